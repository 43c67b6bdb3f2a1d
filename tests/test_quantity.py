"""Quantities with units: conversions by hand, round trips, and refusals that say what is allowed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import grainlaw as gl
from grainlaw import units
from grainlaw.fields import ParameterError
from grainlaw.geometry import from_labels, rectangle
from grainlaw.laws import Linear
from grainlaw.messages import in_python
from grainlaw.unit_text import PREFIXES, USUAL, in_si, quantity, written

NUMBERS = st.floats(1e-12, 1e12)
EXACT = {"k": 3, "M": 6, "G": 9, "m": -3, "u": -6}


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("13 MPa", "Pa", 13e6), ("60GPa", "Pa", 60e9), ("4 kPa", "Pa", 4e3), ("-1 MPa", "Pa", -1e6),
        ("10 MN/m2", "Pa", 10e6), ("105 TPa/m", "Pa/m", 1.05e14), ("105 GPa/mm", "Pa/m", 1.05e14),
        ("40 mm", "m", 0.04), ("5 um", "m", 5e-6), ("5 µm", "m", 5e-6), ("5 μm", "m", 5e-6), ("4 cm", "m", 0.04),
        ("150 N/m", "J/m2", 150), ("0.15 kJ/m^2", "J/m2", 150), ("150 J/m²", "J/m2", 150), ("150 J*m-2", "J/m2", 150),
        ("3.1 g/cm3", "kg/m3", 3100), ("3100 kg/m³", "kg/m3", 3100), ("20 mm/s", "m/s", 0.02), ("0.2 ms", "s", 2e-4),
        ("30 us", "s", 3e-5), ("25 %", "1", 0.25), ("54°", "deg", 54), ("300 1/s", "1/s", 300),
        ("20 kN/m", "J/m2", 2e4), ("90 min", "s", 5400), ("2 h", "s", 7200), ("3 day", "s", 259200),
        ("1 year", "s", 365.25 * 86400), ("2 mm/year", "m/s", 2e-3 / 31557600), ("250 bar", "Pa", 25e6),
        ("1 kbar", "Pa", 1e8), ("1 ksi", "Pa", 6894757.293168361),
        ("1 mPa s", "Pa s", 1e-3), ("1 mPa*s", "Pa s", 1e-3),
        ("0 mm", "m", 0), ("inf m", "m", math.inf), ("13e6", "1", 13e6), ("0", "Pa", 0),
        ("13", "grain sizes", 13), ("1e-999999999 m", "m", 0),
    ],
)  # fmt: skip
def test_conversions_are_exact(text, unit, expected):
    assert quantity(text, unit) == expected


def test_a_half_turn_in_radians():
    assert quantity(f"{math.pi} rad", "deg") == pytest.approx(180, rel=1e-15)


@pytest.mark.parametrize("form", [np.array([1.0, 2.0]), 3, "no form"])
def test_what_is_no_form_is_refused(form):
    with pytest.raises(ParameterError, match="Quantity: form = "):
        gl.Quantity("a", form=form)


@pytest.mark.parametrize("name", [*units.__all__, "min"])
def test_a_unit_of_python_is_that_of_files(name):
    assert getattr(units, name) == in_si(f"1 {name}")


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("29 MPa", "29 * MPa"), ("-1.5e2 kPa", "-1.5e2 * kPa"), ("150 J/m2", "150 * J / m**2"), ("54 deg", "54 * deg"),
        ("3.1 g/cm^3", "3.1 * g / cm**3"), ("2mm/year", "2 * mm / year"), ("5 min", "5 * min"), ("25 %", "25 / 100"),
        ("1 N m", "1 * N * m"), ("0.15 kJ/m²", "0.15 * kJ / m**2"),
    ],
)  # fmt: skip
def test_how_a_text_is_written_in_python(text, written):
    hint = in_python(text)
    assert hint.removesuffix(" (grainlaw.units)") == f"; write {written}"
    names = {name: getattr(units, name) for name in (*units.__all__, "min")}
    assert eval(written, names) == pytest.approx(in_si(text), rel=1e-12)


def test_other_texts_are_no_quantities():
    for text in ("MPa", "29", "29 ", "29 furlong", "29 MPa/furlong", "voronoi", 29, None, "2 m/", "1..20"):
        assert in_python(text) == ""


REFUSED = {
    "CohesiveCrack: cohesion": lambda text: Linear(kn=text, ks=1),
    "rectangle: width": lambda text: rectangle(text, 1),
    "from_labels: pixel": lambda text: from_labels([[1]], text),
    "Drive: speed": lambda text: gl.loads.Drive(boundary="top", axis=1, speed=text),
    "elastic": lambda text: gl.Elastic(youngs_modulus=text, poissons_ratio=0.2, density=3000),
    "certify": lambda text: gl.within_circle((0, 0), text),
}


@pytest.mark.parametrize("call", REFUSED.values(), ids=REFUSED)
def test_a_text_in_the_place_of_a_number_is_refused_with_the_product(call):
    with pytest.raises(ParameterError, match=r"= '29 MPa' is not allowed, .*number.*; write 29 \* MPa"):
        call("29 MPa")


@given(st.integers(1, 10**9), st.sampled_from(sorted(EXACT)), st.sampled_from(["Pa", "m", "s"]))
def test_a_prefix_is_a_power_of_ten(number, prefix, unit):
    assert quantity(f"{number} {prefix}{unit}", unit) == float(f"{number}e{EXACT[prefix]}")


@given(NUMBERS, st.sampled_from(sorted(USUAL)))
def test_what_is_written_in_the_declared_unit_comes_back(number, unit):
    assert quantity(f"{number!r} {unit}", unit) == number == quantity(number, unit)


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (13e6, "Pa", "13 MPa"), (1.05e14, "Pa/m", "105 TPa/m"), (0.05, "m", "50 mm"), (5e-6, "m", "5 um"),
        (2e-4, "s", "200 us"), (0.05, "m/s", "50 mm/s"), (0, "s", "0 s"), (-12.5e6, "Pa", "-12.5 MPa"),
        (2e-8, "m", "0.02 um"), (3100, "kg/m3", "3100 kg/m3"), (0.25, "1", "0.25"), (math.inf, "m", "inf"),
        (0.25, "grain sizes", "0.25"), (1e-300, "m", "1E-300 m"),
    ],
)  # fmt: skip
def test_what_is_written_is_short(value, unit, expected):
    assert written(value, unit) == expected


@given(st.floats(allow_nan=False), st.sampled_from([*sorted(USUAL), "grain sizes"]))
def test_what_is_written_is_the_same_number(number, unit):
    assert quantity(written(number, unit), unit) == number


@given(st.sampled_from(sorted(PREFIXES)), st.sampled_from(sorted(PREFIXES)))
def test_prefixes_cancel(above, below):
    there = quantity(f"3 {above}Pa/{below}m", "Pa/m")
    assert quantity(f"{there!r} {below}Pa/{above}m", "Pa/m") == pytest.approx(3, rel=1e-14)


@given(st.sampled_from(sorted(USUAL)), st.sampled_from(sorted(USUAL)))
def test_only_the_declared_dimension_is_taken(unit, other):
    if unit == other:
        assert quantity(USUAL[unit], unit) > 0
    else:
        with pytest.raises(ParameterError, match="is not allowed"):
            quantity(USUAL[other], unit)


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [
        ("13 mm", "Pa", "law.f = '13 mm' is not allowed: 'mm' is not one of Pa; it must be a number in Pa or a string"),
        ("20", "Pa", "law.f = '20' is not allowed, a text needs its unit; it must be a number in Pa or a string"),
        (
            "13 MPA",
            "Pa",
            "there is no unit 'MPA'; did you mean 'MPa'? it must be a number in Pa or a string",
        ),
        ("13 dollars", "Pa", "there is no unit 'dollars'; it must be a number in Pa or a string such as '13 MPa'"),
        ("7 m", "1", "'m' is not a number without a unit; it must be a number or a string such as '25 %'"),
        ("MPa", "Pa", "law.f = 'MPa' is not allowed"),
        ("13,5 MPa", "Pa", "there is no unit ',5 MPa'"),
        ("5 m/", "m", "there is no unit 'm/'"),
        ("0.2 m", "grain sizes", "it must be a number in grain sizes"),
        (True, "1", "law.f = True is not allowed"),
        (None, "1", "law.f = None is not allowed"),
        ([1.0], "m", "law.f = [1.0] is not allowed"),
    ],
)
def test_refusals_name_what_was_written_and_what_is_allowed(value, unit, words):
    with pytest.raises(ParameterError) as error:
        quantity(value, unit, "law.f")
    assert words in str(error.value)
