"""Laws that know time, by hand: a rate of opening, a dashpot, and the growth of cracks under a load that is held."""

import math

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq
from support import BRITTLE, STIFF, STRONG

import grainlaw as gl
from grainlaw.compiler.batch import compile_law
from grainlaw.laws import (
    BandisClosure,
    CamachoOrtiz,
    CharlesGrowth,
    CohesiveCrack,
    CowperSymonds,
    ExponentialGrowth,
    Friction,
    JohnsonCook,
    Linear,
    MohrCoulomb,
    RateDependent,
    StaticFatigue,
    Viscous,
    XuNeedleman,
)
from grainlaw.workbench.driver import Contact

STRENGTH, KN = STRONG["tensile_strength"], STIFF["kn"]
COHESIVE = CohesiveCrack(**STRONG, mode_i_energy=15, mode_ii_energy=30)


@pytest.mark.parametrize(
    ("effect", "gain"),
    [
        (CowperSymonds(reference_rate=0.5, exponent=2), math.sqrt(0.02 / 0.5)),
        (JohnsonCook(reference_rate=1e-3, coefficient=0.1), 0.1 * math.log(21)),
    ],
)
@pytest.mark.parametrize("mode", [0, 1])
def test_strength_at_a_rate(effect, gain, mode):
    """Pulled or sheared at 0.02 m/s: 1e-9 m in 5e-8 s; the strength is 1 + gain times that at rest."""
    path = np.arange(0, 1.0e-6, 1e-9), 0.0
    found = gl.trace(RateDependent(law=BRITTLE, effect=effect), *path[:: 1 - 2 * mode], time_step=5e-8)
    at_rest = STRENGTH if mode == 0 else STRONG["cohesion"]
    step = 1e-9 * (STIFF["kn"], STIFF["ks"])[mode]
    peak = (found.normal, found.shear)[mode].max()
    assert (1 + gain) * at_rest - step <= peak <= (1 + gain) * at_rest


def test_the_gain_is_that_at_the_beginning_of_damage():
    """Slower after the peak, and faster: the branch is that of the rate at the peak; energies go with its square."""
    effect = CowperSymonds(reference_rate=0.5, exponent=2)
    slow = gl.trace(RateDependent(law=COHESIVE, effect=effect), np.linspace(0, 8e-6, 4001), 0.0, time_step=2e-9 / 0.02)
    factor = 1 + math.sqrt(0.02 / 0.5)
    assert slow.gain[-1] == pytest.approx(factor - 1)
    alone = gl.trace(COHESIVE, np.linspace(0, 8e-6 / factor, 4001), 0.0)
    assert slow.work[-1] == pytest.approx(factor**2 * alone.work[-1], rel=1e-6)


def test_a_dashpot_by_hand():
    found = gl.trace(Viscous(law=BRITTLE, retardation=1e-6), [0.0, 1e-8, 1e-8], [0.0, 0.0, 2e-8], time_step=1e-7)
    assert found.normal == pytest.approx([0.0, KN * (1e-8 + 1e-6 * 0.1), KN * 1e-8])
    assert found.shear == pytest.approx([0.0, 0.0, STIFF["ks"] * (2e-8 + 1e-6 * 0.2)])
    broken = gl.trace(Viscous(law=BRITTLE, retardation=1e-6), [0.0, 1e-6, 2e-6, 3e-6], 0.0, time_step=1e-7)
    assert broken.normal[2:].tolist() == [0.0, 0.0]


def held(law, load, time_step, most=100_000):
    """s until a bond under a constant tension fails: its law at that opening, again and again."""
    contact = Contact(law, time_step=time_step)
    answer = contact.step(load * STRENGTH / KN, 0.0, contact.start)
    for count in range(1, most):
        answer = contact.step(load * STRENGTH / KN, 0.0, answer[2:])
        if answer[2 + contact.names.index("damage")] >= 1:
            return count * time_step
    raise AssertionError("it holds")


def charles(load, exponent, rate):
    """s: integral of ds / (rate load^n s^(3 - n)) from the load up to 1."""
    return (1 - load ** (exponent - 2)) / ((exponent - 2) * rate * load**exponent)


@pytest.mark.parametrize("load", [0.5, 0.7, 0.9])
@pytest.mark.parametrize("exponent", [5.0, 20.0, 40.0])
def test_time_to_failure_of_a_bond_under_a_constant_tension(load, exponent):
    """Exact in any number of steps, so to within the last step."""
    law = StaticFatigue(law=BRITTLE, rate=1e-3, growth=CharlesGrowth(exponent=exponent))
    exact = charles(load, exponent, 1e-3)
    for steps in (7, 200):
        found = held(law, load, exact / steps)
        assert exact * (1 - 1.01 / steps) <= found <= exact * (1 + 1.01 / steps)


def test_time_to_failure_falls_as_a_power_of_the_load():
    """The slope in logarithms is minus the exponent, from loads at which load^(n - 2) is nothing."""
    law = StaticFatigue(law=BRITTLE, rate=1e-3, growth=CharlesGrowth(exponent=20))
    loads = np.array([0.3, 0.5])
    times = [held(law, load, charles(load, 20, 1e-3) / 3000) for load in loads]
    slope = np.diff(np.log(times)) / np.diff(np.log(loads))
    assert slope[0] == pytest.approx(-20, abs=2e-3)


@pytest.mark.parametrize("load", [0.4, 0.8])
def test_exponential_growth_against_quadrature(load):
    law = StaticFatigue(law=BRITTLE, rate=1e-3, growth=ExponentialGrowth(activation=25))
    exact = quad(lambda s: math.exp(25 * (1 - load / s)) / 1e-3, load, 1)[0]
    assert held(law, load, exact / 4000) == pytest.approx(exact, rel=2e-3)


def test_exponential_growth_is_of_second_order():
    """Half the step, a quarter of the error: of the share that is left under a load of 0.6 after half of its life."""
    life = quad(lambda s: math.exp(9 * (1 - 0.6 / s)), 0.6, 1)[0]
    exact = brentq(lambda share: quad(lambda s: math.exp(9 * (1 - 0.6 / s)), share, 1)[0] - life / 2, 0.61, 1)
    growth, wrong = ExponentialGrowth(activation=9), []
    for steps in (20, 40):
        share = 1.0
        for _ in range(steps):
            share = growth.left(share, 0.6, life / 2 / steps)
        wrong.append(share - exact)
    assert wrong[0] / wrong[1] == pytest.approx(4, rel=0.1)
    assert abs(wrong[0]) < 1e-3
    assert growth.left(0.5, 2.0, 0.01) == pytest.approx(0.49)  # beyond its strength the speed is 1
    slow = ExponentialGrowth(activation=1)
    for lost in (0.5, 0.8, 0.98):  # by the speed at first; the middle is where half of it is lost
        left = 1 - lost * math.exp(0.1 * (1 / (1 - lost / 2) - 1))
        assert slow.left(1.0, 0.1, lost * math.exp(0.9)) == pytest.approx(left, rel=1e-12)


def test_the_load_of_a_point_is_that_at_which_it_would_fail():
    """Under pressure the cohesion ages; tan(54) times the pressure stays."""
    law = StaticFatigue(law=BRITTLE, rate=1e-3, growth=CharlesGrowth(exponent=10))
    closure, slip = -1e7 / KN, (0.6 * 29e6 + 1e7 * math.tan(math.radians(54))) / STIFF["ks"]
    exact = charles(0.6, 10, 1e-3)
    trace = gl.trace(law, np.full(102, closure), np.full(102, slip), time_step=exact / 100)
    failed = int(np.argmax(trace.damage >= 1))
    assert failed in (100, 101)
    assert trace.fatigue[failed - 1] == pytest.approx(0.4, abs=0.05)
    little = gl.trace(law, np.full(9, closure), np.full(9, 1e7 / STIFF["ks"]), time_step=1e9)  # friction bears it
    assert little.fatigue.tolist() == [0.0] * 9


@settings(max_examples=50)
@given(st.floats(0.05, 1.0), st.floats(0.01, 1.0), st.floats(0, 1e6))
def test_growth_takes_strength_and_gives_none(share, load, time):
    for growth in (CharlesGrowth(exponent=12), ExponentialGrowth(activation=20)):
        assert growth.left(share, load * share, time) <= share
        assert growth.left(share, load * share, 0.0) == share


def test_below_the_threshold_nothing_grows():
    law = StaticFatigue(law=BRITTLE, rate=1.0, growth=CharlesGrowth(exponent=5), threshold=0.4)
    below, above = (
        gl.trace(law, np.full(4, load * STRENGTH / KN), 0.0, time_step=1e-2).fatigue[-1] for load in (0.39, 0.41)
    )
    assert below == 0
    assert above > 0


@pytest.mark.parametrize(("load", "ages"), [(0.19, False), (0.21, True)])
def test_the_threshold_is_over_the_strength_that_is_left(load, ages):
    """Half of the strength is left: what is 0.4 of that is 0.2 of the first."""
    law = StaticFatigue(law=BRITTLE, rate=1.0, growth=CharlesGrowth(exponent=5), threshold=0.4)
    answer = law.traction(load * STRENGTH / KN, 0.0, 1.0, 0.5, *[0.0] * 5)
    assert answer[0] == pytest.approx(load * STRENGTH)
    assert (answer[2] > 0.5) == ages


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RateDependent(law=Linear(**STIFF)), "it must have a damage"),
        (lambda: Viscous(law=Friction(**STIFF, friction_angle=30), retardation=1.0), "it must have a damage"),
        (
            lambda: StaticFatigue(law=attrs.evolve(BRITTLE, residual_friction_angle=5, dilation_angle=2), rate=1.0),
            "dil",
        ),
        (lambda: RateDependent(law=attrs.evolve(COHESIVE, closure=BandisClosure(maximum_closure=1e-5))), "closure"),
        (lambda: Viscous(law=Viscous(law=BRITTLE, retardation=1.0), retardation=1.0), "not allowed to be a Viscous"),
        (lambda: RateDependent(law=Viscous(law=BRITTLE, retardation=1.0)), r"outside, Viscous\(law=RateDependent\("),
        (lambda: StaticFatigue(law=Viscous(law=BRITTLE, retardation=1.0), rate=1.0), r"outside, Viscous\("),
        (lambda: StaticFatigue(law=RateDependent(law=BRITTLE), rate=1.0), r"outside, RateDependent\(law=StaticFatigue"),
        (lambda: StaticFatigue(law=BRITTLE, rate=0.0), "rate"),
        (lambda: CharlesGrowth(exponent=2.0), "exponent"),
        (lambda: CowperSymonds(exponent=0.5), "exponent"),
        (lambda: StaticFatigue(law=3.0, rate=1.0), "a ContactLaw"),
        (lambda: StaticFatigue(law=attrs.evolve(BRITTLE, tensile_strength=0), rate=1.0), "a tensile_strength above 0"),
    ],
)
def test_what_is_refused(make, message):
    with pytest.raises(gl.ParameterError, match=message):
        make()


@pytest.mark.thorough
@pytest.mark.parametrize("law", [CamachoOrtiz, XuNeedleman, MohrCoulomb], ids=lambda kind: kind.__name__)
def test_a_strength_for_each_contact(law):
    """Arrays of the law within are those of its points."""
    own = {"MohrCoulomb": {"friction_angle": 0.0}, "CamachoOrtiz": {"residual_friction_angle": 0.0} | dict(
        mode_i_energy=150, mode_ii_energy=300)}.get(law.__name__, {"residual_friction_angle": 0.0})  # fmt: skip
    weak = np.array([5e6, 10e6])
    fatigue = StaticFatigue(
        law=law(**STIFF, tensile_strength=weak, cohesion=29e6, **own), rate=1e-3, growth=CharlesGrowth(exponent=5)
    )
    code = compile_law(fatigue, 2)
    code.tell(time_step=1.0)
    memory = np.zeros((len(code.memory), 2))
    code.batch(np.full(2, 4e6 / KN), np.zeros(2), memory)
    lost = memory[code.memory.index("fatigue")]
    assert lost[0] > lost[1] > 0
