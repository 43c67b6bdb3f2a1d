"""Grains of prescribed areas: tiling, closed forms, invariance, circularity, concave regions, what is refused."""

from __future__ import annotations

from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiling import BEAM, BEND, assert_sides_complete, assert_tiles, polygon_of, shoelace

from grainlaw.fields import ParameterError
from grainlaw.geometry import Bricks, Empirical, Even, Laguerre, Lognormal, disc, polygon, rectangle
from grainlaw.geometry.cells import area_cells
from grainlaw.geometry.cells.any_voronoi import frame
from grainlaw.geometry.cells.area_cells import AreaFit, _Moves, _toward, areas_cells
from grainlaw.geometry.cells.area_fit import PowerCells, fitted, inside_areas
from grainlaw.geometry.cells.bounded_voronoi import bounded_diagram
from grainlaw.geometry.cells.power_diagram import _edges, power_diagram
from grainlaw.region import Region

TRIANGLE = Region([(0, 0), (4, 0), (1, 3)], ("base", "flank", "flank"))
SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]
RING = [(2 + np.cos(a), 2 + np.sin(a)) for a in np.arange(9) * 2 * np.pi / 9]
HOLED = polygon(SQUARE, holes={"hole": RING})
ELL = polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
CONVEX = {"rectangle": rectangle(0.05, 0.125), "triangle": TRIANGLE, "disc": disc(0.05)}
CONCAVE = {"beam": BEAM, "semi-disc": BEND, "holed": HOLED, "L": ELL}

deviations = st.floats(0, 0.7)


@pytest.mark.thorough
@settings(max_examples=40)
@given(
    region=st.sampled_from(list(CONVEX.values())),
    grains=st.one_of(st.integers(1, 4), st.integers(5, 200)),
    deviation=deviations,
    seed=st.integers(0, 999),
    relaxation=st.integers(0, 7),
    merge=st.sampled_from([0, 0.25, 0.4]),
)
def test_areas_are_as_asked(region, grains, deviation, seed, relaxation, merge) -> None:
    sizes = Lognormal(deviation=deviation)
    fit = Laguerre(grains=grains, sizes=sizes, seed=seed, relaxation=relaxation, merge=merge).fit(region)
    asked = sizes.draw(grains, np.random.default_rng(seed))
    areas = np.array([shoelace(polygon_of(fit.tessellation, g)) for g in range(grains)])
    assert fit.asked == pytest.approx(asked / asked.sum() * region.area)
    assert fit.largest_before <= 0.01
    assert abs(areas / fit.asked[fit.owner] - 1).max() == pytest.approx(fit.largest_after, abs=1e-9)
    assert fit.largest_after <= 0.02
    assert sorted(fit.owner) == list(range(grains))
    assert_tiles(fit.tessellation)
    assert_sides_complete(fit.tessellation)


@pytest.mark.thorough
@settings(max_examples=30)
@given(width=st.floats(1e-6, 1e3), slenderness=st.floats(0.05, 20), grains=st.integers(1, 60), seed=st.integers(0, 99))
def test_any_rectangle_is_tiled(width, slenderness, grains, seed) -> None:
    fit = Laguerre(grains=grains, seed=seed).fit(rectangle(width, width * slenderness))
    assert_tiles(fit.tessellation)
    assert_sides_complete(fit.tessellation)
    assert fit.largest_after <= 0.02


@pytest.mark.thorough
@settings(max_examples=25)
@given(
    region=st.sampled_from(list(CONCAVE.values())),
    grains=st.integers(1, 150),
    deviation=st.floats(0, 0.5),
    seed=st.integers(0, 999),
)
def test_concave_regions_are_tiled(region, grains, deviation, seed) -> None:
    fit = Laguerre(grains=grains, sizes=Lognormal(deviation=deviation), seed=seed).fit(region)
    assert_tiles(fit.tessellation)
    assert_sides_complete(fit.tessellation)
    assert set(fit.owner) == set(range(grains))
    assert fit.after.sum() == pytest.approx(region.area)


@pytest.mark.thorough
@pytest.mark.parametrize("name", CONCAVE)
@pytest.mark.parametrize("grains", [40, 300])
def test_areas_inside_concave_regions(name: str, grains: int) -> None:
    for seed in range(3):
        fit = Laguerre(grains=grains, sizes=Lognormal(deviation=0.4), seed=seed).fit(CONCAVE[name])
        assert fit.largest_after < 0.02
        assert fit.tessellation.count <= grains + 12


@pytest.mark.parametrize("seed", [3, 5])
def test_seeds_ask_for_less_by_what_they_inherit_out_of_the_sight_of_others(seed: int) -> None:
    """Behind the notch of half a disc; asked for as elsewhere, one grain would miss its area by 0.8 and 4 %."""
    fit = Laguerre(grains=40, sizes=Lognormal(deviation=0.4), seed=seed).fit(CONCAVE["semi-disc"])
    assert fit.largest_before < 0.005


def test_two_seeds_have_the_power_line_between_them() -> None:
    """In a unit square, at (0.25, 0.5) and (0.75, 0.5): x = 1/2 + (w1 - w2) / (2 d) with d = 1/2."""
    seeds, unit = np.array([(0.25, 0.5), (0.75, 0.5)]), rectangle(1, 1)
    for difference in (-0.2, 0, 0.1, 0.4):
        areas = power_diagram(unit, seeds, np.array([difference, 0]), 1.0).areas()
        assert areas == pytest.approx([0.5 + difference, 0.5 - difference])
    cells = fitted(PowerCells(unit, unit, seeds, np.zeros(2), 1.0), np.array([0.8, 0.2]), 1e-9)
    assert cells.weights[0] - cells.weights[1] == pytest.approx(0.3)


def test_edges_of_triangles_know_those_on_both_sides() -> None:
    ends, beside = _edges(np.array([[1, 3, 2], [0, 1, 3]]), 4)
    assert ends.tolist() == [[0, 1], [0, 3], [1, 2], [1, 3], [2, 3]]
    assert beside.tolist() == [[1, -1], [1, -1], [0, -1], [0, 1], [0, -1]]


def test_a_seed_may_lie_outside_its_cell() -> None:
    areas = power_diagram(rectangle(1, 1), np.array([(0.4, 0.5), (0.6, 0.5)]), np.array([-0.1, 0]), 1.0)
    x = areas.vertices[areas.start[areas.seed == 0], 0]
    assert x.max() == pytest.approx(0.25)  # 1/2 - 0.1 / 0.4


@pytest.mark.parametrize("region", CONVEX.values(), ids=CONVEX)
def test_equal_weights_are_voronoi(region: Region) -> None:
    random = np.random.default_rng(2)
    seeds = np.array([c for c in region.bounds[0] + random.random((300, 2)) * np.ptp(region.bounds, axis=0)])
    seeds = seeds[region.contains(seeds)]
    power = power_diagram(region, seeds, np.full(len(seeds), 0.3 * region.area), 0.01 * np.sqrt(region.area))
    voronoi = bounded_diagram(region, seeds)
    assert power.areas() == pytest.approx(voronoi.areas(), rel=1e-9, abs=1e-12 * region.area)
    assert power.centroids() == pytest.approx(voronoi.centroids())


@pytest.mark.thorough
@settings(max_examples=20)
@given(seed=st.integers(0, 999), grains=st.integers(2, 80))
def test_a_point_belongs_to_the_least_power(seed: int, grains: int) -> None:
    """Areas by counting points, told from the definition alone."""
    random, region = np.random.default_rng(seed), rectangle(2, 1)
    seeds = random.random((grains, 2)) * [2, 1]
    weights = random.random(grains) / grains
    x, y = np.meshgrid((np.arange(400) + 0.5) / 200, (np.arange(200) + 0.5) / 200)
    points = np.column_stack([x.ravel(), y.ravel()])
    power = ((points[:, None] - seeds) ** 2).sum(axis=2) - weights
    counted = np.bincount(power.argmin(axis=1), minlength=grains) / 40_000
    areas = power_diagram(region, seeds, weights, 1.0).areas()
    assert areas == pytest.approx(counted, abs=0.012)
    assert areas.sum() == pytest.approx(2)


@pytest.mark.thorough
@pytest.mark.parametrize("name", CONCAVE)
def test_areas_inside_a_region_by_counting(name: str) -> None:
    region, random = CONCAVE[name], np.random.default_rng(5)
    low, extent = region.bounds[0], np.ptp(region.bounds, axis=0)
    seeds = low + random.random((60, 2)) * extent
    seeds = seeds[region.contains(seeds)]
    weights = random.random(len(seeds)) * region.area / 60
    around = frame(region)
    diagram = power_diagram(around, seeds, weights, extent.max())
    areas, share = inside_areas(region, around, diagram, weights)
    points = low + random.random((200_000, 2)) * extent
    points = points[region.contains(points)]
    power = ((points[:, None] - seeds) ** 2).sum(axis=2) - weights
    counted = np.bincount(power.argmin(axis=1), minlength=len(seeds)) / len(points)
    assert areas / region.area == pytest.approx(counted, abs=0.003)
    assert areas.sum() == pytest.approx(region.area, rel=1e-12)
    assert share.min() > -1e-9
    assert share.max() < 1 + 1e-9


def test_slope_of_areas_is_edge_length_over_twice_the_distance() -> None:
    region, random = HOLED, np.random.default_rng(3)
    seeds = random.random((80, 2)) * 4
    seeds = seeds[region.contains(seeds)]
    cells = PowerCells(region, frame(region), seeds, np.zeros(len(seeds)), 4.0)
    for g in (0, 7, 20):
        nudge = np.zeros(len(seeds))
        nudge[g] = 1e-5
        there, here = (PowerCells(region, cells.frame, seeds, sign * nudge, 4.0).areas for sign in (1, -1))
        change = cells.change(cells.areas + (there - here) / 2)
        assert change - change.mean() == pytest.approx(nudge - nudge.mean(), abs=2e-8)


@pytest.mark.thorough
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_even_grains_have_equal_areas_and_seeds_at_centroids(seed: int) -> None:
    fit = Laguerre(grains=200, sizes=Even(), relaxation=60, merge=0, seed=seed).fit(rectangle(1, 1))
    assert fit.after * 200 == pytest.approx(np.ones(200), abs=5e-3)
    free = Laguerre(grains=200, sizes=Even(), relaxation=0, merge=0, seed=seed).fit(rectangle(1, 1))
    assert fit.circularity.mean() > 0.83 > 0.72 > free.circularity.mean()


@pytest.mark.thorough
@settings(max_examples=15)
@given(wanted=st.floats(0.7, 0.81), seed=st.integers(0, 99), deviation=st.floats(0.1, 0.5))
def test_circularity_is_as_asked(wanted: float, seed: int, deviation: float) -> None:
    sizes = Lognormal(deviation=deviation)
    made = Laguerre(grains=250, sizes=sizes, seed=seed, circularity=wanted).fit(rectangle(1, 1))
    grains = made.tessellation
    perimeter = np.zeros(grains.count)
    for g in range(grains.count):
        corners = polygon_of(grains, g)
        perimeter[g] = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T).sum()
    assert (4 * np.pi * grains.areas / perimeter**2).mean() == pytest.approx(wanted, abs=0.01)
    assert made.largest_after <= 0.02


@pytest.mark.thorough
def test_circularity_out_of_reach_is_told() -> None:
    with pytest.raises(
        ParameterError, match=r"circularity = 0\.9 is not allowed, grains of these sizes reach up to 0\.8"
    ):
        Laguerre(grains=80, circularity=0.9).tessellate(rectangle(1, 1))
    with pytest.raises(ParameterError, match=r"circularity = 0\.2 is not allowed, .* reach from 0\.[67]"):
        Laguerre(grains=80, circularity=0.2).tessellate(rectangle(1, 1))


@pytest.mark.thorough
@settings(max_examples=15)
@given(scale=st.floats(1e-4, 1e4), x=st.floats(-50, 50), y=st.floats(-50, 50))
def test_grains_move_and_grow_with_their_region(scale: float, x: float, y: float) -> None:
    maker = Laguerre(grains=60, relaxation=2)
    plain = maker.tessellate(rectangle(1, 2))
    corners = (plain.region.outline + np.array([x, y])) * scale
    moved = maker.tessellate(polygon(corners))
    assert moved.vertices / scale - [x, y] == pytest.approx(plain.vertices, abs=1e-6)
    assert np.array_equal(moved.corners, plain.corners)


@pytest.mark.thorough
def test_same_seed_same_bits() -> None:
    for region in (rectangle(1, 2), HOLED):
        first, second = (Laguerre(grains=80, seed=3).tessellate(region) for _ in range(2))
        assert np.array_equal(first.vertices, second.vertices)
        assert np.array_equal(first.corners, second.corners)
        other = Laguerre(grains=80, seed=4).tessellate(region)
        assert not np.array_equal(first.centroids[:20], other.centroids[:20])


def test_given_areas_are_met_in_their_order() -> None:
    areas = np.array([1.0, 2, 3, 4, 5, 5]) / 20 * 8
    fit = Laguerre(areas=areas).fit(rectangle(2, 4))
    assert fit.tessellation.areas == pytest.approx(areas[fit.owner], rel=0.01)
    assert fit.after == pytest.approx(areas, rel=0.01)


def test_own_seeds_stay_without_rounds() -> None:
    seeds = np.array([(0.2, 0.2), (0.7, 0.3), (0.5, 0.8)])
    fit = areas_cells(rectangle(1, 1), np.ones(3), seeds, rounds=0, merge=0)
    power = np.array([((fit.tessellation.centroids - seed) ** 2).sum(axis=1) for seed in seeds])
    assert power.argmin(axis=0).tolist() == fit.owner.tolist()
    assert fit.after == pytest.approx(np.full(3, 1 / 3), rel=0.005)


@pytest.mark.parametrize("seed", [1, 2])
def test_short_edges_are_merged_beside_small_and_large_grains(seed: int) -> None:
    made = [Laguerre(grains=755, seed=seed, merge=m).tessellate(rectangle(0.05, 0.125)) for m in (0, 0.25)]
    left = []
    for grains in made:
        size, edges = np.sqrt(grains.areas), grains.edges
        smallest = np.full(len(grains.vertices), np.inf)
        np.minimum.at(smallest, grains.corners, np.repeat(size, np.diff(grains.first)))
        left.append((edges.length < 0.24 * np.minimum(smallest[edges.start], smallest[edges.end])).mean())
    assert left[0] > 0.07
    assert left[1] < 0.01


def test_report_says_what_is_met() -> None:
    text = str(Laguerre(grains=50, sizes=Empirical(diameters=[1, 2])).fit(rectangle(1, 1)))
    assert "50 areas, 50 grains, mean circularity 0." in text
    assert "before merging: largest 0." in text


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "give either grains or grain_size, not neither, or areas"),
        ({"grains": 5, "areas": [1, 2]}, "not grains and areas"),
        ({"areas": [1, -2]}, r"areas = \[1, -2\] is not allowed"),
        ({"areas": [1, 1e-9]}, "number 1 is 2e-09 of their mean"),
        ({"areas": "large"}, "areas = 'large' is not allowed"),
        ({"grains": 5, "circularity": 0.95}, r"circularity = 0\.95 is not allowed, .* hexagons"),
        ({"grains": 5, "circularity": "round"}, "circularity = 'round' is not allowed"),
        ({"grains": 5, "sizes": "lognormal"}, "sizes = 'lognormal' is not allowed, it must be a Sizes"),
        ({"grains": 5, "relaxation": -1}, "relaxation = -1"),
        ({"grains": 5, "merge": 1}, "merge = 1"),
    ],
)
def test_refused(arguments: dict, message: str) -> None:
    with pytest.raises(ParameterError, match=f"Laguerre: .*{message}"):
        Laguerre(**arguments)


def test_areas_that_do_not_fit_are_refused_before_any_work(monkeypatch) -> None:
    monkeypatch.setattr("grainlaw.geometry.cells.area_fit.power_diagram", None)
    with pytest.raises(ParameterError, match=r"areas are not allowed, they add up to 3 m2, the region has 2 m2"):
        Laguerre(areas=[1, 2]).tessellate(rectangle(1, 2))
    with pytest.raises(ParameterError, match="memory"):
        Laguerre(grains=10**12).tessellate(rectangle(1, 2))


def test_seeds_between_two_rounds_are_on_the_way() -> None:
    """A quarter of it, and where that leads out of the region they stay."""
    places = [(0.3, 0.2), (1.8, 0.9)], [(0.7, 0.6), (0.9, 1.8)], [(1.7, 0.6), (1.9, 0.8)]
    areas = np.array([1.0, 2.0])
    made = [PowerCells(ELL, frame(ELL), np.array(each), np.zeros(2), 4.0) for each in places]
    moves = _Moves(areas, iter(made))
    assert moves.after(0.25).seeds == pytest.approx(np.array([(0.4, 0.3), (1.8, 0.9)]))
    assert moves.after(1) is made[1]
    assert moves.after(1.5).seeds == pytest.approx(np.array([(1.2, 0.6), (0.9, 1.8)]))


@pytest.mark.parametrize("wanted", [0.6005, 0.63, 0.7, 0.75, 0.78, 0.799])
def test_rounds_are_searched_for_a_circularity(wanted: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Grains that grow rounder from 0.6 to 0.8 with the rounds; within them 0.003 is met."""
    tried = []
    monkeypatch.setattr(area_cells, "first_cells", lambda *_: (None, np.ones(3), np.arange(3)))
    monkeypatch.setattr(area_cells, "rounds_of", lambda *_: iter([]))
    monkeypatch.setattr(_Moves, "after", lambda self, number: tried.append(number) or number)
    monkeypatch.setattr(
        area_cells, "grains_of",
        lambda number, *_: SimpleNamespace(circularity=np.array([0.5, 0.7]) + 0.2 * (1 - np.exp(-number / 9))),
    )  # fmt: skip
    fit = area_cells.grains_of_circularity("Laguerre", None, np.ones(3), None, wanted, 0.25)
    assert fit.circularity.mean() == pytest.approx(wanted, abs=0.003)
    assert max(tried) <= 60
    for beyond, words in ((0.59, r"reach from 0\.600 in"), (0.81, r"reach up to 0\.800 in")):
        with pytest.raises(ParameterError, match=rf"Laguerre: circularity = {beyond} is not allowed.*{words}"):
            area_cells.grains_of_circularity("Laguerre", None, np.ones(3), None, beyond, 0.25)


def test_errors_of_areas_by_hand() -> None:
    """Two grains have the second area; errors of 0.3 and -0.1 before, of 0.05 and -0.1 after."""
    grains = Bricks(rows=1, columns=3).tessellate(rectangle(3, 2))
    fit = AreaFit(grains, np.array([1, 0, 1]), np.array([2 / 1.05, 4 / 0.9]), np.array([2.6 / 1.05, 4.0]))
    assert fit.after == pytest.approx([2, 4])
    assert (fit.largest_before, fit.rms_before) == pytest.approx((0.3, np.sqrt((0.09 + 0.01) / 2)))
    assert (fit.largest_after, fit.rms_after) == pytest.approx((0.1, np.sqrt((0.0025 + 0.01) / 2)))
    assert fit.circularity == pytest.approx(np.full(3, 4 * np.pi * 2 / 6**2))
    assert str(fit) == (
        "2 areas, 3 grains, mean circularity 0.698\n"
        "error of the areas before merging: largest 30.00%, rms 22.36%\n"
        "error of the areas of the grains:  largest 10.00%, rms 7.91%"
    )


MET: list[float] = []  # errors of the areas, from correction to correction


@attrs.frozen
class Steep:
    """Areas that follow an arc tangent, on which Newton's method without halved steps runs away from 1.4 on."""

    weights: np.ndarray
    before: None = None
    diagram = None

    @property
    def areas(self) -> np.ndarray:
        share = np.arctan(self.weights[0] - self.weights[1]) / np.pi
        return np.array([0.5 + share, 0.5 - share])

    def error(self, areas: np.ndarray) -> float:
        return float(abs(self.areas / areas - 1).max())

    def change(self, areas: np.ndarray) -> np.ndarray:
        MET.append(self.error(areas))
        slope = 1 / np.pi / (1 + (self.weights[0] - self.weights[1]) ** 2)
        return np.array([(areas - self.areas)[0] / slope, 0])


def test_steps_that_lead_away_are_halved() -> None:
    MET.clear()
    found = fitted(Steep(np.array([3.0, 0.0])), np.array([0.5, 0.5]), 1e-9)
    assert np.all(np.diff(MET) < 0)
    assert found.weights == pytest.approx([0, 0], abs=1e-8)


def test_a_step_goes_the_whole_way_unless_a_cell_would_be_empty() -> None:
    """Two squares of 1 m2, whose areas are linear in the weights; half of the way to a negative area leaves 0.25."""
    region = rectangle(2, 1)
    squares = PowerCells(region, region, np.array([(0.5, 0.5), (1.5, 0.5)]), np.zeros(2), 2.0)
    assert _toward(squares, np.array([1.2, 0.8]), 0.8).areas == pytest.approx([1.2, 0.8], rel=1e-9)
    assert _toward(squares, np.array([2.5, -0.5]), 0.02).areas == pytest.approx([1.75, 0.25], rel=1e-9)
    small = _toward(squares, np.array([1.997, 0.003]), 0.003)
    assert _toward(small, np.array([1.9978, 0.0022]), 0.5).areas[1] == pytest.approx(0.0022, rel=1e-6)
