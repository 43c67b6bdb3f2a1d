"""
Tunnel in a rock under stress
=============================

A tunnel is excavated in a rock that is under stress. Arrows show where the rock moves, crosses the principal stresses.
"""

import numpy as np

import grainlaw as gl
from grainlaw.geometry import Graded, Laguerre, plate_with_hole
from grainlaw.laws import Linear
from grainlaw.protocols import Excavation
from grainlaw.units import GPa, MPa, mm

radius = 10 * mm
angle = np.linspace(0, 2 * np.pi, 65)
rim = radius * np.column_stack([np.cos(angle), np.sin(angle)])
fine_at_rim = Graded(place=rim, size=0.4 * radius, growth=0.3, largest=1.5 * radius)
region = plate_with_hole(20 * radius, 20 * radius, 2 * radius, sides=24)
elastic = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
rock = gl.Specimen(Laguerre(grain_size=fine_at_rim, seed=1).tessellate(region), elastic)
law = Linear(kn=3e15, ks=3e15)
result = gl.simulate(
    rock, law, Excavation(xx=-10 * MPa, yy=-20 * MPa), detection=None, frames=4
)
result

# %%
# What the test shows by itself: the opening becomes lower and, since the rock is pressed more along y, hardly narrower.
figure = result.plot()
figure

# %%
# Displacements since the excavation began: those by which the rock came under its stress are left out.
moved = gl.plot_field(result, "displacement", since="excavate", vectors=True)
moved.axes[0].set(xlim=(-40, 40), ylim=(-40, 40))
moved

# %%
# The smaller principal stress is the largest pressure, three times the larger stress less the smaller one at the sides.
pressed = gl.plot_field(result, "stress_2", vectors=True)
pressed.axes[0].set(xlim=(-40, 40), ylim=(-40, 40))
pressed

# %%
# **Check.** Displacements of the nodes at the rim, against Kirsch (1898) in plane strain: the rim moves outwards by
# :math:`(1 + \nu) a / E \, (m + (3 - 4\nu)\, d \cos 2\theta)`, with half of the sum and of the difference of both
# stresses, :math:`m` and :math:`d`. The frame has the places of its nodes.
last = result.frames[-1]
before = next(each for each in reversed(result.frames) if each.stage != "excavate")
nodes = last.to_pandas("nodes") - before.to_pandas("nodes").assign(x=0, y=0)
nodes = nodes.iloc[rock.mesh.boundaries["hole"]]
theta = np.arctan2(nodes["y"], nodes["x"])
outwards = nodes["displacement_x"] * np.cos(theta) + nodes["displacement_y"] * np.sin(theta)
mean, half = -15 * MPa, 5 * MPa
kirsch = 1.25 / (60 * GPa) * radius * (mean + (3 - 4 * 0.25) * half * np.cos(2 * theta))
error = np.sqrt(np.mean((outwards - kirsch) ** 2) / np.mean(kirsch**2))
print(f"displacements of the rim differ from Kirsch by {100 * error:.1f} %")
assert error < 0.1
