"""Joints, minerals and breakable grains in a configuration: in [sample], and by name in [rocks] and [laws]."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from grainlaw.cli.components import component, evolved, quantities, settings
from grainlaw.contact import ContactLaw
from grainlaw.fields import ParameterError
from grainlaw.geometry import Breakable, ByPhase, GrainCells, Jointed, Minerals, Sizes, VoronoiCells
from grainlaw.material import Material, Rigid
from grainlaw.messages import short
from grainlaw.tessellation import Tessellator
from grainlaw.unit_text import quantity

KEYS = ("joints", "minerals", "clustering", "breakable")  #: of [sample]
BY_PHASE = "by-phase"  #: type of the sizes that are given by mineral


def by_phase(sizes: Any) -> bool:
    """Whether [sample] sizes are those of each mineral, not those of the tessellator."""
    return isinstance(sizes, Mapping) and str(sizes.get("type")).lower().replace("_", "-") == BY_PHASE


def textured(tessellator: Tessellator, values: Mapping[str, Any]) -> tuple[Tessellator, dict[str, Any]]:
    """A tessellator with what [sample] says of joints, minerals and breakable grains, and its entries to make it again.

    Minerals come after joints, so that their shares are exact, unless they decide of what sizes the grains are.
    """
    seed: Any = values.get("seed", 1)
    section: dict[str, Any] = {}
    traces = _traces(values["joints"]) if "joints" in values else None
    sized = by_phase(values.get("sizes"))
    if traces is not None:
        section["joints"] = traces
    if traces is not None and not sized:
        tessellator = Jointed(tessellator, traces)
    if "minerals" in values:
        minerals = values["minerals"]
        if not isinstance(minerals, Mapping):
            raise ParameterError(f"sample.minerals = {short(minerals)} is not allowed, it must be a table of shares")
        shares = {name: quantity(share, "1", f"sample.minerals.{name}") for name, share in minerals.items()}
        clustering = quantity(values.get("clustering", 1.0), "1", "sample.clustering")
        sizes = _sizes(values["sizes"]) if sized else None
        tessellator = Minerals(tessellator, shares, clustering=clustering, seed=seed, sizes=sizes)
        section |= {"minerals": shares, "clustering": clustering, "seed": seed}
        if sizes is not None:
            own = {name: settings(each, Sizes) for name, each in sizes.sizes.items()}
            section["sizes"] = {"type": BY_PHASE, **own}
    elif sized:
        raise ParameterError("sample.sizes by phase are of the minerals of a sample, which has none")
    elif "clustering" in values:
        raise ParameterError("sample.clustering is of the minerals of a sample, which has none")
    if traces is not None and sized:
        tessellator = Jointed(tessellator, traces)
    if "breakable" in values:
        cells = component(GrainCells, values["breakable"], "sample.breakable", VoronoiCells(count=8))
        tessellator = Breakable(tessellator, cells, seed=seed)
        section |= {"breakable": settings(cells, GrainCells), "seed": seed}
    return tessellator, section


def _traces(joints: Any) -> dict[str, Any]:
    """Traces by the name of their set, in m."""
    if not isinstance(joints, Mapping):
        raise ParameterError(f"sample.joints = {short(joints)} is not allowed, it must be a table of lists of traces")
    return {name: quantities(traces, "m", f"sample.joints.{name}") for name, traces in joints.items()}


def _sizes(table: Mapping[str, Any]) -> ByPhase:
    own = {name: entry for name, entry in table.items() if name != "type"}
    return ByPhase({name: component(Sizes, entry, f"sample.sizes.{name}") for name, entry in own.items()})


def materials(rock: Material | Rigid, given: Mapping[str, Any]) -> tuple[Any, dict[str, Any]]:
    """The rock, or that of each mineral of [rocks] beside it; and the section [rocks]."""
    if not given:
        return rock, {}
    if isinstance(rock, Rigid):
        raise ParameterError("rocks is not allowed: rock is rigid, and minerals differ in how they deform")
    made = {}
    for name, entry in given.items():
        where, table = f"rocks.{name}", _table(entry, f"rocks.{name}")
        if ".py" in str(table.get("type")):
            raise ParameterError(
                f"{where}.type = {table['type']!r} is not allowed, a material of a file must be that of rock.type"
            )
        made[name] = component(Material, table, where, rock)
    section = {
        name: {key: value for key, value in settings(each).items() if key != "type" or type(each) is not type(rock)}
        for name, each in made.items()
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
