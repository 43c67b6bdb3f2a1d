"""A rough joint by hand: kn 1e11 Pa/m, ks 5e10 Pa/m, tan(phi) = 1/2, tan(psi) = 1/10."""

import math

import attrs
import numpy as np
import pytest

from grainlaw.fields import ParameterError
from grainlaw.laws import BandisClosure, BartonBandis, Friction, LinearClosure, Roughness
from grainlaw.workbench.driver import trace

LAW = BartonBandis(
    kn=1e11,
    ks=5e10,
    friction_angle=math.degrees(math.atan(0.5)),
    dilation_angle=math.degrees(math.atan(0.1)),
    closure=BandisClosure(maximum_closure=1e-4),
)
STRAIGHT = attrs.evolve(LAW, closure=LinearClosure())
either_way = pytest.mark.parametrize("compiled", [False, True])


@either_way
def test_closure(compiled):
    # 1e11 * 50e-6 / (1 - 50/100), 1e11 * 80e-6 / (1 - 80/100); no tension.
    t = trace(LAW, [-5e-5, -8e-5, 1e-6], 0, compiled=compiled)
    assert t.normal == pytest.approx([-1e7, -4e7, 0])


@either_way
def test_stick_slip_and_dilation(compiled):
    # 4 MPa hold 2 MPa, 40 um of slip. At 130 um 6.5 - 2 MPa go into (ks + kn/20) = 5.5e10 Pa/m: 81.8182 um of sliding,
    # 8.18182 um of lift, 4.818182 MPa. Back by 96.363636 um the traction is as large the other way and sliding begins
    # anew: 10 um more of slip take 0.5 MPa / 5.5e10 = 9.090909 um, 0.909091 um of lift.
    t = trace(STRAIGHT, -4e-5, [40e-6, 130e-6, 130e-6, 33.636364e-6, 23.636364e-6], compiled=compiled)
    assert t.shear == pytest.approx([2e6, 2.409091e6, 2.409091e6, -2.409091e6, -2.454545e6], rel=1e-6)
    assert t.normal == pytest.approx([-4e6, -4.818182e6, -4.818182e6, -4.818182e6, -4.909091e6], rel=1e-6)
    assert t.dilation == pytest.approx(
        np.array([0, 8.181818, 8.181818, 8.181818, 9.090909]) * 1e-6, rel=1e-6, abs=1e-12
    )


@either_way
def test_dilation_ends(compiled):
    # 50 um of sliding lift by 5 um: 4.5 MPa, 2.25 MPa, no more however far the slip.
    law = attrs.evolve(STRAIGHT, dilation_end=5e-5)
    t = trace(law, -4e-5, [130e-6, 1e-3, -1e-3], compiled=compiled)
    assert t.normal == pytest.approx([-4.5e6] * 3)
    assert t.shear == pytest.approx([2.25e6, 2.25e6, -2.25e6])
    assert t.dilation == pytest.approx([5e-6] * 3)


@pytest.mark.parametrize(("steps", "accuracy"), [(2, 0.02), (20, 1e-5)])
@either_way
def test_dilation_with_curved_closure(compiled, steps, accuracy):
    # Closed by 50 um, 100 um of sliding lift by 10 um: 1e11 * 60e-6 / 0.4 = 15 MPa, 7.5 MPa of friction, reached at
    # a slip of 100 um + 7.5 MPa / ks = 250 um. The shear traction is on the strength however long the step.
    t = trace(LAW, -5e-5, np.linspace(0, 250e-6, steps), compiled=compiled)
    assert t.dilation[-1] == pytest.approx(1e-5, rel=accuracy)
    assert t.normal[-1] == pytest.approx(-1.5e7, rel=accuracy)
    assert t.shear[-1] == pytest.approx(-t.normal[-1] / 2, rel=1e-12)
    at_rest = trace(LAW, -5e-5, [250e-6] * 3, compiled=compiled)
    assert at_rest.shear == pytest.approx([at_rest.shear[0]] * 3, rel=1e-12)


@either_way
def test_what_has_lifted_stays_when_the_joint_opens(compiled):
    # Lifted by 10 um; open at 20 um: no traction, and slip lifts no farther; closed again from 10 um on.
    law = attrs.evolve(STRAIGHT, dilation_end=1e-4)
    t = trace(law, [-4e-5, 2e-5, 2e-5, 5e-6], [1e-3, 1e-3, 5e-3, 5e-3], compiled=compiled)
    assert t.dilation == pytest.approx([1e-5] * 4)
    assert t.normal == pytest.approx([-5e6, 0, 0, -0.5e6], abs=1e-6)
    assert t.shear == pytest.approx([2.5e6, 0, 0, 0], abs=1e-6)
    early = trace(STRAIGHT, [1e-6, 1e-6, -4e-5], [0, 1e-3, 1e-3], compiled=compiled)
    assert early.dilation.tolist() == [0, 0, 0]


def test_smooth_faces_are_friction():
    smooth = attrs.evolve(LAW, dilation_angle=0)
    faces = Friction(kn=LAW.kn, ks=LAW.ks, friction_angle=LAW.friction_angle, closure=LAW.closure)
    at = np.linspace(0, 20, 300)
    path = np.cos(at * 0.7) * 4e-5 - 2e-5, np.sin(at) * 2e-4
    assert trace(smooth, *path).shear.tolist() == trace(faces, *path).shear.tolist()
    assert trace(smooth, *path).normal.tolist() == trace(faces, *path).normal.tolist()


@pytest.mark.parametrize("closure", [LinearClosure(), BandisClosure(maximum_closure=1e-4)])
def test_tangent_is_the_slope_of_the_pressure(closure):
    for u in (0.0, 3e-5, 9e-5, 2e-4):
        slope = (closure.pressure(1e11, u + 1e-11) - closure.pressure(1e11, u)) / 1e-11
        assert closure.tangent(1e11, u) == pytest.approx(slope, rel=1e-4)


def test_roughness():
    # JRC log10(JCS / sigma_n) = 10 log10(100) = 20 deg, half of it dilation; nothing beyond JCS.
    rough = Roughness(jrc=10, jcs=100e6, residual_friction_angle=28)
    assert rough.friction_angle(1e6) == pytest.approx(48)
    assert rough.dilation_angle(1e6) == pytest.approx(10)
    assert rough.friction_angle(10e6) == pytest.approx(38)
    assert rough.friction_angle(2e8) == 28
    assert rough.dilation_angle(2e8) == 0
    assert rough.friction_angle(np.array([1e6, 1e7])) == pytest.approx([48, 38])


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"dilation_angle": 30}, "dilation_angle = 30 is above friction_angle = 26.5651: slip would create energy"),
        ({"dilation_end": 0}, "dilation_end = 0 m is not allowed"),
        ({"friction_angle": 90}, "friction_angle = 90 deg is not allowed"),
        ({"dilation_angle": [5, 40]}, "dilation_angle = 40 is above"),
        ({"closure": 3}, "closure = 3 is not allowed, it must be a Closure such as BandisClosure(maximum_closure=...)"),
    ],
)
def test_refusals(wrong, said):
    with pytest.raises(ParameterError) as refusal:
        attrs.evolve(LAW, **wrong)
    assert f"BartonBandis: {said}" in str(refusal.value)


def test_refused_roughness():
    steep = Roughness(jrc=20, jcs=100e6, residual_friction_angle=28)
    with pytest.raises(ParameterError, match="friction angle of 88 deg at a normal stress of 100000 Pa is not allowed"):
        steep.friction_angle(1e5)
    with pytest.raises(ParameterError, match=r"normal_stress = 0.0 Pa is not allowed, it must be above 0"):
        steep.dilation_angle(0.0)
    with pytest.raises(ParameterError, match="jrc = 21 is not allowed"):
        Roughness(jrc=21, jcs=100e6, residual_friction_angle=28)
