"""The region that grains fill: a polygon whose sides name their boundaries."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, fits, floats
from grainlaw.fields import ParameterError, checked_field
from grainlaw.messages import refusal
from grainlaw.polygon import areas_and_centroids, cross, crossing_sides, enclosed, following, ring_area

SMALLEST, LARGEST = 1e-18, 1e12  #: m: beyond them products of lengths lose digits
SLENDEREST = 1e4  #: length over width
ROUNDING = 1e-9  #: of a length: nearer than this to a side is on the side, flatter than this is straight


def _names(where: str, names: Any) -> tuple[str, ...]:
    if not fits(names, Sequence[str]):
        raise refusal(where, names, "a list of names")
    return tuple(names)


def _rings(rings: Iterable[Any]) -> tuple[np.ndarray, ...]:
    try:
        made = tuple(floats(ring) for ring in rings)
    except (TypeError, ValueError):
        raise ParameterError("Region: holes must be arrays of float") from None
    if not all(ring.ndim for ring in made):
        raise refusal("Region: holes", rings, "a list with the corners (n, 2) m of each hole")
    for ring in made:
        ring.flags.writeable = False
    return made


def _ring_names(rings: Iterable[Iterable[str]]) -> tuple[tuple[str, ...], ...]:
    if not fits(rings, Sequence[Sequence[str]]):
        raise refusal("Region: hole_sides", rings, "a list of names for each hole")
    return tuple(tuple(names) for names in rings)


def array_field(kind: type) -> Any:
    """A field that keeps a read-only array."""

    def check(where: str, values: Any) -> np.ndarray:
        try:
            given = np.array(values)
            if given.dtype.kind == "b" and kind is not bool:
                raise TypeError
            array: np.ndarray = given.astype(kind, casting="same_kind")
        except (TypeError, ValueError):
            array = np.array(0)
        if not array.ndim:
            raise refusal(where, values, f"an array of {kind.__name__}")
        array.flags.writeable = False
        return array

    return checked_field(check)


@attrs.frozen(eq=False)
class Region(metaclass=Checked):
    """A simple polygon, perhaps with holes, to be filled with grains; every side names the boundary it belongs to.

    Several sides may share a name. The sides of the outline and then those of the holes have the index letter ``k``.
    Raises :class:`~grainlaw.fields.ParameterError`.
    """

    outline: np.ndarray = array_field(float)  #: (n, 2) m, counter-clockwise
    sides: tuple[str, ...] = checked_field(_names)  #: name of the side from corner k to corner k + 1
    holes: tuple[np.ndarray, ...] = attrs.field(default=(), converter=_rings)  #: (n, 2) m each, clockwise
    hole_sides: tuple[tuple[str, ...], ...] = attrs.field(converter=_ring_names)  #: as ``sides``; "hole" unless given

    @hole_sides.default
    def _hole(self) -> tuple[tuple[str, ...], ...]:
        return tuple(("hole",) * len(hole) for hole in self.holes)

    def __attrs_post_init__(self) -> None:
        fault = self._fault()
        if fault:
            raise ParameterError(f"Region: {fault}")

    def _fault(self) -> str | None:
        if len(self.hole_sides) != len(self.holes):
            return f"hole_sides has {len(self.hole_sides)} entries for {len(self.holes)} holes"
        named = ["outline", *(f"hole {number}" for number in range(len(self.holes)))]
        rings = list(zip(named, (self.outline, *self.holes), (self.sides, *self.hole_sides), strict=True))
        for name, ring, names in rings:
            fault = _ring_fault(name, ring, names)
            if fault:
                return fault
        first = np.cumsum([0] + [len(ring) for _, ring, _ in rings])
        crossing = crossing_sides(self.start, self.end, self.after)
        if crossing:
            one, other = np.searchsorted(first, crossing, side="right") - 1
            k, m = crossing[0] - first[one], crossing[1] - first[other]
            if one == other:
                return f"{named[one]} crosses or touches itself at its sides {k} and {m}"
            return f"{named[other]} crosses or touches {named[one]}, its side {m} meets side {k}"
        for turn, (name, ring, _) in enumerate(rings):
            if turn == 0 and ring_area(ring) <= 0:
                return f"{name} runs clockwise, its corners must be given counter-clockwise"
            if turn > 0 and ring_area(ring) >= 0:
                return f"{name} runs counter-clockwise, the corners of a hole must be given clockwise"
        for number, hole in enumerate(self.holes):
            others = np.r_[0 : first[number + 1], first[number + 2] : len(self.start)]
            if not enclosed(hole[:1], self.start[others], self.end[others])[0]:
                return f"hole {number} must lie inside the outline and outside the other holes"
        return None

    @cached_property
    def start(self) -> np.ndarray:
        """(k, 2) m, where each side begins; the region is on its left."""
        return np.concatenate([self.outline, *self.holes])

    @cached_property
    def end(self) -> np.ndarray:
        """(k, 2) m, where each side ends."""
        return self.start[self.after]

    @cached_property
    def after(self) -> np.ndarray:
        """(k,) the side that follows each side."""
        return following(np.cumsum([0, len(self.outline), *map(len, self.holes)]))

    @property
    def names(self) -> tuple[str, ...]:
        """(k,) name of the boundary of each side."""
        return self.sides + tuple(name for names in self.hole_sides for name in names)

    @cached_property
    def area(self) -> float:
        """m2, without the holes."""
        first = np.cumsum([0, len(self.outline), *map(len, self.holes)])
        return float(areas_and_centroids(self.start, first)[0].sum())

    @cached_property
    def bounds(self) -> np.ndarray:
        """(2, 2) m: the lower left and the upper right corner of the box round the region."""
        return np.array([self.outline.min(axis=0), self.outline.max(axis=0)])

    @property
    def boundary_names(self) -> tuple[str, ...]:
        """Names of the sides, each once, in the order of the outline and the holes."""
        return tuple(dict.fromkeys(self.names))

    def contains(self, points: np.ndarray) -> np.ndarray:
        """(n,) whether points (n, 2) m lie inside; on a side either."""
        return enclosed(points, self.start, self.end)

    def side_at(self, ends: np.ndarray) -> np.ndarray:
        """(b,) the first side on which an edge with these ends (b, 2, 2) m lies; -1 without."""
        found = [self._side_at(block) for block in np.array_split(ends, 1 + len(ends) * len(self.start) // 1_000_000)]
        return np.concatenate(found)

    def _side_at(self, ends: np.ndarray) -> np.ndarray:
        along = self.end - self.start
        length = np.hypot(*along.T)
        offset = ends[:, :, None] - self.start
        reach = ROUNDING * length.max()
        share = (offset * along).sum(axis=-1) / length
        on = (abs(cross(along, offset)) <= reach * length) & (share >= -reach) & (share <= length + reach)
        both = on.all(axis=1)
        return np.where(both.any(axis=1), both.argmax(axis=1), -1)


def _ring_fault(name: str, ring: np.ndarray, names: tuple[str, ...]) -> str | None:
    if ring.ndim != 2 or ring.shape[1] != 2 or len(ring) < 3:
        return f"{name} has the shape {ring.shape}, it must be (n, 2) with at least 3 corners"
    if not np.isfinite(ring).all():
        return f"{name} has a corner that is not finite"
    small, large = sorted(np.ptp(ring, axis=0).tolist())
    if large > LARGEST or small < SMALLEST or np.abs(ring).max() > LARGEST:
        allowed = f"{SMALLEST:g} to {LARGEST:g} m, and no farther than that from zero"
        return f"{name} is {large:g} m long and {small:g} m wide, it must be {allowed}"
    if large > SLENDEREST * small:
        return f"{name} is {large / small:.2g} times as long as wide, it must be at most {SLENDEREST:g} times"
    if len(names) != len(ring):
        kind = "sides" if name == "outline" else f"hole_sides of {name}"
        return f"{kind} has {len(names)} names for {len(ring)} sides of the {name}"
    if not all(isinstance(each, str) and each for each in names):
        return f"sides = {names} must be names"
    return None
