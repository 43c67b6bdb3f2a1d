"""The sections of a configuration as text: read from TOML, set one by one, written."""

from __future__ import annotations

import json
import math
import os
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from grainlaw.fields import ParameterError
from grainlaw.messages import nearest, refusal, short
from grainlaw.unit_text import NUMBER

Sections = dict[str, dict[str, Any]]
WIDEST = 40  #: columns before a comment that stands in line with others
SECTIONS = ("sample", "rock", "rocks", "law", "laws", "test", "numerics")


def read_file(file: Path) -> Sections:
    """The sections of a TOML file, in which files of laws, materials and grains are relative to the TOML file.

    Raises :class:`ParameterError` for what is no section, and for a file that cannot be read.
    """
    return checked_sections(read_tables(file), file)


def read_tables(file: Path) -> dict[str, Any]:
    """What a TOML file holds. Raises :class:`ParameterError` for a file that cannot be read."""
    try:
        return tomllib.loads(file.read_text(encoding="utf-8-sig"))  # editors of Windows begin with a mark
    except OSError as error:
        raise ParameterError(f"{file} cannot be read: {error.strerror}") from None
    except (ValueError, RecursionError) as error:  # also what is nested too deep, and numbers of thousands of digits
        words = "it is nested too deep" if isinstance(error, RecursionError) else short(str(error))
        raise ParameterError(f"{file} is no TOML that can be read: {words}") from None


def checked_sections(sections: Sections, file: Path, known: Sequence[str] = SECTIONS, of: str = "") -> Sections:
    """The tables of a TOML file as sections. Raises :class:`ParameterError` for what is no section.

    ``of`` says what has the ``known`` ones, as " in a calibration".
    """
    for name, section in sections.items():
        check_section(name, file, known, of)
        if not isinstance(section, dict):
            raise refusal(f"{file}: {name}", section, f"a section [{name}]")
    for name in ("law", "rock", "test"):
        kind = sections.get(name, {}).get("type")
        if isinstance(kind, str) and ".py" in kind:
            sections[name]["type"] = os.fspath(file.parent / kind)
    grains = sections.get("sample", {}).get("file")
    if isinstance(grains, str):
        sections["sample"]["file"] = os.fspath(file.parent / grains)
    return sections


def gathered(config: Path | None, options: Mapping[tuple[str, str], Any], assignments: Iterable[str]) -> Sections:
    """The sections of a file, then options that are not None by section and key, then single assignments.

    Raises :class:`ParameterError`, OSError.
    """
    sections = with_options(read_file(config) if config else {}, options)
    for assignment in assignments:
        assign(sections, assignment)
    return sections


def with_options(sections: Sections, options: Mapping[tuple[str, str], Any]) -> Sections:
    """The sections, copied, with options that are not None in their places."""
    made = {name: dict(section) for name, section in sections.items()}
    for (section, key), value in options.items():
        if value is not None:
            made.setdefault(section, {})[key] = value
    return made


def assign(sections: Sections, assignment: str, known: Sequence[str] = SECTIONS) -> None:
    """Set one value from ``section.key=value``; the value is TOML, or a string without its quotes."""
    path, sign, text = assignment.partition("=")
    section, *keys = path.strip().split(".")
    if not sign or not keys or not all(keys):
        raise ParameterError(f"'{assignment}' is not allowed, it must be like law.tensile_strength=\"13 MPa\"")
    check_section(section, assignment, known)
    put(sections, (section, *keys), _parsed(text))


def put(sections: Sections, place: Sequence[str], value: Any) -> None:
    """Set one value at the place ``(section, key, ...)``; what is inside of a section is copied, not changed."""
    section, *keys = place
    table: dict[str, Any] = sections.setdefault(section, {})
    for key in keys[:-1]:
        inner = table.get(key, {})  # a name alone is the component with its defaults
        table[key] = dict(inner) if isinstance(inner, Mapping) else {"type": inner}
        table = table[key]
    table[keys[-1]] = value


def _parsed(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except (ValueError, RecursionError):
        found = NUMBER.fullmatch(text)  # as .5, which TOML does not know
        return float(found[1]) if found and not found[2] else text.strip()


def check_section(name: str, place: object, known: Sequence[str] = SECTIONS, of: str = "") -> None:
    """Raise :class:`ParameterError` for a name that no section has."""
    if name not in known:
        has = f"sections: {', '.join(known)}"
        raise ParameterError(f"{place}: there is no section '{name}'{of}{nearest(name, known)} ({has})")


def toml(sections: Mapping[str, Mapping[str, Any]], notes: Mapping[str, Mapping[str, str]] | None = None) -> str:
    """Sections as TOML, what is inside of them as inline tables; ``notes`` on keys, by section, as comments.

    What is None is a comment, too.
    """
    blocks = []
    for name, section in sections.items():
        lines = {key: _line(key, value) for key, value in section.items()}
        words = (notes or {}).get(name, {})
        width = min(max((len(line) for key, line in lines.items() if words.get(key)), default=0), WIDEST)
        noted = (f"{line:<{width}}  # {words[key]}" if words.get(key) else line for key, line in lines.items())
        blocks.append("\n".join([f"[{name}]", *noted]))
    return "\n\n".join(blocks) + "\n"


def _line(key: str, value: Any) -> str:
    return f"# {_key(key)} = ..." if value is None else f"{_key(key)} = {value_toml(value)}"


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else json.dumps(key)


def value_toml(value: Any) -> str:
    """A value as TOML, what is inside of it as inline tables."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(float(value)) if math.isfinite(value) else str(value)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_key(key)} = {value_toml(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(value_toml, value)) + "]"
    return json.dumps(value)
