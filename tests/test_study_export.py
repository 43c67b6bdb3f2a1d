"""The table of a study in other forms: pandas, xarray, CSV, parquet, and without these libraries."""

import csv
import itertools
import math
import sys

import numpy as np
import pandas
import pytest
from study_rows import row, table_of

import grainlaw as gl
from grainlaw.results.tables import as_csv, write_curves
from grainlaw.studies.table import Table


@pytest.fixture
def mixed(tmp_path):
    """Factors of texts and of numbers, a quantity that one case lacks, and a case that failed."""
    keys = list(itertools.product(("A", "B"), (1.25e7, 1.3e7), (1, 2)))
    rows = [
        row(
            dict(zip(("law", "strength", "seed"), k, strict=True)),
            {"largest_stress": 1e8 / 3 * k[2] + k[1], "steps": 7},
        )
        for k in keys[:-1]
    ]
    failed = row(dict(zip(("law", "strength", "seed"), keys[-1], strict=True)), {}, "refused", 'a "quoted",\nreason')
    return table_of([*rows, failed], tmp_path / "s")


def test_latex_has_all_rows_with_three_digits(mixed):
    lines = mixed.to_latex().splitlines()
    assert lines[0] == r"\begin{tabular}{lllr}"
    assert lines[2] == r"law & strength (MPa) & seed & largest stress (MPa) \\"
    assert lines[4] == r"A & 12.5 & 1 & 45.8 \\"  # 100/3 + 12.5
    assert lines[11] == r"B & 13 & 2 & -- \\"
    assert len(lines) == 14


def test_means_and_differences_are_tables_for_a_paper(mixed):
    """Of 1e8 / 3 * seed + strength: seeds 1 and 2, one of which failed; strengths of 12.5 and 13 MPa."""
    lines = mixed.means("law", "strength")["largest_stress"].to_latex().splitlines()
    assert lines[0] == r"\begin{tabular}{lrrrr}"
    assert lines[2] == r"law, strength (MPa) & n & largest stress (MPa) & 95 \% & deviation \\"
    assert lines[4].startswith("A, 12.5 & 2 & 62.50 & $-149")  # (1.5 / 3) 1e8 + 12.5e6, and 1/sqrt(2) t 23.57 below
    lines = mixed.paired("strength")["largest_stress"].to_latex().splitlines()
    assert lines[2].startswith(r"law & levels & n & largest stress (MPa) & 95 \% & share & higher & p \\")
    assert lines[4].startswith("A & 13 - 12.5 & 2 & 0.50 & 0.50 to 0.50 & ")


def test_a_study_is_read_from_its_folder_alone(mixed, tmp_path):
    """In the order of factors, as it has that of no design."""
    read = gl.read_study(tmp_path / "s")
    assert read.factors == mixed.factors
    assert [(r["law"], r["strength"], r["seed"]) for r in read.rows] == [
        (r["law"], r["strength"], r["seed"]) for r in mixed.rows
    ]
    assert np.array_equal(read["largest_stress"], mixed["largest_stress"], equal_nan=True)
    with pytest.raises(gl.ParameterError, match="no store of a study"):
        gl.read_study(tmp_path)


@pytest.mark.parametrize(
    "lists", [[[1.0], [2.0]], [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], [[1.0], [2.0, 3.0]], [[], [2.0]]]
)
def test_lists_are_columns_of_their_numbers(lists, tmp_path):
    """As a modulus of each cycle, whose number need not be that of the parts of a tensor."""
    table = table_of([row({"seed": k}, {"moduli": each}) for k, each in enumerate(lists)], tmp_path / "s")
    table.write_csv(tmp_path / "s.csv")
    written = pandas.read_csv(tmp_path / "s.csv")
    for frame in (table.to_pandas(), written):
        for k in range(max(map(len, lists))):
            expected = [each[k] if k < len(each) else np.nan for each in lists]
            assert np.array_equal(frame[f"moduli_{k + 1}"].to_numpy(float), expected, equal_nan=True)
        assert "moduli" not in frame
    table.write_parquet(tmp_path / "s.parquet")
    assert "moduli_1" in table.to_xarray()


def test_of_cases_with_equal_factors_the_last_is_read(tmp_path):
    """As of a function before and after an edit: twice the same specimen would halve an interval."""
    rows = [row({"seed": seed}, {"strength": 1e6 * seed}) for seed in (1, 2)]
    edited = [{**each, "case": each["case"][::-1], "summary": {"strength": 5e6}} for each in rows[:1]]
    table_of([*rows, *edited], tmp_path)
    with pytest.warns(UserWarning, match="1 cases are left out, whose factors a later one has"):
        read = gl.read_study(tmp_path)
    assert read["strength"].tolist() == [5e6, 2e6]


def test_a_factor_that_came_later_is_none_before_and_no_case_counts_twice(tmp_path):
    """Seeds 1 and 2, then with a cohesion: of 29 it gives the runs of before, whose rows are left out."""
    before = [row({"seed": seed}, {"strength": 1e6 * seed}) for seed in (1, 2, 3)]
    after = [
        row({"seed": seed, "cohesion": level}, {"strength": 1e6 * seed}, cost={**before[0]["cost"], "bytes": 3})
        | {"run": before[seed - 1]["case"] if level == 29 else ""}
        for seed in (1, 2) for level in (29, 20)
    ]  # fmt: skip
    table_of([*before, *after], tmp_path, runs=[b"one", b"two", b"six"])
    with pytest.warns(UserWarning, match="2 cases are left out"):
        read = gl.read_study(tmp_path)
    assert [(each["seed"], each["cohesion"]) for each in read.rows] == [(1, 20), (1, 29), (2, 20), (2, 29), (3, None)]
    assert [(mean.group["cohesion"], mean.count) for mean in read.means("cohesion")["strength"]] == [
        (20, 2), (29, 2), (None, 1),
    ]  # fmt: skip
    assert len(read.where(cohesion=None)) == 1


def test_cases_of_several_versions_of_a_study_are_told(tmp_path):
    """Other seeds after an edit of the grains: their mean would be of two rocks."""
    rows = [row({"seed": seed}) | {"version": "new" if seed > 2 else "old"} for seed in (1, 2, 3)]
    table_of(rows, tmp_path)
    with pytest.warns(UserWarning, match=r"of 2 versions of the study \(2, 1\), whose specimens, laws or tests may"):
        gl.read_study(tmp_path)


def test_a_factor_without_a_limit_comes_before_one_with_it(tmp_path):
    table_of([row({"limit": level}) for level in ("none", 5, None, 2)], tmp_path)
    assert gl.read_study(tmp_path).levels("limit") == [None, 2, 5, "none"]


def test_pandas_has_numbers_where_the_table_has(mixed):
    frame = mixed.to_pandas()
    assert list(frame.columns) == list(mixed.columns)
    assert (frame["seed"].dtype.kind, frame["strength"].dtype.kind, frame["largest_stress"].dtype.kind) == (
        "i",
        "f",
        "f",
    )
    assert np.array_equal(frame["largest_stress"], mixed["largest_stress"], equal_nan=True)
    assert frame["reason"].iloc[-1] == 'a "quoted",\nreason'


@pytest.mark.parametrize("name", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1"])
def test_no_text_of_a_csv_is_a_formula(name, tmp_path):
    """Law names are a user's; numbers below 0 stay numbers."""
    table = table_of([row({name: name, "seed": -1}, {"strength": -2.5, name + "b": 1.0})], tmp_path / "s")
    table.write_csv(tmp_path / "t.csv")
    write_curves(tmp_path / "c.csv", {(name,): {"stress": np.array([-1.5]), name: np.zeros(1)}})
    (tmp_path / "a.csv").write_text(as_csv({name: np.array([-1.0]), "a,b": np.zeros(1)}))
    for file in ("t.csv", "c.csv", "a.csv"):
        with (tmp_path / file).open(newline="", encoding="utf-8") as stream:
            for cell in (cell for line in csv.reader(stream) for cell in line):
                assert not cell.startswith(("=", "+", "@", "\t", "\r"))
                assert not cell.startswith("-") or float(cell) < 0
    with (tmp_path / "a.csv").open(newline="") as stream:
        assert next(csv.reader(stream)) == ["'" + name.replace("\r", " "), "a,b"]


def test_curves_of_several_runs_stand_below_each_other(tmp_path):
    """A column that a run lacks is nan there, as long as the others."""
    runs = {("a", 1): {"time": np.array([0, 1.0]), "stress": np.array([2, 3.0])}, ("b", 2): {"strain": np.array([0.5])}}
    write_curves(tmp_path / "c.csv", runs | {("c", 3): {}}, names=("law", "seed"))
    assert (tmp_path / "c.csv").read_text().splitlines() == [
        "law,seed,time,stress,strain", "a,1,0.0,2.0,nan", "a,1,1.0,3.0,nan", "b,2,nan,nan,0.5",
    ]  # fmt: skip


def test_csv_is_read_again_with_the_same_bits(mixed, tmp_path):
    mixed.write_csv(tmp_path / "t.csv")
    with (tmp_path / "t.csv").open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    assert head == list(mixed.columns)
    column = [r[head.index("largest_stress")] for r in rows]
    assert [float(text) if text else math.nan for text in column] == pytest.approx(
        mixed["largest_stress"].tolist(), rel=0, abs=0, nan_ok=True
    )
    assert rows[-1][head.index("reason")] == 'a "quoted",\nreason'


@pytest.mark.parametrize("count", [40, 43])
def test_a_table_is_printed_with_forty_rows_and_its_doubts(count, tmp_path):
    """Of the cases that finished; how many more there are is said."""
    rows = [row({"seed": k}, {"force": 1.0}) | {"doubts": ["it vibrated"][: k % 2]} for k in range(count - 1)]
    rows.append(row({"seed": count}, {}, "refused", "too small") | {"doubts": ["it vibrated"]})
    table = table_of(rows, tmp_path / "s")
    doubted = list(range(1, count - 1, 2))
    assert table.doubts == {"it vibrated": doubted}
    head, rule, *lines = str(table).splitlines()
    assert len(head) == len(rule)
    more = ["... and 3 more"] if count == 43 else []
    assert lines[40:] == [
        *more, f"{len(doubted)} of {count} cases: it vibrated", f"seed = {count}: refused, too small"
    ]  # fmt: skip
    assert [line.split()[0] for line in lines[:39]] == list(map(str, range(39)))
    assert ("and 3 more" in table._repr_html_()) == bool(more)


def test_parquet_is_read_again_the_same(mixed, tmp_path):
    mixed.write_parquet(tmp_path / "t.parquet")
    again = pandas.read_parquet(tmp_path / "t.parquet")
    pandas.testing.assert_frame_equal(again, mixed.to_pandas())


def test_parquet_takes_levels_of_several_kinds(tmp_path):
    table = table_of([row({"size": level}, {"force": 1.0}) for level in ("all", 3, True)], tmp_path / "s")
    table.write_parquet(tmp_path / "t.parquet")
    assert pandas.read_parquet(tmp_path / "t.parquet")["size"].tolist() == ["all", "3", "True"]


def test_xarray_has_the_factors_as_axes(mixed):
    data = mixed.to_xarray()
    assert dict(data.sizes) == {"law": 2, "strength": 2, "seed": 2}
    for k in range(len(mixed) - 1):
        place = {name: mixed[name][k] for name in mixed.factors}
        assert float(data["largest_stress"].sel(place)) == mixed["largest_stress"][k]
    assert np.isnan(float(data["largest_stress"].sel(law="B", strength=1.3e7, seed=2)))


def test_places_without_a_case_are_empty(tmp_path):
    table = table_of([row({"a": k, "b": k}, {"force": 1.0}) for k in range(4)], tmp_path / "s")
    force = table.to_xarray()["force"]
    assert (force.shape, float(force.sum())) == ((4, 4), 4.0)


def test_cases_that_would_fill_an_array_with_nothing_are_refused(tmp_path):
    rows = [row({"a": k / 7, "b": k / 3, "c": k / 11}, {"force": 1.0}) for k in range(101)]
    table = table_of(rows, tmp_path / "s")
    with pytest.raises(gl.ParameterError, match="1,030,301 places"):
        table.to_xarray()
    with pytest.raises(gl.ParameterError, match="same levels"):
        Table([rows[0], rows[0]], ("a", "b", "c"), table.store).to_xarray()


@pytest.mark.parametrize(("name", "call", "message"), [
    ("pandas", lambda t, _: t.to_pandas(), "grainlaw\\[study\\]"),
    ("pandas", lambda t, _: t.to_xarray(), "grainlaw\\[study\\]"),
    ("xarray", lambda t, _: t.to_xarray(), "grainlaw\\[study\\]"),
    ("pyarrow", lambda t, folder: t.write_parquet(folder / "t.parquet"), "grainlaw\\[study\\]"),
])  # fmt: skip
def test_without_a_library_it_says_which(mixed, monkeypatch, tmp_path, name, call, message):
    for loaded in [module for module in sys.modules if module.split(".")[0] == name]:
        monkeypatch.setitem(sys.modules, loaded, None)
    monkeypatch.setitem(sys.modules, name, None)  # importing it fails
    with pytest.raises(gl.ParameterError, match=message):
        call(mixed, tmp_path)
    assert not list(tmp_path.glob("*parquet"))
    assert len(mixed.means("law")["largest_stress"]) == 2  # the rest is as before
    mixed.write_csv(tmp_path / "t.csv")
