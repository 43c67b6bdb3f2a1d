"""Grains that part touch where they met, or lie apart by the gap that was asked for."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull, HalfspaceIntersection
from tiling import SLOPE, lengths, polygon_of, shoelace

import grainlaw as gl
from grainlaw.geometry import Bricks, Hexagonal, Voronoi, apart, block, bodies, disc, rectangle, together
from grainlaw.geometry.bodies import _shrunk
from grainlaw.mesh import build_mesh


def test_grains_apart_touch_where_they_met() -> None:
    bonded = Voronoi(grains=50).tessellate(SLOPE)
    loose = apart(bonded)
    loose.check()
    assert np.array_equal(loose.vertices, bonded.vertices[bonded.corners])
    assert len(build_mesh(loose).interfaces) == 0
    inner = bonded.edges.length[bonded.edges.right >= 0].sum()
    assert lengths(loose) == {**{k: v.expected for k, v in lengths(bonded).items()}, "grains": 2 * inner}
    assert loose.region is bonded.region


def test_hexagons_lose_half_the_gap_on_every_side() -> None:
    bonded = Hexagonal(grain_size=0.1).tessellate(rectangle(1, 1))
    parted = apart(bonded, 0.01)
    whole = np.flatnonzero(np.isclose(bonded.areas, 0.01, rtol=1e-9))
    apothem = np.sqrt(0.01 / (2 * np.sqrt(3)))
    assert len(whole) > 30
    assert parted.areas[whole] == pytest.approx(2 * np.sqrt(3) * (apothem - 0.005) ** 2, rel=1e-9)


@pytest.mark.thorough
@settings(max_examples=25)
@given(
    seed=st.integers(0, 1000),
    share=st.floats(0, 0.3),
    merge=st.sampled_from([0, 0.25]),
    region=st.sampled_from([SLOPE, disc(3.0), rectangle(3, 2)]),
)
def test_parted_grains_are_what_half_planes_leave(seed: int, share: float, merge: float, region) -> None:
    bonded = Voronoi(grains=40, seed=seed, merge=merge).tessellate(region)
    gap = share * np.sqrt(region.area / 40)
    parted = apart(bonded, gap)
    parted.check()
    edges = bonded.edges
    outside = {(e[0], e[1]) for e in np.column_stack([edges.start, edges.end])[edges.right < 0].tolist()}
    for g in range(bonded.count):
        ring = bonded.corners[bonded.first[g] : bonded.first[g + 1]].tolist()
        planes = []
        for i, j in zip(ring, ring[1:] + ring[:1], strict=True):
            (x, y), (u, v) = bonded.vertices[[i, j]]
            out = np.array([v - y, x - u]) / np.hypot(u - x, v - y)
            planes.append([*out, -out @ (x, y) + (0 if (i, j) in outside else gap / 2)])
        expected = ConvexHull(HalfspaceIntersection(np.array(planes), parted.centroids[g]).intersections).volume
        assert shoelace(polygon_of(parted, g)) == pytest.approx(expected, rel=1e-7)
    kept = {k: v for k, v in lengths(parted).items() if k != "grains"}
    assert set(kept) == set(region.boundary_names)


def test_sides_of_a_triangle_move_each_by_its_own(monkeypatch) -> None:
    """Of 4, 5 and 3 m, by 0.1, 0.5 and 0.2 m: y = 0.1, 3x + 4y = 12 - 2.5, x = 0.2. None is lost, so none is cut."""
    monkeypatch.setattr(bodies, "_cut", None)
    sides = np.array([0.1, 0.5, 0.2])
    made, first = _shrunk(np.array([(0.0, 0), (4, 0), (0, 3)]), np.array([0, 3]), sides, 0.0)
    assert made == pytest.approx(np.array([(0.2, 0.1), (9.1 / 3, 0.1), (0.2, 8.9 / 4)]))
    assert first.tolist() == [0, 3]


@pytest.mark.parametrize("size", [1e-7, 1, 1e6])
def test_only_grains_that_lose_a_side_are_cut_side_by_side(size: float, monkeypatch) -> None:
    """A house whose eaves of 0.1 are too short for sides that move by 0.2, beside a square."""
    cut, whole = [], bodies._cut
    monkeypatch.setattr(bodies, "_cut", lambda points, *more: cut.append(len(points)) or whole(points, *more))
    square, house = [(5, 0), (6, 0), (6, 1), (5, 1)], [(0, 0), (2, 0), (2, 0.1), (1, 1.1), (0, 0.1)]
    points = size * np.array(square + house, dtype=float)
    made, first = _shrunk(points, np.array([0, 4, 9]), np.full(9, 0.2 * size), 0.0)
    assert cut == [5]
    assert first.tolist() == [0, 4, 7]
    low, rise = 0.2, 1.1 - 0.2 * np.sqrt(2)  # the roof's sides rise by 45 degrees to this height
    left = np.array(
        [(5.2, 0.2), (5.8, 0.2), (5.8, 0.8), (5.2, 0.8), (1 - rise + low, low), (1 + rise - low, low), (1, rise)]
    )
    assert sorted((made / size).round(9).tolist()) == sorted(left.round(9).tolist())


def test_a_gap_that_swallows_a_grain_is_refused_by_number() -> None:
    row = together(block([(0, 0), (1, 0), (1, 9), (0, 9)]))  # alone it has no side to move
    assert apart(row, 5.0).areas[0] == 9
    bricks = Bricks(rows=1, columns=3).tessellate(rectangle(3, 9))  # 0 and 2 have one side to move, 1 has two
    assert apart(bricks, 0.9).areas == pytest.approx([9 * 0.55, 9 * 0.1, 9 * 0.55])
    with pytest.raises(gl.ParameterError, match=r"apart: gap = 1 m is not allowed, grain 1 would vanish in it"):
        apart(bricks, 1.0)
    with pytest.raises(gl.ParameterError, match=r"apart: gap = -1 m is not allowed"):
        apart(bricks, -1)


@pytest.mark.thorough
def test_a_hundred_thousand_loose_grains_are_light() -> None:
    bonded = Bricks(rows=320, columns=320).tessellate(rectangle(1, 1))
    tracemalloc.start()
    loose = apart(bonded, 1e-4)
    loose.check()
    mesh = build_mesh(loose)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 500e6
    assert len(mesh.nodes) == 5 * 320**2
    assert loose.areas.sum() == pytest.approx((1 - 319e-4) ** 2)  # each row and column loses 319 gaps
