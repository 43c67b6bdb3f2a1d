"""Time jumped over: bonds age under the displacements of an equilibrium, by as much as keeps the next one near."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from grainlaw.columns import AGED, FATIGUE, JUMPS, STORED, SUPPLIED, energy
from grainlaw.conditions import Curves, StageError
from grainlaw.engine.dissipation import stored
from grainlaw.engine.parts.laws import LawGroup
from grainlaw.engine.state import State
from grainlaw.fields import ParameterError
from grainlaw.material import Material, knows_time
from grainlaw.memory import SCALARS
from grainlaw.stage import RESTS, Ageing, Stage

HALVINGS = 60  #: of the interval in which the length of a jump is sought, in logarithms
SHORTEST = 1e-15  #: of the duration: the first jump is longer, or the bonds do not last
FAILED = 1000.0  #: work of the loads in a stage, over what was stored as it began: 500 times its elastic strain
NEARLY = 0.9  #: of the largest growth: near enough


def check_ageing(state: State, stages: Sequence[Stage]) -> None:
    """Raise :class:`ParameterError` for a stage in which time passes, if no bond ages or a material has to, too."""
    if not any(stage.ageing for stage in stages):
        return
    for material, _ in state.specimen.materials:
        if isinstance(material, Material) and knows_time(material):
            raise ParameterError(
                f"ageing: {type(material).__name__}.stress takes time_step, and time passes in jumps for bonds alone: "
                "such grains would not creep in them; take a material without it"
            )
    if not list(_ageing(state)):
        raise ParameterError(
            f"ageing: no bond ages, give them a law that takes time_step and has a {FATIGUE} in its memory, such as "
            "StaticFatigue"
        )


def columns(state: State) -> dict[str, float]:
    """What is recorded of the time that passes in jumps."""
    return {AGED: state.clock.aged, JUMPS: float(state.clock.books.jumps[0])}


def age_at_rest(state: State, ageing: Ageing, curves: Curves) -> None:
    """Let time pass if a specimen is at rest, by its ``curves`` in this stage.

    Raises :class:`StageError`, also for a specimen that will not come to rest any more.
    """
    books = state.clock.books
    books.waited[0] += 1
    if books.waited[0] < RESTS or not ageing.rests(curves):
        _refuse_failed(state, curves)
        return
    ends = float(books.aged_before[0]) + ageing.duration
    left = ends - state.clock.aged
    if left <= 0:
        return
    seconds = _longest(state, ageing, left)
    if books.jumps[0] == books.jumps_before[0] and seconds < SHORTEST * ageing.duration:
        raise StageError(
            f"stage '{state.stage}': the bonds would lose {ageing.largest_growth:g} of their strength in {seconds:.3g} "
            f"s, {seconds / ageing.duration:.3g} of the duration of {ageing.duration:.3g} s: the rate of fatigue is "
            "too high for this load and duration, or the load too near the strength"
        )
    lengths, before = state.bonds.lengths, stored(state)
    for group in _ageing(state):
        _age(state, group, seconds)
    books.aged_loss[0] += float((lengths * (before - stored(state))).sum())
    books.aged[0] = ends if seconds == left else books.aged[0] + seconds
    books.jumps[0] += 1
    books.waited[0] = 0


def _refuse_failed(state: State, curves: Curves) -> None:
    stored_first, supplied = float(energy(curves, *STORED)[0]), energy(curves, SUPPLIED)
    times = float(supplied[-1] - supplied[0]) / stored_first if stored_first > 0 else 0.0
    if times > FAILED:
        raise StageError(
            f"stage '{state.stage}': the specimen has failed after {state.clock.aged:.4g} s and does not come to rest, "
            f"its loads have done {times:.0f} times the work that it had stored when the stage began; end the stage "
            "where it fails, as by Reaches(column, limit) of how far it has moved"
        )


def _ageing(state: State) -> Iterator[LawGroup]:
    """Laws whose bonds age."""
    for group in state.bonds.groups:
        if group.size and group.row(FATIGUE) >= 0 and "time_step" in group.compiled.scalars:
            yield group


def _respond(state: State, group: LawGroup, memory: np.ndarray, seconds: float) -> tuple[np.ndarray, ...]:
    """Tractions of a law's points where they are, after a time in which the ``memory`` (m, n) changes."""
    places = group.points(len(state.bonds))
    row = (state.steps + 1) % 2  # of the last forces
    arrays = state.bonds.arrays
    group.compiled.tell(time_step=seconds)
    try:
        return group.compiled.batch(arrays.opening[row, places], arrays.slip[row, places], memory)
    finally:
        group.compiled.tell(time_step=SCALARS["time_step"])


def _growth(state: State, seconds: float) -> float:
    """The largest growth of fatigue in a time, of points that are not broken."""
    largest = 0.0
    for group in _ageing(state):
        before, after = (state.bonds.memory_of(group) for _ in range(2))
        _respond(state, group, after, seconds)
        row = group.row(FATIGUE)
        largest = max(largest, float((after[row] - before[row]).max()))
    return largest


def _longest(state: State, ageing: Ageing, left: float) -> float:
    """s, the longest time up to ``left`` in which no fatigue grows by more than is allowed."""
    if _growth(state, left) <= ageing.largest_growth:
        return left
    low, high = math.log(left) - 2 * math.log(1 / SHORTEST), math.log(left)
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        growth = _growth(state, math.exp(middle))
        if growth > ageing.largest_growth:
            high = middle
        elif growth > NEARLY * ageing.largest_growth:
            return math.exp(middle)
        else:
            low = middle
    return math.exp(low)


def _age(state: State, group: LawGroup, seconds: float) -> None:
    """Age the bonds of a law; their tractions are then those of the weaker bonds, at the same displacements.

    So the jump does no work, and the work of the next step begins at the new tractions.
    """
    arrays, places, row = state.bonds.arrays, group.points(len(state.bonds)), (state.steps + 1) % 2
    memory = state.bonds.memory_of(group)
    _respond(state, group, memory, seconds)
    normal, shear = _respond(state, group, memory, SCALARS["time_step"])
    whole = ~np.tile(state.bonds.books.replaced, 2)[places]
    chosen = places[whole]
    arrays.memory[: group.depth, chosen] = memory[:, whole]
    arrays.normal[row, chosen], arrays.shear[row, chosen] = normal[whole], shear[whole]
