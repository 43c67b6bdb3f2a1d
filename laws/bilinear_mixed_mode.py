"""Bilinear softening whose strength and fracture energy follow the mix of opening and slip."""

from __future__ import annotations

import math

import attrs
import numpy as np

from grainlaw.contact import ContactLaw
from grainlaw.fields import STRENGTHS, SURFACES, ParameterError, angle_of_friction, parameter, part
from grainlaw.laws.closure import Closure, LinearClosure
from grainlaw.laws.friction import slid
from grainlaw.laws.mixed import TINY
from grainlaw.messages import short


@attrs.frozen(kw_only=True)
class BilinearMixedMode(ContactLaw):
    """Two springs that soften together; strength and energy lie between those of the modes, by a power of the mix.

    Turon, Camanho, Costa and Davila 2006, doi:10.1016/j.mechmat.2005.10.003, with different stiffnesses as in Turon and
    others 2018, doi:10.1016/j.compstruct.2017.10.017. Where the mix changes the published secant may stiffen again;
    here it never does. Friction, which grows with the damage, is not part of the publication. Equation numbers are
    those of the law's section in docs/laws.md.
    """

    kn: float = parameter("Pa/m")  #: normal stiffness
    ks: float = parameter("Pa/m")  #: shear stiffness
    tensile_strength: float = parameter("Pa", usual=STRENGTHS)  #: f_t
    cohesion: float = parameter("Pa", usual=STRENGTHS)  #: c, shear strength
    residual_friction_angle: float = angle_of_friction()  #: friction of the broken contact
    mode_i_energy: float = parameter("J/m2", usual=SURFACES)  #: G_I, beyond the peak; published is G_I + f_t^2 / (2 kn)
    mode_ii_energy: float = parameter(
        "J/m2", usual=SURFACES
    )  #: G_II, beyond the peak; published is G_II + c^2 / (2 ks)
    eta: float = parameter("1", default=2.0, at_least=0.25, at_most=7.75)  #: Benzeggagh-Kenane; k/4
    closure: Closure = part(Closure, LinearClosure())  #: how pressure grows with closure

    def __attrs_post_init__(self) -> None:
        if np.any(np.mod(self.eta, 0.25)) or np.ptp(self.eta) > 0:
            raise ParameterError(
                f"BilinearMixedMode: eta = {short(self.eta)} is not allowed, it must be one multiple of 1/4 "
                "(the power is taken by multiplication and square roots)"
            )

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
    def tension_onset(self) -> float:
        """kn o_p^2 (J/m2), (T2)."""
        return self.tensile_strength * self.tensile_strength / self.kn

    @property
    def shear_onset(self) -> float:
        """ks s_p^2 (J/m2), (T2)."""
        return self.cohesion * self.cohesion / self.ks

    @property
    def quarters(self) -> int:
        """4 eta."""
        return round(4 * float(np.max(self.eta)))

    def power(self, share: float) -> float:
        """B^eta from the binary digits of 4 eta, constants of the compiled code."""
        n = self.quarters
        root = math.sqrt(share) if n & 3 else 1.0
        x2 = share * share
        broken = (math.sqrt(root) if n & 1 else 1.0) * (root if n & 2 else 1.0)
        return broken * ((share if n & 4 else 1.0) * (x2 if n & 8 else 1.0) * (x2 * x2 if n & 16 else 1.0))

    def traction(self, opening, slip, damage, mode, stiffness_loss, anchor):
        """``stiffness_loss``: share of both stiffnesses that is gone; ``anchor``: where friction rests."""
        pressure = self.closure.pressure(self.kn, max(-opening, 0.0))
        opened = max(opening, 0.0)
        stretch = self.kn * opened * opened
        shift = self.ks * slip * slip
        both = stretch + shift
        share = shift / max(both, TINY)  # (T1)
        weight = self.power(share)
        onset = self.tension_onset + (self.shear_onset - self.tension_onset) * weight  # (T2)
        energy = self.mode_i_energy + (self.mode_ii_energy - self.mode_i_energy) * weight  # (T3)

        x = max(math.sqrt(both / onset), 1.0)
        softened = min((x - 1) * onset / (2 * energy), 1.0)  # (T4)
        now = 1 - (1 - softened) / x  # (T5)
        # (T4) counts only where the secant falls, not while a contact is reloaded under another mix.
        mode = share if now > stiffness_loss else mode
        damage = max(damage, softened) if now >= stiffness_loss else damage
        stiffness_loss = max(stiffness_loss, now)

        kept = 1 - stiffness_loss
        anchor = slid(self.ks, slip, anchor, damage * pressure * self.residual_friction)  # (T6)
        shear = kept * self.ks * slip + self.ks * (slip - anchor)
        return kept * self.kn * opened - pressure, shear, damage, mode, stiffness_loss, anchor
