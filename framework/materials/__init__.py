"""Materials of grains."""

from grainlaw.materials.drucker_prager import Cone, DruckerPrager
from grainlaw.materials.expansion import (
    ALBITE,
    BIOTITE,
    MICROCLINE,
    QUARTZ,
    ConstantExpansion,
    Expansion,
    ExpansionTable,
)
from grainlaw.materials.mohr_coulomb import MohrCoulombPlastic
from grainlaw.materials.thermal import Thermal
from grainlaw.materials.transversely_isotropic import TransverselyIsotropic

__all__ = [
    "ALBITE",
    "BIOTITE",
    "MICROCLINE",
    "QUARTZ",
    "Cone",
    "ConstantExpansion",
    "DruckerPrager",
    "Expansion",
    "ExpansionTable",
    "MohrCoulombPlastic",
    "Thermal",
    "TransverselyIsotropic",
]


def __dir__() -> list[str]:  # a notebook offers what is public, not the modules that it came from
    return [*__all__]
