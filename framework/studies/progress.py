"""How far a study is: a bar with the time left, and one for each worker."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from grainlaw.runs.estimate import in_words
from grainlaw.runs.progress import Bar, Progress
from grainlaw.studies.case import FINISHED, SAME, Task
from grainlaw.studies.cost import kind
from grainlaw.studies.workers import Workers

LINES = 8  #: workers that are shown
OFTEN = 0.5  #: s between looks at the workers


class Watcher:
    """Tells bars how far a study is; nothing without them."""

    def __init__(self, tasks: Sequence[Task], by: Workers, bars: Progress | None) -> None:
        self.by, self.total, self.bars = by, len(tasks), bars
        self.cases = bars.bar("cases") if bars else None
        self.named = {task.case: task for task in tasks}
        self.costs: dict[Any, list[float]] = {}  #: s of the cases that are done, by their kind
        self.left: dict[Any, int] = {}  #: cases that are not
        for task in tasks:
            self.left[kind(task.factors)] = self.left.get(kind(task.factors), 0) + 1
        self.count = self.failed = 0
        self.began = self.seen = time.monotonic()
        self.at: dict[str, Bar] = {}  #: bars of cases that workers are at

    def done(self, task: Task, row: Mapping[str, Any]) -> None:
        """A case has come back."""
        self.named.pop(task.case, None)
        self.count += 1
        sort = kind(task.factors)
        self.left[sort] -= 1
        self.failed += row["status"] not in (FINISHED, SAME)
        if row.get("cost", {}).get("seconds") is not None:
            self.costs.setdefault(sort, []).append(row["cost"]["seconds"])
        self._tell()

    def look(self) -> None:
        """Show what the workers are doing."""
        if self.bars is None or not self.bars.is_seen or time.monotonic() - self.seen < OFTEN:
            return
        self.seen = time.monotonic()
        doing = {case: words for case, words in sorted(self.by.doing().items()) if case in self.named}
        for case in [case for case in self.at if case not in doing]:
            self.at.pop(case).remove()
        for case, (share, words) in list(doing.items())[:LINES]:
            if case not in self.at:
                self.at[case] = self.bars.bar(_label(self.named[case].factors))
            self.at[case].tell(share, words)
        self._tell()

    def _tell(self) -> None:
        if self.cases is None:
            return
        left = self.seconds_left()
        words = [f"{self.count} of {self.total}"]
        words += [f"about {in_words(left)} left"] if left and self.count < self.total else []
        words += [f"{self.failed} failed"] if self.failed else []
        self.cases.tell(self.count / self.total, ", ".join(words))

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
