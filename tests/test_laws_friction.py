"""Friction between unbonded faces, by hand: kn 1e12 Pa/m, ks 5e11 Pa/m, friction 0.5."""

import math

import attrs
import numpy as np
import pytest

import grainlaw as gl
from grainlaw.laws import BandisClosure, CohesiveCrack, Friction

FACES = Friction(kn=1e12, ks=5e11, friction_angle=math.degrees(math.atan(0.5)))


def test_open_faces_feel_nothing():
    t = gl.trace(FACES, [1e-6, 1e-6, 1e-6], [0, 1e-6, -1e-6])
    assert not t.normal.any()
    assert not t.shear.any()


def test_closed_faces_stick_slide_and_follow_the_reversal():
    # 10 MPa of pressure hold 5 MPa: stuck up to 10 um of slip, then slid; back by 20 um of slip to the other side.
    slip = np.array([0, 5, 10, 30, 20, 10, -5]) * 1e-6
    t = gl.trace(FACES, -1e-5, slip)
    assert t.normal == pytest.approx(-1e7)
    assert t.shear == pytest.approx(np.array([0, 2.5, 5, 5, 0, -5, -5]) * 1e6, abs=1e-3)
    assert t.anchor * 1e6 == pytest.approx([0, 0, 0, 20, 20, 20, 5])


def test_faces_that_part_forget_where_they_stuck():
    t = gl.trace(FACES, [-1e-5, -1e-5, 1e-6, -1e-5], [0, 8e-6, 8e-6, 8e-6])
    assert t.shear == pytest.approx([0, 4e6, 0, 0], abs=1e-3)


def test_faces_that_are_apart_press_and_rub_once_they_have_met():
    """A gap of 4 um: 6 um of closure are 2 um of contact, which hold 1 MPa of shear."""
    apart = attrs.evolve(FACES, gap=4e-6)
    t = gl.trace(apart, np.array([0, -4, -6, -6, -3]) * 1e-6, np.array([0, 3, 3, 9, 9]) * 1e-6)
    assert t.normal == pytest.approx(np.array([0, 0, -2, -2, 0]) * 1e6, abs=1e-3)
    assert t.shear == pytest.approx(np.array([0, 0, 0, 1, 0]) * 1e6, abs=1e-3)
    assert gl.check_law(apart).passed
    assert FACES.exceptions == {}
    assert "the faces are 4e-06 m apart" in apart.exceptions["stiffness"]
    stiffening = attrs.evolve(apart, closure=BandisClosure(maximum_closure=4e-6))
    assert gl.trace(stiffening, -6e-6, 0).normal[0] == pytest.approx(-1e12 * 2e-6 / (1 - 0.5))
    with pytest.raises(gl.ParameterError, match="Friction: gap = -1 m is not allowed"):
        attrs.evolve(FACES, gap=-1)


def test_closure_is_a_part():
    closed = Friction(kn=1.05e14, ks=1e14, friction_angle=30, closure=BandisClosure(maximum_closure=2e-6))
    assert gl.trace(closed, -0.7537e-6, 0).normal[0] == pytest.approx(-127e6, rel=2e-4)


@pytest.mark.parametrize("pressure", [0.0, 10e6, 40e6])
def test_a_broken_cohesive_crack_is_this_law(pressure):
    crack = CohesiveCrack(
        kn=1.05e14, ks=9.45e13, tensile_strength=13e6, cohesion=29e6, friction_angle=54, residual_friction_angle=5,
        mode_i_energy=150, mode_ii_energy=300,
    )  # fmt: skip
    faces = Friction(kn=1.05e14, ks=9.45e13, friction_angle=5)
    slip = np.concatenate([[0, 0], np.sin(np.linspace(0, 12, 200)) * 3e-6])
    opening = np.concatenate([[0, 1e-3], np.full(200, -pressure / 1.05e14)])
    broken, alone = gl.trace(crack, opening, slip), gl.trace(faces, opening, slip)
    assert broken.damage[1] == 1
    assert broken.normal[2:] == pytest.approx(alone.normal[2:])
    assert broken.shear[2:] == pytest.approx(alone.shear[2:], abs=1)
