"""Rocks as data: their elastic constants against those of single crystals, and that a test takes them."""

import json
import re
from pathlib import Path

import attrs
import numpy as np
import pytest
from command_line import invoke

import grainlaw as gl
from grainlaw.cli.configuration import configured, template
from grainlaw.cli.default_rock import LAWS, ROCK
from grainlaw.cli.rock_file import _laws
from grainlaw.cli.sections import read_file
from grainlaw.geometry import rectangle
from grainlaw.laws import Linear, MohrCoulomb
from grainlaw.units import mm

ROCKS = Path(__file__).parents[1] / "docs" / "examples" / "rocks"
GRANITE = ROCKS / "lac-du-bonnet-granite.toml"

#: GPa, by Voigt's indices; the sources are named in the file of the rock
CRYSTALS = {
    "quartz": {
        "11": 86.6, "22": 86.6, "33": 106.4, "44": 58.0, "55": 58.0, "66": (86.6 - 6.74) / 2, "12": 6.74, "13": 12.4,
        "23": 12.4, "14": 17.8, "24": -17.8, "56": 17.8,
    },
    "K-feldspar": {
        "11": 67.8, "22": 181.2, "33": 158.4, "44": 21.1, "55": 19.4, "66": 33.1, "12": 40.4, "13": 25.0, "15": -1.1,
        "23": 20.6, "25": -12.9, "35": 10.6, "46": -11.6,
    },
    "plagioclase": {
        "11": 87.1, "22": 174.9, "33": 166.1, "44": 22.9, "55": 29.0, "66": 35.0, "12": 43.9, "13": 35.4, "23": 18.0,
        "45": -1.3, "46": -5.2, "56": 0.8, "14": 6.1, "15": -0.4, "16": -0.6, "24": -5.9, "25": -2.9, "26": -6.5,
        "34": -2.9, "35": 4.6, "36": -10.7,
    },
    "mica": {"11": 186, "22": 186, "33": 54, "44": 5.8, "55": 5.8, "66": 76.8, "12": 32.4, "13": 11.6, "23": 11.6},
}  # fmt: skip


def bounds(crystal):
    """Bulk and shear modulus of randomly turned crystals by Voigt and by Reuss."""
    stiffness = np.zeros((6, 6))
    for (i, j), value in crystal.items():
        stiffness[int(i) - 1, int(j) - 1] = stiffness[int(j) - 1, int(i) - 1] = value
    sums = []
    for matrix in (stiffness, np.linalg.inv(stiffness)):
        sums.append((np.trace(matrix[:3, :3]), np.triu(matrix[:3, :3], 1).sum(), np.trace(matrix[3:, 3:])))
    (a, b, c), (r, s, t) = sums
    return ((a + 2 * b) / 9, (a - b + 3 * c) / 15), (1 / (r + 2 * s), 15 / (4 * r - 4 * s + 3 * t))


def of_bulk_and_shear(k, g):
    return 9 * k * g / (3 * k + g), (3 * k - 2 * g) / (6 * k + 2 * g)


def test_the_bounds_of_an_isotropic_crystal_are_its_moduli():
    k, g = 40.0, 30.0
    p, q = k + 4 * g / 3, k - 2 * g / 3
    crystal = {"11": p, "22": p, "33": p, "12": q, "13": q, "23": q, "44": g, "55": g, "66": g}
    assert bounds(crystal) == (pytest.approx((k, g)), pytest.approx((k, g)))
    assert of_bulk_and_shear(k, g) == pytest.approx((72, 0.2))


def test_biotite_has_the_bounds_of_the_handbook():
    """Mavko, Mukerji and Dvorkin, The Rock Physics Handbook, list both."""
    assert bounds(CRYSTALS["mica"]) == (pytest.approx((59.7, 42.3), abs=0.1), pytest.approx((41.1, 12.4), abs=0.1))


def test_elastic_constants_are_those_of_the_crystals():
    rocks = configured("uniaxial-compression", read_file(GRANITE), quick=True).specimen
    for k, name in enumerate(rocks.grains.phase_names):
        young, poisson = of_bulk_and_shear(*np.mean(bounds(CRYSTALS[name]), axis=0))
        material = rocks.material_of(k)
        assert material.youngs_modulus == pytest.approx(young * 1e9, rel=1e-3)
        assert material.poissons_ratio == pytest.approx(poisson, abs=6e-4)


def test_minerals_have_their_shares():
    grains = configured("uniaxial-compression", read_file(GRANITE)).specimen.grains
    found = np.bincount(grains.phase, grains.areas) / grains.areas.sum()
    assert dict(zip(grains.phase_names, found, strict=True)) == pytest.approx(
        {"quartz": 0.31, "K-feldspar": 0.27, "plagioclase": 0.38, "mica": 0.04}, abs=1e-3
    )


def test_the_granite_is_as_stiff_as_its_minerals():
    """In plane strain between the softest and the stiffest, and near to the mean weighted by area."""
    chosen = configured("uniaxial-compression", read_file(GRANITE), quick=True)
    found = gl.elastic_properties(chosen.specimen, Linear(kn=1e17, ks=1e17)).modulus
    assert found == pytest.approx((0.31 * 95.7 + 0.27 * 77.8 + 0.38 * 89.9 + 0.04 * 69.6) * 1e9, rel=0.03)


# --- rocks of papers, by name -----------------------------------------------------------------------------------------

CALIBRATED = {
    "lac-du-bonnet-granite": ("Lac du Bonnet granite", "Mohr-Coulomb"),
    "lac-du-bonnet-granite-cohesive": ("Lac du Bonnet granite", "cohesive crack"),
    "forsmark-granite": ("Forsmark granite", "Mohr-Coulomb"),
    "forsmark-granite-cohesive": ("Forsmark granite", "cohesive crack"),
    "forsmark-tonalite": ("Forsmark tonalite", "Mohr-Coulomb"),
    "forsmark-tonalite-cohesive": ("Forsmark tonalite", "cohesive crack"),
    "palabora-carbonatite": ("", "Mohr-Coulomb"),
    "palabora-carbonatite-cohesive": ("", "cohesive crack"),
}
PRINTED = "palabora-carbonatite-printed"
PREDICTED = "granite-aboayanah-2024"  #: tests/test_rock_study.py
UCS = "uniaxial-compression"
OWN = """
about = "A granite of mine"
cite = ["Me 2026"]
[sample]
minerals = {mica = 0.2, quartz = 0.8}
grain_size = "3 mm"
[rock]
type = "elastic"
youngs_modulus = "70 GPa"
poissons_ratio = 0.2
density = 2650
[rocks]
mica = {youngs_modulus = "30 GPa"}
[law]
type = "cohesive-crack"
kn = 1e14
ks = 5e13
tensile_strength = "9 MPa"
cohesion = "30 MPa"
friction_angle = 50
residual_friction_angle = 20
mode_i_energy = 40
mode_ii_energy = 80
[laws]
"mica/*" = {tensile_strength = "4 MPa", mode_i_energy = 10}
"""


@pytest.fixture
def own(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(OWN, encoding="utf-8")
    return str(file)


def test_calibrated_rocks_are_what_the_calibrations_found():
    docs = Path(__file__).parents[1] / "docs"
    found = json.loads((docs / "examples/rocks/published.json").read_text("utf-8"))
    found[""] = json.loads((docs / "paper/paper_calibrated.json").read_text("utf-8"))
    assert set(gl.rocks) == {*CALIBRATED, PRINTED, PREDICTED}
    for name, (rock, law) in CALIBRATED.items():
        was, has = found[rock][law], gl.rocks[name]
        modulus = 70e9 if rock else 60e9  # of the grains that the search began with
        assert {key: getattr(has.law, key) for key in was["parameters"]} == pytest.approx(was["parameters"], rel=1e-9)
        assert has.law.residual_friction_angle == 5
        assert has.material.youngs_modulus == pytest.approx(was["grains"] * modulus, rel=1e-12)
        assert has.about.count("calibrated") == 1
        assert has.cite


@pytest.mark.parametrize("name", [*CALIBRATED, PRINTED])
def test_a_rock_by_name_has_the_grains_of_its_paper(name):
    count, size = (755, (0.05, 0.125)) if "palabora" in name else (150, (0.022, 0.056))
    specimen = gl.rocks[name].specimen(seed=4)
    low, high = specimen.grains.region.bounds
    assert specimen.grains.count == count
    assert np.subtract(high, low) == pytest.approx(size)
    assert specimen.cite == gl.rocks[name].cite


def test_a_rock_by_the_number_of_its_grains_has_them_as_large_in_other_regions(tmp_path):
    """60 of 4 mm in a prism; a disc and a region of one's own have such grains, the prism itself the same."""
    file = tmp_path / "counted.toml"
    file.write_text(f"""
        [sample]
        region = "rectangle"
        width = "20 mm"
        height = "48 mm"
        tessellator = "voronoi"
        grains = 60
        {OWN[OWN.index("[rock]") : OWN.index("[rocks]")]}
        {OWN[OWN.index("[law]") : OWN.index("[laws]")]}""")
    rock = gl.rocks[str(file)]
    assert rock.specimen().grains.count == 60
    disc = configured("brazilian", {"rock": {"type": str(file)}}).specimen
    wide = rock.specimen(rectangle(40 * mm, 96 * mm))
    for specimen in (disc, wide):
        assert specimen.grains.count == round(specimen.grains.region.area / (4 * mm) ** 2)
    assert configured(UCS, {"rock": {"type": str(file)}, "sample": {"grains": 30}}).specimen.grains.count == 30
    assert repr(rock) == f"{file}: cohesive-crack contacts, elastic grains of 4 mm"


def test_what_the_command_line_takes_without_a_rock_is_the_printed_one():
    printed = gl.rocks[PRINTED]
    assert (printed.law, printed.material) == (LAWS["cohesive-crack"], ROCK)


def test_one_line_of_toml_and_one_of_python_are_the_same_specimen(own):
    for name in ("lac-du-bonnet-granite", own):
        chosen = configured(UCS, {"rock": {"type": name}, "sample": {"seed": 3}})
        region = None if name != own else rectangle(0.05, 0.125)
        made = gl.rocks[name].specimen(region, seed=3)
        assert np.array_equal(made.grains.vertices, chosen.specimen.grains.vertices)
        assert np.array_equal(made.grains.phase, chosen.specimen.grains.phase)
        assert (made.material, gl.rocks[name].law) == (chosen.specimen.material, chosen.law)
        assert made.cite == chosen.specimen.cite == gl.rocks[name].cite


def test_the_grain_size_of_a_rock_holds_in_tests_of_another_shape():
    rock = {"rock": {"type": "lac-du-bonnet-granite"}}
    size = gl.rocks["lac-du-bonnet-granite"].specimen().grains.areas.mean() ** 0.5
    for quick in (False, True):
        assert configured("brazilian", rock, quick).specimen.grains.areas.mean() ** 0.5 == pytest.approx(size, rel=0.05)
    prism = configured(UCS, rock, quick=True).specimen.grains
    assert (prism.region.bounds[1][0], prism.count) == (0.02, round(0.02 * 0.05 / (0.022 * 0.056 / 150)))
    assert configured(UCS, {**rock, "sample": {"grains": 30}}).specimen.grains.count == 30
    assert configured(UCS, {**rock, "sample": {"tessellator": "hexagonal", "grains": 40}}).specimen.grains.count < 60
    assert len(configured("joint-tension", rock).specimen.grains.areas) == 2


def test_another_law_has_what_it_shares_with_the_rock_and_nothing_of_another_rock(own):
    chosen = configured(UCS, {"rock": {"type": own}, "law": {"type": "mohr-coulomb"}})
    assert chosen.law[...] == MohrCoulomb(
        kn=1e14, ks=5e13, tensile_strength=9e6, cohesion=30e6, friction_angle=50, residual_friction_angle=20
    )
    assert chosen.law["mica", ...] == attrs.evolve(chosen.law[...], tensile_strength=4e6)
    again = configured(UCS, chosen.sections)
    assert (again.law, again.specimen.material, again.specimen.cite) == (
        chosen.law, chosen.specimen.material, ("Me 2026",),
    )  # fmt: skip
    with pytest.raises(
        gl.ParameterError, match=r"law\.mode_i_energy .*, law\.mode_ii_energy .* are missing: CohesiveCrack needs them"
    ):
        configured(UCS, {"rock": {"type": "lac-du-bonnet-granite"}, "law": {"type": "cohesive-crack"}})


def test_what_is_given_beside_a_rock_counts_more(own):
    given = {
        "rock": {"type": own, "poissons_ratio": 0.3, "cite": ["You 2025"]}, "rocks": {"mica": {"density": 2900}},
        "law": {"cohesion": "31 MPa"},
        "laws": {"mica/*": {"cohesion": "7 MPa"}, "quartz/quartz": {"type": "linear", "kn": 1e14, "ks": 1e14}},
    }  # fmt: skip
    chosen = configured(UCS, given)
    rock = gl.Elastic(youngs_modulus=70e9, poissons_ratio=0.3, density=2650)
    assert chosen.specimen.material == {"mica": attrs.evolve(rock, youngs_modulus=30e9, density=2900), ...: rock}
    assert chosen.law[...].cohesion == 31e6
    assert (chosen.law["mica", ...].tensile_strength, chosen.law["mica", ...].cohesion) == (4e6, 7e6)
    assert chosen.law["quartz", "quartz"] == Linear(kn=1e14, ks=1e14)
    assert chosen.specimen.cite == ("Me 2026", "You 2025")
    assert 'cite = ["Me 2026", "You 2025"]' in template(UCS, given)


def test_a_pair_of_minerals_may_be_given_in_any_order(own):
    chosen = configured(UCS, {"rock": {"type": own}, "laws": {"*/mica": {"cohesion": "7 MPa"}}})
    assert (chosen.law["mica", ...].cohesion, chosen.law["mica", ...].tensile_strength) == (7e6, 4e6)
    assert set(chosen.law) == {("mica", ...), ...}
    both = {"*/mica": {"cohesion": "21 MPa"}, "mica/*": {"cohesion": "22 MPa"}}
    assert len(configured(UCS, {"rock": {"type": own}, "laws": both}).law) == 3  # neither is lost: a run refuses both


def test_grains_that_break_in_a_rock_may_be_whole():
    rock = gl.rocks[PREDICTED]
    assert rock.specimen(grains=20).grains.is_breakable
    assert not rock.specimen(grains=20, breakable=False).grains.is_breakable
    chosen = configured(UCS, {"rock": {"type": PREDICTED}, "sample": {"grains": 20, "breakable": False}})
    assert not configured(UCS, chosen.sections).specimen.grains.is_breakable


def test_phases_of_an_image_may_be_numbers(own, tmp_path):
    np.save(tmp_path / "section.npy", np.repeat([[1, 2], [3, 4]], 12, axis=0).repeat(12, axis=1))
    names = {1: "mica", 2: "quartz", 3: "quartz", 4: "quartz"}
    made = [
        gl.rocks[own].specimen(file=str(tmp_path / "section.npy"), pixel=1e-3, phases=phases).grains
        for phases in (names, {str(number): name for number, name in names.items()})
    ]
    for grains in made:
        assert sorted(map(grains.phase_name, grains.phase)) == ["mica", "quartz", "quartz", "quartz"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('cite = ["Me 2026"]', 'cite = "Me 2026"', r"mine.toml: cite = 'Me 2026' is not allowed"),
        ("about =", "abuot =", r"there is no '.*mine.toml.abuot'; did you mean 'about'"),
        ('about = "A granite of mine"', "about = 3", r"mine.toml: about = 3 is not allowed, it must be a text"),
        ('type = "elastic"', f'type = "{PRINTED}"', r"mine.toml: rock.type = '.*' is not allowed: a rock of a rock"),
        ('type = "cohesive-crack"', "", r"mine.toml: law.type is missing: the name of the law that has these"),
        ('"mica/*" = {tensile_strength = "4 MPa", mode_i_energy = 10}', "x = 3", r"laws\.x = 3 is not allowed"),
        ('"70 GPa"', '"70 MP"', r"rock.youngs_modulus"),
        ('tensile_strength = "9 MPa"', "tensile_strenght = 9e6", r"law.tensile_strenght"),
    ],
)  # fmt: skip
def test_a_rock_of_a_file_is_refused_with_its_place(own, old, new, words):
    Path(own).write_text(OWN.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(gl.ParameterError, match=words):
        gl.rocks[own].specimen(rectangle(0.02, 0.04))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"rock": {"cite": "You 2025"}}, r"rock\.cite = 'You 2025' is not allowed, it must be a list of texts"),
        ({"rock": {"cite": 3}}, r"rock\.cite = 3 is not allowed, it must be a list of texts"),
        ({"rocks": {"mica": "elastic"}}, r"rocks\.mica = 'elastic' is not allowed, it must be a table of parameters"),
        ({"laws": {"mica/*": 3}}, r"laws\.mica/\* = 3 is not allowed, it must be a table of parameters"),
    ],
)
def test_what_is_wrong_beside_a_rock_is_refused_as_without_one(own, given, words):
    with pytest.raises(gl.ParameterError, match=words):
        configured(UCS, {**given, "rock": {"type": own, **given.get("rock", {})}})


def test_a_file_is_read_again_when_it_has_changed(own):
    assert gl.rocks[own].material[...].youngs_modulus == 70e9
    Path(own).write_text(OWN.replace('"70 GPa"', '"71 GPa"'), encoding="utf-8")
    assert gl.rocks[own].material[...].youngs_modulus == 71e9


def test_a_rock_that_does_not_exist_is_refused():
    with pytest.raises(
        gl.ParameterError, match="there is no rock 'lac-du-bonet'; did you mean 'lac-du-bonnet-granite'"
    ):
        gl.rocks["lac-du-bonet"]
    with pytest.raises(gl.ParameterError, match=r"none\.toml cannot be read"):
        gl.rocks["none.toml"]


@pytest.mark.thorough
def test_a_run_prints_and_writes_what_to_cite(own, tmp_path):
    out = tmp_path / "out"
    arguments = ["test", UCS, "--rock", own, "--grains", "8", "--set", "test.maximum_strain=1e-5", "--out", str(out)]
    said = invoke(*arguments)
    assert said.exit_code == 0, said.output
    assert "to cite: Me 2026\n" in said.output
    assert json.loads((out / "run.json").read_text("utf-8"))["cite"] == ["Me 2026"]
    assert "Me 2026" in (out / "report.html").read_text("utf-8")
    assert 'cite = ["Me 2026"]' in (out / "config.toml").read_text("utf-8")


@pytest.mark.thorough
def test_a_comparison_and_a_study_print_what_to_cite_once(own, tmp_path):
    """A study of two rocks prints the works of both."""
    few = ["--grains", "8", "--seeds", "1,2", "--laws", "linear", "--max-strain", "1e-5"]
    (tmp_path / "c.toml").write_text(f"[rock]\ntype = '{own}'\n", encoding="utf-8")
    said = invoke("compare", "--config", str(tmp_path / "c.toml"), *few, "--out", str(tmp_path / "c"))
    assert said.exit_code == 0, said.output
    assert said.output.count("to cite: Me 2026\n") == 1
    text = f"[sample]\ngrains = 8\n[test]\ntype = '{UCS}'\nmaximum_strain = 1e-5\nsamples = 10\n"
    text += f"[vary]\nrock = ['{own}', 'palabora-carbonatite-printed']\n'sample.seed' = '1..2'\n"
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    said = invoke("study", str(tmp_path / "s.toml"), "--workers", "1")
    assert said.exit_code == 0, said.output
    cited = [line for line in said.output.splitlines() if line.startswith("to cite: ")]
    assert cited == [f"to cite: {work}" for work in ("Me 2026", *gl.rocks["palabora-carbonatite-printed"].cite)]


def test_the_page_of_rocks_lists_them_all():
    page = (Path(__file__).parents[1] / "docs" / "rocks.md").read_text("utf-8")
    assert [f"| `{name}` | {rock.about} |" for name, rock in gl.rocks.items()] == re.findall(r"\| `.*", page)


@pytest.mark.parametrize("kind", ["mine.py:Mine", None, 5])
def test_a_law_of_a_file_has_nothing_of_the_rock(kind):
    """Nor has one without a name."""
    own = {"kn": 1.0} if kind is None else {"type": kind, "kn": 1.0}
    given = {"law": own, "laws": {"quartz": {"ks": 2.0}}}
    assert _laws({"cohesion": 3.0}, {"mica": {"kn": 4.0}}, given) == given


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("lac-du-bonet-granite", "there is no 'lac-du-bonet-granite'; did you mean 'lac-du-bonnet-granite'?"),
        ("elastik", "did you mean 'elastic'?"),
        ("rock/calibrated.tom", "there is no 'rock/calibrated.tom' (rocks: forsmark-granite,"),
    ],
)
def test_a_rock_that_is_not_there_is_refused_with_those_that_are(kind, words):
    with pytest.raises(gl.ParameterError, match=re.escape(words)) as told:
        configured(UCS, {"rock": {"type": kind}})
    assert "or FILE.toml; materials: elastic, rigid" in str(told.value)
