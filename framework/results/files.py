"""Writing files so that, if the run is killed, the last complete one can still be read."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Let ``write`` fill a file next to ``path`` with the same ending, then rename it to ``path`` in one step."""
    other = path.with_name(f".{path.stem}.part{path.suffix}")
    try:
        write(other)
        os.replace(other, path)
    finally:
        other.unlink(missing_ok=True)


def file_name(name: str) -> str:
    """A name given by the user, as part of a file name: _ replaces what a file system may refuse."""
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
    """The same with None for numbers that are not finite, which JSON cannot hold."""
    if isinstance(value, Mapping):
        return {key: without_nan(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [without_nan(entry) for entry in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value
