"""
A study with seeds
==================

One sample says little. Two laws on the same eight samples: is one of them stronger?
"""

import tempfile

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack, MohrCoulomb
from grainlaw.protocols import UniaxialTension
from grainlaw.units import GPa, MPa, mm

rock = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
even = {
    "kn": 1.05e14,
    "ks": 9.45e13,
    "tensile_strength": 13 * MPa,
    "cohesion": 29 * MPa,
    "friction_angle": 40,
    "residual_friction_angle": 20,
}
laws = {
    "Mohr-Coulomb": MohrCoulomb(**even),
    "cohesive crack": CohesiveCrack(**even, mode_i_energy=5, mode_ii_energy=10),
}
pull = UniaxialTension(maximum_strain=6e-4)


def case(law, seed):
    grains = Voronoi(grains=20, seed=seed).tessellate(rectangle(20 * mm, 40 * mm))
    return gl.Run(gl.Specimen(grains, rock), laws[law], pull)


table = gl.Study(case, law=list(laws), seed=range(1, 9)).run(tempfile.mkdtemp())
table

# %%
# The strengths of one sample are joined by a line: the samples are the same under both laws.
figure = table.plot_paired("strength", "law")
figure

# %%
# Their difference, with its interval of confidence. Pairs know more than two groups would.
difference = table.paired("law")["strength"]
print(difference)

# %%
# **Check.** The interval is that of Student's paired t.
from scipy.stats import ttest_1samp

strength = {law: table.where(law=law)["strength"] for law in laws}
change = strength["cohesive crack"] - strength["Mohr-Coulomb"]
low, high = ttest_1samp(change, 0).confidence_interval()
print(
    f"{change.mean() / MPa:.3f} MPa, 95 % between {low / MPa:.3f} and {high / MPa:.3f} MPa"
)
assert abs(difference[0].interval[0] / low - 1) < 1e-9
