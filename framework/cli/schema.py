"""The command that prints the JSON schema of configurations, by which editors complete and check TOML files."""

from __future__ import annotations

import enum
import inspect
import json
import math
import re
from collections.abc import Iterable, Mapping
from typing import Any

import attrs
import click

from grainlaw.cli import running
from grainlaw.cli.components import as_written, choices, explained, instances, interface_of, kinds_of, name_of
from grainlaw.cli.configuration import Numerics
from grainlaw.cli.default_rock import LAWS, NAMES
from grainlaw.cli.minerals import KEYS
from grainlaw.cli.sample import OF_SPECIMEN, REGIONS, region_units, tessellators
from grainlaw.cli.sections import SECTIONS
from grainlaw.cli.setups import SETUPS
from grainlaw.contact import ContactLaw
from grainlaw.engine.thread_count import AUTO
from grainlaw.fields import WITHOUT, Bounds, ParameterError
from grainlaw.geometry import from_labels, from_mesh, read_tess
from grainlaw.material import Material, Rigid
from grainlaw.messages import nearest, short
from grainlaw.protocol import LoadingProtocol
from grainlaw.specimen import ContactPoints
from grainlaw.unit_text import spellings

Schema = dict[str, Any]
VERSION = "https://json-schema.org/draft/2020-12/schema"
NUMBER = r"^\s*[+-]?((\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|inf)"
SYMBOL, POWER = r"([A-Za-zµμ%°]+|1)", r"(\^?[+-]?\d|[²³])"
#: units of several symbols, or with powers: whether they are of the right dimension is left to the command
COMPOUND = rf"{SYMBOL}{POWER}?((\s*[*/·]\s*|\s+){SYMBOL}{POWER}?)+|{SYMBOL}{POWER}"
PLAIN = {bool: "boolean", str: "string", float: "number"}
FILE = {"type": "string", "pattern": r"\.(py(:.*)?|toml)$"}
WORKS = {"type": "array", "items": {"type": "string"}, "description": "works to cite, a text each"}
ABOUT = {"type": "string", "description": "of the file of a rock alone: which rock, in one sentence"}


@click.command(
    help=f"""Print the JSON schema of a TOML file, by which an editor completes and checks it.

NAME is one of {", ".join(SETUPS)}; without it the schema is of the files of all tests, of studies and of rocks. It
knows names, units and bounds; what is missing is told when the file is read."""
)
@click.argument("name", metavar="[NAME]", required=False, shell_complete=running.completed(SETUPS, or_file=False))
def schema(*, name: str | None) -> None:
    with running.refusing():
        click.echo(json.dumps(schema_of(name), indent=1, ensure_ascii=False))


def schema_of(name: str | None = None) -> Schema:
    """Of the file of one test, or of all. Raises :class:`~grainlaw.fields.ParameterError` for another name."""
    if name is not None and name not in SETUPS:
        raise ParameterError(f"there is no test {short(name)}{nearest(name, SETUPS)} (tests: {', '.join(SETUPS)})")
    made = _Made()
    tests = {name: SETUPS[name].protocol} if name else {each: setup.protocol for each, setup in SETUPS.items()}
    laws = {name_: type(law) for name_, law in LAWS.items()} | choices(ContactLaw)
    law = made.by_name(ContactLaw, laws, FILE)
    rocks = {**choices(Material), **choices(Rigid)}
    rock = made.by_name(Material, rocks, {"anyOf": [FILE, {"enum": list(NAMES)}]}, cite=WORKS)
    made.definitions |= {"rock": rock, "law": law}
    rock, law, table = {"$ref": "#/$defs/rock"}, {"$ref": "#/$defs/law"}, {"type": "object"}
    sections = {
        "sample": made.sample(),
        "rock": rock,
        "rocks": {**table, "additionalProperties": {"anyOf": [rock, {"type": "string"}]}},
        "law": law,
        "laws": {**table, "additionalProperties": {"anyOf": [law, {"type": "string"}]}},
        "test": made.by_name(LoadingProtocol, tests, None),
        "numerics": made.table(Numerics, {}),
    }
    vary = {**table, "description": 'a study: levels of keys, as "sample.seed" = "1..20"'}
    of_rocks = {} if name else {"about": ABOUT, "cite": WORKS}
    return {
        "$schema": VERSION,
        "title": f"grainlaw test {name}" if name else "grainlaw",
        "type": "object",
        "properties": {**{section: sections[section] for section in SECTIONS}, "vary": vary, **of_rocks},
        "additionalProperties": False,
        "$defs": made.definitions,
    }


@attrs.define
class _Made:
    """Schemas of components, each once."""

    definitions: dict[str, Schema] = attrs.field(factory=dict)

    def by_name(self, kind: type, known: Mapping[str, type], other: Schema | None, **more: Schema) -> Schema:
        """A section that is a component of a kind: of one of the known types, or of none or another one."""
        classes: dict[type, list[str]] = {}
        for name, cls in known.items():
            classes.setdefault(cls, []).append(name)
        tables = [
            self.table(cls, {"type": {"enum": _names(cls, kind, names)}, **more}) for cls, names in classes.items()
        ]
        if other is not None:
            tables.append({"type": "object", "properties": {"type": other}, "required": ["type"]})
        return {"anyOf": tables} if len(tables) > 1 else tables[0]

    def table(self, cls: type, more: Mapping[str, Schema]) -> Schema:
        """The parameters of a class, and more keys."""
        properties = {**more, **self.fields(cls)}
        return {"type": "object", "properties": properties, "additionalProperties": False}

    def fields(self, cls: type) -> dict[str, Schema]:
        """The schema of each parameter of a class."""
        words, kinds = explained(cls), kinds_of(cls)
        return {
            field.name: {"description": words.get(field.alias, ""), **self.value(field, kinds.get(field.name, ()), cls)}
            for field in attrs.fields(cls)
            if field.init
        }

    def value(self, field: attrs.Attribute, kinds: tuple[type, ...], cls: type) -> Schema:
        """What :func:`grainlaw.cli.components.component` takes of a parameter."""
        one = self.single(field, kinds)
        several = str(field.type).startswith(("tuple", "Sequence", "collections.abc.Sequence"))
        if not one or not (several or getattr(cls, "takes_arrays", False) or field.metadata.get("varies")):
            return _any_of(one)
        if field.metadata.get("varies"):
            point = [{"anyOf": quantity_schema("s", None)}, {"anyOf": quantity_schema(field.metadata["unit"], None)}]
            return _any_of([*one, {"type": "array", "items": {"type": "array", "prefixItems": point}}])
        if "unit" in field.metadata:  # also lists of lists
            return _any_of([*one, {"type": "array"}])
        return _any_of([*one, {"type": "array", "items": _any_of(one)}])

    def single(self, field: attrs.Attribute, kinds: tuple[type, ...]) -> list[Schema]:
        """The same of one value; none where it may be anything."""
        options: list[Schema] = []
        interface = interface_of(kinds)
        if "unit" in field.metadata:
            options += quantity_schema(field.metadata["unit"], field.metadata.get("bounds"))
        if interface is not None:
            options.append(self.component(interface, field.metadata.get(WITHOUT)))
        if of_threads := "Threads" in str(field.type):
            options.append({"enum": [AUTO]})
        for kind in kinds if not options or of_threads else ():
            if issubclass(kind, enum.Enum):
                options.append(_either(map(as_written, kind.__members__)))
            elif kind is int:
                whole = {"minimum": field.metadata.get("at_least"), "maximum": field.metadata.get("at_most")}
                bounds = {key: bound for key, bound in whole.items() if bound is not None}
                options += [{"type": "integer", **bounds}]
                options += [] if of_threads else [{"type": "string", "pattern": r"^[+-]?\d+$"}]
            elif kind in PLAIN:
                options.append({"type": PLAIN[kind]})
            elif kind is not type(None):
                return []
        return options

    def component(self, kind: type, without: type | None = None) -> Schema:
        """A name, or a table with a type and parameters."""
        key = kind.__name__ if without is None else f"{kind.__name__} but {without.__name__}"
        if key not in self.definitions:
            self.definitions[key] = {}  # a part may have parts of its own kind
            known = {name: cls for name, cls in choices(kind).items() if cls is not without}
            names = [name for own, cls in known.items() for name in _names(cls, kind, [own])]
            tables = [self.table(cls, {"type": {"enum": _names(cls, kind, [own])}}) for own, cls in known.items()]
            self.definitions[key] = {"anyOf": [{"enum": [*names, *instances(kind)]}, *tables]}
            if kind in (ContactLaw, Material):
                self.definitions[key]["anyOf"].append(FILE)
        return {"$ref": f"#/$defs/{key.replace(' ', '%20')}"}

    def sample(self) -> Schema:
        """The section [sample]: keys of all regions, tessellators and readers of files."""
        regions = _either(REGIONS)
        properties: dict[str, list[Schema]] = {"region": [regions, {"type": "object"}]}
        for shape in REGIONS.values():
            for name, unit in region_units(shape).items():
                properties.setdefault(name, []).extend(quantity_schema(unit, None) if unit else [{}])
        names = tessellators()
        properties["tessellator"] = [_either(names)]
        for cls in names.values():
            for name, each in self.fields(cls).items():
                properties.setdefault(name, []).append(each)
        readers = (from_labels, from_mesh, read_tess)
        files = (name for reader in readers for name in inspect.signature(reader).parameters)
        for name in (*KEYS, *OF_SPECIMEN, "sizes"):
            properties.setdefault(name, []).append({})
        for name in ("seed", *files):
            properties.setdefault(name, [{}])
        properties["contact_points"] = [self.component(ContactPoints)]
        return {
            "type": "object",
            "properties": {name: _any_of(each) for name, each in properties.items()},
            "additionalProperties": False,
        }


def _names(cls: type, kind: type, known: Iterable[str]) -> list[str]:
    """The names by which a class may be called."""
    return list(dict.fromkeys([*known, name_of(cls, kind), name_of(cls), cls.__name__.lower()]))


def _either(names: Iterable[str]) -> Schema:
    """One of these names, or the same with "_" for "-"."""
    known = [*names]
    return {"enum": list(dict.fromkeys([*known, *(name.replace("-", "_") for name in known)]))}


def _any_of(options: list[Schema]) -> Schema:
    """One of several schemas, each once; what may be anything, or has none, has no other."""
    if not options:
        return {}
    different = [each for k, each in enumerate(options) if each not in options[:k]]
    if any(not set(each) - {"description"} for each in different):
        return next((each for each in different if "description" in each and len(each) == 1), {})
    return different[0] if len(different) == 1 else {"anyOf": different}


def quantity_schema(unit: str, bounds: Any) -> list[Schema]:
    """A number with its bounds, or a text with a unit of the right dimension."""
    number: Schema = {"type": "number"}
    if isinstance(bounds, Bounds):
        limits = {
            "minimum": bounds.at_least, "exclusiveMinimum": bounds.above, "maximum": bounds.at_most,
            "exclusiveMaximum": bounds.below,
        }  # fmt: skip
        number |= {name: limit for name, limit in limits.items() if limit is not None and math.isfinite(limit)}
    simple = "|".join(map(re.escape, spellings(unit)))
    return [number, {"type": "string", "pattern": rf"{NUMBER}\s*({simple}{'|' if simple else ''}{COMPOUND})?\s*$"}]
