"""Every integrator: order, energy, stability, and rest where it is meant to find it."""

import inspect

import attrs
import numpy as np
import pytest
from support import BRITTLE, ROCK, STIFF, small_sample

import grainlaw as gl
from grainlaw.conditions import AtRest, Reaches
from grainlaw.geometry import Bricks, rectangle
from grainlaw.integration import (
    AdaptiveRelaxation,
    CentralDifference,
    DynamicRelaxation,
    Integrator,
    KineticRelaxation,
    LocalDamping,
    MassDamping,
    Motion,
    SwayDamping,
    Undamped,
    VibrationDamping,
)
from grainlaw.laws import Linear, Viscous
from grainlaw.loads import Drive, Traction
from grainlaw.protocols import FreeMotion, UniaxialCompression

#: how each integrator is tried: with nothing that damps, and as users take it
FREE = [CentralDifference(damping=Undamped()), DynamicRelaxation()]
DAMPED = [
    CentralDifference(),
    CentralDifference(damping=LocalDamping()),
    CentralDifference(damping=MassDamping(coefficient=3e5)),
    DynamicRelaxation(),
    DynamicRelaxation(relaxation=KineticRelaxation(), burst=5),
]
ids = [f"{type(i).__name__}-{type(getattr(i, 'relaxation', i.damping)).__name__}" for i in DAMPED]


def test_lists_hold_every_exported_integrator():
    exported = {
        value for value in vars(gl.integration).values()
        if inspect.isclass(value) and issubclass(value, Integrator) and value is not Integrator
    }  # fmt: skip
    assert exported == {type(i) for i in FREE} == {type(i) for i in DAMPED}


def oscillate(integrator, time_step, time, mass=2.0, frequency=100.0):
    """Positions of one mass on a spring, let go from 1 m."""
    place, velocity = 1.0, 0.0
    velocity = 0.5 * mass * frequency**2 * place * time_step / mass  # half a step back
    places, earlier = [place], 0.0
    for _ in range(round(time / time_step)):
        force = -mass * frequency**2 * place
        velocity, _ = integrator.step(force, force - earlier, velocity, mass, time_step)
        earlier = force
        place = integrator.move(place, velocity, time_step)
        places.append(place)
    return np.array(places)


@pytest.mark.parametrize("integrator", FREE, ids=lambda i: type(i).__name__)
def test_second_order(integrator):
    errors = [abs(oscillate(integrator, dt, 0.1)[-1] - np.cos(10.0)) for dt in (2e-4, 1e-4, 5e-5)]
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(4, rel=0.05)


@pytest.mark.parametrize("integrator", FREE, ids=lambda i: type(i).__name__)
def test_a_free_oscillator_keeps_its_amplitude(integrator):
    places = oscillate(integrator, 1e-3, 100.0)
    assert places[-1000:].max() == pytest.approx(places[:1000].max(), rel=1e-3)


@pytest.mark.parametrize("integrator", [*FREE, DAMPED[0]], ids=lambda i: type(i).__name__)
def test_stable_at_its_step_and_not_far_beyond(integrator):
    frequency = 100.0
    step = integrator.stable_step(frequency)
    beyond = 1.2 * step / integrator.safety
    assert np.abs(oscillate(integrator, step, 2000 * step, frequency=frequency)).max() < 3
    with np.errstate(all="ignore"):
        assert not np.abs(oscillate(integrator, beyond, 2000 * step, frequency=frequency)).max() < 1e6


@pytest.mark.parametrize("damping", [MassDamping(coefficient=4.0), SwayDamping(fraction=0.0, coefficient=4.0)])
def test_what_is_damped_by_mass_decays_at_its_rate(damping):
    integrator = CentralDifference(damping=damping)
    places = oscillate(integrator, 1e-4, 1.0)
    peaks = places[1:-1][(places[1:-1] > places[:-2]) & (places[1:-1] > places[2:])]
    period = 2 * np.pi / np.sqrt(100.0**2 - 2.0**2)
    assert peaks[1:] / peaks[:-1] == pytest.approx(np.exp(-2.0 * period), rel=2e-3)


def test_forces_of_dampings_by_hand():
    """On 2 kg that move by 3 m/s under 8 N, in a step of 0.5 s; a change of the force, and the force."""
    local, vibration = LocalDamping(fraction=0.6), VibrationDamping(fraction=0.6)
    sway = SwayDamping(fraction=0.6, coefficient=1.5)
    for force in (8.0, -8.0):
        for speed, wanted in ((3.0, -4.8), (0.0, 0.0), (-3.0, 4.8)):
            assert local.force(force, 1.0, speed, 2.0, 0.5) == pytest.approx(wanted)
        for change, wanted in ((1.0, 4.8), (0.0, 0.0), (-1.0, -4.8)):
            assert vibration.force(force, change, 3.0, 2.0, 0.5) == pytest.approx(wanted)
            assert sway.force(force, change, 3.0, 2.0, 0.5) == pytest.approx(wanted - 1.5 * 2 * 3)
    drag = CentralDifference(damping=MassDamping(coefficient=1.5))
    for integrator in (drag, DynamicRelaxation(damping=drag.damping)):
        after, resistance = integrator.step(8.0, 1.0, 3.0, 2.0, 0.5)
        assert resistance == pytest.approx(-1.5 * 2 * (3 + after) / 2)  # by the mean velocity of the step
        assert after == pytest.approx(3 + (8 + resistance) / 2 * 0.5)


def test_steps_and_dampings_of_stages_by_hand():
    damping = VibrationDamping(fraction=0.44)
    integrator = CentralDifference(damping=damping)
    assert integrator.stable_step(100.0) == pytest.approx(0.9 * 2 / 100 / 1.2)
    assert CentralDifference(damping=Undamped()).stable_step(100.0) == pytest.approx(0.3 * 2 / 100)
    assert DynamicRelaxation().stable_step(100.0) == pytest.approx(0.9 * 2 / 100)
    assert integrator.seeking_rest().damping == LocalDamping(fraction=0.44)
    sway = SwayDamping(fraction=0.44, coefficient=5.0)  # of a mode of 50 / s: 5 % of its critical damping
    assert integrator.holding_sway(50.0).damping == sway
    for other in (LocalDamping(), Undamped()):
        assert (other.seeking_rest(), other.holding_sway(50.0)) == (other, other)


def test_relaxations_choose_by_hand():
    """Rayleigh's quotient of masses of 2 and 3 kg that moved by 1 and 2 m as their forces fell by 8 and 30 N."""
    rows = {"velocity": np.array([[1.0, 2.0]]), "mass": np.array([[2.0, 3.0]])}
    start = Motion(**rows, displacement=np.array([[5.0, 1.0]]), force=np.array([[9.0, 40.0]]))
    now = Motion(**rows, displacement=np.array([[6.0, 3.0]]), force=np.array([[1.0, 10.0]]))
    assert now.kinetic_energy == 0.5 * (2 * 1 + 3 * 4)
    critical = 2 * np.sqrt((1 * 8 + 2 * 30) / (2 * 1 + 3 * 4))
    chosen, halt = DynamicRelaxation().adapt(now, start)
    assert (chosen.damping.coefficient, halt) == (pytest.approx(critical), False)
    pushed = attrs.evolve(now, force=np.array([[20.0, 50.0]]))
    for motion, before in ((now, None), (pushed, start), (now, now)):
        assert AdaptiveRelaxation().choose(motion, before) == (0.0, False)
    slower = attrs.evolve(now, velocity=np.array([[1.0, 1.9]]))
    for motion, before, halts in ((slower, now, True), (now, slower, False), (now, now, False), (now, None, False)):
        assert KineticRelaxation().choose(motion, before) == (0.0, halts)


@pytest.mark.parametrize("damping", [VibrationDamping(), LocalDamping()], ids=lambda d: type(d).__name__)
def test_damping_does_not_feel_a_motion_without_force(damping):
    integrator = CentralDifference(damping=damping)
    for speed in (3.0, 0.0):
        assert integrator.step(0.0, 0.0, speed, 1.0, 1e-3) == (speed, 0.0)


def test_both_dampings_of_a_vibration_are_one():
    """Its force changes against its velocity; of the energy (1 - a) / (1 + a) is left from side to side."""
    frequency = 100.0
    ways = [
        oscillate(CentralDifference(damping=damping(fraction=0.3)), 1e-4, 0.2, frequency=frequency)
        for damping in (VibrationDamping, LocalDamping)
    ]
    for places in ways:
        turns = np.abs(places[1:-1][np.diff(np.sign(np.diff(places))) != 0])
        assert turns[1:4] / turns[:3] == pytest.approx(np.sqrt((1 - 0.3) / (1 + 0.3)), rel=0.03)


@pytest.mark.parametrize("ramp", [2e-6, 5e-6, 1e-5, 4e-5])
def test_what_creeps_is_not_dragged(ramp):
    """A viscous joint under a step of stress: the mean delay of its opening is its retardation time, rings or not.

    With H(s) = k / (m s^2 + c s + k) the mean delay of the response to a step is -H'(0) = c / k.
    """
    delay, height, bond = 2e-5, 10e-3, attrs.evolve(BRITTLE, kn=1e13, ks=1e13)
    specimen = gl.Specimen(
        Bricks(rows=2, columns=1).tessellate(rectangle(height, 2 * height)),
        gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.0, density=2700.0),
    )
    curves = gl.simulate(specimen, Viscous(law=bond, retardation=delay), Pulled(ramp=ramp), frames=1).curves
    times, share = np.append(0.0, curves["time"]), np.append(0.0, curves["opening"] * bond.kn / 1e6)
    assert share[-1] == pytest.approx(1, abs=1e-3)
    assert np.trapezoid(1 - share, times) - ramp / 2 == pytest.approx(delay, rel=0.01)


@attrs.frozen(kw_only=True)
class Pulled(gl.LoadingProtocol):
    """A tension of 1 MPa that stays."""

    ramp: float

    def stages(self, specimen):
        pull = Traction(boundary="top", stress=(0.0, 1e6, 0.0), ramp=self.ramp)
        ground = Drive(boundary="bottom", axis=1, speed=0.0)
        return [gl.Stage(
            name="pull", loads=[ground, pull], until=[Reaches("time", 2.4e-4)], interval=1e-6
        )]  # fmt: skip

    def measure(self, state):
        return {"opening": float(state.opening.mean())}

    def summary(self, curves, specimen):
        return {}


@pytest.mark.thorough
def test_a_fall_is_not_dragged():
    """g t^2 / 2, by default; local damping takes 0.8 of the weight."""
    grain = Bricks(rows=1, columns=1).tessellate(rectangle(1e-2, 1e-2))
    for integrator, share in (
        (CentralDifference(), 1.0),
        (CentralDifference(damping=LocalDamping()), 0.2),
    ):
        test = FreeMotion(duration=0.01, samples=1000, integrator=integrator)
        moved = gl.simulate(gl.Specimen(grain, gl.Rigid(density=2700)), Linear(**STIFF), test).summary["centre_moved_y"]
        assert moved == pytest.approx(-share * 9.81 * 0.01**2 / 2, rel=0.02)  # the first step is from rest


def test_a_stage_that_waits_for_rest_damps_all_motion():
    common = {"name": "stage", "interval": 1e-6}
    held, timed = (
        gl.Stage(until=[AtRest()], **common),
        gl.Stage(until=[Reaches("time", 1.0)], **common),
    )
    assert held.moved_by == CentralDifference(damping=LocalDamping())
    assert timed.moved_by == CentralDifference()
    undamped = CentralDifference(damping=Undamped())
    assert attrs.evolve(held, integrator=undamped).moved_by == undamped
    slack = CentralDifference(damping=VibrationDamping(fraction=0.5), safety=0.6)
    assert slack.seeking_rest() == CentralDifference(damping=LocalDamping(fraction=0.5), safety=0.6)


def test_undamped_steps_are_shorter_by_default():
    assert CentralDifference(damping=Undamped()).safety == 0.3
    assert CentralDifference(damping=Undamped(), safety=0.9).safety == CentralDifference().safety == 0.9


@attrs.frozen(kw_only=True)
class Settle(gl.LoadingProtocol):
    """Press the top down, then wait for rest."""

    integrator: Integrator

    def stages(self, specimen):
        def drives(speed):
            return [
                Drive(boundary="bottom", axis=1, speed=0),
                Drive(boundary="top", axis=1, speed=speed),
            ]

        return [
            gl.Stage(name="press", loads=drives(-0.5), until=[Reaches("time", 1e-5)], interval=1e-6),
            gl.Stage(
                name="rest", loads=drives(0.0), until=[AtRest(1e-7)], interval=1e-5,
                integrator=self.integrator, sample_limit=2000,
            ),
        ]  # fmt: skip

    def measure(self, state):
        return {"top": state.reaction("top")[1], "bottom": state.reaction("bottom")[1], "moved": state.moved("top")[1]}

    def summary(self, curves, specimen):
        return {"force": curves["top"][-1], "moved": curves["moved"][-1]}


@pytest.mark.parametrize("integrator", DAMPED, ids=ids)
def test_finds_rest_where_statics_has_it(integrator):
    specimen = gl.Specimen(Bricks(rows=4, columns=2).tessellate(rectangle(10e-3, 20e-3)), ROCK)
    result = gl.simulate(specimen, Linear(**STIFF), Settle(integrator=integrator))
    top, bottom = result.curves["top"][-1], result.curves["bottom"][-1]
    assert top == pytest.approx(-bottom, rel=1e-4)
    stress = top / 10e-3
    rock = 60e9 / (1 - 0.25**2)
    modulus = 1 / (1 / rock + 3 / (STIFF["kn"] * 20e-3))
    assert stress == pytest.approx(modulus * result.curves["moved"][-1] / 20e-3, rel=2e-3)
    assert result.summary["energy_error"] < 0.005


def test_simulate_puts_its_integrator_in_the_place_of_the_tests():
    """In every stage: the curves are those of the test that was given it, to the last digit."""
    law, test = Linear(**STIFF), UniaxialCompression(loading=gl.Constant(speed=0.2), maximum_strain=1e-4, samples=20)
    undamped = CentralDifference(damping=Undamped(), safety=0.5)
    own = gl.simulate(small_sample(20), law, attrs.evolve(test, integrator=undamped))
    given = gl.simulate(small_sample(20), law, test, integrator=undamped)
    assert own.curves.keys() == given.curves.keys()
    assert all(np.array_equal(own.curves[name], given.curves[name]) for name in own.curves)
    assert given.curves["energy_damping"][-1] == 0
    everything = CentralDifference(damping=LocalDamping(), beside_loading=False)  # what follows the load, too
    assert gl.simulate(small_sample(20), law, test, integrator=everything).curves["energy_damping"][-1] > 0
    compared = gl.compare(small_sample(20), {"linear": law}, test, integrator=undamped)["linear"]
    assert np.array_equal(compared.curves["stress"], given.curves["stress"])


def test_simulate_refuses_what_is_no_integrator():
    with pytest.raises(gl.ParameterError, match=r"integrator = 0\.8 is not allowed, it must be an Integrator or None"):
        gl.simulate(small_sample(20), Linear(**STIFF), UniaxialCompression(), integrator=0.8)


def test_kinetic_relaxation_of_rigid_grains_keeps_its_ledger():
    test = Settle(integrator=DynamicRelaxation(relaxation=KineticRelaxation(), burst=5))
    result = gl.simulate(small_sample(20, material=gl.Rigid(density=3100)), Linear(**STIFF), test)
    assert result.summary["energy_error"] < 0.005
    assert result.curves["energy_damping"][-1] > 0


def test_relaxation_is_faster_than_local_damping():
    steps = [
        gl.simulate(small_sample(30), Linear(**STIFF), Settle(integrator=integrator)).summary["steps"]
        for integrator in (DynamicRelaxation(), CentralDifference())
    ]
    assert steps[0] < steps[1]


def test_mass_scaling_lengthens_the_step_and_says_what_it_added():
    specimen, law = small_sample(60), Linear(**STIFF)
    test = Settle(integrator=DynamicRelaxation())
    plain = gl.simulate(specimen, law, test)
    scaled = gl.simulate(specimen, law, test, mass_scaling=1.3)
    assert scaled.summary["time_step"] == pytest.approx(1.3 * plain.summary["time_step"], rel=0.02)
    assert 0 < scaled.summary["mass_added"] < 0.2
    assert plain.summary["mass_added"] == 0
    stiffness = [r.summary["force"] / r.summary["moved"] for r in (plain, scaled)]
    assert stiffness[0] == pytest.approx(stiffness[1], rel=1e-3)


@attrs.frozen(kw_only=True)
class Fall(gl.LoadingProtocol):
    damping: gl.integration.Damping

    def stages(self, specimen):
        free = CentralDifference(damping=self.damping)
        ends = [gl.conditions.Lasts(2e-4)]
        return [gl.Stage(name="fall", loads=[gl.loads.Gravity()], interval=1e-5, until=ends, integrator=free)]

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {}


def test_energy_that_the_damping_makes_is_told():
    """A body that falls goes too fast by it; the energy of a free fall is that of gravity, m (g t)^2 / 2."""
    found = {}
    for damping in (VibrationDamping(), Undamped()):
        result = gl.simulate(small_sample(12), Linear(**STIFF), Fall(damping=damping))
        fallen = 0.5 * result.specimen.node_masses.sum() * (9.81 * result.curves["time"][-1]) ** 2
        found[type(damping)] = result.curves["energy_kinetic"][-1] / fallen, "the damping made" in str(result.doubts)
    assert found[Undamped] == (pytest.approx(1, rel=0.02), False)
    assert found[VibrationDamping] == (pytest.approx(1.3, abs=0.3), True)
