"""Results as tables of pandas: the same numbers, one row for each thing."""

import sys

import numpy as np
import pandas
import pytest
from support import BRITTLE, PULL, small_sample

import grainlaw as gl


@pytest.fixture(scope="module")
def broken():
    return gl.simulate(small_sample(), BRITTLE, PULL, frames=4)


def test_curves_have_a_row_for_each_sample(broken, tmp_path):
    table = broken.curves.to_pandas()
    assert list(table.columns) == list(broken.curves)
    for name, column in broken.curves.items():
        assert np.array_equal(table[name], column)
    broken.save(tmp_path / "result.npz")
    pandas.testing.assert_frame_equal(gl.Result.load(tmp_path / "result.npz").curves.to_pandas(), table)


def test_cracks_have_a_row_each(broken):
    table = broken.cracks.to_pandas()
    assert len(table) == len(broken.cracks) > 5
    assert np.array_equal(table[["x", "y"]], broken.cracks.position)
    assert np.array_equal(table[["grain_a", "grain_b"]], broken.cracks.grains)
    assert np.array_equal(table["mode"] < 0.5, broken.cracks.tensile)
    assert set(table.columns) >= {"orientation", "length", "time", "opening", "slip", "spent", "inside"}


def test_a_frame_has_a_table_for_each_kind_of_thing(broken):
    frame = broken.frames[-1]
    bonds = frame.to_pandas()
    assert len(bonds) == 2 * len(broken.interfaces)
    assert bonds["broken_time"].notna().sum() == len(broken.cracks)
    grains, nodes = frame.to_pandas("grains"), frame.to_pandas("nodes")
    assert list(grains.columns) == ["stress_xx", "stress_yy", "stress_xy"]
    assert np.array_equal(grains["stress_xy"], frame.stress[:, 2])
    assert np.array_equal(nodes[["velocity_x", "velocity_y"]], frame.velocity)
    assert len(frame.to_pandas("contacts")) == len(frame.contacts["length"])
    with pytest.raises(gl.ParameterError, match=r"Frame.to_pandas: kind = 'bond' is not allowed, it must be bonds, "):
        frame.to_pandas("bond")


def test_a_laboratory_has_a_row_for_each_measure(broken):
    found = broken.laboratory
    table = found.to_pandas()
    leading = [
        "strength",
        "failure_strain",
        "largest_stress",
        "apparent_modulus",
        "modulus",
        "poisson",
        "tensile_cracks",
        "shear_cracks",
    ]
    assert list(table.index) == [*leading, *gl.MEASURES]
    assert table.loc["strength", ["value", "unit"]].tolist() == [broken.summary["strength"] / 1e6, "MPa"]
    assert table.loc["largest_fragment", "value"] == pytest.approx(100 * found.properties["largest_fragment"])
    assert table.loc["lost_opening", ["value", "unit"]].tolist() == [found.properties["lost_opening"], "J/m"]
    assert table.loc["fragments", "unit"] == ""
    assert table.loc["b_value", "source"] == "Aki (1965)"


def test_without_pandas_the_message_says_what_to_install(broken, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    for table in (broken.curves, broken.cracks, broken.frames[-1], broken.laboratory):
        with pytest.raises(gl.ParameterError, match=r"to_pandas needs pandas: pip install 'grainlaw\[study\]'"):
            table.to_pandas()
