"""Polygons side by side become a tiling: near points are merged, and all polygons at a corner share it."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
from scipy.spatial import cKDTree

from grainlaw.geometry.cells.convex import Polygon
from grainlaw.geometry.cells.sides import region_sides
from grainlaw.geometry.cells.tiling import Tiling
from grainlaw.polygon import following, linked
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
    points = np.concatenate([region.start, points])
    pairs = cKDTree(points).query_pairs(near, output_type="ndarray")
    number = linked(len(points), *pairs.T)
    used, place = np.unique(number, return_index=True)  # a corner of the region comes before what is near to it
    vertices = points[place]
    corners, first, owner = _without_repetition(np.searchsorted(used, number[len(region.start) :]), first)
    fixed = np.searchsorted(used, number[: len(region.start)])
    corners, first = _with_touching(vertices, fixed, corners, first, near)
    on = _vertex_sides(region, vertices, near)
    return Tiling(region, region_sides(region).hold(vertices, on), on, corners, first, owner)


def _without_repetition(corners: np.ndarray, first: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Corners, where each polygon begins, and the numbers of the polygons that are left."""
    stay = corners != corners[following(first)]
    first = np.concatenate([[0], np.cumsum(stay)])[first]
    wide = np.diff(first) > 2
    first_of_wide = np.concatenate([[0], np.cumsum(np.diff(first)[wide])])
    return corners[stay][np.repeat(wide, np.diff(first))], first_of_wide, np.flatnonzero(wide)


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
    tree = cKDTree(vertices[candidates])
    a, b = vertices[start[loose]], vertices[end[loose]]
    found = tree.query_ball_point((a + b) / 2, np.hypot(*(b - a).T) / 2)
    after, share, inserted = [], [], []
    for e, hits in enumerate(found):
        along = b[e] - a[e]
        length = np.hypot(*along)
        for v in candidates[hits]:
            x, y = vertices[v] - a[e]
            s = (x * along[0] + y * along[1]) / length
            if abs(along[0] * y - along[1] * x) < 2 * near * length and near < s < length - near:
                after.append(loose[e])
                share.append(s)
                inserted.append(v)
    place = np.concatenate([np.arange(len(corners)), after])
    order = np.lexsort((np.concatenate([np.zeros(len(corners)), share]), place))
    grown = np.bincount(np.array(after, dtype=int), minlength=len(corners)) + 1
    return (
        np.concatenate([corners, np.array(inserted, dtype=int)])[order],
        np.concatenate([[0], np.cumsum(grown)])[first],
    )


def _vertex_sides(region: Region, vertices: np.ndarray, near: float) -> np.ndarray:
    """(v, 2) sides of the region that each vertex lies on, -1 for none; two in a corner."""
    on = np.full((len(vertices), 2), -1)
    for k, (start, end) in enumerate(zip(region.start, region.end, strict=True)):
        along = (end - start) / np.hypot(*(end - start))
        x, y = (vertices - start).T
        share = x * along[0] + y * along[1]
        inside = (share > -near) & (share < np.hypot(*(end - start)) + near)
        touched = np.flatnonzero(inside & (abs(along[0] * y - along[1] * x) < 2 * near))
        on[touched, (on[touched, 0] >= 0).astype(int)] = k
    return on
