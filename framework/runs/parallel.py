"""Several runs at a time."""

from __future__ import annotations

import threading
from collections.abc import Callable, Hashable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import ExitStack
from typing import Any, Generic, TypeVar

import attrs

from grainlaw.arguments import Checked
from grainlaw.compiler.batch import CompilationError
from grainlaw.contact import Laws
from grainlaw.detection import EVERYWHERE, Detection
from grainlaw.engine.model import Model
from grainlaw.engine.thread_count import AUTO, ThreadCount, Threads, checked_threads, cores
from grainlaw.fields import ParameterError
from grainlaw.integration import Integrator
from grainlaw.observation import Observer
from grainlaw.protocol import LoadingProtocol, stages_of
from grainlaw.results.files import file_name
from grainlaw.results.result import Result
from grainlaw.runs.claim import Folder, check_file_names, claimed
from grainlaw.runs.estimate import expected_work
from grainlaw.runs.first_questions import ask_first_questions
from grainlaw.runs.progress import RunBar, Shown, shown_in
from grainlaw.runs.record import described_run, recorded
from grainlaw.runs.simulation import simulate
from grainlaw.runs.stopping import Stop, Stopped
from grainlaw.specimen import Specimen

Key = TypeVar("Key", bound=Hashable)


@attrs.frozen(eq=False)
class Run(metaclass=Checked):
    """What :func:`simulate` is given, as far as it decides the result."""

    specimen: Specimen  #: what is tested
    law: Laws  #: one for all contacts, or by pair of phases
    protocol: LoadingProtocol  #: the test
    #: contacts between any grains; None finds none
    detection: Detection | None = attrs.field(default=EVERYWHERE, kw_only=True)
    integrator: Integrator | None = attrs.field(default=None, kw_only=True)  #: in place of that of the test
    time_step_factor: float = attrs.field(default=1.0, kw_only=True)  #: share of the integrator's time step
    mass_scaling: float = attrs.field(default=1.0, kw_only=True)  #: factor by which added mass lengthens the time step

    @property
    def model(self) -> Model:
        """The specimen with its laws."""
        return Model(self.specimen, self.law, self.detection)

    @property
    def options(self) -> dict[str, Any]:
        """The options of :func:`simulate`."""
        names = ("detection", "integrator", "time_step_factor", "mass_scaling")
        return {name: getattr(self, name) for name in names}

    def key(self, frames: int = 30) -> str:
        """Hex SHA-256 of all that decides the result."""
        options = {**self.options, "frames": frames}
        return str(described_run(self.model, self.protocol, options)["key"])

    def simulate(self, **options: Any) -> Result:
        """Run it; ``options`` are further ones of :func:`simulate`."""
        return simulate(self.specimen, self.law, self.protocol, **{**self.options, **options})


@attrs.frozen(eq=False)
class Outcome(Generic[Key]):
    """Results of the runs that came to their end, and the errors of the others, by the keys of the runs."""

    results: dict[Key, Result]
    failed: dict[Key, Exception]


def simulate_all(
    runs: Mapping[Key, Run], *, threads: Threads = AUTO,
    observers: Callable[[Key], Sequence[Observer]] = lambda key: (), checkpoint: Folder = None,
    folder: Callable[[Key], str] = str, restart: bool = False, overwrite: bool = False, stop: Stop | None = None,
    progress: Shown = True, **options: Any,
) -> Outcome[Key]:  # fmt: skip
    """Do runs, as many at a time as ``threads`` (all cores); threads that a run leaves idle go to the others.

    Where they are more than the threads, those that are expected to take longest begin first.
    ``observers`` maps the key of a run to its observers; ``options`` go to :func:`simulate`. In ``checkpoint`` each run
    has a folder, whose name is given by ``folder``; with ``restart`` those that have finished are not run again. The
    results do not depend on ``threads``. A run that fails does not touch the others. Raises :class:`ParameterError` and
    :class:`CompilationError` for a run that is refused, :class:`Stopped`, whose ``result`` is the outcome so far, and
    the error of the first run if all fail.
    """
    if not runs:
        raise ParameterError("simulate_all: runs is empty, it must have at least one run")
    names = {key: folder(key) for key in runs}
    check_file_names("runs", names.values())
    with ExitStack() as stack:
        folders: dict[Key, Folder] = dict.fromkeys(runs)
        if checkpoint is not None:
            claim = stack.enter_context(claimed(checkpoint, restart=restart, overwrite=overwrite))
            stack.enter_context(recorded(claim.path, {**claim.about, "runs": [file_name(n) for n in names.values()]}))
            folders = {key: claim.inside(name) for key, name in names.items()}
        bars = stack.enter_context(shown_in(progress))
        watched = observers if bars is None else lambda key: [RunBar(bars.bar(names[key])), *observers(key)]
        return _all(runs, threads, watched, folders, stop or Stop(), {**options, "progress": False})


class _Shared:
    """Threads that runs share: each may have an equal part of them, and more as others come to their end."""

    def __init__(self, threads: int) -> None:
        self.threads, self.running = threads, 0
        self._lock = threading.Lock()

    def most(self) -> int:
        return max(1, self.threads // max(1, self.running))

    def __enter__(self) -> ThreadCount:
        with self._lock:
            self.running += 1
        return ThreadCount(self.most)

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self.running -= 1


def _all(
    runs: Mapping[Key, Run], threads: Threads, observers: Callable[[Key], Sequence[Observer]],
    folders: Mapping[Key, Folder], stop: Stop, options: Mapping[str, Any],
) -> Outcome[Key]:  # fmt: skip
    given = checked_threads("threads", threads)
    total = cores() if given == AUTO else given
    at_once = len(runs) if options.get("device") is not None else total  # a device does the steps of all
    workers, shared = min(at_once, len(runs)), _Shared(total)
    kept = any(folder is not None for folder in folders.values())

    def one(key: Key) -> Result:
        stop.check()
        run = runs[key]
        with shared as count:
            return run.simulate(threads=count, observers=observers(key), stop=stop, checkpoint=folders[key], **options)

    for run in runs.values():  # made here, once, before threads share it
        _ = run.specimen.mesh, run.specimen.zone_stiffness, run.specimen.node_masses
    with stop.by_signals(only_interrupt=not kept), ThreadPoolExecutor(workers) as pool:
        order = list(runs) if workers == len(runs) else _longest_first(runs, options)
        futures = {key: pool.submit(one, key) for key in order}
        try:
            _wait(futures.values(), stop)
        except BaseException:
            stop.ask("stopped")
            raise
    return _outcome({key: futures[key] for key in runs}, stop)


def _longest_first(runs: Mapping[Key, Run], options: Mapping[str, Any]) -> list[Key]:
    """So that the last runs are short, and no core waits long for another."""
    given = {name: options[name] for name in ("detection",) if name in options}
    models = {key: attrs.evolve(run, **given).model for key, run in runs.items()}
    for model in models.values():  # a law that is no law has no stiffness
        ask_first_questions(model)
    work = {key: expected_work(models[key], stages_of(run.protocol, run.specimen)) for key, run in runs.items()}
    return sorted(runs, key=work.__getitem__, reverse=True)


def _wait(futures: Any, stop: Stop) -> None:
    """Wait for all; a run that is refused stops the others. In short waits, between which signals are handled."""
    left = set(futures)
    while left:
        done, left = wait(left, timeout=0.2)
        for future in done:
            if isinstance(future.exception(), (ParameterError, CompilationError)):
                stop.ask("another run was refused")


def _outcome(futures: Mapping[Key, Future[Result]], stop: Stop) -> Outcome[Key]:
    errors = {key: error for key, future in futures.items() if (error := future.exception()) is not None}
    results = {key: future.result() for key, future in futures.items() if key not in errors}
    for error in errors.values():
        if isinstance(error, (ParameterError, CompilationError)):
            raise error
    failed = {key: error for key, error in errors.items() if isinstance(error, Exception)}
    if len(failed) < len(errors):
        stopped = Stopped(stop.reason, stop.signal)
        stopped.result = Outcome(results, failed)
        raise stopped
    if failed and not results:
        raise next(iter(failed.values()))
    return Outcome(results, failed)
