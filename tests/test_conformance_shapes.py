"""The kit passes published laws with a level peak or bent from the start, and no law that hides behind such a shape."""

import attrs
import pytest
from published_laws import Dugdale, Hyperbolic, Needleman, Trapezoid

import grainlaw as gl
from grainlaw.laws import Linear

SHAPES = [
    Trapezoid(),
    Trapezoid(first=0.15),  # as in the paper
    Trapezoid(first=0.001, second=0.99, strength=3e6),
    Dugdale(),
    Dugdale(energy=2000),
    Needleman(),
    Hyperbolic(),
    Hyperbolic(strength=50e6),
]


@pytest.mark.thorough
@pytest.mark.parametrize("law", SHAPES, ids=lambda law: type(law).__name__)
def test_a_published_shape_passes(law):
    report = gl.check_law(law)
    assert report.passed, str(report)


@pytest.mark.thorough
@pytest.mark.parametrize("strength", [f * 1e6 for f in (9.7, 10, 11.3, 12, 13, 14.9, 16, 17)])
def test_the_work_under_a_level_peak_is_whole_wherever_it_is_sampled(strength):
    """It begins where a rounded secant times a rounded opening comes out largest, or does not."""
    assert gl.check_law(Dugdale(strength=strength), compiled=False)["fracture energies"].passed
    found = gl.characteristics(Trapezoid(strength=strength))
    area = strength * 8e-6 * (0.4875 + 0.25)  # level, then a triangle
    assert found.tension.work_after_peak == pytest.approx(area, rel=1e-5)
    assert found.shear[0].work_after_peak == pytest.approx(area, rel=1e-5)


class ShortPlateau(Trapezoid):
    """Its level part ends 1 % of the energy too early."""

    def traction(self, opening, slip, damage, widest):
        return attrs.evolve(self, second=0.5 - 0.01 * 2 * 0.7375).before(opening, slip, damage, widest)

    before = Trapezoid.traction


class Promises(Dugdale):
    """Declares 1 % more than the area under its level stress."""

    fracture_energies = property(lambda self: {"mode_i": 1.01 * self.energy})


class NeverBreaks(Hyperbolic):
    """Promises an energy, and holds for ever."""

    fracture_energies = property(lambda self: {"mode_ii": 50.0})


@pytest.mark.thorough
def test_a_level_peak_hides_no_missing_energy():
    found = gl.check_law(ShortPlateau(), compiled=False)["fracture energies"]
    assert not found.passed
    assert found.size == pytest.approx(0.01, rel=1e-3)
    found = gl.check_law(Promises(), compiled=False)["fracture energies"]
    assert not found.passed
    assert found.size == pytest.approx(1 - 1 / 1.01, rel=1e-3)
    assert "mode_ii: no peak and break" in str(gl.check_law(NeverBreaks(), compiled=False)["fracture energies"])


@attrs.frozen(kw_only=True)
class Bent(gl.ContactLaw):
    """Its secant falls from ``ratio`` times what it declares with a power of the slip; secant unloading."""

    k: float = gl.parameter("Pa/m", default=1e14)
    ratio: float = gl.parameter("1", default=1.0)
    power: float = gl.parameter("1", default=0.5)
    reach: float = gl.parameter("m", default=1e-4)
    stiffness = property(lambda self: (self.k, self.k))

    def traction(self, opening, slip, longest):
        longest = min(max(longest, abs(slip)), self.reach)
        return self.k * opening, self.ratio * self.k * slip * (1 - 0.3 * (longest / self.reach) ** self.power), longest


class Ramps(Linear):
    """Stiffens by a fifth from a ten-thousandth of its reach on."""

    def traction(self, opening, slip):
        return self.kn * opening + 0.2 * self.kn * max(opening - 1e-10, 0.0), self.ks * slip


def stiffness_of(law):
    return gl.check_law(law, compiled=False)["stiffness"]


@pytest.mark.parametrize("power", [0.3, 0.5, 1.0, 2.0])
def test_a_stiffness_may_be_a_limit(power):
    assert stiffness_of(Bent(power=power)).passed


@pytest.mark.parametrize("power", [0.3, 1.0])
@pytest.mark.parametrize("ratio", [1.001, 0.999])
def test_a_limit_that_is_another_is_caught(power, ratio):
    found = stiffness_of(Bent(power=power, ratio=ratio))
    assert not found.passed
    assert found.size == pytest.approx(0.001, rel=0.2)


def test_a_law_that_stiffens_nearby_is_caught():
    found = stiffness_of(Ramps(kn=1e14, ks=1e14))
    assert not found.passed
    assert found.size == pytest.approx(0.2)
    assert "normal response rises by 1.2e+14 Pa/m at" in found.found


@attrs.frozen(kw_only=True)
class Hertz(gl.ContactLaw):
    """Hertz (1881): a closure without stiffness at the origin, which no declared number fits."""

    kn: float = gl.parameter("Pa/m", default=1e14)
    reach: float = gl.parameter("m", default=1e-6)
    stiffness = property(lambda self: (self.kn, self.kn))

    def traction(self, opening, slip):
        closed = max(-opening, 0.0)
        return -self.kn * closed * (closed / self.reach) ** 0.5, self.kn * slip


@pytest.mark.thorough
def test_a_law_without_a_first_tangent_may_say_so():
    @attrs.frozen(kw_only=True)
    class Excused(Hertz):
        exceptions = property(lambda self: {"stiffness": "none at the origin"})

    assert not stiffness_of(Hertz()).passed
    found = stiffness_of(Excused())
    assert found.passed
    assert found.size == pytest.approx(1, abs=1e-3)
    assert str(found).startswith("stiffness          exception  declared: none at the origin; normal response ")
