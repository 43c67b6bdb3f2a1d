"""Steps of the engine: the compiled loop, and what it asks for: a search of neighbours, a bond handed over."""

from __future__ import annotations

from typing import Any

import numpy as np

from grainlaw.compiler.batch import Compiled
from grainlaw.engine import step as loop
from grainlaw.engine.assembly import share_out
from grainlaw.engine.bonds import hand_over
from grainlaw.engine.state import State
from grainlaw.stage import Hold


class InstabilityError(ArithmeticError):
    """A run that left the finite numbers or made energy; ``result`` holds what was recorded before."""

    result: Any


class OverlapError(InstabilityError):
    """Grains overlap more than is allowed; the message names the pair and what to do."""


def _schedule(state: State, times: np.ndarray) -> np.ndarray:
    """(t, columns) what the drives, nothing (the rotation of rigid grains), and the pressures are at times (s)."""
    table = np.zeros((len(times), len(state.drives) + 1 + len(state.pressures)))
    for column, drive in enumerate(state.drives):
        length = state.mesh.boundary_lengths[drive.boundary] if isinstance(drive, Hold) else 1.0
        table[:, column] = drive.course(times) * length
    for column, pressure in enumerate(state.pressures, len(state.drives) + 1):
        table[:, column] = pressure.course(times)
    return table


def advance(state: State, integrator: Compiled, steps: int, *, threads: int = 1) -> None:
    """Do ``steps`` of the present stage. Raises :class:`OverlapError`."""
    parameters = np.append(integrator.numbers, state.time_step)
    times, done = state.next_times(steps), 0
    schedule = _schedule(state, times - state.began)
    while True:
        parts = share_out(state.specimen, state.groups, state.driven, state.pressed, state.touches, threads)
        touching, table = state.touching(threads)
        now = loop.run(
            threads, steps - done, state.steps, state.time_step, state.arrays, state.contacts, state.table,
            state.freedoms, state.driven, state.held, state.pressed, schedule[done:], state.rigid, parts,
            integrator.address, parameters.ctypes.data, touching, table, state.weighed,
        )  # fmt: skip
        done += now
        state.count_steps(now, float(times[done - 1]) if done else state.time)
        if state.touches is not None:
            moved, deep, _, leaving = touching.tally[:, :4].sum(axis=0)
            if deep:
                where = f"the run stopped at step {state.steps} (t = {state.time:.4g} s, stage '{state.stage}')"
                raise OverlapError(f"{where}: {state.touches.deepest()}")
            if leaving:
                hand_over(state)
            elif moved:
                state.search()
        if done == steps:
            return
