"""A dashpot beside a bond, for any law."""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.fields import parameter
from grainlaw.laws.modified import Modifier, refuse_without_damage


@attrs.frozen(kw_only=True)
class Viscous(Modifier):
    """Any law with a dashpot beside its springs, a Kelvin-Voigt body, while the point is not broken.

    The dashpots have the viscosities kn and ks times ``retardation``, the time in which a bond under a constant load
    comes within 1/e of its displacement (Jaeger, Cook and Zimmerman 2007, Fundamentals of Rock Mechanics). Damage
    weakens them as it does the bond. The stable step is shorter by sqrt(1 + b^2) - b with b half the retardation times
    the highest frequency: retardation much above the stable step makes a run slow.
    """

    retardation: float = parameter("s", at_least=0)  #: viscosity over stiffness

    def __attrs_post_init__(self) -> None:
        refuse_without_damage(self)

    @property
    def retardation_time(self) -> float:
        return float(np.max(self.retardation)) + self.law.retardation_time

    @property
    def normal_viscosity(self) -> float:
        """Pa s/m."""
        return self.law.stiffness[0] * self.retardation

    @property
    def shear_viscosity(self) -> float:
        """Pa s/m."""
        return self.law.stiffness[1] * self.retardation

    def traction(self, opening, slip, time_step, previous_opening, previous_slip, damage, *law):
        """``previous_opening``, ``previous_slip``: at the step before; ``damage`` is that of the law."""
        answer = self.law.traction(opening, slip, *law)
        share = (1 - damage) / time_step if time_step > 0 else 0.0
        normal = share * self.normal_viscosity * (opening - previous_opening)
        shear = share * self.shear_viscosity * (slip - previous_slip)
        return (answer[0] + normal, answer[1] + shear, opening, slip, *answer[2:])
