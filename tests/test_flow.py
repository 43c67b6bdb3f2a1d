"""A viscous fluid that is pumped in flows along cracks: closed forms of joints, its ledger, and where there is none."""

import attrs
import numpy as np
import pytest
import pyvista
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from support import ROCK, STRONG, advance, state_of
from test_injection import BRITTLE, FLOOR, JOINT, Late, Pumped, holed

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.engine.parts.flow import network
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Friction, MohrCoulomb
from grainlaw.results.figures.cracks import pressures_side_by_side
from grainlaw.results.figures.report import write_report
from grainlaw.results.vtk import VtkWriter

LENGTH, APERTURE, VISCOSITY, BULK = 20e-3, 10e-6, 2e-4, 1e8
DIFFUSIVITY = APERTURE**2 * BULK / (12 * VISCOSITY)  #: m2/s
PRESS = gl.loads.Hold(boundary="top", axis=1, stress=-30e6)
PUMP = gl.loads.Injection(
    boundary="left", rate=0.0, volume=1e-12, bulk_modulus=BULK, viscosity=VISCOSITY, residual_aperture=APERTURE,
    cracks_only=True,
)  # fmt: skip
OUTLET = gl.loads.FluidPressure(boundary="right", pressure=0.0, cracks_only=True)


def jointed(refinement=4):
    """Two bricks with a joint along x, of twice as many cells as bonds."""
    return gl.Specimen(Bricks(rows=2).tessellate(rectangle(LENGTH, 4e-3)), ROCK, refinement=refinement)


def along(specimen, result):
    """(p,) m, where the middles of cells are."""
    ends = specimen.mesh.nodes[result.interfaces][:, :2, 0]
    return np.concatenate([ends @ [0.75, 0.25], ends @ [0.25, 0.75]])


def run(specimen, *loads, law=JOINT, time=1e-4, samples=40, rests=False, **options):
    test = Pumped(loads=loads, time=time, samples=samples, rests=rests)
    return gl.simulate(specimen, law, test, progress=False, frames=2, **options)


# --- closed forms -----------------------------------------------------------------------------------------------------


@pytest.mark.thorough
def test_flow_between_parallel_plates():
    """Steady: the pressure falls by 12 mu q / w^3 along a closed joint, and what is pumped in leaves."""
    specimen, rate = jointed(), 1e-6
    pump = attrs.evolve(PUMP, rate=rate)
    result = run(specimen, [FLOOR, attrs.evolve(PRESS, ramp=2e-5)], [FLOOR, PRESS, pump, OUTLET], time=4e-4)
    x, found = along(specimen, result), result.frames[-1].bonds["fluid_pressure"]
    falls = 12 * VISCOSITY * rate / APERTURE**3
    assert found == pytest.approx(falls * (LENGTH - x), rel=1e-3)
    assert result.summary["injection_pressure"] == pytest.approx(falls * LENGTH, rel=1e-3)
    out = np.gradient(result.curves["outflow"], result.curves["time"])
    assert out[-2] == pytest.approx(rate, rel=1e-3)
    assert result.summary["energy_error"] < 1e-9


@pytest.mark.thorough
@pytest.mark.parametrize(("stress", "aperture"), [(10e6, 15e-6), (20e6, 12.5e-6), (60e6, 10e-6)])
def test_stress_closes_a_joint_to_its_residual_aperture(stress, aperture):
    """Joint of 4e12 Pa/m, 17.5 um without stress: less 2.5 um for each 10 MPa, at least 10 um."""
    specimen, rate = jointed(refinement=2), 1e-6
    soft = Friction(kn=4e12, ks=4e12, friction_angle=30)
    pump = attrs.evolve(PUMP, rate=rate, unstressed_aperture=17.5e-6)
    press = attrs.evolve(PRESS, stress=-stress)
    result = run(specimen, [FLOOR, attrs.evolve(press, ramp=2e-5)], [FLOOR, press, pump, OUTLET], law=soft, time=1.2e-3)
    falls = 12 * VISCOSITY * rate * LENGTH / aperture**3
    assert result.summary["injection_pressure"] == pytest.approx(falls, rel=2e-3)
    assert result.summary["energy_error"] < 1e-9


@pytest.mark.parametrize("time", [1e-5, 4e-5])
def test_a_pressure_spreads_along_a_joint(time):
    """By diffusion with the storage of the fluid, D = w^2 K / (12 mu), from one end to the other, which is closed."""
    specimen, pressure = jointed(), 1e6
    source = attrs.evolve(OUTLET, pressure=pressure)
    result = run(specimen, [FLOOR, attrs.evolve(PRESS, ramp=2e-5)], [FLOOR, PRESS, PUMP, source], time=time)
    x, found = along(specimen, result), result.frames[-1].bonds["fluid_pressure"]
    n = np.arange(200)
    waves = np.cos((2 * n + 1) * np.pi * x[:, None] / (2 * LENGTH)) * (-1.0) ** n / (2 * n + 1)
    passed = result.summary["since"]
    decay = np.exp(-DIFFUSIVITY * ((2 * n + 1) * np.pi / (2 * LENGTH)) ** 2 * passed)
    expected = pressure * (1 - 4 / np.pi * waves @ decay)
    assert found == pytest.approx(expected, abs=0.02 * pressure)
    assert result.summary["outflow"] == pytest.approx(-APERTURE * LENGTH * expected.mean() / BULK, rel=0.02)


@pytest.mark.parametrize("bulk", [1e8, 2.2e9])
def test_a_joint_that_is_pumped_open_has_one_pressure_at_rest(bulk):
    """(V + w L + p S L)(1 + p/K) = V + w L + Q, where what opens is p over the stiffness of spring and bricks."""
    spring, rate, volume, residual = 2e13, [(0.0, 0.0), (5e-5, 4e-5), (1e-4, 0.0)], 1e-6, 5e-6
    top = gl.loads.Hold(boundary="top", axis=1, stress=0.0, stiffness=spring)
    pump = attrs.evolve(PUMP, rate=rate, volume=volume, bulk_modulus=bulk, viscosity=1e-5, residual_aperture=residual)
    specimen = jointed(2)
    result = run(specimen, [FLOOR, top, pump], time=1e-4, rests=True)
    injected, room = 4e-5 * 1e-4 / 2, volume + residual * LENGTH
    softness = LENGTH * (1 / spring + 4e-3 * (1 - ROCK.poissons_ratio**2) / ROCK.youngs_modulus)
    p = brentq(lambda p: (room + p * softness) * (1 + p / bulk) - room - injected, 0, 1e9)
    found = result.summary
    assert found["injected"] == pytest.approx(injected, rel=1e-9)
    assert result.frames[-1].bonds["fluid_pressure"] == pytest.approx(p, rel=0.01)
    assert found["crack_room"] - residual * LENGTH == pytest.approx(p * softness, rel=0.01)
    assert found["energy_error"] < 1e-9


# --- what is where ----------------------------------------------------------------------------------------------------

VISCOUS = gl.loads.Injection(boundary="hole", rate=4e-3, ramp=1e-5, viscosity=1e-5, residual_aperture=2e-6)
PUMPED, TIME = attrs.evolve(VISCOUS, viscosity=0.0, residual_aperture=0.0), 2.5e-4


def torn(seed, share=0.6):
    """A plate with a hole of which some points are broken, those near the hole with fluid in them, and the stage."""
    specimen, random = holed(60), np.random.default_rng(seed)
    state = state_of(specimen, MohrCoulomb(**STRONG))
    (group,) = state.bonds.groups
    state.bonds.arrays.memory[group.row("damage")] = random.random(2 * len(state.bonds)) < share
    drained = gl.loads.FluidPressure(boundary="right", pressure=2e5)
    stage = gl.Stage(
        name="wet",
        loads=[FLOOR, attrs.evolve(VISCOUS, rate=0.0, ramp=0.0), drained],
        until=[gl.conditions.AtRest()],
        interval=1e-6,
    )
    state.begin(stage)
    return state, random


@pytest.mark.thorough
@settings(max_examples=10, deadline=None)
@given(st.integers(1, 1000), st.sampled_from([1e-9, 1e-7, 1e-5]))
def test_pressures_are_those_of_the_cubic_law_between_full_cells(seed, time_step):
    """By the places of nodes: what flows in a step is by the cubic law, and there is pressure where cells are full."""
    state, random = torn(seed)
    a, count, mesh, ends = state.fluids.arrays, len(state.bonds), state.mesh, state.bonds.ends
    points = np.flatnonzero(state.fluids.books.fluid == 1)
    volume = state.fluids.volumes
    a.content[1 + points] *= random.uniform(0.9, 1.01, len(points))
    a.content[0] *= random.choice([0.999, 1.0005, 1.01])
    a.pressure[random.random(len(a.pressure)) < 0.3] = 0.0  # from which the search for full cells begins
    before = a.content.copy()
    advance(state, time_step=time_step)
    pressure, content, bulk = a.pressure, a.content, a.bulk[0]
    assert (pressure >= 0).all()
    full = volume * (1 + pressure / bulk)
    has = pressure[1 + points] > 0
    assert content[1 + points][has] == pytest.approx(full[1 + points][has], rel=1e-9)
    assert (content[1 + points][~has] <= volume[1 + points][~has]).all()
    assert pressure[0] == pytest.approx(max(bulk * (content[0] / volume[0] - 1), 0), rel=1e-6, abs=1)
    # Flow out of a cell to its corner and to the middle of its bond; ends, and what is at them, by their places.
    at = np.round(mesh.nodes / 1e-9).astype(int)
    place = {tuple(at[i]): [] for i in ends.ravel()}
    h = state.contact_lengths
    ease = VISCOUS.residual_aperture**3 / (12 * VISCOUS.viscosity) / (h / 2)
    for p in points:
        place[tuple(at[ends[p % count, p // count]])].append(p)
    hole, right = ({tuple(at[i]) for i in mesh.boundaries[name]} for name in ("hole", "right"))
    out = np.zeros(2 * count)
    for corner, some in place.items():
        if some:
            levels, eases = pressure[1 + np.array(some)], ease[some]
            common = pressure[0] if corner in hole else 2e5 if corner in right else eases @ levels / eases.sum()
            out[some] += eases * (levels - common)
    for c in range(count):
        if {c, c + count} <= set(points):
            other = (pressure[1 + c] - pressure[1 + c + count]) / (1 / ease[c] + 1 / ease[c + count])
            out[c] += other
            out[c + count] -= other
    change = (content - before)[1:][points]
    assert change == pytest.approx(-time_step * out[points], rel=1e-6, abs=1e-9 * np.abs(change).max())
    assert content.sum() - before.sum() == pytest.approx(0, abs=1e-14 * before.sum())


class Books(gl.Observer):
    """What is not right in the ledger of the volume, over what there is, and how many cells are not full, by sample."""

    def __init__(self):
        self.wrong, self.empty = [], []

    def observe(self, state, curves, stage, progress):
        a, volumes = state.fluids.arrays, state.fluids.volumes
        filled = np.where(a.pressure > 0, volumes * (1 + a.pressure / a.bulk[0]), a.content)
        self.wrong.append(abs(filled.sum() - a.content.sum()) / volumes.sum())
        cells = a.network.vertex[a.network.cell]
        self.empty.append(int((a.content[cells] < volumes[cells]).sum()))


def test_a_restored_state_has_the_network_of_then():
    """As where a sample in which something breaks is done again."""
    state, _ = torn(1)
    saved, cells = state.save(), set(state.fluids.arrays.network.vertex.tolist())
    (group,) = state.bonds.groups
    state.bonds.arrays.memory[group.row("damage")] = 1.0
    state.let_fluids_follow()
    assert cells < set(state.fluids.arrays.network.vertex.tolist())
    state.restore(saved)
    assert cells == set(state.fluids.arrays.network.vertex.tolist())


@pytest.mark.parametrize(("entry", "entered"), [(1.0, 0.0), (0.3, 0.5)])
def test_a_fluid_enters_points_of_enough_damage(entry, entered):
    """Of half of the points damage is 0.5, of the others none: those near the hole are entered from 0.3 on."""
    state = state_of(holed(60), MohrCoulomb(**STRONG))
    (group,) = state.bonds.groups
    state.bonds.arrays.memory[group.row("damage"), ::2] = 0.5
    pump = attrs.evolve(VISCOUS, entry_damage=entry)
    state.begin(gl.Stage(name="wet", loads=[FLOOR, pump], until=[gl.conditions.AtRest()], interval=1e-6))
    damage = state.memory("damage")[state.fluids.books.fluid == 1]
    assert (len(damage) > 0) == (entered > 0)
    assert (damage == entered).all()


@pytest.fixture(scope="module")
def split():
    books = Books()
    loads = [FLOOR, VISCOUS]
    return run(holed(), loads, law=BRITTLE, time=TIME, samples=100, threads=1, observers=[books]), books


def test_cracks_fill_and_nothing_is_lost(split):
    one_pressure = run(holed(), [FLOOR, PUMPED], law=BRITTLE, time=TIME, samples=100)
    result, books = split
    curves = result.curves
    assert max(books.wrong) < 1e-12
    pumped, since = (curves[name][10:] - curves[name][10] for name in ("injected", "time"))
    assert pumped == pytest.approx(4e-3 * since, rel=1e-9)
    assert (curves["injected"] >= curves["crack_fluid"]).all()
    assert 0 < curves["crack_fluid"][-1] < 0.5 * curves["crack_room"][-1]  # torn open faster than it is filled
    assert curves["injection_pressure"].max() > 1.02 * one_pressure.curves["injection_pressure"].max()
    assert max(books.empty) > 5
    assert result.summary["energy_error"] < 1e-8


def test_threads_and_a_restart_change_no_bit(split, tmp_path):
    test = Pumped(loads=([FLOOR, VISCOUS],), time=TIME, samples=100)
    stop = gl.Stop()
    options = {"progress": False, "frames": 2, "threads": 2, "checkpoint": tmp_path}
    with pytest.raises(gl.Stopped):
        gl.simulate(holed(), BRITTLE, test, stop=stop, observers=[Late(stop)], **options)
    again = gl.simulate(holed(), BRITTLE, test, restart=True, observers=[Late()], **options)
    for name, curve in split[0].curves.items():
        assert np.array_equal(curve, again.curves[name], equal_nan=True), name


def test_a_thin_crack_full_of_fluid_shortens_the_step():
    """With 0.2 um of water it is a hundred times as stiff as its contacts: pumped open, the run stays stable."""
    runs = []
    for aperture in (0.2e-6, 200e-6):
        thin = attrs.evolve(
            PUMP, rate=2e-4, volume=1e-6, bulk_modulus=2.2e9, viscosity=1e-7, residual_aperture=aperture
        )
        runs.append(run(jointed(2), [FLOOR, attrs.evolve(PRESS, stress=-1e6), thin], time=4e-5).summary)
    assert runs[0]["time_step"] < 0.5 * runs[1]["time_step"]
    assert runs[0]["crack_room"] > 2 * 0.2e-6 * LENGTH
    assert runs[0]["energy_error"] < 1e-6


@pytest.mark.thorough
def test_the_next_stage_goes_on_with_the_same_fluid():
    """Shut in, a joint that leaks keeps what it has: nothing is added, and the pressure falls as the cracks fill."""
    pump, shut = attrs.evolve(PUMP, rate=1e-5, volume=1e-8), attrs.evolve(PUMP, rate=0.0, volume=1e-8)
    press = attrs.evolve(PRESS, ramp=2e-5)
    result = run(jointed(), [FLOOR, press], [FLOOR, PRESS, pump], [FLOOR, PRESS, shut], time=1e-4)
    pumped, closed = (result.curves["stage"] == k for k in (1, 2))
    assert result.curves["injected"][pumped][-1] == pytest.approx(1e-5 * 1e-4, rel=1e-3)
    assert np.ptp(result.curves["injected"][closed]) == pytest.approx(0, abs=1e-18)
    even = BULK * 1e-9 / (1e-8 + APERTURE * LENGTH)
    assert result.curves["injection_pressure"][pumped][-1] > 1.05 * even
    assert result.frames[-1].bonds["fluid_pressure"] == pytest.approx(even, rel=0.02)


# --- what is shown of it ----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def drained(tmp_path_factory):
    """A joint with a steady flow, from 48 kPa at the left to 0 at the right, and its folder of files for ParaView."""
    folder = tmp_path_factory.mktemp("drained")
    loads = [FLOOR, attrs.evolve(PRESS, ramp=2e-5)], [FLOOR, PRESS, attrs.evolve(PUMP, rate=1e-6), OUTLET]
    return run(jointed(2), *loads, time=2e-4, observers=[VtkWriter(folder, count=2)]), folder


def test_paraview_is_told_the_pressure_of_each_point(drained):
    result, folder = drained
    last = pyvista.read(sorted(folder.glob("cracks_*.vtu"))[-1])
    x = last.cell_centers().points[:, 0]
    assert last.cell_data["fluid_pressure"] == pytest.approx(48e3 * (1 - x / LENGTH), rel=0.01)
    assert len(x) == 2 * len(result.interfaces)


@pytest.mark.thorough
def test_a_report_has_a_picture_of_the_pressures(drained, tmp_path):
    result, _ = drained
    figure = pressures_side_by_side({"joint": result, "again": result})
    for axes in figure.axes[:2]:
        drawn = axes.collections[-1]
        assert np.asarray(drawn.get_array()) == pytest.approx(result.frames[-1].bonds["fluid_pressure"] / 1e6)
        assert drawn.get_clim() == (0, pytest.approx(result.frames[-1].bonds["fluid_pressure"].max() / 1e6))
    assert figure.axes[-1].get_ylabel() == "pressure of the fluid (MPa)"
    write_report({"joint": result}, tmp_path / "wet.html")
    assert "Pressure of the fluid along the cracks" in (tmp_path / "wet.html").read_text("utf-8")
    dry = run(jointed(2), [FLOOR, attrs.evolve(PRESS, ramp=2e-5)], time=2e-5)
    assert pressures_side_by_side({"joint": dry}) is None


def test_a_file_gives_the_test_its_viscosity():
    given = {"test": {"viscosity": "1 mPa s", "residual_aperture": "2 um"}}
    test = configured("hydraulic-fracturing", given, quick=True).protocol
    assert (test.viscosity, test.residual_aperture) == (1e-3, 2e-6)
    with pytest.raises(gl.ParameterError, match=r"residual_aperture = 0 m is not allowed with viscosity = 0\.001"):
        configured("hydraulic-fracturing", {"test": {"viscosity": "1 mPa s"}}, quick=True)


# --- the network ------------------------------------------------------------------------------------------------------


def test_a_crack_in_a_row_has_a_matrix_without_fill():
    """Vertices 0 to 20 in a row, cells at the odd ones: each row of the factor but the last has two numbers."""
    cells = np.arange(1, 20, 2)
    row = network(
        np.zeros(0, dtype=int), np.zeros(0, dtype=int), cells, np.stack([cells - 1, cells + 1]), cells * 1.0, {}
    )
    assert len(row.column) == 21 + 20
    assert sorted(row.vertex) == list(range(21))
    for m, cell in enumerate(cells):
        assert row.vertex[row.cell[m]] == cell
        for e in range(2):
            pair = sorted((row.cell[m], row.end[e, m]))
            place = row.link[e, m]
            assert row.start[pair[1]] <= place < row.start[pair[1] + 1]
            assert row.column[place] == pair[0]


# --- refusals ---------------------------------------------------------------------------------------------------------


def test_viscous_fluids_that_cannot_be_are_refused():
    for options, message in (
        (
            {"viscosity": -1.0},
            "Injection: viscosity = -1 Pa s is not allowed, it must be a finite number and at least 0",
        ),
        (
            {"residual_aperture": -1e-6},
            "Injection: residual_aperture = -1e-06 m is not allowed, it must be a finite number and at least 0",
        ),
        ({"viscosity": 1e-3}, "residual_aperture = 0 m is not allowed with viscosity = 0.001 Pa s, it must be above 0"),
        ({"entry_damage": 0.0}, "Injection: entry_damage = 0 is not allowed, it must be a finite number and above 0"),
        ({"unstressed_aperture": 1e-6}, "unstressed_aperture is not allowed without a viscosity"),
        (
            {"viscosity": 1e-3, "residual_aperture": 2e-6, "unstressed_aperture": 1e-6},
            "unstressed_aperture = 1e-06 is not allowed, it must be at least the residual_aperture, 2e-06 m",
        ),
        ({"residual_aperture": 1e-6}, "residual_aperture = 1e-06 m is not allowed without a viscosity, it must be 0"),
    ):
        with pytest.raises(gl.ParameterError, match=message):
            gl.loads.Injection(boundary="hole", rate=1e-3, **options)
