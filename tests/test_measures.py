"""Measures, standard ones and those of a user: named, explained, one number each, shown where reports show them."""

import math
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import STIFF, STRONG, small_sample

import grainlaw as gl
from grainlaw.laws import Linear, MohrCoulomb
from grainlaw.protocols import UniaxialCompression
from grainlaw.results.standard_measures import ratios, thresholds
from grainlaw.unit_text import factor_into

PRESS = UniaxialCompression(loading=gl.Constant(speed=0.5), maximum_strain=0.005, samples=100)


@attrs.frozen
class Eighth(gl.Measure):
    """A number known beforehand."""

    name: str = "eighth"
    meaning: str = "one eighth"
    unit: str = "%"
    source: str = "Euclid (300 BC)"
    needs: tuple[str, ...] = ()
    value: object = 0.125

    def find(self, laboratory):
        return self.value


@pytest.fixture(scope="module")
def result():
    return gl.simulate(small_sample(20), MohrCoulomb(**STRONG), PRESS)


@pytest.mark.thorough
@pytest.mark.parametrize("name", gl.MEASURES)
def test_a_standard_measure_is_named_explained_and_one_number(name, result):
    measure = gl.MEASURES[name]
    assert isinstance(measure, gl.Measure)
    assert measure.name == name
    assert len(measure.meaning) > 3
    assert measure.unit in ("1", "J/m") or measure.factor != 1
    assert set(measure.needs) <= set(result.curves)
    for each in (result, gl.simulate(small_sample(12), Linear(**STIFF), attrs.evolve(PRESS, maximum_strain=1e-4))):
        value = each.laboratory.value(name)
        assert np.isnan(value) or np.isfinite(value)
        assert np.array_equal(each.laboratory.properties[name], value, equal_nan=True)


def test_ratios_are_thresholds_over_the_stress_at_the_peak():
    """Of 90 MPa over a strength of 120 MPa, of which 20 MPa confine: 3/4."""
    path = SimpleNamespace(load=np.array([50e6, 100e6]), confinement=20e6)
    failed, whole = (
        SimpleNamespace(
            path=path,
            value={each.name: 90e6 for each in thresholds()}.__getitem__,
            result=SimpleNamespace(summary=tells),
        )
        for tells in ({}, {"strength": math.nan})
    )
    assert len(ratios()) == len(thresholds()) - 1
    for each in ratios():
        assert each.find(failed) == pytest.approx(0.75)
        assert math.isnan(each.find(whole))  # it may bear more
        assert each.meaning.split(", ")[0] in ("CC/UCS", "CI/UCS", "CD/UCS")


@pytest.mark.parametrize(
    ("unit", "shown"),
    [("GPa", 60e9 * 1e-9), ("mm", 60e9 * 1e3), ("%", 60e9 * 100), ("deg", np.degrees(60e9)), ("1", 60e9),
     ("J/m", 60e9), ("kJ/m2", 60e9 * 1e-3), ("permille", 60e12), ("‰", 60e12)],
)  # fmt: skip
def test_the_factor_follows_from_the_unit(unit, shown):
    assert 60e9 * Eighth(unit=unit).factor == pytest.approx(shown, rel=1e-15)
    assert factor_into(unit) == Eighth(unit=unit).factor


@pytest.mark.parametrize("unit", ["bananas", "1e-3", "MPA"])
def test_what_is_no_unit_is_refused(unit):
    with pytest.raises(gl.ParameterError, match=f"Quantity ripeness: unit = '{unit}' is not allowed, it must be a u"):
        gl.Quantity("ripeness", unit)
    with pytest.raises(gl.ParameterError, match=f"Eighth: unit = '{unit}'"):
        assert Eighth(unit=unit).factor
    assert gl.Quantity("ripeness", unit, factor=2).with_unit(3) == f"6 {unit}"


@pytest.mark.thorough
def test_a_measure_of_a_user_stands_in_the_table_with_unit_and_source(result, tmp_path):
    measures = [*gl.MEASURES.values(), Eighth()]
    laboratory = gl.Laboratory(result, measures)
    assert list(laboratory.properties) == [*gl.MEASURES, "eighth"]
    assert laboratory.properties["eighth"] == 0.125
    [row] = [line for line in str(laboratory).splitlines() if line.startswith("one eighth")]
    assert row.split(maxsplit=4) == [
        "one",
        "eighth",
        "12.5",
        "%",
        "Euclid (300 BC)",
    ]
    assert list(result.laboratory.properties) == list(gl.MEASURES)
    row = '<th scope="row">one eighth (%)</th>' + '<td class="number">12.5</td>' * 2 + "<td>Euclid (300 BC)</td>"
    comparison = gl.Comparison({"one": result, "other": result})
    comparison.write_report(tmp_path / "all.html", measures=measures)
    assert row in (tmp_path / "all.html").read_text("utf-8")
    result.write_report(tmp_path / "alone.html", measures=[Eighth()])
    alone = (tmp_path / "alone.html").read_text("utf-8")
    assert row.replace('<td class="number">12.5</td>', "", 1) in alone
    assert "b-value" not in alone
    comparison.write_report(tmp_path / "standard.html")
    assert "one eighth" not in (tmp_path / "standard.html").read_text("utf-8")


def test_points_that_have_broken_are_those_of_the_cracks(result):
    laboratory, cracks = result.laboratory, result.cracks
    assert 0 < len(cracks) == laboratory.broken.sum()
    assert np.sort(laboratory.half_lengths[laboratory.broken]) == pytest.approx(np.sort(cracks.length))
    assert 0 < cracks.tensile.sum() == (laboratory.broken & laboratory.tensile).sum() < len(cracks)


class Pieces(SimpleNamespace):
    def __len__(self):
        return len(self.areas)


def test_standard_measures_by_hand():
    """Four contact points, of which the last is whole; three cracks; two pieces of 3 and 1 mm2."""
    laboratory = SimpleNamespace(
        energy_lost=np.array([[1, 2, 4, 8.0], [10, 20, 40, 80]]), broken=np.array([True, True, True, False]),
        tensile=np.array([True, True, False, True]), beyond_rounding=float, fragments=Pieces(areas=np.array([3.0, 1])),
        result=SimpleNamespace(cracks=SimpleNamespace(length=np.array([1, 2, 4.0]), tensile=np.array([1, 1, 0], bool))),
        events=Pieces(areas=[0] * 7, magnitude=np.array([-4, np.nan, -3]), energy=np.array([1, 0, 2.0])),
    )  # fmt: skip
    expected = {
        "lost_opening": 15, "lost_slip": 150, "lost_tensile_cracks": 33, "lost_shear_cracks": 44, "lost_unbroken": 88,
        "tensile_length": 3, "shear_length": 4, "fragments": 2, "largest_fragment": 0.75, "acoustic_events": 7,
        "largest_magnitude": -3,
    }  # fmt: skip
    assert {name: gl.MEASURES[name].find(laboratory) for name in expected} == expected
    laboratory.events.energy = np.zeros(3)
    assert np.isnan(gl.MEASURES["largest_magnitude"].find(laboratory))


def test_a_table_of_measures_by_hand(result):
    measures = [Eighth(), Eighth(name="plain", unit="1", meaning="a share"), Eighth(name="never", value=np.nan)]
    table, *doubts = str(gl.Laboratory(result, measures)).split("\ndoubt: ")
    assert tuple(doubts) == result.doubts
    assert table == (
        "one eighth   12.5  %  Euclid (300 BC)\n"
        "a share     0.125     Euclid (300 BC)\n"
        "one eighth      -  %  Euclid (300 BC)"
    )


def test_a_measure_may_be_found_from_others(result):
    class Ratio(gl.Measure):
        name, meaning, asked = "ratio", "CI over the onset of damage", 0

        def find(self, laboratory):
            Ratio.asked += 1
            return laboratory.value("crack_initiation_count") / laboratory.value("damage_onset")

    laboratory = gl.Laboratory(result, [Ratio()])
    ratio = result.laboratory.value("crack_initiation_count") / result.laboratory.value("damage_onset")
    assert laboratory.properties == {"ratio": ratio}
    assert laboratory.value("ratio") == ratio
    assert Ratio.asked == 1  # found once
    with pytest.raises(gl.ParameterError, match="there is no measure 'toughness', only apparent_tangent_modulus, "):
        laboratory.value("toughness")


@pytest.mark.thorough
def test_what_a_test_does_not_record_is_said_and_not_asked_for(result, tmp_path):
    less = attrs.evolve(result, curves={n: v for n, v in result.curves.items() if n not in ("stress", "strain")})
    laboratory = gl.Laboratory(less, [Eighth(name="never", needs=("strain", "time"), value=1 / 8), Eighth()])
    assert np.isnan(laboratory.properties["never"])
    assert laboratory.properties["eighth"] == 0.125
    assert laboratory.note == "the test does not record strain: no never"
    assert str(laboratory).split("\ndoubt: ")[0].splitlines()[-1] == laboratory.note
    assert gl.Laboratory(less, [Eighth()]).note == gl.Laboratory(result, [Eighth()]).note == ""
    assert less.laboratory.note == ""  # a standard measure that cannot exist in this test is not there
    assert "E_t50" not in str(less.laboratory)
    assert "E_t50, tangent at 50 % of the peak" in str(result.laboratory)
    measures = [Eighth(name="never_there", needs=("strain", "time")), *gl.MEASURES.values()]
    less.write_report(tmp_path / "report.html", measures=measures)
    page = (tmp_path / "report.html").read_text("utf-8")
    assert "<p>Not measured: the test does not record strain: no never there.</p>" in page
    assert "tangent" not in page
    assert "the test recorded no peak or no strains" in [t.get_text() for t in less.laboratory.plot().axes[0].texts]


def test_a_report_says_why_a_measure_does_not_exist(tmp_path):
    """A specimen that swells has no largest contraction; its curves are made by hand."""
    result = gl.simulate(small_sample(4), Linear(**STIFF), attrs.evolve(PRESS, maximum_strain=1e-4, samples=20))
    load = np.linspace(0, 1e8, len(result.curves["time"]))
    strains = {"strain": load / 5e10, "lateral_strain": 1.5 * load / 5e10, "volumetric_strain": 0.5 * load / 5e10}
    laboratory = attrs.evolve(result, curves={**result.curves, "stress": load, **strains}).laboratory
    assert laboratory.note.split("; ") == [
        "the axial strain has no foot of 0.01 of that at 0.5 of the peak: no crack closure, crack closure ratio",
        "nothing has broken: no crack initiation count, crack initiation count ratio",
        "there is no CD to end the line at: the sum of axial and lateral strain rises all the way to the peak: no "
        "crack initiation lateral, crack initiation lateral ratio",
        "the crack volume at the peak is less than 0.01 of the elastic one: no crack initiation volumetric, "
        "crack initiation volumetric ratio",
        "the sum of axial and lateral strain rises all the way to the peak: no crack damage, crack damage ratio",
        "the sum of axial and twice the lateral strain rises all the way to the peak: no crack damage cylinder, "
        "crack damage cylinder ratio",
    ]


def test_measures_that_cannot_be_are_refused(result, tmp_path):
    with pytest.raises(gl.ParameterError, match=r"measures: 'b_value' is not allowed, it must be a Measure"):
        result.write_report(tmp_path / "report.html", measures=["b_value"])
    with pytest.raises(gl.ParameterError, match="two are named 'b_value', each must have a name of its own"):
        gl.Laboratory(result, [*gl.MEASURES.values(), Eighth(name="b_value")])
    for value in (np.zeros(3), None, "12", True):
        with pytest.raises(gl.ParameterError, match=r"Eighth: find returned .* for 'eighth', it must"):
            gl.Laboratory(result, [Eighth(value=value)]).value("eighth")
    with pytest.raises(gl.ParameterError, match="Nameless cannot be made: it must define meaning, name"):
        type("Nameless", (gl.Measure,), {"find": lambda self, laboratory: 0.0})()
    assert not list(tmp_path.iterdir())
