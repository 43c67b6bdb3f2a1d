"""The number of threads follows what pays: found soon, held, given up when the cores have other work."""

import ctypes
import os
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import BRITTLE, PULL, advance, impose, small_sample, state_of
from test_restart import CASES, same

import grainlaw as gl
from grainlaw.engine import barrier, stepping
from grainlaw.engine.thread_count import LATE, SOON, TURN, ThreadCount, checked_threads, cores
from grainlaw.runs.parallel import _Shared


class Machine:
    """Does steps that take ``time(threads, now)`` seconds, without a clock."""

    def __init__(self, time, most=lambda: 2, chunk=10**9):
        self.time, self.chunk, self.now, self.steps = time, chunk, 0.0, 0
        self.threads = ThreadCount(most)
        self.used = []  #: (threads, seconds) of each call

    def run(self, seconds):
        end = self.now + seconds
        while self.now < end:
            count, steps = self.threads.turn(self.chunk)
            assert 1 <= steps <= self.chunk
            took = steps * self.time(count, self.now)
            self.threads.note(steps, took)
            self.now += took
            self.steps += steps
            self.used.append((count, took))

    def share(self, count):
        return sum(took for threads, took in self.used if threads == count) / sum(took for _, took in self.used)


@pytest.mark.parametrize("chunk", [10, 10**9])
@pytest.mark.parametrize(("gain", "best"), [(0.55, 2), (0.7, 2), (0.98, 1), (2.0, 1)])
def test_what_pays_is_found_within_a_tenth_of_a_second_and_held(gain, best, chunk):
    machine = Machine(lambda count, now: 1e-4 * (gain if count == 2 else 1.0), chunk=chunk)
    machine.run(3 * SOON)
    assert machine.threads.count == best
    machine.used.clear()
    machine.run(20 * LATE)
    assert machine.share(best) > 0.95


@pytest.mark.parametrize("size", [1e-6, 1e-4, 1e-2])
def test_of_many_cores_as_many_are_used_as_pay(size):
    """By Amdahl's law with 15 % in one thread: 32 threads take 0.87 of the time of 16, and 64 take 0.92 of that."""
    machine = Machine(lambda count, now: size * (0.15 + 0.85 / count), most=lambda: 64)
    machine.run(10 * LATE)
    assert machine.threads.count == 32


def test_cores_that_get_other_work_are_given_up_and_taken_again():
    def time(count, now):
        busy = 10 < now % 20
        return 1e-4 * (1.0 if count == 1 else 1.5 if busy else 0.6)

    machine = Machine(time)
    machine.run(9)
    assert machine.threads.count == 2
    machine.run(11 - machine.now)
    assert machine.threads.count == 1  # within a second
    machine.run(19 - machine.now)
    assert machine.threads.count == 1
    machine.run(20 + LATE + 2 * SOON - machine.now)
    assert machine.threads.count == 2


@pytest.mark.thorough
@given(
    times=st.lists(st.floats(1e-6, 1e-3), min_size=4, max_size=4),
    noise=st.lists(st.floats(0.95, 1.05), min_size=7, max_size=7),
    most=st.integers(1, 4),
)
def test_trying_costs_little_whatever_the_times_are(times, noise, most):
    """No more than what one thread takes in the worst noise, and some for the trials."""
    calls = iter(range(10**9))
    machine = Machine(lambda count, now: times[count - 1] * noise[next(calls) % 7], most=lambda: most)
    machine.run(60)
    assert all(1 <= count <= most for count, _ in machine.used)
    alone = times[0] * max(noise)
    assert machine.steps * alone > 60 / 1.04


def test_the_number_never_exceeds_what_is_allowed_now():
    allowed = [4]
    machine = Machine(lambda count, now: 1e-4 / count, most=lambda: allowed[0])
    machine.run(1)
    assert machine.threads.count == 4
    for allowed[0] in (1, 3, 2, 4):
        machine.used.clear()
        machine.run(3 * LATE)
        assert {count for count, _ in machine.used} <= set(range(1, allowed[0] + 1))
        assert machine.threads.count == allowed[0]


def test_compiling_and_calls_without_steps_do_not_count():
    threads = ThreadCount(lambda: 2)
    assert threads.turn(0) == (1, 0)
    threads.note(0, 30.0)
    assert threads.turn(1000)[0] == 1
    threads.note(20, TURN / 500)
    assert threads.turn(10**6) == (1, pytest.approx(1e4, rel=0.01))


def test_runs_share_threads_and_the_last_has_all():
    shared = _Shared(5)
    with shared as one:
        assert one.most() == 5
        with shared as other:
            assert (one.most(), other.most()) == (2, 2)
        assert one.most() == 5
    assert _Shared(1).most() == 1


def test_cores_are_those_that_the_process_may_use(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: {3, 5, 7}, raising=False)
    assert cores() == 3
    monkeypatch.setattr(os, "sched_getaffinity", lambda process: set(range(500)))
    assert cores() == 128


@pytest.mark.parametrize("wrong", ["many", "", None, 0, 129, 2.0, True])
def test_what_is_no_number_of_threads_is_refused(wrong):
    with pytest.raises(gl.ParameterError, match=r"it must be a whole number from 1 to 128, or 'auto'"):
        gl.simulate(small_sample(5), BRITTLE, PULL, threads=wrong)
    with pytest.raises(gl.ParameterError, match=r"threads = .* or 'auto'"):
        checked_threads("threads", wrong)


@pytest.mark.parametrize(
    "case",
    [
        case if case in ("rigid grains", "adaptive loading") else pytest.param(case, marks=pytest.mark.slow)
        for case in CASES
    ],
)
@pytest.mark.alone
def test_the_bits_are_the_same_however_the_number_changes(case, monkeypatch):
    specimen, law, protocol, options = CASES[case]
    one = gl.simulate(specimen, law, protocol, **options, threads=1)
    chance, used = np.random.default_rng(len(case)), set()

    def turn(self, steps):
        count, some = int(chance.integers(1, 4)), int(min(steps, chance.integers(1, 300)))
        used.add(count)
        return count, some

    monkeypatch.setattr(ThreadCount, "turn", turn)
    same(one, gl.simulate(specimen, law, protocol, **options, threads="auto"))
    assert used == {1, 2, 3}


@pytest.fixture
def meeting(monkeypatch):
    """A barrier interpreted, at which others arrive after so many looks; and how the waiting thread paused."""
    made = SimpleNamespace(counts=np.zeros(barrier.SIZE, dtype=np.int64), looks=0, after=0, paused=[])

    def load(counts, at):
        made.looks += 1
        assert made.looks <= max(made.after, 1), "it waits for nobody"
        counts[at] += made.looks == made.after
        return int(counts[at])

    def add(counts, at, much):
        counts[at] += much
        return int(counts[at]) - much

    monkeypatch.setattr(barrier, "atomic_load", load)
    monkeypatch.setattr(barrier, "atomic_add", add)
    monkeypatch.setattr(barrier, "atomic_store", lambda counts, at, value: counts.__setitem__(at, value))
    monkeypatch.setattr(barrier, "call", lambda function, given: made.paused.append((function, *given)))
    made.wait = lambda threads: barrier.wait.py_func(made.counts, threads, barrier.Pauses(1, 2))
    return made


@pytest.mark.skipif(sys.platform == "win32", reason="functions of POSIX")
def test_pauses_are_functions_of_the_system():
    """Each at its address: one gives the processor away, the other sleeps for as many microseconds."""
    addresses = barrier.pauses()
    assert all(addresses)
    give, sleep = (ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_uint)(address) for address in addresses)
    assert give(0) == 0
    begun = time.perf_counter()
    assert sleep(2000) == 0
    assert time.perf_counter() - begun >= 2e-3


class Turns(ThreadCount):
    """One thread, and never more than three steps at a time; what is noted of each turn."""

    def __init__(self, most):
        super().__init__(most)
        self.noted = []

    def note(self, steps, seconds):
        self.noted.append((steps, seconds))

    def turn(self, steps):
        return 1, min(steps, 3)


def test_steps_in_turns_are_the_steps_at_once():
    """Each has the speeds of its own moment: the drive rises to its speed all the while."""
    states = []
    for threads in (1, Turns(lambda: 1)):
        state = state_of(small_sample(12), BRITTLE)
        impose(
            state,
            [
                gl.loads.Drive(boundary="top", axis=1, speed=-0.5, ramp=1e-6),
                gl.loads.Drive(boundary="bottom", axis=1, speed=0),
            ],
        )
        advance(state, 8, 1e-7, threads=threads)
        states.append(state)
    once, turns = states
    assert (turns.steps, turns.time) == (once.steps, once.time)
    assert np.abs(once.displacement).max() > 0
    assert np.array_equal(turns.displacement, once.displacement)
    assert np.array_equal(turns.velocity, once.velocity)


def test_the_time_of_each_turn_is_noted(monkeypatch):
    """By a clock that goes on by 0.25 s whenever it is asked."""
    clock = iter(np.arange(100.0, 200.0, 0.25))
    monkeypatch.setattr(stepping, "time", SimpleNamespace(perf_counter=lambda: next(clock)))
    turns = Turns(lambda: 1)
    advance(state_of(small_sample(12), BRITTLE), 8, 1e-7, threads=turns)
    assert turns.noted == [(3, 0.25), (3, 0.25), (2, 0.25)]


def test_the_last_thread_opens_the_barrier_for_the_others(meeting):
    meeting.wait(1)
    assert (meeting.looks, meeting.counts.any()) == (0, False)
    meeting.counts[:] = 0
    meeting.counts[0] = 2  # of three, two wait
    meeting.wait(3)
    assert (meeting.counts[0], meeting.counts[16], meeting.paused) == (0, 1, [])


def test_a_thread_that_waits_spins_then_yields_then_sleeps(meeting):
    """Until the others have come: 200 looks for each pause, 400 pauses that yield before the first that sleeps."""
    meeting.after = 1 + 200
    meeting.wait(3)
    assert (meeting.counts[0], meeting.looks, meeting.paused) == (1, 201, [])
    meeting.looks, meeting.after = 0, 1 + 201 * 402 + 1
    meeting.wait(3)
    assert meeting.paused == [(1, barrier.REST)] * 400 + [(2, barrier.REST)] * 2
