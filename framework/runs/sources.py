"""The sources of grainlaw: where they lie, and their hash."""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
from pathlib import Path

import grainlaw

COMPONENTS = ("laws", "geometry", "protocols")
SHOWN_ONLY = ("workbench/", "results/figures/", "studies/")  #: rooms of the package that decide no result


def sources() -> dict[str, Path]:
    """Files by their place in the package, which is the same wherever it is installed."""
    return {
        place + file.relative_to(folder).as_posix(): file
        for place, folder in _folders().items()
        for file in folder.rglob("*.py")
    }


@functools.cache
def sources_hash(*without: str) -> str:
    """Hash of the sources that decide results; ``without`` names further rooms that do not."""
    hasher = hashlib.sha256()
    for name, file in sorted(sources().items()):
        if not name.startswith((*SHOWN_ONLY, *without)):
            hasher.update(f"{name} ".encode())
            hasher.update(file.read_bytes())
    return hasher.hexdigest()


def is_grainlaw(file: str | None) -> bool:
    """Whether a file is one of grainlaw."""
    return bool(file) and (str(file).startswith(_below()) or os.path.realpath(str(file)).startswith(_below()))


@functools.cache
def _folders() -> dict[str, Path]:
    """Of each part of the package, whether it is loaded or not: the hash is the same in every process."""
    found = {"": Path(str(grainlaw.__file__)).parent}
    for name in COMPONENTS:
        spec = importlib.util.find_spec(f"grainlaw.{name}")
        if spec and spec.origin:
            found[f"{name}/"] = Path(spec.origin).parent
    return found


@functools.cache
def _below() -> tuple[str, ...]:
    folders = {str(folder.absolute()) for folder in _folders().values()}
    return tuple(folder + os.sep for folder in sorted(folders | {os.path.realpath(folder) for folder in folders}))
