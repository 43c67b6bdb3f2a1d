"""The section [sample]: a region, the grains that fill it, and where they touch."""

from __future__ import annotations

import inspect
import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import attrs

import grainlaw.geometry
from grainlaw.cli.components import (
    as_written,
    choices,
    component,
    evolved,
    explained,
    own,
    quantities,
    refuse_unknown,
    settings,
)
from grainlaw.cli.minerals import KEYS, by_phase, edge_key, textured
from grainlaw.fields import ParameterError
from grainlaw.geometry import from_labels, from_mesh, read_tess
from grainlaw.messages import nearest, refusal, short
from grainlaw.region import Region
from grainlaw.specimen import ContactPoints, GaussPoints
from grainlaw.tessellation import Tessellation, Tessellator
from grainlaw.unit_text import quantity, written

REGIONS: dict[str, Callable[..., Region]] = {
    as_written(name): function
    for name, function in inspect.getmembers(grainlaw.geometry, inspect.isfunction)
    if inspect.signature(function, eval_str=True).return_annotation is Region
}
OF_SPECIMEN = ("contact_points", "tied", "slits")  #: keys that are no tessellator's
INSTEAD_OF_GRAINS = ("grain_size", "points", "areas")  #: of the default's number
ANGLES = ("loaded",)  #: numbers of regions that are no lengths
TESSELLATION = ".tess"
IMAGES = (".npy", ".png", ".tif", ".tiff", ".bmp")
LENGTHS = ("unit", "pixel", "cell_size")  #: options in m


def grains_of_file(file: Any, options: Mapping[str, Any]) -> tuple[Tessellation, dict[str, Any]]:
    """The grains, and the options as they are written again.

    ``options`` are those of the function that reads the file. Raises :class:`~grainlaw.fields.ParameterError`.
    """
    if not isinstance(file, str):
        raise refusal("sample.file", file, "the name of a file")
    if not Path(file).is_file():
        raise ParameterError(f"sample.file = {short(file)} is not allowed, there is no such file")
    suffix = Path(file).suffix.lower()
    reader: Callable[..., Tessellation] = from_labels if suffix in IMAGES else from_mesh
    if suffix == TESSELLATION:
        reader = read_tess
    known = [name for name, p in inspect.signature(reader).parameters.items() if name not in ("file", "image")]
    refuse_unknown("sample", options, ["file", *known, *OF_SPECIMEN])
    given = {key: _value(key, value) for key, value in options.items()}
    if reader is from_labels and "pixel" not in given:
        raise ParameterError("sample.pixel is missing: the size of a pixel of the image")
    shown = {key: written(given[key], "m") if key in LENGTHS else options[key] for key in given}
    return reader(file, **given), shown


def _value(key: str, value: Any) -> Any:
    if key in LENGTHS:
        return quantity(value, "m", f"sample.{key}")
    if key == "region":
        return _region(value)
    if key == "corner" and isinstance(value, list):
        return quantities(value, "m", "sample.corner")
    if key == "phases" and isinstance(value, Mapping):  # keys of TOML are texts
        return {int(number) if str(number).isdecimal() else number: name for number, name in value.items()}
    return value


def _region(given: Any) -> Region:
    """The region of a table with its type and parameters, or of a name; what is outside of it is cut off an image."""
    if not isinstance(given, (str, Mapping)):
        raise refusal("sample.region", given, "a name or a table")
    table = {"type": given} if isinstance(given, str) else dict(given)
    shape = _named(table.pop("type", ""), REGIONS, "sample.region")
    refuse_unknown("sample.region", table, _lengths(shape))
    return REGIONS[shape](**_sizes(shape, table))


def tessellators() -> dict[str, type]:
    """Those that fill a region by themselves, by name."""
    every = choices(Tessellator).items()
    return {name: cls for name, cls in every if "tessellator" not in attrs.fields_dict(cls)}


@attrs.frozen
class Sample:
    """Grains that are not made yet, and the section that makes them again."""

    section: dict[str, Any]
    grains: Callable[[], Tessellation]
    contact_points: ContactPoints
    tessellator: Tessellator | None = None  #: None for grains of a file
    edges: Mapping[str, tuple[Any, ...]] = attrs.field(factory=dict)  #: ``tied`` and ``slits`` of the specimen


def sample(default: Mapping[str, Any], given: Mapping[str, Any]) -> Sample:
    """What a section says of the grains. Raises :class:`~grainlaw.fields.ParameterError`.

    ``default`` counts as far as the given region and tessellator know it.
    """
    if "file" in given:
        return _from_file(given)
    shape = _named(given.get("region", default["region"]), REGIONS, "sample.region")
    filling = _named(given.get("tessellator", default["tessellator"]), tessellators(), "sample.tessellator")
    lengths = _lengths(shape)
    fields = [field.name for field in attrs.fields(tessellators()[filling])]
    known = ["region", *lengths, "tessellator", *fields, *KEYS, *OF_SPECIMEN]
    refuse_unknown("sample", given, [*known, "seed"] if {*KEYS} & {*given} else known)

    values = {**default, **given}
    if "grains" not in given and any(name in given for name in INSTEAD_OF_GRAINS):
        values.pop("grains", None)
    size = _sizes(shape, values)
    its = {key: values[key] for key in fields if key in values and not (key == "sizes" and by_phase(values[key]))}
    grains = evolved(tessellators()[filling], its, "sample")
    points, edges = _contact_points(given), _edges(given)

    whole, more = textured(grains, values)
    region = REGIONS[shape](**size)
    section = {
        "region": shape,
        **{name: _written(name, value) for name, value in size.items() if value is not None},
        "tessellator": filling,
        **own(settings(grains)),
        **more,
        "contact_points": settings(points, ContactPoints),
        **_entries(given),
    }
    return Sample(section, lambda: whole.tessellate(region), points, whole, edges)


def with_size(given: Mapping[str, Any]) -> dict[str, Any]:
    """A section [sample] with the size of its grains for their number, so that other regions have such grains too.

    As it is where it does not tell a region, or cannot be. Raises :class:`~grainlaw.fields.ParameterError`.
    """
    count, shape = given.get("grains"), given.get("region")
    if not isinstance(count, int) or count < 1 or "grain_size" in given or shape not in REGIONS:
        return dict(given)
    if not all(name in given or each.default is not each.empty for name, each in _lengths(shape).items()):
        return dict(given)
    region = REGIONS[shape](**_sizes(shape, given))
    rest = {name: value for name, value in given.items() if name != "grains"}
    return {**rest, "grain_size": written(math.sqrt(region.area / count), "m")}


def with_notes(section: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, str]]:
    """A section of :func:`sample` with what else its tessellator could be given, as None, and notes on its keys."""
    if "file" in section:
        return dict(section), {}
    shape, filling = REGIONS[section["region"]], tessellators()[section["tessellator"]]
    lengths = inspect.signature(shape, eval_str=True).parameters.values()
    notes = explained(filling)
    head = {key: value for key, value in section.items() if key not in notes}
    whole = {key: section.get(key) for key in notes}
    notes |= {each.name: _unit(each.name) for each in lengths if each.annotation is float}
    notes |= {"region": f"one of {', '.join(REGIONS)}", "tessellator": f"one of {', '.join(tessellators())}"}
    last = {name: head.pop(name, None) for name in OF_SPECIMEN}
    notes |= {
        "contact_points": f"one of {', '.join(choices(ContactPoints))}",
        "tied": "edges at which nodes are shared",
    }
    return {**head, **whole, **last}, notes


def _from_file(given: Mapping[str, Any]) -> Sample:
    """Of grains that a file holds: it has a region of its own."""
    options = {key: value for key, value in given.items() if key not in ("file", *OF_SPECIMEN)}
    grains, made = grains_of_file(given["file"], options)
    points, edges = _contact_points(given), _edges(given)
    section = {"file": os.fspath(given["file"]), **made, "contact_points": settings(points, ContactPoints)}
    return Sample({**section, **_entries(given)}, lambda: grains, points, edges=edges)


def _entries(given: Mapping[str, Any]) -> dict[str, Any]:
    """The entries of edges that are tied, or slits, that are there."""
    return {name: list(given[name]) for name in ("tied", "slits") if name in given}


def _edges(given: Mapping[str, Any]) -> dict[str, tuple[Any, ...]]:
    found = {}
    for name, wanted in (("tied", 'kinds of edges, such as ["inside", "quartz/mica"]'), ("slits", "names of joints")):
        keys = given.get(name, ())
        if not isinstance(keys, (list, tuple)) or not all(isinstance(key, str) for key in keys):
            raise refusal(f"sample.{name}", keys, f"a list of {wanted}")
        found[name] = tuple(edge_key(key, "sample.tied") if name == "tied" else key for key in keys)
    return found


def _contact_points(given: Mapping[str, Any]) -> ContactPoints:
    return component(ContactPoints, given.get("contact_points", {}), "sample.contact_points", GaussPoints())


def _named(name: Any, known: Mapping[str, Any], where: str) -> str:
    if isinstance(name, Mapping):
        raise refusal(where, dict(name), "a name; what it needs are keys of [sample], beside it")
    key = as_written(name)
    if key not in known:
        raise ParameterError(
            f"{where}: there is no {short(str(name))}{nearest(key, known)} (there are: {', '.join(known)})"
        )
    return key


def _lengths(shape: str) -> Mapping[str, inspect.Parameter]:
    """What the function of a region takes, by name."""
    return inspect.signature(REGIONS[shape], eval_str=True).parameters


def _sizes(shape: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """All that the function of a region takes, SI, of a table. Raises :class:`~grainlaw.fields.ParameterError`."""
    return {name: _size(parameter, values, shape) for name, parameter in _lengths(shape).items()}


def _size(parameter: inspect.Parameter, values: Mapping[str, Any], shape: str) -> Any:
    where = f"sample.{parameter.name}"
    if parameter.name not in values:
        if parameter.default is inspect.Parameter.empty:
            raise ParameterError(f"{where} is missing: the region {shape} needs it")
        return parameter.default
    value = values[parameter.name]
    return quantity(value, _unit(parameter.name), where) if parameter.annotation is float else value


def region_units(shape: Callable[..., Region]) -> dict[str, str]:
    """The unit of each number of a region; empty for what is none."""
    found = inspect.signature(shape, eval_str=True).parameters
    return {name: _unit(name) if each.annotation is float else "" for name, each in found.items()}


def _unit(name: str) -> str:
    return "deg" if name in ANGLES else "m"


def _written(name: str, value: Any) -> Any:
    return written(value, _unit(name)) if isinstance(value, float) else value
