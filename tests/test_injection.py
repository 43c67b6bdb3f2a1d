"""Fluids that are pumped in: their pressure from what is there and the room it has, in closed form and in a ledger."""

import attrs
import numpy as np
import pytest
from bodies import sectors
from scipy.optimize import brentq
from support import ROCK, STIFF, STRONG

import grainlaw as gl
from grainlaw.geometry import Bricks, Voronoi, plate_with_hole, rectangle
from grainlaw.laws import Friction, Linear, MohrCoulomb
from grainlaw.loads import enclosed_area
from grainlaw.protocols import HydraulicFracturing
from grainlaw.units import mm

WATER = 2.2e9  #: Pa
FLOOR = gl.loads.Drive(boundary="bottom", axis=1, speed=0.0)
JOINT = Friction(**STIFF, friction_angle=30)
BRITTLE = MohrCoulomb(**{**STRONG, "tensile_strength": 5e6})
STIFFER = gl.Elastic(youngs_modulus=35e9, poissons_ratio=0.27, density=2500)


@attrs.frozen(kw_only=True)
class Pumped(gl.LoadingProtocol):
    """Loads for a time each; the last stage at rest if asked."""

    loads: tuple = ()
    time: float = 1e-4
    samples: int = 40
    rests: bool = False

    def stages(self, specimen):
        ends = [[gl.conditions.Reaches("since", self.time)]] * len(self.loads)
        if self.rests:
            ends[-1] = [gl.conditions.AtRest(1e-5)]
        return [
            gl.Stage(name=f"pump {k}", until=until, interval=self.time / self.samples, loads=loads)
            for k, (loads, until) in enumerate(zip(self.loads, ends, strict=True))
        ]

    def measure(self, state):
        wet = (state.fluid_pressure > 0) & (state.opening > 0)
        open_ = float((state.opening * state.contact_lengths)[wet].sum())
        return {"since": state.time - state.began, "open": open_, "wet": int(wet.sum()), **state.pumped}

    def summary(self, curves, specimen):
        return {name: float(values[-1]) for name, values in curves.items()}


def run(specimen, law, *loads, **options):
    more = {name: options.pop(name) for name in ("threads", "checkpoint", "restart", "stop") if name in options}
    return gl.simulate(specimen, law, Pumped(loads=loads, **options), progress=False, frames=2, **more)


def holed(grains=40, seed=1, rock=STIFFER):
    region = plate_with_hole(0.1, 0.1, 0.02)
    return gl.Specimen(Voronoi(grains=grains, seed=seed).tessellate(region), rock)


# --- closed forms -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bulk", [1e8, WATER])
@pytest.mark.parametrize("volume", [2e-8, 1e-6])
def test_a_joint_that_is_pumped_open_against_a_spring(bulk, volume):
    """p = S w with all in series, and (V + w L)(1 + p/K) = V + Q: the pressure by hand, to half a percent."""
    width, height, spring = 10e-3, 4e-3, 2e13
    specimen = gl.Specimen(Bricks(rows=2).tessellate(rectangle(width, height)), ROCK)
    top = gl.loads.Hold(boundary="top", axis=1, stress=0.0, stiffness=spring)
    rate = [(0.0, 0.0), (5e-5, 4e-5), (1e-4, 0.0)]
    pumped = gl.loads.Injection(boundary="left", rate=rate, volume=volume, bulk_modulus=bulk, cracks_only=True)
    result = run(specimen, JOINT, [FLOOR, top, pumped], rests=True)
    injected = 4e-5 * 1e-4 / 2
    softness = 1 / spring + height * (1 - ROCK.poissons_ratio**2) / ROCK.youngs_modulus
    p = brentq(lambda p: (volume + p * softness * width) * (1 + p / bulk) - volume - injected, 0, 1e9)
    found = result.summary
    assert found["injected"] == pytest.approx(injected, rel=1e-9)
    assert found["injection_pressure"] == pytest.approx(p, rel=0.01)
    assert found["crack_room"] == pytest.approx(p * softness * width, rel=0.01)
    assert found["energy_error"] < 1e-9


@pytest.mark.thorough
def test_a_hole_and_its_fluid_share_what_is_pumped_in():
    """The fluid is compressed by p/K, the hole grows as under the same pressure; what is there fills both exactly."""
    specimen = holed()
    edges = specimen.mesh.boundary_edges["hole"]
    first = enclosed_area(specimen.mesh.nodes, edges)
    assert first == pytest.approx(np.pi * 0.01**2, rel=1e-3)
    law = Linear(kn=1e15, ks=1e15)
    result = run(specimen, law, [FLOOR, gl.loads.Injection(boundary="hole", rate=2e-4, ramp=1e-4)], time=5e-4)
    found, last = result.summary, result.frames[-1]
    now = enclosed_area(specimen.mesh.nodes, edges, last.displacement)
    assert found["room"] == pytest.approx(now - first, rel=0.02)  # contacts between grains of the rim open a little
    assert (first + found["room"]) * (1 + found["injection_pressure"] / WATER) == pytest.approx(
        first + found["injected"], rel=1e-9
    )
    pressed = gl.loads.Pressure(boundary="hole", pressure=found["injection_pressure"])
    still = run(specimen, law, [FLOOR, pressed], rests=True)
    grown = enclosed_area(specimen.mesh.nodes, edges, still.frames[-1].displacement) - first
    assert now - first == pytest.approx(grown, rel=0.02)
    assert found["crack_room"] == 0


# --- cracks -----------------------------------------------------------------------------------------------------------


LOADS, TIME = [FLOOR, gl.loads.Injection(boundary="hole", rate=4e-3, ramp=1e-5)], 2.5e-4


@pytest.fixture(scope="module")
def split():
    return run(holed(), BRITTLE, LOADS, time=TIME, samples=100, threads=1)


def test_cracks_take_up_what_they_open_and_the_pressure_falls(split):
    curves = split.curves
    pressure, room = curves["injection_pressure"], curves["crack_room"]
    peak = int(np.argmax(pressure))
    assert 0 < peak < len(pressure) - 5
    assert pressure[-1] < 0.9 * pressure[peak]
    assert curves["wet"].max() > 10
    first = enclosed_area(split.mesh.nodes, split.mesh.boundary_edges["hole"])
    there = (first + curves["room"] + room) * (1 + pressure / WATER)
    held = pressure > 0
    assert there[held] == pytest.approx((first + curves["injected"])[held], rel=1e-9)  # nothing is lost
    assert room[held] == pytest.approx(
        curves["open"][held], rel=0.01, abs=1e-12
    )  # openings of wet points, by themselves
    assert (pressure[room > 2e-6] == 0).all()  # torn open faster than it is filled
    assert split.summary["energy_error"] < 1e-8


class Late(gl.Observer):
    """Asks to stop late in the test, once."""

    def __init__(self, stop=None):
        self.stop = stop

    def observe(self, state, curves, stage, progress):
        if self.stop is not None and progress > 0.6:
            self.stop.ask("enough")


@pytest.mark.thorough
def test_threads_and_a_restart_change_no_bit(split, tmp_path):
    test = Pumped(loads=(LOADS,), time=TIME, samples=100)
    stop = gl.Stop()
    options = {"progress": False, "frames": 2, "threads": 2, "checkpoint": tmp_path}
    with pytest.raises(gl.Stopped):
        gl.simulate(holed(), BRITTLE, test, stop=stop, observers=[Late(stop)], **options)
    again = gl.simulate(holed(), BRITTLE, test, restart=True, observers=[Late()], **options)
    for name, curve in split.curves.items():
        assert np.array_equal(curve, again.curves[name], equal_nan=True), name


def test_a_stiff_fluid_shortens_the_step():
    """Without room behind it the fluid in a joint is far stiffer than its contacts: the run stays stable."""
    specimen = gl.Specimen(Bricks(rows=2).tessellate(rectangle(10e-3, 4e-3)), ROCK)
    top = gl.loads.Hold(boundary="top", axis=1, stress=-5e6)
    tight = gl.loads.Injection(boundary="left", rate=1e-7, volume=1e-10, bulk_modulus=WATER, cracks_only=True)
    roomy = attrs.evolve(tight, volume=1e-3)
    steps = [run(specimen, JOINT, [FLOOR, top, one], time=2e-5).summary for one in (tight, roomy)]
    assert steps[0]["time_step"] < 0.3 * steps[1]["time_step"]
    assert steps[0]["energy_error"] < 1e-6


def test_what_is_pumped_out_leaves_no_tension():
    specimen = holed()
    out = gl.loads.Injection(boundary="hole", rate=-1e-3, pressure=1e5)
    found = run(specimen, Linear(**STIFF), [FLOOR, out], time=1e-4)
    assert found.curves["injection_pressure"][0] > 0
    assert found.summary["injection_pressure"] == 0
    assert found.summary["injected"] == pytest.approx(-1e-7, rel=0.05)


# --- the test ---------------------------------------------------------------------------------------------------------

BLOCK = HydraulicFracturing(xx=-6e6, yy=-4e6, rate=4e-3, largest_volume=8e-6)


def test_a_rock_under_stress_is_pumped_until_it_breaks():
    stress, pump = BLOCK.stages(holed())
    far = [gl.loads.Traction(boundary=name, stress=(-6e6, -4e6, 0.0)) for name in ("bottom", "right", "top", "left")]
    assert (stress.static, stress.until) == (True, [gl.conditions.AtRest(1e-4)])
    for stage, ramp in ((stress, 2e-3), (pump, 0.0)):
        assert sorted(stage.of(gl.loads.Traction), key=repr) == sorted(
            (attrs.evolve(f, ramp=ramp) for f in far), key=repr
        )
    assert pump.of(gl.loads.Injection) == [gl.loads.Injection(boundary="hole", rate=4e-3, ramp=1e-4)]
    thick = attrs.evolve(BLOCK, viscosity=1e-3, residual_aperture=2e-6).stages(holed())[1]
    assert thick.of(gl.loads.Injection) == [
        attrs.evolve(pump.of(gl.loads.Injection)[0], viscosity=1e-3, residual_aperture=2e-6)
    ]
    assert pump.until == [gl.conditions.FailsTo("injection_pressure", 0.5), gl.conditions.Reaches("injected", 8e-6)]
    assert (pump.interval, pump.expected) == (pytest.approx(2e-6), 1000)
    with pytest.raises(gl.ParameterError, match="HydraulicFracturing: the specimen has no boundary named pit"):
        attrs.evolve(BLOCK, opening="pit").stages(holed())


def test_pressures_are_those_of_the_pump():
    curves = {
        "stage": np.array([0, 0, 0, 1, 1, 1]), "injection_pressure": np.array([0, 0, 0, 1e6, 7e6, 2e6]),
        "damaged": np.array([0, 1, 2, 2, 9, 9]), "injected": np.array([0, 0, 0, 2, 3, 4e-6]),
    }  # fmt: skip
    found = BLOCK.summary(curves, holed())
    assert found.pop("largest_pressure") == 7e6
    assert found == {"breakdown_pressure": 7e6, "initiation_pressure": 7e6, "injected": 4e-6}
    none = BLOCK.summary(curves | {"damaged": np.full(6, 2)}, holed())
    assert np.isnan([none["initiation_pressure"], none["breakdown_pressure"]]).all()
    assert none["largest_pressure"] == 7e6


@pytest.mark.thorough
@pytest.mark.parametrize("stress", [(-6e6, -4e6), (-5e6, -5e6)])
def test_the_first_crack_is_near_that_of_an_elastic_plate(stress):
    """At 3 times the least stress less the largest, and the strength (Hubbert and Willis 1957), on the axis of it.

    Less in a plate of five diameters, 0.95 for a cylinder as wide (Lame); and the weakest of the contacts at the rim,
    each under a stress of its own between uneven grains, is damaged first.
    """
    bond = MohrCoulomb(
        kn=4e14, ks=3.6e14, tensile_strength=8e6, cohesion=40e6, friction_angle=40, residual_friction_angle=40
    )
    found = gl.simulate(
        holed(grains=300), bond, attrs.evolve(BLOCK, xx=stress[0], yy=stress[1]), progress=False, frames=2
    )
    least, most = sorted(-s for s in stress)
    expected = 0.95 * (3 * least - most + 8e6)
    assert 0.85 * expected < found.summary["initiation_pressure"] < expected
    assert found.summary["breakdown_pressure"] >= found.summary["initiation_pressure"]
    assert "without_static_solution" not in found.summary
    x, y = found.cracks.position[0]
    assert np.hypot(x, y) < 0.015
    assert stress[0] == stress[1] or abs(y) < 0.3 * abs(x)


@pytest.mark.thorough
@pytest.mark.filterwarnings("ignore::grainlaw.geometry.SliverWarning")
@pytest.mark.parametrize(("xx", "expected", "axes"), [(-6.8e6, 12.0e6, [0]), (-4.6e6, 14.2e6, [0, 1])])
def test_a_hole_in_a_solid_breaks_where_theory_says(xx, expected, axes):
    """3 times the least stress less the largest, and the strength (Hubbert and Willis 1957).

    The only joints of a solid plate of 80 radii are on both axes, so no uneven grains concentrate the stress.
    """
    plate = gl.Specimen(sectors(np.geomspace(50e-3, 4.0, 38), 48), STIFFER, tied=["between"])
    joint = MohrCoulomb(
        kn=5e14, ks=5e14, tensile_strength=5e6, cohesion=24e6, friction_angle=38, residual_friction_angle=38
    )
    test = HydraulicFracturing(xx=xx, yy=-4.6e6, rate=2e-2, largest_volume=1e-4, samples=2000)
    found = gl.simulate(plate, joint, test, detection=None, progress=False, frames=2)
    assert found.summary["initiation_pressure"] == pytest.approx(expected, rel=0.02)
    assert sorted(set(np.abs(found.cracks.position).argmax(axis=1))) == axes


# --- refusals ---------------------------------------------------------------------------------------------------------


def test_injections_that_cannot_be_are_refused():
    two = [gl.loads.Injection(boundary=name, rate=1e-3, volume=1e-3, cracks_only=True) for name in ("left", "right")]
    for loads, message in (
        (
            [FLOOR, gl.loads.Injection(boundary="left", rate=1e-3)],
            "boundary = 'left' encloses no room; give the volume",
        ),
        (
            [FLOOR, gl.loads.Injection(boundary="lid", rate=1e-3, volume=1.0)],
            "Injection: the specimen has no boundary named lid",
        ),
        ([FLOOR, *two], "has 2 injections, it can have one"),
        ([FLOOR, two[0], gl.loads.FluidPressure(boundary="left", pressure=1e6)], "has two fluids"),
        (
            [FLOOR, gl.loads.Injection(boundary="bottom", rate=1e-3, volume=1.0)],
            "has a drive, so that a fluid can only be",
        ),
    ):
        with pytest.raises(gl.ParameterError, match=message):
            run(holed(), JOINT, loads)
    rigid = attrs.evolve(holed(), material=gl.Rigid(density=2500))
    with pytest.raises(gl.ParameterError, match="is of rigid grains"):
        run(rigid, JOINT, [FLOOR, gl.loads.Injection(boundary="hole", rate=1e-3)])
    with pytest.raises(gl.ParameterError, match="Injection: volume = 0 m2 is not allowed"):
        gl.loads.Injection(boundary="hole", rate=1e-3, volume=0)
    with pytest.raises(gl.ParameterError, match="Injection: bulk_modulus = 0"):
        gl.loads.Injection(boundary="hole", rate=1e-3, bulk_modulus=0)


# --- a slit that is pumped open ---------------------------------------------------------------------------------------


def slit_in_a_plate(cells, half=10 * mm, far=150 * mm):
    """A slit of so many cells in a tied body whose cells grow away from it."""
    growing = [1.25**k for k in range(1, 30)]
    size = 2 * half / cells
    beyond = [size * grown for grown in growing if size * grown * 4 < far]
    columns, rows = ([*beyond[::-1], *[size] * count, *beyond] for count in (cells + 4, 8))
    grains = Bricks(rows=rows, columns=columns).tessellate(rectangle(sum(columns), sum(rows)))
    pairs = np.stack([grains.edges.start, grains.edges.end], axis=1)
    x, y = grains.vertices[pairs].transpose(2, 0, 1)
    on = (abs(y - sum(rows) / 2) < 1e-9) & (abs(x - sum(columns) / 2) < 1.001 * half)
    grains = attrs.evolve(grains, joints={"slit": pairs[on.all(axis=1)]})
    return gl.Specimen(grains, ROCK, tied=["between"], slits=["slit"])


@attrs.frozen(kw_only=True)
class Filled(gl.LoadingProtocol):
    """So much fluid is pumped into the slit in 0.1 ms."""

    volume: float = 1e-8

    def stages(self, specimen):
        rate = [(0, 0), (5e-5, self.volume / 5e-5), (1e-4, 0)]
        pump = gl.loads.Injection(boundary="slit", rate=rate, volume=1e-9)
        return [gl.Stage(name="pump", loads=[pump], until=[gl.conditions.AtRest(1e-3)], interval=2e-6)]

    def measure(self, state):
        return state.pumped

    def summary(self, curves, specimen):
        return {}


@pytest.mark.thorough
def test_a_pumped_slit_has_the_pressure_and_opening_of_sneddon():
    """V = 2 pi a^2 p / E' and w = 4 a p / E' (Sneddon 1946): what is pumped in decides the pressure.

    Zones of constant strain at its tips err in proportion to their size: two sizes give the limit.
    """
    plane, half, shares = ROCK.youngs_modulus / (1 - ROCK.poissons_ratio**2), 10 * mm, []
    for cells in (10, 20):
        specimen = slit_in_a_plate(cells)
        result = gl.simulate(specimen, JOINT, Filled(), detection=None, frames=2, progress=False)
        pressure, room = (float(result.curves[name][-1]) for name in ("injection_pressure", "room"))
        mesh, moved = specimen.mesh, result.frames[-1].displacement[:, 1]
        nodes = np.unique(mesh.boundary_edges["slit"])
        opening = np.ptp(moved[nodes[abs(mesh.nodes[nodes, 0] - np.ptp(mesh.nodes[:, 0]) / 2) < 1e-9]])
        shares.append([room / (2 * np.pi * half**2 * pressure / plane), opening / (4 * half * pressure / plane)])
        assert result.curves["injected"][-1] == pytest.approx(1e-8, rel=1e-9)
    one, two = np.array(shares)
    assert (1 - one) / (1 - two) == pytest.approx(2, rel=0.2)
    assert 2 * two - one == pytest.approx(1, abs=0.01)
