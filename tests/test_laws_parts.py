"""Softening curves, closures and how a law accepts them."""

import math
from decimal import Decimal, getcontext

import numpy as np
import pytest
from scipy.optimize import brentq

from grainlaw.fields import ParameterError
from grainlaw.laws import (
    BandisClosure,
    CohesiveCrack,
    EvansMarathe,
    ExponentialSoftening,
    HordijkSoftening,
    LinearClosure,
    LinearSoftening,
    PeterssonSoftening,
    Residual,
)
from grainlaw.workbench.driver import trace

TABLE = {
    0.05: 0.962306, 0.10: 0.878317, 0.15: 0.778053, 0.20: 0.678411, 0.25: 0.587842, 0.30: 0.509572, 0.40: 0.389045,
    0.50: 0.304138, 0.60: 0.238163, 0.70: 0.179112, 0.80: 0.120774, 0.90: 0.061081,
}  # fmt: skip
PALABORA = {
    "kn": 1.05e14, "ks": 9.45e13, "tensile_strength": 13e6, "cohesion": 29e6, "friction_angle": 54,
    "residual_friction_angle": 5, "mode_i_energy": 150, "mode_ii_energy": 300,
}  # fmt: skip


def chi(damage: str) -> float:
    """Eq. (2) to 40 digits."""
    getcontext().prec = 40
    d, a, b, c = Decimal(damage), Decimal("0.63"), Decimal("1.8"), 6
    decay = (d * (a + c * b) / ((a + b) * (1 - a - b))).exp()
    return float((1 - (a + b - 1) / (a + b) * decay) * (a * (1 - d) + b * (1 - d) ** c))


@pytest.mark.parametrize(("damage", "expected"), TABLE.items())
def test_evans_marathe_table(damage, expected):
    assert EvansMarathe().remaining(damage) == pytest.approx(expected, abs=6e-7)


@pytest.mark.parametrize("damage", ["0.001", "0.05", "0.31", "0.5", "0.77", "0.9", "0.999"])
def test_evans_marathe_to_all_digits(damage):
    assert EvansMarathe().remaining(float(damage)) == pytest.approx(chi(damage), rel=1e-13, abs=0)


def test_evans_marathe_ends():
    curve = EvansMarathe()
    assert curve.remaining(0.0) == pytest.approx(1.0, abs=1e-15)
    assert curve.remaining(1.0) == 0.0
    assert (curve.remaining(1e-6) - 1) / 1e-6 == pytest.approx(0, abs=1e-4)  # level at the start


@pytest.mark.parametrize("c", [1, 2, 3, 6, 13, 22, 31])
def test_evans_marathe_power(c):
    assert EvansMarathe(a=0.1, b=6, c=c).power(0.7) == pytest.approx(0.7**c, rel=1e-14)


def test_length_dissipates_the_energy():
    assert EvansMarathe().length == pytest.approx(2.588612779530, abs=5e-13)
    assert 1 / EvansMarathe().length == pytest.approx(0.386307294744, abs=5e-13)
    assert LinearSoftening().length == pytest.approx(2, rel=1e-14)
    curve = EvansMarathe(a=0.8, b=1.5, c=4)
    d = np.linspace(0, 1, 2001)
    assert 1 / curve.length == pytest.approx(np.trapezoid([curve.remaining(x) for x in d], d), rel=1e-6)


PUBLISHED = [
    (ExponentialSoftening(), {0.1: 0.603861499, 0.2: 0.363591353, 0.5: 0.075858180, 0.9: 0.004400701}),
    (ExponentialSoftening(rate=1.0), {0.5: 0.377540669}),
    (HordijkSoftening(), {0.1: 0.510837180, 0.2: 0.298612694, 0.5: 0.123127387, 0.9: 0.015804408}),
    (PeterssonSoftening(), {1 / 9: 2 / 3, 2 / 9: 1 / 3, 11 / 18: 1 / 6, 0.5: 3 / 14}),
]


@pytest.mark.parametrize(("curve", "points"), PUBLISHED, ids=lambda value: type(value).__name__)
def test_published_curves_by_hand(curve, points):
    for damage, expected in points.items():
        assert curve.remaining(damage) == pytest.approx(expected, abs=6e-10)
    assert curve.remaining(0.0) == pytest.approx(1.0, abs=1e-15)
    assert curve.remaining(1.0) == 0.0
    assert np.all(np.diff([curve.remaining(d) for d in np.linspace(0, 1, 1001)]) < 0)


def test_hordijk_near_its_end_stays_above_nothing():
    curve = HordijkSoftening()
    assert all(curve.remaining(1 - 2.0**-k) > 0 for k in range(1, 50))


@pytest.mark.thorough
@pytest.mark.parametrize("curve", [curve for curve, _ in PUBLISHED], ids=lambda curve: type(curve).__name__)
def test_published_curves_dissipate_the_energy(curve):
    law = CohesiveCrack(**PALABORA, softening=curve)
    d = np.linspace(0, 1, 9001)
    pull = trace(law, law.peak_opening + d * law.softening_opening, 0)
    assert pull.work[-1] == pytest.approx(150, rel=1e-6)
    assert pull.damage[-1] == pytest.approx(1, abs=1e-12)
    same = trace(law, law.peak_opening + d * law.softening_opening, 0, compiled=True)
    np.testing.assert_allclose(same.normal, pull.normal, rtol=1e-12, atol=1e-6)


def test_published_lengths():
    assert PeterssonSoftening().length == pytest.approx(3.6)  # opening at the break, in G/f
    assert PeterssonSoftening().kink_damage * 3.6 == pytest.approx(0.8)
    assert PeterssonSoftening(kink_share=0.5, kink_damage=0.5).length == pytest.approx(LinearSoftening().length)
    assert HordijkSoftening().length == pytest.approx(5.136, abs=5e-4)  # w_c = 5.14 G/f in Hordijk's thesis
    end = math.exp(-5)
    assert 1 / ExponentialSoftening().length == pytest.approx(((1 - end) / 5 - end) / (1 - end), rel=1e-12)


@pytest.mark.parametrize(
    ("kind", "wrong", "said"),
    [
        (ExponentialSoftening, {"rate": 0}, "rate = 0 is not allowed, it must be"),
        (ExponentialSoftening, {"rate": 9}, "rate = 9 is not allowed"),
        (HordijkSoftening, {"c1": 8}, "c1 = 8, c2 = 6.93 is not allowed: the curve rises"),
        (HordijkSoftening, {"c2": 8.5}, "c2 = 8.5 is not allowed"),
        (PeterssonSoftening, {"kink_damage": 1}, "kink_damage = 1 is not allowed"),
    ],
)
def test_published_curves_refuse(kind, wrong, said):
    with pytest.raises(ParameterError) as refusal:
        kind(**wrong)
    assert str(refusal.value).startswith(f"{kind.__name__}: ")
    assert said in str(refusal.value)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"c": 6.0}, "c = 6.0 is not allowed, it must be a whole number"),
        ({"c": 0}, "c = 0 is not allowed"),
        ({"c": True}, "c = True is not allowed"),
        ({"a": 0.5, "b": 0.5}, "a + b must be above 1"),
        ({"a": 0.2, "b": 1.0}, "exponent of Eq. (2) reaches -25.8333"),
        ({"a": 5, "b": 1, "c": 20}, "the curve rises"),
        ({"a": -1}, "a = -1 is not allowed"),
    ],
)
def test_evans_marathe_refuses(wrong, said):
    with pytest.raises(ParameterError) as refusal:
        EvansMarathe(**wrong)
    assert str(refusal.value).startswith("EvansMarathe: ")
    assert said in str(refusal.value)


@pytest.mark.parametrize(
    ("maximum", "expected"), [(1e-6, 0.5474), (2e-6, 0.7537), (5e-6, 0.9739), (10e-6, 1.0790), (math.inf, 1.2095)]
)
def test_bandis_closure_at_127_mpa(maximum, expected):
    law = BandisClosure(maximum_closure=maximum)
    closure = brentq(lambda u: law.pressure(1.05e14, u) - 127e6, 0, 2e-6, xtol=1e-15)
    assert closure * 1e6 == pytest.approx(expected, abs=5.1e-5)


def test_linear_closure():
    assert LinearClosure().pressure(1.05e14, 1.2095e-6) == pytest.approx(127e6, rel=1e-4)


def test_bandis_goes_on_straight_below_the_maximum_closure():
    law = BandisClosure(maximum_closure=1e-6, straight_from=0.9)
    assert law.pressure(1e14, 0.9e-6) == pytest.approx(1e14 * 0.9e-6 / 0.1)
    assert law.pressure(1e14, 1.9e-6) == pytest.approx(1e14 * (9e-6 + 1e-6 / 0.01))  # slope kn/(1 - 0.9)^2
    before, after = law.pressure(1e14, 0.9e-6 - 1e-13), law.pressure(1e14, 0.9e-6 + 1e-13)
    assert after - before == pytest.approx(1e14 * 100 * 2e-13, rel=1e-4)


@pytest.mark.parametrize("wrong", [0, -1e-6, math.nan])
def test_bandis_refuses_a_maximum_closure(wrong):
    with pytest.raises(ParameterError, match=r"BandisClosure: maximum_closure = .* m is not allowed, .* above 0"):
        BandisClosure(maximum_closure=wrong)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"softening": LinearClosure()}, "softening = LinearClosure() is not allowed, it must be a Softening such as"),
        ({"closure": "bandis"}, "closure = 'bandis' is not allowed, it must be a Closure"),
        ({"residual": "floor"}, "residual = 'floor' is not allowed, it must be one of Residual.FLOOR, Residual.BLEND"),
        ({"residual": 1}, "residual = 1 is not allowed"),
        ({"pre_peak": Residual.BLEND}, "it must be one of PrePeak.EXPONENTIAL, PrePeak.AS_PRINTED, PrePeak.LINEAR"),
        ({"residual_friction_angle": 60}, "residual_friction_angle = 60 is above friction_angle = 54"),
        (
            {"tensile_strength": 22e6},
            "beyond the apex of the shear strength, cohesion / tan(friction_angle) = 2.10697e+07 Pa",
        ),
        ({"mode_i_energy": 0}, "mode_i_energy = 0 J/m2 is not allowed"),
        ({"tensile_strength": [13e6, 22e6]}, "tensile_strength = 2.2e+07 Pa lies beyond the apex"),
    ],
)
def test_a_law_refuses(wrong, said):
    with pytest.raises(ParameterError) as refusal:
        CohesiveCrack(**PALABORA | wrong)
    assert str(refusal.value).startswith("CohesiveCrack: ")
    assert said in str(refusal.value)
