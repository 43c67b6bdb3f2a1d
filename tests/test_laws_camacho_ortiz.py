"""Camacho and Ortiz's law in round numbers, worked out by hand, and against Snozzi and Molinari's formula."""

import itertools
import math

import attrs
import numpy as np
import pytest

import grainlaw as gl
from grainlaw.laws import CamachoOrtiz
from grainlaw.workbench.driver import trace

um, MPa = 1e-6, 1e6
# o_p = f_t/k_n = 0.1 um, o_c = o_p + 2 G_I/f_t = 10.1 um; s_p = c/k_s = 0.2 um, s_c = s_p + 2 G_II/c = 10.2 um.
LAW = CamachoOrtiz(
    kn=1e14,
    ks=1e14,
    tensile_strength=10e6,
    cohesion=20e6,
    residual_friction_angle=math.degrees(math.atan(0.5)),
    mode_i_energy=50,
    mode_ii_energy=100,
)
# beta = kappa = 2. With k_s/k_n = beta^2/kappa both ellipses are circles: s_p = o_p = 0.1 um, s_c = o_c = 10.1 um.
ROUND = attrs.evolve(LAW, ks=2e14)
PRESSED = -0.2 * um  # 20 MPa

both = pytest.mark.parametrize("compiled", [False, True])


def path(*corners, steps=1000):
    """Straight lines through the corners, ``steps`` points each."""
    legs = [np.linspace(a, b, steps, endpoint=False) for a, b in itertools.pairwise(corners)]
    return np.concatenate([*legs, corners[-1:]])


@both
def test_tension(compiled):
    t = trace(LAW, np.array([0.05, 0.1, 5.1, 7.6, 10.1, 11, 0.05]) * um, 0, compiled=compiled)
    assert t.normal / MPa == pytest.approx([5, 10, 5, 2.5, 0, 0, 0], abs=1e-9)
    assert t.damage == pytest.approx([0, 0, 0.5, 0.75, 1, 1, 1], abs=1e-12)
    assert t.damage[-1] == 1
    # 5 MPa of 510 MPa that the intact spring would hold
    assert t.stiffness_loss[2] == pytest.approx(1 - 1 / 102)
    assert np.all(t.mode == 0)


@both
def test_shear(compiled):
    t = trace(LAW, 0, np.array([-0.1, -0.2, -5.2, -7.7, -10.2]) * um, compiled=compiled)
    assert t.shear / MPa == pytest.approx([-10, -20, -10, -5, 0], abs=1e-9)
    assert t.damage == pytest.approx([0, 0, 0.5, 0.75, 1], abs=1e-12)
    assert t.mode[2:] == pytest.approx([1, 1, 1])


@both
def test_unloading_and_closing(compiled):
    t = trace(LAW, np.array([5.1, 2.55, 0.1, 0, -0.2, 5.1, 7.6]) * um, 0, compiled=compiled)
    assert t.normal / MPa == pytest.approx([5, 2.5, 5 / 51, 0, -20, 5, 2.5])
    assert t.damage[:6] == pytest.approx([0.5] * 6)


@both
def test_mixed_on_circles(compiled):
    # (3.06, 4.08) um is 5.1 um along the ray (0.6, 0.8), half way from 0.1 to 10.1: half of 6 and of 16 MPa.
    ray = np.array([0.05, 0.1, 5.1, 10.1]) * um
    t = trace(ROUND, [*0.6 * ray, 1 * um], [*0.8 * ray, 0], compiled=compiled)
    assert t.normal / MPa == pytest.approx([3, 6, 3, 0, 0], abs=1e-9)
    assert t.shear / MPa == pytest.approx([8, 16, 8, 0, 0], abs=1e-9)
    assert t.damage == pytest.approx([0, 0, 0.5, 1, 1])
    assert t.mode[2:] == pytest.approx([0.64] * 3)


@both
def test_mixed_on_ellipses(compiled):
    # The ray through (0.06, 0.16) um, where 6 and 16 MPa lie on the ellipse of strengths; 0.06/10.1 and 0.16/10.2
    # are 0.00594059 and 0.01568627: it breaks at 1/0.01677349 = 59.6179 times that, and is half way at 30.30895.
    many = np.array([1, 30.30895, 59.618])
    t = trace(LAW, 0.06 * um * many, 0.16 * um * many, compiled=compiled)
    assert t.normal / MPa == pytest.approx([6, 3, 0], abs=1e-5)
    assert t.shear / MPa == pytest.approx([16, 8, 0], abs=1e-5)
    assert t.damage == pytest.approx([0, 0.5, 1], abs=1e-6)
    assert t.mode[1] == pytest.approx(0.01568627**2 / 0.01677349**2, rel=1e-6)


def test_stiff_springs_give_the_formula_of_snozzi_and_molinari():
    # T = (o, beta^2/kappa s) sigma_c/delta (1 - delta/delta_c) with delta^2 = o^2 + (beta/kappa s)^2, rigid at first.
    beta, kappa, critical = 2, 2, 10 * um
    stiff = attrs.evolve(LAW, kn=1e20, ks=beta**2 / kappa * 1e20)
    for o, s in np.array([(3, 4), (1, 0.2), (0.5, 6)]) * um:
        delta = math.hypot(o, beta / kappa * s)
        expected = np.array([o, beta**2 / kappa * s]) * 10 * MPa / delta * (1 - delta / critical)
        t = trace(stiff, [0.1 * o, o], [0.1 * s, s])
        assert [t.normal[1], t.shear[1]] == pytest.approx(expected, rel=1e-4)


@both
def test_stiffness_lost_in_one_mode_is_lost_in_the_other(compiled):
    # Pulled to D = 1/2, 1/102 of the stiffness is left. Sheared, the secant 100/102 MPa/um meets the branch
    # 2 (10.2 - s) MPa at s = 20.4/2.98039216 = 6.844737 um, 6.710526 MPa.
    slip = np.array([0, 0, 0.2, 6.8447, 6.8448, 7.7, 10.2]) * um
    t = trace(LAW, np.array([5.1, 0, 0, 0, 0, 0, 0]) * um, slip, compiled=compiled)
    assert t.shear / MPa == pytest.approx([0, 0, 20 / 102, 6.7105, 6.7104, 5, 0], abs=1e-4)
    assert t.damage[:4].tolist() == [t.damage[0]] * 4
    assert t.damage[4:] == pytest.approx([0.66448, 0.75, 1])
    # Pulled and released: 0.5 + 37.5 - 5 x 5.1/2 J/m2; the shear takes 6.710526 x 10.2/2 J/m2.
    opening = path(0, 5.1 * um, 0, 0, 0)
    t = trace(LAW, opening, path(0, 0, 0, 6.844737 * um, 10.2 * um), compiled=compiled)
    assert t.work[-1] == pytest.approx(25.25 + 34.22368, rel=1e-5)


@both
def test_friction_grows_with_the_damage(compiled):
    # Broken it holds 20 x 0.5 = 10 MPa, at D = 1/2 half of that beside 10 MPa of the branch.
    slip = np.array([0.2, 5.2, 10.2, 12, 11.95, 11.8, 11, 12]) * um
    t = trace(LAW, PRESSED, slip, compiled=compiled)
    assert t.shear / MPa == pytest.approx([20, 15, 10, 10, 5, -10, -10, 10])
    assert t.normal / MPa == pytest.approx([-20] * 8)


@both
def test_work(compiled):
    # Up to the peak f u_p/2: 0.5 and 2 J/m2.
    pulled = trace(LAW, path(0, 0.1 * um, 11 * um), 0, compiled=compiled)
    assert [pulled.work[1000], pulled.work[-1]] == pytest.approx([0.5, 50.5], rel=1e-5)
    sheared = trace(LAW, 0, path(0, 0.2 * um, 11 * um), compiled=compiled)
    assert [sheared.work[1000], sheared.work[-1]] == pytest.approx([2, 102], rel=1e-5)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"cohesion": 0}, "cohesion"),
        ({"tensile_strength": 0}, "tensile_strength"),
        ({"mode_i_energy": -1}, "mode_i_energy"),
        ({"mode_ii_energy": np.array([1.0, 0.0])}, "mode_ii_energy"),
        ({"residual_friction_angle": 90}, "residual_friction_angle"),
        ({"closure": 1}, "must be a Closure"),
    ],
)
def test_refused(changes, words):
    with pytest.raises(gl.ParameterError, match=words):
        attrs.evolve(LAW, **changes)
