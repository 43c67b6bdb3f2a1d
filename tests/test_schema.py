"""The JSON schema of configurations: what the command writes fits it, and what the command refuses does not."""

import json
import re
import tomllib

import jsonschema
import pytest
from command_line import invoke
from doc_checks import PAGES, ROOT
from jsonschema.exceptions import best_match
from test_words_and_units import NEEDED

from grainlaw.cli.configuration import template
from grainlaw.cli.default_rock import LAWS
from grainlaw.cli.schema import quantity_schema, schema_of
from grainlaw.cli.setups import SETUPS
from grainlaw.unit_text import USUAL, spellings

WHOLE = schema_of()


def faults(found, schema=WHOLE):
    """Where a file does not fit a schema, and why."""
    errors = jsonschema.Draft202012Validator(schema).iter_errors(found)
    return [f"{error.json_path}: {best_match([error]).message[:200]}" for error in errors]


@pytest.mark.parametrize("schema", [WHOLE, schema_of("brazilian")], ids=["of all tests", "of one"])
def test_it_is_a_schema(schema):
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == jsonschema.Draft202012Validator.META_SCHEMA["$id"]


def template_of(name, **more):
    needed = {section: dict(given) for section, given in NEEDED.get(name, {}).items()}
    for section, given in more.items():
        needed.setdefault(section, {}).update(given)
    return re.sub(r'^(\w+) = "FILL IN".*\n', "", template(name, needed), flags=re.M)


@pytest.mark.thorough
@pytest.mark.parametrize("name", SETUPS)
def test_the_template_of_a_test_fits_its_schema_and_that_of_all(name):
    """With every parameter, also those that stand there as comments, in the form in which they are shown."""
    found = tomllib.loads(template_of(name))
    own = schema_of(name)
    assert faults(found, own) == faults(found) == []
    others = [other for other in SETUPS if other != name]
    assert all(faults({"test": {"type": other}}, own) for other in others)


@pytest.mark.parametrize("law", LAWS)
def test_templates_of_laws_fit(law):
    assert faults(tomllib.loads(template_of("uniaxial-compression", law={"type": law}))) == []


MADE = [
    *(("uniaxial-compression", {"rock": {"type": rock}}) for rock in (
        "rigid", "transversely-isotropic", "drucker-prager", "mohr-coulomb-plastic", "thermal")),
    *(("uniaxial-compression", {"sample": {"tessellator": kind}}) for kind in ("hexagonal", "laguerre", "bricks")),
    ("uniaxial-compression", {"law": {"type": "munjiza"}}),
    ("uniaxial-compression", {"test": {"gauges": "clip", "loading": {"type": "constant", "speed": "20 mm/s"}}}),
]  # fmt: skip


@pytest.mark.parametrize(("name", "more"), MADE)
def test_templates_with_other_components_fit(name, more):
    assert faults(tomllib.loads(template_of(name, **more))) == []


#: shipped files of TOML that are no configurations: settings of ruff, and what the command line takes without one
OTHERS = ("ruff.toml", "default_rock.toml")
FILES = [
    file for folder in ("framework", "docs") for file in (ROOT / folder).rglob("*.toml") if file.name not in OTHERS
]
BLOCKS = [
    (name, block) for name, text in PAGES.items() for block in re.findall(r"^```toml\n(.*?)^```", text, re.M | re.S)
]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.relative_to(ROOT).as_posix())
def test_shipped_files_fit(file):
    assert faults(tomllib.loads(file.read_text("utf-8"))) == []


def test_shipped_files_and_those_of_the_documents_are_found():
    assert len(FILES) >= 10
    assert len({name for name, _ in BLOCKS}) >= 5


@pytest.mark.parametrize(("name", "block"), BLOCKS)
def test_files_of_the_documents_fit(name, block):
    found = tomllib.loads(block)
    assert faults({key: each for key, each in found.items() if key in WHOLE["properties"]}) == []


@pytest.mark.parametrize(
    "wrong",
    [
        {"tests": {}}, {"cite": "A 2000"}, {"test": {"type": "uniaxial"}},
        {"law": {"type": "mohr-coulomb", "cohesian": "29 MPa"}},
        {"law": {"type": "mohr-coulomb", "cohesion": "29 mm"}}, {"law": {"type": "mohr-coulomb", "cohesion": -1}},
        {"law": {"type": "mohr-coulomb", "friction_angle": 90}}, {"rock": {"type": "granit"}},
        {"law": {"type": "mohr-coulomb", "cohesion": True}}, {"law": {"cohesion": "29 MPA"}},
        {"test": {"type": "uniaxial-compression", "samples": 9}},
        {"test": {"type": "uniaxial-compression", "platens": "wet"}},
        {"test": {"type": "uniaxial-compression", "loading": {"type": "constant", "speed": "20 mm"}}},
        {"test": {"type": "uniaxial-compression", "loading": "constantly"}},
        {"test": {"type": "plane-wave", "stress": [["0 s", "1 mm"]]}},
        {"test": {"type": "uniaxial-compression", "loading": "heating-rate"}},
        {"sample": {"tessellator": "voronoy"}}, {"sample": {"region": "disk"}}, {"sample": {"grainz": 3}},
        {"numerics": {"refinement": -1}}, {"numerics": {"time_step_factor": 2}}, {"numerics": {"zones": "yes"}},
        {"numerics": {"threads": 0}}, {"numerics": {"threads": "12"}}, {"numerics": {"threads": "all"}},
        {"sample": {"width": "50 MPa"}}, {"rock": {"type": "elastic", "youngs_modulus": "60 GPa/"}},
    ],
)  # fmt: skip
def test_what_is_refused_does_not_fit(wrong):
    assert faults(wrong)


def test_every_parameter_says_what_it_is():
    cohesion = next(
        each["properties"]["cohesion"]
        for each in WHOLE["$defs"]["law"]["anyOf"]
        if "mohr-coulomb" in each["properties"]["type"].get("enum", ())
    )
    assert cohesion["description"].startswith("Pa; at least 0")
    assert cohesion["anyOf"][0] == {"type": "number", "minimum": 0}


@pytest.mark.parametrize("unit", USUAL)
def test_usual_texts_fit_their_unit(unit):
    _, text = quantity_schema(unit, None)
    assert re.search(text["pattern"], USUAL[unit])
    assert re.search(text["pattern"], "13.5e-3")
    assert not re.search(text["pattern"], "13,5")
    assert "MPa" in spellings("Pa")
    assert "mm" not in spellings("Pa")
    assert {"min", "h", "day", "year", "ms"} <= set(spellings("s"))


@pytest.mark.thorough
def test_the_command_prints_it_and_suggests():
    assert json.loads(invoke("schema").output) == WHOLE
    assert json.loads(invoke("schema", "brazilian").output)["title"] == "grainlaw test brazilian"
    done = invoke("schema", "brasilian")
    assert done.exit_code == 2
    assert "there is no test 'brasilian'; did you mean 'brazilian'?" in done.output
    done = invoke("tset")
    assert done.exit_code == 2
    assert "there is no command 'tset'; did you mean 'test'? (commands: cache, calibrate, " in done.output
    assert "there is no command 'xyzzy' (commands: " in invoke("xyzzy").output
