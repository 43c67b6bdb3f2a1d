"""Independent points of uniform density."""

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
