"""
Static fatigue
==============

A bond under a load that it bears for now fails later. One bond by itself, and a specimen of such bonds that creeps to
failure.
"""

import numpy as np
from matplotlib.figure import Figure

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CharlesGrowth, CohesiveCrack, MohrCoulomb, StaticFatigue
from grainlaw.protocols import Creep
from grainlaw.units import GPa, MPa, mm

bond = MohrCoulomb(
    kn=1.05e14,
    ks=9.45e13,
    tensile_strength=13 * MPa,
    cohesion=29 * MPa,
    friction_angle=40,
    residual_friction_angle=20,
)
RATE, EXPONENT = 1e-6, 20
ageing = StaticFatigue(law=bond, rate=RATE, growth=CharlesGrowth(exponent=EXPONENT))


def closed_form(load):
    """Seconds that a bond lasts under a share of its strength (Charles 1958)."""
    return (1 - load ** (EXPONENT - 2)) / ((EXPONENT - 2) * RATE * load**EXPONENT)


def lasts(load, steps=500):
    """The same by holding one contact point."""
    step = 1.2 * closed_form(load) / steps
    held = gl.trace(ageing, np.full(steps, load * 13 * MPa / 1.05e14), 0.0, time_step=step)
    return step * int(np.argmax(held.damage))


loads = np.linspace(0.6, 0.95, 8)
times = np.array([lasts(load) for load in loads])

# %%
# In logarithms the time falls with the slope -20.
figure = Figure(figsize=(6, 4), layout="constrained")
axes = figure.subplots()
line = np.linspace(0.58, 0.97, 100)
axes.loglog(closed_form(line), line, "k-", lw=1, label="closed form")
axes.loglog(times, loads, "o", label="one bond, held")
axes.set(xlabel="time to failure (s)", ylabel="load over strength")
axes.set_yticks([0.6, 0.7, 0.8, 0.9], ["0.6", "0.7", "0.8", "0.9"])
axes.set_yticks([], minor=True)
axes.legend(frameon=False)
figure

# %%
# A specimen under a constant stress. It strains in steps, each the failure of a group of bonds, which follow each other
# ever faster.
soft = CohesiveCrack(
    kn=1.05e14,
    ks=9.45e13,
    tensile_strength=10 * MPa,
    cohesion=25 * MPa,
    friction_angle=25,
    residual_friction_angle=15,
    mode_i_energy=30,
    mode_ii_energy=100,
)
grains = Voronoi(grains=30, seed=1).tessellate(rectangle(20 * mm, 40 * mm))
rock = gl.Specimen(
    grains, gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=2700)
)
test = Creep(load=75 * MPa, duration=1e6, largest_growth=0.1)
result = gl.simulate(rock, StaticFatigue(law=soft, rate=1.0), test, frames=5)
creep = test.curve(result.curves)

picture = Figure(figsize=(6, 4), layout="constrained")
axes = picture.subplots()
axes.semilogx(creep["time"][1:], 1e3 * creep["strain"][1:], "o-", ms=3)
axes.set(xlabel="time (s)", ylabel="axial strain (0.001)")
picture

# %%
# **Check.** The time of one bond, to within a step of the holding.
print(f"at 0.8 of the strength: {lasts(0.8):.3e} s, closed form {closed_form(0.8):.3e} s")
assert np.all(abs(times / closed_form(loads) - 1) < 2 * 1.2 / 500)
