"""Coulomb's limit with dashpots: it applies to the whole normal force, that of the spring and that of the dashpot."""

import math

import numpy as np
import pytest
from bodies import RIGID, SOFT, Motion, box, each, gap, momentum, together, turned

import grainlaw as gl
from grainlaw.geometry import moved
from grainlaw.laws import BandisClosure, Friction, MohrCoulomb

ANGLE = 30
TAN = math.tan(math.radians(ANGLE))
STIFFNESS = {"kn": 1e9, "ks": 1e9}
LAWS = {
    "linear": Friction(**STIFFNESS, friction_angle=ANGLE),
    "Bandis": Friction(**STIFFNESS, friction_angle=ANGLE, closure=BandisClosure(maximum_closure=5e-3)),
    "dilating": MohrCoulomb(
        **STIFFNESS, tensile_strength=0, cohesion=0, friction_angle=ANGLE, residual_friction_angle=ANGLE,
        dilation_angle=5,
    ),
}  # fmt: skip


def pressed_and_sheared(state):
    """(k, 2) N of each closed contact: pressure and size of the shear force, from the forces on its nodes."""
    contacts = state.contacts
    closed = contacts.arrays.length > 0
    (x, y), (tx, ty) = contacts.forces[:, :2, closed].sum(axis=1), contacts.closed()["tangent"].T
    return np.column_stack([x * -ty + y * tx, np.abs(x * tx + y * ty)])


def steps_of(motion, count):
    """(k, 2) of all contacts in so many steps, and what energies are meanwhile."""
    forces = []
    run = motion.run(
        count * motion.state.time_step, count, closed=lambda state: len(forces.append(pressed_and_sheared(state)) or [])
    )
    return np.concatenate(forces), run


@pytest.mark.parametrize("material", [RIGID, SOFT], ids=["rigid", "deformable"])
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
@pytest.mark.parametrize("degrees", [0, 20])
@pytest.mark.parametrize("damping", [0.3, 1.0])
def test_shear_is_at_most_friction_times_the_whole_normal_force(law, material, degrees, damping):
    """An oblique impact: the dashpot first adds to the force of the spring, then takes from it."""
    floor = box(20, 1, 0, -1, "floor")
    thrown = turned(1, 1, degrees, (5, math.hypot(0.5, 0.5) * math.cos(math.radians(45 - degrees)) + 1e-4), "thrown")
    motion = Motion(
        together(floor, thrown), law, material=material, fixed=[0], safety=0.3, velocity=each((0, 0), (0.2, -0.1)),
        detection=gl.Detection(damping=damping),
    )  # fmt: skip
    forces, run = steps_of(motion, 1000)
    pressure, shear = forces.T
    assert len(forces) > 20
    assert pressure.min() >= -1e-12 * pressure.max()  # the dashpot does not pull
    assert (shear <= TAN * pressure + 1e-9 * shear.max()).all()
    assert np.count_nonzero((shear > 0.99 * TAN * pressure) & (pressure > 0)) >= 10  # and it reaches the limit
    energy = run["kinetic"][0]
    assert gap(run).max() < 1e-3 * energy
    assert min(run["damping"].min(), run["contacts_shear"].min()) >= -1e-9 * energy
    assert run["kinetic"].max() <= energy * (1 + 1e-6)


@pytest.mark.parametrize("damping", [0.1, 0.5, 1.0])
def test_an_impact_that_slides_all_the_time_has_coulombs_ratio_of_impulses(damping):
    """Where a contact slides from first to last its impulses are as its forces: tan(phi), whatever the restitution."""
    target, thrown = box(40, 1, 0, -1, "target"), moved(box(1, 1, 5, 1e-3, "thrown"))
    motion = Motion(
        together(target, thrown), LAWS["linear"], fixed=[0], safety=0.1, velocity=each((0, 0), (40.0, -0.1)),
        detection=gl.Detection(damping=damping),
    )  # fmt: skip
    before = momentum(motion.state)
    motion.run(0.05)
    lost = momentum(motion.state) - before
    assert lost[1] > 0.1 * 2600
    assert -lost[0] / lost[1] == pytest.approx(TAN, rel=2e-3)
