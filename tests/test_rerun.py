"""A run is repeated from its folder: with its law files as they were, and every difference is said."""

import hashlib
import json

import click
import pytest
from click.testing import CliRunner
from command_line import SMALL, invoke

from grainlaw.cli.law_copy import copied
from grainlaw.cli.rerun import _differences, rerun

LAW = """
from parts import KN
from grainlaw.laws import MohrCoulomb
law = MohrCoulomb(kn=KN, ks=9e13, tensile_strength=5e6, cohesion=2e7, friction_angle=30, residual_friction_angle=5)
"""
NOT_SO = "from grainlaw.laws import Linear\nlaw = Linear(kn=1e14, ks=9e13)\n"


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A test with a law of one's own that imports a helper; both files are changed afterwards."""
    place = tmp_path_factory.mktemp("rerun")
    (place / "mine.py").write_text(LAW)
    (place / "parts.py").write_text("KN = 1e14\n")
    (place / "run.toml").write_text('[law]\ntype = "mine.py:law"\n')  # relative to this file, wherever one is
    result = invoke("test", "uniaxial-tension", *SMALL, "--config", place / "run.toml", "--out", place / "out")
    assert result.exit_code == 0, result.output
    (place / "mine.py").write_text(NOT_SO)
    (place / "parts.py").unlink()
    return place


@pytest.mark.thorough
def test_the_law_files_are_copied_and_named_in_the_record(done):
    assert (done / "out" / "law_files" / "mine.py").read_text() == LAW
    assert (done / "out" / "law_files" / "parts.py").read_text() == "KN = 1e14\n"
    record = json.loads((done / "out" / "run.json").read_text())
    assert [entry["copy"] for entry in record["law_files"]] == ["law_files/mine.py", "law_files/parts.py"]
    assert record["law_files"][0]["file"] == str(done / "mine.py")
    assert len(record["law_files"][0]["sha256"]) == 64


@pytest.mark.thorough
def test_a_run_is_repeated_with_the_same_numbers(done):
    result = invoke("rerun", done / "out", "--out", done / "again")
    assert result.exit_code == 0, result.output
    assert f"every number is the same as in {done / 'out'}" in result.output
    for name in ("curves.csv", "cracks.csv", "config.toml"):
        assert (done / "again" / name).read_bytes() == (done / "out" / name).read_bytes()


@pytest.mark.parametrize("name", ["run.json", "study.json"])
def test_a_run_is_not_repeated_into_another_one(name, tmp_path):
    for folder, file in (("out", "run.json"), ("again", name)):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / file).write_text('{"command": {"name": "test", "arguments": {}}}')
    result = invoke("rerun", tmp_path / "out", "--out", tmp_path / "again")
    assert result.exit_code == 2
    assert "holds a run or a study: choose another folder (--out), or remove it" in " ".join(result.output.split())


FEW = "--set", "sample.grains=12"
OWN = """
import attrs
import grainlaw as gl
from parts import SPEED

@attrs.frozen(kw_only=True)
class Pull(gl.LoadingProtocol):
    time: float = gl.parameter("s")
    quantities = (gl.Quantity("forces", "kN/m", is_main=True),)

    def stages(self, specimen):
        drives = [gl.loads.Drive(boundary=side, axis=1, speed=v) for side, v in (("top", SPEED), ("bottom", 0))]
        return [gl.Stage(name="pull", loads=drives, until=[gl.conditions.Lasts(self.time)], interval=1e-6)]

    def measure(self, state):
        return {"force": state.reaction("top")[1]}

    def summary(self, curves, specimen):
        return {"forces": curves["force"][:2]}
"""


@pytest.mark.thorough
def test_a_test_of_ones_own_runs_from_a_file_and_is_repeated_from_its_folder(tmp_path):
    (tmp_path / "mine.py").write_text(OWN)
    (tmp_path / "parts.py").write_text("SPEED = 0.01\n")
    given, out = (*FEW, "--set", "test.time=3 us"), tmp_path / "out"
    done = invoke("test", f"{tmp_path / 'mine.py'}:Pull", *given, "--out", out)
    assert done.exit_code == 0, done.output
    assert "forces (kN/m)" in done.output
    assert (out / "test_files" / "mine.py").read_text() == OWN
    assert [each["copy"] for each in json.loads((out / "run.json").read_text())["test_files"]] == [
        "test_files/mine.py", "test_files/parts.py",
    ]  # fmt: skip
    assert 'type = "test_files/mine.py:Pull"' in (out / "config.toml").read_text()
    (tmp_path / "parts.py").unlink()
    again = invoke("rerun", out, "--out", tmp_path / "again")
    assert "every number is the same" in again.output, again.output
    asked = invoke("test", f"{out / 'test_files' / 'mine.py'}:Pull", "--config", out / "config.toml", "--template")
    assert 'time = "3 us"' in asked.output, asked.output


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("mine.py:Pul", "test.type: there is no 'Pul' in mine.py; did you mean 'Pull'? (tests in mine.py: Pull)"),
        ("mine.py", "test.type: name the test, as in mine.py:Pull (tests in mine.py: Pull)"),
        ("none.py:Pull", "test.type: there is no file none.py"),
        ("mine.py:Pull", "test.time (s) is missing: Pull needs it"),
        ("own.py:Plain", "test.type: the test Plain must be an attrs class: @attrs.frozen(kw_only=True)"),
        ("pull", "one of your own: FILE.py:TEST)"),
    ],
)
def test_a_test_of_ones_own_that_cannot_be_is_refused(name, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(OWN.replace("from parts import SPEED", "SPEED = 0.01"))
    (tmp_path / "own.py").write_text("import grainlaw as gl\nclass Plain(gl.LoadingProtocol):\n    pass\n")
    done = invoke("test", name, *FEW, "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert words in " ".join(done.output.split())


@pytest.mark.thorough
def test_a_difference_is_said(done):
    for file in (done / "out").rglob("*"):
        if file.is_file() and file.suffix in (".py", ".json", ".csv", ".toml"):
            copy = done / "other" / file.relative_to(done / "out")
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(file.read_bytes())
    (done / "other" / "law_files" / "parts.py").write_text("KN = 1.1e14\n")
    config = (done / "other" / "config.toml").read_text()
    (done / "other" / "config.toml").write_text(config.replace('kn = "100 TPa/m"', 'kn = "110 TPa/m"'))
    record = json.loads((done / "other" / "run.json").read_text())
    record["made_with"]["versions"]["numpy"] = "1.0.0"
    (done / "other" / "run.json").write_text(json.dumps(record))
    result = invoke("rerun", done / "other")
    assert result.exit_code == 1
    words = " ".join(result.output.split())
    assert "different from" in words
    assert "made with another versions" in words
    assert "another law: kn 100000000000000.0 -> 110000000000000.0" in words
    assert "curves.csv: " in words
    assert "they part in row 1 of" in words
    assert (done / "other-again" / "curves.csv").exists()


@pytest.mark.slow
def test_a_comparison_and_an_envelope_are_repeated(tmp_path):
    small = ("--quick", "--grains", "20", "--max-strain", "0.0005")
    assert invoke("compare", *small, "--laws", "linear,mohr-coulomb", "--out", tmp_path / "laws").exit_code == 0
    (tmp_path / "mine.py").write_text(LAW.replace("from parts import KN", "KN = 1e14"))
    law = f"{tmp_path / 'mine.py'}:law"
    made = invoke("envelope", *small, "--law", law, "--confinement", "0,2", "--out", tmp_path / "peaks")
    assert made.exit_code == 0, made.output
    (tmp_path / "mine.py").unlink()
    for name in ("laws", "peaks"):
        result = invoke("rerun", tmp_path / name)
        assert result.exit_code == 0, result.output
        assert "every number is the same" in result.output
    summary = json.loads((tmp_path / "peaks" / "summary.json").read_text())
    summary["tests"][1]["lost_slip"] = 7.0
    (tmp_path / "peaks" / "summary.json").write_text(json.dumps(summary))
    result = invoke("rerun", tmp_path / "peaks")
    assert result.exit_code == 1
    assert "tests.1.lost_slip 7.0 -> " in result.output


RECORD = {
    "status": "finished", "made_with": {"grainlaw": "1.0", "numpy": "2.0"}, "specimen": {"grains": 20, "sizes": [1, 2]},
    "law": {"kn": 1e14}, "protocol": {"speed": 0.1}, "options": {}, "engine": {"threads": 1},
}  # fmt: skip
CURVES = "time,stress\n0,0\n1,10\n2,20\n3,nan\n"


def write(folder, curves=CURVES, cracks="time\n", **changes):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "run.json").write_text(json.dumps(RECORD | changes))
    (folder / "curves.csv").write_text(curves)
    (folder / "cracks.csv").write_text(cracks)
    return folder


PART = "curves.csv: they part in row 2 of 4 (stress, by 2.5e-02 of its largest value); the largest difference is "


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({}, []),
        ({"made_with": {"grainlaw": "1.0", "numpy": "2.1", "scipy": "1"}}, ["made with another numpy: 2.0 -> 2.1"]),
        ({"status": "killed"}, ["it ended otherwise: finished -> killed"]),
        ({"law": {"kn": 2e14, "ks": 1}}, ["another law: kn 100000000000000.0 -> 200000000000000.0, ks None -> 1"]),
        ({"specimen": {"grains": 20, "sizes": [1, 3]}}, ["another specimen: sizes.1 2 -> 3"]),
        ({"specimen": {"grains": 20, "sizes": [1]}}, ["another specimen: sizes [1, 2] -> [1]"]),
        ({"protocol": {"speed": 1}, "engine": None}, [
            "another test: speed 0.1 -> 1", "another engine:  {'threads': 1} -> None",
        ]),
        ({"curves": CURVES.replace("10", "10.5").replace("20", "18")}, [f"{PART}1.0e-01 (stress)"]),
        ({"curves": CURVES.replace("1,10", "1.3,10.5")}, [
            "curves.csv: they part in row 2 of 4 (time, by 1.0e-01 of its largest value); the largest difference is "
            "1.0e-01 (time)",
        ]),
        ({"curves": CURVES.replace("3,nan\n", "")}, ["curves.csv: 4 rows -> 3; the rows that both have are the same"]),
        ({"curves": CURVES + "4,5\n"}, ["curves.csv: 4 rows -> 5; the rows that both have are the same"]),
        ({"curves": CURVES.replace("stress", "load")}, ["curves.csv: other columns"]),
        ({"cracks": "time\n5\n"}, ["cracks.csv: 0 rows -> 1; the rows that both have are the same"]),
    ],
)  # fmt: skip
def test_differences_by_hand(changes, says, tmp_path):
    before, now = write(tmp_path / "before"), write(tmp_path / "now", **changes)
    assert list(_differences(before, now)) == [f"  {line}" for line in says]
    several = {"runs": ["one", "other"]}
    for folder, changed in ((tmp_path / "both", {}), (tmp_path / "again", changes)):
        write(folder, **several)
        write(folder / "one")
        write(folder / "other", **changed)
    told = [f"  other: {line}" for line in says if not line.startswith(("made", "it ended"))]
    assert list(_differences(tmp_path / "both", tmp_path / "again")) == told


def test_studies_differ_by_their_summaries(tmp_path):
    for name, ucs in (("before", 5), ("now", 6)):
        folder = write(tmp_path / name, curves=f"ucs\n{ucs}\n")
        (folder / "study.json").write_text("{}")
        (folder / "summary.json").write_text(json.dumps({"ucs": ucs, "tests": [{"law": "a"}]}))
    assert list(_differences(tmp_path / "before", tmp_path / "now")) == ["  ucs 5 -> 6"]


@pytest.mark.parametrize("status", ["finished", "killed"])
@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ({"law": "mine.py:law", "grains": 20}, {"law": "{}/mine.py:law", "grains": 20}),
        ({"law": "mohr-coulomb"}, {"law": "mohr-coulomb"}),
        ({"law": "mine.py:law", "config": "config.toml"}, {"law": "mine.py:law", "config": "{}/config.toml"}),
    ],
)
def test_the_command_of_a_folder_is_called_again(status, arguments, expected, tmp_path):
    called = []

    @click.command()
    def make(out, **given):
        called.append({name: str(value) if name == "config" else value for name, value in given.items()})
        write(out, status=status)

    program = click.Group(commands={"rerun": rerun, "make": make})
    folder = write(tmp_path / "out", command={"name": "make", "arguments": arguments})
    done = CliRunner().invoke(program, ["rerun", str(folder)])
    assert called == [{k: v.format(folder) if isinstance(v, str) else v for k, v in expected.items()}]
    assert (tmp_path / "out-again" / "curves.csv").exists()
    assert done.exit_code == (status != "finished")
    assert done.output == (
        f"\nevery number is the same as in {folder}\n" if status == "finished"
        else f"\ndifferent from {folder}:\n  it ended otherwise: finished -> killed\n"
    )  # fmt: skip


@pytest.mark.parametrize("name", [".", ".."])
def test_the_folder_where_one_stands_has_a_name(name, tmp_path, monkeypatch):
    """It is refused where it holds no run, and written beside itself where it does."""
    folder = tmp_path / "out"
    (folder / "within").mkdir(parents=True)
    monkeypatch.chdir(folder if name == "." else folder / "within")
    refused = invoke("rerun", name)
    assert refused.exit_code == 2
    assert f"{name} holds no run" in refused.output

    @click.command()
    def make(out):
        write(out)

    write(folder, command={"name": "make", "arguments": {}})
    done = CliRunner().invoke(click.Group(commands={"rerun": rerun, "make": make}), ["rerun", name])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "out-again" / "curves.csv").exists()


def test_files_of_a_law_are_copied_once_with_their_folders(tmp_path):
    home = tmp_path / "home"
    (home / "inner").mkdir(parents=True)
    (home / "mine.py").write_text("law = 1\n")
    (home / "inner" / "helper.py").write_text("")
    files = [home / "mine.py", home / "inner" / "helper.py"]
    reference, record = copied(f"{home / 'mine.py'}:law", files, tmp_path / "out")
    assert reference == "law_files/mine.py:law"
    assert (tmp_path / "out" / "law_files" / "mine.py").read_text() == "law = 1\n"
    assert (tmp_path / "out" / "law_files" / "inner" / "helper.py").exists()
    assert [(one["copy"], one["file"]) for one in record] == [
        ("law_files/mine.py", str(files[0])), ("law_files/inner/helper.py", str(files[1])),
    ]  # fmt: skip
    assert record[0]["sha256"] == hashlib.sha256(b"law = 1\n").hexdigest()
    there = [tmp_path / "out" / one["copy"] for one in record]
    assert copied(reference, there, tmp_path / "out")[0] == reference  # they are there
    assert there[0].read_text() == "law = 1\n"
    assert copied("mohr-coulomb", [], tmp_path / "none") == ("mohr-coulomb", [])


def test_what_holds_no_run_of_a_command_is_refused(tmp_path):
    assert "holds no run" in invoke("rerun", tmp_path).output
    (tmp_path / "run.json").write_text("{")
    assert "cannot be read" in invoke("rerun", tmp_path).output
    (tmp_path / "run.json").write_text("[1]")
    assert "is no record" in invoke("rerun", tmp_path).output
    (tmp_path / "run.json").write_text('{"program": ["study.py", "7"]}')
    result = invoke("rerun", tmp_path)
    assert result.exit_code == 2
    assert "was not made by a command, but by study.py 7: run that again" in " ".join(
        result.output.replace("│", "").split()
    )
