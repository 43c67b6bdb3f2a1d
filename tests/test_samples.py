"""Laws on several samples: the same runs as one by one, means and ranges, and what is left of those that fail."""

import csv
import json
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from support import BRITTLE, PULL, STIFF, small_sample

import grainlaw as gl
from grainlaw.laws import Linear
from grainlaw.quantity import Quantity
from grainlaw.results.figures.curves import _draw_peaks
from grainlaw.results.means import mean_and_interval, mean_and_range, means

TEST = attrs.evolve(PULL, samples=20)
LAWS = {"linear": Linear(**STIFF), "brittle": BRITTLE}
SAMPLES = {1: small_sample(20, seed=1), 7: small_sample(20, seed=7)}


def test_means_and_intervals_by_hand():
    look, three = Quantity("load", factor=10.0, form=".1f"), np.array([1.0, 2.0, 3.0])
    assert mean_and_interval(look, three) == "20.0 (-4.8 to 44.8)"  # Student: 4.3027 / sqrt(3)
    assert mean_and_interval(look, np.append(three, np.nan)) == "20.0 (-4.8 to 44.8), 3 of 4"
    assert mean_and_interval(look, three[:1]) == "10.0"
    assert mean_and_interval(look, np.array([np.nan])) == "-"


@pytest.fixture(scope="module")
def found():
    return gl.compare(SAMPLES, LAWS, TEST, threads=2, frames=4)


@pytest.fixture(scope="module")
def folder(found, tmp_path_factory):
    path = tmp_path_factory.mktemp("samples")
    found.write(path, {"seeds": [1, 7]})
    found.write_report(path / "report.html")
    return path


def test_means_and_ranges_by_hand():
    three = [{"load": load, "count": 2, "all": [1, 2]} for load in (1.0, 4.0, 10.0)]
    assert means(three) == {"load": 5.0, "count": 2.0}
    look = Quantity("load", factor=10.0, form=".1f")
    three = [SimpleNamespace(summary=summary, curves={}, law=None) for summary in three]
    nothing = SimpleNamespace(summary={"load": float("nan")}, curves={}, law=None)
    assert mean_and_range(look, three, "load") == "50.0 (10.0 to 100.0)"
    assert mean_and_range(look, three, "count") == "20.0"
    assert mean_and_range(look, three, "all") == "10.0, 20.0"
    assert mean_and_range(look, three, "none") == "-"
    assert mean_and_range(look, [*three, nothing], "load") == "-"
    assert np.isnan(means([{"load": 1.0}, {"load": float("nan")}])["load"])


PRESSED = gl.Panel("strain", ["stress"])


def recorded(curves):
    factors = {"strain": 100, "stress": 1e-6}
    return SimpleNamespace(curves=curves, summary={}, shown=lambda name: curves[name] * factors[name])


def test_bars_of_strengths_by_hand():
    """Peaks of 10, 60 and 20 MPa at 0.1, 0.3 and 0.2 %, after which nothing is borne; none is drawn if one is not."""
    peaks = ((0.1, 10), (0.3, 60), (0.2, 20))
    way = np.linspace(0, 1.5, 301)
    results = [
        recorded({
            "strain": 1e-2 * at * way, "stress": 1e6 * peak * np.where(way <= 1, way, 0.0), "stage": np.zeros(301),
        })
        for at, peak in peaks
    ]  # fmt: skip
    axes = Figure().subplots()
    assert _draw_peaks(axes, PRESSED, results, 0)
    across, up = (lines.get_segments()[0] for lines in axes.containers[0].lines[2])
    assert np.sort(across[:, 0]) == pytest.approx([0.1, 0.3])
    assert np.sort(up[:, 1]) == pytest.approx([10, 60])
    assert axes.containers[0].lines[0].get_xydata()[0] == pytest.approx([0.2, 30])
    without = Figure().subplots()
    rising = recorded(results[0].curves | {"stress": way})
    assert not _draw_peaks(without, PRESSED, [*results, rising], 0)
    assert not _draw_peaks(without, gl.Panel("time", ["stress"]), results, 0)  # where no strength is read
    assert not without.containers


@pytest.mark.thorough
def test_bars_of_strengths_reach_from_the_lowest_to_the_highest(found):
    axes = Figure().subplots()
    results = [found.results["brittle", seed] for seed in SAMPLES]
    _draw_peaks(axes, PRESSED, results, 0)
    (bars,) = axes.containers
    across, up = (lines.get_segments()[0] for lines in bars.lines[2])
    strengths = [result.summary["strength"] / 1e6 for result in results]
    strains = [result.summary["failure_strain"] * 100 for result in results]
    assert sorted(up[:, 1]) == pytest.approx(sorted(strengths), rel=1e-6)
    assert sorted(across[:, 0]) == pytest.approx(sorted(strains), rel=1e-6)


@pytest.mark.thorough
def test_each_run_is_that_of_one_sample(found):
    for seed, specimen in SAMPLES.items():
        alone = gl.compare(specimen, LAWS, TEST, threads=1, frames=4)
        for law, result in alone.items():
            for name, values in result.curves.items():
                assert np.array_equal(found.results[law, seed].curves[name], values, equal_nan=True)


def test_the_table_has_means_and_ranges(found):
    lines = str(found).splitlines()
    assert lines[0].split() == ["linear", "brittle"]
    peaks = np.array([found.results["brittle", seed].summary["strength"] for seed in (1, 7)]) / 1e6
    assert peaks[0] != peaks[1]
    assert lines[2].endswith(f" {peaks.mean():.2f} ({peaks.min():.2f} to {peaks.max():.2f})")
    assert "mean (range) of the samples with the seeds 1, 7" in lines


def test_it_is_a_table_as_of_a_study(found):
    table = found.table
    assert (table.factors, len(table), table.main[:3]) == (
        ("law", "seed"),
        4,
        ["strength", "failure_strain", "largest_stress"],
    )
    peaks = np.array([found["brittle", seed].summary["strength"] for seed in (1, 7)])
    (mean,) = [each for each in table.means("law")["strength"] if each.group == {"law": "brittle"}]
    half = 12.706204736432095 * peaks.std(ddof=1) / np.sqrt(2)  # t of one degree of freedom at 0.975
    assert mean.interval == pytest.approx((peaks.mean() - half, peaks.mean() + half))
    (pair,) = table.paired("law")["largest_stress"]
    linear, brittle = (np.array([found[law, seed].summary["largest_stress"] for seed in (1, 7)]) for law in LAWS)
    assert (pair.levels, pair.mean) == (("linear", "brittle"), pytest.approx((brittle - linear).mean()))
    assert table.result(law="brittle", seed=7) is found["brittle", 7]
    assert "fragments" in table.quantities  # what a laboratory measures
    assert len(table.plot_curves("law").axes[0].lines) == 6  # two of each law, and their medians


def test_of_one_sample_laws_are_rows_and_what_failed_is_one_that_counts_nowhere(found):
    one = gl.Comparison({"linear": found["linear", 1]}, {"brittle": ValueError("it broke")})
    assert (one.table.factors, one.table.levels("law")) == (("law",), ["linear", "brittle"])
    assert one.table.failed == [{"law": "brittle", "status": "failed", "reason": "it broke"}]
    assert np.isnan(one.table["largest_stress"]).tolist() == [False, True]


@pytest.mark.thorough
def test_files_hold_means_and_each_sample(found, folder):
    content = json.loads((folder / "summary.json").read_text())
    assert content["seeds"] == [1, 7]
    for law in LAWS:
        for name in ("largest_stress", "steps", "tensile_cracks"):
            both = [content["samples"][seed][law][name] for seed in ("1", "7")]
            assert both == [found.results[law, seed].summary[name] for seed in (1, 7)]
            assert content["laws"][law][name] == pytest.approx(sum(both) / 2, rel=1e-12)
    with (folder / "curves.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if (row["law"], row["seed"]) == ("brittle", "7")]
    assert [float(row["stress"]) for row in rows] == found.results["brittle", 7].curves["stress"].tolist()
    for name in ("comparison", "cracks_linear", "cracks_brittle"):
        picture = imread(folder / f"{name}.png")
        assert 400 < min(picture.shape[:2])
        assert max(picture.shape[:2]) < 4000
        assert 0.01 < (picture[..., :3] < 0.95).any(axis=-1).mean() < 0.9  # neither blank nor filled


@pytest.mark.thorough
def test_the_report_begins_with_all_samples(found, folder):
    page = (folder / "report.html").read_text()
    assert "Means and ranges of all samples" in page
    assert "The samples are those of the seeds 1, 7; what follows is of seed 1." in page
    peaks = np.array([found.results["brittle", seed].summary["strength"] for seed in (1, 7)]) / 1e6
    texts = [f"{value:.3g}" for value in (peaks.mean(), peaks.min(), peaks.max())]
    both = texts[0] if texts[1] == texts[2] else f"{texts[0]} ({texts[1]} to {texts[2]})"
    assert f'<td class="number">{both}</td>' in page
    assert f'<td class="number">{peaks[0]:.3g}</td>' in page


class Fails(gl.Observer):
    def observe(self, state, curves, stage, progress):
        raise gl.InstabilityError("it broke")


@pytest.mark.thorough
def test_a_run_that_fails_leaves_the_others(found, tmp_path):
    bad = gl.compare(
        SAMPLES, LAWS, TEST, threads=1, frames=4, checkpoint=tmp_path,
        observers=lambda run: [Fails()] if run == ("brittle", 1) else [],
    )  # fmt: skip
    assert set(bad.results) == {("linear", 1), ("linear", 7), ("brittle", 7)}
    assert "brittle, seed 1 failed: it broke" in str(bad).splitlines()
    assert bad.summary["brittle"]["strength"] == found.results["brittle", 7].summary["strength"]
    bad.write(tmp_path)
    assert json.loads((tmp_path / "summary.json").read_text())["failed"] == {"brittle, seed 1": "it broke"}
    bad.write_report(tmp_path / "report.html")
    assert "brittle, seed 1: it broke" in (tmp_path / "report.html").read_text()
    assert json.loads((tmp_path / "brittle_seed_1" / "run.json").read_text())["status"] == "it broke"


@pytest.mark.thorough
def test_what_is_stopped_goes_on(found, tmp_path):
    stop, watched = gl.Stop(), []

    class Asks(gl.Observer):
        def observe(self, state, curves, stage, progress):
            stop.ask("it is late")

    def observers(run):
        watched.append(run)
        return [Asks()] if len(watched) == 3 else []

    with pytest.raises(gl.Stopped, match="it is late") as stopped:
        gl.compare(SAMPLES, LAWS, TEST, threads=1, observers=observers, stop=stop, checkpoint=tmp_path, frames=4)
    assert list(stopped.value.result.results) == [run for run in found.results if run in watched[:2]]
    again = gl.compare(
        SAMPLES, LAWS, TEST, threads=1, checkpoint=tmp_path, restart=True, frames=4,
        observers=lambda run: [Asks()] if run == watched[2] else [],
    )  # fmt: skip
    assert set(again.results) == set(found.results)
    for run, result in again.results.items():
        assert np.array_equal(result.curves["stress"], found.results[run].curves["stress"])


def test_nothing_to_compare_is_refused():
    for samples, laws, words in (({}, LAWS, "specimen = {} is not allowed"), (SAMPLES, {}, "laws is empty")):
        with pytest.raises(gl.ParameterError, match=words):
            gl.compare(samples, laws, TEST)
