"""The first failure: what counts as one, and what does not."""

import itertools
import math
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import BRITTLE, ROCK, STRONG, small_sample

import grainlaw as gl
from grainlaw.columns import quantity_of
from grainlaw.geometry import Voronoi, disc, rectangle
from grainlaw.laws import CohesiveCrack, Linear
from grainlaw.moduli import elastic_moduli
from grainlaw.protocols import BiaxialCompression, Brazilian, UniaxialCompression, UniaxialTension
from grainlaw.results.certificate import doubts, has_failed, texts
from grainlaw.strength import Borne, borne
from grainlaw.units import MPa

COHESIVE = CohesiveCrack(**STRONG, mode_i_energy=1.5, mode_ii_energy=3)


def found(way, load, stage=None):
    way, load = np.asarray(way, dtype=float), np.asarray(load, dtype=float)
    return borne(load, way, np.zeros(len(way)) if stage is None else np.asarray(stage))


def test_a_stage_fails_by_its_own_deformation_and_damage():
    """The load is level from 1 mm of this stage on, which is 10 mm of the run: 1 % of 1 mm later it has failed."""
    way = np.linspace(10e-3, 11.02e-3, 1021)
    load = np.minimum((way - 10e-3) * 1e8, 1e5)

    def fails(samples, damaged, stage=1.0, after=0.0):
        columns = {"load": load, "way": way + after, "damaged": damaged * np.ones(1021), "stage": np.full(1021, stage)}
        return gl.conditions.Fails("load", "way").progress({name: column[:samples] for name, column in columns.items()})

    cracks = np.append(np.full(1000, 7.0), np.full(21, 8.0))
    assert [fails(samples, cracks) for samples in (1005, 1021)] == [0, 1]
    assert fails(1021, 7.0) == 0  # of the stage before
    assert fails(1021, 7.0, stage=0.0, after=-10e-3) == 1


def test_a_stage_that_begins_under_load_fails_by_all_of_its_deformation():
    """It was held at 2 mm and 112 kN, and is pressed on as stiff as before, to 3 mm; then the load is level."""
    way = np.linspace(2e-3, 3.05e-3, 1051)[1:]
    columns = {
        "load": np.minimum(way, 3e-3) * 56e6, "way": way, "damaged": np.arange(1050.0), "stage": np.full(1050, 2.0),
    }  # fmt: skip

    def fails(samples):
        return gl.conditions.Fails("load", "way").progress({name: column[:samples] for name, column in columns.items()})

    assert not any(fails(samples) for samples in range(2, 1025, 7))
    assert fails(1035) == 1  # 1 % of 3 mm after the load has grown for the last time


def course(*corners, samples=2001):
    """Straight lines between (deformation, load), sampled evenly from the first step on."""
    x, y = np.transpose(corners)
    way = np.linspace(x[0], x[-1], samples)[1:]
    return way, np.interp(way, x, y)


def test_a_load_that_grows_to_the_end_is_no_strength():
    way, load = course((0, 0), (1, 100))
    assert found(way, load) == Borne(failed=False, at=len(load) - 1, largest=len(load) - 1)
    assert found(way, -load) is None
    assert found([], []) is None


def test_a_load_that_falls_by_a_twentieth_has_failed_at_once():
    way, load = course((0, 0), (1, 100), (1.001, 60), (1.01, 60.2))
    assert found(way, load).failed
    assert load[found(way, load).at] == pytest.approx(100, rel=1e-3)


@pytest.mark.parametrize(
    ("course_after", "strength"),
    [
        ([(1.001, 99.6), (1.005, 100), (2, 198)], 198),  # a crack: it is as stiff as before, and soon bears more
        ([(1.01, 97), (1.5, 120), (2, 150)], 100),  # pieces: it takes 6 % more deformation to bear as much again
        ([(1.011, 100.05), (2, 150)], 100.05),  # a plateau
        ([(1.007, 100), (2, 196)], 196),  # a shorter one
    ],
)
def test_a_failure_is_a_load_that_does_not_grow_while_the_deformation_grows_by_1_percent(course_after, strength):
    way, load = course((0, 0), (1, 100), *course_after, (2.05, 0), samples=20001)
    assert found(way, load).failed
    assert load[found(way, load).at] == pytest.approx(strength, rel=2e-3)
    assert load[found(way, load).largest] == load.max()


def test_waves_at_the_beginning_are_no_failure():
    way, load = course((0, 0), (0.04, 8), (0.05, 0), (0.06, 8), (1, 100), (1.1, 0))
    assert load[found(way, load).at] == pytest.approx(100, rel=2e-3)


def test_a_record_that_begins_under_load_has_not_failed_there():
    """The first sample has a fifth of the load and no deformation yet, as when a loop of loading is judged."""
    way = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    assert not found(way, 20 + 20 * way).failed
    assert found(np.append(way, [4.1, 4.2]), np.append(20 + 20 * way, [100, 100])) == Borne(
        failed=True, at=4, largest=4
    )


@pytest.mark.parametrize("preload", [9.9, 20.0, 60.0, 99.0])
@pytest.mark.parametrize("samples", [200, 2000, 20000])
def test_a_load_before_any_deformation_is_no_failure(preload, samples):
    """As of a heated specimen between platens, or in a record of a machine that was set to zero under load."""
    way, load = course((0, preload), (1 - preload / 100, 100), (1.1 - preload / 100, 100), (1.11, 50), samples=samples)
    assert load[found(way, load).at] == pytest.approx(100, rel=1e-3)
    zeroed = found(np.append(0.0, way), np.append(preload, load))
    assert zeroed.at - 1 == found(way, load).at
    held = np.linspace(0, preload, 50)
    together = found(np.append(0 * held, way), np.append(held, load), np.append(0 * held, 1 + 0 * way))
    assert together.at - 50 == found(way, load).at
    assert together.failed
    number = int(np.argmax(load >= preload + 0.3 * (100 - preload)))
    level = np.minimum(load, load[number])  # it stops growing on its way
    assert load[found(way, level).at] == pytest.approx(load[number])
    assert found(way, level).failed


def test_loops_of_unloading_are_no_failure():
    corners = [(0, 0), (0.5, 50), (0.2, 5), (0.5, 49.9), (1, 100), (0.7, 10), (1, 99), (1.2, 120), (1.3, 60)]
    parts = [course(a, b, samples=200) for a, b in itertools.pairwise(corners)]
    way, load = np.concatenate(parts, axis=1)
    stage = np.repeat(np.arange(len(parts)), 199)
    assert load[found(way, load, stage).at] == pytest.approx(120, rel=2e-3)
    assert load[found(way, load).at] == pytest.approx(120, rel=2e-3)  # as in a record of a laboratory


def test_a_loop_in_a_record_of_one_stage_is_no_failure():
    """As a laboratory writes it down, with a softer branch up; but a load that never comes back has failed."""
    up, down = np.linspace(0, 40, 81), np.linspace(40, 4, 60)
    load = np.concatenate([up, down[1:], down[::-1][1:], np.linspace(40, 150, 221)[1:], [149, 120, 60]])
    way = load / 50 + np.concatenate(
        [np.zeros(81 + 59), np.linspace(0.01, 0.02, 59), np.full(220, 0.02), [0.1, 0.3, 0.5]]
    )
    assert load[found(way, load).at] == 150
    class_ii = np.concatenate([up, down[1:]])
    assert found(np.append(up, 0.9 * down[1:] + 3), class_ii) == Borne(failed=True, at=80, largest=80)


@pytest.mark.parametrize("beyond", [0.0, 0.1, 3.0])
def test_a_load_that_turns_late_has_not_failed(beyond):
    """The first samples of an unloading stage lie above the last of the loading: the drive has turned, waves come."""
    corners = [(0, 0), (0.5, 50), (0.5, 50 + beyond), (0.2, 5), (1, 100), (1, 100 + beyond), (0.7, 10), (1.2, 120)]
    parts = [course(a, b, samples=200) for a, b in itertools.pairwise([*corners, (1.3, 60)])]
    way, load = np.concatenate(parts, axis=1)
    stage = np.repeat([0, 1, 1, 2, 3, 3, 4, 4], 199)  # the third and the sixth part unload
    assert load[found(way, load, stage).at] == pytest.approx(120, rel=2e-3)


def test_a_load_that_grows_in_its_stage_may_fall_with_the_deformation():
    """As on a gauge beside the place that fails."""
    parts = [course(a, b, samples=200) for a, b in itertools.pairwise([(0, 0), (0.5, 50), (0.3, 20), (0.4, 22)])]
    way, load = np.concatenate(parts, axis=1)
    assert load[found(way, load).at] == pytest.approx(50, rel=2e-3)


def test_a_stage_that_begins_under_load_may_fail_at_once():
    """As one that goes on more slowly just below the strength."""
    parts = [course(a, b, samples=200) for a, b in itertools.pairwise([(0, 0), (0.5, 50), (0.505, 50.5), (0.6, 20)])]
    way, load = np.concatenate(parts, axis=1)
    assert load[found(way, load, np.repeat([0, 1, 1], 199)).at] == pytest.approx(50.5, rel=2e-3)


@given(st.floats(1e-9, 1e9), st.floats(1e-9, 1e9), st.integers(1, 12))
def test_it_does_not_depend_on_units_nor_on_how_dense_samples_are(unit, length, every):
    way, load = course((0, 0), (0.7, 70), (0.702, 69.8), (1, 98), (1.03, 96), (2, 150), (2.2, 30), samples=6001)
    way, load = way[every - 1 :: every], load[every - 1 :: every]
    here = found(way * length, load * unit)
    assert here == found(way, load)
    assert load[here.at] == pytest.approx(98, rel=5e-3)


TESTS = [
    (UniaxialCompression(samples=300), BRITTLE),
    (UniaxialTension(samples=300), BRITTLE),
    (BiaxialCompression(confinement=5 * MPa, samples=300), COHESIVE),
]


@pytest.mark.thorough
@pytest.mark.parametrize(("test", "law"), TESTS)
def test_a_test_that_ends_at_the_failure_finds_the_same_strength(test, law):
    rock = small_sample(60)
    whole = gl.simulate(rock, law, test)
    short = gl.simulate(rock, law, attrs.evolve(test, until=gl.Until.FAILURE))
    assert short.summary["strength"] == whole.summary["strength"]
    assert short.summary["failure_strain"] == whole.summary["failure_strain"]
    assert len(short.curves["stress"]) < len(whole.curves["stress"])
    assert has_failed(short)
    load = short.curves.get("deviator", short.curves["stress"])
    assert short.summary["strength"] == pytest.approx(load.max() + getattr(test, "confinement", 0))


def test_moduli_are_those_between_a_fifth_and_half_of_the_strength():
    """A toe that closes, a straight part and a bend, each with moduli of its own."""
    corners = [(0, 0), (1.0, 20), (1.5, 50), (3.5, 100), (3.6, 10)]  # 1e-3, MPa: 20, 60 and 25 GPa
    strain, stress = course(*corners)
    lateral = np.interp(strain, [0, 1.0, 1.5, 3.5], [0, 0.1, 0.25, 1.25])  # extension counts positive
    curves = {"strain": 1e-3 * strain, "stress": stress * MPa, "lateral_strain": 1e-3 * lateral, "stage": 0 * strain}
    moduli = elastic_moduli(curves, small_sample(), -1.0)
    assert moduli["apparent_modulus"] == pytest.approx(60e9, rel=0.01)
    assert moduli["apparent_poisson"] == pytest.approx(0.3, rel=0.01)


def test_moduli_are_of_the_path_to_the_peak_and_not_of_loops_below_it():
    """60 GPa with a lateral ratio of 0.3, but for a loop from 60 MPa on which it is softer, and wider."""
    corners = [(0, 0), (1.0, 60), (0.3, 10), (1.0, 60), (1.667, 100), (1.8, 10)]  # 1e-3, MPa
    strain, stress = (np.interp(np.linspace(0, 5, 501), range(6), values) for values in zip(*corners, strict=True))
    stage = np.repeat([0, 1, 2], [100, 100, 301])
    lateral = 0.3 * strain + np.where((stage > 0) & (strain < 1), 0.1 * (1 - strain), 0)
    curves = {"strain": 1e-3 * strain, "stress": stress * MPa, "lateral_strain": 1e-3 * lateral, "stage": stage}
    moduli = elastic_moduli(curves, None, -1.0)
    assert moduli["apparent_modulus"] == pytest.approx(60e9, rel=0.02)
    assert moduli["apparent_poisson"] == pytest.approx(0.3, rel=0.02)


@pytest.mark.thorough
def test_what_has_not_failed_has_no_strength():
    rock = small_sample(20)
    sound = gl.simulate(rock, Linear(kn=1e14, ks=1e14), UniaxialCompression(samples=20, maximum_strain=1e-3))
    assert np.isnan(sound.summary["strength"])
    assert "strength (MPa)" in str(gl.compare(rock, {"linear": Linear(kn=1e14, ks=1e14)}, sound.protocol))
    assert list(doubts(sound)) == []  # nothing can break
    bent = gl.simulate(rock, CohesiveCrack(**STRONG, mode_i_energy=15, mode_ii_energy=30), UniaxialCompression(
        samples=100, maximum_strain=3e-3))  # fmt: skip
    assert bent.curves["damaged"][-1] > 0
    assert np.isnan(bent.summary["strength"])
    assert list(doubts(bent)) == ["the specimen had not failed when the test ended"]
    assert f"&gt; {bent.summary['largest_stress'] / MPa:.2f}" in bent._repr_html_()


def judged(asked=math.inf, law=BRITTLE, damaged=(), **summary):
    """Doubts about a test that recorded nothing else."""
    loading = SimpleNamespace(imbalance=asked)
    curves = {"damaged": np.array(damaged)}
    return list(doubts(SimpleNamespace(
        summary=summary, law=law, curves=curves, protocol=SimpleNamespace(loading=loading), stages=(),
        quantity=quantity_of, of_test=lambda: SimpleNamespace(curves=curves),
    )))  # fmt: skip


NOT_FAILED = "the specimen had not failed when the test ended"


def test_what_is_doubted_of_a_strength():
    assert judged() == judged(strength=100.0) == judged(strength=100.0, largest_stress=100.9) == []
    assert judged(failure_force=100.0, largest_force=100.9) == []
    for name, largest, words in (
        ("strength", "largest_stress", "largest stress"), ("failure_force", "largest_force", "largest force"),
    ):  # fmt: skip
        (found,) = judged(**{name: 100.0, largest: 101.1})
        assert found.startswith("after its first failure the specimen bore more than its strength, its ")
        assert f"its {words} is that of what was left of it" in found
    assert judged(strength=math.nan) == [NOT_FAILED]
    elastic = Linear(kn=1e14, ks=1e14)
    assert judged(strength=math.nan, law=elastic, damaged=[0, 0.0]) == []
    assert judged(strength=math.nan, law=elastic, damaged=[0, 0, 1.0]) == [NOT_FAILED]
    assert judged(strength=math.nan, law={"inside": elastic, ...: BRITTLE}) == [NOT_FAILED]


def test_a_fluid_that_reaches_nothing_is_a_doubt():
    assert judged(wet=3) == []
    assert judged(wet=0) == ["the fluid has reached no contact point"]


def test_a_strength_that_is_not_known_is_shown_as_a_bound():
    summary = {"strength": math.nan, "largest_stress": 2e6, "modulus": math.nan, "energy_error": 1.0, "steps": 7}
    unknown = SimpleNamespace(summary=summary, law=BRITTLE, curves={}, quantity=quantity_of)
    assert texts(unknown, [*summary, "never"]) == {
        "strength (MPa)": "> 2.00", "largest stress (MPa)": "2.00", "E (GPa)": "-",
        "energy error": "1.0e+00 FAIL", "steps": "7",
    }  # fmt: skip
    elastic = SimpleNamespace(**vars(unknown) | {"law": Linear(kn=1e14, ks=1e14)})
    known = SimpleNamespace(**vars(unknown) | {"summary": summary | {"strength": 1.5e6, "energy_error": 0.005}})
    assert texts(elastic, ["strength"]) == {"strength (MPa)": "-"}
    assert texts(known, ["strength", "energy_error"]) == {"strength (MPa)": "1.50", "energy error": "5.0e-03"}


def test_a_balance_that_was_asked_for_and_not_had_is_a_doubt():
    """Above the limit of 0.01 it is more than that."""
    assert judged(0.001, imbalance=0.001) == judged(0.02, imbalance=0.009) == judged(imbalance=0.009) == []
    assert "the imbalance of 0.001 that was asked for was not had" in judged(0.001, imbalance=0.002)[0]
    (above,) = judged(0.001, imbalance=0.011)
    assert "is above its limit; the load was not in balance" in above
    (unknown,) = judged(imbalance=math.nan)
    assert unknown.endswith("cannot be computed, so the test has failed its certificate")


@pytest.mark.thorough
def test_a_largest_stress_above_the_strength_is_a_doubt():
    """120 grains under 5 MPa: a fall by 4 % at 191 MPa, then columns of grains that interlock."""
    grains = Voronoi(grains=120, seed=1).tessellate(rectangle(20e-3, 50e-3))
    local = gl.integration.CentralDifference(damping=gl.integration.LocalDamping())
    result = gl.simulate(gl.Specimen(grains, ROCK), BRITTLE, BiaxialCompression(confinement=5 * MPa), integrator=local)
    assert result.summary["strength"] == pytest.approx(191.1 * MPa, rel=0.01)
    if result.summary["largest_stress"] > 1.01 * result.summary["strength"]:  # what is left is chaotic
        assert any("bore more than its strength" in words for words in doubts(result))


@pytest.mark.thorough
@pytest.mark.parametrize("samples", [100, 250])
@pytest.mark.parametrize(
    "test", [UniaxialCompression(), BiaxialCompression(confinement=20 * MPa, until=gl.Until.FAILURE)]
)
def test_a_strength_does_not_depend_on_the_number_of_samples(test, samples):
    """Under confinement the first sample has more than a tenth of the load at which contacts begin to break."""
    rock = small_sample(60)
    usual, few = (gl.simulate(rock, BRITTLE, attrs.evolve(test, samples=n)) for n in (1000, samples))
    assert few.summary["strength"] == pytest.approx(usual.summary["strength"], rel=0.01)
    assert len(few.curves["stress"]) < len(usual.curves["stress"])


@pytest.mark.thorough
def test_a_disc_is_read_by_its_load():
    rock = gl.Specimen(Voronoi(grains=60, seed=1).tessellate(disc(20e-3)), ROCK)
    result = gl.simulate(rock, BRITTLE, Brazilian(until=gl.Until.FAILURE))
    at = int(np.argmax(result.curves["force"]))
    assert result.summary["failure_force"] == result.curves["force"][at]
    assert result.summary["strength"] == result.curves["stress"][at]
