"""Grains that can break: each is filled with cells, and the edges between its cells are bonds inside of it."""

from __future__ import annotations

import math
import warnings
from abc import abstractmethod
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import attrs
import numpy as np
from scipy.spatial import Delaunay

from grainlaw.arguments import Checked, checked
from grainlaw.fields import ParameterError, UnitWarning, is_number, parameter, whole_number
from grainlaw.geometry.cells.any_voronoi import NEAR, SMALL
from grainlaw.geometry.cells.convex import Point, Polygon, area, centroid, depth, polygon_of, split
from grainlaw.geometry.cells.grain_size import check_room, length
from grainlaw.geometry.cells.joining import tiling_of_parts
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.geometry.cells.sides import held, marked, vertices_on
from grainlaw.messages import refusal
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation, Tessellator

TRIANGLE = 2 / 3**0.25  #: edge of an equilateral triangle of area 1
FLAT = 1e-9  #: of the squared edge: smaller triangles are what rounding leaves on a straight edge


def voronoi_cells(
    polygon: Polygon, count: int, relaxation: int, near: float, random: np.random.Generator
) -> list[Polygon]:
    """Cells of ``count`` random seeds, after so many iterations of Lloyd's algorithm."""
    if count == 1:
        return [polygon]
    seeds = _scattered(polygon, count, random)
    cells = _cells(polygon, seeds, near)
    for _ in range(relaxation):
        cells = _cells(polygon, [centroid(cell) for cell in cells], near)
    return cells


def _scattered(polygon: Polygon, count: int, random: np.random.Generator) -> list[Point]:
    """Independent points of uniform density, drawn from a fan of triangles."""
    (ox, oy), fan = polygon[0], list(pairwise(polygon[1:]))
    shares = np.maximum([area([polygon[0], a, b]) for a, b in fan], 0.0)
    points = []
    for k in random.choice(len(fan), size=count, p=shares / shares.sum()).tolist():
        (ax, ay), (bx, by) = fan[k]
        out, across = math.sqrt(random.random()), random.random()
        points.append(
            (ox + out * (ax - ox + across * (bx - ax)), oy + out * (ay - oy + across * (by - ay)))
        )  # fmt: skip
    return points


def _cells(polygon: Polygon, seeds: list[Point], near: float) -> list[Polygon]:
    """What is nearer to each seed than to all others; those farther than twice its corners cannot matter."""
    places = np.array(seeds)
    cells = []
    for x, y in seeds:
        away = np.hypot(places[:, 0] - x, places[:, 1] - y)
        cell, reach = polygon, math.inf
        for k in np.argsort(away, kind="stable")[1:].tolist():
            if away[k] > reach:
                break
            u, v = seeds[k]
            cell = split(cell, ((x + u) / 2, (y + v) / 2), (y - v, u - x), near)[0]
            reach = 2 * max(math.hypot(p - x, q - y) for p, q in cell) + near
        cells.append(cell)
    return cells


def triangles(polygon: Polygon, size: float, random: np.random.Generator) -> list[Polygon]:
    """Delaunay triangles with areas of about ``size`` squared; neighbours divide a shared edge at the same points."""
    edge = TRIANGLE * size
    rim = [
        (ax + (bx - ax) * k / parts, ay + (by - ay) * k / parts)
        for (ax, ay), (bx, by) in zip(polygon, polygon[1:] + polygon[:1], strict=True)
        for parts in [max(1, round(math.hypot(bx - ax, by - ay) / edge))]
        for k in range(parts)
    ]
    points = rim + _lattice(polygon, edge, random)
    if len(points) == 3:
        return [polygon]
    made = []
    for i, j, k in Delaunay(np.array(points)).simplices.tolist():
        triangle = [points[i], points[j], points[k]]
        if 2 * area(triangle) > FLAT * edge**2:
            made.append(triangle)
    return made


def _lattice(polygon: Polygon, edge: float, random: np.random.Generator) -> list[Point]:
    """Points of a triangular lattice, turned and moved at random, well inside; else the centroid of a large polygon."""
    x, y = centroid(polygon)
    reach = max(math.hypot(p - x, q - y) for p, q in polygon)
    turn, dx, dy = random.random() * math.pi / 3, random.random(), random.random()
    steps = range(-math.ceil(2 * reach / edge) - 1, math.ceil(2 * reach / edge) + 2)
    points = []
    for row in steps:
        for place in steps:
            u, v = edge * (place + dx + (row + dy) / 2), edge * (row + dy) * math.sqrt(0.75)
            point = x + u * math.cos(turn) - v * math.sin(turn), y + u * math.sin(turn) + v * math.cos(turn)
            if depth(polygon, point) > edge / 2:
                points.append(point)
    if not points and area(polygon) > 3 * edge**2 / TRIANGLE**2:
        return [(x, y)]
    return points


def strips(polygon: Polygon, angle: float, spacing: float, near: float) -> list[Polygon]:
    """Strips of equal width, as near to ``spacing`` as fits, between lines at an ``angle`` (rad) from the x axis."""
    tx, ty = math.cos(angle), math.sin(angle)
    heights = [y * tx - x * ty for x, y in polygon]
    low, width = min(heights), max(heights) - min(heights)
    count = max(1, round(width / spacing))
    made, rest = [], polygon
    for k in range(1, count):
        height = low + width * k / count
        rest, below = split(rest, (-height * ty, height * tx), (tx, ty), near)
        made += [below] if below else []
    return [*made, rest]


class GrainCells(metaclass=Checked):
    """How a grain is filled with cells."""

    @abstractmethod
    def cell_size(self, grain_area: float) -> float:
        """Root of the area of a cell (m) where grains have this mean area (m2); for strips their width."""

    @abstractmethod
    def fill(self, grain: Polygon, number: int, size: float, random: np.random.Generator) -> list[Polygon]:
        """Convex cells that fill a convex grain with this number; corners (x, y) m, counter-clockwise."""


@attrs.frozen(kw_only=True)
class _Counted(GrainCells):
    """Cells of one size, or as many as are wanted in a grain of mean area."""

    count: int | None = whole_number(at_least=2, default=None)  #: cells in a grain of mean area; give this or size
    size: float | None = length()  #: m, root of the mean area of the cells

    def __attrs_post_init__(self) -> None:
        if (self.count is None) == (self.size is None):
            given = "neither" if self.count is None else "both"
            raise ParameterError(f"{type(self).__name__}: give either count or size, not {given}")

    def cell_size(self, grain_area: float) -> float:
        return self.size or math.sqrt(grain_area / self.count)  # type: ignore[operator]


@attrs.frozen(kw_only=True)
class VoronoiCells(_Counted):
    """Voronoi cells of random seeds inside of each grain: ``count`` in one of mean area, or of a ``size``.

    A grain has as many as its area holds, at least one.
    """

    relaxation: int = whole_number(at_least=0, at_most=1000, default=2)  #: Lloyd iterations

    def fill(self, grain: Polygon, number: int, size: float, random: np.random.Generator) -> list[Polygon]:
        return voronoi_cells(grain, max(1, round(area(grain) / size**2)), self.relaxation, NEAR * size, random)


@attrs.frozen(kw_only=True)
class Trigons(_Counted):
    """Triangles, about ``count`` in a grain of mean area, or of a ``size``; grains that meet divide an edge alike.

    Cracks can go nearly any way between them: Mayer and Stead 2017, Computers and Geotechnics 82, 110-123.
    """

    def fill(self, grain: Polygon, number: int, size: float, random: np.random.Generator) -> list[Polygon]:
        return triangles(grain, size, random)


def _angle(value: Any) -> float | tuple[float, ...] | None:
    if value is None:
        return None
    angles = value.tolist() if isinstance(value, np.ndarray) else value
    if is_number(angles) and math.isfinite(angles):
        return float(angles)
    if isinstance(angles, (list, tuple)) and angles and all(is_number(a) and math.isfinite(a) for a in angles):
        return tuple(map(float, angles))
    raise refusal("Cleavage: angle", value, "a number of degrees, or one for each grain, or None: at random")


@attrs.frozen(kw_only=True)
class Cleavage(GrainCells):
    """Strips between parallel planes, as in mica and feldspar; of one width in a grain, near to the ``spacing``."""

    spacing: float = parameter("m")  #: width of the strips
    angle: Any = attrs.field(default=None, converter=_angle)  #: deg from the x axis, or by grain; None: at random

    def cell_size(self, grain_area: float) -> float:
        return self.spacing

    def fill(self, grain: Polygon, number: int, size: float, random: np.random.Generator) -> list[Polygon]:
        if isinstance(self.angle, tuple) and number >= len(self.angle):
            raise ParameterError(
                f"Cleavage: angle has {len(self.angle)} entries, it must have one for each grain, also for {number}"
            )
        own = self.angle[number] if isinstance(self.angle, tuple) else self.angle
        angle = random.random() * math.pi if own is None else math.radians(own)
        return strips(grain, angle, size, NEAR * size)


def _checked_cells(value: Any) -> GrainCells | dict[Any, GrainCells]:
    if isinstance(value, GrainCells):
        return value
    if not isinstance(value, Mapping) or not value or not all(isinstance(each, GrainCells) for each in value.values()):
        raise refusal("Breakable: cells", value, "VoronoiCells, Trigons or Cleavage, or a mapping of phases to them")
    return dict(value)


@attrs.frozen
class Breakable(Tessellator):
    """The grains of another tessellator, filled with cells: ``Breakable(Voronoi(grains=200), VoronoiCells(count=8))``.

    ``cells`` may differ by the name of a phase, with ``...`` for all others; phases that are not named stay whole.
    Grains keep their outline exactly: cells end on it, and where those of two neighbours end nearly in one place, they
    end in one. ``parent`` of the tessellation has the grain of each cell. Raises ParameterError.
    """

    tessellator: Tessellator  #: makes the grains
    #: what fills the grains; by name of the phase if it differs
    cells: GrainCells | Mapping[Any, GrainCells] = attrs.field(converter=_checked_cells)
    seed: int = whole_number(at_least=0, default=1)  #: of the random numbers
    merge: float = parameter("cell sizes", default=0.25, at_least=0, below=1)  #: shorter edges vanish where they can

    @checked
    def tessellate(self, region: Region) -> Tessellation:
        """Fill a region; the cells of a grain follow each other in number."""
        grains = self.tessellator.tessellate(region)
        filling = self._fillings(grains)
        mean = region.area / grains.count
        sizes = {id(each): each.cell_size(mean) for each in filling if each is not None}
        count = region.area / min(sizes.values()) ** 2
        check_room(f"Breakable: cells make about {count:.3g} grains, that is not allowed", count)
        parts: list[list[Polygon]] = []
        for g, each in enumerate(filling):
            corners = grains.corners[grains.first[g] : grains.first[g + 1]]
            grain, random = polygon_of(grains.vertices[corners]), np.random.default_rng([self.seed, g])
            number = int(grains.parent[g])
            parts.append([grain] if each is None else each.fill(grain, number, sizes[id(each)], random))
        divided = [part for part, each in zip(parts, filling, strict=True) if each is not None]
        if max(map(len, divided), default=0) == 1 and min(sizes.values()) > math.sqrt(mean):
            words = (
                f"cells of {min(sizes.values()):.3g} m divide no grain of {math.sqrt(mean):.3g} m: is the unit right?"
            )
            warnings.warn(UnitWarning(f"Breakable: {words}"), stacklevel=3)
        return self._joined(grains, parts, min(sizes.values()))

    def _joined(self, grains: Tessellation, parts: list[list[Polygon]], size: float) -> Tessellation:
        near, edges = NEAR * size, grains.edges
        tiling = tiling_of_parts(grains.region, parts, near)
        joint = edges.kind >= 2
        start, end = grains.vertices[edges.start], grains.vertices[edges.end]
        tiling = marked(tiling, start[joint], end[joint], edges.kind[joint] - 1, near)
        inner = edges.right >= 0
        start, end = start[inner], end[inner]
        tiling, lines = held(tiling, start, end, vertices_on(tiling.vertices, start, end, near))
        merged = merge_short_edges(tiling, self.merge * size, SMALL * size**2, lines)
        return merged.tessellation(grains, tuple(grains.joints))

    def _fillings(self, grains: Tessellation) -> list[GrainCells | None]:
        """How each grain is filled."""
        if isinstance(self.cells, GrainCells):
            return [self.cells] * grains.count
        for key in self.cells:
            number = None if key is ... else grains.phase_number(key)
            if key is not ... and (number is None or number not in grains.phase):
                known = ", ".join(map(grains.phase_name, np.unique(grains.phase).tolist()))
                raise ParameterError(f"Breakable: cells: there is no phase {key!r} (phases: {known})")
        others = self.cells.get(...)
        return [self.cells.get(p, self.cells.get(grains.phase_name(p), others)) for p in grains.phase.tolist()]
