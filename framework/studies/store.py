"""What keeps the cases of a study: a folder with a row of each and a file for each run, or a program's memory."""

from __future__ import annotations

import io
import json
import math
import os
import stat
import time
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
from filelock import FileLock, Timeout

from grainlaw.fields import ParameterError
from grainlaw.results.archive import from_bytes
from grainlaw.results.files import warn, writable_folder, write_atomically, write_text
from grainlaw.runs.claim import LOCK, STUDY

if TYPE_CHECKING:
    from grainlaw.results.result import Result

FORMAT = 2  #: raise when a store of before could not be read any more
CASES, RUNS, PACKS = "cases", "runs", "packs"
KILLED = "killed"
WRITTEN = "written"  #: s since 1970, of a row: which of several cases with equal factors is the last
END = "end"  #: of an index, with the number of its lines before
LOOSE = 2000  #: files of cases from which they are packed
PACKED = 1000  #: cases in a pack
LARGE = 64e6  #: bytes of a row that no study writes
ABANDONED = 3600.0  #: s after which a half-written file is nobody's
_HEX = frozenset("0123456789abcdef")


@attrs.frozen(slots=True)
class StoredCase:
    """What is known of a case without reading its row."""

    run: str  #: key of its run, empty where there is none
    status: str
    pack: int = -1  #: number of its pack
    start: int = 0  #: place of its row there
    size: int = 0


class Store:
    """A folder that cases are written to, by any number of processes at a time.

    A file is written beside its place and renamed, the row of a case after the file of its run, and never changed: at
    every moment the folder holds whole cases. Some thousands of them are packed: a text of rows, an archive of runs,
    and last their index. A case that was killed has a row of its own kind, which that of a later try replaces.

    What cannot be read, as after a loss of power, or is not what its name says, is missing: it is warned of, and run
    again. ``damaged`` are the files.
    """

    def __init__(self, folder: str | os.PathLike[str], *, make: bool = True, about: Mapping[str, Any] | None = None):
        """Raises :class:`ParameterError` for a folder that is no store, or that of another version; OSError."""
        self.path = Path(folder)
        self.damaged: list[str] = []
        self.about = self._about(make, about or {})
        if (written := self.about["format"]) != FORMAT:
            raise ParameterError(f"{self.path} is a store of format {written}; this version of grainlaw has {FORMAT}")
        for name in (CASES, RUNS, PACKS):
            (self.path / name).mkdir(exist_ok=True)
        self.entries: dict[bytes, StoredCase] = {}
        self._packs: dict[int, _Pack] = {}  #: that were looked at; a pack is never changed
        self.refresh()

    def _about(self, make: bool, about: Mapping[str, Any]) -> dict[str, Any]:
        """What the folder says about itself; said again where that cannot be read."""
        file = self.path / STUDY
        try:
            found = json.loads(_content(file, LARGE))
            if isinstance(found, dict) and "format" in found:
                return found
        except (OSError, ValueError, RecursionError):
            pass
        if not all((self.path / name).is_dir() for name in (CASES, RUNS, PACKS)):
            self._refuse_other()
            if not make:
                raise ParameterError(f"the folder '{self.path}' is no store of a study: it has no {STUDY}")
        writable_folder(self.path)
        text = json.dumps({"format": FORMAT, **about}, indent=2) + "\n"
        write_text(file, text)
        return {"format": FORMAT, **about}

    def _refuse_other(self) -> None:
        if self.path.exists() and not self.path.is_dir():
            raise ParameterError(f"'{self.path}' is a file; a study needs a folder")
        if self.path.is_dir() and any(self.path.iterdir()):
            raise ParameterError(f"the folder '{self.path}' is not empty and no store of a study: it has no {STUDY}")

    # --- what is there -----------------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """Look again what is there; other processes may have written."""
        loose = list(_loose(self.path / CASES))  # first: what is packed meanwhile is in a pack that is looked at later
        packs = [self._pack(number) for number in self._pack_numbers()]
        found = {case: entry for pack in packs for case, entry in pack.entries.items()}
        damaged = {case: file for pack in packs for case, file in pack.damaged.items()}
        sizes: dict[str, set[Any]] = {}  #: that the file of a run may have: cases that give one run write it each
        for case, killed in loose:
            if killed:
                found.setdefault(case, StoredCase("", KILLED))
            elif case not in found or found[case].pack < 0:
                try:
                    row = self._loose_row(case.hex())
                except (OSError, ValueError):
                    damaged[case] = str(self._case_file(case.hex()))
                    continue
                if row is not None:
                    found[case] = StoredCase(str(row["run"] or ""), str(row["status"]))
                    sizes.setdefault(found[case].run, set()).add(dict(row.get("cost") or {}).get("bytes"))
        runs = {key for pack in packs for key in pack.runs}
        for case, entry in list(found.items()):  # a row without the run that it names is none
            if entry.run and entry.run not in runs and not self._has_run(entry.run, sizes.get(entry.run, {None})):
                damaged[case] = str(self._run_file(entry.run))
                del found[case]
        self.entries = found
        self._warn([file for case, file in damaged.items() if case not in found])

    def _has_run(self, key: str, sizes: set[Any]) -> bool:
        """Whether the file of a run is there, as large as it was written, if that is known."""
        try:
            file = self._run_file(key)
            return _is_file(file) and not sizes.isdisjoint((None, file.stat().st_size))
        except OSError:
            return False

    def _warn(self, files: list[str]) -> None:
        """Once of each file."""
        new = [file for file in dict.fromkeys(files) if file not in self.damaged]
        self.damaged += new
        if new:
            more = f", nor {len(new) - 1} others" if len(new) > 1 else ""
            warn(f"{new[0]} cannot be read{more}: what they hold of the study is missing, and is run again")

    def __len__(self) -> int:
        return len(self.entries)

    def __contains__(self, case: str) -> bool:
        """Whether a case is finished: it has a row, and was not killed."""
        entry = self.entries.get(bytes.fromhex(case))
        return entry is not None and entry.status != KILLED

    def status(self, case: str) -> str:
        """How a case ended, empty where it is not there."""
        entry = self.entries.get(bytes.fromhex(case))
        return "" if entry is None else entry.status

    def cases(self) -> Iterator[str]:
        """The keys of all cases."""
        return (case.hex() for case in list(self.entries))

    def row(self, case: str) -> dict[str, Any]:
        """The row of a case. Raises KeyError."""
        found = next(self.rows([case]))
        if found is None:
            raise KeyError(case)
        return found

    def rows(self, cases: Iterable[str]) -> Iterator[dict[str, Any] | None]:
        """The rows of cases in their order, None for those that are not there."""
        texts: dict[int, Any] = {}
        try:
            for case in cases:
                entry = self.entries.get(bytes.fromhex(case))
                if entry is not None and entry.pack < 0:
                    try:
                        row = self._loose_row(case)
                    except (OSError, ValueError):
                        row = None
                    if row is not None:
                        yield row
                        continue
                    self.refresh()  # it was packed meanwhile
                    entry = self.entries.get(bytes.fromhex(case))
                if entry is None or entry.pack < 0:
                    yield None
                    continue
                if entry.pack not in texts:
                    if len(texts) > 64:
                        texts.pop(next(iter(texts))).close()
                    texts[entry.pack] = (self.path / PACKS / f"{entry.pack:06d}.jsonl").open("rb")
                texts[entry.pack].seek(entry.start)
                yield json.loads(texts[entry.pack].read(entry.size))
        finally:
            for text in texts.values():
                text.close()

    def _loose_row(self, case: str) -> dict[str, Any] | None:
        """None where there is no file. Raises ValueError, OSError for one that cannot be read."""
        for file in (self._case_file(case), self._case_file(case, killed=True)):
            try:
                return _row(_content(file, LARGE), case)
            except FileNotFoundError:
                continue
        return None

    def run_of(self, case: str) -> bytes:
        """The file of the run of a case. Raises KeyError where there is none, as for a case that failed."""
        key = str(self.row(case)["run"] or "")
        if not key:
            raise KeyError(case)
        try:
            return _content(self._run_file(key))
        except (OSError, ValueError):
            pass
        first = self.entries[bytes.fromhex(case)].pack
        for number in (first, *self._pack_numbers()):  # one run may be that of cases in several packs
            if number < 0:
                continue
            try:
                with zipfile.ZipFile(self.path / PACKS / f"{number:06d}.zip") as archive:
                    return archive.read(f"{key}.npz")
            except (KeyError, OSError, zipfile.BadZipFile):
                continue
        raise KeyError(key)

    def result(self, case: str) -> Result:
        """The run of a case, without frames. Raises KeyError where there is none, ParameterError for a damaged one."""
        return from_bytes(self.run_of(case), f"{self.path}: the run")

    # --- writing -----------------------------------------------------------------------------------------------------

    def write(self, row: Mapping[str, Any], run: bytes | None) -> None:
        """Add a case. Raises OSError where it cannot be written; the store is then as before."""
        case, killed = str(row["case"]), row["status"] == KILLED
        if case in self:
            return
        if run is not None:
            _write(self._run_file(str(row["run"])), run)
        file = self._case_file(case, killed=killed)
        _write(file, json.dumps({**row, WRITTEN: time.time()}, allow_nan=False).encode())
        if not killed:
            self._case_file(case, killed=True).unlink(missing_ok=True)
        self.entries[bytes.fromhex(case)] = StoredCase("" if killed else str(row["run"]), str(row["status"]))

    def pack(self, least: int = LOOSE) -> int:
        """Pack cases where there are at least so many loose ones; the number packed. Another process's packing wins."""
        lock = FileLock(self.path / LOCK)
        try:
            lock.acquire(blocking=False)
        except Timeout:
            return 0
        try:
            self._sweep()
            packed = {case for number in self._pack_numbers() for case in self._pack(number).entries}
            done = 0
            loose = []
            for case, killed in _loose(self.path / CASES):
                if killed:
                    continue
                if case in packed:  # packed by a process that was killed before it removed the files
                    self._remove([case.hex()])
                else:
                    loose.append(case.hex())
            if len(loose) >= max(least, 1):
                self.refresh()
                loose = [case for case in loose if bytes.fromhex(case) in self.entries]  # others are written again
            while len(loose) >= max(least, 1):
                some, loose = loose[:PACKED], loose[PACKED:]
                self._write_pack(some)
                done += len(some)
        finally:
            lock.release()
        if done:
            self.refresh()
        return done

    def _write_pack(self, cases: list[str]) -> None:
        number = max(self._pack_numbers(), default=0) + 1
        rows = {case: self._case_file(case).read_bytes() for case in cases}
        runs = {str(json.loads(text).get("run") or "") for text in rows.values()}
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_STORED) as together:
            for key in sorted(runs):
                if key and self._run_file(key).exists():
                    together.writestr(zipfile.ZipInfo(f"{key}.npz"), self._run_file(key).read_bytes())
        index, start = [], 0
        for case, text in rows.items():
            row = json.loads(text)
            index.append(f"{case} {row.get('run') or '-'} {row['status']} {start} {len(text)} {zlib.crc32(text):08x}\n")
            start += len(text) + 1
        place = self.path / PACKS / f"{number:06d}"
        _write(place.with_suffix(".zip"), archive.getvalue())
        _write(place.with_suffix(".jsonl"), b"".join(text + b"\n" for text in rows.values()))
        _write(place.with_suffix(".index"), "".join([*index, f"{END} {len(index)}\n"]).encode())
        self._remove(cases, runs)

    def _remove(self, cases: Iterable[str], runs: Iterable[str] = ()) -> None:
        for file in (*map(self._case_file, cases), *(self._run_file(key) for key in runs if key)):
            file.unlink(missing_ok=True)

    def _sweep(self) -> None:
        """Remove files that were half written when their process was killed."""
        for file in self.path.glob("*/**/.*.part*"):
            try:
                if time.time() - file.stat().st_mtime > ABANDONED:
                    file.unlink()
            except FileNotFoundError:  # renamed meanwhile
                continue

    # --- places ------------------------------------------------------------------------------------------------------

    def _case_file(self, case: str, killed: bool = False) -> Path:
        return self.path / CASES / case[:2] / f"{case}{f'.{KILLED}' if killed else ''}.json"

    def _run_file(self, key: str) -> Path:
        return self.path / RUNS / key[:2] / f"{key}.npz"

    def _pack_numbers(self) -> list[int]:
        return sorted(int(file.stem) for file in (self.path / PACKS).glob("[0-9]*.index"))

    def _pack(self, number: int) -> _Pack:
        """What is in a pack, each row held to its checksum; known once it was looked at."""
        if number not in self._packs:
            self._packs[number] = self._looked_at(number)
        return self._packs[number]

    def _looked_at(self, number: int) -> _Pack:
        place = self.path / PACKS / f"{number:06d}"
        index, text, archive = (place.with_suffix(end) for end in (".index", ".jsonl", ".zip"))
        pack = _Pack()
        try:
            lines = _content(index).decode("ascii").splitlines()
            rows = _content(text)
        except (OSError, ValueError):
            self._warn([str(index if not _is_file(index) else text)])
            return pack
        try:
            if not _is_file(archive):
                raise ValueError("it is no file")
            with zipfile.ZipFile(archive) as together:
                pack.runs.update(name.removesuffix(".npz") for name in together.namelist())
        except (OSError, ValueError, zipfile.BadZipFile):
            self._warn([str(archive)])
        if lines and lines[-1] == f"{END} {len(lines) - 1}":
            lines.pop()
        else:
            self._warn([str(index)])
        for line in lines:
            try:
                case, run, status, start, size, checksum = line.split(" ")
                key, first, last = bytes.fromhex(case), int(start), int(start) + int(size)
                run, right = "" if run == "-" else run, zlib.crc32(rows[first:last]) == int(checksum, 16)
            except ValueError:
                self._warn([str(index)])
                continue
            if len(key) != 32 or not right or not _HEX.issuperset(run):
                pack.damaged[key] = str(text)
                continue
            pack.entries[key] = StoredCase(run, status, number, first, last - first)
        return pack


class InMemory:
    """The same for as long as a program runs, without a folder."""

    def __init__(self, about: Mapping[str, Any] | None = None) -> None:
        self.about = dict(about or {})
        self._rows: dict[str, Mapping[str, Any]] = {}
        self._runs: dict[str, bytes | Result] = {}

    def __contains__(self, case: str) -> bool:
        """Whether a case is finished."""
        return case in self._rows and self._rows[case]["status"] != KILLED

    def cases(self) -> Iterator[str]:
        """The keys of all cases."""
        return iter(self._rows)

    def row(self, case: str) -> Mapping[str, Any]:
        """The row of a case. Raises KeyError."""
        return self._rows[case]

    def rows(self, cases: Iterable[str]) -> Iterator[Mapping[str, Any] | None]:
        """The rows of cases in their order, None for those that are not there."""
        return map(self._rows.get, cases)

    def write(self, row: Mapping[str, Any], run: bytes | Result | None) -> None:
        """Add a case, with the run as a result or as the content of its file."""
        self._rows[str(row["case"])] = row
        if run is not None:
            self._runs[str(row["run"])] = run

    def result(self, case: str) -> Result:
        """The run of a case. Raises KeyError where there is none."""
        run = self._runs[str(self._rows[case]["run"])]
        return from_bytes(run, "the run") if isinstance(run, bytes) else run


Kept = Store | InMemory  #: what a study's cases are kept in


@attrs.frozen
class _Pack:
    """What is known of a pack."""

    entries: dict[bytes, StoredCase] = attrs.field(factory=dict)
    damaged: dict[bytes, str] = attrs.field(factory=dict)  #: the file, by case
    runs: set[str] = attrs.field(factory=set)


def _is_file(file: Path) -> bool:
    """Whether it is one itself: no link, no device."""
    try:
        return stat.S_ISREG(file.lstat().st_mode)
    except FileNotFoundError:
        return False


def _content(file: Path, most: float = math.inf) -> bytes:
    """Of a file. Raises FileNotFoundError, OSError, ValueError for a link, a device, or ``most`` bytes or more."""
    about = file.lstat()
    if not stat.S_ISREG(about.st_mode) or about.st_size >= most:
        raise ValueError(f"{file} is no file, or too large")
    return file.read_bytes()


def _row(text: bytes, case: str) -> dict[str, Any]:
    """The row of a case. Raises ValueError for another text."""
    try:
        row = json.loads(text)
    except RecursionError:
        raise ValueError("it is nested too deep") from None
    if not isinstance(row, dict) or row.get("case") != case or not {"run", "status", "factors"} <= set(row):
        raise ValueError("it is no row of this case")
    if row["run"] and not (isinstance(row["run"], str) and _HEX.issuperset(row["run"])):
        raise ValueError("its run is no key")
    return row


def _loose(folder: Path) -> Iterator[tuple[bytes, bool]]:
    """Cases that have a file of their own, and whether they were killed."""
    for inner in os.scandir(folder):
        for entry in os.scandir(inner.path) if inner.is_dir(follow_symlinks=False) else ():
            case, _, rest = entry.name.partition(".")
            if rest in ("json", f"{KILLED}.json") and len(case) == 64 and _HEX.issuperset(case):
                yield bytes.fromhex(case), rest != "json"


def _write(file: Path, content: bytes) -> None:
    """Raises OSError, also where the disk is full."""
    file.parent.mkdir(exist_ok=True)
    write_atomically(file, lambda other: other.write_bytes(content), shared=True, forced=True)
