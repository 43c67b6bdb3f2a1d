"""The loading of a run: what it sees after a sample, and the speed of drives and steady motion that it asks for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.columns import IMBALANCE, LOST, STABILITY, STORED, SUPPLIED, THERMAL
from grainlaw.conditions import StageError
from grainlaw.engine.margin import LARGEST, Margin
from grainlaw.engine.stable_step import StableStep
from grainlaw.engine.stage_statics import steady_motion, stiffness_along
from grainlaw.engine.state import State
from grainlaw.engine.static_load import bring_under_load
from grainlaw.integration import Integrator
from grainlaw.loading import RECENT, AccuracyError, Loading, Pace
from grainlaw.loads import Heat
from grainlaw.messages import short
from grainlaw.stage import Stage

FADING = 5  #: periods of the steady motion, in which energy that was released fades by 1/e
SLOWEST = 1e-4  #: of the highest frequency: that of a motion which nothing resists
NOISE = 1e-6  #: of the kinetic energy of the steady motion: less vibration counts as none
HEATED = 0.01  #: of the force and the energy that free strains would have if they were held
TINY = 1e-300
STEPS = 10  #: of a sample, at least: the load grows by little in a step
FALLEN = 0.95  #: of the largest load: below, a specimen has failed, and its imbalance counts no more
ASKED = 1 / 100  #: of the span of a stage: the stability margin is asked for again after so much, and
FARTHER = 0.15  #: of the way so far, while no contact is damaged; sooner where it falls by
LOWER = 0.1  #: of it, and at every sample while the softest motion is settled: from a margin on that is below
SOFT = 0.2
SHORT = 0.004  #: of the way so far: between two times that a motion is settled
SLIDES = 0.01  #: of the slip: so much of it that the stiffness does not explain
MOST = 10  #: pieces of a sample for it; times that a sample is as long as the one before
REPEATS = 200  #: times that a sample is done again at most: each is about half as fast as the one before
FINE = 1 / 800  #: of the way so far: the smallest piece of a sample in which contacts are damaged
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
    least: float = 0.0  #: N/m, of a heated specimen: less load counts as none
    inner: float = 0.0  #: sqrt(N)/m^1/2, force of its own stresses over the root of the energy that they store
    fallen: bool = False  #: whether the load is well below it now: the specimen has failed
    force: float = 0.0  #: N/m, the largest work over travel so far
    supplied: float = 0.0  #: J/m
    lost: float = 0.0  #: J/m, in vibration and damping
    vibration: float = 0.0  #: J/m
    released: float = 0.0
    momentum: tuple[float, float] = (0.0, 0.0)
    imbalances: tuple[float, ...] = ()  #: of the last samples
    #: s, and N s/m along both axes since the stage began, at the samples of the last period
    impulses: tuple[tuple[float, float, float], ...] = ()
    imbalance: float = 0.0  #: mean over that period
    way: float = 0.0  #: m, of the drives so far
    stability: float = math.nan  #: the last margin that was found
    weakening: float = 0.0  #: 1/m, how fast the margin fell on the way to it
    settled: float = 0.0  #: m, the way when the softest motion was settled last
    asked: float = 0.0  #: m, the way when it was asked for
    damaged: int = 0  #: contact points with damage at that time


class Loader:
    """Drives the stages of a run as their loadings ask for."""

    def __init__(self, state: State, stability: StableStep) -> None:
        self._state, self._stability = state, stability
        self._seen, self._new, self._wanted = _Seen(), _Seen(), 1.0
        #: N/m, of the specimen as it begins
        is_too_large = not len(state.bonds) or state.freedoms.arrays.mass.size > LARGEST
        self._sound = None if is_too_large else stability.sound()
        self._highest = stability.frequency  #: 1/s
        self._repeated = 0  #: times that the present sample was done again
        self._margin: Margin | None = None  #: made when it is first asked for in a stage

    def begin(self, stage: Stage) -> bool:
        """Begin a stage: where it has a loading, with the steady motion in place of that of the stage before.

        False where loads that should be static have no static solution, so that the specimen moves under them.
        """
        state, before = self._state, self._state.steady.velocity
        field, pace, self._margin = np.zeros_like(before), 1.0, None
        if stage.loading is not None:
            field = self._static(stage)
            pace = stage.loading.first(self._pace())
        self._new = self._seen if stage.loading is not None else _Seen()
        self._expect(stage)
        state.steady.start(field, pace, state.time, rises=stage.loading is not None and stage.loading.ramp > 0)
        self._change(stage, before)
        return not stage.static or bring_under_load(state, stage, self._stability)

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
        force, farthest = HEATED * along * span * bool(state.heat.sign), max(float(np.abs(field[:2]).max()), TINY)
        inner = math.sqrt(2 * along) / farthest if force else 0.0
        self._seen = _Seen(
            span=span, inertia=inertia, frequency=frequency, force=force, least=force / farthest, inner=inner,
            fastest=stage.interval / (stage.pieces * STEPS * state.time_step), supplied=math.nan,
            momentum=self._momentum(),
        )  # fmt: skip
        return field

    def integrator(self, stage: Stage) -> Integrator:
        """That of a stage that has begun. A heated specimen is kept from swaying: its ends may not hold it."""
        return stage.moved_by.holding_sway(self._seen.frequency) if stage.of(Heat) else stage.moved_by

    def steps(self, stage: Stage, pieces: int = 1) -> int:
        """Steps of the next sample, or of one of the ``pieces`` into which it is divided."""
        pace, heat = self._state.steady.pace, self._state.heat
        steps = max(1, round(stage.interval / pieces / pace / self._state.time_step))
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
        self._new = self._ask_margin(stage.loading, self._look(energies, self._state.time - began))
        try:
            answer = stage.loading.next(self._pace(self._new))
        except AccuracyError as error:
            raise StageError(f"stage '{stage.name}': {error}") from None
        self._wanted, again = self._checked(answer, stage)
        self._repeated = self._repeated + 1 if again else 0
        if self._repeated > REPEATS:
            raise StageError(
                f"stage '{stage.name}': {type(stage.loading).__name__}.next has asked for the sample again {REPEATS} "
                "times: what it does must come to an end"
            )
        return not again

    @staticmethod
    def _checked(answer: Any, stage: Stage) -> tuple[float, bool]:
        """A speed, and whether the sample is done again. Raises :class:`StageError` for anything else."""
        try:
            speed, again = answer
            fine = 0 < speed < math.inf
        except (TypeError, ValueError):
            fine = False
        if not fine:
            raise StageError(
                f"stage '{stage.name}': {type(stage.loading).__name__}.next gave {short(answer)}, it must be a finite "
                "speed above 0 and whether the sample is done again"
            )
        return float(speed), bool(again)

    def go_on(self, stage: Stage) -> None:
        """Take the speed that was asked for, after a sample that counts."""
        if stage.loading is not None:
            self._seen = self._new
            self.repeat(stage)

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
            changed = steady.follow(state.drives, state.imposed.speeds, state.time, period)
        if changed:
            self._damp(stage)

    def repeat(self, stage: Stage) -> None:
        """Take the speed that was asked for, at the beginning of the sample."""
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

    # --- how stable the specimen is ----------------------------------------------------------------------------------

    @property
    def columns(self) -> dict[str, float]:
        """What is recorded of it at a sample that counts."""
        return {STABILITY: self._new.stability, IMBALANCE: self._new.imbalance}

    def pieces(self, stage: Stage, is_damaged: bool) -> int:
        """Into how many a sample is divided: where contacts are damaged, and until a soft motion is settled."""
        way, soft = self._seen.way, self._seen.settled > 0 and not self._seen.fallen
        damaged = stage.pieces if is_damaged else 1
        if way > 0:
            damaged = min(damaged, math.ceil(stage.interval / (FINE * way)))
        return max(damaged, min(math.ceil(stage.interval / (SHORT * way)), MOST) if soft else 1)

    def _ask_margin(self, loading: Loading, seen: _Seen) -> _Seen:
        """Find the margin, if it may have changed since it was asked for."""
        state = self._state
        if self._sound is None or not self._margin_is_due(seen):
            return seen
        damaged = self._damaged
        if self._margin is None:
            self._margin = Margin(state, self._sound, self._highest, seen.frequency)
        guess = state.steady.books.softest
        found = self._margin.find(guess if len(guess) else self._margin.first_guess())
        if found is None:
            return attrs.evolve(seen, asked=seen.way, damaged=damaged)
        state.steady.soften(found.motion)
        settled, slow = seen.settled, found.frequency * math.sqrt(max(found.margin, 0.0)) < seen.frequency
        if loading.settles and slow and (found.margin < SOFT or settled):
            settled = seen.way if self._margin.settle(found, seen.way - settled) else settled
            seen = attrs.evolve(seen, momentum=self._momentum())
        before = 1.0 if math.isnan(seen.stability) else seen.stability
        weakening = max(before - found.margin, 0.0) / (seen.way - seen.asked)
        return attrs.evolve(
            seen, stability=found.margin, weakening=weakening, settled=settled, asked=seen.way, damaged=damaged
        )

    def _margin_is_due(self, seen: _Seen) -> bool:
        if seen.fallen:
            return False
        farther = seen.way - seen.asked
        if farther * seen.weakening > LOWER * max(seen.stability, LOWER):
            return True
        if seen.settled > 0:
            return True
        if farther < ASKED * seen.span:
            return False
        return farther >= FARTHER * seen.asked or math.isnan(seen.stability) or self._damaged > seen.damaged

    # --- what a loading sees ----------------------------------------------------------------------------------------

    @property
    def _damaged(self) -> int:
        """Contact points with damage and, under laws that count none, those that slide."""
        slides = np.abs(self._state.beyond_elastic[1]) > SLIDES * np.abs(self._state.slip)
        return int(np.count_nonzero(self._state.bonds.memory("damage", slides) > 0))

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
        gained = [after - before for after, before in zip(momentum, seen.momentum, strict=True)]
        stored = max(seen.stored, sum(energies[kind] for kind in STORED))
        fallen = now < FALLEN * load and load > seen.least
        carried = max(load, seen.least, seen.inner * math.sqrt(max(stored, 0.0)))
        imbalance = 0.0 if fallen or carried == 0 else max(map(abs, gained)) / time / carried
        impulses = self._impulses(seen, gained)
        mean = max(abs(impulses[-1][k] - impulses[0][k]) for k in (1, 2)) / (impulses[-1][0] - impulses[0][0])
        return attrs.evolve(
            seen, stored=stored, load=load, fallen=fallen, force=force, supplied=supplied, lost=lost,
            vibration=max(vibration - noise, 0.0), released=max(released, faded), momentum=momentum, impulses=impulses,
            imbalance=mean / carried if carried else 0.0, way=seen.way + travel,
            imbalances=(*seen.imbalances, imbalance)[-RECENT:],
        )  # fmt: skip

    def _impulses(self, seen: _Seen, gained: Sequence[float]) -> tuple[tuple[float, float, float], ...]:
        """Those of the last period of the steady motion, which means do not depend on where samples end in it."""
        now, start = self._state.time, (self._state.began, 0.0, 0.0)
        _, x, y = seen.impulses[-1] if seen.impulses else start
        found = [*(seen.impulses or (start,)), (now, x + gained[0], y + gained[1])]
        while len(found) > 2 and found[1][0] <= now - 2 * math.pi / seen.frequency:
            found.pop(0)
        return tuple(tuple(one) for one in found)  # type: ignore[misc]

    def _pace(self, seen: _Seen | None = None) -> Pace:
        seen = seen or self._seen
        last = seen.imbalances
        return Pace(
            speed=self._state.steady.pace, unit="m/s" if self._state.heat.target is None else "K/s",
            span=seen.span, inertia=seen.inertia, frequency=seen.frequency, fastest=seen.fastest,
            stored=seen.stored, vibration=seen.vibration, damaged=self._damaged > 0, soft=seen.settled > 0,
            released=seen.released, imbalance=last[-1] if last else 0.0,
            least_imbalance=min(last) if len(last) == RECENT else 0.0,
        )  # fmt: skip

    # --- checkpoints ------------------------------------------------------------------------------------------------

    def save(self) -> dict[str, object]:
        """Numbers of a checkpoint."""
        return attrs.asdict(self._seen, recurse=False)

    def restore(self, numbers: Mapping[str, object], stage: Stage) -> None:
        """Go on from what ``save`` returned."""
        self._seen = _Seen(**{name: _as_tuple(v) for name, v in numbers.items()})  # type: ignore[arg-type]
        self._expect(stage)


def _as_tuple(value: object) -> object:
    """A list, also of lists, as a file of numbers has it, in the form that it was saved in."""
    return tuple(map(_as_tuple, value)) if isinstance(value, list) else value
