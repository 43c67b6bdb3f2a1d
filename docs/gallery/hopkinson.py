"""
Split Hopkinson bar
===================

A wave comes along a steel bar, meets a piece of rock, and goes on in a second bar. The bars are ends of bars that are
not meshed.
"""

import numpy as np
from matplotlib.figure import Figure

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack, Linear
from grainlaw.protocols import SplitHopkinson
from grainlaw.units import GPa, MPa, mm

grains = Voronoi(grains=120, seed=1).tessellate(rectangle(20 * mm, 20 * mm))
rock = gl.Specimen(
    grains, gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=2700)
)
law = CohesiveCrack(
    kn=3e14,
    ks=3e14,
    tensile_strength=12 * MPa,
    cohesion=30 * MPa,
    friction_angle=40,
    residual_friction_angle=20,
    mode_i_energy=20,
    mode_ii_energy=100,
)
struck = gl.simulate(
    rock, law, SplitHopkinson(wave=gl.pulse(-250 * MPa, rise=100e-6)), frames=20
)
struck

# %%
# The stress that the specimen bears is that of the wave in the second bar, as long as the forces on both ends are
# equal.
curves = struck.curves
picture = Figure(figsize=(6, 4), layout="constrained")
axes = picture.subplots()
for name in ("incident", "reflected", "transmitted"):
    axes.plot(curves["time"] * 1e6, curves[name] / MPa, label=name)
axes.set(xlabel="time (µs)", ylabel="stress of the wave (MPa)")
axes.legend(frameon=False)
picture

# %%
# What is left of the specimen.
figure = gl.plot_cracks(struck)
figure

# %%
# **Check.** A specimen that does not break comes, passage by passage, under the stress of the wave itself, whatever its
# impedance: in a step of ten passages nothing but the last of its vibration is left.
step = gl.TimeSeries([0, 10e-6], [0, -50 * MPa])
unbroken = gl.simulate(
    rock, Linear(kn=3e14, ks=3e14), SplitHopkinson(wave=step, duration=150e-6), frames=1
)
late = unbroken.curves["time"] > 100e-6
stress = np.mean(unbroken.curves["stress"][late])
print(f"stress {stress / MPa:.2f} MPa, of the wave 50 MPa")
assert abs(stress / (50 * MPa) - 1) < 0.01
