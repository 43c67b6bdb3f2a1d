"""One case of a study, from its factors to its row; what a worker does."""

from __future__ import annotations

import contextlib
import functools
import os
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import cloudpickle
import numpy as np

from grainlaw.compiler.batch import CompilationError, compile_integrator
from grainlaw.compiler.cache import compile_portably
from grainlaw.conditions import StageError
from grainlaw.engine.device import Gpu
from grainlaw.engine.state import State
from grainlaw.engine.stepping import InstabilityError, OverlapError, advance
from grainlaw.fields import ParameterError
from grainlaw.messages import short
from grainlaw.observation import Observer
from grainlaw.protocol import stages_of
from grainlaw.results.archive import to_bytes
from grainlaw.results.certificate import doubts
from grainlaw.results.files import without_nan
from grainlaw.results.laboratory import Laboratory
from grainlaw.results.measure import Measure
from grainlaw.results.result import Result
from grainlaw.results.standard_measures import MEASURES
from grainlaw.runs.first_questions import ask_first_questions
from grainlaw.runs.parallel import Run
from grainlaw.runs.progress import RunFile
from grainlaw.runs.progress_file import ProgressFile
from grainlaw.studies.store import KILLED
from grainlaw.tessellation import TilingError

FINISHED, SAME = "finished", "same"
OWN = "own"  #: of a row: quantities by measures of the user's own
REFUSALS = (ParameterError, CompilationError, TilingError)


@attrs.frozen(eq=False)
class Recipe:
    """What all cases of a study have in common."""

    case: Callable[..., Run]
    measures: tuple[Measure, ...]
    levels: Mapping[str, Mapping[Any, Any]] = attrs.field(factory=dict)  #: of factors: what the case is given for each
    portable: bool = False  #: whether code is compiled so that every processor gives the same bits

    def run(self, factors: Mapping[str, Any]) -> Run:
        """The run of a case. Raises what the function raises, and ParameterError where it gives no run."""
        run = self.case(**{name: self.levels.get(name, {}).get(level, level) for name, level in factors.items()})
        if not isinstance(run, Run):
            wanted = "it must return a grainlaw.Run(specimen, law, protocol)"
            raise ParameterError(f"{getattr(self.case, '__name__', 'case')} returned {short(run)}, {wanted}")
        return run


@attrs.frozen(eq=False)
class Task:
    """A case to be carried out."""

    case: str  #: its key
    factors: dict[str, Any]  #: as they are recorded
    known: tuple[str, str] = ("", "")  #: keys of the run that the same factors had before, and of that case


@attrs.frozen(eq=False)
class Done:
    """A case that has been carried out: its row, and the file of its run."""

    row: dict[str, Any]
    run: bytes | None


def compiled(run: Run) -> None:
    """Compile all that a run needs, so that it is in the cache. Raises as the run would."""
    stages = stages_of(run.protocol, run.specimen)
    model = run.model
    ask_first_questions(model)
    state = State(model)
    for stage in stages:
        integrator = run.integrator or stage.integrator
        advance(state, compile_integrator(integrator), 0)


def carry_out(recipe: bytes, task: Task, watched: str = "", device: Gpu | None = None) -> Done:
    """Build a case, and run it unless its run is the known one; every failure is a row with its reason.

    Only where the ``device`` that does the steps fails, :class:`~grainlaw.runs.stopping.Stopped` is raised.
    """
    began = time.perf_counter(), time.process_time()
    try:
        with watching(watched, task.case) as observers:
            row, content = _answered(_loaded(recipe), task, observers, device)
    except MemoryError as error:
        row, content = {"status": KILLED, "reason": f"not enough memory: {error}"}, None
    wall, cpu = time.perf_counter() - began[0], time.process_time() - began[1]
    row = {"case": task.case, "run": "", "factors": task.factors, **row}
    row["cost"] = {"seconds": wall, "cpu": cpu, "bytes": len(content or b"")}
    return Done(without_nan(row), content)


@functools.lru_cache(maxsize=2)
def _loaded(recipe: bytes) -> Recipe:
    found: Recipe = cloudpickle.loads(recipe)
    if found.portable:
        compile_portably()
    return found


def _answered(
    recipe: Recipe, task: Task, observers: Sequence[Observer], device: Gpu | None
) -> tuple[dict[str, Any], bytes | None]:
    try:
        run = recipe.run(task.factors)
        key = run.key()
    except MemoryError:
        raise
    except Exception as error:
        return _refused(error), None
    if key == task.known[0]:
        return {"status": SAME, "run": key}, None
    try:
        options = {"threads": 1, "device": device, "observers": observers, "progress": False}
        result, status, reason = run.simulate(**options), FINISHED, ""
    except (StageError, InstabilityError) as error:
        kinds = {OverlapError: "overlap", InstabilityError: "unstable", StageError: "stage"}
        status = next(name for kind, name in kinds.items() if isinstance(error, kind))
        result, reason = error.result, str(error)
    except MemoryError:
        raise
    except Exception as error:
        return _refused(error) | {"run": key}, None
    return {"status": status, "reason": reason, "run": key, **found_by(result, recipe.measures)}, to_bytes(
        result, frames=False
    )


def _refused(error: Exception) -> dict[str, Any]:
    words = str(error) if isinstance(error, REFUSALS) else f"{type(error).__name__}: {error}"
    return {"status": "refused", "reason": words}


def found_by(result: Result, measures: Sequence[Measure]) -> dict[str, Any]:
    """The properties of a test, doubts about them, and what a laboratory measures; not what the clock says."""
    summary = {name: value for name, value in result.summary.items() if name != "seconds"}
    plain, failed = dict[str, Any](), list[str]()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        laboratory = Laboratory(result, measures)
        for measure in measures if result.frames and result.curves else ():
            if measure.name in summary and measure.name not in MEASURES:
                failed.append(
                    f"the measure '{measure.name}' has the name of a property of the test, which stands there"
                )
                continue
            try:
                value = laboratory.value(measure.name)
            except Exception as error:  # a measure of the user's own, or a test that has not got far
                failed.append(str(error))
                continue
            plain[measure.name] = float(value) if isinstance(value, np.floating) else value
    own = [attrs.asdict(measure.quantity) for measure in measures if measure.name not in MEASURES]
    return {
        "summary": summary, "doubts": [*doubts(result), *failed],
        "quantities": [attrs.asdict(each) for each in result.quantities.values()],
        "measures": plain, **({OWN: own} if own else {}),
    }  # fmt: skip


# --- what a worker is doing ------------------------------------------------------------------------------------------


@contextlib.contextmanager
def watching(folder: str, case: str) -> Iterator[list[Observer]]:
    """A file that says what a worker is doing, for as long as the context lasts; nothing without a folder."""
    if not folder:
        yield []
        return
    file = Path(folder) / f"{case}.{os.getpid()}"
    file.touch()
    try:
        yield [RunFile(ProgressFile(file))]
    finally:
        file.unlink(missing_ok=True)
