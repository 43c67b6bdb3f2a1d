"""grainlaw test: options that reach the run, refusals before any work, what is left of a test that fails."""

import csv
import importlib
import json
import re
from pathlib import Path

import pytest
from command_line import SMALL, invoke
from law_sources import STIFFER
from test_report import Page

import grainlaw as gl

# --- a whole run -----------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run") / "new" / "out"
    config = folder.parents[1] / "mine.toml"
    config.write_text(
        '[law]\ntensile_strength = "10 MPa"\ncohesion = "30 MPa"\n'
        '[test]\nloading = {type = "constant", speed = "0.2 m/s"}\n'
    )
    given = ("--config", config, *SMALL, "--seed", 3, "--set", "law.cohesion = 25e6", "--interactive", "--animate")
    return invoke("test", "uniaxial-compression", *given, "--out", folder), folder


@pytest.mark.thorough
def test_a_run_prints_the_properties_and_writes_the_folder(done):
    result, folder = done
    assert result.exit_code == 0, result.output
    assert re.search(r"^strength \(MPa\) +> \d+\.\d\d$", result.output, re.M)
    assert re.search(r"^time step \(s\) +\d\.\d+e-0\d$", result.output, re.M)
    names = {"report.html", "summary.json", "curves.csv", "grains.pvd", "cracks.pvd", "config.toml"}
    assert names <= {file.name for file in folder.iterdir()}
    assert not (folder / "certificate.json").exists()  # which was not asked for
    read = gl.Result.load(folder)
    assert read.frames
    assert read.summary["steps"] == json.loads((folder / "summary.json").read_text())["properties"]["steps"]
    with pytest.raises(gl.ParameterError, match=r"has no result\.npz, which grainlaw test writes at its end"):
        gl.Result.load(folder.parent)


@pytest.mark.thorough
def test_a_finished_run_is_not_replaced_by_another_that_goes_on_with_it(done):
    _, folder = done
    before = {file.name: file.read_bytes() for file in folder.iterdir() if file.is_file()}
    given = ("--config", folder / "config.toml", "--seed", 4)
    result = invoke("test", "uniaxial-compression", *given, "--restart", "--out", folder)
    assert result.exit_code == 1, result.output
    assert "belongs to another run: specimen, law, test, options" in " ".join(result.output.split())
    assert {file.name: file.read_bytes() for file in folder.iterdir() if file.is_file()} == before


def test_file_options_and_single_values_reach_the_run_in_this_order(done):
    content = json.loads((done[1] / "run.json").read_text())
    made = content["configuration"]
    assert made["law"]["tensile_strength"] == "10 MPa"
    assert made["law"]["cohesion"] == "25 MPa"
    assert made["law"]["mode_i_energy"] == "150 J/m2"
    assert made["test"]["loading"]["speed"] == "200 mm/s"
    assert (made["sample"]["grains"], made["sample"]["seed"]) == (20, 3)
    assert made["numerics"]["threads"] == content["threads"] == "auto"
    assert content["made_with"]["versions"]["grainlaw"]
    with (done[1] / "curves.csv").open() as file:
        rows = list(csv.DictReader(file))
    # 0.0002 of 50 mm at 0.2 m/s are 50 us in 20 samples; the strain, a mean over a sample, is late by half of one
    assert 50e-6 < float(rows[-1]["time"]) < 50e-6 * (1 + 2 / 20)
    assert not (done[1] / "certificate.json").exists()  # which was not asked for
    page = Page(done[1] / "report.html")
    assert ["10 MPa"] in page.rows["tensile_strength"]
    assert ["3"] in page.rows["seed"]


def test_a_run_writes_the_page_to_look_into_where_it_is_asked_for(done):
    assert (done[1] / "interactive.html").stat().st_size > 1e6
    assert (done[1] / "cracks.gif").read_bytes().startswith(b"GIF89a")
    assert '<a href="cracks.gif">' in (done[1] / "report.html").read_text("utf-8")
    assert '<a href="interactive.html">' in (done[1] / "report.html").read_text("utf-8")


@pytest.mark.thorough
def test_the_written_configuration_runs_the_same_test_again(done, tmp_path):
    again = invoke("test", "uniaxial-compression", "--config", done[1] / "config.toml", "--out", tmp_path)
    assert again.exit_code == 0, again.output
    assert (tmp_path / "config.toml").read_text() == (done[1] / "config.toml").read_text()
    assert (tmp_path / "curves.csv").read_text() == (done[1] / "curves.csv").read_text()


# --- refusals --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["uniaxial-compresion"], "there is no test 'uniaxial-compresion'; did you mean 'uniaxial-compression'?"),
        (["biaxial-compression"], "test.confinement (Pa) is missing"),
        (["uniaxial-compression", "--law", "cohesive-crak"], "did you mean 'cohesive-crack'?"),
        (["uniaxial-compression", "--law", "none.py:LAW"], "there is no file none.py"),
        (["uniaxial-compression", "--set", "test.loading={type='constant',speed=-1}"], "speed = -1 m/s is not allowed"),
        (["uniaxial-compression", "--set", "test.loading={type='constant', speed='1 Pa'}"], "'Pa' is not one of m/s"),
        (["uniaxial-compression", "--set", "test.lading=1"], "there is no 'test.lading'; did you mean 'loading'?"),
        (["uniaxial-compression", "--set", "tests.speed=1"], "there is no section 'tests'; did you mean 'test'?"),
        (["uniaxial-compression", "--set", "speed=1"], "it must be like law.tensile_strength="),
        (["uniaxial-compression", "--set", 'sample.width="20"'], "sample.width = '20' is not allowed, a text"),
        (["uniaxial-compression", "--set", 'sample.grains="60"'], "grains = '60' is not allowed"),
        (["uniaxial-compression", "--set", "test.samples=.5"], "samples = 0.5 is not allowed"),
        (["uniaxial-compression", "--set", "test.platens=rouh"], "did you mean 'rough'? (one of: smooth, rough)"),
        (["uniaxial-compression", "--set", "law.softening=hordik"], "did you mean 'hordijk'?"),
        (["uniaxial-compression", "--set", "law.closure=bandis"], "law.closure.maximum_closure (m) is missing"),
        (["uniaxial-compression", "--set", "law.closure.kn=1"], "there is no 'law.closure.kn'"),
        (["uniaxial-compression", "--set", "law.closure=3"], "must be a name or a table"),
        (["uniaxial-compression", "--set", "law.kN=1"], "there is no 'law.kN'; did you mean 'kn'?"),
        (["uniaxial-compression", "--set", "sample.grainz=9"], "did you mean 'grains'?"),
        (["uniaxial-compression", "--set", "sample.region=disk"], "did you mean 'disc'?"),
        (["uniaxial-compression", "--set", "sample.region=disc"], "sample.diameter is missing"),
        (["uniaxial-compression", "--set", "rock.type=rigid"], "rock.density (kg/m3) is missing"),
        (["uniaxial-compression", "--set", "test.type=direct-shear"], "test.type = 'direct-shear' is not allowed"),
        (["uniaxial-compression", "--threads", "0"], "threads = 0 is not allowed"),
        (["uniaxial-compression", "--grains", "0"], "grains = 0 is not allowed"),
        (["uniaxial-compression", "--set", "numerics.mass_scaling=0.5"], "mass_scaling = 0.5 is not allowed"),
        (["joint-tension", "--grains", "4"], "there is no 'sample.grains'"),
        (["uniaxial-compression", "--config", "none.toml"], "none.toml"),
        (["uniaxial-compression", "--config", "broken.toml"], "broken.toml is no TOML"),
        (["uniaxial-compression", "--config", "sections.toml"], "there is no section 'lawz'; did you mean 'law'?"),
        (["uniaxial-compression", "--config", "flat.toml"], "it must be a section [law]"),
    ],
    ids=lambda value: " ".join(value[-2:]) if isinstance(value, list) else "",
)  # fmt: skip
def test_refusals_are_one_message_and_leave_nothing(arguments, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("broken.toml").write_text("[law\n")
    Path("sections.toml").write_text("[lawz]\n")
    Path("flat.toml").write_text('law = "linear"\n')
    result = invoke("test", *arguments, "--quick", "--out", "out")
    assert result.exit_code == 2
    assert words in " ".join(result.output.split())
    assert "Traceback" not in result.output
    assert isinstance(result.exception, SystemExit)
    assert not Path("out").exists()


def test_a_specimen_that_does_not_fit_the_test_is_refused(tmp_path):
    disc = ("--set", "sample.region=disc", "--set", "sample.diameter=20 mm")
    result = invoke("test", "uniaxial-compression", "--quick", *disc, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert "the specimen has no boundary named left or right" in result.output
    assert not (tmp_path / "out").exists()


# --- tests that cannot end -------------------------------------------------------------------------------------------


def test_a_law_stiffer_than_it_says_is_refused_before_the_test(tmp_path):
    (tmp_path / "mine.py").write_text(STIFFER.replace("asked > 50", "opening < 1"))
    law = ("--law", f"{tmp_path / 'mine.py'}:Stiffer")
    result = invoke("test", "uniaxial-compression", *SMALL, *law, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert "normal traction grows by 1e+16 Pa/m" in " ".join(result.output.replace("│", " ").split())
    assert "Traceback" not in result.output
    assert not (tmp_path / "out").exists()


@pytest.mark.thorough
def test_an_unstable_run_keeps_what_it_recorded(tmp_path):
    (tmp_path / "mine.py").write_text(STIFFER)
    result = invoke(
        "test", "uniaxial-compression", *SMALL, "--law", f"{tmp_path / 'mine.py'}:Stiffer", "--out", tmp_path,
        "--set", "test.loading={type='constant',speed=0.05}",
    )  # fmt: skip
    assert result.exit_code == 1
    assert "the run became unstable at step" in result.output
    assert "Traceback" not in result.output
    assert "Incomplete: the run became unstable" in Page(tmp_path / "report.html").text
    content = json.loads((tmp_path / "summary.json").read_text())
    assert "unstable" in content["incomplete"]
    record = json.loads((tmp_path / "run.json").read_text())
    assert record["status"] == content["incomplete"]
    assert record["configuration"]["law"]["kn"] == "100 TPa/m"
    assert (tmp_path / "curves.csv").exists()


@pytest.mark.thorough
def test_a_specimen_that_breaks_under_the_confinement_keeps_what_it_recorded(tmp_path):
    (tmp_path / "soil.toml").write_text(
        '[law]\ntype = "mohr-coulomb"\ntensile_strength = "1 Pa"\ncohesion = "2 Pa"\nfriction_angle = 0.5\n'
        'residual_friction_angle = 0.1\n[test]\nconfinement = "30 MPa"\n'
    )
    result = invoke("test", "biaxial-compression", *SMALL, "--config", tmp_path / "soil.toml", "--out", tmp_path)
    assert result.exit_code == 1
    assert "broke under the confinement of 30 MPa alone" in " ".join(result.output.split())
    page = Page(tmp_path / "report.html")
    assert "Incomplete" in page.text
    with (tmp_path / "curves.csv").open() as file:
        assert len(list(csv.DictReader(file))) > 0


@pytest.mark.thorough
def test_a_law_of_ones_own_runs_with_its_parameters_and_parts(tmp_path):
    text = "from grainlaw.laws import CohesiveCrack\nlaw = CohesiveCrack(kn=1e14, ks=9e13, tensile_strength=5e6, "
    text += "cohesion=2e7, friction_angle=30, residual_friction_angle=5, mode_i_energy=20, mode_ii_energy=40)\n"
    (tmp_path / "mine.py").write_text(text)
    reference = f"{tmp_path / 'mine.py'}:law"
    result = invoke("test", "joint-tension", "--law", reference, "--set", "law.tensile_strength=4 MPa",
                    "--set", "law.closure.type=bandis", "--set", "law.closure.maximum_closure=1 mm",
                    "--set", "sample.height=2 mm", "--out", tmp_path)  # fmt: skip
    assert result.exit_code == 0, result.output
    content = json.loads((tmp_path / "summary.json").read_text())
    record = json.loads((tmp_path / "run.json").read_text())
    assert record["configuration"]["law"]["type"] == reference
    assert record["configuration"]["law"]["kn"] == "100 TPa/m"
    assert content["properties"]["strength"] == pytest.approx(4e6, rel=0.01)


@pytest.mark.parametrize(
    "command", [("test", "uniaxial-compression"), ("study", "run", "x.toml"), ("calibrate", "x.toml")]
)
def test_a_command_that_is_stopped_before_it_has_begun_says_so(command, tmp_path, monkeypatch):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.chdir(tmp_path)
    (tmp_path / "x.toml").write_text("")
    monkeypatch.setattr("tomllib.loads", interrupted)
    monkeypatch.setattr(importlib.import_module("grainlaw.cli.test"), "gathered", interrupted)
    result = invoke(*command, "--quick")
    assert result.exit_code == 130
    assert "stopped; go on with the same command" in result.output
