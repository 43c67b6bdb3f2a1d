"""
Three laws on one sample
========================

The same grains in the same test, under springs that never break, under Mohr-Coulomb, and under a cohesive crack.
"""

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack, Linear, MohrCoulomb
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import GPa, MPa, mm

grains = Voronoi(grains=60, seed=1).tessellate(rectangle(20 * mm, 50 * mm))
rock = gl.Specimen(
    grains, gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
)
stiff = {"kn": 1.05e14, "ks": 9.45e13}
strong = stiff | {
    "tensile_strength": 13 * MPa,
    "cohesion": 29 * MPa,
    "friction_angle": 40,
    "residual_friction_angle": 20,
}
laws = {
    "linear": Linear(**stiff),
    "Mohr-Coulomb": MohrCoulomb(**strong),
    "cohesive crack": CohesiveCrack(**strong, mode_i_energy=15, mode_ii_energy=30),
}
comparison = gl.compare(
    rock, laws, UniaxialCompression(maximum_strain=0.004, samples=300), frames=10
)
comparison

# %%
# The linear law gives the line that the others leave: Mohr-Coulomb at its first break, the cohesive crack gradually,
# because its bonds soften over some micrometres before they part.
curves = gl.plot_curves(comparison)
curves

# %%
# Thin red lines are tensile cracks, thick blue ones shear cracks.
broken = {name: result for name, result in comparison.items() if len(result.cracks)}
cracks = gl.side_by_side(broken)
cracks

# %%
# **Check.** Before anything breaks the two laws with straight springs have the modulus of a static solution.
static = gl.elastic_properties(rock, laws["linear"]).apparent_modulus
for name in ("linear", "Mohr-Coulomb"):
    early = comparison[name].curves["strain"] < 3e-4
    strain, stress = (
        comparison[name].curves[column][early] for column in ("strain", "stress")
    )
    modulus = (stress[-1] - stress[0]) / (strain[-1] - strain[0])
    print(f"{name:12} {modulus / GPa:.3f} GPa, static solution {static / GPa:.3f} GPa")
    assert abs(modulus / static - 1) < 0.005
