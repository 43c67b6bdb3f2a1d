"""Heat that is conducted against closed forms: slab, disc, contacts in series, thermal stress; its balance and bits."""

import re

import attrs
import numpy as np
import pytest
import pyvista
from bodies import sectors
from device_simulator import Simulated
from scipy import special
from scipy.optimize import brentq
from support import small_sample, state_of
from test_injection import Late

import grainlaw as gl
from grainlaw.geometry import Bricks, Voronoi, disc, rectangle
from grainlaw.laws import Friction, Linear, MohrCoulomb
from grainlaw.materials import QUARTZ, Thermal
from grainlaw.protocols import Heating
from grainlaw.results.figures.cracks import temperatures_side_by_side
from grainlaw.results.figures.report import write_report
from grainlaw.results.result import energy_error
from grainlaw.results.vtk import VtkWriter

E, NU, ALPHA, K, C, RHO = 60e9, 0.25, 8e-6, 3.0, 800.0, 2650.0
DIFFUSIVITY = K / C / RHO  #: m2/s
ELASTIC = gl.Elastic(youngs_modulus=E, poissons_ratio=NU, density=RHO)
ROCK = Thermal(material=ELASTIC, expansion=ALPHA, conductivity=K, heat_capacity=C)
HARD = Linear(kn=1e16, ks=1e16)  # between grains of mm: of no account
LENGTH, RADIUS, HOT = 20e-3, 10e-3, 120.0
SUDDEN = gl.loads.FixedTemperature(boundary="left", temperature=HOT)


def slab(columns=4, refinement=2, rock=ROCK):
    return gl.Specimen(Bricks(rows=1, columns=columns).tessellate(rectangle(LENGTH, 4e-3)), rock, refinement=refinement)


def round_plate(grains=40, refinement=1):
    return gl.Specimen(
        Voronoi(grains=grains, seed=1).tessellate(disc(2 * RADIUS, flat=False, sides=96)), ROCK, refinement=refinement
    )


def rim(temperature):
    return [gl.loads.FixedTemperature(boundary=name, temperature=temperature) for name in ("rim", "top", "bottom")]


def begun(specimen, *loads, law=HARD, **options):
    """A state whose heat flows in steps of a second of the motion."""
    state = state_of(specimen, law)
    flow = gl.loads.Conduction(duration=1e9, **options)
    state.begin(gl.Stage(name="heat", loads=[flow, *loads], interval=1.0))
    return state


def flow(state, steps, opening=0.0):
    """Heat alone: whole steps of it, without motion."""
    for _ in range(steps):
        state.conduction.follow(np.full(2 * len(state.bonds), opening), 1.0)
        state.conduction.count(state.conduction.left)
    return state.conduction.temperature


def conducted(specimen, *loads, time, steps, law=HARD, opening=0.0, **options):
    """(i,) °C of nodes after a time (s) in so many steps, and the state."""
    state = begun(specimen, *loads, law=law, speedup=time / steps, step=time / steps, **options)
    return flow(state, steps, opening), state


@attrs.frozen(kw_only=True)
class Conducted(gl.LoadingProtocol):
    """Stages of conduction, each in so much time of the motion."""

    loads: tuple = ()
    time: float = 2e-4
    samples: int = 20

    def stages(self, specimen):
        found = []
        for k, loads in enumerate(self.loads):
            (heat,) = (load for load in loads if isinstance(load, gl.loads.Conduction))
            heat = attrs.evolve(heat, speedup=heat.duration / self.time)
            others = [load for load in loads if not isinstance(load, gl.loads.Conduction)]
            found.append(gl.Stage(name=f"heat {k}", loads=[heat, *others], interval=self.time / self.samples))
        return found

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {name: float(values[-1]) for name, values in curves.items()}


class Last(gl.Observer):
    """Stresses and temperatures of zones in the last sample."""

    def observe(self, state, curves, stage, progress):
        self.stress, self.temperature = state.zone_state()[0].copy(), state.zone_temperature.copy()


def run(specimen, *loads, law=HARD, **options):
    more = {name: options.pop(name) for name in tuple(options) if name in ("time", "samples")}
    return gl.simulate(specimen, law, Conducted(loads=loads, **more), progress=False, **{"frames": 2, **options})


def middles(specimen):
    return specimen.mesh.nodes[specimen.mesh.zones].mean(axis=1)


# --- closed forms of the temperature ----------------------------------------------------------------------------------


def of_slab(x, time):
    """Carslaw and Jaeger (1959) 3.3: one face of a slab at 20 °C comes to HOT at once, the other is insulated."""
    n = np.arange(200)
    wave = (2 * n + 1) * np.pi / 2 / LENGTH
    sines = np.sin(wave * x[:, None]) / (2 * n + 1)
    return HOT - (HOT - 20) * 4 / np.pi * sines @ np.exp(-DIFFUSIVITY * wave**2 * time)


@pytest.mark.parametrize("share", [0.05, 0.2])
def test_a_slab_warms_from_a_face(share):
    """Sixteen zones across, 40 steps: within 1 % of the change."""
    time, specimen = share * LENGTH**2 / DIFFUSIVITY, slab()
    found, state = conducted(specimen, SUDDEN, time=time, steps=40)
    expected = of_slab(specimen.mesh.nodes[:, 0], time)
    assert found == pytest.approx(expected, abs=0.01 * (HOT - 20))
    heat = RHO * C * 4e-3 * LENGTH * (of_slab((np.arange(1000) + 0.5) * LENGTH / 1000, time).mean() - 20)
    assert state.conduction.columns["heat_supplied"] == pytest.approx(heat, rel=0.01)


@pytest.mark.parametrize("biot", [0.2, 1.0, 10.0])
def test_a_slab_is_cooled_by_what_flows_past_it(biot):
    """Carslaw and Jaeger (1959) 3.11: insulated at one face, Newton's law at the other, roots of b tan b = Biot."""
    time, specimen = 0.3 * LENGTH**2 / DIFFUSIVITY, slab()
    past = gl.loads.Convection(boundary="right", coefficient=biot * K / LENGTH, temperature=HOT)
    found, _ = conducted(specimen, past, time=time, steps=40)
    b = np.array(
        [brentq(lambda b: b * np.tan(b) - biot, n * np.pi + 1e-9, (n + 0.5) * np.pi - 1e-9) for n in range(30)]
    )
    size = 4 * np.sin(b) / (2 * b + np.sin(2 * b)) * np.exp(-(b**2) * 0.3)
    expected = HOT - (HOT - 20) * np.cos(b * specimen.mesh.nodes[:, :1] / LENGTH) @ size
    assert found == pytest.approx(expected, abs=0.01 * (HOT - 20))


def of_disc(r, time):
    """Carslaw and Jaeger (1959) 7.6: the rim of a disc at 20 °C comes to HOT at once."""
    roots = special.jn_zeros(0, 60)
    size = 2 / (roots * special.j1(roots)) * np.exp(-(roots**2) * DIFFUSIVITY * time / RADIUS**2)
    return HOT - (HOT - 20) * special.j0(np.multiply.outer(np.asarray(r) / RADIUS, roots)) @ size


@pytest.mark.thorough
@pytest.mark.parametrize("share", [0.05, 0.2])
def test_a_disc_warms_from_its_rim(share):
    """Of 40 grains, refined twice, 40 steps: within 1.5 % of the change."""
    time, specimen = share * RADIUS**2 / DIFFUSIVITY, round_plate(refinement=2)
    found, _ = conducted(specimen, *rim(HOT), time=time, steps=40)
    assert found == pytest.approx(of_disc(np.hypot(*specimen.mesh.nodes.T), time), abs=0.015 * (HOT - 20))


def test_a_hot_block_is_cooled_from_all_sides():
    """The product of the fields of two slabs, each with both faces at another temperature at once (5.6)."""
    grains = Voronoi(grains=12, seed=1).tessellate(rectangle(LENGTH, LENGTH))
    specimen, time = gl.Specimen(grains, ROCK, refinement=2), 0.03 * LENGTH**2 / DIFFUSIVITY
    sides = [gl.loads.FixedTemperature(boundary=side, temperature=HOT) for side in ("left", "right", "top", "bottom")]
    found, _ = conducted(specimen, *sides, time=time, steps=40)
    n = 2 * np.arange(60) + 1
    decay = 4 / np.pi / n * np.exp(-DIFFUSIVITY * (n * np.pi / LENGTH) ** 2 * time)
    fields = np.sin(np.pi * np.multiply.outer(specimen.mesh.nodes / LENGTH, n)) @ decay
    assert found == pytest.approx(HOT - (HOT - 20) * fields.prod(axis=1), abs=0.015 * (HOT - 20))


def test_the_order_in_space_is_two():
    """A field sin(pi x/L) sin(pi y/L) fades by exp(-2 D (pi/L)^2 t), in steps of length d by 1/(1 + 2 D (pi/L)^2 d)."""
    errors, count = [], 5
    for refinement in range(1, 5):
        grains = Voronoi(grains=12, seed=1).tessellate(rectangle(LENGTH, LENGTH))
        specimen = gl.Specimen(grains, ROCK, refinement=refinement)
        rate = 2 * DIFFUSIVITY * (np.pi / LENGTH) ** 2
        step = 0.5 / rate / count
        cold = [
            gl.loads.FixedTemperature(boundary=side, temperature=20.0) for side in ("left", "right", "top", "bottom")
        ]
        state = begun(specimen, *cold, speedup=step, step=step)
        field = np.prod(np.sin(np.pi * specimen.mesh.nodes / LENGTH), axis=1)
        state.conduction.books.ends[:] = 20 + field
        found, expected = flow(state, count) - 20, field / (1 + rate * step) ** count
        weight = state.conduction.capacity
        errors.append(np.sqrt(np.sum(weight * (found - expected) ** 2) / np.sum(weight * expected**2)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert errors[-1] < 1e-3
    assert orders[1:] == pytest.approx(2, abs=0.15)


def test_the_order_in_time_is_one():
    """A block that conducts so well that it has one temperature fades by exp(-h P t / C), Newton's law of cooling."""
    even = attrs.evolve(ROCK, conductivity=1e9)
    past = gl.loads.Convection(boundary="right", coefficient=50.0, temperature=HOT)
    rate = 50.0 / (RHO * C * LENGTH)
    errors = []
    for steps in (10, 20, 40):
        found, _ = conducted(slab(rock=even), past, time=1 / rate, steps=steps)
        errors.append(abs(found.mean() - (HOT - (HOT - 20) * np.exp(-1))))
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(1, abs=0.05)
    assert errors[-1] < 0.01 * (HOT - 20)


@pytest.mark.parametrize(
    ("law", "opening", "conductance"),
    [
        (HARD, 0.0, 500.0),  # bonded
        (Friction(kn=1e16, ks=1e16, friction_angle=30), -1e-6, 0.03 / 2e-6),  # broken and closed
        (Friction(kn=1e16, ks=1e16, friction_angle=30), 1e-6, 0.03 / 2e-6),  # less open than the smallest aperture
        (Friction(kn=1e16, ks=1e16, friction_angle=30), 50e-6, 0.03 / 50e-6),  # open
        (Friction(kn=1e16, ks=1e16, friction_angle=30, gap=50e-6), -20e-6, 0.03 / 30e-6),  # from the start
    ],
)
def test_a_contact_is_a_resistance_in_series(law, opening, conductance):
    """Steady between two faces, two bricks and a contact: q = dT / (L/k + 1/h), and T straight in each brick."""
    specimen = slab(columns=2, refinement=1)
    cold = gl.loads.FixedTemperature(boundary="right", temperature=20.0)
    found, state = conducted(
        specimen, SUDDEN, cold, time=2e5, steps=40, law=law, opening=opening, bonded=500.0, filling=0.03,
        smallest_aperture=2e-6,
    )  # fmt: skip
    flux = (HOT - 20) / (LENGTH / K + 1 / conductance)
    x, first = specimen.mesh.nodes[:, 0], specimen.mesh.node_grain == np.argmin(specimen.grains.centroids[:, 0])
    assert found == pytest.approx(np.where(first, HOT - flux / K * x, 20 + flux / K * (LENGTH - x)), rel=1e-6)
    before = state.conduction.columns["heat_supplied"]
    flow(state, 1, opening)
    assert state.conduction.columns["heat_supplied"] == pytest.approx(before, rel=1e-9)


def test_a_fixed_temperature_is_that_of_the_end_of_a_step():
    """It rises by x^3 (10 - 15 x + 6 x^2) over its ramp, or along its points; another that meets it counts."""
    specimen = slab()
    left, right = (specimen.mesh.boundaries[name] for name in ("left", "right"))
    rising = attrs.evolve(SUDDEN, start=40.0, ramp=20.0)
    series = gl.loads.FixedTemperature(boundary="right", temperature=[(0, 20), (10, 60), (20, 20)])
    found, _ = conducted(specimen, rising, series, time=5.0, steps=5)
    share = 0.25**3 * (10 - 15 * 0.25 + 6 * 0.25**2)
    assert found[left] == pytest.approx(40 + 80 * share)
    assert found[right] == pytest.approx(40)
    bottom = attrs.evolve(SUDDEN, boundary="bottom", temperature=80.0)
    found, _ = conducted(specimen, SUDDEN, bottom, time=5.0, steps=1)
    assert found[np.intersect1d(left, specimen.mesh.boundaries["bottom"])] == pytest.approx(80)


def test_factors_are_kept_while_contacts_hardly_change():
    state = begun(slab(columns=2), SUDDEN, law=Friction(kn=1e16, ks=1e16, friction_angle=30), speedup=1.0, step=1.0)
    made = []
    for opening in (50e-6, 51e-6, 54e-6, 54e-6):
        flow(state, 1, opening)
        made.append(state.conduction._factors)
    assert (made[0] is made[1], made[1] is made[2], made[2] is made[3]) == (True, False, True)
    assert state.conduction.books.conductance == pytest.approx(0.026 / 54e-6)


def test_a_flux_that_rises_brings_as_much_heat_in_long_steps():
    """Half of the whole time, for the ramp is as much below its mean at first as above it then."""
    for steps in (2, 10):
        rising = gl.loads.HeatFlux(boundary="left", flux=1e4, ramp=50.0)
        specimen = slab()
        _, state = conducted(specimen, rising, time=50.0, steps=steps)
        height = float(np.ptp(specimen.mesh.nodes[:, 1]))
        assert state.conduction.columns["heat_supplied"] == pytest.approx(1e4 * 25.0 * height, rel=1e-9)


# --- its balance ------------------------------------------------------------------------------------------------------


def test_heat_is_balanced_with_every_load():
    """What comes in by each load is known; all of it is stored, but for rounding."""
    specimen, time = small_sample(12, material=ROCK), 60.0
    flux = gl.loads.HeatFlux(boundary="left", flux=[(0, 0), (30, 1e4), (60, 0)])
    source = gl.loads.HeatSource(power=1e6, grains=[2, 5], ramp=30.0)
    for loads, expected in [
        ([flux], 1e4 * 30 * 40e-3),
        ([source], 1e6 * specimen.grains.areas[[2, 5]].sum() * 45),  # half of it while it rises
        ([gl.loads.HeatSource(power=1e6)], 1e6 * specimen.grains.areas.sum() * 60),
    ]:
        _, state = conducted(specimen, *loads, time=time, steps=60)
        assert state.conduction.columns["heat_supplied"] == pytest.approx(expected, rel=1e-9)
    past = gl.loads.Convection(boundary="top", coefficient=200.0, temperature=80.0)
    found, state = conducted(
        specimen, flux, source, past, attrs.evolve(SUDDEN, boundary="bottom", ramp=20.0), time=time, steps=60
    )
    columns = state.conduction.columns
    assert columns["heat_supplied"] == pytest.approx(columns["heat_stored"], rel=1e-12)
    assert columns["heat_stored"] == pytest.approx(np.sum(state.conduction.capacity * (found - 20)), rel=1e-12)
    assert np.sum(state.conduction.capacity) == pytest.approx(RHO * C * specimen.grains.areas.sum())


def test_no_node_is_hotter_or_colder_than_what_heats_it():
    """No angle of a zone is obtuse, and capacity is lumped: the maximum principle, also in a step far too short."""
    found, _ = conducted(slab(columns=5), SUDDEN, time=1e-3, steps=1)
    assert 20 - 1e-9 <= found.min() <= found.max() <= HOT + 1e-9


def test_the_step_is_that_of_a_zone_unless_it_is_given():
    state = begun(slab(), SUDDEN, speedup=1e-3)
    flow(state, 1)
    step = np.median(state.mesh.zone_areas) / DIFFUSIVITY
    assert state.conduction.columns["heat_time"] == pytest.approx(step, abs=0.6e-3)
    fast = begun(slab(), SUDDEN, speedup=10 * step)  # one step of the motion is ten of heat
    assert flow(fast, 1) == pytest.approx(conducted(slab(), SUDDEN, time=10 * step, steps=10)[0], rel=1e-9)


# --- thermal stress ---------------------------------------------------------------------------------------------------


@pytest.mark.thorough
def test_a_slab_that_is_held_along_its_faces_is_pressed_by_its_heat():
    """Plane strain and held along y: sigma_yy = -E alpha (T - 20) / (1 - nu), free across (Boley and Weiner 1960)."""
    specimen, time, last = slab(refinement=3), 0.1 * LENGTH**2 / DIFFUSIVITY, Last()
    held = [gl.loads.Drive(boundary=end, axis=1, speed=0.0) for end in ("bottom", "top")]
    left = gl.loads.Drive(boundary="left", axis=0, speed=0.0)
    result = run(specimen, [gl.loads.Conduction(duration=time), SUDDEN, left, *held], observers=[last])
    passed = result.summary["heat_time"]
    expected = -E * ALPHA * (of_slab(middles(specimen)[:, 0], passed) - 20) / (1 - NU)
    assert last.stress[:, 1] == pytest.approx(expected, abs=0.02 * np.abs(expected).max())
    assert last.stress[:, 0] == pytest.approx(0, abs=0.02 * np.abs(expected).max())
    assert result.summary["energy_error"] < 1e-9
    assert result.summary["heat_supplied"] == pytest.approx(result.summary["heat_stored"], rel=1e-9)
    assert result.curves["heat_time"] == pytest.approx(result.curves["time"] * time / 2e-4, rel=1e-9)
    assert last.temperature == pytest.approx(of_slab(middles(specimen)[:, 0], passed), abs=0.01 * (HOT - 20))
    assert result.frames[-1].zones["temperature"].tolist() == last.temperature.tolist()


def of_stress(r, time):
    """Timoshenko and Goodier (1970) Art. 150, in plane strain: radial and circumferential stress (Pa) of a disc."""
    at = (np.arange(2000) + 0.5) / 2000 * RADIUS
    inner = np.append(0.0, np.cumsum((of_disc(at, time) - 20) * at) * RADIUS / 2000)
    within = np.interp(r, np.arange(2001) / 2000 * RADIUS, inner)
    mean, factor = inner[-1] / RADIUS**2, E * ALPHA / (1 - NU)
    return factor * (mean - within / r**2), factor * (mean + within / r**2 - (of_disc(r, time) - 20))


def errors_of_disc(refinement):
    """Of radial and circumferential stress, root of the mean square over the area, over the largest stress."""
    specimen, last = round_plate(refinement=refinement), Last()
    result = run(specimen, [gl.loads.Conduction(duration=0.05 * RADIUS**2 / DIFFUSIVITY), *rim(HOT)], observers=[last])
    place = middles(specimen)
    r = np.hypot(*place.T)
    radial, around = of_stress(r, result.summary["heat_time"])
    found = in_polar_axes(place, last.stress)
    assert result.summary["energy_error"] < 1e-9
    return [
        np.sqrt(np.average((one - other) ** 2, weights=specimen.mesh.zone_areas)) / np.abs(around).max()
        for one, other in zip(found, (radial, around), strict=True)
    ]


@pytest.mark.thorough
def test_a_disc_with_a_hot_rim_is_torn_inside():
    """40 grains: 2.8 and 1.7 % where they are refined once, 1.6 and 0.7 % twice; each zone has one stress."""
    coarse, fine = errors_of_disc(1), errors_of_disc(2)
    assert max(fine) < 0.02
    assert (np.array(coarse) / fine > 1.6).all()


def in_polar_axes(place, stress):
    """Radial and circumferential stress (2, z) of zones at their places."""
    (x, y), (sxx, syy, sxy) = place.T / np.hypot(*place.T), stress.T
    return np.stack([x * x * sxx + y * y * syy + 2 * x * y * sxy, y * y * sxx + x * x * syy - 2 * x * y * sxy])


@pytest.mark.thorough
def test_the_rock_round_a_heated_hole():
    """Steady, T falls with ln r; stresses of a ring (Timoshenko and Goodier 1970, Art. 151)."""
    inner, outer = 2e-3, 8e-3
    specimen, last = gl.Specimen(sectors(np.geomspace(inner, outer, 9), 48), ROCK, refinement=1), Last()
    ends = [
        gl.loads.FixedTemperature(boundary=name, temperature=at) for name, at in (("hole", HOT), ("boundary", 20.0))
    ]
    heat = gl.loads.Conduction(duration=2 * outer**2 / DIFFUSIVITY, step=1.0)
    result = run(specimen, [heat, *ends], observers=[last], time=2e-4)
    r = np.hypot(*middles(specimen).T)
    scale = (HOT - 20) / np.log(outer / inner)
    assert last.temperature == pytest.approx(20 + scale * np.log(outer / r), abs=0.01 * (HOT - 20))

    def within(to):  # of (T - 20) r, from the hole on
        return scale * ((to**2 * np.log(outer / to) - inner**2 * np.log(outer / inner)) / 2 + (to**2 - inner**2) / 4)

    whole, factor = within(outer) / (outer**2 - inner**2), E * ALPHA / (1 - NU) / r**2
    radial = factor * ((r**2 - inner**2) * whole - within(r))
    around = factor * ((r**2 + inner**2) * whole + within(r) - scale * np.log(outer / r) * r**2)
    for found, expected in zip(in_polar_axes(middles(specimen), last.stress), (radial, around), strict=True):
        error = np.sqrt(np.average((found - expected) ** 2, weights=specimen.mesh.zone_areas))
        assert error < 0.02 * np.abs(around).max()
    assert result.summary["energy_error"] < 1e-9


# --- what goes on beside it -------------------------------------------------------------------------------------------


@pytest.mark.thorough
def test_zones_that_could_conduct_are_heated_evenly_as_others_are():
    """The same curves from a temperature in each zone as from one for all."""
    protocol = Heating(to=(120, 60), samples=10, loading=gl.HeatingRate(rate=1e6))
    both = [
        gl.simulate(slab(rock=rock), HARD, protocol, threads=1, progress=False).curves
        for rock in (ROCK, attrs.evolve(ROCK, conductivity=None, heat_capacity=None))
    ]
    for name, curve in both[1].items():
        assert both[0][name] == pytest.approx(curve, rel=1e-9, abs=1e-9 * np.nanmax(np.abs(curve)), nan_ok=True), name


@attrs.frozen(kw_only=True)
class HeatedBefore(gl.LoadingProtocol):
    """One temperature, then conduction, then no heat that flows."""

    def stages(self, specimen):
        base = [gl.loads.Drive(boundary="bottom", axis=k, speed=0.0, roller=k == 0) for k in (1, 0)]
        rate = gl.HeatingRate(rate=1e6)
        warm = gl.Stage(name="warm", loads=[*base, gl.loads.Heat(to=80)], loading=rate, interval=6.0, expected=10)
        cold = gl.loads.FixedTemperature(boundary="left", temperature=20.0)
        heat = gl.Stage(
            name="cool", loads=[*base, gl.loads.Conduction(duration=5.0, speedup=1e5), cold], interval=5e-6, expected=10
        )
        over = gl.Stage(name="over", loads=base, until=[gl.conditions.Reaches("time", 1.6e-4)], interval=1e-5)
        return [warm, heat, over]

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


def test_heat_flows_from_the_temperature_that_a_stage_has_brought_and_stops_with_its_stage():
    curves = gl.simulate(slab(), HARD, HeatedBefore(), threads=1, progress=False).curves
    warm, cool, over = (curves["stage"] == k for k in range(3))
    assert curves["temperature"][warm][-1] == 80
    assert curves["hottest"][cool][-1] == pytest.approx(80, abs=0.1)
    assert curves["coldest"][cool][-1] == 20
    assert np.ptp(curves["temperature"][over]) == 0
    assert curves["temperature"][over][0] == curves["temperature"][cool][-1] < 75
    whole = RHO * C * LENGTH * 4e-3
    assert curves["heat_stored"][cool] == pytest.approx(whole * (curves["temperature"][cool] - 20), rel=1e-9)
    assert curves["heat_supplied"][-1] == pytest.approx(curves["heat_stored"][-1], rel=1e-9)
    assert energy_error(curves) < 1e-6


def test_a_column_that_a_load_of_a_later_stage_records_is_waited_for():
    """The test does not record it before."""

    def stages(self, specimen):
        warm, heat, _ = HeatedBefore.stages(self, specimen)
        return [warm, attrs.evolve(heat, until=[gl.conditions.Reaches("heat_time", 2.0)])]

    until = type("Until", (HeatedBefore,), {"stages": stages})()
    assert 2.0 <= gl.simulate(slab(), HARD, until, threads=1, progress=False).curves["heat_time"][-1] < 4.0


@pytest.mark.thorough
def test_a_report_and_paraview_have_the_temperature_of_zones(tmp_path):
    result = run(slab(), [gl.loads.Conduction(duration=20.0), SUDDEN], observers=[VtkWriter(tmp_path, count=2)])
    picture = temperatures_side_by_side({"slab": result})
    (drawn,) = picture.axes[0].collections
    expected = of_slab(middles(slab())[:, 0], result.summary["heat_time"])
    assert np.asarray(drawn.get_array()) == pytest.approx(expected, abs=1.5)
    last = pyvista.read(sorted(tmp_path.glob("grains_*.vtu"))[-1])
    assert last.cell_data["temperature"] == pytest.approx(expected, abs=1.5)
    write_report({"slab": result}, tmp_path / "report.html")
    assert "Temperature, in the last frame" in (tmp_path / "report.html").read_text("utf-8")
    even = run(slab(), [gl.loads.Conduction(duration=20.0)])
    assert temperatures_side_by_side({"slab": even}) is None
    write_report({"slab": even}, tmp_path / "report.html")
    assert "Temperature, in the last frame" not in (tmp_path / "report.html").read_text("utf-8")


@pytest.mark.thorough
def test_a_second_stage_goes_on_where_the_first_has_ended():
    """Insulated from then on: no more heat comes in, the field evens out, and time of heat begins again."""
    warm, even = [gl.loads.Conduction(duration=20.0), SUDDEN], [gl.loads.Conduction(duration=40.0)]
    curves = run(slab(), warm, even, time=1e-4, samples=10).curves
    first, second = (curves["stage"] == k for k in range(2))
    assert curves["heat_time"][second] == pytest.approx(4e5 * (curves["time"][second] - curves["time"][first][-1]))
    for name in ("heat_supplied", "heat_stored"):
        assert curves[name][second] == pytest.approx(curves[name][first][-1], rel=1e-12)
    assert np.ptp(curves["temperature"][second]) < 1e-9
    assert (np.diff(curves["hottest"][second]) < 0).all()
    assert curves["hottest"][second][-1] - curves["coldest"][second][-1] < 60


# --- the same bits, and what is refused -------------------------------------------------------------------------------

WEAK = MohrCoulomb(kn=1e14, ks=1e14, tensile_strength=3e6, cohesion=10e6, friction_angle=30)
SHOCK = [
    gl.loads.Conduction(duration=10.0),
    *(gl.loads.FixedTemperature(boundary=s, temperature=-80.0) for s in ("left", "right")),
]


@pytest.mark.thorough
def test_threads_and_a_restart_with_heat_in_motion_change_no_bit(tmp_path):
    specimen, options = small_sample(material=ROCK), {"time": 1e-4, "samples": 40}
    once = run(specimen, SHOCK, law=WEAK, threads=1, **options)
    assert once.curves["tensile_cracks"][-1] > 20
    assert once.summary["heat_supplied"] == pytest.approx(once.summary["heat_stored"], rel=1e-9)
    stop = gl.Stop()
    two = {**options, "threads": 2, "checkpoint": tmp_path}
    with pytest.raises(gl.Stopped):
        run(specimen, SHOCK, law=WEAK, stop=stop, observers=[Late(stop)], **two)
    again = run(specimen, SHOCK, law=WEAK, restart=True, observers=[Late()], **two)
    for name, curve in once.curves.items():
        assert np.array_equal(curve, again.curves[name], equal_nan=True), name
    for name, row in once.frames[-1].zones.items():
        assert np.array_equal(row, again.frames[-1].zones[name]), name


@pytest.mark.thorough
def test_a_device_follows_the_processor():
    """To the last digits, as of other runs: temperatures go up to it, and the path of zones between them."""
    specimen, options = small_sample(3, material=ROCK), {"law": WEAK, "time": 4e-6, "samples": 4}
    loads = [gl.loads.Conduction(duration=40.0), attrs.evolve(SUDDEN, temperature=60.0)]
    here, there = (
        run(specimen, loads, **options, **where).curves for where in ({"threads": 1}, {"device": Simulated()})
    )
    assert here["energy_zones_thermal"][-1] < 0
    for name in ("step", "heat_time", "hottest", "energy_zones", "energy_zones_thermal", "energy_kinetic"):
        np.testing.assert_allclose(there[name], here[name], rtol=1e-9, atol=1e-9 * np.abs(here[name]).max())


def test_cracks_that_open_let_less_heat_through():
    """Of the sample that is torn, the middle stays warmer than of one whose bonds hold."""
    specimen, options = small_sample(12, material=ROCK, width=20e-3, height=20e-3), {"time": 1e-4, "samples": 20}
    torn, whole = (run(specimen, SHOCK, law=law, **options).summary for law in (WEAK, HARD))
    assert torn["hottest"] > whole["hottest"] + 0.1


def stage(*loads, **options):
    return gl.Stage(name="heat", **{"loads": [gl.loads.Conduction(duration=1.0), *loads], "interval": 1.0, **options})


QUARTZ_ROCK = Thermal(material=ELASTIC, expansion=QUARTZ, conductivity=K, heat_capacity=C)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Thermal(material=ELASTIC, expansion=ALPHA, conductivity=3), "must be given together"),
        (lambda: Thermal(material=ELASTIC, expansion=ALPHA, heat_capacity=3), "must be given together"),
        (
            lambda: Thermal(material=ELASTIC, expansion=ALPHA, conductivity=-3, heat_capacity=1),
            "Thermal: conductivity = -3 W/m/K is not allowed, it must be a finite number and above 0",
        ),
        (lambda: stage(gl.loads.Conduction(duration=1.0)), "it has 2 conductions, it can have one"),
        (
            lambda: stage(gl.loads.Heat(to=60), loading=gl.HeatingRate(rate=1.0), expected=1),
            "Heat is the same everywhere",
        ),
        (lambda: stage(static=True), "static is not allowed while heat flows"),
        (lambda: stage(until=[gl.conditions.AtRest()]), "AtRest is not allowed while heat flows"),
        (lambda: stage(ageing=gl.Ageing(duration=1.0)), "ageing is not allowed while heat flows"),
        (lambda: stage(loading=gl.Adaptive(), expected=1), "is not allowed where heat is conducted"),
        (
            lambda: stage(loads=[SUDDEN], until=[gl.conditions.AtRest()]),
            "FixedTemperature needs a Conduction beside it",
        ),
        (lambda: stage(SUDDEN, SUDDEN), "boundary = 'left' has a temperature that is fixed"),
        (lambda: stage(SUDDEN, gl.loads.HeatFlux(boundary="left", flux=1.0)), "nothing else can bring heat there"),
        (lambda: gl.loads.FixedTemperature(boundary="left", temperature=-300), "at least -273.15 (degC)"),
        (lambda: gl.loads.FixedTemperature(boundary="left", temperature=[(0, 20), (1, 60)], ramp=1.0), "start = 20"),
        (lambda: gl.loads.HeatFlux(boundary="left", flux=[(0, 20), (1, 60)], start=1.0), "start = 1"),
        (lambda: gl.loads.Convection(boundary="left", coefficient=0, temperature=20), "Convection: coefficient = 0"),
        (lambda: gl.loads.Conduction(duration=0), "Conduction: duration = 0 s"),
        (lambda: gl.loads.Conduction(duration=1, step=0), "Conduction: step = 0 s"),
        (lambda: gl.loads.Conduction(duration=1, step=2), "Conduction: step = 2 s is not allowed, it must be at most"),
        (
            lambda: gl.Stage(name="a", loads=[gl.loads.Conduction(duration=1.0, speedup=1e6)], interval=1e-4),
            "in which 100 s of heat pass, is more than the Conduction's duration = 1 s",
        ),
        (
            lambda: run(slab(), [gl.loads.Conduction(duration=1.0)], time=1e-9, samples=1),
            "more than a tenth of the duration = 1 s: give a smaller one",
        ),
        (lambda: gl.loads.HeatSource(power=1.0, grains=[]), "at least one grain number, or None for all grains"),
        (lambda: gl.loads.HeatSource(power=1.0, grains=[99]).check_specimen(slab()), "HeatSource: grains = 99"),
        (
            lambda: gl.loads.FixedTemperature(boundary="rim", temperature=60).check_specimen(slab()),
            "no boundary named rim",
        ),
        (lambda: gl.loads.HeatFlux(boundary="rim", flux=60.0).check_specimen(slab()), "no boundary named rim"),
        (
            lambda: gl.loads.FixedTemperature(boundary="left", temperature=[(0, 20), (1, 1200)]).check_specimen(
                slab(rock=QUARTZ_ROCK)
            ),
            "temperature = 1200 °C is not allowed",
        ),
        (
            lambda: gl.loads.Convection(
                boundary="left", coefficient=1.0, temperature=60, start=0, ramp=1.0
            ).check_specimen(slab(rock=QUARTZ_ROCK)),
            "temperature = 0 °C is not allowed",
        ),
        (
            lambda: gl.loads.Conduction(duration=1.0).check_specimen(
                slab(rock=attrs.evolve(ROCK, conductivity=None, heat_capacity=None))
            ),
            "does not conduct",
        ),
        (
            lambda: gl.loads.Conduction(duration=1.0).check_specimen(slab(rock=gl.Rigid(density=2650))),
            "does not conduct",
        ),
        (
            lambda: run(slab(), [gl.loads.Conduction(duration=1.0)], [gl.loads.Conduction(duration=1.0), *rim(60)]),
            "the specimen has no boundary named rim",
        ),
    ],
)
def test_what_makes_no_conduction_is_refused(make, words):
    with pytest.raises(gl.ParameterError, match=re.escape(words)):
        make()


@attrs.frozen(kw_only=True)
class HeatedAfter(HeatedBefore):
    """The other way round."""

    def stages(self, specimen):
        return super().stages(specimen)[1::-1]


def test_one_temperature_after_conduction_is_refused():
    with pytest.raises(gl.ParameterError, match=r"stage 'warm': Heat .* after stage 'cool'"):
        gl.simulate(slab(), HARD, HeatedAfter(), progress=False)


def test_a_temperature_that_a_material_does_not_know_ends_the_run():
    cold = gl.loads.HeatFlux(boundary="left", flux=-1e6)
    with pytest.raises(gl.StageError, match=r"grain 0 comes to -?[\d.]+ °C after .* known from 20 to 1000 °C"):
        run(slab(rock=QUARTZ_ROCK), [gl.loads.Conduction(duration=1.0), cold])


@pytest.mark.parametrize("fixed", [True, False])
def test_heat_flows_through_tied_cells_as_through_one_grain(fixed):
    """The temperatures of bonded cells whose contacts conduct without loss, and one at each point."""
    loads = [SUDDEN] if fixed else [gl.loads.HeatFlux(boundary="left", flux=1e4)]
    bonded = begun(slab(), *loads, step=1.0, bonded=1e12)
    tied = begun(attrs.evolve(slab(), tied=...), *loads, step=1.0)
    for state in (bonded, tied):
        flow(state, 20)
    mesh, found = tied.mesh, tied.conduction.temperature
    assert found == pytest.approx(bonded.conduction.temperature, abs=1e-4)
    assert found.max() > 20.5
    assert np.array_equal(found, found[mesh.first_of_point][mesh.point])
    columns = tied.conduction.columns
    assert columns["heat_supplied"] == pytest.approx(columns["heat_stored"], rel=1e-10)
