"""The JSON schema of configurations: what the command writes fits it, and what the command refuses does not."""

import json
import re
import tomllib

import pytest
from command_line import invoke
from doc_checks import PAGES, ROOT
from test_words_and_units import NEEDED

from grainlaw.cli.configuration import template
from grainlaw.cli.default_rock import LAWS
from grainlaw.cli.schema import quantity_schema, schema_of
from grainlaw.cli.setups import SETUPS
from grainlaw.unit_text import USUAL, spellings

WHOLE = schema_of()
KINDS = {"object": dict, "array": list, "string": str, "integer": int, "number": (int, float), "boolean": bool}
KNOWN = {
    "$schema", "title", "description", "$defs", "$ref", "type", "enum", "pattern", "anyOf", "properties", "required",
    "additionalProperties", "items", "prefixItems", "minimum", "maximum", "exclusiveMinimum", "exclusiveMaximum",
}  # fmt: skip
LIMITS = {
    "minimum": float.__ge__, "maximum": float.__le__,
    "exclusiveMinimum": float.__gt__, "exclusiveMaximum": float.__lt__,
}  # fmt: skip


def fits(value, schema, root):
    """Whether a value fits a schema, by the meaning of the keywords that are used here."""
    if "$ref" in schema:
        schema = root["$defs"][schema["$ref"].removeprefix("#/$defs/").replace("%20", " ")]
    assert set(schema) <= KNOWN
    kind = schema.get("type")
    if kind and (not isinstance(value, KINDS[kind]) or (isinstance(value, bool) and kind != "boolean")):
        return False
    if "enum" in schema and value not in schema["enum"]:
        return False
    if "pattern" in schema and not (isinstance(value, str) and re.search(schema["pattern"], value)):
        return False
    number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if number and not all(rule(float(value), float(schema[key])) for key, rule in LIMITS.items() if key in schema):
        return False
    if "anyOf" in schema and not any(fits(value, each, root) for each in schema["anyOf"]):
        return False
    if isinstance(value, list):
        each = [*schema.get("prefixItems", [])][: len(value)]
        each += [schema.get("items", {})] * (len(value) - len(each))
        return all(map(fits, value, each, [root] * len(value)))
    if isinstance(value, dict):
        own, rest = schema.get("properties", {}), schema.get("additionalProperties", {})
        if not set(schema.get("required", ())) <= set(value) or (rest is False and set(value) - set(own)):
            return False
        return all(fits(each, own.get(key, rest or {}), root) for key, each in value.items())
    return True


def check(found, schema=WHOLE):
    """That all of a file fits; its keys are tried one by one, so that a failure names the one at fault."""
    for section, table in found.items():
        for key, value in table.items() if isinstance(table, dict) else ():
            alone = {"type": table["type"], key: value} if "type" in table else {key: value}
            if not fits({section: alone}, schema, schema):
                pytest.fail(f"{section}.{key} = {value}", pytrace=False)
    if not fits(found, schema, schema):
        pytest.fail("the whole", pytrace=False)


def template_of(name, **more):
    needed = {section: dict(given) for section, given in NEEDED.get(name, {}).items()}
    for section, given in more.items():
        needed.setdefault(section, {}).update(given)
    return re.sub(r'^(\w+) = "FILL IN".*\n', "", template(name, needed), flags=re.M)


@pytest.mark.parametrize("name", SETUPS)
def test_the_template_of_a_test_fits_its_schema_and_that_of_all(name):
    """With every parameter, also those that stand there as comments, in the form in which they are shown."""
    found = tomllib.loads(template_of(name))
    own = schema_of(name)
    for section, table in found.items():
        for key, value in table.items():  # one by one, so that a failure names it
            assert fits(
                {section: {"type": table["type"], key: value} if "type" in table else {key: value}}, own, own
            ), key
    check(found, own)
    check(found)
    others = [other for other in SETUPS if other != name]
    assert not any(fits({"test": {"type": other}}, own, own) for other in others)


@pytest.mark.parametrize("law", LAWS)
def test_templates_of_laws_fit(law):
    check(tomllib.loads(template_of("uniaxial-compression", law={"type": law})))


MADE = [
    *(("uniaxial-compression", {"rock": {"type": rock}}) for rock in (
        "rigid", "transversely-isotropic", "drucker-prager", "mohr-coulomb-plastic", "thermal")),
    *(("uniaxial-compression", {"sample": {"tessellator": kind}}) for kind in ("hexagonal", "laguerre", "bricks")),
    ("uniaxial-compression", {"law": {"type": "munjiza"}}),
    ("uniaxial-compression", {"test": {"gauges": "clip", "loading": {"type": "constant", "speed": "20 mm/s"}}}),
]  # fmt: skip


@pytest.mark.parametrize(("name", "more"), MADE)
def test_templates_with_other_components_fit(name, more):
    check(tomllib.loads(template_of(name, **more)))


FILES = [*(ROOT / "framework/cli/rocks").glob("*.toml"), *(ROOT / "docs/examples/rocks").glob("*.toml")]
BLOCKS = [
    (name, block)
    for name in ("docs/configuration.md", "docs/textures.md", "docs/temperature.md", "docs/studies.md", "docs/water.md")
    for block in re.findall(r"^```toml\n(.*?)^```", PAGES[name], re.M | re.S)
]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_rocks_fit(file):
    sections = {
        key: each for key, each in tomllib.loads(file.read_text("utf-8")).items() if key not in ("about", "cite")
    }
    assert fits(sections, WHOLE, WHOLE)


@pytest.mark.parametrize(("name", "block"), BLOCKS)
def test_files_of_the_documents_fit(name, block):
    found = tomllib.loads(block)
    check({key: each for key, each in found.items() if key in WHOLE["properties"]})


@pytest.mark.parametrize(
    "wrong",
    [
        {"tests": {}}, {"test": {"type": "uniaxial"}}, {"law": {"type": "mohr-coulomb", "cohesian": "29 MPa"}},
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
        {"sample": {"width": "50 MPa"}}, {"rock": {"type": "elastic", "youngs_modulus": "60 GPa/"}},
    ],
)  # fmt: skip
def test_what_is_refused_does_not_fit(wrong):
    if fits(wrong, WHOLE, WHOLE):
        pytest.fail(f"{wrong} fits", pytrace=False)


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
