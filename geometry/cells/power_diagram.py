"""Power diagram (Laguerre tessellation) of weighted seeds, that ends exactly on the sides of a convex region.

A point belongs to the seed of the least power, its squared distance less the weight of the seed. Seeds lifted to the
height of their squared distance from the origin less their weight have the diagram as the lower side of their convex
hull (Aurenhammer 1987, doi:10.1137/0216006). Images of the same weight over the sides bound it as they do a Voronoi
diagram: no image has a smaller power inside the region than its seed. A seed may lie outside its own cell, and may have
none.
"""

from __future__ import annotations

import functools

import numpy as np
from scipy.spatial import ConvexHull

from grainlaw.geometry.cells.bounded_voronoi import Diagram, half_edges, mirrored_diagram
from grainlaw.geometry.cells.sides import convex_sides
from grainlaw.polygon import cross, linked
from grainlaw.region import Region

NEAR = 1e-9  #: of the grain size: nearer vertices are one


def power_diagram(region: Region, seeds: np.ndarray, weights: np.ndarray, reach: float) -> Diagram:
    """Cells of distinct ``seeds`` (g, 2) m inside a convex region with ``weights`` (g,) m2.

    Seeds nearer to a side than about ``reach`` (m) have cells there: it is doubled as often as that is too little.
    """
    return mirrored_diagram(region, seeds, reach, functools.partial(_power, region, seeds, weights), "power")


def _power(
    region: Region, seeds: np.ndarray, weights: np.ndarray, points: np.ndarray, origin: np.ndarray, side: np.ndarray
) -> Diagram | None:
    """Of seeds and their images, all ``points``; None if a cell does not end on the sides."""
    centre, extent = region.bounds.mean(axis=0), np.ptp(region.bounds, axis=0).max()
    near = NEAR * np.sqrt(region.area / len(seeds)) / extent
    points = (points - centre) / extent
    weight = np.concatenate([weights, weights[origin]]) / extent**2

    hull = ConvexHull(np.column_stack([points, (points**2).sum(axis=1) - weight]))
    triangles = hull.simplices[hull.equations[:, 2] < -1e-13]  # of its lower side; those upright have no vertex
    between, beside = _edges(triangles, len(points))
    ours = between[:, 0] < len(seeds)
    between, beside = between[ours], beside[ours]
    if beside.min() < 0:  # an open cell
        return None
    used, beside = np.unique(beside, return_inverse=True)
    centres = _radical_centres(points, weight, triangles[used])
    vertices, ends = _without_repetition(centres, beside.reshape(-1, 2), near)
    real = ends[:, 0] != ends[:, 1]  # a seed, its neighbour and both images have one vertex on the side
    between, ends = between[real], ends[real]

    image = np.maximum(between[:, 1] - len(seeds), 0)
    outer = between[:, 1] >= len(seeds)
    side = np.where(outer, side[image], -1)
    vertices = vertices * extent + centre
    lowest = convex_sides(region).distance(vertices[ends.ravel()]).min()
    if (origin[image] != between[:, 0])[outer].any() or lowest < -1e3 * near * extent:
        return None
    outward = points[between[:, 1]] - points[between[:, 0]]
    swap = cross(vertices[ends[:, 1]] - vertices[ends[:, 0]], outward) > 0  # the outside is on the right
    return half_edges(seeds, vertices, between, ends, side, swap)


def _edges(triangles: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """(e, 2) points of the edges of triangles, lower first, and (e, 2) triangles on both sides, -1 for none."""
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    ends.sort(axis=1)
    key = ends[:, 0] * count + ends[:, 1]
    order = np.argsort(key, kind="stable")
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    twice = np.diff(first, append=len(order)) > 1
    beside = np.full((len(first), 2), -1)
    beside[:, 0] = order[first] % len(triangles)
    beside[twice, 1] = order[first[twice] + 1] % len(triangles)
    return ends[order[first]], beside


def _radical_centres(points: np.ndarray, weight: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """(t, 2) points of equal power to all three corners; from the corners, for the hull's planes have fewer digits."""
    a, b, c = triangles.T
    ab, ac = points[b] - points[a], points[c] - points[a]
    p = ((ab**2).sum(axis=1) + weight[a] - weight[b]) / 2
    q = ((ac**2).sum(axis=1) + weight[a] - weight[c]) / 2
    x = p * ac[:, 1] - q * ab[:, 1]
    y = q * ab[:, 0] - p * ac[:, 0]
    return points[a] + np.column_stack([x, y]) / cross(ab, ac)[:, None]


def _without_repetition(centres: np.ndarray, ends: np.ndarray, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Vertices, and the ends (e, 2) among them, where edges shorter than ``near`` have shrunk to one vertex."""
    a, b = ends.T
    short = np.flatnonzero(np.hypot(*(centres[a] - centres[b]).T) < near)
    number = linked(len(centres), a[short], b[short])
    place = np.unique(number, return_index=True)[1]
    return centres[place], number[ends]
