"""Random strength: its statistics, where it goes, what refuses it, and the weakest link."""

import itertools
import math

import attrs
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.special import ndtri
from support import ROCK, STRONG, small_sample, state_of

import grainlaw as gl
from grainlaw.compiler.batch import compile_law
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import (
    BilinearMixedMode,
    CamachoOrtiz,
    CohesiveCrack,
    Linear,
    MohrCoulomb,
    MunjizaJoint,
    WeibullField,
    XuNeedleman,
)
from grainlaw.protocols import UniaxialTension
from grainlaw.units import mm

EVEN = {name: value for name, value in STRONG.items() if name != "friction_angle"}
TOUGH = {"mode_i_energy": 150, "mode_ii_energy": 300}
BRITTLE = MohrCoulomb(**STRONG)
LAWS = [
    BRITTLE, CohesiveCrack(**STRONG, **TOUGH), MunjizaJoint(**STRONG, **TOUGH), CamachoOrtiz(**EVEN, **TOUGH),
    BilinearMixedMode(**EVEN, **TOUGH), XuNeedleman(**EVEN),
]  # fmt: skip


@pytest.fixture(scope="module")
def rock():
    return small_sample()


@pytest.fixture(scope="module")
def bricks():
    """10,000 interfaces and more."""
    return gl.Specimen(Bricks(rows=80, columns=80).tessellate(rectangle(1.0, 1.0)), ROCK)


@pytest.mark.parametrize("modulus", [1.5, 5, 20])
def test_mean_is_one_and_the_scatter_that_of_the_modulus(bricks, modulus):
    factors = WeibullField(modulus=modulus).factors(bricks)
    count = len(factors)
    assert count > 10_000
    scatter = math.sqrt(math.gamma(1 + 2 / modulus) / math.gamma(1 + 1 / modulus) ** 2 - 1)
    assert factors.mean() == pytest.approx(1, abs=4 * scatter / math.sqrt(count))
    assert factors.std() == pytest.approx(scatter, rel=0.04)
    # The share below its scale is 1 - 1/e whatever the modulus.
    below = np.mean(factors < 1 / math.gamma(1 + 1 / modulus))
    assert below == pytest.approx(1 - math.exp(-1), abs=4 * 0.5 / math.sqrt(count))


def test_the_seed_is_the_field(rock):
    first, again, other = (WeibullField(modulus=8, seed=seed).factors(rock) for seed in (3, 3, 4))
    assert np.array_equal(first, again)
    assert not np.any(first == other)
    # The same contacts are weak for every modulus: factors are powers of the same draws.
    smooth = WeibullField(modulus=16, seed=3).factors(rock)
    assert np.array_equal(np.argsort(first), np.argsort(smooth))


@pytest.mark.parametrize("length", [0.0, 5 * mm])
def test_the_field_is_the_same_in_every_mesh(rock, length):
    """By place: an edge of two grains keeps its factor however often it is cut."""
    field, grains = WeibullField(modulus=4, correlation_length=length), rock.grains
    coarse = field.factors(rock)
    for refinement in (1, 2):
        fine = gl.Specimen(grains, ROCK, refinement=refinement)
        a, b = (mesh.nodes[mesh.interfaces[:, :2]].mean(axis=1) for mesh in (rock.mesh, fine.mesh))
        ends = rock.mesh.nodes[rock.mesh.interfaces[:, :2]]
        reach = np.hypot(*(ends[:, 1] - ends[:, 0]).T) / 2
        same = (rock.mesh.interface_grains[:, None] == fine.mesh.interface_grains).all(axis=2)
        far = np.hypot(*(a[:, None] - b).transpose(2, 0, 1))
        owner = np.argmax(same & (far < reach[:, None]), axis=0)
        assert np.array_equal(np.bincount(owner), np.full(len(coarse), 2**refinement))
        assert field.factors(fine) == pytest.approx(coarse[owner], rel=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("length", [0.05, 0.1])
def test_the_correlation_length_is_that_of_the_field(bricks, length):
    """The normal scores of the factors: 1/e at that distance, exp(-(r/l)^2) at others; each of them is Weibull's."""
    mesh, dice = bricks.mesh, np.random.default_rng(0)
    at = mesh.nodes[mesh.interfaces[:, :2]].mean(axis=1)
    first, second = dice.integers(0, len(at), (2, 200_000))
    distance = np.hypot(*(at[first] - at[second]).T) / length
    found, means = [], []
    for seed in range(20):
        factors = WeibullField(modulus=5, seed=seed, correlation_length=length).factors(bricks)
        scores = ndtri(-np.expm1(-((factors * math.gamma(1.2)) ** 5)))
        products = scores[first] * scores[second]
        found.append([products[abs(distance - r) < 0.1].mean() for r in (0.5, 1, 2)])
        means.append((scores**2).mean())
    error = 4 * math.sqrt(math.pi / 20) * length  # of the mean of 20 fields, of so many independent places each
    assert np.mean(means) == pytest.approx(1, abs=error)
    assert np.mean(found, axis=0) == pytest.approx(np.exp(-np.square([0.5, 1, 2])), abs=error)


def test_places_a_correlation_length_apart_are_alike_by_1_over_e(bricks):
    """And nearer ones by exp(-(r/l)^2): the normal scores of two fields, of some 5000 independent places in all."""
    mesh, length = bricks.mesh, 0.02
    at = mesh.nodes[mesh.interfaces[:, :2]].mean(axis=1)
    fields = [WeibullField(modulus=5, seed=seed, correlation_length=length).factors(bricks) for seed in (0, 1)]
    scores = ndtri(-np.expm1(-((np.array(fields) * math.gamma(1.2)) ** 5)))
    for other in cKDTree(at).query(at, k=17)[1][:, [4, 16]].T:
        distance = np.hypot(*(at - at[other]).T) / length
        assert np.mean(scores * scores[:, other]) == pytest.approx(np.exp(-(distance**2)).mean(), abs=0.1)
    assert np.mean(scores**2) == pytest.approx(1, abs=0.1)


def test_both_points_and_all_names_have_one_factor(rock):
    field = WeibullField(modulus=5)
    law = field.scatter(BRITTLE, rock)
    first, second = law.tensile_strength.reshape(2, -1)
    assert np.array_equal(first, second)
    assert law.tensile_strength / 13e6 == pytest.approx(law.cohesion / 29e6, rel=1e-14)
    assert first == pytest.approx(13e6 * field.factors(rock), rel=1e-14)
    assert law.friction_angle == 54


@pytest.mark.thorough
@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_each_contact_follows_the_law_of_its_own_strength(rock, law):
    scattered = WeibullField(modulus=3).scatter(law, rock)
    count = len(scattered.cohesion)
    compiled = compile_law(scattered, count)
    memory = np.zeros((len(compiled.memory), count))
    path = [(0.1e-6, 0.1e-6), (0.4e-6, 0.9e-6), (-0.2e-6, 1.5e-6), (3e-6, 1e-6)]
    found = [compiled.batch(np.full(count, o), np.full(count, s), memory) for o, s in path]
    for c in (0, 7, count - 1):
        own = attrs.evolve(law, tensile_strength=scattered.tensile_strength[c], cohesion=scattered.cohesion[c])
        trace = gl.trace(own, *zip(*path, strict=True))
        assert [normal[c] for normal, _ in found] == pytest.approx(trace.normal, rel=1e-12, abs=1e-3)
        assert [shear[c] for _, shear in found] == pytest.approx(trace.shear, rel=1e-12, abs=1e-3)


def test_laws_for_pairs_of_phases_have_the_same_field(rock):
    phase = np.arange(rock.grains.count) % 2
    mixed = gl.Specimen(attrs.evolve(rock.grains, phase=phase, phase_names=("a", "b", "c")), ROCK)  # no c
    strong = attrs.evolve(BRITTLE, tensile_strength=20e6)
    laws = {(1, 0): BRITTLE, (0, 0): strong, (1, 1): BRITTLE, (1, 2): strong}
    field = WeibullField(modulus=5)
    state = state_of(mixed, field.scatter(laws, mixed))
    factors = field.factors(mixed)[state.bonds.order]
    assert [group.size > 0 for group in state.bonds.groups] == [True, True, True, False]
    for group, law in zip(state.bonds.groups[:3], laws.values(), strict=False):
        expected = law.tensile_strength * factors[group.first : group.last]
        assert group.law.tensile_strength.reshape(2, -1) == pytest.approx(np.stack([expected] * 2), rel=1e-14)


def test_what_no_contact_may_have_is_refused(rock):
    field = WeibullField(modulus=2)
    with pytest.raises(gl.ParameterError, match=r"residual_cohesion = 2e\+07 is above cohesion"):
        field.scatter(attrs.evolve(BRITTLE, residual_cohesion=20e6), rock)
    with pytest.raises(gl.ParameterError, match="beyond the apex"):
        attrs.evolve(field, names=("cohesion",)).scatter(BRITTLE, rock)
    with pytest.raises(gl.ParameterError, match="beyond the apex"):
        attrs.evolve(field, names=("tensile_strength",)).scatter(LAWS[1], rock)
    with pytest.raises(gl.ParameterError, match="eta"):
        attrs.evolve(field, names=("eta",)).scatter(LAWS[4], rock)
    with pytest.raises(gl.ParameterError, match="Linear has no parameter tensile_strength"):
        field.scatter(Linear(kn=1e14, ks=1e14), rock)
    with pytest.raises(gl.ParameterError, match="no parameter closure"):
        attrs.evolve(field, names=("closure",)).scatter(LAWS[1], rock)
    with pytest.raises(gl.ParameterError, match="contact points"):
        state_of(small_sample(grains=20), field.scatter(BRITTLE, rock))


def test_what_scatters_together_stays_allowed(rock):
    names = ("tensile_strength", "cohesion", "residual_cohesion")
    law = WeibullField(modulus=2, names=names).scatter(attrs.evolve(BRITTLE, residual_cohesion=20e6), rock)
    assert law.residual_cohesion / law.cohesion == pytest.approx(20 / 29)


@pytest.mark.thorough
def test_a_column_is_as_strong_as_its_weakest_link():
    column = gl.Specimen(Bricks(rows=8, columns=1).tessellate(rectangle(10 * mm, 40 * mm)), ROCK)
    for seed in (1, 2, 3):
        field = WeibullField(modulus=4, seed=seed)
        result = gl.simulate(column, field.scatter(BRITTLE, column), UniaxialTension(maximum_strain=5e-4), frames=1)
        # Smooth platens and straight joints: every joint carries the stress of the platens, to within the waves.
        assert result.summary["strength"] == pytest.approx(13e6 * field.factors(column).min(), rel=0.02)


@pytest.mark.thorough
def test_more_scatter_is_less_strength(rock):
    test = UniaxialTension(loading=gl.Constant(speed=0.05), maximum_strain=4e-4, samples=200)
    fields = {str(modulus): WeibullField(modulus=modulus).scatter(BRITTLE, rock) for modulus in (2, 6, 20)}
    strength = [result.summary["strength"] for result in gl.compare(rock, fields | {"even": BRITTLE}, test).values()]
    assert all(weaker < stronger for weaker, stronger in itertools.pairwise(strength))
