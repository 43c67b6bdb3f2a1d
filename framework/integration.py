"""Integrators: how a node moves under its force, and how motion is damped."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.fields import parameter, part, whole_number

__all__ = [
    "AdaptiveRelaxation",
    "CentralDifference",
    "Damping",
    "DynamicRelaxation",
    "Integrator",
    "KineticRelaxation",
    "LocalDamping",
    "MassDamping",
    "Motion",
    "Relaxation",
    "SwayDamping",
    "Undamped",
    "VibrationDamping",
]

SWAY = 0.1  #: damping over mass and frequency of the steady motion: 5 % of the critical damping of that frequency


class Damping(metaclass=Checked):
    """A force that takes energy from the motion of one freedom."""

    @abstractmethod
    def force(self, force: Any, change: Any, velocity: Any, mass: Any, time_step: Any) -> Any:
        """Damping force (N) from scalars.

        They are the unbalanced force (N) and its change since the step before (N), the velocity (m/s), the mass (kg)
        and the time step (s).
        """

    def seeking_rest(self) -> Damping:
        """What damps instead in a stage that waits for rest, where only its end counts."""
        return self

    def holding_sway(self, frequency: float) -> Damping:
        """What damps instead beside a steady motion of a ``frequency`` (1/s) where ends may be free."""
        return self

    @property
    def step_factor(self) -> float:
        """Stable step with this damping over that without."""
        return 1.0


@attrs.frozen
class Undamped(Damping):
    """No damping: for waves."""

    def force(self, force: Any, change: Any, velocity: Any, mass: Any, time_step: Any) -> Any:
        return 0.0


@attrs.frozen(kw_only=True)
class _ShareOfForce(Damping):
    """A damping force that is a fraction of the unbalanced force."""

    fraction: float = parameter("1", default=0.8, at_least=0, below=1)  #: of the unbalanced force

    @property
    def step_factor(self) -> float:
        # The fastest mode reverses at every step, its velocity always against its force, and the force with it. The
        # damping force then adds to that force: the mode has 1 + fraction times its stiffness.
        return 1 / math.sqrt(1 + self.fraction)


@attrs.frozen(kw_only=True)
class LocalDamping(_ShareOfForce):
    """A fraction of the unbalanced force, against the velocity (Cundall 1987); UDEC's local damping."""

    def force(self, force: Any, change: Any, velocity: Any, mass: Any, time_step: Any) -> Any:
        resistance = self.fraction * abs(force)
        return -resistance if velocity > 0 else (resistance if velocity < 0 else 0.0)


@attrs.frozen(kw_only=True)
class VibrationDamping(_ShareOfForce):
    """A fraction of the unbalanced force, with its change: damps what vibrates, and not what drifts.

    In a vibration the force changes against the velocity, so that this is local damping of it. A motion that goes on
    under a small force - creep, a load that moves - feels nothing. It is the part of the combined damping of Cundall
    (1987) that does not see the velocity. A stage that waits for rest takes local damping, which stops what drifts,
    too. What falls freely needs none: the weight of each node is large there beside what vibrates, were it rounding,
    whose sign decides, and a body of many grains falls by 14 to 28 % too fast.
    """

    def force(self, force: Any, change: Any, velocity: Any, mass: Any, time_step: Any) -> Any:
        resistance = self.fraction * abs(force)
        return resistance if change > 0 else (-resistance if change < 0 else 0.0)

    def seeking_rest(self) -> Damping:
        return LocalDamping(fraction=self.fraction)

    def holding_sway(self, frequency: float) -> Damping:
        return SwayDamping(fraction=self.fraction, coefficient=SWAY * frequency)


@attrs.frozen(kw_only=True)
class SwayDamping(_ShareOfForce):
    """:class:`VibrationDamping`, and a force in proportion to mass and velocity, for what sways slowly.

    The unbalanced force of a slow mode changes little in a step, and a faster vibration decides the sign: of a body
    that bends to and fro as a whole, vibration damping takes next to nothing. The drag is that of the velocity half a
    step before, so that a coefficient is to be small beside one over the time step.
    """

    coefficient: float = parameter("1/s", at_least=0)  #: force over mass and velocity

    def force(self, force: Any, change: Any, velocity: Any, mass: Any, time_step: Any) -> Any:
        resistance = self.fraction * abs(force)
        drag = self.coefficient * mass * velocity
        return (resistance if change > 0 else (-resistance if change < 0 else 0.0)) - drag


@attrs.frozen(kw_only=True)
class MassDamping(Damping):
    """Proportional to mass and to the mean velocity of the step: stable for any coefficient."""

    coefficient: float = parameter("1/s", at_least=0)  #: force over mass and velocity

    def force(self, force: Any, change: Any, velocity: Any, mass: Any, time_step: Any) -> Any:
        middle = (velocity + 0.5 * time_step * force / mass) / (1 + 0.5 * time_step * self.coefficient)
        return -self.coefficient * mass * middle


@attrs.frozen(eq=False)
class Motion(metaclass=Checked):
    """What an integrator sees between bursts of steps: arrays (r, n) over all freedoms, forces zero where driven."""

    velocity: np.ndarray  #: m/s
    displacement: np.ndarray  #: m
    force: np.ndarray  #: N, unbalanced
    mass: np.ndarray  #: kg

    @property
    def kinetic_energy(self) -> float:
        """J per metre of thickness."""
        return float(0.5 * np.sum(self.mass * self.velocity**2))


class Integrator(metaclass=Checked):
    """Moves one freedom (a node's component, a rigid grain's translation or rotation) by one explicit step.

    A whole integrator, forward motion without damping::

        @attrs.frozen(kw_only=True)
        class Free(gl.integration.Integrator):
            def step(self, force, change, velocity, mass, time_step):
                return velocity + force / mass * time_step, 0.0

            def stable_step(self, highest_frequency):
                return 0.9 * 2 / highest_frequency

    The framework calls ``step``, imposes the velocity of driven freedoms, calls ``move``, and records the work of the
    damping force.
    """

    @abstractmethod
    def step(self, force: Any, change: Any, velocity: Any, mass: Any, time_step: Any) -> tuple[Any, Any]:
        """New velocity (m/s) and damping force (N), from scalars; compiled, like a contact law.

        ``change`` (N) is that of the unbalanced force since the step before.
        """

    def move(self, displacement: Any, velocity: Any, time_step: Any) -> Any:
        """New displacement (m), from scalars, at the new or imposed velocity (m/s); compiled with ``step``.

        By default it grows by the velocity times the step. This is of second order, as the velocity is that in the
        middle of the step.
        """
        return displacement + velocity * time_step

    @abstractmethod
    def stable_step(self, highest_frequency: float) -> float:
        """Time step (s) for the highest angular frequency (1/s) of the specimen."""

    def adapt(self, motion: Motion, before: Motion | None) -> tuple[Integrator, bool]:
        """The integrator for the next burst of steps, and whether to halt all motion before it.

        ``motion`` is that now, ``before`` that one burst earlier (None at first).
        """
        return self, False

    def seeking_rest(self) -> Integrator:
        """The integrator of a stage that waits for rest."""
        return self

    def holding_sway(self, frequency: float) -> Integrator:
        """The integrator beside a steady motion of a ``frequency`` (1/s), where no end of the specimen may be held."""
        return self

    beside_loading: bool = False  #: whether ``step`` sees the velocity beside the steady motion of a stage's loading
    burst: int = 0  #: steps between calls of ``adapt``; 0 never calls it


def _usual_safety(integrator: CentralDifference) -> float:
    return 0.3 if isinstance(integrator.damping, Undamped) else 0.9


@attrs.frozen(kw_only=True)
class CentralDifference(Integrator):
    """Explicit central differences, Eq. (9); with the fraction ``safety`` of the stable step, Eq. (10).

    It is 0.9, and 0.3 without damping, for contacts that open and close within a longer step make energy that nothing
    takes out. Where no bond can break, 0.9 is as good.

    Where a stage has a loading, a damping that sees the velocity sees that ``beside_loading``, or, if that is False,
    all of it.
    """

    damping: Damping = part(Damping, VibrationDamping())  #: what takes energy out
    #: share of the stable time step that is used
    safety: float = parameter("1", default=attrs.Factory(_usual_safety, takes_self=True), above=0, at_most=1)
    beside_loading: bool = part(bool, True)  #: whether damping leaves the steady motion of a loading alone

    def step(self, force: Any, change: Any, velocity: Any, mass: Any, time_step: Any) -> tuple[Any, Any]:
        resistance = self.damping.force(force, change, velocity, mass, time_step)
        return velocity + (force + resistance) * (time_step / mass), resistance

    def stable_step(self, highest_frequency: float) -> float:
        return self.safety * self.damping.step_factor * 2 / highest_frequency

    def seeking_rest(self) -> Integrator:
        return attrs.evolve(self, damping=self.damping.seeking_rest())

    def holding_sway(self, frequency: float) -> Integrator:
        return attrs.evolve(self, damping=self.damping.holding_sway(frequency))


class Relaxation(metaclass=Checked):
    """How dynamic relaxation brings a specimen to rest: part of :class:`DynamicRelaxation`."""

    @abstractmethod
    def choose(self, motion: Motion, before: Motion | None) -> tuple[float, bool]:
        """Mass-proportional damping (1/s) for the next burst, and whether to halt all motion before it."""


@attrs.frozen
class AdaptiveRelaxation(Relaxation):
    """Critical damping of the mode that moves most, from Rayleigh's quotient over the last burst (Underwood 1983)."""

    def choose(self, motion: Motion, before: Motion | None) -> tuple[float, bool]:
        if before is None:
            return 0.0, False
        moved = motion.displacement - before.displacement
        inertia = float(np.sum(moved * motion.mass * moved))
        stiffness = float(np.sum(moved * (before.force - motion.force)))
        return 2 * float(np.sqrt(max(stiffness, 0.0) / inertia)) if inertia > 0 else 0.0, False


@attrs.frozen
class KineticRelaxation(Relaxation):
    """No damping, but a halt whenever the kinetic energy has passed a maximum, in short bursts (Cundall 1976)."""

    def choose(self, motion: Motion, before: Motion | None) -> tuple[float, bool]:
        return 0.0, before is not None and motion.kinetic_energy < before.kinetic_energy


@attrs.frozen(kw_only=True)
class DynamicRelaxation(Integrator):
    """Central differences that bring a specimen to rest; the damping is chosen again every ``burst`` steps."""

    relaxation: Relaxation = part(Relaxation, AdaptiveRelaxation())  #: how the damping is chosen
    safety: float = parameter("1", default=0.9, above=0, at_most=1)  #: share of the stable time step that is used
    burst: int = whole_number(default=10, at_least=1)  #: steps between two choices of the damping
    damping: MassDamping = part(MassDamping, MassDamping(coefficient=0.0))  #: of the present burst

    def step(self, force: Any, change: Any, velocity: Any, mass: Any, time_step: Any) -> tuple[Any, Any]:
        resistance = self.damping.force(force, change, velocity, mass, time_step)
        return velocity + (force + resistance) * (time_step / mass), resistance

    def stable_step(self, highest_frequency: float) -> float:
        return self.safety * 2 / highest_frequency

    def adapt(self, motion: Motion, before: Motion | None) -> tuple[Integrator, bool]:
        coefficient, halt = self.relaxation.choose(motion, before)
        return attrs.evolve(self, damping=MassDamping(coefficient=coefficient)), halt


def __dir__() -> list[str]:  # a notebook offers what is public
    return [*__all__]
