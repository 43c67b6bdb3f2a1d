"""Copies of a user's files of laws, materials and grains in the folder of a run, to repeat the run from there alone."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from grainlaw.cli.configuration import Configuration
from grainlaw.cli.sections import Sections
from grainlaw.runs.claim import GRAIN_FILES, LAW_FILES, MATERIAL_FILES, TEST_FILES

#: where the files of a section's type are copied to; a configuration calls them so, too
COPIES = {"law": LAW_FILES, "rock": MATERIAL_FILES, "test": TEST_FILES}


def copied(
    reference: str, files: Sequence[Path], folder: Path, inside: str = LAW_FILES
) -> tuple[str, list[dict[str, Any]]]:
    """Copy the files of ``FILE.py:LAW`` to a folder, ``inside`` one; the reference there, and the record of each file.

    What a law reads beside Python files, such as a table of numbers, is not copied. Raises OSError.
    """
    if not files:
        return reference, []
    home = files[0].resolve().parent
    record = [_copied(file, folder, Path(inside) / file.resolve().relative_to(home)) for file in files]
    return f"{inside}/{files[0].name}:{reference.rpartition(':')[2]}", record


def copied_files(
    chosen: Configuration, sections: Mapping[str, Mapping[str, Any]], folder: Path
) -> tuple[Sections, dict[str, list[dict[str, Any]]]]:
    """Copy the files of a user that sections of a configuration name to a folder; the sections there, and the records.

    Raises OSError.
    """
    there, record = {name: dict(section) for name, section in sections.items()}, {}
    for name, inside in COPIES.items():
        if files := getattr(chosen, inside):
            there[name]["type"], record[inside] = copied(sections[name]["type"], files, folder, inside)
    if "sample" in there:
        there["sample"], record[GRAIN_FILES] = copied_grains(there["sample"], folder)
    return there, record


def copied_grains(sample: Mapping[str, Any], folder: Path) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Copy the file of a section [sample] to a folder, if it has one; the section there, and the record of the file.

    Raises OSError.
    """
    if "file" not in sample:
        return dict(sample), []
    file = Path(sample["file"])
    place = Path(GRAIN_FILES) / file.name
    return {**sample, "file": place.as_posix()}, [_copied(file, folder, place)]


def _copied(file: Path, folder: Path, place: Path) -> dict[str, Any]:
    """Copy a file to a place in a folder, unless it is that file; its record."""
    copy = folder / place
    copy.parent.mkdir(parents=True, exist_ok=True)
    if file.resolve() != copy.resolve():
        shutil.copyfile(file, copy)
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    return {"copy": place.as_posix(), "file": str(file.resolve()), "sha256": digest}
