"""Pictures and the report of a study: what they show is what the table says."""

import itertools
import re
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from study_rows import row, table_of
from support import BRITTLE, PULL, small_sample
from test_report import Page

import grainlaw as gl
from grainlaw.drawing.figure import LengthUnit
from grainlaw.drawing.palette import COLORS
from grainlaw.results.archive import to_bytes
from grainlaw.results.figures.cracks import scale_bar
from grainlaw.studies import report
from grainlaw.studies.figures import BAND, MOST_PATTERNS, _box, on_common_grid
from grainlaw.studies.table import Table
from grainlaw.units import mm

LAWS, SIZES, SEEDS = ("Mohr-Coulomb", "cohesive crack"), (10e6, 13e6), range(4)


@pytest.fixture(scope="module")
def run():
    return gl.simulate(small_sample(12), BRITTLE, attrs.evolve(PULL, samples=10))


@pytest.fixture(scope="module")
def table(tmp_path_factory, run):
    """Two laws, two strengths, four seeds; the last case failed; stress of run k is that of the first times k + 1."""
    rng = np.random.default_rng(1)
    rows, runs = [], []
    for k, key in enumerate(itertools.product(LAWS, SIZES, SEEDS)):
        factors = dict(zip(("law", "strength", "seed"), key, strict=True))
        summary = {"largest_stress": 1e8 + 1e6 * k + 1e5 * rng.random(), "tensile_cracks": 10 + k, "steps": 7}
        rows.append(row(factors, summary, measures={"failure_plane_angle": 1.0}))
        runs.append(
            to_bytes(attrs.evolve(run, curves=run.curves | {"stress": run.curves["stress"] * (k + 1)}), frames=False)
        )
    rows[-1] = row(rows[-1]["factors"], {}, "refused", "too <strong>")
    return table_of(rows, tmp_path_factory.mktemp("s") / "s", runs[:-1])


def points(axes, marker):
    return [np.column_stack(line.get_data()) for line in axes.lines if line.get_marker() == marker]


# --- strips ----------------------------------------------------------------------------------------------------------


def test_a_strip_shows_all_cases_and_their_means(table):
    axes = table.plot("largest_stress").axes[0]
    shown = np.sort(np.concatenate(points(axes, "o"))[:, 1])
    assert shown == pytest.approx(np.sort(table["largest_stress"][:-1]) / 1e6)
    means = [each.mean / 1e6 for each in table.means("law", "strength")["largest_stress"]]
    assert [each[0, 1] for each in points(axes, "D")] == pytest.approx(means)
    bars = [c.get_segments()[0][:, 1] for c in axes.collections if isinstance(c, LineCollection)]
    for drawn, each in zip(bars, table.means("law", "strength")["largest_stress"], strict=True):
        assert drawn == pytest.approx(np.array(each.interval) / 1e6)
    assert axes.get_ylabel() == "largest stress (MPa)"
    assert [label.get_text().split("\n")[-1] for label in axes.get_xticklabels()] == ["n = 4"] * 3 + ["n = 3 of 4"]
    assert {text.get_text() for text in axes.texts} == set(LAWS)


def test_a_seed_lies_at_the_same_place_in_each_strip(table):
    axes = table.plot("largest_stress", by="law", over=("strength", "seed")).axes[0]
    one, other = points(axes, "o")
    assert one[:7, 0] + 1 == pytest.approx(other[:, 0])
    assert len(set(one[:, 0])) == 8


def test_one_case_in_a_group_has_a_mean_and_no_interval(tmp_path):
    table = table_of([row({"seed": s}, {"force": 1e3}) for s in range(2)], tmp_path / "s")
    axes = table.plot("force", by="seed", over=()).axes[0]
    assert [each[0, 1] for each in points(axes, "D")] == [1.0, 1.0]  # kN/m


# --- pairs -----------------------------------------------------------------------------------------------------------


def test_lines_join_pairs_and_the_title_says_the_difference(table):
    axes = table.plot_paired("largest_stress", "law").axes[0]
    found = table.paired("law")["largest_stress"]
    lines = [np.array(line.get_ydata()) for line in axes.lines if line.get_marker() == "None"]
    assert len(lines) == sum(each.count for each in found) == 7
    assert np.mean([y[1] - y[0] for y in lines[:4]]) == pytest.approx(found[0].mean / 1e6)
    for line, each in zip(axes.get_title(loc="left").split("\n"), found, strict=True):
        low, high = (f"{end / 1e6:.2f}" for end in each.interval)
        size = f"strength {each.group['strength'] / 1e6:g} MPa"
        assert line == (
            f"{size}: cohesive crack less Mohr-Coulomb: +{each.mean / 1e6:.2f} MPa "
            f"(95 %: {low} to {high}, n = {each.count})"
        )
    for drawn, each in zip(points(axes, "D"), found, strict=True):
        assert drawn[1, 1] - drawn[0, 1] == pytest.approx(each.mean / 1e6)


def test_falling_pairs_are_told_from_rising_ones(tmp_path):
    rows = [
        row({"law": law, "seed": s}, {"force": f}) for law, s, f in [("A", 0, 1), ("A", 1, 2), ("B", 0, 2), ("B", 1, 1)]
    ]
    axes = table_of(rows, tmp_path / "s").plot_paired("force", "law").axes[0]
    pairs = [line for line in axes.lines if line.get_marker() == "None"]
    assert [(line.get_ydata()[1] > line.get_ydata()[0], line.get_linestyle()) for line in pairs] == [
        (True, "-"), (False, "--"),
    ]  # fmt: skip
    assert [line.get_color() for line in pairs] == list(COLORS[:2])


# --- curves ----------------------------------------------------------------------------------------------------------


def test_the_median_of_multiples_is_the_middle_one(table, run):
    axes = table.plot_curves(by=("law", "strength")).axes[0]
    medians = [line for line in axes.lines if line.get_linewidth() == 2]
    x, y = medians[0].get_data()
    assert y == pytest.approx(2.5 * np.interp(x, 100 * run.curves["strain"], run.curves["stress"] / 1e6))
    assert medians[-1].get_label() == "cohesive crack, strength 13 MPa (n = 3)"
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("strain (%)", "stress (MPa)")  # the rows declare nothing
    assert len(axes.lines) - len(medians) == 15


@pytest.mark.thorough
@given(st.lists(st.floats(0.1, 10), min_size=1, max_size=9), st.sampled_from([-1.0, 1.0]))
def test_percentiles_of_straight_lines_of_equal_length(slopes, turn):
    along = turn * np.linspace(0, 2, 7)
    grid, found = on_common_grid([(along, slope * along) for slope in slopes])
    assert [grid[0], grid[-1]] == pytest.approx([0, 2 * turn])
    expected = np.percentile(np.outer(slopes, grid), (BAND[0], 50, BAND[1]), axis=0)
    assert found == pytest.approx(expected)


@pytest.mark.parametrize("turn", [-1.0, 1.0])
def test_the_band_of_three_straight_lines_by_hand(turn):
    """Of 1, 2 and 3 the tenth and the ninetieth percentile are 1.2 and 2.8."""
    grid, found = on_common_grid([(turn * np.array([0, 2.0]), slope * np.array([0, 2.0])) for slope in (1, 2, 3)])
    assert found == pytest.approx(np.outer((1.2, 2, 2.8), np.abs(grid)))
    assert grid[[0, -1]] == pytest.approx([0, 2 * turn])


def test_a_curve_that_has_ended_counts_with_its_last_value():
    short, middle, long = ((np.linspace(0, end, 5), np.linspace(0, end, 5)) for end in (1.0, 2.0, 3.0))
    grid, (_, median, _) = on_common_grid([short, middle, long])
    assert grid[-1] == 2  # half of them have ended
    assert median[grid > 1] == pytest.approx(grid[grid > 1])  # the middle one, not the mean of those left


def test_a_band_begins_where_all_of_its_curves_have_begun():
    """A curve that begins later than others has no values before."""
    grid, found = on_common_grid([(np.array([first, 2.0]), np.array([first, 2.0])) for first in (0, 0.5, 0.25)])
    assert grid[[0, -1]].tolist() == [0.5, 2.0]
    assert found == pytest.approx(np.array([grid] * 3))


def test_a_curve_that_turns_back_is_followed_forward():
    along = np.array([0, 1, 0.5, 1.5, 2.0])
    grid, (_, median, _) = on_common_grid([(along, np.array([0, 1.0, 7.0, 1.5, 2.0]))])
    assert median == pytest.approx(grid)
    begun = np.array([0, -0.1, 1, 2])  # the wrong way, by a wave
    grid, (_, median, _) = on_common_grid([(begun, begun)])
    assert (grid[0], grid[-1]) == (0, 2)
    assert median == pytest.approx(grid)


# --- cracks ----------------------------------------------------------------------------------------------------------


def test_crack_patterns_have_one_scale(table, run):
    figure = table.plot_cracks()
    figure.draw_without_rendering()
    assert len(figure.axes) == 4
    assert len({(axes.get_xlim(), axes.get_ylim()) for axes in figure.axes}) == 1
    assert len({tuple(np.round(axes.get_window_extent().size, 3)) for axes in figure.axes}) == 1
    counts = [sum(len(c.get_segments()) for c in axes.collections) for axes in figure.axes]
    assert counts == [len(run.cracks)] * 4
    assert figure.axes[0].get_title() == "Mohr-Coulomb\nstrength 10 MPa"
    assert figure.get_suptitle() == "seed 0"


def test_a_pattern_lies_on_the_outline_of_its_specimen(table, run):
    """20 x 40 mm with 3 % of the height around."""
    axes = table.plot_cracks().axes[0]
    assert axes.patches[0].get_path().get_extents().extents == pytest.approx([0, 0, 20, 40])
    assert axes.get_xlim() == pytest.approx((-1.2, 21.2), abs=0.1)
    assert axes.get_ylim() == pytest.approx((-1.2, 41.2), abs=0.1)
    lines = np.concatenate([each.get_segments() for each in axes.collections if len(each.get_segments())])
    assert np.hypot(*(lines[:, 1] - lines[:, 0]).T).sum() == pytest.approx(1e3 * run.cracks.length.sum())
    assert np.sort(lines.mean(axis=1), axis=0) == pytest.approx(np.sort(1e3 * run.cracks.position, axis=0))


def test_a_pattern_has_room_for_a_specimen_anywhere_and_for_its_cracks():
    """Regions from (1, 2) to (3, 6), a crack at (3.5, 4), and 3 % of the height of 4 around."""
    outlines = [np.array([(1, 2), (3, 2), (3, 4), (1, 4)]), np.array([(1, 4), (3, 4), (3, 6), (1, 6)])]
    grains = SimpleNamespace(regions=[SimpleNamespace(outline=outline) for outline in outlines])
    cracks = SimpleNamespace(position=np.array([(3.5, 4.0)]))
    box = _box(SimpleNamespace(specimen=SimpleNamespace(grains=grains), cracks=cracks))
    assert box == pytest.approx(np.array([(0.88, 1.88), (3.62, 6.12)]))


def test_specimens_of_two_sizes_have_one_scale(run, tmp_path):
    low = gl.simulate(small_sample(12, height=20 * mm), BRITTLE, attrs.evolve(PULL, samples=10))
    runs = [to_bytes(each, frames=False) for each in (run, low)]
    table = table_of([row({"height": h}, {"largest_stress": 1.0}) for h in (40 * mm, 20 * mm)], tmp_path / "s", runs)
    figure = table.plot_cracks(over=(), cases=[{"height": 40 * mm}, {"height": 20 * mm}])
    figure.draw_without_rendering()
    scales = [(a.transData.transform((10, 10)) - a.transData.transform((0, 0))).tolist() for a in figure.axes]
    assert scales[0] == pytest.approx(scales[1])
    assert scales[0][0] == pytest.approx(scales[0][1])


@pytest.mark.parametrize(("width", "length"), [(0.05, 10), (0.02, 5), (0.1, 20), (0.0031, 1), (0.03, 10)])
def test_a_scale_bar_is_round_and_as_long_as_it_says(width, length):
    axes = Figure().subplots()
    axes.set_xlim(7, 7 + width * 1e3)
    axes.set_ylim(3, 9)
    scale_bar(axes, width, LengthUnit(1e3, "mm"))
    assert np.ptp(axes.lines[0].get_xdata()) == pytest.approx(length)
    assert np.mean(axes.lines[0].get_xdata()) == axes.texts[0].xy[0] == pytest.approx(7 + width * 1e3 / 2)
    assert list(axes.lines[0].get_ydata()) == [3, 3]
    assert axes.texts[0].xyann[1] < 0  # below it
    assert axes.texts[0].get_text() == f"{length} mm"


# --- what all of them share ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("draw", [
    lambda t, ax: t.plot("largest_stress", ax=ax),
    lambda t, ax: t.plot_paired("largest_stress", "law", ax=ax),
    lambda t, ax: t.plot_curves("law", ax=ax),
    lambda t, ax: t.plot_cracks([{"law": LAWS[0], "strength": 10e6, "seed": 1}], ax=[ax]),
])  # fmt: skip
def test_axes_that_are_given_are_drawn_on(table, draw):
    figure = Figure()
    axes = figure.subplots()
    assert draw(table, axes) is figure
    assert axes.has_data()


@pytest.mark.parametrize(("draw", "message"), [
    (lambda t: t.plot("peak"), "no quantity 'peak'"),
    (lambda t: t.plot("status"), "no quantity 'status'"),
    (lambda t: t.plot("largest_stress", by="lw"), "no factor 'lw'"),
    (lambda t: t.plot("largest_stress", ax=3), "ax = 3"),
    (lambda t: t.plot_paired("largest_stress", "seed"), "each factor only once"),
    (lambda t: t.plot_curves(y="force"), "no column 'force'"),
    (lambda t: t.plot_curves(by="laws"), "no factor 'laws'"),
    (lambda t: t.plot_cracks([]), f"0 cases.*1 to {MOST_PATTERNS}"),
    (lambda t: t.plot_cracks([{"seed": 1}]), "4 cases have seed = 1"),
    (lambda t: t.plot_cracks([{"law": LAWS[1], "strength": 13e6, "seed": 3}]), "has no run: refused, too"),
    (lambda t: t.plot_cracks(columns=0), "columns = 0"),
])  # fmt: skip
def test_what_cannot_be_drawn_is_refused(table, draw, message):
    with pytest.raises(gl.ParameterError, match=message):
        draw(table)


def test_colours_are_told_apart_without_red_and_green():
    """A plain model of dichromacy: red and green are seen as their mean; lightness is that of a grey page."""
    seen = [((red + green) / 2, blue) for red, green, blue in map(to_rgb, COLORS)]
    for one, other in itertools.combinations(seen, 2):
        assert np.linalg.norm(np.subtract(one, other)) > 0.1


# --- the report ------------------------------------------------------------------------------------------------------


def test_tables_of_a_report_by_hand(tmp_path):
    """Of 1, 2 and 3 the mean is 2, and half of its interval Student's 4.3027 / sqrt(3)."""
    rows = [
        row({"law": law, "seed": s}, {"strength": 1e6 * s, "own": float(s)}, cost={"cpu": 60.0 * s, "bytes": 3000})
        for law in ("A", "B") for s in (1, 2, 3)
    ]  # fmt: skip
    rows[-1] = row(rows[-1]["factors"], {}, "refused", "so") | {"cost": {}}
    table = table_of(rows, tmp_path / "s")
    assert report._others(table, ["law"]) == {
        "rows": [["own", "2 ± 2.484", "1.5 ± 6.353"]],  # 12.706 / 2 of two
        "heads": ["law", "A", "B"],
    }
    assert report._others(table, [])["heads"] == ["", "all"]
    assert report._failures(table) == {
        "rows": [["B", "3", "refused", "so"]], "heads": ["law", "seed", "status", "reason"], "more": 0,
    }  # fmt: skip
    assert report._cost(table) == [
        ["CPU time of all cases", "9 min"],  # 1 + 2 + 3 + 1 + 2
        ["CPU time of a case, mean and longest", "108 s, 3 min"],
        ["stored runs", "0.015 MB"],
        ["stored run of a case, mean", "3 kB"],
    ]
    assert report._factors(table) == [["law", "A, B", "2 levels"], ["seed", "1, 2, 3", "3 levels"]]
    (pairs,) = report._pairs(table, ["seed"])
    assert [words for _, words in pairs["figures"]] == ["strength"]
    assert [each["factor"] for each in report._pairs(table, ["law"])] == ["seed"]
    assert report._pairs(table, []) == []
    assert report._means(table, ["law"], ["seed"])["how"] == "over seed"
    assert report._means(table, ["law", "seed"], ["seed"])["how"] == "over all other factors"


@pytest.mark.parametrize(("groups", "drawn"), [(24, True), (25, False)])
def test_pairs_of_more_than_24_groups_are_written_but_not_drawn(groups, drawn, tmp_path, monkeypatch):
    cases = [{"law": law, "speed": speed, "seed": 1} for law in "AB" for speed in range(groups)]
    rows = [row(case, {"strength": 1e6 if case["law"] == "A" else 3e6}) for case in cases]
    monkeypatch.setattr(Table, "plot_paired", lambda table, *which: which)
    (found,) = report._pairs(table_of(rows, tmp_path / "s"), ["seed"])
    assert found["figures"] == [(("strength", "law", ["seed"]), "strength")] * drawn
    assert len(found["listings"][0]["rows"]) == groups


def test_pairs_of_cases_that_measure_nothing_have_no_picture(tmp_path):
    table = table_of([row({"law": law, "seed": 1}) for law in "AB"], tmp_path / "s")
    assert report._pairs(table, ["seed"]) == [{"factor": "law", "over": "seed", "listings": [], "figures": []}]


@pytest.mark.parametrize(("levels", "pairs"), [(4, ["law", "share"]), (5, ["law"])])
def test_differences_are_those_of_all_factors_with_names_or_few_levels(levels, pairs, tmp_path):
    cases = [{"law": law, "share": k / 10, "seed": 1} for law in "AB" for k in range(levels)]
    table = table_of([row(case, {}) for case in cases], tmp_path / "s")
    assert [each["factor"] for each in report._pairs(table, ["seed"])] == pairs


def test_curves_are_drawn_where_all_runs_have_them(table, monkeypatch):
    run, last = table.run, max(k for k in range(len(table)) if table.is_finished(k))
    other = SimpleNamespace(curves={"force": np.zeros(2)})
    monkeypatch.setattr(Table, "run", lambda _, k: other if k == last else run(k))
    assert report._pictures(table, ["law"], ["seed"])["curves"] is None


@pytest.mark.parametrize(
    ("count", "text"), [(12, ", ".join("abcdefghijkl")), (13, "a, b, c, d, e, f, g, h, i, j, k, l, ...")]
)
def test_many_levels_of_a_report_are_not_all_written(count, text, tmp_path):
    names = [row({"law": law, "speed": 2 + k}, {"strength": 1.0}) for k, law in enumerate("abcdefghijklm"[:count])]
    numbers = ", ".join(str(2 + k) for k in range(12)) if count == 12 else "2 to 14"
    assert report._factors(table_of(names, tmp_path / "s")) == [
        ["law", text, f"{count} levels"], ["speed", numbers, f"{count} levels"],
    ]  # fmt: skip


def test_pictures_of_a_report_are_those_that_runs_allow(table, tmp_path):
    assert all(report._pictures(table, ["law", "strength"], ["seed"]).values())
    without = table_of([row({"seed": 1}, {"strength": 1.0})], tmp_path / "s")
    assert report._pictures(without, [], ["seed"]) == {"curves": None, "cracks": None}


def test_more_than_24_groups_are_those_of_what_has_names_or_none(tmp_path):
    def grouped(laws, speeds):
        cases = [{"law": law, "speed": speed} for law in range(laws) for speed in range(speeds)]
        rows = [row(case | {"law": f"law {case['law']}"}, {"strength": 1.0}) for case in cases]
        return report._grouped(table_of(rows, tmp_path / f"{laws} {speeds}"), [])

    assert [grouped(*each) for each in ((4, 6), (5, 5), (25, 1))] == [["law", "speed"], ["law"], []]


@pytest.mark.thorough
def test_the_report_holds_what_the_table_says(table, tmp_path):
    table.write_report(tmp_path / "r.html", title="Three & more")
    page = Page(tmp_path / "r.html")
    assert "Three & more" in page.text
    assert "16 cases: 15 finished, 1 failed." in page.text
    assert "too <strong>" in page.text  # as text, not as a tag
    assert page.rows["law"][0] == ["Mohr-Coulomb, cohesive crack", "2 levels"]
    for each in table.means("law", "strength")["largest_stress"]:
        name = f"{each.group['law']}, {each.group['strength'] / 1e6:g}"
        low, high = (f"{end / 1e6:.2f}" for end in each.interval)
        assert page.rows[name][0][:3] == [str(each.count), f"{each.mean / 1e6:.2f}", f"{low} to {high}"]
    first = table.paired("law")["largest_stress"][0]
    assert page.rows["10"][0][:3] == ["cohesive crack - Mohr-Coulomb", "4", f"{first.mean / 1e6:.2f}"]
    assert "57.3 ± 0" in page.rows["failure plane angle (deg)"][0]
    assert page.rows["CPU time of all cases"] == [["24 s"]]  # 16 of 1.5 s
    assert len(page.images) == 5
    assert all(re.match(r"data:image/png;base64,", image) for image in page.images)


def test_a_report_of_points_without_seeds(tmp_path):
    """As many groups as cases: means are those of all, and there are no pairs; rows without runs have no pictures."""
    points = [{"strength": 1e6 * k, "energy": 3.0 * k} for k in range(1, 40)]
    table = table_of([row(point, {"largest_stress": 2 * point["strength"]}) for point in points], tmp_path / "s")
    table.write_report(tmp_path / "r.html")
    page = Page(tmp_path / "r.html")
    assert page.rows["strength (MPa)"] == [["1 to 39", "39 levels"]]
    assert page.rows["all"][0][:2] == ["39", "40.00"]
    assert "Paired" not in page.text
    assert len(page.images) == 1
    named = [row({"law": law, **point}, {"largest_stress": 1e6}) for law in LAWS for point in points]
    table_of(named, tmp_path / "t").write_report(tmp_path / "r.html")
    assert Page(tmp_path / "r.html").rows["cohesive crack"][0][:2] == ["39", "1.00"]  # by what has few levels
    with pytest.raises(gl.ParameterError, match="no factor 'seed'"):
        table.write_report(tmp_path / "r.html", over="seed")


@pytest.mark.parametrize(("count", "warned"), [(9, True), (10, False)])
def test_ci_and_cd_of_fewer_than_ten_are_doubted(count, warned, tmp_path):
    rows = [row({"seed": s}, {"force": 1e3}, measures={"crack_damage": 1e8 + s}) for s in range(count)]
    table_of([*rows, row({"seed": 99}, {"force": 1e3})], tmp_path / "s").write_report(tmp_path / "r.html")
    assert ("Fewer than ten cases in a mean" in Page(tmp_path / "r.html").text) == warned
    table_of([row({"seed": s}, {"force": 1e3}) for s in range(3)], tmp_path / "t").write_report(tmp_path / "r.html")
    assert "Fewer than ten" not in Page(tmp_path / "r.html").text


def test_a_report_has_the_title_given_or_its_factors(tmp_path, monkeypatch):
    titles = []
    monkeypatch.setattr(report, "write_page", lambda file, page, *, title, **more: titles.append(title))
    for factors, title in (({"law": "a", "seed": 1}, ""), ({}, ""), ({"seed": 1}, "Block 7")):
        table_of([row(factors, {}, "killed", "")], tmp_path / str(len(titles))).write_report("r.html", title=title)
    assert titles == ["Study of law, seed", "Study of one case", "Block 7"]


def test_a_report_of_nothing_but_failures(tmp_path):
    table_of([row({"seed": 1}, {}, "killed", "its worker died")], tmp_path / "s").write_report(tmp_path / "r.html")
    page = Page(tmp_path / "r.html")
    assert page.rows["1"] == [["killed", "its worker died"]]
    assert page.images == []


@pytest.mark.parametrize(("over", "drawn"), [(["seed"], ["seed"]), ([], ("law", "seed"))])
def test_the_strip_of_a_report_is_over_what_is_asked_for_or_over_all(over, drawn, tmp_path, monkeypatch):
    rows = [row({"law": law, "seed": s}, {"strength": 1e6 * s}) for law in "AB" for s in (1, 2)]
    monkeypatch.setattr(report, "plot_strip", lambda table, *which: which)
    by = [name for name in ("law", "seed") if name not in over]
    strips = report._means(table_of(rows, tmp_path / "s"), by, over)["strips"]
    assert strips == [(("strength", by, drawn, None), "strength")]


@pytest.mark.parametrize(
    ("curves", "count", "drawn"),
    [(("strain", "stress"), 300, True), (("strain", "stress"), 301, False), (("strain", "force"), 2, False)],
)
def test_curves_of_a_report_are_those_of_not_too_many_runs_that_have_them(curves, count, drawn, monkeypatch):
    monkeypatch.setattr(report.groups, "first_of_each", lambda table, over: [])

    class Runs:
        def __len__(self):
            return count

        def is_finished(self, k):
            return k == 1

        def has_run(self, k):
            return k == 1

        def run(self, k):
            return SimpleNamespace(curves=dict.fromkeys(curves) if k == 1 else {})

        def plot_curves(self, by):
            return by

    assert report._pictures(Runs(), ["law"], ["seed"]) == {"curves": ["law"] if drawn else None, "cracks": None}


@pytest.mark.parametrize(("cases", "drawn"), [(0, False), (1, True), (MOST_PATTERNS, True), (MOST_PATTERNS + 1, False)])
def test_cracks_of_a_report_are_those_of_not_too_many_cases(cases, drawn, monkeypatch):
    monkeypatch.setattr(report.groups, "first_of_each", lambda table, over: list(range(cases)))
    runs = SimpleNamespace(
        is_finished=lambda k: True, has_run=lambda k: True, run=lambda k: SimpleNamespace(curves={}),
        plot_cracks=lambda which: which,
    )  # fmt: skip

    class Runs(SimpleNamespace):
        def __len__(self):
            return 2

    found = report._pictures(Runs(**vars(runs)), ["law"], ["seed"])
    assert found == {"curves": None, "cracks": list(range(cases)) if drawn else None}
