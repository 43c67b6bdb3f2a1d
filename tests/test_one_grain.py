"""A grain alone, rigid or not: it falls, is pressed and thrown as in the textbook, and its energies are right."""

import attrs
import numpy as np
import pytest
from support import state_of

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.integration import CentralDifference, Undamped
from grainlaw.laws import Friction
from grainlaw.protocols import DirectShear, FreeMotion, UniaxialCompression

LAW = Friction(kn=1e10, ks=1e10, friction_angle=30)
DENSITY, SIDE = 3000, 0.1
MASS = DENSITY * SIDE * SIDE
RIGID = gl.Rigid(density=DENSITY)
ELASTIC = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=DENSITY)
both = pytest.mark.parametrize("material", [RIGID, ELASTIC], ids=["rigid", "elastic"])


def blocks(material, rows=1):
    return gl.Specimen(Bricks(rows=rows).tessellate(rectangle(SIDE, SIDE * rows)), material)


@attrs.frozen(kw_only=True)
class Imposed(gl.LoadingProtocol):
    """Something for a hundredth of a second."""

    loads: tuple = ()
    velocity: tuple = (0.0, 0.0)

    def stages(self, specimen):
        velocity = np.tile(np.array(self.velocity), (len(specimen.mesh.nodes), 1))
        return [gl.Stage(name="only", loads=[*self.loads, gl.loads.InitialVelocity(velocity=velocity)],
                         until=[gl.conditions.Reaches("time", 0.01)], interval=1e-4,
                         integrator=CentralDifference(damping=Undamped()))]  # fmt: skip

    def measure(self, state):
        return {"x": state.displacement[:, 0].mean(), "y": state.displacement[:, 1].mean()}

    def summary(self, curves, specimen):
        return {}


@pytest.mark.thorough
@both
def test_a_grain_falls_as_galileo_says(material):
    result = gl.simulate(blocks(material), LAW, FreeMotion(duration=0.1))
    time, fallen = result.curves["time"], SIDE / 2 - result.curves["centre_y"]
    step = result.summary["time_step"]  # what is seen of places is a step ahead of the forces
    assert fallen == pytest.approx(9.81 * time**2 / 2, abs=9.81 * 0.1 * step)
    assert result.curves["energy_kinetic"][-1] == pytest.approx(MASS * (9.81 * time[-1]) ** 2 / 2, rel=3 * step / 0.1)
    assert result.summary["energy_error"] < 1e-10


@both
@pytest.mark.parametrize("load", ["pressure", "force"])
def test_a_sudden_load_on_a_grain_at_rest_is_no_instability(material, load):
    """The first sample is one step: all energies cancel to rounding, and no work has been done yet."""
    imposed = {"pressure": gl.loads.Pressure(boundary="bottom", pressure=1e4),
             "force": gl.loads.Hold(boundary="bottom", axis=1, stress=1e4)}[load]  # fmt: skip
    result = gl.simulate(blocks(material), LAW, Imposed(loads=(imposed,)))
    moved = 1e4 * SIDE / MASS * result.curves["time"][-1] ** 2 / 2
    assert result.curves["y"][-1] == pytest.approx(moved, rel=0.02)
    assert result.summary["energy_error"] < 1e-10


@both
def test_a_held_grain_that_is_thrown_stays(material):
    result = gl.simulate(blocks(material), LAW, Imposed(loads=(gl.loads.Fixed(grains=[0]),), velocity=(1.0, 1.0)))
    assert result.curves["y"][-1] == 0


@pytest.mark.thorough
def test_two_rigid_blocks_slide_with_friction():
    """As a rigid sample starts: the first sample of its press is one step."""
    test = DirectShear(normal_stress=1e5, loading=gl.Constant(speed=1e-3), maximum_slip=40e-6)
    result = gl.simulate(blocks(RIGID, rows=2), LAW, test)
    assert result.summary["strength"] == pytest.approx(1e5 * np.tan(np.radians(30)), rel=0.01)
    assert result.summary["energy_error"] < 1e-10


def test_a_rigid_grain_between_platens_is_refused():
    """It went with the platen that was named last, and the test measured nothing: an energy error of 1."""
    with pytest.raises(gl.ParameterError, match="boundary = 'bottom' is not allowed, rigid grain 0 lies on 'top' too"):
        gl.simulate(blocks(RIGID), LAW, UniaxialCompression())
    gl.simulate(
        blocks(ELASTIC), LAW, UniaxialCompression(loading=gl.Constant(speed=1.0), maximum_strain=1e-4, samples=10)
    )


def test_a_rigid_grain_may_lie_on_two_boundaries_that_move_alike():
    drives = tuple(gl.loads.Drive(boundary=name, axis=0, speed=0.5) for name in ("left", "right"))
    result = gl.simulate(blocks(RIGID), LAW, Imposed(loads=drives))
    assert result.curves["x"][-1] == pytest.approx(0.5 * result.curves["time"][-1], rel=0.02)


def test_nodes_of_a_rigid_grain_that_turns_move_about_its_centre():
    """v + w x r, with r on the turned grain: the nodes are where they were, turned by a quarter."""
    state = state_of(blocks(RIGID), LAW)
    state.freedoms.arrays.displacement[2, 0] = np.pi / 2
    state.nodes.arrays.displacement[:] = state.grains.nodes_at(state.freedoms.arrays.displacement)
    state.freedoms.arrays.velocity[:, 0] = 2.0, -3.0, 5.0  # m/s, m/s, rad/s
    x, y = (state.mesh.nodes - SIDE / 2).T
    assert state.positions == pytest.approx(SIDE / 2 + np.stack([-y, x], axis=1), abs=1e-15)
    assert state.velocity == pytest.approx(np.stack([2 - 5 * x, -3 - 5 * y], axis=1), abs=1e-12)
