"""Thermal expansion against closed forms: one grain, held samples, a bimaterial strip, an inclusion; heat as energy."""

import itertools
import re
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from every_material import MOHR, SCHIST
from support import small_sample, state_of

import grainlaw as gl
from grainlaw.engine.parts.heat import ROOM, EvenTemperature
from grainlaw.engine.stable_step import StableStep
from grainlaw.engine.stage_statics import _heated, steady_motion
from grainlaw.geometry import Bricks, from_polygons, rectangle
from grainlaw.laws import Linear, MohrCoulomb
from grainlaw.materials import QUARTZ, ExpansionTable, MohrCoulombPlastic, Thermal
from grainlaw.protocols import Cyclic, Heating, UniaxialCompression, UniaxialTension
from grainlaw.protocols.heating import Held
from grainlaw.results.archive import from_bytes, to_bytes
from grainlaw.results.result import energy_error
from grainlaw.runs.loader import Loader

E, NU, ALPHA, WARMER = 60e9, 0.25, 8e-6, 100.0
ELASTIC = gl.Elastic(youngs_modulus=E, poissons_ratio=NU, density=2650)
WARM = Thermal(material=ELASTIC, expansion=ALPHA)
STRONG = MohrCoulomb(kn=1e15, ks=1e15, tensile_strength=1e9, cohesion=1e9, friction_angle=30)
HARD = Linear(kn=1e17, ks=1e17)  # between grains of mm: of no account
SLOW = gl.HeatingRate(rate=1e5)  # some thousand steps


def one_grain(material):
    return gl.Specimen(Bricks(rows=1, columns=1).tessellate(rectangle(10e-3, 10e-3)), material)


def heated(specimen, held, law=STRONG, to=20 + WARMER, test=None, **options):
    protocol = Heating(to=to, held=held, samples=10, loading=SLOW, test=test)
    return gl.simulate(specimen, law, protocol, threads=1, frames=2, **options)


def per_kelvin(specimen, law, drives=()):
    """(i, 2) m/K of the nodes, of the static solution that a stage begins with."""
    state = state_of(specimen, law)
    state.begin(gl.Stage(name="heat", loads=[*drives, gl.loads.Heat(to=21)], loading=SLOW, interval=0.1, expected=10))
    stable = StableStep(state)
    return state.grains.nodes_at(steady_motion(state, stable.stiffness(), stable.frequency)).T


PLANE_STRESS = attrs.evolve(ELASTIC, plane=gl.Plane.STRESS)
SHARE = (1 + NU) / (1 - NU)  # of a free strain that one direction in the plane takes where the two others are held


@pytest.mark.parametrize(
    ("material", "held", "strain", "stress"),
    [
        (ELASTIC, Held.BOTTOM, (1 + NU, 1 + NU), (0, 0)),
        (ELASTIC, Held.ENDS, (SHARE, 0), (0, -1 / (1 - NU))),
        (ELASTIC, Held.ALL, (0, 0), (-1 / (1 - 2 * NU), -1 / (1 - 2 * NU))),
        (PLANE_STRESS, Held.BOTTOM, (1, 1), (0, 0)),
        (PLANE_STRESS, Held.ALL, (0, 0), (-1 / (1 - NU), -1 / (1 - NU))),
    ],
)
def test_one_grain_expands_where_it_may(material, held, strain, stress):
    result = heated(one_grain(Thermal(material=material, expansion=ALPHA)), held)
    curves = result.curves
    assert curves["temperature"][-1] == 20 + WARMER
    free = ALPHA * WARMER
    for axis, wanted, held_back in zip("xy", strain, stress, strict=True):
        for found in (curves[f"expansion_{axis}"][-1], result.summary[f"expansion_{axis}"]):
            assert found == pytest.approx(wanted * free, abs=2e-3 * free)  # strains of 0.1 %
        assert curves[f"stress_{axis}"][-1] == pytest.approx(held_back * E * free, abs=3e-3 * E * free)


@attrs.frozen(kw_only=True)
class Resting(gl.LoadingProtocol):
    """Nothing is imposed."""

    def stages(self, specimen):
        return [gl.Stage(name="rest", until=[gl.conditions.Reaches("time", 1e-4)], interval=1e-5)]

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


def test_a_specimen_on_which_nothing_acts_is_not_called_unstable():
    """Its free strain less that at the reference is no more than rounding, and so is the energy of it."""
    assert gl.simulate(small_sample(4, material=WARM), HARD, Resting()).curves["energy_zones"].max() < 1e-25


def test_a_bonded_sample_expands_as_one_grain_and_returns():
    result = heated(small_sample(grains=12, material=WARM), Held.BOTTOM, to=(120, 20))
    curves, hot = result.curves, np.flatnonzero(result.curves["temperature"] == 120)[0]
    free = (1 + NU) * ALPHA * WARMER
    for axis in "xy":
        assert curves[f"expansion_{axis}"][hot] == pytest.approx(free, rel=1e-3)
        assert curves[f"expansion_{axis}"][-1] == pytest.approx(0, abs=1e-3 * free)
        assert abs(curves[f"stress_{axis}"][hot]) < 1e-3 * E * free
    assert energy_error(curves) < 1e-6
    assert result.summary["thermal_cracks"] == 0


def test_two_grains_between_walls_press_their_contact():
    height, kn = 5e-3, 1e15
    grains = Bricks(rows=2, columns=1).tessellate(rectangle(10e-3, 2 * height))
    curves = heated(gl.Specimen(grains, WARM), Held.ALL).curves
    oedometer = E * (1 - NU) / ((1 + NU) * (1 - 2 * NU))
    expected = -E * ALPHA * WARMER / (1 - 2 * NU) / (1 + oedometer / (2 * height * kn))
    assert curves["stress_y"][-1] == pytest.approx(expected, rel=1e-3)


def test_heat_is_in_the_ledger():
    """Held, all that the zones store comes from heat; across the plane the free strain is held always."""
    curves = heated(one_grain(WARM), Held.ALL, to=(120, 20)).curves
    hot = np.flatnonzero(curves["temperature"] == 120)[0]
    stored = (
        1.5 * E * (ALPHA * WARMER) ** 2 / (1 - 2 * NU) * 1e-4
    )  # sigma : elastic strain / 2, alike in all directions
    assert curves["energy_zones"][hot] == pytest.approx(stored, rel=1e-3)
    assert curves["energy_zones_thermal"][hot] == pytest.approx(-stored, rel=1e-3)
    assert abs(curves["energy_zones_thermal"][-1]) < 1e-3 * stored
    assert curves["energy_zones_dissipated"][-1] == 0
    assert energy_error(curves) < 1e-6


def test_plastic_grains_dissipate_what_heat_presses_out_of_them():
    weak = MohrCoulombPlastic(
        youngs_modulus=E, poissons_ratio=NU, density=2650, tensile_strength=5e6, cohesion=10e6, friction_angle=30
    )
    curves = heated(one_grain(Thermal(material=weak, expansion=ALPHA)), Held.ENDS).curves
    strength = 2 * 10e6 * np.cos(np.radians(30)) / (1 - np.sin(np.radians(30)))  # Coulomb's, pressed along y and z
    assert curves["stress_y"][-1] == pytest.approx(-strength, rel=1e-2)
    assert curves["energy_zones_dissipated"][-1] > 0.1 * curves["energy_zones"][-1]
    assert energy_error(curves) < 1e-6


def test_a_foliated_grain_is_held_across_the_plane():
    """Held on all sides: the stiffness in three dimensions, inverted as a whole, times minus the free strain."""
    m, angle = SCHIST, np.radians(SCHIST.foliation_angle)
    e, between = m.youngs_modulus, -m.poissons_ratio_across / m.youngs_modulus_across
    near = -m.poissons_ratio / e
    soft = np.array([[1 / e, between, near], [between, 1 / m.youngs_modulus_across, between], [near, between, 1 / e]])
    along, across, third = np.linalg.solve(soft, np.full(3, -ALPHA * WARMER))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    expected = turn @ np.diag([along, across]) @ turn.T
    warm = Thermal(material=m, expansion=ALPHA)
    assert warm.stress(0, 0, 0, 120, 0.0) == pytest.approx((expected[0, 0], expected[1, 1], expected[0, 1]), rel=1e-9)
    assert warm.energy(0, 0, 0, 120, 0.0) == pytest.approx(-0.5 * (along + across + third) * ALPHA * WARMER)


def test_a_crystal_expands_along_its_axis():
    crystal = Thermal(material=PLANE_STRESS, expansion=14e-6, expansion_along=8e-6, axis_angle=30)
    turn = np.array([[np.cos(np.pi / 6), -np.sin(np.pi / 6)], [np.sin(np.pi / 6), np.cos(np.pi / 6)]])
    free = turn @ np.diag([8e-6, 14e-6]) @ turn.T * WARMER
    assert crystal.stress(free[0, 0], free[1, 1], free[0, 1], 120, 0.0) == pytest.approx((0, 0, 0), abs=1e-3)


def test_a_table_is_straight_between_its_temperatures():
    random = np.random.default_rng(0)
    at = np.cumsum(random.uniform(5, 60, 24)) - 100
    table = ExpansionTable(at, random.normal(size=24) * 1e-3)
    for temperature in random.uniform(at[0], at[-1], 100):
        expected = np.interp(temperature, table.at, table.strains)
        assert table.strain(temperature) == pytest.approx(expected, abs=1e-12)


def test_a_crystal_is_known_where_all_its_tables_are():
    cold = ExpansionTable([-50, 500], [0, 1e-3])
    assert Thermal(material=ELASTIC, expansion=QUARTZ, expansion_along=cold).temperatures == (20, 500)
    assert Thermal(material=ELASTIC, expansion=cold, expansion_along=QUARTZ).temperatures == (20, 500)
    assert Thermal(material=ELASTIC, expansion=1e-5).temperatures == (-273.15, np.inf)


@pytest.mark.thorough
def test_a_heated_sample_is_pressed_by_the_strain_that_it_is_asked_for():
    """Heat has made it longer by 0.1 %, which does not count."""
    largest = (1 + NU) * ALPHA * WARMER
    press = UniaxialCompression(loading=gl.Constant(speed=0.5), maximum_strain=largest, samples=20)
    protocol = Heating(to=20 + WARMER, samples=50, loading=SLOW, test=press)
    result = gl.simulate(small_sample(grains=12, material=WARM), STRONG, protocol, threads=1)
    height = result.curves["strain_points"]  # mean over each sample: the last of the heating is a fiftieth
    hot = np.flatnonzero(result.curves["stage"] == 0)[-1]
    assert height[hot] == pytest.approx(-0.99 * largest, rel=2e-3)
    assert height[-1] == pytest.approx(0, abs=0.1 * largest)  # a sample of the press is a twentieth
    assert result.curves["strain"][-1] - result.curves["strain"][hot] == pytest.approx(largest, rel=0.06)


def test_what_expands_freely_does_not_vibrate():
    """In plane stress nothing is stored then, and vibration over stored energy would be noise over noise."""
    specimen = small_sample(grains=12, material=Thermal(material=PLANE_STRESS, expansion=ALPHA))
    result = heated(specimen, Held.BOTTOM)
    assert result.curves["energy_zones"].max() < 1e-5 * result.curves["energy_kinetic"].max()
    assert result.summary["heating_kinetic_ratio"] < 1e-5  # that of the start


def test_only_what_breaks_in_a_stage_ends_it():
    """The load vibrates while it begins, in a sample that heat has cracked; then it falls because a contact breaks."""
    curves = {"load": np.array([1.0, 0.2, 2.0, 0.5]), "shear_cracks": np.zeros(4), "stage": np.ones(4)}
    fails = gl.conditions.FailsTo("load", 0.5)

    def after(samples, cracks):
        return fails.progress({name: column[:samples] for name, column in {**curves, "tensile_cracks": cracks}.items()})

    assert after(2, np.full(4, 7.0)) == 0
    assert after(4, np.array([7.0, 7, 7, 8])) == 1
    curves["stage"] = np.zeros(4)  # of a stage that begins the run every break counts, also before its first sample
    assert after(2, np.full(4, 7.0)) == 1


# --- static solutions ------------------------------------------------------------------------------------------------

STIFFER = Thermal(material=attrs.evolve(ELASTIC, youngs_modulus=2 * E), expansion=2 * ALPHA)


def strip_error(columns, refinement):
    """Curvature of a strip of two layers, over Timoshenko's (1925, J. Opt. Soc. Am. 11, 233-255), less one.

    In plane strain the moduli are E / (1 - nu^2) and the expansions (1 + nu) times those of a beam.
    """
    length, height = 40e-3, 4e-3
    grains = Bricks(rows=2, columns=columns).tessellate(rectangle(length, height))
    grains = attrs.evolve(grains, phase=(grains.centroids[:, 1] > height / 2).astype(int))
    specimen = gl.Specimen(grains, {0: WARM, 1: STIFFER}, refinement=refinement)
    u, x = per_kelvin(specimen, HARD), specimen.mesh.nodes
    m, n = 1.0, 0.5  # layers of equal thickness; the upper one is twice as stiff
    shape = 3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n))
    expected = 6 * (STIFFER.expansion.coefficient - ALPHA) * (1 + NU) * (1 + m) ** 2 / (height * shape)
    middle = (np.abs(x[:, 0] - length / 2) < length / 4) & (x[:, 1] < 1e-9)
    bent = np.polyfit(x[middle, 0], u[middle, 1], 2)[0] * 2
    return abs(bent) / expected - 1


def test_a_bimaterial_strip_curves_as_timoshenko_says():
    assert abs(strip_error(20, 2)) < 0.02
    assert abs(strip_error(20, 2)) < abs(strip_error(20, 1))


def test_a_round_inclusion_is_pressed_by_its_expansion():
    """Lame's cylinders in plane strain: a disc of radius a that expands more than the ring around it, up to b."""
    a, rings, sectors = 1e-3, np.array([0.4, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0]), 48
    angles = np.linspace(0, 2 * np.pi, sectors + 1)
    ray = np.stack([np.cos(angles), np.sin(angles)], axis=1) * a
    cells = [[(0, 0), rings[0] * ray[k], rings[0] * ray[k + 1]] for k in range(sectors)]
    phases = [0] * sectors
    for inner, outer in itertools.pairwise(rings):
        cells += [[inner * ray[k], outer * ray[k], outer * ray[k + 1], inner * ray[k + 1]] for k in range(sectors)]
        phases += [int(inner >= 1)] * sectors
    hot = Thermal(material=ELASTIC, expansion=2 * ALPHA)
    specimen = gl.Specimen(from_polygons(cells, phases), {0: hot, 1: WARM}, refinement=1)
    u = per_kelvin(specimen, HARD)
    distance = np.hypot(*specimen.mesh.nodes.T)
    rim = np.abs(distance - a) < 1e-3 * a
    moved = np.mean(np.sum(u[rim] * specimen.mesh.nodes[rim], axis=1) / distance[rim]) / a
    misfit, wide = (1 + NU) * ALPHA, rings[-1] ** 2
    ring = (1 + NU) * ((1 - 2 * NU) + wide) / (wide - 1) / E  # strain of the hole by a pressure of 1 in it
    disc = (1 + NU) * (1 - 2 * NU) / E
    pressure = misfit / (ring + disc)
    expected = misfit + ring * pressure  # the ring's own free strain, and what the pressure widens it by
    assert moved == pytest.approx(expected, rel=0.01)


# --- the same bits, and what is refused ------------------------------------------------------------------------------


@pytest.mark.alone
def test_threads_and_a_restart_give_the_same_bits(tmp_path):
    angles = np.linspace(0, 165, 12)  # of the grains: they press each other, and break
    crystal = Thermal(material=MOHR, expansion=14e-6, expansion_along=8e-6, axis_angle=angles)
    weak = MohrCoulomb(kn=1e14, ks=1e14, tensile_strength=5e6, cohesion=10e6, friction_angle=30)
    specimen = small_sample(grains=12, material=crystal)
    protocol = Heating(to=(100, 20), samples=10, loading=SLOW)
    runs = [gl.simulate(specimen, weak, protocol, threads=threads, frames=2).curves for threads in (1, 3)]
    stop, options = gl.Stop(), {"threads": 1, "frames": 2, "checkpoint": tmp_path / "run"}

    class Stops(gl.Observer):
        def observe(self, state, curves, stage, progress):
            if not options.get("restart") and state.heat.temperature > 40:
                stop.ask("in the middle")

    with pytest.raises(gl.Stopped):
        gl.simulate(specimen, weak, protocol, observers=[Stops()], stop=stop, **options)
    options["restart"] = True
    found = gl.simulate(specimen, weak, protocol, observers=[Stops()], **options)
    for name, row in runs[0].items():
        assert np.array_equal(row, runs[1][name], equal_nan=True), name
        assert np.array_equal(row, found.curves[name], equal_nan=True), name
    assert runs[0]["tensile_cracks"][-1] > 0


@pytest.mark.thorough
def test_what_is_heated_and_free_is_measured_by_its_own_stresses():
    """Its ends bear nothing that an imbalance could be a share of, and nothing keeps it from swaying."""
    crystal = Thermal(material=MOHR, expansion=14e-6, expansion_along=8e-6, axis_angle=np.linspace(0, 165, 12))
    weak = MohrCoulomb(kn=1e14, ks=1e14, tensile_strength=5e6, cohesion=10e6, friction_angle=30)
    protocol = Heating(to=(200, 20), samples=20)
    found = gl.simulate(small_sample(grains=12, material=crystal), weak, protocol, threads=1, frames=2)
    assert found.summary["thermal_cracks"] > 10
    assert found.curves["imbalance"].max() < 0.01
    assert found.summary["heating_kinetic_ratio"] < 0.01


def test_the_force_of_own_stresses_by_hand():
    """Held, a square of side b has the stress E alpha T / (1 - nu) both ways; free, it moves by alpha T b."""
    material, change = Thermal(material=PLANE_STRESS, expansion=ALPHA), 10.0
    specimen = gl.Specimen(Bricks(rows=1, columns=1).tessellate(rectangle(10e-3, 10e-3)), material)
    state = state_of(specimen, HARD)
    ground = [gl.loads.Drive(boundary="bottom", axis=k, speed=0.0, roller=k == 0) for k in (1, 0)]
    loads = [*ground, gl.loads.Heat(to=20 + change)]
    stage = gl.Stage(name="heat", loads=loads, loading=SLOW, interval=change / 10, expected=10)
    state.begin(stage)
    state.change_time_step(1e-8)
    loader = Loader(state, StableStep(state))
    loader.begin(stage)
    side, stress = 10e-3, E * ALPHA * change / (1 - NU)
    stored = stress * ALPHA * change * side**2  # J/m, of both directions
    seen = loader.save()
    assert seen["inner"] * np.sqrt(stored) == pytest.approx(2 * stress * side, rel=1e-3)
    assert seen["least"] == pytest.approx(0.01 * 2 * stress * side, rel=1e-3)


@pytest.mark.thorough
def test_what_stores_nothing_is_in_balance_by_what_it_would_bear():
    even = Thermal(material=PLANE_STRESS, expansion=ALPHA)
    found = gl.simulate(small_sample(12, material=even), STRONG, Heating(to=60, samples=10), threads=1, frames=2)
    assert found.curves["imbalance"].max() < 0.001


@attrs.frozen(kw_only=True)
class Swaying(gl.LoadingProtocol):
    """Heat slowly what was thrown to the side."""

    velocity: np.ndarray = attrs.field(eq=False)

    def stages(self, specimen):
        loads = [gl.loads.Drive(boundary="bottom", axis=k, speed=0.0) for k in (0, 1)]
        loads += [gl.loads.Heat(to=21), gl.loads.InitialVelocity(velocity=self.velocity)]
        rate = gl.HeatingRate(rate=1 / 4e-4)
        return [gl.Stage(name="heat", loads=loads, loading=rate, interval=0.01, expected=100)]

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


def test_what_sways_while_it_is_heated_comes_to_rest():
    """Energy in a mode fades by exp(-c t), here with c = 0.1 omega, the frequency by which the loading goes."""
    specimen = small_sample(12, material=WARM)
    nodes = specimen.mesh.nodes
    thrown = np.zeros_like(nodes)
    thrown[:, 0] = (nodes[:, 1] / nodes[:, 1].max()) ** 2 * 0.1
    curves = gl.simulate(specimen, STRONG, Swaying(velocity=thrown), threads=1, frames=2).curves
    half = len(curves["time"]) // 2
    assert curves["vibration"][half:].max() < 0.02 * curves["vibration"][:half].max()


@attrs.frozen(kw_only=True)
class Flat(gl.Material):
    """Says nothing of the third direction."""

    modulus: float = gl.parameter("Pa")
    density: float = gl.parameter("kg/m3")
    stiffness = property(lambda self: tuple(self.modulus * row for row in np.eye(3)))

    def stress(self, exx, eyy, exy):
        return self.modulus * exx, self.modulus * eyy, 2 * self.modulus * exy

    def energy(self, exx, eyy, exy):
        return self.modulus * (0.5 * (exx**2 + eyy**2) + 2 * exy**2)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: ExpansionTable([20, 500, 400], [0, 1e-3, 2e-3]), "400 °C follows 500 °C; temperatures must rise"),
        (lambda: ExpansionTable([20, 500], [0]), "at has 2 temperatures and strains 1"),
        (lambda: ExpansionTable([20], [0]), "at has 1 temperatures and strains 1 entries"),
        (lambda: ExpansionTable(range(25), range(25)), "both must have the same number, from 2 to 24"),
        (lambda: ExpansionTable([20, 20], [0, 1e-3]), "20 °C follows 20 °C"),
        (lambda: ExpansionTable([20, np.nan], [0, 1e-3]), "finite"),
        (lambda: ExpansionTable([20, 40], [0, np.inf]), "finite"),
        (lambda: ExpansionTable([-274, 40], [0, 1e-3]), "from absolute zero on"),
        (lambda: ExpansionTable(24, [0, 1e-3]), "two lists of numbers"),
        (lambda: ExpansionTable("24", [0, 1e-3]), "two lists of numbers"),
        (lambda: ExpansionTable([20, "40"], [0, 1e-3]), "two lists of numbers"),
        (lambda: ExpansionTable([20, 40], [False, True]), "two lists of numbers"),
        (lambda: Thermal(material=ELASTIC, expansion=None), "Thermal: expansion = None is not allowed"),
        (lambda: Thermal(material=ELASTIC, expansion=True), "Thermal: expansion = True is not allowed"),
        (lambda: Thermal(material=ELASTIC, expansion="much"), "Thermal: expansion = 'much' is not allowed"),
        (lambda: Thermal(material=gl.Rigid(density=2650), expansion=1e-5), "a material of grains that deform"),
        (lambda: Thermal(material=Flat(modulus=1e9, density=2650), expansion=1e-5), "Flat.stress must take ezz"),
        (lambda: Thermal(material=ELASTIC, expansion=QUARTZ, reference=0), "known from 20 to 1000 °C"),
        (lambda: Heating(to=()), "a temperature"),
        (lambda: Heating(to=(60, 60)), "each must differ from the last"),
        (lambda: Heating(to=60, test=Heating(to=80)), "Heating: test"),
        (lambda: Heating(to=60, test=ELASTIC), "Heating: test"),
        (lambda: Heating(to="hot"), "Heating: to = 'hot'"),
        (
            lambda: gl.Stage(name="heat", loads=[gl.loads.Heat(to=60)], interval=1.0),
            "it must be one in K/s without a ramp",
        ),
        (lambda: gl.loads.Heat(to=-300), "Heat: to = -300 degC"),
        (lambda: heated(small_sample(grains=2), Held.BOTTOM), "no material of the specimen depends on the temperature"),
        (
            lambda: gl.loads.Heat(to=1001).check_specimen(one_grain(Thermal(material=ELASTIC, expansion=QUARTZ))),
            "to 1000 °C",
        ),
        (
            lambda: gl.loads.Heat(to=19).check_specimen(one_grain(Thermal(material=ELASTIC, expansion=QUARTZ))),
            "20 to 1000 °C",
        ),
        pytest.param(
            lambda: heated(one_grain(Thermal(material=ELASTIC, expansion=QUARTZ)), Held.BOTTOM, to=1200),
            "to 1000 °C",
            marks=pytest.mark.thorough,
        ),
    ],
)
def test_what_makes_no_heating_is_refused(make, words):
    with pytest.raises(gl.ParameterError, match=re.escape(words)):
        make()


@pytest.mark.parametrize(
    ("low", "high", "to", "words"),
    [
        (20, 500, 600, "known from 20 to 500 °C, not at 600 °C"),
        (30, 500, 600, "known from 30 to 500 °C, not at 20 °C at which every run begins"),
    ],
)
def test_a_temperature_that_a_material_does_not_know_is_named(low, high, to, words):
    rock = Thermal(material=ELASTIC, expansion=ExpansionTable([low, high], [0, 1e-3]), reference=low)
    with pytest.raises(gl.ParameterError) as refused:
        gl.loads.Heat(to=to).check_specimen(one_grain(rock))
    assert str(refused.value).startswith(f"Heat: to = {to} °C is not allowed: Thermal(")
    assert str(refused.value).endswith(words)


@pytest.mark.parametrize(("begins", "target", "by"), [(20.0, 120.0, 1.0), (520.0, 20.0, -5.0)])
def test_the_first_expansion_is_found_towards_the_temperature_of_the_stage(begins, target, by):
    """A hundredth of the way; a table may begin or end where the stage does."""
    asked, reached = [], []

    def force(displacement, temperature, change):
        asked.append((temperature, change))
        return np.full((2, 3), 7.0)

    heat = SimpleNamespace(sign=np.sign(by), target=target, temperature=begins, reach=reached.append)
    arrays = SimpleNamespace(displacement=np.zeros((2, 3)))
    state = SimpleNamespace(
        heat=heat, materials=SimpleNamespace(force_per_kelvin=force), nodes=SimpleNamespace(arrays=arrays),
        grains=SimpleNamespace(carry=np.eye(6)),
    )  # fmt: skip
    assert _heated(state).tolist() == [np.sign(by) * 7.0] * 6  # N/s at 1 K/s, up or down
    assert asked == [(begins, pytest.approx(by))]
    assert reached == [begins]
    for changed in ({"sign": 0.0}, {"target": None}):
        heat.__dict__.update(changed)
        assert _heated(state) == 0.0


def test_temperatures_of_steps_go_on_from_where_the_rate_last_changed():
    told = []
    heat = EvenTemperature(SimpleNamespace(take_temperature=told.append))
    heat.target = ROOM + 30
    first = heat.course(np.array([1.0, 2.0, 40.0]), 0.5, 1.0) - ROOM
    assert first.tolist() == [[0, 0.5], [0.5, 1.5], [1.5, 30]]
    heat.reach(ROOM + 1.5)
    assert (heat.course(np.array([3.0]), 2.25, 1.0) - ROOM).tolist() == [[1.5, 2.5]]  # at the same rate
    assert (heat.course(np.array([3.0]), 2.0, 4.0) - ROOM).tolist() == [[1.5, 5.5]]
    heat.target = ROOM - 3
    assert (heat.course(np.array([3.0, 9.0]), 2.0, 4.0) - ROOM).tolist() == [[1.5, -2.5], [-2.5, -3]]
    heat.target = None
    assert (heat.course(np.array([3.0]), 2.0, 4.0) - ROOM).tolist() == [[1.5, 1.5]]
    assert told == [ROOM + 1.5]


def pulled(**more):
    return UniaxialTension(samples=100, maximum_strain=5e-4, stop_fraction=0.5, **more)


BRITTLE = MohrCoulomb(kn=1e14, ks=5e13, tensile_strength=13e6, cohesion=40e6, friction_angle=40)


@pytest.mark.thorough
@pytest.mark.parametrize("test", [pulled(), Cyclic(test=pulled(), levels=(6e-5, 1.2e-4))], ids=["pulled", "cyclic"])
def test_even_expansion_and_back_changes_nothing_of_a_test(test):
    """Coarse samples of the heating, so that a mean since the last one lags far behind where the specimen is."""
    specimen = small_sample(12, material=WARM)
    cold, hot = (gl.simulate(specimen, BRITTLE, each) for each in (test, Heating(to=(400, 20), samples=10, test=test)))
    for name in ("strength", "failure_strain", "apparent_modulus"):
        assert hot.summary[name] == pytest.approx(cold.summary[name], rel=3e-3)
    assert hot.summary.get("unloading_moduli", []) == pytest.approx(cold.summary.get("unloading_moduli", []), rel=3e-3)
    assert hot.stages[2] == "rest"
    drawn, kept = hot.plot().axes[0].lines[0].get_xdata(), from_bytes(to_bytes(hot))
    assert -1e-3 < drawn.min() < drawn.max() < 0.06  # %: the test alone; heated it was longer by 0.4 %
    assert kept.begins == hot.begins > 0
    assert np.array_equal(kept.of_test().curves["strain"], hot.of_test().curves["strain"])
    assert kept.of_test("temperature") is kept


@pytest.mark.thorough
def test_what_heat_has_broken_is_no_part_of_a_test_that_follows():
    minerals = {0: attrs.evolve(WARM, expansion=1.1e-5), ...: WARM}
    grains = attrs.evolve(small_sample(30).grains, phase=np.arange(30) % 2)
    test = UniaxialCompression(samples=100, maximum_strain=0.004, until=gl.Until.FAILURE)
    found = gl.simulate(gl.Specimen(grains, minerals), BRITTLE, Heating(to=(400, 20), samples=20, test=test))
    assert found.summary["thermal_cracks"] > 0.01 * found.summary["tensile_cracks"]
    begins = found.laboratory.value("crack_initiation_count")
    assert begins == pytest.approx(found.of_test().laboratory.value("crack_initiation_count"), abs=5e6)
    assert begins > 0.05 * found.summary["strength"]  # and not as the test begins


def test_tied_grains_expand_as_one():
    specimen = gl.Specimen(small_sample(12).grains, WARM, tied=["between"])
    found = gl.simulate(specimen, Linear(kn=1e14, ks=1e14), Heating(to=120, samples=10))
    assert found.summary["expansion_y"] == pytest.approx((1 + NU) * ALPHA * WARMER, rel=1e-2)
    place, moved = specimen.mesh.nodes, per_kelvin(specimen, HARD, Heating(to=120)._drives())
    assert moved - moved[0] == pytest.approx((place - place[0]) * (1 + NU) * ALPHA, abs=1e-12)


@attrs.frozen(kw_only=True)
class Draws(gl.LoadingProtocol):
    """Draws the upper end by a way, which is counted, and tells where the end is, which is not."""

    way: float
    quantities = (gl.Quantity("moved", "µm", counts=True), gl.Quantity("place", "µm"))

    def stages(self, specimen):
        held = gl.loads.Drive(boundary="bottom", axis=1, speed=0.0)
        drawn = gl.loads.Drive(boundary="top", axis=1, speed=1.0)
        until = [gl.conditions.Reaches("moved", self.way)]
        return [gl.Stage(name="draw", loads=[held, drawn], until=until, loading=gl.Constant(speed=0.1),
                         interval=self.way / 20, expected=20)]  # fmt: skip

    def measure(self, state):
        return dict.fromkeys(("moved", "place"), float(state.moved("top")[1]))

    def summary(self, curves, specimen):
        return {name: float(curves[name][-1]) for name in ("moved", "place")}


def test_what_a_test_of_ones_own_counts_begins_after_the_heating():
    """It has grown by ten times the way before, which is no part of it."""
    specimen = small_sample(12, material=WARM)
    height = np.ptp(specimen.grains.region.bounds, axis=0)[1]
    grown = (1 + NU) * ALPHA * WARMER * height
    found = heated(specimen, Held.BOTTOM, to=20 + WARMER, test=Draws(way=grown / 10))
    assert found.summary["moved"] == pytest.approx(0.1 * grown, rel=0.06)
    assert found.summary["place"] == pytest.approx(1.1 * grown, rel=0.02)
    assert found.of_test("moved").curves["moved"][-1] == found.summary["moved"]
