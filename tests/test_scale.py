"""A specimen of any size, of any unit of stress, does the same: scaled by a power of two, to the last bit."""

import attrs
import numpy as np
import pytest

import grainlaw as gl
from grainlaw.compiler.batch import compile_law
from grainlaw.engine.model import broken_memory
from grainlaw.geometry import Bricks, Voronoi, rectangle
from grainlaw.laws import (
    BandisClosure,
    BartonBandis,
    CohesiveCrack,
    Linear,
    MunjizaJoint,
)
from grainlaw.protocols import DirectShear, UniaxialCompression
from grainlaw.units import GPa, MPa, mm, um

#: How lengths and stresses scale; what has neither in its unit does not.
SIZES = {"cracks": (0, 0), "energy": (2, 1), "vibration": (2, 1), "time": (1, 0), "displacement": (1, 0),
         "dilation": (1, 0),
         "opening": (1, 0), "slip": (1, 0), "normal": (0, 1), "shear": (0, 1), "stress": (0, 1)}  # fmt: skip


def stiff(length, stress):
    return {"kn": 1.05e14 * stress / length, "ks": 9.45e13 * stress / length}


def crack(length, stress, **options):
    """Tough enough to break between a micrometre and a decimetre, by its size."""
    return CohesiveCrack(**stiff(length, stress), tensile_strength=13 * MPa * stress, cohesion=29 * MPa * stress,
                         friction_angle=54, residual_friction_angle=5, mode_i_energy=150 * stress * length,
                         mode_ii_energy=300 * stress * length, **options)  # fmt: skip


def specimen(grains, stress):
    material = gl.Elastic(youngs_modulus=60 * GPa * stress, poissons_ratio=0.25, density=3100 * stress)
    return gl.Specimen(grains, material)


def crushed(length, stress):
    """Breaks, hands bonds over, and closes on stiffening contacts."""
    grains = Voronoi(grains=40, seed=1).tessellate(rectangle(20 * mm * length, 40 * mm * length))
    law = crack(length, stress, closure=BandisClosure(maximum_closure=50 * um * length))
    test = UniaxialCompression(loading=gl.Constant(speed=3.0), maximum_strain=0.03, samples=30, stop_fraction=0)
    return gl.simulate(specimen(grains, stress), law, test)


def sheared(length, stress):
    """A rough joint, which lifts and stiffens."""
    grains = Bricks(rows=2).tessellate(rectangle(40 * mm * length, 20 * mm * length))
    closure = BandisClosure(maximum_closure=5 * um * length)
    law = BartonBandis(**stiff(length, stress), friction_angle=40, dilation_angle=15, closure=closure)
    test = DirectShear(normal_stress=5 * MPa * stress, loading=gl.Constant(speed=0.5), ramp=5e-5 * length,
                       maximum_slip=0.2 * mm * length, resolution=0.02 * mm * length)  # fmt: skip
    return gl.simulate(specimen(grains, stress), law, test)


def factor(column, length, stress):
    m, pa = next((size for name, size in SIZES.items() if name in column), (0, 0))
    return length**m * stress**pa


@pytest.mark.parametrize("run", [crushed, sheared])
@pytest.mark.alone
def test_a_scaled_run_is_the_same_run(run):
    first = run(1.0, 1.0)
    if run is crushed:
        assert len(first.frames[-1].contacts["length"]) > 0
        assert len(first.cracks) > 20
    for length, stress in ((2.0**10, 1.0), (2.0**20, 1.0), (2.0**-44, 1.0), (1.0, 2.0**10), (2.0**-10, 2.0**-10)):
        second = run(length, stress)
        assert first.curves.keys() == second.curves.keys()
        for name, values in first.curves.items():
            np.testing.assert_array_equal(values * factor(name, length, stress), second.curves[name], err_msg=name)
        for one, other in zip(first.frames, second.frames, strict=True):
            np.testing.assert_array_equal(one.displacement * length, other.displacement)


FREE = {"tensile_strength": 13 * MPa, "cohesion": 0.0, "friction_angle": 0, "residual_friction_angle": 0}


def without_strength(kind, length):
    return kind(**stiff(length, 1.0), **FREE, mode_i_energy=150 * length, mode_ii_energy=300 * length)


@pytest.mark.parametrize("kind", [CohesiveCrack, MunjizaJoint])
def test_no_strength_is_none_at_any_size(kind):
    slip = np.array([0, 1e-8, 1e-6, 1e-4, -1e-6])
    small = gl.trace(without_strength(kind, 1.0), 0, slip)
    large = gl.trace(without_strength(kind, 2.0**20), 0, slip * 2.0**20)
    for name in ("shear", *small.memory):
        if name != "anchor":
            np.testing.assert_array_equal(getattr(small, name), getattr(large, name), err_msg=name)


@attrs.frozen(kw_only=True)
class Fades(gl.ContactLaw):
    """Its damage tends to 1, and an opening of astronomers is too much for it."""

    k: float = gl.parameter("Pa/m", default=1e14)
    reach: float = gl.parameter("m", default=1e-6)
    stiffness = property(lambda self: (self.k, self.k))

    def traction(self, opening, slip, damage):
        x = max(opening, 0.0) / self.reach
        damage = max(damage, x**60 / (1 + x**60))
        return (1 - damage if opening > 0 else 1.0) * self.k * opening, self.k * slip, damage


def test_a_contact_counts_as_broken_where_its_law_breaks():
    for length in (2.0**-20, 1.0, 2.0**20, 2.0**30):
        law = compile_law(crack(length, 1.0))
        assert broken_memory(law)[law.memory.index("damage")] == 1
    assert np.isfinite(broken_memory(compile_law(Fades()))).all()
    assert broken_memory(compile_law(Linear(kn=1e14, ks=1e14))) == [0]
