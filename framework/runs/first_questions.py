"""Checks of a law before its first run: the same compiled as interpreted, and no stiffer than it declares."""

from __future__ import annotations

import functools

import numpy as np

from grainlaw.compiler.batch import Compiled
from grainlaw.contact import ContactLaw
from grainlaw.engine.model import Model
from grainlaw.fields import ParameterError
from grainlaw.workbench.driver import Contact, refuse_endless, run_together

ROUNDING = 1e-12
LEFT_OVER = 1e-9  #: rounding of memory, which may be a small difference of larger numbers
STIFFER = 1.05  #: times the declared stiffness, at most: the safety of time steps allows for it
DISPLACEMENTS = 0.927 * np.geomspace(1e-12, 1e-2, 41)  #: m; round numbers are where laws change branches
PRESSURES = (1e5, 1e7, 1e8)  #: Pa, under which a contact is sheared
HIGHEST = 1e9  #: Pa, by the declared stiffness: larger closures are not tried

_answered: set[tuple] = set()  #: laws that have passed: everything that the answers depend on


def ask_first_questions(model: Model) -> None:
    """Raise :class:`ParameterError` for a law that gives wrong runs; done once for each law with its parameters.

    The law is evaluated along short paths of one contact, interpreted and compiled: the tractions must be equal and
    finite, and must not grow faster with opening and slip than the declared stiffness. Where parameters differ from
    contact to contact, their means are used. Raises CompilationError too.
    """
    for one in model.each:
        law, compiled = one.law, one.compiled
        key = compiled.key, compiled.numbers.tobytes(), tuple(map(float, law.stiffness))
        if key not in _answered:
            refuse_endless(law, compiled)
            with np.errstate(all="ignore"):
                _Questions(law, compiled).ask()
            _answered.add(key)


def _paths(kn: float) -> dict[str, np.ndarray]:
    """Paths (i, 2) of opening and slip, of equal length, each from a virgin contact."""
    u, none = np.concatenate([[0.0], DISPLACEMENTS]), np.zeros(len(DISPLACEMENTS) + 1)
    closed = np.minimum(u, HIGHEST / kn)
    turn = np.arange(len(u)) % 4
    to, fro = u * np.array([1.0, 0.3, 0.0, 0.6])[turn], u * np.array([0.5, -1.0, 0.8, 0.1])[turn]
    pulled_first = np.full(len(u), -min(PRESSURES[1] / kn, u[-1]))
    pulled_first[:2] = 0.0, u[-1]
    columns = {
        "opening": (u, none), "slip": (none, u), "slip back": (none, -u), "opening and slip": (u, u),
        "closing": (-closed, none), "to and fro": (to - np.where(turn == 2, closed, 0.0), fro),
        "slip when broken": (pulled_first, u),
    }  # fmt: skip
    columns |= {f"slip under {p:g} Pa": (np.full(len(u), -min(p / kn, u[-1])), u) for p in PRESSURES}
    return {name: np.stack(column, axis=1) for name, column in columns.items()}


class _Questions:
    """Paths, and the tractions along them interpreted and compiled."""

    def __init__(self, law: ContactLaw, compiled: Compiled) -> None:
        self.law, self.contact, self._code = law, Contact(law), compiled
        paths = _paths(float(law.stiffness[0]))
        self.names = list(paths)
        self.points = np.stack(list(paths.values()))  #: (path, i, 2)
        self.interpreted = np.stack([self.contact.run(path.tolist()) for path in self.points])  #: (path, i, 2 + m)

    @functools.cached_property
    def compiled(self) -> np.ndarray:
        """The same compiled."""
        return run_together(self._code, self.points)

    def ask(self) -> None:
        self._finite(self.interpreted, "interpreted")  # first: what fails in compiled code can only be printed
        self._finite(self.compiled, "compiled")
        self._equal()
        for name, mode in (("opening", 0), ("slip", 1), *((name, 1) for name in self.names if "under" in name)):
            self._not_stiffer(self.names.index(name), mode)

    def _refuse(self, path: int, i: int, what: str) -> None:
        opening, slip = self.points[path, i]
        raise ParameterError(
            f"{type(self.law).__name__}: at opening {opening:.4g} m, slip {slip:.4g} m {what}; "
            "gl.check_law(law) tells more"
        )

    def _label(self, column: int) -> str:
        return ("normal traction", "shear traction", *self.contact.names)[column]

    def _finite(self, answers: np.ndarray, how: str) -> None:
        bad = np.argwhere(~np.isfinite(answers))
        if len(bad):
            path, i, column = bad[0].tolist()
            why = f" ({self.contact.error})" if self.contact.error and how == "interpreted" else ""
            value = answers[path, i, column]
            self._refuse(path, i, f"the {self._label(column)} is {value} {how}{why}, it must be finite")

    def _equal(self) -> None:
        here = self.interpreted
        scale = np.maximum.accumulate(np.abs(here), axis=1)
        scale[..., :2] += (np.abs(self.points) * self.law.stiffness).sum(axis=2)[..., None]
        scale[..., 2:] += np.abs(self.points).sum(axis=2)[..., None]
        scale *= np.where(np.arange(here.shape[2]) < 2, ROUNDING, LEFT_OVER)
        wrong = np.argwhere(np.abs(self.compiled - here) > scale)
        if len(wrong):
            path, i, column = wrong[0].tolist()
            both = f"{self.compiled[path, i, column]:.15g} compiled, {here[path, i, column]:.15g} interpreted"
            self._refuse(path, i, f"the {self._label(column)} is {both}, they must be equal")

    def _not_stiffer(self, path: int, mode: int) -> None:
        moved, traction = np.diff(self.points[path, :, mode]), self.interpreted[path, :, mode]
        allowed = STIFFER * self.law.stiffness[mode]
        rounding = ROUNDING * np.maximum.accumulate(np.abs(traction))[1:]
        stiffer = np.flatnonzero(np.diff(traction) > allowed * moved + rounding)
        if len(stiffer):
            i, kind = int(stiffer[0]), ("normal", "shear")[mode]
            tangent = float(np.diff(traction)[i] / moved[i])
            text = f"the {kind} traction grows by {tangent:.4g} Pa/m, more than {STIFFER:g} times the"
            self._refuse(path, i + 1, f"{text} {self.law.stiffness[mode]:.4g} Pa/m of its stiffness")
