"""Probes: single contact points followed through a run, to see why a bond broke or did not."""

from __future__ import annotations

import operator
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, fits
from grainlaw.contact import ContactLaw, memory_names
from grainlaw.engine.model import uniform
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError, checked_points, whole_number
from grainlaw.messages import refusal
from grainlaw.observation import Observer
from grainlaw.stage import Stage
from grainlaw.workbench.bench import words
from grainlaw.workbench.characteristics import QUICK, shear_mode, tensile_mode
from grainlaw.workbench.driver import alone

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure

QUANTITIES = ("opening", "slip", "normal", "shear", "damage")


def _end(path: ContactPath) -> str:
    at = min(path.unbroken, len(path.time) - 1)
    where = f"opening {words(path.opening[at], 'm')}, slip {words(path.slip[at], 'm')}"
    if path.unbroken < len(path.time):
        mode = "in tension" if path.mode < 0.5 else "in shear"
        return f"broke at {path.broken:.4g} s {mode} (share of shear {path.mode:.2f}), {where}"
    counted = "damage" in memory_names(path.law)
    return f"did not break, {f'damage {path.damage[-1]:.3g}, ' if counted else ''}{where}"


def _tension(path: ContactPath) -> str:
    highest = float(path.normal[: max(path.unbroken, 1)].max())
    if highest <= 0:
        return "never in tension"
    with np.errstate(all="ignore"):
        strength = tensile_mode(alone(path.law), QUICK).peak
    return f"peak tension {_of(highest, strength)}"


def _shear(path: ContactPath) -> str:
    i = int(np.argmax(np.abs(path.shear[: max(path.unbroken, 1)])))
    normal, shear = float(path.normal[i]), float(abs(path.shear[i]))
    with np.errstate(all="ignore"):
        strength = shear_mode(alone(path.law), -normal, QUICK).peak
    sign = "a tension" if normal > 0 else "a pressure"
    return f"peak shear {_of(shear, strength)} under {sign} of {words(abs(normal), 'Pa')}"


def _of(value: float, strength: float) -> str:
    return words(value, "Pa") if np.isnan(strength) else f"{value * 1e-6:.4g} of {words(strength, 'Pa')}"


@attrs.frozen(kw_only=True, eq=False)
class ContactPath(metaclass=Checked):
    """Opening, slip and tractions of one contact point at all samples; prints as one line that says how it broke."""

    point: int  #: its number ``p``
    grains: tuple[int, int]  #: numbers of its two grains
    position: np.ndarray  #: (2,) m, at the first sample
    law: ContactLaw  #: law of its pair of phases, with the parameters of this point
    time: np.ndarray  #: (i,) s
    opening: np.ndarray  #: (i,) m
    slip: np.ndarray  #: (i,) m
    normal: np.ndarray  #: (i,) Pa, tension positive
    shear: np.ndarray  #: (i,) Pa
    damage: np.ndarray  #: (i,) 0 where the law counts none
    broken: float  #: s, to within one sample; nan where it did not break
    mode: float  #: share of shear when it broke, or nan

    @property
    def unbroken(self) -> int:
        """Number of samples before the point broke."""
        return len(self.time) if np.isnan(self.broken) else int(np.searchsorted(self.time, self.broken * (1 - 1e-12)))

    def __str__(self) -> str:
        """The contact, whether and how it broke, and its highest tractions at samples before with its strengths."""
        x, y = self.position * 1e3
        a, b = self.grains
        who = f"contact {self.point} between grains {a} and {b} at ({x:.1f}, {y:.1f}) mm"
        return f"{who}: {_end(self)}; {_tension(self)}, {_shear(self)}"

    def plot(self) -> Figure:
        """Draw the path together with the curves of its law, and with its strength."""
        from grainlaw.results.figures.probe import plot_paths

        return plot_paths([self])


def _places(value: Any) -> np.ndarray:
    return checked_points("Probe: places", value) if not fits(value, Sequence) or len(value) else np.zeros((0, 2))


def _points(value: Any) -> tuple[int, ...]:
    if not fits(value, Sequence[int]):
        raise refusal("Probe: points", value, "a list of numbers of contact points")
    return tuple(map(int, value))


@attrs.define(eq=False, kw_only=True)
class Probe(Observer):
    """Follows contact points: by number, those nearest to places, and the first to break.

    ``paths`` has one :class:`ContactPath` for each, in this order. Which points break first is not known in advance:
    until they have broken every point is kept, with 20 bytes per point and sample (755 grains, 1,000 samples: 90 MB).
    A probe that is used in another run begins a new record.
    """

    points: tuple[int, ...] = attrs.field(default=(), converter=_points)  #: numbers of contact points
    places: np.ndarray = attrs.field(default=(), converter=_places)  #: (k, 2) m
    first: int = whole_number(default=0, at_least=0)  #: how many that break first
    _run: _Run | None = attrs.field(default=None, init=False)

    def __attrs_post_init__(self) -> None:
        if not (self.points or len(self.places) or self.first):
            raise ParameterError("Probe: give points, places or first, or there is nothing to follow")

    def observe(self, state: State, curves: Mapping[str, np.ndarray], stage: Stage, progress: float) -> None:
        if self._run is None or self._run.broken_time is not state.broken_time:
            self._run = _Run(self, state)
        self._run.record(state)

    def save(self) -> dict[str, np.ndarray]:
        """The record so far."""
        run = self._run
        if run is None:
            return {}
        rows = np.array(run.rows) if run.rows else np.zeros((0, len(QUANTITIES), len(run.kept)), dtype=np.float32)
        return {"times": np.array(run.times), "rows": rows, "kept": run.kept, "positions": run.positions}

    def restore(self, state: State, saved: Mapping[str, np.ndarray]) -> None:
        """Go on with a record."""
        if saved:
            self._run = run = _Run(self, state)
            run.times, run.rows = saved["times"].tolist(), list(saved["rows"])
            run.kept, run.positions = saved["kept"], saved["positions"]
            run.named = run.named_at(self, run.positions)

    @property
    def paths(self) -> list[ContactPath]:
        """The paths recorded so far."""
        return self._run.paths() if self._run else []

    def __str__(self) -> str:
        return "\n".join(map(str, self.paths)) or "nothing was followed"

    def plot(self) -> Figure:
        """Draw every path in a row, together with the curves of its law, and with its strength."""
        from grainlaw.results.figures.probe import plot_paths

        return plot_paths(self.paths)


class _Run:
    """The record of one run."""

    def __init__(self, probe: Probe, state: State) -> None:
        count = len(state.broken_time)
        wrong = [point for point in probe.points if not 0 <= point < count]
        if wrong:
            raise ParameterError(f"Probe: there is no contact point {wrong[0]}, they go from 0 to {count - 1}")
        self.positions = state.contact_positions
        near, _ = state.specimen.vicinity
        for place in probe.places:
            if (away := np.hypot(*(self.positions - place).T).min(initial=np.inf)) > near:
                raise ParameterError(
                    f"Probe: places: ({place[0]:g}, {place[1]:g}) m is outside of the specimen: the nearest contact "
                    f"point is {away:.3g} m away, more than two grains, {near:.3g} m"
                )
        self.named, self.first = self.named_at(probe, self.positions), probe.first
        self.breaks = state.breaks
        self.broken_time, self.broken_mode = state.broken_time, state.broken_mode  # arrays that the engine fills
        self.grains = state.mesh.interface_grains[state.bonds.order]
        self.groups = [(group.law, group.first, group.last) for group in state.bonds.groups]
        self.kept = np.arange(count) if self.first else self._chosen()
        self.times: list[float] = []
        self.rows: list[np.ndarray] = []  #: (q, kept)

    @staticmethod
    def named_at(probe: Probe, positions: np.ndarray) -> list[int]:
        """Points that a probe names, by number and by place."""
        nearest = [int(np.argmin(np.hypot(*(positions - place).T))) for place in probe.places]
        return [*probe.points, *nearest]

    def _chosen(self) -> np.ndarray:
        """Numbers of the points to follow, each once: those named, and the first that have broken."""
        first = self.breaks.in_order()[: self.first]
        return np.array(list(dict.fromkeys([*self.named, *first.tolist()])), dtype=int)

    def record(self, state: State) -> None:
        values = (state.opening, state.slip, state.normal, state.shear, state.memory("damage"))
        self.times.append(state.time)
        self.rows.append(np.array([value[self.kept] for value in values], dtype=np.float32))
        all_kept = len(self.kept) == len(self.broken_time)
        if self.first and all_kept and np.count_nonzero(~np.isnan(self.broken_time)) >= self.first:
            chosen = self._chosen()
            self.rows = [row[:, chosen] for row in self.rows]
            self.kept = chosen

    def paths(self) -> list[ContactPath]:
        chosen = self._chosen()
        column = {int(point): k for k, point in enumerate(self.kept)}
        table = np.stack([row[:, [column[p] for p in chosen.tolist()]] for row in self.rows]).astype(float)
        time = np.array(self.times)
        return [self._path(int(point), time, table[:, :, k]) for k, point in enumerate(chosen)]

    def _path(self, point: int, time: np.ndarray, table: np.ndarray) -> ContactPath:
        interfaces = len(self.grains)
        second, interface = divmod(point, interfaces)
        law, begin, end = next(group for group in self.groups if group[1] <= interface < group[2])
        a, b = self.grains[interface].tolist()
        return ContactPath(
            point=point, grains=(a, b), position=self.positions[point].copy(), time=time,
            law=uniform(law, operator.itemgetter(interface - begin + second * (end - begin))),
            broken=float(self.broken_time[point]), mode=float(self.broken_mode[point]),
            **dict(zip(QUANTITIES, table.T, strict=True)),
        )  # fmt: skip
