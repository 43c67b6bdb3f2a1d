"""What a comparison of laws writes: a table, a summary, curves and pictures."""

import csv
import json

import attrs
import numpy as np
import pytest
from matplotlib.image import imread
from support import BRITTLE, PULL, STIFF, small_sample

import grainlaw as gl
from grainlaw.laws import Linear

KEYS = {
    "peak_stress", "peak_strain", "apparent_modulus", "apparent_poisson", "modulus", "poisson", "tensile_cracks",
    "shear_cracks", "steps", "seconds", "time_step", "energy_error", "energy_made",
    "kinetic_ratio", "platen_imbalance",
}  # fmt: skip


@pytest.fixture(scope="module")
def comparison():
    laws = {"linear": Linear(**STIFF), "brittle": BRITTLE}
    return gl.compare(small_sample(20), laws, attrs.evolve(PULL, samples=20), threads=1, frames=4)


@pytest.fixture(scope="module")
def folder(comparison, tmp_path_factory):
    path = tmp_path_factory.mktemp("comparison")
    comparison.write(path, {"seed": 1, "missing": float("nan"), "array": [np.float64(2), np.int64(3)]})
    return path


def test_comparison_is_a_mapping_that_prints_a_table(comparison):
    assert list(comparison) == ["linear", "brittle"]
    assert len(comparison) == 2
    lines = str(comparison).splitlines()
    assert lines[0].split() == ["linear", "brittle"]
    assert len({len(line) for line in lines}) == 1
    assert lines[2].split()[:3] == ["peak", "stress", "(MPa)"]
    assert lines[2].split()[-1] == f"{comparison['brittle'].summary['peak_stress'] / 1e6:.2f}"


def test_summary_is_json_with_every_key(comparison, folder):
    def refuse(constant):
        raise AssertionError(constant)

    content = json.loads((folder / "summary.json").read_text(), parse_constant=refuse)
    assert set(content["laws"]) == {"linear", "brittle"}
    for name, summary in content["laws"].items():
        assert set(summary) >= KEYS
        assert summary["peak_stress"] == comparison[name].summary["peak_stress"]
        assert summary["steps"] == comparison[name].curves["step"][-1]
    assert (content["seed"], content["missing"], content["array"]) == (1, None, [2, 3])


def test_curves_are_all_there(comparison, folder):
    with (folder / "curves.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    for name, result in comparison.items():
        mine = [row for row in rows if row["law"] == name]
        assert len(mine) == len(result.curves["time"])
        for column, values in result.curves.items():
            assert np.allclose([float(row[column]) for row in mine], values, rtol=1e-8, equal_nan=True), column


@pytest.mark.parametrize("name", ["comparison", "cracks_linear", "cracks_brittle"])
def test_pictures_are_drawn(folder, name):
    picture = imread(folder / f"{name}.png")
    height, width = picture.shape[:2]
    assert 400 < height < 4000
    assert 400 < width < 4000
    assert 0.01 < (picture[..., :3] < 0.95).any(axis=-1).mean() < 0.9  # neither blank nor filled


def test_nothing_else_is_written(folder):
    names = {"comparison.png", "cracks_linear.png", "cracks_brittle.png", "curves.csv", "summary.json"}
    assert {file.name for file in folder.iterdir()} == names
