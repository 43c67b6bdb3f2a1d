"""Grains as data: the polygons that fill a region, and the interface of what makes them."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, fits, wanted
from grainlaw.messages import refusal
from grainlaw.polygon import areas_and_centroids, boxes, cross, following, near_sides, overlaps
from grainlaw.region import ROUNDING, Region, array_field
from grainlaw.short_form import rounded

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure

LOOSE = "grains"  #: the boundary of all sides that loose grains have inside their region
BETWEEN, INSIDE = "between", "inside"  #: kinds of edges: between two grains, and between cells of one


@attrs.frozen(eq=False)
class Edges:
    """All edges of a tessellation, each once; index letter ``e``."""

    start: np.ndarray  #: (e,) vertex; start to end runs counter-clockwise round the left grain
    end: np.ndarray  #: (e,) vertex
    left: np.ndarray  #: (e,) grain
    right: np.ndarray  #: (e,) grain, -1 on the boundary
    side: np.ndarray  #: (e,) number into ``boundary_names``, -1 inside (and where no side of the region is)
    kind: np.ndarray  #: (e,) number into the tessellation's ``kinds``: between two grains, inside of one, or a joint
    left_corners: np.ndarray  #: (e, 2) positions in ``corners`` of start and end, in the left grain
    right_corners: np.ndarray  #: (e, 2) positions in ``corners`` of start and end, in the right grain; -1 without
    length: np.ndarray  #: (e,) m
    boundary_names: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.start)

    @property
    def of_corners(self) -> np.ndarray:
        """(k,) number, from 1, of the edge from each corner of the grains; below 0 where it runs the other way."""
        number = np.zeros(2 * len(self) - int(np.sum(self.right < 0)), dtype=int)
        inner, counted = self.right >= 0, np.arange(1, len(self) + 1)
        number[self.left_corners[:, 0]] = counted
        number[self.right_corners[inner, 1]] = -counted[inner]
        return number


class TilingError(ValueError):
    """Polygons that do not tile their region; the message says which grain, edge or corner is at fault."""


def _phase_names(names: Iterable[str]) -> tuple[str, ...]:
    if not fits(names, Sequence[str]) or len(set(names)) < len(tuple(names)) or BETWEEN in names or INSIDE in names:
        raise refusal("Tessellation: phase_names", names, f"different names, none of them {BETWEEN} or {INSIDE}")
    return tuple(names)


def _joints(joints: Mapping[str, Any]) -> dict[str, np.ndarray]:
    if not isinstance(joints, Mapping) or any(name in (BETWEEN, INSIDE, "") for name in joints):
        raise refusal("Tessellation: joints", joints, f"arrays by names, none of them {BETWEEN} or {INSIDE}")
    made = {}
    for name, edges in joints.items():
        made[str(name)] = np.array(edges, dtype=np.int64).reshape(-1, 2)
        made[str(name)].flags.writeable = False
    return made


def _regions(regions: Iterable[Region]) -> tuple[Region, ...]:
    if not fits(regions, Sequence[Region]):
        raise refusal("Tessellation: bodies", regions, wanted(Sequence[Region]))
    return tuple(regions)


@attrs.frozen(eq=False)
class Tessellation(metaclass=Checked):
    """Convex polygons that cover a region without gap or overlap and meet along whole edges.

    Index letters: ``v`` vertex, ``g`` grain. The corners of grain g are ``corners[first[g]:first[g + 1]]``,
    counter-clockwise. There may be further ``bodies`` beside the region: they share no vertex with it or with each
    other, even where they touch. Loose grains need not fill their region; their sides inside it are the boundary
    "grains".

    A grain that can break is made of several polygons, its cells: those with one number of ``parent``. ``joints`` are
    edges with a name of their own, by which a law is chosen.

    Arrays that do not fit each other raise :class:`TilingError`; :meth:`check` tells whether the polygons tile the
    regions.
    """

    region: Region  #: what the grains fill
    vertices: np.ndarray = array_field(float)  #: (v, 2) m
    corners: np.ndarray = array_field(int)  #: vertex numbers of all grains in a row
    first: np.ndarray = array_field(int)  #: (g + 1,)
    phase: np.ndarray = array_field(int)  #: (g,) mineral phase of each grain, all 0 unless given
    bodies: tuple[Region, ...] = attrs.field(default=(), converter=_regions)  #: regions beside the first
    body: np.ndarray = array_field(int)  #: (g,) number into ``regions`` of what each grain fills, all 0 unless given
    loose: np.ndarray = array_field(bool)  #: (g,) whether a grain may leave room round it, none unless given
    parent: np.ndarray = array_field(int)  #: (g,) number of the grain that each is a cell of; its own unless given
    phase_names: tuple[str, ...] = attrs.field(default=(), converter=_phase_names)  #: by number; numbers if none
    joints: Mapping[str, np.ndarray] = attrs.field(factory=dict, converter=_joints)  #: (n, 2) vertices of their edges

    @parent.default
    def _grains_of_one_cell(self) -> np.ndarray:
        return np.arange(self.count)

    @phase.default
    @body.default
    def _all_the_first(self) -> np.ndarray:
        return np.zeros(self.count, dtype=int)

    @loose.default
    def _none_loose(self) -> np.ndarray:
        return np.zeros(self.count, dtype=bool)

    def __attrs_post_init__(self) -> None:
        if self.vertices.ndim != 2 or self.vertices.shape[1] != 2 or not np.isfinite(self.vertices).all():
            raise TilingError(f"vertices must be finite and (v, 2), their shape is {self.vertices.shape}")
        if len(self.first) < 2 or self.first[0] != 0 or self.first[-1] != len(self.corners):
            raise TilingError(f"first must run from 0 to the number of corners, {len(self.corners)}")
        if np.diff(self.first).min() < 3:
            raise TilingError(f"grain {np.argmin(np.diff(self.first))} has less than 3 corners")
        if self.corners.min() < 0 or self.corners.max() >= len(self.vertices):
            raise TilingError(f"corners must be vertex numbers below {len(self.vertices)}")
        for name in ("phase", "body", "loose", "parent"):
            if getattr(self, name).shape != (self.count,):
                raise TilingError(f"{name} has the shape {getattr(self, name).shape} for {self.count} grains")
        if self.phase_names and not 0 <= self.phase.min() <= self.phase.max() < len(self.phase_names):
            raise TilingError(f"phase must be numbers of the {len(self.phase_names)} phase_names, from 0")
        if not np.array_equal(np.unique(self.body), np.arange(len(self.regions))):
            raise TilingError(f"body must give each of the {len(self.regions)} regions grains, by numbers from 0")
        ends = np.concatenate([np.zeros(0, dtype=np.int64), *(edges.ravel() for edges in self.joints.values())])
        if len(ends) and not 0 <= ends.min() <= ends.max() < len(self.vertices):
            raise TilingError(f"joints must be vertex numbers below {len(self.vertices)}")
        if self.loose.any() and any(LOOSE in region.names for region in self.regions):
            raise TilingError(f"a region has a side named {LOOSE}, that is the boundary of loose grains")

    @property
    def _facts(self) -> dict[str, str]:
        size = " x ".join(rounded(length, "m") for length in np.ptp(self.vertices, axis=0))
        facts = {"grains": str(len(np.unique(self.parent))), "size": size, "grain size": rounded(self.grain_size, "m")}
        facts |= {"cells": str(self.count)} if self.is_breakable else {}
        names = {"phases": ", ".join(self.phase_names), "joints": ", ".join(self.joints)}
        return facts | {what: text for what, text in names.items() if text}

    @property
    def count(self) -> int:
        """Number of grains."""
        return len(self.first) - 1

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of the kinds of edges, by their number."""
        return (BETWEEN, INSIDE, *self.joints)

    @property
    def is_breakable(self) -> bool:
        """Whether a grain has several cells."""
        return len(np.unique(self.parent)) < self.count

    def phase_number(self, phase: int | str) -> int | None:
        """Number of a phase given by number or name; None for what no phase has."""
        if isinstance(phase, str):
            return self.phase_names.index(phase) if phase in self.phase_names else None
        return int(phase) if phase in (range(len(self.phase_names)) or self.phase.tolist()) else None

    @property
    def known_phases(self) -> str:
        """Names of all phases; where they have none, their numbers."""
        return ", ".join(self.phase_names) or f"without names, numbers {', '.join(map(str, np.unique(self.phase)))}"

    def phase_name(self, number: int) -> str:
        """Name of a phase, or its number as text."""
        return self.phase_names[number] if self.phase_names else str(number)

    @property
    def regions(self) -> tuple[Region, ...]:
        """Of all bodies, ``region`` first."""
        return (self.region, *self.bodies)

    @cached_property
    def boundary_names(self) -> tuple[str, ...]:
        """Names of the boundaries of all bodies, each once; last that of loose grains."""
        names = dict.fromkeys(name for region in self.regions for name in region.names)
        return (*names, LOOSE) if self.loose.any() else tuple(names)

    @cached_property
    def areas(self) -> np.ndarray:
        """(g,) m2, negative for a grain that runs clockwise."""
        return areas_and_centroids(self.vertices[self.corners], self.first)[0]

    @cached_property
    def grain_size(self) -> float:
        """m, the median root of the areas."""
        return float(np.median(np.sqrt(self.areas)))

    @cached_property
    def mean_size(self) -> float:
        """m, the root of the mean area."""
        return float(np.sqrt(self.areas.mean()))

    @cached_property
    def centroids(self) -> np.ndarray:
        """(g, 2) m."""
        return areas_and_centroids(self.vertices[self.corners], self.first)[1]

    @cached_property
    def edges(self) -> Edges:
        """All edges, in the order of the left grain, which has the lower number of the two."""
        next_corner = following(self.first)
        start, end = self.corners, self.corners[next_corner]
        grain = np.repeat(np.arange(self.count), np.diff(self.first))
        run, wanted = start * len(self.vertices) + end, end * len(self.vertices) + start
        order = np.argsort(run, kind="stable")
        found = order[np.minimum(np.searchsorted(run[order], wanted), len(run) - 1)]
        twin = np.where(run[found] == wanted, found, -1)
        e = np.flatnonzero((twin < 0) | (twin > np.arange(len(twin))))
        t = twin[e]
        side, right = np.full(len(e), -1), np.where(t < 0, -1, grain[t])
        side[t < 0] = self._boundary(self.vertices[np.column_stack([start[e], end[e]])[t < 0]], grain[e[t < 0]])
        return Edges(
            start=start[e], end=end[e], left=grain[e], right=right, side=side,
            kind=self._kind(start[e], end[e], grain[e], right),
            left_corners=np.column_stack([e, next_corner[e]]),
            right_corners=np.where(t[:, None] < 0, -1, np.column_stack([next_corner[t], t])),
            length=np.hypot(*(self.vertices[end[e]] - self.vertices[start[e]]).T), boundary_names=self.boundary_names,
        )  # fmt: skip

    def _kind(self, start: np.ndarray, end: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        kind = ((right >= 0) & (self.parent[left] == self.parent[right])).astype(np.int64)
        run = np.minimum(start, end) * len(self.vertices) + np.maximum(start, end)
        for number, edges in enumerate(self.joints.values(), start=2):
            kind[np.isin(run, edges.min(axis=1) * len(self.vertices) + edges.max(axis=1))] = number
        return kind

    def _boundary(self, ends: np.ndarray, grain: np.ndarray) -> np.ndarray:
        """Boundary on which edges with these ends (b, 2, 2) of grains (b,) lie; -1 without."""
        number = {name: k for k, name in enumerate(self.boundary_names)}
        boundary = np.where(self.loose[grain], number.get(LOOSE, -1), -1)
        order = np.argsort(self.body[grain], kind="stable")
        parted = np.split(order, np.searchsorted(self.body[grain][order], np.arange(1, len(self.regions))))
        for region, mine in zip(self.regions, parted, strict=True):
            side = region.side_at(ends[mine])
            boundary[mine] = np.where(side < 0, boundary[mine], np.array([number[name] for name in region.names])[side])
        return boundary

    def plot(self, by: str = "phase", *, ax: Any = None) -> Figure:
        """Draw the grains, coloured by "phase", "area" or "parent", the grain of each cell.

        Draws into the axes ``ax`` of matplotlib, if they are given. Returns the figure.
        """
        from grainlaw.drawing.grains import draw_grains

        return draw_grains(self, by, ax)

    def check(self) -> None:
        """Raise :class:`TilingError` unless the grains are convex and those of each body tile its region, edge to edge.

        Loose grains must have room in it, and neither they nor bodies may lie in each other.
        """
        self.check_tiling()
        if found := self.deepest_overlap():
            one, other, depth = found
            raise TilingError(f"grains {one} and {other} lie {depth:.3g} m in each other")

    def check_tiling(self) -> None:
        """The same without a look at whether bodies or loose grains lie in each other, as pressed ones may."""
        self._check_convex()
        key = self.corners * len(self.vertices) + self.corners[following(self.first)]
        run, times = np.unique(key, return_counts=True)
        if times.max() > 1:
            start, end = divmod(int(run[times.argmax()]), len(self.vertices))
            raise TilingError(f"{times.max()} grains lie on the same side of the edge from vertex {start} to {end}")
        edges = self.edges
        loose = (edges.right < 0) & (edges.side < 0)
        if loose.any():
            e = loose.argmax()
            raise TilingError(
                f"the edge between vertices {edges.start[e]} and {edges.end[e]} of grain {edges.left[e]} "
                "has neither a second grain nor a side of the region"
            )
        shared = (edges.right >= 0) & (self.body[edges.left] != self.body[edges.right])
        if shared.any():
            e = shared.argmax()
            raise TilingError(f"grains {edges.left[e]} and {edges.right[e]} share an edge, but are of different bodies")
        for number, region in enumerate(self.regions):
            self._check_area(region, self.body == number, f" of body {number}" if self.bodies else "")

    def deepest_overlap(self) -> tuple[int, int, float] | None:
        """The two grains that lie deepest (m) in each other, of different bodies or loose; None without such."""
        if not (self.bodies or self.loose.any()):
            return None
        points = self.vertices[self.corners]
        one, other = near_sides(*boxes(points, self.first))  # their diagonals
        free = (self.body[one] != self.body[other]) | self.loose[one] | self.loose[other]
        one, other = one[free], other[free]
        depth = overlaps(points, self.first, one, other)
        k = int(depth.argmax()) if len(depth) else 0
        if not len(depth) or depth[k] <= ROUNDING * abs(points).max():
            return None
        return int(one[k]), int(other[k]), float(depth[k])

    def _check_area(self, region: Region, mine: np.ndarray, which: str) -> None:
        total = float(self.areas[mine].sum())
        missing = region.area - total
        perimeter = np.hypot(*(region.end - region.start).T).sum()
        placed = 2 * np.finfo(float).eps * abs(region.bounds).max() * perimeter  # what corners far from zero lose
        if abs(missing) > 1e-12 * region.area + placed and not (missing > 0 and self.loose[mine].any()):
            raise TilingError(f"the areas of the grains{which} add up to {total} m2, the region has {region.area} m2")

    def _check_convex(self) -> None:
        if self.areas.min() <= 0:
            raise TilingError(f"grain {np.argmin(self.areas)} runs clockwise or has no area")
        next_corner = following(self.first)
        along = self.vertices[self.corners[next_corner]] - self.vertices[self.corners]
        length = np.hypot(*along.T)
        bad = (cross(along, along[next_corner]) < -ROUNDING * length * length[next_corner]) | (length == 0)
        if bad.any():
            grain = np.searchsorted(self.first, bad.argmax(), side="right") - 1
            raise TilingError(f"grain {grain} is not convex near its vertex {self.corners[bad.argmax()]}")


class Tessellator(metaclass=Checked):
    """Makes grains.

    A whole tessellator, equal bricks for an upright rectangle::

        @attrs.frozen(kw_only=True)
        class Bricks(gl.Tessellator):
            rows: int = 4
            columns: int = 3

            def tessellate(self, region):
                (left, bottom), (right, top) = region.bounds
                x, y = np.linspace(left, right, self.columns + 1), np.linspace(bottom, top, self.rows + 1)
                at = np.arange(x.size * y.size).reshape(y.size, x.size)
                corners = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).ravel()
                vertices = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
                return gl.Tessellation(region, vertices, corners, np.arange(0, corners.size + 1, 4))
    """

    @abstractmethod
    def tessellate(self, region: Region) -> Tessellation:
        """Fill the region; the same component gives the same grains. The result passes its ``check``."""
