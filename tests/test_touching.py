"""Blocks that meet: inclines, toppling, rocking, collisions, sliding over joints and teeth, damping, free flight."""

import math

import numpy as np
import pytest
from bodies import GRAVITY, RIGID, SOFT, Motion, box, each, gap, momentum, together, total
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scenes import (
    DOWN,
    MEETINGS,
    collided,
    faces,
    leaned,
    over_joints,
    over_teeth,
    rebound,
    rocking,
    slid,
    stayed,
    swing,
    thrown_at_random,
)
from scipy.spatial import ConvexHull

import grainlaw as gl
from grainlaw.geometry import block
from grainlaw.geometry.bodies import side_by_side

BOTH = pytest.mark.parametrize("material", [RIGID, SOFT], ids=["rigid", "deformable"])


@BOTH
def test_a_block_slides_down_an_incline_as_coulomb_says(material):
    expected = GRAVITY * (0.5 - math.cos(math.pi / 6) * math.tan(math.radians(20)))
    assert slid(material) == pytest.approx(expected, rel=5e-3)


@BOTH
def test_a_block_with_enough_friction_stays(material):
    way = stayed(material)
    assert np.ptp(way[10:]) < 1e-6
    assert way[-1] < 1e-4


@BOTH
@pytest.mark.parametrize(("share", "topples"), [(0.93, True), (1.07, False)])
def test_a_slender_block_topples(material, share, topples):
    turn = leaned(material, share)
    assert (turn > 45) if topples else abs(turn) < 2


@pytest.mark.thorough
def test_a_rocking_block_swings_as_housner_says():
    """Housner, 1963, https://doi.org/10.1785/BSSA0530020403: a quarter swing, and half of one of another height."""
    quarter, half, *expected = swing(rocking())
    assert (quarter, half) == pytest.approx(expected, rel=0.03)
    assert 4 * expected[0] == pytest.approx(2.0535, abs=1e-5)


@pytest.mark.thorough
def test_rocking_gains_no_energy_but_rounding_of_the_step():
    """As seen at the samples, against the weight times half the width: about 1e-5, with the square of the step."""
    scale = 2 * 2600 * GRAVITY * 0.5
    coarse, fine = (total(rocking(safety)).max() / scale for safety in (0.9, 0.3))
    assert coarse < 2e-5
    assert fine < coarse / 3


@pytest.mark.thorough
@BOTH
@pytest.mark.parametrize(("turn", "height"), MEETINGS)
def test_two_blocks_collide(material, turn, height):
    run, before, after = collided(material, turn, height)
    energy = run["kinetic"] + run["zones"]
    assert after == pytest.approx(before, abs=1e-10 * np.abs(before).max())
    assert energy[-1] == pytest.approx(energy[0], rel=1e-3)
    assert gap(run).max() < 1e-6 * energy[0]


coordinate = st.floats(-0.5, 0.5, width=16)


@st.composite
def polygons(draw):
    points = np.array(draw(st.lists(st.tuples(coordinate, coordinate), min_size=4, max_size=8, unique=True)))
    assume(np.ptp(points, axis=0).min() > 0.3)
    assume(np.linalg.matrix_rank(points - points[0], tol=0.1) == 2)
    corners = points[ConvexHull(points).vertices]
    sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    assume(sides.min() > 0.1)
    x, y = (corners - corners.mean(axis=0)).T
    assume(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0.2)
    return corners


def thrown(first, second, height, spin, friction, **options):
    motion = Motion(
        together(block(first), block(second + np.array([1.1, height]))), faces(friction), safety=0.1,
        velocity=each((2, 0.3), (0, 0, spin)), **options,
    )  # fmt: skip
    before = momentum(motion.state)
    run = motion.run(0.5, 25)
    return motion, before, run


@pytest.mark.thorough
@settings(max_examples=15)
@given(polygons(), polygons(), st.floats(-0.4, 0.4), st.floats(-2, 2), st.sampled_from([0.0, 30.0, 60.0]))
def test_bodies_of_any_shape_keep_momentum_and_the_ledger(first, second, height, spin, friction):
    motion, before, run = thrown(first, second, height, spin, friction)
    given_energy = float(motion.state.freedoms.books.given[0])
    assert momentum(motion.state) == pytest.approx(before, abs=1e-10 * np.abs(before).max())
    assert gap(run).max() < 1e-5 * given_energy
    assert run["contacts_shear"].min() > -1e-10 * given_energy  # friction only takes


def test_friction_under_a_corner_gives_no_energy():
    """A corner that slides while it presses deeper: what is new in contact has not slipped."""
    run, _ = thrown_at_random(3, friction=60, samples=40)
    assert run["contacts_shear"][-1] >= 0
    assert run["kinetic"][-1] <= run["kinetic"][0]


@pytest.mark.thorough
@BOTH
@pytest.mark.parametrize("step", [0.0, 1e-6])
def test_no_catching_at_joints_of_a_level_floor(material, step):
    drag, pressed, ripple = over_joints(material, step)
    assert drag < ripple
    assert pressed < 3 * ripple


@pytest.mark.thorough
@pytest.mark.parametrize("angle", [20, 30])
def test_a_corner_climbs_a_tooth_as_its_slope_says(angle):
    """On the flanks of frictionless teeth the drag is the weight times the slope, up and down."""
    scale, run = over_teeth(angle, stiffness=1e10)
    for low, high, expected in ((0.15, 0.45, 1), (0.6, 0.9, -1)):
        there = run["drag"][(run["x"] > low) & (run["x"] < high)]
        assert there == pytest.approx(np.full(len(there), expected), rel=0.1)
    assert gap(run).max() < 1e-6 * scale


@pytest.mark.parametrize("share", [0.1, 0.2, 0.5, 0.9])
def test_contact_damping_is_a_share_of_the_critical(share):
    found, expected, run = rebound(share)
    assert found == pytest.approx(expected, abs=0.01)
    thrown = 2600 * 1**2 / 2  # J, of a square metre at 1 m/s
    assert run["damping"][-1] == pytest.approx((1 - found**2) / 2 * thrown, rel=5e-3)
    assert gap(run).max() < 1e-9 * run["kinetic"][0]


@BOTH
@pytest.mark.parametrize("share", [0.5, 1.0])
def test_a_tower_with_contact_damping_comes_to_rest(material, share):
    """Dashpots shorten the stable step of central differences by sqrt(1 + share^2) - share."""
    tower = together(box(3, 1, -1, -1, "floor"), *(box(1, 0.5, 0.02 * k, 0.5 * k) for k in range(4)))
    motion = Motion(
        tower, faces(30), material=material, gravity=DOWN, fixed=[0], detection=gl.Detection(damping=share),
    )  # fmt: skip
    run = motion.run(2.0, 20)
    sunk = 2600 * 2 * GRAVITY * 1e-4  # J of weight over some static closure
    assert gap(run).max() < 1e-3 * sunk
    assert run["kinetic"][-1] < 1e-2 * sunk


@pytest.mark.thorough
def test_free_flight_with_spin_does_not_drift():
    body = box(1, 0.5)
    motion = Motion(together(body, box(1, 1, 50)), faces(), velocity=each((1, 2, 3), (0, 0)))
    state = motion.state
    state.time_step = 1e-4
    motion.steps(100_000)
    x, y, angle = state.freedoms.arrays.displacement[:, 0]
    assert (x, y, angle) == pytest.approx((10, 20, 30), rel=1e-10)
    corners = np.array([(0, 0), (1, 0), (1, 0.5), (0, 0.5)]) - (0.5, 0.25)
    c, s = math.cos(angle), math.sin(angle)
    expected = corners @ [[c, s], [-s, c]] + (0.5 + x, 0.25 + y)
    found = state.positions[state.mesh.node_grain == 0][:4]  # the last node is the centroid
    order = [int(np.argmin(np.hypot(*(expected - place).T))) for place in found]
    assert found == pytest.approx(expected[order], abs=1e-12)


def test_contacts_born_overlapping_begin_without_force():
    motion = Motion(side_by_side(box(1, 1), box(1, 1, 0.99, 0.3, "other")), faces(30))
    run = motion.run(0.1, 10)
    assert not motion.state.freedoms.arrays.velocity.any()
    assert run["contacts_normal"] == pytest.approx(0)


def test_what_is_born_overlapping_gives_no_energy():
    motion = Motion(side_by_side(box(1, 1), box(1, 1, 0.99, 0.3, "other")), faces(30), velocity=each((1, 0), (0, 0)))
    run = motion.run(0.2, 40)
    assert run["kinetic"].max() <= float(motion.state.freedoms.books.given[0]) * (1 + 1e-9)
    assert run["kinetic"][-1] > 0.98 * float(motion.state.freedoms.books.given[0])
