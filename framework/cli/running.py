"""What the commands that run tests share: a line of progress for each run, and the record of what was run."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from grainlaw.columns import COURSE, LOAD
from grainlaw.compiler.batch import CompilationError
from grainlaw.engine.state import State
from grainlaw.engine.stepping import InstabilityError
from grainlaw.naming import shown
from grainlaw.observation import Observer
from grainlaw.parameter import ParameterError, parameters
from grainlaw.runs.simulation import MOST_THREADS
from grainlaw.stage import Stage, StageError

#: What ends a command with its own words.
FAILURES = (ParameterError, OSError, CompilationError, InstabilityError, StageError, MemoryError)


def check_threads(threads: int | None) -> None:
    """Refuse a number of threads before any work is done."""
    if threads is not None and not 1 <= threads <= MOST_THREADS:
        raise click.UsageError(f"--threads = {threads} is not allowed, it must be from 1 to {MOST_THREADS}")


class ProgressBar(Observer):
    """A run's line: stage, strain, stress (or what the test has instead), time left."""

    def __init__(self, progress: Progress, name: str) -> None:
        self.progress = progress
        self.task = progress.add_task(name, total=1.0, stage="starting", strain="", stress="")

    def observe(self, state: State, curves: Mapping[str, np.ndarray], stage: Stage, progress: float) -> None:
        self.progress.update(
            self.task,
            completed=progress,
            stage=stage.name if progress < 1 else "done",
            strain=_last(curves, COURSE),
            stress=_last(curves, LOAD),
        )


def _last(curves: Mapping[str, np.ndarray], names: Sequence[str]) -> str:
    name = next(name for name in names if name in curves)
    return f"{shown(name).text(float(curves[name][-1]))} {shown(name).unit}"


def progress_bars() -> Progress:
    """Lines for :class:`ProgressBar`, on the error stream."""
    return Progress(
        TextColumn("{task.description:<14}"), BarColumn(16), TextColumn("{task.percentage:>3.0f}%"),
        TextColumn("{task.fields[stage]:<11}{task.fields[strain]:>9}{task.fields[stress]:>11}"),
        TimeRemainingColumn(compact=True), console=Console(stderr=True), refresh_per_second=4,
    )  # fmt: skip


def versions() -> dict[str, str]:
    """Of Python and of the packages that results depend on."""
    packages = ("grainlaw", "numpy", "scipy", "numba", "llvmlite", "meshio", "attrs")
    return {"python": platform.python_version(), **{name: version(name) for name in packages}}


def described(component: Any) -> dict[str, Any]:
    """A component's type and parameters, for a record."""
    return {"type": type(component).__name__, **parameters(component)}
