"""Results as one file of numbers, from which they are read again without running anything."""

from __future__ import annotations

import io
import json
import re
import zipfile
from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.columns import Panel
from grainlaw.fields import ParameterError, parameters
from grainlaw.material import Elastic, Material, Plane, Rigid
from grainlaw.messages import short
from grainlaw.quantity import Quantity
from grainlaw.region import Region
from grainlaw.results.files import Arrays, below, for_json, grouped, without_nan
from grainlaw.results.frames import packed, unpacked
from grainlaw.results.result import Cracks, Curves, Named, Result
from grainlaw.specimen import EndPoints, GaussPoints, InsetPoints, Specimen
from grainlaw.tessellation import Tessellation

FORMAT = 3  #: raise when a file of before could not be read any more
GRAINS = ("vertices", "corners", "first", "phase", "body", "loose", "parent")
#: parts of names of tests as the field spells them
SPELT = {"Three point": "Three-point", "Semi circular": "Semi-circular", "hopkinson": "Hopkinson"}
KINDS: dict[str, type] = {kind.__name__: kind for kind in (Elastic, Rigid, EndPoints, GaussPoints, InsetPoints)}


@attrs.frozen
class Recorded(metaclass=Checked):
    """A law or a test of a run that is read from a file: its class's name and its parameters, no code."""

    type: str
    parameters: dict[str, Any]
    quantities: tuple[Quantity, ...] = ()  #: that a test declares
    panels: tuple[Panel, ...] = ()  #: of its figures


@attrs.frozen
class RecordedMaterial(Material):
    """The material of a run that is read from a file: as :class:`Recorded`, with what it weighs and how stiff it is."""

    type: str
    parameters: dict[str, Any]
    density: Any
    declared: Any

    @property
    def stiffness(self) -> Any:
        return self.declared

    def stress(self, exx: Any, eyy: Any, exy: Any) -> Any:
        raise ParameterError(f"{self.type} was read from a file, which has no code: make the material again")

    energy = stress


READ = (Recorded, RecordedMaterial)


def called(component: Any) -> str:
    """The name of a component's class."""
    return component.type if isinstance(component, READ) else type(component).__name__


def in_words(component: Any) -> str:
    """``UniaxialCompression`` as "Uniaxial compression"."""
    words = " ".join(re.findall(r"[A-Z]+[a-z0-9]*", called(component))).capitalize()
    for plain, spelt in SPELT.items():
        words = words.replace(plain, spelt)
    return words


def law_name(law: Any) -> str:
    """The name of a law's class, and of the law that it modifies; of several, as by joint, each name once."""
    if isinstance(law, Mapping):
        return ", ".join(dict.fromkeys(map(law_name, law.values())))
    return _law_called(called(law), listed(law))


def _law_called(name: str, values: Mapping[str, Any]) -> str:
    inner = values.get("law")
    if not isinstance(inner, Mapping) or "type" not in inner:
        return name
    return f"{name} of {_law_called(inner['type'], inner)}"


def listed(component: Any) -> dict[str, Any]:
    """The parameters of a component by name, see :func:`~grainlaw.fields.parameters`."""
    return dict(component.parameters) if isinstance(component, READ) else parameters(component)


def to_bytes(result: Result, *, frames: bool = True) -> bytes:
    """A result as the content of a file; without its ``frames`` a third of the size or less."""
    arrays: Arrays = {f"curves/{name}": row for name, row in result.curves.items()}
    arrays |= {f"cracks/{field.name}": getattr(result.cracks, field.name) for field in attrs.fields(Cracks)}
    arrays["interfaces"] = result.interfaces
    for k, frame in enumerate(result.frames if frames else ()):
        arrays |= {f"frames/{k}/{name}": row for name, row in packed(frame).items()}
    grains = result.specimen.grains
    arrays |= {f"grains/{name}": getattr(grains, name) for name in GRAINS}
    arrays |= {f"joints/{name}": edges for name, edges in grains.joints.items()}
    for k, region in enumerate(grains.regions):
        arrays[f"regions/{k}/outline"] = region.outline
        arrays |= {f"regions/{k}/hole/{h}": hole for h, hole in enumerate(region.holes)}
    about = {
        "format": FORMAT,
        "summary": result.summary,
        "law": _described(result.law),
        "protocol": _described(result.protocol),
        "quantities": [attrs.asdict(each) for each in result.quantities.values()],
        "stages": list(result.stages),
        "begins": result.begins,
        "panels": [attrs.asdict(each) for each in result.protocol.panels],
        "material": _described(result.specimen.material),
        "contact_points": _described(result.specimen.contact_points),
        "refinement": result.specimen.refinement,
        "slits": result.specimen.slits,
        "tied": [_written(key) for key in result.specimen.tied],
        "phase_names": grains.phase_names,
        "sides": [[region.sides, region.hole_sides] for region in grains.regions],
    }
    arrays["about"] = np.array(json.dumps(without_nan(about), allow_nan=False, default=for_json))
    stream = io.BytesIO()
    np.savez_compressed(stream, allow_pickle=False, **arrays)
    return stream.getvalue()


def from_bytes(content: bytes, where: str = "the content") -> Result:
    """The result of :func:`to_bytes`. Raises :class:`ParameterError`, which begins with ``where``."""
    if not zipfile.is_zipfile(io.BytesIO(content)):
        raise ParameterError(f"{where} is no result that can be read: it is no npz file, or was cut off")
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as stored:
            about = json.loads(str(stored["about"]))
            written = about["format"]
            arrays = {name: stored[name] for name in stored.files} if written == FORMAT else {}
        if written != FORMAT:
            raise ParameterError(f"it has the format {written}; this version of grainlaw reads {FORMAT}")
        return _result(arrays, about)
    except ParameterError as error:
        raise ParameterError(f"{where} cannot be read: {error}") from None
    except Exception as error:  # zipfile, zlib, numpy and json have each their own errors for a damaged file
        raise ParameterError(f"{where} is no result that can be read: {short(str(error))}") from None


def _result(arrays: Arrays, about: Mapping[str, Any]) -> Result:
    frames = grouped(below("frames", arrays))
    declared = {
        name: tuple(kind(**each) for each in about[name])
        for name, kind in (("quantities", Quantity), ("panels", Panel))
    }
    specimen = _specimen(arrays, about)
    return Result(
        specimen=specimen,
        law=_read(about["law"]),
        protocol=attrs.evolve(_read(about["protocol"]), **declared),
        curves=Curves(below("curves", arrays)),
        summary=Named({name: np.nan if value is None else value for name, value in about["summary"].items()}),
        cracks=Cracks(**below("cracks", arrays)),
        frames=[unpacked(frames[k], specimen.mesh.nodes) for k in sorted(frames, key=int)],
        interfaces=arrays["interfaces"],
        stages=about["stages"],
        begins=about.get("begins", 0),
    )


def _described(component: Any) -> Any:
    if isinstance(component, Mapping):
        return {"by": [[_written(key), _described(entry)] for key, entry in component.items()]}
    about = {"type": called(component), "parameters": listed(component)}
    if isinstance(component, Material) and type(component).__name__ not in KINDS:
        about |= {"density": _numbers(component.density), "declared": _numbers(component.stiffness)}
    return about


def _numbers(value: Any) -> Any:
    """A number, or rows of numbers or arrays of them, as lists."""
    return [_numbers(entry) for entry in value] if isinstance(value, (tuple, list)) else np.asarray(value).tolist()


def _written(key: Any) -> Any:
    """A phase, a pair of them, or ... for any."""
    return [_written(part) for part in key] if isinstance(key, tuple) else "..." if key is ... else key


def _key(key: Any) -> Any:
    return tuple(map(_key, key)) if isinstance(key, list) else ... if key == "..." else key


def _read(entry: Mapping[str, Any]) -> Any:
    if "by" in entry:
        return {_key(key): _read(inner) for key, inner in entry["by"]}
    return Recorded(**entry)


def _specimen(arrays: Arrays, about: Mapping[str, Any]) -> Specimen:
    regions = []
    for k, (sides, hole_sides) in enumerate(about["sides"]):
        holes = [arrays[f"regions/{k}/hole/{h}"] for h in range(len(hole_sides))]
        regions.append(Region(arrays[f"regions/{k}/outline"], sides, holes, hole_sides))
    grains = Tessellation(
        regions[0], **below("grains", arrays), bodies=regions[1:], phase_names=about["phase_names"],
        joints=below("joints", arrays),
    )  # fmt: skip
    return Specimen(
        grains, _made(about["material"]), contact_points=_made(about["contact_points"]),
        refinement=about["refinement"], tied=tuple(map(_key, about["tied"])), slits=tuple(about["slits"]),
    )  # fmt: skip


def _made(entry: Mapping[str, Any]) -> Any:
    """A material or contact points again."""
    if "by" in entry:
        return {_key(key): _made(inner) for key, inner in entry["by"]}
    if "declared" in entry:
        return RecordedMaterial(**entry)
    if entry["type"] not in KINDS:
        raise ParameterError(f"there is no {entry['type']} in this version of grainlaw")
    values = dict(entry["parameters"])
    if "plane" in values:
        values["plane"] = Plane[values["plane"].upper()]
    return KINDS[entry["type"]](**values)
