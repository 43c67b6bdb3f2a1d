"""Studies from the command line: cases of a file, what is finished, tables, what is refused."""

import csv
import importlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import FILE, LAWS, MINE, invoke, study_file
from law_sources import STIFFER
from matplotlib.image import imread
from study_rows import row, table_of

import grainlaw as gl
from grainlaw.cli.study import means
from grainlaw.cli.study_file import Factor, StudyFile, _names, _range, _recorded, case_of, factors, study_of
from grainlaw.columns import quantity_of
from grainlaw.fields import ParameterError
from grainlaw.laws import Linear
from grainlaw.studies.statistics import level
from grainlaw.studies.study import Status

cli = importlib.import_module("grainlaw.cli.study")


def rows_of(file, *options):
    place = file.with_suffix(".csv")
    result = invoke("study", "table", file, "--quick", "--csv", place, *options)
    assert result.exit_code == 0, result.output
    with place.open(newline="") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    file = study_file(tmp_path_factory.mktemp("study"), LAWS)
    result = invoke("study", file, "--quick", "--workers", 2)
    assert result.exit_code == 0, result.output
    return file, result.output


@pytest.mark.thorough
def test_means_over_the_seeds_are_printed(done):
    file, output = done
    peaks = [float(row["largest_stress"]) for row in rows_of(file) if row["law"] == "mine.py:Mine"]
    line = next(line for line in output.splitlines() if line.startswith("mine.py:Mine"))
    assert len(peaks) == 2
    found = line.split()
    at = found.index(f"{np.mean(peaks) / 1e6:.2f}")
    assert found[1] == "2"
    half = 12.7062 * np.std(peaks, ddof=1) / np.sqrt(2) / 1e6  # Student's quantile of one degree of freedom
    assert found[at + 1 : at + 3] == ["±", f"{half:.2f}"]
    assert "4 cases: 4 finished, none failed, 0 missing" in output
    assert f"written to {file.with_suffix('')}{os.sep}" in output


def test_means_are_in_the_units_of_measures(tmp_path):
    rows = [row({"law": "a", "seed": n}, {"strength": 2e8}, measures={"crack_damage": n * 1e8}) for n in (1, 1.02)]
    printed = means(table_of(rows, tmp_path / "s"), ["law"])
    assert "crack damage (MPa)" in printed
    assert "101 ± 12.71" in printed  # of two: 12.706 times half of their difference
    rows.append(row({"law": "a", "seed": 3}, {"strength": 2e8}))
    line = means(table_of(rows, tmp_path / "t"), ["law"]).splitlines()[2]
    assert line.split()[:2] == ["a", "3"]
    assert "101 ± 12.71 (2)" in line  # it is not in the third


def test_the_table_is_printed_where_no_case_has_another_seed(tmp_path):
    rows = [row({"law": law, "seed": 1}, {"strength": 2e8}) for law in "ab"]
    table = table_of(rows, tmp_path / "s")
    assert means(table, ["law"]) == str(table)
    none = table_of([row({"law": "a", "seed": n}, {}) for n in (1, 2)], tmp_path / "t")
    assert means(none, ["law"]) == str(none)


@pytest.mark.parametrize(
    ("level", "recorded"),
    [("7", 7), (" -8 ", -8), ("10 MPa", 10e6), ("2.5", 2.5), ("30 deg", 30), ("mohr-coulomb", "mohr-coulomb"),
     (3, 3), (0.5, 0.5), (True, True), ({"a": 1}, "{a = 1}"), ([1, 2], "[1, 2]")],
)  # fmt: skip
def test_what_a_table_records_of_a_level(level, recorded):
    found = _recorded(level)
    assert (found, type(found)) == (recorded, type(recorded) if level != "30 deg" else float)


def test_a_range_has_as_many_levels_as_it_counts_wherever_it_begins(monkeypatch):
    assert _range("seed", " 98 .. 100 ") == [98, 99, 100]
    monkeypatch.setattr("grainlaw.cli.study_file.MOST", 4)
    assert _range("seed", "98..101") == [98, 99, 100, 101]
    assert _range("seed", "-3..0") == [-3, -2, -1, 0]
    for text in ("98..102", "-3..1"):
        with pytest.raises(gl.ParameterError, match=rf"^seed = '{text}' is not allowed, it may have 4 levels at most"):
            _range("seed", text)


@pytest.mark.parametrize(
    ("vary", "words"),
    [
        ({}, "a study needs a table [vary]"),
        ("sample", "a study needs a table [vary]"),
        ({"sample": [1, 2]}, "vary: 'sample' is not allowed, it must be a key such as 'sample.seed'"),
        ({"sample.": [1, 2]}, "vary: 'sample.' is not allowed, it must be a key such as 'sample.seed'"),
        ({"law.spread..seed": [1]}, "vary: 'law.spread..seed' is not allowed, it must be a key such as 'sample.seed'"),
        ({"law": {"type": ["a"]}, "law.type": ["b"]}, "vary: 'law.type' is given twice"),
    ],
)
def test_what_is_no_key_that_is_varied_is_refused(vary, words):
    with pytest.raises(gl.ParameterError, match=f"^granite.toml: {re.escape(words)}"):
        factors(vary, Path("granite.toml"))


def test_a_case_has_no_value_that_is_varied_or_decides_nothing():
    """An edit of it would make all cases anew."""
    sections = {
        "sample": {"seed": 3, "grains": 20},
        "numerics": {"threads": 2, "refinement": 1},
        "test": {"type": "creep"},
    }
    case = case_of(sections, {"seed": ("sample", "seed"), "test": ("test", "type")})
    assert case.sections == {"sample": {"grains": 20}, "numerics": {"refinement": 1}, "test": {}}
    assert sections["sample"]["seed"] == 3


def test_means_are_over_what_ends_in_a_seed_at_any_depth(tmp_path):
    places = [("law", "type"), ("sample", "seed"), ("test", "loading", "speed"), ("law", "spread", "seed")]
    chosen = [Factor(".".join(place), place, {}) for place in places]
    file = StudyFile(tmp_path / "granite.toml", gl.Study(lambda: None), chosen, [])
    assert file.over == ["sample.seed", "law.spread.seed"]
    assert file.by == ["law.type", "test.loading.speed"]


def test_a_file_is_a_study_of_its_cases(tmp_path):
    vary = 'law = ["linear", "mine.py:Mine"]\n"law.kn" = ["100 TPa/m", 2e13]\n"sample.seed" = "1..3"\n'
    file = study_file(tmp_path, vary)
    chosen = study_of(file, ["law.ks=3e13"], quick=True)
    assert (chosen.over, chosen.by, chosen.folder) == (["seed"], ["law", "kn"], tmp_path / "granite")
    assert (len(chosen.study), chosen.study.design.names) == (12, ("law", "kn", "seed"))
    assert chosen.options == ["--set", "law.ks=3e13", "--quick"]
    run = chosen.study.case(law="linear", kn=1e14, seed=3)
    assert run.law == Linear(kn=1e14, ks=3e13)
    assert (run.time_step_factor, run.mass_scaling) == (0.9, 1.5)
    assert run.protocol.maximum_strain == 0.0001
    other = chosen.study.case(law="linear", kn=1e14, seed=2)
    assert run.specimen.grains.count == other.specimen.grains.count == 12
    assert not np.array_equal(run.specimen.grains.vertices, other.specimen.grains.vertices)


@pytest.fixture
def stored(tmp_path, monkeypatch):
    """A study of six cases, of which three failed, in place of that of a file; the calls of its ``run``."""
    cases = [({"law": law, "seed": n}, {"strength": n * 1e6}) for law in "ab" for n in (1, 2, 3)]
    rows = [row(*case) for case in cases[:3]]
    rows += [row(factors, {}, kind, f"{kind} {factors['seed']}") for (factors, _), kind in zip(
        cases[3:], ("unstable", "refused", "unstable"), strict=True)]  # fmt: skip
    table = table_of(rows, tmp_path / "s")
    calls = []
    ours = SimpleNamespace(
        table=lambda folder: table, status=lambda folder: Status(6, 3, {"unstable": 2, "refused": 1}, 0),
        run=lambda folder, **options: calls.append((folder, options)) or table,
    )  # fmt: skip
    chosen = SimpleNamespace(
        study=ours, folder=tmp_path / "granite", file=tmp_path / "granite.toml", by=["law"], over=["seed"],
        try_first=lambda: [],
    )  # fmt: skip
    monkeypatch.setattr(cli, "study_of", lambda file, assignments, quick: chosen)
    return table, calls, tmp_path


REASONS = "\n2 unstable, the first law = b, seed = 1: unstable 1\n1 refused, the first law = b, seed = 2: refused 2"


def test_the_table_is_printed_or_written(stored):
    table, _, folder = stored
    csv_file, parquet = folder / "t.csv", folder / "t.parquet"
    assert invoke("study", "table", "x.toml").output == f"{table}\n"
    assert invoke("study", "table", "x.toml", "--csv", csv_file).output == f"6 cases written to {csv_file}\n"
    assert len(csv_file.read_text().splitlines()) == 7
    both = invoke("study", "table", "x.toml", "--csv", csv_file, "--parquet", parquet).output
    assert both == f"6 cases written to {csv_file}, {parquet}\n"
    assert parquet.exists()


def test_the_first_column_that_the_table_shows_is_drawn(stored, monkeypatch):
    """Of a test of one's own, which has no strength, too."""
    _, _, folder = stored
    own = table_of([row({"law": law}, {"relief": 2e6}) for law in "ab"], folder / "own")
    ours = SimpleNamespace(study=SimpleNamespace(table=lambda _: own), folder=folder / "own", over=["law"])
    monkeypatch.setattr(cli, "study_of", lambda file, assignments, quick: ours)
    assert invoke("study", "plot", "x.toml").output == f"written to {folder / 'own' / 'relief.png'}\n"


def test_what_a_study_ran_and_why_cases_failed_is_said(stored):
    table, calls, folder = stored
    done = invoke("study", "x.toml", "--workers", 3, "--shard", "2/5", "--out", folder)
    assert calls == [(folder, {"on": None, "workers": 3, "shard": (2, 5)})]
    assert done.exit_code == 1
    status = "6 cases: 3 finished, 1 refused, 2 unstable, 0 missing"
    assert means(table, ["law"]) in done.output
    assert f"\n{status}\n" in done.output
    assert f"3 of 6 cases failed{REASONS}" in done.output
    assert invoke("study", "status", "x.toml").output == f"{status}{REASONS}\n"


@pytest.mark.parametrize("shard", ["0/3", "4/3", "1/0", "3", "a/b", "-1/3"])
def test_what_is_no_shard_is_refused(shard, stored):
    assert "is not allowed, it must be a number and of how many" in " ".join(
        invoke("study", "x.toml", "--shard", shard).output.replace("│", "").split()
    )
    assert stored[1] == []
    assert invoke("study", "x.toml", "--shard", "3/3", "--out", stored[2]).exit_code == 1  # of its failed cases


@pytest.mark.thorough
def test_a_case_is_the_test_of_the_same_file(done, tmp_path):
    file, _ = done
    alone = tmp_path / "alone.toml"
    alone.write_text(FILE.replace("[vary]", "[law]\ntype = 'mine.py:Mine'\n").replace("grains", "seed = 2\ngrains"))
    for name in ("mine.py", "helper.py"):
        (tmp_path / name).write_text((file.parent / name).read_text())
    call = ("test", "uniaxial-compression", "--quick", "--config", alone, "--out", tmp_path / "out", "--threads", 1)
    assert invoke(*call).exit_code == 0
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())["properties"]
    row = next(row for row in rows_of(file) if (row["law"], row["seed"]) == ("mine.py:Mine", "2"))
    for name in ("largest_stress", "apparent_modulus", "steps", "energy_error"):
        assert float(row[name]) == summary[name]


@pytest.mark.thorough
def test_an_edited_law_is_another_case_and_an_edited_comment_is_not(done, tmp_path, monkeypatch):
    source, _ = done
    file = study_file(tmp_path, LAWS)
    status = lambda: invoke("study", "status", "granite.toml", "--quick", "--out", source.with_suffix("")).output  # noqa: E731
    monkeypatch.chdir(tmp_path)  # nor does it matter where the file lies, and how it is called
    assert "4 finished, none failed, 0 missing" in status()
    (tmp_path / "mine.py").write_text(MINE.replace("by the helper", "times"))
    file.write_text(f"# granite\n{file.read_text()}")
    assert "4 finished, none failed, 0 missing" in status()
    (tmp_path / "helper.py").write_text("def times(a, b):\n    return b * a\n")
    assert "2 finished, none failed, 2 missing" in status()
    (tmp_path / "helper.py").write_text("def times(a, b):\n    return a * b\n")
    (tmp_path / "mine.py").write_text(MINE.replace("4e13", "3e13"))
    assert "2 finished, none failed, 2 missing" in status()
    assert "0 finished, none failed, 4 missing" in invoke(
        "study", "status", "granite.toml", "--out", source.with_suffix("")).output  # fmt: skip


@pytest.mark.thorough
def test_what_is_finished_is_not_run_again(done, tmp_path):
    file, _ = done
    before = {path: path.stat().st_mtime_ns for path in file.with_suffix("").rglob("*.json")}
    more = study_file(tmp_path, LAWS.replace("1..2", "1..3"))
    result = invoke("study", more, "--quick", "--out", file.with_suffix(""))
    assert "6 cases: 6 finished" in result.output
    assert before.items() <= {path: path.stat().st_mtime_ns for path in file.with_suffix("").rglob("*.json")}.items()


@pytest.mark.thorough
def test_quantities_are_numbers_of_the_table_and_keys_may_be_inside(tmp_path):
    vary = 'law.tensile_strength = ["10 MPa", "13 MPa"]\n'
    file = study_file(tmp_path, vary + '"test.loading" = [{type = "constant", speed = "0.2 m/s"}]')
    result = invoke("study", file, "--quick", "--set", "law.type=mohr-coulomb")
    assert result.exit_code == 0, result.output
    assert result.output.splitlines()[0].startswith("tensile strength (MPa)")
    rows = rows_of(file, "--set", "law.type=mohr-coulomb")
    assert [float(row["tensile_strength"]) for row in rows] == [10e6, 13e6]
    assert {row["loading"] for row in rows} == {'{type = "constant", speed = "0.2 m/s"}'}
    assert level("loading", rows[0]["loading"]) == "type constant, speed 0.2 m/s"  # in tables and pictures
    text = invoke("study", "table", file, "--quick", "--set", "law.type=mohr-coulomb").output
    assert [line.split()[0] for line in text.splitlines()[2:4]] == ["10", "13"]


@pytest.mark.thorough
def test_what_the_missing_cases_cost_is_told_before(done, tmp_path):
    file, _ = done
    more = study_file(tmp_path, LAWS.replace('"1..2"', "[1, 2, 9]"))
    output = invoke("study", "estimate", more, "--quick", "--out", file.with_suffix("")).output
    assert output.startswith("2 cases: about ")
    assert "(from finished cases)" in output
    assert "(from a probe)" in invoke("study", "estimate", more, "--quick").output
    assert not more.with_suffix("").exists()


@pytest.mark.thorough
def test_portable_cases_are_others(done, monkeypatch):
    file, _ = done
    """In another process: this one has compiled what is not portable."""
    monkeypatch.delenv("GRAINLAW_PORTABLE", raising=False)
    call = [sys.executable, "-m", "grainlaw", "study", "status", file, "--quick", "--portable"]
    output = subprocess.run(call, capture_output=True, text=True).stdout
    assert "0 finished, none failed, 4 missing" in output


@pytest.mark.thorough
def test_shards_are_parts_of_one_study(tmp_path):
    file = study_file(tmp_path, '"sample.seed" = "1..3"\n')
    assert "3 cases: 2 finished, none failed, 1 missing" in invoke("study", file, "--quick", "--shard", "1/2").output
    assert {row["seed"] for row in rows_of(file)} == {"1", "3"}
    assert "3 cases: 3 finished, none failed, 0 missing" in invoke("study", file, "--quick", "--shard", "2/2").output


@pytest.mark.thorough
def test_cases_that_fail_are_told_and_not_tried_again(tmp_path):
    file = study_file(tmp_path, 'law = ["linear", "mine.py:Stiffer"]', FILE.replace("0.0001", "0.0002"))
    (tmp_path / "mine.py").write_text(STIFFER)
    call = "study", file, "--quick", "--set", "sample.grains=20", "--set", "test.loading={type='constant',speed=0.05}"
    for _ in range(2):
        result = invoke(*call)
        assert result.exit_code == 1
        words = " ".join(result.output.split())
        assert "2 cases: 1 finished, 1 unstable, 0 missing" in words
        assert "Error: 1 of 2 cases failed 1 unstable, the first law = mine.py:Stiffer: " in words
    assert "1 unstable, the first law" in invoke("study", "status", *call[1:]).output
    assert [row["status"] for row in rows_of(*call[1:])] == ["finished", "unstable"]


@pytest.mark.thorough
def test_pictures_and_a_report_are_study_file(done, tmp_path):
    file, _ = done
    written = file.with_suffix("") / "largest_stress.png"  # they have no strength, they did not fail
    assert f"written to {written}" in invoke("study", "plot", file, "--quick").output
    assert min(imread(written).shape[:2]) > 200
    result = invoke("study", "plot", file, "--quick", "--column", "modulus", "--to", tmp_path / "m.svg")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "m.svg").read_text().startswith("<?xml")
    for options, words in (
        (["--column", "strenght"], "did you mean 'strength'?"),
        (["--to", tmp_path / "m.abc"], "its ending must be one of"),
    ):
        result = invoke("study", "plot", file, "--quick", *options)
        assert result.exit_code == 2
        assert words in " ".join(result.output.split())
    assert invoke("study", "report", file, "--quick").exit_code == 0
    page = (file.with_suffix("") / "report.html").read_text()
    assert "mine.py:Mine" in page
    assert invoke("study", "report", file, "--quick", "--to", tmp_path / "none" / "r.html").exit_code == 1


@pytest.mark.thorough
def test_nothing_is_drawn_of_nothing(done, tmp_path):
    file = study_file(tmp_path, LAWS.replace("1..2", "5..6"))
    result = invoke("study", "plot", file, "--quick", "--out", done[0].with_suffix(""))
    assert result.exit_code == 2
    assert "no case of" in result.output


# --- what is refused -------------------------------------------------------------------------------------------------


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("vary", "options", "words"),
    [
        ("", [], 'a study needs a table [vary], such as "sample.seed" = "1..20"'),
        ('"sampel.seed" = "1..3"', [], "there is no section 'sampel'; did you mean 'sample'?"),
        ('sample = "1..3"', [], "vary: 'sample' is not allowed, it must be a key such as 'sample.seed'"),
        ('"sample.sed" = "1..3"', [], "there is no 'sample.sed'; did you mean 'seed'?"),
        ('"sample.seed" = "20..1"', [], "sample.seed = '20..1' is not allowed: the range is empty, 1 is below 20"),
        ('"sample.seed" = "1..9999999999"', [], "it may have 1,000,000 levels at most"),
        ('"sample.seed" = ""', [], "sample.seed = '' is not allowed, it must be a list such as"),
        ('"sample.seed" = []', [], "sample.seed has no levels"),
        ('"sample.seed" = 3', [], "sample.seed = 3 is not allowed, it must be a list such as"),
        ('"sample.seed" = [1, -1]', [], "seed = -1 is refused: Voronoi: seed = -1 is not"),
        ('"rock.density" = ["3 g/cm3", 3000]', [], "it has the same level twice"),
        ('"law.cohesion" = ["29 MPa", "9 mm"]', [], "cohesion = 0.009 is refused: law.cohesion = '9 mm'"),
        ('law = ["linear", "mohr-colomb"]', [], "did you mean 'mohr-coulomb'?"),
        ('law = ["linear", "yours.py:Yours"]', [], "law.type = 'yours.py:Yours' is refused: there is no file"),
        ('law = ["linear", "mine.py:My"]', [], "there is no 'My' in"),
        ('law = ["linear"]\n"law.type" = ["linear"]', [], "vary: 'law.type' is given twice"),
        ('test = ["uniaxial-compresion"]', [], "did you mean 'uniaxial-compression'?"),
        ('"numerics.threads" = [1, 2]', [], "vary: 'numerics.threads' is not allowed, it does not decide a result"),
        ('"sample.seed" = "1..3"', ["--shard", "5/3"], "--shard = '5/3' is not allowed"),
        ('"sample.seed" = "1..3"', ["--shard", "half"], "--shard = 'half' is not allowed"),
        ('"sample.seed" = "1..3"', ["--workers", "0"], "workers = 0 is not allowed"),
        ('"sample.seed" = "1..3"', ["--set", "law.knn=3"], "there is no 'law.knn'; did you mean 'kn'?"),
        ('"sample.seed" = "1..3"', ["--set", "test.type=pull"], "there is no test 'pull'"),
        ('"sample.seed" = "1..3"', ["--on", "tcp://127.0.0.1:9"], "no Dask scheduler answers at 'tcp://127.0.0.1:9'"),
    ],
    ids=lambda value: value if isinstance(value, str) and len(value) < 40 else "",
)  # fmt: skip
def test_refusals_are_one_line_before_anything_runs(vary, options, words, tmp_path):
    file = study_file(tmp_path, vary)
    result = invoke("study", file, "--quick", *options)
    assert result.exit_code == 2, result.output
    assert words in " ".join(result.output.split())
    assert "Traceback" not in result.output
    assert not list(tmp_path.rglob("*.npz"))


def test_a_test_must_be_named(tmp_path):
    file = study_file(tmp_path, '"sample.seed" = "1..3"', "[vary]\n")
    result = invoke("study", file)
    assert result.exit_code == 2
    assert 'the test is missing: [test] type = "...", one of uniaxial-compression' in " ".join(result.output.split())


def test_the_status_of_a_file_that_has_no_folder_because_of_a_key_names_the_key(tmp_path):
    file = study_file(tmp_path, '"sample.sed" = [1, 2]')
    assert "'sample.sed'; did you mean 'seed'?" in " ".join(invoke("study", "status", file).output.split())


@pytest.mark.thorough
@pytest.mark.parametrize("command", ["run", "status", "table", "plot", "report"])
def test_folders_that_are_no_store_are_refused(command, done, tmp_path):
    file, other = done[0], tmp_path / "other"
    other.mkdir()
    (other / "letter.txt").write_text("dear friend")
    result = invoke("study", command, file, "--quick", "--out", other)
    assert result.exit_code == 2
    assert "no store of a study" in " ".join(result.output.split())
    (other / "study.json").write_text('{"format": 99}')
    result = invoke("study", command, file, "--quick", "--out", other)
    assert result.exit_code == 2
    assert "is a store of format 99" in " ".join(result.output.split())
    assert (other / "letter.txt").read_text() == "dear friend"


def test_help_tells_the_commands():
    text = invoke("study", "--help").output
    for name in ("run", "status", "table", "plot", "report", "slurm"):
        assert f"\n  {name} " in text
    assert "--shard" in invoke("study", "run", "--help").output
    assert invoke("study").exit_code != 0


def test_a_range_has_both_ends_and_a_million_levels_at_most():
    assert _range("seed", " -2 .. +1 ") == [-2, -1, 0, 1]
    assert _range("seed", "5000000..5000001") == [5_000_000, 5_000_001]
    assert len(_range("seed", "1..1000000")) == 1_000_000
    for wrong, words in (("0..1000000", "1,000,000 levels at most"), ("2..1", "the range is empty, 1 is below 2")):
        with pytest.raises(ParameterError, match=words):
            _range("seed", wrong)


def test_means_are_over_what_is_called_a_seed_wherever_it_stands():
    places = [("law", "law", "seed"), ("seed", "law"), ("sample", "seed"), ("law", "type")]
    chosen = StudyFile(Path("a.toml"), None, [Factor("-".join(place), place, {}) for place in places], [])
    assert (chosen.over, chosen.by) == (["law-law-seed", "sample-seed"], ["seed-law", "law-type"])


def test_factors_have_the_key_without_its_section_where_no_other_has():
    places = [("sample", "seed"), ("test", "loading", "speed"), ("law", "type"), ("law", "kn"), ("rock", "kn")]
    assert list(_names(dict.fromkeys(places)).values()) == ["seed", "loading.speed", "law", "law.kn", "rock.kn"]
    mica, rock = _names(dict.fromkeys([("rocks", "mica", "youngs_modulus"), ("rock", "youngs_modulus")])).values()
    assert (quantity_of(mica).heading, quantity_of(rock).heading) == ("mica E (GPa)", "E (GPa)")
