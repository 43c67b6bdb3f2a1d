"""
Heating a strip of two layers
=============================

Two layers that expand by different amounts bend each other. Timoshenko's closed form of 1925 says by how much.
"""

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

import grainlaw as gl
from grainlaw.geometry import from_polygons
from grainlaw.laws import Linear
from grainlaw.materials import Thermal
from grainlaw.protocols import Heating
from grainlaw.units import GPa, mm

LENGTH, WIDTH, ROWS, HOT = 40 * mm, 4 * mm, 20, 120
NU, ALPHA = 0.25, 8e-6
left = Thermal(
    material=gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=NU, density=2700),
    expansion=ALPHA,
)
right = Thermal(
    material=gl.Elastic(youngs_modulus=120 * GPa, poissons_ratio=NU, density=2700),
    expansion=2 * ALPHA,
)

y = np.linspace(0, LENGTH, ROWS + 1)
sides = ((0.0, WIDTH / 2, "left"), (WIDTH / 2, WIDTH, "right"))
cells = [
    [(a, y[k]), (b, y[k]), (b, y[k + 1]), (a, y[k + 1])]
    for a, b, _ in sides
    for k in range(ROWS)
]
strip = from_polygons(cells, [name for _, _, name in sides for _ in range(ROWS)])
specimen = gl.Specimen(strip, {"left": left, "right": right}, refinement=2)
heating = Heating(to=HOT, samples=10, loading=gl.HeatingRate(rate=2e7))
result = gl.simulate(specimen, Linear(kn=1e16, ks=1e16), heating, frames=2)

# %%
# Displacements are drawn ten times as large.
moved = result.frames[-1].displacement
triangles = (result.mesh.nodes + 10 * moved)[result.mesh.zones] / mm
middle = result.mesh.nodes[result.mesh.zones].mean(axis=1)[:, 0] > WIDTH / 2

figure = Figure(figsize=(3, 6), layout="constrained")
axes = figure.subplots()
axes.add_collection(
    PolyCollection(
        triangles, facecolor=np.where(middle, "#ee7733", "#0077bb"), edgecolor="w", lw=0.2
    )
)
axes.autoscale_view()
axes.set(aspect="equal", xlabel="x (mm)", ylabel="y (mm)")
figure

# %%
# **Check.** The curvature in the middle half. In plane strain the expansions are :math:`1+\nu` times those of a beam.
nodes = result.mesh.nodes
line = (abs(nodes[:, 1] - LENGTH / 2) < LENGTH / 4) & (nodes[:, 0] < 1e-9)
curvature = abs(2 * np.polyfit(nodes[line, 1], moved[line, 0], 2)[0])
m, n = 1.0, 0.5  # equal thickness; half the modulus
shape = 3 * (1 + m) ** 2 + (1 + m * n) * (m**2 + 1 / (m * n))
theory = 6 * ALPHA * (1 + NU) * (HOT - 20) * (1 + m) ** 2 / (WIDTH * shape)
print(
    f"curvature {curvature:.4f} 1/m, Timoshenko {theory:.4f} 1/m, {100 * (curvature / theory - 1):+.1f} %"
)
assert abs(curvature / theory - 1) < 0.03
