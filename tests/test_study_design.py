"""The cases of a study: combinations of levels, lists, points that fill ranges, and what is refused."""

import itertools

import numpy as np
import pandas
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import qmc

import grainlaw as gl
from grainlaw.studies.design import check_signature, factorial, listed

COUNTS = st.integers(1, 65)
SEEDS = st.integers(0, 2**32)
RANGES = st.dictionaries(
    st.sampled_from(["a", "b", "c", "d"]),
    st.tuples(st.floats(-1e9, 1e9), st.floats(1e-3, 1e3)).map(lambda e: (e[0], e[0] + e[1] * max(abs(e[0]), 1e-3))),
    min_size=1,
)


def never(**factors):
    raise AssertionError("no case is made before a study runs")


def test_all_combinations_and_the_last_factor_changes_fastest():
    design = factorial({"law": ["A", "B"], "strength": (1.0, 2.0), "seed": range(3)})
    expected = list(itertools.product(["A", "B"], [1.0, 2.0], [0, 1, 2]))
    assert [tuple(case.values()) for case in design] == expected
    assert len(design) == 12
    assert all(list(case) == ["law", "strength", "seed"] for case in design)


def test_levels_of_numpy_are_recorded_as_plain_numbers():
    (case,) = factorial({"a": np.array([0.1]), "b": np.arange(3)[2:], "c": [np.str_("x")]})
    assert case == {"a": 0.1, "b": 2, "c": "x"}
    assert [type(level) for level in case.values()] == [float, int, str]


@pytest.mark.parametrize("kind", [list, pandas.DataFrame])
def test_listed_cases_are_combined_with_further_factors(kind):
    cases = [{"a": 1.5, "b": "x"}, {"a": 2.5, "b": "y"}]
    design = listed(kind(cases), {"seed": range(2)})
    assert list(design) == [case | {"seed": seed} for case in cases for seed in range(2)]
    assert design.names == ("a", "b", "seed")
    assert len(design) == 4


def test_listed_cases_may_name_their_factors_in_any_order():
    assert list(listed([{"a": 1, "b": 2}, {"b": 3, "a": 4}], {})) == [{"a": 1, "b": 2}, {"a": 4, "b": 3}]


# --- points in ranges ------------------------------------------------------------------------------------------------


@given(COUNTS, SEEDS, RANGES)
def test_latin_hypercube_has_one_point_in_each_slice(count, seed, ranges):
    points = gl.latin_hypercube(count, seed=seed, **ranges)
    assert len(points) == count
    for name, (low, high) in ranges.items():
        values = np.array([point[name] for point in points])
        share = (values - low) / (high - low)
        assert np.all((values >= low) & (values <= high))
        edges = np.abs(share * count - np.round(share * count)) < 1e-4  # on a border but for rounding
        slices = np.floor(share * count).astype(int)
        assert edges.any() or sorted(slices) == list(range(count))


@pytest.mark.thorough
@given(COUNTS, SEEDS, RANGES)
def test_sobol_points_lie_in_their_ranges(count, seed, ranges):
    points = gl.sobol(count, seed=seed, **ranges)
    assert len(points) == count
    for point in points:
        assert list(point) == list(ranges)
        assert all(low <= point[name] <= high and type(point[name]) is float for name, (low, high) in ranges.items())


@pytest.mark.parametrize("draw", [gl.latin_hypercube, gl.sobol])
def test_the_same_seed_gives_the_same_points(draw):
    ranges = {"a": (0, 1), "b": (5.0, 20.0)}
    assert draw(16, seed=3, **ranges) == draw(16, seed=3, **ranges) != draw(16, seed=4, **ranges)
    assert draw(16, **ranges) == draw(16, seed=0, **ranges)


@pytest.mark.parametrize("draw", [gl.latin_hypercube, gl.sobol])
def test_four_points_of_a_range_are_one_in_each_quarter(draw):
    points = draw(4, seed=1, a=(10, 30), b=(-2, -1))
    for factor, low, quarter in (("a", 10, 5), ("b", -2, 0.25)):
        assert sorted(int((point[factor] - low) // quarter) for point in points) == [0, 1, 2, 3]


def test_sobol_points_fill_more_evenly_than_chance():
    points = np.array([list(p.values()) for p in gl.sobol(256, a=(0, 1), b=(0, 1), c=(0, 1))])
    chance = np.random.default_rng(0).random((256, 3))
    assert qmc.discrepancy(points) < 0.2 * qmc.discrepancy(chance)
    for dimension in range(3):  # a (t, m, s)-net: as many points in each of 256 slices
        assert sorted(np.floor(points[:, dimension] * 256).astype(int)) == list(range(256))


def test_points_are_the_cases_of_a_study():
    study = gl.Study(never, cases=gl.latin_hypercube(5, strength=(5e6, 20e6)), seed=range(3))
    assert len(study) == 15
    assert repr(study) == "Study(never, 15 cases, levels of seed: 3)"


@settings(max_examples=20)
@given(st.floats(1e-9, 1e12), st.integers(1, 3))
def test_the_narrowest_range_is_not_left(low, steps):
    high = low
    for _ in range(steps):
        high = float(np.nextafter(high, np.inf))
    for draw in (gl.latin_hypercube, gl.sobol):
        assert all(low <= point["a"] <= high for point in draw(9, a=(low, high)))


# --- bad input -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("factors", "message"), [
    ({"a": "text"}, "a = 'text'.*list of levels"),
    ({"a": 3}, "a = 3.*list of levels"),
    ({"a": []}, "a has no levels"),
    ({"a": [1, 1.0]}, "same level twice"),
    ({"a": [True, 1]}, "same level twice"),
    ({"a": [float("nan")]}, "a = nan.*finite number"),
    ({"a": [float("inf")]}, "a = inf.*finite number"),
    ({"a": [object()]}, "a = .*by names"),
    ({"a": [[1, 2]]}, r"a = \[1, 2\].*by names"),
    ({"a": {}}, "a has no levels"),
    ({"status": [1]}, "may not be called 'status'"),
])  # fmt: skip
def test_levels_that_are_none_are_refused(factors, message):
    with pytest.raises(gl.ParameterError, match=f"Study: .*{message}"):
        gl.Study(never, **factors)


@pytest.mark.parametrize(("cases", "factors", "message"), [
    ([], {}, "cases is empty"),
    ("text", {}, "cases = 'text'"),
    ({"a": 1}, {}, "list of mappings"),
    (7, {}, "cases = 7"),
    ([1], {}, r"cases\[0\] = 1"),
    ([{1: 2}], {}, r"cases\[0\].*names"),
    ([{"a": 1}, {"b": 1}], {}, r"cases\[1\] has the factors b, but cases\[0\] has a"),
    ([{"a": 1}, {"a": 1}], {}, "same case twice"),
    ([{"a": 1}, {"a": 1.0}], {}, "same case twice"),
    ([{"a": 1}], {"a": [1]}, "'a' is given twice"),
    ([{"a": None}, {"a": float("nan")}], {}, r"cases\[1\]: a = nan"),
    (pandas.DataFrame({"a": [1.0, None]}), {}, r"cases\[1\]: a = nan"),
    (pandas.DataFrame({0: [1.0]}), {}, r"cases\[0\].*names"),
])  # fmt: skip
def test_lists_that_are_none_are_refused(cases, factors, message):
    with pytest.raises(gl.ParameterError, match=f"Study: .*{message}"):
        gl.Study(never, cases=cases, **factors)


@pytest.mark.parametrize("draw", [gl.latin_hypercube, gl.sobol])
@pytest.mark.parametrize(("count", "options", "message"), [
    (0, {"a": (0, 1)}, "count = 0"),
    (2.5, {"a": (0, 1)}, "count = 2.5"),
    (4, {}, "there is no range"),
    (4, {"a": (1, 1)}, "a = 1"),
    (4, {"a": (2, 1)}, "a = 1"),
    (4, {"a": 3}, r"a = 3.*\(low, high\)"),
    (4, {"a": (1, 2, 3)}, r"\(low, high\)"),
    (4, {"a": (0, float("inf"))}, "a = inf"),
    (4, {"a": ("x", "y")}, "a = 'x'"),
    (4, {"a": (0, 1), "seed": -1}, "seed = -1"),
    (4, {"a": (0, 1), "seed": "x"}, "seed = 'x'"),
])  # fmt: skip
def test_ranges_that_are_none_are_refused(draw, count, options, message):
    with pytest.raises(gl.ParameterError, match=f"{draw.__name__}: .*{message}"):
        draw(count, **options)


def some(law, seed, strength=1.0):
    return None


def by_place(a, /):
    return None


@pytest.mark.parametrize(("case", "names", "message"), [
    (some, ["law", "sed"], "no factor 'sed'.*did you mean 'seed'"),
    (some, ["law"], "needs the factor 'seed'"),
    (by_place, [], "without a name"),
    (3, [], "case = 3"),
])  # fmt: skip
def test_factors_that_a_function_does_not_take_are_refused(case, names, message):
    with pytest.raises(gl.ParameterError, match=f"Study: .*{message}"):
        check_signature(case, names)
    check_signature(some, ["law", "seed"])
    check_signature(never, ["anything"])
