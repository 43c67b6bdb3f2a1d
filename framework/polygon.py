"""Plane geometry of polygons, many at a time."""

from __future__ import annotations

import numpy as np


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


def following(first: np.ndarray) -> np.ndarray:
    """Position of the next corner of the same polygon, for each corner; polygon g has ``first[g]:first[g + 1]``."""
    position = np.arange(1, first[-1] + 1)
    position[first[1:] - 1] = first[:-1]
    return position


def crossing_sides(outline: np.ndarray) -> tuple[int, int] | None:
    """Two sides that share more than the corner between them."""
    n = len(outline)
    i, j = np.indices((n, n))
    along = np.roll(outline, -1, axis=0) - outline
    left_of = cross(along[:, None], outline - outline[:, None])  # sign: corner j to the left of side i
    astride = left_of * np.roll(left_of, -1, axis=1) <= 0
    ends = np.stack([outline, outline + along])
    low, high = ends.min(axis=0), ends.max(axis=0)
    near = ((low[:, None] <= high) & (low <= high[:, None])).all(axis=2)
    meet = (i + 1 < j) & ((j + 1) % n != i) & astride & astride.T & near
    onward = np.roll(along, -1, axis=0)
    meet |= (j == (i + 1) % n) & ((cross(along, onward) == 0) & ((along * onward).sum(axis=1) <= 0))[:, None]
    return next(((int(k), int(m)) for k, m in np.argwhere(meet)), None)
