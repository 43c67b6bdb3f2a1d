"""Configurations of grainlaw test: files, sections, single values and names mean what they say."""

import json
import re
import tomllib
from pathlib import Path

import attrs
import pytest
from command_line import SMALL, invoke

import grainlaw as gl
from grainlaw import laws, protocols
from grainlaw.cli.components import FILL_IN, choices, name_of
from grainlaw.cli.configuration import configured, template
from grainlaw.cli.default_rock import LAWS
from grainlaw.cli.sections import assign, checked_sections, read_tables, toml, value_toml
from grainlaw.cli.setups import SETUPS, _bar
from grainlaw.fields import ParameterError
from grainlaw.geometry import Empirical, Even, Hexagonal, Laguerre, Lognormal, rectangle

DOCS = Path(__file__).parents[1] / "docs"
NEEDED = {
    "biaxial-compression": {"test": {"confinement": "4 MPa"}}, "direct-shear": {"test": {"normal_stress": "1 MPa"}},
    "creep": {"law": {"rate": 1e-6}, "test": {"load": "80 MPa", "duration": 1e6}},
    "cyclic": {"test": {"levels": [0.001, 0.002]}}, "saturated": {"test": {"pressure": "5 MPa"}},
    "heating": {"rock": {"expansion": "quartz"}, "test": {"to": ["100 °C", 20]}},
    "thermal-shock": {
        "rock": {"expansion": 8e-6}, "test": {"hot": "120 °C", "duration": "5 s"},
    },
}  # fmt: skip


def blocks(name):
    """The TOML that a page shows."""
    return re.findall(r"^```toml\n(.*?)^```", (DOCS / name).read_text("utf-8"), re.M | re.S)


QUICK_AND_FULL = [(name, True) for name in SETUPS]
QUICK_AND_FULL += [(name, False) for name, setup in SETUPS.items() if setup.sample != setup.quick]


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "quick"), QUICK_AND_FULL)
def test_what_is_configured_is_configured_again_by_its_own_sections(name, quick):
    coarse = {"columns": 20} if name == "plane-wave" else {"grain_size": 0.012}
    first = configured(name, {**NEEDED.get(name, {}), "sample": {} if quick else coarse}, quick)
    again = configured(name, tomllib.loads(toml(first.sections)))
    assert again.sections == first.sections
    for part in ("law", "protocol", "numerics"):
        assert getattr(again, part) == getattr(first, part)
    assert again.specimen.material == first.specimen.material
    assert (again.specimen.grains.vertices == first.specimen.grains.vertices).all()


def test_toml_by_hand():
    """Comments stand below each other, to the right of the longest line that has one, 40 columns at most."""
    sections = {"law": {"kn": 0.5, "type": "linear", "none": None, "a key": True}, "test": {"part": {"speed": 0.1}}}
    notes = {"law": {"kn": "Pa/m", "type": "one of many", "none": "absent"}}
    assert toml(sections, notes) == (
        '[law]\nkn = 0.5         # Pa/m\ntype = "linear"  # one of many\n# none = ...     # absent\n"a key" = true\n\n'
        "[test]\npart = {speed = 0.1}\n"
    )
    long = toml({"law": {"a": "x" * 50, "b": 1}}, {"law": {"a": "A", "b": "B"}})
    assert long == f'[law]\na = "{"x" * 50}"  # A\nb = 1{" " * 35}  # B\n'


def test_files_that_a_file_names_lie_beside_it():
    given = {"law": {"type": "mine.py:Law"}, "rock": {"type": "elastic"}, "sample": {"file": "in/grains.tess"}}
    assert checked_sections(given, Path("home") / "run.toml") == {
        "law": {"type": str(Path("home") / "mine.py:Law")}, "rock": {"type": "elastic"},
        "sample": {"file": str(Path("home") / "in" / "grains.tess")},
    }  # fmt: skip


def test_a_bar_for_waves_is_of_square_bricks():
    assert _bar(7) == {
        "region": "rectangle", "width": pytest.approx(14e-3), "height": pytest.approx(4e-3), "tessellator": "bricks",
        "rows": 2, "columns": 7,
    }  # fmt: skip


def test_a_template_is_the_configuration_with_units_bounds_and_names_to_choose_from():
    text = template("brazilian", {})
    assert configured("brazilian", tomllib.loads(text)).sections == configured("brazilian", {}).sections
    words = dict(re.findall(r"^(\w+) = .*?  +# (.*)$", text, re.M))
    assert words["tensile_strength"] == "Pa; above 0; f_t"
    assert words["loading"].startswith("one of adaptive, constant;")
    assert words["jaws"] == "one of smooth, rough; whether the disc may slide along the jaws"
    assert set(choices(laws.Softening)) == set(words["softening"].partition(";")[0].removeprefix("one of ").split(", "))
    assert {field.name for field in attrs.fields(laws.CohesiveCrack)} <= set(words)


@pytest.mark.thorough
@pytest.mark.parametrize("name", SETUPS)
def test_a_template_of_every_test_says_what_is_to_be_filled_in(name):
    text, needed = template(name, {}, quick=True), NEEDED.get(name, {})
    for section in ("test", "law", "rock"):
        for key, value in needed.get(section, {}).items():
            with pytest.raises(ParameterError, match=rf"^{section}\.{key}( \(.*\))? is still to be filled in"):
                configured(name, tomllib.loads(text), quick=True)
            hole = f'{key} = "FILL IN"'
            assert len(re.findall(rf"^{hole} .*# \S+", text, re.M)) == 1
            text = text.replace(hole, f"{key} = {value_toml(value)}")
    assert configured(name, tomllib.loads(text)).sections == configured(name, needed, quick=True).sections
    part = text.partition("[test]")[2].partition("[numerics]")[0]
    listed = re.findall(r"^(?:# )?(\w+) = ", part, re.M)
    assert listed == ["type", *(field.name for field in attrs.fields(SETUPS[name].protocol))]


def test_what_a_template_shows_as_a_comment_can_be_given():
    text = sample = template("plane-wave", {}, quick=True)
    for key in ("velocity", "gauges"):
        assert len(re.findall(rf"^# {key} = \.\.\. +# m", text, re.M)) == 1
    text = text.replace("# velocity = ...", 'velocity = "1 m/s"').replace("# gauges = ...", 'gauges = ["20 mm", 0.05]')
    made = configured("plane-wave", tomllib.loads(text)).protocol
    assert made == protocols.PlaneWave(velocity=1.0, gauges=[0.02, 0.05])
    assert tomllib.loads(sample)["test"]["stress"] == [["0 s", "0 Pa"], ["5 us", "-1 MPa"], ["10 us", "0 Pa"]]
    sample = template("uniaxial-compression", {"sample": {"grains": 80}})
    text = sample.replace("grains = 80", "").replace("# grain_size = ...", 'grain_size = "5 mm"')
    assert configured("uniaxial-compression", tomllib.loads(text)).specimen.grains.count == 250  # 50 x 125 mm2


def test_a_template_of_a_law_or_a_rock_that_is_chosen_says_what_is_to_be_filled_in():
    given = {"law": {"type": "friction"}, "rock": {"type": "thermal"}, "laws": {"quartz/*": {"type": "linear"}}}
    text = template("brazilian", given)
    made = tomllib.loads(text)
    assert made["rock"]["material"] == made["rock"]["expansion"] == made["law"]["kn"] == FILL_IN
    assert made["laws"] == given["laws"]
    assert template("brazilian", made) == text
    names = "albite, biotite, microcline, quartz, constant, expansion-table"
    assert re.search(rf"^expansion = .*# 1/K, or one of {names}; ", text, re.M)
    for name in names.split(", ")[:4]:
        filled = {"type": "thermal", "expansion": name, "material": tomllib.loads(template("creep", {}))["rock"]}
        assert configured("uniaxial-tension", {"rock": filled}, quick=True)


@pytest.mark.parametrize("name", LAWS)
def test_every_law_of_the_table_is_a_type(name):
    chosen = configured("joint-tension", {"law": {"type": name}})
    assert chosen.law == LAWS[name]
    assert configured("joint-tension", tomllib.loads(toml(chosen.sections))).law == LAWS[name]


def test_the_example_of_the_configuration_page_means_what_it_says():
    text, *_ = blocks("configuration.md")
    made = configured("uniaxial-compression", tomllib.loads(text))
    law = made.law
    assert isinstance(law, laws.MunjizaJoint)
    assert law.softening == laws.ExponentialSoftening(rate=4)
    assert law.closure == laws.BandisClosure(maximum_closure=5e-6)
    assert law.unloading is laws.Unloading.RETRACED
    assert law.tensile_strength == 13e6
    assert made.protocol.platens is protocols.Platens.ROUGH
    assert made.protocol.loading.ramp == 1e-4
    assert made.protocol.integrator == gl.integration.CentralDifference(
        damping=gl.integration.LocalDamping(fraction=0.7)
    )
    assert made.specimen.contact_points == gl.InsetPoints(inset=2e-4)
    assert made.specimen.material.plane is gl.Plane.STRESS
    region = made.specimen.grains.region
    assert made.specimen.grains.count == Hexagonal(grain_size=0.01).tessellate(region).count
    assert (made.numerics.mass_scaling, made.numerics.frames) == (2, 10)
    assert configured("uniaxial-compression", tomllib.loads(toml(made.sections))).sections == made.sections


@pytest.mark.thorough
def test_the_example_of_getting_started_runs(tmp_path):
    (text,) = blocks("getting-started.md")
    (tmp_path / "granite.toml").write_text(text)
    result = invoke("test", "uniaxial-tension", "--config", tmp_path / "granite.toml", "--quick", *SMALL[1:],
                    "--out", tmp_path / "granite")  # fmt: skip
    assert result.exit_code == 0, result.output
    law = json.loads((tmp_path / "granite" / "run.json").read_text())["configuration"]["law"]
    assert law["softening"]["type"] == "hordijk"
    assert law["tensile_strength"] == "10 MPa"


def test_parts_are_set_one_by_one():
    sections = {"law": {"closure": "bandis"}}
    for text in ('law.closure.maximum_closure="5 um"', "law.softening = {type = \"exponential\", rate = 3}",
                 "law.pre_peak=linear", "test.loading={type='constant', speed='20 mm/s'}",
                 "law.softening.rate=4"):  # fmt: skip
        assign(sections, text)
    made = configured("joint-tension", sections)
    assert made.law.closure == laws.BandisClosure(maximum_closure=5e-6)
    assert made.law.softening == laws.ExponentialSoftening(rate=4)
    assert made.law.pre_peak is laws.PrePeak.LINEAR
    assert made.protocol.loading.speed == 0.02
    heats = NEEDED["heating"]["test"] | {"loading": {"type": "heating-rate", "rate": "50 K/s"}}
    made = configured("heating", NEEDED["heating"] | {"test": heats}, quick=True)
    assert made.protocol.loading == gl.HeatingRate(rate=50.0)
    assert made.sections["test"]["loading"] == {"type": "heating-rate", "rate": "50 K/s"}


def test_names_are_those_of_the_classes():
    assert name_of(laws.HordijkSoftening, laws.Softening) == "hordijk"
    assert name_of(laws.EvansMarathe, laws.Softening) == "evans-marathe"
    assert name_of(type("VeryLongSoftening", (), {}), laws.Softening) == "very-long"
    assert name_of(type("SofteningLaw", (), {}), laws.Softening) == "softening-law"
    assert name_of(laws.Softening, laws.Softening) == "softening"
    assert {"linear", "bandis"} == set(choices(laws.Closure))
    assert choices(gl.integration.Relaxation) == {
        "adaptive": gl.integration.AdaptiveRelaxation,
        "kinetic": gl.integration.KineticRelaxation,
    }
    for name in ("hordijk", "HordijkSoftening", "hordijk-softening", "Hordijk_Softening"):
        assert configured("joint-tension", {"law": {"softening": name}}).law.softening == laws.HordijkSoftening()


def test_setups_are_of_public_protocols():
    public = [getattr(protocols, name) for name in protocols.__all__]
    known = {setup.protocol for setup in SETUPS.values()}
    tests = {c for c in public if isinstance(c, type) and issubclass(c, gl.LoadingProtocol)}
    assert known == tests - {protocols.FreeMotion}  # whose bodies are put together in Python


def test_the_page_lists_every_test():
    page = (DOCS / "configuration.md").read_text("utf-8")
    listed = set(re.findall(r"`([\w-]+)`", " ".join(re.findall(r"^\| (`[^|]*) \|", page.split("## Tests")[1], re.M))))
    assert set(SETUPS) <= listed


def test_a_part_of_ones_own_is_known_by_its_name(tmp_path):
    text = "import attrs\nfrom grainlaw import parameter\nfrom grainlaw.laws import *\n"
    text += "@attrs.frozen(kw_only=True)\nclass StiffClosure(LinearClosure.__base__):\n"
    text += "    times: float = parameter('1', default=2)\n"
    text += "    def pressure(self, kn, closure): return self.times * kn * closure\n"
    text += "    def tangent(self, kn, closure): return self.times * kn\n"
    text += "law = CohesiveCrack(kn=1e14, ks=9e13, tensile_strength=5e6, cohesion=2e7, friction_angle=30, "
    text += "residual_friction_angle=5, mode_i_energy=20, mode_ii_energy=40, closure=StiffClosure())\n"
    (tmp_path / "mine.py").write_text(text)
    given = {"type": f"{tmp_path / 'mine.py'}:law", "closure": {"type": "stiff", "times": 3}}
    made = configured("joint-tension", {"law": given})
    assert made.law.closure.times == 3
    assert made.sections["law"]["closure"] == {"type": "stiff", "times": 3.0}


@pytest.mark.parametrize(
    ("sample", "grains"),
    [
        ({"grains": 60, "sizes": {"type": "lognormal", "deviation": 0.4}},
         Laguerre(grains=60, sizes=Lognormal(deviation=0.4))),
        ({"grain_size": "4 mm", "sizes": "even", "relaxation": 2},
         Laguerre(grain_size=4e-3, sizes=Even(), relaxation=2)),
        ({"sizes": {"type": "empirical", "diameters": ["1 mm", 2e-3], "weights": [3, 1]}},
         Laguerre(grains=120, sizes=Empirical(diameters=[1e-3, 2e-3], weights=[3, 1]))),
        ({"areas": ["2 cm2", 8e-4]}, Laguerre(areas=[2e-4, 8e-4])),
    ],
)  # fmt: skip
def test_sizes_of_grains_are_configured(sample, grains):
    made = configured("uniaxial-compression", {"sample": {"tessellator": "laguerre", **sample}}, True)
    assert (made.specimen.grains.vertices == grains.tessellate(rectangle(0.02, 0.05)).vertices).all()
    again = configured("uniaxial-compression", tomllib.loads(toml(made.sections)))
    assert (again.specimen.grains.vertices == made.specimen.grains.vertices).all()


def test_own_points_are_configured():
    sample = {"tessellator": "voronoi", "points": [[0.01, 0.02], [0.005, 0.03], [0.015, 0.01]]}
    made = configured("uniaxial-compression", {"sample": sample}, True)
    assert made.specimen.grains.count == 3
    assert tomllib.loads(toml(made.sections))["sample"]["points"] == sample["points"]


def test_wrong_sizes_are_refused():
    for sizes, message in (
        ("lognormal", r"sizes\.deviation \(1\) is missing"),
        ("normal", "no 'normal'"),
        (3, "name or a table"),
    ):
        with pytest.raises(ParameterError, match=message):
            configured("uniaxial-compression", {"sample": {"tessellator": "laguerre", "sizes": sizes}}, True)


HOSTILE = {
    "deep": ("a = " + "[" * 5000 + "]" * 5000, "is no TOML that can be read: it is nested too deep"),
    "digits": ("[sample]\nseed = " + "9" * 300_000, "is no TOML that can be read"),
    "large": ("[rock]\ndensity = 1" + "0" * 400, "rock.density = 1000.* is not allowed, it is too large"),
    "bytes": ("\udcff", "is no TOML that can be read"),
}


def test_a_file_with_the_mark_and_the_lines_of_windows_is_read(tmp_path):
    (tmp_path / "x.toml").write_bytes(b"\xef\xbb\xbf[sample]\r\ngrains = 20\r\n")
    assert read_tables(tmp_path / "x.toml") == {"sample": {"grains": 20}}


@pytest.mark.parametrize("name", HOSTILE)
def test_a_file_that_no_one_should_have_to_read_is_refused_in_a_line(name, tmp_path):
    text, words = HOSTILE[name]
    (tmp_path / "x.toml").write_text(text, encoding="utf-8", errors="surrogateescape")
    for command in (("test", "uniaxial-compression", "--quick", "--config"), ("study", "run"), ("calibrate",)):
        result = invoke(*command, tmp_path / "x.toml")
        assert (result.exit_code, "fault of grainlaw" in result.output) == (2, False)
        if command[0] == "test":
            assert re.search(words, " ".join(result.output.split()))


@pytest.mark.parametrize(
    "wrong", ["rock.density=[3100,3100]", "numerics.time_step_factor=[1]", "numerics.mass_scaling=[1,2]"]
)
def test_what_is_refused_is_refused_before_the_folder_is_made(wrong, tmp_path):
    folder = tmp_path / "out"
    for command in (("test", "uniaxial-compression"), ("compare", "--laws", "linear")):
        result = invoke(*command, "--quick", "--set", wrong, "--out", folder)
        assert (result.exit_code, folder.exists()) == (2, False)
        assert "is not allowed" in " ".join(result.output.split())


def test_a_template_refuses_a_wrong_key_of_laws_beside():
    with pytest.raises(gl.ParameterError, match=r"there is no 'laws.q/f.tensile_strngth'; did you mean 'tensile_str"):
        template("uniaxial-compression", {"laws": {"q/f": {"tensile_strngth": "3 MPa"}}})
    assert "tensile_strength" in template("uniaxial-compression", {"laws": {"q/f": {"tensile_strength": "3 MPa"}}})
