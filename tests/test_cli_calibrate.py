"""Calibration from the command line: what a file asks for, what is refused, killed and called again."""

import importlib
import json
import os
import signal
import subprocess
import sys
import time
import tomllib
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from command_line import invoke

import grainlaw as gl
from grainlaw.calibration.targets import Target
from grainlaw.cli.calibrate import _pair, _tie, _write, calibration_of, targets_of
from grainlaw.cli.components import own, settings
from grainlaw.cli.configuration import configured
from grainlaw.cli.material import EXAMPLES
from grainlaw.cli.sections import read_file, toml
from grainlaw.fields import ParameterError
from grainlaw.runs.progress_file import of_process
from grainlaw.runs.stopping import Stopped
from grainlaw.studies.watched import watched
from grainlaw.studies.workers import Whole
from grainlaw.units import GPa, MPa

calibrate = importlib.import_module("grainlaw.cli.calibrate")
FILE = """
[targets]
ucs = ["45 MPa", "1 MPa"]
tensile_strength = "5 MPa"

[free]
tensile_strength = ["3 MPa", "12 MPa"]
cohesion = ["10 MPa", "30 MPa"]

[sample]
width = "20 mm"
height = "40 mm"
grains = 20

[law]
type = "mohr-coulomb"
friction_angle = 25

[tests]
compression = {samples = 60, maximum_strain = "0.4 %"}
tension = {samples = 60}

[calibration]
seeds = 2
budget = 10
more = 4
fresh = 3
"""


def written(folder, text=FILE):
    file = folder / "rock.toml"
    file.write_text(text)
    return file


def test_a_file_says_what_is_looked_for(tmp_path):
    text = FILE + "also = ['brazilian_strength']\n\n[tied]\nresidual_cohesion = {of = 'cohesion', times = '10 %'}\n"
    asked = calibration_of(
        written(tmp_path, text + "\n[disc]\ngrains = 30\ndiameter = '30 mm'\n"), options={"seeds": 4}
    )
    given = asked.given
    assert given["targets"].ucs.uncertainty == 1 * MPa
    assert given["free"] == {"tensile_strength": (3 * MPa, 12 * MPa), "cohesion": (10 * MPa, 30 * MPa)}
    assert given["tied"] == {"residual_cohesion": ("cohesion", pytest.approx(0.1))}
    assert (given["seeds"], given["budget"], given["also"]) == (4, 10, ("brazilian_strength",))
    assert given["law"].friction_angle == 25
    assert given["tests"]["compression"].maximum_strain == pytest.approx(0.004)
    assert given["tests"]["compression"].until is gl.Until.FAILURE  # the usual one of a calibration
    assert (asked.specimens["prism"](3).grains.count, asked.specimens["disc"](1).grains.count) == (20, 30)
    one, other = (asked.specimens["prism"](seed).grains.centroids for seed in (1, 2))
    assert abs(one - other).max() > 1e-4
    assert "half_disc" not in asked.specimens  # nothing asks for it


def test_a_target_brings_its_specimens(tmp_path):
    asked = calibration_of(written(tmp_path, FILE.replace("ucs =", 'fracture_toughness = "1 MPa sqrt(m)"\nucs =')))
    assert "notch" in asked.specimens["half_disc"](1).mesh.boundaries


def test_targets_have_units():
    targets = targets_of({"youngs_modulus": "60 GPa", "fracture_toughness": ["1.2 MPa sqrt(m)", 5e4],
                          "ucs": 1e8, "confinements": "4 MPa"})  # fmt: skip
    assert targets.youngs_modulus.value == 60 * GPa
    assert (targets.fracture_toughness.value, targets.fracture_toughness.uncertainty) == (1.2e6, 5e4)
    assert targets.pressures == (4 * MPa,)
    triaxial = targets_of({"triaxial": [["20 MPa", "404 MPa"], [75e6, "703 MPa", "9 MPa"]]}).triaxial
    assert triaxial == {20 * MPa: Target(404 * MPa, 8.08 * MPa), 75 * MPa: Target(703 * MPa, 9 * MPa)}
    for wrong in ({"20 MPa": "404 MPa"}, ["20 MPa", "404 MPa"], [["20 MPa"]]):
        with pytest.raises(ParameterError, match=r"targets\.triaxial = .* a list of \[confinement, strength\]"):
            targets_of({"triaxial": wrong})


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[targets]", "[target]", "there is no section 'target' in a calibration; did you mean 'targets'?"),
        ("ucs =", "usc =", "there is no 'targets.usc'; did you mean 'ucs'?"),
        ('"5 MPa"', '"5 mm"', "targets.tensile_strength = '5 mm' is not allowed"),
        ("cohesion =", "cohesoin =", "there is no 'free.cohesoin'; did you mean 'cohesion'?"),
        ('["10 MPa", "30 MPa"]', '"20 MPa"', "free.cohesion = '20 MPa' is not allowed, it must be a list"),
        ('["10 MPa", "30 MPa"]', '["20 MPa"]', "free.cohesion = ['20 MPa'] is not allowed, it must be a list: lowest"),
        ('["10 MPa", "30 MPa"]', '["60 MPa", "20 MPa"]', "free.cohesion = ['60 MPa', '20 MPa'] is not allowed"),
        ("budget = 10", "budget = 9", "calibrate: budget = 9 is not allowed, it must be at least 10: 2 times 5 points"),
        ("[calibration]", "[calibration]\nelastic = 'none'", "elastic = 'none' is not allowed"),
        ("tension =", "pulling =", "there is no 'tests.pulling'"),
        ("[law]", "[numerics]\nmass_scaling = 2\n[law]", "there is no 'numerics.mass_scaling'"),
        ("[targets]", "[test]\ntype = 'brazilian'\n[targets]", "there is no section 'test' in a calibration"),
        ("[calibration]", "[calibration]\nalso = ['strength']", "also: there is no quantity 'strength'"),
        ("[calibration]", "[calibration]\nalso = 3", "Settings: also = 3 is not allowed, it must be a list"),
        ("tension = {samples = 60}", "tension = 60", "tests.tension = 60 is not allowed, it must be a table"),
        ("[law]", "[disc]\nfile = 'a.tess'\n[law]", "disc.file is not allowed: seeds must make other grains"),
        ('"5 MPa"', '"5 MPa"\nfriction_angle = 95', "friction_angle = 95.0 is not allowed, it must be below 90"),
    ],
)
def test_what_is_wrong_is_refused_before_any_work(tmp_path, old, new, words):
    assert old in FILE
    result = invoke("calibrate", written(tmp_path, FILE.replace(old, new)))
    assert result.exit_code == 2
    assert words in " ".join(result.output.split())
    assert not list((tmp_path / "rock").glob("tests/cases/*")) if (tmp_path / "rock").exists() else True


def test_a_rock_with_several_laws_is_refused(tmp_path):
    text = (
        '[rock]\ntype = "granite-aboayanah-2024"\n[targets]\nucs = "200 MPa"\n[free]\ncohesion = ["10 MPa", "30 MPa"]'
    )
    words = (
        r"rock\.type = 'granite-aboayanah-2024' is not allowed in a calibration, .* it has others \(inside feldspar, "
    )
    with pytest.raises(ParameterError, match=words):
        calibration_of(written(tmp_path, text))


def numbers(folder):
    content = json.loads((folder / "calibration.json").read_text())
    return {name: content[name] for name in ("parameters", "points", "values", "checks", "identifiability")}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    file = written(tmp_path_factory.mktemp("calibration"))
    result = invoke("calibrate", file, "--workers", 2)
    return file, result


@pytest.mark.parametrize("pair", ["20 MPa", 2e7, [], ["20 MPa"], ["10 MPa", "20 MPa", "30 MPa"], {"low": 1, "high": 2}])
def test_what_is_no_range_is_refused(pair):
    with pytest.raises(gl.ParameterError, match=r"free.kn = .* is not allowed, it must be a list: lowest and highest"):
        _pair("free.kn", pair, "Pa")
    assert _pair("free.kn", ["10 MPa", 3e7], "Pa") == (1e7, 3e7)


@pytest.mark.parametrize("tie", [2, {"of": "cohesion"}, {"of": "cohesion", "times": 2, "more": 1}, ["of", "times"]])
def test_what_is_no_tie_is_refused(tie):
    with pytest.raises(gl.ParameterError, match=r"tied.kn = .* is not allowed, it must be like"):
        _tie("tied.kn", tie)
    assert _tie("tied.kn", {"of": "cohesion", "times": "10 %"}) == ("cohesion", 0.1)


@pytest.mark.parametrize("plausible", [True, False])
def test_options_of_the_command_and_its_exit_code(plausible, tmp_path, monkeypatch):
    seen, wrote, seeds = {}, [], []
    found = SimpleNamespace(
        is_plausible=plausible, write=wrote.append, summary={"plausible": plausible}, tried=(13, 14),
        typical=lambda shape: (14, f"the {shape}"),
    )  # fmt: skip

    def write(found, chosen, file, about):
        assert about == "the prism"
        wrote.append(file.parent)
        seeds.append(chosen.sections["sample"]["seed"])

    monkeypatch.setattr(calibrate, "run", lambda **given: seen.update(given) or found)
    monkeypatch.setattr(calibrate, "_write_rock", write)
    options = ("--out", tmp_path / "out", "--budget", 12, "--seeds", 5, "--workers", 3, "--on", "tcp://host:1")
    done = invoke("calibrate", written(tmp_path), *options)
    assert done.exit_code == (not plausible)
    assert [seen[name] for name in ("budget", "seeds", "workers", "on")] == [12, 5, 3, "tcp://host:1"]
    assert seen["more"] == 4  # of the file
    assert seen["store"] == tmp_path / "out" / "tests"
    assert wrote == [tmp_path / "out"] * (1 + plausible)
    assert seeds == [14] * plausible  # the nearest to the means
    assert ("the targets are in conflict" in done.output) == (not plausible)


def test_an_answer_to_other_targets_is_told_before_it_is_replaced(tmp_path, monkeypatch):
    """Stopped then, only what this call wrote is said to be written."""
    stopped = Stopped("stopped in the first wave", signal.SIGINT)

    def stop(**given):
        raise stopped

    def content(asked):
        targets = {name: attrs.asdict(target) for name, target in asked.given["targets"].given.items()}
        return {"targets": targets, "ranges": asked.given["free"]}

    monkeypatch.setattr(calibrate, "run", stop)
    file, folder = written(tmp_path), tmp_path / "rock"
    folder.mkdir()
    assert "of before" not in invoke("calibrate", file).output
    (folder / "calibration.json").write_text(json.dumps(content(calibration_of(file))))
    (folder / "tests").mkdir()
    same = invoke("calibrate", file).output
    assert "other targets or ranges" not in same
    assert f"written to {folder}/: tests/; of before: calibration.json" in same
    other = invoke("calibrate", written(tmp_path, FILE.replace('"30 MPa"', '"31 MPa"'))).output
    assert "has the answer to other targets or ranges: calibration.json are replaced in the end" in other


@pytest.mark.parametrize("posterior", [None, "samples"])
def test_a_first_look_that_finds_nothing_fails(posterior, tmp_path, monkeypatch):
    look = SimpleNamespace(posterior=posterior, summary={"best": {}})
    monkeypatch.setattr(calibrate, "first_look", lambda **given: look)
    done = invoke("calibrate", written(tmp_path), "--first")
    assert done.exit_code == (posterior is None)
    assert ("no parameters in the ranges meet the targets" in done.output) == (posterior is None)


def test_any_value_of_the_file_can_be_set(tmp_path):
    asked = calibration_of(written(tmp_path), ["calibration.fresh=21", 'free.cohesion=["11 MPa", "31 MPa"]'])
    assert asked.given["fresh"] == 21
    assert asked.given["free"]["cohesion"] == (11 * MPa, 31 * MPa)
    with pytest.raises(ParameterError, match="there is no section 'calibraton'; did you mean 'calibration'"):
        calibration_of(written(tmp_path), ["calibraton.fresh=21"])


def test_what_is_stopped_on_its_fresh_specimens_has_an_answer(tmp_path, monkeypatch):
    """All that the search has found, before it is tried."""
    wrote, stopped = [], Stopped("stopped on the fresh specimens", signal.SIGINT)
    stopped.result = SimpleNamespace(
        is_plausible=True, tried=(), typical=lambda shape: (1, ""),
        write=lambda folder: (folder / "report.html").write_text("so far"),
    )  # fmt: skip

    def stop(**given):
        raise stopped

    monkeypatch.setattr(calibrate, "run", stop)
    monkeypatch.setattr(calibrate, "_write_rock", lambda *given, about: wrote.append((given[-1].parent, about)))
    done = invoke("calibrate", written(tmp_path))
    assert done.exit_code == 128 + signal.SIGINT
    assert wrote == [(tmp_path / "rock", "")]
    assert f"written to {tmp_path / 'rock'}/: report.html" in done.output
    given = calibration_of(written(tmp_path)).given
    targets = {name: attrs.asdict(target) for name, target in given["targets"].given.items()}
    tried = {"targets": targets, "ranges": given["free"], "checks": [{"name": "ucs"}]}
    (tmp_path / "rock" / "calibration.json").write_text(json.dumps(tried))
    kept = invoke("calibrate", written(tmp_path))
    assert len(wrote) == 1  # it is better than one that was not tried
    assert "of before: report.html, calibration.json" in kept.output
    assert f"{tmp_path / 'rock'} keeps the answer that it has, which was tried on fresh specimens" in kept.output


def test_another_process_that_calibrates_in_the_folder_is_told(tmp_path, monkeypatch):
    """From its first moment on, before it has tested anything; it may test more than was planned."""
    monkeypatch.setattr(calibrate, "run", lambda **given: 1 / 0)
    file, folder = written(tmp_path), tmp_path / "rock"
    assert "another process" not in invoke("calibrate", file).output
    (folder / "tests").mkdir(parents=True)
    whole = Whole("calibration", 12, of_process(folder / "tests", {}), None)
    whole.begin()
    seen = watched(folder)
    assert (seen.kind, seen.state, seen.done, seen.total) == ("calibration", "running", 0, 12)
    assert f"another process calibrates in {folder}: the answer" in " ".join(invoke("calibrate", file).output.split())
    whole.done |= {str(k) for k in range(15)}
    whole.begin()
    assert (watched(folder).done, watched(folder).total) == (15, 15)


@pytest.mark.thorough
def test_what_is_stopped_among_its_tests_has_no_answer(tmp_path, monkeypatch):
    """A study that is stopped has its table as its result; of a calibration that is none."""

    def stop(self, *given, **options):
        stopped = Stopped("stopped by a signal", signal.SIGTERM)
        stopped.result = gl.Study
        raise stopped

    monkeypatch.setattr(gl.Study, "run", stop)
    done = invoke("calibrate", written(tmp_path))
    assert done.exit_code == 128 + signal.SIGTERM, done.output
    assert "fault" not in done.output
    assert "go on with the same command" in done.output


def found(*, law, rock=lambda rock: rock, typical=(1, "")):
    """An answer that writes nothing of its own."""
    return SimpleNamespace(
        law=law, rock=rock, write=lambda folder: None, is_plausible=True, tried=(13, 14), typical=lambda shape: typical
    )


def test_the_rock_that_was_found_is_a_file_that_runs(tmp_path):
    asked = calibration_of(written(tmp_path))
    law = attrs.evolve(asked.given["law"], tensile_strength=7 * MPa, cohesion=21 * MPa)
    stiff = gl.Elastic(youngs_modulus=50 * GPa, poissons_ratio=0.2, density=2700)
    answer = found(law=law, rock=lambda rock: attrs.evolve(rock, material=stiff), typical=(13, "seed 13: UCS 85 MPa"))
    _write(answer, asked, tmp_path)
    assert "\n# seed 13: UCS 85 MPa\n" in (tmp_path / "calibrated.toml").read_text()
    made = configured("uniaxial-tension", read_file(tmp_path / "calibrated.toml"))
    assert made.law == law
    assert made.specimen.material == stiff
    assert made.specimen.grains.count == 20
    assert not (tmp_path / "calibrated-disc.toml").exists()
    (tmp_path / "calibrated-disc.toml").write_text("of another answer")
    answer.is_plausible = False
    _write(answer, asked, tmp_path)  # in conflict: what the folder had is of other targets
    assert [*tmp_path.glob("calibrated*")] == []


def test_the_minerals_and_the_class_that_were_calibrated_are_in_its_file(tmp_path):
    """The rock between its minerals was left out, and so were the class of a mineral and the file of a material."""
    (tmp_path / "mine.py").write_text(
        "import grainlaw as gl\n\n\nclass Rock(gl.Elastic):\n    pass\n\n\n"
        "hard = Rock(youngs_modulus=80e9, poissons_ratio=0.1, density=2600)\n"
    )
    rocks = {"mica": settings(EXAMPLES["transversely-isotropic"]), "old": {"youngs_modulus": "45 GPa"}}
    rock = {"type": "mine.py:hard", "youngs_modulus": "90 GPa"}
    minerals = "minerals = {quartz = 0.6, mica = 0.3, old = 0.1}\n\n"
    text = FILE.replace("[law]", f"{minerals}{toml({'rock': rock, 'rocks': rocks})}\n[law]")
    asked = calibration_of(written(tmp_path, text))
    folder = tmp_path / "answer"
    folder.mkdir()
    _write(found(law=asked.given["law"]), asked, folder)
    known = asked.specimens["prism"](1).material
    (tmp_path / "mine.py").unlink()
    made = configured("uniaxial-tension", read_file(folder / "calibrated.toml"))
    assert {name: attrs.asdict(rock) for name, rock in made.specimen.material.items()} == {
        name: attrs.asdict(rock) for name, rock in known.items()
    }
    assert made.specimen.material[...].youngs_modulus == 90 * GPa
    assert [type(made.specimen.material[name]).__name__ for name in ("mica", "old")] == [
        "TransverselyIsotropic", "Rock",
    ]  # fmt: skip


def test_the_disc_of_a_calibration_is_in_a_file_of_its_own(tmp_path):
    disc = '\n[disc]\ndiameter = "33 mm"\ngrain_size = "4 mm"\n'
    asked = calibration_of(written(tmp_path, f"{FILE}also = ['brazilian_strength']\n{disc}"))
    _write(found(law=asked.given["law"]), asked, tmp_path)
    made = configured("brazilian", read_file(tmp_path / "calibrated-disc.toml"))
    assert np.ptp(made.specimen.grains.region.bounds, axis=0)[0] == pytest.approx(0.033, rel=2e-3)  # it has flat ends


@pytest.mark.slow
def test_the_answer_is_printed_and_written(done):
    file, result = done
    assert result.exit_code == 0, result.output
    assert "MohrCoulomb" in result.output
    page = (file.with_suffix("") / "report.html").read_text()
    assert page.count("<img") >= 3
    content = json.loads((file.with_suffix("") / "calibration.json").read_text())
    assert content["plausible"]
    assert {"tensile_strength", "cohesion"} == set(content["parameters"])
    assert 6 <= len(content["points"]) <= 10
    ucs = next(row for row in content["checks"] if row["name"] == "ucs")
    assert ucs["count"] == 3
    assert abs(ucs["measured"] / (45 * MPa) - 1) < 0.2


@pytest.mark.slow
def test_the_calibrated_rock_can_be_tested(done, tmp_path):
    file, _ = done
    config = file.with_suffix("") / "calibrated.toml"
    law = tomllib.loads(config.read_text())["law"]
    found = json.loads((file.with_suffix("") / "calibration.json").read_text())["parameters"]
    out = tmp_path / "out"
    called = ("test", "uniaxial-tension", "--config", config, "--out", out, "--set", "test.samples=60", "--threads", 1)
    assert invoke(*called).exit_code == 0
    made = tomllib.loads((out / "config.toml").read_text())["law"]
    assert made["tensile_strength"] == law["tensile_strength"]
    assert gl.Targets(ucs=(1e8, 0)).ucs.value  # the names are public
    assert found["tensile_strength"] == pytest.approx(_in_pa(law["tensile_strength"]))


def _in_pa(text):
    from grainlaw.unit_text import quantity

    return quantity(text, "Pa")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of Unix")
def test_killed_and_called_again_it_goes_on_to_the_same_answer(done, tmp_path):
    file = written(tmp_path)
    call = [sys.executable, "-m", "grainlaw", "calibrate", str(file), "--workers", "2"]
    for wait in (6, 9, 12, 15):
        process = subprocess.Popen(call, stderr=subprocess.DEVNULL, start_new_session=True)
        try:
            process.wait(wait)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        time.sleep(0.5)
    assert subprocess.run(call, stderr=subprocess.DEVNULL, check=False).returncode == 0
    assert numbers(file.with_suffix("")) == numbers(done[0].with_suffix(""))


def test_minerals_are_written_without_the_word_for_their_kind():
    assert own(settings(gl.Elastic(youngs_modulus=9e10, poissons_ratio=0.1, density=2600))) == {
        "youngs_modulus": "90 GPa", "poissons_ratio": 0.1, "density": "2600 kg/m3", "plane": "strain",
    }  # fmt: skip


@pytest.mark.thorough
def test_a_first_look_runs_and_writes_nothing(tmp_path):
    file = written(tmp_path)
    said = invoke("calibrate", str(file), "--first").stdout
    assert "first look, by no test" in said
    assert [line.split()[0] for line in said.splitlines()[2:4]] == ["tensile_strength", "cohesion"]
    assert list(tmp_path.iterdir()) == [file]
    other = FILE.replace("mohr-coulomb", "munjiza")
    refused = invoke("calibrate", str(written(tmp_path, other)), "--first")
    assert refused.exit_code == 2
    assert "does not know this rock: it knows MohrCoulomb and CohesiveCrack, not MunjizaJoint" in refused.output
