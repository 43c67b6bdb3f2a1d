"""Steps of a state: the compiled step, and what it cannot do: search neighbours, replace bonds by contacts."""

from __future__ import annotations

from typing import Any

import numpy as np

from grainlaw.compiler.batch import Compiled
from grainlaw.compiler.loops import interruptible
from grainlaw.engine import step
from grainlaw.engine.hand_over import hand_over
from grainlaw.engine.parts.contact_passes import DEEP, LEAVING, MOVED
from grainlaw.engine.state import State


class InstabilityError(ArithmeticError):
    """A run whose numbers are no longer finite or whose energy does not balance; ``result`` holds the record before."""

    result: Any


class OverlapError(InstabilityError):
    """Grains overlap more than is allowed; the message names the pair and what to do."""


def advance(state: State, integrator: Compiled, steps: int, *, threads: int = 1) -> None:
    """Do ``steps`` of the present stage. Raises :class:`OverlapError`."""
    numbers = np.append(integrator.numbers, state.time_step)
    times, done = state.next_times(steps), 0
    schedule = state.boundaries.schedule(times - state.began, state.steady.pace)
    loops = integrator.loops or any(group.compiled.loops for group in (*state.bonds.groups, *state.contacts.groups))
    while True:
        parts = state.shared(threads)
        chunk = step.Chunk(
            steps - done, state.steps, state.time_step, schedule[done:], integrator.address, numbers.ctypes.data
        )
        if loops:
            now = interruptible(lambda: step.run(threads, parts, chunk))  # noqa: B023
        else:
            now = step.run(threads, parts, chunk)
        state.boundaries.platens.take_back(parts.platens)
        done += now
        state.count_steps(now, float(times[done - 1]) if done else state.time)
        tally = parts.contacts.tally.sum(axis=0).tolist()
        if tally[DEEP]:
            where = f"the run stopped at step {state.steps} (t = {state.time:.4g} s, stage '{state.stage}')"
            raise OverlapError(f"{where}: {state.contacts.deepest()}")
        if tally[LEAVING]:
            hand_over(state)
        elif tally[MOVED]:
            state.search(state.displacement_at_forces())
        if done == steps:
            return
