"""The folder of one run: curves, cracks, summary and checkpoints that are written while the run goes on."""

from __future__ import annotations

import errno
import math
import os
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from grainlaw.engine.state import State
from grainlaw.fields import ParameterError
from grainlaw.observation import Observer
from grainlaw.results.files import check_room, warn, write_atomically, write_text
from grainlaw.results.frames import Frame, packed, unpacked
from grainlaw.results.tables import as_csv, breaks, lines, write_json
from grainlaw.runs import checkpoint
from grainlaw.runs.checkpoint import Checkpoint, SavedMoment
from grainlaw.runs.claim import CHECKPOINT, FRAMES, RUN, Claim
from grainlaw.runs.record import key_of, made_with

SUMMARY = 10.0  #: s between summaries
AGAIN = 10.0  #: s until a file that could not be written is tried again


class _Table:
    """A CSV file that grows by whole rows; what fails is tried again after some seconds."""

    def __init__(self, file: Path) -> None:
        self.file, self.rows = file, 0
        self.columns: tuple[str, ...] = ()
        self.again = 0.0  #: when to try next
        self._stream: Any = None

    def grow(self, table: Mapping[str, np.ndarray]) -> None:
        """Bring the file up to a table, of which it has the first rows. Raises OSError."""
        self.again = time.monotonic() + AGAIN  # until it has gone well
        if self._stream is None or tuple(table) != self.columns:
            self.close()
            write_text(self.file, as_csv(table))
            self._stream = self.file.open("ab", buffering=0)
        else:
            self._append(lines(values[self.rows :] for values in table.values()).encode())
        self.rows, self.columns, self.again = len(next(iter(table.values()), ())), tuple(table), 0.0

    def _append(self, text: bytes) -> None:
        """All of it or nothing: a row that does not fit is cut off again."""
        before = os.fstat(self._stream.fileno()).st_size
        try:
            if self._stream.write(text) != len(text):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self.file))
        except OSError:
            self._stream.truncate(before)
            raise

    def close(self) -> None:
        if self._stream is not None:
            self._stream.close()
            self._stream = None


class RunFolder:
    """Writes what a run has; what cannot be written is warned of once, tried again later, and stops no run."""

    def __init__(self, claim: Claim, every: float, key: str) -> None:
        self.path, self.every, self.key = claim.path, every, key
        self._claim: Claim | None = claim  #: until it has begun
        self._curves, self._cracks = _Table(self.path / "curves.csv"), _Table(self.path / "cracks.csv")
        self._frames = 0
        self._last_summary = self._last_checkpoint = time.monotonic()
        self.failed: set[str] = set()  #: files that could not be written

    # --- while the run goes on ---------------------------------------------------------------------------------------

    def sample(self, curves: Mapping[str, np.ndarray], state: State, *, last: bool = False) -> None:
        """After each sample: its row of the curves, and the points that have broken."""
        if self._claim is not None and not last:
            self._claim.begins()
            self._claim = None
        now = math.inf if last else time.monotonic()
        if now >= self._curves.again:
            self._try("curves.csv", lambda: self._curves.grow(curves))
        new = self._cracks.rows != np.count_nonzero(~np.isnan(state.broken_time)) or not self._cracks.columns
        if new and now >= self._cracks.again:
            self._try("cracks.csv", lambda: self._cracks.grow(breaks(state)))

    def keep(self, frames: Sequence[Frame]) -> None:
        """Write the frames that are not written yet."""
        for number in range(self._frames, len(frames)):
            self._try(FRAMES, lambda k=number: self._write_frame(k, frames[k]))  # type: ignore[misc]
        self._frames = len(frames)

    def _write_frame(self, number: int, frame: Frame) -> None:
        check_room(self.path)
        folder = self.path / FRAMES
        folder.mkdir(exist_ok=True)
        arrays = packed(frame)
        write_atomically(
            folder / f"{number:04d}.npz", lambda path: np.savez(path, allow_pickle=False, **arrays), forced=True
        )

    def summary_is_due(self) -> bool:
        """Whether it is time for a summary."""
        return time.monotonic() - self._last_summary > SUMMARY

    def summarize(self, properties: Mapping[str, Any], status: str) -> None:
        """Write the properties so far; ``status`` is running, finished, or why the run ended otherwise."""
        self._last_summary = time.monotonic()
        unfinished = {} if status == "finished" else {"incomplete": status}
        self._try(
            "summary.json", lambda: write_json(self.path / "summary.json", {"properties": properties, **unfinished})
        )

    def checkpoint_is_due(self) -> bool:
        """Whether it is time for a checkpoint."""
        return time.monotonic() - self._last_checkpoint > self.every

    def checkpoint(self, moment: SavedMoment, curves: Mapping[str, np.ndarray], observers: Sequence[Observer]) -> None:
        """Write a checkpoint; where that fails, the one before is still there."""
        file = self.path / CHECKPOINT
        self._try(CHECKPOINT, lambda: checkpoint.save(file, self.key, made_with(), moment, curves, observers))
        self._last_checkpoint = time.monotonic()

    def close(self) -> None:
        """Close the files."""
        self._curves.close()
        self._cracks.close()

    def _try(self, name: str, write: Callable[[], None]) -> None:
        try:
            write()
        except OSError as error:
            if name not in self.failed:
                warn(f"{self.path / name} cannot be written ({error.strerror or error}); the run goes on")
            self.failed.add(name)
        else:
            self.failed.discard(name)

    # --- going on ----------------------------------------------------------------------------------------------------

    def frames(self, count: int, nodes: np.ndarray) -> list[Frame]:
        """The first ``count`` frames of a specimen with these nodes, from their files.

        Those that cannot be read are warned of and left out.
        """
        found = []
        for number in range(count):
            file = self.path / FRAMES / f"{number:04d}.npz"
            try:
                with np.load(file, allow_pickle=False) as stored:
                    found.append(unpacked({name: stored[name] for name in stored.files}, nodes))
            except Exception as error:  # zipfile, zlib and numpy have each their own errors for a damaged file
                warn(f"a picture of the run before is missing, {file}: {error}")
        self._frames = count if len(found) == count else 0  # all are written again, one after the other
        return found


def checkpoint_of(folder: Path, key: str) -> Checkpoint | None:
    """The checkpoint in a folder, or None. Raises :class:`ParameterError` where another run lies there."""
    file = folder / CHECKPOINT
    found = checkpoint.load(file) if file.exists() else None
    there = key_of(folder) if found is None else found.key
    if there not in (None, key):
        raise ParameterError(
            f"{file if found else folder / RUN} belongs to another run: specimen, law, test, options or the version of "
            "grainlaw differ; give those of before, or begin anew (overwrite)"
        )
    if found is None:
        return None
    differ = [name for name, value in made_with().items() if found.made_with.get(name) != value]
    if differ:
        warn(f"{file} was written with other {', '.join(differ)}: the last digits may differ from one unstopped run")
    return found
