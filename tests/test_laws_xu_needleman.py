"""Exponential decohesion by hand: delta_n = 1 um, f_t = 1 MPa, delta_t = 2 um, c = 2 MPa.

phi_n = e f_t delta_n = 2.71828 J/m2, phi_t = sqrt(e/2) c delta_t = 4.66329 J/m2, q = 4/sqrt(2 e) = 1.71553.
"""

import math

import attrs
import numpy as np
import pytest

import grainlaw as gl
from grainlaw.fields import ParameterError
from grainlaw.laws import Coupling, XuNeedleman
from grainlaw.workbench.driver import trace

LAW = XuNeedleman(
    kn=math.e * 1e12,
    ks=math.sqrt(2 * math.e) * 1e12,
    tensile_strength=1e6,
    cohesion=2e6,
    residual_friction_angle=math.degrees(math.atan(0.5)),
)
POTENTIAL = attrs.evolve(LAW, coupling=Coupling.POTENTIAL)
either_way = pytest.mark.parametrize("compiled", [False, True])


def test_lengths_and_energies():
    assert LAW.opening_length == pytest.approx(1e-6)
    assert LAW.slip_length == pytest.approx(2e-6)
    assert LAW.opening_energy == pytest.approx(2.718282, rel=1e-6)
    assert LAW.slip_energy == pytest.approx(4.663288, rel=1e-6)
    assert LAW.energy_ratio == pytest.approx(1.715528, rel=1e-6)
    assert LAW.mode_i_energy == pytest.approx(2.718282 * (0.735759 - 9 * 0.000335463), rel=1e-6)
    assert LAW.mode_ii_energy == pytest.approx(4.663288 * (0.606531 - 0.000335463), rel=1e-6)


@pytest.mark.parametrize("law", [LAW, POTENTIAL], ids=["van den Bosch", "potential"])
def test_the_whole_work_is_the_area_up_to_the_break(law):
    # Beyond n = 8 lie 9 exp(-8) of phi_n, beyond t = 8 exp(-8) of phi_t.
    pulled = trace(law, np.linspace(0, 8e-6, 20001), 0)
    assert pulled.work[-1] == pytest.approx(2.718282 * (1 - 0.00301916), rel=1e-6)
    sheared = trace(law, 0, np.linspace(0, math.sqrt(8) * 2e-6, 20001))
    assert sheared.work[-1] == pytest.approx(4.663288 * (1 - 0.000335463), rel=1e-6)


@either_way
def test_tension(compiled):
    # n exp(1 - n): 1 at the peak, 2/e = 0.735759 at 2 um, from there along the secant; 8 exp(-7) before the break.
    t = trace(LAW, np.array([1, 2, 1, 2, 7.9999999, 8, 2]) * 1e-6, 0, compiled=compiled)
    assert t.normal == pytest.approx(np.array([1, 0.735759, 0.367879, 0.735759, 0.00729506, 0, 0]) * 1e6, rel=2e-6)
    # (exp(-1) - exp(-2)) / (exp(-1) - exp(-8))
    assert t.damage == pytest.approx([0, 0.632698, 0.632698, 0.632698, 1, 1, 1], abs=1e-6)
    assert t.damage[4] < 1 == t.damage[5]
    assert not t.mode.any()


@either_way
def test_shear(compiled):
    # sqrt(2 e) y exp(-y^2): 1 at the peak, y = sqrt(1/2), and 0.857764 at y = 1.
    slip = np.array([math.sqrt(2), 2, -1, -2, 5.656855])
    t = trace(LAW, 0, slip * 1e-6, compiled=compiled)
    assert t.shear == pytest.approx(np.array([1, 0.857764, -0.428882, -0.857764, 0]) * 2e6, rel=2e-6)
    # (exp(-1/2) - exp(-1)) / (exp(-1/2) - exp(-8))
    assert t.damage == pytest.approx([0, 0.393687, 0.393687, 0.393687, 1], abs=1e-6)
    assert t.mode[1:].tolist() == [1, 1, 1, 1]


@either_way
def test_mixed(compiled):
    # n = t = 1: tension e exp(-2) f_t, shear 2 sqrt(2 e) exp(-2) c; peak at n + t = 2/3 on this ray.
    t = trace(LAW, 1e-6, 2e-6, compiled=compiled)
    assert t.normal[0] == pytest.approx(0.367879e6, rel=2e-6)
    assert t.shear[0] == pytest.approx(0.631107 * 2e6, rel=2e-6)
    assert t.mode[0] == 0.5
    assert t.damage[0] == pytest.approx((0.513417 - 0.135335) / (0.513417 - 0.000335463), rel=2e-6)


@either_way
def test_potential(compiled):
    # n = t = 1: exp(1 - n) (1 - q + q exp(-t)) f_t = 1 - 1.715528 * 0.632121 = -0.084421, a repulsion; shear as above.
    t = trace(POTENTIAL, 1e-6, 2e-6, compiled=compiled)
    assert t.normal[0] == pytest.approx(-0.084421e6, rel=2e-5)
    assert t.shear[0] == pytest.approx(0.631107 * 2e6, rel=2e-6)
    # One potential: pulled then sheared costs what sheared then pulled does, up to n = t = 1
    # phi_n (1 - 2/e (1 - q + q/e)) = 2.718282 * (1 + 0.735759 * 0.084421) = 2.887 J/m2.
    go, wait = np.linspace(0, 1, 2001), np.ones(2000)
    first_pulled = trace(POTENTIAL, [*go * 1e-6, *wait * 1e-6], [*np.zeros(2001), *go[1:] * 2e-6], compiled=compiled)
    first_sheared = trace(POTENTIAL, [*np.zeros(2001), *go[1:] * 1e-6], [*go * 2e-6, *wait * 2e-6], compiled=compiled)
    assert first_pulled.work[-1] == pytest.approx(2.887125, rel=1e-6)
    assert first_sheared.work[-1] == pytest.approx(2.887125, rel=1e-6)


@either_way
def test_one_mode_weakens_the_other(compiled):
    # Pulled to the peak and back, n = 1: (1 + 1) exp(-1) = 0.735759 of the shear is left.
    t = trace(LAW, [1e-6, 0], [0, math.sqrt(2) * 1e-6], compiled=compiled)
    assert t.shear[1] == pytest.approx(0.735759 * 2e6, rel=2e-6)


@either_way
def test_broken_is_friction(compiled):
    # 10 MPa hold 5 MPa, over 5 / 2.331644 um of slip.
    over = 5e-6 / math.sqrt(2 * math.e)
    slip = np.array([0, 0, 0.5, 2, 1, -1]) * over
    t = trace(LAW, [1e-5, *[-1e-5 / math.e] * 5], slip, compiled=compiled)
    assert t.normal[1:] == pytest.approx(-1e7)
    assert t.shear == pytest.approx(np.array([0, 0, 2.5, 5, 0, -5]) * 1e6, abs=1e-3)


@either_way
def test_friction_grows_with_the_damage(compiled):
    # At 4 um, y = 2, the damage is (exp(-1/2) - exp(-4)) / (exp(-1/2) - exp(-8)) = 0.970338: of 5 MPa friction holds
    # 4.85169 MPa, next to the bond's 2 sqrt(2 e) exp(-4) c = 0.17082 MPa.
    t = trace(LAW, -1e-5 / math.e, np.array([0, math.sqrt(2), 4]) * 1e-6, compiled=compiled)
    assert t.shear == pytest.approx([0, 2e6, 5.02251e6], rel=2e-6)


def staircase(law, step=0.02, last=2.4):
    """Least work of growing n = 2 t, each length on its own and back, then opening to the break."""
    opening, slip, n, t = [0.0], [0.0], 0.0, 0.0
    while t < last:
        new_n, new_t = n + 2 * step, t + step
        opening += [n, new_n, 0, 0, 0, 0]
        slip += [0, 0, 0, math.sqrt(t), math.sqrt(new_t), 0]
        n, t = new_n, new_t
    opening += np.linspace(n, 8 - t, 500)[:-1].tolist()
    slip += [0] * 499
    return gl.trace(law, np.array(opening) * law.opening_length, np.array(slip) * law.slip_length).work.min()


@pytest.mark.parametrize("q", [0.5, 1.7155, 2.2])
def test_the_potential_gives_no_energy_up_to_nine_quarters(q):
    law = attrs.evolve(POTENTIAL, cohesion=2e6 * math.sqrt(q / POTENTIAL.energy_ratio))
    assert law.energy_ratio == pytest.approx(q)
    assert set(law.exceptions) == {"continuity"}
    assert staircase(law) >= 0


def test_the_potential_gives_energy_beyond():
    # (1 - 4 q/9) phi_n = -0.302 J/m2 for q = 2.5 in the limit of many small steps to t = 8/3 and farther.
    law = attrs.evolve(POTENTIAL, cohesion=2e6 * math.sqrt(2.5 / POTENTIAL.energy_ratio))
    assert "up to (4 q/9 - 1) phi_n = 0.302 J/m2" in law.exceptions["energy"]
    assert -0.302031 < staircase(law) < -0.1
    assert LAW.exceptions == {}


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"cohesion": 0}, "cohesion = 0 Pa is not allowed"),
        ({"kn": -1}, "kn = -1 Pa/m is not allowed"),
        ({"residual_friction_angle": 90}, "residual_friction_angle = 90 deg is not allowed"),
        ({"coupling": 1}, "coupling = 1 is not allowed, it must be one of Coupling.VAN_DEN_BOSCH, Coupling.POTENTIAL"),
        ({"closure": 3}, "closure = 3 is not allowed, it must be a Closure"),
    ],
)
def test_refusals(wrong, said):
    with pytest.raises(ParameterError) as refusal:
        attrs.evolve(LAW, **wrong)
    assert "XuNeedleman: " in str(refusal.value)
    assert said in str(refusal.value)
