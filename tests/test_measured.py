"""Curves of a laboratory: read from files as machines write them, and judged where the answers are known."""

import re

import attrs
import numpy as np
import pytest
from support import BRITTLE, PULL, small_sample

import grainlaw as gl
from grainlaw.quantity import digits_that_count
from grainlaw.results.tables import latex, latex_unit
from grainlaw.results.text_table import read_table
from grainlaw.results.thresholds import crack_damage
from grainlaw.units import MPa, mm

E, NU = 50e9, 0.25
LOAD = np.linspace(0, 100, 201) * 1e6
AFTER = np.linspace(100, 20, 50)[1:] * 1e6


def lateral_of(load):
    """Slopes 0.25, 0.45 and 1.5 over E: kinks at 40 and 80 MPa, where twice the tangent ratio passes 1."""
    return np.interp(load, np.array([0, 40, 80, 100]) * 1e6, np.array([0, 10, 28, 58]) * 1e6 / E)


STRESS = np.concatenate([LOAD, AFTER])
AXIAL = np.concatenate([LOAD / E, 100e6 / E + np.arange(1, 50) * 4e-5])  # it falls while the strain grows
LATERAL = np.concatenate([lateral_of(LOAD), lateral_of(100e6) + np.arange(1, 50) * 8e-5])


def write(path, head, columns, separator=";", decimal=".", after=""):
    """A file of a testing machine."""
    rows = (separator.join(f"{value:.9g}".replace(".", decimal) for value in row) for row in zip(*columns, strict=True))
    path.write_text("\n".join([*head, *rows]) + "\n" + after, encoding="utf-8")
    return path


#: forms of one curve: lines above, columns, separator, decimal sign, what is given
FORMS = {
    "semicolons": (
        ["Axial strain (%);Lateral strain (%);sigma_1 [MPa]"],
        [AXIAL * 100, -LATERAL * 100, STRESS / 1e6], ";", ".", {},
    ),
    "german": (
        ["Versuch 12;;", "Bohrkern 3,5 cm;;", "Dehnung;Querdehnung;Spannung", "%;%;N/mm²"],
        [AXIAL * 100, LATERAL * 100, STRESS / 1e6], ";", ",", {},
    ),
    "tabs, microstrain": (
        ["eps_a (µε)\teps_r (µε)\tDeviator stress (kPa)"],
        [AXIAL * 1e6, LATERAL * 1e6, STRESS / 1e3], "\t", ".", {},
    ),
    "force, displacement": (
        ["Time (s),Load (kN),Axial displacement (mm),Radial strain"],
        [np.arange(250.0), STRESS * np.pi * 0.025**2 / 1e3, AXIAL * 125, LATERAL * 1e6], ",", ".",
        {"diameter": 50 * mm, "height": 125 * mm, "lateral_strain": "um/m"},
    ),
    "extension positive": (["ε1, ε3, σ1".replace(",", "\t")], [-AXIAL, LATERAL, -STRESS / 1e6], "\t", ".", {}),
    "volume": (["strain,vol. strain,stress"], [AXIAL * 100, (AXIAL - 2 * LATERAL) * 100, STRESS / 1e6], ",", ".", {}),
    "volume, extension positive": (
        ["strain,vol. strain,stress"],
        [-AXIAL * 100, (2 * LATERAL - AXIAL) * 100, STRESS / 1e6], ",", ".", {},
    ),
    "blanks, names with brackets": (
        ["Specimen 12 of 14", "", "Axial strain (%) Lateral strain (%) Axial stress (MPa)"],
        [AXIAL * 100, LATERAL * 100, STRESS / 1e6], "  ", ".", {},
    ),
    "blanks, names in columns": (
        ["Axial strain   Lateral strain   Axial stress", "%  %  MPa"],
        [AXIAL * 100, LATERAL * 100, STRESS / 1e6], "   ", ".", {},
    ),
    "blanks, no names": (
        [], [AXIAL * 100, LATERAL * 100, STRESS], " ", ",",
        {"columns": {"strain": 1, "lateral_strain": 2, "stress": 3}},
    ),
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS)
def test_kinks_of_a_measured_curve_are_where_they_were_put(form, tmp_path):
    """E 50 GPa and nu 0.45 at half of the peak; CI at 40 and CD at 80 MPa of 100, as on paper."""
    head, columns, separator, decimal, given = FORMS[form]
    curve = gl.read_curve(write(tmp_path / "lab.csv", head, columns, separator, decimal), **given)
    found = curve.laboratory.properties
    assert curve.curves["stress"] == pytest.approx(STRESS, rel=1e-7, abs=1)
    assert curve.curves["strain"] == pytest.approx(AXIAL, rel=1e-7, abs=1e-9)
    assert curve.curves["lateral_strain"] == pytest.approx(LATERAL, rel=1e-6, abs=1e-9)
    assert found["tangent_modulus"] == pytest.approx(E, rel=1e-6)
    assert found["tangent_poisson"] == pytest.approx(0.45, rel=1e-6)
    assert found["secant_modulus"] == pytest.approx(E, rel=1e-6)
    assert found["secant_poisson"] == pytest.approx((10 + 4.5) / 50, rel=1e-6)
    assert found["crack_damage"] == found["crack_damage_cylinder"] == pytest.approx(80e6)
    assert found["crack_initiation_lateral"] == pytest.approx(40e6)
    # The crack volume grows by 2 x 0.2/E per load beyond 40 MPa: 1 % of the elastic 0.5 x 100 MPa/E at the peak.
    assert found["crack_initiation_volumetric"] == pytest.approx((40 + 0.5 / 0.4) * 1e6, rel=1e-4)
    assert curve.summary["strength"] == curve.summary["largest_stress"] == pytest.approx(100e6)
    assert curve.summary["failure_strain"] == pytest.approx(100e6 / E)
    assert curve.summary["modulus"] == pytest.approx(E, rel=1e-6)
    assert found["crack_damage_ratio"] == pytest.approx(0.8)
    assert not [name for name in found if name.startswith("apparent") or "energy" in name]


@pytest.mark.parametrize("samples", [200, 1000, 5000])
@pytest.mark.parametrize("noise", [0.05, 0.2, 0.5])
@pytest.mark.parametrize("seed", [1, 2])
def test_noise_of_a_machine_is_no_failure(samples, noise, seed, tmp_path):
    """MPa, of a specimen of 100 MPa; one that breaks at 60 MPa and then bears 95 again has failed at 60."""
    chance, up = np.random.default_rng(seed), np.linspace(0, 100, samples)
    after = np.linspace(100, 50, samples // 5)[1:]
    broken = np.where(up < 60, up, np.maximum(up - 20, 50))
    for load, strength, within in ((np.append(up, after), 100, 0.01), (np.append(broken, after - 20), 60, 0.03)):
        strain = np.append(up / 500, 0.2 + np.arange(1, len(after) + 1) * 0.05 / len(after))
        columns = [strain, load + noise * chance.standard_normal(len(load))]
        found = gl.read_curve(write(tmp_path / "x.csv", ["strain (%);stress (MPa)"], columns)).summary
        assert found["strength"] == pytest.approx(strength * MPa, rel=within)
        assert found["modulus"] == pytest.approx(50e9, rel=0.05)  # three standard errors of 36 samples


def test_steps_of_a_machine_are_no_failure(tmp_path):
    """A load in whole MPa, of 2,000 samples."""
    up, after = np.linspace(0, 100, 2001), np.linspace(100, 50, 200)
    columns = [np.append(up / 500, 0.2 + after[::-1] / 1000), np.round(np.append(up, after))]
    found = gl.read_curve(write(tmp_path / "x.csv", ["strain (%);stress (MPa)"], columns)).summary
    assert found["strength"] == 100 * MPa


@pytest.mark.parametrize("timed", [False, True])
def test_rows_that_are_written_from_the_end_are_turned(timed, tmp_path):
    columns = [AXIAL * 100, -LATERAL * 100, STRESS / 1e6, *([np.arange(250.0)] if timed else [])]
    head = ["Axial strain (%);Lateral strain (%);sigma_1 [MPa]" + ";time (s)" * timed]
    forward = gl.read_curve(write(tmp_path / "a.csv", head, columns))
    back = gl.read_curve(write(tmp_path / "b.csv", head, [column[::-1] for column in columns]))
    assert back.summary == forward.summary
    assert "rows turned: the newest is written first" in str(back)
    assert "rows turned" not in str(forward)
    assert back.laboratory.value("crack_damage") == forward.laboratory.value("crack_damage")


@pytest.mark.parametrize("kind", ["Axial strain", "Lateral strain"])
def test_of_two_gauges_it_is_asked_which(kind, tmp_path):
    head = [f"Axial strain{' 1' * (kind[0] == 'A')};Lateral strain{' 1' * (kind[0] == 'L')};{kind} 2;stress (MPa)"]
    columns = [AXIAL, LATERAL, AXIAL if kind[0] == "A" else LATERAL, STRESS / 1e6]
    with pytest.raises(gl.ParameterError, match=f"'{kind} 1', '{kind} 2' may each be the"):
        gl.read_curve(write(tmp_path / "x.csv", head, columns), strain="1", lateral_strain="1")


def test_what_was_guessed_is_said(tmp_path):
    file = write(
        tmp_path / "lab.csv",
        ["Date;Axial strain;Radial strain;Stress;T"],
        [AXIAL * 0, AXIAL * 100, LATERAL * 100, STRESS / 1e6, AXIAL],
    )
    curve = gl.read_curve(file)
    assert str(curve).splitlines() == [
        f"{file}: 250 rows, columns separated by semicolons, decimal point",
        "stress: 'Stress' in MPa (guessed)",
        "strain: 'Axial strain' in % (guessed)",
        "lateral_strain: 'Radial strain' in % (guessed)",
        "volumetric_strain: sum of axial and twice the lateral strain",
        "time: 'T' in s (guessed)",
        "not used: 'Date'",
    ]
    given = gl.read_curve(file, strain="1", lateral_strain="‰", stress="kPa")
    assert "strain: 'Axial strain' in a ratio (given)" in str(given)
    assert given.curves["stress"].max() == pytest.approx(1e5)
    assert given.curves["lateral_strain"].max() == pytest.approx(LATERAL.max() * 0.1)
    assert repr(curve).startswith("MeasuredCurve(file: lab.csv, rows: 250, strength: 100.00 MPa, strain at failure: ")


@pytest.mark.parametrize("unit", ["1", "%", "um/m"])
@pytest.mark.parametrize("modulus", [1.1e9, 50e9, 190e9])
def test_a_strain_without_unit_is_told_by_the_stiffness_of_rocks(unit, modulus, tmp_path):
    sizes = {"1": 1, "%": 100, "um/m": 1e6}
    file = write(tmp_path / "lab.txt", ["strain stress"], [LOAD / modulus * sizes[unit], LOAD / 1e6], " ")
    if sum(1e9 < modulus * size / sizes[unit] < 2e11 for size in sizes.values()) > 1:
        with pytest.raises(gl.ParameterError, match="its size does not tell it: strain='%'"):
            gl.read_curve(file)
        return
    assert gl.read_curve(file).summary["modulus"] == pytest.approx(modulus, rel=1e-6)


def test_without_lateral_strain_there_is_a_modulus_and_a_reason(tmp_path):
    curve = gl.read_curve(write(tmp_path / "lab.csv", ["strain (%);stress (MPa)"], [AXIAL * 100, STRESS / 1e6]))
    found = curve.laboratory
    assert found.properties["tangent_modulus"] == pytest.approx(E)
    for name in ("tangent_poisson", "crack_damage", "crack_initiation_lateral", "crack_initiation_volumetric"):
        assert np.isnan(found.properties[name])
    assert "no lateral strain was measured: no crack initiation volumetric, crack damage" in found.note
    assert "there is no CD to end the line at: no lateral strain was measured" in found.note


def test_a_confined_curve_begins_where_the_load_exceeds_the_confinement(tmp_path):
    """30 rows of an isotropic rise to 10 MPa, in which the strains are others, come first."""
    rise = np.linspace(0, 10e6, 31)[:-1]
    stress = np.concatenate([rise, 10e6 + STRESS])
    axial = np.concatenate([rise / 20e9, 10e6 / 20e9 + AXIAL])
    lateral = np.concatenate([-rise / 20e9, -10e6 / 20e9 + LATERAL])
    file = write(
        tmp_path / "lab.csv", ["strain (%);radial strain (%);sigma1 (MPa)"], [axial * 100, lateral * 100, stress / 1e6]
    )
    curve = gl.read_curve(file, confinement=10 * MPa)
    assert curve.summary["strength"] == pytest.approx(110e6)
    assert curve.curves["deviator"][0] == pytest.approx(0, abs=0.4e6)  # the last sample before, or the first
    rise = 10e6 / 20e9
    assert curve.summary["failure_strain"] == pytest.approx(AXIAL[np.argmax(STRESS)], abs=rise / 30)
    assert curve.laboratory.properties["crack_damage"] == pytest.approx(90e6)
    assert curve.laboratory.properties["crack_initiation_lateral"] == pytest.approx(50e6)
    assert curve.laboratory.properties["secant_modulus"] == pytest.approx(E, rel=1e-3)
    assert curve.summary["modulus"] == pytest.approx(E, rel=1e-3)
    with pytest.raises(gl.ParameterError, match=r"confinement = 200000000.0 is not allowed, it must be below"):
        gl.read_curve(file, confinement=200 * MPa)
    deviator = write(tmp_path / "q.csv", ["strain (%);eps_3 (%);q (MPa)"], [AXIAL * 100, LATERAL * 100, STRESS / 1e6])
    confined = gl.read_curve(deviator, confinement=10 * MPa)
    assert confined.curves["stress"] - confined.curves["deviator"] == pytest.approx(10e6)
    assert confined.laboratory.properties["crack_damage"] == pytest.approx(90e6)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_specimen_that_is_pulled_becomes_thinner(sign, tmp_path):
    columns = [sign * LOAD / 10 / E * 1e6, -sign * NU * LOAD / 10 / E * 1e6, LOAD / 1e7]
    file = write(tmp_path / "lab.csv", ["axial strain (µε);lateral strain (µε);stress (MPa)"], columns)
    curve = gl.read_curve(file, tension=True)
    found = curve.laboratory
    assert found.properties["tangent_modulus"] == pytest.approx(E)
    assert found.properties["tangent_poisson"] == pytest.approx(NU)
    assert curve.summary["poisson"] == pytest.approx(NU)
    assert curve.curves["volumetric_strain"][-1] == pytest.approx((1 - 2 * NU) * 10e6 / E)
    assert "the specimen has not become shorter: no " in found.note
    alone = gl.read_curve(write(tmp_path / "b.csv", ["strain (µε);stress (MPa)"], columns[::2]), tension=True)
    assert not alone.laboratory.path.is_compression


def test_a_plate_has_one_lateral_strain_in_its_volume(tmp_path):
    file = write(
        tmp_path / "lab.csv", ["strain (%);lateral strain (%);stress (MPa)"], [AXIAL * 100, LATERAL * 100, STRESS / 1e6]
    )
    plate, cylinder = gl.read_curve(file, laterals=1), gl.read_curve(file)
    assert plate.curves["volumetric_strain"] == pytest.approx(LATERAL - AXIAL)
    assert cylinder.curves["volumetric_strain"] == pytest.approx(2 * LATERAL - AXIAL)
    assert crack_damage(plate.path).value == pytest.approx(80e6)
    slow = np.where(LATERAL > lateral_of(60e6), LATERAL, 0.55 * LATERAL)  # between 1/2 and 1
    assert crack_damage(attrs.evolve(cylinder.path, lateral=slow[:201] * 0)).why.startswith(
        "the sum of axial and twice"
    )


REFUSED = {
    "strain (%);stress (MPa)": [
        ({"strain": "MPa"}, r"strain = 'MPa' is not allowed, it must be a unit of a strain, such as '%'"),
        ({"stress": "furlong"}, r"stress = 'furlong' is not allowed, it must be a unit of a stress, such as 'MPa'"),
        ({"columns": {"strian": 1}}, r"columns: there is no 'strian'; did you mean 'strain'\?"),
        ({"columns": {"strain": "Ext"}}, r"columns: strain = 'Ext' is not allowed, .* \(there are: 'strain', 'stress'"),
        ({"columns": {"strain": 3}}, r"columns: strain = 3 is not allowed"),
        ({"columns": {"strain": 2, "stress": 1}}, r"the column 'strain' has the unit %, which is no stress"),
        ({"laterals": 3}, r"laterals = 3 is not allowed, it must be a whole number from 1 to 2"),
        ({"confinement": -1}, r"confinement = -1 Pa is not allowed"),
        ({"height": 0}, r"height = 0 m is not allowed, it must be a finite number and above 0"),
    ],
    "strain (%);force (kN)": [({}, r"the column 'force' is a force: give the diameter \(m\) of the cylinder")],
    "strain (%);force": [({"diameter": 0.05}, r"the column 'force' has no unit, give it: force='kN'")],
    "displacement (mm);stress (MPa)": [({}, r"the column 'displacement' is a displacement: give the height \(m\)")],
    "displacement;stress (MPa)": [({"height": 0.1}, r"'displacement' has no unit, give it: displacement='mm'")],
    "a;b": [({}, r"no column is a stress, a deviator or a force by its name, say which is: columns=")],
    "a;stress (MPa)": [({}, r"no column is a strain or a displacement by its name")],
    "strain A (%);strain B (%);stress": [({}, r"the columns 'strain A', 'strain B' may each be the strain, say which")],
}  # fmt: skip


@pytest.mark.parametrize(("head", "given", "words"), [(head, *each) for head, rows in REFUSED.items() for each in rows])
def test_what_cannot_be_told_is_refused_with_its_column(head, given, words, tmp_path):
    columns = [AXIAL * 100] * head.count(";") + [STRESS / 1e6]
    with pytest.raises(gl.ParameterError, match=f"read_curve: .*{words}"):
        gl.read_curve(write(tmp_path / "lab.csv", [head], columns), **given)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"PK\x03\x04", "is a workbook, it must be text: save its sheet as .csv"),
        (b"", "is empty"),
        (b"\0\1\2", "is no text"),
        (b"a report of a test\nwithout numbers", "has no two columns of numbers below each other"),
        (b"strain (%);stress (MPa)\n1;2\n2;3\n", "2 rows have a stress and a strain, it must be at least 10"),
        (
            b"strain (%);stress (MPa)\n" + b"1;2\n" * 20 + b"3;broken\n",
            "line 22: 'broken' in the column 'stress' is not",
        ),
    ],
)
def test_files_that_are_no_curves_are_refused(content, words, tmp_path):
    file = tmp_path / "lab.csv"
    file.write_bytes(content)
    with pytest.raises(gl.ParameterError, match=re.escape(words)):
        gl.read_curve(file)
    with pytest.raises(gl.ParameterError, match=r"nowhere\.csv cannot be read: No such file"):
        gl.read_curve(tmp_path / "nowhere.csv")


def test_names_that_do_not_fit_the_columns_are_no_names(tmp_path):
    """Between single blanks nobody can tell which words are one name: 'strain' is not the second column."""
    file = write(tmp_path / "lab.txt", ["Axial strain Axial stress"], [STRESS / 1e6, AXIAL * 100], " ")
    with pytest.raises(gl.ParameterError, match="no column is a stress, a deviator or a force by its name"):
        gl.read_curve(file)
    curve = gl.read_curve(file, columns={"stress": 1, "strain": "column 2"})
    assert curve.summary["strength"] == pytest.approx(100e6)


def test_a_file_of_a_machine_with_much_beside_the_numbers(tmp_path):
    """A preamble with numbers, dates in a column, an empty line before the names, blank and empty places."""
    head = ["Test report;2024;3;1", "Diameter;50;mm", "", "Date;Time;Load;Stroke;Remark", ";[s];[kN];[mm];"]
    load = STRESS * np.pi * 0.025**2 / 1e3
    rows = [
        f"01.02.2024;{k};{f:.6f};{-u:.7f};{'peak' if k == 200 else ''}"
        for k, (f, u) in enumerate(zip(load, AXIAL * 125, strict=True))
    ]
    file = tmp_path / "lab.txt"
    file.write_text("\n".join([*head, *rows]).replace(".", ",").replace("01,02,2024", "01.02.2024") + "\n\n", "cp1252")
    curve = gl.read_curve(file, diameter=50 * mm, height=125 * mm)
    assert curve.curves["stress"] == pytest.approx(STRESS, abs=2)
    assert curve.summary["failure_strain"] == pytest.approx(2e-3, rel=1e-5)
    assert curve.curves["time"][-1] == 249
    assert "strain: sign turned" in str(curve)
    assert "force: 'Load' in kN, over 1963.5 mm2" in str(curve)


def test_rows_without_a_number_are_left_out_and_said(tmp_path):
    file = write(
        tmp_path / "lab.csv", ["strain (%),stress (MPa)"], [AXIAL * 100, STRESS / 1e6], ",", after="0.3,\n,\nnan,5\n"
    )
    curve = gl.read_curve(file)
    assert len(curve.curves["stress"]) == 250
    assert "2 rows without all numbers left out" in str(curve)


@pytest.mark.parametrize(
    ("encoding", "head"), [("utf-16", "ε1 (%)"), ("cp1252", "Dehnung (‰)"), ("utf-8-sig", "ε1 [µε]")]
)
def test_encodings_and_thousands(encoding, head, tmp_path):
    file = tmp_path / "lab.csv"
    file.write_text(f'"{head}";"Kraft [N]"\r\n' + '"1,5";"12.345,5"\r\n' * 12, encoding=encoding)
    strain, force = read_table("test", file).columns
    assert (strain.name, force.unit) == (head.split()[0], "N")
    assert strain.unit == {"%": "%", "‰": "‰", "µε": "um/m"}[head.split()[1][1:-1]]
    assert strain.values.tolist() == [1.5] * 12
    assert force.values.tolist() == [12345.5] * 12


@pytest.mark.parametrize(
    ("cells", "values"),
    [
        (("1,234", "5,678"), (1.234, 5.678)), (("1.234", "5.678"), (1.234, 5.678)),
        (("0,981748", "12,5"), (0.981748, 12.5)), (("1.234,5", "0,5"), (1234.5, 0.5)),
        (("1,234.5", "0.5"), (1234.5, 0.5)), (("1.234.567", "0,5"), (1234567, 0.5)),
        (("1e-3", "-2.5E2"), (1e-3, -250)), ((".5", "+5."), (0.5, 5)), (("3", "4"), (3, 4)),
    ],
)  # fmt: skip
def test_one_sign_alone_is_the_decimal_one(cells, values, tmp_path):
    file = tmp_path / "lab.txt"
    for line in (f"{cells[0]}\t{cells[1]}\n", f'"{cells[0]}","{cells[1]}"\n'):
        file.write_text(line * 12)
        assert [each.values[0] for each in read_table("test", file).columns] == list(values)


@pytest.fixture(scope="module")
def ours():
    return gl.simulate(small_sample(), BRITTLE, PULL)


def test_a_measured_curve_is_drawn_beside_ours_in_the_same_units(ours, tmp_path):
    curve = gl.read_curve(write(tmp_path / "lab.csv", ["strain (%);stress (kPa)"], [AXIAL * 100, STRESS / 1e3]))
    axes = gl.plot_curves(ours, measured=curve).axes[0]
    mark = next(line for line in axes.lines if line.get_marker() == "o" and line.get_fillstyle() == "full")
    assert mark.get_ydata() == pytest.approx(ours.summary["strength"] / 1e6)
    drawn = [line for line in axes.lines if line.get_marker() != "o"]
    assert [line.get_label() for line in drawn] == ["MohrCoulomb", "lab.csv"]
    assert drawn[1].get_xdata() == pytest.approx(AXIAL * 100)
    assert drawn[1].get_ydata() == pytest.approx(STRESS / 1e6)
    assert axes.get_legend().get_title().get_text() == "plane strain: 1/(1 − ν²) as steep as a cylinder"
    both = gl.read_curve(
        write(tmp_path / "both.csv", ["strain;stress (MPa);lateral strain"], [AXIAL, STRESS / 1e6, AXIAL])
    )
    sides = gl.plot_curves(ours, "lateral_strain", measured=both).axes[0]
    assert not sides.get_legend().get_title().get_text()  # nu* is nu / (1 - nu)
    plate = attrs.evolve(curve, laterals=1)
    assert not gl.plot_curves(ours, measured=plate).axes[0].get_legend().get_title().get_text()
    rock = attrs.evolve(ours.specimen.material, plane=gl.Plane.STRESS)
    free = attrs.evolve(ours, specimen=attrs.evolve(ours.specimen, material=rock))
    assert not gl.plot_curves(free, measured=curve).axes[0].get_legend().get_title().get_text()
    several = gl.plot_curves(ours, measured=[curve, curve]).axes[0]
    assert [line.get_label() for line in several.lines if line.get_marker() != "o"][1:] == ["lab.csv", "lab.csv (2)"]
    assert gl.plot_curves(ours, measured={"core 3": curve}).axes[0].lines[-1].get_label() == "core 3"
    with pytest.raises(gl.ParameterError, match="measured = 3 is not allowed, it must be a curve of read_curve"):
        gl.plot_curves(ours, measured=3)
    with pytest.raises(gl.ParameterError, match="plot_curves needs the column energy_kinetic"):
        gl.plot_curves(ours, "energy_kinetic", measured=curve)


def test_a_laboratory_of_a_measured_curve_has_what_curves_tell(ours, tmp_path):
    head, columns, separator, decimal, _ = FORMS["semicolons"]
    found = gl.read_curve(write(tmp_path / "lab.csv", head, columns, separator, decimal)).laboratory
    assert len(found.plot().axes) == 1
    with pytest.raises(gl.ParameterError, match="panel = 'rose' is not allowed, it must be 'thresholds'"):
        found.plot("rose")
    every = gl.Laboratory(found.result, list(gl.MEASURES.values()))
    assert np.isnan(every.properties["fragments"])
    assert "a measured curve has no cracks and no frames: no damage onset, crack initiation count, " in every.note
    assert every.properties["crack_damage"] == found.properties["crack_damage"]
    with pytest.raises(gl.ParameterError, match="result = 3 is not allowed, it must be a Result or a MeasuredCurve"):
        gl.Laboratory(3)
    assert len(gl.Laboratory(ours).measures) == len(gl.MEASURES)


# --- digits that mean something --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "resolution", "text"),
    [
        (80.0, 0, "80"), (80.0, 0.5, "80.0"), (80.04, 0.004, "80.0"), (80.0, 2, "80"), (183, 20, "180"),
        (183, 100, "200"),
        (0.95123, 0.12, "1.0"), (0.95123, 0.012, "0.95"), (-12.34, 0.03, "-12.3"), (12345.6, 0, "12346"),
        (12345.6, 0.1, "12346"), (3.0, 0.09, "3.00"), (0.0, 0.1, "0"), (2.0, np.nan, "2"), (2.0, 50, "0"),
    ],
)  # fmt: skip
def test_no_digit_is_finer_than_what_is_known(value, resolution, text):
    assert digits_that_count(value, resolution) == text


@pytest.mark.parametrize("step", [0.5, 5])
def test_a_threshold_is_known_to_the_distance_of_samples(step, tmp_path):
    load = np.arange(0, 100 + step, step) * 1e6
    columns = [load / E * 100, lateral_of(load) * 100, load / 1e6]
    found = gl.read_curve(
        write(tmp_path / "lab.csv", ["strain (%);radial strain (%);stress (MPa)"], columns)
    ).laboratory
    table = found.to_pandas()
    assert table["value"]["crack_damage"] == pytest.approx(80)
    assert table["resolution"]["crack_damage"] == pytest.approx(step)
    assert table["resolution"]["crack_damage_ratio"] == pytest.approx(step / 100)
    assert table["resolution"]["tangent_modulus"] == 0
    lines = found.to_latex().splitlines()
    assert lines[:4] == [r"\begin{tabular}{lrl}", r"\toprule", r"measure & value & unit \\", r"\midrule"]
    assert r"$E_{t50}$, tangent at 50 \% of the peak & 50 & GPa \\" in lines
    assert r"$\nu_{s50}$, secant up to 50 \% of the peak & 0.29 &  \\" in lines
    damage = {0.5: "80.0", 5: "80"}[step]
    assert rf"CD, reversal of the volumetric strain & {damage} & MPa \\" in lines
    assert r"CC, axial strain response & -- & MPa \\" in lines
    assert lines[-2:] == [r"\bottomrule", r"\end{tabular}"]


def test_a_record_that_stops_at_failure_has_its_strength_where_it_ends(tmp_path):
    """A straight line to 100 MPa at 2 permille; that the specimen failed there only the laboratory knows."""
    load = np.linspace(0, 100, 201)
    file = write(tmp_path / "lab.csv", ["strain (%);stress (MPa)"], [load / 500, load])
    open_end, failed = gl.read_curve(file), gl.read_curve(file, ends_at_failure=True)
    assert np.isnan(open_end.summary["strength"])
    assert "strength: the record ends before a failure; ends_at_failure=True takes the largest stress" in str(open_end)
    assert failed.summary["strength"] == pytest.approx(100e6)
    assert failed.summary["failure_strain"] == pytest.approx(2e-3)
    assert "ends_at_failure" not in str(failed)


def test_a_table_for_a_paper_begins_with_the_strength_and_sets_two_specimens_side_by_side(tmp_path):
    """The second bears 0.8 of the stress at each strain, so that its modulus and CD are 0.8 of the first."""
    head = ["strain (%);radial strain (%);stress (MPa)"]
    one, two = (
        gl.read_curve(write(tmp_path / f"{share}.csv", head, [AXIAL * 100, LATERAL * 100, share * STRESS / 1e6]))
        for share in (1, 0.8)
    )
    lines = one.laboratory.to_latex().splitlines()
    assert lines[4] == r"strength, load at the first failure & 100 & MPa \\"
    assert r"E, of the rock & 50 & GPa \\" in lines
    lines = one.laboratory.to_latex(measured=two).splitlines()
    assert lines[:3] == [r"\begin{tabular}{lrrl}", r"\toprule", r"measure & model & measured & unit \\"]
    assert lines[4] == r"strength, load at the first failure & 100 & 80 & MPa \\"
    assert r"CD, reversal of the volumetric strain & 80.0 & 64.0 & MPa \\" in lines
    assert r"E, of the rock & 50 & 40 & GPa \\" in lines
    assert not any("fragments" in line for line in lines)
    assert str(one.laboratory).splitlines()[0].split() == "strength, load at the first failure 100 MPa".split()
    table = one.laboratory.to_pandas(measured=two)
    assert table["measured"]["crack_damage"] == pytest.approx(0.8 * table["value"]["crack_damage"])
    assert table["measured"]["modulus"] == pytest.approx(40)
    with pytest.raises(gl.ParameterError, match=r"measured = 5 is not allowed, it must be what gl\.read_curve"):
        one.laboratory.to_latex(measured=5)


def test_what_has_a_meaning_in_latex_is_escaped():
    assert latex("50 % of A_1 & {b} #2 ^ ~ \\ $") == (
        r"50 \% of A\_1 \& \{b\} \#2 \textasciicircum{} \textasciitilde{} \textbackslash{} \$"
    )
    assert latex("E*_t50, x") == "$E^*_{t50}$, x"
    assert (latex("-3.5"), latex("-"), latex("Energy")) == ("$-3.5$", "--", "Energy")
    assert [latex_unit(unit) for unit in ("J/m2", "%", "deg", "MPa √m", "m-2")] == [
        "J/m$^{2}$", r"\%", r"$^\circ$", r"MPa $\surd$m", "m$^{-2}$",
    ]  # fmt: skip
