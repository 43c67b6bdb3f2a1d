"""Running a test: the only module that sees specimen, law, protocol and integrator together."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.assembly import Laws, share_out
from grainlaw.integration import Integrator, Motion
from grainlaw.kernels import loop
from grainlaw.kernels.batch import compile_integrator
from grainlaw.loading import LoadingProtocol, Stage
from grainlaw.observation import FrameRecorder, Observer, take_frame
from grainlaw.parameter import ParameterError
from grainlaw.result import Result
from grainlaw.specimen import Specimen
from grainlaw.stability import highest_frequency, rigid_map, scale_masses, stiffness_matrix
from grainlaw.state import Saved, State

CALL = 4_000_000  #: zones times steps of one call of the engine, some tenths of a second: Ctrl-C waits no longer
MOST_THREADS = 128
TOLERATED_GAP = 0.5  #: energy made or lost, over the energy supplied: beyond it the run is unstable


class InstabilityError(ArithmeticError):
    """A run that left the finite numbers or made energy; ``result`` holds what was recorded before."""

    result: Result


class StageLimitError(RuntimeError):
    """A stage that did not end within its number of samples; ``result`` holds what was recorded."""

    result: Result


def simulate(
    specimen: Specimen,
    law: Laws,
    protocol: LoadingProtocol,
    *,
    threads: int = 1,
    time_step_factor: float = 1.0,
    mass_scaling: float = 1.0,
    observers: Sequence[Observer] = (),
    frames: int = 30,
) -> Result:
    """Put a specimen through a test.

    ``law`` is one contact law, or a mapping from pairs of phases to laws. ``threads`` share one model (several models
    at a time, as in :func:`compare`, use cores better). ``time_step_factor`` shortens the integrator's stable step;
    ``mass_scaling`` lengthens it so many times by raising the mass of the nodes that alone govern it. ``frames`` is
    the number of moments kept for pictures and VTK. Raises :class:`ParameterError` before any work is done,
    :class:`InstabilityError` with the step, contact, grain and likely cause, :class:`StageLimitError`.
    """
    _check(specimen, law, protocol, threads, time_step_factor, mass_scaling)
    return _Run(specimen, law, protocol, threads, time_step_factor, mass_scaling, observers, frames).go()


def _check(
    specimen: Specimen, law: Laws, protocol: LoadingProtocol, threads: int, factor: float, scaling: float
) -> None:
    if not isinstance(specimen, Specimen):
        raise ParameterError(f"simulate: specimen = {specimen!r} is not allowed, it must be a Specimen")
    if not isinstance(protocol, LoadingProtocol):
        raise ParameterError(f"simulate: protocol = {protocol!r} is not allowed, it must be a LoadingProtocol")
    if not isinstance(threads, int) or isinstance(threads, bool) or not 1 <= threads <= MOST_THREADS:
        raise ParameterError(
            f"simulate: threads = {threads!r} is not allowed, it must be a whole number from 1 to {MOST_THREADS}"
        )
    if not 0 < factor <= 1:
        raise ParameterError(f"simulate: time_step_factor = {factor!r} is not allowed, it must be above 0, at most 1")
    if not 1 <= scaling <= 100:
        raise ParameterError(f"simulate: mass_scaling = {scaling!r} is not allowed, it must be from 1 to 100")


class Columns:
    """Rows of named numbers, kept as arrays that grow."""

    def __init__(self) -> None:
        self.count = 0
        self._table: dict[str, np.ndarray] = {}

    def append(self, row: Mapping[str, float]) -> None:
        """Add one row; the first one names the columns, later ones may add some (nan before)."""
        for name, value in row.items():
            column = self._table.get(name)
            if column is None or self.count == len(column):
                longer = np.full(max(1024, 2 * self.count), np.nan)
                longer[: self.count] = np.nan if column is None else column
                column = self._table[name] = longer
            column[self.count] = value
        self.count += 1

    def since(self, first: int) -> dict[str, np.ndarray]:
        """The rows from number ``first`` on."""
        return {name: column[first : self.count] for name, column in self._table.items()}


class _Run:
    """One run: the state, and what is needed to carry it through the stages."""

    def __init__(
        self,
        specimen: Specimen,
        law: Laws,
        protocol: LoadingProtocol,
        threads: int,
        factor: float,
        scaling: float,
        observers: Sequence[Observer],
        frames: int,
    ) -> None:
        self.protocol, self.threads, self.factor = protocol, threads, factor
        self.stages = list(protocol.stages(specimen))  # refuses a specimen that does not fit before work is done
        self.state = State(specimen, law)
        self.law = law
        self.recorder = FrameRecorder(frames)
        self.observers = [self.recorder, *observers]
        self.columns = Columns()
        self.seconds = 0.0
        self.most_steps = max(1, CALL // len(self.state.mesh.zones))
        self.supplied = 1e-300  #: J, largest external work so far, or that of giving all grains the platens' speed
        self._prepare_stability(scaling)

    # --- stable step -------------------------------------------------------------------------------------------------

    def _prepare_stability(self, scaling: float) -> None:
        state = self.state
        self.contact_stiffness = np.empty((2, 2 * len(state.mesh.interfaces)))  # kn, ks in the engine's order
        for group in state.groups:
            for row, value in zip(self.contact_stiffness, group.law.stiffness, strict=True):
                spread = np.broadcast_to(value, 2 * group.size).reshape(2, -1)
                row.reshape(2, -1)[:, group.first : group.last] = spread
        matrix = self._stiffness(self.contact_stiffness[0])
        mass = self._flat_mass()
        self.frequency = highest_frequency(matrix, mass)
        if scaling > 1:
            scaled = scale_masses(matrix, mass, scaling, self._share_mass())
            state.mass_added, self.frequency = scaled.added, scaled.frequency
            self._set_mass(scaled.mass)
        self.stiffest = 1.0  # closure stiffness over kn that the present step allows for

    def _flat_mass(self) -> np.ndarray:
        mass = self.state.freedoms.mass
        return mass.ravel() if self.state.rigid.grains else mass.T.ravel()

    def _share_mass(self) -> np.ndarray:
        """Number for each freedom, equal for those that have one mass: a node's two, a rigid grain's x and y."""
        rows, count = self.state.freedoms.mass.shape
        if self.state.rigid.grains:
            return np.concatenate([np.tile(np.arange(count), 2), count + np.arange(count)])
        return np.repeat(np.arange(count), rows)

    def _set_mass(self, flat: np.ndarray) -> None:
        mass = self.state.freedoms.mass
        mass[:] = flat.reshape(mass.shape) if self.state.rigid.grains else flat.reshape(-1, 2).T

    def _stiffness(self, kn: np.ndarray) -> Any:
        specimen, order = self.state.specimen, self.state.order
        rows = [np.empty((2, len(order))) for _ in range(2)]
        for row, values in zip(rows, (kn, self.contact_stiffness[1]), strict=True):
            row[:, order] = values.reshape(2, -1)
        matrix = stiffness_matrix(specimen, *rows)
        if specimen.is_rigid:
            carry = rigid_map(specimen)
            matrix = (carry.T @ matrix @ carry).tocsr()
        return matrix

    def _follow_closure(self, integrator: Integrator) -> None:
        """Shorten the step where a law's closure has become stiffer than its first response (Bandis)."""
        tangents = self.state.closure_tangents()
        ratio = float(np.max(tangents / self.contact_stiffness[0], initial=1.0))
        if np.isfinite(ratio) and ratio > 1.05 * self.stiffest:
            self.stiffest = 1.2 * ratio  # ahead of what comes, so that this is rare
            kn = np.maximum(self.contact_stiffness[0], 1.2 * tangents)
            self.frequency = highest_frequency(self._stiffness(kn), self._flat_mass())
            self.state.time_step = self.factor * integrator.stable_step(self.frequency)

    # --- stages ------------------------------------------------------------------------------------------------------

    def go(self) -> Result:
        for stage in self.stages:
            self._run_stage(stage)
        return self._result(self.stages[-1].name)

    def _run_stage(self, stage: Stage) -> None:
        state = self.state
        state.stage = stage.name
        state.drive(stage.drives)
        fastest = max((abs(drive.speed) for drive in stage.drives), default=0.0)
        self.supplied = max(self.supplied, 0.5 * float(state.freedoms.mass[0].sum()) * fastest**2)
        state.give_velocity(stage.initial_velocity)
        integrator, before = stage.integrator, None
        state.time_step = self.factor * integrator.stable_step(self.frequency)
        began, first = state.time, self.columns.count
        self._steps(stage, integrator, 0, began)  # compiles, so that the clock sees the time loop alone
        for _ in range(stage.sample_limit):
            steps = max(1, round(stage.interval / state.time_step))
            saved = state.save()
            start = time.perf_counter()
            integrator, before = self._advance(stage, integrator, before, steps, began)
            self.seconds += time.perf_counter() - start
            with np.errstate(all="ignore"):  # what is not finite is found by the check
                energies = state.energies()
            self._check(energies, saved, stage, integrator, steps, began)
            self._record(energies)
            curves = self.columns.since(first)
            progress = max(condition.progress(curves) for condition in stage.until)
            for observer in self.observers:
                observer.observe(state, curves, stage, min(progress, 1.0))
            if progress >= 1:
                return
            self._follow_closure(integrator)
        error = StageLimitError(
            f"stage '{stage.name}' did not end within {stage.sample_limit} samples; it waits for {list(stage.until)}"
        )
        error.result = self._result(stage.name)
        raise error

    def _advance(
        self, stage: Stage, integrator: Integrator, before: Motion | None, steps: int, began: float
    ) -> tuple[Integrator, Motion | None]:
        done = 0
        while done < steps:
            burst = min(integrator.burst or self.most_steps, steps - done)
            done += burst
            if integrator.burst:  # at the start of a burst, so that samples see the motion as the steps left it
                motion = self.state.motion()
                (integrator, halt), before = integrator.adapt(motion, before), motion
                if halt:
                    before = attrs.evolve(motion, velocity=np.zeros_like(motion.velocity))
                    self.state.stop()
                    self._steps(stage, integrator, 1, began)
                    self.state.start_from_rest(motion.velocity)
                    burst -= 1
            if burst:
                self._steps(stage, integrator, burst, began)
        return integrator, before

    def _steps(self, stage: Stage, integrator: Integrator, steps: int, began: float) -> None:
        state = self.state
        compiled = compile_integrator(integrator)
        parameters = np.append(compiled.numbers, state.time_step)
        times = state.time - began + state.time_step * (np.arange(steps) + 1)
        schedule = np.zeros((steps, len(stage.drives) + 1))  # the last column holds the rotation of rigid grains
        for column, drive in enumerate(stage.drives):
            schedule[:, column] = drive.velocity(times)
        parts = share_out(state.specimen, state.driven, self.threads)
        loop.run(
            self.threads, steps, state.steps, state.time_step, state.arrays, state.contacts, state.table,
            state.freedoms, state.driven, schedule, state.rigid, parts, compiled.address, parameters.ctypes.data,
        )  # fmt: skip
        state.count_steps(steps)

    def _record(self, energies: dict[str, float]) -> None:
        state = self.state
        state.note_breaks()
        row = {"time": state.time, "step": state.steps, **self.protocol.measure(state)}
        row |= {
            "tensile_cracks": int(np.sum(state.broken_mode < 0.5)),
            "shear_cracks": int(np.sum(state.broken_mode >= 0.5)),
            "unbalanced": state.unbalanced(),
        }
        row |= {f"energy_{name}": value for name, value in energies.items()}
        self.columns.append(row)
        state.new_sample()

    # --- failure -----------------------------------------------------------------------------------------------------

    def _check(
        self, energy: dict[str, float], saved: Saved, stage: Stage, integrator: Integrator, steps: int, began: float
    ) -> None:
        self.supplied = max(self.supplied, abs(energy["external"]))
        gap = abs(energy["external"] - sum(value for name, value in energy.items() if name != "external"))
        if gap <= TOLERATED_GAP * self.supplied and np.isfinite(list(energy.values())).all():
            return
        with np.errstate(all="ignore"):
            error = InstabilityError(self._explain(saved, stage, integrator, steps, began))
        self.state.restore(saved)  # what is kept is the last moment before
        error.result = self._result(stage.name)
        raise error

    def _explain(self, saved: Saved, stage: Stage, integrator: Integrator, steps: int, began: float) -> str:
        """Replay the chunk step by step to find where it went wrong."""
        state = self.state
        state.restore(saved)
        for _ in range(steps):
            self._steps(stage, integrator, 1, began)
            if place := _first_fault(state):
                break
        else:
            place = _fastest(state)
        return f"the run became unstable at step {state.steps} (t = {state.time:.4g} s, stage '{stage.name}'): {place}"

    def _result(self, stage: str) -> Result:
        state = self.state
        curves = self.columns.since(0)
        if not self.recorder.frames or self.recorder.frames[-1].time < state.time:
            self.recorder.frames.append(take_frame(state))
        return Result.from_run(state, self.law, self.protocol, curves, self.recorder.frames, self.seconds)


def _first_fault(state: State) -> str | None:
    """The contact point or grain that left the finite numbers, in words."""
    tractions = state.normal + state.shear
    if not np.isfinite(tractions).all():
        p = int(np.argmin(np.isfinite(tractions)))
        a, b = _grains_at(state, p)
        where = f"contact point {p} between grains {a} and {b}"
        if np.isfinite(state.opening[p] + state.slip[p]):
            return (
                f"the law returned {state.normal[p]} and {state.shear[p]} Pa at {where} "
                f"(opening {state.opening[p]:.4g} m, slip {state.slip[p]:.4g} m); look at this law with gl.trace"
            )
        return f"opening and slip are not finite at {where}"
    speeds = state.freedoms.velocity
    if not np.isfinite(speeds).all():
        n = int(np.argmin(np.isfinite(speeds).all(axis=0)))
        return f"the velocity of grain {n if state.rigid.grains else state.mesh.node_grain[n]} is not finite"
    return None


def _fastest(state: State) -> str:
    node = int(np.argmax(np.hypot(*state.velocity.T)))
    speed = float(np.hypot(*state.velocity[node]))
    grain = int(state.mesh.node_grain[node])
    p = int(np.argmax(np.hypot(state.opening, state.slip)))
    a, b = _grains_at(state, p)
    return (
        f"the energy balance does not close; grain {grain} moves at {speed:.4g} m/s, and contact point {p} "
        f"between grains {a} and {b} has opened by {state.opening[p]:.4g} m; likely cause: a time step that is too "
        "long for a law stiffer than its `stiffness` says; lower the integrator's safety, or see the law with gl.trace"
    )


def _grains_at(state: State, point: int) -> tuple[int, int]:
    a, b = state.mesh.interface_grains[state.order[point % len(state.order)]]
    return int(a), int(b)
