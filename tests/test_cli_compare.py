"""The main job with a file of parameters, and what of the certificate its table marks."""

import json
import re
import tomllib

import attrs
import numpy as np
import pytest
from command_line import invoke
from support import PULL, STIFF, small_sample

import grainlaw as gl
from grainlaw.cli.compare import _configurations, _rows
from grainlaw.laws import Linear
from grainlaw.results.certificate import LIMITS

FEW = ["compare", "--quick", "--threads", "1"]
FILE = """
[sample]
width = "12 mm"
height = "20 mm"
grains = 8
seed = 5

[rock]
youngs_modulus = "50 GPa"

[law]
type = "munjiza"
tensile_strength = "10 MPa"
mode_i_energy = "70 J/m2"

[test]
maximum_strain = 0.0001
samples = 10

[numerics]
frames = 3
"""


def one_line(result):
    return " ".join(result.output.replace("│", " ").split())


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("file")
    (folder / "granite.toml").write_text(FILE)
    call = [*FEW, "--config", folder / "granite.toml", "--set", "law.cohesion=25 MPa"]
    result = invoke(*call, "--laws", "linear,cohesive-crack", "--out", folder / "out")
    assert result.exit_code == 0, result.output
    return folder / "out", result


def test_a_file_gives_the_parameters_of_all_laws(made):
    """Each law takes what it has: a linear law has no strength, which is no error."""
    folder, _ = made
    content = json.loads((folder / "summary.json").read_text())
    parameters = content["parameters"]
    assert (content["seed"], parameters["sample"]["grains"], parameters["sample"]["width"]) == (5, 8, "12 mm")
    assert parameters["material"]["youngs_modulus"] == 50e9
    assert parameters["protocol"]["maximum_strain"] == 1e-4
    crack = parameters["laws"]["cohesive-crack"]
    assert (crack["tensile_strength"], crack["mode_i_energy"], crack["cohesion"]) == (10e6, 70, 25e6)
    assert parameters["laws"]["linear"]["kn"] == crack["kn"] == 1.05e14
    assert 3 <= len(list((folder / "linear").glob("grains_*.vtu"))) <= 5


def test_laws_between_minerals_take_what_each_law_has():
    """As [law]: a linear law has no strength between minerals either. What no law has is refused."""
    sections = {
        "sample": {"grains": 20, "minerals": {"quartz": 0.5, "mica": 0.5}},
        "laws": {"mica/*": {"tensile_strength": "5 MPa"}, "quartz/quartz": {"type": "linear", "kn": 1e14}},
    }
    rows = _configurations(["linear", "mohr-coulomb"], sections, [1], True)
    weak = rows["mohr-coulomb", 1].law["mica", ...]
    assert (weak.tensile_strength, rows["mohr-coulomb", 1].law["quartz", "quartz"].kn) == (5e6, 1e14)
    assert rows["linear", 1].law["mica", ...] == rows["linear", 1].law[...]
    with pytest.raises(gl.ParameterError, match=r"no 'laws\.mica/\*\.tensil'.*tensile_strength"):
        _configurations(["linear"], {**sections, "laws": {"mica/*": {"tensil": 5e6}}}, [1], True)


def test_runs_stand_in_a_row_for_each_sample():
    class Compared(dict):
        seeds = (1, 2)

    keys = [("a", 1), ("b", 1), ("a", 2), ("b", 2)]
    rows = _rows(Compared({key: f"result of {key}" for key in keys}))
    assert [[result for *_, result in row] for row in rows] == [
        [f"result of {key}" for key in keys[:2]], [f"result of {key}" for key in keys[2:]],
    ]  # fmt: skip
    alone = Compared({"a": 1, "b": 2})
    alone.seeds = ()
    assert [[result for *_, result in row] for row in _rows(alone)] == [[1, 2]]


@pytest.mark.thorough
def test_options_count_more_than_the_file(made, tmp_path):
    file = made[0].parent / "granite.toml"
    result = invoke(
        *FEW, "--config", file, "--laws", "linear", "--seeds", "1,2", "--grains", 6, "--max-strain", "5e-5",
        "--out", tmp_path,
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    content = json.loads((tmp_path / "summary.json").read_text())
    assert content["seeds"] == [1, 2]
    assert content["parameters"]["sample"]["grains"] == 6
    strains = np.genfromtxt(tmp_path / "linear_seed_2" / "curves.csv", names=True, delimiter=",")["strain"]
    assert strains[-1] == pytest.approx(5e-5, rel=0.1)


@pytest.mark.thorough
def test_the_folder_repeats_itself_without_the_file(made):
    folder, _ = made
    kept = tomllib.loads((folder / "config.toml").read_text())
    assert kept["law"] == {"tensile_strength": "10 MPa", "mode_i_energy": "70 J/m2", "cohesion": "25 MPa"}
    (folder.parent / "granite.toml").rename(folder.parent / "moved.toml")
    try:
        result = invoke("rerun", folder, "--out", folder.parent / "again")
    finally:
        (folder.parent / "moved.toml").rename(folder.parent / "granite.toml")
    assert result.exit_code == 0, result.output
    assert "every number is the same" in result.output


@pytest.mark.thorough
def test_a_rock_from_a_file_is_copied_and_repeated(tmp_path):
    (tmp_path / "rocks").mkdir()
    code = "import grainlaw as gl\nrock = gl.Elastic(youngs_modulus=40e9, poissons_ratio=0.2, density=2600)\n"
    (tmp_path / "rocks" / "soft.py").write_text(code)
    file = tmp_path / "rocks" / "rock.toml"
    file.write_text('[rock]\ntype = "soft.py:rock"\n[test]\nsamples = 10\n')
    few = ["--laws", "linear", "--seeds", "1", "--grains", 6, "--max-strain", "5e-5"]
    made = invoke(*FEW, "--config", file, *few, "--out", tmp_path / "out")
    assert made.exit_code == 0, made.output
    (tmp_path / "rocks").rename(tmp_path / "elsewhere")
    again = invoke("rerun", tmp_path / "out", "--out", tmp_path / "again")
    assert again.exit_code == 0, again.output
    assert "every number is the same" in again.output
    content = json.loads((tmp_path / "again" / "summary.json").read_text())
    assert content["parameters"]["material"]["youngs_modulus"] == 40e9


@pytest.mark.thorough
def test_grains_without_a_seed_are_one_sample(tmp_path):
    bricks = ["--set", "sample.tessellator=bricks", "--set", "sample.rows=2", "--set", "test.samples=10"]
    result = invoke(*FEW, *bricks, "--laws", "linear", "--max-strain", "5e-5", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    assert (tmp_path / "linear" / "grains.pvd").exists()


@pytest.mark.parametrize(
    ("text", "more", "words"),
    [
        ("[law]\ntensile_strenth = 1e7\n", [], "there is no 'law.tensile_strenth'; did you mean 'tensile_strength'?"),
        ("[law]\nkn = '1 GPa'\n", [], "law.kn"),
        ("[test]\ntype = 'brazilian'\n", [], "test.type = 'brazilian' is not allowed"),
        ("[sample]\ntessellator = 'bricks'\nrows = 2\n", ["--seeds", "1,2"], "there is no 'sample.seed'"),
        ("[sampel]\n", [], "there is no section 'sampel'; did you mean 'sample'?"),
        ("[law\n", [], "is no TOML"),
    ],
)
def test_wrong_files_are_refused_before_any_work(text, more, words, tmp_path):
    (tmp_path / "granite.toml").write_text(text)
    result = invoke(*FEW, "--config", tmp_path / "granite.toml", "--out", tmp_path / "out", *more)
    assert result.exit_code == 2
    assert words in one_line(result)
    assert not (tmp_path / "out").exists()


def test_the_table_marks_what_fails_the_certificate():
    """In the column of the law that failed, and of several samples where one has."""

    result = gl.simulate(small_sample(4), Linear(**STIFF), attrs.evolve(PULL, maximum_strain=1e-5, samples=10))

    def fake(share):
        return attrs.evolve(result, summary=result.summary | {n: share * limit for n, (limit, _) in LIMITS.items()})

    rows = str(gl.Comparison({"good": fake(1.0), "bad": fake(1.01)})).splitlines()
    marked = [row for row in rows if "FAIL" in row]
    assert [row.split("  ")[0] for row in marked] == [
        "kinetic ratio", "imbalance (%)", "rise while unstable (%)", "energy error", "energy made",
        "energy returned", "difference of end forces (%)",
    ]  # fmt: skip
    assert all(row.endswith("FAIL") and row.count("FAIL") == 1 for row in marked)
    several = gl.Comparison({("law", 1): fake(1.0), ("law", 2): fake(1.5), ("other", 1): fake(0.5)})
    (line,) = [row for row in str(several).splitlines() if row.startswith("energy error")]
    assert re.split(" {2,}", line)[1].endswith(") FAIL")
    assert line.count("FAIL") == 1


@pytest.mark.thorough
@pytest.mark.parametrize(("seeds", "words"), [("5", "1 of 2 laws failed"), ("5,6", "1 of 4 runs failed")])
def test_how_many_failed_is_said_of_laws_or_of_runs(seeds, words, tmp_path, monkeypatch):
    from grainlaw.cli import compare

    result = gl.simulate(small_sample(4), Linear(**STIFF), attrs.evolve(PULL, maximum_strain=1e-5, samples=10))
    laws = [(law, int(seed)) for law in ("linear", "cohesive-crack") for seed in seeds.split(",")]
    keys = [key if "," in seeds else key[0] for key in laws]
    found = gl.Comparison(dict.fromkeys(keys[:-1], result), failed={keys[-1]: gl.StageError("it slips away")})
    monkeypatch.setattr(compare, "_compared", lambda *_: found)
    call = [*FEW, "--laws", "linear,cohesive-crack", "--seeds", seeds, "--grains", "4", "--out", tmp_path / "out"]
    said = invoke(*call)
    assert said.exit_code == 1
    assert words in one_line(said)
