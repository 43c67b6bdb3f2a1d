"""A line that says how far runs are, while they go on: on a terminal, and below the cell of a notebook."""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np

from grainlaw.engine.state import State
from grainlaw.observation import Observer
from grainlaw.runs.estimate import in_words
from grainlaw.stage import Stage

OFTEN = 0.3  #: s between two texts
LONGEST = 78  #: letters


class Line(logging.Handler):
    """One line for all runs, written over itself, and taken away at the end."""

    def __init__(self, stream: Any) -> None:
        super().__init__()
        self.stream, self.doing, self.told = stream, dict[str, str](), 0.0
        self._turn = threading.Lock()

    def tell(self, name: str, text: str) -> None:
        """Say what a run does, if nothing has been said for a moment."""
        with self._turn:
            self.doing[name] = text
            if time.monotonic() - self.told < OFTEN:
                return
            self._write("; ".join(f"{run} {words}" for run, words in self.doing.items()))

    def emit(self, record: logging.LogRecord) -> None:
        """What the logger of the package says: that something is compiled."""
        with self._turn:
            self._write(record.getMessage())

    def clear(self) -> None:
        """Leave an empty line."""
        self._write("")
        self.stream.write("\r")
        self.stream.flush()

    def _write(self, text: str) -> None:
        self.told = time.monotonic()
        self.stream.write(f"\r{text[:LONGEST]:<{LONGEST}}")
        self.stream.flush()


class Watcher(Observer):
    """Tells a line how far a run is, and how long it usually still takes. No part of what a checkpoint keeps."""

    def __init__(self, line: Line, name: str) -> None:
        self.line, self.name = line, name
        self.began: tuple[float, int] | None = None  #: s by the clock, and steps, at the first sample

    def observe(self, state: State, curves: Mapping[str, np.ndarray], stage: Stage, progress: float) -> None:
        left = self._left(state) if progress < 1 else 0.0
        words = f", about {in_words(left)} left" if left else ""
        self.line.tell(self.name, f"{stage.name} {progress:.0%}{words}")

    def _left(self, state: State) -> float:
        now = time.monotonic()
        began, steps = self.began = self.began or (now, state.steps)
        left = (state.usual_end - state.time) / state.time_step
        return max(left, 0.0) * (now - began) / (state.steps - steps) if state.steps > steps else 0.0


def kept(observers: Iterable[Observer]) -> list[Observer]:
    """Those of which a checkpoint keeps what they have."""
    return [observer for observer in observers if not isinstance(observer, Watcher)]


@contextmanager
def told(quiet: bool) -> Iterator[Line | None]:
    """A line, if somebody looks and it was not asked to be ``quiet``; also what is compiled is said in it."""
    stream = None if quiet else _stream()
    if stream is None:
        yield None
        return
    line, logger = Line(stream), logging.getLogger("grainlaw")
    logger.addHandler(line)
    try:
        yield line
    finally:
        logger.removeHandler(line)
        line.clear()


def _stream() -> Any:
    """Where a line can be written over: the error stream of a terminal, the output of a notebook; else None."""
    if type(sys.stdout).__module__.startswith("ipykernel"):
        return sys.stdout
    return sys.stderr if sys.stderr is not None and sys.stderr.isatty() else None
