"""Linear irreversible softening over an effective opening."""

from __future__ import annotations

import math

import attrs

from grainlaw.contact import ContactLaw
from grainlaw.fields import STRENGTHS, SURFACES, angle_of_friction, parameter, part
from grainlaw.laws.closure import Closure, LinearClosure
from grainlaw.laws.friction import slid
from grainlaw.laws.mixed import TINY


@attrs.frozen(kw_only=True)
class CamachoOrtiz(ContactLaw):
    """Two springs that lose stiffness together once an ellipse of strengths is reached; friction grows with the damage.

    Camacho and Ortiz 1996, doi:10.1016/0020-7683(95)00255-3, with the two fracture energies of Snozzi and Molinari
    2013, doi:10.1002/nme.4398, and an elastic rise in place of their rigid start. The intact strength does not depend
    on pressure. Equation numbers are those of the law's section in docs/laws.md.
    """

    kn: float = parameter("Pa/m")  #: normal stiffness
    ks: float = parameter("Pa/m")  #: shear stiffness
    tensile_strength: float = parameter("Pa", usual=STRENGTHS)  #: f_t
    cohesion: float = parameter("Pa", usual=STRENGTHS)  #: c, shear strength: beta f_t
    residual_friction_angle: float = angle_of_friction()  #: friction of the broken contact
    mode_i_energy: float = parameter("J/m2", usual=SURFACES)  #: G_I, beyond the peak
    mode_ii_energy: float = parameter("J/m2", usual=SURFACES)  #: G_II, beyond the peak: kappa G_I
    closure: Closure = part(Closure, LinearClosure())  #: how pressure grows with closure

    @property
    def stiffness(self) -> tuple[float, float]:
        return self.kn, self.ks

    @property
    def fracture_energies(self) -> dict[str, float]:
        """G_I and G_II (J/m2), beyond the peaks."""
        return {"mode_i": self.mode_i_energy, "mode_ii": self.mode_ii_energy}

    @property
    def residual_friction(self) -> float:
        """tan(phi_res)."""
        return math.tan(math.radians(self.residual_friction_angle))

    @property
    def peak_opening(self) -> float:
        """o_p (m), (C1)."""
        return self.tensile_strength / self.kn

    @property
    def peak_slip(self) -> float:
        """s_p (m), (C1)."""
        return self.cohesion / self.ks

    @property
    def breaking_opening(self) -> float:
        """o_c (m), (C2)."""
        return self.peak_opening + 2 * self.mode_i_energy / self.tensile_strength

    @property
    def breaking_slip(self) -> float:
        """s_c (m), (C2)."""
        return self.peak_slip + 2 * self.mode_ii_energy / self.cohesion

    def traction(self, opening, slip, damage, mode, stiffness_loss, anchor):
        """``stiffness_loss``: share of both stiffnesses that is gone; ``anchor``: where friction rests."""
        pressure = self.closure.pressure(self.kn, max(-opening, 0.0))
        opened = max(opening, 0.0)
        o, s = opened * (1 / self.peak_opening), slip * (1 / self.peak_slip)
        a = math.sqrt(o * o + s * s)  # (C1)
        o, s = opened * (1 / self.breaking_opening), slip * (1 / self.breaking_slip)
        b = math.sqrt(o * o + s * s)  # (C2)

        now = (a - 1) / max(a - b, TINY)  # (C4)
        grows = min(now, 1.0) > stiffness_loss
        # (C3): the share of the softening on this ray; it grows only with the loss, not while a contact is reloaded.
        damage = max(damage, b * now if now < 1 else 1.0) if grows else damage
        mode = s * s / max(b * b, TINY) if grows else mode
        stiffness_loss = max(stiffness_loss, min(now, 1.0))

        kept = 1 - stiffness_loss
        anchor = slid(self.ks, slip, anchor, damage * pressure * self.residual_friction)  # (C5)
        shear = kept * self.ks * slip + self.ks * (slip - anchor)
        return kept * self.kn * opened - pressure, shear, damage, mode, stiffness_loss, anchor
