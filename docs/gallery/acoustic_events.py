"""
Events and their mechanisms
===========================

A small specimen is pressed until it fails. Contact points that break together are an acoustic event; its moment tensor
says whether a crack opened or slipped.
"""

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import GPa, MPa, mm

elastic = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=2700)
rock = gl.Specimen(
    Voronoi(grains=150, seed=1).tessellate(rectangle(20 * mm, 40 * mm)), elastic
)
law = CohesiveCrack(
    kn=1.05e14,
    ks=9.45e13,
    tensile_strength=10 * MPa,
    cohesion=25 * MPa,
    friction_angle=40,
    residual_friction_angle=20,
    mode_i_energy=5,
    mode_ii_energy=50,
)
press = UniaxialCompression(samples=2000, loading=gl.Constant(speed=0.05))
result = gl.simulate(rock, law, press, frames=2)
events = gl.acoustic_events(result)
events

# %%
# Each event on the specimen, by its mechanism, with both planes that a crack with its source can have.
places = result.laboratory.plot("events")
places

# %%
# Over the test: all of them come with the failure, and most are cracks that open.
over_time = result.laboratory.plot("mechanisms")
over_time

# %%
# **Check.** What the events radiated is what went into motion: kinetic energy, and what the damping took.
motion = result.curves["energy_kinetic"][-1] + result.curves["energy_damping"][-1]
radiated = events.radiated.sum()
print(f"{len(events)} events radiated {radiated:.3g} J/m of {motion:.3g} J/m")
assert 0.9 < radiated / motion < 1 + 1e-9
