"""Diagrams made from the one before are those of a convex hull, or are not made; and large systems of equations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array, csc_array, diags_array, eye_array
from test_laguerre import CONCAVE, CONVEX
from tiling import assert_sides_complete, assert_tiles

from grainlaw.geometry import Laguerre, Lognormal, disc, rectangle
from grainlaw.geometry.cells import area_fit, moved_cells, sparse_solve
from grainlaw.geometry.cells.area_fit import PowerCells, round_cells
from grainlaw.geometry.cells.bounded_voronoi import Diagram
from grainlaw.geometry.cells.moved_cells import moved_diagram
from grainlaw.geometry.cells.power_diagram import power_diagram
from grainlaw.geometry.cells.seeds import hilbert_order
from grainlaw.geometry.cells.sparse_solve import solved
from grainlaw.region import Region

REGIONS = {**CONVEX, "strip": rectangle(4, 0.1)}


@pytest.fixture
def interpreted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compilation takes 2 s."""
    for name in ("_cells", "_at_odds"):
        monkeypatch.setattr(moved_cells, name, getattr(moved_cells, name).py_func)


def scattered(region: Region, count: int, random: np.random.Generator) -> np.ndarray:
    seeds = region.bounds[0] + random.random((20 * count, 2)) * np.ptp(region.bounds, axis=0)
    return seeds[region.contains(seeds)][:count]


@pytest.mark.thorough
@settings(max_examples=25)
@given(
    region=st.sampled_from(list(REGIONS.values())),
    count=st.integers(2, 150),
    step=st.floats(0, 0.4),
    spread=st.floats(0, 0.3),
    seed=st.integers(0, 999),
)
@example(region=rectangle(0.05, 0.125), count=106, step=0.0, spread=0.25, seed=242)  # the last cell is empty
@example(region=rectangle(0.05, 0.125), count=145, step=0.1875, spread=0.033203125, seed=252)  # overlap by 5e-7
def test_cells_are_those_of_the_convex_hull(region, count, step, spread, seed) -> None:
    """Seeds that move by up to a third of their distance, with weights up to those of cells that are empty."""
    random, reach = np.random.default_rng(seed), float(np.ptp(region.bounds, axis=0).max())
    seeds = scattered(region, count, random)
    before = power_diagram(region, seeds, np.zeros(count), reach)
    moved = seeds + step * (before.centroids() - seeds)
    weights = spread * region.area / count * random.standard_normal(count)
    whole, made = power_diagram(region, moved, weights, reach), moved_diagram(region, moved, weights, before)
    assert made is not None
    assert made.areas() * count / region.area == pytest.approx(whole.areas() * count / region.area, abs=1e-8)
    full = whole.areas() > 1e-6 * region.area / count
    with np.errstate(invalid="ignore"):
        assert made.centroids()[full] == pytest.approx(whole.centroids()[full], abs=1e-6 * reach)
    border = [np.bincount(d.side[d.side >= 0], d.lengths()[d.side >= 0]) for d in (made, whole)]
    assert border[0] == pytest.approx(border[1])
    assert border[0] == pytest.approx(np.hypot(*(region.end - region.start).T))


@pytest.mark.usefixtures("interpreted")
def test_two_cells_meet_at_the_power_line() -> None:
    """In a unit square, at (0.25, 0.5) and (0.75, 0.5): x = 1/2 + (w1 - w2) / (2 d) with d = 1/2."""
    seeds, unit = np.array([(0.25, 0.5), (0.75, 0.5)]), rectangle(1, 1)
    before = power_diagram(unit, seeds, np.zeros(2), 1.0)
    for difference in (-0.2, 0.1, 0.4):
        made = moved_diagram(unit, seeds, np.array([difference, 0]), before)
        assert made.areas() == pytest.approx([0.5 + difference, 0.5 - difference], abs=1e-12)
        middle = np.array([0.5 + difference, 1.5 + difference]) / 2
        assert made.centroids() == pytest.approx(np.column_stack([middle, [0.5, 0.5]]), abs=1e-12)
        inner = made.vertices[made.start[made.other >= 0]]
        assert inner[:, 0] == pytest.approx(0.5 + difference, abs=1e-12)
        assert sorted(made.side.tolist()) == [-1, -1, 0, 0, 1, 2, 2, 3]


@pytest.mark.usefixtures("interpreted")
def test_a_cell_without_room_is_empty() -> None:
    seeds = np.array([(0.2, 0.2), (0.8, 0.2), (0.5, 0.8), (0.5, 0.45)])
    before = power_diagram(rectangle(1, 1), seeds, np.zeros(4), 1.0)
    made = moved_diagram(rectangle(1, 1), seeds, np.array([0, 0, 0, -0.3]), before)
    assert made.areas()[3] == 0
    assert made.areas().sum() == pytest.approx(1, abs=1e-12)


def met(diagram: Diagram) -> dict[tuple[int, int, int], float]:
    """Lengths of the edges of each seed, by the other seed and side that they are shared with."""
    ends = zip(diagram.seed.tolist(), diagram.other.tolist(), diagram.side.tolist(), strict=True)
    lengths = dict(zip(ends, diagram.lengths().tolist(), strict=True))
    return {pair: length for pair, length in lengths.items() if length > 1e-9}


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize(
    ("region", "seed", "spread"), [(rectangle(2, 1), 17, 1.0), (disc(1), 3, 0.2), (disc(1000), 3, 0.2)]
)
def test_cells_at_odds_are_cut_again(region: Region, seed: int, spread: float, monkeypatch) -> None:
    """Weights that leave some seeds of the rectangle without a cell, so that others meet who were far apart."""
    cells, tried = moved_cells._cells, []
    monkeypatch.setattr(moved_cells, "_cells", lambda who, *others: tried.append(who) or cells(who, *others))
    random = np.random.default_rng(seed)
    seeds = scattered(region, 60, random)
    reach = 1.5 * float(np.ptp(region.bounds[:, 0]))
    before = power_diagram(region, seeds, np.zeros(60), reach)
    weights = spread * region.area / 60 * random.standard_normal(60)
    made = moved_diagram(region, before.centroids(), weights, before)
    assert (len(tried), (made.areas() == 0).any()) == ((3, True) if spread == 1 else (1, False))
    whole = power_diagram(region, before.centroids(), weights, reach)
    assert met(made) == pytest.approx(met(whole), abs=1e-9 * reach)


@pytest.mark.parametrize("forgotten", [(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1), None])
def test_cells_that_meet_in_a_corner_know_each_other_or_are_cut_again(forgotten: tuple[int, int] | None) -> None:
    """Three cells round one corner, counter-clockwise from a side each, and one apart that meets but sides."""
    known = [[-1, 1, 2], [-2, 2, 0], [0, 1, -3], [-1, -2, -3]]
    if forgotten:
        cell, other = forgotten
        known[cell][known[cell].index(other)] = -4
    begin = np.array([0, 3, 6, 9])
    odd = moved_cells._at_odds.py_func(np.concatenate(known), begin, np.full(4, 3))
    assert odd.tolist() == [forgotten is not None] * 3 + [False]


@pytest.mark.thorough
def test_a_diagram_of_other_seeds_gives_none() -> None:
    random, region = np.random.default_rng(3), rectangle(1, 1)
    seeds = random.random((2000, 2))
    before = power_diagram(region, seeds, np.zeros(2000), 0.1)
    assert moved_diagram(region, seeds[random.permutation(2000)], np.zeros(2000), before) is None


def test_where_there_is_none_the_hull_takes_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    random, region = np.random.default_rng(3), rectangle(1, 1)
    seeds = random.random((50, 2))
    cells = PowerCells(region, region, seeds, np.zeros(50), 1.0)
    monkeypatch.setattr(area_fit, "FEW", 0)
    next_to = round_cells(cells, cells.diagram.centroids(), cells.areas)
    assert next_to.diagram is not next_to.joined
    monkeypatch.setattr(area_fit, "moved_diagram", lambda *_: None)
    again = round_cells(cells, cells.diagram.centroids(), cells.areas)
    assert again.diagram is again.joined
    assert again.areas == pytest.approx(next_to.areas, abs=1e-12)


def test_round_cells_lie_about_their_seeds() -> None:
    """As discs of 0.9 and 0.1 m2 would, 0.2 m apart, had the small one not been left 0.1/(4 pi) m2 of power there."""
    unit, seeds = rectangle(1, 1), np.array([(0.4, 0.5), (0.6, 0.5)])
    made = round_cells(PowerCells(unit, unit, seeds, np.zeros(2), 1.0), seeds, np.array([0.9, 0.1]))
    line = 0.5 + (0.2**2 - 0.1 / (4 * np.pi)) / (2 * 0.2)
    assert made.areas == pytest.approx([line, 1 - line])
    alone = round_cells(PowerCells(unit, unit, seeds[:1], np.zeros(1), 1.0), seeds[1:], np.ones(1))
    assert alone.areas == pytest.approx([1.0])


def test_another_order_of_the_seeds() -> None:
    random, region = np.random.default_rng(1), rectangle(1, 1)
    diagram = power_diagram(region, random.random((30, 2)), np.zeros(30), 1.0)
    order = random.permutation(30)
    other = diagram.renumbered(order)
    assert other.areas() == pytest.approx(diagram.areas()[order], abs=1e-12)
    assert other.areas() == pytest.approx(power_diagram(region, diagram.seeds[order], np.zeros(30), 1.0).areas())
    assert np.array_equal(other.other < 0, diagram.other < 0)
    inner = other.other >= 0
    assert np.array_equal(order[other.other[inner]], diagram.other[inner])


@pytest.mark.thorough
@settings(max_examples=25)
@given(
    region=st.sampled_from([*CONVEX.values(), *CONCAVE.values()]),
    grains=st.integers(2, 150),
    deviation=st.floats(0, 0.5),
    seed=st.integers(0, 999),
)
def test_areas_are_as_asked_on_the_way_of_many(region, grains, deviation, seed) -> None:
    """The way of more than 10,000 grains, with few. A concave region may keep grains from their area."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(area_fit, "FEW", 0)
        patch.setattr(sparse_solve, "FEW", 0)
        fit = Laguerre(grains=grains, sizes=Lognormal(deviation=deviation), seed=seed).fit(region)
    assert_tiles(fit.tessellation)
    assert_sides_complete(fit.tessellation)
    assert set(fit.owner) == set(range(grains))
    assert fit.after.sum() == pytest.approx(region.area)
    if region in CONVEX.values():
        assert fit.largest_before <= 0.01
        assert fit.largest_after <= 0.02


def laplacian(count: int) -> tuple[csc_array, np.ndarray]:
    """Of a square grid with random conductances, numbered along space, held a little; and a random right side."""
    random = np.random.default_rng(2)
    node = np.empty((count, count), dtype=int)
    node.ravel()[hilbert_order(np.indices((count, count)).reshape(2, -1).T)] = np.arange(count**2)
    i = np.concatenate([node[:, :-1].ravel(), node[:-1].ravel()])
    j = np.concatenate([node[:, 1:].ravel(), node[1:].ravel()])
    slope = 0.5 + random.random(len(i))
    between = coo_array((slope, (i, j)), shape=(count**2,) * 2)
    both = between + between.T
    matrix = diags_array(both.sum(axis=1)) - both
    return (matrix + 1e-3 * eye_array(count**2)).tocsc(), random.standard_normal(count**2)


def test_many_unknowns_are_found_to_one_percent(monkeypatch: pytest.MonkeyPatch) -> None:
    matrix, right = laplacian(60)
    exact = solved(matrix, right)
    assert matrix @ exact == pytest.approx(right, abs=1e-9)
    monkeypatch.setattr(sparse_solve, "FEW", 0)
    found = solved(matrix, right)
    missed = np.linalg.norm(matrix @ found - right) / np.linalg.norm(right)
    assert 1e-6 < missed <= 0.01
    assert np.linalg.norm(found - exact) < 0.05 * np.linalg.norm(exact)
    assert solved(matrix, right / 2**20) * 2**20 == pytest.approx(found, rel=1e-12)  # areas are small numbers of m2
    monkeypatch.setattr(sparse_solve, "MOST", 3)
    assert np.array_equal(solved(matrix, right), exact)


@pytest.mark.slow
@pytest.mark.parametrize(("grains", "seed"), [(20_000, 4), (100_000, 2)])
def test_many_grains(grains: int, seed: int) -> None:
    fit = Laguerre(grains=grains, seed=seed).fit(rectangle(0.05, 0.125))
    assert fit.largest_before <= 0.01
    assert fit.largest_after <= 0.02
    assert_tiles(fit.tessellation)
    assert fit.circularity.mean() == pytest.approx(0.79, abs=0.005)  # of 10,000 grains by convex hulls


@pytest.mark.usefixtures("interpreted")
@pytest.mark.parametrize("size", [1e-3, 1e3])
def test_cells_grow_with_their_region(size: float) -> None:
    """Of a row of unequal cells: halfway between two seeds."""
    places = np.array([0.1, 0.3, 0.4, 0.7, 0.9])
    seeds, region = size * np.column_stack([places, np.full(5, 0.05)]), rectangle(size, 0.1 * size)
    before = power_diagram(region, seeds, np.zeros(5), size)
    made = moved_diagram(region, seeds, np.zeros(5), before)
    assert made is not None
    ends = np.array([0, 0.2, 0.35, 0.55, 0.8, 1])
    assert made.areas() / size**2 == pytest.approx(0.1 * np.diff(ends), rel=1e-9)
