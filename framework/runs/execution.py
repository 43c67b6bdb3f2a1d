"""One run on its way through the stages of a test: steps, samples, checks, and what is kept of them."""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import (
    ENERGY,
    IN_MOTION,
    SHARED,
    SPENT,
    STAGE_TIME,
    SUPPLIED,
    THERMAL,
    TIME,
    is_of_every_test,
    misspelt,
    require,
)
from grainlaw.conditions import Condition, StageError
from grainlaw.engine import ageing
from grainlaw.engine.diagnosis import fastest, first_fault
from grainlaw.engine.ledger import ROUNDING, energies, least_work, motion, unbalanced
from grainlaw.engine.state import State
from grainlaw.engine.stepping import InstabilityError
from grainlaw.fields import ParameterError
from grainlaw.messages import enumeration, refusal, short, users_line
from grainlaw.observation import Observer
from grainlaw.protocol import LoadingProtocol
from grainlaw.results.frames import Frame, FrameClock, take_frame
from grainlaw.results.result import Result
from grainlaw.runs.checkpoint import Checkpoint, Counters, SavedMoment
from grainlaw.runs.estimate import warn_of_cost
from grainlaw.runs.loader import MOST, Loader
from grainlaw.runs.progress import without_bars
from grainlaw.runs.run_folder import RunFolder
from grainlaw.runs.stepper import Stepper
from grainlaw.runs.stopping import Stopped
from grainlaw.stage import Stage

IDLE = 10  #: samples after which a stage without loads must have come nearer to its end
MANY = 10  #: samples that are expected of a stage: then it should not end at its first
LOADED = 0.9  #: progress of a stage that waits for rest when its loads have come
TOLERATED_GAP = 0.5  #: energy made or lost, over the energy supplied: beyond it the run is unstable


def row_of(state: State, energies: Mapping[str, float]) -> dict[str, float]:
    """Columns of the present moment, by name, beside time, step and stage."""
    row = {
        "loading_speed": state.steady.pace,
        "temperature": state.conduction.mean,
        **state.conduction.columns,
        "vibration": state.steady.vibration(),
        "tensile_cracks": int(np.sum(state.broken_mode < 0.5)),
        "shear_cracks": int(np.sum(state.broken_mode >= 0.5)),
        "damaged": int(np.count_nonzero(state.memory("damage") > 0)),
        "unbalanced": unbalanced(state),
        "motion": motion(state, energies),
    }
    return row | {ENERGY + kind: value for kind, value in energies.items()}


def measured_by(protocol: LoadingProtocol, state: State) -> Mapping[str, float]:
    """What a test measures.

    Raises :class:`ParameterError` for what is no number by a name, :class:`StageError` where it fails.
    """
    where = f"{type(protocol).__name__}.measure"
    try:
        found = protocol.measure(state)
    except ParameterError:
        raise
    except Exception as error:  # of a user
        raise StageError(f"{where}: {type(error).__name__}: {error}") from error
    if not isinstance(found, Mapping):
        raise refusal(where, found, "a dictionary of numbers by name")
    for name, value in found.items():
        if is_of_every_test(name):
            raise ParameterError(f"{where}: {name} is recorded in every test, give what is measured another name")
        if np.ndim(value) or isinstance(value, str) or value is None:
            raise refusal(f"{where}: {name}", value, "one number")
    return found


def _progress(condition: Condition, curves: Mapping[str, np.ndarray], stage: Stage) -> float:
    """How far a stage is by a condition. Raises :class:`StageError` where that fails, or gives no number."""
    where = f"stage '{stage.name}': {type(condition).__name__}.progress"
    try:
        found = condition.progress(curves)
    except (ParameterError, StageError):
        raise
    except KeyError as error:
        raise StageError(f"{where} takes the column {error}, there are: {', '.join(curves)}") from error
    except Exception as error:  # of a user
        raise StageError(f"{where}: {type(error).__name__}: {error}") from error
    if found is None or np.ndim(found) or np.isnan(found):
        raise StageError(f"{where} gave {short(found)}, it must be a number: 1 and more where the stage ends")
    return float(found)


class CurveTable:
    """Rows of named numbers, kept as arrays that grow."""

    def __init__(self) -> None:
        self.count = 0
        self._table: dict[str, np.ndarray] = {}

    def append(self, row: Mapping[str, float]) -> None:
        """Add a row. A name that is new makes a new column, with nan in the earlier rows."""
        for name, value in row.items():
            column = self._table.get(name)
            if column is None or self.count == len(column):
                longer = np.full(max(1024, 2 * self.count), np.nan)
                longer[: self.count] = np.nan if column is None else column
                column = self._table[name] = longer
            column[self.count] = value
        self.count += 1

    def since(self, first: int) -> dict[str, np.ndarray]:
        """The rows from number ``first`` on, to be read alone."""
        found = {name: column[first : self.count] for name, column in self._table.items()}
        for column in found.values():
            column.flags.writeable = False
        return found

    def fill(self, curves: Mapping[str, np.ndarray]) -> None:
        """Take whole columns of equal length in place of all rows. Raises ValueError for others."""
        shapes = {np.shape(values) for values in curves.values()}
        if len(shapes) > 1 or any(len(shape) != 1 for shape in shapes):
            raise ValueError("the curves are not of equal length")
        self._table = {name: np.array(values) for name, values in curves.items()}
        self.count = len(next(iter(curves.values()), ()))


class Execution:
    """One run: the state, and what takes it through the stages."""

    def __init__(
        self, stepper: Stepper, protocol: LoadingProtocol, stages: Sequence[Stage], *, observers: Sequence[Observer],
        frames: int, folder: RunFolder | None,
    ) -> None:  # fmt: skip
        self.state, self.stepper, self.protocol, self.stages = stepper.state, stepper, protocol, stages
        self.folder, self.watching = folder, list(observers)
        self.clock, self.frames = FrameClock(frames), list[Frame]()
        self.observers = without_bars(observers)  #: of which a checkpoint keeps what they have
        self.columns, self.at, self.state.stages = CurveTable(), Counters(), len(stages)
        self.loader = Loader(self.state, stepper.stability)
        self.goes_on = False  #: in a stage that began before a checkpoint
        self._measured: tuple[int, set[str]] = 0, set()  #: number of a stage, and the names that its test has measured

    def go(self) -> Result:
        """Run to the end. Errors hold the result so far in ``result``."""
        had_finished = self.at.finished
        try:
            while not self.at.finished:
                self._run_stage()
            if self.folder is not None and not had_finished:
                self._save(self.moment())
        except (StageError, InstabilityError, Stopped) as error:
            error.result = self._result(whole=False)
            raise
        return self._result(whole=True)

    def _run_stage(self) -> None:
        stage, state = self.stages[self.at.stage], self.state
        if not self.goes_on:
            self._begin(stage)
        self.stepper.do(0)  # compiles, so that the clock measures the time loop alone
        if not self.goes_on and not self.columns.count:
            warn_of_cost(state, self.stages, self.stepper.do)
        self.goes_on = False
        while self.columns.count - self.at.first_sample < stage.most_samples:
            moment = self.moment()
            steps, began = self.loader.steps(stage, self.at.pieces), state.time
            damage = state.damage if stage.pieces > 1 else 0.0
            start = time.perf_counter()
            try:
                self.stepper.advance(stage, steps, self.loader.look)
            except Stopped:
                self._return_to(moment)
                self._save(moment)
                raise
            self.at.seconds += time.perf_counter() - start
            with np.errstate(all="ignore"):  # the check finds numbers that are not finite
                found = energies(state)
            self._check(found, moment, stage, steps)
            grown = stage.pieces > 1 and state.damage != damage
            if grown and self.at.pieces < (pieces := self.loader.pieces(stage, grown)):
                self._return_to(moment)
                self.at.pieces = pieces
                continue  # again, to see the load before it falls
            if not self.loader.accepts(stage, found, began):
                self._return_to(moment)
                self.loader.repeat(stage)
                continue
            self._record(found)
            self.loader.go_on(stage)
            self.at.pieces = max(self.loader.pieces(stage, grown), self.at.pieces // MOST)
            if self._observe(stage) >= 1:
                self._warn_of_haste(stage)
                self.at.finished = self.at.stage == len(self.stages) - 1 or self._ends_test(stage)
                self.at.stage += not self.at.finished
                return
            self._refuse_idle(stage)
            if stage.ageing is not None:
                ageing.age_at_rest(state, stage.ageing, self.columns.since(self.at.first_sample))
            if self.folder is not None and self.folder.checkpoint_is_due():
                self._save(self.moment())
        expected = f" ({stage.expected} were expected)" if stage.expected else ""
        waited = f"stage '{stage.name}' did not end within {stage.most_samples} samples{expected}"
        broken = int(np.count_nonzero(~np.isnan(state.broken_time)))
        parts = f"; {broken} of its {2 * len(state.bonds)} contact points have broken" if broken else ""
        raise StageError(f"{waited}; it waits for {stage.ends}{self._stand(stage)}{parts}")

    def _warn_of_haste(self, stage: Stage) -> None:
        """Where a stage ends at once that should have many samples: a number of a wrong size ends it so.

        Not what a stage before waited for, too, as for a joint that has broken sooner than is usual.
        """
        if self.columns.count - self.at.first_sample > 1 or (stage.expected or 0) < MANY:
            return
        earlier = [end for before in self.stages[: self.at.stage] for end in before.until]
        if not any(end in earlier and _progress(end, self._seen_by_conditions(), stage) >= 1 for end in stage.until):
            warnings.warn(
                f"stage '{stage.name}' ended at its first sample, and {stage.expected} were expected: are its interval "
                "and what it waits for in SI (m, s, Pa)?",
                stacklevel=users_line(),
            )

    def _stand(self, stage: Stage) -> str:
        """Where the columns of the conditions of a stage are, in words and SI; empty without any."""
        seen, found = self._seen_by_conditions(), []
        for name in dict.fromkeys(name for end in stage.ends for name in end.columns if name in seen):
            low, high, now = seen[name].min(), seen[name].max(), seen[name][-1]
            found.append(f"{name} is {now:.4g}, between {low:.4g} and {high:.4g} in this stage")
        return f"; {', '.join(found)}" if found else ""

    def _begin(self, stage: Stage) -> None:
        state, at = self.state, self.at
        state.begin(stage)
        self.stepper.begin(stage)
        at.without_static += not self.loader.begin(stage)
        self.stepper.start(self.loader.integrator(stage))
        at.supplied = max(at.supplied, least_work(state))
        state.take_back_half_a_step_of_gravity()
        at.first_sample, at.pieces = self.columns.count, 1

    def _observe(self, stage: Stage) -> float:
        """Show the sample to all observers; returns the share of the stage that is done."""
        curves = self.columns.since(self.at.first_sample)
        seen = self._seen_by_conditions()
        if self.columns.count - self.at.first_sample == 1:
            self._refuse_absent(seen)
        for end in stage.ends:
            if absent := [name for name in end.columns if name in seen and np.isnan(seen[name][-1])]:
                raise StageError(
                    f"stage '{stage.name}' waits for {end}, and {type(self.protocol).__name__}.measure gave nan for "
                    f"{enumeration(absent)}"
                )
        progress = max(_progress(condition, seen, stage) for condition in stage.ends)
        if self.folder is not None:  # curves before pictures, which take more room
            self.folder.sample(self.columns.since(0), self.state)
        shown = min(max(progress, self._loaded(stage)), 1.0)
        if self.clock.due(self.state, stage, shown):
            self.frames.append(take_frame(self.state))
        for observer in self.watching:
            observer.observe(self.state, curves, stage, shown)
        if self.folder is not None:
            self.folder.keep(self.frames)
            if self.folder.summary_is_due():
                self.folder.summarize(self._summary_so_far(), "running")
        return progress

    def _refuse_absent(self, seen: Mapping[str, np.ndarray]) -> None:
        """Raise ParameterError where this stage waits for a column that the test does not record.

        Or a later one, for a name that no load of it records either.
        """
        for number, stage in enumerate(self.stages[self.at.stage :]):
            for end in (*stage.until, *stage.ends_test):
                names = [name for name in end.columns if number == 0 or name not in SHARED]
                require(f"stage '{stage.name}': {type(end).__name__}", seen, *names)

    def _loaded(self, stage: Stage) -> float:
        """How far a stage that waits for rest is, by its loads that still change: rest itself comes all at once."""
        lasts = self.state.imposed.lasts
        if not 0 < lasts < np.inf or not any(end.waits_for_rest for end in stage.ends):
            return 0.0
        return LOADED * min((self.state.time - self.state.began) / lasts, 1.0)

    def _seen_by_conditions(self) -> dict[str, np.ndarray]:
        curves = self.protocol.counted(self.columns.since(0), self.at.first_sample)
        return {**curves, STAGE_TIME: curves[TIME] - self.state.began}

    def _ends_test(self, stage: Stage) -> bool:
        return any(_progress(condition, self._seen_by_conditions(), stage) >= 1 for condition in stage.ends_test)

    def _refuse_idle(self, stage: Stage) -> None:
        """Raise StageError where nothing is imposed on a specimen that has never moved, and its test sees no change."""
        count = self.columns.count - self.at.first_sample
        if stage.loads or count != IDLE or self.state.kinetic_energy:
            return
        curves = self._seen_by_conditions()
        before = {name: column[:-1] for name, column in curves.items()}
        if all(end.progress(curves) == end.progress(before) for end in stage.ends):
            raise StageError(
                f"stage '{stage.name}' has no loads, and its specimen is at rest: it would wait for ever for "
                f"{stage.ends}; give it loads=[...]"
            )

    def _record(self, energies: dict[str, float]) -> None:
        state = self.state
        state.note_breaks()
        measured = measured_by(self.protocol, state)
        self._tell_left_out(measured)
        own = {"stage": self.at.stage, **self.loader.columns, **measured}
        if any(stage.ageing for stage in self.stages):
            own |= ageing.columns(state)
        self.columns.append({"time": state.time, "step": state.steps, **own, **row_of(state, energies)})
        state.new_sample()

    def _tell_left_out(self, measured: Mapping[str, float]) -> None:
        """Where a test leaves out what it has measured before in this stage: there the column is nan."""
        stage, before = self._measured
        if left_out := sorted(before - {*measured}) if stage == self.at.stage else []:
            words = f"leaves out {', '.join(left_out)} in the stage in which it gave it before: it is nan there"
            warnings.warn(f"{type(self.protocol).__name__}.measure {words}", stacklevel=users_line())
        self._measured = self.at.stage, {*measured}

    # --- checkpoints -------------------------------------------------------------------------------------------------

    def moment(self) -> SavedMoment:
        """All that the run needs to go on from here; copies."""
        state = self.state
        numbers = {
            "counters": attrs.asdict(self.at), "began": state.began, "samples": self.columns.count,
            "frames": len(self.frames), "steps": self.stepper.save(), "loader": self.loader.save(),
            "clock": {k: row.tolist() for k, row in self.clock.save().items()},
        }  # fmt: skip
        return SavedMoment(state.save(), self.stepper.integrator, self.stepper.before, numbers)

    def _save(self, moment: SavedMoment) -> None:
        """Write a checkpoint. No observer may have seen a later moment."""
        if self.folder is not None:
            count = moment.numbers["samples"]
            curves = {name: values[:count] for name, values in self.columns.since(0).items()}
            self.folder.checkpoint(moment, curves, self.observers)

    def go_on_from(self, found: Checkpoint) -> None:
        """Take up a run, in a state that has just been made, where a checkpoint was written."""
        state, numbers = self.state, found.numbers
        names = [name for name, _ in found.observers]
        if names != [type(observer).__name__ for observer in self.observers]:
            raise ParameterError(f"simulate: observers must be those of the run before, {', '.join(names) or 'none'}")
        try:
            self.at = Counters(**numbers["counters"])
            stage = self.stages[self.at.stage]
            state.begin(stage)
            state.check_saved(found.state)  # it comes from a file: nothing is used before all of it fits
            state.began = numbers["began"]
            self.loader.restore(numbers["loader"], stage)
            self._return_to(found.moment(self.loader.integrator(stage)))
            self.columns.fill(found.curves)
            self.clock.restore(numbers["clock"])
        except (ValueError, LookupError, TypeError, AttributeError) as error:
            raise ParameterError(f"the checkpoint does not fit this run: {error}") from None
        for observer, (_, saved) in zip(self.observers, found.observers, strict=True):
            observer.restore(state, saved)
        assert self.folder is not None
        self.frames = self.folder.frames(numbers["frames"], state.mesh.nodes)
        self.goes_on = True

    def _return_to(self, moment: SavedMoment) -> None:
        self.state.restore(moment.state)
        self.stepper.restore(moment.numbers["steps"], moment.integrator, moment.before)

    # --- failure -----------------------------------------------------------------------------------------------------

    def _check(self, energy: dict[str, float], moment: SavedMoment, stage: Stage, steps: int) -> None:
        moving = self.state.kinetic_energy + abs(float(self.state.freedoms.books.given[0]))
        self.at.supplied = max(self.at.supplied, abs(energy[SUPPLIED]), abs(energy[THERMAL]), ROUNDING * moving)
        gap = abs(energy[SUPPLIED] - sum(energy[kind] for kind in SPENT))
        if gap <= TOLERATED_GAP * self.at.supplied and np.isfinite(list(energy.values())).all():
            return
        with np.errstate(all="ignore"):
            error = InstabilityError(self._explain(moment, stage, steps))
        self.state.restore(moment.state)  # the result ends with the last moment before
        raise error

    def _explain(self, moment: SavedMoment, stage: Stage, steps: int) -> str:
        """Replay the chunk step by step to find where it went wrong."""
        state = self.state
        state.restore(moment.state)
        for _ in range(steps):
            self.stepper.do(1)
            if place := first_fault(state):
                break
        else:
            place = fastest(state)
        return f"the run became unstable at step {state.steps} (t = {state.time:.4g} s, stage '{stage.name}'): {place}"

    def _result(self, *, whole: bool) -> Result:
        """What was recorded, with the summary of a ``whole`` test, or as far as the test finds one of a part.

        Raises :class:`StageError`, with the rest in ``result``, where the protocol's summary of a whole test fails.
        """
        if self.folder is not None and self.columns.count:
            self.folder.sample(self.columns.since(0), self.state, last=True)
        frames = self.frames
        if not frames or frames[-1].time < self.state.time:
            frames.append(take_frame(self.state))
        try:
            result = self._result_with(frames)
        except Exception as error:  # of a user
            found = self._result_with(frames, of_test=False)
            if not whole:
                return found
            told = str(error) if isinstance(error, ParameterError) else f"{type(error).__name__}: {error}"
            failed = StageError(
                f"{type(self.protocol).__name__}.summary, after the run: {told}; what was recorded is kept, in "
                "Python as error.result"
            )
            failed.result = found
            raise failed from error
        if whole:
            self._tell_misspelt(result)
        return result

    def _tell_misspelt(self, result: Result) -> None:
        declared = self.protocol.panels, self.protocol.quantities
        for words in misspelt(*declared, list(result.curves), list(result.summary)):
            warnings.warn(f"{type(self.protocol).__name__} has {words}", stacklevel=users_line())

    def _result_with(self, frames: list[Frame], *, of_test: bool = True) -> Result:
        curves, seconds = self.columns.since(0), self.at.seconds
        names = [stage.name for stage in self.stages]
        result = Result.from_run(self.state, self.protocol, curves, frames, seconds, names, of_test=of_test)
        if self.at.without_static:
            result.summary[IN_MOTION] = self.at.without_static
        return result

    def _summary_so_far(self) -> dict[str, Any]:
        """Properties as far as the test has got; none where it has not got far enough for them."""
        try:
            return self._result_with(self.frames).summary
        except Exception:  # a user's summary need not expect half a test
            return {}
