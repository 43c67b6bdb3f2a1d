"""One instance of each exported material, and more where options change the code."""

import numpy as np
from support import ROCK
from toy_materials import CUBIC

from grainlaw.materials import Cone, DruckerPrager, MohrCoulombPlastic, Thermal, TransverselyIsotropic

GRAIN = {"youngs_modulus": 60e9, "poissons_ratio": 0.25, "density": 2700}
SCHIST = TransverselyIsotropic(
    youngs_modulus=60e9, youngs_modulus_across=20e9, poissons_ratio=0.2, poissons_ratio_across=0.1,
    shear_modulus_across=8e9, density=2700, foliation_angle=30,
)  # fmt: skip
CONE = DruckerPrager(**GRAIN, cohesion=30e6, friction_angle=40, dilation_angle=10)
MISES = DruckerPrager(**GRAIN, cohesion=30e6, friction_angle=0)
OUTER = DruckerPrager(**GRAIN, cohesion=30e6, friction_angle=40, dilation_angle=40, cone=Cone.OUTER)
MOHR = MohrCoulombPlastic(**GRAIN, tensile_strength=10e6, cohesion=30e6, friction_angle=40, dilation_angle=10)
CRUSHED = MohrCoulombPlastic(
    **GRAIN, tensile_strength=10e6, cohesion=30e6, friction_angle=40, residual_friction_angle=30, residual_cohesion=5e6,
    softening_strain=1e-2,
)  # fmt: skip
WARM = Thermal(material=ROCK, expansion=8e-6)
CRYSTAL = Thermal(material=MOHR, expansion=14e-6, expansion_along=8e-6, axis_angle=30)
MATERIALS = {
    "elastic": ROCK, "cubic": CUBIC, "schist": SCHIST, "cone": CONE, "mises": MISES, "outer": OUTER, "mohr": MOHR,
    "crushed": CRUSHED, "warm": WARM, "crystal": CRYSTAL,
}  # fmt: skip


def compliance(material):
    """Lekhnitskii's reduced compliance in the axes of the foliation, from textbook formulas: b11, b12, b22, b66."""
    m = material
    between = -m.poissons_ratio_across / m.youngs_modulus_across
    full = np.array([
        [1 / m.youngs_modulus, between, -m.poissons_ratio / m.youngs_modulus],
        [0, 1 / m.youngs_modulus_across, between],
        [0, 0, 1 / m.youngs_modulus],
    ])  # fmt: skip
    full = full + np.triu(full, 1).T
    reduced = full[:2, :2] - np.outer(full[:2, 2], full[2, :2]) / full[2, 2]
    return reduced[0, 0], reduced[0, 1], reduced[1, 1], 1 / m.shear_modulus_across


def compliance_along_y(material, angle):
    """1/Pa, of a pull along y where the trace of the foliation is at an angle (degrees) to x."""
    b11, b12, b22, b66 = compliance(material)
    s, c = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    return b11 * s**4 + (2 * b12 + b66) * s**2 * c**2 + b22 * c**4
