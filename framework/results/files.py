"""Writing files so that, if the run is killed, the last complete one can still be read."""

from __future__ import annotations

import errno
import os
import re
import shutil
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

RESERVE = 32 * 2**20  #: bytes that pictures leave free for curves, summary and checkpoints, or a tenth of a small disk
PARAVIEW = "show_in_paraview.py"  #: not paraview.py, which would hide the module of that name from itself
RESULT = "result.npz"  #: in the folder of grainlaw test: all of a result, with its frames
Arrays = dict[str, np.ndarray]  #: of a file, by names such as curves/strain


class OutputWarning(UserWarning):
    """A file that could not be written while a run goes on."""


def warn(message: str) -> None:
    """Warn that something is not written."""
    warnings.warn(message, OutputWarning, stacklevel=3)


def check_room(folder: Path) -> None:
    """Raise OSError where so little room is left that pictures would take it from curves and summary."""
    disk = shutil.disk_usage(folder)
    if disk.free < min(RESERVE, disk.total // 10):
        raise OSError(errno.ENOSPC, f"only {disk.free / 2**20:.1f} MB are free", str(folder))


def write_atomically(
    path: Path, write: Callable[[Path], object], *, shared: bool = False, forced: bool = False
) -> None:
    """Let ``write`` fill a file next to ``path`` with the same ending, then rename it to ``path`` in one step.

    ``shared`` says that other processes may write the same file at the same time, ``forced`` that it must outlast a
    loss of power: it is on the disk before the rename, and its name is before this returns. Raises OSError, with the
    name of the file.
    """
    if not path.name:
        raise IsADirectoryError(errno.EISDIR, "a folder, not the name of a file", str(path))
    if not path.parent.is_dir():
        raise FileNotFoundError(errno.ENOENT, f"there is no folder '{path.parent}'", str(path))
    other = path.with_name(f".{path.stem}{f'.{os.getpid()}' if shared else ''}.part{path.suffix}")
    try:
        write(other)
        if forced:
            _force(other)
        os.replace(other, path)
        if forced and os.name != "nt":
            _force(path.parent)
    except OSError as error:
        raise OSError(error.errno or 0, error.strerror or str(error), str(path)) from None
    finally:
        other.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text by :func:`write_atomically`. Raises OSError."""
    write_atomically(path, lambda part: part.write_text(text, encoding="utf-8"))


def _force(place: Path) -> None:
    """Bring what was written to a file, or the names in a folder, to the disk."""
    opened = os.open(place, os.O_RDWR if os.name == "nt" else os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


def below(place: str, arrays: Mapping[str, np.ndarray]) -> Arrays:
    """The arrays whose names begin with a place, by the rest of their names."""
    return {name.removeprefix(f"{place}/"): row for name, row in arrays.items() if name.startswith(f"{place}/")}


def grouped(arrays: Mapping[str, np.ndarray]) -> dict[str, Arrays]:
    """The arrays whose names have several parts, by the first part, and by the rest of their names."""
    found: dict[str, Arrays] = {}
    for name, row in arrays.items():
        first, slash, rest = name.partition("/")
        if slash:
            found.setdefault(first, {})[rest] = row
    return found


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


def for_json(value: Any) -> Any:
    """What JSON has no word for: arrays as lists, all else as text."""
    return without_nan(value.tolist()) if hasattr(value, "tolist") else str(value)


def without_nan(value: Any) -> Any:
    """The same with None for numbers that are not finite, which JSON cannot hold."""
    if isinstance(value, Mapping):
        return {key: without_nan(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [without_nan(entry) for entry in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if np.isfinite(value) else None
    return int(value) if isinstance(value, np.integer) else value
