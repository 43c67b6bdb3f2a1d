"""Strength over confinement: the fits by closed forms, the intervals by an independent computation, the command."""

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import curve_fit
from study_rows import peaks, row, table_of
from support import STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw.cli.commands import main
from grainlaw.drawing.figure import Figure
from grainlaw.laws import Linear, MohrCoulomb
from grainlaw.protocols import BiaxialCompression

CONFINEMENTS = np.arange(5) * 1e6


@given(c=st.floats(1e5, 1e8), phi=st.floats(1, 70))
def test_a_mohr_coulomb_rock_gives_its_cohesion_and_angle(c, phi):
    """s1 = s3 (1 + sin phi)/(1 - sin phi) + 2 c cos phi/(1 - sin phi)."""
    s = math.sin(math.radians(phi))
    fit = gl.fit_mohr_coulomb(CONFINEMENTS, CONFINEMENTS * (1 + s) / (1 - s) + 2 * c * math.sqrt(1 - s * s) / (1 - s))
    assert fit.cohesion == pytest.approx(c, rel=1e-6)
    assert fit.friction_angle == pytest.approx(phi, rel=1e-6)
    assert fit.cohesion_interval == pytest.approx((c, c), rel=1e-4)
    assert fit.r_squared == pytest.approx(1)


def test_the_papers_line():
    fit = gl.fit_mohr_coulomb(CONFINEMENTS, 126.65e6 + 11.909 * CONFINEMENTS)
    assert fit.slope == pytest.approx(11.909)
    assert fit.cohesion == pytest.approx(18.35e6, rel=1e-4)
    assert fit.friction_angle == pytest.approx(57.68, abs=0.005)


@given(ucs=st.floats(1e6, 3e8), m=st.floats(0.5, 40))
def test_a_hoek_brown_rock_gives_its_constants(ucs, m):
    fit = gl.fit_hoek_brown(CONFINEMENTS, CONFINEMENTS + np.sqrt(m * ucs * CONFINEMENTS + ucs**2))
    assert fit.ucs == pytest.approx(ucs, rel=1e-6)
    assert fit.m == pytest.approx(m, rel=1e-6)
    assert fit.r_squared == pytest.approx(1)


def test_both_criteria_are_judged_by_the_strengths():
    """Not by their squares, of which those under pressure count most; at two pressures both leave the same."""
    scattered, x = np.array([11.0, 9.0, 18.0, 14.0]) * 1e6, np.array([0.0, 0.0, 4.0, 4.0]) * 1e6
    fit = gl.fit_hoek_brown(x, scattered)
    found = x + np.sqrt(fit.m * fit.ucs * x + fit.ucs**2)
    total = np.sum((scattered - scattered.mean()) ** 2)
    assert fit.r_squared == pytest.approx(1 - np.sum((scattered - found) ** 2) / total)
    assert fit.r_squared == pytest.approx(gl.fit_mohr_coulomb(x, scattered).r_squared, abs=0.01)


def test_intervals_agree_with_a_fit_of_the_constants_themselves():
    """The same criterion fitted in c and phi by Gauss-Newton: its covariance is, to first order, the propagated one."""
    random = np.random.default_rng(2)
    x = np.repeat(CONFINEMENTS, 3)
    y = 126.65e6 + 11.909 * x + random.normal(0, 3e6, len(x))

    def criterion(s3, c, phi):
        s = np.sin(phi)
        return (s3 * (1 + s) + 2e6 * c * np.cos(phi)) / (1 - s)

    (c, phi), covariance = curve_fit(criterion, x, y, p0=(20, 1.0))
    fit = gl.fit_mohr_coulomb(x, y)
    assert fit.cohesion == pytest.approx(c * 1e6, rel=1e-5)
    assert fit.friction_angle == pytest.approx(np.degrees(phi), rel=1e-5)
    student = 2.1604  # 97.5 % of Student's distribution with 13 degrees of freedom, from a table
    for low, high, error in (
        (*fit.cohesion_interval, 1e6 * np.sqrt(covariance[0, 0])),
        (*fit.friction_angle_interval, np.degrees(np.sqrt(covariance[1, 1]))),
    ):
        assert (high - low) / 2 == pytest.approx(student * error, rel=1e-3)
    slope_error = 3e6 / np.sqrt(np.sum((x - x.mean()) ** 2))  # of the noise that was put in
    assert np.ptp(fit.slope_interval) / 2 == pytest.approx(student * slope_error, rel=0.5)


def test_intervals_of_hoek_and_brown_agree_with_a_fit_of_their_constants():
    """The same, of (s1 - s3)^2 = m s_ci s3 + s_ci^2, in MPa."""
    x = np.repeat(np.arange(5.0), 3)
    y = x + np.sqrt(12 * 120 * x + 120**2) + np.random.default_rng(3).normal(0, 3, len(x))
    (m, ucs), covariance = curve_fit(lambda x, m, ucs: m * ucs * x + ucs**2, x, (y - x) ** 2, p0=(10, 100))
    fit = gl.fit_hoek_brown(1e6 * x, 1e6 * y)
    assert (fit.m, fit.ucs) == pytest.approx((m, 1e6 * ucs), rel=1e-5)
    student = 2.1604
    for (low, high), value, error in (
        (fit.m_interval, m, covariance[0, 0] ** 0.5),
        (fit.ucs_interval, 1e6 * ucs, 1e6 * covariance[1, 1] ** 0.5),
    ):
        assert ((low + high) / 2, (high - low) / 2) == pytest.approx((value, student * error), rel=1e-3)


def test_two_tests_have_no_interval_and_no_friction_no_angle():
    assert np.isnan(gl.fit_mohr_coulomb([0, 1e6], [1e8, 1.1e8]).slope_interval).all()
    falling = gl.fit_mohr_coulomb([0, 1e6], [1e8, 0.9e8])
    assert math.isnan(falling.friction_angle)
    assert math.isnan(falling.cohesion)
    assert falling.slope == pytest.approx(-10)


@pytest.mark.parametrize("fit", [gl.fit_mohr_coulomb, gl.fit_hoek_brown])
def test_strengths_and_confinements_in_the_other_order_are_refused(fit):
    with pytest.raises(gl.ParameterError, match=f"{fit.__name__}: strength = 0 Pa under 1e.08 Pa is not allowed"):
        fit([1e8, 1.5e8], [0, 1e7])


@pytest.mark.parametrize("peaks", [[1e8], [1e8, 2e8], [1e8, math.nan, 1e8]])
@pytest.mark.parametrize("fit", [gl.fit_mohr_coulomb, gl.fit_hoek_brown])
def test_peaks_that_cannot_be_fitted_are_refused(fit, peaks):
    confinement = [0, 1e6, 2e6] if len(peaks) == 3 else [1e6] * len(peaks)
    with pytest.raises(gl.ParameterError, match=rf"{fit.__name__}: \d confinements and \d strengths"):
        fit(confinement, peaks)


LAWS = {"brittle": MohrCoulomb(**STRONG), "linear": Linear(**STIFF)}


def pressed(law, seed, confinement):
    test = BiaxialCompression(confinement=confinement, maximum_strain=0.006, samples=200)
    return gl.Run(small_sample(20, seed=seed), LAWS[law], test)


@pytest.mark.thorough
def test_a_study_over_confinement(tmp_path):
    study = gl.Study(pressed, law=["brittle", "linear"], seed=[1, 2], confinement=[0, 5e6])
    table = study.run(tmp_path, workers=2, progress=False)
    found = gl.StrengthEnvelope(table.where(law="brittle"))
    assert found.strengths[:, 0].tolist() == [0, 5e6, 0, 5e6]
    alone = pressed("brittle", 2, 5e6).simulate()
    assert found.strengths[3, 1] == alone.summary["strength"]
    assert found.summary["strength"][1] == pytest.approx(found.strengths[[1, 3], 1].mean())
    assert found.summary["slope"] == found.mohr_coulomb.slope > 1
    assert [(test["law"], test["seed"]) for test in found.summary["tests"]] == [("brittle", k) for k in (1, 1, 2, 2)]
    few = table.where(law="brittle")
    few.rows[3].update(confinement=9e6, strength=None)  # as where no specimen fails under a confinement
    assert len(gl.StrengthEnvelope(few).plot().axes[0].lines) == 4
    curves, peaks = found.plot().axes
    assert [line.get_linestyle() for line in curves.lines] == ["-", "-", "--", "--"]  # by the seed
    assert np.array_equal(curves.lines[3].get_ydata(), alone.curves["stress"] * 1e-6)
    assert np.array_equal(peaks.lines[0].get_ydata(), found.strengths[:, 1] / 1e6)
    found.write(tmp_path)
    assert json.loads((tmp_path / "summary.json").read_text())["ucs"] == found.mohr_coulomb.ucs
    assert (tmp_path / "envelope.png").stat().st_size > 10_000


def test_only_cases_that_came_to_their_end_count(tmp_path, monkeypatch):
    table = peaks(
        {(0.0, 1): 1e8, (1e6, 1): 1.1e8, (2e6, 1): None, (0.0, 2): 1.02e8, (1e6, 2): 1.12e8}, tmp_path,
        ("confinement", "seed"),
    )  # fmt: skip
    found = gl.StrengthEnvelope(table)
    assert found.mohr_coulomb.slope == pytest.approx(10)
    assert found.mohr_coulomb.ucs == pytest.approx(1.01e8)
    assert found.summary["confinement"] == [0, 1e6]
    assert [row["confinement"] for row in found.summary["failed"]] == [2e6]
    assert "unstable" in str(found)
    monkeypatch.setattr(gl.StrengthEnvelope, "plot", lambda self: Figure())  # these rows have no runs
    found.write(tmp_path / "both", {"law": "mine"})
    assert {file.name for file in (tmp_path / "both").iterdir()} == {"summary.json", "envelope.png"}
    written = json.loads((tmp_path / "both" / "summary.json").read_text())
    assert (written["law"], written["slope"]) == ("mine", pytest.approx(10))
    assert (tmp_path / "both" / "envelope.png").read_bytes().startswith(b"\x89PNG")
    one = gl.StrengthEnvelope(table.where(confinement=0.0))
    assert one.summary["strength"] == [pytest.approx(1.01e8)]
    assert "no strength criteria are fitted" in str(one)
    one.write(tmp_path / "one")
    assert [file.name for file in (tmp_path / "one").iterdir()] == ["summary.json"]


@pytest.mark.parametrize(
    ("table", "says"),
    [
        (lambda folder: peaks({("a", 1): 1e8}, folder), "there is no factor 'confinement'"),
        (
            lambda folder: peaks({("a", 1): 1e8}, folder, ("confinement", "seed")),
            r"confinement = 'a' .* a number \(Pa\)",
        ),
        (lambda folder: table_of([row({"confinement": 0.0}, {"force": 1.0})], folder), "no column strength"),
    ],
)
def test_a_table_without_confinement_or_peaks_is_refused(table, says, tmp_path):
    with pytest.raises(gl.ParameterError, match=says):
        gl.StrengthEnvelope(table(tmp_path))


@pytest.mark.parametrize(("threads", "workers"), [("3", 3), ("auto", None)])
def test_threads_of_the_command_are_workers_of_the_study(threads, workers, tmp_path, monkeypatch):
    seen = []

    def run(study, out, workers):
        seen.append((len(study), workers))
        raise gl.ParameterError("it is enough")

    monkeypatch.setattr(gl.Study, "run", run)
    CliRunner().invoke(
        main, ["envelope", "--quick", "--confinement", "0,2", "--threads", threads, "--out", str(tmp_path / "s")]
    )
    assert seen == [(2, workers)]
    record = json.loads((tmp_path / "s" / "run.json").read_text())
    assert record["parameters"]["protocol"]["confinement"] == 2e6  # the largest
    assert record["command"]["arguments"]["confinement"] == "0,2"


@pytest.mark.thorough
def test_the_command(tmp_path):
    out = tmp_path / "out"
    small = ["--quick", "--grains", "40", "--max-strain", "0.006", "--law", "mohr-coulomb"]
    arguments = ["envelope", *small, "--confinement", "0,2", "--out", str(out)]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 0, done.output
    summary = json.loads((out / "summary.json").read_text())
    assert summary["confinement"] == [0, 2e6]
    expected = {"strength", "cohesion", "friction_angle", "ucs", "slope", "slope_interval", "ucs_interval",
                "cohesion_interval", "friction_angle_interval", "hoek_brown", "tests", "parameters"}  # fmt: skip
    assert expected <= set(summary)
    assert summary["ucs"] == pytest.approx(summary["strength"][0])  # a line through two points
    assert summary["slope"] == pytest.approx(np.diff(summary["strength"])[0] / 2e6)
    assert summary["slope_interval"] == [None, None]
    assert (out / "envelope.png").stat().st_size > 10_000
    assert "friction angle" in done.output


@pytest.mark.thorough
def test_the_same_call_goes_on_and_another_adds_its_tests(tmp_path, monkeypatch):
    small = [
        "envelope",
        "--quick",
        "--grains",
        "40",
        "--max-strain",
        "0.006",
        "--law",
        "mohr-coulomb",
        "--out",
        str(tmp_path),
    ]
    assert CliRunner().invoke(main, [*small, "--confinement", "0,2"]).exit_code == 0
    before = (tmp_path / "summary.json").read_bytes()
    assert CliRunner().invoke(main, [*small, "--confinement", "0,2,4"]).exit_code == 0
    assert json.loads((tmp_path / "summary.json").read_text())["confinement"] == [0, 2e6, 4e6]
    assert len([*tmp_path.glob("cases/*/*.json")]) == 3
    monkeypatch.setattr("grainlaw.studies.study.carry_all", lambda *_: pytest.fail("a finished test is run again"))
    assert CliRunner().invoke(main, [*small, "--confinement", "0,2", "--threads", "1"]).exit_code == 0
    assert (tmp_path / "summary.json").read_bytes() == before


@pytest.mark.thorough
def test_the_command_takes_any_rock_and_its_configuration_makes_the_same(tmp_path, monkeypatch):
    some = ["--confinement", "0,5", "--seeds", "1,2", "--out", str(tmp_path)]
    rock = ["--quick", "--grains", "20", "--rock", "lac-du-bonnet-granite", "--set", "law.cohesion=40 MPa"]
    assert CliRunner().invoke(main, ["envelope", *rock, *some]).exit_code == 0
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert (summary["parameters"]["law"]["cohesion"], len(summary["tests"])) == (40e6, 4)
    assert (
        summary["parameters"]["material"]["youngs_modulus"] == gl.rocks["lac-du-bonnet-granite"].material.youngs_modulus
    )
    monkeypatch.setattr("grainlaw.studies.study.carry_all", lambda *_: pytest.fail("a finished test is run again"))
    again = ["envelope", "--config", str(tmp_path / "config.toml"), *some]
    assert CliRunner().invoke(main, again).exit_code == 0
    assert json.loads((tmp_path / "summary.json").read_text()) == summary


def test_a_folder_of_something_else_is_refused(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    done = CliRunner().invoke(main, ["envelope", "--quick", "--out", str(tmp_path)])
    assert done.exit_code == 2
    assert "is not empty and no store of a study" in " ".join(done.output.replace("│", "").split())
    assert [file.name for file in tmp_path.iterdir()] == ["mine.txt"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--confinement", "1"], "--confinement = 1 is not allowed, it must name at least two"),
        (["--confinement", "a,b"], "--confinement = a,b is not allowed, it must be numbers"),
        (["--confinement", "0,-1"], "confinement = -1e+06"),
        (["--confinement", "0,0"], "each once"),
        (["--seeds", "1.5"], "--seeds = 1.5 is not allowed, it must be whole numbers"),
        (["--speed", "-1"], "speed = -1"),
        (
            ["--seeds", "1,2", "--set", "sample.tessellator=hexagonal"],
            "--seeds = 1,2 is not allowed, these grains have no seed",
        ),
        (
            ["--set", "sample.tessellator=hexagonal", "--confinement", "0,5 MPa"],
            "it must be numbers with commas between",
        ),
        (["--law", "mohr"], "did you mean 'mohr-coulomb'?"),
    ],
)
def test_what_cannot_be_is_refused_before_any_work(arguments, says, tmp_path):
    done = CliRunner().invoke(main, ["envelope", "--out", str(tmp_path / "out"), *arguments])
    assert done.exit_code == 2
    assert says in " ".join(done.output.split())
    assert not (tmp_path / "out").exists()
