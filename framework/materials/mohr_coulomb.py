"""Mohr-Coulomb plasticity of grains, with a tension cut-off and softening: grains that crush."""

from __future__ import annotations

import math
from typing import Any

import attrs
import numpy as np

from grainlaw.checks import not_above, not_beyond_apex
from grainlaw.fields import STRENGTHS, angle_of_friction, parameter
from grainlaw.materials.isotropic import Plastic, equivalent

TINY = 1e-200  # Pa2: keeps the direction of a stress without shear from being 0/0


@attrs.frozen(kw_only=True)
class MohrCoulombPlastic(Plastic):
    """Elastic to s1 - s3 + (s1 + s3) sin(phi) = 2 c cos(phi), or to s1 = f_t, then plastic, with softening.

    Principal stresses s1 >= s2 >= s3, tension positive, that across the plane among them. The return to the planes and
    edges in principal stresses is that of de Souza Neto, Peric and Owen (2008), Computational methods for plasticity,
    section 8.2; that of the tension cut-off comes first, since a return in shear lowers s1 (where both are active the
    stress is exact for small steps). From no plastic strain to
    ``softening_strain`` f_t, sin(phi) and c cos(phi) fall linearly to their residual values; the strain at the start of
    a step counts. The band in which a softening material fails is one zone wide: its energy depends on the mesh.
    """

    tensile_strength: float = parameter("Pa", at_least=0, usual=STRENGTHS)  #: f_t, the largest principal stress
    cohesion: float = parameter("Pa", at_least=0, usual=STRENGTHS)  #: c
    friction_angle: float = angle_of_friction()  #: phi
    #: psi; friction_angle makes the flow associated
    dilation_angle: float = parameter("deg", default=0.0, at_least=0, below=90)
    residual_tensile_strength: float = parameter("Pa", default=0.0, at_least=0, usual=STRENGTHS)  #: after softening
    residual_cohesion: float = parameter("Pa", default=0.0, at_least=0, usual=STRENGTHS)  #: after softening
    residual_friction_angle: float = angle_of_friction(default=0.0)  #: after softening
    softening_strain: float = parameter("1", default=math.inf, infinite=True)  #: none without one

    def __attrs_post_init__(self) -> None:
        for name in ("tensile_strength", "cohesion", "friction_angle"):
            not_above(self, f"residual_{name}", name, "a grain cannot gain strength by yielding")
        not_above(self, "dilation_angle", "friction_angle", "plastic strain would create energy")
        if np.any(np.isfinite(self.softening_strain)):
            not_above(self, "dilation_angle", "residual_friction_angle", "plastic strain would create energy")
        not_beyond_apex(self, "tensile_strength", "cohesion", "friction_angle")
        not_beyond_apex(self, "residual_tensile_strength", "residual_cohesion", "residual_friction_angle")

    sine = property(lambda self: math.sin(math.radians(self.friction_angle)))
    residual_sine = property(lambda self: math.sin(math.radians(self.residual_friction_angle)))
    dilation_sine = property(lambda self: math.sin(math.radians(self.dilation_angle)))
    softening = property(lambda self: 1 / self.softening_strain)
    compliance = property(lambda self: 0.5 / self.shear)
    swelling = property(lambda self: (1 / (3 * self.bulk) - self.compliance) / 3)
    held = property(lambda self: 2 * self.cohesion * math.cos(math.radians(self.friction_angle)))

    @property
    def residual_held(self) -> float:
        return 2 * self.residual_cohesion * math.cos(math.radians(self.residual_friction_angle))

    def stress(
        self, exx: Any, eyy: Any, exy: Any, ezz: Any, pxx: Any, pyy: Any, pzz: Any, pxy: Any, plastic_strain: Any
    ) -> Any:
        across, twice = self.bulk - 2 * self.shear / 3, 2 * self.shear
        xx, yy, zz, xy = exx - pxx, eyy - pyy, ezz - pzz, exy - pxy
        both = xx + yy
        volume = across * (both + zz)
        middle, half, szz, sxy = volume + self.shear * both, self.shear * (xx - yy), volume + twice * zz, twice * xy
        radius = math.sqrt(half**2 + (sxy**2 + TINY))
        high, low = middle + radius, middle - radius
        s1, s2, s3 = max(high, szz), max(min(high, szz), low), min(low, szz)

        soft = min(plastic_strain * self.softening, 1.0)
        tension = self.tensile_strength + soft * (self.residual_tensile_strength - self.tensile_strength)
        sine = self.sine + soft * (self.residual_sine - self.sine)
        strength = self.held + soft * (self.residual_held - self.held)
        s1, s2, s3 = self.cut_off(s1, s2, s3, tension)  # as they are, to the last digit, where nothing yields
        s1, s2, s3 = self.sheared(s1, s2, s3, sine, strength)

        # What the stresses fall by: the larger and the smaller one in the plane, and that across it.
        first, last = szz >= high, szz <= low
        fall_high, fall_low = high - (s2 if first else s1), low - (s2 if last else s3)
        fall_zz = szz - (s1 if first else s3 if last else s2)
        share = 0.5 * (fall_high - fall_low) / radius
        fall, fall_half, fall_xy = 0.5 * (fall_high + fall_low), share * half, share * sxy
        swell = (fall_high + fall_low + fall_zz) * self.swelling
        mean, apart = fall * self.compliance + swell, fall_half * self.compliance
        dxx, dyy, dzz, dxy = mean + apart, mean - apart, fall_zz * self.compliance + swell, fall_xy * self.compliance
        plastic_strain = plastic_strain + equivalent(dxx, dyy, dzz, dxy)
        middle, half = middle - fall, half - fall_half
        return (
            middle + half, middle - half, sxy - fall_xy, pxx + dxx, pyy + dyy, pzz + dzz, pxy + dxy, plastic_strain
        )  # fmt: skip

    def cut_off(self, s1: Any, s2: Any, s3: Any, tension: Any) -> Any:
        """Principal stresses after the return to s1, then s2, then s3 at the tensile strength."""
        along, across = self.bulk + 4 * self.shear / 3, self.bulk - 2 * self.shear / 3
        beside = across / along * max(s1 - tension, 0.0)
        two = s2 - beside > tension
        s3 = s3 - (across / (along + across) * (s1 + s2 - 2 * tension) if two else beside)
        return min(s1, tension), min(s2 - beside, tension), min(s3, tension)

    def sheared(self, s1: Any, s2: Any, s3: Any, sine: Any, strength: Any) -> Any:
        """Principal stresses after the return to the plane of s1 and s3, or to an edge with a second plane."""
        along, across = self.bulk + 4 * self.shear / 3, self.bulk - 2 * self.shear / 3
        up, down = 1 + self.dilation_sine, 1 - self.dilation_sine
        # Change of the stress by a unit of flow: of the larger stress of the pair, of the other one, of the smaller.
        g1, g2, g3 = along * up - across * down, across * (up - down), across * up - along * down
        more, less = 1 + sine, 1 - sine
        plain, excess = more * g1 - less * g3, max(more * s1 - less * s3 - strength, 0.0)
        # To an edge, where s1 would fall below s2, or s2 below s3: both of these stay alike, as their mean moves.
        upper = (s1 - s2) * plain < excess * (g1 - g2)
        lower = (s2 - s3) * plain < excess * (g2 - g3) and not upper
        large, g_large = (0.5 * (s1 + s2), 0.5 * (g1 + g2)) if upper else (s1, g1)
        small, g_small = (0.5 * (s2 + s3), 0.5 * (g2 + g3)) if lower else (s3, g3)
        flow = max(more * large - less * small - strength, 0.0) / (more * g_large - less * g_small)
        large, small = large - flow * g_large, small - flow * g_small
        return large, large if upper else small if lower else s2 - flow * g2, small
