"""Copies of a user's law files in the folder of a run, so that the run can be repeated from there alone."""

from __future__ import annotations

import hashlib
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from grainlaw.runs.claim import LAW_FILES


def copied(reference: str, files: Sequence[Path], folder: Path) -> tuple[str, list[dict[str, Any]]]:
    """Copy the files of ``FILE.py:LAW`` to a folder; the reference there, and what the record says of each file.

    What a law reads beside Python files, such as a table of numbers, is not copied. Raises OSError.
    """
    if not files:
        return reference, []
    home, record = files[0].resolve().parent, []
    for file in files:
        place = Path(LAW_FILES) / file.resolve().relative_to(home)
        (folder / place).parent.mkdir(parents=True, exist_ok=True)
        if file.resolve() != (folder / place).resolve():
            shutil.copyfile(file, folder / place)
        digest = hashlib.sha256(file.read_bytes()).hexdigest()
        record.append({"copy": place.as_posix(), "file": str(file.resolve()), "sha256": digest})
    name = reference.rpartition(":")[2]
    return f"{LAW_FILES}/{files[0].name}:{name}", record
