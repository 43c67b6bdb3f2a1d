"""Joints that dilate: lift and shear against theory before, at and after a bond is handed over, and on loose faces."""

import math

import attrs
import numpy as np
import pytest
from bodies import GRAVITY, RIGID, SOFT, box, moved, together
from scenes import DILATING, DILATION, FRICTION, JOINT, PRESSURE, SLOPE, TAN, WIDTH, lift, ridden, sheared

import grainlaw as gl
from grainlaw.geometry import Bricks, block, rectangle
from grainlaw.laws import BandisClosure, Friction
from grainlaw.protocols import FreeMotion

DETECTIONS = {
    "bonds": None,
    "handed over at 0.5 mm": gl.Detection(hand_over=0.01),
    "handed over, dashpots": gl.Detection(hand_over=0.01, damping=0.5),
}
HANDED_OVER = 0.01 * WIDTH


@pytest.mark.thorough
@pytest.mark.parametrize("law", DILATING.values(), ids=DILATING)
@pytest.mark.parametrize("detection", DETECTIONS.values(), ids=DETECTIONS)
def test_lift_and_shear_of_a_joint(law, detection):
    """Slip less that of the spring, times tan(psi); pressure times tan(phi): everywhere to 2 %."""
    result, (slip, pressure, shear) = sheared(law, detection)
    curves = result.curves
    lifted = lift(curves)
    far = curves["displacement"] > 1e-4
    expected = SLOPE * (curves["displacement"] - TAN * PRESSURE / JOINT["ks"])
    assert lifted[far] == pytest.approx(expected[far], rel=0.02)
    around = np.abs(curves["displacement"] - HANDED_OVER) < 4e-5
    assert np.abs(np.diff(lifted[around])).max() < 1e-6  # no jump
    sliding = slip > 1e-4
    assert shear[sliding] == pytest.approx(TAN * pressure[sliding], rel=0.02)
    for part in (slip < HANDED_OVER, slip > HANDED_OVER):
        assert pressure[sliding & part].mean() == pytest.approx(PRESSURE, rel=0.025)  # local damping, 1.02 at most
    assert result.summary["energy_error"] < 1e-6


@pytest.mark.thorough
@pytest.mark.parametrize("law", DILATING.values(), ids=DILATING)
def test_dilation_leaves_the_time_step_alone(law):
    steps = [
        sheared(attrs.evolve(law, dilation_angle=angle), gl.Detection(hand_over=0.01))[0].summary["steps"]
        for angle in (0, DILATION)
    ]
    assert steps[1] < 1.1 * steps[0]


@pytest.mark.thorough
@pytest.mark.parametrize("damping", [0.0, 0.2])
@pytest.mark.parametrize("material", [RIGID, SOFT], ids=["rigid", "deformable"])
@pytest.mark.parametrize("law", DILATING.values(), ids=DILATING)
def test_a_block_rides_up_an_incline_it_slides_down(law, material, damping):
    """Faces that nothing ever bonded. m a_n = N - m g cos, a_n = a tan(psi), m a = m g sin - N tan(phi)."""
    way, lifted, acceleration = ridden(law, material, damping)
    assert way[-1] > 0.1
    assert lifted[way > 0.02] == pytest.approx(SLOPE * way[way > 0.02], rel=0.02)
    angle = math.radians(40)
    expected = GRAVITY * (math.sin(angle) - TAN * math.cos(angle)) / (1 + TAN * SLOPE)
    assert acceleration == pytest.approx(expected, rel=0.02)


@pytest.mark.thorough
@pytest.mark.parametrize("damping", [0.0, 0.2])
def test_a_joint_that_dilates_does_not_lift_a_block_whose_joint_does_not(damping):
    """Two blocks slide down one incline: the second keeps to the plane."""
    rough, smooth = (
        attrs.evolve(DILATING["Mohr-Coulomb"], kn=1e9, ks=1e9),
        Friction(kn=1e9, ks=1e9, friction_angle=FRICTION),
    )
    base = block([(0, -1), (40, -1), (40, 0), (0, 0)], phase=0)
    blocks = [block([(x, 0), (x + 1, 0), (x + 1, 0.5), (x, 0.5)], phase=k) for k, x in ((1, 30), (2, 35))]
    motion = FreeMotion(duration=0.3, settle=0.1, fixed=[0], tracked=[1, 2])
    curves = gl.simulate(
        gl.Specimen(moved(together(base, *blocks), turn=40), RIGID), {(0, 1): rough, (0, 2): smooth, (1, 2): smooth},
        motion, detection=gl.Detection(damping=damping),
    ).curves  # fmt: skip
    up = np.array([-math.sin(math.radians(40)), math.cos(math.radians(40))])
    lifts = [np.ptp(np.column_stack([curves[f"x_{k}"], curves[f"y_{k}"]]) @ up) for k in (1, 2)]
    assert lifts[0] > 5e-3
    assert lifts[1] < 1e-4  # it sinks in by weight over stiffness, 1e-5 m, and swings


@pytest.mark.thorough
def test_the_step_recovers_when_a_stiff_closure_eases():
    """Pressed to 200 MPa and let go: shorter by at least the root of the tangent's part in it, then as at the start."""
    law = attrs.evolve(DILATING["Barton-Bandis"], kn=1e13, ks=1e13, closure=BandisClosure(maximum_closure=1e-5))
    blocks = gl.Specimen(Bricks(rows=2).tessellate(rectangle(10e-3, 4e-3)), gl.Rigid(density=3000))
    curves = gl.simulate(blocks, law, _PressAndRelease(), detection=None).curves
    step = np.diff(curves["time"]) / np.diff(curves["step"])
    tangent = (1 + 200e6 / (1e13 * 1e-5)) ** 2  # of the hyperbola, over kn
    assert step.min() < 1.1 * step[0] / math.sqrt(tangent)
    assert step[-1] > step[0] / math.sqrt(1.5 * 1.2 * 1.03)  # what has eased by less than a third stays


@attrs.frozen(kw_only=True)
class _PressAndRelease(gl.LoadingProtocol):
    """A platen that presses the upper block, and goes back."""

    def stages(self, specimen):
        bottom = gl.loads.Drive(boundary="bottom", axis=1, speed=0)

        def stage(name, start, stress):
            top = gl.loads.Hold(boundary="top", axis=1, stress=-stress, start=-start, ramp=2e-4)
            return gl.Stage(name=name, loads=[top, bottom], until=[gl.conditions.Reaches(name, 3e-4)], interval=2e-6)

        return [stage("pressed", 0.0, 200e6), stage("released", 200e6, 1e6)]

    def measure(self, state):
        began = state.time - state.began
        return {"pressed": began, "released": began}

    def summary(self, curves, specimen):
        return {}


@pytest.mark.thorough
def test_lifted_faces_that_part_keep_their_lift_for_a_while():
    """Pulled apart by less than grains may overlap and put back, they meet where they parted; by more, they fall."""
    law = attrs.evolve(DILATING["Mohr-Coulomb"], kn=1e9, ks=1e9)
    for gap, kept in ((0.02, True), (0.2, False)):
        blocks = together(box(4, 1, -2, -1, "base"), box(1, 1, -0.5))
        found = gl.simulate(gl.Specimen(blocks, RIGID), law, _SlideLiftAndPress(gap=gap), time_step_factor=0.2).curves
        slid = found["x"].max()
        assert slid == pytest.approx(0.1, rel=0.05)
        pressed = (found["stage"] == 3) & (found["force"] > 1)
        first = found["y"][np.flatnonzero(pressed)[0]]
        assert first == pytest.approx(SLOPE * slid if kept else 0.0, abs=0.1 * SLOPE * slid)


@attrs.frozen(kw_only=True)
class _SlideLiftAndPress(gl.LoadingProtocol):
    """Slide a box by 0.1 m under pressure, pull it off by ``gap``, and press it down again."""

    gap: float

    def stages(self, specimen):
        def stage(name, column, limit, across, speed=None, stress=None):
            up = (
                gl.loads.Hold(boundary="box", axis=1, stress=stress) if speed is None
                else gl.loads.Drive(boundary="box", axis=1, speed=speed)
            )  # fmt: skip
            return gl.Stage(
                name=name, loads=[up, gl.loads.Drive(boundary="box", axis=0, speed=across), gl.loads.Fixed(grains=[0])],
                until=[gl.conditions.Reaches(column, limit)], interval=1e-3,
            )  # fmt: skip

        top = 0.1 * SLOPE + self.gap
        return [
            stage("press", "steps_done", 50, 0.0, stress=-5e4), stage("slide", "x", 0.1, 0.5, stress=-5e4),
            stage("lift", "y", top, 0.0, speed=0.2), stage("press again", "force", 1e5, 0.0, speed=-0.2),
        ]  # fmt: skip

    def measure(self, state):
        x, y = state.moved("box")
        return {"x": float(x), "y": float(y), "force": -float(state.contacts.forces[1, :2].sum()),
                "steps_done": float(state.steps)}  # fmt: skip

    def summary(self, curves, specimen):
        return {}
