"""A file that says how far something is, for those who look from another terminal."""

from __future__ import annotations

import contextlib
import json
import os
import platform
import time
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import psutil

from grainlaw.results.files import file_name, without_nan, write_text

PROGRESS = "progress.json"  #: in the folder of a run
FOLDER = "progress"  #: in that of a study: a file for each process that carries out cases
OFTEN = 0.5  #: s between two contents
SAME = 60.0  #: s by which the beginning of a process may seem to move, as clocks are set
SILENT = 3600.0  #: s after which nobody writes a file any more


def this_process() -> dict[str, Any]:
    """By which others find out whether this process still runs."""
    return {"host": platform.node(), "pid": os.getpid(), "began": psutil.Process().create_time()}


def lives(process: Any) -> bool | None:
    """Whether a process of :func:`this_process` still runs; None where that cannot be seen: on another computer."""
    if not isinstance(process, Mapping) or process.get("host") != platform.node():
        return None
    try:
        found = psutil.Process(int(process["pid"]))
        same = abs(found.create_time() - float(process["began"])) < SAME
        return same and found.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False
    except (psutil.Error, KeyError, TypeError, ValueError, OverflowError):
        return None


class ProgressFile:
    """One file, whole at every moment; what cannot be written is left out, for it is only for the eye.

    As a context it is removed at the end, and says in ``status`` how something ended that did not come to its end.
    """

    def __init__(self, file: Path, about: Mapping[str, Any] | None = None) -> None:
        self.file, self.about = file, dict(about or {})
        self._content: dict[str, Any] = {}
        self._told = 0.0

    @property
    def is_due(self) -> bool:
        """Whether the last content is not new any more."""
        return time.monotonic() - self._told >= OFTEN

    def tell(self, **content: Any) -> None:
        """Write another content."""
        self._told, self._content = time.monotonic(), content
        with contextlib.suppress(OSError):
            self.file.parent.mkdir(exist_ok=True)
            write_text(self.file, json.dumps(without_nan({**self.about, **content}), allow_nan=False))

    def __enter__(self) -> ProgressFile:
        return self

    def __exit__(self, _: type | None, error: BaseException | None, __: TracebackType | None) -> None:
        if error is not None:
            self.tell(**self._content, status=str(error) or type(error).__name__)
            return
        with contextlib.suppress(OSError):
            self.file.unlink(missing_ok=True)
            self.file.parent.rmdir()  # where no other process has a file


def forget_ended(folder: Path, **of: Any) -> None:
    """Remove what processes have left in the folder of a study that have ended; of those that told of this alone."""
    for file in (folder / FOLDER).glob("*.json"):
        told = read(file)
        ended = told is None or told.get("status") or lives(told.get("process")) is False or silent(file) > SILENT
        if ended and all((told or of).get(name) == value for name, value in of.items()):
            with contextlib.suppress(OSError):
                file.unlink()
                file.parent.rmdir()  # where no other process has a file


def of_process(folder: Path, about: Mapping[str, Any]) -> ProgressFile:
    """That of this process in the folder of a study; those of processes that have ended are removed."""
    process = this_process()
    forget_ended(folder)
    name = file_name(f"{process['host']}-{process['pid']}.json")
    return ProgressFile(folder / FOLDER / name, {"process": process, **about})


def read(file: Path) -> dict[str, Any] | None:
    """The content of a file of JSON that others write; None where there is none, or no whole one."""
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) else None


def silent(file: Path) -> float:
    """Seconds since a file was last written; infinite where there is none."""
    try:
        return max(time.time() - file.stat().st_mtime, 0.0)
    except OSError:
        return float("inf")
