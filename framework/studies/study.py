"""A study: one question, many cases, one table; what is finished is never done again."""

from __future__ import annotations

import functools
import hashlib
import json
import os
import sys
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import attrs
import cloudpickle

from grainlaw.arguments import Checked, checked
from grainlaw.columns import SHARED
from grainlaw.compiler.cache import is_portable
from grainlaw.engine.device import Gpu
from grainlaw.engine.thread_count import cores
from grainlaw.fields import ParameterError, checked_whole_number
from grainlaw.messages import refusal, short
from grainlaw.protocol import stages_of
from grainlaw.results.measure import Measure, check_measures
from grainlaw.results.result import Result
from grainlaw.results.standard_measures import MEASURES
from grainlaw.runs.estimate import CostWarning
from grainlaw.runs.identity import Unknown, digest, fingerprint_of, own_modules
from grainlaw.runs.parallel import Run
from grainlaw.runs.plausibility import warn_of_scales
from grainlaw.runs.progress import Progress, Shown, shown_in
from grainlaw.runs.progress_file import ProgressFile, forget_ended, of_process
from grainlaw.runs.record import program
from grainlaw.runs.stopping import Stop, Stopped
from grainlaw.studies.case import FINISHED, SAME, Done, Recipe, Task, compiled
from grainlaw.studies.cost import StudyCost, cost_of
from grainlaw.studies.design import RESERVED, Design, Factors, check_results, check_signature, factorial, listed
from grainlaw.studies.store import KILLED, WRITTEN, InMemory, Kept, Store
from grainlaw.studies.table import Table
from grainlaw.studies.workers import Watcher, Whole, carry_all, workers

CROWDED = 8  #: workers of one core that are told
SEVERAL = 8  #: levels of a factor that are tried before anything is run; of more numbers the first and the outermost
Folder = str | os.PathLike[str]


@attrs.frozen
class Status(metaclass=Checked):
    """How many cases a study has, and how many of them are finished, have failed, are missing; prints as a line."""

    cases: int  #: of the study
    finished: int  #: cases that have finished
    failed: dict[str, int]  #: by how they failed; those that were killed are tried again
    missing: int  #: cases that have not run

    def __str__(self) -> str:
        failed = ", ".join(f"{count} {kind}" for kind, count in sorted(self.failed.items()))
        return f"{self.cases} cases: {self.finished} finished, {failed or 'none failed'}, {self.missing} missing"


class Study(metaclass=Checked):
    """Cases made by a function of factors, all with the same measures.

    ``case`` is any function that takes the factors by name and returns a :class:`~grainlaw.runs.parallel.Run`. Each
    factor has a list of levels, numbers or texts, or a mapping of names or numbers to levels of any kind; the cases
    are all combinations. ``cases`` is a list of mappings, or a DataFrame, instead (:func:`latin_hypercube`,
    :func:`sobol`), each with all combinations of the factors that are given beside it.

    ``measures`` are those of the laboratory. Raises :class:`ParameterError` for factors that the function does not
    take.
    """

    def __init__(
        self, case: Callable[..., Run], cases: Any = None, *, measures: Sequence[Any] | None = None,
        **factors: Any,
    ) -> None:  # fmt: skip
        self.design: Design = factorial(factors) if cases is None else listed(cases, factors)
        check_signature(case, self.design.names)
        self.case = case
        self.measures = tuple(MEASURES.values() if measures is None else measures)
        _check_measures(self.measures, self.design.names)

    def __len__(self) -> int:
        return len(self.design)

    def __repr__(self) -> str:
        levels = ", ".join(f"{name}: {len(each)}" for name, each in self.design.levels.items())
        return f"Study({getattr(self.case, '__name__', 'case')}, {len(self)} cases{levels and f', levels of {levels}'})"

    # --- running -----------------------------------------------------------------------------------------------------

    def run(
        self, folder: Folder | None = None, *, on: Any = None, workers: int | None = None,
        shard: tuple[int, int] | None = None, progress: Shown = True, stop: Stop | None = None,
        whole: Whole | None = None,
    ) -> Table:  # fmt: skip
        """Carry out the cases that the store in ``folder`` does not have, and return the table of all.

        Without a folder all cases are carried out, and the table is all that there is of them.
        They run on all cores of this machine, or on ``workers`` of them, or ``on`` an executor: one of
        ``concurrent.futures``, a client of Dask, or the address of its scheduler; or on a :class:`~grainlaw.Gpu`, with
        so many ``workers`` at a time, at first as many as it does side by side. ``shard`` is (k, n): every n-th case
        from the k-th on, for n jobs that share one store. What is interrupted goes on with the same call; a case that
        failed is tried again only if it was killed. ``whole`` is what this study is a part of.

        Raises :class:`ParameterError` before anything is run where a level is refused, with its factor, and after the
        first case where a factor has the name of a result; :class:`ExecutorError` where the workers are gone;
        :class:`~grainlaw.runs.stopping.Stopped`, whose ``result`` is the table so far; OSError where the store cannot
        be written. Every finished case is kept in all of these.
        """
        if workers is not None and on is not None and not isinstance(on, Gpu):
            raise ParameterError("Study.run: workers and on are not allowed together: an executor has its own")
        usual = on.side_by_side if isinstance(on, Gpu) else cores()
        count = usual if workers is None else checked_whole_number("Study.run: workers", workers, at_least=1)
        turn = _shard(shard)
        if on is None and min(count, len(self)) > CROWDED * cores():
            warnings.warn(
                f"Study.run: workers = {count} are more than the {cores()} cores of this machine can do, and each "
                "takes 0.3 GB of memory and more: take as many as there are cores",
                CostWarning, stacklevel=2,
            )  # fmt: skip
        store: Kept = InMemory(self._about()) if folder is None else Store(folder, about=self._about())
        stop = stop or Stop()
        mine = (pair for k, pair in enumerate(self._cases()) if k % turn[1] == turn[0])
        missing = [Task(case, factors) for case, factors in mine if case not in store]
        if missing:
            with ExitStack() as stack:
                file = whole.file if whole else None
                if file is None and isinstance(store, Store):
                    about = {"program": program(), "shard": list(turn)}
                    file = stack.enter_context(of_process(store.path, about))
                if file is not None:  # to compile takes long
                    file.tell(total=len(missing), **({"whole": whole.content} if whole else {}))
                self._try_levels(missing, compile_too=on is None)
                missing = self._with_known(missing, store)
                try:
                    with stop.by_signals():
                        self._carry(missing, store, on, min(count, len(missing)), progress, stop, file, whole)
                except Stopped as stopped:
                    stopped.result = self._table(store)
                    raise
                finally:
                    if isinstance(store, Store):
                        store.pack()
        if isinstance(store, Store) and whole is None:
            forget_ended(store.path, shard=list(turn))  # another process with these cases may have been killed
        return self._table(store)

    def _carry(
        self, missing: list[Task], store: Kept, on: Any, count: int, progress: Shown, stop: Stop,
        file: ProgressFile | None, whole: Whole | None,
    ) -> None:  # fmt: skip
        recipe = packed(self._recipe)
        with workers(on, count) as by, shown_in(progress, stays=True, speaks=True) as bars:
            watcher = Watcher(missing, by, bars, file, whole)

            def accept(task: Task, done: Done) -> None:
                row = done.row
                if row["status"] == SAME:
                    row = {**store.row(task.known[1]), "case": task.case}
                store.write({**row, "measured": self._measured, "version": self._version}, done.run)
                check_results(row)
                watcher.done(task, row)

            carry_all(iter(missing), recipe, by, accept, stop, watcher.look)
            if isinstance(progress, Progress):  # it goes on to tell something else
                watcher.remove()

    def _try_levels(self, tasks: Sequence[Task], compile_too: bool) -> None:
        """Build one case for each level, so that one that is refused is known at once; compile each law once."""
        recipe = self._recipe
        tried: dict[str, str] = {}  # keys of runs by those of cases
        laws: set[str] = set()
        for name in self.design.names:
            levels: dict[Any, Task] = {}
            for task in tasks:
                levels.setdefault(task.factors[name], task)
            if len(levels) > SEVERAL and all(isinstance(level, (int, float)) for level in levels):
                levels = {level: levels[level] for level in (next(iter(levels)), min(levels), max(levels))}
            for level, task in levels.items():
                if task.case in tried:
                    continue
                try:
                    run = recipe.run(task.factors)
                    tried[task.case] = run.key()
                    warn_of_scales(run.model, stages_of(run.protocol, run.specimen))
                    if compile_too and (kind := _kind(run)) not in laws:
                        compiled(run)
                        laws.add(kind)
                except Exception as error:
                    words = str(error) if isinstance(error, ParameterError) else f"{type(error).__name__}: {error}"
                    others = ", ".join(f"{n} = {v}" for n, v in task.factors.items() if n != name)
                    where = f" (in the case {others})" if others else ""
                    raise ParameterError(f"Study: {name} = {short(level)} is refused{where}: {words}") from None
            if len(levels) > 1 and len({tried[task.case] for task in levels.values()}) == 1:
                same = ", ".join(short(level) for level in levels)
                called = f"{getattr(self.case, '__name__', 'case')}({', '.join(self.design.names)})"
                words = f"Study: {name} = {same} give one and the same run: does {called} make use of {name}?"
                warnings.warn(words, stacklevel=3)

    def _with_known(self, tasks: list[Task], store: Kept) -> list[Task]:
        """The same, with the runs that equal factors had before the function was edited: perhaps they are the same."""
        mine = {case for case, _ in self._cases()}
        known = {}
        for row in store.rows(case for case in store.cases() if case not in mine):
            if row and row["run"] and row["status"] != KILLED and row["measured"] == self._measured:
                known[json.dumps(row["factors"], sort_keys=True)] = row["run"], row["case"]
        if not known:
            return tasks
        nothing = "", ""
        return [attrs.evolve(t, known=known.get(json.dumps(t.factors, sort_keys=True), nothing)) for t in tasks]

    # --- what is there -----------------------------------------------------------------------------------------------

    def status(self, folder: Folder) -> Status:
        """How far the study has come in a store. Raises ParameterError for a folder that is no store."""
        store = Store(folder, make=False)
        states = Counter(store.status(case) or "missing" for case, _ in self._cases())
        missing, finished = states.pop("missing", 0), states.pop(FINISHED, 0)
        return Status(len(self), finished, dict(states), missing)

    def estimate(self, folder: Folder | None = None) -> StudyCost:
        """CPU time and disk that the cases not in a store will take; without a folder, all cases.

        From what finished cases of the same kind have taken, or from a probe of some steps of one case of each kind,
        which is run nowhere else.
        """
        store = Store(folder, make=False) if folder is not None and Path(folder).exists() else None
        rows = [row for row in store.rows(case for case, _ in self._cases()) if row] if store else []
        missing = [Task(*pair) for pair in self._cases() if store is None or pair[0] not in store]
        recipe = self._recipe
        return cost_of(missing, rows, lambda task: recipe.run(task.factors))

    def table(self, folder: Folder) -> Table:
        """The table of the cases that a store has. Raises ParameterError for a folder that is no store."""
        return self._table(Store(folder, make=False))

    def result(self, folder: Folder, **factors: Any) -> Result:
        """Curves, cracks and grains of one case, without frames. Raises ParameterError for a case that is not there."""
        store = Store(folder, make=False)
        return self._table(store).result(**factors)

    def _table(self, store: Kept) -> Table:
        rows = (row for row in store.rows(case for case, _ in self._cases()) if row is not None)
        return Table(rows, self.design.names, store, self.measures)

    # --- keys --------------------------------------------------------------------------------------------------------

    @property
    def _recipe(self) -> Recipe:
        return Recipe(self.case, self.measures, self.design.named, is_portable())

    @functools.cached_property
    def _measured(self) -> str:
        return digest(*(type(measure) for measure in self.measures), *self.measures)

    @functools.cached_property
    def _version(self) -> str:
        """Of the function and of all that it uses."""
        return digest(fingerprint_of(self.case))

    def _cases(self) -> Iterator[tuple[str, Factors]]:
        """All cases in their order: key and factors.

        A key is the hash of the function's fingerprint and of the levels, of what is recorded and what is given.
        """
        try:
            code = hashlib.sha256(digest(fingerprint_of(self.case), self._measured, is_portable()).encode())
            words = {
                (name, recorded): _word(name, recorded, "" if level is recorded else digest(level))
                for name, each in self.design.levels.items()
                for recorded, level in each.items()
            }
        except Unknown as error:
            raise ParameterError(
                f"Study: what {getattr(self.case, '__name__', 'case')} depends on cannot be told: {error}; read files "
                "before, and give what they hold as levels"
            ) from None
        names = sorted(self.design.names)
        for factors in self.design:
            key = code.copy()
            for name in names:
                level = factors[name]
                key.update(words.get((name, level)) or _word(name, level, ""))
            yield key.hexdigest(), factors

    def _about(self) -> dict[str, Any]:
        return {"grainlaw": sys.modules["grainlaw"].__version__, "factors": list(self.design.names)}


@checked
def read_study(folder: Folder) -> Table:
    """The table of all cases that the folder of a study has, also of one from the command line; by their factors.

    Of several cases with equal factors, as of a function before and after an edit, it has the last, and warns of the
    others; a factor that was added later is None in the cases before. It warns, too, where the cases are of several
    versions of the study. :meth:`Study.table` gives those of one study in its own order. Raises
    :class:`ParameterError` for a folder that is no store.
    """
    store = Store(folder, make=False)
    found = sorted((row for row in store.rows(store.cases()) if row is not None), key=lambda row: row.get(WRITTEN, 0))
    names = [*dict.fromkeys(name for row in found for name in row["factors"])]
    last: dict[str, dict[str, Any]] = {}
    for row in found:
        factors = {name: row["factors"].get(name) for name in names}
        last[json.dumps(factors, sort_keys=True)] = {**row, "factors": factors}
    with_more: dict[str, list[dict[str, Any]]] = {}
    for row in last.values():
        with_more.setdefault(row["run"], []).append(row["factors"])
    rows = [
        row for row in last.values()
        if not (row["run"] and any(_has_more(other, row["factors"]) for other in with_more[row["run"]]))
    ]  # fmt: skip
    if len(rows) < len(found):
        words = (
            f"{store.path}: {len(found) - len(rows)} cases are left out, whose factors a later one has: of the study "
            "before an edit"
        )
        warnings.warn(words, stacklevel=3)
    versions = Counter(row.get("version") for row in rows)
    if len(versions) > 1:
        counts = ", ".join(map(str, versions.values()))
        words = (
            f"{store.path}: the cases are of {len(versions)} versions of the study ({counts}), whose specimens, laws "
            "or tests may differ: Study.table, or grainlaw study report, has those of one"
        )
        warnings.warn(words, stacklevel=3)

    def place(row: Mapping[str, Any]) -> list[tuple[Any, ...]]:  # what is None, numbers, texts
        return [
            (each is not None, isinstance(each, str), 0 if each is None else each) for each in row["factors"].values()
        ]

    return Table(sorted(rows, key=place), names, store)


def _has_more(factors: Mapping[str, Any], of: Mapping[str, Any]) -> bool:
    """Whether levels are those ``of`` a case, with one more: of a factor that was added later."""
    return factors != of and all(level is None or factors[name] == level for name, level in of.items())


def _check_measures(measures: Sequence[Measure], factors: Iterable[str]) -> None:
    """Raise :class:`ParameterError` for a unit that is none, and for a name that another, a test or a factor has."""
    check_measures("Study", measures)
    names = {measure.quantity.name for measure in measures}
    if taken := (names - {*MEASURES}) & {*SHARED, *RESERVED}:
        raise ParameterError(
            f"Study: measures: the name '{min(taken)}' is not allowed, it is that of a property of tests"
        )
    if taken := names & {*factors}:
        raise ParameterError(
            f"Study: a factor may not be called '{min(taken)}', a measure has this name; rename the factor"
        )


def _word(name: str, recorded: Any, given: str) -> bytes:
    return json.dumps([name, recorded, given]).encode()


def _shard(shard: tuple[int, int] | None) -> tuple[int, int]:
    """Number of the first case and how far the next is."""
    if shard is None:
        return 0, 1
    try:
        k, n = shard
        count = checked_whole_number("Study.run: shard", n, at_least=1)
        return checked_whole_number("Study.run: shard", k, at_least=1, at_most=count) - 1, count
    except (TypeError, ValueError) as error:
        if isinstance(error, ParameterError):
            raise
        raise refusal("Study.run: shard", shard, "(number, of how many)") from None


def _kind(run: Run) -> str:
    """Runs of one kind share their compiled code."""
    law = run.law if not hasattr(run.law, "values") else tuple(run.law.values())
    return repr([type(law).__qualname__, type(run.protocol).__qualname__, type(run.specimen.material).__qualname__])


def packed(recipe: Recipe) -> bytes:
    """A recipe for other processes, with the modules of the user's own in it: workers need not find their files."""
    modules = [
        sys.modules[name] for name in own_modules(recipe.case, *recipe.measures, recipe.levels) if name in sys.modules
    ]
    for module in modules:
        cloudpickle.register_pickle_by_value(module)
    try:
        content: bytes = cloudpickle.dumps(recipe)
    finally:
        for module in modules:
            cloudpickle.unregister_pickle_by_value(module)
    return content
