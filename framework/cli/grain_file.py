"""Grains from a file that the section [sample] names: a tessellation, a label map or a mesh, told by its ending."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from grainlaw.cli.components import refuse_unknown
from grainlaw.geometry import from_labels, from_mesh, read_tess
from grainlaw.messages import short
from grainlaw.parameter import ParameterError
from grainlaw.tessellation import Tessellation
from grainlaw.unit_text import quantity, written

TESSELLATION = ".tess"
IMAGES = (".npy", ".png", ".tif", ".tiff", ".bmp")
LENGTHS = ("unit", "pixel", "cell_size")  #: options in m


def grains_of_file(file: Any, options: Mapping[str, Any]) -> tuple[Tessellation, dict[str, Any]]:
    """The grains, and the options as they are written again.

    ``options`` are those of the function that reads the file. Raises :class:`~grainlaw.parameter.ParameterError`.
    """
    if not isinstance(file, str):
        raise ParameterError(f"sample.file = {short(file)} is not allowed, it must be the name of a file")
    if not Path(file).is_file():
        raise ParameterError(f"sample.file = {short(file)} is not allowed, there is no such file")
    reader = _reader(Path(file).suffix.lower())
    known = [name for name, p in inspect.signature(reader).parameters.items() if name not in ("file", "image")]
    refuse_unknown("sample", options, ["file", *known, "contact_points"])
    given = {key: _value(key, value) for key, value in options.items()}
    if reader is from_labels and "pixel" not in given:
        raise ParameterError("sample.pixel is missing: the size of a pixel of the image")
    shown = {key: written(given[key], "m") if key in LENGTHS else options[key] for key in given}
    return reader(file, **given), shown


def _reader(suffix: str) -> Callable[..., Tessellation]:
    if suffix == TESSELLATION:
        return read_tess
    return from_labels if suffix in IMAGES else from_mesh


def _value(key: str, value: Any) -> Any:
    if key in LENGTHS:
        return quantity(value, "m", f"sample.{key}")
    if key == "phases" and isinstance(value, Mapping):  # keys of TOML are texts
        return {int(number) if number.isdecimal() else number: name for number, name in value.items()}
    return value
