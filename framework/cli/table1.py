"""Table 1 of the paper: carbonatite of the Palabora mine, its specimen, and laws with its contact values."""

from __future__ import annotations

from typing import Any

import click

from grainlaw.contact import ContactLaw
from grainlaw.laws import (
    BandisClosure,
    BartonBandis,
    BilinearMixedMode,
    CamachoOrtiz,
    CohesiveCrack,
    Linear,
    MohrCoulomb,
    MunjizaJoint,
    XuNeedleman,
)
from grainlaw.material import Elastic
from grainlaw.messages import nearest
from grainlaw.units import GPa, MPa, mm

ROCK = Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
SAMPLE, QUICK = (50 * mm, 125 * mm, 755), (20 * mm, 50 * mm, 120)  #: width, height, grains

_STIFF: dict[str, Any] = {"kn": 1.05e14, "ks": 9.45e13}
_EVEN = _STIFF | {"tensile_strength": 13 * MPa, "cohesion": 29 * MPa, "residual_friction_angle": 5}
_STRONG = _EVEN | {"friction_angle": 54}
_TOUGH: dict[str, Any] = {"mode_i_energy": 150, "mode_ii_energy": 300}
LAWS: dict[str, ContactLaw] = {
    "linear": Linear(**_STIFF),
    "mohr-coulomb": MohrCoulomb(**_STRONG),
    "cohesive-crack": CohesiveCrack(**_STRONG, **_TOUGH),
    "munjiza": MunjizaJoint(**_STRONG, **_TOUGH),
    "camacho-ortiz": CamachoOrtiz(**_EVEN, **_TOUGH),
    "bilinear-mixed-mode": BilinearMixedMode(**_EVEN, **_TOUGH),
    "xu-needleman": XuNeedleman(**_EVEN),  # strength and stiffness leave no choice of energies: 8.7 and 14.7 J/m2
    # A rough joint is not in the table: friction of the contacts, dilation by phi = phi_res + 2 psi, closure assumed.
    "barton-bandis": BartonBandis(
        **_STIFF, friction_angle=54, dilation_angle=24.5, closure=BandisClosure(maximum_closure=5e-6)
    ),
}


def law_named(name: str) -> ContactLaw:
    """The law of a name. Raises click.BadParameter that suggests the nearest one."""
    if name not in LAWS:
        raise click.BadParameter(f"there is no law '{name}'{nearest(name, LAWS, 0.3)} (laws: {', '.join(LAWS)})")
    return LAWS[name]
