"""Mohr-Coulomb plasticity of grains, with a tension cut-off and softening: grains that crush."""

from __future__ import annotations

import math
from typing import Any

import attrs
import numpy as np

from grainlaw.checks import not_above, not_beyond_apex
from grainlaw.material import Material, Rows
from grainlaw.materials.isotropic import bulk_modulus, equivalent, in_plane_strain, shear_modulus, stored
from grainlaw.parameter import parameter

TINY = 1e-300  # Pa: keeps the direction of a stress without shear from being 0/0


@attrs.frozen(kw_only=True)
class MohrCoulombPlastic(Material):
    """Elastic to s1 - s3 + (s1 + s3) sin(phi) = 2 c cos(phi), or to s1 = f_t, then plastic, with softening.

    Principal stresses s1 >= s2 >= s3, tension positive, that across the plane among them. The return to the planes and
    edges in principal stresses is that of de Souza Neto, Peric and Owen (2008), Computational methods for plasticity,
    section 8.2; that of the tension cut-off comes first, since a return in shear lowers s1 (where both are active the
    stress is exact for small steps). From no plastic strain to
    ``softening_strain`` f_t, sin(phi) and c cos(phi) fall linearly to their residual values; the strain at the start of
    a step counts. The band in which a softening material fails is one zone wide: its energy depends on the mesh.
    """

    youngs_modulus: float = parameter("Pa", usual=(1e8, 1e12))  #: E
    poissons_ratio: float = parameter("1", above=-1.0, below=0.5)  #: nu
    density: float = parameter("kg/m3", usual=(500, 20_000))  #: mass per volume
    tensile_strength: float = parameter("Pa", at_least=0)  #: f_t, the largest principal stress
    cohesion: float = parameter("Pa", at_least=0)  #: c
    friction_angle: float = parameter("deg", at_least=0, below=90)  #: phi
    #: psi; friction_angle makes the flow associated
    dilation_angle: float = parameter("deg", default=0.0, at_least=0, below=90)
    residual_tensile_strength: float = parameter("Pa", default=0.0, at_least=0)  #: after softening
    residual_cohesion: float = parameter("Pa", default=0.0, at_least=0)  #: after softening
    residual_friction_angle: float = parameter("deg", default=0.0, at_least=0, below=90)  #: after softening
    softening_strain: float = parameter("1", default=math.inf, infinite=True)  #: none without one

    def __attrs_post_init__(self) -> None:
        for name in ("tensile_strength", "cohesion", "friction_angle"):
            not_above(self, f"residual_{name}", name, "a grain cannot gain strength by yielding")
        not_above(self, "dilation_angle", "friction_angle", "plastic strain would create energy")
        if np.any(np.isfinite(self.softening_strain)):
            not_above(self, "dilation_angle", "residual_friction_angle", "plastic strain would create energy")
        not_beyond_apex(self, "tensile_strength", "cohesion", "friction_angle")
        not_beyond_apex(self, "residual_tensile_strength", "residual_cohesion", "residual_friction_angle")

    bulk = property(lambda self: bulk_modulus(self.youngs_modulus, self.poissons_ratio))
    shear = property(lambda self: shear_modulus(self.youngs_modulus, self.poissons_ratio))
    sine = property(lambda self: math.sin(math.radians(self.friction_angle)))
    residual_sine = property(lambda self: math.sin(math.radians(self.residual_friction_angle)))
    dilation_sine = property(lambda self: math.sin(math.radians(self.dilation_angle)))
    softening = property(lambda self: 1 / self.softening_strain)
    compliance = property(lambda self: 0.5 / self.shear)
    held = property(lambda self: 2 * self.cohesion * math.cos(math.radians(self.friction_angle)))

    @property
    def residual_held(self) -> float:
        return 2 * self.residual_cohesion * math.cos(math.radians(self.residual_friction_angle))

    @property
    def stiffness(self) -> Rows:
        return in_plane_strain(self.bulk, self.shear)

    def stress(
        self, exx: Any, eyy: Any, exy: Any, ezz: Any, pxx: Any, pyy: Any, pzz: Any, pxy: Any, plastic_strain: Any
    ) -> Any:
        across, twice = self.bulk - 2 * self.shear / 3, 2 * self.shear
        xx, yy, zz, xy = exx - pxx, eyy - pyy, ezz - pzz, exy - pxy
        volume = across * (xx + yy + zz)
        sxx, syy, szz, sxy = volume + twice * xx, volume + twice * yy, volume + twice * zz, twice * xy
        middle, half = 0.5 * (sxx + syy), 0.5 * (sxx - syy)
        radius = math.sqrt(half**2 + sxy**2)
        high, low = middle + radius, middle - radius
        t1, t2, t3 = max(high, szz), max(min(high, szz), low), min(low, szz)

        soft = min(plastic_strain * self.softening, 1.0)
        tension = self.tensile_strength + soft * (self.residual_tensile_strength - self.tensile_strength)
        sine = self.sine + soft * (self.residual_sine - self.sine)
        strength = self.held + soft * (self.residual_held - self.held)
        s1, s2, s3 = self.cut_off(t1, t2, t3, tension)
        s1, s2, s3 = self.sheared(s1, s2, s3, sine, strength)
        yields = t1 > tension or t1 - t3 + (t1 + t3) * sine > strength

        last = szz <= low
        new_high = s2 if szz >= high else s1
        new_low = s2 if last else s3
        new_zz = s1 if szz >= high else s3 if last else s2
        share = 0.5 * (new_high - new_low) / max(radius, TINY)
        new_middle = 0.5 * (new_high + new_low)
        fall_xx = sxx - (new_middle + share * half) if yields else 0.0
        fall_yy = syy - (new_middle - share * half) if yields else 0.0
        fall_zz = szz - new_zz if yields else 0.0
        fall_xy = (1 - share) * sxy if yields else 0.0
        mean = (fall_xx + fall_yy + fall_zz) / 3
        swell = mean * (1 / (3 * self.bulk) - self.compliance)
        dxx, dyy, dzz, dxy = (
            fall_xx * self.compliance + swell,
            fall_yy * self.compliance + swell,
            fall_zz * self.compliance + swell,
            fall_xy * self.compliance,
        )
        plastic_strain = plastic_strain + equivalent(dxx, dyy, dzz, dxy)
        return (
            sxx - fall_xx, syy - fall_yy, sxy - fall_xy, pxx + dxx, pyy + dyy, pzz + dzz, pxy + dxy, plastic_strain
        )  # fmt: skip

    def cut_off(self, s1: Any, s2: Any, s3: Any, tension: Any) -> Any:
        """Principal stresses after the return to s1, then s2, then s3 at the tensile strength."""
        along, across = self.bulk + 4 * self.shear / 3, self.bulk - 2 * self.shear / 3
        u1, u2, u3 = s1 - tension, s2 - tension, s3 - tension
        beside = across / along * max(u1, 0.0)
        two = u2 - beside > 0
        u3 = u3 - (across / (along + across) * (u1 + u2) if two else beside)
        return tension + min(u1, 0.0), tension + min(u2 - beside, 0.0), tension + min(u3, 0.0)

    def sheared(self, s1: Any, s2: Any, s3: Any, sine: Any, strength: Any) -> Any:
        """Principal stresses after the return to the plane of s1 and s3, or to an edge with a second plane."""
        along, across = self.bulk + 4 * self.shear / 3, self.bulk - 2 * self.shear / 3
        up, down = 1 + self.dilation_sine, 1 - self.dilation_sine
        # Change of the stress by a unit of flow: of the larger stress of the pair, of the other one, of the smaller.
        g1, g2, g3 = along * up - across * down, across * (up - down), across * up - along * down
        plain = (1 + sine) * g1 - (1 - sine) * g3
        f13 = s1 - s3 + (s1 + s3) * sine - strength
        flow = max(f13, 0.0) / plain
        m1, m2, m3 = s1 - flow * g1, s2 - flow * g2, s3 - flow * g3
        # Two planes: those of the pairs 13 and 23 where s1 would fall below s2, 13 and 12 where s2 would below s3.
        upper = m1 < m2
        edge = upper or m2 < m3
        other = s2 - s3 + (s2 + s3) * sine - strength if upper else s1 - s2 + (s1 + s2) * sine - strength
        cross = (1 + sine) * g2 - (1 - sine) * g3 if upper else (1 + sine) * g1 - (1 - sine) * g2
        scale = 1 / (plain * plain - cross * cross)
        a, b = (plain * f13 - cross * other) * scale, (plain * other - cross * f13) * scale
        m1 = (s1 - a * g1 - b * (g2 if upper else g1)) if edge else m1
        m2 = (s2 - a * g2 - b * (g1 if upper else g3)) if edge else m2
        m3 = (s3 - a * g3 - b * (g3 if upper else g2)) if edge else m3
        return m1, m2, m3

    def energy(
        self, exx: Any, eyy: Any, exy: Any, ezz: Any, pxx: Any, pyy: Any, pzz: Any, pxy: Any, plastic_strain: Any
    ) -> Any:
        return stored(self.bulk, self.shear, exx - pxx, eyy - pyy, ezz - pzz, exy - pxy)
