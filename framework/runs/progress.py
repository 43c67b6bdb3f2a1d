"""How far something is that takes long: bars on a terminal and below the cell of a notebook."""

from __future__ import annotations

import logging
import sys
import threading
import time
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import cracks, leading, readings
from grainlaw.engine.state import State
from grainlaw.observation import Observer
from grainlaw.runs.estimate import in_words
from grainlaw.runs.progress_file import ProgressFile
from grainlaw.stage import Stage

OFTEN = 0.3  #: s between two pictures
SILENCE = 30.0  #: s between lines where there is no terminal
POINTS = 120  #: of a curve that others look at


class Progress(logging.Handler):
    """Bars, while the context lasts: one for each run, or for many cases; and what is compiled meanwhile.

    They go at the end unless it ``stays``. Where nobody looks, nothing is said, or a line now and then if it
    ``speaks``.
    """

    def __init__(self, *, stays: bool = False, speaks: bool = False) -> None:
        super().__init__()
        self.stays, self.speaks = stays, speaks
        self._turn = threading.RLock()
        self._bars: Any = None  #: of rich, while somebody looks
        self._compiles: Any = None  #: the one that says what is compiled
        self._drawn, self._said = 0.0, time.monotonic()

    def __enter__(self) -> Progress:
        console = _console()
        if console is not None:
            from rich.progress import BarColumn, TextColumn  # rich takes long to load
            from rich.progress import Progress as Bars

            name = TextColumn("{task.description:<14}", markup=False)
            share = TextColumn("{task.percentage:>3.0f}%")
            words = TextColumn("{task.fields[words]}", markup=False)
            look: Any = {"console": console, "transient": not self.stays, "auto_refresh": False}
            self._bars = Bars(name, BarColumn(10), share, words, **look)
            self._compiles = self._bars.add_task("", visible=False, words="")
            self._bars.start()
            logging.getLogger("grainlaw").addHandler(self)
        return self

    def __exit__(self, *_: object) -> None:
        if self._bars is not None:
            logging.getLogger("grainlaw").removeHandler(self)
            with self._turn:
                self._draw(visible=False)
                self._bars.stop()
                self._bars = None

    @property
    def is_seen(self) -> bool:
        """Whether somebody looks."""
        return self._bars is not None

    def bar(self, name: str) -> Bar:
        """Another bar."""
        with self._turn:
            return Bar(self, name, None if self._bars is None else self._bars.add_task(name, total=1.0, words=""))

    def emit(self, record: logging.LogRecord) -> None:
        """What the logger of the package says: that something is compiled."""
        with self._turn:
            if self._bars is not None:
                self._draw(visible=True, words=record.getMessage())

    def _draw(self, **compiles: Any) -> None:
        self._drawn = time.monotonic()
        self._bars.update(self._compiles, **compiles)
        self._bars.refresh()


class Bar:
    """One of the bars; what has no bar says nothing but lines."""

    def __init__(self, progress: Progress, name: str, task: Any) -> None:
        self.progress, self.name, self.task = progress, name, task

    def tell(self, share: float, words: str) -> None:
        """Show how far it is, 0 to 1, and what it does, if nothing was shown for a moment."""
        at, now = self.progress, time.monotonic()
        with at._turn:
            if at._bars is not None:
                at._bars.update(self.task, completed=share, words=words)
                if now - at._drawn >= OFTEN:
                    at._draw(visible=False)
            elif at.speaks and now - at._said >= SILENCE:
                at._said = now
                print(f"{self.name}: {share:.0%}, {words}", file=sys.stderr, flush=True)

    def remove(self) -> None:
        """Take it away."""
        with self.progress._turn:
            if self.progress._bars is not None:
                self.progress._bars.remove_task(self.task)


Shown = bool | Progress  #: whether somebody is told how far something is, or where


def shown_in(progress: Shown, **how: bool) -> AbstractContextManager[Progress | None]:
    """A context with bars to tell: those that are given, new ones (``how`` as :class:`Progress`) if True, or None."""
    if isinstance(progress, Progress):
        return nullcontext(progress)
    return Progress(**how) if progress else nullcontext(None)


class Pace:
    """How far a run is, and how long it usually still takes."""

    def __init__(self) -> None:
        self.began = time.monotonic()
        self._first: tuple[float, int] | None = None  #: s by the clock, and steps, at the first sample

    def __call__(self, state: State, curves: Mapping[str, np.ndarray], stage: Stage, progress: float) -> Going:
        now = time.monotonic()
        first, steps = self._first = self._first or (now, state.steps)
        left = max((state.usual_end - state.time) / state.time_step, 0.0) if progress < 1 else 0.0
        pace = (now - first) / (state.steps - steps) if state.steps > steps else 0.0
        return Going(progress, where_is(stage, curves), now - self.began, left * pace)


@attrs.frozen
class Going:
    """How far a run is in its present stage."""

    share: float  #: of the stage
    where: str  #: the stage, and the last readings
    seconds: float  #: s since the run began
    left: float  #: s that the stage usually still takes; 0 where that is not known

    @property
    def words(self) -> str:
        """Where it is, and the time left."""
        return self.where + (f", {in_words(self.left)} left" if self.left else "")


class RunBar(Observer):
    """Tells a bar how far a run is. No part of what a checkpoint keeps."""

    def __init__(self, bar: Bar) -> None:
        self.bar, self.pace = bar, Pace()

    def observe(self, state: State, curves: Mapping[str, np.ndarray], stage: Stage, progress: float) -> None:
        going = self.pace(state, curves, stage, progress)
        self.bar.tell(going.share, going.words)


class RunFile(Observer):
    """Tells a file how far a run is. No part of what a checkpoint keeps."""

    def __init__(self, file: ProgressFile) -> None:
        self.file, self.pace = file, Pace()

    def observe(self, state: State, curves: Mapping[str, np.ndarray], stage: Stage, progress: float) -> None:
        going = self.pace(state, curves, stage, progress)
        if self.file.is_due or progress >= 1:
            names, rows = thinned(curves)
            self.file.tell(**attrs.asdict(going), columns=names, rows=rows, cracks=int(cracks(curves)[-1]))


def thinned(curves: Mapping[str, np.ndarray]) -> tuple[list[str], list[list[float]]]:
    """The columns of how far a test is and of what it applies, and some rows of both, the last one among them."""
    names = leading(curves)
    count = len(next(iter(curves.values()), ()))
    rows = np.unique(np.linspace(0, count - 1, min(count, POINTS)).round().astype(int))
    return names, [list(row) for row in zip(*(curves[name][rows].tolist() for name in names), strict=True)]


def where_is(stage: Stage, curves: Mapping[str, np.ndarray]) -> str:
    """The stage of a run and the last readings of its curve, as "axial, 0.12 %, 43.1 MPa"."""
    names = leading(curves)
    told = readings(names, (float(curves[name][-1]) for name in names))
    return ", ".join(filter(None, [stage.name, told]))


def without_bars(observers: Iterable[Observer]) -> list[Observer]:
    """Those of which a checkpoint keeps what they have."""
    return [observer for observer in observers if not isinstance(observer, (RunBar, RunFile))]


def _console() -> Any:
    """Where bars can be drawn: the error stream of a terminal, the output of a notebook; else None."""
    notebook = type(sys.stdout).__module__.startswith("ipykernel")
    if not notebook and not (sys.stderr is not None and sys.stderr.isatty()):
        return None
    from rich.console import Console

    return Console() if notebook else Console(file=sys.stderr)
