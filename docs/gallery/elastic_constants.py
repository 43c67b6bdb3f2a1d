"""
Elastic constants without a test
================================

Springs between grains make a rock softer than its grains. A static solution tells by how much in a fraction of a
second; a test gives the same.
"""

import numpy as np
from matplotlib.figure import Figure

import grainlaw as gl
from grainlaw.geometry import Bricks, Voronoi, rectangle
from grainlaw.laws import Linear
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import GPa, mm

grain = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
region = rectangle(20 * mm, 40 * mm)
bricks = gl.Specimen(Bricks(rows=8).tessellate(region), grain)
voronoi = gl.Specimen(Voronoi(grains=60, seed=1).tessellate(region), grain)
print(gl.elastic_properties(voronoi, Linear(kn=1e14, ks=5e13)))

# %%
# The modulus over the normal stiffness of the bonds. Bricks stand one on the other, so that theirs is a row of springs:
# the grain, with :math:`E/(1-\nu^2)` in plane strain, and seven joints on the height.
kn = np.logspace(13, 16, 13)
found = {
    name: np.array(
        [gl.elastic_properties(each, Linear(kn=k, ks=k / 2)).apparent_modulus for k in kn]
    )
    for name, each in (("bricks", bricks), ("Voronoi grains", voronoi))
}
closed = 1 / ((1 - 0.25**2) / (60 * GPa) + 7 / (kn * 40 * mm))

figure = Figure(figsize=(6, 4), layout="constrained")
axes = figure.subplots()
axes.semilogx(kn, closed / GPa, "k-", lw=1, label="springs in a row")
axes.semilogx(kn, found["bricks"] / GPa, "o", mfc="none", label="bricks")
axes.semilogx(kn, found["Voronoi grains"] / GPa, "s-", lw=1, label="Voronoi grains")
axes.set(xlabel="normal stiffness (Pa/m)", ylabel="modulus in plane strain (GPa)")
axes.legend(frameon=False)
figure

# %%
# **Check.** The bricks meet the closed form, and a test of the Voronoi grains has the slope of their static solution.
print(f"largest difference {abs(found['bricks'] / closed - 1).max():.1e}")
assert abs(found["bricks"] / closed - 1).max() < 1e-6

law = Linear(kn=1e14, ks=5e13)
test = UniaxialCompression(maximum_strain=5e-4, samples=50)
curves = gl.simulate(voronoi, law, test, frames=1).curves
slope = np.polyfit(curves["strain"], curves["stress"], 1)[0]
static = gl.elastic_properties(voronoi, law).apparent_modulus
print(f"test {slope / GPa:.3f} GPa, static solution {static / GPa:.3f} GPa")
assert abs(slope / static - 1) < 2e-3
