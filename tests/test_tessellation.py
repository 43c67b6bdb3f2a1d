"""What every tessellation must hold, tried on every tessellator; what they refuse; short edges."""

from __future__ import annotations

import inspect

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiling import assert_sides_complete, assert_tiles

from grainlaw import geometry
from grainlaw.fields import ParameterError
from grainlaw.geometry import (
    Breakable,
    Bricks,
    Cracked,
    Hexagonal,
    Jointed,
    JointSets,
    Laguerre,
    Minerals,
    Voronoi,
    rectangle,
)
from grainlaw.geometry.cells import grain_size
from grainlaw.geometry.cells.bounded_voronoi import bounded_diagram, polygons
from grainlaw.geometry.cells.joining import tiling_of
from grainlaw.geometry.cells.seeds import hilbert_order
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation, Tessellator

TESSELLATORS = [Hexagonal, Voronoi]
TRIANGLE = Region([(0, 0), (4, 0), (1, 3)], ("base", "flank", "flank"))
DISC = Region([(np.cos(a), np.sin(a)) for a in np.arange(64) * np.pi / 32], ["jaw", *["rim"] * 63])

every = pytest.mark.parametrize("tessellator", TESSELLATORS)


def test_all_tessellators_are_tried() -> None:
    exported = [getattr(geometry, name) for name in geometry.__all__]
    made = {each for each in exported if inspect.isclass(each) and issubclass(each, Tessellator)}
    others = {Breakable, Cracked, Jointed, JointSets, Laguerre, Minerals}  # have tests of their own
    assert made == {Bricks, *others, *TESSELLATORS}


@pytest.mark.thorough
@every
@settings(max_examples=40)
@given(
    width=st.floats(1e-6, 1e3),
    slenderness=st.floats(0.02, 50),
    grains=st.one_of(st.integers(1, 3), st.integers(1, 60)),
)
def test_tiles_any_rectangle(tessellator: type, width: float, slenderness: float, grains: int) -> None:
    made = tessellator(grains=grains).tessellate(rectangle(width, width * slenderness))
    assert_tiles(made)
    assert_sides_complete(made)


@every
@pytest.mark.parametrize("region", [TRIANGLE, DISC])
@pytest.mark.parametrize("grains", [1, 2, 7, 150])
def test_tiles_other_convex_regions(tessellator: type, region: Region, grains: int) -> None:
    made = tessellator(grains=grains).tessellate(region)
    assert_tiles(made)
    assert_sides_complete(made)


@every
def test_same_component_makes_the_same_grains(tessellator: type) -> None:
    first, second = (tessellator(grains=80).tessellate(rectangle(1, 2)) for _ in range(2))
    assert np.array_equal(first.vertices, second.vertices)
    assert np.array_equal(first.corners, second.corners)


def test_seed_and_relaxation_make_other_grains() -> None:
    made = [Voronoi(grains=80, seed=s, relaxation=r).tessellate(rectangle(1, 2)) for s, r in ((1, 3), (2, 3), (1, 4))]
    for other in made[1:]:
        assert not np.allclose(made[0].centroids, other.centroids)


def test_relaxation_makes_grains_even() -> None:
    made = [Voronoi(grains=400, relaxation=r, merge=0).tessellate(rectangle(1, 1)) for r in (0, 1, 3, 20)]
    spread = [400 * np.std(grains.areas) for grains in made]
    assert np.all(np.diff(spread) < -0.05)
    # Cells of independent seeds: variance 0.280 (Gilbert 1962, doi:10.1214/aoms/1177704464).
    assert spread[0] == pytest.approx(np.sqrt(0.280), abs=0.05)


def test_hilbert_curve_never_jumps() -> None:
    grid = np.argwhere(np.ones((32, 32))).astype(float)
    steps = np.diff(grid[hilbert_order(grid)], axis=0)
    assert np.all(abs(steps).sum(axis=1) == 1)


@pytest.mark.thorough
@every
def test_numbers_follow_space(tessellator: type) -> None:
    edges = tessellator(grains=3000).tessellate(rectangle(1, 2)).edges
    apart = abs(edges.left - edges.right)[edges.right >= 0]
    assert np.median(apart) <= 5
    assert apart.mean() < 60  # 1,000 at random


@every
def test_mean_area_is_the_square_of_the_grain_size(tessellator: type) -> None:
    region = rectangle(3, 4)
    by_number = tessellator(grains=300).tessellate(region)
    by_size = tessellator(grain_size=0.2).tessellate(region)
    assert np.allclose(by_number.vertices, by_size.vertices, rtol=0, atol=1e-9)
    assert by_number.count == pytest.approx(300, rel=0 if tessellator is Voronoi else 0.1)


@pytest.mark.thorough
def test_inner_hexagons_are_regular() -> None:
    made = Hexagonal(grain_size=0.05).tessellate(rectangle(1, 1))
    inner = np.flatnonzero(abs(made.centroids - 0.5).max(axis=1) < 0.4)
    assert len(inner) > 200
    assert np.all(np.diff(made.first)[inner] == 6)
    assert made.areas[inner] == pytest.approx(0.05**2, rel=1e-9)
    side = 0.05 * np.sqrt(2 / np.sqrt(27))
    assert made.edges.length[np.isin(made.edges.left, inner)] == pytest.approx(side, rel=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_short_edges_are_merged(seed: int) -> None:
    region, size = rectangle(50e-3, 125e-3), np.sqrt(50e-3 * 125e-3 / 755)
    kept, merged = (Voronoi(grains=755, seed=seed, merge=m).tessellate(region) for m in (0, 0.25))
    assert (kept.edges.length < 0.25 * size).mean() > 0.1
    assert merged.edges.length.min() > 0.25 * size
    assert merged.count == kept.count == 755
    assert_tiles(merged)


@pytest.mark.parametrize("merge", [0.5, 0.95])
def test_merging_gives_way_to_convexity(merge: float) -> None:
    made = Voronoi(grains=120, relaxation=0, merge=merge).tessellate(DISC)
    assert_tiles(made)
    assert_sides_complete(made)
    assert np.diff(made.first).min() >= 3


def test_hardly_any_short_edge_is_left_among_uneven_grains() -> None:
    made = Voronoi(grains=3000, relaxation=0).tessellate(rectangle(1, 1))
    assert (made.edges.length < 0.25 / np.sqrt(3000)).mean() < 2e-3


def test_diagram_reaches_sides_far_from_all_seeds() -> None:
    region = rectangle(1, 1)
    made = polygons(region, bounded_diagram(region, np.random.default_rng(1).random((200, 2)) / 20)).tessellation()
    assert_tiles(made)
    assert_sides_complete(made)


def test_diagram_knows_its_centroids() -> None:
    diagram = bounded_diagram(DISC, np.random.default_rng(1).random((150, 2)) / 2)
    assert diagram.centroids() == pytest.approx(polygons(DISC, diagram).tessellation().centroids)


@every
def test_result_is_checked(tessellator: type, monkeypatch) -> None:
    checked = []
    monkeypatch.setattr(Tessellation, "check", lambda self: checked.append(self))
    made = tessellator(grains=5).tessellate(rectangle(1, 1))
    assert checked == [made]


@pytest.mark.thorough
def test_large() -> None:
    made = Voronoi(grains=20_000).tessellate(rectangle(1, 1))
    assert made.count == 20_000
    assert (made.edges.length < 0.25 / np.sqrt(20_000)).mean() < 1e-3
    assert_sides_complete(made)


@every
def test_corners_of_edges_are_their_vertices(tessellator: type) -> None:
    made = tessellator(grains=40).tessellate(rectangle(1, 1))
    edges, inner = made.edges, made.edges.right >= 0
    ends = np.column_stack([edges.start, edges.end])
    grain = np.repeat(np.arange(made.count), np.diff(made.first))
    assert np.array_equal(made.corners[edges.left_corners], ends)
    assert np.array_equal(made.corners[edges.right_corners[inner]], ends[inner])
    assert np.array_equal(grain[edges.left_corners], np.column_stack([edges.left] * 2))
    assert np.array_equal(grain[edges.right_corners[inner]], np.column_stack([edges.right[inner]] * 2))
    assert (edges.right_corners[~inner] == -1).all()


@every
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "give either grains or grain_size, not neither"),
        ({"grains": 5, "grain_size": 0.1}, "give either grains or grain_size, not both"),
        ({"grains": 0}, "grains = 0 is not allowed, it must be a whole number, at least 1"),
        ({"grains": 7.5}, "grains = 7.5 is not allowed"),
        ({"grains": np.nan}, "grains = nan is not allowed"),
        ({"grains": "7"}, "grains = '7' is not allowed"),
        ({"grains": True}, "grains = True is not allowed"),
        ({"grain_size": 0}, "grain_size = 0 m is not allowed, it must be a finite number above 0"),
        ({"grain_size": np.inf}, "grain_size = inf m is not allowed"),
    ],
)
def test_size_refused(tessellator: type, arguments: dict, message: str) -> None:
    with pytest.raises(ParameterError, match=f"{tessellator.__name__}: {message}"):
        tessellator(**arguments)


@pytest.mark.parametrize(
    ("name", "value"), [("seed", -1), ("seed", 1.5), ("relaxation", -1), ("merge", -0.1), ("merge", 1), ("seed", None)]
)
def test_voronoi_refuses(name: str, value: object) -> None:
    with pytest.raises(ParameterError, match=f"Voronoi: {name} = {value}"):
        Voronoi(grains=5, **{name: value})


@every
def test_grain_size_must_fit_the_region(tessellator: type) -> None:
    with pytest.raises(ParameterError, match=r"grain_size = 2\.5 m is not allowed, it must be at most 2 m"):
        tessellator(grain_size=2.5).tessellate(rectangle(2, 9))


@every
def test_more_grains_than_memory_are_refused_before_any_work(tessellator: type, monkeypatch) -> None:
    monkeypatch.setattr(grain_size, "_memory", lambda: 10_000_000)
    with pytest.raises(ParameterError, match=r"grains = 1001 is not allowed, the memory .* holds about 1000 grains"):
        tessellator(grains=1001).tessellate(rectangle(1, 1))
    with pytest.raises(ParameterError, match="which makes 1000000 grains, is not allowed"):
        tessellator(grain_size=1e-3).tessellate(rectangle(1, 1))
    assert tessellator(grains=1000).tessellate(rectangle(1, 1)).count > 500


def test_memory_is_what_the_system_tells(monkeypatch) -> None:
    assert 2**28 < grain_size._memory() < 2**60
    monkeypatch.delattr("os.sysconf")
    assert Voronoi(grains=5).tessellate(rectangle(1, 1)).count == 5


@settings(max_examples=30)
@given(width=st.floats(1e-6, 1e3), slenderness=st.floats(0.02, 50), rows=st.integers(1, 7), columns=st.integers(1, 7))
def test_bricks_are_equal_and_in_rows(width: float, slenderness: float, rows: int, columns: int) -> None:
    made = Bricks(rows=rows, columns=columns).tessellate(rectangle(width, width * slenderness))
    assert_tiles(made)
    assert made.areas == pytest.approx(np.full(rows * columns, width * width * slenderness / (rows * columns)))
    middle = made.centroids.reshape(rows, columns, 2)
    assert np.all(np.diff(middle[..., 1], axis=0) > 0)
    assert np.all(np.diff(middle[..., 0], axis=1) > 0)


@pytest.mark.parametrize("region", [TRIANGLE, DISC, Region([(0, 1), (1, 0), (2, 1), (1, 2)], tuple("abcd"))])
def test_bricks_need_an_upright_rectangle(region: Region) -> None:
    with pytest.raises(ParameterError, match=r"Bricks: region .* upright rectangle"):
        Bricks().tessellate(region)


def test_own_points_make_the_cells() -> None:
    """Three points: areas by hand from the perpendicular bisectors."""
    made = Voronoi(points=[(0.25, 0.25), (0.25, 0.75), (0.75, 0.5)], merge=0).tessellate(rectangle(1, 1))
    # The third cell begins at x = 7/16 on the middle line and at x = 11/16 at the top and the bottom.
    assert sorted(made.areas) == pytest.approx([9 / 32, 9 / 32, 14 / 32])
    assert_tiles(made)
    slit = Region([(0, 0), (0.9, 0), (0.9, 3), (1.1, 3), (1.1, 0), (2, 0), (2, 4), (0, 4)], ("side",) * 8)
    assert_tiles(Voronoi(points=[(0.5, 1), (0.4, 3), (1.5, 2)]).tessellate(slit))


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(0.2, 0.2), (1.5, 0.5)], r"points\[1\] = \(1\.5, 0\.5\) m is not inside the region"),
        ([(0.2, 0.2), (0.5, 0)], r"points\[1\] = \(0\.5, 0\.0\) m is not inside the region"),
        ([(0.2, 0.2), (0.5, 0.5)] * 2, r"points\[0\] and points\[2\] = \(0\.2, 0\.2\) m are the same"),
    ],
)
def test_own_points_refused(points: list, message: str) -> None:
    with pytest.raises(ParameterError, match=f"Voronoi: {message}"):
        Voronoi(points=points).tessellate(rectangle(1, 1))


@pytest.mark.parametrize("points", [[], [(1, 2, 3)], [(0, np.nan)], "middle", 3])
def test_own_points_are_points(points: object) -> None:
    with pytest.raises(ParameterError, match="Voronoi: points = "):
        Voronoi(points=points)
    with pytest.raises(ParameterError, match="give either grains or grain_size, not grains and points, or points"):
        Voronoi(grains=3, points=[(1, 1)])


@pytest.mark.parametrize("shift", [0.0, 1.0])
def test_a_corner_on_an_edge_becomes_one_of_its_polygon(shift: float) -> None:
    """Two bricks on one, wherever the origin lies: the corner between them is not in the middle."""
    region = Region(np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) + shift, ("bottom", "right", "top", "left"))
    lower, left = [(-1, -1), (1, -1), (1, 0), (-1, 0)], [(-1, 0), (0.7, 0), (0.7, 1), (-1, 1)]
    points = np.array([*lower, *left, (0.7, 0), (1, 0), (1, 1), (0.7, 1)]) + shift
    made = tiling_of(region, points, np.array([0, 4, 8, 12]), 1e-9)
    ring = made.vertices[made.corners[: made.first[1]]] - shift
    assert ring == pytest.approx(np.array([*lower[:3], (0.7, 0), lower[3]]))
    assert np.diff(made.first).tolist() == [5, 4, 4]
