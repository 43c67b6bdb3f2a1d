"""Softening curves: the strength that remains at a damage."""

from __future__ import annotations

import functools
import itertools
from abc import abstractmethod

import attrs
import scipy

from grainlaw.arguments import Checked
from grainlaw.fields import ParameterError, parameter, whole_number
from grainlaw.messages import refusal
from grainlaw.vector_math import exp_bounded


class Softening(metaclass=Checked):
    """Share of the strength that remains at a damage, falling from 1 to 0 as the damage grows from 0 to 1.

    A law's part; linear softening is ``def remaining(self, damage): return 1 - damage``.
    """

    takes_arrays = True  #: parameters may be arrays

    @abstractmethod
    def remaining(self, damage: float) -> float:
        """The share chi(D), exactly 0 at D = 1."""

    @functools.cached_property
    def length(self) -> float:
        """L for which a branch as long as L G/f dissipates G: 1 over the integral of ``remaining``."""
        return 1 / scipy.integrate.quad(self.remaining, 0, 1, epsabs=1e-14, epsrel=1e-14)[0]


def _single(component: Softening, *names: str) -> None:
    """Refuse arrays: the shape of these curves is checked for one number each."""
    for name in names:
        value = getattr(component, name)
        if not isinstance(value, float):
            raise refusal(f"{type(component).__name__}: {name}", value, "one number for all contacts")


@attrs.frozen(kw_only=True)
class LinearSoftening(Softening):
    """A straight line (Hillerborg, Modeer and Petersson 1976, doi:10.1016/0008-8846(76)90007-7)."""

    def remaining(self, damage: float) -> float:
        return 1 - damage


@attrs.frozen(kw_only=True)
class ExponentialSoftening(Softening):
    """A decay exp(-rate D), shifted and scaled to reach 0 at D = 1: (e^(-rate D) - e^-rate) / (1 - e^-rate).

    An exponential never ends (Gopalaratnam and Shah 1985, ACI Journal 82(3), 310-323, with an exponent near 1); this
    one does. Under one fracture energy a higher rate is a steeper start and a longer tail; towards 0 it is a straight
    line.
    """

    rate: float = parameter("1", default=5.0, above=0, at_most=8)  #: the larger, the faster the first fall

    @property
    def end(self) -> float:
        """What the decay leaves at D = 1, by the same arithmetic, so that the curve ends at nothing exactly."""
        return exp_bounded(-self.rate)

    @property
    def scale(self) -> float:
        return 1 / (1 - self.end)

    def remaining(self, damage: float) -> float:
        return (exp_bounded(-self.rate * damage) - self.end) * self.scale


@attrs.frozen(kw_only=True)
class HordijkSoftening(Softening):
    """(1 + (c1 D)^3) exp(-c2 D) - D (1 + c1^3) exp(-c2), fitted to tension tests of concrete.

    Cornelissen, Hordijk and Reinhardt 1986, Heron 31(2), 45-56; Hordijk 1991, doctoral thesis, Delft.
    """

    c1: float = parameter("1", default=3.0, at_least=0)  #: c1 of the formula
    c2: float = parameter("1", default=6.93, above=0, at_most=8)  #: c2 of the formula

    @property
    def cubic(self) -> float:
        """c1^3."""
        return self.c1 * self.c1 * self.c1

    @property
    def end(self) -> float:
        """What the first term leaves at D = 1, by the same arithmetic."""
        return (1 + self.cubic) * exp_bounded(-self.c2)

    def remaining(self, damage: float) -> float:
        power = self.cubic * (damage * damage * damage)
        return (1 + power) * exp_bounded(-self.c2 * damage) - damage * self.end

    def __attrs_post_init__(self) -> None:
        _single(self, "c1", "c2")
        curve = [self.remaining(i / 64) for i in range(65)]
        if any(after >= before for before, after in itertools.pairwise(curve)):
            raise ParameterError(
                f"HordijkSoftening: c1 = {self.c1:g}, c2 = {self.c2:g} is not allowed: the curve rises, it must fall "
                "from 1 to 0"
            )


@attrs.frozen(kw_only=True)
class PeterssonSoftening(Softening):
    """Two straight lines: by default to a third of the strength at 0.8 G/f, then to nothing at 3.6 G/f.

    Petersson 1981, report TVBM-1006, Lund Institute of Technology.
    """

    kink_share: float = parameter("1", default=1 / 3, above=0, below=1)  #: of the strength
    kink_damage: float = parameter("1", default=2 / 9, above=0, below=1)  #: damage D at which the two lines meet

    @property
    def first_slope(self) -> float:
        return (1 - self.kink_share) / self.kink_damage

    @property
    def second_slope(self) -> float:
        return self.kink_share / (1 - self.kink_damage)

    def remaining(self, damage: float) -> float:
        kink = self.kink_damage
        return self.second_slope * (1 - max(damage, kink)) + self.first_slope * (kink - min(damage, kink))


@attrs.frozen(kw_only=True)
class EvansMarathe(Softening):
    """Eq. (2), fitted to direct tension tests of concrete.

    Evans and Marathe 1968, Materials and Structures 1(1), 61-64; a, b, c as in the paper that prints Eq. (2).
    """

    a: float = parameter("1", default=0.63)  #: a of Eq. (2)
    b: float = parameter("1", default=1.8)  #: b of Eq. (2)
    c: int = whole_number(default=6, at_least=1, at_most=31)  #: c of Eq. (2), a power that is taken by multiplication

    @property
    def share(self) -> float:
        """(a+b-1)/(a+b) in Eq. (2)."""
        return (self.a + self.b - 1) / (self.a + self.b)

    @property
    def rate(self) -> float:
        """Minus the factor of D in the exponent of Eq. (2)."""
        return (self.a + self.c * self.b) / ((self.a + self.b) * (self.a + self.b - 1))

    def remaining(self, damage: float) -> float:
        left = 1 - damage
        return (1 - self.share * exp_bounded(-self.rate * damage)) * (self.a * left + self.b * self.power(left))

    def power(self, x: float) -> float:
        """x^c from the binary digits of c, a constant of the compiled code: x^6 = x^2 x^4."""
        x2 = x * x
        x4 = x2 * x2
        x8 = x4 * x4
        low = (x if self.c & 1 else 1.0) * (x2 if self.c & 2 else 1.0) * (x4 if self.c & 4 else 1.0)
        return low * (x8 if self.c & 8 else 1.0) * (x8 * x8 if self.c & 16 else 1.0)

    def __attrs_post_init__(self) -> None:
        _single(self, "a", "b")
        if not self.a + self.b > 1:
            raise self._refusal("a + b must be above 1, or the curve does not start level")
        if not self.rate <= 8:
            raise self._refusal(f"the exponent of Eq. (2) reaches {-self.rate:g}, it must not be below -8")
        curve = [self.remaining(i / 64) for i in range(65)]
        if any(after >= before for before, after in itertools.pairwise(curve)):
            raise self._refusal("the curve rises, it must fall from 1 to 0")

    def _refusal(self, reason: str) -> ParameterError:
        return ParameterError(f"EvansMarathe: a = {self.a:g}, b = {self.b:g}, c = {self.c} is not allowed: {reason}")
