"""Writing files so that a kill at any moment leaves the last complete one readable."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Let ``write`` fill a file beside ``path`` with the same ending, then put it in place in one step."""
    beside = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        write(beside)
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def file_name(name: str) -> str:
    """A name of the user's as part of a file's: with _ for what a file system may refuse."""
    return re.sub(r'[\\/:*?"<>|\x00-\x1f]', "_", name)


def writable_folder(folder: str | os.PathLike[str]) -> Path:
    """Make a folder, with its parents, and make sure that files can be written there. Raises OSError."""
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / ".grainlaw"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise OSError(f"cannot write to the folder '{path}': {error.strerror or error}") from None
    return path


def without_nan(value: Any) -> Any:
    """The same with null for what is not a finite number, as JSON has no other way."""
    if isinstance(value, Mapping):
        return {key: without_nan(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [without_nan(entry) for entry in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value
