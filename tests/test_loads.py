"""Boundaries under forces: platens held at a stress, and pressures that follow a deforming side."""

import attrs
import numpy as np
import pytest
from support import ROCK, STIFF, advance, impose, small_sample, state_of

import grainlaw as gl
from grainlaw.columns import ENERGY, SPENT, SUPPLIED
from grainlaw.engine.parts.part import Part
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Linear

ALONG = 60e9 / (1 - 0.25**2)  # Pa, plane strain: stress over strain with free sides
ACROSS = 0.25 / 0.75  # lateral over axial strain


@attrs.frozen(kw_only=True)
class Loads(gl.LoadingProtocol):
    """One stage until the specimen is at rest."""

    loads: tuple = ()
    least: float = 3e-5
    rest: float = 1.0  # N on any freedom

    def stages(self, specimen):
        until = [gl.conditions.Reaches("settled", 1.0)]
        return [gl.Stage(name="load", loads=self.loads, until=until, interval=1e-6)]

    def measure(self, state):
        low, high = specimen_size(state)
        strain = [
            (state.moved(far)[axis] - state.moved(near)[axis]) / (high - low)[axis]
            for axis, near, far in ((0, "left", "right"), (1, "bottom", "top"))
        ]
        forces = np.abs(state.freedoms.arrays.force[:2][state.freedoms.arrays.free[:2] > 0])
        settled = state.time > self.least and forces.max() < self.rest
        return {
            "x": strain[0], "y": strain[1], "settled": float(settled), "top": state.reaction("top")[1],
            "bottom": state.reaction("bottom")[1], "moved": state.moved("top")[1],
        }  # fmt: skip

    def summary(self, curves, specimen):
        return {name: curves[name][-1] for name in ("x", "y", "top", "bottom", "moved")}


def specimen_size(state):
    return state.specimen.grains.region.bounds


def block(material=ROCK, rows=1):
    return gl.Specimen(Bricks(rows=rows, columns=1).tessellate(rectangle(4e-3, 4e-3)), material)


def gl_drive(boundary, axis=1, speed=0.0):
    return gl.loads.Drive(boundary=boundary, axis=axis, speed=speed)


HELD = gl_drive("bottom")


def test_a_platen_presses_with_its_stress():
    load = Loads(loads=(HELD, gl.loads.Hold(boundary="top", axis=1, stress=-10e6, ramp=2e-5)))
    result = gl.simulate(block(), Linear(**STIFF), load)
    found = result.summary
    assert found["y"] == pytest.approx(-10e6 / ALONG, rel=1e-3)
    assert found["x"] == pytest.approx(10e6 / ALONG * ACROSS, rel=1e-3)
    assert found["top"] == pytest.approx(-10e6 * 4e-3, rel=1e-3)
    assert found["bottom"] == pytest.approx(10e6 * 4e-3, rel=1e-3)
    assert found["energy_error"] < 1e-3
    assert result.curves["energy_external"][-1] == pytest.approx(0.5 * 10e6**2 / ALONG * 16e-6, rel=0.05)


def test_a_platen_moves_as_one():
    """Where the force alone would bend the top: blocks of different stiffness stand side by side below it."""
    grains = Bricks(rows=1, columns=2).tessellate(rectangle(4e-3, 4e-3))
    grains = attrs.evolve(grains, phase=np.array([0, 1]))
    soft = gl.Elastic(youngs_modulus=20e9, poissons_ratio=0.0, density=2600)
    specimen = gl.Specimen(grains, {0: attrs.evolve(soft, youngs_modulus=60e9), 1: soft})
    load = Loads(loads=(HELD, gl.loads.Hold(boundary="top", axis=1, stress=-10e6, ramp=2e-5)))
    result = gl.simulate(specimen, Linear(**STIFF), load)
    top = specimen.mesh.boundaries["top"]
    assert np.ptp(result.frames[-1].displacement[top, 1]) < 1e-18
    assert result.summary["y"] == pytest.approx(-10e6 / 40e9, rel=0.01)  # in parallel


def test_a_spring_on_a_platen_takes_its_share():
    stiffness = ALONG / 4e-3  # as stiff as the block
    hold = gl.loads.Hold(boundary="top", axis=1, stress=-10e6, ramp=2e-5, stiffness=stiffness)
    found = gl.simulate(block(), Linear(**STIFF), Loads(loads=(HELD, hold))).summary
    assert found["moved"] == pytest.approx(-10e6 / (2 * stiffness), rel=1e-3)
    assert found["top"] == pytest.approx(-5e6 * 4e-3, rel=2e-3)


@pytest.mark.parametrize("rows", [1, 3])
def test_pressure_on_the_sides(rows):
    sides = tuple(gl.loads.Pressure(boundary=side, pressure=10e6, ramp=2e-5) for side in ("left", "right"))
    result = gl.simulate(block(rows=rows), Linear(**STIFF), Loads(loads=(HELD, *sides)))
    assert result.summary["x"] == pytest.approx(-10e6 / ALONG, rel=2e-3)
    assert result.summary["energy_error"] < 1e-3
    assert result.curves["energy_external"][-1] == pytest.approx(0.5 * 10e6**2 / ALONG * 16e-6, rel=0.05)


@pytest.mark.parametrize("rows", [1, 3])
def test_pressure_on_an_end(rows):
    """Its work is half of pressure times strain times volume, and the ledger closes."""
    top = gl.loads.Pressure(boundary="top", pressure=10e6, ramp=2e-5)
    result = gl.simulate(block(rows=rows), Linear(**STIFF), Loads(loads=(HELD, top)))
    modulus = 1 / (1 / ALONG + (rows - 1) / (STIFF["kn"] * 4e-3))
    assert result.summary["y"] == pytest.approx(-10e6 / modulus, rel=2e-3)
    assert result.summary["energy_error"] < 1e-3
    assert result.curves["energy_external"][-1] == pytest.approx(0.5 * 10e6**2 / modulus * 16e-6, rel=0.05)


def test_pressure_all_round_a_free_specimen_leaves_it_where_it_is():
    """No resultant and no moment, however the specimen is turned and bent."""
    specimen = small_sample(15)
    state = state_of(specimen, Linear(**STIFF))
    pressures = [gl.loads.Pressure(boundary=side, pressure=10e6) for side in ("left", "right", "top", "bottom")]
    impose(state, pressures)
    place = specimen.mesh.nodes
    bent = np.stack([place[:, 1] * 0.3 - 5 * place[:, 0] ** 2, -0.2 * place[:, 0] + 4 * place[:, 1] ** 2], axis=1)
    state.nodes.arrays.displacement[:] = bent.T
    advance(state)
    force = state.nodes.arrays.force.T.copy()
    impose(state, [])
    advance(state)
    inside = force - state.nodes.arrays.force.T
    x, y = (place + bent).T
    scale = 10e6 * 20e-3
    assert np.abs(inside.sum(axis=0)).max() < 1e-9 * scale
    assert abs(np.sum(x * inside[:, 1] - y * inside[:, 0])) < 1e-9 * scale * 20e-3
    assert np.abs(inside).max() > 1e-3 * scale


def test_pressure_follows_the_side():
    """A quarter turn carries the force along."""
    specimen = block()
    state = state_of(specimen, Linear(**STIFF))
    impose(state, [gl.loads.Pressure(boundary="top", pressure=10e6)])
    x, y = specimen.mesh.nodes.T
    state.nodes.arrays.displacement[:] = np.array([-y - x, x - y])  # (x, y) to (-y, x)
    advance(state)
    assert state.nodes.arrays.force.sum(axis=1) == pytest.approx([10e6 * 4e-3, 0], abs=1e-3)  # the top now looks to -x


@pytest.mark.parametrize("material", [ROCK, gl.Rigid(density=3100)], ids=["elastic", "rigid"])
@pytest.mark.alone
def test_loads_are_the_same_for_any_number_of_threads(material):
    specimen = small_sample(12, material=material)
    sides = tuple(gl.loads.Pressure(boundary=side, pressure=2e6, ramp=1e-5) for side in ("left", "right"))
    drives = (HELD, gl_drive("bottom", axis=0), gl.loads.Hold(boundary="top", axis=1, stress=-5e6, ramp=1e-5))
    load = Loads(loads=(*drives, *sides), least=2e-5)
    runs = [gl.simulate(specimen, Linear(**STIFF), load, threads=threads) for threads in (1, 2, 3)]
    for run in runs[1:]:
        for name, curve in runs[0].curves.items():
            assert np.array_equal(curve, run.curves[name], equal_nan=True), name
    assert runs[0].summary["top"] == pytest.approx(-5e6 * 20e-3, rel=0.01)
    assert runs[0].summary["energy_error"] < 0.005


@pytest.mark.parametrize(
    "load", [gl.loads.Hold(boundary="lid", axis=1, stress=1e6), gl.loads.Pressure(boundary="lid", pressure=1)]
)
def test_unknown_boundary(load):
    says = rf"{type(load).__name__}: the specimen has no boundary named lid .it has: bottom, left, right, top"
    with pytest.raises(gl.ParameterError, match=says):
        gl.simulate(block(), Linear(**STIFF), Loads(loads=(load,)))


@attrs.frozen(kw_only=True)
class InParts(gl.LoadingProtocol):
    """A pressure that is there at once, undamped, in stages of a microsecond."""

    def stages(self, specimen):
        held, undamped = (
            gl.loads.Drive(boundary="bottom", axis=1, speed=0.0),
            gl.integration.CentralDifference(damping=gl.integration.Undamped()),
        )
        pressure = gl.loads.Pressure(boundary="top", pressure=10e6)
        return [
            gl.Stage(
                name=f"part {k}", loads=[held, pressure], until=[gl.conditions.Reaches("time", (k + 1) * 1e-6)],
                interval=2.5e-7, integrator=undamped,
            )
            for k in range(6)
        ]  # fmt: skip

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


def test_a_speed_that_changes_counts_its_time_from_its_stage():
    """In a second stage, too: the way is the integral of the speed."""
    state = state_of(small_sample(9), Linear(**STIFF))
    impose(state, [gl.loads.Drive(boundary="top", axis=1, speed=0.1)])
    advance(state, 50, 4e-8)
    top, before = state.mesh.boundaries["top"], state.displacement.copy()
    impose(state, [gl.loads.Drive(boundary="top", axis=1, speed=[(0, 0), (2e-6, 1.0)])])
    advance(state, 50, 4e-8)
    assert (state.displacement - before)[top, 1] == pytest.approx(np.full(len(top), 0.5 * 2e-6), rel=1e-9)


def test_a_platen_under_a_force_takes_part_in_a_change_of_velocity():
    """A second step must not find the platen as it was before: momentum is what the change gave."""
    state = state_of(small_sample(6), Linear(**STIFF))
    impose(state, [gl.loads.Hold(boundary="top", axis=1, stress=0.0)])
    advance(state, 1, 1e-9)
    state.change_velocity(np.repeat([[0.0], [1.0]], state.freedoms.arrays.velocity.shape[1], axis=1))
    advance(state, 1, 1e-9)
    freedoms = state.freedoms.arrays
    assert np.sum(freedoms.mass[1] * freedoms.velocity[1]) == pytest.approx(np.sum(freedoms.mass[1]), rel=1e-12)
    assert state.platens.arrays.velocity[0] == pytest.approx([1.0], rel=1e-6)


def test_an_axis_may_be_one_of_numpy():
    assert gl.loads.Drive(boundary="top", axis=np.int64(1), speed=0.0).axis == 1


def test_a_platen_needs_a_freedom_that_is_not_fixed():
    sample = small_sample(6)
    top = np.unique(sample.mesh.node_grain[sample.mesh.boundaries["top"]]).tolist()
    with pytest.raises(
        gl.ParameterError,
        match="Hold: boundary = 'top' is not allowed, it must be a boundary with a node that is free along axis 1",
    ):
        impose(
            state_of(sample, Linear(**STIFF)),
            [gl.loads.Hold(boundary="top", axis=1, stress=-1e6), gl.loads.Fixed(grains=top)],
        )


def test_the_largest_load_is_a_force_not_a_moment():
    """Of rigid grains of 1 km: what bears 160 GN has moments of 12 TN m."""
    sample = small_sample(8, width=2000.0, height=4000.0, material=gl.Rigid(density=2700))
    state = state_of(sample, Linear(**STIFF))
    impose(state, [gl_drive("top", axis=1, speed=-0.1), gl_drive("bottom", axis=1, speed=0.0)])
    advance(state, 400, 1e-5)
    largest = max(np.linalg.norm(state.reaction(boundary)) for boundary in ("top", "bottom"))
    assert state.boundaries.largest_load() == pytest.approx(largest, rel=1e-6)


def test_the_ledger_knows_the_work_of_a_pressure_between_stages():
    curves = gl.simulate(small_sample(), Linear(**STIFF), InParts()).curves
    supplied = curves[ENERGY + SUPPLIED]
    gap = supplied - sum(curves[ENERGY + name] for name in SPENT)
    assert np.abs(gap).max() < 1e-6 * np.abs(supplied).max()


def test_what_a_part_forgets_when_a_stage_begins_stays_in_the_ledger():
    """A part of a load of one's own that says nothing of its past: 5 J are supplied in each of three stages."""

    class Forgetful(Part):
        takes, had = (gl.loads.Gravity,), 0.0

        def begin(self, imposed, at):
            self.had = 0.0

        def energy(self, time_step):
            return {SUPPLIED: self.had}

    state = state_of(small_sample(4), Linear(**STIFF))
    state.gravity = Forgetful()
    for _ in range(3):
        impose(state, [])
        state.gravity.had = 5.0
    assert sum(part.energy(0.0).get(SUPPLIED, 0.0) for part in (state.gravity, state.ended)) == 15.0


def test_a_load_that_no_part_takes_is_refused_before_any_work_is_done(tmp_path):
    @attrs.frozen
    class Magnet(gl.loads.Load):
        """Of one's own."""

    class Pull(InParts):
        def stages(self, specimen):
            until = {"until": [gl.conditions.Reaches("time", 1e-6)], "interval": 1e-6}
            return [gl.Stage(name="rest", **until), gl.Stage(name="pull", loads=[Magnet()], **until)]

    with pytest.raises(
        gl.ParameterError, match=r"Magnet: no part of State.parts takes this load, only Conduction, Driven"
    ):
        gl.simulate(small_sample(4), Linear(**STIFF), Pull(), checkpoint=tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: gl.loads.InitialVelocity(velocity="fast"), "InitialVelocity: velocity = 'fast' is not allowed"),
        (lambda: gl.loads.InitialVelocity(velocity=[(0, np.nan)]), "velocities"),
        (
            lambda: gl.loads.InitialVelocity(velocity=np.zeros((3, 2))).check_specimen(block()),
            "is of 3 nodes, the specimen has",
        ),
        (lambda: gl.loads.Fixed(grains=[7]).check_specimen(block()), "Fixed: grains = 7 is not allowed"),
        (lambda: gl.loads.Gravity(acceleration=(0, "down")), "Gravity: acceleration"),
        (lambda: gl.loads.Heat(to=-300), "Heat: to = -300"),
    ],
)
def test_loads_that_cannot_be_are_refused(make, words):
    with pytest.raises(gl.ParameterError, match=words):
        make()
