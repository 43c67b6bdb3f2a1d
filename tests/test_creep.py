"""Time jumped over: bars under a held load against the growth law, and small specimens that creep."""

from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from scipy.integrate import quad
from support import STIFF, small_sample

import grainlaw as gl
from grainlaw.columns import ENERGY, SPENT, STAGE, SUPPLIED
from grainlaw.engine import ageing
from grainlaw.geometry import Bricks, from_polygons, rectangle
from grainlaw.laws import BandisClosure, CharlesGrowth, CohesiveCrack, ExponentialGrowth, MohrCoulomb, StaticFatigue
from grainlaw.protocols import Creep
from grainlaw.protocols.creep import Collapses
from grainlaw.stage import Outlasts
from grainlaw.units import MPa, mm

STRENGTH, RATE = 10 * MPa, 1e-6
BOND = MohrCoulomb(**STIFF, tensile_strength=STRENGTH, cohesion=30 * MPa, friction_angle=30)
ROCK = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.0, density=3000)
SOFT = CohesiveCrack(
    **STIFF, tensile_strength=10 * MPa, cohesion=25 * MPa, friction_angle=25, residual_friction_angle=15,
    mode_i_energy=30, mode_ii_energy=100,
)  # fmt: skip
AGEING = StaticFatigue(law=SOFT, rate=1.0, growth=CharlesGrowth(exponent=20))
CREEP = Creep(load=75 * MPa, duration=1e3, largest_growth=0.1)


@attrs.frozen(kw_only=True)
class HeldTension(gl.LoadingProtocol):
    """Pull a specimen by a force that is held until a bond breaks."""

    stress: float = gl.parameter("Pa")
    duration: float = gl.parameter("s")
    largest_growth: float = gl.parameter("1", default=0.02)

    def stages(self, specimen):
        held = [gl.loads.Drive(boundary="bottom", axis=1, speed=0.0)]
        common = {"interval": 2e-6, "integrator": gl.integration.CentralDifference()}
        rise = gl.loads.Hold(boundary="top", axis=1, stress=self.stress, ramp=2e-5)
        hold = gl.loads.Hold(boundary="top", axis=1, stress=self.stress, start=self.stress)
        ageing = gl.Ageing(duration=self.duration, largest_growth=self.largest_growth, ratio=1e-6)
        ends = [gl.conditions.Reaches("broken", 1), gl.conditions.Reaches("aged", self.duration)]
        return [
            gl.Stage(name="pull", loads=[rise, *held], until=[gl.conditions.AtRest(1e-6)], static=True, **common),
            gl.Stage(name="hold", loads=[hold, *held], until=ends, ageing=ageing, **common),
        ]

    def measure(self, state):
        broken, fatigue = (state.memory(name) for name in ("damage", "fatigue"))
        return {"aged": state.clock.aged, "broken": float((broken >= 1).sum()), "fatigue": float(fatigue.max())}

    def summary(self, curves, specimen):
        return {"time": float(curves["aged"][-1]), "broken": float(curves["broken"][-1])}


def bar(blocks):
    return gl.Specimen(Bricks(rows=blocks, columns=1).tessellate(rectangle(4 * mm, 4 * mm * blocks)), ROCK)


def lasts(load, exponent):
    """s, by hand: the integral of ds / (rate load^n s^(3 - n)) from the load to 1."""
    return (1 - load ** (exponent - 2)) / ((exponent - 2) * RATE * load**exponent)


def failed_after(specimen, load, growth, largest_growth=0.02):
    law = StaticFatigue(law=BOND, rate=RATE, growth=growth)
    test = HeldTension(stress=load * STRENGTH, duration=1e16, largest_growth=largest_growth)
    run = gl.simulate(specimen, law, test, threads=1, frames=1)
    assert run.summary["broken"] >= 1
    return run.summary["time"]


@pytest.mark.parametrize("load", [0.5, 0.8])
def test_a_bond_under_a_held_tension(load):
    """Longer than by hand by no more than the last jump, in which the strength falls from above the load by 0.02."""
    exact, found = lasts(load, 20.0), failed_after(bar(2), load, CharlesGrowth(exponent=20))
    last = ((load + 0.02) ** 18 - load**18) / (1 - load**18)
    assert exact * (1 - 1e-4) <= found <= exact * (1 + last + 1e-4)


def test_smaller_jumps_come_nearer():
    exact = lasts(0.8, 20.0)
    coarse, fine = (failed_after(bar(2), 0.8, CharlesGrowth(exponent=20), growth) for growth in (0.1, 0.005))
    assert abs(fine - exact) < 0.003 * exact
    assert abs(fine - exact) < abs(coarse - exact) / 4


def test_bonds_in_series_fail_with_the_first():
    """Each bears the same tension, so a bar of four blocks lasts as long as one of two."""
    growth = CharlesGrowth(exponent=20)
    assert failed_after(bar(4), 0.8, growth) == pytest.approx(failed_after(bar(2), 0.8, growth), rel=1e-3)


@pytest.mark.thorough
def test_exponential_growth_in_a_bar():
    exact = quad(lambda s: np.exp(25 * (1 - 0.7 / s)) / RATE, 0.7, 1)[0]
    found = failed_after(bar(2), 0.7, ExponentialGrowth(activation=25), 0.005)
    assert found == pytest.approx(exact, rel=0.01)


def test_the_slope_of_time_over_load():
    """In logarithms minus the exponent, at loads of which the power n - 2 is nothing."""
    loads = np.array([0.35, 0.5])
    times = [failed_after(bar(2), load, CharlesGrowth(exponent=20)) for load in loads]
    assert np.diff(np.log(times))[0] / np.diff(np.log(loads))[0] == pytest.approx(-20, abs=0.01)


def crept_bar(**test):
    """A bar with a bond at 45 degrees, without friction, under 0.8 of its strength; its test, run and time by hand.

    The stress is uniform, and the shear on the bond half of it. Loads are small, so that the bond hardly turns.
    """
    lower, upper = [(0, 0), (4, 0), (4, 6), (0, 2)], [(0, 2), (4, 6), (4, 8), (0, 8)]
    bond = MohrCoulomb(**STIFF, tensile_strength=1 * MPa, cohesion=3 * MPa, friction_angle=0)
    law = StaticFatigue(law=bond, rate=RATE, growth=CharlesGrowth(exponent=20))
    test = Creep(load=2 * 0.8 * 3 * MPa, ratio=1e-6, **test)
    specimen = gl.Specimen(from_polygons([np.array(corners) * mm for corners in (lower, upper)]), ROCK)
    return test, gl.simulate(specimen, law, test, threads=1, frames=1)


@pytest.mark.parametrize("growth", [0.1, 0.5])
def test_time_to_failure_counts_the_jump_that_breaks(growth):
    """Longer than by hand by no more than that jump; at 0.5 the first breaks the bond."""
    exact = lasts(0.8, 20.0)
    _, run = crept_bar(duration=1e9, largest_growth=growth)
    last = (min(0.8 + growth, 1) ** 18 - 0.8**18) / (1 - 0.8**18)
    if growth == 0.5:
        assert run.summary["jumps"] == 1
        last = (0.8**18 - 0.5**18) / (1 - 0.8**18)  # from the whole strength to no less than half of it
    assert run.summary["failed"]
    assert exact * (1 - 2e-3) <= run.summary["time_to_failure"] <= exact * (1 + last + 2e-3)


def test_the_last_jump_may_break():
    """It is seen by the motion after it."""
    duration = 1.005 * lasts(0.8, 20.0)
    _, run = crept_bar(duration=duration, largest_growth=0.5)
    assert run.summary["failed"]
    assert run.summary["time_to_failure"] == duration
    lost = (0.8 * 3 * MPa) ** 2 / (2 * STIFF["ks"]) * 4 * np.sqrt(2) * mm  # J: of its shear; what presses it stays
    assert run.curves["aged_loss"][-1] == pytest.approx(lost, rel=1e-3)


def test_a_test_ends_at_the_equilibrium_after_the_last_jump():
    duration = 0.9 * lasts(0.8, 20.0)
    test, run = crept_bar(duration=duration, largest_growth=0.5)
    assert not run.summary["failed"]
    assert test.curve(run.curves)["time"].tolist() == [0.0, duration]
    assert np.abs(run.curves["aged_loss"]).max() <= 1e-9 * run.curves[ENERGY + SUPPLIED].max()  # weaker, and as stiff
    after = run.curves["jumps"] == 1
    assert after.sum() >= 2
    assert run.curves["unbalanced"][after][-2:].max() <= 1e-6


@attrs.frozen(kw_only=True)
class HeldTwice(HeldTension):
    """Two stages of ageing, each of the same duration."""

    def stages(self, specimen):
        pull, hold = super().stages(specimen)
        again = attrs.evolve(hold, name="again", until=[gl.conditions.Reaches("aged", 2 * self.duration)])
        return [pull, hold, again]


def test_time_passes_in_every_stage_that_ages():
    """By hand: the fatigue under a held load after both durations."""
    duration, x = 0.4 * lasts(0.5, 20.0), 0.5
    law = StaticFatigue(law=BOND, rate=RATE, growth=CharlesGrowth(exponent=20))
    run = gl.simulate(bar(2), law, HeldTwice(stress=x * STRENGTH, duration=duration), threads=1, frames=1)
    curves = run.curves
    assert [curves["aged"][curves[STAGE] == k].max() for k in (1, 2)] == [duration, 2 * duration]
    assert 1 - run.curves["fatigue"][-1] == pytest.approx((1 - 18 * RATE * x**20 * 2 * duration) ** (1 / 18), rel=1e-4)


@attrs.frozen(kw_only=True)
class HeldOn(HeldTension):
    """A test that says nothing of time: only of what never comes."""

    def stages(self, specimen):
        pull, hold = super().stages(specimen)
        return [pull, attrs.evolve(hold, until=[gl.conditions.Reaches("never", 1)], sample_limit=20_000)]

    def measure(self, state):
        found = super().measure(state)
        del found["aged"]
        return {**found, "never": 0.0}


def test_a_stage_ends_at_rest_when_its_time_has_passed():
    law = StaticFatigue(law=BOND, rate=RATE, growth=CharlesGrowth(exponent=20))
    duration = 0.4 * lasts(0.5, 20.0)
    run = gl.simulate(bar(2), law, HeldOn(stress=0.5 * STRENGTH, duration=duration), threads=1, frames=1)
    assert run.summary["time"] == duration
    assert run.curves["jumps"][-2] == run.curves["jumps"][-1] > 1


def test_a_specimen_that_fails_while_time_passes_ends_the_run_with_its_reason():
    """The upper block is pulled away by its load: it never rests, and the test ends by nothing that it knows."""
    law = StaticFatigue(law=BOND, rate=RATE, growth=CharlesGrowth(exponent=20))
    test = HeldOn(stress=0.5 * STRENGTH, duration=2 * lasts(0.5, 20.0))
    with pytest.raises(
        gl.StageError, match=r"stage 'hold': the specimen has failed after .* end the stage where"
    ) as told:
        gl.simulate(bar(2), law, test, threads=1, frames=1)
    curves = told.value.result.curves
    assert 0.9 * lasts(0.5, 20.0) < curves["aged"][-1] < 1.1 * lasts(0.5, 20.0)
    assert len(curves["aged"]) < 2000


@pytest.fixture(scope="module")
def crept():
    return gl.simulate(small_sample(30), AGEING, CREEP, threads=1, frames=1)


def test_energy_closes_through_jumps(crept):
    c = crept.curves
    assert crept.summary["jumps"] > 10
    assert crept.summary["cracks"] > crept.summary["cracks_at_first"]
    supplied = c[ENERGY + SUPPLIED]
    assert np.abs(supplied - sum(c[ENERGY + kind] for kind in SPENT)).max() < 1e-6 * supplied.max()
    assert np.diff(c["aged_loss"]).min() >= -1e-9 * supplied.max()  # jumps take energy and give none


def test_strain_grows_and_time_passes(crept):
    curve = CREEP.curve(crept.curves)
    held = crept.curves[STAGE] == crept.curves[STAGE].max()
    assert np.all(np.diff(curve["time"]) > 0)
    assert curve["strain"][-1] > curve["strain"][0]
    assert np.all(np.diff(crept.curves["fatigue"][held]) >= 0)


@pytest.mark.alone
def test_threads_give_the_same_bits(crept):
    again = gl.simulate(small_sample(30), AGEING, CREEP, threads=2, frames=1)
    for name, values in crept.curves.items():
        assert np.array_equal(values, again.curves[name], equal_nan=True), name


@pytest.mark.parametrize(
    ("unbalanced", "motion", "work", "at_rest"),
    [
        ([1e-3, 5e-5, 4e-5], [1e-2, 9e-5, 8e-5], [1.0, 1.1, 1.2], True),
        ([1e-3, 5e-5, 4e-4], [1e-2, 9e-5, 8e-5], [1.0, 1.0, 1.0], False),  # forces do not balance
        ([1e-5, 1e-5, 1e-5], [0.1, 0.1, 0.1], [1.0, 1.0, 1.0], True),  # a piece flies
        ([1e-5, 1e-5, 1e-5], [0.1, 0.1, 0.1], [1.0, 1.001, 1.002], False),  # the load goes down steadily
    ],
)
def test_when_a_specimen_rests(unbalanced, motion, work, at_rest):
    curves = {"unbalanced": unbalanced, "motion": motion, ENERGY + SUPPLIED: work}
    found = gl.Ageing(duration=1.0, ratio=1e-4).rests({name: np.array(values) for name, values in curves.items()})
    assert found is at_rest


@pytest.mark.parametrize(
    ("aged", "jumps", "unbalanced", "progress"),
    [
        ([30, 30, 34], [2, 2, 3], 1e-5, 0.4),
        ([30, 34, 40], [3, 4, 5], 1e-5, 0.99),  # there was a jump between the last samples
        ([30, 40, 40], [4, 5, 5], 1e-3, 0.99),  # it does not rest
        ([30, 40, 40], [4, 5, 5], 1e-5, 1.0),
    ],
)
def test_time_passes_from_the_beginning_of_a_stage_until_the_specimen_rests(aged, jumps, unbalanced, progress):
    curves = {"aged": aged, "jumps": jumps, "unbalanced": [unbalanced] * 3, "motion": [1e-5] * 3}
    curves = {name: np.array(values, dtype=float) for name, values in curves.items()}
    found = Outlasts(gl.Ageing(duration=10.0)).progress(curves | {ENERGY + SUPPLIED: np.ones(3)})
    assert found == pytest.approx(progress, rel=1e-12)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Creep(load=5 * MPa, duration=1.0, confinement=5 * MPa), "above confinement"),
        (lambda: Creep(load=5 * MPa, duration=0.0), "duration"),
        (lambda: gl.Ageing(duration=1.0, largest_growth=0.7), "largest_growth"),
        (lambda: StaticFatigue(law=attrs.evolve(SOFT, closure=BandisClosure(maximum_closure=1e-5)), rate=1), "closure"),
    ],
)
def test_what_is_refused(make, message):
    with pytest.raises(gl.ParameterError, match=message):
        make()


def test_grains_that_would_stand_still_are_refused():
    @attrs.frozen(kw_only=True)
    class Flowing(gl.Elastic):
        def stress(self, exx, eyy, exy, time_step):
            return self.youngs_modulus * exx, self.youngs_modulus * eyy, self.youngs_modulus * exy

    flowing = Flowing(youngs_modulus=60e9, poissons_ratio=0.25, density=2700)
    with pytest.raises(gl.ParameterError, match=r"Flowing.stress takes time_step, and time passes in jumps for bonds"):
        gl.simulate(small_sample(12, material=flowing), AGEING, CREEP, threads=1)


def test_a_law_that_does_not_age_is_refused():
    with pytest.raises(gl.ParameterError, match=r"no bond ages.*StaticFatigue"):
        gl.simulate(small_sample(12), SOFT, CREEP, threads=1)


def test_a_rate_at_which_nothing_lasts_stops_the_run():
    """In the time of the run, and in the first jump."""
    law = attrs.evolve(AGEING, rate=1e20)
    with pytest.raises(gl.StageError, match=r"of the run in which the load is applied: the rate of fatigue is too"):
        gl.simulate(small_sample(12), law, CREEP, threads=1, frames=1)
    law = StaticFatigue(law=BOND, rate=1e3)
    with pytest.raises(gl.StageError, match=r"1e\+20 s: the rate of fatigue is too high"):
        gl.simulate(bar(2), law, HeldTension(stress=0.8 * STRENGTH, duration=1e20), threads=1, frames=1)


def test_a_specimen_collapses_by_the_growth_of_its_strain():
    """From 0.004 to 0.005 is a quarter of 0.004."""
    assert Collapses(0.004).progress({"strain": np.array([0.004, 0.0, 0.005])}) == pytest.approx(0.25)


def test_laws_age_whose_bonds_remember_fatigue_and_take_the_time():
    """Of five, two: of the others one has no bond, one remembers no fatigue, one takes no time."""
    laws = {"first": (3, 0, "time_step"), "empty": (0, 0, "time_step"), "forgets": (3, -1, "time_step"),
            "timeless": (3, 0, "temperature"), "second": (1, 2, "time_step")}  # fmt: skip
    groups = [
        SimpleNamespace(name=name, size=size, row=lambda which, at=at: at, compiled=SimpleNamespace(scalars=(scalar,)))
        for name, (size, at, scalar) in laws.items()
    ]
    found = ageing._ageing(SimpleNamespace(bonds=SimpleNamespace(groups=groups)))
    assert [group.name for group in found] == ["first", "second"]


def test_a_load_above_the_strength_stops_the_run():
    with pytest.raises(gl.StageError, match="failed under the load of 900 MPa as it was applied"):
        gl.simulate(small_sample(12), AGEING, attrs.evolve(CREEP, load=900 * MPa), threads=1, frames=1)


def test_confinement_is_held_too():
    test = attrs.evolve(CREEP, confinement=5 * MPa, duration=1e-3)
    run = gl.simulate(small_sample(12), AGEING, test, threads=1, frames=1)
    assert run.summary["jumps"] == 1
    assert not run.summary["failed"]
    last = {name: values[-1] for name, values in run.curves.items()}
    assert last["stress"] == pytest.approx(75 * MPa, rel=1e-3)
    assert last["strain"] > 70 * MPa / 60e9  # grains alone; bonds add to it


def test_the_largest_growth_is_that_of_fatigue_alone(monkeypatch):
    """Of two laws, whose fatigue is their second and their first memory."""
    told = []
    memories = {"a": np.array([[0.0, 0.0], [0.1, 0.2]]), "b": np.array([[0.3, 0.4]])}
    grown = {"a": np.array([[9.0, 9.0], [0.02, 0.05]]), "b": np.array([[0.01, 0.03]])}

    def respond(state, group, memory, seconds):
        memory += grown[group.name]
        told.append((group.name, seconds))

    groups = [SimpleNamespace(name=name, row=lambda which, at=at: at) for name, at in (("a", 1), ("b", 0))]
    monkeypatch.setattr(ageing, "_ageing", lambda state: iter(groups))
    monkeypatch.setattr(ageing, "_respond", respond)
    state = SimpleNamespace(bonds=SimpleNamespace(memory_of=lambda group: memories[group.name].copy()))
    assert ageing._growth(state, 7.0) == pytest.approx(0.05)
    assert told == [("a", 7.0), ("b", 7.0)]


def test_a_collapse_is_the_growth_of_the_strain_since_the_stage_began():
    assert Collapses(growth=4e-3).progress({"strain": np.array([2e-3, 9e-3, 5e-3])}) == pytest.approx(0.75)
