"""Strength that follows the rate of opening and slip, for any law."""

from __future__ import annotations

import math
from abc import abstractmethod

import attrs

from grainlaw.arguments import Checked
from grainlaw.fields import parameter, part
from grainlaw.laws.modified import Modifier, refuse_what_does_not_scale


class RateEffect(metaclass=Checked):
    """How much stronger a bond is at a rate; a part of :class:`RateDependent`."""

    takes_arrays = True  #: parameters may be arrays

    @abstractmethod
    def gain(self, rate: float) -> float:
        """Strength at a rate (m/s) over that at none, less 1: 0 at a rate of 0, and never falling."""


@attrs.frozen(kw_only=True)
class CowperSymonds(RateEffect):
    """(rate / reference_rate)^(1 / exponent) (Cowper and Symonds 1957, technical report 28, Brown University)."""

    reference_rate: float = parameter("m/s", default=1.0)  #: at which the strength is twice that at rest
    exponent: float = parameter("1", default=4.0, at_least=1)  #: the larger, the weaker the effect of the rate

    @property
    def inverse_exponent(self) -> float:
        return 1 / self.exponent

    def gain(self, rate: float) -> float:
        return (rate / self.reference_rate) ** self.inverse_exponent


@attrs.frozen(kw_only=True)
class JohnsonCook(RateEffect):
    """coefficient times ln(1 + rate / reference_rate).

    Johnson and Cook 1983, 7th International Symposium on Ballistics, 541-547, without their lower end: they have the
    logarithm of the rate alone, which falls below 0 under the reference rate.
    """

    reference_rate: float = parameter("m/s", default=1e-3)  #: from which on the strength grows clearly
    coefficient: float = parameter("1", default=0.1, at_least=0)  #: gain for each factor e of the rate

    def gain(self, rate: float) -> float:
        return self.coefficient * math.log1p(rate / self.reference_rate)


@attrs.frozen(kw_only=True)
class RateDependent(Modifier):
    """Any law with strengths that grow with the rate of opening and slip, up to where damage begins.

    Strengths, and the displacements at which the bond softens and breaks, are those of the law times 1 + gain; its
    stiffness and friction stay. From the beginning of damage on the gain is kept: a rate that jumps when a bond fails
    would give strength back to it (as in Malvar and others 1997, doi:10.1016/S0734-743X(97)00023-7). The rate is
    sqrt(max(d opening, 0)^2 + d slip^2) over the time step. No time passes, no gain: the slow limit is the law.
    Fracture energies are those of the law at rest; at a rate they are those times (1 + gain)^2.
    """

    effect: RateEffect = part(RateEffect, CowperSymonds())  #: gain of strength over rate

    def __attrs_post_init__(self) -> None:
        refuse_what_does_not_scale(self)

    def traction(self, opening, slip, time_step, gain, last_opening, last_slip, damage, *law):
        """``gain``: of strength; ``last_opening``, ``last_slip``: at the step before; ``damage`` is that of the law."""
        opened, slid = max(opening - last_opening, 0.0), slip - last_slip
        moved = math.sqrt(opened * opened + slid * slid)
        now = self.effect.gain(moved / time_step) if time_step > 0 else 0.0
        gain = now if damage == 0 else gain
        factor = 1 + gain
        answer = self.law.traction(opening / factor, slip / factor, *law)
        return (factor * answer[0], factor * answer[1], gain, opening, slip, *answer[2:])
