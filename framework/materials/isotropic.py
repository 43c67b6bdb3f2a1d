"""What plastic materials have in common."""

from __future__ import annotations

import math
from typing import Any

import attrs

from grainlaw.fields import parameter
from grainlaw.material import Material, Rows


@attrs.frozen(kw_only=True)
class Plastic(Material):
    """Isotropic elasticity beside plastic strain, in three dimensions."""

    youngs_modulus: float = parameter("Pa", usual=(1e8, 1e12))  #: E
    poissons_ratio: float = parameter("1", above=-1.0, below=0.5)  #: nu
    density: float = parameter("kg/m3", usual=(500, 20_000))  #: mass per volume

    bulk = property(lambda self: self.youngs_modulus / (3 * (1 - 2 * self.poissons_ratio)))
    shear = property(lambda self: self.youngs_modulus / (2 * (1 + self.poissons_ratio)))

    @property
    def stiffness(self) -> Rows:
        along, across = self.bulk + 4 * self.shear / 3, self.bulk - 2 * self.shear / 3
        return (along, across, 0.0), (across, along, 0.0), (0.0, 0.0, self.shear)

    def energy(
        self, exx: Any, eyy: Any, exy: Any, ezz: Any, pxx: Any, pyy: Any, pzz: Any, pxy: Any, plastic_strain: Any
    ) -> Any:
        xx, yy, zz, xy = exx - pxx, eyy - pyy, ezz - pzz, exy - pxy
        mean = (xx + yy + zz) * (1 / 3)
        apart = (xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2 * xy**2
        return 4.5 * self.bulk * mean**2 + self.shear * apart


def equivalent(xx: Any, yy: Any, zz: Any, xy: Any) -> Any:
    """Equivalent of a plastic strain, sqrt(2/3 e:e) (Vermeer and de Borst 1984, Heron 29(3))."""
    return math.sqrt((xx**2 + yy**2 + zz**2 + 2 * xy**2) * (2 / 3))
