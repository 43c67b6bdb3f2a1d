"""How a contact resists closing."""

from __future__ import annotations

from abc import abstractmethod

import attrs

from grainlaw.arguments import Checked
from grainlaw.fields import parameter


class Closure(metaclass=Checked):
    """Pressure of a closed contact; a law's part."""

    takes_arrays = True  #: parameters may be arrays

    @abstractmethod
    def pressure(self, kn: float, closure: float) -> float:
        """Pressure (Pa) at a closure (m, 0 or more), with slope ``kn`` at the start, which never falls."""

    @abstractmethod
    def tangent(self, kn: float, closure: float) -> float:
        """Slope (Pa/m) of the pressure there."""


@attrs.frozen(kw_only=True)
class LinearClosure(Closure):
    """A constant normal stiffness."""

    def pressure(self, kn: float, closure: float) -> float:
        return kn * closure

    def tangent(self, kn: float, closure: float) -> float:
        return kn


@attrs.frozen(kw_only=True)
class BandisClosure(Closure):
    """Hyperbolic closure, Eq. (12) (Bandis, Lumsden and Barton 1983, doi:10.1016/0148-9062(83)90595-8).

    Beyond ``straight_from`` V_m the curve goes on along its tangent, so that pressure and stiffness stay finite.
    """

    maximum_closure: float = parameter("m", above=0, infinite=True)  #: V_m; infinite gives the straight line
    straight_from: float = parameter("1", default=0.99, above=0, below=1)  #: as a share of V_m

    @property
    def curved(self) -> float:
        """Closure (m) up to which the hyperbola holds."""
        return self.straight_from * self.maximum_closure

    def pressure(self, kn: float, closure: float) -> float:
        curved = min(closure, self.curved)
        room = 1 - curved / self.maximum_closure
        return kn * (curved / room + (closure - curved) / (room * room))

    def tangent(self, kn: float, closure: float) -> float:
        room = 1 - min(closure, self.curved) / self.maximum_closure
        return kn / (room * room)
