"""Running a test: the only module that sees specimen, law, protocol and integrator together."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

import attrs
import numpy as np

from grainlaw.arguments import checked, is_number, refusal
from grainlaw.columns import ENERGY, SPENT, SUPPLIED
from grainlaw.compiler.batch import Compiled, compile_integrator
from grainlaw.contact import Laws
from grainlaw.detection import EVERYWHERE, Detection
from grainlaw.engine.diagnosis import fastest, first_fault
from grainlaw.engine.ledger import energies, motion, unbalanced
from grainlaw.engine.stable_step import StableStep
from grainlaw.engine.state import Saved, State
from grainlaw.engine.stepping import InstabilityError, OverlapError, advance
from grainlaw.integration import Integrator, Motion
from grainlaw.observation import Observer
from grainlaw.parameter import checked_whole_number
from grainlaw.protocol import LoadingProtocol
from grainlaw.results.frames import FrameClock, FrameRecorder, take_frame
from grainlaw.results.result import Result
from grainlaw.runs.curve_table import CurveTable
from grainlaw.runs.first_questions import ask_first_questions
from grainlaw.runs.plausibility import warn_of_scales
from grainlaw.specimen import Specimen
from grainlaw.stage import Drive, Stage, StageError

CALL = 4_000_000  #: zones times steps of one call of the engine: some tenths of a second, the delay of Ctrl-C
MOST_THREADS = 128
ROUNDING = 1e-9  #: of kinetic energy, and of gravity's work over the size of the specimen: no run is judged by less
TOLERATED_GAP = 0.5  #: energy made or lost, over the energy supplied: beyond it the run is unstable


@checked
def simulate(
    specimen: Specimen,
    law: Laws,
    protocol: LoadingProtocol,
    *,
    detection: Detection | None = EVERYWHERE,
    threads: int = 1,
    integrator: Integrator | None = None,
    time_step_factor: float = 1.0,
    mass_scaling: float = 1.0,
    observers: Sequence[Observer] = (),
    frames: int = 30,
) -> Result:
    """Put a specimen through a test.

    ``law`` is one contact law, or a mapping from pairs of phases to laws. ``detection`` says how contacts without a
    bond are found, and which law they follow; with None there are only the bonds of the specimen.
    ``threads`` share one model (several models at a time, as in :func:`compare`, use cores better).
    ``integrator`` replaces the protocol's in all stages, so that integrators can be compared like laws.
    ``time_step_factor`` shortens the integrator's stable step; ``mass_scaling`` lengthens it by this factor by raising
    the mass of the few nodes that govern it. ``frames`` is the number of moments kept for pictures and VTK. Raises
    :class:`ParameterError` before any work is done, :class:`InstabilityError` with the step, contact, grain and
    likely cause (:class:`OverlapError` where grains overlap too much), :class:`StageError`.
    """
    _check(threads, time_step_factor, mass_scaling)
    ask_first_questions(law, detection)
    stages = list(protocol.stages(specimen))  # refuses a specimen that does not fit before work is done
    if integrator is not None:
        stages = [attrs.evolve(stage, integrator=integrator) for stage in stages]
    warn_of_scales(specimen, law, stages)
    state = State(specimen, law, detection)
    return _Run(state, law, protocol, stages, threads, time_step_factor, mass_scaling, observers, frames).go()


def _check(threads: int, factor: float, scaling: float) -> None:
    checked_whole_number("simulate: threads", threads, at_least=1, at_most=MOST_THREADS)
    if not is_number(factor) or not 0 < factor <= 1:
        raise refusal("simulate: time_step_factor", factor, "above 0, at most 1")
    if not is_number(scaling) or not 1 <= scaling <= 100:
        raise refusal("simulate: mass_scaling", scaling, "from 1 to 100")


class _Run:
    """One run: the state, and what takes it through the stages."""

    def __init__(
        self,
        state: State,
        law: Laws,
        protocol: LoadingProtocol,
        stages: Sequence[Stage],
        threads: int,
        factor: float,
        scaling: float,
        observers: Sequence[Observer],
        frames: int,
    ) -> None:
        self.state, self.law, self.protocol, self.stages = state, law, protocol, stages
        self.threads, self.factor = threads, factor
        self.recorder = FrameRecorder(FrameClock(frames))
        self.observers = [self.recorder, *observers]
        self.columns = CurveTable()
        self.seconds = 0.0
        self.compiled: tuple[Integrator, Compiled] | None = None  #: the integrator of the last steps
        self.first_step, self.next_adapt, self.halts = 0, 0, 0  #: ``next_adapt`` counts in the stage
        self.most_steps = max(1, CALL // len(self.state.mesh.zones))
        self.supplied = 1e-300  #: J, largest external work so far, or that of giving all grains the platens' speed
        self.stability = StableStep(self.state, scaling)

    # --- stages ------------------------------------------------------------------------------------------------------

    def go(self) -> Result:
        for number, stage in enumerate(self.stages):
            try:
                self._run_stage(number, stage)
            except (StageError, OverlapError) as error:
                error.result = self._result(stage.name)
                raise
        return self._result(self.stages[-1].name)

    def _run_stage(self, number: int, stage: Stage) -> None:
        state = self.state
        state.begin(stage)
        fastest = max((abs(drive.speed) for drive in stage.drives if isinstance(drive, Drive)), default=0.0)
        size = float(np.hypot(*np.ptp(state.mesh.nodes, axis=0)))
        rounding = ROUNDING * size * float(np.abs(state.gravity.arrays.weight).sum())
        self.supplied = max(self.supplied, 0.5 * float(state.freedoms.arrays.mass[0].sum()) * fastest**2, rounding)
        integrator, before = stage.integrator, None
        state.time_step = self._time_step(stage, integrator)
        state.take_back_half_a_step_of_gravity()
        first = self.columns.count
        self.first_step, self.next_adapt, self.halts = state.steps, 0, 0
        self._steps(integrator, 0)  # compiles, so that the clock measures the time loop alone
        for _ in range(stage.sample_limit):
            steps = max(1, round(stage.interval / state.time_step))
            saved = state.save()
            start = time.perf_counter()
            integrator, before = self._advance(stage, integrator, before, steps)
            self.seconds += time.perf_counter() - start
            with np.errstate(all="ignore"):  # the check finds numbers that are not finite
                found = energies(state)
            self._check(found, saved, stage, integrator, steps)
            self._record(number, found)
            curves = self.columns.since(first)
            progress = max(condition.progress(curves) for condition in stage.until)
            for observer in self.observers:
                observer.observe(state, curves, stage, min(progress, 1.0))
            if progress >= 1:
                return
        raise StageError(
            f"stage '{stage.name}' did not end within {stage.sample_limit} samples; it waits for {list(stage.until)}"
        )

    def _time_step(self, stage: Stage, integrator: Integrator) -> float:
        step = self.factor * self.stability.step(integrator)
        return step if math.isfinite(step) else stage.interval

    def _advance(
        self, stage: Stage, integrator: Integrator, before: Motion | None, steps: int
    ) -> tuple[Integrator, Motion | None]:
        """Do ``steps``; integrator and time step change at steps counted from the stage's start, not at samples."""
        state = self.state
        end, look = state.steps + steps, self.stability.look
        while state.steps < end:
            since = state.steps - self.first_step
            if since and since % look == 0 and self.stability.has_changed():
                state.time_step = self._time_step(stage, integrator)
            if integrator.burst and since >= self.next_adapt:
                motion = state.motion()
                (integrator, halt), before = integrator.adapt(motion, before), motion
                # With bursts of equal length a mode of that period would be seen at rest every time.
                self.next_adapt = since + integrator.burst + self.halts % integrator.burst // 2
                if halt:
                    self.halts += 1
                    before = attrs.evolve(motion, velocity=np.zeros_like(motion.velocity))
                    state.stop()
                    self._steps(integrator, 1)
                    state.start_from_rest(motion.velocity)
                    continue
            pause = self.next_adapt - since if integrator.burst else look
            self._steps(integrator, min(pause, look - since % look, self.most_steps, end - state.steps))
        return integrator, before

    def _steps(self, integrator: Integrator, steps: int) -> None:
        if self.compiled is None or self.compiled[0] is not integrator:
            self.compiled = integrator, compile_integrator(integrator)
        advance(self.state, self.compiled[1], steps, threads=self.threads)

    def _record(self, number: int, energies: dict[str, float]) -> None:
        state = self.state
        state.note_breaks()
        row = {"time": state.time, "step": state.steps, "stage": number, **self.protocol.measure(state)}
        row |= {
            "tensile_cracks": int(np.sum(state.broken_mode < 0.5)),
            "shear_cracks": int(np.sum(state.broken_mode >= 0.5)),
            "damaged": int(np.count_nonzero(state.memory("damage") > 0)),
            "unbalanced": unbalanced(state),
            "motion": motion(state, energies),
        }
        row |= {ENERGY + kind: value for kind, value in energies.items()}
        self.columns.append(row)
        state.new_sample()

    # --- failure -----------------------------------------------------------------------------------------------------

    def _check(self, energy: dict[str, float], saved: Saved, stage: Stage, integrator: Integrator, steps: int) -> None:
        moving = self.state.kinetic_energy + abs(float(self.state.freedoms.books.given[0]))
        self.supplied = max(self.supplied, abs(energy[SUPPLIED]), ROUNDING * moving)
        gap = abs(energy[SUPPLIED] - sum(energy[kind] for kind in SPENT))
        if gap <= TOLERATED_GAP * self.supplied and np.isfinite(list(energy.values())).all():
            return
        with np.errstate(all="ignore"):
            error = InstabilityError(self._explain(saved, stage, integrator, steps))
        self.state.restore(saved)  # the result ends with the last moment before
        error.result = self._result(stage.name)
        raise error

    def _explain(self, saved: Saved, stage: Stage, integrator: Integrator, steps: int) -> str:
        """Replay the chunk step by step to find where it went wrong."""
        state = self.state
        state.restore(saved)
        for _ in range(steps):
            self._steps(integrator, 1)
            if place := first_fault(state):
                break
        else:
            place = fastest(state)
        return f"the run became unstable at step {state.steps} (t = {state.time:.4g} s, stage '{stage.name}'): {place}"

    def _result(self, stage: str) -> Result:
        state = self.state
        curves = self.columns.since(0)
        if not self.recorder.frames or self.recorder.frames[-1].time < state.time:
            self.recorder.frames.append(take_frame(state))
        return Result.from_run(state, self.law, self.protocol, curves, self.recorder.frames, self.seconds)
