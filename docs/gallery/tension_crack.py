"""
Tension and its crack
=====================

A specimen of cohesive cracks is pulled apart. Bonds soften along one path across it; there it parts.
"""

import numpy as np

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack
from grainlaw.protocols import UniaxialTension
from grainlaw.units import GPa, MPa, mm

grains = Voronoi(grains=60, seed=2).tessellate(rectangle(20 * mm, 40 * mm))
rock = gl.Specimen(
    grains, gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
)
law = CohesiveCrack(
    kn=1.05e14,
    ks=9.45e13,
    tensile_strength=10 * MPa,
    cohesion=25 * MPa,
    friction_angle=40,
    residual_friction_angle=20,
    mode_i_energy=20,
    mode_ii_energy=60,
)
result = gl.simulate(rock, law, UniaxialTension(samples=400), frames=30)
result

# %%
# The curve, and the crack on the deformed specimen at the end.
figure = result.plot()
figure

# %%
# How damage grows at four moments. :func:`grainlaw.plot_cracks` draws on axes of your own.
from matplotlib.figure import Figure

moments = Figure(figsize=(9, 4.5), layout="constrained")
at = np.linspace(0, len(result.frames) - 1, 5)[1:].astype(int)
for axes, frame in zip(moments.subplots(1, 4), at, strict=True):
    gl.plot_cracks(
        result, int(frame), title=f"{1e3 * result.frames[frame].time:.2f} ms", ax=axes
    )
moments

# %%
# **Check.** What a bond takes to break in pure tension is the area below its curve. Take the bonds that broke with
# hardly any slip.
work = gl.characteristics(law).tension.work
opened = result.cracks.mode < 0.02
spent = np.median(result.cracks.spent[opened])
print(
    f"{opened.sum()} of {len(result.cracks)} points broke in tension: {spent:.2f} J/m2 each, by the law {work:.2f} J/m2"
)
assert abs(spent / work - 1) < 0.05
