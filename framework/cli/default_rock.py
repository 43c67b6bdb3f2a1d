"""The rock of the command line where none is given: that of a published study, with specimens and laws by name."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any, cast

import click

from grainlaw.cli.components import choices, component, evolved, own, shared
from grainlaw.cli.law_file import find_with_files
from grainlaw.cli.sections import read_tables
from grainlaw.contact import ContactLaw
from grainlaw.material import Elastic, Material
from grainlaw.messages import nearest
from grainlaw.unit_text import quantity

FOLDER = Path(str(files("grainlaw.cli"))) / "rocks"  #: of the rocks of papers
SUFFIX = ".toml"
NAMES = sorted(file.stem for file in FOLDER.glob(f"*{SUFFIX}"))
DEFAULT = "palabora-carbonatite-printed"
_TABLES, _OF_PAPER = read_tables(FOLDER.parent / "default_rock.toml"), read_tables(FOLDER / f"{DEFAULT}{SUFFIX}")


def _size(given: Mapping[str, Any]) -> tuple[float, float, int]:
    width, height = (quantity(given[name], "m", name) for name in ("width", "height"))
    return width, height, given["grains"]


def _law(name: str, given: Mapping[str, Any]) -> ContactLaw:
    kind = choices(ContactLaw)[given.get("type", name)]
    return cast(ContactLaw, evolved(kind, {**shared(_OF_PAPER["law"], kind), **own(given)}, f"laws.{name}"))


ROCK = cast(Elastic, component(Material, _OF_PAPER["rock"], "rock"))
SAMPLE, QUICK = _size(_TABLES["sample"]), _size(_TABLES["quick"])  #: width, height (m), grains
LAWS: dict[str, ContactLaw] = {name: _law(name, given) for name, given in _TABLES["laws"].items()}


def law_named(name: str) -> ContactLaw:
    """The law of a name. Raises click.BadParameter that suggests the nearest one."""
    if name not in LAWS:
        raise click.BadParameter(f"there is no law '{name}'{nearest(name, LAWS, 0.3)} (laws: {', '.join(LAWS)})")
    return LAWS[name]


def law_or_file(name: str) -> ContactLaw:
    """The law of a name or of FILE.py:LAW.

    Raises click.BadParameter, :class:`ParameterError`.
    """
    return find_with_files(name, ContactLaw)[0] if ".py" in name else law_named(name)
