"""A run is repeated from its folder: with its law files as they were, and every difference is said."""

import json

import pytest
from command_line import SMALL, invoke

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
