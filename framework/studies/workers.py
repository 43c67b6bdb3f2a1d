"""Cases carried out by an executor of ``concurrent.futures``: by this machine's cores, or by one that is given."""

from __future__ import annotations

import multiprocessing
import os
import shutil
import signal
import sys
import tempfile
import threading
import time
import types
import warnings
from abc import ABC, abstractmethod
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
)
from concurrent.futures import wait as wait_for
from contextlib import closing, contextmanager
from multiprocessing import connection
from multiprocessing.context import ForkServerContext, ForkServerProcess
from pathlib import Path
from typing import Any

from grainlaw.columns import quantity_of
from grainlaw.engine.device import Gpu
from grainlaw.fields import ParameterError, UnitWarning
from grainlaw.messages import cut, refusal
from grainlaw.runs.estimate import CostWarning, in_words
from grainlaw.runs.progress import Bar, Progress
from grainlaw.runs.progress_file import ProgressFile, read
from grainlaw.runs.stopping import Stop
from grainlaw.studies.case import FINISHED, SAME, Done, Task, carry_out
from grainlaw.studies.cost import kind
from grainlaw.studies.store import KILLED

TRIES = 4  #: times that a worker may die over a case
PATIENCE = 0.2  #: s between looks at the signals
AHEAD = 3  #: cases given to each worker in advance
MANY = 1000  #: cases given to workers whose number is not known


class ExecutorError(RuntimeError):
    """The workers of a study are gone; what they had finished is kept."""


class Workers(ABC):
    """What carries out cases."""

    folder = ""  #: where workers say what they are doing, empty if they cannot
    count = 0  #: how many there are, 0 if that is not known

    @abstractmethod
    def submit(self, recipe: bytes, task: Task) -> Future[Done]:
        """Begin a case."""

    @abstractmethod
    def renew(self) -> set[str]:
        """Replace those that have died, and say which cases they were at. Raises :class:`ExecutorError`."""

    def doing(self) -> dict[str, dict[str, Any]]:
        """How far what is being done is, as :class:`RunFile` tells it, by the key of the case; at first nothing."""
        files = Path(self.folder).glob("*.*") if self.folder else ()
        return {file.name.partition(".")[0]: read(file) or {} for file in files if not file.name.startswith(".")}

    @property
    def ahead(self) -> int:
        """Cases to give them at a time."""
        return AHEAD * self.count if self.count else MANY


class GivenExecutor(Workers):
    """An executor of the user's: threads, processes, or those of a cluster."""

    def __init__(self, executor: Executor) -> None:
        self.executor, self.count = executor, int(getattr(executor, "_max_workers", 0) or 0)

    def submit(self, recipe: bytes, task: Task) -> Future[Done]:
        return self.executor.submit(carry_out, recipe, task)

    def renew(self) -> set[str]:
        raise ExecutorError("a worker of the executor has died, and the executor takes no more cases")


class OnDevice(Workers):
    """Threads of this process, whose runs a device does the steps of."""

    def __init__(self, device: Gpu, count: int) -> None:
        self.device, self.count = device, count
        self.pool = ThreadPoolExecutor(count)

    def submit(self, recipe: bytes, task: Task) -> Future[Done]:
        return self.pool.submit(carry_out, recipe, task, "", self.device)

    def renew(self) -> set[str]:
        raise ExecutorError("the threads of a device have died")

    def close(self) -> None:
        """Wait for the runs that have begun."""
        self.pool.shutdown(cancel_futures=True)


class Local(Workers):
    """Processes on this machine, one for each core; new ones take the place of those that die."""

    def __init__(self, count: int) -> None:
        self.count, self.folder = count, tempfile.mkdtemp(prefix="grainlaw-")
        self.pool = self._pool()

    def _pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(self.count, mp_context=_context(), initializer=_begin, initargs=(self.folder,))

    def submit(self, recipe: bytes, task: Task) -> Future[Done]:
        return self.pool.submit(carry_out, recipe, task, self.folder)

    def renew(self) -> set[str]:
        self._end()
        lost = set(self.doing())
        for file in Path(self.folder).iterdir():
            file.unlink(missing_ok=True)
        self.pool = self._pool()
        return lost

    def _end(self) -> None:
        """End all processes at once: what they were doing is done again."""
        for process in list((self.pool._processes or {}).values()):
            process.kill()
        self.pool.shutdown(wait=True, cancel_futures=True)

    def close(self) -> None:
        """End the processes, and what they said."""
        self._end()
        shutil.rmtree(self.folder, ignore_errors=True)


def _begin(folder: str) -> None:
    """In a new process: Ctrl-C is for the one that gives out the cases, and without that one there is no work.

    Warnings of a run are given by that one too, once for each level, and by the estimate.
    """
    for warning in (UnitWarning, CostWarning):
        warnings.simplefilter("ignore", warning)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent.sentinel, folder), daemon=True).start()


def _end_with(parent: int, folder: str) -> None:
    connection.wait([parent])
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(1)


def _context() -> Any:
    """How processes are made: copies of a clean one with grainlaw loaded, where the system can."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = _Context()
    context.set_forkserver_preload(["grainlaw.studies.case"])
    return context


class _Process(ForkServerProcess):
    """Does not run the user's script again, as it would a script without a guard: what cases need travels with them."""

    @staticmethod
    def _Popen(process: Any) -> Any:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = types.ModuleType("__main__")
        try:
            return ForkServerProcess._Popen(process)
        finally:
            sys.modules["__main__"] = main


class _Context(ForkServerContext):
    Process = _Process


@contextmanager
def workers(on: Any, count: int) -> Iterator[Workers]:
    """The workers that are asked for: an executor, a device, the address of a Dask scheduler, or None: this machine.

    Raises :class:`ParameterError` for what is none of these, and where no scheduler answers.
    """
    if on is None:
        with closing(Local(count)) as local:
            yield local
    elif isinstance(on, str):
        with _cluster(on) as client:
            yield GivenExecutor(client.get_executor(retries=TRIES))
    elif isinstance(on, Gpu):
        with closing(OnDevice(on, count)) as threads:
            yield threads
    elif isinstance(on, Executor):
        yield GivenExecutor(on)
    elif hasattr(on, "get_executor"):  # a client of Dask
        yield GivenExecutor(on.get_executor(retries=TRIES))
    else:
        wanted = "a Gpu, an executor of concurrent.futures, a client of Dask, or the address of a scheduler"
        raise refusal("Study.run: on", on, f"{wanted} such as 'tcp://host:8786'")


def _cluster(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError:
        raise ParameterError(f"Study.run: on = '{address}' needs Dask: pip install 'grainlaw[dask]'") from None
    try:
        return Client(address, timeout=10)
    except (OSError, ValueError, TimeoutError) as error:
        raise ParameterError(f"Study.run: no Dask scheduler answers at '{address}': {error}") from None


def carry_all(
    tasks: Iterator[Task], recipe: bytes, by: Workers, accept: Callable[[Task, Done], None], stop: Stop,
    look: Callable[[], None] = lambda: None,
) -> None:  # fmt: skip
    """Give out tasks, some ahead, and accept what comes back; a case over which workers die again and again is killed.

    Raises :class:`ExecutorError`, :class:`~grainlaw.runs.stopping.Stopped`, and what ``accept`` raises.
    """
    pending: dict[Future[Done], Task] = {}
    again: deque[Task] = deque()
    suspects: deque[Task] = deque()  #: at which a worker died; last, for one may kill the next worker too
    deaths: Counter[str] = Counter()

    def following() -> Task | None:
        if again:
            return again.popleft()
        return next(tasks, None) or (suspects.popleft() if suspects else None)

    def fill() -> None:
        while len(pending) < by.ahead:
            task = following()
            if task is None:
                return
            try:
                pending[by.submit(recipe, task)] = task
            except (BrokenExecutor, RuntimeError):
                again.appendleft(task)
                if pending:  # those are looked at first: some may be done
                    return
                renew()

    def renew() -> None:
        deaths.update(by.renew())
        for task in pending.values():
            if deaths[task.case] >= TRIES:
                accept(task, _killed(task, f"its worker died {deaths[task.case]} times (of too little memory?)"))
            else:
                (suspects if deaths[task.case] else again).append(task)
        pending.clear()

    try:
        fill()
        while pending:
            finished, _ = wait_for(pending, PATIENCE, FIRST_COMPLETED)
            stop.check()
            broken = False
            for future in finished:
                try:
                    done = future.result()
                except BrokenExecutor:
                    broken = True
                    continue
                except (Exception, CancelledError) as error:
                    done = _failed(pending[future], error)
                task = pending.pop(future)
                accept(task, done)
            if broken:
                for future in [future for future in pending if future.done() and not future.exception()]:
                    accept(pending[future], future.result())
                    del pending[future]
                renew()
            look()
            fill()
    finally:
        for future in pending:
            future.cancel()


def _failed(task: Task, error: BaseException) -> Done:
    """What an executor says of a case that it could not carry out."""
    kind = type(error).__name__
    if kind in ("KilledWorker", "MemoryError"):
        return _killed(task, f"{kind}: {error}")
    raise ExecutorError(f"the executor could not carry out a case, {kind}: {error}") from error


def _killed(task: Task, reason: str) -> Done:
    return Done(
        {"case": task.case, "run": "", "factors": task.factors, "status": KILLED, "reason": reason, "cost": {}}, None
    )


# --- how far a study is -----------------------------------------------------------------------------------------------


LINES = 8  #: workers that are shown
LABEL, NAMED = 36, 110  #: characters that name a case at a bar, and in a file
OFTEN = 0.5  #: s between looks at the workers
SAID = 3  #: of the last words that those who look are told
STARTING = "starting"  #: what a worker is doing that has not told of a sample


class Whole:
    """A piece of work of which studies are the parts, as a calibration; each counts its cases here."""

    def __init__(self, name: str, planned: int, file: ProgressFile, bars: Progress | None) -> None:
        self.name, self.planned, self.file = name, planned, file  #: cases at most; where it is told
        self.bar = bars.bar(name) if bars else None
        self.left = 0.0  #: s at most; 0 where that is not known
        self.done: set[str] = set()  #: keys of cases
        self.costs: dict[Any, list[float]] = {}  #: s of the cases that were carried out, by their kind
        self.said: list[str] = []  #: what was found, and what is done now

    def further(self, waiting: int) -> int:
        """Cases that may come beside those that wait now."""
        return max(self.planned - len(self.done) - waiting, 0)

    @property
    def content(self) -> dict[str, Any]:
        """What the file says of it."""
        found = {"name": self.name, "done": len(self.done), "total": self.most, "left": self.left}
        return {**found, "said": self.said[-SAID:]}

    @property
    def most(self) -> int:
        """Cases that it takes: what was planned, but for what comes beside it, as a search for a stiffness."""
        return max(self.planned, len(self.done))

    def begin(self) -> None:
        """Tell those who look that it has begun, before its first study."""
        self.file.tell(whole=self.content)

    def say(self, words: str) -> None:
        """Tell those who look what was found, or what is done now."""
        self.said.append(words)
        self.begin()

    def tell(self, left: float) -> None:
        """Tell its bar, with the time that all the cases that may come will take."""
        self.left = left
        if self.bar is not None and self.planned:
            words = f"{len(self.done)} of at most {self.most} tests"
            words += f", at most about {in_words(left)} left" if left else ""
            self.bar.tell(len(self.done) / self.most, words)


class Watcher:
    """Tells bars, a file and the whole that it is a part of how far a study is."""

    def __init__(
        self, tasks: Sequence[Task], by: Workers, bars: Progress | None, file: ProgressFile | None = None,
        whole: Whole | None = None,
    ) -> None:  # fmt: skip
        self.by, self.total, self.bars, self.file, self.whole = by, len(tasks), bars, file, whole
        self.cases = bars.bar("cases") if bars else None
        self.named = {task.case: task for task in tasks}
        #: s of the cases that are done, by their kind
        self.costs: dict[Any, list[float]] = whole.costs if whole else {}
        self.left = Counter(kind(task.factors) for task in tasks)  #: cases that are not
        self.count = self.failed = 0
        self.worked = 0.0  #: s, of the cases that are done
        self.began = self.seen = time.monotonic()
        self.at: dict[str, Bar] = {}  #: bars of cases that workers are at
        self.doing: dict[str, dict[str, Any]] = {}  #: what they are at
        self.last: deque[dict[str, Any]] = deque(maxlen=LINES)  #: what they have done

    def done(self, task: Task, row: Mapping[str, Any]) -> None:
        """A case has come back."""
        self.named.pop(task.case, None)
        self.count += 1
        sort = kind(task.factors)
        self.left[sort] -= 1
        failed = row["status"] not in (FINISHED, SAME)
        self.failed += failed
        seconds = row.get("cost", {}).get("seconds")
        if seconds is not None:
            self.costs.setdefault(sort, []).append(seconds)
            self.worked += seconds
        if self.whole is not None:
            self.whole.done.add(task.case)
        why = row.get("reason", "") if failed else ""
        self.last.append(
            {"name": _label(task.factors, NAMED), "state": row["status"], "reason": why, "seconds": seconds}
        )
        self._tell()

    @property
    def is_heard(self) -> bool:
        """Whether anything is told."""
        return not (self.cases is None and self.whole is None and self.file is None)

    def look(self) -> None:
        """Show what the workers are doing."""
        if not self.is_heard or time.monotonic() - self.seen < OFTEN:
            return
        self.seen = time.monotonic()
        self.doing = {case: going for case, going in sorted(self.by.doing().items()) if case in self.named}
        if self.bars is not None and self.bars.is_seen:
            self._show()
        self._tell()

    def _show(self) -> None:
        assert self.bars is not None
        for case in [case for case in self.at if case not in self.doing]:
            self.at.pop(case).remove()
        for case, going in list(self.doing.items())[:LINES]:
            if case not in self.at:
                self.at[case] = self.bars.bar(_label(self.named[case].factors))
            self.at[case].tell(going.get("share", 0.0), going.get("where", STARTING))

    def remove(self) -> None:
        """Take all bars away."""
        for bar in (self.cases, *self.at.values()):
            if bar is not None:
                bar.remove()

    def _tell(self) -> None:
        if not self.is_heard:
            return
        left = self.seconds_left() if self.count < self.total else 0.0
        if self.whole is not None:
            further = self.whole.further(self.total - self.count)
            self.whole.tell(self.seconds_left(further))  # before the cases: a line now and then is of the whole
        if self.cases is not None:
            words = [f"{self.count} of {self.total}"]
            words += [f"about {in_words(left)} left"] if left else []
            words += [f"{self.failed} failed"] if self.failed else []
            self.cases.tell(self.count / self.total, ", ".join(words))
        if self.file is not None and (self.file.is_due or self.count == self.total):
            self.file.tell(**self._content(left))

    def _content(self, left: float) -> dict[str, Any]:
        doing = [{"name": _label(self.named[case].factors, NAMED), **each} for case, each in self.doing.items()
                 if case in self.named]  # fmt: skip
        content = {
            "done": self.count, "total": self.total, "failed": self.failed, "left": left,
            "doing": doing[:LINES], "last": list(self.last),
        }  # fmt: skip
        if self.whole is not None:
            content["whole"] = self.whole.content
        return content

    def seconds_left(self, further: int = 0) -> float:
        """Of the cases that are not done, and ``further`` ones; 0 where nothing is known of any.

        From what cases of the same kind have cost, and how many were done at a time; before the first is done, from how
        far those are that have begun.
        """
        begun = [each["seconds"] + each["left"] for each in self.doing.values() if each.get("left")]
        every = [cost for costs in self.costs.values() for cost in costs] or begun
        if not every:
            return 0.0
        mean = sum(every) / len(every)
        work = sum(n * sum(c := self.costs.get(sort, [mean])) / len(c) for sort, n in self.left.items())
        if self.worked:
            at_a_time = self.worked / max(time.monotonic() - self.began, 1e-9)
        else:
            work -= sum(each.get("seconds", 0.0) for each in self.doing.values())
            at_a_time = len(self.doing) or self.by.count or 1
        return max(work + further * mean, 0.0) / max(at_a_time, 1e-9)


def _label(factors: Mapping[str, Any], most: int = LABEL) -> str:
    """The factors of a case, names, seed and confinement first: where they are many the last ones are left out."""
    shown = {k: quantity_of(k).with_unit(v) if isinstance(v, float) else v for k, v in factors.items()}
    names = [name for name, value in factors.items() if isinstance(value, str)]
    before = [*names, "seed", *(["confinement"] if factors.get("confinement") else [])]
    first = dict.fromkeys([name for name in [*before, *factors] if name in factors])
    words = ", ".join(str(shown[name]) if name in names else f"{name} = {shown[name]}" for name in first)
    return cut(words, most)
