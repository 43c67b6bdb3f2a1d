"""Plane geometry of polygons, many at a time."""

from __future__ import annotations

import numpy as np
import scipy


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Third component of the product of plane vectors (..., 2): positive where b points left of a."""
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def areas_and_centroids(points: np.ndarray, first: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(g,) and (g, 2) of polygons whose corners ``points`` lie in a row, ``first[g]:first[g + 1]``."""
    origin = points[first[:-1]]  # from a corner of its own, else polygons far from zero lose digits
    here = points - np.repeat(origin, np.diff(first), axis=0)
    there = here[following(first)]
    twice = cross(here, there)
    areas = np.add.reduceat(twice, first[:-1]) / 2
    moments = np.add.reduceat((here + there) * twice[:, None], first[:-1])
    with np.errstate(invalid="ignore", divide="ignore"):  # a polygon without area has no centroid
        return areas, origin + moments / (6 * areas[:, None])


LONG = 8.0  #: times the median length of sides
FEW = 64  #: sides of which all pairs are looked at sooner than those that are near are found


def ring_area(ring: np.ndarray) -> float:
    """Of one polygon (n, 2), negative where it runs clockwise."""
    return float(areas_and_centroids(ring, np.array([0, len(ring)]))[0][0])


def following(first: np.ndarray) -> np.ndarray:
    """Position of the next corner of the same polygon, for each corner; polygon g has ``first[g]:first[g + 1]``."""
    position = np.arange(1, first[-1] + 1)
    position[first[1:] - 1] = first[:-1]
    return position


def linked(count: int, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(count,) number from 0 of the part that each of so many things is in, of which these pairs (n,) hang together."""
    links = scipy.sparse.coo_array((np.ones(len(one)), (one, other)), shape=(count, count))
    return scipy.sparse.csgraph.connected_components(links, directed=False)[1]


def crossing_sides(start: np.ndarray, end: np.ndarray, after: np.ndarray) -> tuple[int, int] | None:
    """Two sides of closed outlines that share more than the corner between them; side ``after[k]`` follows side k."""
    along, (i, j) = end - start, near_sides(start, end)
    ends = np.stack([start, end])
    low, high = ends.min(axis=0), ends.max(axis=0)
    meet = ((low[i] <= high[j]) & (low[j] <= high[i])).all(axis=1) & (after[i] != j) & (after[j] != i)
    for one, other in ((i, j), (j, i)):  # sign: the start and the end of the other to the left of the one
        left = (cross(along[one], at[other] - start[one]) for at in (start, end))
        meet &= np.multiply(*left) <= 0
    onward = along[after]
    back = np.flatnonzero((cross(along, onward) == 0) & ((along * onward).sum(axis=1) <= 0))
    found = [(i[meet], j[meet]), (back, after[back])]
    return min((pair for pairs in found for pair in zip(*(each.tolist() for each in pairs), strict=True)), default=None)


def near_sides(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(2, n) pairs of sides, the smaller number first, of few sides all, else those whose circles overlap.

    All that can meet are among them.
    """
    if len(start) <= FEW:
        return np.array(np.triu_indices(len(start), 1))
    middle, half = (start + end) / 2, np.hypot(*(end - start).T) / 2
    is_long = half > LONG * np.median(half)  # few, so they are compared with all
    short, long = np.flatnonzero(~is_long), np.flatnonzero(is_long)
    tree = scipy.spatial.cKDTree(middle[short])
    pairs = [short[tree.query_pairs(2.01 * half[short].max(), output_type="ndarray").reshape(-1, 2)]]
    pairs += [np.column_stack([np.full(len(half), k), np.arange(len(half))]) for k in long]
    i, j = np.sort(np.concatenate(pairs), axis=1).T
    near = (i < j) & (np.hypot(*(middle[i] - middle[j]).T) <= 1.001 * (half[i] + half[j]))
    return np.unique(np.column_stack([i, j])[near], axis=0).T


def boxes(points: np.ndarray, first: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(g, 2) lower left and upper right corner of the upright box round each polygon."""
    return np.minimum.reduceat(points, first[:-1]), np.maximum.reduceat(points, first[:-1])


PAIRS = 200_000  #: of convex polygons whose sides are compared at a time


def overlaps(points: np.ndarray, first: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(n,) m, how far each pair of convex polygons ``one`` and ``other`` (n,) lies in each other; negative for a gap.

    Corners ``points`` lie in a row, counter-clockwise, ``first[g]:first[g + 1]``. It is the shortest way along the
    normal of a side by which they part.
    """
    low, high = boxes(points, first)
    depth = np.minimum(high[one] - low[other], high[other] - low[one]).min(axis=1)
    near = np.flatnonzero(depth > 0)
    for some in np.array_split(near, 1 + len(near) // PAIRS):
        for sides, corners in ((one[some], other[some]), (other[some], one[some])):
            depth[some] = np.minimum(depth[some], -_clearance(points, first, sides, corners))
    return depth


def _clearance(points: np.ndarray, first: np.ndarray, sides: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """(n,) m, of each polygon ``corners`` from that side of the polygon ``sides`` of which it is farthest."""
    pair, side = _members(first, sides)
    if not len(pair):
        return np.zeros(0)
    along = points[following(first)[side]] - points[side]
    normal = np.column_stack([along[:, 1], -along[:, 0]]) / np.hypot(*along.T)[:, None]
    each, corner = _members(first, corners[pair])
    nearest = np.minimum.reduceat(
        ((points[corner] - points[side[each]]) * normal[each]).sum(axis=1), np.flatnonzero(np.diff(each, prepend=-1))
    )
    return np.maximum.reduceat(nearest, np.flatnonzero(np.diff(pair, prepend=-1)))


def _members(first: np.ndarray, polygons: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of each of ``polygons`` all corners: the number in ``polygons`` and the position of the corner."""
    count = np.diff(first)[polygons]
    number = np.repeat(np.arange(len(polygons)), count)
    return number, np.arange(len(number)) - np.repeat(np.cumsum(count) - count - first[polygons], count)


def enclosed(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """(n,) whether each point (n, 2) lies inside closed outlines with these sides: a ray to the right leaves them."""
    inside = []
    for block in np.array_split(points, 1 + len(points) * len(start) // 1_000_000):
        passed = (start[:, 1] > block[:, None, 1]) != (end[:, 1] > block[:, None, 1])
        left = cross(end - start, block[:, None] - start) * np.sign(end - start)[:, 1] > 0
        inside.append((passed & left).sum(axis=1) % 2 == 1)
    return np.concatenate(inside)
