"""What several tests of grains share: whether polygons tile a region, told slowly and by other means than ``check``."""

import numpy as np
import pytest

from grainlaw.tessellation import Tessellation


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
