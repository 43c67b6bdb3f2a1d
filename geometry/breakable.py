"""Grains that can break: each is filled with cells, and the edges between its cells are bonds inside of it."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.fields import ParameterError, is_number, parameter, whole_number
from grainlaw.geometry.cells.any_voronoi import NEAR, SMALL
from grainlaw.geometry.cells.convex import Polygon, area, polygon_of
from grainlaw.geometry.cells.filling import strips, triangles, voronoi_cells
from grainlaw.geometry.cells.grain_size import check_room, length
from grainlaw.geometry.cells.joining import tiling_of_parts
from grainlaw.geometry.cells.lines import held, marked, vertices_on
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.messages import refusal
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation, Tessellator


class GrainCells(metaclass=Checked):
    """How a grain is filled with cells."""

    @abstractmethod
    def cell_size(self, grain_area: float) -> float:
        """Root of the area of a cell (m) where grains have this mean area (m2); for strips their width."""

    @abstractmethod
    def fill(self, grain: Polygon, number: int, size: float, random: np.random.Generator) -> list[Polygon]:
        """Convex cells that fill a convex grain with this number; corners (x, y) m, counter-clockwise."""


def _require_one(cells: Any) -> None:
    if (cells.count is None) == (cells.size is None):
        given = "neither" if cells.count is None else "both"
        raise ParameterError(f"{type(cells).__name__}: give either count or size, not {given}")


@attrs.frozen(kw_only=True)
class VoronoiCells(GrainCells):
    """Voronoi cells of random seeds inside of each grain: ``count`` in one of mean area, or of a ``size``.

    A grain has as many as its area holds, at least one.
    """

    count: int | None = whole_number(at_least=1, default=None)  #: cells in a grain of mean area; give this or size
    size: float | None = length()  #: m, root of the mean area of the cells
    relaxation: int = whole_number(at_least=0, at_most=1000, default=2)  #: Lloyd iterations

    def __attrs_post_init__(self) -> None:
        _require_one(self)

    def cell_size(self, grain_area: float) -> float:
        return self.size or math.sqrt(grain_area / self.count)  # type: ignore[operator]

    def fill(self, grain: Polygon, number: int, size: float, random: np.random.Generator) -> list[Polygon]:
        return voronoi_cells(grain, max(1, round(area(grain) / size**2)), self.relaxation, NEAR * size, random)


@attrs.frozen(kw_only=True)
class Trigons(GrainCells):
    """Triangles, about ``count`` in a grain of mean area, or of a ``size``; grains that meet divide an edge alike.

    Cracks can go nearly any way between them: Mayer and Stead 2017, Computers and Geotechnics 82, 110-123.
    """

    count: int | None = whole_number(at_least=1, default=None)  #: cells in a grain of mean area; give this or size
    size: float | None = length()  #: m, root of the mean area of the triangles

    def __attrs_post_init__(self) -> None:
        _require_one(self)

    def cell_size(self, grain_area: float) -> float:
        return self.size or math.sqrt(grain_area / self.count)  # type: ignore[operator]

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


def _cells(value: Any) -> GrainCells | dict[Any, GrainCells]:
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
    cells: GrainCells | Mapping[Any, GrainCells] = attrs.field(converter=_cells)
    seed: int = whole_number(at_least=0, default=1)  #: of the random numbers
    merge: float = parameter("cell sizes", default=0.25, at_least=0, below=1)  #: shorter edges vanish where they can

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
