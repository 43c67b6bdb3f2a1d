"""Minerals dealt to grains: shares of the area, clusters, what is refused."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grainlaw.fields import ParameterError
from grainlaw.geometry import Breakable, Bricks, Hexagonal, Minerals, Trigons, Voronoi, rectangle
from grainlaw.geometry.cells.dealing import (
    carried,
    dealt,
    expected_share,
    like_share,
    rearranged,
    refined,
    shuffled_share,
)

REGION = rectangle(50e-3, 100e-3)
GRANITE = {"quartz": 0.31, "K-feldspar": 0.43, "plagioclase": 0.20, "mica": 0.06}


def shares_of(grains):
    """Of the area, by the name of the phase."""
    return {
        name: float(grains.areas[grains.phase == k].sum() / grains.areas.sum())
        for k, name in enumerate(grains.phase_names)
    }


def clustering_of(grains):
    """Like boundary over what is expected at random: for two grains drawn without putting the first back."""
    edges = grains.edges
    like = whole = 0.0
    for left, right, length in zip(edges.left, edges.right, edges.length, strict=True):
        if right >= 0 and grains.parent[left] != grains.parent[right]:
            whole += length
            like += length * (grains.phase[left] == grains.phase[right])
    phase = {int(parent): int(phase) for parent, phase in zip(grains.parent, grains.phase, strict=True)}
    counts, n = np.bincount(list(phase.values())), len(phase)
    return like / whole / sum(c / n * (c - 1) / (n - 1) for c in counts)


def compositions():
    """Two to five minerals of at least 5 % each."""
    parts = st.lists(st.integers(5, 100), min_size=2, max_size=5)
    return parts.filter(lambda p: min(p) >= 0.05 * sum(p)).map(lambda p: {f"m{k}": x / sum(p) for k, x in enumerate(p)})


@pytest.mark.thorough
@settings(max_examples=40)
@given(fractions=compositions(), seed=st.integers(0, 10**6), count=st.integers(150, 500))
def test_fractions_are_met_to_a_thousandth(fractions, seed, count):
    made = Minerals(Voronoi(grains=count, seed=seed), fractions, seed=seed).tessellate(REGION)
    assert shares_of(made) == pytest.approx(fractions, abs=1e-3)


@pytest.mark.thorough
@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), clustering=st.floats(0.5, 1.7), last=st.floats(0.3, 0.5))
def test_clustering_is_as_asked_and_fractions_stay(seed, clustering, last):
    fractions = {"a": 0.2, "b": 0.8 - last, "c": last}
    made = Minerals(Voronoi(grains=300, seed=seed), fractions, clustering=clustering, seed=seed).tessellate(REGION)
    if clustering != 1:
        assert clustering_of(made) == pytest.approx(clustering, rel=0.02)
    assert shares_of(made) == pytest.approx(fractions, abs=1e-3)


@pytest.mark.thorough
@settings(max_examples=10)
@given(seed=st.integers(0, 10**6))
def test_more_clustering_makes_more_like_boundary(seed):
    asked = (0.6, 0.8, 1.2, 1.6, 2.0)
    found = [
        clustering_of(Minerals(Voronoi(grains=200, seed=seed), GRANITE, c, seed=seed).tessellate(REGION)) for c in asked
    ]
    assert (np.diff(found) > 0).all()


@pytest.mark.thorough
def test_grains_as_dealt_are_not_clustered_on_average():
    found = [clustering_of(Minerals(Voronoi(grains=200), GRANITE, seed=s).tessellate(REGION)) for s in range(60)]
    assert np.mean(found) == pytest.approx(1, abs=3 * np.std(found) / np.sqrt(len(found)))
    assert np.std(found) < 0.1


def test_clustering_that_no_arrangement_has_is_refused():
    """One brick of twelve is unlike its neighbours, at most four: the 13 other of 17 edges are between like ones."""
    made = Minerals(Bricks(rows=4, columns=3), {"black": 0.9, "white": 0.1}, clustering=0.1)
    with pytest.raises(
        ParameterError, match=r"clustering = 0.1 is not reached, swaps bring these 12 grains to 0\.[89]"
    ):
        made.tessellate(REGION)


def test_the_same_seed_deals_the_same_and_another_differs():
    one, same, other = (Minerals(Voronoi(grains=80), GRANITE, 1.3, s).tessellate(REGION) for s in (1, 1, 2))
    assert np.array_equal(one.phase, same.phase)
    assert not np.array_equal(one.phase, other.phase)
    assert np.array_equal(one.vertices, other.vertices)
    assert one.phase_names == tuple(GRANITE)


@pytest.mark.parametrize("clustering", [1.0, 1.4])
def test_all_cells_of_a_grain_are_of_one_mineral(clustering):
    made = Minerals(Breakable(Voronoi(grains=150), Trigons(count=6)), GRANITE, clustering).tessellate(REGION)
    grain = np.unique(made.parent, return_inverse=True)[1]
    assert made.is_breakable
    first = made.phase[np.unique(grain, return_index=True)[1]]
    assert np.array_equal(first[grain], made.phase)
    assert shares_of(made) == pytest.approx(GRANITE, abs=1e-3)


def test_large_grains_come_as_near_as_they_can():
    made = Minerals(Bricks(rows=5, columns=1), {"a": 0.5, "b": 0.5}).tessellate(REGION)
    assert sorted(shares_of(made).values()) == pytest.approx([0.4, 0.6])
    made = Minerals(Hexagonal(grains=100), {"a": 1.0}).tessellate(REGION)
    assert made.phase_names == ("a",)
    assert not made.phase.any()


@pytest.mark.parametrize(
    ("fractions", "more", "words"),
    [
        ({"quartz": 0.3, "mica": 0.6}, {}, "fractions sum to 0.9, they must sum to 1"),
        ({"quartz": 1.3, "mica": -0.3}, {}, "fractions: quartz = 1.3 is not allowed, it must be a number above 0"),
        ({"quartz": 1.0, "mica": 0}, {}, "fractions: mica = 0 is not allowed"),
        ({"quartz": 1.0, "mica": np.nan}, {}, "fractions: mica = nan is not allowed"),
        ({"inside": 1.0}, {}, "name = 'inside' is not allowed"),
        ({3: 1.0}, {}, "name = 3 is not allowed, it must be a text"),
        ({}, {}, "fractions = {} is not allowed, it must be a mapping"),
        (0.3, {}, "fractions = 0.3 is not allowed"),
        (GRANITE, {"clustering": 0}, "clustering = 0 is not allowed"),
        (GRANITE, {"clustering": 4}, "clustering = 4 is not allowed, with these fractions it must be below 3.08"),
        (GRANITE, {"seed": -1}, "seed = -1 is not allowed"),
    ],
)
def test_what_minerals_refuse(fractions, more, words):
    with pytest.raises(ParameterError, match=words):
        Minerals(Voronoi(grains=10), fractions, **more)


def test_a_grain_is_dealt_to_the_phase_in_which_its_middle_lies():
    """In their order in a row of 10 m2 the middles are at 1, 2.5, 5, 8 and 9.5 m2."""
    in_order = SimpleNamespace(permutation=lambda count: np.array([0, 2, 1, 3, 4]))
    areas = np.array([2.0, 4.0, 1.0, 2.0, 1.0])
    for first, phases in ((0.24, [0, 1, 1, 1, 1]), (0.26, [0, 1, 0, 1, 1]), (0.9, [0, 0, 0, 0, 1])):
        assert dealt(areas, np.array([first, 1 - first]), in_order).tolist() == phases


@pytest.mark.parametrize("seed", range(5))
def test_shares_are_refined_by_swaps(seed):
    random, shares = np.random.default_rng(seed), np.array([0.31, 0.63, 0.06])
    areas = random.lognormal(0, 0.8, 200)
    phase = refined(random.integers(3, size=200), areas, shares, random)
    assert np.bincount(phase, areas, 3) / areas.sum() == pytest.approx(shares, abs=2e-4)


def test_the_swap_that_comes_nearest_is_made():
    """To give 3.9 m2 of 25, the grain of 5 is swapped for the one of 1."""
    areas, phase = np.array([5.0, 20, 1, 3]), np.array([0, 0, 1, 1])
    shares = np.array([25 - 3.9, 4 + 3.9]) / 29
    assert refined(phase, areas, shares, np.random.default_rng(1)).tolist() == [1, 0, 0, 1]


def test_shares_of_like_boundary_by_hand():
    """Round a square of four grains, of the phases 0, 0, 1 and 1, edges of 1, 2, 3 and 4 m."""
    phase, pairs = np.array([0, 0, 1, 1]), np.array([(0, 1), (1, 2), (2, 3), (3, 0)])
    lengths = np.array([1.0, 2.0, 3.0, 4.0])
    assert like_share(phase, pairs, lengths) == pytest.approx((1 + 3) / 10)
    assert expected_share(phase) == pytest.approx(1 / 3)  # of three others one is like it
    own = [5, 3, 5, 7]  # m of boundary
    alike, every = 2 * (5 * 3 + 5 * 7), 20**2 - sum(n * n for n in own)
    assert shuffled_share(phase, pairs, lengths) == pytest.approx(alike / every)
    assert like_share(phase[:1], np.empty((0, 2), dtype=int), np.empty(0)) == expected_share(phase[:1]) == 1


def test_phases_that_change_places_take_their_areas_with_them():
    before, after = np.array([0, 0, 0, 1, 1, 2]), np.array([1, 0, 2, 0, 1, 0])
    areas = carried(before, after, np.array([1.0, 2, 3, 4, 5, 6]), np.random.default_rng(1))
    assert areas[[0, 1, 2, 4]].tolist() == [4, 2, 6, 5]
    assert sorted(areas[[3, 5]]) == [1, 3]


@pytest.mark.parametrize("wanted", [0.35, 0.45, 0.65])
def test_swaps_reach_a_share_of_like_boundary(wanted):
    """On a chessboard of 20 by 20, where 0.455 is what is expected; shares of the area stay near to what they were."""
    random, number = np.random.default_rng(2), np.arange(400).reshape(20, 20)
    pairs = np.concatenate([np.column_stack([a.ravel(), b.ravel()]) for a, b in (
        (number[:, 1:], number[:, :-1]), (number[1:], number[:-1])
    )])  # fmt: skip
    lengths, areas = random.uniform(0.5, 1.5, len(pairs)), random.uniform(0.5, 2, 400)
    shares = np.array([0.3, 0.6, 0.1])
    phase = refined(dealt(areas, shares, random), areas, shares, random)
    then, share = rearranged(phase, pairs, lengths, areas, shares, wanted, random)
    assert share == pytest.approx(wanted, rel=2e-3)
    assert share == pytest.approx(like_share(then, pairs, lengths), abs=1e-12)
    assert np.bincount(then, areas) / areas.sum() == pytest.approx(shares, abs=8e-4)
