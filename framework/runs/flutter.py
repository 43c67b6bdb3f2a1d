"""Flutter: whether, and how fast, the kinetic energy of a specimen grows that is held loaded without damping."""

from __future__ import annotations

import math
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked
from grainlaw.columns import DAMAGED, KINETIC, STAGE, STRESS, TIME, energy
from grainlaw.conditions import Condition, Curves, FailsTo, Reaches, StageError
from grainlaw.contact import Laws
from grainlaw.detection import EVERYWHERE, Detection
from grainlaw.engine.model import Model
from grainlaw.engine.state import State
from grainlaw.fields import checked_number, parameter, part
from grainlaw.integration import CentralDifference, DynamicRelaxation, MassDamping, Undamped
from grainlaw.loads import Drive, InitialVelocity
from grainlaw.protocol import LoadingProtocol
from grainlaw.runs.plausibility import scales
from grainlaw.runs.simulation import simulate
from grainlaw.specimen import Specimen
from grainlaw.stage import Stage

PRESS, REST, CALM = 8, 15, 5  #: duration of these stages, over the time in which a wave passes the specimen
HOLD = 1300  #: duration of holding, over the time in which a wave passes a grain
SAMPLES = 200  #: of the kinetic energy while the specimen is held
HELD = 0.9  #: share of the stress that must be left when the specimen is at rest
GROWTH = 10  #: of the kinetic energy, from which it is flutter; if energy is conserved it varies by a factor of 4
QUIET = 0.3  #: mass damping (1/s) before holding, over the frequency of waves in a grain: stops any flutter
PUSH = 2e-10  #: random velocity at the start of holding, over the wave speed, from which flutter grows


@attrs.frozen
class _Samples(Condition):
    """A number of samples has been taken."""

    count: int

    def progress(self, curves: Curves) -> float:
        return len(curves[TIME]) / self.count


@attrs.frozen(eq=False)
class Flutter(metaclass=Checked):
    """The kinetic energy of a specimen that was held without damping; prints as one line."""

    stress: float  #: Pa, under which it was held, compression positive
    time: np.ndarray  #: (k,) s since the damping was removed
    kinetic: np.ndarray  #: (k,) J
    damaged: np.ndarray  #: (k,) contact points with damage
    step: float  #: s

    @property
    def _last(self) -> int:
        """Number of the last record before a contact was damaged: a break moves its neighbours under any law."""
        worse = np.flatnonzero(self.damaged > self.damaged[0])
        return max(int(worse[0]) - 1, 1) if len(worse) else len(self.time) - 1

    @property
    def rate(self) -> float:
        """1/s, of the growth of the kinetic energy, exp(rate t), before any damage; 0 where it does not grow."""
        end = self._last
        base = float(np.median(self.kinetic[: max(end // 10, 1)]))
        if not self.kinetic[end] > GROWTH * base:
            return 0.0
        start = int(np.flatnonzero(self.kinetic[:end] <= math.sqrt(GROWTH) * base)[-1])
        growing = slice(start, end + 1)
        return float(np.polyfit(self.time[growing], np.log(np.maximum(self.kinetic[growing], 1e-300)), 1)[0])

    @property
    def flutters(self) -> bool:
        """Whether the kinetic energy grows."""
        return self.rate > 0

    def __str__(self) -> str:
        held = f"held at {self.stress * 1e-6:.3g} MPa without damping"
        if not self.flutters:
            return f"does not flutter: {held} for {self.time[-1] * 1e6:.3g} us, its kinetic energy does not grow"
        tenfold = math.log(10) / self.rate
        return (
            f"flutters: {held}, its kinetic energy grows tenfold in {tenfold * 1e6:.3g} us ({tenfold / self.step:.0f} "
            "steps); the strength of such specimens depends on the damping"
        )


@attrs.frozen(kw_only=True)
class _HeldStill(LoadingProtocol):
    """Press, bring to rest, hold without damping."""

    stress: float = parameter("Pa")
    modulus: float = parameter("Pa")  #: of grains and contacts in series, about that of the specimen
    wave_speed: float = parameter("m/s")
    duration: float = parameter("s")  #: without damping
    confined: bool = part(bool, False)

    def stages(self, specimen: Specimen) -> list[Stage]:
        low, high = specimen.grains.region.bounds
        height = float((high - low)[1])
        transit = height / self.wave_speed
        size = specimen.grains.grain_size
        speed = self.stress / self.modulus * height / (PRESS * transit)
        push = np.random.default_rng(0).normal(size=specimen.mesh.nodes.shape) * PUSH * self.wave_speed
        return [
            Stage(
                name="press", loads=self._drives(speed, transit), interval=transit / 25, sample_limit=25 * 10 * PRESS,
                until=[Reaches(STRESS, self.stress), FailsTo(STRESS, 0.5)],
            ),
            Stage(
                name="rest", loads=self._drives(), until=[_Samples(10)], interval=REST * transit / 10,
                integrator=DynamicRelaxation(),  # damps the slow modes
            ),
            Stage(
                name="calm", loads=self._drives(), until=[_Samples(10)], interval=CALM * transit / 10,
                integrator=CentralDifference(damping=MassDamping(coefficient=QUIET * self.wave_speed / size)),
            ),
            Stage(
                name="hold", loads=[*self._drives(), InitialVelocity(velocity=push)],
                until=[_Samples(SAMPLES)], interval=self.duration / SAMPLES,
                integrator=CentralDifference(damping=Undamped(), safety=0.6),
            ),
        ]  # fmt: skip

    def _drives(self, speed: float = 0.0, ramp: float = 0.0) -> list[Drive]:
        sides = [Drive(boundary=side, axis=0, speed=0.0) for side in ("left", "right")] if self.confined else []
        top = Drive(boundary="top", axis=1, speed=-speed, ramp=ramp)
        return [top, Drive(boundary="bottom", axis=1, speed=0.0), *sides]

    def measure(self, state: State) -> dict[str, float]:
        width = float(np.ptp(state.mesh.nodes[:, 0]))
        return {STRESS: (state.reaction("bottom")[1] - state.reaction("top")[1]) / (2 * width)}

    def summary(self, curves: Curves, specimen: Specimen) -> dict[str, Any]:
        return {}


@checked
def hold(
    specimen: Specimen, law: Laws, stress: float, *, confined: bool = False, duration: float | None = None,
    detection: Detection | None = EVERYWHERE, time_step_factor: float = 1.0, threads: int = 1,
) -> Flutter:  # fmt: skip
    """Press a specimen to a ``stress`` (Pa), bring it to rest, remove all damping, and record its kinetic energy.

    The specimen is held by its smooth platens and starts with a very small random velocity. If its contacts conserve
    energy, it vibrates with the same energy. If contacts make energy it flutters: the kinetic energy grows
    exponentially, and the results of a run with damping depend on the damping (docs/flutter.md). ``confined`` holds the
    sides too, for grains without bonds; ``duration`` (s) is that of holding, some 12,000 steps by default. Raises as
    :func:`simulate`, and :class:`StageError` for a specimen that fails before the stress is reached.
    """
    stress = checked_number("hold: stress", stress, "Pa", above=0)
    modulus, wave_speed, size = scales(Model(specimen, law))
    test = _HeldStill(
        stress=stress, modulus=modulus, wave_speed=wave_speed, confined=confined,
        duration=HOLD * size / wave_speed if duration is None else duration,
    )  # fmt: skip
    result = simulate(
        specimen, law, test, detection=detection, time_step_factor=time_step_factor, threads=threads, frames=1
    )
    held = result.curves[STAGE] == 3
    pressed, damaged = result.curves[STRESS], result.curves[DAMAGED][held]
    if pressed.max() < stress or pressed[held][0] < HELD * stress:
        error = StageError(
            f"hold: the specimen failed: it reached {pressed.max() * 1e-6:.4g} MPa and holds "
            f"{pressed[held][0] * 1e-6:.4g} MPa; stress = {stress * 1e-6:g} MPa must be lower"
        )
        error.result = result
        raise error
    time, kinetic = result.curves[TIME][held], energy(result.curves, KINETIC)[held]
    return Flutter(float(pressed[held][0]), time - time[0], kinetic, damaged, result.summary["time_step"])
