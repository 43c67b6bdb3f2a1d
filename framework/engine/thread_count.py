"""How many threads share a model: as many as pay, which is tried now and then while the model runs."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any, Literal

from grainlaw.fields import ParameterError, checked_whole_number

Threads = int | Literal["auto"]
AUTO: Literal["auto"] = "auto"
MOST_THREADS = 128
TURN = 0.03  #: s of steps from which the time of a step is known
SOON, LATE = 0.1, 2.0  #: s until another number is tried: after a change, and at most
FIRST = 20  #: steps from which the time of a step is known roughly
GAIN = 0.9  #: twice as many threads must take less than this share of the time
SLOWER = 1.2  #: a step that takes so many times as long as before: the cores have got other work


def checked_threads(where: str, value: Any) -> Threads:
    """A number of threads, or "auto". Raises :class:`ParameterError`, which begins with ``where``."""
    if isinstance(value, str) and value == AUTO:
        return AUTO
    try:
        return checked_whole_number(where, value, at_least=1, at_most=MOST_THREADS)
    except ParameterError as error:
        raise ParameterError(f"{error}, or 'auto'") from None


def cores() -> int:
    """Cores that this process may use."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(count, MOST_THREADS)


class ThreadCount:
    """The number of threads for the next steps: 1 at first, then what was fastest when it was tried.

    It follows the clock and what else the machine does; results do not, for they are the same for any number. ``most``
    is asked each time, so that a run may use the cores of others that have ended.
    """

    def __init__(self, most: Callable[[], int]) -> None:
        self.most = most
        self.count = 1  #: that in use
        self.tried = 0  #: that being tried instead, or 0
        self.time = 0.0  #: s of a step in the last turn of the number in use, 0 before the first
        self.until = 0.0  #: s of running until another number is tried
        self.wait = SOON  #: s from one trial to the next
        self.upwards = True  #: whether more are tried next
        self._steps, self._seconds, self._since = 0, 0.0, 0.0

    def turn(self, steps: int) -> tuple[int, int]:
        """Threads for the next call, and how many of the steps to do in it."""
        most = self.most()
        if max(self.count, self.tried) > most:
            self.count, self.tried, self.time = min(self.count, most), 0, 0.0
            self._steps, self._seconds = 0, 0.0
        if most == 1:
            return 1, steps
        if not self._steps and (self.tried or self.time == 0.0):
            return self.tried or self.count, min(steps, FIRST)
        step = self._seconds / self._steps if self._steps else self.time
        return self.tried or self.count, min(steps, max(1, int((TURN - self._seconds) / step) + 1))

    def note(self, steps: int, seconds: float) -> None:
        """What a call took."""
        if not steps:  # it may have compiled
            return
        self._steps += steps
        self._seconds += seconds
        self._since += seconds
        if self._seconds < TURN:
            return
        step, self._steps, self._seconds = self._seconds / self._steps, 0, 0.0
        if self.tried:
            self._judge(step)
            return
        if self._since > SOON and step > SLOWER * self.time > 0:
            self.until = 0.0
        self.time = step
        if self._since >= self.until:
            self.tried = self._other()
            self._since = 0.0

    def _judge(self, step: float) -> None:
        """Whether the number that was tried is better, from the time of its step (s)."""
        more = self.tried > self.count
        if step < GAIN * self.time if more else GAIN * step < self.time:
            self.count, self.time, self.wait = self.tried, step, SOON
            self.upwards = more
        else:
            self.wait = min(2 * self.wait, LATE)
            self.upwards = not more
        self.tried, self._since, self.until = 0, 0.0, self.wait

    def _other(self) -> int:
        """The number to be tried, or 0."""
        more, fewer = min(2 * self.count, self.most()), (self.count + 1) // 2
        if self.count == 1:
            return more if more > 1 else 0
        return more if self.upwards and more > self.count else fewer
