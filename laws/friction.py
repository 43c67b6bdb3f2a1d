"""The contact of two faces that nothing bonds: closure under pressure and Coulomb friction, shared by all laws."""

from __future__ import annotations

import math

import attrs
import numpy as np

from grainlaw.contact import ContactLaw
from grainlaw.fields import angle_of_friction, parameter, part
from grainlaw.laws.closure import Closure, LinearClosure
from grainlaw.messages import short


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

    What the other laws become when they have broken. It counts no damage: there is nothing to break. With a ``gap`` the
    faces are that far apart in the undeformed specimen, and press only once it is closed.
    """

    kn: float = parameter("Pa/m")  #: normal stiffness
    ks: float = parameter("Pa/m")  #: shear stiffness
    friction_angle: float = angle_of_friction()  #: phi of the faces
    closure: Closure = part(Closure, LinearClosure())  #: how pressure grows with closure
    gap: float = parameter("m", default=0.0, at_least=0)  #: between the faces before any load

    @property
    def stiffness(self) -> tuple[float, float]:
        return self.kn, self.ks

    @property
    def friction(self) -> float:
        """tan(phi)."""
        return math.tan(math.radians(self.friction_angle))

    @property
    def exceptions(self) -> dict[str, str]:
        if not np.any(self.gap):
            return {}
        return {"stiffness": f"the faces are {short(self.gap)} m apart: they have a stiffness once they meet"}

    def traction(self, opening, slip, anchor):
        pressure = self.closure.pressure(self.kn, max(-opening - self.gap, 0.0))
        anchor = slid(self.ks, slip, anchor, pressure * self.friction)
        return -pressure, self.ks * (slip - anchor), anchor
