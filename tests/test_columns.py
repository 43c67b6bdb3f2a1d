"""The columns that runs record, and what is said where one is missing."""

import attrs
import numpy as np
import pytest
from study_rows import row, table_of
from support import STIFF, small_sample

import grainlaw as gl
from grainlaw.columns import (
    BETWEEN_ENDS,
    DEVIATOR,
    ENERGIES,
    ENERGY,
    EVERY_TEST,
    SPENT,
    SUPPLIED,
    course,
    energy,
    since,
)
from grainlaw.laws import Linear
from grainlaw.protocols import BiaxialCompression, Cyclic, UniaxialCompression
from grainlaw.quantity import Quantity
from grainlaw.results.archive import to_bytes

LAW = Linear(**STIFF)
PRESS = UniaxialCompression(loading=gl.Constant(speed=0.3), maximum_strain=1e-4, samples=20)


@attrs.frozen(kw_only=True)
class Pull(gl.LoadingProtocol):
    """Measures a force alone, or nothing."""

    until: gl.conditions.Condition = attrs.field(factory=lambda: gl.conditions.Reaches("time", 1e-5))
    force: bool = True

    def stages(self, specimen):
        drives = [gl.loads.Drive(boundary="top", axis=1, speed=0.1), gl.loads.Drive(boundary="bottom", axis=1, speed=0)]
        return [gl.Stage(name="pull", loads=drives, until=[self.until], interval=1e-6)]

    def measure(self, state):
        return {"force": state.reaction("top")[1]} if self.force else {}

    def summary(self, curves, specimen):
        return {}


@pytest.fixture(scope="module")
def pulled():
    return gl.simulate(small_sample(12), LAW, Pull())


def test_a_test_that_measures_nothing_records_the_columns_of_every_test():
    curves = gl.simulate(small_sample(12), LAW, Pull(force=False)).curves
    assert set(curves) == {*(q.name for q in EVERY_TEST), *(ENERGY + kind for kind in ENERGIES)}


def test_what_is_supplied_is_spent():
    curves = gl.simulate(small_sample(12), LAW, PRESS).curves
    assert set(ENERGIES) == {SUPPLIED, *SPENT}
    supplied = energy(curves, SUPPLIED)
    assert supplied[-1] > 0
    assert energy(curves, *SPENT) == pytest.approx(supplied, abs=1e-4 * supplied.max())


@pytest.mark.thorough
def test_compression_records_what_pictures_and_measures_look_for():
    found = gl.simulate(small_sample(12), LAW, PRESS).curves
    assert {q.name for q in BETWEEN_ENDS} - set(found) == {DEVIATOR}
    confined = BiaxialCompression(confinement=1e6, maximum_strain=1e-4, samples=20)
    found = gl.simulate(small_sample(12), LAW, confined).curves
    assert {q.name for q in BETWEEN_ENDS} <= set(found)
    at_rest = np.flatnonzero(found["stage"] == 0)[-1]
    assert found["stress"][at_rest] == pytest.approx(1e6, rel=0.02)  # compression counts positive
    assert found["stress"][-1] > 2e6
    assert found["deviator"] == pytest.approx(found["stress"] - 1e6)


@pytest.mark.thorough
def test_pictures_show_what_a_test_of_ones_own_records(pulled, tmp_path):
    """Also one that declares nothing, and after it was written: its force over time."""
    says = ("time (s)", "force (kN/m)")
    table = table_of(
        [row({"confinement": p}, {"strength": 1e6 + p}) for p in (0.0, 1e6)], tmp_path / "study", [to_bytes(pulled)] * 2
    )
    for figure in (pulled.plot(), table.run(0).plot(), gl.StrengthEnvelope(table).plot()):
        assert (figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel()) == says
    comparison = gl.Comparison({"linear": pulled})
    comparison.write(tmp_path / "out")
    assert (tmp_path / "out" / "comparison.png").stat().st_size > 5000
    assert comparison.plot().axes[0].get_ylabel() == says[1]


def test_pictures_of_several_results_name_the_columns_they_miss(pulled):
    pressed = gl.simulate(small_sample(12), LAW, PRESS)
    says = r"needs the columns strain and stress, which the test does not record \(it records force\)$"
    with pytest.raises(gl.ParameterError, match=says):
        gl.Comparison({"pressed": pressed, "pulled": pulled}).plot()
    with pytest.raises(gl.ParameterError, match="needs its curves, and it has none"):
        attrs.evolve(pulled, curves={}).plot()


@pytest.mark.parametrize("until", [gl.conditions.Reaches("strain", 0.1), gl.conditions.FallsTo("strain", 0.5)])
def test_conditions_name_the_column_they_miss(until):
    says = rf"{type(until).__name__} needs the column strain, which the test does not record \(it records force\)$"
    with pytest.raises(gl.ParameterError, match=says):
        gl.simulate(small_sample(12), LAW, Pull(until=until))
    with pytest.raises(gl.ParameterError, match="FallsTo needs the column shear_stress"):
        gl.simulate(small_sample(12), LAW, Cyclic(test=PRESS, levels=(5e-5,), load="shear_stress"))


def test_a_load_that_a_stress_does_not_go_with_gives_no_thresholds(pulled):
    """``deviator`` without ``stress``: the confinement, and so the axial stress, is not known."""
    curves = pulled.curves | {"deviator": np.linspace(0, 1e6, len(pulled.curves["time"]))}
    found = attrs.evolve(pulled, curves=curves).laboratory.properties
    assert np.isnan([found[name] for name in ("tangent_modulus", "crack_damage", "damage_onset")]).all()


def test_curves_are_drawn_over_what_grows():
    ramp, cycle = np.linspace(0, 1, 101), np.abs(np.linspace(-1, 1, 101))
    curves = {"time": ramp, "deflection": ramp, "strain": cycle}
    assert course(curves) == "deflection"
    assert course(curves | {"strain": ramp}) == "strain"
    assert course(curves | {"strain": ramp + 0.02 * np.sin(np.arange(101))}) == "strain"  # it vibrates
    assert course({"time": ramp, "strain": cycle}) == "time"


@pytest.mark.parametrize(("value", "shown"), [(-1e-9, "0.0000 %"), (0.0, "0.0000 %"), (-1e-4, "-0.0100 %")])
def test_what_rounds_to_nothing_has_no_sign(value, shown):
    assert Quantity("strain", "%", form=".4f").with_unit(value) == shown


def test_a_shared_column_counts_also_where_a_test_shows_it_in_another_unit():
    curves = {"time": np.array([1.0, 2.0, 4.0]), "moved": np.array([1.0, 3.0, 6.0]), "place": np.array([1.0, 3.0, 6.0])}
    own = {"time": Quantity("time", "µs"), "moved": Quantity("moved", "µm", counts=True)}
    after = {name: values.tolist() for name, values in since(curves, 1, own).items()}
    assert after == {"time": [1.0, 3.0], "moved": [2.0, 5.0], "place": [3.0, 6.0]}
    assert since(curves, 0, own)["time"].tolist() == curves["time"].tolist()


def test_one_of_several_counts_as_they_do():
    own = {"moved": Quantity("moved", "µm", counts=True)}
    after = since({"moved_0": np.array([1.0, 3.0]), "moved_x": np.array([1.0, 3.0])}, 1, own)
    assert (after["moved_0"].tolist(), after["moved_x"].tolist()) == ([2.0], [3.0])
