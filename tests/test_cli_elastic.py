"""grainlaw elastic: the table, the file, and what is refused."""

import json

import pytest
from command_line import invoke

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import Linear
from grainlaw.units import mm

SET = ("--set", "law.kn=1e13", "--set", "rock.poissons_ratio=0.1")
SMALL = ("--quick", "--grains", 20, "--seed", 3, "--law", "linear", *SET)


def test_it_prints_and_writes_what_python_finds(tmp_path):
    config = tmp_path / "mine.toml"
    config.write_text('[test]\ntype = "biaxial-compression"\nconfinement = "5 MPa"\n[sample]\nwidth = "25 mm"\n')
    file = tmp_path / "new" / "elastic.json"
    result = invoke("elastic", *SMALL, "--config", config, "--boundary", "static", "--out", file)
    assert result.exit_code == 0, result.output
    rock = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.1, density=3100)
    specimen = gl.Specimen(Voronoi(grains=20, seed=3).tessellate(rectangle(25 * mm, 50 * mm)), rock)
    found = gl.elastic_properties(specimen, Linear(kn=1e13, ks=9.45e13), boundary="static")
    assert str(found) in result.output
    content = json.loads(file.read_text())
    assert content["apparent_modulus"] == pytest.approx(found.apparent_modulus, rel=1e-12)
    assert content["stiffness"][2][2] == pytest.approx(found.stiffness[2, 2], rel=1e-9)
    assert content["boundary"] == "static"
    assert content["configuration"]["law"]["kn"] == "10 TPa/m"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--law", "linar"], "did you mean 'linear'?"),
        (["--set", "sample.region=disc", "--set", "sample.diameter='40 mm'"], "has no boundary named left or right"),
        (["--set", "test.samples=20"], "there is no test"),
        (["--boundary", "periodic"], "'periodic' is not one of 'kinematic', 'static'"),
    ],
)
def test_refusals_are_one_message(arguments, words):
    result = invoke("elastic", "--quick", *arguments)
    assert result.exit_code == 2
    assert words in " ".join(result.output.split())
    assert "Traceback" not in result.output
