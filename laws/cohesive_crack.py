"""The cohesive crack model of grain contacts.

Equation numbers are those of "Application of cohesive crack model to simulation of rocks mechanical behavior in
grain-based distinct element model" (2019). Where it leaves a choice, the choice is an option of the law.
"""

from __future__ import annotations

import math

import attrs
import numpy as np

from grainlaw.checks import not_above, not_beyond_apex
from grainlaw.contact import ContactLaw
from grainlaw.fields import STRENGTHS, SURFACES, angle_of_friction, parameter, part
from grainlaw.laws.closure import Closure, LinearClosure
from grainlaw.laws.friction import slid
from grainlaw.laws.mixed import TINY, joined
from grainlaw.laws.readings import OtherMode, PrePeak, Residual, SofteningLength, TensionShear
from grainlaw.laws.softening import EvansMarathe, Softening
from grainlaw.vector_math import exp_unit


@attrs.frozen(kw_only=True)
class CohesiveCrack(ContactLaw):
    """Tension and shear soften together by one damage over their fracture energies, friction remains.

    A mode unloads along the secant to the origin. The shear strength follows the pressure, Eq. (5), but the secant in
    shear never stiffens: a contact that is pressed after it has slipped gets the higher strength only by further slip.
    Got at rest, it would be energy from nothing. Friction is a spring and slider next to the softening branch, which
    follows any reversal; it carries nothing while the contact is intact, and all shear when it has broken.
    """

    kn: float = parameter("Pa/m")  #: normal stiffness
    ks: float = parameter("Pa/m")  #: shear stiffness
    tensile_strength: float = parameter("Pa", usual=STRENGTHS)  #: f_t
    cohesion: float = parameter("Pa", at_least=0, usual=STRENGTHS)  #: c, shear strength under no pressure
    friction_angle: float = angle_of_friction()  #: phi, of the intact contact
    residual_friction_angle: float = angle_of_friction()  #: friction of the broken contact
    mode_i_energy: float = parameter("J/m2", usual=SURFACES)  #: G_I, beyond the peak
    mode_ii_energy: float = parameter("J/m2", usual=SURFACES)  #: G_II, beyond the peak
    softening: Softening = part(Softening, EvansMarathe())  #: shape of the softening branches
    closure: Closure = part(Closure, LinearClosure())  #: how pressure grows with closure
    #: how long the softening branches are
    softening_length: SofteningLength = part(SofteningLength, SofteningLength.ENERGY)
    other_mode: OtherMode = part(OtherMode, OtherMode.SCALED)  #: the branch of one mode after damage by the other
    residual: Residual = part(Residual, Residual.FLOOR)  #: how the shear branch ends in residual friction
    #: shear strength of a contact under tension
    tension_shear: TensionShear = part(TensionShear, TensionShear.EXTENDED)
    pre_peak: PrePeak = part(PrePeak, PrePeak.EXPONENTIAL)  #: how a traction rises to its peak

    def __attrs_post_init__(self) -> None:
        not_above(self, "residual_friction_angle", "friction_angle", "a contact cannot gain strength by breaking")
        if self.tension_shear == TensionShear.EXTENDED:
            not_beyond_apex(self, "tensile_strength", "cohesion", "friction_angle")

    @property
    def stiffness(self) -> tuple[float, float]:
        return self.kn, self.ks

    @property
    def exceptions(self) -> dict[str, str]:
        found = {}
        if self.pre_peak == PrePeak.AS_PRINTED and np.max(self.friction_angle) > 0:
            found["energy"] = (
                "the peak slip follows the pressure, Eqs. (5, 9): slip, press, unslip, unpress before the peak "
                "gives energy, less than 0.24 k_s s_p^2 in a cycle up to the peak slip s_p before pressing"
            )
        if self.other_mode == OtherMode.NOT_SCALED:
            found["continuity"] = "a mode falls by 1 - chi(D) where it reaches its peak after the other mode's damage"
        if self.softening_length == SofteningLength.CLOSED_FORM:
            share = self.length / self.softening.length
            found["fracture energies"] = f"L = 3 as printed: the branches dissipate {share:.4f} of the energies"
        return found

    @property
    def fracture_energies(self) -> dict[str, float]:
        """G_I and G_II (J/m2), beyond the peaks."""
        return {"mode_i": self.mode_i_energy, "mode_ii": self.mode_ii_energy}

    @property
    def friction(self) -> float:
        """tan(phi)."""
        return math.tan(math.radians(self.friction_angle))

    @property
    def residual_friction(self) -> float:
        """tan(phi_res)."""
        return math.tan(math.radians(self.residual_friction_angle))

    @property
    def length(self) -> float:
        """L in Eqs. (4, 8)."""
        return 3.0 if self.softening_length == SofteningLength.CLOSED_FORM else self.softening.length

    @property
    def peak_factor(self) -> float:
        """Peak displacement over strength/stiffness, Eqs. (1, 9)."""
        return 1.0 if self.pre_peak == PrePeak.LINEAR else math.e

    @property
    def peak_opening(self) -> float:
        """o_p (m), Eq. (1)."""
        return self.peak_factor * self.tensile_strength / self.kn

    @property
    def softening_opening(self) -> float:
        """o_res - o_p (m), Eq. (4)."""
        return self.length * self.mode_i_energy / self.tensile_strength

    @property
    def breaking_opening(self) -> float:
        """o_res (m), Eq. (4)."""
        return self.peak_opening + self.softening_opening

    @property
    def softening_work(self) -> float:
        """(s_res - s_p) f_s (J/m2), Eq. (8)."""
        return self.length * self.mode_ii_energy

    def shear_strength(self, pressure: float, tension: float) -> float:
        """f_s (Pa), Eq. (5)."""
        return max(self.cohesion + (pressure - tension) * self.friction, 0.0)

    def peak_slip(self, strength: float) -> float:
        """s_p (m), Eq. (9)."""
        return strength * (self.peak_factor / self.ks)

    def breaking_slip(self, strength: float) -> float:
        """s_res (m), Eq. (8)."""
        return self.peak_slip(strength) + self.softening_work / strength

    def rise(self, x: float, farthest: float) -> float:
        """Secant before the peak over the first stiffness, at ``x`` (once ``farthest``) times the peak displacement."""
        if self.pre_peak == PrePeak.LINEAR:
            return 1.0
        return exp_unit(-min(x if self.pre_peak == PrePeak.AS_PRINTED else farthest, 1.0))

    def secant(self, rise: float, farthest: float) -> float:
        """Secant over the first stiffness without damage, after ``farthest`` times the peak displacement."""
        return rise if farthest <= 1 else 1 / (self.peak_factor * max(farthest, 1.0))

    def intact_share(self, farthest: float, damage: float, remaining: float) -> float:
        """What the damage leaves of a mode that has been as far as ``farthest`` times its peak displacement."""
        before_peak = (1.0 if damage < 1 else 0.0) if self.other_mode == OtherMode.NOT_SCALED else remaining
        return before_peak if farthest <= 1 else remaining

    def slider_strength(self, pressure: float, strength: float, share: float, damage: float) -> float:
        """What friction holds (Pa) next to a softening branch that holds ``share`` of ``strength``, Eq. (7)."""
        full = pressure * self.residual_friction
        if self.residual == Residual.FLOOR:
            return max(full - share * strength, 0.0)
        if self.residual == Residual.BLEND:
            return (1 - share) * full
        return full if damage >= 1 else 0.0

    def traction(self, opening, slip, damage, mode, widest, farthest, anchor):
        """``widest``, ``farthest``: largest opening and slip over their peaks; ``anchor``: where friction rests."""
        pressure = self.closure.pressure(self.kn, max(-opening, 0.0))
        opened = max(opening, 0.0)
        x = opened * (1 / self.peak_opening)
        widest = max(widest, x)
        rise = self.rise(x, widest)
        # Eq. (5) by the tension an intact contact would have: softening must not give shear strength back.
        tension = self.kn * opened * rise if widest <= 1 else self.tensile_strength
        strength = self.shear_strength(pressure, tension if self.tension_shear == TensionShear.EXTENDED else 0.0)
        peak_slip = max(self.peak_slip(strength), TINY * self.peak_opening)
        y = abs(slip) / peak_slip
        farthest = max(farthest, y)

        d1 = max(opened - self.peak_opening, 0.0) * (1 / self.softening_opening)  # Eq. (4)
        d2 = max(abs(slip) - peak_slip, 0.0) * strength * (1 / self.softening_work)  # Eq. (8)
        grown, share = joined(d1, d2)  # Eq. (11)
        mode = share if grown > damage else mode
        damage = max(damage, grown)
        remaining = self.softening.remaining(damage)

        share = self.intact_share(widest, damage, remaining)
        normal = share * self.kn * opened * self.secant(rise, widest) - pressure
        share = self.intact_share(farthest, damage, remaining)
        shear = share * self.ks * slip * self.secant(self.rise(y, farthest), farthest)

        limit = self.slider_strength(pressure, strength, share, damage)
        anchor = slid(self.ks, slip, anchor, limit)
        return normal, shear + self.ks * (slip - anchor), damage, mode, widest, farthest, anchor
