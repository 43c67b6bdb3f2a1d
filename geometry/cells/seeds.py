"""Seeds of cells: independent points of uniform density, and their order along space."""

from __future__ import annotations

import numpy as np

from grainlaw.geometry.cells.any_voronoi import frame
from grainlaw.region import Region


def uniform_points(region: Region, count: int, random: np.random.Generator) -> np.ndarray:
    """(count, 2) m, independent points of uniform density in a convex region, drawn from a fan of triangles."""
    corner, a, b = region.outline[0], region.outline[1:-1], region.outline[2:]
    a, b = a - corner, b - corner
    areas = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    triangle = random.choice(len(areas), size=count, p=areas / areas.sum())
    out, across = np.sqrt(random.random(count))[:, None], random.random(count)[:, None]
    return corner + out * (a[triangle] + across * (b - a)[triangle])


def scattered_points(region: Region, count: int, random: np.random.Generator) -> np.ndarray:
    """(count, 2) m, independent points of uniform density in a region, drawn from its frame."""
    around, seeds = frame(region), np.empty((0, 2))
    while len(seeds) < count:
        drawn = uniform_points(around, count, random)
        seeds = np.concatenate([seeds, drawn[region.contains(drawn)]])
    return seeds[:count]


LEVELS = 20  #: halvings of the box; 4 ** 20 cells still fit a 64 bit key


def hilbert_order(points: np.ndarray) -> np.ndarray:
    """Order of ``points`` (n, 2) along Hilbert's curve through the square round them (Hilbert 1891)."""
    low = points.min(axis=0)
    extent = max(np.ptp(points, axis=0).max(), np.finfo(float).tiny)
    x, y = np.minimum((points - low) / extent * 2**LEVELS, 2**LEVELS - 1).astype(np.int64).T
    key = np.zeros(len(points), dtype=np.int64)
    for level in reversed(range(LEVELS)):
        right, upper = x >> level & 1, y >> level & 1
        key = 4 * key + (3 * right ^ upper)
        # The quarters at the curve's ends are passed transposed, the last one upside down as well.
        flip = (upper == 0) & (right == 1)
        x, y = np.where(flip, ~x, x), np.where(flip, ~y, y)
        x, y = np.where(upper == 0, y, x), np.where(upper == 0, x, y)
    return np.argsort(key, kind="stable")
