"""The table of a study: columns, means, pairs, interactions, and the samples that an interval would take."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import stats
from study_rows import peaks, row, table_of

import grainlaw as gl
from grainlaw.results.means import spread
from grainlaw.studies.statistics import MOST, Listing, Mean, difference, level

LAWS = ("A", "B", "C")
NUMBERS = st.floats(-1e9, 1e9, allow_subnormal=False)


def made(**fields):
    return Mean(**{"count": 5, "mean": 1.0, "deviation": 2.0, "interval": (0.0, 2.0), "group": {}} | fields)


@pytest.fixture
def drawn():
    rng = np.random.default_rng(3)
    sample = rng.normal(100e6, 12e6, 8)  # what the grains do to all laws alike
    means = {"A": 0.0, "B": 6e6, "C": -3e6}
    return {(law, seed): means[law] + sample[seed] + rng.normal(0, 1e6) for law in LAWS for seed in range(8)}


# --- against scipy, pandas and by hand -------------------------------------------------------------------------------


def test_pairs_are_those_of_students_paired_test(drawn, tmp_path):
    found = peaks(drawn, tmp_path / "s").paired("law")["strength"]
    assert [entry.levels for entry in found] == [("A", "B"), ("A", "C"), ("B", "C")]
    for entry in found:
        first, second = (np.array([drawn[name, seed] for seed in range(8)]) for name in entry.levels)
        theirs = stats.ttest_rel(second, first)
        assert entry.interval == pytest.approx(tuple(theirs.confidence_interval(0.95)), rel=1e-9)
        assert entry.mean == pytest.approx(second.mean() - first.mean())
        assert entry.share == pytest.approx(entry.mean / first.mean())
        low, high = entry.share_interval
        assert low < entry.share < high
        for end in (low, high):  # a ratio of the means that is just refused at 5 %
            assert stats.ttest_1samp(second - (1 + end) * first, 0).pvalue == pytest.approx(0.05, rel=1e-9)
        assert entry.higher == np.sum(second > first)
        assert entry.p_value == pytest.approx(stats.binomtest(int(np.sum(second > first)), 8).pvalue)
        assert (entry.count, entry.unpaired, entry.group) == (8, 0, {})


def test_a_difference_from_next_to_nothing_has_no_share(tmp_path):
    drawn = {("A", 0): 1.0, ("A", 1): 3.0, ("B", 0): 100e6, ("B", 1): 104e6}
    assert "%" not in str(peaks(drawn, tmp_path / "s").paired("law")["strength"]).splitlines()[-1].partition("to")[2]
    assert np.isnan(peaks(drawn, tmp_path / "s").paired("law")["strength"][0].share_interval).all()
    shifted = {key: value + 2e6 for key, value in drawn.items()}
    assert "+5100.0 %" in str(peaks(shifted, tmp_path / "t").paired("law")["strength"])


def test_an_interval_is_that_of_students_test_of_one_sample(drawn, tmp_path):
    for entry in peaks(drawn, tmp_path / "s").means("law")["strength"]:
        values = np.array([drawn[entry.group["law"], seed] for seed in range(8)])
        theirs = stats.ttest_1samp(values, 0).confidence_interval(0.95)
        assert entry.interval == pytest.approx(tuple(theirs), rel=1e-9)
        assert (entry.mean, entry.deviation) == pytest.approx((values.mean(), values.std(ddof=1)))


def test_an_interval_by_hand():
    entry = spread(np.array([1.0, 2.0, 3.0, np.nan]))
    half = 4.302652729749464 / math.sqrt(3)  # t of 2 degrees of freedom at 0.975, deviation 1
    assert (entry["count"], entry["mean"], entry["deviation"]) == (3, 2, pytest.approx(1))
    assert entry["interval"] == pytest.approx((2 - half, 2 + half))


def test_one_sample_and_none_have_no_interval():
    one, none = spread(np.array([7.0])), spread(np.array([np.nan]))
    assert (one["count"], one["mean"], none["count"]) == (1, 7.0, 0)
    assert np.isnan([one["deviation"], *one["interval"], none["mean"], none["deviation"], *none["interval"]]).all()


def test_means_of_groups_are_those_of_pandas(drawn, tmp_path):
    table = peaks(drawn, tmp_path / "s")
    theirs = table.to_pandas().groupby("law", sort=False)["strength"].agg(["count", "mean", "std"])
    ours = {e.group["law"]: (e.count, e.mean, e.deviation) for e in table.means("law")["strength"]}
    assert list(ours) == list(theirs.index)
    for name, numbers in ours.items():
        assert numbers == pytest.approx(tuple(theirs.loc[name]))
    whole = table.means()["strength"]
    assert [(e.count, e.group) for e in whole] == [(24, {})]
    assert whole[0].mean == pytest.approx(np.mean(list(drawn.values())))


def test_an_interaction_is_a_difference_of_differences(tmp_path):
    rng = np.random.default_rng(5)
    keys = list(itertools.product("AB", (10.0, 20.0), range(6)))
    values = {key: rng.normal(100, 10) for key in keys}
    rows = [row(dict(zip(("law", "size", "seed"), k, strict=True)), {"force": v}) for k, v in values.items()]
    (entry,) = table_of(rows, tmp_path / "s").interaction("law", "size")["force"]
    each = [values["B", 20.0, s] - values["A", 20.0, s] - values["B", 10.0, s] + values["A", 10.0, s] for s in range(6)]
    theirs = stats.ttest_1samp(each, 0)
    assert entry.mean == pytest.approx(np.mean(each))
    assert entry.interval == pytest.approx(tuple(theirs.confidence_interval(0.95)))
    assert (entry.first, entry.second, entry.factors) == (("A", "B"), (10.0, 20.0), ("law", "size"))


def test_ties_count_for_neither_side():
    pairs = np.array([[1.0, 1.0], [1.0, 2.0], [1.0, 2.0], [1.0, 3.0]])
    entry = difference({}, "law", ("A", "B"), pairs, 0)
    assert (entry.higher, entry.p_value) == (3, pytest.approx(2 / 2**3))  # three of three, of either sign
    both = difference({}, "law", ("A", "B"), np.array([[1.0, 2.0], [1.0, 0.0]]), 0)
    assert (both.higher, both.p_value) == (1, 1)
    equal = difference({}, "law", ("A", "B"), np.array([[1.0, 1.0]]), 0)
    assert np.isnan(equal.p_value)
    assert str(Listing("force", [equal])).splitlines()[-1].split() == "all B - A 1 0 - +0.0 % 0 of 1 -".split()


# --- how many samples ------------------------------------------------------------------------------------------------


@pytest.mark.thorough
@pytest.mark.parametrize("width", [8.0, 2.0, 0.5, 0.11])
def test_the_samples_for_a_width_are_the_fewest_that_do(width):
    def widths(n):
        return 2 * stats.t.ppf(0.975, n - 1) * 2.0 / np.sqrt(n)

    fewest = next(n for n in itertools.count(2) if widths(n) <= width)
    assert made().samples_for(width) == fewest


@pytest.mark.thorough
@given(st.floats(1e-2, 1e6), st.floats(1e-2, 1e6), st.floats(1.0, 10.0))
def test_samples_are_enough_fewest_and_fall_with_the_width(deviation, width, wider):
    assume(deviation / width < 500)
    entry = made(deviation=deviation)
    n = entry.samples_for(width)

    def is_enough(k):
        return bool(2 * stats.t.ppf(0.975, k - 1) * deviation / np.sqrt(k) <= width * (1 + 1e-9))

    assert is_enough(n)
    assert n == 2 or 2 * stats.t.ppf(0.975, n - 2) * deviation / np.sqrt(n - 1) > width * (1 - 1e-9)
    assert entry.samples_for(width * wider) <= n


@pytest.mark.parametrize(("fields", "width"), [({}, 0), ({}, -1.0), ({"count": 1}, 1.0), ({}, 1e-6), ({}, math.nan)])
def test_samples_that_cannot_be_told_are_refused(fields, width):
    with pytest.raises(gl.ParameterError, match="samples_for"):
        made(**fields).samples_for(width)
    assert made(deviation=0.0).samples_for(1e-6) == 2
    assert made(deviation=1.0).samples_for(0.01) < MOST


# --- properties ------------------------------------------------------------------------------------------------------


@pytest.mark.thorough
@settings(max_examples=50)
@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=6), st.floats(-1e6, 1e6))
def test_the_difference_of_shifted_samples_is_the_shift(tmp_path_factory, values, shift):
    samples = {("A", k): v for k, v in enumerate(values)} | {("B", k): v + shift for k, v in enumerate(values)}
    (entry,) = peaks(samples, tmp_path_factory.mktemp("s") / "s").paired("law")["strength"]
    assert entry.mean == pytest.approx(shift, abs=1e-8)
    assert entry.deviation == pytest.approx(0, abs=1e-8)
    low, high = entry.interval
    assert low - 1e-8 <= shift <= high + 1e-8


@given(st.lists(NUMBERS, min_size=2, max_size=20), st.floats(0.1, 10), NUMBERS)
def test_a_spread_follows_the_unit_and_the_zero(values, factor, zero):
    one = spread(np.array(values))
    other = spread(np.array(values) * factor + zero)
    close = {"rel": 1e-9, "abs": 1e-3}
    assert other["mean"] == pytest.approx(one["mean"] * factor + zero, **close)
    assert other["deviation"] == pytest.approx(one["deviation"] * factor, **close)
    assert other["interval"][0] <= other["mean"] <= other["interval"][1]


@pytest.mark.thorough
def test_the_interval_holds_the_mean_as_often_as_it_says():
    rng = np.random.default_rng(11)
    held = [low <= 5 <= high for low, high in (spread(rng.normal(5, 2, 4))["interval"] for _ in range(4000))]
    assert np.mean(held) == pytest.approx(0.95, abs=4 * math.sqrt(0.95 * 0.05 / 4000))


# --- what is missing -------------------------------------------------------------------------------------------------


def test_what_failed_leaves_pairs_and_means(tmp_path):
    table = peaks(
        {("A", 0): 1.0, ("A", 1): 2.0, ("A", 2): None, ("B", 0): 5.0, ("B", 1): None, ("B", 2): 9.0}, tmp_path
    )
    (entry,) = table.paired("law")["strength"]
    assert (entry.count, entry.mean, entry.unpaired) == (1, 4.0, 2)
    assert [e.mean for e in table.means("law")["strength"]] == [1.5, 7.0]  # not what unstable runs had by then
    assert np.isnan(table["strength"][[2, 4]]).all()
    assert table.rows[2]["strength"] == 1e12  # but it can be looked at
    table.write_csv(tmp_path / "t.csv")
    assert "1000000" not in (tmp_path / "t.csv").read_text("utf-8") + str(table)
    assert [(case["law"], case["status"], case["reason"]) for case in table.failed] == [
        ("A", "unstable", "it broke"), ("B", "unstable", "it broke")
    ]  # fmt: skip


def test_a_missing_case_does_not_turn_the_sign(tmp_path):
    """In the second group the first case of A is not there, so that B comes first."""
    keys = [("A", 1.0, 0), ("B", 1.0, 0), ("B", 2.0, 0), ("A", 2.0, 1), ("B", 2.0, 1)]
    rows = [row(dict(zip(("law", "size", "seed"), k, strict=True)), {"force": float(k[0] == "B")}) for k in keys]
    found = table_of(rows, tmp_path / "s").paired("law")["force"]
    assert [(entry.levels, entry.mean) for entry in found] == [(("A", "B"), 1.0)] * 2


def test_a_column_is_of_numbers_where_all_levels_are(tmp_path):
    levels = {"law": "A", "seed": 1, "size": 2.5, "mixed": 1, "flag": True}
    rows = [row(levels, {"force": 1.0}), row(levels | {"seed": 2, "mixed": "all", "flag": False}, {"force": None})]
    table = table_of(rows, tmp_path / "s")
    kinds = {name: table[name].dtype.kind for name in (*levels, "force", "status")}
    assert kinds == {"law": "O", "seed": "i", "size": "f", "mixed": "O", "flag": "O", "force": "f", "status": "O"}
    assert [list(table[name]) for name in ("seed", "mixed", "flag")] == [[1, 2], [1, "all"], [True, False]]


def test_where_chooses_cases_with_their_runs(drawn, tmp_path):
    table = peaks(drawn, tmp_path / "s")
    chosen = table.where(law="B", seed=3)
    assert chosen["strength"].tolist() == [drawn["B", 3]]
    assert table.where(law="C")["seed"].tolist() == list(range(8))
    assert len(table.where()) == len(table) == 24
    with pytest.raises(
        gl.ParameterError, match=r"Table\.where: law = 'D' is not allowed, it must be a level: 'A', 'B', 'C'"
    ):
        table.where(law="D")


def test_a_table_without_rows(tmp_path):
    table = table_of([], tmp_path / "s")
    assert (len(table), table.quantities, table.failed, len(table.means())) == (0, [], [], 0)
    assert "status" in str(table)
    assert str(Listing("strength", [])) == "there is nothing to say of strength"


# --- names -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("call", "message"), [
    (lambda t: t["strenght"], "strength"),
    (lambda t: t.means("lw"), "no factor 'lw'.*'law'"),
    (lambda t: t.paired("law", over="sed"), "no factor 'sed'.*'seed'"),
    (lambda t: t.paired("seed"), "each factor only once"),
    (lambda t: t.paired("law", over=3), "over = 3"),
    (lambda t: t.interaction("law", "strength"), "no factor 'strength'"),
    (lambda t: t.means("law")["peak"], "no column of single numbers 'peak'"),
    (lambda t: t.result(lav="A"), "no column 'lav'"),
    (lambda t: t.result(law="A"), "2 cases have law = 'A'"),
    (lambda t: t.result(law="A", seed=0), "law = A, seed = 0 has no run"),
    (lambda t: t.levels("status"), "no factor 'status'"),
])  # fmt: skip
def test_names_that_are_not_there_are_answered(tmp_path, call, message):
    table = peaks({(law, seed): 1.0 for law in "AB" for seed in range(2)}, tmp_path / "s")
    with pytest.raises(gl.ParameterError, match=message):
        call(table)


def test_measures_are_shown_in_their_own_units(tmp_path):
    rows = [row({"seed": s}, {}, measures={"failure_plane_angle": math.pi / 3, "crack_damage": 8e7}) for s in range(2)]
    table = table_of(rows, tmp_path / "s")
    assert "failure plane angle (deg)" in str(table.means()["failure_plane_angle"])
    assert " 60 " in str(table.means()["failure_plane_angle"])
    assert "crack damage (MPa)" in str(table)
    assert level("seed", 12345678) == "12345678"
    assert level("seed", 1234567.8) == "1.23457e+06"
    assert level("tensile_strength", 12345678) == "12.3457"
    assert level("tensile_strength", True) == "True"
    assert level("tensile_strength", 13e6) == "13"


def test_a_factor_may_have_the_name_of_a_result_that_is_the_factor(tmp_path):
    table = table_of([row({"confinement": 1e7}, {"confinement": 1e7, "strength": 2e8})], tmp_path / "s")
    assert table["confinement"] == [1e7]
    assert table["strength"] == [2e8]
    other = table_of([row({"confinement": 1e7}, measures={"confinement": 2e7})], tmp_path / "t")
    with pytest.raises(gl.ParameterError, match=r"'confinement' = 10000000\.0 has the name of a result of the tests"):
        print(other.rows)
