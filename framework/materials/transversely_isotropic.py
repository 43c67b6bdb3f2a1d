"""Transversely isotropic grains: schist, slate, mica."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from grainlaw.checks import first_of
from grainlaw.material import Material, Plane, Rows
from grainlaw.parameter import ParameterError, parameter, part


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
    def _third(self) -> tuple[Any, ...]:
        """Pa: stress xx, yy, xy and zz by a strain across the plane, in the axes of the specimen."""
        if self.plane is Plane.STRESS:
            return 0.0, 0.0, 0.0, 0.0
        e, across, nu = self.youngs_modulus, self.youngs_modulus_across, self.poissons_ratio
        between = -self.poissons_ratio_across / across
        full = np.array([[1 / e, between, -nu / e], [between, 1 / across, between], [-nu / e, between, 1 / e]])
        near, far, own = np.linalg.inv(full)[2]
        c, s = np.cos(np.radians(self.foliation_angle)), np.sin(np.radians(self.foliation_angle))
        return near * c**2 + far * s**2, near * s**2 + far * c**2, (near - far) * s * c, own

    z0 = property(lambda self: float(self._third[3]))
    z1 = property(lambda self: float(self._third[0]))
    z2 = property(lambda self: float(self._third[1]))
    z3 = property(lambda self: float(self._third[2]))
    d11 = property(lambda self: float(self._turned[0]))
    d22 = property(lambda self: float(self._turned[1]))
    d12 = property(lambda self: float(self._turned[2]))
    d33 = property(lambda self: float(self._turned[3]))
    d13 = property(lambda self: float(self._turned[4]))
    d23 = property(lambda self: float(self._turned[5]))

    @property
    def stiffness(self) -> Rows:
        d11, d22, d12, d33, d13, d23 = self._turned
        return (d11, d12, d13), (d12, d22, d23), (d13, d23, d33)

    def stress(self, exx: Any, eyy: Any, exy: Any, ezz: Any) -> tuple[Any, ...]:
        angle = 2 * exy
        sxx = self.d11 * exx + self.d12 * eyy + self.d13 * angle + self.z1 * ezz
        syy = self.d12 * exx + self.d22 * eyy + self.d23 * angle + self.z2 * ezz
        return sxx, syy, self.d13 * exx + self.d23 * eyy + self.d33 * angle + self.z3 * ezz

    def energy(self, exx: Any, eyy: Any, exy: Any, ezz: Any) -> Any:
        sxx, syy, sxy = self.stress(exx, eyy, exy, ezz)
        szz = self.z1 * exx + self.z2 * eyy + 2 * self.z3 * exy + self.z0 * ezz
        return 0.5 * (sxx * exx + syy * eyy + szz * ezz) + sxy * exy
