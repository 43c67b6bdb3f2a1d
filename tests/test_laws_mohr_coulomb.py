"""Brittle Coulomb slip by hand: tan(phi) = 1, tan(phi_res) = 1/2."""

import math

import attrs
import pytest

from grainlaw.fields import ParameterError
from grainlaw.laws import MohrCoulomb
from grainlaw.workbench.driver import trace

LAW = MohrCoulomb(
    kn=1e11,
    ks=5e10,
    tensile_strength=1e6,
    cohesion=2e6,
    friction_angle=45,
    residual_friction_angle=math.degrees(math.atan(0.5)),
)
both_ways = pytest.mark.parametrize("compiled", [False, True], ids=["interpreted", "compiled"])


@both_ways
def test_slip_under_pressure_and_back(compiled):
    # 4 MPa: strength 2 + 4 = 6 MPa at 120 um, then friction of 2 MPa that follows the reversals over 40 um.
    slip = [119e-6, 130e-6, 100e-6, 0.0, -20e-6, 20e-6, 100e-6]
    t = trace(LAW, -40e-6, slip, compiled=compiled)
    assert t.shear == pytest.approx([5.95e6, 2e6, 0.5e6, -2e6, -2e6, 0, 2e6], abs=1e-3)
    assert t.plastic_slip == pytest.approx([0, 90e-6, 90e-6, 40e-6, 20e-6, 20e-6, 60e-6])
    assert t.normal == pytest.approx([-4e6] * 7)
    assert t.damage.tolist() == [0, 1, 1, 1, 1, 1, 1]
    assert t.mode.tolist() == [0, 1, 1, 1, 1, 1, 1]


@both_ways
def test_friction_follows_the_pressure(compiled):
    t = trace(LAW, [-40e-6, -40e-6, -10e-6, 1e-6, -60e-6, -60e-6], [0, 130e-6, 130e-6, 130e-6, 130e-6, 200e-6],
              compiled=compiled)  # fmt: skip
    assert t.shear == pytest.approx([0, 2e6, 0.5e6, 0, 0, 3e6], abs=1e-3)
    assert t.normal == pytest.approx([-4e6, -4e6, -1e6, 0, -6e6, -6e6])


@both_ways
def test_tension_breaks_at_once_and_pressure_stays(compiled):
    t = trace(LAW, [9.9e-6, 10.1e-6, 5e-6, -10e-6], 0, compiled=compiled)
    assert t.normal == pytest.approx([0.99e6, 0, 0, -1e6], abs=1e-9)
    assert t.damage.tolist() == [0, 1, 1, 1]
    assert t.mode.tolist() == [0, 0, 0, 0]


@both_ways
def test_residual_tension_and_cohesion(compiled):
    law = attrs.evolve(LAW, residual_tensile_strength=0.25e6, residual_cohesion=0.5e6)
    t = trace(law, [10.1e-6, 30e-6, 1e-6, -10e-6, 30e-6], [0, 0, 0, 0, 50e-6], compiled=compiled)
    assert t.normal == pytest.approx([0.25e6, 0.25e6, 0.1e6, -1e6, 0.25e6])
    assert t.shear == pytest.approx([0, 0, 0, 0, 0.5e6 - 0.25e6 / 2])


@both_ways
def test_tension_lowers_the_shear_strength(compiled):
    # 0.5 MPa of tension leaves 1.5 MPa; an open contact holds nothing afterwards.
    t = trace(LAW, 5e-6, [29e-6, 31e-6], compiled=compiled)
    assert t.shear == pytest.approx([1.45e6, 0], abs=1e-9)
    assert t.damage.tolist() == [0, 1]
    assert t.mode.tolist() == [0, 1]


@both_ways
def test_a_step_past_both_strengths_is_tensile(compiled):
    t = trace(LAW, [11e-6, -40e-6], [200e-6, 300e-6], compiled=compiled)
    assert t.mode.tolist() == [0, 0]
    assert t.damage.tolist() == [1, 1]


@both_ways
def test_dilation_raises_the_pressure(compiled):
    # 10 um of sliding lift the contact by 1 um. To 130 um: (6.5 - 2) MPa / (ks + kn/20) = 81.82 um of sliding;
    # opened to 4 um: (2.40909 - 0.20909) MPa / (ks + kn/20) = 40 um more.
    law = attrs.evolve(LAW, dilation_angle=math.degrees(math.atan(0.1)))
    t = trace(law, [-40e-6, -40e-6, 4e-6, 13e-6], [0, 130e-6, 130e-6, 140e-6], compiled=compiled)
    assert t.plastic_slip[1] == pytest.approx(4.5 / 5.5e10 * 1e6)
    assert t.dilation[1] == pytest.approx(8.1818182e-6)
    assert t.normal[1] == pytest.approx(-4.8181818e6)
    assert t.shear[1] == pytest.approx(2.4090909e6)
    assert t.normal[2] == pytest.approx(-1e11 * (12.1818182e-6 - 4e-6))  # held apart by what it has dilated
    assert t.normal[3] == 0.0
    assert t.dilation[3] == t.dilation[2]  # open, nothing to ride up on


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"residual_cohesion": 3e6}, "residual_cohesion = 3e+06 is above cohesion = 2e+06"),
        ({"residual_tensile_strength": 3e6}, "residual_tensile_strength = 3e+06 is above tensile_strength = 1e+06"),
        ({"residual_friction_angle": 46}, "residual_friction_angle = 46 is above friction_angle = 45"),
        ({"dilation_angle": 30}, "dilation_angle = 30 is above residual_friction_angle = 26.5651: slip would create"),
        ({"tensile_strength": 2.5e6}, "beyond the apex of the shear strength, cohesion / tan(friction_angle) = 2e+06"),
        ({"residual_tensile_strength": 1e5}, "beyond the apex"),
        ({"cohesion": [2e6, 0.5e6]}, "tensile_strength = 1e+06 Pa lies beyond"),
        ({"friction_angle": 90}, "friction_angle = 90 deg is not allowed"),
        ({"kn": 0}, "kn = 0 Pa/m is not allowed"),
    ],
)
def test_refusals(wrong, said):
    with pytest.raises(ParameterError) as refusal:
        attrs.evolve(LAW, **wrong)
    assert "MohrCoulomb: " in str(refusal.value)
    assert said in str(refusal.value)
