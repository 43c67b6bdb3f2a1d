"""Blocks that meet: inclines, toppling, rocking, collisions, sliding over joints and teeth, damping, free flight."""

import math

import numpy as np
import pytest
from bodies import GRAVITY, RIGID, SOFT, Motion, box, each, gap, momentum, together, total, turned
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

import grainlaw as gl
from grainlaw.geometry import block, moved
from grainlaw.laws import Friction

DOWN = (0.0, -GRAVITY)
BOTH = pytest.mark.parametrize("material", [RIGID, SOFT], ids=["rigid", "deformable"])


def faces(friction_angle=0.0, stiffness=1e9):
    return Friction(kn=stiffness, ks=stiffness, friction_angle=friction_angle)


def on_incline(friction, material, *, width=1.0, height=0.5, stiffness=1e9, **options):
    """A block on an incline of 30 degrees; motion along it."""
    body = moved(together(box(40, 1, 0, -1, "base"), box(width, height, left=30)), turn=30)
    motion = Motion(body, faces(friction, stiffness), material=material, gravity=DOWN, fixed=[0], **options)
    along, mine = np.array([math.cos(math.pi / 6), 0.5]), motion.state.mesh.node_grain == 1
    way = {
        "way": lambda state: -float(state.displacement[mine].mean(axis=0) @ along),
        "speed": lambda state: -float(state.velocity[mine].mean(axis=0) @ along),
    }
    return motion, way


@BOTH
def test_a_block_slides_down_an_incline_as_coulomb_says(material):
    motion, way = on_incline(20, material, detection=gl.Detection(damping=0.2))
    run = motion.run(2.0, 40, **way)
    expected = GRAVITY * (0.5 - math.cos(math.pi / 6) * math.tan(math.radians(20)))
    assert np.polyfit(run["time"][8:], run["speed"][8:], 1)[0] == pytest.approx(expected, rel=5e-3)


@BOTH
def test_a_block_with_enough_friction_stays(material):
    motion, way = on_incline(35, material, damping=gl.LocalDamping())
    run = motion.run(2.0, 20, **way)
    assert np.ptp(run["way"][10:]) < 1e-6
    assert run["way"][-1] < 1e-4


@BOTH
@pytest.mark.parametrize(("share", "topples"), [(0.93, True), (1.07, False)])
def test_a_slender_block_topples(material, share, topples):
    width = share * math.tan(math.radians(30))
    motion, _ = on_incline(60, material, width=width, height=1.0, stiffness=1e10, damping=gl.LocalDamping())
    motion.run(3.0)
    first, second = motion.state.positions[motion.state.mesh.node_grain == 1][:2]
    turn = math.degrees(math.atan2(*(second - first)[::-1])) - 30
    assert (turn > 45) if topples else abs(turn) < 2


def rocking(safety=0.9, samples=300, seconds=1.5):
    """A block of 1 x 2 m, released at half its critical angle; its angle from upright."""
    tilt = math.atan(0.5) / 2
    body = together(box(7, 1, -3, -1, "floor"), moved(box(1, 2, -1), turn=-math.degrees(tilt)))
    motion = Motion(body, faces(60, 1e10), gravity=DOWN, fixed=[0], safety=safety)
    return motion.run(seconds, samples, angle=lambda state: float(state.freedoms.arrays.displacement[2, 1]) - tilt)


def test_a_rocking_block_swings_as_housner_says():
    """Housner, 1963, https://doi.org/10.1785/BSSA0530020403: a quarter swing, and half of one of another height."""
    run = rocking()
    critical, p = math.atan(0.5), math.sqrt(3 * GRAVITY / (4 * math.sqrt(1.25)))
    at = np.flatnonzero(np.diff(np.sign(run["angle"])))
    share = -run["angle"][at] / (run["angle"][at + 1] - run["angle"][at])
    crossing = run["time"][at] + share * (run["time"][at + 1] - run["time"][at])
    assert crossing[0] == pytest.approx(math.acosh(2) / p, rel=0.03)
    assert 4 * math.acosh(2) / p == pytest.approx(2.0535, abs=1e-5)
    top = run["angle"][at[0] : at[1]].max() / critical
    assert crossing[1] - crossing[0] == pytest.approx(2 / p * math.acosh(1 / (1 - top)), rel=0.03)


def test_rocking_gains_no_energy_but_rounding_of_the_step():
    """As seen at the samples, against the weight times half the width: about 1e-5, with the square of the step."""
    scale = 2 * 2600 * GRAVITY * 0.5
    coarse, fine = (total(rocking(safety)).max() / scale for safety in (0.9, 0.3))
    assert coarse < 2e-5
    assert fine < coarse / 3


MEETINGS = [(0, 0.5), (0, 0.8), (0, 1.45), (20, 0.5), (30, 1.3), (44, 1.2), (45, 0.5)]


@BOTH
@pytest.mark.parametrize(("turn", "height"), MEETINGS)
def test_two_blocks_collide(material, turn, height):
    body = together(box(1, 1), turned(1, 1, turn, (1.8, height)))
    motion = Motion(body, faces(), material=material, safety=0.1, velocity=each((1, 0.2), (0, 0)))
    before = momentum(motion.state)
    run = motion.run(0.6, 60)
    after, energy = momentum(motion.state), run["kinetic"] + run["zones"]
    assert motion.state.velocity[motion.state.mesh.node_grain == 1, 0].mean() > 0.1  # they met
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


@settings(max_examples=15, deadline=None)
@given(polygons(), polygons(), st.floats(-0.4, 0.4), st.floats(-2, 2), st.sampled_from([0.0, 30.0, 60.0]))
def test_bodies_of_any_shape_keep_momentum_and_the_ledger(first, second, height, spin, friction):
    motion, before, run = thrown(first, second, height, spin, friction)
    given_energy = float(motion.state.freedoms.books.given[0])
    assert momentum(motion.state) == pytest.approx(before, abs=1e-10 * np.abs(before).max())
    assert gap(run).max() < 1e-5 * given_energy
    assert run["contacts_shear"].min() > -1e-10 * given_energy  # friction only takes


def test_friction_under_a_corner_gives_no_energy():
    """A corner that slides while it presses deeper: what is new in contact has not slipped."""
    generator = np.random.default_rng(3)
    first, second = (p[ConvexHull(p).vertices] for p in generator.uniform(-0.5, 0.5, (2, 7, 2)))
    motion = Motion(
        together(block(first), block(second + np.array([1.2, generator.uniform(-0.4, 0.4)]))), faces(60), safety=0.3,
        velocity=each((generator.uniform(1, 3), generator.uniform(-1, 1), generator.uniform(-2, 2)),
                      (0, 0, generator.uniform(-2, 2))),
    )  # fmt: skip
    run = motion.run(0.8, 40)
    assert run["contacts_shear"][-1] >= 0
    assert run["kinetic"][-1] <= run["kinetic"][0]


@BOTH
@pytest.mark.parametrize("step", [0.0, 1e-6])
def test_no_catching_at_joints_of_a_level_floor(material, step):
    """Ripple of what drags and of what carries a block of 1.37 m over blocks of 1 m, over its weight."""
    floor = [box(1, 1, k, -1 + step * (k % 2), f"floor {k}") for k in range(5)]
    drive = gl.Drive(boundary="box", axis=0, speed=0.5, ramp=0.2)
    motion = Motion(
        together(*floor, box(1.37, 1, 0.2, step)), faces(), material=material, gravity=DOWN, fixed=range(5),
        drives=[drive], damping=gl.MassDamping(coefficient=100.0),
    )  # fmt: skip
    weight = 2600 * 1.37 * GRAVITY
    run = motion.run(
        4.0, 1000, drag=lambda state: state.reaction("box")[0] / weight,
        pressed=lambda state: float(state.contacts.forces[1, 2:].sum()) / weight,
    )  # fmt: skip
    moving = run["time"] > 1.0
    ripple = weight / (1.37 * faces().kn) / 1.37  # sinking over length: what a strip that deep can feel of an end
    assert np.ptp(run["drag"][moving]) < ripple
    assert np.abs(run["pressed"][moving] - 1).max() < 3 * ripple


@pytest.mark.parametrize("angle", [20, 30])
def test_a_corner_climbs_a_tooth_as_its_slope_says(angle):
    """Frictionless teeth of 1 m: on the flanks the drag is the weight times the slope, up and down."""
    slope = math.tan(math.radians(angle))
    tooth = [(0, -0.5), (1, -0.5), (1, 0), (0.5, slope / 2), (0, 0)]
    teeth = [moved(block(tooth, f"tooth {k}"), by=(k, 0)) for k in range(4)]
    body = moved(box(0.6, 0.6, -0.3, -0.3), by=(1.0, 0.3 * math.sqrt(2)), turn=45)
    motion = Motion(
        together(*teeth, body), faces(stiffness=1e10), gravity=DOWN, fixed=range(4),
        drives=[gl.Drive(boundary="box", axis=0, speed=0.1, ramp=0.5)], detection=gl.Detection(damping=0.3),
    )  # fmt: skip
    weight = 2600 * 0.36 * GRAVITY
    run = motion.run(
        12.0, 600, drag=lambda state: state.reaction("box")[0] / weight, x=lambda state: state.moved("box")[0] % 1
    )
    for low, high, expected in ((0.15, 0.45, slope), (0.6, 0.9, -slope)):
        there = run["drag"][(run["x"] > low) & (run["x"] < high)]
        assert there == pytest.approx(np.full(len(there), expected), rel=0.1)
    assert gap(run).max() < 1e-6 * weight * slope


@pytest.mark.parametrize("share", [0.1, 0.2, 0.5, 0.9])
def test_contact_damping_is_a_share_of_the_critical(share):
    """A spring and a dashpot that do not pull part when their force is zero; both blocks are free."""
    body = together(box(1, 1), box(1, 1, 1.001, name="other"))
    motion = Motion(body, faces(), safety=0.05, velocity=each((1, 0), (0, 0)), detection=gl.Detection(damping=share))
    run = motion.run(0.03, 10)
    x, y = motion.state.freedoms.arrays.velocity[0]
    root = math.sqrt(1 - share**2)
    expected = math.exp(-share / root * math.atan2(2 * share * root, 2 * share**2 - 1))
    assert y - x == pytest.approx(expected, abs=0.01)
    assert run["damping"][-1] == pytest.approx(
        (1 - (y - x) ** 2) / 2 * float(motion.state.freedoms.books.given[0]), rel=5e-3
    )
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
    motion = Motion(together(box(1, 1), box(1, 1, 0.99, 0.3, "other")), faces(30))
    run = motion.run(0.1, 10)
    assert not motion.state.freedoms.arrays.velocity.any()
    assert run["contacts_normal"] == pytest.approx(0)


def test_what_is_born_overlapping_gives_no_energy():
    motion = Motion(together(box(1, 1), box(1, 1, 0.99, 0.3, "other")), faces(30), velocity=each((1, 0), (0, 0)))
    run = motion.run(0.2, 40)
    assert run["kinetic"].max() <= float(motion.state.freedoms.books.given[0]) * (1 + 1e-9)
    assert run["kinetic"][-1] > 0.98 * float(motion.state.freedoms.books.given[0])
