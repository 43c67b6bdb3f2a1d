"""What a comparison of laws writes: a table, a summary, curves and pictures."""

import csv
import json
import re
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from matplotlib.image import imread
from support import BRITTLE, PULL, STIFF, small_sample

import grainlaw as gl
from grainlaw.drawing.figure import Figure
from grainlaw.laws import Linear
from grainlaw.results.figures import cracks
from grainlaw.runs import parallel
from grainlaw.runs.parallel import simulate_all

KEYS = {
    "strength", "failure_strain", "apparent_modulus", "apparent_poisson", "modulus", "poisson", "tensile_cracks",
    "shear_cracks", "steps", "seconds", "time_step", "energy_error", "energy_made",
    "kinetic_ratio", "imbalance",
}  # fmt: skip


@pytest.fixture(scope="module")
def comparison():
    laws = {"linear": Linear(**STIFF), "brittle": BRITTLE}
    return gl.compare(small_sample(20), laws, attrs.evolve(PULL, samples=20), threads=1, frames=4)


@pytest.fixture(scope="module")
def folder(comparison, tmp_path_factory):
    path = tmp_path_factory.mktemp("comparison")
    comparison.write(path, {"seed": 1, "missing": float("nan"), "array": [np.float64(2), np.int64(3)]})
    return path


def test_comparison_is_a_mapping_that_prints_a_table(comparison):
    assert list(comparison) == ["linear", "brittle"]
    assert len(comparison) == 2
    lines = str(comparison).splitlines()
    assert lines[0].split() == ["linear", "brittle"]
    assert len({len(line) for line in lines if "brittle: " not in line}) == 1  # but for doubts
    assert lines[2].split()[:3] == ["strength", "(MPa)", "-"]  # what cannot break has no strength
    assert lines[2].split()[-1] == f"{comparison['brittle'].summary['strength'] / 1e6:.2f}"
    with pytest.raises(KeyError, match=r"there is no run 'britle' \(there are: 'linear', 'brittle'\)"):
        comparison["britle"]


def test_the_peak_of_a_specimen_that_had_not_failed_is_open_in_every_table(comparison):
    """Its strength is more than what was reached; that of the one that failed is as measured."""
    other = comparison["brittle"]
    one = gl.simulate(other.specimen, other.law, attrs.evolve(other.protocol, maximum_strain=5e-5), frames=1)
    whole, failed = f"{one.summary['largest_stress'] / 1e6:.2f}", f"{other.summary['strength'] / 1e6:.2f}"
    comparison = type(comparison)({"linear": one, "brittle": other})
    every = gl.Comparison({("a", 1): one, ("a", 2): one, ("b", 1): other, ("b", 2): other})
    for of in (comparison, every):
        [line] = [line for line in str(of).splitlines() if line.startswith("strength")]
        assert re.findall(r"> [\d.]+|[\d.]+", line) == [f"> {whole}", failed]
    assert f"> {whole}" in one._repr_html_().replace("&gt;", ">")
    assert f"> {failed}" not in other._repr_html_().replace("&gt;", ">")


def test_summary_is_json_with_every_key(comparison, folder):
    def refuse(constant):
        raise AssertionError(constant)

    content = json.loads((folder / "summary.json").read_text(), parse_constant=refuse)
    assert set(content["laws"]) == {"linear", "brittle"}
    for name, summary in content["laws"].items():
        assert set(summary) >= KEYS
        assert summary["largest_stress"] == comparison[name].summary["largest_stress"]
        assert summary["steps"] == comparison[name].curves["step"][-1]
    assert (content["seed"], content["missing"], content["array"]) == (1, None, [2, 3])


def test_curves_are_all_there(comparison, folder):
    with (folder / "curves.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    for name, result in comparison.items():
        mine = [row for row in rows if row["law"] == name]
        assert len(mine) == len(result.curves["time"])
        for column, values in result.curves.items():
            assert np.allclose([float(row[column]) for row in mine], values, rtol=1e-8, equal_nan=True), column


@pytest.mark.parametrize("name", ["comparison", "cracks_linear", "cracks_brittle"])
def test_pictures_are_drawn(folder, name):
    picture = imread(folder / f"{name}.png")
    height, width = picture.shape[:2]
    assert 400 < height < 4000
    assert 400 < width < 4000
    assert 0.01 < (picture[..., :3] < 0.95).any(axis=-1).mean() < 0.9  # neither blank nor filled


def test_nothing_else_is_written(folder):
    names = {"comparison.png", "cracks_linear.png", "cracks_brittle.png", "curves.csv", "summary.json"}
    assert {file.name for file in folder.iterdir()} == names


# --- laws that fail --------------------------------------------------------------------------------------------------


class Overturned(gl.Observer):
    """Breaks one of several runs after some samples."""

    def __init__(self, error):
        self.error, self.samples = error, 0

    def observe(self, state, curves, stage, progress):
        self.samples += 1
        if self.samples == 5:
            raise self.error


@pytest.mark.thorough
@pytest.mark.parametrize("threads", [1, 2])
def test_a_law_that_fails_leaves_the_others_and_its_reason(threads, tmp_path, comparison):
    laws = {"bad": BRITTLE, "linear": Linear(**STIFF)}
    watchers = {"bad": [Overturned(gl.InstabilityError("it broke"))], "linear": []}
    found = gl.compare(
        small_sample(20), laws, attrs.evolve(PULL, samples=20), threads=threads, frames=4,
        observers=watchers.__getitem__, checkpoint=tmp_path,
    )  # fmt: skip
    assert list(found) == ["linear"]
    assert np.array_equal(found["linear"].curves["stress"], comparison["linear"].curves["stress"])
    with pytest.raises(gl.InstabilityError, match="it broke"):
        found["bad"]
    lines = str(found).splitlines()
    assert lines[0].split() == ["linear", "bad"]
    assert lines[2].split()[-1] == "failed"
    assert lines[-1] == "bad failed: it broke"
    found.write(tmp_path)
    assert json.loads((tmp_path / "summary.json").read_text())["failed"] == {"bad": "it broke"}
    found.write_report(tmp_path / "report.html")
    assert "bad: it broke" in (tmp_path / "report.html").read_text()
    assert json.loads((tmp_path / "bad" / "run.json").read_text())["status"] == "it broke"
    assert len((tmp_path / "bad" / "curves.csv").read_text().splitlines()) == 1 + 5


def test_if_all_laws_fail_the_first_error_is_raised():
    with pytest.raises(gl.StageError, match="first"):
        gl.compare(
            small_sample(20), {"one": BRITTLE, "two": BRITTLE}, PULL, threads=1,
            observers=lambda name: [Overturned(gl.StageError("first" if name == "one" else "second"))],
        )  # fmt: skip


def test_a_law_that_is_refused_stops_the_comparison():
    class Refuses(gl.Observer):
        def observe(self, state, curves, stage, progress):
            raise gl.ParameterError("not so")

    with pytest.raises(gl.ParameterError, match="not so"):
        gl.compare(
            small_sample(20), {"one": BRITTLE, "two": BRITTLE}, PULL, threads=1,
            observers=lambda name: [Refuses()] if name == "one" else [],
        )  # fmt: skip


@pytest.mark.thorough
def test_a_stopped_comparison_has_what_is_finished(tmp_path):
    stop, order = gl.Stop(), []

    class AskInTheSecond(gl.Observer):
        def observe(self, state, curves, stage, progress):
            stop.ask("it is late")

    def observers(name):
        order.append(name)
        return [AskInTheSecond()] if len(order) == 2 else []

    laws = {"one": BRITTLE, "two": Linear(**STIFF), "three": BRITTLE}
    with pytest.raises(gl.Stopped, match="it is late") as stopped:
        gl.compare(small_sample(20), laws, PULL, threads=1, observers=observers, stop=stop, checkpoint=tmp_path)
    assert order[0] == "two"  # nothing breaks: it takes longest
    assert list(stopped.value.result) == order[:1]
    assert json.loads((tmp_path / "run.json").read_text())["status"] == "it is late"
    again = gl.compare(small_sample(20), laws, PULL, threads=1, observers=lambda name: (
        [AskInTheSecond()] if name == order[1] else []), checkpoint=tmp_path, restart=True)  # fmt: skip
    whole = gl.compare(small_sample(20), laws, PULL, threads=1)
    for name, result in whole.items():
        assert np.array_equal(result.curves["stress"], again[name].curves["stress"])


def test_no_runs_are_refused():
    with pytest.raises(gl.ParameterError, match="simulate_all: runs is empty"):
        simulate_all({})


def test_nothing_is_not_compared():
    for specimen, laws, words in (
        (small_sample(6), {}, "laws is empty"),
        ({}, {"brittle": BRITTLE}, r"specimen = \{\} is not allowed"),
    ):
        with pytest.raises(gl.ParameterError, match=words):
            gl.compare(specimen, laws, PULL)


def test_cracks_are_drawn_in_the_last_frame(comparison, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(cracks, "plot_cracks", lambda result, frame=-1, **_: drawn.append((result, frame)) or Figure())
    comparison.write(tmp_path)
    assert drawn == [(comparison["linear"], -1), (comparison["brittle"], -1)]


@pytest.mark.parametrize(("threads", "order"), [(1, "cab"), (2, "cab"), (3, "abc"), (4, "abc")])
def test_what_takes_longest_begins_first_where_runs_must_wait(threads, order, monkeypatch):
    """Of three runs, where there are fewer threads."""
    begun = []

    class Pool(ThreadPoolExecutor):
        def submit(self, do, key):
            begun.append(key)
            return super().submit(do, key)

    monkeypatch.setattr(parallel, "ThreadPoolExecutor", Pool)
    monkeypatch.setattr(parallel, "_longest_first", lambda runs, options: list("cab"))
    run = SimpleNamespace(
        specimen=SimpleNamespace(mesh=0, zone_stiffness=0, node_masses=0), simulate=lambda **given: given["observers"]
    )
    found = parallel._all(
        dict.fromkeys("abc", run), threads, lambda key: [key], dict.fromkeys("abc"), gl.Stop(), {}
    )  # fmt: skip
    assert begun == list(order)
    assert found.results == {key: [key] for key in "abc"}
