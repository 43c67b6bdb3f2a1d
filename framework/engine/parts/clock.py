"""Time and steps of a run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grainlaw.engine.parts.part import Changing, Part


class ClockBooks(NamedTuple):
    """Time and steps that were done."""

    time: Changing  #: (1,) s
    steps: Changing  #: (1,)
    time_step: Changing  #: (1,) s, of the last steps
    since_time: Changing  #: (1,) s, when this time step began
    since_steps: Changing  #: (1,) steps done by then
    aged: Changing  #: (1,) s that passed in jumps, beside the time of the steps
    jumps: Changing  #: (1,)
    aged_before: Changing  #: (1,) s that had passed in jumps when the stage began
    jumps_before: Changing  #: (1,) jumps by then
    waited: Changing  #: (1,) samples since the last jump
    aged_loss: Changing  #: (1,) J that contact points have lost in jumps


class Clock(Part):
    """Time and steps. The time of a step is the same to the last digit, however many steps are done in one call."""

    def __init__(self) -> None:
        whole = ("steps", "since_steps", "jumps", "jumps_before", "waited")
        self.books = ClockBooks(*(np.zeros(1, dtype=int if name in whole else float) for name in ClockBooks._fields))

    @property
    def time(self) -> float:
        """s."""
        return float(self.books.time[0])

    @property
    def steps(self) -> int:
        """Steps done."""
        return int(self.books.steps[0])

    @property
    def aged(self) -> float:
        """s that passed in jumps."""
        return float(self.books.aged[0])

    def begin_stage(self) -> float:
        """Count time in jumps from here, where a stage begins; returns the time (s)."""
        books = self.books
        books.aged_before[0], books.jumps_before[0], books.waited[0] = books.aged[0], books.jumps[0], 0
        return self.time

    def next_times(self, count: int, time_step: float) -> np.ndarray:
        """(count,) s of the next steps."""
        books = self.books
        if books.time_step[0] != time_step:
            books.time_step[0], books.since_time[0], books.since_steps[0] = time_step, self.time, self.steps
        done = self.steps - int(books.since_steps[0])
        return books.since_time[0] + time_step * (done + 1 + np.arange(count))

    def count(self, steps: int, time: float) -> None:
        """Record steps that were done until ``time`` (s)."""
        self.books.steps[0] += steps
        self.books.time[0] = time
