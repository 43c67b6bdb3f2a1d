"""A rough rock joint: hyperbolic closure, friction and dilation that ends."""

from __future__ import annotations

import math
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.checks import not_above
from grainlaw.contact import ContactLaw
from grainlaw.fields import STRENGTHS, ParameterError, angle_of_friction, parameter
from grainlaw.laws.closure import Closure
from grainlaw.laws.friction import slid
from grainlaw.messages import short


@attrs.frozen(kw_only=True)
class Roughness(metaclass=Checked):
    """A joint's surface: it gives friction and dilation angle at a normal stress, for :class:`BartonBandis`.

    Barton and Choubey 1977, doi:10.1007/BF01261801.
    """

    takes_arrays = True  #: parameters may be arrays

    jrc: float = parameter("1", at_least=0, at_most=20)  #: joint roughness coefficient
    jcs: float = parameter("Pa", usual=STRENGTHS)  #: joint wall compressive strength
    residual_friction_angle: float = angle_of_friction()  #: of the smooth, weathered surface

    def friction_angle(self, normal_stress: Any) -> Any:
        """Degrees at a normal stress (Pa), (B4); above 70 it is refused, as the criterion is not meant for it."""
        angle = self.residual_friction_angle + 2 * self.dilation_angle(normal_stress)
        if np.any(angle > 70):
            raise ParameterError(
                f"Roughness: a friction angle of {np.max(angle):.3g} deg at a normal stress of "
                f"{np.min(normal_stress):g} Pa is not allowed, the criterion is not meant for more than 70 deg"
            )
        return angle

    def dilation_angle(self, normal_stress: Any) -> Any:
        """Degrees at a normal stress (Pa), (B5); nothing from a stress of JCS on."""
        if not np.all(np.greater(normal_stress, 0)):
            raise ParameterError(
                f"Roughness: normal_stress = {short(normal_stress)} Pa is not allowed, it must be above 0"
            )
        return 0.5 * self.jrc * np.maximum(np.log10(self.jcs / normal_stress), 0.0)


def _a_closure(component: Any, attribute: Any, value: Any) -> None:
    if not isinstance(value, Closure):
        raise ParameterError(
            f"{type(component).__name__}: {attribute.name} = {short(value)} is not allowed, "
            "it must be a Closure such as BandisClosure(maximum_closure=...)"
        )


@attrs.frozen(kw_only=True)
class BartonBandis(ContactLaw):
    """A joint without a bond: closure, Coulomb slip, and dilation that ends after a length of slip.

    Of Bandis, Lumsden and Barton 1983, doi:10.1016/0148-9062(83)90595-8, it takes the hyperbola of closure, but not
    the stiffening from one loading to the next. The angles are those at one normal stress; :class:`Roughness` gives
    them. Their change with the stress and with slip (mobilisation, wear) is left out. Dilation counts slip in either
    direction, is not undone by slip back and stays when the joint opens. A dilation angle above the friction angle is
    refused: the joint would gain more energy by dilation than friction dissipates. Equation numbers are those of the
    law's section in docs/laws.md.
    """

    kn: float = parameter("Pa/m")  #: normal stiffness, of the closure at its start
    ks: float = parameter("Pa/m")  #: shear stiffness
    friction_angle: float = angle_of_friction()  #: phi
    #: psi: slip under pressure opens the joint by its tangent
    dilation_angle: float = parameter("deg", default=0.0, at_least=0, below=90)
    dilation_end: float = parameter("m", default=math.inf, above=0, infinite=True)  #: slip up to which it dilates
    closure: Closure = attrs.field(validator=_a_closure)  #: how pressure grows with closure

    def __attrs_post_init__(self) -> None:
        not_above(self, "dilation_angle", "friction_angle", "slip would create energy")

    @property
    def stiffness(self) -> tuple[float, float]:
        return self.kn, self.ks

    @property
    def friction(self) -> float:
        """tan(phi)."""
        return math.tan(math.radians(self.friction_angle))

    @property
    def dilatancy(self) -> float:
        """tan(psi)."""
        return math.tan(math.radians(self.dilation_angle))

    @property
    def full_dilation(self) -> float:
        """m, (B3)."""
        return self.dilatancy * self.dilation_end if self.dilation_angle > 0 else 0.0

    def sliding(self, trial: float, closed: float, lift: float) -> float:
        """Length of slip (m) that brings a shear traction from ``trial`` (Pa) down to the strength.

        The slip dilates the joint by ``lift`` times its length, and so raises the pressure and the strength.

        Two steps of Newton's method. Pressure is convex in closure, so that neither falls short: the shear traction
        comes to rest at once.
        """
        hardening = lift * self.friction
        excess = trial - self.friction * self.closure.pressure(self.kn, closed)
        first = max(excess, 0.0) / (self.ks + hardening * self.closure.tangent(self.kn, closed))
        closed = closed + lift * first
        excess = trial - self.ks * first - self.friction * self.closure.pressure(self.kn, closed)
        return max(first + excess / (self.ks + hardening * self.closure.tangent(self.kn, closed)), 0.0)

    def traction(self, opening, slip, anchor, dilation):
        """``anchor``: where friction rests; ``dilation``: what slip has lifted so far (m)."""
        trial = abs(self.ks * (slip - anchor))
        lift = self.dilatancy if opening < dilation else 0.0  # an open joint has nothing to ride up on
        length = self.sliding(trial, max(dilation - opening, 0.0), lift)
        dilation = min(dilation + lift * length, self.full_dilation)  # (B3)
        pressure = self.closure.pressure(self.kn, max(dilation - opening, 0.0))  # (B1)
        anchor = slid(self.ks, slip, anchor, pressure * self.friction)  # (B2)
        return -pressure, self.ks * (slip - anchor), anchor, dilation
