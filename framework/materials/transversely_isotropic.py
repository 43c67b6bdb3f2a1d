"""Transversely isotropic grains: schist, slate, mica."""

from __future__ import annotations

import math
from typing import Any

import attrs
import numpy as np

from grainlaw.checks import first_of
from grainlaw.fields import ParameterError, parameter, part
from grainlaw.material import Material, Plane, Rows


@attrs.frozen(kw_only=True)
class TransverselyIsotropic(Material):
    """Linear elastic, alike in all directions of a foliation that is normal to the plane.

    ``foliation_angle`` is that of its trace, counter-clockwise from the x axis of the undeformed specimen; an array
    gives each grain its own. The third direction lies in the foliation. Lekhnitskii (1963), Theory of elasticity of an
    anisotropic elastic body; with the names of Amadei (1996), doi:10.1016/0148-9062(95)00043-7.
    """

    youngs_modulus: float = parameter("Pa", usual=(1e8, 1e12))  #: E, in the foliation
    youngs_modulus_across: float = parameter("Pa", usual=(1e8, 1e12))  #: E', normal to it
    poissons_ratio: float = parameter("1", above=-1.0, below=1.0)  #: nu, in the foliation
    poissons_ratio_across: float = parameter("1", above=-np.inf)  #: nu', strain in the foliation by stress across it
    shear_modulus_across: float = parameter("Pa")  #: G', of sliding along the foliation
    density: float = parameter("kg/m3", usual=(500, 20_000))  #: mass per volume
    #: of the foliation, from the x axis, counter-clockwise
    foliation_angle: float = parameter("deg", default=0.0, above=-np.inf)
    plane: Plane = part(Plane, Plane.STRAIN)  #: what holds in the third direction: no strain or no stress

    def __attrs_post_init__(self) -> None:
        ratio = self.youngs_modulus_across / self.youngs_modulus
        room = ratio * (1 - np.asarray(self.poissons_ratio)) / 2
        wrong = np.asarray(self.poissons_ratio_across) ** 2 >= room
        if np.any(wrong):
            given, limit = first_of(wrong, self.poissons_ratio_across, np.sqrt(room))
            raise ParameterError(
                f"TransverselyIsotropic: poissons_ratio_across = {given:g} is not allowed, it must be of size below "
                f"sqrt((1 - poissons_ratio) youngs_modulus_across / (2 youngs_modulus)) = {limit:g}: the stiffness "
                "would not be positive definite"
            )

    @property
    def _along_foliation(self) -> tuple[Any, Any, Any, Any]:
        """Stiffness (Pa) along the foliation, across it, between the two, and in shear, in the plane."""
        e, across, nu = self.youngs_modulus, self.youngs_modulus_across, self.poissons_ratio
        strain = self.plane is Plane.STRAIN
        # Compliance, reduced where the third direction is held: b_ij = a_ij - a_i3 a_j3 / a_33 (Lekhnitskii).
        b11 = (1 - nu**2) / e if strain else 1 / e
        b12 = -self.poissons_ratio_across / across * (1 + nu if strain else 1.0)
        b22 = 1 / across - (self.poissons_ratio_across**2 * e / across**2 if strain else 0.0)
        area = b11 * b22 - b12**2
        return b22 / area, b11 / area, -b12 / area, self.shear_modulus_across

    @property
    def _turned(self) -> tuple[Any, ...]:
        """The six constants in the axes of the specimen: xx, yy, between the two, shear, and shear with xx and yy."""
        c11, c22, c12, c66 = self._along_foliation
        angle = np.radians(self.foliation_angle)
        c, s = np.cos(angle), np.sin(angle)
        both, far, near = c12 + 2 * c66, c11 - c12 - 2 * c66, c12 - c22 + 2 * c66
        return (
            c11 * c**4 + 2 * both * c**2 * s**2 + c22 * s**4, c11 * s**4 + 2 * both * c**2 * s**2 + c22 * c**4,
            (c11 + c22 - 4 * c66) * c**2 * s**2 + c12 * (s**4 + c**4),
            (c11 + c22 - 2 * c12) * c**2 * s**2 + c66 * (c**2 - s**2) ** 2,
            far * s * c**3 + near * s**3 * c, far * s**3 * c + near * s * c**3,
        )  # fmt: skip

    @property
    def _third(self) -> tuple[Any, Any, Any]:
        """Pa: stress along the foliation, across it, and in the third direction, by a strain in the third."""
        if self.plane is Plane.STRESS:
            return 0.0, 0.0, 0.0
        e, across, nu = self.youngs_modulus, self.youngs_modulus_across, self.poissons_ratio
        between = -self.poissons_ratio_across / across
        full = np.array([[1 / e, between, -nu / e], [between, 1 / across, between], [-nu / e, between, 1 / e]])
        near, far, own = np.linalg.inv(full)[2]
        return near, far, own

    # Stress along and across the foliation: its mean p and half the difference q, of the mean strain e and half the
    # difference d: p = evenly e + mixed d, q = mixed e + unevenly d. Two numbers tell the direction of a grain.
    evenly = property(
        lambda self: 0.5 * (self._along_foliation[0] + self._along_foliation[1]) + self._along_foliation[2]
    )
    unevenly = property(lambda self: self.evenly - 2 * self._along_foliation[2])
    mixed = property(lambda self: 0.5 * (self._along_foliation[0] - self._along_foliation[1]))
    sliding = property(lambda self: 2 * self.shear_modulus_across)
    third_evenly = property(lambda self: 0.5 * float(self._third[0] + self._third[1]))
    third_unevenly = property(lambda self: 0.5 * float(self._third[0] - self._third[1]))
    third = property(lambda self: float(self._third[2]))
    cosine = property(lambda self: math.cos(2 * math.radians(self.foliation_angle)))
    sine = property(lambda self: math.sin(2 * math.radians(self.foliation_angle)))

    @property
    def stiffness(self) -> Rows:
        d11, d22, d12, d33, d13, d23 = self._turned
        return (d11, d12, d13), (d12, d22, d23), (d13, d23, d33)

    def stress(self, exx: Any, eyy: Any, exy: Any, ezz: Any) -> tuple[Any, ...]:
        mean, half = 0.5 * (exx + eyy), 0.5 * (exx - eyy)
        along, slid = half * self.cosine + exy * self.sine, exy * self.cosine - half * self.sine
        p = self.evenly * mean + self.mixed * along + self.third_evenly * ezz
        q = self.mixed * mean + self.unevenly * along + self.third_unevenly * ezz
        t = self.sliding * slid
        sq = q * self.cosine - t * self.sine
        return p + sq, p - sq, q * self.sine + t * self.cosine

    def energy(self, exx: Any, eyy: Any, exy: Any, ezz: Any) -> Any:
        sxx, syy, sxy = self.stress(exx, eyy, exy, ezz)
        along = 0.5 * (exx - eyy) * self.cosine + exy * self.sine
        szz = self.third_evenly * (exx + eyy) + 2 * self.third_unevenly * along + self.third * ezz
        return 0.5 * (sxx * exx + syy * eyy + szz * ezz) + sxy * exy
