"""Running a test: the only module that sees specimen, law, protocol and integrator together."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any

import attrs

from grainlaw.arguments import checked, is_number
from grainlaw.columns import check_panels
from grainlaw.conditions import StageError
from grainlaw.contact import Laws
from grainlaw.detection import EVERYWHERE, Detection
from grainlaw.engine.ageing import check_ageing
from grainlaw.engine.device import Gpu
from grainlaw.engine.model import Model
from grainlaw.engine.state import State
from grainlaw.engine.stepping import InstabilityError
from grainlaw.engine.thread_count import AUTO, ThreadCount, Threads, checked_threads, cores
from grainlaw.fields import ParameterError, checked_number, checked_whole_number
from grainlaw.integration import Integrator
from grainlaw.loads import Quiet
from grainlaw.messages import refusal
from grainlaw.observation import Observer
from grainlaw.protocol import LoadingProtocol, stages_of
from grainlaw.results.archive import law_name
from grainlaw.results.result import Result
from grainlaw.runs import record
from grainlaw.runs.claim import Folder, claimed
from grainlaw.runs.estimate import check_memory
from grainlaw.runs.execution import Execution
from grainlaw.runs.first_questions import ask_first_questions
from grainlaw.runs.plausibility import (
    refuse_heat_after_conduction,
    refuse_lost_loads,
    refuse_lost_pressures,
    warn_of_contacts,
    warn_of_free,
    warn_of_idle_laws,
    warn_of_jumps,
    warn_of_scales,
    warn_of_thin_cell,
    warn_of_unbalanced,
)
from grainlaw.runs.progress import RunBar, RunFile, Shown, shown_in
from grainlaw.runs.progress_file import PROGRESS, ProgressFile
from grainlaw.runs.run_folder import RunFolder, checkpoint_of
from grainlaw.runs.stepper import Stepper
from grainlaw.runs.stopping import Stop, Stopped
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage

LEAST_FACTOR = 1e-6  #: of the stable step: with less a run would not end


@checked
def simulate(
    specimen: Specimen,
    law: Laws,
    protocol: LoadingProtocol,
    *,
    detection: Detection | None = EVERYWHERE,
    threads: Threads | ThreadCount = "auto",
    device: Gpu | None = None,
    integrator: Integrator | None = None,
    time_step_factor: float = 1.0,
    mass_scaling: float = 1.0,
    observers: Sequence[Observer] = (),
    frames: int = 30,
    checkpoint: Folder = None,
    every: float = 60.0,
    restart: bool = False,
    overwrite: bool = False,
    stop: Stop | None = None,
    progress: Shown = True,
) -> Result:
    """Put a specimen through a test.

    ``law`` is one contact law, or a mapping from pairs of phases to laws. ``detection`` says how contacts without a
    bond are found, and which law they follow; with None there are only the bonds of the specimen.
    ``threads`` share one model; with "auto" they are as many as pay for its size and for what else the machine does,
    which is tried anew now and then. The result does not depend on them. A ``device`` does the steps in their place
    (docs/device.md).
    ``integrator`` replaces the protocol's in all stages, so that integrators can be compared like laws.
    ``time_step_factor`` shortens the integrator's stable step; ``mass_scaling`` lengthens it by this factor by raising
    the mass of the few nodes that govern it. About ``frames`` moments are kept for pictures and VTK.

    ``checkpoint`` is a folder in which curves, cracks, summary and a record are written while the run goes on, and
    every ``every`` seconds, at a signal to stop and at the end a checkpoint. With ``restart`` the run goes on from it,
    with the same bits as if it had never stopped (from the beginning where there is none); ``overwrite`` removes the
    run that the folder holds. ``stop`` ends the run when it is asked to (docs/reliability.md).

    On a terminal and in a notebook a bar says what is compiled, how far the run is and the time left, unless
    ``progress`` is False.

    Raises :class:`ParameterError` before any work is done, :class:`InstabilityError` with the step, contact, grain and
    likely cause (:class:`OverlapError` where grains overlap too much), :class:`StageError`, and :class:`Stopped` (a
    KeyboardInterrupt); these four have the ``result`` so far.
    """
    shared = threads if isinstance(threads, ThreadCount) else checked_threads("simulate: threads", threads)
    checked_number("simulate: every", every, "s", at_least=0)
    if checkpoint is None and (restart or overwrite):
        raise ParameterError("simulate: restart and overwrite need a checkpoint, the folder of the run")
    options: dict[str, Any] = {
        "integrator": integrator, "time_step_factor": time_step_factor, "mass_scaling": mass_scaling, "frames": frames,
    }  # fmt: skip
    state, stages = begun(Model(specimen, law, detection), protocol, **options)
    stop, watching = stop or Stop(), list(observers)

    def execution(folder: RunFolder | None) -> Execution:
        stepper = Stepper(
            state, stages[0].moved_by, threads=device or (ThreadCount(cores) if shared == AUTO else shared),
            factor=time_step_factor, scaling=mass_scaling, stop=stop,
        )  # fmt: skip
        return Execution(stepper, protocol, stages, observers=watching, frames=frames, folder=folder)

    with ExitStack() as stack:
        if device is not None:
            stack.enter_context(device.joined())
        if (bars := stack.enter_context(shown_in(progress))) is not None:
            watching.append(RunBar(bars.bar(law_name(law))))
        if checkpoint is None:
            stack.enter_context(stop.by_signals(only_interrupt=True))
            return execution(None).go()
        claim = stack.enter_context(claimed(checkpoint, restart=restart, overwrite=overwrite))
        stack.enter_context(stop.by_signals())
        about = {**claim.about, "threads": shared if isinstance(shared, int) else AUTO, "cite": list(specimen.cite)}
        what = record.described_run(state.model, protocol, {"detection": detection, **options})
        found = checkpoint_of(claim.path, what["key"]) if claim.restart else None
        stack.enter_context(record.recorded(claim.path, {**about, **what}))
        folder = RunFolder(claim, every, what["key"])
        stack.callback(folder.close)
        watching.append(RunFile(stack.enter_context(ProgressFile(claim.path / PROGRESS))))
        run = execution(folder)
        if found is not None:
            run.go_on_from(found)
        return _kept(run, folder)


def _kept(run: Execution, folder: RunFolder) -> Result:
    """Run, and leave a summary in the folder, however it ends."""
    try:
        result = run.go()
    except (StageError, InstabilityError, Stopped) as error:
        folder.keep(error.result.frames)
        folder.summarize(error.result.summary, str(error))
        raise
    folder.keep(result.frames)
    folder.summarize(result.summary, "finished")
    return result


def begun(
    model: Model, protocol: LoadingProtocol, *, integrator: Integrator | None = None, time_step_factor: float = 1.0,
    mass_scaling: float = 1.0, frames: int = 30,
) -> tuple[State, list[Stage]]:  # fmt: skip
    """A specimen before its first step, and the stages of its test; all that :func:`simulate` refuses is refused here.

    Raises :class:`ParameterError`, also for a specimen that does not fit the test, and for what no stage may have.
    """
    if not is_number(time_step_factor) or not LEAST_FACTOR <= time_step_factor <= 1:
        raise refusal("simulate: time_step_factor", time_step_factor, f"from {LEAST_FACTOR:g} to 1")
    if not is_number(mass_scaling) or not 1 <= mass_scaling <= 100:
        raise refusal("simulate: mass_scaling", mass_scaling, "from 1 to 100")
    checked_whole_number("simulate: frames", frames, at_least=1)
    ask_first_questions(model)
    check_memory(model.specimen, frames)
    state = State(model)
    stages = stages_of(protocol, state.specimen)
    check_ageing(state, stages)
    check_panels(type(protocol).__name__, protocol.panels, protocol.quantities)
    if integrator is not None:
        stages = [attrs.evolve(stage, integrator=integrator) for stage in stages]
    for stage in stages:
        state.check(stage)
        if stage.of(Quiet) and mass_scaling > 1:
            raise ParameterError(
                f"simulate: mass_scaling = {mass_scaling:g} is not allowed with quiet boundaries: waves in heavier "
                "grains are slower"
            )
    refuse_lost_loads(model, stages)
    refuse_lost_pressures(model, stages)
    refuse_heat_after_conduction(stages)
    warn_of_contacts(model.specimen, model.laws)
    warn_of_scales(model, stages)
    warn_of_free(stages)
    warn_of_unbalanced(model, stages)
    warn_of_jumps(stages)
    warn_of_thin_cell(model)
    warn_of_idle_laws(model)
    return state, stages
