"""What tests of grains share: regions, and whether polygons tile one, told slowly and otherwise than by ``check``."""

import numpy as np
import pytest

from grainlaw.geometry import notched_beam, polygon, semi_disc
from grainlaw.tessellation import Tessellation

SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
SLOPE = polygon([(0, 0), (4, 0), (4, 1), (2, 1), (1, 3), (0, 3)], ["base", "right", "foot", "face", "crest", "left"])
BEAM = notched_beam(0.2, 0.06, notch_depth=0.02, notch_width=1e-4, span=0.16, bearing=0.005)
BEND = semi_disc(0.076, notch_depth=0.019, notch_width=1e-3, span=0.046, bearing=0.004)


def polygon_of(grains: Tessellation, g: int) -> np.ndarray:
    """(n, 2) m."""
    return grains.vertices[grains.corners[grains.first[g] : grains.first[g + 1]]]


def shoelace(points: np.ndarray) -> float:
    """m2."""
    x, y = (points - points[0]).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def assert_tiles(grains: Tessellation) -> None:
    """Areas add up, every grain is convex, every edge has two grains or a side."""
    region = grains.region
    polygons = [polygon_of(grains, g) for g in range(grains.count)]
    assert sum(map(shoelace, polygons)) == pytest.approx(region.area, rel=1e-12)
    runs: dict[tuple[int, int], int] = {}
    for g, points in enumerate(polygons):
        along = np.roll(points, -1, axis=0) - points
        onward = np.roll(along, -1, axis=0)
        turns = np.arctan2(along[:, 0] * onward[:, 1] - along[:, 1] * onward[:, 0], (along * onward).sum(axis=1))
        assert turns.min() > -1e-9
        assert turns.sum() == pytest.approx(2 * np.pi)
        ring = grains.corners[grains.first[g] : grains.first[g + 1]].tolist()
        for pair in zip(ring, ring[1:] + ring[:1], strict=True):
            assert pair not in runs
            runs[pair] = g
    edges = grains.edges
    listed = set(zip(edges.start.tolist(), edges.end.tolist(), strict=True))
    assert len(listed) == len(edges)
    assert listed | {(j, i) for i, j in listed} == set(runs) | {(j, i) for i, j in runs}
    for i, j, left, right, side in zip(edges.start, edges.end, edges.left, edges.right, edges.side, strict=True):
        assert runs[i, j] == left
        assert runs.get((j, i), -1) == right
        assert (side < 0) == (right >= 0)


def assert_sides_complete(grains: Tessellation) -> None:
    """The edges on every boundary are as long as its sides, and all corners of the region are vertices."""
    region, edges = grains.region, grains.edges
    rings = list(zip((region.outline, *region.holes), (region.sides, *region.hole_sides), strict=True))
    for number, name in enumerate(edges.boundary_names):
        side = 0.0
        for ring, names in rings:
            lengths = np.hypot(*(np.roll(ring, -1, axis=0) - ring).T)
            side += sum(length for length, each in zip(lengths, names, strict=True) if each == name)
        assert edges.length[edges.side == number].sum() == pytest.approx(side, rel=1e-12)
    vertices = {tuple(vertex) for vertex in grains.vertices}
    assert {tuple(corner) for ring, _ in rings for corner in ring} <= vertices


def lengths(grains: Tessellation) -> dict[str, float]:
    """m of each boundary that has any."""
    edges = grains.edges
    every = {name: edges.length[edges.side == k].sum() for k, name in enumerate(edges.boundary_names)}
    return {name: pytest.approx(length, rel=1e-9) for name, length in every.items() if length > 0}
