"""Loading: how fast the drives of a stage move, given as a speed or as the accuracy that the test must have."""

from __future__ import annotations

import math
from abc import abstractmethod

import attrs

from grainlaw.arguments import Checked
from grainlaw.fields import parameter

RECENT = 5  #: samples that a loading may look back on


@attrs.frozen(kw_only=True)
class Pace(metaclass=Checked):
    """What a loading sees of a stage after a sample. All of it follows from the motion, none from the computer's clock.

    The *steady motion* is the velocity field with which the specimen stays in equilibrium while its drives move; what
    moves beside it vibrates (docs/theory.md, Loading).
    """

    speed: float = 0.0  #: m/s, in this sample
    unit: str = "m/s"  #: of the speed; K/s where a stage heats or cools
    span: float  #: m, by which the drives move if the stage goes to its end
    inertia: float  #: kg/m, twice the kinetic energy of the steady motion at 1 m/s
    frequency: float  #: 1/s, of the steady motion when the stage began, by Rayleigh's quotient
    fastest: float = math.inf  #: m/s, at which a sample still has some steps
    stored: float = 0.0  #: J/m, energy in zones and contacts, the largest so far
    vibration: float = 0.0  #: J/m, kinetic energy of the motion beside the steady motion
    damaged: bool = False  #: whether any contact is damaged
    soft: bool = False  #: whether a motion that has become soft is brought to its place after every sample
    released: float = 0.0  #: energy that vibration and damping have taken, over the work at the largest load
    imbalance: float = 0.0  #: sum of the forces on the specimen in this sample, over the largest load; 0 after the peak
    least_imbalance: float = 0.0  #: the least of the last ``RECENT`` samples; 0 while there were fewer

    @property
    def quick(self) -> float:
        """m/s at which the kinetic energy of the steady motion is that stored."""
        return math.sqrt(2 * self.stored / self.inertia)


class AccuracyError(RuntimeError):
    """The accuracy that is asked for cannot be had; the message says what was found."""


class Loading(metaclass=Checked):
    """How fast the drives of a stage move: it multiplies their speeds, which are written for 1 m/s.

    A whole loading, which slows down as the load grows::

        @attrs.frozen(kw_only=True)
        class Slowing(Loading):
            speed: float = gl.parameter("m/s")

            def first(self, pace):
                return self.speed

            def next(self, pace):
                return self.speed / (1 + pace.stored), False

            def slower(self):
                return attrs.evolve(self, speed=self.speed / 2)
    """

    ramp: float = 0.0  #: s, in which the speed rises from zero; without it a stage begins with the steady motion
    settles: bool = False  #: whether a motion that is too soft to follow is brought to its place (docs/theory.md)

    @abstractmethod
    def first(self, pace: Pace) -> float:
        """Speed (m/s) at which a stage begins."""

    @abstractmethod
    def next(self, pace: Pace) -> tuple[float, bool]:
        """Speed (m/s) after a sample, and whether the sample is done again with it, from where it began.

        Raises :class:`AccuracyError`, which ends the run and keeps what it has recorded.
        """

    @abstractmethod
    def slower(self) -> Loading:
        """The same at half the speed, to see what the speed does."""

    def usual(self, span: float, frequency: float) -> float:
        """Time (s) that a stage usually takes, from what ``Pace`` calls so."""
        return span / self.first(Pace(span=span, inertia=1.0, frequency=frequency))

    def delay(self, interval: float) -> int:
        """Samples of ``interval`` (m) that are lost while the speed rises."""
        return 0


@attrs.frozen(kw_only=True)
class Constant(Loading):
    """One speed: for waves, and to compare with other programs."""

    speed: float = parameter("m/s")  #: of all drives together
    ramp: float = parameter("s", default=0.0, at_least=0)  #: in which the speed rises smoothly from zero

    def first(self, pace: Pace) -> float:
        return self.speed

    def next(self, pace: Pace) -> tuple[float, bool]:
        return self.speed, False

    def slower(self) -> Loading:
        return attrs.evolve(self, speed=self.speed / 2, ramp=self.ramp * 2)

    def delay(self, interval: float) -> int:
        return math.ceil(self.ramp * self.speed / interval / 2)


@attrs.frozen(kw_only=True)
class HeatingRate(Loading):
    """One rate of heating or cooling: the loading of a stage with a temperature, and of the test ``Heating``."""

    rate: float = parameter("K/s")  #: at which the temperature changes

    def first(self, pace: Pace) -> float:
        return self.rate

    def next(self, pace: Pace) -> tuple[float, bool]:
        return self.rate, False

    def slower(self) -> Loading:
        return attrs.evolve(self, rate=self.rate / 2)


WHOLE = 20  #: times ``rate``: of the span of the stage, while no contact is damaged
QUIET = 4  #: times ``rate``: of the load, while contacts are damaged but little energy is released
RELEASED = 0.02  #: of the work: from here on the speed is the lowest
SLOWER = 0.7  #: times the speed, after a sample that was not in balance
GROWTH = 0.25  #: of the load, over which contacts usually break in a test
FASTER = 1.1  #: times the speed, at most, after one that was
LOWEST = 1 / 8  #: of the speed that ``rate`` gives, and
LEAST = 1 / 500  #: of that of an intact specimen: a test that is not in balance then will not be


@attrs.frozen(kw_only=True)
class Adaptive(Loading):
    """As fast as the accuracy of the test allows.

    Quick while no contact is damaged, as the specimen follows the static solution at any speed. Then the kinetic energy
    of the loading is at most ``rate`` squared of the energy stored wherever contacts that break release energy, and 16
    times that elsewhere. Where the release begins, and where a sample was not in balance, it is done again more slowly.
    """

    settles = True
    imbalance: float = parameter("1", default=0.01, above=0, below=1)  #: of the forces on the ends, over the load
    rate: float = parameter("1", default=0.0015, above=0, below=0.05)  #: growth of the load in 1/frequency, at failure

    def first(self, pace: Pace) -> float:
        return min(WHOLE * self.rate * pace.frequency * pace.span, pace.fastest)

    def next(self, pace: Pace) -> tuple[float, bool]:
        fast = self.first(pace)
        slow = max(self.rate * pace.quick, LEAST * fast)
        fast = min(fast, QUIET * slow) if pace.soft else fast
        limit = min(fast, slow * self._calm(pace), max(slow, self._still(pace)))
        if pace.speed > 2.0 * limit:
            return limit, True
        if pace.imbalance <= self.imbalance:
            return min(FASTER * pace.speed, limit), False
        lowest = LOWEST * min(limit, slow)
        if pace.speed > lowest:
            again = pace.released < RELEASED
            return max(lowest, pace.speed * (0.5 if again else SLOWER)), again
        if pace.least_imbalance > self.imbalance:
            raise AccuracyError(
                f"Adaptive: imbalance = {self.imbalance:g} cannot be had, it was at least "
                f"{pace.least_imbalance:.2g} in the last {RECENT} samples, at {pace.speed:.2g} {pace.unit}"
            )
        return pace.speed, False

    def slower(self) -> Loading:
        return attrs.evolve(self, rate=self.rate / 2)

    @staticmethod
    def _calm(pace: Pace) -> float:
        """How many times the lowest speed is allowed, by the energy that is released."""
        by_energy = max(1.0, RELEASED / max(pace.released, 1e-300))
        return min(QUIET, by_energy) if pace.damaged else by_energy

    def _still(self, pace: Pace) -> float:
        """Speed (m/s) at which vibration would have as little energy as the loading may have, if it comes from it."""
        allowed = (QUIET * self.rate) ** 2 * pace.stored
        return math.inf if pace.vibration <= allowed else pace.speed * math.sqrt(allowed / pace.vibration)

    def usual(self, span: float, frequency: float) -> float:
        return (1 / WHOLE + GROWTH) / (self.rate * frequency)
