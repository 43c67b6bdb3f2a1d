"""What a study will cost, before it is run: from cases that are finished, or from a timed probe of one of each kind."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import attrs

from grainlaw.compiler.batch import compile_integrator
from grainlaw.engine.ledger import energies
from grainlaw.engine.stable_step import StableStep
from grainlaw.engine.state import State
from grainlaw.engine.stepping import advance
from grainlaw.protocol import stages_of
from grainlaw.runs.estimate import estimate, expected_steps, in_words
from grainlaw.runs.parallel import Run
from grainlaw.runs.plausibility import lowest_frequency
from grainlaw.studies.case import Task

PER_NUMBER = 6.0  #: bytes of a number in the file of a run, which is compressed (measured)
COLUMNS, PER_CORNER, PER_POINT = 26, 10.0, 20.0  #: of curves; numbers of a corner of a grain, and of a contact point
ROW = 3000  #: bytes
KINDS = 12  #: kinds of cases that are probed at most


@attrs.frozen
class StudyCost:
    """What the cases that are missing will take; prints as a line."""

    cases: int
    cpu: float  #: s, on one core
    disk: float  #: bytes
    measured: bool  #: whether from finished cases; otherwise from a probe, for tests that go to their usual end

    def __str__(self) -> str:
        source = "from finished cases" if self.measured else "from a probe"
        return f"{self.cases} cases: about {in_words(self.cpu)} of one core, {self.disk / 1e6:.3g} MB ({source})"


def kind(factors: Mapping[str, Any]) -> tuple:
    """Cases that cost about the same: those that differ in numbers alone."""
    return tuple(level for level in factors.values() if isinstance(level, bool) or not isinstance(level, (int, float)))


def cost_of(tasks: Sequence[Task], rows: Sequence[Mapping[str, Any]], build: Any) -> StudyCost:
    """What tasks will take, by their kinds: from the rows of finished cases of a kind, or a probe of what is built."""
    finished: dict[tuple, list[tuple[float, float]]] = {}
    for row in rows:
        if row.get("cost"):
            finished.setdefault(kind(row["factors"]), []).append((row["cost"]["cpu"], row["cost"]["bytes"] + ROW))
    waiting: dict[tuple, list[Task]] = {}
    for task in tasks:
        waiting.setdefault(kind(task.factors), []).append(task)
    cpu = disk = 0.0
    probed: list[tuple[float, float]] = []
    for name, same in waiting.items():
        known = finished.get(name)
        if known is None and len(probed) < KINDS:
            probed.append(probe(build(same[len(same) // 2])))
            known = probed[-1:]
        known = known or probed
        cpu += len(same) * sum(each for each, _ in known) / len(known)
        disk += len(same) * sum(each for _, each in known) / len(known)
    return StudyCost(len(tasks), cpu, disk, measured=not probed)


def probe(run: Run) -> tuple[float, float]:
    """CPU time (s) and bytes of a run, from the time of some steps and of one sample."""
    began = time.process_time()
    stages = stages_of(run.protocol, run.specimen)
    model = run.model
    state = State(model)
    state.begin(stages[0])
    integrator = run.integrator or stages[0].integrator
    state.time_step = run.time_step_factor * StableStep(state, run.mass_scaling).step(integrator)
    compiled = compile_integrator(integrator)
    advance(state, compiled, 0)
    start = time.process_time() - began
    steps = expected_steps(stages, state.time_step, lowest_frequency(model))
    stepping = estimate(steps, len(state.mesh.zones), lambda count: advance(state, compiled, count)).seconds
    began = time.process_time()
    for _ in range(3):
        energies(state)
        run.protocol.measure(state)
        state.save()
    samples = sum(stage.expected or 0 for stage in stages)
    numbers = COLUMNS * samples + PER_CORNER * len(run.specimen.grains.corners) + PER_POINT * len(state.broken_time)
    return start + stepping + samples * (time.process_time() - began) / 3, ROW + PER_NUMBER * numbers
