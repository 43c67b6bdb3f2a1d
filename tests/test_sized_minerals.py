"""Minerals with grains of their own sizes: areas, shares, clusters, what is refused; by Python and by configuration."""

import tomllib

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_regions import star_shaped
from tiling import assert_tiles

from grainlaw.cli.configuration import configured
from grainlaw.cli.sections import toml
from grainlaw.fields import ParameterError
from grainlaw.geometry import (
    Breakable,
    ByPhase,
    Even,
    Laguerre,
    Lognormal,
    Minerals,
    Trigons,
    Voronoi,
    rectangle,
    texture,
)  # fmt: skip

REGION = rectangle(50e-3, 100e-3)
SHARES = {"quartz": 0.3, "feldspar": 0.6, "mica": 0.1}
SIZES = ByPhase(
    {"quartz": Lognormal(deviation=0.2), "feldspar": Lognormal(deviation=0.3, diameter=3), "mica": Even(diameter=0.8)}
)


def minerals(count=250, seed=1, clustering=1.0, **more):
    return Minerals(Laguerre(grains=count, seed=seed, **more), SHARES, clustering, seed, sizes=SIZES)


def clustering_of(grains):
    """Like boundary over that of pairs of grains drawn by their boundary, a grain never with itself."""
    edges, own = grains.edges, np.zeros(grains.count)
    like = 0.0
    for left, right, length in zip(edges.left, edges.right, edges.length, strict=True):
        if right >= 0:
            own[[left, right]] += length
            like += 2 * length * (grains.phase[left] == grains.phase[right])
    pairs = np.outer(own, own) * ~np.eye(len(own), dtype=bool)
    same = grains.phase[:, None] == grains.phase
    return like / own.sum() / (pairs[same].sum() / pairs.sum())


def assert_as_asked(grains, made, region):
    """Fractions to a thousandth; of each mineral the areas that ``ByPhase`` draws, each to 2 %."""
    phase, areas = SIZES.draw(SHARES, made.tessellator.grains, np.random.default_rng(made.seed))
    for k, (name, share) in enumerate(SHARES.items()):
        assert grains.phase_names[k] == name
        mine = grains.areas[grains.phase == k]
        assert mine.sum() / region.area == pytest.approx(share, abs=1e-3)
        if len(mine) == np.sum(phase == k):  # a region with holes may cut the cell of an area in two
            assert np.sort(mine) == pytest.approx(np.sort(areas[phase == k]) * region.area, rel=0.02)


@pytest.mark.thorough
@settings(max_examples=8)
@given(seed=st.integers(0, 10**6), count=st.integers(60, 300))
def test_each_mineral_has_its_sizes(seed, count):
    made = minerals(count, seed)
    grains = made.tessellate(REGION)
    assert grains.count == count
    assert_tiles(grains)
    assert_as_asked(grains, made, REGION)


@pytest.mark.thorough
@settings(max_examples=6)
@given(seed=st.integers(0, 10**6), clustering=st.floats(0.75, 1.4))
def test_clustering_is_as_asked_and_sizes_stay(seed, clustering):
    made = minerals(250, seed, clustering)
    grains = made.tessellate(REGION)
    assert_as_asked(grains, made, REGION)
    assert clustering_of(grains) == pytest.approx(clustering, rel=0.02)


@pytest.mark.thorough
@settings(max_examples=5)
@given(region=star_shaped(), seed=st.integers(0, 99))
def test_in_any_region(region, seed):
    made = minerals(120, seed)
    grains = made.tessellate(region)
    assert_tiles(grains)
    assert_as_asked(grains, made, region)


@pytest.mark.thorough
def test_grains_at_random_have_a_clustering_of_one_on_average():
    """Of the formula: in places of their own, which no relaxation has changed."""
    found = []
    for seed in range(40):
        phase, areas = SIZES.draw(SHARES, 200, np.random.default_rng(seed))
        fit = Laguerre(areas=areas * REGION.area, relaxation=0, seed=seed).fit(REGION)
        found.append(clustering_of(attrs.evolve(fit.tessellation, phase=phase[fit.owner])))
    assert np.mean(found) == pytest.approx(1, abs=3 * np.std(found) / np.sqrt(len(found)))
    assert np.std(found) < 0.08


@pytest.mark.thorough
def test_the_same_seed_gives_the_same_bits():
    one, same, other = (minerals(100, seed, 1.2).tessellate(REGION) for seed in (1, 1, 2))
    assert np.array_equal(one.vertices, same.vertices)
    assert np.array_equal(one.phase, same.phase)
    assert not np.array_equal(one.vertices[:9], other.vertices[:9])


@pytest.mark.thorough
def test_round_grains_of_their_sizes_that_break():
    made = minerals(150, circularity=0.78)
    broken = Breakable(made, {"feldspar": Trigons(count=4)}).tessellate(REGION)
    found = texture(broken, made)
    assert found.circularity.mean == pytest.approx(0.78, abs=0.006)
    assert found.grains == 150
    assert found.phase_diameters["quartz"].cv == pytest.approx(0.2, abs=0.05)


@pytest.mark.thorough
def test_the_report_has_the_sizes_of_each_mineral_beside_those_asked_for():
    made = minerals(400)
    found = texture(made.tessellate(REGION), made)
    for name in SHARES:
        asked = found.asked["phase_diameters"][name]
        assert found.phase_diameters[name].mean == pytest.approx(asked.mean, rel=0.08)
    assert found.asked["diameters"].mean == pytest.approx(found.diameters.mean, rel=0.05)
    feldspar, mica = (found.asked["phase_diameters"][name].mean for name in ("feldspar", "mica"))
    assert feldspar / mica == pytest.approx(3 / 0.8, rel=0.02)
    line = next(line for line in str(found).splitlines() if line.startswith("feldspar: diameter"))
    assert len(line.split()) == 6
    assert found.clustering == pytest.approx(clustering_of(made.tessellate(REGION)))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Minerals(Voronoi(grains=9), SHARES, sizes=SIZES), "not allowed with grains of Voronoi, they need"),
        (lambda: Minerals(Laguerre(grains=9, sizes=Even()), SHARES, sizes=SIZES), "either sizes or the sizes of Lag"),
        (lambda: Minerals(Laguerre(areas=[1, 2]), SHARES, sizes=SIZES), "either sizes or the areas of Laguerre"),
        (lambda: Minerals(Laguerre(grains=9), {"olivine": 1.0}, sizes=SIZES), "ByPhase: sizes has none for 'olivine'"),
        (lambda: minerals(2).tessellate(REGION), "2 grains are not allowed for 3 phases"),
        pytest.param(
            lambda: minerals(60, clustering=4).tessellate(REGION),
            "clustering = 4 is not reached, swaps bring these",
            marks=pytest.mark.thorough,
        ),
    ],
)
def test_what_is_refused(make, words):
    with pytest.raises(ParameterError, match=words):
        make()


TEXT = """
[sample]
tessellator = "laguerre"
grains = 120
seed = 2
minerals = {quartz = 0.4, feldspar = 0.6}
clustering = 1.2
[sample.sizes]
type = "by-phase"
quartz = "even"
feldspar = {type = "lognormal", deviation = 0.2, diameter = 2}
"""


@pytest.mark.thorough
def test_from_a_configuration():
    first = configured("uniaxial-tension", tomllib.loads(TEXT))
    sizes = ByPhase({"quartz": Even(), "feldspar": Lognormal(deviation=0.2, diameter=2)})
    made = Minerals(Laguerre(grains=120, seed=2), {"quartz": 0.4, "feldspar": 0.6}, 1.2, 2, sizes=sizes)
    grains = first.specimen.grains
    expected = made.tessellate(grains.region)
    assert np.array_equal(grains.vertices, expected.vertices)
    assert np.array_equal(grains.phase, expected.phase)
    again = configured("uniaxial-tension", tomllib.loads(toml(first.sections)))
    assert again.sections == first.sections
    assert np.array_equal(again.specimen.grains.vertices, grains.vertices)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("minerals = {quartz = 0.4, feldspar = 0.6}\nclustering = 1.2", ""), "sample.sizes by phase are of the min"),
        (('quartz = "even"', ""), "ByPhase: sizes has none for 'quartz'"),
        (('"laguerre"', '"voronoi"'), "there is no 'sample.sizes'"),
        (('"even"', '"evn"'), "sample.sizes.quartz: there is no 'evn'; did you mean 'even'"),
    ],
)
def test_what_a_configuration_refuses(change, words):
    with pytest.raises(ParameterError, match=words):
        configured("uniaxial-tension", tomllib.loads(TEXT.replace(*change)))


@pytest.mark.parametrize("clustering", [0.75, 1.25])
def test_clustering_of_a_few_grains_is_as_asked(clustering):
    made = minerals(60, 1, clustering)
    grains = made.tessellate(REGION)
    assert_as_asked(grains, made, REGION)
    assert clustering_of(grains) == pytest.approx(clustering, abs=0.05)  # a sixtieth of the boundary, of a third of it
