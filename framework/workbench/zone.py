"""One zone of a material, driven by itself: every answer of a material without a specimen comes from here."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import attrs
import numpy as np
import scipy

from grainlaw.arguments import Checked, checked, floats_or_nan
from grainlaw.compiler.batch import compile_material
from grainlaw.fields import ParameterError, checked_number, parameters
from grainlaw.material import Material, material_arguments, material_memory, stiffness_of
from grainlaw.memory import ROOM, SCALARS, as_floats, with_scalars
from grainlaw.messages import refusal, short
from grainlaw.workbench.driver import work_done

Strain = Sequence[float]  #: exx, eyy, exy
CONFINING = 10  #: increments in which the confinement of a path rises


@attrs.frozen(eq=False)
class MaterialTrace(metaclass=Checked):
    """Answer of one zone along a path: arrays of equal length, the memory under its own names."""

    strain: np.ndarray  #: (i, 3) xx, yy, xy
    stress: np.ndarray  #: (i, 3) Pa, xx, yy, xy, tension positive
    work: np.ndarray  #: (i,) J/m3 done on the zone since the first point
    stored: np.ndarray  #: (i,) J/m3 of it that unloading gives back
    memory: dict[str, np.ndarray]  #: by the names of the material's memory, one value for each point

    def __getattr__(self, name: str) -> np.ndarray:
        if not name.startswith("_") and name in self.memory:
            return self.memory[name]
        raise AttributeError(f"a trace has strain, stress, work, stored and {', '.join(self.memory)}; not {name}")


class Zone:
    """A material's answers for one zone, as floats: interpreted, or by the ``compiled`` code that a simulation runs.

    An ArithmeticError or ValueError inside the material becomes nan and its words are kept in ``error``; with
    ``raises`` it goes through. Strains are counted from ``origin``, zero at first.
    """

    def __init__(
        self, material: Material, *, compiled: bool = False, raises: bool = False, temperature: float = ROOM
    ) -> None:
        self.material, self.names, self.error = material, material_memory(material), ""
        self.start = (0.0,) * len(self.names)
        self.stiffness = stiffness_of(material)[0]  #: (3, 3) Pa over exx, eyy and the shear angle
        self.origin = (0.0, 0.0, 0.0)  #: strain xx, yy, xy
        at = SCALARS | {"temperature": temperature}
        self._stress: Callable[..., Any] = with_scalars(material.stress, material_arguments(material), at)
        self._energy: Callable[..., Any] = with_scalars(material.energy, material_arguments(material, "energy"), at)
        if compiled:
            codes = compile_material(material)
            for code in codes:
                code.tell(temperature=temperature)
            self._stress, self._energy = (code.respond for code in codes)
        self._compiled = compiled
        self._caught = () if raises else (ArithmeticError, ValueError)

    def step(self, strain: Strain, state: Iterable[float]) -> tuple[float, ...]:
        """Stress xx, yy, xy (Pa), then the memory. Raises TypeError for another number of results."""
        try:
            answer = self._stress(*self._from_origin(strain), *state)
        except self._caught as error:
            self.error = f"{type(error).__name__}: {error}"
            return (math.nan,) * (3 + len(self.names))
        return as_floats(self.material, "stress", "stress xx, yy and xy", 3, self.names, answer)

    def energy(self, strain: Strain, state: Iterable[float]) -> float:
        """J/m3 stored at a strain, with the memory that ``step`` returned there. Raises TypeError for no number."""
        try:
            answer: Any = self._energy(*self._from_origin(strain), *state)
        except self._caught as error:
            self.error = f"{type(error).__name__}: {error}"
            return math.nan
        try:
            return float(answer[0] if self._compiled else answer)
        except TypeError:
            name = type(self.material).__name__
            raise TypeError(f"{name}.energy must return a number (J/m3), not {short(answer)}") from None

    def _from_origin(self, strain: Strain) -> Strain:
        return [own + more for own, more in zip(self.origin, strain, strict=True)] if any(self.origin) else strain

    def run(self, points: Iterable[Strain]) -> np.ndarray:
        """Answers (i, 4 + m), stress, stored energy and memory, of a virgin zone to a sequence of strains."""
        state, rows = self.start, []
        for strain in points:
            answer = self.step(strain, state)
            state = answer[3:]
            rows.append((*answer[:3], self.energy(strain, state), *state))
        return np.array(rows, dtype=float).reshape(-1, 4 + len(self.names))

    def trace(self, points: Any) -> MaterialTrace:
        """The answer of a virgin zone to strains (i, 3)."""
        strain = np.asarray(points, dtype=float).reshape(-1, 3)
        return self.as_trace(strain, self.run(strain.tolist()))

    def as_trace(self, strain: np.ndarray, answers: np.ndarray) -> MaterialTrace:
        """Strains (i, 3) with the answers (i, 4 + m) to them."""
        memory = dict(zip(self.names, answers[:, 4:].T.copy(), strict=True))
        stress = answers[:, :3].copy()
        work = work_done(*zip(strain.T, (stress * [1.0, 1.0, 2.0]).T, strict=True))
        return MaterialTrace(strain, stress, work, answers[:, 3].copy(), memory)


def alone_material(material: Any) -> Zone:
    """One zone of a material. Raises ParameterError for what is none, and where its numbers are not single ones."""
    if not isinstance(material, Material) or not attrs.has(type(material)):
        raise ParameterError(f"this takes an instance of an attrs class that is a gl.Material, not {short(material)}")
    if any(isinstance(value, list) for value in parameters(material).values()):
        name = type(material).__name__
        raise ParameterError(f"{name}: give the material of one grain, and give single numbers instead of arrays")
    return Zone(material)


@checked
def trace_material(material: Material, exx: Any, eyy: Any, exy: Any, *, compiled: bool = False) -> MaterialTrace:
    """Drive one zone alone along arrays of strain (i,); each may be a single number.

    Interpreted, or through the ``compiled`` code a simulation runs. Raises ParameterError for arrays that are no path.
    """
    alone_material(material)
    try:
        rows = np.array(np.broadcast_arrays(*(np.atleast_1d(floats_or_nan(row)) for row in (exx, eyy, exy))))
    except ValueError:
        rows = np.full((3, 1), np.nan)
    if rows.ndim != 2 or not np.isfinite(rows).all():
        raise refusal("trace_material: strain", (exx, eyy, exy), "three numbers or (i,) arrays of equal length, finite")
    return Zone(material, compiled=compiled, raises=True).trace(rows.T)


@checked
def compress(material: Material, strain: Any, *, confinement: float = 0.0) -> MaterialTrace:
    """Compress one zone along y in plane strain, under a confinement (Pa) along x that is held.

    ``strain`` (i,) is the shortening since the confinement; negative values pull. The trace begins under the
    confinement alone. There is no shear stress in the axes. Raises ParameterError where no strain keeps the
    confinement.
    """
    zone = alone_material(material)
    checked_number("compress: confinement", confinement, "Pa")
    path = np.atleast_1d(floats_or_nan(strain))
    if path.ndim != 1 or not path.size or not (np.abs(path) <= 1).all():
        raise refusal("compress: strain", strain, "a number from -1 to 1 or a (i,) array of them")
    state, now = zone.start, np.zeros(3)
    for share in np.arange(1, CONFINING + 1) / CONFINING:
        now = kept(zone, state, now, np.array([-confinement, -confinement, 0.0]) * share, None)
        state = zone.step(now.tolist(), state)[3:]
    start, rows, answers = now[1], [], []
    for shortening in path.tolist():
        now = kept(zone, state, now, np.array([-confinement, 0.0, 0.0]), start - shortening)
        answer = zone.step(now.tolist(), state)
        state = answer[3:]
        rows.append(now)
        answers.append([*answer[:3], zone.energy(now.tolist(), state), *state])
    trace = zone.as_trace(np.array(rows), np.array(answers))
    return attrs.evolve(trace, work=trace.work + answers[0][3])


def kept(zone: Zone, state: tuple[float, ...], near: np.ndarray, stress: np.ndarray, eyy: float | None) -> np.ndarray:
    """The strain near another at which a zone has a stress (3,) Pa; with ``eyy`` given, the stress yy is free."""
    free = [0, 1, 2] if eyy is None else [0, 2]
    size = float(zone.stiffness[0, 0])
    unit = np.linalg.inv(zone.stiffness[np.ix_(free, free)])[0, 0] * max(float(np.abs(stress).max()), 1e-6 * size)

    def at(values: np.ndarray) -> np.ndarray:
        strain = near.copy()
        strain[free] = near[free] + unit * values
        if eyy is not None:
            strain[1] = eyy
        return strain

    def apart(values: np.ndarray) -> np.ndarray:
        found = np.array(zone.step(at(values).tolist(), state)[:3])
        return (found - stress)[free] / (unit * size)

    # Newton's method may fail where the zone yields within the step; the elastic stiffness always leads there, slowly.
    values, elastic = np.zeros(len(free)), np.linalg.inv(zone.stiffness[np.ix_(free, free)]) * size
    for attempt in range(3):
        for _ in range((0, 20, 2000)[attempt]):
            values = values - elastic @ apart(values)
        values = values if attempt == 2 else scipy.optimize.root(apart, values, tol=1e-12).x
        if np.abs(apart(values)).max() < 1e-6:
            break
    else:
        raise ParameterError(
            f"compress: {type(zone.material).__name__} cannot keep the stress {stress[0]:.4g} Pa along x"
            + ("" if eyy is None else f" at a strain of {eyy:.4g} along y")
        )
    return at(values)
