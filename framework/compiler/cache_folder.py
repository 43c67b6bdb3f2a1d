"""The folder of compiled code: one file per function, which nobody but its owner can write.

A file is a line of JSON and the object code after it. Object code is executed: whoever can write it can do all that
the user can. So it must be the user's own, and written by nobody else; a signature would guard no more, for its secret
would have to lie in a file that is guarded in the same way.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import sys
import time
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import attrs

from grainlaw.fields import ParameterError

LIMIT = 500  #: MB, if GRAINLAW_CACHE_LIMIT does not say otherwise
_OURS = re.compile(r"[0-9a-f]{40}\.code")
_UNFINISHED = re.compile(r"[0-9a-f]{40}\.[0-9a-f]{32}")
_ABANDONED = 3600.0  #: s, after which an unfinished file belongs to a process that was killed
_BY_OTHERS = 0o022  #: the bits of a mode by which group and others may write


class NotPrivateError(Exception):
    """A folder or file that somebody else can write."""


def cache_folder() -> Path:
    """Where compiled code is kept: ``GRAINLAW_CACHE``, or the user's cache folder."""
    if os.environ.get("GRAINLAW_CACHE"):
        return Path(os.environ["GRAINLAW_CACHE"])
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "grainlaw"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "grainlaw"


def limit() -> int:
    """Bytes that the folder may hold: ``GRAINLAW_CACHE_LIMIT`` in MB. Raises ParameterError."""
    text = os.environ.get("GRAINLAW_CACHE_LIMIT") or str(LIMIT)
    try:
        megabytes = float(text)
    except ValueError:
        megabytes = -1.0
    if not 0 <= megabytes < 1e12:
        raise ParameterError(
            f"GRAINLAW_CACHE_LIMIT = {text[:40]} is not allowed, it must be a number of megabytes from 0 to 1e12"
        )
    return int(megabytes * 1e6)


@attrs.frozen
class Folder:
    """The files of a cache; a name is 40 hexadecimal digits."""

    path: Path

    def check(self) -> None:
        """Raises :class:`NotPrivateError` where somebody else owns the folder, or may write there."""
        with contextlib.suppress(FileNotFoundError, NotADirectoryError):
            _check(os.stat(self.path), self.path)

    def read(self, name: str) -> tuple[dict[str, Any], bytes] | None:
        """Header and object code; None for what is missing or damaged. Raises :class:`NotPrivateError`."""
        path = self._path(name)
        try:
            self.check()
            with path.open("rb") as file:
                _check(os.fstat(file.fileno()), path)  # of what was opened: the name may be another's by now
                line, code = file.readline(), file.read()
        except OSError:
            return None
        try:
            header = json.loads(line)
            whole = (header.pop("name"), header.pop("sha256")) == (name, _digest(header, code))
        except (ValueError, KeyError, TypeError, AttributeError):
            return None
        if not whole:
            return None
        with contextlib.suppress(OSError):
            os.utime(path)  # the oldest that are removed are those not used for longest
        return header, code

    def write(self, name: str, header: dict[str, Any], code: bytes) -> None:
        """Write a file in one step, and remove the oldest above the limit. Raises OSError."""
        self.path.mkdir(mode=0o700, parents=True, exist_ok=True)
        self.check()
        line = json.dumps({**header, "name": name, "sha256": _digest(header, code)})
        beside = self.path / f"{name}.{uuid.uuid4().hex}"  # several processes may write the same
        try:
            handle = os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o600)
            with os.fdopen(handle, "wb") as file:
                file.write(line.encode() + b"\n" + code)
            os.replace(beside, self._path(name))
        finally:
            beside.unlink(missing_ok=True)
        self._trim(name)

    def files(self) -> list[tuple[Path, os.stat_result]]:
        """The functions kept, those used last at the end."""
        return sorted(_found(self.path, _OURS), key=lambda found: found[1].st_mtime)

    def clear(self) -> None:
        """Remove every file of the cache, and no other. Raises OSError."""
        for pattern in (_OURS, _UNFINISHED):
            for path, _ in _found(self.path, pattern):
                path.unlink(missing_ok=True)

    def _path(self, name: str) -> Path:
        return self.path / f"{name}.code"

    def _trim(self, kept: str) -> None:
        for path, status in _found(self.path, _UNFINISHED):
            if time.time() - status.st_mtime > _ABANDONED:
                _remove(path)
        files = self.files()
        above = sum(status.st_size for _, status in files) - limit()
        for path, status in files:
            if above <= 0:
                return
            if path != self._path(kept):
                _remove(path)
                above -= status.st_size


def _check(status: os.stat_result, path: Path) -> None:
    if not hasattr(os, "geteuid"):  # Windows: a user's own folders are closed to other users
        return
    if status.st_uid != os.geteuid():
        raise NotPrivateError(f"{path} belongs to another user (number {status.st_uid})")
    if status.st_mode & _BY_OTHERS:
        raise NotPrivateError(f"others may write to {path} (mode {status.st_mode & 0o777:o}: chmod go-w)")


def _digest(header: dict[str, Any], code: bytes) -> str:
    return hashlib.sha256(json.dumps(header, sort_keys=True).encode() + b"\n" + code).hexdigest()


def _found(folder: Path, pattern: re.Pattern[str]) -> Iterator[tuple[Path, os.stat_result]]:
    try:
        entries = list(os.scandir(folder))
    except (FileNotFoundError, NotADirectoryError):
        return
    for entry in entries:
        try:
            if pattern.fullmatch(entry.name):
                yield Path(entry.path), entry.stat()
        except FileNotFoundError:  # another process has just removed it
            continue


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):  # Windows, where another process reads it
        path.unlink(missing_ok=True)
