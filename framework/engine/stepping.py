"""Steps of a state: the compiled step, and what it cannot do: search neighbours, replace bonds by contacts."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from grainlaw.compiler.batch import Compiled
from grainlaw.compiler.loops import interruptible
from grainlaw.compiler.numba_private import python_function
from grainlaw.engine import step
from grainlaw.engine.contacts.contact_passes import DEEP, LEAVING, MOVED
from grainlaw.engine.contacts.hand_over import hand_over
from grainlaw.engine.device import Gpu
from grainlaw.engine.state import State
from grainlaw.engine.thread_count import ThreadCount
from grainlaw.memory import SCALARS


class InstabilityError(ArithmeticError):
    """A run whose numbers are no longer finite or whose energy does not balance; ``result`` holds the record before."""

    result: Any


class OverlapError(InstabilityError):
    """Grains overlap more than is allowed; the message names the pair and what to do."""


#: of the step, here without compiling it for a few numbers
_take_temperature = python_function(step.take_temperature)
Crew = int | ThreadCount | Gpu  #: who does the steps of a run: a number of threads, as many as pay, or a device


def advance(state: State, integrator: Compiled, steps: int, *, threads: Crew = 1) -> None:
    """Do ``steps`` of the present stage. Raises :class:`OverlapError`, and OSError of a device that fails."""
    numbers = np.append(integrator.numbers, state.time_step)
    times, done = state.next_times(steps), 0
    pace = state.steady.pace
    conduction = state.conduction if state.conduction.load is not None else None
    temperatures = conduction.course(steps) if conduction else state.heat.course(times, state.time, pace)
    begin, end = times - state.began - state.time_step, times - state.began
    schedule = schedule_of(state, begin, end, pace, temperatures)
    loops = integrator.loops or any(one.loops for one in state.compiled)
    while True:
        count, some = threads if isinstance(threads, int) else 1, steps - done
        if isinstance(threads, ThreadCount):
            count, some = threads.turn(steps - done)
        imposed = schedule[done : done + some]
        start = time.perf_counter()
        if some:
            _take_temperature(state.materials.arrays, *temperatures[done])
        own = np.empty((count, schedule.shape[1]))
        chunk = step.Chunk(some, state.steps, state.time_step, imposed, own, integrator.address, numbers.ctypes.data)
        if isinstance(threads, Gpu) and not some:
            threads.check(state, integrator)
            return
        if isinstance(threads, Gpu):
            now, tally = _run(state, chunk, partial(threads.run, state, integrator, chunk, numbers))
        else:
            now, tally = _run(state, chunk, partial(_by_threads, state, count, chunk, loops))
        if isinstance(threads, ThreadCount):
            threads.note(now, time.perf_counter() - start)
        done += now
        state.count_steps(now, float(times[done - 1]) if done else state.time)
        if conduction:
            conduction.count(now)
        else:
            state.heat.reach(float(temperatures[done - 1, 1]) if done else state.heat.temperature)
        if tally[DEEP]:
            where = f"the run stopped at step {state.steps} (t = {state.time:.4g} s, stage '{state.stage}')"
            raise OverlapError(f"{where}: {state.contacts.deepest()}")
        if tally[LEAVING]:
            hand_over(state, count)
        elif tally[MOVED]:
            state.search(state.displacement_at_forces())
        if done == steps:
            return


def schedule_of(state: State, begin: np.ndarray, end: np.ndarray, pace: float, temperatures: np.ndarray) -> np.ndarray:
    """(t, columns) that the step takes, between times (t,) s of the stage; ``temperatures`` (t, 2) come last.

    They are °C before and at each step, or how far zones that conduct are on their way.
    """
    return np.column_stack([state.imposed.schedule(begin, end, pace), temperatures])


def tell(state: State, **scalars: float) -> None:
    """Give laws and materials that name them new values of scalars of the step (:data:`grainlaw.memory.SCALARS`)."""
    for one in state.compiled:
        one.tell(**scalars)


Steps = tuple[int, step.Shared]  #: how many were done, and the arrays of the parts as they were shared


def _run(state: State, chunk: step.Chunk, do: Callable[[], Steps]) -> tuple[int, list[int]]:
    """Do a chunk; how many of its steps were done, and the sum of the threads' tallies."""
    tell(state, time_step=chunk.time_step)
    try:
        done, shared = do()
    finally:
        tell(state, time_step=SCALARS["time_step"])  # who asks a law between steps does so outside of time
    state.platens.take_back(shared.parts.platens)
    return done, shared.parts.contacts.tally.sum(axis=0).tolist()


def _by_threads(state: State, threads: int, chunk: step.Chunk, loops: bool) -> Steps:
    shared = state.shared(threads)
    done = interruptible(lambda: step.run(threads, shared, chunk)) if loops else step.run(threads, shared, chunk)
    return done, shared
