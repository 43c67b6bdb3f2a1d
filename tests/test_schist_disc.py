"""The stress in a disc of foliated rock, pressed over two arcs, against Lekhnitskii's solution."""

import attrs
import numpy as np
import pytest

import grainlaw as gl
from grainlaw.geometry import Voronoi, disc
from grainlaw.laws import Linear
from grainlaw.materials import TransverselyIsotropic
from grainlaw.units import GPa, MPa, mm

DIAMETER, ARC, PRESSURE = 50 * mm, 10, 10 * MPa
SCHIST = TransverselyIsotropic(
    youngs_modulus=60 * GPa, youngs_modulus_across=20 * GPa, poissons_ratio=0.2, poissons_ratio_across=0.15,
    shear_modulus_across=10 * GPa, density=2700,
)  # fmt: skip
GLUE = Linear(kn=1e16, ks=1e16)  # so stiff that the grains alone count
TERMS, POINTS = 60, 2880


def lekhnitskii(stiffness, at):
    """Stress xx, yy, xy (p, 3) over the pressure at points (p, 2), in radii, of a disc of one stiffness (3, 3).

    Two analytic functions of x + mu y, each with one root mu of the characteristic equation (Lekhnitskii 1968,
    Anisotropic plates), as series whose tractions are fitted to the pressure all around.
    """
    b = np.linalg.inv(stiffness)
    roots = np.roots([b[0, 0], -2 * b[0, 2], 2 * b[0, 1] + b[2, 2], -2 * b[1, 2], b[1, 1]])

    def stresses(points):
        found = []
        for mu in roots[roots.imag > 0]:
            focus = np.sqrt(1 + mu**2 + 0j)
            largest = np.abs(np.polynomial.chebyshev.chebvander((1 - 1j * mu) / focus, TERMS)).clip(1)
            terms = np.polynomial.chebyshev.chebvander((points @ [1, mu]) / focus, TERMS) / largest
            found += [2 * np.real([mu**2 * f, f, -mu * f]) for f in (terms, 1j * terms)]
        return np.concatenate(found, axis=2)

    around = (np.arange(POINTS) + 0.5) * 2 * np.pi / POINTS
    x, y = normal = np.array([np.cos(around), np.sin(around)])
    xx, yy, xy = stresses(normal.T)
    tractions = np.concatenate([(xx.T * x + xy.T * y).T, (xy.T * x + yy.T * y).T])
    pressed = np.abs(x) < np.sin(np.radians(ARC / 2))
    return (stresses(at) @ np.linalg.lstsq(tractions, -(normal * pressed).ravel(), rcond=1e-13)[0]).T


@pytest.mark.thorough
def test_the_series_has_hondros_stress_in_the_middle_of_an_isotropic_disc():
    alike = attrs.evolve(
        SCHIST, youngs_modulus_across=60 * GPa, poissons_ratio_across=0.2 + 1e-7, shear_modulus_across=25 * GPa + 1e4
    )  # two roots that are nearly one
    half = np.radians(ARC / 2)
    hondros = [2 / np.pi * (np.sin(2 * half) - half), -2 / np.pi * (np.sin(2 * half) + half), 0]
    assert lekhnitskii(alike.stiffness, np.zeros((1, 2)))[0] == pytest.approx(hondros, abs=2e-5)


@pytest.mark.thorough
@pytest.mark.parametrize("angle", [0, 45, 90])
def test_a_disc_of_schist_has_lekhnitskiis_stress(angle):
    """Means over grains in the inner half, to 2.5 % of the largest; near the centre, to 1 %. Finer zones are nearer."""
    schist = attrs.evolve(SCHIST, foliation_angle=angle)
    grains = Voronoi(grains=300, seed=1).tessellate(disc(DIAMETER, loaded=ARC, flat=False, sides=72))
    stress = squeezed(gl.Specimen(grains, schist, refinement=1)) / PRESSURE
    radius = np.hypot(*grains.centroids.T) / (DIAMETER / 2)
    theory = lekhnitskii(schist.stiffness, grains.centroids / (DIAMETER / 2))
    inner, middle = radius < 0.5, radius < 0.2
    assert np.abs(stress - theory)[inner].max() < 0.025 * np.abs(theory[inner]).max()
    found, expected = (np.average(each[middle], axis=0, weights=grains.areas[middle]) for each in (stress, theory))
    assert np.abs(found - expected).max() < 0.01 * np.abs(expected).max()


@attrs.frozen
class Squeeze(gl.LoadingProtocol):
    """The pressure, by statics; the ends cannot move sideways."""

    found: list = attrs.field(factory=list)  #: (g, 3) stress of grains, of each sample

    def stages(self, specimen):
        ends = [("top", 0), ("bottom", 0), ("bottom", 1)]
        press = gl.Stage(
            name="press", static=True, interval=1e-9, until=[gl.conditions.Reaches("time", 1e-12)],
            loads=[
                *(gl.loads.Pressure(boundary=end, pressure=PRESSURE) for end in ("top", "bottom")),
                *(gl.loads.Drive(boundary=end, axis=axis, speed=0.0, roller=True) for end, axis in ends),
            ],
        )  # fmt: skip
        return [press]

    def measure(self, state):
        self.found.append(state.grain_stress())
        return {}

    def summary(self, curves, specimen):
        return {}


def squeezed(specimen):
    test = Squeeze()
    gl.simulate(specimen, GLUE, test)
    return test.found[-1]
