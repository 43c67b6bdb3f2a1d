"""Materials of grains."""

from grainlaw.materials.drucker_prager import Cone, DruckerPrager
from grainlaw.materials.mohr_coulomb import MohrCoulombPlastic
from grainlaw.materials.transversely_isotropic import TransverselyIsotropic

__all__ = ["Cone", "DruckerPrager", "MohrCoulombPlastic", "TransverselyIsotropic"]
