"""What commands answer with --json: one document on the output stream, also of what is refused."""

import json
import math
import os
import subprocess
import sys

import pytest
from click.testing import CliRunner
from command_line import SMALL, study_file

from grainlaw.cli.answers import document
from grainlaw.cli.commands import COMMANDS, main
from grainlaw.laws import MohrCoulomb

SPRING = """
import attrs
import grainlaw as gl

@attrs.frozen(kw_only=True)
class Spring(gl.ContactLaw):
    kn: float = gl.parameter("Pa/m", default=5e13)
    ks: float = gl.parameter("Pa/m", default=4e13)
    stiffness = property(lambda self: (self.kn, self.ks))

    def traction(self, opening, slip):
        return self.kn * opening, self.ks * slip
"""
WITHOUT = {"schema"}  #: its words are JSON


def asked(*arguments, code=0):
    """The document, which is all of the output stream."""
    done = CliRunner().invoke(main, [*map(str, arguments), "--json"])
    assert done.exit_code == code, done.output
    return json.loads(done.stdout)


def test_every_command_takes_it():
    for name in set(COMMANDS) - WITHOUT - {"study"}:
        assert "--json" in CliRunner().invoke(main, [name, "--help"]).output, name
    for name in ("run", "status", "estimate", "table"):
        assert "--json" in CliRunner().invoke(main, ["study", name, "--help"]).output, name


def test_a_document_has_null_for_what_is_no_number():
    assert json.loads(document({"a": [math.nan, 1.5], "b": {"c": math.inf}, "d": MohrCoulomb})) == {
        "a": [None, 1.5], "b": {"c": None}, "d": str(MohrCoulomb)
    }  # fmt: skip


@pytest.mark.parametrize(
    ("words", "error"),
    [
        (["test", "creeep"], "there is no test 'creeep'; did you mean 'creep'"),
        (["test", "creep", "--grains", "x"], "Invalid value for '--grains'"),
        (["tset"], "there is no command 'tset'; did you mean 'test'"),
        (["elastic", "--nothing"], "No such option"),
        (["study", "table", "none.toml"], "none.toml"),
        (["schema"], "No such option"),
    ],
)
def test_what_is_refused_is_an_error_of_the_document(words, error):
    assert error in asked(*words, code=2)["error"]


def test_a_fault_is_an_error_of_the_document(monkeypatch):
    def fails(*_):
        raise RuntimeError("broken")

    monkeypatch.delenv("GRAINLAW_TRACEBACK", raising=False)
    monkeypatch.setattr("grainlaw.cli.cache.cache_folder", fails)
    assert "a fault of grainlaw (RuntimeError" in asked("cache", code=1)["error"]


@pytest.mark.thorough
def test_laws_materials_the_cache_and_elastic_properties(tmp_path):
    law = asked("law", "mohr-coulomb", "--out", tmp_path)
    assert law["tension"]["peak"] == pytest.approx(13e6, rel=1e-3)
    assert law["tension"]["pressure"] is None
    material = asked("material", "elastic", "--out", tmp_path)
    assert material["passed"]
    assert material["entries"]
    assert set(asked("cache")) >= {"folder", "functions", "bytes", "limit", "used"}
    rock = asked("elastic", "--quick", "--grains", "12", "--out", tmp_path / "rock.json")
    written = json.loads((tmp_path / "rock.json").read_text())
    assert {name: written[name] for name in rock} == rock


@pytest.mark.thorough
def test_a_law_that_is_checked(tmp_path):
    (tmp_path / "spring.py").write_text(SPRING)
    found = asked("check", f"{tmp_path / 'spring.py'}:Spring")
    assert found["passed"]
    assert not found["flutters"]


@pytest.mark.thorough
def test_a_test_its_folder_and_its_repetition(tmp_path):
    done = asked("test", "uniaxial-compression", *SMALL, "--out", tmp_path / "a")
    assert done["properties"] == json.loads((tmp_path / "a" / "summary.json").read_text())["properties"]
    assert (done["test"], done["folder"]) == ("uniaxial-compression", str(tmp_path / "a"))
    seen = asked("watch", tmp_path / "a")
    assert (seen["state"], len(seen["parts"])) == ("finished", 1)
    again = asked("rerun", tmp_path / "a")
    assert (again["same"], again["differences"]) == (True, [])
    refused = asked("test", "uniaxial-compression", *SMALL, "--out", tmp_path / "a", code=2)
    assert "holds a run" in refused["error"]


@pytest.mark.thorough
def test_a_test_that_could_not_end_has_its_properties_and_the_error(tmp_path):
    """It breaks under the confinement alone."""
    soil = (
        "type=mohr-coulomb",
        "tensile_strength=1",
        "cohesion=2",
        "friction_angle=0.5",
        "residual_friction_angle=0.1",
    )
    weak = [word for each in soil for word in ("--set", f"law.{each}")]
    pressed = ["--set", "test.confinement=30 MPa"]
    done = asked("test", "biaxial-compression", *SMALL, *weak, *pressed, "--out", tmp_path, code=1)
    assert done["error"]
    assert "steps" in done["properties"]


@pytest.mark.thorough
def test_a_comparison_and_an_envelope(tmp_path):
    small = ["--quick", "--grains", "12", "--max-strain", "0.0001"]
    found = asked("compare", *small, "--seeds", "1,2", "--laws", "linear,mohr-coulomb", "--out", tmp_path / "c")
    written = json.loads((tmp_path / "c" / "summary.json").read_text())
    assert (found["laws"], found["samples"]) == (written["laws"], written["samples"])
    found = asked("envelope", *small, "--confinement", "0,1", "--out", tmp_path / "e")
    written = json.loads((tmp_path / "e" / "summary.json").read_text())
    assert {name: written[name] for name in found if name != "folder"} == {
        name: value for name, value in found.items() if name != "folder"
    }
    assert {"confinement", "strength", "tests", "failed"} <= set(found)


@pytest.mark.thorough
def test_a_study_its_status_its_table_and_what_it_will_take(tmp_path):
    file = study_file(tmp_path, '"sample.seed" = "1..2"\n')
    before = asked("study", "estimate", file)
    assert (before["cases"], before["measured"]) == (2, False)
    done = asked("study", file, "--workers", "1")
    assert (done["finished"], done["missing"], done["factors"]) == (2, 0, ["seed"])
    assert [row["seed"] for row in done["rows"]] == [1, 2]
    table = asked("study", "table", file)
    assert table["rows"] == done["rows"]
    assert asked("study", "status", file) == {"cases": 2, "finished": 2, "failed": {}, "missing": 0, "reasons": []}
    assert asked("watch", tmp_path / "granite")["done"] == 2


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="pipes are those of Unix")
def test_a_command_ends_in_silence_where_nobody_reads_on():
    """As ``grainlaw schema | head -1``."""
    read, write = os.pipe()
    os.close(read)
    with os.fdopen(write, "w") as closed:
        done = subprocess.run(
            [sys.executable, "-m", "grainlaw", "schema"], stdout=closed, stderr=subprocess.PIPE, text=True
        )
    assert (done.returncode, done.stderr) == (1, "")
