"""The same result bit for bit for any number of threads, on a second run, and inside a comparison."""

import attrs
import numpy as np
import pytest
from support import ROCK, STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw.engine.parts import bonds, zones
from grainlaw.laws import CohesiveCrack, Linear, MohrCoulomb
from grainlaw.protocols import UniaxialCompression, UniaxialTension
from grainlaw.results.result import Cracks

MOHR_COULOMB = MohrCoulomb(**STRONG)
COHESIVE = CohesiveCrack(**STRONG, mode_i_energy=1.5, mode_ii_energy=3)
TENSION = UniaxialTension(loading=gl.Constant(speed=0.3), maximum_strain=5e-4, samples=25, stop_fraction=0)


def several_minerals(material=ROCK, **options):
    """A sample whose grains have one of two phases, softer in the second."""
    grains = small_sample(**options).grains
    phase = np.random.default_rng(3).integers(0, 2, grains.count)
    return gl.Specimen(attrs.evolve(grains, phase=phase), material)


def varied(specimen):
    """A strength of its own for each contact point."""
    points = 2 * len(specimen.mesh.interfaces)
    strength = 13e6 * np.random.default_rng(4).uniform(0.7, 1, points)
    return attrs.evolve(COHESIVE, tensile_strength=strength)


SOFT = gl.Elastic(youngs_modulus=30e9, poissons_ratio=0.2, density=2600)
PAIRS = {(0, 0): MOHR_COULOMB, (1, 1): Linear(**STIFF), (0, 1): COHESIVE}
CASES = {
    "elastic": (small_sample(), COHESIVE),
    "brittle": (small_sample(), MOHR_COULOMB),
    "rigid": (small_sample(material=gl.Rigid(density=3100)), COHESIVE),
    "refined": (small_sample(12, refinement=1), MOHR_COULOMB),
    "phases": (several_minerals({0: ROCK, 1: SOFT}), PAIRS),
    "rigid phases": (several_minerals(gl.Rigid(density=3100)), PAIRS),
    "random strength": (small_sample(), varied(small_sample())),
    "several blocks": (small_sample(1900), COHESIVE),
}


def test_a_case_needs_several_blocks():
    mesh = CASES["several blocks"][0].mesh
    assert len(mesh.zones) > zones.BLOCK
    assert len(mesh.interfaces) > bonds.BLOCK


def assert_same_bits(a, b):
    """All that a result holds of the run."""
    assert a.curves.keys() == b.curves.keys()
    for name in a.curves:
        assert np.array_equal(a.curves[name], b.curves[name], equal_nan=True), name
    for name in (field.name for field in attrs.fields(Cracks)):
        assert np.array_equal(getattr(a.cracks, name), getattr(b.cracks, name)), name
    for one, other in zip(a.frames, b.frames, strict=True):
        for name in ("time", "displacement", "velocity", "stress"):
            assert np.array_equal(getattr(one, name), getattr(other, name)), name
        for name in one.bonds:
            assert np.array_equal(one.bonds[name], other.bonds[name], equal_nan=True), name


@pytest.mark.parametrize(("specimen", "law"), CASES.values(), ids=CASES)
@pytest.mark.alone
def test_any_number_of_threads(specimen, law):
    first = gl.simulate(specimen, law, TENSION)
    assert len(first.cracks) > 1
    assert_same_bits(first, gl.simulate(specimen, law, TENSION))
    for threads in (2, 3):
        assert_same_bits(first, gl.simulate(specimen, law, TENSION, threads=threads))


@pytest.mark.thorough
def test_a_specimen_made_again_is_the_same():
    first, again = (gl.simulate(small_sample(seed=5), COHESIVE, TENSION) for _ in range(2))
    assert_same_bits(first, again)


@pytest.mark.thorough
def test_another_seed_is_not_the_same():
    """What the other tests compare can differ."""
    first, other = (gl.simulate(small_sample(seed=seed), COHESIVE, TENSION) for seed in (1, 2))
    with pytest.raises(AssertionError):
        assert_same_bits(first, other)


@pytest.mark.thorough
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_inside_a_comparison(threads):
    specimen = several_minerals()
    laws = {"brittle": MOHR_COULOMB, "cohesive": COHESIVE, "both": PAIRS}
    comparison = gl.compare(specimen, laws, TENSION, threads=threads)
    assert list(comparison) == list(laws)
    for name, law in laws.items():
        assert_same_bits(comparison[name], gl.simulate(specimen, law, TENSION))


@pytest.mark.parametrize("relaxation", [gl.integration.AdaptiveRelaxation(), gl.integration.KineticRelaxation()])
def test_relaxation_in_several_threads(relaxation):
    test = UniaxialCompression(
        maximum_strain=1e-4,
        loading=gl.Constant(speed=0.1),
        samples=10,
        integrator=gl.integration.DynamicRelaxation(relaxation=relaxation),
    )
    first, other = (gl.simulate(small_sample(20), COHESIVE, test, threads=threads) for threads in (1, 3))
    assert_same_bits(first, other)
