"""Brittle Coulomb slip with residual strength."""

from __future__ import annotations

import math

import attrs

from grainlaw.checks import not_above, not_beyond_apex
from grainlaw.contact import ContactLaw
from grainlaw.fields import STRENGTHS, angle_of_friction, parameter
from grainlaw.laws.friction import slid


@attrs.frozen(kw_only=True)
class MohrCoulomb(ContactLaw):
    """Linear up to the tensile strength or c + sigma_n tan(phi), then residual strength at once (UDEC's Coulomb slip).

    With residual strength the contact is a spring and slider in shear, which follows any reversal, and holds no more
    than the residual tension. ``damage`` is 0 or 1; ``mode`` is 0 after tensile and 1 after shear failure. Where one
    step passes both strengths the failure is called tensile; the contact is the same afterwards.

    Slip under pressure beyond the residual strength dilates the contact by its length times tan(dilation_angle), in
    either direction and without limit. A dilation angle above the residual friction angle is refused: the contact
    would gain more energy by dilation than friction dissipates.
    """

    kn: float = parameter("Pa/m")  #: normal stiffness
    ks: float = parameter("Pa/m")  #: shear stiffness
    tensile_strength: float = parameter("Pa", at_least=0, usual=STRENGTHS)  #: f_t
    cohesion: float = parameter("Pa", at_least=0, usual=STRENGTHS)  #: c, shear strength under no pressure
    friction_angle: float = angle_of_friction()  #: phi, before it has broken
    #: tension that the broken contact still bears
    residual_tensile_strength: float = parameter("Pa", default=0.0, at_least=0, usual=STRENGTHS)
    #: shear that the broken contact bears under no pressure
    residual_cohesion: float = parameter("Pa", default=0.0, at_least=0, usual=STRENGTHS)
    #: friction of the broken contact
    residual_friction_angle: float = angle_of_friction(default=0.0)
    #: slip of the broken contact under pressure opens it by its tangent
    dilation_angle: float = parameter("deg", default=0.0, at_least=0, below=90)

    def __attrs_post_init__(self) -> None:
        for name in ("tensile_strength", "cohesion", "friction_angle"):
            not_above(self, f"residual_{name}", name, "a contact cannot gain strength by breaking")
        not_above(self, "dilation_angle", "residual_friction_angle", "slip would create energy")
        not_beyond_apex(self, "tensile_strength", "cohesion", "friction_angle")
        not_beyond_apex(self, "residual_tensile_strength", "residual_cohesion", "residual_friction_angle")

    @property
    def stiffness(self) -> tuple[float, float]:
        return self.kn, self.ks

    @property
    def exceptions(self) -> dict[str, str]:
        return {"continuity": "brittle: strength drops to its residual value in one step"}

    @property
    def friction(self) -> float:
        return math.tan(math.radians(self.friction_angle))

    @property
    def residual_friction(self) -> float:
        return math.tan(math.radians(self.residual_friction_angle))

    @property
    def dilatancy(self) -> float:
        return math.tan(math.radians(self.dilation_angle))

    def traction(self, opening, slip, damage, mode, plastic_slip, dilation):
        tension, shear = self.kn * opening, self.ks * slip
        pulled = 1.0 if tension > self.tensile_strength else 0.0
        sheared = 1.0 if abs(shear) > self.cohesion - tension * self.friction else 0.0
        mode = (1 - pulled) * sheared if damage == 0 else mode
        damage = max(damage, pulled, sheared)

        held = min(self.kn * (opening - dilation), self.residual_tensile_strength)
        strength = max(self.residual_cohesion - held * self.residual_friction, 0.0)
        lift = self.dilatancy if opening < dilation else 0.0  # an open contact has nothing to ride up on
        # Slip raises the pressure by kn lift and with it the strength.
        anchor = slid(self.ks, slip, plastic_slip, strength, self.kn * lift * self.residual_friction)
        anchor = anchor if damage > 0 else plastic_slip
        dilation = dilation + lift * abs(anchor - plastic_slip)
        plastic_slip = anchor

        held = min(self.kn * (opening - dilation), self.residual_tensile_strength)
        normal = held if damage > 0 else tension
        shear = self.ks * (slip - plastic_slip)  # no plastic slip before failure
        return normal, shear, damage, mode, plastic_slip, dilation
