"""Several runs at a time."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Hashable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import attrs
import numpy as np

from grainlaw.contact import Laws
from grainlaw.engine.state import State
from grainlaw.observation import Observer
from grainlaw.parameter import checked_whole_number
from grainlaw.protocol import LoadingProtocol
from grainlaw.results.result import Result
from grainlaw.runs.simulation import simulate
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage

Key = TypeVar("Key", bound=Hashable)


@attrs.frozen(eq=False)
class Run:
    """What :func:`simulate` is given."""

    specimen: Specimen
    law: Laws
    protocol: LoadingProtocol


class _Stopped(Exception):
    """Ends a run whose result is no longer needed."""


@attrs.frozen
class _Stop(Observer):
    """Ends runs at their next sample once another run has failed."""

    asked: threading.Event = attrs.field(factory=threading.Event)

    def observe(self, state: State, curves: Mapping[str, np.ndarray], stage: Stage, progress: float) -> None:
        if self.asked.is_set():
            raise _Stopped


def simulate_all(
    runs: Mapping[Key, Run],
    *,
    threads: int | None = None,
    observers: Callable[[Key], Sequence[Observer]] = lambda key: (),
    **options: Any,
) -> dict[Key, Result]:
    """Results of runs, as many at a time as ``threads`` (all cores); spare threads share a model.

    ``observers`` maps the key of a run to its observers; ``options`` go to :func:`simulate`. The results do not depend
    on ``threads``. If one run fails, the others are stopped.
    """
    threads = checked_whole_number("threads", os.cpu_count() or 1 if threads is None else threads, at_least=1)
    workers = min(threads, len(runs))
    stop = _Stop()

    def one(key: Key) -> Result:
        run, share = runs[key], max(1, threads // workers)
        watchers = [*observers(key), stop]
        return simulate(run.specimen, run.law, run.protocol, threads=share, observers=watchers, **options)

    for run in runs.values():  # made here, once, before threads share it
        _ = run.specimen.mesh, run.specimen.zone_constants, run.specimen.node_masses
    with ThreadPoolExecutor(workers) as pool:
        try:
            return dict(zip(runs, pool.map(one, runs), strict=True))
        except BaseException:  # Ctrl-C, or one run has failed: stop the others
            stop.asked.set()
            raise
