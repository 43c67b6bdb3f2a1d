"""
A foliated rock at all angles
=============================

Grains of a transversely isotropic material, all foliated in one direction, and each in its own.
"""

import numpy as np
from matplotlib.figure import Figure

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import Linear
from grainlaw.materials import TransverselyIsotropic
from grainlaw.units import GPa, mm

E, ACROSS, NU, NU_ACROSS, SHEAR = 60 * GPa, 25 * GPa, 0.2, 0.15, 7 * GPa
grains = Voronoi(grains=60, seed=1).tessellate(rectangle(20 * mm, 40 * mm))
stiff = Linear(kn=1e18, ks=1e18)  # bonds so stiff that the rock is its grains


def modulus(angle):
    """Of a column loaded along y that may shear freely; ``angle`` is that of the foliation, in degrees from x."""
    schist = TransverselyIsotropic(
        youngs_modulus=E,
        youngs_modulus_across=ACROSS,
        poissons_ratio=NU,
        poissons_ratio_across=NU_ACROSS,
        shear_modulus_across=SHEAR,
        density=2700,
        foliation_angle=angle,
    )
    found = gl.elastic_properties(gl.Specimen(grains, schist), stiff)
    return 1 / np.linalg.inv(found.stiffness)[1, 1]


def closed_form(degrees):
    """Lekhnitskii: the compliance along y, turned, and reduced to plane strain."""
    along, across = (1 - NU**2) / E, 1 / ACROSS - NU_ACROSS**2 * E / ACROSS**2
    between = -NU_ACROSS / ACROSS * (1 + NU)
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return 1 / (along * s**4 + across * c**4 + (2 * between + 1 / SHEAR) * s**2 * c**2)


angles = np.arange(0, 91, 15.0)
found = np.array([modulus(angle) for angle in angles])
random = modulus(np.random.default_rng(1).uniform(0, 180, grains.count))

# %%
# The softest direction is neither along nor across the foliation. Grains foliated at random give one modulus between
# the extremes.
figure = Figure(figsize=(6, 4), layout="constrained")
axes = figure.subplots()
line = np.linspace(0, 90, 181)
axes.plot(line, closed_form(line) / GPa, "k-", lw=1, label="closed form")
axes.plot(angles, found / GPa, "o", label="all grains foliated at this angle")
axes.axhline(random / GPa, ls="--", color="0.5", label="each grain at an angle of its own")
axes.set(
    xlabel="angle of the foliation to the end faces (degrees)",
    ylabel="modulus along the axis (GPa)",
)
axes.legend(frameon=False)
figure

# %%
# **Check.**
error = abs(found / closed_form(angles) - 1).max()
print(f"largest difference from the closed form {error:.1e}")
assert error < 2e-3
