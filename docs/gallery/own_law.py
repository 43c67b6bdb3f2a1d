"""
A contact law of your own
=========================

Linear tension softening after Hillerborg, for one contact point and in scalars. The framework compiles it, and
checks it as it checks its own laws.
"""

import attrs
import numpy as np

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.protocols import UniaxialTension
from grainlaw.units import GPa, MPa, mm, um


@attrs.frozen(kw_only=True)
class Hillerborg(gl.ContactLaw):
    """Linear tension softening over the fracture energy; elastic in shear."""

    kn: float = gl.parameter("Pa/m")
    ks: float = gl.parameter("Pa/m")
    strength: float = gl.parameter("Pa")
    energy: float = gl.parameter("J/m2")
    stiffness = property(lambda self: (self.kn, self.ks))

    def traction(self, opening, slip, damage, widest):
        peak, last = self.strength / self.kn, 2 * self.energy / self.strength
        widest = max(widest, opening, peak)
        damage = min((widest - peak) / (last - peak), 1.0)
        secant = self.strength * (1 - damage) / widest
        return (
            (secant if opening > 0 else self.kn) * opening,
            self.ks * slip,
            damage,
            widest,
        )


law = Hillerborg(kn=1.05e14, ks=9.45e13, strength=13 * MPa, energy=50)

# %%
# Pull it, let go in between, and pull until it has broken: the secant leads back to the origin.
opening = (
    np.concatenate(
        [np.linspace(0, 3, 301), np.linspace(3, 0, 301), np.linspace(0, 10, 1001)]
    )
    * um
)
pulled = gl.trace(law, opening, slip=0)
curve = pulled.plot()
curve

# %%
# The kit of checks asks it what makes a law comparable and safe to run.
report = gl.check_law(law)
print(report)
assert report.passed

# %%
# In a specimen. It is compiled once; other numbers need no second compilation.
grains = Voronoi(grains=40, seed=1).tessellate(rectangle(20 * mm, 40 * mm))
rock = gl.Specimen(
    grains, gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
)
result = gl.simulate(rock, law, UniaxialTension(samples=300), frames=10)
figure = result.plot()
figure

# %%
# **Check.** The work to break it is the fracture energy.
print(f"work {pulled.work[-1]:.3f} J/m2, fracture energy {law.energy:.3f} J/m2")
assert abs(pulled.work[-1] / law.energy - 1) < 1e-3
