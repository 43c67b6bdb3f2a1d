"""How numbers are called and shown: by who records them, in all that shows them, and after they were written."""

import re

import attrs
import numpy as np
import pytest
from study_rows import row, table_of
from support import PULL, STIFF, offenders, small_sample, state_of

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.cli.setups import SETUPS
from grainlaw.columns import ENERGIES, ENERGY, EVERY_TEST, SHARED, STAGE, quantity_of
from grainlaw.engine.ageing import columns
from grainlaw.laws import Linear
from grainlaw.messages import spelled
from grainlaw.protocols import Brazilian, Cyclic, DirectShear, FreeMotion, Saturated
from grainlaw.unit_text import without_prefixes


def names_of(specimen, law, protocol):
    """Columns of a test, and properties of curves that only rise."""
    stages = protocol.stages(specimen)
    state = state_of(specimen, law)
    state.begin(stages[0])
    measured = protocol.measure(state)
    if any(stage.ageing for stage in stages):
        measured |= columns(state)
    rising = np.linspace(0.0, 1.0, 40)
    every = [*(each.name for each in EVERY_TEST), *(ENERGY + kind for kind in ENERGIES), *measured]
    last = float(len(stages) - 1)
    curves = {name: last * (rising > 0.1) if name == STAGE else rising * 1e-3 for name in every}
    return {*measured, *protocol.summary(curves, specimen)}


@pytest.mark.thorough
def test_every_number_of_every_test_is_declared():
    def rule(name):
        chosen = configured(name, NEEDED.get(name, {}), quick=True)
        own = {each.name: each for each in chosen.protocol.quantities}
        found = names_of(chosen.specimen, chosen.law, chosen.protocol)
        bare = {each for each in found if quantity_of(each, own) == gl.Quantity(each)}
        assert not bare - COUNTS, sorted(bare - COUNTS)

    assert not offenders(rule, SETUPS)


NEEDED = {
    "biaxial-compression": {"test": {"confinement": 1e6}},
    "creep": {"test": {"load": 1e6, "duration": 1e6}, "law": {"rate": 1e-9}},
    "cyclic": {"test": {"levels": [1e-4]}},
    "direct-shear": {"test": {"normal_stress": 1e6}},
    "heating": {"test": {"to": [200.0]}, "rock": {"expansion": 8e-6}},
    "saturated": {"test": {"pressure": 1e5}},
    "thermal-shock": {
        "test": {"hot": 60.0, "duration": 1.0},
        "rock": {"expansion": 8e-6},
    },
}
#: numbers that are shown as they are
COUNTS = {
    "wet", "failed", "cracks", "cracks_at_first", "jumps", "thermal_cracks", "felicity_ratios",
}  # fmt: skip


def test_numbers_of_free_bodies_are_declared():
    move = FreeMotion(duration=1e-4, tracked=[0])
    own = {each.name: each for each in move.quantities}
    found = names_of(small_sample(12), Linear(**STIFF), move)
    assert {each for each in found if quantity_of(each, own) == gl.Quantity(each)} == set()
    assert quantity_of("rotation_0", own).heading == "rotation 0 (rad)"


def test_modes_are_spelled_in_roman_figures():
    assert spelled("mode_ii_energy") == "mode II energy"
    assert gl.Quantity("mode_i_energy", "J/m2").words == "mode I energy"


def test_shared_names_have_words_of_their_own_and_a_unit_that_is_known():
    same = {"modulus": "youngs_modulus", "poisson": "poissons_ratio"}  # of a test, and of a rock
    words = {each.words: name for name, each in SHARED.items()}
    assert {name: words[each.words] for name, each in SHARED.items() if words[each.words] != name} == same
    unknown = {each.unit for each in SHARED.values() if each.factor == 1 and without_prefixes(each.unit) != each.unit}
    assert unknown == set()


@pytest.mark.parametrize(
    ("unit", "in_si"),
    [
        ("MPa", "Pa"), ("GPa", "Pa"), ("%", "1"), ("µm", "m"), ("m", "m"), ("ms", "s"), ("MPa √m", "Pa √m"),
        ("kN/m", "N/m"), ("kJ/m3", "J/m3"), ("mm/s", "m/s"), ("J/m2", "J/m2"), ("°C", "°C"), ("deg", "deg"), ("1", "1"),
    ],
)  # fmt: skip
def test_units_without_their_prefixes(unit, in_si):
    assert without_prefixes(unit) == in_si


@attrs.frozen(kw_only=True)
class Pulled(gl.LoadingProtocol):
    """A test of the user's own, with a quantity in kN/m, a strength of its own kind, and one that nobody declares."""

    quantities = (
        gl.Quantity("pull", "kN/m", words="tension of the rope", form=".3f"),
        gl.Quantity("strength", "kN/m", words="breaking load", is_main=True),
        gl.Quantity("stretch", "%", is_main=True),
    )

    def stages(self, specimen):
        return PULL.stages(specimen)

    def measure(self, state):
        return {**PULL.measure(state), "pull": state.reaction("top")[1]}

    def summary(self, curves, specimen):
        return {"strength": 5e3, "stretch": 0.25, "undeclared": 7.0, "energy_error": 0.0}


@pytest.fixture(scope="module")
def pulled():
    return gl.simulate(small_sample(12), Linear(**STIFF), attrs.evolve(Pulled()))


@pytest.mark.thorough
def test_a_test_of_ones_own_is_shown_in_its_words(pulled, tmp_path):
    assert pulled.quantity("pull").heading == "tension of the rope (kN/m)"
    assert pulled.quantity("strain") == SHARED["strain"]
    assert re.search(r"breaking load \(kN/m\)[ =:]*5\b", str(pulled))
    assert "stretch (%)" in str(pulled)
    assert "undeclared" not in str(pulled)
    comparison = str(gl.Comparison({"rope": pulled}))
    assert re.search(r"^breaking load \(kN/m\) +5$", comparison, re.M)
    assert re.search(r"^undeclared +7$", comparison, re.M)
    figure = gl.plot_curves(pulled, y="pull")
    assert figure.axes[0].get_ylabel() == "tension of the rope (kN/m)"
    assert figure.axes[0].lines[0].get_ydata() == pytest.approx(pulled.curves["pull"] / 1e3)
    pulled.write_report(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert "breaking load (kN/m)" in page
    assert "stretch (%)" in page


def test_words_are_kept_with_what_is_written(pulled, tmp_path):
    pulled.save(tmp_path / "run.npz")
    read = gl.Result.load(tmp_path / "run.npz")
    assert read.quantity("pull") == pulled.quantity("pull")
    assert str(read).partition("test")[2].partition("samples")[0] != ""
    assert "breaking load (kN/m)" in str(read)
    read.save(tmp_path / "again.npz")
    assert gl.Result.load(tmp_path / "again.npz").quantities == pulled.quantities


def test_a_table_shows_what_the_tests_of_its_rows_have_declared(tmp_path):
    declared = [attrs.asdict(each) for each in Pulled.quantities]
    rows = [
        row({"seed": seed}, summary={"strength": 4e3 + seed, "stretch": 0.2, "undeclared": 1.0})
        | {"quantities": declared}
        for seed in (1, 2)
    ]
    table = table_of(rows, tmp_path)
    assert table.main == ["strength", "stretch"]
    assert table.quantity("strength").heading == "breaking load (kN/m)"
    assert "breaking load (kN/m)" in str(table)
    assert "breaking load (kN/m)" in str(table.means()["strength"])


def test_tests_before_or_in_another_have_its_words():
    shear = DirectShear(normal_stress=1e6)
    for outer in (Cyclic(test=shear, levels=(1e-6,)), Saturated(test=shear, pressure=1e5)):
        own = {each.name: each for each in outer.quantities}
        assert own["dilation"].unit == "µm"
    assert {each.name: each.words for each in Brazilian.quantities}["stress"] == "tensile stress"
