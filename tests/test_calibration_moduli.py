"""Stiffnesses that meet modulus and Poisson's ratio in the test, not in statics alone."""

import math

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import grainlaw as gl
from grainlaw.calibration.moduli import WITHIN, fit_moduli
from grainlaw.calibration.stiffness_search import Stiffness, UnreachableError
from grainlaw.units import GPa

WANTED = {"youngs_modulus": 60 * GPa, "poissons_ratio": 0.25}


def statics(aims):
    """A rock whose stiffnesses are modulus and Poisson's ratio themselves."""
    modulus, poisson = aims["youngs_modulus"], aims["poissons_ratio"]
    if not 0 < poisson < 0.4:
        raise gl.ParameterError("calibrate: poissons_ratio cannot be had")
    return Stiffness(parameters={"kn": modulus, "ks": poisson}, grains=1, modulus=modulus, poisson=poisson, solutions=1)


def cracking(softer, wider, steeper):
    """A test in which early cracks make the rock softer and wider, the more the larger Poisson's ratio is."""

    def measure(stiffness):
        return {
            "youngs_modulus": (1 - softer * stiffness.poisson) * stiffness.modulus,
            "poissons_ratio": stiffness.poisson + wider + steeper * (stiffness.poisson - 0.2),
        }

    return measure


@given(st.floats(0, 0.5), st.floats(0, 0.08), st.floats(0, 1.5))
def test_the_test_has_the_moduli_that_are_wanted(softer, wider, steeper):
    measure = cracking(softer, wider, steeper)
    found = fit_moduli(WANTED, statics, measure)
    for name, value in measure(found).items():
        assert value == pytest.approx(WANTED[name], rel=WITHIN)
    assert found.tested == measure(found)


def test_statics_keep_the_word_where_the_test_gives_nothing_else():
    asked = []

    def elastic(stiffness):
        asked.append(stiffness)
        return {"youngs_modulus": stiffness.modulus, "poissons_ratio": stiffness.poisson}

    assert attrs.evolve(fit_moduli(WANTED, statics, elastic), tested={}) == statics(WANTED)
    assert len(asked) == 1
    nothing = fit_moduli(WANTED, statics, lambda stiffness: dict.fromkeys(WANTED, math.nan))
    assert nothing.parameters == statics(WANTED).parameters


def test_the_nearest_is_taken_where_statics_cannot_go_further():
    def wide(stiffness):
        return {"youngs_modulus": stiffness.modulus, "poissons_ratio": stiffness.poisson + 0.3}

    found = fit_moduli(WANTED, statics, wide)  # would take less than 0
    assert 0 < found.poisson < 0.1
    assert found.tested["poissons_ratio"] == found.poisson + 0.3
    with pytest.raises(gl.ParameterError, match="cannot be had"):
        fit_moduli({**WANTED, "poissons_ratio": 0.45}, statics, wide)


def bounded(aims):
    """Statics that have no Poisson's ratio above 0.4, and say that 0.39 is the nearest."""
    if aims["poissons_ratio"] > 0.4:
        raise UnreachableError("calibrate: 0.4 at most", 0.39)
    return statics(aims)


def test_a_ratio_that_only_the_test_has_is_met_by_it():
    """Cracks widen it by 0.08: 0.45 is 0.37 by statics."""
    wanted = {**WANTED, "poissons_ratio": 0.45}
    found = fit_moduli(wanted, bounded, cracking(0, 0.08, 0))
    assert found.poisson == pytest.approx(0.37, abs=0.45 * WITHIN)
    assert found.tested["poissons_ratio"] == pytest.approx(0.45, rel=WITHIN)
    with pytest.raises(UnreachableError, match=r"0.4 at most"):
        fit_moduli(wanted, bounded, cracking(0, 0.01, 0))
    with pytest.raises(UnreachableError, match=r"0.4 at most"):
        fit_moduli(wanted, bounded, lambda stiffness: dict.fromkeys(wanted, math.nan))


@pytest.mark.parametrize(("nearest", "times"), [(math.nan, 1), (0.39, 2)])
def test_statics_without_a_nearest_ratio_refuse_at_once(nearest, times):
    asked = []

    def never(aims):
        asked.append(aims)
        raise UnreachableError("calibrate: none", nearest)

    with pytest.raises(UnreachableError, match="none"):
        fit_moduli(WANTED, never, None)
    assert len(asked) == times


def test_one_target_alone_is_met():
    def alone(aims):
        return statics({"poissons_ratio": 0.2, **aims})

    found = fit_moduli({"youngs_modulus": 60 * GPa}, alone, lambda each: {"youngs_modulus": 0.9 * each.modulus})
    assert found.modulus == pytest.approx(60 * GPa / 0.9, rel=1e-6)
    assert np.isclose(found.tested["youngs_modulus"], 60 * GPa)
