"""Joints, minerals, breakable grains and cracks in a configuration: in [sample], and by name in [rocks] and [laws]."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from grainlaw.cli.components import as_written, component, evolved, own, quantities, refuse_unknown, settings
from grainlaw.contact import ContactLaw
from grainlaw.edge_keys import CRACKS
from grainlaw.fields import ParameterError
from grainlaw.geometry import Breakable, ByPhase, Cracked, GrainCells, Jointed, Minerals, Sizes, VoronoiCells
from grainlaw.material import Material, Rigid
from grainlaw.messages import refusal
from grainlaw.tessellation import Tessellator
from grainlaw.unit_text import quantity

KEYS = ("joints", "minerals", "clustering", "breakable", "cracks")  #: of [sample]
CRACKED = {"share": "1", "least": "1", "direction": "deg", "within": "deg"}  #: units of numbers of [sample] cracks
BY_PHASE = "by-phase"  #: type of the sizes that are given by mineral


def by_phase(sizes: Any) -> bool:
    """Whether [sample] sizes are those of each mineral, not those of the tessellator."""
    return isinstance(sizes, Mapping) and as_written(sizes.get("type")) == BY_PHASE


def textured(tessellator: Tessellator, values: Mapping[str, Any]) -> tuple[Tessellator, dict[str, Any]]:
    """A tessellator with what [sample] says of its texture, and the entries to make it again.

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
            raise refusal("sample.minerals", minerals, "a table of shares")
        shares = {name: quantity(share, "1", f"sample.minerals.{name}") for name, share in minerals.items()}
        clustering = quantity(values.get("clustering", 1.0), "1", "sample.clustering")
        given = own(values["sizes"]) if sized else {}
        sizes = {name: component(Sizes, entry, f"sample.sizes.{name}") for name, entry in given.items()}
        by = ByPhase(sizes) if sized else None
        tessellator = Minerals(tessellator, shares, clustering=clustering, seed=seed, sizes=by)
        section |= {"minerals": shares, "clustering": clustering, "seed": seed}
        if sized:
            section["sizes"] = {"type": BY_PHASE, **{name: settings(each, Sizes) for name, each in sizes.items()}}
    elif sized:
        raise ParameterError("sample.sizes by phase are of the minerals of a sample, which has none")
    elif "clustering" in values:
        raise ParameterError("sample.clustering is of the minerals of a sample, which has none")
    if traces is not None and sized:
        tessellator = Jointed(tessellator, traces)
    if values.get("breakable") is False:  # whole, also where those of the rock are not
        section["breakable"] = False
    elif "breakable" in values:
        filling = values["breakable"]
        has_size = isinstance(filling, Mapping) and "size" in filling  # which takes the place of a count
        base = VoronoiCells(size=1.0) if has_size else VoronoiCells(count=8)
        cells = component(GrainCells, filling, "sample.breakable", base)
        tessellator = Breakable(tessellator, cells, seed=seed)
        section |= {"breakable": settings(cells, GrainCells), "seed": seed}
    if "cracks" in values:
        tessellator, section["cracks"] = _cracked(tessellator, values["cracks"], seed)
        section["seed"] = seed
    return tessellator, section


def _cracked(tessellator: Tessellator, given: Any, seed: Any) -> tuple[Tessellator, dict[str, Any]]:
    """Grains with initial cracks, of a share or of a table with one; and the table."""
    where = "sample.cracks"
    table = dict(given) if isinstance(given, Mapping) else {"share": given}
    refuse_unknown(where, table, [*CRACKED, "between"])
    if "share" not in table:
        raise ParameterError(f"{where}.share is missing: the share of the length between grains that is cracked")
    numbers: Any = {n: quantity(table[n], unit, f"{where}.{n}") for n, unit in CRACKED.items() if n in table}
    pairs = table.get("between")
    if pairs is None:
        return Cracked(tessellator, seed=seed, **numbers), numbers
    if not isinstance(pairs, list) or not all(isinstance(pair, str) and pair.count("/") == 1 for pair in pairs):
        raise refusal(f"{where}.between", pairs, "a list like ['quartz/mica']")
    made = Cracked(tessellator, between=[tuple(pair.split("/")) for pair in pairs], seed=seed, **numbers)
    return made, {**numbers, "between": list(pairs)}


def check_cracks(section: Mapping[str, Any], laws: Any) -> None:
    """Refuse initial cracks that would have the law of all other contacts."""
    if "cracks" in section and (not isinstance(laws, Mapping) or CRACKS not in laws):
        raise ParameterError(
            f'sample.cracks needs a law of its own in [laws]: "{CRACKS}" = {{type = "friction", kn = 1e14, ks = 1e14, '
            "friction_angle = 30}, or another one"
        )


def _traces(joints: Any) -> dict[str, Any]:
    """Traces by the name of their set, in m."""
    if not isinstance(joints, Mapping):
        raise refusal("sample.joints", joints, "a table of lists of traces")
    return {name: quantities(traces, "m", f"sample.joints.{name}") for name, traces in joints.items()}


def materials(rock: Material | Rigid, given: Mapping[str, Any]) -> tuple[Any, dict[str, Any]]:
    """The rock, or that of each mineral of [rocks] beside it; and the section [rocks]."""
    if not given:
        return rock, {}
    if isinstance(rock, Rigid):
        raise ParameterError("rocks is not allowed: rock is rigid, and minerals differ in how they deform")
    made = {}
    for name, entry in given.items():
        where, table = f"rocks.{name}", table_of(entry, f"rocks.{name}")
        if ".py" in str(table.get("type")):
            raise ParameterError(
                f"{where}.type = {table['type']!r} is not allowed, a material of a file must be that of rock.type"
            )
        made[name] = component(Material, table, where, rock)
    return {**made, ...: rock}, section_of(made, rock)


def section_of(minerals: Mapping[str, Material], rock: Material) -> dict[str, Any]:
    """The section [rocks] of these minerals beside [rock]: with their types, where these are others."""
    shown = {name: settings(each) for name, each in minerals.items()}
    return {name: own(shown[name]) if type(each) is type(rock) else shown[name] for name, each in minerals.items()}


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
        where, table = f"laws.{key}", table_of(entry, f"laws.{key}")
        kind = table.get("type")
        named = {}
        if kind is None:
            found = evolved(law, table, where)
        elif ".py" in str(kind):
            raise ParameterError(f"{where}.type = {kind!r} is not allowed, a law of a file must be that of law.type")
        else:
            named["type"], found, _ = find(dict(table))
        made[edge_key(key)] = found
        section[key] = own(settings(found, ContactLaw)) | named
    return {**made, ...: law}, section


def table_of(entry: Any, where: str) -> dict[str, Any]:
    if not isinstance(entry, Mapping):
        raise refusal(where, entry, "a table of parameters")
    return dict(entry)


def edge_key(text: str, where: str = "laws") -> Any:
    """A key of edges: ``quartz/mica`` between minerals, ``quartz/*`` with any other, ``inside/quartz``, a joint."""
    parts = [... if part == "*" else part for part in text.split("/")]
    if len(parts) > 2 or "" in parts or "..." in parts:
        raise ParameterError(
            f"{where}: the key '{text}' is not allowed, it must be like quartz/mica, quartz/* or inside"
        )
    return tuple(parts) if len(parts) == 2 else parts[0]
