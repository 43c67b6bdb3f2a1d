"""Materials as a user writes them: a cubic crystal, and one that yields in shear."""

import attrs
import numpy as np
from support import ROCK

import grainlaw as gl


@attrs.frozen(kw_only=True)
class Cubic(gl.Material):
    """Three constants, axes along those of the specimen."""

    c11: float = gl.parameter("Pa")
    c12: float = gl.parameter("Pa")
    c44: float = gl.parameter("Pa")
    density: float = gl.parameter("kg/m3")
    stiffness = property(lambda self: ((self.c11, self.c12, 0), (self.c12, self.c11, 0), (0, 0, self.c44)))

    def stress(self, exx, eyy, exy):
        return self.c11 * exx + self.c12 * eyy, self.c12 * exx + self.c11 * eyy, 2 * self.c44 * exy

    def energy(self, exx, eyy, exy):
        sxx, syy, sxy = self.stress(exx, eyy, exy)
        return 0.5 * (sxx * exx + syy * eyy) + sxy * exy


@attrs.frozen(kw_only=True)
class Yielding(Cubic):
    """Its shear stress is limited."""

    strength: float = gl.parameter("Pa")

    def stress(self, exx, eyy, exy, plastic_strain):
        trial = 2 * self.c44 * (exy - plastic_strain)
        shear = min(max(trial, -self.strength), self.strength)
        plastic_strain = plastic_strain + (trial - shear) / (2 * self.c44)
        return self.c11 * exx + self.c12 * eyy, self.c12 * exx + self.c11 * eyy, shear, plastic_strain

    def energy(self, exx, eyy, exy, plastic_strain):
        return 0.5 * self.c11 * (exx**2 + eyy**2) + self.c12 * exx * eyy + 2 * self.c44 * (exy - plastic_strain) ** 2


along, across, shear = ROCK.constants
ALIKE = Cubic(c11=along, c12=across, c44=shear, density=3100)  #: the same as ROCK
CUBIC = Cubic(c11=90e9, c12=10e9, c44=5e9, density=3100)  #: far from isotropic
YIELDING = Yielding(c11=along, c12=across, c44=shear, density=3100, strength=1e5)


def each_its_own(material, name, count):
    """The material with another number in each of ``count`` grains."""
    values = getattr(material, name) * np.random.default_rng(1).uniform(0.7, 1, count)
    return attrs.evolve(material, **{name: values})
