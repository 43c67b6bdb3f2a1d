"""Sizes of grains: drawn areas have the distribution asked for; what is refused."""

from __future__ import annotations

import inspect
import textwrap

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import grainlaw as gl
from grainlaw import geometry
from grainlaw.fields import ParameterError
from grainlaw.geometry import ByPhase, Empirical, Even, Laguerre, Lognormal, NaturalGrowth, Sizes, rectangle

DRAWN = [Even(), Lognormal(deviation=0.3), NaturalGrowth(), Empirical(diameters=[1e-3, 2e-3, 4e-3])]


def test_all_sizes_are_tried() -> None:
    exported = [getattr(geometry, name) for name in geometry.__all__]
    made = {each for each in exported if inspect.isclass(each) and issubclass(each, Sizes)}
    assert made == {Sizes, *map(type, DRAWN)}


@pytest.mark.parametrize("sizes", DRAWN)
def test_draws_are_areas_and_repeat(sizes: Sizes) -> None:
    first, second = (sizes.draw(50, np.random.default_rng(3)) for _ in range(2))
    assert first.shape == (50,)
    assert first.min() > 0
    assert np.array_equal(first, second)


@settings(max_examples=30)
@given(deviation=st.floats(0.02, 1), seed=st.integers(0, 99))
def test_diameters_are_lognormal(deviation: float, seed: int) -> None:
    """Mean 1 and the deviation asked for: sigma^2 = ln(1 + deviation^2) and scale exp(-sigma^2 / 2)."""
    diameters = np.sqrt(Lognormal(deviation=deviation).draw(2000, np.random.default_rng(seed)))
    sigma = np.sqrt(np.log(1 + deviation**2))
    assert stats.kstest(diameters, stats.lognorm(s=sigma, scale=np.exp(-(sigma**2) / 2)).cdf).pvalue > 1e-4


def test_lognormal_of_scipy_has_the_deviation() -> None:
    sigma = np.sqrt(np.log(1 + 0.42**2))
    law = stats.lognorm(s=sigma, scale=np.exp(-(sigma**2) / 2))
    assert (law.mean(), law.std()) == pytest.approx((1, 0.42))
    diameters = np.sqrt(NaturalGrowth().draw(200_000, np.random.default_rng(1)))
    assert (diameters.mean(), diameters.std()) == pytest.approx((1, 0.42), abs=0.005)


@pytest.mark.thorough
def test_grains_have_the_distribution() -> None:
    """The grains of a specimen, not only what was drawn for them."""
    made = Laguerre(grains=2000, sizes=Lognormal(deviation=0.4), seed=4).tessellate(rectangle(0.1, 0.1))
    diameters = np.sqrt(made.areas)
    sigma = np.sqrt(np.log(1 + 0.4**2))
    law = stats.lognorm(s=sigma, scale=np.exp(-(sigma**2) / 2))
    assert stats.kstest(diameters / diameters.mean(), law.cdf).pvalue > 0.01
    assert stats.kstest(diameters / diameters.mean(), stats.lognorm(s=0.3).cdf).pvalue < 1e-6


def test_classes_are_drawn_by_weight() -> None:
    areas = Empirical(diameters=[1, 2, 3], weights=[1, 0, 3]).draw(40_000, np.random.default_rng(1))
    assert np.unique(areas).tolist() == [1, 9]
    assert (areas == 9).mean() == pytest.approx(0.75, abs=0.01)
    alike = Empirical(diameters=[1, 2]).draw(40_000, np.random.default_rng(1))
    assert (alike == 4).mean() == pytest.approx(0.5, abs=0.01)


@settings(max_examples=40)
@given(quartz=st.floats(0.05, 0.6), mica=st.floats(0.05, 0.35), count=st.integers(3, 400), seed=st.integers(0, 99))
def test_phases_have_their_fractions_exactly(quartz: float, mica: float, count: int, seed: int) -> None:
    fractions = {"quartz": quartz, "mica": mica, "feldspar": 1 - quartz - mica}
    sizes = ByPhase({"quartz": Lognormal(deviation=0.3, diameter=2), "mica": Even(), "feldspar": NaturalGrowth()})
    phases, areas = sizes.draw(fractions, count, np.random.default_rng(seed))
    assert len(phases) == len(areas) == count
    assert np.bincount(phases, areas) == pytest.approx(list(fractions.values()), rel=1e-12)


def test_large_grains_are_few() -> None:
    """Diameters of 2 beside 1: a quarter as many grains for the same fraction, four times the area each."""
    sizes = ByPhase({"coarse": Even(diameter=2), "fine": Even()})
    phases, areas = sizes.draw({"fine": 0.5, "coarse": 0.5}, 500, np.random.default_rng(1))
    assert np.bincount(phases).tolist() == [400, 100]
    assert areas[phases == 1] / areas[phases == 0][0] == pytest.approx(np.full(100, 4.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Lognormal(deviation=-0.1), r"Lognormal: deviation = -0\.1 is not allowed"),
        (lambda: Lognormal(deviation=1.5), r"Lognormal: deviation = 1\.5 is not allowed, .* at least 0 and at most 1"),
        (lambda: Empirical(diameters=[]), r"Empirical: diameters = \[\] is not allowed"),
        (lambda: Empirical(diameters=[1, 0]), r"Empirical: diameters = .* must be above 0"),
        (lambda: Empirical(diameters=[1, np.nan]), r"Empirical: diameters = .* finite"),
        (lambda: Empirical(diameters=[1, 2], weights=[1]), r"Empirical: weights = .* 2 numbers"),
        (lambda: Empirical(diameters=[1, 2], weights=[0, 0]), r"Empirical: weights = .* 2 numbers"),
        (lambda: ByPhase({"quartz": 3}), r"ByPhase: sizes = .* mapping"),
        (lambda: ByPhase({"a": Even()}).draw({"b": 1.0}, 5, np.random.default_rng(1)), "has none for 'b'"),
        (lambda: ByPhase({"a": Even(), "b": Even()}).draw({"a": 0.5, "b": 0.5}, 1, None), "1 grains .* 2 phases"),
    ],
)
def test_refused(make, message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        make()


def test_example_of_the_interface_runs() -> None:
    code = textwrap.dedent(inspect.getdoc(Sizes).split("::\n", 1)[1])
    names = {"attrs": attrs, "gl": gl, "np": np, "geometry": geometry}
    exec(code, names)
    fit = Laguerre(grains=60, sizes=names["Bimodal"](ratio=2.0)).fit(rectangle(1, 1))
    assert np.unique(np.round(fit.asked / fit.asked.min(), 9)).tolist() == [1, 4]
    assert fit.largest_after < 0.02


def test_sizes_of_a_user_are_checked_before_any_work() -> None:
    class Wrong(Sizes):
        def __init__(self, areas):
            self.areas = areas

        def draw(self, count, random):
            return np.array(self.areas)

    for areas, message in (([1.0, -1.0], "above 0"), ([1.0], "are 1, they must be 2"), ([1.0, 1e-9], "at least 1e-06")):
        with pytest.raises(ParameterError, match=f"Wrong: areas that draw gave.*{message}"):
            Laguerre(grains=2, sizes=Wrong(areas)).tessellate(rectangle(1, 1))
