"""Minerals and breakable grains under load, against bounds, and against specimens without them."""

import attrs
import numpy as np
import pytest
from support import BRITTLE, PULL, ROCK

import grainlaw as gl
from grainlaw.geometry import Breakable, Cleavage, Jointed, Minerals, Trigons, Voronoi, VoronoiCells, rectangle
from grainlaw.laws import Linear
from grainlaw.units import GPa

GLUED = Linear(kn=1e17, ks=1e17)  #: stiffer by far than grains: E over their size is below 1e14 Pa/m
SQUARE, PRISM = rectangle(0.05, 0.05), rectangle(0.05, 0.1)


def hashin_shtrikman(materials, shares, extreme):
    """Bulk and shear modulus (Pa) in plane strain, isotropic in the plane: the bound of ``extreme`` (min or max).

    Hashin 1965, doi:10.1016/0022-5096(65)90015-3, for any number of phases as in Torquato 2002, ch. 21.
    """
    shear = np.array([m.youngs_modulus / (2 * (1 + m.poissons_ratio)) for m in materials])
    bulk = shear / (1 - 2 * np.array([m.poissons_ratio for m in materials]))  # lambda + mu
    k, mu = extreme(bulk), extreme(shear)
    around = k * mu / (k + 2 * mu)
    shares = np.asarray(shares)
    return 1 / (shares / (bulk + mu)).sum() - mu, 1 / (shares / (shear + around)).sum() - around


@pytest.mark.thorough
@pytest.mark.parametrize("boundary", ["kinematic", "static"])
@pytest.mark.parametrize("seed", [1, 2])
def test_two_minerals_lie_between_the_hashin_shtrikman_bounds(seed, boundary):
    materials = {
        name: gl.Elastic(youngs_modulus=e * GPa, poissons_ratio=0.2, density=2700)
        for name, e in (("soft", 30), ("stiff", 120))
    }
    grains = Minerals(Voronoi(grains=300, seed=seed), {"soft": 0.5, "stiff": 0.5}, seed=seed).tessellate(SQUARE)
    # Unrefined, a fan of triangles is some percent too stiff in shear.
    found = gl.elastic_properties(gl.Specimen(grains, materials, refinement=1), GLUED, boundary=boundary).stiffness
    bulk = (found[0, 0] + found[1, 1] + 2 * found[0, 1]) / 4
    (low_bulk, low_shear), (high_bulk, high_shear) = (
        hashin_shtrikman(list(materials.values()), (0.5, 0.5), extreme) for extreme in (np.min, np.max)
    )
    assert high_bulk / low_bulk < 1.2  # of 4 between the minerals
    assert low_bulk < bulk < high_bulk
    for shear in (found[2, 2], (found[0, 0] + found[1, 1] - 2 * found[0, 1]) / 4):
        assert low_shear < shear < high_shear


@pytest.mark.thorough
def test_minerals_that_are_alike_give_the_bits_of_one():
    tessellator = Voronoi(grains=30)
    plain = gl.simulate(gl.Specimen(tessellator.tessellate(PRISM), ROCK), BRITTLE, PULL)
    grains = Minerals(tessellator, {"quartz": 0.3, "feldspar": 0.5, "mica": 0.2}, clustering=1.2).tessellate(PRISM)
    alike = gl.simulate(gl.Specimen(grains, {"quartz": ROCK, ...: ROCK}), {...: BRITTLE}, PULL)
    assert len(plain.cracks) > 0
    assert all(np.array_equal(alike.curves[name], row) for name, row in plain.curves.items())


@pytest.mark.thorough
@pytest.mark.parametrize(
    "cells", [VoronoiCells(count=6), Trigons(count=8), Cleavage(spacing=2e-3)], ids=lambda cells: type(cells).__name__
)
def test_glued_cells_are_the_unbroken_grain(cells):
    whole = Voronoi(grains=100)
    broken = gl.Specimen(Breakable(whole, cells).tessellate(PRISM), ROCK)
    expected = gl.elastic_properties(gl.Specimen(whole.tessellate(PRISM), ROCK), BRITTLE)
    found = gl.elastic_properties(broken, {"inside": GLUED, ...: BRITTLE})
    assert found.apparent_modulus == pytest.approx(expected.apparent_modulus, rel=0.02)
    assert found.apparent_poisson == pytest.approx(expected.apparent_poisson, rel=0.05)
    soft = gl.elastic_properties(broken, BRITTLE)
    assert soft.apparent_modulus < 0.95 * found.apparent_modulus


@pytest.mark.thorough
def test_weak_grains_break_inside_and_strong_ones_between():
    grains = Breakable(Voronoi(grains=15), Trigons(count=6)).tessellate(PRISM)
    weak = attrs.evolve(BRITTLE, tensile_strength=3e6, cohesion=10e6)
    inside, between = (
        gl.simulate(gl.Specimen(grains, ROCK), laws, PULL).cracks.inside
        for laws in ({"inside": weak, ...: BRITTLE}, {"inside": BRITTLE, ...: weak})
    )
    assert inside.mean() > 0.8
    assert between.mean() < 0.2


def test_a_soft_joint_is_in_series_with_the_rock():
    """1 / (1 / E + 1 / (kn h)), for a joint across a specimen of height h; its kn and ks are alike."""
    grains = Jointed(Voronoi(grains=40), {"bedding": [[(-0.01, 0.045), (0.06, 0.055)]]}).tessellate(PRISM)
    specimen = gl.Specimen(grains, ROCK)
    whole = gl.elastic_properties(specimen, BRITTLE).apparent_modulus
    found = gl.elastic_properties(specimen, {"bedding": Linear(kn=1e12, ks=1e12), ...: BRITTLE}).apparent_modulus
    assert found == pytest.approx(1 / (1 / whole + 1 / (1e12 * 0.1)), rel=0.03)
