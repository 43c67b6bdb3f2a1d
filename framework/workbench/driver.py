"""One contact of a law, driven by itself: every answer of a law without a specimen comes from here."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked, fits, floats_or_nan
from grainlaw.compiler.batch import CompilationError, Compiled, compile_law
from grainlaw.contact import ContactLaw, declared_stiffness, law_arguments
from grainlaw.fields import ParameterError, checked_number, parameters
from grainlaw.memory import SCALARS, as_floats, only_memory, with_scalars
from grainlaw.messages import refusal, short
from grainlaw.short_form import between, rounded

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure


FARTHEST = 1e6  #: m, beyond it energies overflow
SECONDS = 10.0  #: for all points; a law without an endless loop needs some milliseconds
SIZES = 10.0 ** np.arange(-12, 1, 2)  #: m
DISPLACEMENTS = [0.0, *(sign * 0.927 * size for size in SIZES.tolist() for sign in (1, -1))]
POINTS = [(opening, slip) for opening in DISPLACEMENTS for slip in DISPLACEMENTS]


@attrs.frozen(eq=False)
class Trace(metaclass=Checked):
    """Answer of one contact along a path: arrays of equal length, the memory under its own names."""

    opening: np.ndarray  #: m
    slip: np.ndarray  #: m
    normal: np.ndarray  #: Pa, tension positive
    shear: np.ndarray  #: Pa
    work: np.ndarray  #: J/m2 done on the contact since the first point
    memory: dict[str, np.ndarray]  #: by the names of the law's memory, one value for each point

    @property
    def _facts(self) -> dict[str, str]:
        """Where the path and its tractions lie, the work done, and the memory at the end."""
        if not len(self.opening):
            return {"points": "0"}
        units = {"opening": "m", "slip": "m", "normal": "Pa", "shear": "Pa"}
        ends = {name: between(getattr(self, name), unit) for name, unit in units.items()}
        last = {name: f"{values[-1]:.4g}" for name, values in self.memory.items()}
        return {"points": str(len(self.opening)), **ends, "work": rounded(float(self.work[-1]), "J/m2"), **last}

    def plot(self, *, ax: Any = None) -> Figure:
        """Draw normal traction over opening and shear traction over slip; a mode in which nothing moves is left out.

        Draws into the axes ``ax`` of matplotlib, if they are given. Returns the figure.
        """
        from grainlaw.workbench.law_figure import draw_trace

        return draw_trace(self, ax)

    def __getattr__(self, name: str) -> np.ndarray:
        if not name.startswith("_") and name in self.memory:
            return self.memory[name]
        raise AttributeError(f"a trace has opening, slip, normal, shear, work and {', '.join(self.memory)}; not {name}")


class Contact:
    """A law's answers for one contact, as floats: interpreted, or by the ``compiled`` code that a simulation runs.

    An ArithmeticError or ValueError inside the law becomes nan and its words are kept in ``error``, so that a fault can
    be reported with its place; with ``raises`` it goes through. ``time_step`` (s) passes at each answer.
    """

    def __init__(
        self, law: ContactLaw, *, compiled: bool = False, raises: bool = False, time_step: float = 0.0
    ) -> None:
        self.law, arguments = law, law_arguments(law)
        self.names = only_memory(arguments)
        self.start = (0.0,) * len(self.names)
        self.error = ""
        self._respond = with_scalars(law.traction, arguments, SCALARS | {"time_step": time_step})
        if compiled:
            code = compile_law(law)
            code.tell(time_step=time_step)
            self._respond = code.respond
        self._caught = () if raises else (ArithmeticError, ValueError)

    def step(self, opening: float, slip: float, state: Iterable[float]) -> tuple[float, ...]:
        """Normal, shear (Pa), then the memory. Raises TypeError for another number of results."""
        try:
            answer = self._respond(opening, slip, *state)
        except self._caught as error:
            self.error = f"{type(error).__name__}: {error}"
            return (math.nan,) * (2 + len(self.names))
        return as_floats(self.law, "traction", "normal and shear traction", 2, self.names, answer)

    def run(self, points: Iterable[tuple[float, float]]) -> np.ndarray:
        """Answers (i, 2 + m) of a virgin contact to a sequence of openings and slips (m)."""
        state, rows = self.start, []
        for opening, slip in points:
            answer = self.step(opening, slip, state)
            state = answer[2:]
            rows.append(answer)
        return np.array(rows).reshape(-1, 2 + len(self.names))

    def trace(self, points: Sequence[tuple[float, float]]) -> Trace:
        """The answer of a virgin contact to a sequence of openings and slips (m)."""
        return self.as_trace(points, self.run(points))

    def as_trace(self, points: Sequence[tuple[float, float]], answers: Any) -> Trace:
        """Openings and slips (i, 2) with the answers (i, 2 + m) to them."""
        opening, slip = np.array(points, dtype=float).reshape(-1, 2).T.copy()
        normal, shear, *memory = np.array(answers, dtype=float).reshape(-1, 2 + len(self.names)).T.copy()
        work = work_done((opening, normal), (slip, shear))
        return Trace(opening, slip, normal, shear, work, dict(zip(self.names, memory, strict=True)))


def work_done(*modes: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Work (i,) J/m2 since the first point, by the trapezoidal rule of Eq. (12).

    Each mode is a displacement (i,) m and the traction (i,) Pa along it.
    """
    steps: Any = 0.0
    for displacement, traction in modes:
        steps = steps + (traction[1:] + traction[:-1]) / 2 * np.diff(displacement)
    return np.concatenate([[0.0], np.cumsum(steps)])[: len(modes[0][0])]


def run_together(compiled: Compiled, points: np.ndarray) -> np.ndarray:
    """Answers (path, i, 2 + m) of machine code to ``points`` (path, i, 2) m, a virgin contact for each path.

    All contacts answer in one call, as in a simulation.
    """
    paths, length, _ = points.shape
    answers = np.empty((paths, length, 2 + len(compiled.memory)))
    memory = np.zeros((max(len(compiled.memory), 1), paths))
    for i in range(length):
        answers[:, i, 0], answers[:, i, 1] = compiled.batch(points[:, i, 0], points[:, i, 1], memory)
        answers[:, i, 2:] = memory[: len(compiled.memory)].T
    return answers


def refuse_endless(law: ContactLaw, compiled: Compiled | None = None) -> None:
    """Raise :class:`ParameterError`, with opening and slip, for a law that does not return; ask those with a loop only.

    The compiled code is asked, in a thread that is left behind if it does not return.
    """
    if compiled is None:
        try:
            compiled = compile_law(law)
        except CompilationError:  # it is told elsewhere what cannot be compiled
            return
    if not compiled.loops:
        return
    asked: list[tuple[float, float]] = []
    thread = threading.Thread(target=_ask, args=(compiled, asked), daemon=True)
    thread.start()
    thread.join(SECONDS)
    if thread.is_alive():
        opening, slip = asked[-1]
        raise ParameterError(
            f"{type(law).__name__}: at opening {opening:.4g} m, slip {slip:.4g} m the law did not return within "
            f"{SECONDS:g} s: a loop in its code does not end"
        )


def _ask(compiled: Compiled, asked: list[tuple[float, float]]) -> None:
    """Each point from a virgin contact, and all of them one after the other."""
    path = np.zeros((max(len(compiled.memory), 1), 1))
    for point in POINTS:
        asked.append(point)
        for memory in (np.zeros_like(path), path):
            compiled.call(np.array([point[0]]), np.array([point[1]]), memory)


def alone(law: Any) -> Contact:
    """One contact of a law. Raises ParameterError for what is no law, and where its numbers are not single ones."""
    if not isinstance(law, ContactLaw) or not attrs.has(type(law)):
        raise ParameterError(f"this takes an instance of an attrs class that is a gl.ContactLaw, not {short(law)}")
    _refuse_arrays(law)
    declared = declared_stiffness(law)
    if not fits(declared, tuple[float, float]):
        raise refusal(f"{type(law).__name__}.stiffness", declared, "two positive numbers (Pa/m)")
    refuse_endless(law)
    return Contact(law)


def _refuse_arrays(law: ContactLaw) -> None:
    if any(isinstance(value, list) for value in parameters(law).values()):
        name = type(law).__name__
        raise ParameterError(f"{name}: give the law of one contact, and give single numbers instead of arrays")


@checked
def trace(law: ContactLaw, opening: Any, slip: Any, *, compiled: bool = False, time_step: float = 0.0) -> Trace:
    """Drive one contact alone along arrays of ``opening`` and ``slip`` (m; either may be a single number).

    For a law that knows time, ``time_step`` (s) passes from point to point; at 0 no time passes.
    Interpreted, or through the ``compiled`` code a simulation runs; both agree to 1e-12. Raises TypeError for a law
    that returns anything but its two tractions and its memory, ParameterError for arrays that are no path.
    """
    _refuse_arrays(law)
    ends = _path("opening", opening), _path("slip", slip)
    if any(end.ndim > 1 for end in ends) or len({end.size for end in ends if end.size != 1}) > 1:
        raise ParameterError(
            f"trace: opening of shape {ends[0].shape} and slip of shape {ends[1].shape} are not allowed, they must be "
            "numbers or (i,) arrays of equal length"
        )
    checked_number("trace: time_step", time_step, "s", at_least=0)
    if compiled:
        refuse_endless(law)  # what is interpreted can be interrupted
    points = np.stack(np.broadcast_arrays(*map(np.atleast_1d, ends)), axis=1)
    return Contact(law, compiled=compiled, raises=True, time_step=time_step).trace(points.tolist())


def _path(name: str, value: Any) -> np.ndarray:
    path = floats_or_nan(value)
    if not (np.abs(path) <= FARTHEST).all():
        raise refusal(f"trace: {name}", value, f"a number of at most {FARTHEST:g} m or an array of them")
    return path
