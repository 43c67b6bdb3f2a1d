"""Sizes that grow away from a place: the size by distance, grains of it, elements of it, what is refused."""

import re
import tomllib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiling import BEAM, assert_tiles

from grainlaw.cli.configuration import configured
from grainlaw.cli.sections import toml
from grainlaw.fields import ParameterError
from grainlaw.geometry import (
    Bricks,
    ByPhase,
    Even,
    Graded,
    Laguerre,
    Lognormal,
    Minerals,
    rectangle,
    write_geo,
)  # fmt: skip
from grainlaw.geometry.laguerre import graded_points

REGION = rectangle(1, 2)
CORNER = Graded(place=[(0, 0)], size=0.02, growth=0.1, largest=0.1)


def test_size_by_hand():
    bent = Graded(place=[(0, 0), (4, 0), (4, 3)], size=1, growth=0.5, largest=2.2)
    points = np.array([(2, 0), (2, -2), (-3, 4), (5, 2), (4, 3.4)])
    assert bent.at(points) == pytest.approx([1, 2, 2.2, 1.5, 1.2])
    elsewhere = Graded(place=[(-7, 10), (-3, 10), (-3, 13)], size=1, growth=0.5, largest=2.2)
    assert elsewhere.at(points + np.array([-7, 10])) == pytest.approx([1, 2, 2.2, 1.5, 1.2])
    assert CORNER.at(np.array([(0.3, 0.4), (0, 0), (1, 1)])) == pytest.approx([0.07, 0.02, 0.1])


@pytest.mark.thorough
@settings(max_examples=6)
@given(seed=st.integers(0, 99), spread=st.sampled_from([0, 0.4]), finest=st.sampled_from([0.02, 0.03]))
def test_grains_have_the_size_of_their_place(seed, spread, finest):
    """In rings round the place as many grains as the integral of 1 / size^2 over them: to 10 %, or 3 of Poisson's."""
    graded = Graded(place=[(0, 0)], size=finest, growth=0.1, largest=0.1)
    fit = Laguerre(grain_size=graded, sizes=Lognormal(deviation=spread), seed=seed).fit(REGION)
    grains = fit.tessellation
    assert_tiles(grains)
    assert fit.largest_before < 0.01
    assert fit.largest_after < 0.02
    away = np.hypot(*grains.centroids.T)
    for near, far in ((0, 0.25), (0.25, 0.6), (0.6, 0.98)):
        r = np.linspace(near, far, 2001)
        size = np.minimum(finest + 0.1 * r, 0.1)
        wanted = np.trapezoid(np.pi / 2 * r / size**2, r)
        found = np.sum((away >= near) & (away < far))
        assert found == pytest.approx(wanted, abs=max(0.1 * wanted, 3 * np.sqrt(wanted)))


def test_a_large_region_round_fine_grains_is_filled():
    """Points to choose from, three million here, need no room: grains count, as the integral of 1 / size^2."""
    graded = Graded(place=[(10, 10)], size=0.012, growth=0.1, largest=0.5)
    points = graded_points(rectangle(20, 20), graded, np.random.default_rng(1))
    away = np.hypot(*(points - 10).T)
    for near, far in ((0, 1), (1, 9)):
        r = np.linspace(near, far, 20_001)
        wanted = np.trapezoid(2 * np.pi * r / np.minimum(0.012 + 0.1 * r, 0.5) ** 2, r)
        assert np.sum((away >= near) & (away < far)) == pytest.approx(wanted, abs=3 * np.sqrt(wanted))
    with pytest.raises(ParameterError, match=r"size = 1e-06 is not allowed, it must be at least 0\.00063 m here"):
        Laguerre(grain_size=Graded(place=[(0, 0)], size=1e-6, growth=0.1, largest=0.5)).tessellate(rectangle(20, 20))


def test_fine_grains_at_the_tip_of_a_notch():
    tip = (0.1, 0.02)
    graded = Graded(place=[tip], size=5e-4, growth=0.15, largest=4e-3)
    made = Laguerre(grain_size=graded, seed=2).tessellate(BEAM)
    assert_tiles(made)
    size, away = np.sqrt(made.areas), np.hypot(*(made.centroids - tip).T)
    assert np.median(size[away < 2e-3]) < 1e-3
    assert np.median(size[away > 0.04]) == pytest.approx(4e-3, rel=0.2)


def test_round_graded_grains():
    fit = Laguerre(grain_size=CORNER, circularity=0.8, seed=1).fit(REGION)
    assert fit.circularity.mean() == pytest.approx(0.8, abs=0.004)
    assert fit.largest_after < 0.02


def test_elements_grow(tmp_path):
    grains = Bricks(rows=4, columns=2).tessellate(REGION)
    write_geo(grains, tmp_path / "grains.geo", CORNER, unit=0.1)
    text = (tmp_path / "grains.geo").read_text()
    rows = np.array(re.findall(r"Point\(\d+\) = \{(\S+), (\S+), 0, (\S+)\};", text), dtype=float)
    assert len(rows) == len(grains.vertices)
    assert rows[:, 2] == pytest.approx(np.minimum(0.2 + 0.1 * np.hypot(*rows[:, :2].T), 1))


TEXT = """
[sample]
tessellator = "laguerre"
[sample.grain_size]
place = [["10 mm", 0.0], ["10 mm", "5 mm"]]
size = "1 mm"
growth = 0.2
largest = "4 mm"
"""


def test_from_a_configuration():
    first = configured("uniaxial-tension", tomllib.loads(TEXT))
    grains = first.specimen.grains
    graded = Graded(place=[(0.01, 0), (0.01, 0.005)], size=1e-3, growth=0.2, largest=4e-3)
    assert np.array_equal(grains.vertices, Laguerre(grain_size=graded).tessellate(grains.region).vertices)
    again = configured("uniaxial-tension", tomllib.loads(toml(first.sections)))
    assert again.sections == first.sections
    assert np.array_equal(again.specimen.grains.vertices, grains.vertices)


BY_PHASE = ByPhase({"quartz": Even()})


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Graded(place=[], size=1, growth=0, largest=1), r"Graded: place = \[\] is not allowed"),
        (lambda: Graded(place=[1, 2], size=1, growth=0, largest=1), r"Graded: place = \[1, 2\] is not allowed"),
        (lambda: Graded(place=[(0, 0)], size=0, growth=0, largest=1), "Graded: size = 0 m is not allowed"),
        (lambda: Graded(place=[(0, 0)], size=1, growth=-1, largest=1), "Graded: growth = -1 is not allowed"),
        (lambda: Graded(place=[(0, 0)], size=2, growth=1, largest=1), "largest = 1 m is not allowed, .* at least the"),
        (lambda: Laguerre(grain_size="fine"), "Laguerre: grain_size = 'fine' is not allowed"),
        (lambda: Laguerre(grain_size=CORNER, grains=5), "give either grains or grain_size, not both"),
        (lambda: Laguerre(grain_size=Graded(place=[(0, 0)], size=1e-7, growth=1, largest=1)).fit(REGION), "= 1e-07"),
        (lambda: Minerals(Laguerre(grain_size=CORNER), {"quartz": 1.0}, sizes=BY_PHASE), "with a graded grain_size"),
    ],
)  # fmt: skip
def test_what_is_refused(make, words):
    with pytest.raises(ParameterError, match=words):
        make()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('size = "1 mm"', 'size = "1 MPa"'), "sample.grain_size.size"),
        (('["10 mm", 0.0]', '["10 mm", "0 s"]'), "sample.grain_size.place"),
        (("growth", "grow"), "there is no 'sample.grain_size.grow'; did you mean 'growth'"),
        (('"laguerre"', '"voronoi"'), "Voronoi: grain_size"),
    ],
)
def test_what_a_configuration_refuses(change, words):
    with pytest.raises(ParameterError, match=words):
        configured("uniaxial-tension", tomllib.loads(TEXT.replace(*change)))
