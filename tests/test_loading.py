"""Loading: the start without a wave, the speed that follows accuracy, damping beside the load, and its energy."""

import math

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import ROCK, STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw.columns import SPENT
from grainlaw.geometry import Bricks, Jointed, rectangle
from grainlaw.laws import BandisClosure, BartonBandis, CohesiveCrack, Friction, Linear, LinearClosure, MohrCoulomb
from grainlaw.loading import RECENT, RELEASED, Loading, Pace
from grainlaw.materials import Thermal
from grainlaw.protocols import BiaxialCompression, Cyclic, Heating, Held, Platens, UniaxialCompression, UniaxialTension
from grainlaw.strength import borne_in
from grainlaw.units import MPa

COHESIVE = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300)
BRITTLE = MohrCoulomb(**STRONG)
CRUSH = UniaxialCompression(samples=200)
SPEEDS = st.floats(1e-6, 1e2)


def ledger(curves):
    """Largest gap of the energies over the largest energy that was supplied."""
    spent = sum(curves[f"energy_{kind}"] for kind in SPENT)
    supplied = curves["energy_external"]
    return np.abs(supplied - spent).max() / np.abs(supplied).max()


@pytest.mark.parametrize("material", [ROCK, gl.Rigid(density=3100)], ids=["elastic", "rigid"])
@pytest.mark.parametrize("platens", Platens)
def test_a_test_begins_without_a_wave_at_any_speed(material, platens):
    """In a linear specimen the static solution is the motion, so that the ends carry the same force at every moment."""
    test = UniaxialCompression(loading=gl.Constant(speed=2.0), platens=platens, maximum_strain=2e-4, samples=20)
    found = gl.simulate(small_sample(material=material), Linear(**STIFF), test)
    assert found.summary["imbalance"] < 1e-4
    assert found.summary["kinetic_ratio"] < 1e-6
    assert found.curves["energy_damping"][-1] < 1e-4 * found.curves["energy_external"][-1]


def test_the_static_solution_of_a_column_is_that_of_springs_in_series():
    """Blocks that cannot become wider: strains by M = E (1 - nu)/((1 + nu)(1 - 2 nu)), jumps by kn."""
    height, rows, speed = 20e-3, 4, 0.5

    @attrs.define
    class First(gl.Observer):
        velocity: object = None

        def observe(self, state, curves, stage, progress):
            self.velocity = state.velocity if self.velocity is None else self.velocity

    sides = [gl.loads.Drive(boundary=side, axis=0, speed=0.0) for side in ("left", "right")]
    ends = [gl.loads.Drive(boundary="top", axis=1, speed=-1.0), gl.loads.Drive(boundary="bottom", axis=1, speed=0.0)]

    @attrs.frozen
    class Press(gl.LoadingProtocol):
        def stages(self, specimen):
            return [gl.Stage(name="press", loads=[*ends, *sides], loading=gl.Constant(speed=speed), interval=1e-8,
                             expected=2, until=[gl.conditions.Reaches("time", 1e-9)])]  # fmt: skip

        def measure(self, state):
            return {}

        def summary(self, curves, specimen):
            return {}

    specimen = gl.Specimen(Bricks(rows=rows).tessellate(rectangle(10e-3, height)), ROCK)
    watch = First()
    gl.simulate(specimen, Linear(**STIFF), Press(), observers=[watch])
    young, poisson = ROCK.youngs_modulus, ROCK.poissons_ratio
    confined = young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    stress = speed / (height / confined + (rows - 1) / STIFF["kn"])  # per second
    y, block = specimen.mesh.nodes[:, 1], specimen.mesh.node_grain
    expected = -stress * (y / confined + block / STIFF["kn"])
    assert np.abs(watch.velocity[:, 1] - expected).max() < 1e-6 * speed


@pytest.mark.thorough
@pytest.mark.parametrize("law", [BRITTLE, COHESIVE], ids=["brittle", "cohesive"])
def test_the_default_test_passes_its_certificate_and_closes_its_ledger(law):
    found = gl.simulate(small_sample(), law, CRUSH)
    if law is BRITTLE:  # in so small a sample one break of the other is a twentieth of the load
        assert found.summary["imbalance"] < 0.02
    assert found.summary["kinetic_ratio"] < 0.01
    assert ledger(found.curves) < 1e-6


@pytest.mark.thorough
@pytest.mark.parametrize(
    "law", [Friction(**STIFF, friction_angle=30), BartonBandis(**STIFF, friction_angle=30, closure=LinearClosure())]
)
def test_a_joint_that_slides_without_damage_bears_as_much_as_by_hand(law):
    """Jaeger 1960: a plane of friction at 45 degrees, 8 MPa; it would bear 4 % more as fast as a sound specimen."""
    pressure, friction, height, width = 8 * MPa, math.tan(math.radians(30)), 0.06, 0.016
    trace = [(-0.001, (height - width) / 2 - 0.001), (width + 0.001, (height + width) / 2 + 0.001)]
    blocks = Jointed(Bricks(rows=12, columns=3), {"joint": [trace]}).tessellate(rectangle(width, height))
    test = BiaxialCompression(confinement=pressure, until=gl.Until.FAILURE, samples=600)
    found = gl.simulate(gl.Specimen(blocks, ROCK, tied=["between"]), law, test).summary
    assert found["strength"] == pytest.approx(pressure * (1 + 2 * friction / (1 - friction)), rel=0.01)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("test", "to"), [(UniaxialCompression(), (50, 60)), (UniaxialTension(), (18, 10))], ids=["heated", "cooled"]
)
def test_a_stress_of_held_heat_is_part_of_what_a_specimen_bears(test, to):
    """It bears as much as at 20 °C, whatever the stress between its ends before they move."""
    rock = Thermal(material=ROCK, expansion=1e-5)
    for temperature in to:
        found = gl.simulate(
            small_sample(material=rock), BRITTLE, Heating(to=temperature, held=Held.ENDS, samples=20, test=test)
        )
        plain = gl.simulate(small_sample(), BRITTLE, test)
        assert found.curves["stress"][found.curves["stage"] < 2].max() > 0.1 * plain.summary["strength"]
        assert found.summary["strength"] == pytest.approx(plain.summary["strength"], rel=0.02)


@pytest.mark.thorough
def test_the_peak_is_that_of_slower_loading():
    found, slower = (
        gl.simulate(small_sample(), BRITTLE, attrs.evolve(CRUSH, loading=gl.Adaptive(rate=rate))).summary
        for rate in (0.0015, 0.0005)
    )
    assert found["strength"] == pytest.approx(slower["strength"], rel=0.02)
    assert found["steps"] < 0.6 * slower["steps"]


@pytest.mark.thorough
def test_the_speed_is_high_at_first_and_low_when_bonds_break():
    curves = gl.simulate(small_sample(), BRITTLE, CRUSH).curves
    speed, peak = curves["loading_speed"], borne_in(curves).at
    assert curves["damaged"][0] == 0
    assert speed[peak : peak + 5].min() < speed[0] / 10  # where the load falls


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("law", "test"),
    [
        (BRITTLE, Cyclic(test=CRUSH, levels=(5e-4, 8e-4))),
        (BRITTLE, BiaxialCompression(confinement=5 * MPa, samples=200)),
        (attrs.evolve(COHESIVE, closure=BandisClosure(maximum_closure=5e-6)), CRUSH),  # its time step changes
    ],
    ids=["cycles", "confined", "closure"],
)
def test_every_change_of_speed_and_step_is_in_the_ledger(law, test):
    assert ledger(gl.simulate(small_sample(), law, test).curves) < 1e-6


@pytest.mark.alone
def test_the_speed_does_not_depend_on_threads():
    first, other = (gl.simulate(small_sample(), BRITTLE, CRUSH, threads=threads).curves for threads in (1, 3))
    assert all(np.array_equal(first[name], other[name], equal_nan=True) for name in first)


def test_an_accuracy_that_cannot_be_had_ends_with_words_and_what_was_found():
    test = attrs.evolve(CRUSH, samples=1000, loading=gl.Adaptive(imbalance=1e-6))
    with pytest.raises(gl.StageError, match=r"compression': Adaptive: imbalance = 1e-06 cannot be had") as caught:
        gl.simulate(small_sample(), BRITTLE, test)
    assert len(caught.value.result.curves["stress"]) > 10


@pytest.mark.thorough
def test_damping_of_all_motion_drags_the_load():
    """Where bonds break, it takes the sign of the load's own motion: the end that moves carries more, on the mean."""
    press = attrs.evolve(CRUSH, loading=gl.Constant(speed=0.2), stop_fraction=0.9)
    drag = []
    local = gl.integration.LocalDamping()
    for integrator in (
        gl.integration.CentralDifference(damping=local),
        gl.integration.CentralDifference(damping=local, beside_loading=False),
    ):
        curves = gl.simulate(small_sample(), BRITTLE, attrs.evolve(press, integrator=integrator)).curves
        damaged = slice(int(np.argmax(curves["damaged"] > 0)), int(np.argmax(curves["stress"])))
        drag.append(np.mean((curves["stress_top"] - curves["stress_bottom"])[damaged]) / curves["stress"].max())
    assert abs(drag[0]) < 0.2 * drag[1]


@given(
    speed=SPEEDS, span=SPEEDS, inertia=SPEEDS, frequency=st.floats(1, 1e6), stored=st.floats(0, 1e3),
    damaged=st.booleans(), released=st.floats(0, 10), imbalance=st.floats(0, 1),
)  # fmt: skip
def test_an_adaptive_speed_stays_in_its_bounds(**seen):
    adaptive, pace = gl.Adaptive(), Pace(**seen)
    fast = adaptive.first(pace)
    wanted, again = adaptive.next(pace)
    assert 0 < wanted <= max(fast, pace.speed)
    if again:
        assert wanted < pace.speed
    if pace.damaged and pace.released > RELEASED and pace.imbalance < adaptive.imbalance:
        kinetic, slowest = 0.5 * pace.inertia * wanted**2, fast / 500
        assert wanted <= 1.001 * slowest or kinetic <= 1.001 * adaptive.rate**2 * pace.stored * (2 if again else 4)


@pytest.mark.parametrize(
    ("seen", "expected"),
    [
        ({"speed": 1.0}, (1.1, False)),  # intact: up to 20 x 0.001 x 1e5 / s x 1 mm = 2 m/s
        ({"speed": 1.9}, (2.0, False)),
        ({"speed": 3.9}, (2.0, False)),
        ({"speed": 4.1}, (2.0, True)),
        ({"speed": 0.4, "fastest": 0.3}, (0.3, False)),
        ({"speed": 0.03, "damaged": True}, (0.033, False)),  # up to 4 times 0.001 of the 10 m/s that store so much
        ({"speed": 0.07, "damaged": True}, (0.04, False)),
        ({"speed": 0.09, "damaged": True}, (0.04, True)),
        ({"speed": 0.015, "damaged": True, "stored": 0.0}, (0.016, False)),  # 4 times a 500th of that at first
        ({"speed": 0.019, "damaged": True, "released": 0.01}, (0.02, False)),  # twice: half of 2 % is released
        ({"speed": 0.019, "released": 0.01}, (0.02, False)),
        ({"speed": 0.019, "damaged": True, "released": 0.08}, (0.01, False)),
        ({"speed": 0.039, "soft": True}, (0.04, False)),
        ({"speed": 0.03, "vibration": 0.0036}, (0.02, False)),  # (3 / 2)^2 times the energy that the loading may have
        ({"speed": 1.0, "vibration": 0.64}, (0.05, True)),
        ({"speed": 1.0, "vibration": 0.00159}, (1.1, False)),
        ({"speed": 0.019, "vibration": 1.0}, (0.01, False)),
        ({"speed": 1.0, "imbalance": 0.05}, (0.5, True)),
        ({"speed": 1.0, "imbalance": 0.01}, (1.1, False)),
        ({"speed": 0.02, "imbalance": 0.05, "released": 0.02}, (0.014, False)),
        ({"speed": 0.0016, "imbalance": 0.05, "released": 0.02}, (0.00125, False)),  # the lowest: an eighth
        ({"speed": 0.00125, "imbalance": 0.05, "least_imbalance": 0.01}, (0.00125, False)),
        ({"speed": 0.3, "imbalance": 0.05, "stored": 1e8}, (0.25, True)),
    ],
)
def test_the_next_speed_is_by_hand(seen, expected):
    pace = Pace(**{"span": 1e-3, "inertia": 2.0, "frequency": 1e5, "stored": 100.0} | seen)
    speed, again = gl.Adaptive(rate=0.001, imbalance=0.01).next(pace)
    assert (speed, again) == (pytest.approx(expected[0]), expected[1])


def test_how_long_a_stage_takes_and_how_it_is_slowed_down():
    assert gl.Adaptive(rate=0.001).usual(1e-3, 1e5) == pytest.approx((0.05 + 0.25) / 100)
    assert gl.Adaptive(rate=0.001).slower() == gl.Adaptive(rate=0.0005)
    steady = gl.Constant(speed=0.1, ramp=1.1e-3)
    assert steady.usual(1e-3, 1e5) == pytest.approx(0.01)
    assert steady.slower() == gl.Constant(speed=0.05, ramp=2.2e-3)
    assert steady.delay(1e-5) == 6  # half of the ramp: 55 um


def test_a_stage_lasts_no_less_than_a_sample():
    stage = {"name": "wait", "until": [gl.conditions.AtRest(), gl.conditions.Lasts(1e-4)]}
    assert gl.Stage(**stage, interval=1e-4).interval == 1e-4
    with pytest.raises(
        gl.ParameterError, match=r"Stage 'wait': interval = 0\.001 is not allowed, .* at most the 0\.0001 s"
    ):
        gl.Stage(**stage, interval=1e-3)


def test_loading_is_checked():
    stage = {"name": "load", "until": [gl.conditions.Reaches("time", 1)], "interval": 1e-6, "loading": gl.Adaptive()}
    moving, still = (gl.loads.Drive(boundary="top", axis=1, speed=speed) for speed in (1.0, 0.0))
    with pytest.raises(gl.ParameterError, match="Stage 'load': a loading needs expected"):
        gl.Stage(**stage, loads=[moving])
    with pytest.raises(gl.ParameterError, match="Stage 'load': a loading needs a drive whose speed is not 0"):
        gl.Stage(**stage, loads=[still], expected=10)
    heats = gl.HeatingRate(rate=1e5)
    with pytest.raises(gl.ParameterError, match="not allowed without a temperature"):
        gl.Stage(**stage | {"loading": heats}, loads=[moving], expected=10)
    with pytest.raises(gl.ParameterError, match=r"must be one in K/s .* such as Adaptive\(\) or HeatingRate"):
        gl.Stage(**stage | {"loading": gl.Constant(speed=0.1)}, loads=[gl.loads.Heat(to=60)], expected=10)
    for loads, more in (([moving], {}), ([], {"static": True})):
        with pytest.raises(gl.ParameterError, match="a stage with a temperature holds its boundaries"):
            gl.Stage(**stage | more, loads=[*loads, gl.loads.Heat(to=60)], expected=10)
    with pytest.raises(gl.ParameterError, match="it has 2 temperatures to come to, it can have one"):
        gl.Stage(**stage, loads=[gl.loads.Heat(to=60), gl.loads.Heat(to=70)], expected=10)
    assert gl.Stage(**stage, loads=[still, gl.loads.Heat(to=60)], expected=10).loading == gl.Adaptive()
    assert heats.slower() == gl.HeatingRate(rate=5e4)
    with pytest.raises(gl.ParameterError, match=r"Adaptive: rate = 0\.5 is not allowed"):
        gl.Adaptive(rate=0.5)
    for without_end in ("rate", "imbalance"):
        with pytest.raises(gl.ParameterError, match=f"Adaptive: {without_end} = 0 is not allowed"):
            gl.Adaptive(**{without_end: 0})
    with pytest.raises(gl.ParameterError, match=r"loading = 0\.05 is not allowed"):
        UniaxialTension(loading=0.05)
    assert math.isinf(Pace(span=1, inertia=1, frequency=1).fastest)


UNITS = set()


@attrs.frozen(kw_only=True)
class Noting(Loading):
    """Notes in which unit a stage counts its speed."""

    speed: float

    def first(self, pace):
        return self.speed

    def next(self, pace):
        UNITS.add(pace.unit)
        return self.speed, False

    def slower(self):
        return self


def test_a_loading_knows_the_unit_of_its_speed():
    one = gl.Specimen(
        Bricks(rows=1, columns=1).tessellate(rectangle(0.01, 0.01)), Thermal(material=ROCK, expansion=8e-6)
    )
    press = UniaxialCompression(samples=10, maximum_strain=1e-5, loading=Noting(speed=1.0))
    for test, unit in ((Heating(to=30, samples=10, loading=Noting(speed=1e5)), "K/s"), (press, "m/s")):
        UNITS.clear()
        gl.simulate(one, Linear(**STIFF), test, threads=1, frames=2)
        assert UNITS == {unit}
    seen = Pace(speed=2.0, unit="K/s", span=1.0, inertia=1.0, frequency=1e6, imbalance=1.0, least_imbalance=1.0)
    with pytest.raises(gl.AccuracyError, match=r"at 2 K/s$"):
        gl.Adaptive(rate=0.04).next(seen)


class Watching(Loading):
    """Keeps what it is told."""

    def first(self, pace):
        return 0.5

    def next(self, pace):
        TOLD.append((pace.imbalance, pace.least_imbalance))
        return 0.5, False

    def slower(self):
        return self


TOLD = []


def test_a_loading_is_told_the_least_of_the_last_imbalances():
    TOLD.clear()
    test = UniaxialCompression(samples=12, maximum_strain=1e-4, loading=Watching())
    gl.simulate(small_sample(12), BRITTLE, test, threads=1, frames=1, progress=False)
    last, least = np.transpose(TOLD)
    assert np.ptp(last) > 0
    assert not least[: RECENT - 1].any()
    windows = np.lib.stride_tricks.sliding_window_view(last, RECENT)
    assert least[RECENT - 1 :].tolist() == windows.min(axis=1).tolist()


def test_tests_refuse_loadings_of_another_kind():
    with pytest.raises(
        gl.ParameterError, match=r"UniaxialTension: loading = .* must be a Loading such as .* no HeatingRate"
    ):
        UniaxialTension(loading=gl.HeatingRate(rate=1.0))
    with pytest.raises(gl.ParameterError, match=r"Heating: loading = .* must be a Loading such as .* no Constant"):
        Heating(to=100, loading=gl.Constant(speed=0.1))
