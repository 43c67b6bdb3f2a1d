"""What a study is doing, for the eye: a bar with the time left, and a line for each worker."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from grainlaw.runs.estimate import in_words
from grainlaw.studies.case import FINISHED, SAME, Task
from grainlaw.studies.cost import kind
from grainlaw.studies.workers import Workers

LINES = 8  #: workers that are shown
SILENCE = 30.0  #: s between lines where there is no terminal
OFTEN = 0.5  #: s between looks at the workers


class Watcher:
    """Shows a study on the error stream, in a notebook below the cell; nothing if ``quiet``."""

    def __init__(self, tasks: Sequence[Task], by: Workers, quiet: bool) -> None:
        self.by, self.quiet, self.total = by, quiet, len(tasks)
        self.named = {task.case: task for task in tasks}
        self.costs: dict[Any, list[float]] = {}  #: s of the cases that are done, by their kind
        self.left: dict[Any, int] = {}  #: cases that are not
        for task in tasks:
            self.left[kind(task.factors)] = self.left.get(kind(task.factors), 0) + 1
        self.count = self.failed = 0
        self.began = self.told = self.seen = time.monotonic()
        from rich.console import Console  # rich takes long to load
        from rich.live import Live
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

        self.console = Console(stderr=True)
        self.bar = Progress(
            TextColumn("{task.description}"), BarColumn(24), MofNCompleteColumn(), TextColumn("{task.fields[words]}"),
            console=self.console,
        )  # fmt: skip
        self.task = self.bar.add_task("cases", total=self.total, words="")
        self.live = Live(self.bar, console=self.console, refresh_per_second=4, transient=False)

    def __enter__(self) -> Watcher:
        if not self.quiet and self._shown:
            self.live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if not self.quiet and self._shown:
            self.live.update(self.bar)
            self.live.stop()

    @property
    def _shown(self) -> bool:
        return self.console.is_terminal or self.console.is_jupyter

    def done(self, task: Task, row: Mapping[str, Any]) -> None:
        """A case has come back."""
        self.named.pop(task.case, None)
        self.count += 1
        sort = kind(task.factors)
        self.left[sort] -= 1
        self.failed += row["status"] not in (FINISHED, SAME)
        if row.get("cost", {}).get("seconds") is not None:
            self.costs.setdefault(sort, []).append(row["cost"]["seconds"])
        self.bar.update(self.task, completed=self.count, words=self._words())
        self._tell()

    def look(self) -> None:
        """Show what the workers are doing."""
        if self.quiet or not self._shown or time.monotonic() - self.seen < OFTEN:
            return
        self.seen = time.monotonic()
        self.bar.update(self.task, words=self._words())
        lines = [
            f"  {_label(self.named[case].factors)}: {doing or 'starting'}"
            for case, doing in sorted(self.by.doing().items())
            if case in self.named
        ]
        from rich.console import Group

        more = [f"  and {len(lines) - LINES} more"] if len(lines) > LINES else []
        self.live.update(Group(self.bar, *lines[:LINES], *more))

    def _tell(self) -> None:
        """A line now and then where there is no terminal."""
        if self.quiet or self._shown or time.monotonic() - self.told < SILENCE:
            return
        self.told = time.monotonic()
        self.console.print(f"{self.count} of {self.total} cases, {self._words()}", highlight=False)

    def _words(self) -> str:
        left = self.seconds_left()
        words = f"about {in_words(left)} left" if left and self.count < self.total else ""
        return ", ".join(filter(None, [words, f"{self.failed} failed" if self.failed else ""]))

    def seconds_left(self) -> float:
        """From what cases of the same kind have cost, and how many were done at a time; 0 before the first is done."""
        if not self.costs:
            return 0.0
        every = [cost for costs in self.costs.values() for cost in costs]
        mean = sum(every) / len(every)
        work = sum(n * sum(c := self.costs.get(sort, [mean])) / len(c) for sort, n in self.left.items())
        at_a_time = max(sum(every) / max(time.monotonic() - self.began, 1e-9), 1e-9)
        return work / at_a_time


def _label(factors: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {level}" for name, level in factors.items())
