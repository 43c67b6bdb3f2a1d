"""Subcritical growth of cracks in bonds under a load that is held, for any law."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.fields import ParameterError, parameter, part
from grainlaw.laws.modified import Modifier, innermost, refuse_what_does_not_scale

LEAST = 1e-3  #: share of the strength at which ageing ends: by then any bond that is loaded has failed


class Growth(metaclass=Checked):
    """How fast a bond loses strength; a part of :class:`StaticFatigue`."""

    takes_arrays = True  #: parameters may be arrays

    @abstractmethod
    def left(self, share: float, load: float, time: float) -> float:
        """The share of the strength after a time in which a load is held.

        ``load`` is that over the strength at first, ``time`` that in units in which a bond loses strength at a speed
        of 1 where it bears all of its first strength.
        """


@attrs.frozen(kw_only=True)
class CharlesGrowth(Growth):
    """A crack whose speed is a power of its stress intensity (Charles 1958, doi:10.1063/1.1722991).

    With K = Y sigma sqrt(a), strength S as a^(-1/2) and da/dt as K^n the share s of the strength falls by
    ds/dt = -rate x^n s^(3 - n) under the load x (Evans 1974, doi:10.1007/BF00156402; for the cohesion of rock bridges
    Kemeny 2003, doi:10.1007/s00603-003-0032-1). Exact over any time under a load that is held.
    """

    exponent: float = parameter("1", default=20.0, above=2)  #: n, the subcritical index

    def left(self, share: float, load: float, time: float) -> float:
        order = self.exponent - 2
        lost = order * time * share * share * (load / share) ** self.exponent
        return share * math.exp(math.log1p(-min(lost, 1 - 1e-12)) / order)


@attrs.frozen(kw_only=True)
class ExponentialGrowth(Growth):
    """A speed that is exponential in the stress: ds/dt = -rate exp(-activation (1 - x / s)).

    As Potyondy 2007 (doi:10.1016/j.ijrmms.2006.10.002) lets parallel bonds corrode, after Wiederhorn and Bolz 1970
    (doi:10.1111/j.1151-2916.1970.tb15962.x); ``activation`` is the stress coefficient times the strength over RT. The
    middle of the time is taken (second order).
    """

    activation: float = parameter("1", default=30.0)  #: stress coefficient times strength over RT

    def left(self, share: float, load: float, time: float) -> float:
        first = time * math.exp(-self.activation * (1 - min(load / share, 1.0)))
        middle = max(share - 0.5 * first, 0.5 * share)
        return share - time * math.exp(-self.activation * (1 - min(load / middle, 1.0)))


@attrs.frozen(kw_only=True)
class StaticFatigue(Modifier):
    """Any law whose bonds lose strength with time while they bear a load, by the growth of cracks in them.

    ``fatigue`` is the share of the strength that is gone. All strengths of the law, and the displacements at which it
    softens and breaks, are those of the law times 1 - fatigue; stiffness and friction stay. The load of a point is the
    larger of tension over tensile strength and of shear beyond friction over cohesion, where the law has these. It
    grows up to the break. A law without a ``cohesion`` ages by tension alone.

    In a run a step ages bonds by the time step, which is nothing. Ages pass in jumps from equilibrium to equilibrium
    (:class:`~grainlaw.Ageing`, as in the test ``Creep``).
    """

    rate: float = parameter("1/s")  #: share of the strength lost per second under a load as high as the strength
    growth: Growth = part(Growth, CharlesGrowth())  #: how the speed depends on the load
    threshold: float = parameter("1", default=0.0, at_least=0, below=1)  #: load over strength below which nothing grows

    def __attrs_post_init__(self) -> None:
        refuse_what_does_not_scale(self)
        if not np.all(getattr(innermost(self.law), "tensile_strength", 0.0)):
            name = type(innermost(self.law)).__name__
            raise ParameterError(f"StaticFatigue: law = {name} is not allowed, it must have a tensile_strength above 0")

    @property
    def over_tension(self) -> Any:
        """1 / tensile strength (1/Pa)."""
        return 1 / innermost(self.law).tensile_strength

    @property
    def over_cohesion(self) -> Any:
        """1 / cohesion (1/Pa); 0 where the law has none."""
        cohesion = getattr(innermost(self.law), "cohesion", 0.0)
        return 1 / cohesion if cohesion > 0 else 0.0

    @property
    def friction(self) -> Any:
        """tan(friction angle); 0 where the law has none."""
        return math.tan(math.radians(getattr(innermost(self.law), "friction_angle", 0.0)))

    def traction(self, opening, slip, time_step, fatigue, damage, *law):
        """``fatigue``: share of the strength that is gone; ``damage`` is that of the law."""
        share = 1 - fatigue
        answer = self.law.traction(opening / share, slip / share, *law)
        normal, shear = share * answer[0], share * answer[1]
        load = max(normal * self.over_tension, (abs(shear) + normal * self.friction) * self.over_cohesion)
        ages = time_step > 0 and damage < 1 and load > self.threshold * share
        left = self.growth.left(share, load, self.rate * time_step) if ages else share
        return (normal, shear, max(fatigue, 1 - max(left, LEAST)), *answer[2:])
