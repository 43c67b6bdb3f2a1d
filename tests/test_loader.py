"""What a loading is told after a sample and what it makes of the steady motion, of numbers that are given."""

import math
import time
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import STIFF, small_sample, state_of

import grainlaw as gl
from grainlaw.engine.parts.steady import Steady
from grainlaw.engine.state import State
from grainlaw.laws import Linear
from grainlaw.loading import Adaptive, Constant
from grainlaw.protocols import FreeMotion
from grainlaw.runs import execution, stepper
from grainlaw.runs import loader as loaders
from grainlaw.runs.checkpoint import Counters
from grainlaw.runs.execution import Execution
from grainlaw.runs.loader import Loader, _Seen

MASS = np.array([[1.0, 2.0], [1.0, 2.0], [9.0, 9.0]])
SEEN = _Seen(span=2.0, inertia=4e6, frequency=0.5, supplied=10.0, lost=3.0, momentum=(1.0, 2.0), load=50.0, force=2.0,
             stored=6.0, released=0.2, way=7.0, fastest=9.0)  # fmt: skip


def loader(seen=SEEN, load=40.0, pace=2.0, time=9.0, momentum=(3.0, 8.0), damage=(0.0, 0.5, 1.0)):
    """Of a state in which vibration has 5 J/m; of rows that turn the momentum does not count."""
    velocity = np.array([[momentum[0], 0.0], [0.0, momentum[1] / 2], [7.0, 7.0]])
    steady = SimpleNamespace(pace=pace, vibration=lambda: 5.0, velocity=np.zeros(2), rises=False)
    made = object.__new__(Loader)
    made._seen = made._new = seen
    made._wanted, made._highest, made._margin, made._sound, made._repeated = 1.0, 10.0, None, None, 0
    made._state = SimpleNamespace(
        steady=steady, freedoms=SimpleNamespace(arrays=SimpleNamespace(mass=MASS, velocity=velocity)), time=time,
        began=4.0, boundaries=SimpleNamespace(largest_load=lambda: load), time_step=1e-3, usual_end=0.0,
        bonds=SimpleNamespace(memory=lambda name, otherwise: np.array(damage)), slip=np.zeros(3),
        beyond_elastic=np.zeros((2, 3)), heat=SimpleNamespace(sign=0, target=None, temperature=20.0),
    )  # fmt: skip
    return made


def energies(**changed):
    kinds = {"external": 30.0, "zones_thermal": 4.0, "damping": 6.0, "zones": 1.0, "contacts_normal": 2.0,
             "contacts_shear": 5.0}  # fmt: skip
    return kinds | changed


def test_what_a_sample_tells_by_hand():
    """Of 0.25 s at 2 m/s; the noise is a millionth of 4e6 * 2^2 / 2 J/m."""
    found = loader()._look(energies(), 0.25)
    assert found.way == 7.0 + 0.5
    assert (found.supplied, found.lost) == (26.0, 11.0)
    assert found.force == (26 - 10) / 0.5
    assert found.vibration == 0.0  # less than the noise
    assert found.released == pytest.approx(0.2 * math.exp(-0.25 * 0.5 / (2 * math.pi * 5)))
    assert (found.load, found.stored, found.momentum) == (50.0, 8.0, (3.0, 8.0))
    assert found.fallen  # below 0.95 of the largest load
    assert found.imbalances == (0.0,)  # it counts no more
    assert found.impulses == ((4.0, 0.0, 0.0), (9.0, 2.0, 6.0))
    assert found.imbalance == 6 / 5 / 50
    less = loader(attrs.evolve(SEEN, inertia=2e6), pace=1.0)._look(energies(), 0.25)  # the noise is 1 J/m
    assert (less.vibration, less.released) == (4.0, pytest.approx(7 / (64 * 0.25)))


def test_a_load_that_holds_shows_its_imbalance():
    """By the larger gain of momentum, over the time and the largest load."""
    seen = attrs.evolve(SEEN, imbalances=(0.1, 0.2, 0.3, 0.4, 0.5))
    found = loader(seen, load=100.0, momentum=(6.0, 5.0))._look(energies(), 0.25)
    assert not found.fallen
    assert found.imbalances == (0.2, 0.3, 0.4, 0.5, 5 / 0.25 / 100)
    assert found.load == 100.0
    still = loader(load=48.0)._look(energies(), 0.25)  # 0.96 of the largest
    assert not still.fallen
    weak = loader(attrs.evolve(SEEN, least=60.0), load=10.0)._look(energies(), 0.25)
    assert not weak.fallen  # no load yet
    assert weak.imbalances == (6 / 0.25 / 60,)
    own = loader(attrs.evolve(SEEN, inner=40.0))._look(energies(), 0.25)  # its own stresses bear more
    assert own.imbalance == pytest.approx(6 / 5 / (40 * math.sqrt(8)))
    before = attrs.evolve(SEEN, impulses=((2.0, 1.0, 1.0), (3.0, 8.0, 8.0), (6.0, 9.0, -4.0)))
    assert loader(before)._look(energies(), 0.25).imbalance == pytest.approx((9 + 2 - 1) / (9 - 2) / 50)
    free = loader(attrs.evolve(SEEN, load=0.0), load=0.0)._look(energies(), 0.25)
    assert (free.imbalance, free.imbalances) == (0.0, (0.0,))


def test_the_first_sample_of_a_stage_has_nothing_to_compare_with():
    found = loader(attrs.evolve(SEEN, supplied=math.nan, released=0.0, force=1.0))._look(energies(), 0.25)
    assert (found.supplied, found.lost, found.force, found.released) == (26.0, 11.0, 1.0, 0.0)


def test_impulses_are_those_of_the_last_period():
    """Which is 2 pi / 0.5 = 12.57 s: from the last sample before it on."""
    times = (0.0, 2.0, 3.0, 8.0)
    seen = attrs.evolve(SEEN, impulses=tuple((time, time, -time) for time in times))
    assert loader(seen, time=15.0)._impulses(seen, [1.0, 2.0]) == (
        (2.0, 2.0, -2.0), (3.0, 3.0, -3.0), (8.0, 8.0, -8.0), (15.0, 9.0, -6.0),
    )  # fmt: skip
    late = loader(seen, time=100.0)._impulses(seen, [0.0, 0.0])
    assert [one[0] for one in late] == [8.0, 100.0]


def test_a_loading_is_told_what_was_seen():
    seen = attrs.evolve(SEEN, imbalances=(0.3, 0.1, 0.2, 0.5, 0.4), settled=1.0, vibration=0.7)
    pace = loader(seen)._pace()
    told = attrs.asdict(pace)
    assert told == {
        "speed": 2.0, "unit": "m/s", "span": 2.0, "inertia": 4e6, "frequency": 0.5, "fastest": 9.0, "stored": 6.0,
        "vibration": 0.7, "damaged": True, "soft": True, "released": 0.2, "imbalance": 0.4, "least_imbalance": 0.1,
    }  # fmt: skip
    fresh = loader(damage=(0.0, 0.0))._pace()
    assert (fresh.damaged, fresh.soft, fresh.imbalance, fresh.least_imbalance) == (False, False, 0.0, 0.0)
    few = loader(attrs.evolve(seen, imbalances=(0.3, 0.1, 0.2, 0.5)))._pace()
    assert (few.imbalance, few.least_imbalance) == (0.5, 0.0)


@pytest.mark.parametrize(
    ("change", "due"),
    [
        ({}, True),  # it was never found
        ({"stability": 0.5, "asked": 6.99}, False),  # nearer than a hundredth of the span
        ({"stability": 0.5, "asked": 6.9}, True),  # damaged since
        ({"stability": 0.5, "asked": 6.9, "damaged": 2}, False),
        ({"stability": 0.5, "asked": 6.0, "damaged": 2}, True),  # farther than 0.15 of the way when it was asked for
        ({"stability": 0.5, "asked": 6.2, "damaged": 2}, False),
        ({"stability": 0.5, "asked": 6.99, "weakening": 5.1}, True),  # it has fallen by a tenth of 0.5
        ({"stability": 0.5, "asked": 6.99, "weakening": 4.9}, False),
        ({"stability": 0.05, "asked": 6.99, "weakening": 1.1}, True),  # or of 0.1
        ({"stability": 0.05, "asked": 6.99, "weakening": 0.9}, False),
        ({"stability": 0.5, "asked": 6.999, "settled": 1.0}, True),  # while the softest motion is settled
        ({"settled": 1.0, "fallen": True}, False),
    ],
)
def test_when_the_margin_is_asked_for(change, due):
    seen = attrs.evolve(SEEN, **change)
    assert loader()._margin_is_due(seen) is due


@pytest.mark.parametrize(
    ("margin", "frequency", "settled", "settles"),
    [
        (0.15, 1.0, 0.0, True),  # 0.39 / s: slower than the load, and soft
        (0.15, 2.0, 0.0, False),  # 0.77 / s: quicker than the 0.5 / s of the load
        (0.21, 1.0, 0.0, False),  # not soft
        (0.21, 1.0, 3.0, True),  # but it was before
        (-0.1, 9.0, 0.0, True),
    ],
)
def test_a_soft_motion_that_is_slower_than_the_load_is_settled(margin, frequency, settled, settles):
    """Since it was so last; how fast the margin fell counts from where it was asked for, at 5 m of 7 m."""
    ways, softened = [], []
    seen = attrs.evolve(SEEN, stability=0.3, asked=5.0, settled=settled)
    made = loader(seen)
    made._sound = "sound"
    made._state.steady.books = SimpleNamespace(softest=[1.0])
    made._state.steady.soften = softened.append
    made._margin = SimpleNamespace(
        find=lambda guess: SimpleNamespace(margin=margin, motion="motion", frequency=frequency),
        settle=lambda found, way: ways.append(way) or True,
    )
    found = made._ask_margin(Adaptive(), seen)
    assert (found.stability, found.asked, found.damaged) == (margin, 7.0, 2)
    assert found.weakening == pytest.approx((0.3 - margin) / 2)
    assert (ways, softened) == ([7.0 - settled] * settles, ["motion"])
    assert found.settled == (7.0 if settles else settled)
    first = made._ask_margin(Adaptive(), attrs.evolve(seen, stability=math.nan))
    assert first.weakening == pytest.approx((1.0 - margin) / 2)
    rising = made._ask_margin(Adaptive(), attrs.evolve(seen, stability=-0.5))
    assert rising.weakening == 0.0
    made._margin = SimpleNamespace(find=lambda guess: None)
    assert made._ask_margin(Adaptive(), seen) == attrs.evolve(seen, asked=7.0, damaged=2)
    near = attrs.evolve(seen, asked=6.999, settled=0.0)
    assert made._ask_margin(Adaptive(), near) is near  # not due
    made._sound = None
    assert made._ask_margin(Adaptive(), seen) is seen


def test_a_sample_is_taken_again_where_the_loading_asks_for_it():
    class Asks(Constant):
        def next(self, pace):
            asked.append(pace.released)
            return 0.25, True

    asked, made = [], loader(attrs.evolve(SEEN, inertia=0.0))
    stage = SimpleNamespace(loading=Asks(speed=1.0))
    assert made.accepts(stage, energies(), 8.75) is False
    assert asked == [8 / (32 * 0.5)]  # lost, over the force times the way of 0.25 s
    assert made._wanted == 0.25
    assert made.accepts(SimpleNamespace(loading=Constant(speed=1.0)), energies(), 8.75) is True
    assert made.accepts(SimpleNamespace(loading=None), energies(), 8.75) is True


def test_samples_have_as_many_steps_as_the_speed_asks_for_and_pieces_while_a_motion_is_soft():
    stage = SimpleNamespace(interval=0.1, pieces=15)
    assert loader().steps(stage) == 50
    assert loader().steps(stage, 4) == 12
    assert loader(pace=1e9).steps(stage) == 1
    heated = loader()
    heated._state.heat = SimpleNamespace(sign=1, target=100.0, temperature=99.857)  # 71.5 steps are left, or 74
    assert heated.steps(stage) == 72
    heated._state.heat = SimpleNamespace(sign=-1, target=20.0, temperature=20.16)
    assert heated.steps(stage) == 50
    assert loader().pieces(stage, False) == 1
    soft = attrs.evolve(SEEN, settled=1.0)
    assert loader(soft).pieces(stage, False) == 4  # 0.1 over 0.004 of 7
    assert loader(attrs.evolve(soft, way=0.5)).pieces(stage, False) == 10
    assert loader(attrs.evolve(soft, fallen=True)).pieces(stage, False) == 1
    for way, pieces in ((0.0, 15), (1.0, 15), (7.0, 12), (39.0, 3), (100.0, 1)):  # 0.1 over 1/800 of it, at most 15
        assert loader(attrs.evolve(SEEN, way=way)).pieces(stage, True) == pieces
    assert loader(attrs.evolve(soft, way=7.0)).pieces(stage, True) == 12


def test_a_stage_usually_ends_after_its_samples_at_the_speed_of_its_loading():
    made = loader()
    stage = SimpleNamespace(interval=0.5, expected=8, loading=Constant(speed=2.0))
    made._expect(stage)
    assert made._state.usual_end == 4.0 + 2.0
    made._expect(SimpleNamespace(interval=0.5, expected=8, loading=None))
    assert made._state.usual_end == 4.0 + 4.0
    made._expect(SimpleNamespace(interval=0.5, expected=8, loading=Adaptive(rate=0.001)))
    assert made._state.usual_end == pytest.approx(4.0 + (1 / 20 + 0.25) / (0.001 * 0.5))
    made._expect(SimpleNamespace(interval=0.5, expected=None, loading=None))
    assert made._state.usual_end == 0.0


@pytest.mark.parametrize(("time", "done"), [(4.9, False), (5.1, True)])
def test_a_ramp_is_done_after_its_time_since_the_stage_began(time, done):
    """Until then all motion is damped; beside the steady motion after it."""
    said = []
    made = loader(time=time)
    steady = made._state.steady
    steady.rises = True

    def rise(now, done):
        said.append((now, done))
        steady.rises = not done

    steady.rise, steady.damp_beside = rise, lambda beside: said.append(beside)
    integrator = SimpleNamespace(beside_loading="beside")
    made.look(SimpleNamespace(loading=Constant(speed=1.0, ramp=1.0), integrator=integrator))
    assert said == [(time, done), *["beside"] * done]


def test_the_steady_motion_follows_over_its_period():
    said = []
    made = loader()
    made._state.drives, made._state.imposed = "drives", SimpleNamespace(speeds="speeds")
    made._state.steady.follow = lambda *given: said.append(given)
    made.look(SimpleNamespace(loading=Adaptive()))
    assert said == [("drives", "speeds", 9.0, pytest.approx(4 * math.pi))]
    made.look(SimpleNamespace(loading=None))
    assert len(said) == 1


@pytest.mark.parametrize(
    ("begun", "fluids", "done"),
    [(0, [], [5, 5, 2]), (3, [], [2, 5, 5]), (14, [], [1, 5, 5, 1]), (4, ["fluid"], [1, 1, 3, 1, 2, 3, 1])],
)
def test_it_looks_after_every_so_many_steps_of_a_stage_wherever_a_part_begins(begun, fluids, done, monkeypatch):
    """Twelve steps of which every fifth is looked at, from where the part before had ended; fluids every third."""
    monkeypatch.setattr(stepper, "FLOW", 3)
    looked, flowed, counts = [], [], []
    state = SimpleNamespace(
        steps=100 + begun, let_membranes_follow=lambda: None,
        let_fluids_follow=lambda: flowed.append(state.steps - 100), let_heat_flow=lambda: 0,
    )  # fmt: skip

    def do(steps):
        counts.append(steps)
        state.steps += steps

    part = SimpleNamespace(
        state=state, stop=gl.Stop(), first=100,
        stability=SimpleNamespace(look=5, has_changed=lambda: False, fluid_has_changed=lambda: False),
        integrator=SimpleNamespace(burst=0), do=do, _most=1000,
    )  # fmt: skip
    stage = SimpleNamespace(of=lambda kind: fluids)
    stepper.Stepper.advance(part, stage, 12, lambda stage: looked.append(state.steps - 100))
    assert counts == done
    assert looked == [k for k in range(begun, begun + 12) if k % 5 == 0]
    assert flowed == [k for k in range(begun, begun + 12) if k % (3 if fluids else 5) == 0]


def test_a_call_of_the_engine_does_so_many_steps_that_it_can_be_stopped(monkeypatch):
    def most():
        options = {"threads": 1, "factor": 0.9, "scaling": 1.0, "stop": gl.Stop()}
        return stepper.Stepper(state, gl.integration.CentralDifference(), **options)._most

    state = state_of(small_sample(4), Linear(**STIFF))
    zones = len(state.mesh.zones)
    assert most() == 4_000_000 // zones
    monkeypatch.setattr(stepper, "CALL", zones - 1)
    assert most() == 1


def test_a_run_is_kept_where_it_ends_and_not_again():
    kept = []
    run = object.__new__(Execution)
    run.at, run.folder = SimpleNamespace(finished=False), "folder"
    run.moment, run._save, run._result = lambda: "moment", kept.append, lambda whole: "result"
    run._run_stage = lambda: setattr(run.at, "finished", True)
    assert (run.go(), kept) == ("result", ["moment"])
    assert (run.go(), kept) == ("result", ["moment"])
    run.at.finished, run.folder = False, None
    assert (run.go(), kept) == ("result", ["moment"])


def test_a_run_is_estimated_once_and_its_loop_is_timed(monkeypatch):
    """Before the first of two stages; the clock of the loop counts no more than the whole run took."""
    asked, begin = [], time.perf_counter()
    monkeypatch.setattr(execution, "warn_of_cost", lambda state, stages, do: asked.append((len(stages), state.steps)))
    body = FreeMotion(duration=1e-5, settle=1e-5, fixed=[0], tracked=[1])
    result = gl.simulate(small_sample(2), Linear(**STIFF), body, frames=1)
    assert asked == [(2, 0)]
    assert 0 < result.summary["seconds"] < time.perf_counter() - begin


def test_gravity_that_is_new_takes_half_a_step_from_velocities():
    """Of 0.2 s: 2 kg gain 3 N * 0.2 s / 2 kg, and what is held gains nothing."""
    made = object.__new__(State)
    arrays = SimpleNamespace(
        mass=np.array([[1.0, 4.0], [2.0, 8.0]]), free=np.array([[1.0, 1.0], [1.0, 0.0]]), velocity=np.full((2, 2), 5.0)
    )
    made.freedoms = SimpleNamespace(arrays=arrays, books=SimpleNamespace(given=np.array([7.0])))
    made.gravity, made.time_step = SimpleNamespace(new=np.array([[0.0, 0.0], [3.0, 9.0]])), 0.2
    made.take_back_half_a_step_of_gravity()
    assert arrays.velocity.tolist() == [[5, 5], [pytest.approx(5 - 0.15), 5]]
    assert made.freedoms.books.given[0] == pytest.approx(7 - 2 * 0.3**2 / 8)


@pytest.mark.parametrize("heated", [False, True])
def test_the_steady_motion_is_the_mean_of_the_last_time(heated):
    """From 2 s on, after 3 s: over 0.3 s in which a drive moves by 0.6 m, or 20 K that a stage has cooled by."""
    arrays = SimpleNamespace(mass=np.ones((2, 2)), displacement=np.array([[1.0, 2.0], [3.0, 4.0]]))
    heat = SimpleNamespace(temperature=50.0, target=0.0 if heated else None)
    steady = Steady(SimpleNamespace(arrays=arrays), heat)
    steady.start(np.full((2, 2), 7.0), 1.0, 2.0, rises=False)
    driven = SimpleNamespace(arrays=SimpleNamespace(column=np.array([1]), row=np.array([1]), place=np.array([0])))
    moved = np.array([[0.3, 0.0], [-0.6, 1.2]])
    arrays.displacement += moved
    heat.temperature = 30.0
    speeds = np.array([9.0, -2.0])
    assert not steady.follow(driven, speeds, 4.9, 3.0)
    assert (steady.books.field == 7).all()
    assert steady.follow(driven, speeds, 5.0, 3.0)
    assert steady.books.field == pytest.approx(moved / (20 if heated else 0.3))
    assert not steady.follow(driven, speeds, 7.9, 3.0)  # marked anew
    assert steady.follow(driven, speeds, 8.0, 3.0)
    assert steady.books.field == pytest.approx(moved / (20 if heated else 0.3))  # what did not move tells nothing


def test_vibration_is_the_motion_beside_the_steady_one():
    """Of 0.5 and 1 m/s at a pace of 2, once nothing rises; damping sees it where a freedom is free."""
    arrays = SimpleNamespace(
        mass=np.array([[2.0, 4.0]]), velocity=np.array([[3.0, 1.0]]), displacement=np.zeros((1, 2)),
        free=np.array([[1.0, 0.0]]), imposed=np.full((1, 2), 9.0),
    )  # fmt: skip
    steady = Steady(SimpleNamespace(arrays=arrays), SimpleNamespace(temperature=20.0, target=None))
    steady.start(np.array([[0.5, 1.0]]), 2.0, 0.0, rises=True)
    assert (steady.rises, steady.velocity.tolist(), steady.vibration()) == (True, [[0, 0]], 0.5 * (2 * 9 + 4 * 1))
    steady.rise(1.0, done=True)
    assert (steady.rises, steady.velocity.tolist(), steady.vibration()) == (False, [[1, 2]], 0.5 * (2 * 4 + 4 * 1))
    steady.damp_beside(True)
    assert arrays.imposed.tolist() == [[1, 9]]
    steady.damp_beside(False)
    assert arrays.imposed.tolist() == [[0, 9]]


def test_what_the_static_solution_tells_by_hand(monkeypatch):
    """0.06 kg m2/s2 of inertia and 0.54 N/s along a motion of 0.2 m/s at most: 3 / s."""
    field, along = np.array([[0.2, 0.0], [0.0, -0.1], [0.0, 0.0]]), 0.54
    made = loader()
    made._stability = SimpleNamespace(stiffness=lambda: "stiffness", frequency=100.0)
    monkeypatch.setattr(loaders, "steady_motion", lambda state, stiffness, frequency: field)
    monkeypatch.setattr(loaders, "stiffness_along", lambda state, stiffness, motion: along)
    stage = SimpleNamespace(interval=0.5, expected=40, pieces=4)
    assert made._static(stage) == pytest.approx(field)
    seen = made._seen
    assert (seen.span, seen.momentum, seen.force, seen.least, seen.inner) == (20.0, (3.0, 8.0), 0, 0, 0)
    assert (seen.inertia, seen.frequency, seen.fastest) == pytest.approx((0.06, 3.0, 0.5 / (4 * 10 * 1e-3)))
    assert math.isnan(seen.supplied)
    made._state.heat.sign = -1  # a hundredth of the force on free strains
    made._static(stage)
    assert made._seen.force == pytest.approx(0.01 * 0.54 * 20)
    assert made._seen.least == pytest.approx(0.01 * 0.54 * 20 / 0.2)
    assert made._seen.inner == pytest.approx(math.sqrt(2 * 0.54) / 0.2)
    along = -1.0  # nothing resists
    made._static(stage)
    assert made._seen.frequency == pytest.approx(1e-4 * 100)
    field = 0 * field
    made._static(stage)
    assert made._seen.frequency == 100


@pytest.mark.parametrize(("static", "found", "said"), [(False, False, True), (True, False, False), (True, True, True)])
def test_a_stage_that_should_be_static_says_whether_it_is(static, found, said, monkeypatch):
    made, started = loader(), []
    made._stability = "stability"
    made._state.steady.start = lambda field, pace, time, rises: started.append((pace, time, rises))
    made._expect, made._change = lambda stage: None, lambda stage, before: None
    monkeypatch.setattr(loaders, "bring_under_load", lambda state, stage, stability: found)
    assert made.begin(SimpleNamespace(loading=None, static=static)) is said
    assert started == [(1.0, 9.0, False)]
    assert (made._new.way, made._new.load) == (0.0, 0.0)  # nothing of the stage before


def test_what_every_sample_records_by_hand(monkeypatch):
    monkeypatch.setattr(execution, "unbalanced", lambda state: 0.25)
    monkeypatch.setattr(execution, "motion", lambda state, energies: energies["damping"] / 8)
    state = SimpleNamespace(
        steady=SimpleNamespace(pace=3.0, vibration=lambda: 7.0),
        conduction=SimpleNamespace(mean=30.0, columns={"coldest": 20.0}),
        broken_mode=np.array([0.0, 0.1, 0.45, 0.5, 0.55, 1.0, 1.0, np.nan]),
        memory=lambda name: np.array([0.0, 0.0, 1e-9, 0.5, 1.0]),
    )  # fmt: skip
    assert execution.row_of(state, {"damping": 2.0}) == {
        "loading_speed": 3.0, "temperature": 30.0, "coldest": 20.0, "vibration": 7.0, "tensile_cracks": 3,
        "shear_cracks": 4, "damaged": 3, "unbalanced": 0.25, "motion": 0.25, "energy_damping": 2.0,
    }  # fmt: skip


@pytest.mark.parametrize(("supplied", "least", "found"), [(3.0, 2.0, 3.0), (1.0, 2.0, 2.0)])
def test_a_stage_that_begins_goes_on_with_the_largest_work(supplied, least, found, monkeypatch):
    monkeypatch.setattr(execution, "least_work", lambda state: least)
    done, run = [], object.__new__(Execution)
    run.state = SimpleNamespace(
        begin=lambda stage: done.append("state"), take_back_half_a_step_of_gravity=lambda: done.append("gravity")
    )
    run.stepper = SimpleNamespace(begin=lambda stage: done.append("stepper"), start=done.append)
    run.loader = SimpleNamespace(begin=lambda stage: done.append("loader"), integrator=lambda stage: "integrator")
    run.columns = SimpleNamespace(count=17)
    run.at = SimpleNamespace(supplied=supplied, without_static=4, first_sample=0, pieces=5)
    run._begin("stage")
    assert done == ["state", "stepper", "loader", "integrator", "gravity"]
    assert vars(run.at) == {"supplied": found, "without_static": 5, "first_sample": 17, "pieces": 1}  # None: not static


@pytest.mark.parametrize(
    ("pieces", "damage", "asked", "kept"),
    [
        (10, [5, 6, 6, 6, 6], [1, 1, 10, 10, 1], [5, 6, 6, 6]),
        (10, [6, 6, 7, 8, 8, 8], [1, 10, 10, 10, 10, 1], [6, 7, 8, 8, 8]),
        (1, [5, 6, 7], [1, 1, 1], [5, 6, 7]),
        (250, [6, 6, 6, 6, 6], [1, 250, 250, 25, 2], [6, 6, 6, 6]),
    ],
    ids=["once", "again", "whole samples", "no sample is more than ten times as long as the one before"],
)
def test_a_sample_in_which_damage_grows_is_done_again_in_pieces(pieces, damage, asked, kept, monkeypatch):
    """By the damage after each advance; that the specimen was damaged before, by 5, is no reason."""
    stage = SimpleNamespace(
        pieces=pieces, most_samples=len(kept), expected=None, ageing=None, name="press", ends="the end", loads=["one"]
    )
    monkeypatch.setattr(execution, "energies", lambda state: {})
    run, told, rows, left = object.__new__(Execution), [], [], list(damage)
    run.stages, run.folder, run.goes_on, run.at = [stage], None, True, Counters()
    run.state, run.columns = SimpleNamespace(damage=5, time=0.0), SimpleNamespace(count=0)
    run.state.broken_time, run.state.bonds = np.array([0.1, np.nan]), ["one"]

    def advance(stage, steps, look):
        told.append(steps)
        run.state.damage = left.pop(0)

    def record(found):
        rows.append(run.state.damage)
        run.columns.count += 1

    run.stepper = SimpleNamespace(do=lambda steps: None, advance=advance)
    run.loader = SimpleNamespace(
        steps=lambda stage, pieces: pieces, look=1, accepts=lambda *_: True, go_on=lambda stage: None,
        pieces=lambda stage, is_damaged: stage.pieces if is_damaged else 1,
    )  # fmt: skip
    run.moment = lambda: run.state.damage
    run._return_to = lambda moment: setattr(run.state, "damage", moment)
    run._check, run._record, run._observe = lambda *_: None, record, lambda stage: 0.0
    run._stand = lambda stage: ""
    says = (
        f"'press' did not end within {len(kept)} samples; it waits for the end; 1 of its 2 contact points have broken"
    )
    with pytest.raises(gl.StageError, match=says):
        run._run_stage()
    assert (told, rows) == (asked, kept)


@attrs.frozen(eq=False)
class Seen:
    """A motion, and the step at which it was seen."""

    at: int
    velocity: np.ndarray


class Moves:
    """What a stepper needs of a state, and what it did: the steps and by how much, or what follows at them."""

    def __init__(self, first, most, look, factor=0.5, scale=3.0):
        self.steps, self.done, self.first = first, [], first
        self.freedoms = SimpleNamespace(motion=self.motion, stop=lambda: self.at("stops"))
        self.stepper = made = object.__new__(stepper.Stepper)
        made.state, made._most, made.first, made.next_adapt, made.halts, made.before = self, most, first, 0, 0, None
        made.stop, made.factor = SimpleNamespace(check=lambda: None), factor
        made.stability = SimpleNamespace(
            look=look, has_changed=lambda: True, fluid_has_changed=lambda: False, step=lambda integrator: scale
        )  # fmt: skip
        made.integrator = SimpleNamespace(burst=0)
        made.do = self.go

    def go(self, steps):
        self.done.append(steps)
        self.steps += steps

    def at(self, what):
        self.done.append((what, self.steps - self.first))

    def motion(self):
        return Seen(self.steps - self.first, np.full(2, 3.0))

    def start_from_rest(self, velocity):
        assert velocity.tolist() == [3.0, 3.0]  # of before it was stopped
        self.at("starts")

    def let_membranes_follow(self):
        self.at("membranes")

    def let_fluids_follow(self):
        self.at("fluids")

    def let_heat_flow(self):
        return 0

    def change_time_step(self, step):
        self.done.append(step)


def test_between_steps_is_looked_at_steps_counted_from_where_the_stage_began(monkeypatch):
    """Whatever samples there are: at 0, 10, 20 steps; by calls of 7 steps at most; 0.5 of the stable step of 3 s."""
    state, stage = Moves(first=104, most=7, look=10), SimpleNamespace(of=lambda kind: [], interval=9.0)
    for steps in (4, 3, 9, 4, 2):
        state.stepper.advance(stage, steps, lambda stage: state.at("looks"))
    looks = [("looks", 0), ("membranes", 0), ("fluids", 0)], [("looks", 10), ("membranes", 10), 1.5, ("fluids", 10)]
    assert state.done == [*looks[0], 4, 3, 3, *looks[1], 6, 4, ("looks", 20), ("membranes", 20), 1.5, ("fluids", 20), 2]
    monkeypatch.setattr(stepper, "FLOW", 4)
    state, wet = Moves(first=104, most=99, look=10), SimpleNamespace(of=lambda kind: ["wet"], interval=9.0)
    for steps in (3, 8):
        state.stepper.advance(wet, steps, lambda stage: None)
    fluids = [each[1] for each in state.done if isinstance(each, tuple) and each[0] == "fluids"]
    assert fluids == [0, 4, 8]
    assert [each for each in state.done if isinstance(each, int)] == [3, 1, 4, 2, 1]


def test_a_stage_without_a_stable_step_takes_its_interval():
    state = Moves(first=0, most=7, look=10, scale=math.inf)
    assert state.stepper._time_step(SimpleNamespace(interval=9.0)) == 9.0


def test_an_integrator_that_adapts_sees_the_motion_after_bursts_that_halts_make_longer():
    """Bursts of 4 steps, after n halts by half of n modulo 4 more; of a halt it sees the motion at rest."""
    state, seen, halts = Moves(first=50, most=99, look=1000), [], iter([False, True, True, True, False])

    def adapt(now, before):
        seen.append((now.at, None if before is None else (before.at, before.velocity.tolist())))
        return state.stepper.integrator, next(halts)

    state.stepper.integrator = SimpleNamespace(burst=4, adapt=adapt)
    state.stepper.advance(SimpleNamespace(of=lambda kind: [], interval=9.0), 22, lambda stage: None)
    rest = [0.0, 0.0]
    assert seen == [(0, None), (4, (0, [3.0, 3.0])), (8, (4, rest)), (12, (8, rest)), (17, (12, rest))]
    steps = [each for each in state.done if isinstance(each, int)]
    assert steps == [4, 1, 3, 1, 3, 1, 4, 5]
    stops = [each[1] for each in state.done if isinstance(each, tuple) and each[0] == "stops"]
    assert stops == [4, 8, 12]
    assert [each[1] for each in state.done if isinstance(each, tuple) and each[0] == "starts"] == [5, 9, 13]
