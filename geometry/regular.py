"""Regular grains: rectangles in rows, and hexagons."""

from __future__ import annotations

import contextlib
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError, checked_field, checked_number, checked_whole_number, whole_number
from grainlaw.geometry.cells.any_voronoi import NEAR, SMALL, Cells
from grainlaw.geometry.cells.bounded_voronoi import bounded_diagram, polygons
from grainlaw.geometry.cells.grain_size import grain_count, length, require_one
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.geometry.cells.seeds import hilbert_order
from grainlaw.geometry.cells.sides import convex_sides, depths, is_convex
from grainlaw.messages import refusal
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation, Tessellator, TilingError

MOST = 10_000  #: rows or columns


def _bricks(where: str, value: Any) -> int | tuple[float, ...]:
    if not isinstance(value, (list, tuple, np.ndarray)):
        return checked_whole_number(where, value, at_least=1, at_most=MOST)
    if not 1 <= len(value) <= MOST:
        raise refusal(where, value, f"1 to {MOST} sizes")
    return tuple(checked_number(where, size, above=0) for size in value)


@attrs.frozen(kw_only=True)
class Bricks(Tessellator):
    """Bricks in straight rows and columns, for an upright rectangle; two rows are two blocks with one joint.

    A number of rows or columns of one size, or the size of each in proportion: ``columns=[1, 1, 2, 4]``.
    """

    rows: int | tuple[float, ...] = checked_field(_bricks, default=2)  #: on top of each other, from below
    columns: int | tuple[float, ...] = checked_field(_bricks, default=1)  #: beside each other, from the left

    @checked
    def tessellate(self, region: Region) -> Tessellation:
        """Fill an upright rectangle, row by row from below. Raises ParameterError for another region."""
        low, high = region.bounds
        if len(region.start) != 4 or not ((region.outline == low) | (region.outline == high)).all():
            raise ParameterError("Bricks: region is not allowed, it must be an upright rectangle")
        x, y = _lines(low[0], high[0], self.columns), _lines(low[1], high[1], self.rows)
        at = np.arange(len(x) * len(y)).reshape(len(y), len(x))
        corners = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).ravel()
        vertices = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        return Tessellation(region, vertices, corners, np.arange(0, len(corners) + 1, 4))


def _lines(low: float, high: float, of: int | tuple[float, ...]) -> np.ndarray:
    if isinstance(of, int):
        return np.linspace(low, high, of + 1)
    ends = np.cumsum(of) / np.sum(of)
    return np.array([low, *(low + (high - low) * ends[:-1]), high])


# Cuts go along lines of the lattice and of the region. Where two of them all but coincide, their distance may be that
# below which points are one; then cells do not meet, and a coarser distance tells the lines to be one.
NEARS = (NEAR, 10 * NEAR, 100 * NEAR, 1000 * NEAR)
SHORTEST = 0.25  #: of the grain size: the shortest edge that the sides of the region may cut off


@attrs.frozen(kw_only=True)
class Hexagonal(Tessellator):
    """Regular hexagons about the middle of a region; those at its sides are cut by them or reach out to them.

    Give either ``grain_size``, the square root of the area of a whole hexagon, or ``grains``, about how many fit.
    """

    grains: int | None = whole_number(at_least=1, default=None)  #: number of grains; give this or grain_size
    grain_size: float | None = length()  #: square root of the area of a whole hexagon

    def __attrs_post_init__(self) -> None:
        require_one(self)

    @checked
    def tessellate(self, region: Region) -> Tessellation:
        """Fill a region; grains near in space are near in number."""
        count = grain_count(self, region)
        size = self.grain_size or np.sqrt(region.area / count)
        seeds = _lattice(region, size * np.sqrt(2 / np.sqrt(3)))
        if is_convex(region):
            cells = polygons(region, bounded_diagram(region, seeds[hilbert_order(seeds)]))
            return merge_short_edges(cells, SHORTEST * size).tessellation()
        for near in NEARS[:-1]:
            with contextlib.suppress(TilingError):
                return _cut(region, seeds, size, near)
        return _cut(region, seeds, size, NEARS[-1])


def _cut(region: Region, seeds: np.ndarray, size: float, near: float) -> Tessellation:
    """Cells in a region of any shape; points nearer to each other than ``near`` times the size are one."""
    seeds = Cells(region, seeds, size, near=near).next_seeds(relaxed=False)
    cells = Cells(region, seeds[hilbert_order(seeds)], size, near=near).tiling()
    return merge_short_edges(cells, SHORTEST * size, SMALL * size**2).tessellation()


def _lattice(region: Region, spacing: float) -> np.ndarray:
    """(n, 2) m, the middle of the region and all centres of hexagons round it that lie well inside."""
    pitch = spacing * np.array([1, np.sqrt(0.75)])
    n, m = np.ceil(np.ptp(region.bounds, axis=0) / pitch)
    row, place = (i.ravel() for i in np.mgrid[-m : m + 1, -n : n + 1])
    points = region.outline.mean(axis=0) + pitch * np.column_stack([place + row % 2 / 2, row])
    depth = convex_sides(region).distance(points).min(axis=1) if is_convex(region) else depths(region, points)
    if depth.max() <= 0:  # in none of a region narrower than the grains: the deepest of closer ones
        closer = _lattice(region, spacing / 2)
        return closer[[depths(region, closer).argmax()]]
    # Thinner cuts would be slivers; the middle stays also where the region is narrower than that.
    return points[depth > min(spacing / 4, depth.max() / 2)]
