"""Rocks as data: their elastic constants against those of single crystals, and that a test takes them."""

from pathlib import Path

import numpy as np
import pytest

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.cli.sections import read_file
from grainlaw.laws import Linear

ROCKS = Path(__file__).parents[1] / "docs" / "examples" / "rocks"
GRANITE = ROCKS / "lac-du-bonnet-granite.toml"

#: GPa, by Voigt's indices; the sources are named in the file of the rock
CRYSTALS = {
    "quartz": {
        "11": 86.6, "22": 86.6, "33": 106.4, "44": 58.0, "55": 58.0, "66": (86.6 - 6.74) / 2, "12": 6.74, "13": 12.4,
        "23": 12.4, "14": 17.8, "24": -17.8, "56": 17.8,
    },
    "K-feldspar": {
        "11": 67.8, "22": 181.2, "33": 158.4, "44": 21.1, "55": 19.4, "66": 33.1, "12": 40.4, "13": 25.0, "15": -1.1,
        "23": 20.6, "25": -12.9, "35": 10.6, "46": -11.6,
    },
    "plagioclase": {
        "11": 87.1, "22": 174.9, "33": 166.1, "44": 22.9, "55": 29.0, "66": 35.0, "12": 43.9, "13": 35.4, "23": 18.0,
        "45": -1.3, "46": -5.2, "56": 0.8, "14": 6.1, "15": -0.4, "16": -0.6, "24": -5.9, "25": -2.9, "26": -6.5,
        "34": -2.9, "35": 4.6, "36": -10.7,
    },
    "mica": {"11": 186, "22": 186, "33": 54, "44": 5.8, "55": 5.8, "66": 76.8, "12": 32.4, "13": 11.6, "23": 11.6},
}  # fmt: skip


def bounds(crystal):
    """Bulk and shear modulus of randomly turned crystals by Voigt and by Reuss."""
    stiffness = np.zeros((6, 6))
    for (i, j), value in crystal.items():
        stiffness[int(i) - 1, int(j) - 1] = stiffness[int(j) - 1, int(i) - 1] = value
    sums = []
    for matrix in (stiffness, np.linalg.inv(stiffness)):
        sums.append((np.trace(matrix[:3, :3]), np.triu(matrix[:3, :3], 1).sum(), np.trace(matrix[3:, 3:])))
    (a, b, c), (r, s, t) = sums
    return ((a + 2 * b) / 9, (a - b + 3 * c) / 15), (1 / (r + 2 * s), 15 / (4 * r - 4 * s + 3 * t))


def of_bulk_and_shear(k, g):
    return 9 * k * g / (3 * k + g), (3 * k - 2 * g) / (6 * k + 2 * g)


def test_the_bounds_of_an_isotropic_crystal_are_its_moduli():
    k, g = 40.0, 30.0
    p, q = k + 4 * g / 3, k - 2 * g / 3
    crystal = {"11": p, "22": p, "33": p, "12": q, "13": q, "23": q, "44": g, "55": g, "66": g}
    assert bounds(crystal) == (pytest.approx((k, g)), pytest.approx((k, g)))
    assert of_bulk_and_shear(k, g) == pytest.approx((72, 0.2))


def test_biotite_has_the_bounds_of_the_handbook():
    """Mavko, Mukerji and Dvorkin, The Rock Physics Handbook, list both."""
    assert bounds(CRYSTALS["mica"]) == (pytest.approx((59.7, 42.3), abs=0.1), pytest.approx((41.1, 12.4), abs=0.1))


def test_elastic_constants_are_those_of_the_crystals():
    rocks = configured("uniaxial-compression", read_file(GRANITE), quick=True).specimen
    for k, name in enumerate(rocks.grains.phase_names):
        young, poisson = of_bulk_and_shear(*np.mean(bounds(CRYSTALS[name]), axis=0))
        material = rocks.material_of(k)
        assert material.youngs_modulus == pytest.approx(young * 1e9, rel=1e-3)
        assert material.poissons_ratio == pytest.approx(poisson, abs=6e-4)


def test_minerals_have_their_shares():
    grains = configured("uniaxial-compression", read_file(GRANITE)).specimen.grains
    found = np.bincount(grains.phase, grains.areas) / grains.areas.sum()
    assert dict(zip(grains.phase_names, found, strict=True)) == pytest.approx(
        {"quartz": 0.31, "K-feldspar": 0.27, "plagioclase": 0.38, "mica": 0.04}, abs=1e-3
    )


def test_the_granite_is_as_stiff_as_its_minerals():
    """In plane strain between the softest and the stiffest, and near to the mean weighted by area."""
    chosen = configured("uniaxial-compression", read_file(GRANITE), quick=True)
    found = gl.elastic_properties(chosen.specimen, Linear(kn=1e17, ks=1e17)).modulus
    assert found == pytest.approx((0.31 * 95.7 + 0.27 * 77.8 + 0.38 * 89.9 + 0.04 * 69.6) * 1e9, rel=0.03)
