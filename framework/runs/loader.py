"""The loading of a run: what it sees after a sample, and the speed of drives and steady motion that it asks for."""

from __future__ import annotations

import math
from collections.abc import Mapping

import attrs
import numpy as np

from grainlaw.columns import LOST, STORED, SUPPLIED, THERMAL
from grainlaw.condition import StageError
from grainlaw.engine.stable_step import StableStep
from grainlaw.engine.state import State
from grainlaw.engine.static_load import bring_under_load
from grainlaw.engine.steady import steady_motion, stiffness_along
from grainlaw.loading import RECENT, AccuracyError, Pace
from grainlaw.stage import Stage

FADING = 5  #: periods of the steady motion, in which energy that was released fades by 1/e
SLOWEST = 1e-4  #: of the highest frequency: that of a motion which nothing resists
NOISE = 1e-6  #: of the kinetic energy of the steady motion: less vibration counts as none
HEATED = 0.01  #: of the energy that free strains would store if they were held, over the change of temperature
TINY = 1e-300
STEPS = 10  #: of a sample, at least: the load grows by little in a step
FALLEN = 0.95  #: of the largest load: below, a specimen has failed, and its imbalance counts no more
EXACT = 1e-7  #: to which the static solution is rounded, so that it does not depend on how it was solved


@attrs.frozen(kw_only=True)
class _Seen:
    """What a loading goes by, after a sample that counts."""

    span: float = 0.0
    inertia: float = 0.0
    frequency: float = 0.0
    fastest: float = math.inf
    stored: float = 0.0
    load: float = 0.0  #: N/m, the largest so far
    force: float = 0.0  #: N/m, the largest work over travel so far
    supplied: float = 0.0  #: J/m
    lost: float = 0.0  #: J/m, in vibration and damping
    vibration: float = 0.0  #: J/m
    released: float = 0.0
    momentum: tuple[float, float] = (0.0, 0.0)
    imbalances: tuple[float, ...] = ()  #: of the last samples


class Loader:
    """Drives the stages of a run as their loadings ask for."""

    def __init__(self, state: State, stability: StableStep) -> None:
        self._state, self._stability = state, stability
        self._seen, self._new, self._wanted = _Seen(), _Seen(), 1.0

    def begin(self, stage: Stage) -> None:
        """Begin a stage: where it has a loading, with the steady motion in place of that of the stage before."""
        state, before = self._state, self._state.steady.velocity
        field, pace = np.zeros_like(before), 1.0
        if stage.loading is not None:
            field = self._static(stage)
            pace = stage.loading.first(self._pace())
        self._expect(stage)
        state.steady.begin(field, pace, state.time, rises=stage.loading is not None and stage.loading.ramp > 0)
        self._change(stage, before)
        if stage.static:
            bring_under_load(state, stage, self._stability)

    def _expect(self, stage: Stage) -> None:
        """Note when the stage usually ends."""
        span = stage.interval * (stage.expected or 0)
        lasts = span if stage.loading is None else stage.loading.usual(span, self._seen.frequency)
        self._state.usual_end = self._state.began + lasts if span else 0.0

    def _static(self, stage: Stage) -> np.ndarray:
        """The static solution; notes what a loading goes by."""
        state, stiffness = self._state, self._stability.stiffness()
        field = steady_motion(state, stiffness, self._stability.frequency)
        field = np.round(field / (scale := max(EXACT * float(np.abs(field).max()), TINY))) * scale
        inertia = max(float(np.sum(state.freedoms.arrays.mass * field**2)), TINY)
        lowest, along = SLOWEST * self._stability.frequency, max(stiffness_along(state, stiffness, field), 0.0)
        frequency = max(math.sqrt(along / inertia), lowest) if field.any() else self._stability.frequency
        assert stage.expected is not None
        span = stage.interval * stage.expected
        self._seen = _Seen(
            span=span, inertia=inertia, frequency=frequency, force=HEATED * along * span * bool(state.heat.sign),
            fastest=stage.interval / (STEPS * state.time_step), supplied=math.nan, momentum=self._momentum(),
        )  # fmt: skip
        return field

    def steps(self, stage: Stage) -> int:
        """Steps of the next sample."""
        pace, heat = self._state.steady.pace, self._state.heat
        steps = max(1, round(stage.interval / pace / self._state.time_step))
        if not heat.sign or heat.target is None:
            return steps
        left = math.ceil(abs(heat.target - heat.temperature) / pace / self._state.time_step)
        return left if left < 1.5 * steps else steps  # the last sample ends at the temperature of the stage

    def accepts(self, stage: Stage, energies: Mapping[str, float], began: float) -> bool:
        """Whether a sample that ``began`` at a time (s) counts; otherwise the run returns to it and calls ``repeat``.

        Raises :class:`StageError` if its accuracy cannot be had.
        """
        if stage.loading is None:
            return True
        self._new = self._look(energies, self._state.time - began)
        try:
            self._wanted, again = stage.loading.next(self._pace(self._new))
        except AccuracyError as error:
            raise StageError(f"stage '{stage.name}': {error}") from None
        return not again

    def repeat(self, stage: Stage) -> None:
        """Take the speed that was asked for, at the beginning of the sample."""
        self._take(stage)

    def go_on(self, stage: Stage) -> None:
        """Take the speed that was asked for, after a sample that counts."""
        if stage.loading is None:
            return
        self._seen = self._new
        self._take(stage)

    def look(self, stage: Stage) -> None:
        """Let the steady motion follow the mean motion; asked at steps that do not depend on samples.

        While a speed rises over a ramp, nothing is steady: all motion is damped.
        """
        if stage.loading is None:
            return
        state, steady = self._state, self._state.steady
        if steady.rises:
            steady.rise(state.time, done=state.time - state.began >= stage.loading.ramp)
            changed = not steady.rises
        else:
            period = 2 * math.pi / self._seen.frequency
            changed = steady.follow(state.boundaries.driven, state.boundaries.speeds, state.time, period)
        if changed:
            self._damp(stage)

    def _take(self, stage: Stage) -> None:
        before = self._state.steady.velocity
        self._state.steady.books.pace[0] = self._wanted
        self._change(stage, before)

    def _change(self, stage: Stage, before: np.ndarray) -> None:
        """Replace the steady motion ``before`` (r, n) by the present one: vibration stays, and no wave starts."""
        if (change := self._state.steady.velocity - before).any():
            self._state.change_velocity(change)
        self._damp(stage)
        self._seen = attrs.evolve(self._seen, momentum=self._momentum())

    def _damp(self, stage: Stage) -> None:
        self._state.steady.damp_beside(stage.integrator.beside_loading)

    # --- what a loading sees ----------------------------------------------------------------------------------------

    @property
    def _damaged(self) -> bool:
        return bool((self._state.memory("damage") > 0).any())

    def _momentum(self) -> tuple[float, float]:
        x, y = np.sum(self._state.freedoms.arrays.mass[:2] * self._state.freedoms.arrays.velocity[:2], axis=1).tolist()
        return x, y

    def _look(self, energies: Mapping[str, float], time: float) -> _Seen:
        """What has changed in a sample of a time (s)."""
        state, seen = self._state, self._seen
        travel, momentum = state.steady.pace * time, self._momentum()
        vibration, supplied = state.steady.vibration(), energies[SUPPLIED] - energies[THERMAL]
        lost = energies[LOST] + vibration
        if math.isnan(seen.supplied):  # the first sample of a stage
            seen = attrs.evolve(seen, lost=lost, supplied=supplied)
        force = max(seen.force, abs(supplied - seen.supplied) / travel)
        noise = NOISE * seen.inertia * state.steady.pace**2 / 2
        released = max(lost - seen.lost - noise, 0.0) / max(force * travel, 1e-300)
        faded = seen.released * math.exp(-time * seen.frequency / (2 * math.pi * FADING))
        now = state.boundaries.largest_load()
        load = max(seen.load, now)
        change = max(abs(after - before) for after, before in zip(momentum, seen.momentum, strict=True))
        fallen = now < FALLEN * load
        imbalance = 0.0 if fallen or load == 0 else change / time / load
        return attrs.evolve(
            seen, stored=max(seen.stored, sum(energies[kind] for kind in STORED)), load=load, force=force,
            supplied=supplied, lost=lost, vibration=max(vibration - noise, 0.0), released=max(released, faded),
            momentum=momentum, imbalances=(*seen.imbalances, imbalance)[-RECENT:],
        )  # fmt: skip

    def _pace(self, seen: _Seen | None = None) -> Pace:
        seen = seen or self._seen
        last = seen.imbalances
        return Pace(
            speed=self._state.steady.pace, unit="m/s" if self._state.heat.target is None else "K/s",
            span=seen.span, inertia=seen.inertia, frequency=seen.frequency, fastest=seen.fastest,
            stored=seen.stored, vibration=seen.vibration, damaged=self._damaged,
            released=seen.released, imbalance=last[-1] if last else 0.0,
            least_imbalance=min(last) if len(last) == RECENT else 0.0,
        )  # fmt: skip

    # --- checkpoints ------------------------------------------------------------------------------------------------

    def save(self) -> dict[str, object]:
        """Numbers of a checkpoint."""
        return attrs.asdict(self._seen)

    def restore(self, numbers: Mapping[str, object], stage: Stage) -> None:
        """Go on from what ``save`` returned."""
        self._seen = _Seen(**{name: tuple(v) if isinstance(v, list) else v for name, v in numbers.items()})  # type: ignore[arg-type]
        self._expect(stage)
