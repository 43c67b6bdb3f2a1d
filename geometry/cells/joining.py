"""Polygons side by side become a tiling: near points are merged, and all polygons at a corner share it."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from grainlaw.geometry.cells.convex import Polygon
from grainlaw.geometry.cells.shared_edges import merged
from grainlaw.geometry.cells.sides import lines_at, region_sides, vertices_on
from grainlaw.geometry.cells.tiling import Tiling, without_repetition
from grainlaw.polygon import following
from grainlaw.region import Region


def tiling_of_parts(region: Region, parts: Sequence[Sequence[Polygon]], near: float) -> Tiling:
    """As :func:`tiling_of`, of several polygons for each seed or grain."""
    polygons = [polygon for each in parts for polygon in each]
    made = tiling_of(region, np.concatenate(polygons), np.cumsum([0, *map(len, polygons)]), near)
    return attrs.evolve(made, owner=np.repeat(np.arange(len(parts)), list(map(len, parts)))[made.owner])


def tiling_of(region: Region, points: np.ndarray, first: np.ndarray, near: float) -> Tiling:
    """Polygons whose corners ``points`` (n, 2) lie in a row, ``first[g]:first[g + 1]``, joined.

    Points nearer than ``near`` (m) become one. The corners of the region become corners of the polygons too. ``owner``
    has the numbers of the polygons that have not vanished.
    """
    vertices, number = merged(np.concatenate([region.start, points]), near)  # corners of the region stay in place
    corners = number[len(region.start) :]
    stay, first, owner = without_repetition(corners, first)
    corners, first = _with_touching(vertices, number[: len(region.start)], corners[stay], first, near)
    on = lines_at(len(vertices), *vertices_on(vertices, region.start, region.end, near))[:, :2]
    return Tiling(region, region_sides(region).hold(vertices, on), on, corners, first, owner)


def _with_touching(
    vertices: np.ndarray, fixed: np.ndarray, corners: np.ndarray, first: np.ndarray, near: float
) -> tuple[np.ndarray, np.ndarray]:
    """Corners with every vertex inserted that lies on an edge: only edges without a second polygon have such.

    Vertices are those of such edges themselves, or ``fixed`` ones.
    """
    start, end = corners, corners[following(first)]
    run, wanted = start * len(vertices) + end, end * len(vertices) + start
    loose = np.flatnonzero(~np.isin(run, wanted))
    candidates = np.union1d(fixed, np.concatenate([start[loose], end[loose]]))
    a, along = vertices[start[loose]], vertices[end[loose]] - vertices[start[loose]]
    vertex, edge = vertices_on(vertices[candidates], a, vertices[end[loose]], near)
    length = np.hypot(*along.T)[edge]
    share = ((vertices[candidates[vertex]] - a[edge]) * along[edge]).sum(axis=1) / length
    on = (share > near) & (share < length - near)
    vertex, edge, share = candidates[vertex[on]], loose[edge[on]], share[on]
    place = np.concatenate([np.arange(len(corners)), edge])
    order = np.lexsort((np.concatenate([np.zeros(len(corners)), share]), place))
    grown = np.bincount(edge, minlength=len(corners)) + 1
    return np.concatenate([corners, vertex])[order], np.concatenate([[0], np.cumsum(grown)])[first]
