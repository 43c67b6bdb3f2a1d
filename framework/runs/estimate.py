"""What a run will take: steps, time and memory, before it begins."""

from __future__ import annotations

import math
import time
import warnings
from collections.abc import Callable, Sequence

import attrs
import numpy as np
import psutil

from grainlaw.contact import memory_names
from grainlaw.engine.model import Model
from grainlaw.engine.stability import stiffness_matrix
from grainlaw.engine.state import State
from grainlaw.loading import Adaptive
from grainlaw.loads import Drive
from grainlaw.runs.plausibility import lowest_frequency
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage

LONG = 3600.0  #: s from which a run is said to be long
MOST = 0.8  #: of the free memory
#: bytes per zone: mesh, arrays of the step and their copies at each sample; and each frame (measured, 8,000 grains)
PER_ZONE, PER_FRAME = 2600, 170
QUICK = 1e9  #: zones times steps that take seconds: no estimate is made
PROBE = 4e5  #: zones times steps of the probe
SLIVER = 0.02  #: of the mean: edges so short govern the time step alone


class CostWarning(UserWarning):
    """A run that will take very long, or more memory than there is."""


@attrs.frozen
class Estimate:
    """What is expected of the stages whose length is known."""

    steps: float
    seconds: float

    def __str__(self) -> str:
        return f"about {self.steps:.2g} steps, {in_words(self.seconds)}"


def in_words(seconds: float) -> str:
    """A time as people say it."""
    for unit, size in (("years", 365.25 * 86400), ("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"


def check_memory(specimen: Specimen, frames: int) -> None:
    """Warn (:class:`CostWarning`) if the model and its frames need most of the memory that is free."""
    zones = len(specimen.grains.corners) * 4**specimen.refinement
    needed, free = zones * (PER_ZONE + frames * PER_FRAME), psutil.virtual_memory().available
    if needed > MOST * free:
        kept = "frames" if frames * PER_FRAME > PER_ZONE else "grains and refinement"
        warnings.warn(
            f"the run needs about {needed / 2**30:.2g} GB of memory, {free / 2**30:.2g} GB are free: "
            f"{specimen.grains.count} grains, refinement = {specimen.refinement}, frames = {frames}; fewer {kept} help",
            CostWarning, stacklevel=3,
        )  # fmt: skip


def expected_steps(stages: Sequence[Stage], time_step: float, frequency: float) -> float:
    """Steps of the stages whose length is known, if the specimen does not fail before their end.

    ``frequency`` (1/s) is the lowest of the specimen, about.
    """
    return sum(max(stage.expected, _time(stage, frequency) / time_step) for stage in stages if stage.expected)


def _time(stage: Stage, frequency: float) -> float:
    """s"""
    assert stage.expected is not None
    span = stage.expected * stage.interval
    return span if stage.loading is None else stage.loading.usual(span, frequency)


def expected_work(model: Model, stages: Sequence[Stage]) -> tuple[float, bool, int]:
    """How long a run takes beside others, to put them in order: larger for what takes longer.

    First zones times steps, with Gershgorin's bound of the highest frequency. Of equal ones a specimen that never
    breaks is tested to the end, quickly where the loading is adaptive, and a law that remembers more takes longer.
    """
    specimen, each = model.specimen, model.of_bonds
    kn, ks = (max(float(np.max(law.stiffness[k])) for law in each) for k in (0, 1))
    points = np.ones((2, len(specimen.mesh.interfaces)))
    rows = abs(stiffness_matrix(specimen, kn * points, ks * points)).sum(axis=1)
    squared = float(np.max(np.ravel(rows) / np.repeat(specimen.node_masses, 2)))
    step = 2 / math.sqrt(squared) if squared > 0 else math.inf
    steps = expected_steps(stages, step, lowest_frequency(model))
    memory = [memory_names(law) for law in each]
    breaks, quick = any("damage" in names for names in memory), any(isinstance(s.loading, Adaptive) for s in stages)
    return steps * len(specimen.mesh.zones), breaks == quick, max(map(len, memory))


def estimate(steps: float, zones: int, do: Callable[[int], None]) -> Estimate:
    """Time a probe of some steps with ``do``; the caller goes back to where it was."""
    count = max(1, int(PROBE / zones))
    do(1)
    start = time.perf_counter()
    do(count)
    return Estimate(steps, steps * (time.perf_counter() - start) / count)


def warn_of_cost(state: State, stages: Sequence[Stage], do: Callable[[int], None]) -> None:
    """Warn of a run that takes long, before it begins: from a probe whose steps, done with ``do``, are taken back."""
    zones, frequency = len(state.mesh.zones), lowest_frequency(state.model)
    steps = expected_steps(stages, state.time_step, frequency)
    if steps * zones > QUICK:
        saved = state.save()
        found = estimate(steps, zones, do)
        state.restore(saved)
        warn_if_long(found, stages, state.specimen, state.time_step, frequency)


def warn_if_long(
    found: Estimate, stages: Sequence[Stage], specimen: Specimen, time_step: float, frequency: float
) -> None:
    """Warn (:class:`CostWarning`) of a run above an hour, with what rules its length."""
    if found.seconds > LONG:
        warnings.warn(
            f"the run takes {found}: {_ruled_by(stages, specimen, time_step, frequency)}", CostWarning, stacklevel=3
        )


def _ruled_by(stages: Sequence[Stage], specimen: Specimen, time_step: float, frequency: float) -> str:
    duration, longest = max(
        ((_time(stage, frequency), stage) for stage in stages if stage.expected), key=lambda pair: pair[0]
    )
    lengths = np.hypot(*specimen.mesh.interface_edges.T) if len(specimen.mesh.interfaces) else np.ones(1)
    if lengths.min() < SLIVER * lengths.mean():
        a, b = specimen.mesh.interface_grains[int(np.argmin(lengths))].tolist()
        return (
            f"its time step of {time_step:.2g} s is that of an edge of {lengths.min():.2g} m between the grains {a} "
            f"and {b} (their mean is {lengths.mean():.2g} m); merge short edges"
        )
    drives = [load for load in longest.imposed if isinstance(load, Drive)]
    ramp, speed = (max((getattr(drive, name) for drive in drives), default=0.0) for name in ("ramp", "largest"))
    speed *= 1.0 if longest.loading is None else (longest.expected or 0) * longest.interval / duration
    if ramp > duration / 4:
        return f"the ramp of {ramp:.3g} s is long against the time step of {time_step:.2g} s"
    crossing = duration / time_step
    if crossing > 5e6:
        slow = f" at a speed of {speed:.3g} m/s" if speed else ""
        return f"stage '{longest.name}' lasts {duration:.3g} s{slow}, {crossing:.2g} time steps; load faster"
    count, finer = specimen.grains.count, specimen.refinement
    size = f"{count} grains" + (f" with refinement = {finer}" if finer else "")
    return f"it has {size}, {len(specimen.mesh.zones)} zones; use fewer, or more threads"
