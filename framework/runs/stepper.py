"""What moves a specimen from sample to sample: an integrator and its time step, and what is looked at between steps."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import attrs
import numpy as np

from grainlaw.compiler.batch import Compiled, compile_integrator
from grainlaw.engine.device import DeviceError, Gpu
from grainlaw.engine.parts.fluids import FLOW
from grainlaw.engine.stable_step import StableStep
from grainlaw.engine.state import State
from grainlaw.engine.stepping import Crew, advance
from grainlaw.integration import Integrator, Motion
from grainlaw.loads import Fluid
from grainlaw.runs.stopping import Stop, Stopped
from grainlaw.stage import Stage

CALL = 4_000_000  #: zones times steps of one call of the engine: some tenths of a second, the delay of Ctrl-C


class Stepper:
    """Does steps. Integrator and time step change at steps counted from the stage's start, not at samples."""

    def __init__(
        self, state: State, integrator: Integrator, *, threads: Crew, factor: float, scaling: float,
        stop: Stop,
    ) -> None:  # fmt: skip
        self.state, self.integrator, self.threads, self.factor, self.stop = state, integrator, threads, factor, stop
        self.before: Motion | None = None  #: the motion that the integrator has seen last
        self.stability = StableStep(state, scaling)
        self.first = 0  #: step at which the stage began
        self.next_adapt = 0  #: step since then
        self.halts = 0  #: of the integrator, since then
        self._compiled: tuple[Integrator, Compiled] | None = None  #: the integrator of the last steps
        teams = threads.side_by_side if isinstance(threads, Gpu) else 1
        self._most = max(1, CALL * teams // len(state.mesh.zones))

    def begin(self, stage: Stage) -> None:
        """Take the time step of a stage that has just begun."""
        self.integrator, self.before = stage.moved_by, None
        self.stability.fluid_has_changed()
        self.state.change_time_step(self._time_step(stage))

    def start(self, integrator: Integrator) -> None:
        """Count steps from here on: what brought the stage here, as a static solution, has taken some of its own."""
        self.integrator, self.first, self.next_adapt, self.halts = integrator, self.state.steps, 0, 0

    def _time_step(self, stage: Stage) -> float:
        step = self.factor * self.stability.step(self.integrator)
        return step if math.isfinite(step) else stage.interval

    def advance(self, stage: Stage, steps: int, look: Callable[[Stage], None]) -> None:
        """Do ``steps``; ``look`` is called now and then. Raises :class:`~grainlaw.runs.stopping.Stopped`."""
        state = self.state
        end, often = state.steps + steps, self.stability.look
        flow = FLOW if stage.of(Fluid) else often
        while state.steps < end:
            self.stop.check()
            since = state.steps - self.first
            if since % often == 0:
                look(stage)
                state.let_membranes_follow()
                if since and self.stability.has_changed():
                    state.change_time_step(self._time_step(stage))
            if since % flow == 0:
                state.let_fluids_follow()
                if self.stability.fluid_has_changed():
                    state.change_time_step(self._time_step(stage))
            heat = state.let_heat_flow() or often
            burst = self.integrator.burst
            if burst and since >= self.next_adapt:
                now = state.freedoms.motion()
                (self.integrator, halt), self.before = self.integrator.adapt(now, self.before), now
                # With bursts of equal length a mode of that period would be seen at rest every time.
                self.next_adapt = since + burst + self.halts % burst // 2
                if halt:
                    self.halts += 1
                    self.before = attrs.evolve(now, velocity=np.zeros_like(now.velocity))
                    state.freedoms.stop()
                    self.do(1)
                    state.start_from_rest(now.velocity)
                    continue
            pause = self.next_adapt - since if burst else often
            self.do(min(pause, often - since % often, flow - since % flow, heat, self._most, end - state.steps))

    def do(self, steps: int) -> None:
        """Do ``steps`` as they are; with none the step is compiled. Raises Stopped where a device fails."""
        try:
            self._do(steps)
        except DeviceError as error:
            raise Stopped(str(error)) from error

    def _do(self, steps: int) -> None:
        if self._compiled is None or self._compiled[0] is not self.integrator:
            before = None if self._compiled is None else self._compiled[1]
            self._compiled = self.integrator, compile_integrator(self.integrator, before)
        if steps and self.state.freedoms.lags:
            advance(self.state, self._compiled[1], 1, threads=self.threads)
            self.state.freedoms.catch_up()
            steps -= 1
        advance(self.state, self._compiled[1], steps, threads=self.threads)

    def save(self) -> dict[str, Any]:
        """What it goes by, beside the integrator and the motion that this has seen."""
        return {
            "time_step": self.state.time_step, "first": self.first, "next_adapt": self.next_adapt,
            "halts": self.halts, "stable_step": self.stability.save(),
        }  # fmt: skip

    def restore(self, saved: Mapping[str, Any], integrator: Integrator, before: Motion | None) -> None:
        """Go on from what :meth:`save` returned."""
        self.integrator, self.before, self.state.time_step = integrator, before, saved["time_step"]
        self.first, self.next_adapt, self.halts = (saved[name] for name in ("first", "next_adapt", "halts"))
        self.stability.restore(saved["stable_step"])
