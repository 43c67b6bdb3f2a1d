"""The contact of two faces that nothing bonds: closure under pressure and Coulomb friction, shared by all laws."""

from __future__ import annotations

import math

import attrs

from grainlaw.contact import ContactLaw
from grainlaw.fields import angle_of_friction, parameter, part
from grainlaw.laws.closure import Closure, LinearClosure


def slid(stiffness: float, slip: float, anchor: float, strength: float, hardening: float = 0.0) -> float:
    """The anchor (m) of a spring (Pa/m) in series with a slider that holds ``strength`` (Pa), after a slip (m).

    The shear traction is ``stiffness * (slip - anchor)``. ``hardening`` (Pa/m) is the rise of the strength per length
    of sliding, as by dilation under confinement.
    """
    trial = stiffness * (slip - anchor)
    sliding = max(abs(trial) - strength, 0.0) / (stiffness + hardening)
    return anchor + (sliding if trial > 0 else -sliding)


@attrs.frozen(kw_only=True)
class Friction(ContactLaw):
    """Faces that were never bonded, or have nothing left of their bond: no tension, closure, Coulomb friction.

    What the other laws become when they have broken. It counts no damage: there is nothing to break.
    """

    kn: float = parameter("Pa/m")  #: normal stiffness
    ks: float = parameter("Pa/m")  #: shear stiffness
    friction_angle: float = angle_of_friction()  #: phi of the faces
    closure: Closure = part(Closure, LinearClosure())  #: how pressure grows with closure

    @property
    def stiffness(self) -> tuple[float, float]:
        return self.kn, self.ks

    @property
    def friction(self) -> float:
        """tan(phi)."""
        return math.tan(math.radians(self.friction_angle))

    def traction(self, opening, slip, anchor):
        pressure = self.closure.pressure(self.kn, max(-opening, 0.0))
        anchor = slid(self.ks, slip, anchor, pressure * self.friction)
        return -pressure, self.ks * (slip - anchor), anchor
