"""Fluids in cracks: where they reach, what they press on, and closed forms of what comes of it."""

import attrs
import numpy as np
import pytest
import pyvista
from hypothesis import given, settings
from hypothesis import strategies as st
from support import ROCK, STIFF, STRONG, advance, small_sample, state_of

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.engine.ledger import energies
from grainlaw.engine.parts.fluids import Connection
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import CohesiveCrack, Friction, Linear, MohrCoulomb
from grainlaw.protocols import BiaxialCompression, DirectShear, Saturated, UniaxialCompression, UniaxialTension
from grainlaw.results.vtk import VtkWriter
from grainlaw.units import mm

SIDES = ("left", "right", "top", "bottom")
JOINT, GLUE = Friction(**STIFF, friction_angle=30), Linear(**STIFF)
WEAK = CohesiveCrack(
    **STIFF, tensile_strength=5e6, cohesion=10e6, friction_angle=20, residual_friction_angle=10, mode_i_energy=0.2,
    mode_ii_energy=0.5,
)  # fmt: skip
CRUSH = UniaxialCompression(loading=gl.Constant(speed=0.7), maximum_strain=0.02, samples=40, stop_fraction=0)
FLOOR = gl.loads.Drive(boundary="bottom", axis=1, speed=0.0)


@attrs.frozen(kw_only=True)
class Loads(gl.LoadingProtocol):
    """A stage for each list of loads, until it is at rest."""

    loads: tuple = ()
    ratio: float = 1e-4
    limit: int = 100_000

    def stages(self, specimen):
        until = [gl.conditions.AtRest(self.ratio)]
        return [
            gl.Stage(name=f"load {k}", until=until, interval=1e-5, loads=loads, sample_limit=self.limit)
            for k, loads in enumerate(self.loads)
        ]

    def measure(self, state):
        wet, length = state.fluid_pressure > 0, state.contact_lengths
        return {
            "wet": int(wet.sum()),
            "normal": float(np.average(state.normal, weights=length)),
            "opening": float(np.average(state.opening, weights=length)),
            "widest": float(state.opening.max()),
            **{f"{side}_{axis}": state.moved(side)[k] for side in SIDES for k, axis in enumerate("xy")},
        }

    def summary(self, curves, specimen):
        return {name: float(values[-1]) for name, values in curves.items()}


class Last(gl.Observer):
    """Keeps the state."""

    def observe(self, state, curves, stage, progress):
        self.state = state


def two_bricks(width=10e-3, height=4e-3):
    return gl.Specimen(Bricks(rows=2).tessellate(rectangle(width, height)), ROCK)


def fluid(boundary, pressure=5e6, **options):
    return gl.loads.FluidPressure(boundary=boundary, pressure=pressure, ramp=2e-5, **options)


def pressed(stress, ramp=2e-5):
    return gl.loads.Hold(boundary="top", axis=1, stress=-stress, ramp=ramp)


# --- where it reaches ------------------------------------------------------------------------------------------------


def flooded(mesh, ends, broken, boundary):
    """Points that a flood reaches from a boundary, node by node: those of one place are one corner."""
    place = {i: tuple(np.round(mesh.nodes[i] / 1e-9).astype(int)) for i in np.unique(ends)}
    count = len(ends)
    dry = {int(p) for p in np.flatnonzero(broken)}
    at = {place[i] for i in mesh.boundaries[boundary] if i in place}
    wet = set()
    while True:
        found = {p for p in dry if place[ends[p % count, p // count]] in at or (p + count) % (2 * count) in wet}
        if not found:
            return wet
        dry, wet = dry - found, wet | found
        at |= {place[ends[p % count, p // count]] for p in found}


@settings(max_examples=30)
@given(st.integers(1, 1000), st.floats(0.2, 0.9), st.sampled_from(SIDES), st.integers(0, 1))
def test_a_fluid_reaches_what_a_flood_reaches(seed, share, boundary, refinement):
    specimen = small_sample(25, refinement=refinement)
    mesh, ends = specimen.mesh, specimen.mesh.interfaces
    broken = np.random.default_rng(seed).random(2 * len(ends)) < share
    points, corners = Connection(mesh, ends).pieces(broken)
    reached = broken & np.isin(points, corners[mesh.boundaries[boundary]])
    assert set(np.flatnonzero(reached)) == flooded(mesh, ends, broken, boundary)


def test_half_a_bond_is_pressed_where_it_is_broken():
    """By hand, two bricks of 10 mm: at a Gauss point the force p L / 2 goes to the ends by 0.7887 and 0.2113 of it."""
    specimen = two_bricks()
    state = state_of(specimen, MohrCoulomb(**STRONG))
    (group,) = state.bonds.groups
    nodes = specimen.mesh.interfaces[0]
    (left,) = np.flatnonzero(specimen.mesh.nodes[nodes[:2], 0] < 1e-9)  # which end of the joint is at the left
    state.bonds.arrays.memory[group.row("damage"), left] = 1.0
    both = tuple(gl.loads.FluidPressure(boundary=side, pressure=5e6, cracks_only=True) for side in ("left", "right"))
    state.begin(gl.Stage(name="wet", loads=both, until=[gl.conditions.AtRest()], interval=1e-6))
    advance(state)
    force = state.nodes.arrays.force.T
    near, far = 0.5 + 0.5 / np.sqrt(3), 0.5 - 0.5 / np.sqrt(3)
    expected = 5e6 * 10e-3 / 2 * np.array([near, far])[:: 1 if left == 0 else -1]
    lower, upper = np.sort(nodes.reshape(2, 2), axis=0) if nodes[0] < nodes[2] else nodes.reshape(2, 2)[::-1]
    assert force[lower] == pytest.approx(np.column_stack([0 * expected, -expected]))
    assert force[upper] == pytest.approx(np.column_stack([0 * expected, expected]))
    assert np.abs(force).sum() == pytest.approx(2 * expected.sum())  # and nothing else is pressed
    assert state.fluid_pressure.tolist() == [5e6 if p == left else 0 for p in (0, 1)]


def test_the_pressure_that_is_read_is_that_since_the_stage_began():
    """It rises smoothly: half way through its ramp it is half of what it comes to."""
    state = state_of(two_bricks(), JOINT)
    state.time_step = 1e-6
    for stage, count in ((gl.Stage(name="dry", until=[gl.conditions.AtRest()], interval=1e-6), 7), (None, 10)):
        state.begin(
            stage or gl.Stage(name="wet", loads=[FLOOR, fluid("left")], until=[gl.conditions.AtRest()], interval=1e-6)
        )
        advance(state, count, 1e-6)
    assert state.began == pytest.approx(7e-6)
    assert state.fluid_pressure == pytest.approx([2.5e6, 2.5e6])


def test_a_crack_that_joins_two_fluids_has_the_higher_pressure():
    state = state_of(two_bricks(), JOINT)
    fluids = (
        gl.loads.FluidPressure(boundary="left", pressure=2e6),
        gl.loads.FluidPressure(boundary="right", pressure=1e6),
    )
    for order in (fluids, fluids[::-1]):
        state.begin(gl.Stage(name="wet", loads=order, until=[gl.conditions.AtRest()], interval=1e-6))
        assert state.fluid_pressure.tolist() == [2e6, 2e6]
    state.begin(gl.Stage(name="dry", until=[gl.conditions.AtRest()], interval=1e-6))
    assert not state.fluid_pressure.any()


# --- closed forms ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("material", [ROCK, gl.Rigid(density=2700)])
@pytest.mark.parametrize("pressure", [2e6, 9e6])
def test_a_closed_joint_bears_the_effective_stress(material, pressure):
    """Held by 10 MPa, with a fluid in it: the joint opens by p / kn, and the blocks do not feel it."""
    specimen = gl.Specimen(Bricks(rows=2).tessellate(rectangle(10e-3, 4e-3)), material)
    dry = [FLOOR, pressed(10e6)]
    wet = [FLOOR, pressed(10e6, ramp=0.0), fluid("left", pressure, cracks_only=True)]
    result = gl.simulate(specimen, JOINT, Loads(loads=(dry, wet)))
    found, stage = result.summary, result.curves["stage"]
    rise = result.curves["top_y"][-1] - result.curves["top_y"][stage == 0][-1]
    assert found["wet"] == 2
    assert found["normal"] == pytest.approx(pressure - 10e6, rel=1e-3)
    assert found["opening"] == pytest.approx((pressure - 10e6) / STIFF["kn"], rel=1e-3)
    assert rise == pytest.approx(pressure / STIFF["kn"], rel=1e-3)
    assert found["energy_error"] < 1e-6


@pytest.mark.parametrize(("pressure", "opens"), [(9.9e6, False), (10.1e6, True)])
def test_a_joint_opens_when_the_fluid_bears_more_than_presses_on_it(pressure, opens):
    dry = [FLOOR, pressed(10e6)]
    wet = [FLOOR, pressed(10e6, ramp=0.0), fluid("left", pressure, cracks_only=True)]
    try:
        found = gl.simulate(two_bricks(), JOINT, Loads(loads=(dry, wet), limit=10)).summary
    except gl.StageError as error:  # nothing holds it
        found = error.result.summary
    assert (found["opening"] > 0) == opens
    assert found["energy_error"] < 1e-6


def test_a_broken_joint_slides_at_the_friction_of_its_effective_stress():
    """tan(30 deg) times 10 MPa less 4 MPa."""
    shear = DirectShear(normal_stress=10e6, loading=gl.Constant(speed=0.02), maximum_slip=10e-6)
    found = gl.simulate(two_bricks(), JOINT, Saturated(test=shear, pressure=4e6, boundaries="left")).summary
    assert found["wet"] == 2
    assert found["residual_stress"] == pytest.approx(np.tan(np.radians(30)) * 6e6, rel=0.01)
    assert found["energy_error"] < 1e-6


def test_grains_in_a_fluid_are_pressed_alike_from_all_sides():
    """A free block of four bricks; its joints are whole and dry, so that they close by p / kn."""
    specimen = gl.Specimen(Bricks(rows=2, columns=2).tessellate(rectangle(4e-3, 4e-3)), ROCK)
    all_around = [fluid(side) for side in SIDES]
    found = gl.simulate(specimen, Linear(**STIFF), Loads(loads=(all_around,))).summary
    strain = -5e6 * (1.25 * 0.5 / 60e9 + 1 / STIFF["kn"] / 4e-3)
    assert found["right_x"] - found["left_x"] == pytest.approx(strain * 4e-3, rel=1e-3)
    assert found["top_y"] - found["bottom_y"] == pytest.approx(strain * 4e-3, rel=1e-3)
    assert found["wet"] == 0
    assert found["energy_error"] < 1e-6


@pytest.mark.thorough
def test_a_test_under_a_fluid_begins_from_its_own_strain_and_breaks_at_the_effective_stress():
    """Bricks on each other pulled apart: a joint that has broken at 13 MPa is entered, intact ones are dry."""
    specimen = gl.Specimen(Bricks(rows=4).tessellate(rectangle(5e-3, 20e-3)), ROCK)
    pull = UniaxialTension(maximum_strain=1e-3, loading=gl.Constant(speed=0.01))
    result = gl.simulate(specimen, MohrCoulomb(**STRONG), Saturated(test=pull, pressure=5e6))
    found, saturates = result.summary, result.curves["saturates"] == 1
    assert saturates[0]
    assert not saturates[-1]
    assert abs(result.curves["strain"][saturates][-1]) > 1e-5  # the sides are pressed
    # the pull begins at no stress of the platens, under 5 MPa at the sides
    assert found["strength"] == pytest.approx(13e6, rel=0.01)
    compliance = (1 - 0.25**2) / 60e9 + 3 / 20e-3 / STIFF["kn"]
    assert found["failure_strain"] == pytest.approx(13e6 * compliance, rel=0.02)
    assert found["wet"] == len(result.cracks) >= 2


@attrs.frozen
class Unknown(gl.loads.Load):
    """Something that a user imposes."""


def test_what_a_test_imposes_stays_in_a_fluid():
    """Before it too: rock under a stress far away, one side quiet, with weight and fluid of its own."""
    far = gl.loads.Traction(boundary="top", stress=(0, -1e6, 0), ramp=1e-5)
    slows = gl.loads.Drive(boundary="left", axis=1, speed=0.0, start=0.1, ramp=1e-5)
    rests = Saturated(test=Loads(loads=([slows],)), pressure=5e6, boundaries=("top", "bottom")).stages(small_sample(20))
    assert rests[0].of(gl.loads.Drive) == [gl.loads.Drive(boundary="left", axis=1, speed=0.0)]
    stays = [FLOOR, gl.loads.Quiet(boundary="right"), gl.loads.Gravity(), gl.loads.Fixed(grains=[3]), Unknown()]
    test = Saturated(test=Loads(loads=([far, *stays, fluid("top", 2e6)],)), pressure=5e6)
    first, own = test.stages(small_sample(20))
    assert first.of(gl.loads.Traction) == [gl.loads.Traction(boundary="top", stress=(0, -1e6, 0), factor=0.0)]
    assert own.of(gl.loads.Traction) == [far]
    for stage in (first, own):
        assert [one.boundary for one in stage.of(gl.loads.FluidPressure)] == ["top", "left", "right"]
        assert [one for one in stage.loads if not isinstance(one, (gl.loads.Traction, gl.loads.FluidPressure))] == stays


def test_a_fluid_presses_a_side_of_which_only_the_middle_is_held():
    """On one that is held as a whole, or pressed by a membrane, it is in the cracks alone."""
    middle = gl.loads.Drive(boundary="left", axis=0, speed=0.0, roller=True)
    loads = [
        FLOOR,
        middle,
        gl.loads.Drive(boundary="right", axis=1, speed=0.0),
        gl.loads.Pressure(boundary="top", pressure=1e6),
    ]
    for stage in Saturated(test=Loads(loads=(loads,)), pressure=5e6, boundaries=SIDES).stages(small_sample(20)):
        only_in_cracks = {one.boundary: one.cracks_only for one in stage.of(gl.loads.FluidPressure)}
        assert only_in_cracks == {"left": False, "right": True, "top": True, "bottom": True}


def test_a_strength_between_sides_that_a_fluid_presses_names_its_confinement():
    specimen = small_sample(20)
    pressed, found = Saturated(pressure=5e6), {"stage": np.zeros(1), "wet": np.zeros(1), "saturates": np.ones(1)}
    assert pressed.summary(found, specimen)["confinement"] == 5e6
    assert "confinement" not in attrs.evolve(pressed, boundaries=("left",)).summary(found, specimen)


# --- as every part of a run ------------------------------------------------------------------------------------------


def test_the_ledger_closes_where_a_fluid_comes_and_goes_in_motion():
    """Three stages that end in the middle of a motion: in a fluid, without, in another; then Eq. (12) step by step."""
    specimen = small_sample(20)
    state = state_of(specimen, Friction(**STIFF, friction_angle=20), None)
    stages = [[fluid("left"), fluid("top", 2e6)], [], [fluid("right", 3e6)]]
    state.time_step = 2e-8
    gaps, works = [], []
    for k, fluids in enumerate(stages):
        state.begin(gl.Stage(name=str(k), loads=[FLOOR, *fluids], until=[gl.conditions.AtRest()], interval=1))
        for _ in range(12):
            advance(state, 50, 2e-8)
            state.let_fluids_follow()
            found = energies(state)
            spent = sum(value for kind, value in found.items() if kind != "external")
            gaps.append(abs(found["external"] - spent))
            works.append(abs(found["external"]))
    assert max(works) > 1e-3
    assert max(gaps) < 1e-6 * max(works)


@pytest.mark.alone
def test_a_wet_sample_that_falls_to_pieces_has_the_same_bits_for_any_number_of_threads():
    """Bonds that break, are entered, and become contacts of edges, which the fluid goes on to press."""
    test = Saturated(test=CRUSH, pressure=5e6, boundaries=SIDES)
    watch = Last()
    runs = [gl.simulate(small_sample(20), WEAK, test, threads=t, frames=3, observers=[watch]) for t in (1, 2, 3)]
    wet = watch.state.fluid_pressure.reshape(2, -1) > 0
    assert watch.state.replaced[wet.all(axis=0)].sum() > 5
    assert runs[0].summary["energy_error"] < 1e-6  # without a fluid 2e-7
    for other in runs[1:]:
        assert all(np.array_equal(row, other.curves[name], equal_nan=True) for name, row in runs[0].curves.items())
        pressures = [run.frames[-1].bonds["fluid_pressure"] for run in (runs[0], other)]
        assert np.array_equal(*pressures)


def test_paraview_is_told_the_pressure_on_each_wet_point(tmp_path):
    """Points of a joint have no damage, and are there because they are wet."""
    load = [FLOOR, pressed(10e6), fluid("left", 4e6, cracks_only=True)]
    gl.simulate(two_bricks(), JOINT, Loads(loads=(load,)), observers=[VtkWriter(tmp_path, count=2)])
    last = pyvista.read(sorted(tmp_path.glob("cracks_*.vtu"))[-1])
    assert last.cell_data["fluid_pressure"] == pytest.approx([4e6, 4e6])
    assert last.cell_data["normal"] == pytest.approx([-6e6, -6e6], rel=1e-3)


def test_a_configuration_has_tests_in_a_fluid():
    given = {"type": "biaxial-compression", "confinement": "10 MPa"}
    test = {"pressure": "5 MPa", "boundaries": ["left"], "test": given}
    made = configured("saturated", {"test": test}, quick=True)
    assert made.protocol == Saturated(test=BiaxialCompression(confinement=10e6), pressure=5e6, boundaries=("left",))
    assert configured("saturated", made.sections, quick=True).protocol == made.protocol
    confine, axial = made.protocol.stages(made.specimen)  # it rises with the confinement, behind the membrane
    assert [(one.pressure, one.ramp, one.cracks_only) for one in confine.of(gl.loads.FluidPressure)] == [
        (5e6, 2e-4, True)
    ]
    assert [(one.pressure, one.ramp, one.cracks_only) for one in axial.of(gl.loads.FluidPressure)] == [(5e6, 0.0, True)]


# --- bad input -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("load", "message"),
    [
        ([fluid("left"), fluid("left", 1e6)], r"'left' has two fluids"),
        ([fluid("bottom"), FLOOR], r"'bottom' has a drive, .* cracks_only=True"),
        (
            [fluid("left"), gl.loads.Pressure(boundary="left", pressure=1e6)],
            r"'left' has a pressure behind a membrane, .* cracks_only=True",
        ),
        ([fluid("hole")], r"FluidPressure: the specimen has no boundary named hole \(it has: bottom, left"),
    ],
)
def test_fluids_that_cannot_be_are_refused(load, message):
    with pytest.raises(gl.ParameterError, match=message):
        gl.simulate(two_bricks(), JOINT, Loads(loads=(load,)))


def test_bad_numbers_are_refused():
    with pytest.raises(gl.ParameterError, match=r"FluidPressure: pressure = -1"):
        gl.loads.FluidPressure(boundary="left", pressure=-1.0)
    with pytest.raises(gl.ParameterError, match=r"Saturated: boundaries = .* each can be named once"):
        Saturated(pressure=1e6, boundaries=("left", "left"))
    with pytest.raises(gl.ParameterError, match=r"Saturated: boundaries = \(\) is not allowed"):
        Saturated(pressure=1e6, boundaries=())
    with pytest.raises(gl.ParameterError, match=r"Saturated: test = .* another test"):
        Saturated(test=Saturated(pressure=1e6), pressure=1e6)
    with pytest.raises(gl.ParameterError, match=r"the fluid on left pushes the specimen along x, where"):
        gl.simulate(small_sample(4), JOINT, Saturated(pressure=1e6, boundaries="left"))
    with pytest.raises(gl.ParameterError, match=r"Saturated: the specimen has no boundary named hole"):
        gl.simulate(two_bricks(), JOINT, Saturated(pressure=1e6, boundaries="hole"))


# --- a water table ----------------------------------------------------------------------------------------------------


def under_water(specimen, table, law=GLUE):
    """A state at the first forces under water on all sides, with 1 kPa for each metre below the table."""
    state = state_of(specimen, law)
    depth = table - specimen.mesh.nodes[:, 1].min()
    sides = [gl.loads.FluidPressure(boundary=side, pressure=1e3 * depth, water_table=table) for side in SIDES]
    state.begin(gl.Stage(name="water", loads=sides, until=[gl.conditions.Reaches("time", 1.0)], interval=1.0))
    advance(state, 1)
    return state


@given(st.floats(0.041, 10.0), st.integers(1, 5))
@settings(max_examples=10, deadline=None)
def test_water_carries_what_is_displaced(table, seed):
    """Archimedes: the resultant is the weight of water in place of the specimen, and goes through its middle."""
    specimen = small_sample(grains=12, seed=seed)
    state = under_water(specimen, table)
    force, place = state.nodes.arrays.force, specimen.mesh.nodes.T
    weight = 1e3 * specimen.grains.areas.sum()
    assert force.sum(axis=1) == pytest.approx([0, weight], abs=1e-9 * 1e3 * table * 0.04)
    edge = 0.01  # the pressure of an edge acts in its middle, that of theory a little lower
    moment = float((place[0] * force[1] - place[1] * force[0]).sum())
    assert moment == pytest.approx(weight * 0.01, abs=1e3 * edge**2 * 0.04)


def test_there_is_no_water_above_its_table():
    """Half of it in water; edges are 1 mm high, and the table is at the end of one."""
    block = gl.Specimen(Bricks(rows=40, columns=4).tessellate(rectangle(20 * mm, 40 * mm)), ROCK)
    state = under_water(block, 15 * mm)
    assert state.nodes.arrays.force.sum(axis=1) == pytest.approx([0, 1e3 * 20e-3 * 15e-3], rel=1e-9, abs=1e-9)


def test_water_lifts_what_stands_on_an_open_joint():
    """It presses on both faces, by the depth of the joint: uplift under a wall is that of the full head."""
    state = under_water(two_bricks(), 10 * mm, JOINT)
    assert state.fluid_pressure == pytest.approx(1e3 * 8e-3)  # the joint is 2 mm above the bottom
    upper = state.mesh.node_grain == 1
    lift = 1e3 * 10e-3 * (8e-3 - 6e-3)  # below less above
    assert state.nodes.arrays.force[1, upper].sum() == pytest.approx(lift, rel=1e-9)


def test_a_water_table_is_above_the_bottom_and_not_beside_a_viscous_injection():
    with pytest.raises(gl.ParameterError, match=r"water_table = -0\.5 is not allowed, it must be above the lowest"):
        gl.simulate(two_bricks(), JOINT, Loads(loads=([fluid("top", water_table=-0.5)],)), progress=False)
    pumped = gl.loads.Injection(boundary="left", rate=1e-9, viscosity=1e-3, residual_aperture=1e-6)
    with pytest.raises(gl.ParameterError, match="water_table = 1 m is not allowed beside a viscous injection"):
        gl.simulate(two_bricks(), JOINT, Loads(loads=([fluid("top", water_table=1), pumped],)), progress=False)


@pytest.mark.thorough
def test_a_joint_that_water_lifts_off_is_given_up_soon():
    """Under more pressure than it is pressed with; it waited for rest for 100,000 samples."""
    lifted = Saturated(test=DirectShear(normal_stress=10e6, maximum_slip=1e-5), pressure=12e6, boundaries=["left"])
    with pytest.raises(gl.StageError, match=r"stage 'press' did not end within 200 samples; it waits for .*AtRest"):
        gl.simulate(two_bricks(), JOINT, lifted, progress=False)
