"""Munjiza's joint in round numbers, worked out by hand."""

import itertools
import math

import attrs
import numpy as np
import pytest

import grainlaw as gl
from grainlaw.laws import LinearSoftening, MunjizaJoint, Unloading
from grainlaw.workbench.driver import trace

um, MPa = 1e-6, 1e6
# o_p = 2 f_t/k_n = 0.2 um and s_p = 2 c/k_s = 0.4 um; with L = 2 the branches are 2 G_I/f_t = 10 um and
# 2 G_II/c = 10 um long. Under 20 MPa f_s = 20 + 20 tan 45 = 40 MPa: s_p = 0.8 um, 2 G_II/f_s = 5 um.
LAW = MunjizaJoint(
    kn=1e14,
    ks=1e14,
    tensile_strength=10e6,
    cohesion=20e6,
    friction_angle=45,
    residual_friction_angle=math.degrees(math.atan(0.5)),
    mode_i_energy=50,
    mode_ii_energy=100,
    softening=LinearSoftening(),
)
RETRACED = attrs.evolve(LAW, unloading=Unloading.RETRACED)
PRESSED = -0.2 * um  # 20 MPa

both = pytest.mark.parametrize("compiled", [False, True])
any_unloading = pytest.mark.parametrize("law", [LAW, RETRACED], ids=["secant", "retraced"])


def path(*corners, steps=1000):
    """Straight lines through the corners, ``steps`` points each."""
    legs = [np.linspace(a, b, steps, endpoint=False) for a, b in itertools.pairwise(corners)]
    return np.concatenate([*legs, corners[-1:]])


@pytest.mark.thorough
@both
@any_unloading
def test_the_parabola_and_the_branch(law, compiled):
    # Half way to the peak 2 x 1/2 - 1/4 = 3/4 of the strength, half way to the break 1/2 of it.
    t = trace(law, np.array([0.1, 0.2, 5.2, 7.7, 10.2]) * um, 0, compiled=compiled)
    assert t.normal / MPa == pytest.approx([7.5, 10, 5, 2.5, 0], abs=1e-9)
    assert t.damage == pytest.approx([0, 0, 0.5, 0.75, 1])
    assert np.all(t.mode == 0)
    t = trace(law, 0, np.array([-0.2, -0.4, -5.4, -7.9, -10.4]) * um, compiled=compiled)
    assert t.shear / MPa == pytest.approx([-15, -20, -10, -5, 0], abs=1e-9)
    assert t.mode[2:] == pytest.approx([1, 1, 1])


def test_the_default_branch_is_the_curve_of_evans_and_marathe():
    # chi(1/2) = 0.304138 at o_p + L G_I/(2 f_t) = 0.2 + 2.588612779530 x 5/2 = 6.671532 um
    law = MunjizaJoint(**{f.name: getattr(LAW, f.name) for f in attrs.fields(MunjizaJoint) if f.name != "softening"})
    t = trace(law, 6.671532 * um, 0)
    assert t.normal[0] == pytest.approx(3.04138 * MPa, rel=2e-6)


@both
def test_secant_unloading(compiled):
    opening = np.array([0.15, 0.1, 5.2, 2.6, 0.1, 0, 5.2, 7.7]) * um
    t = trace(LAW, opening, 0, compiled=compiled)
    # Back along the parabola before the peak; 5 MPa at 5.2 um is 0.096154 MPa at 0.1 um.
    assert t.normal / MPa == pytest.approx([9.375, 7.5, 5, 2.5, 5 / 52, 0, 5, 2.5])
    t = trace(LAW, 0, np.array([5.4, 2.7, -2.7, -5.4, -7.9]) * um, compiled=compiled)
    assert t.shear / MPa == pytest.approx([10, 5, -5, -10, -5])


@both
def test_retraced_unloading(compiled):
    opening = np.array([5.2, 2.7, 0.1, 0, 7.7, 10.3, 2.7, 0.1]) * um
    t = trace(RETRACED, opening, 0, compiled=compiled)
    # At 2.7 um D = 0.25; what is broken stays broken.
    assert t.normal / MPa == pytest.approx([5, 7.5, 7.5, 0, 2.5, 0, 0, 0], abs=1e-9)
    assert t.damage == pytest.approx([0.5, 0.5, 0.5, 0.5, 0.75, 1, 1, 1])
    t = trace(RETRACED, 0, np.array([5.4, 2.9, -0.2, -2.9]) * um, compiled=compiled)
    assert t.shear / MPa == pytest.approx([10, 15, -15, -15])


@both
@any_unloading
def test_mixed(law, compiled):
    # D_I = 3/10, D_II = 4/10, D = 1/2, of which shear 0.16/0.25
    t = trace(law, np.array([3.2, 1.2]) * um, np.array([4.4, 0.1]) * um, compiled=compiled)
    assert [t.normal[0] / MPa, t.shear[0] / MPa, t.damage[0], t.mode[0]] == pytest.approx([5, 10, 0.5, 0.64])
    assert t.mode[1] == t.mode[0]
    # D = 1/2 by tension alone, slip half way to its peak: half of 15 MPa.
    t = trace(law, 5.2 * um, [0.2 * um], compiled=compiled)
    assert [t.shear[0] / MPa, t.mode[0]] == pytest.approx([7.5, 0])


@both
@any_unloading
def test_under_pressure(law, compiled):
    # At 3.3 um D = (3.3 - 0.8)/5 = 1/2: half of 40 MPa and half of the friction, 20 x 0.5 = 10 MPa.
    slip = np.array([0.4, 0.8, 3.3, 5.8, 7, 6.95, 6.8, 6, 7]) * um
    t = trace(law, PRESSED, slip, compiled=compiled)
    assert t.shear / MPa == pytest.approx([30, 40, 25, 10, 10, 5, -10, -10, 10])
    assert t.normal / MPa == pytest.approx([-20] * 9)
    assert t.damage[:4] == pytest.approx([0, 0, 0.5, 1])


@both
@any_unloading
def test_work(law, compiled):
    # Up to the peak 2/3 f u_p: 4/3 and 16/3 J/m2.
    pulled = trace(law, path(0, 0.2 * um, 11 * um), 0, compiled=compiled)
    assert [pulled.work[1000], pulled.work[-1]] == pytest.approx([4 / 3, 4 / 3 + 50], rel=1e-5)
    sheared = trace(law, 0, path(0, 0.4 * um, 11 * um), compiled=compiled)
    assert [sheared.work[1000], sheared.work[-1]] == pytest.approx([16 / 3, 16 / 3 + 100], rel=1e-5)


@any_unloading
def test_the_peak_slip_follows_the_pressure_and_gives_energy_before_the_peak(law):
    # Out to s_p = 0.4 um 16/3 J/m2; back from x = 1/2 under 20 MPa f_s s_p (x^2 - x^3/3) = 32 x 5/24 = 20/3 J/m2.
    t = trace(law, path(0, 0, PRESSED, PRESSED, 0), path(0, 0.4 * um, 0.4 * um, 0, 0))
    assert -t.work[-1] == pytest.approx(4 / 3, rel=1e-5)
    assert -t.work[-1] < 1e14 * (0.4 * um) ** 2 / 6  # what the law declares


def test_pressing_a_softened_secant_at_rest_gives_nothing():
    # D = (1.4 - 0.4)/10 = 0.1 holds 18 MPa. On the way to 20 MPa D_II = (1.4 um - 2 f_s/k_s) f_s/(200 J/m2) is
    # largest at f_s = 35 MPa: 0.7 x 35/200 = 0.1225, which takes 18 MPa down to 0.8775 x 20 MPa.
    t = trace(LAW, path(0, 0, PRESSED, PRESSED, 0), path(0, 1.4 * um, 1.4 * um, 0, 0))
    assert t.shear[[1000, 2000]] / MPa == pytest.approx([18, 17.55], rel=1e-6)
    assert t.damage[2000] == pytest.approx(0.1225, rel=1e-6)
    # 16/3 + (20 + 18)/2 x 1 J/m2 spent, 17.55 x 1.4/2 back; friction at 0.1225 x 10 MPa holds against it.
    friction = 1.225 * (1.4 - 0.01225 / 2)
    assert t.work[-1] == pytest.approx(16 / 3 + 19 - 17.55 * 0.7 + friction, rel=1e-3)


def test_what_is_retraced_gives_energy_when_the_modes_take_turns():
    # Pull to D = 1/2, slip to the peak at half strength, close, slip back at full strength: 16/3 out of 8/3 J/m2.
    opening, slip = path(0, 5.2 * um, 5.2 * um, 0, 0), path(0, 0, 0.4 * um, 0.4 * um, 0)
    assert trace(RETRACED, opening, slip).work[-1] == pytest.approx(-8 / 3, rel=1e-4)
    # By the secant the pull keeps 4/3 + 37.5 of which 5 MPa x 5.2 um / 2 come back, the slip nothing.
    assert trace(LAW, opening, slip).work[-1] == pytest.approx(4 / 3 + 37.5 - 13, rel=1e-4)


@pytest.mark.parametrize(
    ("law", "most"),
    # k_s s_p^2/6 = 100 x 0.4^2/6; pressed by up to twice the larger strength f_s = 60 MPa: k_s s_p^2/3 = 48 J/m2
    [(LAW, 8 / 3), (RETRACED, 48 + 100)],
    ids=["secant", "retraced"],
)
def test_the_kit_meets_what_is_declared_and_no_more(law, most):
    report = gl.check_law(law, compiled=False)
    assert report.passed
    assert 0.1 < report["energy"].size < most


def test_exceptions():
    smooth = {"friction_angle": 0, "residual_friction_angle": 0}
    assert set(LAW.exceptions) == set(RETRACED.exceptions) == {"energy"}
    assert attrs.evolve(LAW, **smooth).exceptions == {}
    assert attrs.evolve(RETRACED, **smooth).exceptions == RETRACED.exceptions


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"residual_friction_angle": 46}, "is above friction_angle = 45"),
        ({"residual_friction_angle": np.array([20.0, 46.0])}, "residual_friction_angle = 46 is above"),
        ({"mode_i_energy": 0}, "mode_i_energy"),
        ({"mode_ii_energy": -1}, "mode_ii_energy"),
        ({"tensile_strength": 0}, "tensile_strength"),
        ({"cohesion": -1}, "cohesion"),
        ({"unloading": 1}, "Unloading.RETRACED"),
        ({"softening": "linear"}, "must be a Softening"),
        ({"closure": None}, "must be a Closure"),
    ],
)
def test_refused(changes, words):
    with pytest.raises(gl.ParameterError, match=words):
        attrs.evolve(LAW, **changes)
