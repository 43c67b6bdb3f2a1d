"""Bilinear mixed-mode softening by hand.

Tension peaks at 1 um and breaks at 1 + 2 * 3 / 2 = 4 um, shear peaks at 4 um and breaks at 4 + 2 * 16 / 4 = 12 um.
Twice the elastic energy at the onset: 2 J/m2 in tension, 16 J/m2 in shear.
"""

import math

import attrs
import numpy as np
import pytest

from grainlaw.fields import ParameterError
from grainlaw.laws import BilinearMixedMode
from grainlaw.workbench.driver import trace

LAW = BilinearMixedMode(
    kn=2e12,
    ks=1e12,
    tensile_strength=2e6,
    cohesion=4e6,
    residual_friction_angle=math.degrees(math.atan(0.5)),
    mode_i_energy=3,
    mode_ii_energy=16,
)
either_way = pytest.mark.parametrize("compiled", [False, True])


@either_way
def test_tension(compiled):
    t = trace(LAW, np.array([0.5, 1, 2.5, 1.25, 2.5, 3.25, 4, 1]) * 1e-6, 0, compiled=compiled)
    assert t.normal == pytest.approx(np.array([1, 2, 1, 0.5, 1, 0.5, 0, 0]) * 1e6, abs=1e-3)
    assert t.damage == pytest.approx([0, 0, 0.5, 0.5, 0.5, 0.75, 1, 1])
    assert t.damage[-1] == 1
    assert not t.mode.any()


@either_way
def test_shear_follows_the_reversal_along_the_secant(compiled):
    t = trace(LAW, 0, np.array([4, 8, 2, -8, -10, 12]) * 1e-6, compiled=compiled)
    assert t.shear == pytest.approx(np.array([4, 2, 0.5, -2, -1, 0]) * 1e6, abs=1e-3)
    assert t.damage == pytest.approx([0, 0.5, 0.5, 0.5, 0.75, 1])
    assert t.mode.tolist() == [0, 1, 1, 1, 1, 1]


@either_way
def test_mixed_in_equal_shares(compiled):
    # B = 1/2, B^2 = 1/4: onset at 2 + 14/4 = 5.5 J/m2, half of it each, G = 3 + 13/4 = 6.25 J/m2.
    # Twice as far: r = 5.5 / (2 * 6.25) = 0.44, secant (1 - 0.44) / 2 = 0.28; broken at 1 + 2 * 6.25 / 5.5 times.
    o, s = math.sqrt(2.75 / 2e12), math.sqrt(2.75 / 1e12)
    far = np.array([1, 2, 1 + 12.5 / 5.5 + 1e-9])
    t = trace(LAW, far * o, far * s, compiled=compiled)
    assert t.normal == pytest.approx([2e12 * o, 0.28 * 2e12 * 2 * o, 0], abs=1e-3)
    assert t.shear == pytest.approx([1e12 * s, 0.28 * 1e12 * 2 * s, 0], abs=1e-3)
    assert t.damage == pytest.approx([0, 0.44, 1])
    assert t.mode[1:] == pytest.approx([0.5, 0.5])
    whole = trace(LAW, [0, *(far * o)], [0, *(far * s)], compiled=compiled)
    assert whole.work[-1] == pytest.approx(5.5 / 2 + 6.25)  # the curve is straight between these points


@either_way
def test_mixed_with_square_roots(compiled):
    # B = 1/16, B^0.75 = 1/8: onset at 2 + 14/8 = 3.75 J/m2, G = 3 + 13/8 = 4.625 J/m2.
    # Twice as far: r = 3.75 / 9.25 = 15/37, secant (22/37) / 2 = 11/37.
    o, s = 2 * math.sqrt(3.75 * 15 / 16 / 2e12), 2 * math.sqrt(3.75 / 16 / 1e12)
    t = trace(attrs.evolve(LAW, eta=0.75), o, s, compiled=compiled)
    assert t.damage[0] == pytest.approx(15 / 37)
    assert t.normal[0] == pytest.approx(11 / 37 * 2e12 * o)
    assert t.shear[0] == pytest.approx(11 / 37 * 1e12 * s)


@pytest.mark.parametrize("quarters", range(1, 32))
def test_power(quarters):
    assert attrs.evolve(LAW, eta=quarters / 4).power(1 / 16) == 2.0**-quarters
    assert attrs.evolve(LAW, eta=quarters / 4).power(0.0) == 0
    assert attrs.evolve(LAW, eta=quarters / 4).power(1.0) == 1


@either_way
def test_another_mix_never_stiffens(compiled):
    # Pulled to r = 1/2 the secant is 0.2. Published, r = 1/2 is a secant of (1 - 0.5) / (1 + 0.5 * 2) = 0.25 in shear.
    # Shear alone, (1 - r) / x with r = (x - 1) / 2 falls below 0.2 at x = 15/7, 8.57 um; at 10 um r = 3/4, secant 0.1.
    # Damage rests until then, though r alone would be 0.55 at 8.4 um.
    t = trace(LAW, [2.5e-6, 0, 0, 0], [0, 2e-6, 8.4e-6, 10e-6], compiled=compiled)
    assert t.shear == pytest.approx([0, 0.4e6, 1.68e6, 1e6])
    assert t.stiffness_loss == pytest.approx([0.8, 0.8, 0.8, 0.9])
    assert t.damage == pytest.approx([0.5, 0.5, 0.5, 0.75])
    assert t.mode.tolist() == [0, 0, 0, 1]


@either_way
def test_the_other_way_softens_on_at_once(compiled):
    # Sheared to r = 1/2, secant 0.25: in tension 0.25 is met at (4 - x) / (3 x) = 1/4, x = 16/7 um; 2.5 um: 0.2.
    t = trace(LAW, [0, 2e-6, 2.5e-6], [8e-6, 0, 0], compiled=compiled)
    assert t.normal == pytest.approx([0, 0.25 * 4e6, 1e6])
    assert t.damage == pytest.approx([0.5, 0.5, 0.5])


@either_way
def test_friction_grows_with_the_damage(compiled):
    # 10 MPa hold 5 MPa when broken. Sheared to r = 1/2: the bond keeps 2 MPa, friction adds 2.5 MPa.
    t = trace(LAW, -5e-6, np.array([0, 4, 8, 12, 20, 17, 10]) * 1e-6, compiled=compiled)
    assert t.normal == pytest.approx(-1e7)
    assert t.shear == pytest.approx(np.array([0, 4, 4.5, 5, 5, 2, -5]) * 1e6, abs=1e-3)


@either_way
def test_broken_is_friction(compiled):
    t = trace(LAW, np.array([20, *[-5] * 6]) * 1e-6, np.array([0, 0, 3, 8, 5, 0, -5]) * 1e-6, compiled=compiled)
    assert t.shear == pytest.approx(np.array([0, 0, 3, 5, 2, -3, -5]) * 1e6, abs=1e-3)
    assert t.damage.tolist() == [1] * 7


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"eta": 2.1}, "eta = 2.1 is not allowed, it must be one multiple of 1/4 (the power is taken by"),
        ({"eta": [2, 1]}, "it must be one multiple of 1/4"),
        ({"eta": 8}, "eta = 8 is not allowed, it must be a finite number and at least 0.25 and at most 7.75"),
        ({"mode_i_energy": -1}, "mode_i_energy = -1 J/m2 is not allowed"),
        ({"cohesion": 0}, "cohesion = 0 Pa is not allowed"),
        ({"residual_friction_angle": 90}, "residual_friction_angle = 90 deg is not allowed"),
        ({"closure": 3}, "closure = 3 is not allowed, it must be a Closure"),
    ],
)
def test_refusals(wrong, said):
    with pytest.raises(ParameterError) as refusal:
        attrs.evolve(LAW, **wrong)
    assert "BilinearMixedMode: " in str(refusal.value)
    assert said in str(refusal.value)
