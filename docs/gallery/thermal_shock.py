"""
Thermal shock of a disc
=======================

A hot disc of granite is quenched at its rim. What cools shrinks around what is still
hot, and is torn.
"""

import numpy as np
from scipy.special import jn_zeros

import grainlaw as gl
from grainlaw.geometry import Voronoi, disc
from grainlaw.laws import CohesiveCrack
from grainlaw.materials import Thermal
from grainlaw.protocols import ThermalShock
from grainlaw.units import GPa, MPa, mm

elastic = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=2650)
granite = Thermal(material=elastic, expansion=8e-6, conductivity=3.0, heat_capacity=800.0)
bond = CohesiveCrack(
    kn=4e14, ks=3.6e14, tensile_strength=10 * MPa, cohesion=40 * MPa, friction_angle=40,
    residual_friction_angle=30, mode_i_energy=10, mode_ii_energy=100,
)  # fmt: skip
radius, duration = 15 * mm, 5.0
specimen = gl.Specimen(Voronoi(grains=500, seed=1).tessellate(disc(2 * radius)), granite)
test = ThermalShock(hot=120, bath=20, duration=duration)
result = gl.simulate(specimen, bond, test, frames=4)

# %%
# The temperature at the end, and the cracks: they begin at the rim and run inwards.
temperature = gl.plot_field(result, "temperature")
temperature

# %%
cracks = gl.plot_cracks(result)
cracks

# %%
# **Check.** The mean temperature over the disc follows the series for a cylinder whose surface comes to another
# temperature at once (Carslaw and Jaeger 1959): cracks along the flow of heat hardly hinder it.
zeros = jn_zeros(0, 200)
time = (duration * 3.0 / (2650 * 800.0)) / radius**2
expected = 20 + 100 * np.sum(4 / zeros**2 * np.exp(-(zeros**2) * time))
found = result.curves["temperature"][-1]
print(f"mean temperature {found:.1f} °C, of the series {expected:.1f} °C")
assert abs(found - expected) < 2
