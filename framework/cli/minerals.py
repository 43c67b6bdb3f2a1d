"""Minerals and breakable grains in a configuration: in [sample], and by name in [rocks] and [laws]."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from grainlaw.arguments import short
from grainlaw.cli.components import component, evolved, settings
from grainlaw.contact import ContactLaw
from grainlaw.geometry import Breakable, GrainCells, Minerals, VoronoiCells
from grainlaw.parameter import ParameterError
from grainlaw.specimen import Elastic, Rigid
from grainlaw.tessellation import Tessellator
from grainlaw.unit_text import quantity

KEYS = ("minerals", "clustering", "breakable")  #: of [sample]


def textured(tessellator: Tessellator, values: Mapping[str, Any]) -> tuple[Tessellator, dict[str, Any]]:
    """A tessellator with what [sample] says of minerals and breakable grains, and its entries to make it again."""
    seed: Any = values.get("seed", 1)
    section: dict[str, Any] = {}
    if "minerals" in values:
        minerals = values["minerals"]
        if not isinstance(minerals, Mapping):
            raise ParameterError(f"sample.minerals = {short(minerals)} is not allowed, it must be a table of shares")
        shares = {name: quantity(share, "1", f"sample.minerals.{name}") for name, share in minerals.items()}
        clustering = quantity(values.get("clustering", 1.0), "1", "sample.clustering")
        tessellator = Minerals(tessellator, shares, clustering=clustering, seed=seed)
        section |= {"minerals": shares, "clustering": clustering, "seed": seed}
    elif "clustering" in values:
        raise ParameterError("sample.clustering is of the minerals of a sample, which has none")
    if "breakable" in values:
        cells = component(GrainCells, values["breakable"], "sample.breakable", VoronoiCells(count=8))
        tessellator = Breakable(tessellator, cells, seed=seed)
        section |= {"breakable": settings(cells, GrainCells), "seed": seed}
    return tessellator, section


def materials(rock: Elastic | Rigid, given: Mapping[str, Any]) -> tuple[Any, dict[str, Any]]:
    """The rock, or that of each mineral of [rocks] beside it; and the section [rocks]."""
    if not given:
        return rock, {}
    if isinstance(rock, Rigid):
        raise ParameterError("rocks is not allowed: rock is rigid, and minerals differ in how they deform")
    made = {name: evolved(rock, _table(entry, f"rocks.{name}"), f"rocks.{name}") for name, entry in given.items()}
    section = {
        name: {key: value for key, value in settings(each).items() if key != "type"} for name, each in made.items()
    }
    return {**made, ...: rock}, section


def laws_by_key(
    law: ContactLaw, given: Mapping[str, Any], find: Callable[[dict[str, Any]], tuple[str, ContactLaw, list[Any]]]
) -> tuple[Any, dict[str, Any]]:
    """The law, or those of [laws] beside it by what they are between; and the section [laws].

    A table without a type has the law of [law] with other parameters; ``find`` makes the law of one with a type.
    """
    if not given:
        return law, {}
    made: dict[Any, ContactLaw] = {}
    section = {}
    for key, entry in given.items():
        where, table = f"laws.{key}", _table(entry, f"laws.{key}")
        kind = table.get("type")
        if kind is None:
            own = evolved(law, table, where)
        elif ".py" in str(kind):
            raise ParameterError(f"{where}.type = {kind!r} is not allowed, a law of a file must be that of law.type")
        else:
            kind, own, _ = find(dict(table))
        made[_key(key)] = own
        named = {"type": kind} if kind is not None else {}
        section[key] = {name: value for name, value in settings(own, ContactLaw).items() if name != "type"} | named
    return {**made, ...: law}, section


def _table(entry: Any, where: str) -> dict[str, Any]:
    if not isinstance(entry, Mapping):
        raise ParameterError(f"{where} = {short(entry)} is not allowed, it must be a table of parameters")
    return dict(entry)


def _key(text: str) -> Any:
    """``quartz/mica`` between minerals, ``quartz/*`` with any other, ``inside``, ``inside/quartz``, or a joint."""
    parts = [... if part == "*" else part for part in text.split("/")]
    if len(parts) > 2 or "" in parts:
        raise ParameterError(f"laws: the key '{text}' is not allowed, it must be like quartz/mica, quartz/* or inside")
    return tuple(parts) if len(parts) == 2 else parts[0]
