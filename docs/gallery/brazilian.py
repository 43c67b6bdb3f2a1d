"""
Brazilian disc
==============

A disc with two flat ends is pressed until it splits. The tension in its middle follows from the load.
"""

import numpy as np

import grainlaw as gl
from grainlaw.geometry import Voronoi, disc
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import Brazilian
from grainlaw.units import GPa, MPa, mm

grains = Voronoi(grains=120, seed=1).tessellate(disc(50 * mm, loaded=20))
rock = gl.Specimen(
    grains, gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
)
law = MohrCoulomb(
    kn=1e15,
    ks=5e14,
    tensile_strength=10 * MPa,
    cohesion=40 * MPa,
    friction_angle=40,
    residual_friction_angle=20,
)
result = gl.simulate(rock, law, Brazilian(shape_factor=0.9644), frames=20)
result

# %%
# The crack runs along the loaded diameter.
figure = gl.plot_cracks(result)
figure

# %%
# Tension in the middle over the load, and theory: 0.9644 times :math:`2P/\pi D` for flat ends of 20 degrees (Wang and
# others 2004). The few grains near the centre carry less than an even disc would; more grains come nearer.
from matplotlib.figure import Figure

curves = result.curves
force, middle = curves["force"], curves["middle_across"]
picture = Figure(figsize=(5.5, 4), layout="constrained")
axes = picture.subplots()
axes.plot(force / 1e3, middle / MPa, label="mean of the grains in the middle")
axes.plot(
    force / 1e3,
    0.9644 * 2 * force / (np.pi * 50 * mm) / MPa,
    "k--",
    lw=1,
    label="even disc",
)
axes.set(xlabel="load (kN/m)", ylabel="tension across the loaded diameter (MPa)")
axes.legend(frameon=False)
picture

# %%
# **Check.** What holds for any grains: the mean stress of the whole disc along the load is load times height over area.
# A recorded load is the mean of its sample, so it belongs to the middle of the sample.
bounds = grains.region.bounds
time = curves["time"] - np.diff(curves["time"], prepend=0.0) / 2
number, frame = next(
    (k, each)
    for k, each in enumerate(result.frames)
    if np.interp(each.time, time, force) > force.max() / 4
)
along = gl.mean_stress(result, gl.within_rectangle(*bounds), number)[1]
load = np.interp(frame.time, time, force)
expected = -load * np.ptp(bounds[:, 1]) / grains.areas.sum()
print(
    f"mean stress along the load {along / MPa:.4f} MPa, from the load {expected / MPa:.4f} MPa"
)
assert abs(along / expected - 1) < 5e-3
