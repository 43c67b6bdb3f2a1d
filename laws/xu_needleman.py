"""Exponential decohesion in opening and slip, from one potential or with a coupling for each mode."""

from __future__ import annotations

import enum
import math

import attrs
import numpy as np

from grainlaw.contact import ContactLaw
from grainlaw.fields import STRENGTHS, angle_of_friction, parameter, part
from grainlaw.laws.closure import Closure, LinearClosure
from grainlaw.laws.friction import slid
from grainlaw.laws.mixed import TINY
from grainlaw.vector_math import exp_bounded, exp_unit

END = 8.0  #: n + t at the break


class Coupling(enum.IntEnum):
    """What slip does to the tension."""

    VAN_DEN_BOSCH = 0  #: it falls by the same factor as the shear traction
    POTENTIAL = 1  #: it falls to 1 - phi_t/phi_n of itself, so that one potential holds both energies


@attrs.frozen(kw_only=True)
class XuNeedleman(ContactLaw):
    """Tractions that rise and fall as x exp(-x) and x exp(-x^2); stiffnesses and strengths give the energies.

    Xu and Needleman 1994, doi:10.1016/0022-5096(94)90003-5, with r = 0, and as van den Bosch, Schreurs and Geers 2006,
    doi:10.1016/j.engfracmech.2005.12.006; the latter is the default, because with q = phi_t/phi_n above 1 the tension
    of the former becomes a repulsion after slip. As published on paths on which opening and slip only grow. Ours are:
    unloading along the secants, the break where less than 1 % of a strength is left, closure, and friction, which grows
    with the damage. Equation numbers are those of the law's section in docs/laws.md.
    """

    kn: float = parameter("Pa/m")  #: normal stiffness at the start
    ks: float = parameter("Pa/m")  #: shear stiffness at the start
    tensile_strength: float = parameter("Pa", usual=STRENGTHS)  #: f_t
    cohesion: float = parameter("Pa", usual=STRENGTHS)  #: c, shear strength without opening
    residual_friction_angle: float = angle_of_friction()  #: friction of the broken contact
    closure: Closure = part(Closure, LinearClosure())  #: how pressure grows with closure
    coupling: Coupling = part(Coupling, Coupling.VAN_DEN_BOSCH)  #: what slip does to the tension

    @property
    def stiffness(self) -> tuple[float, float]:
        return self.kn, self.ks

    @property
    def exceptions(self) -> dict[str, str]:
        q = np.max(self.energy_ratio)
        found = {}
        if self.coupling == Coupling.POTENTIAL:
            size = np.max(np.abs(1 - self.energy_ratio) * self.tensile_strength)
            found["continuity"] = f"the tension that slip leaves, up to |1 - q| f_t = {size:.3g} Pa, ends at the break"
        if self.coupling == Coupling.POTENTIAL and q > 9 / 4:
            size = np.max((4 * self.energy_ratio / 9 - 1) * self.opening_energy)
            found["energy"] = (
                f"q = {q:.3g} is above 9/4: after slip and return the repulsion gives up to (4 q/9 - 1) phi_n = "
                f"{size:.3g} J/m2"
            )
        return found

    @property
    def fracture_energies(self) -> dict[str, float]:
        """G_I and G_II (J/m2), beyond the peaks."""
        return {"mode_i": self.mode_i_energy, "mode_ii": self.mode_ii_energy}

    @property
    def residual_friction(self) -> float:
        """tan(phi_res)."""
        return math.tan(math.radians(self.residual_friction_angle))

    @property
    def opening_length(self) -> float:
        """delta_n (m), the opening at the peak, (X1)."""
        return math.e * self.tensile_strength / self.kn

    @property
    def slip_length(self) -> float:
        """delta_t (m), sqrt(2) times the slip at the peak, (X1)."""
        return math.sqrt(2 * math.e) * self.cohesion / self.ks

    @property
    def opening_energy(self) -> float:
        """phi_n (J/m2), the whole area, (X2)."""
        return math.e * self.tensile_strength * self.opening_length

    @property
    def slip_energy(self) -> float:
        """phi_t (J/m2), the whole area, (X2)."""
        return math.sqrt(math.e / 2) * self.cohesion * self.slip_length

    @property
    def energy_ratio(self) -> float:
        """q = phi_t / phi_n."""
        return self.slip_energy / self.opening_energy

    @property
    def mode_i_energy(self) -> float:
        """J/m2 from the peak to the break."""
        return self.opening_energy * (2 * math.exp(-1) - (1 + END) * math.exp(-END))

    @property
    def mode_ii_energy(self) -> float:
        """J/m2 from the peak to the break."""
        return self.slip_energy * (math.exp(-0.5) - math.exp(-END))

    def tension_kept(self, n: float, t: float, both: float) -> float:
        """Secant in tension over kn, (X3) or (X4); ``both`` is exp(-n - t)."""
        if self.coupling == Coupling.POTENTIAL:
            return (1 - self.energy_ratio) * exp_bounded(-n) + self.energy_ratio * both
        return both

    def traction(self, opening, slip, damage, mode, widest, farthest, anchor):
        """``widest``: largest opening over delta_n; ``farthest``: largest (slip / delta_t)^2."""
        pressure = self.closure.pressure(self.kn, max(-opening, 0.0))
        opened = max(opening, 0.0)
        y = slip * (1 / self.slip_length)
        widest = max(widest, opened * (1 / self.opening_length))
        farthest = max(farthest, y * y)

        away = min(widest + farthest, END)
        both = exp_bounded(-away)
        share = farthest / max(widest + farthest, TINY)
        peak = exp_unit(-1 / (1 + share))
        end = exp_bounded(-END)
        fallen = max((peak - both) / (peak - end), 0.0) if away < END else 1.0  # (X5)
        mode = share if fallen > damage else mode
        damage = max(damage, fallen)

        n = min(widest, END)
        kept = 1.0 if damage < 1 else 0.0
        normal = kept * self.tension_kept(n, farthest, both) * self.kn * opened - pressure
        anchor = slid(self.ks, slip, anchor, damage * pressure * self.residual_friction)  # (X6)
        shear = kept * (1 + n) * both * self.ks * slip + self.ks * (slip - anchor)
        return normal, shear, damage, mode, widest, farthest, anchor
