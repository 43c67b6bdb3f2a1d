"""What plastic materials have in common: isotropic elasticity beside plastic strain, in three dimensions."""

from __future__ import annotations

import math
from typing import Any

from grainlaw.material import Rows


def bulk_modulus(youngs_modulus: Any, poissons_ratio: Any) -> Any:
    """Pa"""
    return youngs_modulus / (3 * (1 - 2 * poissons_ratio))


def shear_modulus(youngs_modulus: Any, poissons_ratio: Any) -> Any:
    """Pa"""
    return youngs_modulus / (2 * (1 + poissons_ratio))


def in_plane_strain(bulk: Any, shear: Any) -> Rows:
    """The stiffness before any plastic strain."""
    along, across = bulk + 4 * shear / 3, bulk - 2 * shear / 3
    return (along, across, 0.0), (across, along, 0.0), (0.0, 0.0, shear)


def stored(bulk: Any, shear: Any, xx: Any, yy: Any, zz: Any, xy: Any) -> Any:
    """J/m3 of an elastic strain; a third of its trace is its mean."""
    mean = (xx + yy + zz) * (1 / 3)
    apart = (xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2 * xy**2
    return 4.5 * bulk * mean**2 + shear * apart


def equivalent(xx: Any, yy: Any, zz: Any, xy: Any) -> Any:
    """Equivalent of a plastic strain, sqrt(2/3 e:e) (Vermeer and de Borst 1984, Heron 29(3))."""
    return math.sqrt((xx**2 + yy**2 + zz**2 + 2 * xy**2) * (2 / 3))
