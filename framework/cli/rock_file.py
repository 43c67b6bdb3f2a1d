"""Rocks of papers: a file each, with the sections of a configuration and what to cite; and what a test takes of one."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs

from grainlaw.cli.components import choices, own, refuse_unknown, shared
from grainlaw.cli.default_rock import FOLDER, LAWS, NAMES, SUFFIX
from grainlaw.cli.minerals import KEYS
from grainlaw.cli.sample import with_size
from grainlaw.cli.sections import Sections, checked_sections, read_tables
from grainlaw.contact import ContactLaw
from grainlaw.fields import ParameterError
from grainlaw.messages import refusal, short

SECTIONS_OF_ROCK = ("sample", "rock", "rocks", "law", "laws")
#: of [sample]: the specimen of the paper, not the texture
BY_REGION = ("region", "width", "height", "diameter", "grains")


@attrs.frozen
class RockFile:
    """A rock as its file has it."""

    name: str  #: what it was asked for by
    about: str  #: one sentence: which rock, and by what it was found
    cite: tuple[str, ...]  #: works to cite
    sections: Sections


def is_rock(name: Any) -> bool:
    """Whether the type of a rock names one of ours, or a file, not a material."""
    return isinstance(name, str) and (name in NAMES or name.endswith(SUFFIX))


def rock_file(name: str) -> RockFile:
    """The rock of a name, or of a TOML file. Raises :class:`~grainlaw.fields.ParameterError`."""
    file = FOLDER / f"{name}{SUFFIX}" if name in NAMES else Path(name)
    tables = read_tables(file)
    refuse_unknown(os.fspath(file), tables, ["about", "cite", *SECTIONS_OF_ROCK])
    about, cite = tables.pop("about", ""), checked_cite(tables.pop("cite", []), f"{file}: cite")
    if not isinstance(about, str):
        raise refusal(f"{file}: about", about, "a text")
    sections = checked_sections(tables, file)
    if "sample" in sections:
        sections["sample"] = with_size(sections["sample"])
    if sections.get("law") and "type" not in sections["law"]:
        raise ParameterError(f"{file}: law.type is missing: the name of the law that has these parameters")
    if is_rock(sections.get("rock", {}).get("type")):
        raise ParameterError(f"{file}: rock.type = {short(sections['rock']['type'])} is not allowed: a rock of a rock")
    return RockFile(name, about, cite, sections)


def checked_cite(given: Any, where: str) -> tuple[str, ...]:
    """Works to cite, a text each. Raises :class:`~grainlaw.fields.ParameterError`."""
    if not isinstance(given, list) or not all(isinstance(work, str) for work in given):
        raise refusal(where, given, "a list of texts")
    return tuple(given)


def over_rock(rock: RockFile, given: Sections, usual: Mapping[str, Any], quick: bool) -> Sections:
    """The sections with those of a rock beneath them; ``usual`` is the test's own sample.

    The size of the paper's specimen counts in tests of a specimen of the same shape. Another law than the rock's own
    has of the rock the parameters that both know; one of a file has none.
    """
    of_rock = {name: dict(rock.sections.get(name, {})) for name in SECTIONS_OF_ROCK}
    cite = [*rock.cite, *checked_cite(given["rock"].get("cite", []), "rock.cite")]
    return {
        **given,
        "sample": _texture(of_rock["sample"], given["sample"], usual, quick) | given["sample"],
        "rock": {**of_rock["rock"], **own(given["rock"]), "cite": cite},
        "rocks": _over(of_rock["rocks"], given["rocks"]),
        **_laws(of_rock["law"], of_rock["laws"], given),
    }


def _laws(law: dict[str, Any], laws: dict[str, Any], given: Sections) -> Sections:
    """The sections of laws, with classes in place of their names: what nobody gives is not that of another rock."""
    kind = given["law"].get("type", law.get("type"))
    if not isinstance(kind, str) or ".py" in kind:
        return {"law": given["law"], "laws": given["laws"]}
    cls, tables = law_class(kind), {name: dict(entry) for name, entry in laws.items() if isinstance(entry, Mapping)}
    if kind != law.get("type") and isinstance(cls, type):
        law = shared(law, cls)
        tables = {name: entry if "type" in entry else shared(entry, cls) for name, entry in tables.items()}
    for entry in tables.values():
        if "type" in entry:
            entry["type"] = law_class(entry["type"])
    laws = {**laws, **tables}
    over = {_as_in(laws, key, given["laws"]): entry for key, entry in given["laws"].items()}
    return {"law": {**law, **given["law"], "type": cls}, "laws": _over(laws, over)}


def _as_in(laws: Mapping[str, Any], key: str, given: Mapping[str, Any]) -> str:
    """The key of a pair in the order in which the rock has it; where both are given they stay, and are refused."""
    turned = "/".join(reversed(key.split("/")))
    return turned if turned in laws and turned not in given else key


def law_class(name: Any) -> Any:
    """The class of a law's name, of Table 1's or of any other; the name where there is none."""
    return ({each: type(law) for each, law in LAWS.items()} | choices(ContactLaw)).get(str(name), name)


def _texture(rock: dict[str, Any], given: Mapping[str, Any], usual: Mapping[str, Any], quick: bool) -> dict[str, Any]:
    """What of a rock's sample fits the test: nothing where the grains are given, or are no grains, as of a joint."""
    if "file" in given or usual["tessellator"] != "voronoi":
        return {}
    if given.get("tessellator", rock.get("tessellator")) != rock.get("tessellator"):
        rock = {key: value for key, value in rock.items() if key in (*KEYS, *BY_REGION)}
    if quick or given.get("region", usual["region"]) != rock.get("region"):
        rock = {key: value for key, value in rock.items() if key not in BY_REGION}
    if any(name in given for name in ("grains", "grain_size", "points", "areas")):
        rock = {key: value for key, value in rock.items() if key not in ("grains", "grain_size", "areas")}
    return rock


def _over(rock: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """Tables by name: what is given of one over what the rock has of it, unless it is of another type."""
    tables = [name for name in given if isinstance(rock.get(name), Mapping) and isinstance(given[name], Mapping)]
    both = {name: {**rock[name], **given[name]} for name in tables if "type" not in given[name]}
    return {**rock, **given, **both}
