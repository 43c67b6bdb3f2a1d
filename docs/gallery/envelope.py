"""
Strength over confinement
=========================

Biaxial tests at several confinements, and the Mohr-Coulomb line through their strengths; beside it the line of the law
that joins the grains.
"""

import tempfile

import numpy as np

import grainlaw as gl
from grainlaw.geometry import Bricks, Voronoi, rectangle
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import BiaxialCompression, DirectShear
from grainlaw.units import GPa, MPa, mm

rock = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
law = MohrCoulomb(
    kn=1.05e14,
    ks=9.45e13,
    tensile_strength=10 * MPa,
    cohesion=25 * MPa,
    friction_angle=35,
    residual_friction_angle=20,
)


def case(confinement, seed):
    grains = Voronoi(grains=80, seed=seed).tessellate(rectangle(20 * mm, 50 * mm))
    test = BiaxialCompression(confinement=confinement, samples=100, maximum_strain=0.004)
    return gl.Run(gl.Specimen(grains, rock), law, test)


study = gl.Study(case, confinement=[0.0, 5 * MPa, 10 * MPa], seed=range(1, 3))
table = study.run(tempfile.mkdtemp())
envelope = gl.StrengthEnvelope(table)
print(envelope)

# %%
# So few grains scatter: the intervals say how little two samples determine.
figure = envelope.plot()
figure

# %%
# **Check.** A joint of the same law, sheared alone, has the law's own line: cohesion and friction angle come back.
joint = gl.Specimen(Bricks(rows=2).tessellate(rectangle(20 * mm, 8 * mm)), rock)
pressure = np.array([2, 6, 10]) * MPa
strength = [
    gl.simulate(joint, law, DirectShear(normal_stress=p), frames=1).summary["strength"]
    for p in pressure
]
slope, cohesion = np.polyfit(pressure, strength, 1)
print(
    f"friction angle {np.degrees(np.arctan(slope)):.2f} degrees, cohesion {cohesion / MPa:.2f} MPa"
)
assert abs(np.degrees(np.arctan(slope)) - 35) < 0.5
assert abs(cohesion / (25 * MPa) - 1) < 0.01
