"""The joint element of the combined finite-discrete element method."""

from __future__ import annotations

import enum
import math

import attrs
import numpy as np

from grainlaw.checks import not_above
from grainlaw.contact import ContactLaw
from grainlaw.fields import STRENGTHS, SURFACES, angle_of_friction, parameter, part
from grainlaw.laws.closure import Closure, LinearClosure
from grainlaw.laws.friction import slid
from grainlaw.laws.mixed import TINY, joined
from grainlaw.laws.softening import EvansMarathe, Softening


class Unloading(enum.IntEnum):
    """How a joint unloads after its peak; the first is the default."""

    SECANT = 0  #: along the secant to the origin, and along it again when it is reloaded
    RETRACED = 1  #: back along the loading curve, as in the Y code: only the break is remembered


@attrs.frozen(kw_only=True)
class MunjizaJoint(ContactLaw):
    """A parabola up to each strength, then tension and shear soften together by one damage, and friction remains.

    Munjiza, Andrews and White 1999, doi:10.1002/(SICI)1097-0207(19990110)44:1<41::AID-NME487>3.0.CO;2-A; shear
    strength and mixed mode as in Y-Geo (Mahabadi and others 2012, doi:10.1061/(ASCE)GM.1943-5622.0000216). The
    stiffnesses are those at the origin, where a parabola is steepest: twice the secant to its peak. Equation numbers
    are those of the law's section in docs/laws.md.
    """

    kn: float = parameter("Pa/m")  #: normal stiffness at the origin
    ks: float = parameter("Pa/m")  #: shear stiffness at the origin
    tensile_strength: float = parameter("Pa", usual=STRENGTHS)  #: f_t
    cohesion: float = parameter("Pa", at_least=0, usual=STRENGTHS)  #: c, shear strength under no pressure
    friction_angle: float = angle_of_friction()  #: phi, of the intact contact
    residual_friction_angle: float = angle_of_friction()  #: friction of the broken contact
    mode_i_energy: float = parameter("J/m2", usual=SURFACES)  #: G_I, beyond the peak
    mode_ii_energy: float = parameter("J/m2", usual=SURFACES)  #: G_II, beyond the peak
    softening: Softening = part(Softening, EvansMarathe())  #: shape of the softening branches
    closure: Closure = part(Closure, LinearClosure())  #: how pressure grows with closure
    unloading: Unloading = part(Unloading, Unloading.SECANT)  #: how a joint unloads after its peak

    def __attrs_post_init__(self) -> None:
        not_above(self, "residual_friction_angle", "friction_angle", "a contact cannot gain strength by breaking")

    @property
    def stiffness(self) -> tuple[float, float]:
        return self.kn, self.ks

    @property
    def exceptions(self) -> dict[str, str]:
        if self.unloading == Unloading.RETRACED:
            return {
                "energy": (
                    "only the break is remembered: slip while softened or little pressed, close or press, slip back "
                    "gives energy, at each stroke less than the branch under the highest pressure takes up to the "
                    "break, k_s s_p^2 / 3 + G_II"
                )
            }
        if np.max(self.friction_angle) > 0:
            return {
                "energy": (
                    "the peak slip follows the pressure: slip, press, slip back, release before the peak gives "
                    "energy, less than k_s s_p^2 / 6 in a cycle up to the peak slip s_p before pressing"
                )
            }
        return {}

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
    def peak_opening(self) -> float:
        """o_p (m), (M1)."""
        return 2 * self.tensile_strength / self.kn

    @property
    def softening_opening(self) -> float:
        """o_r - o_p (m), (M3)."""
        return self.softening.length * self.mode_i_energy / self.tensile_strength

    @property
    def softening_work(self) -> float:
        """(s_r - s_p) f_s (J/m2), (M3)."""
        return self.softening.length * self.mode_ii_energy

    def secant(self, x: float) -> float:
        """Secant over the stiffness at the origin, undamaged, at ``x`` times the peak displacement, (M2)."""
        return 1 - x / 2 if x <= 1 else 1 / (2 * max(x, 1.0))

    def held(self, x: float, farthest: float) -> float:
        """The displacement (over that at the peak) whose secant holds; before the peak it unloads along the curve."""
        return farthest if self.unloading == Unloading.SECANT and farthest > 1 else x

    def traction(self, opening, slip, damage, mode, widest, farthest, anchor):
        """``widest``, ``farthest``: largest opening and slip over their peaks; ``anchor``: where friction rests."""
        pressure = self.closure.pressure(self.kn, max(-opening, 0.0))
        opened = max(opening, 0.0)
        strength = self.cohesion + pressure * self.friction
        peak_slip = max(2 * strength / self.ks, TINY * self.peak_opening)
        x = opened * (1 / self.peak_opening)
        y = abs(slip) / peak_slip
        widest, farthest = max(widest, x), max(farthest, y)

        d1 = max(opened - self.peak_opening, 0.0) * (1 / self.softening_opening)  # (M4)
        d2 = max(abs(slip) - peak_slip, 0.0) * strength * (1 / self.softening_work)  # (M4)
        now, share = joined(d1, d2)  # (M5)
        mode = share if now > damage else mode
        damage = max(damage, now)
        lasting = self.unloading == Unloading.SECANT or damage >= 1
        remaining = self.softening.remaining(damage if lasting else now)

        normal = remaining * self.kn * opened * self.secant(self.held(x, widest)) - pressure
        shear = remaining * self.ks * slip * self.secant(self.held(y, farthest))
        anchor = slid(self.ks, slip, anchor, (1 - remaining) * pressure * self.residual_friction)  # (M6)
        return normal, shear + self.ks * (slip - anchor), damage, mode, widest, farthest, anchor
