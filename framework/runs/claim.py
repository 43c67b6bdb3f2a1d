"""The claim of a run to a folder: locked while it runs, refused where another run's files are."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import attrs
from filelock import FileLock, Timeout

from grainlaw.fields import ParameterError
from grainlaw.results.files import PARAVIEW, RESULT, file_name, writable_folder
from grainlaw.runs.progress_file import PROGRESS

RUN, CHECKPOINT, FRAMES, LOCK = "run.json", "checkpoint.npz", "frames", ".grainlaw.lock"
STUDY = "study.json"  #: of a study, in whose folder no run of its own lies
LAW_FILES = "law_files"  #: folder of the copies of a user's law files, with folders of their own
MATERIAL_FILES = "material_files"  #: the same of materials
TEST_FILES = "test_files"  #: and of tests
GRAIN_FILES = "grain_files"  #: folder of the copy of the file that grains were read from

REPLACED = ".replaced"  #: folder of a run that is being replaced, until the new one has its first sample
WHOLE = "whole"  #: in it: a file that says that all of the old run lies there

#: files that people have, too: where no run has written them they are not replaced without being asked to
COMMON = ("config.toml", "summary.json", "curves.csv", "cracks.csv", "report.html", RESULT)
#: what only a restart needs
FOR_RESTART = (CHECKPOINT, f"{FRAMES}/*.npz", FRAMES)
INTERACTIVE, ANIMATION, CERTIFICATE = "interactive.html", "cracks.gif", "certificate.json"
#: what commands make of a run beside what it writes itself
EXTRAS = (PARAVIEW, CERTIFICATE, INTERACTIVE, ANIMATION)
#: what runs write to their folders, and --overwrite removes; the record last, for it says that this is a run
WRITTEN = (
    *FOR_RESTART, PROGRESS, "watch.html", *COMMON, *EXTRAS, "comparison.png", "cracks_*.png",
    f"{LAW_FILES}/**/*", LAW_FILES, f"{MATERIAL_FILES}/**/*", MATERIAL_FILES, f"{TEST_FILES}/**/*", TEST_FILES,
    f"{GRAIN_FILES}/*", GRAIN_FILES,
    *(f"{name}{end}" for name in ("grains", "cracks", "contacts") for end in (".pvd", "_*.vtu")), RUN,
)  # fmt: skip


@attrs.frozen
class Claim:
    """A folder that is a run's own; ``about`` is what a command adds to the record of the run."""

    path: Path
    restart: bool = False  #: whether to go on with the run that the folder holds
    about: dict[str, Any] = attrs.field(factory=dict)
    outer: Path | None = None  #: the folder of several runs that this one lies in
    others: tuple[str, ...] = ()  #: names of what lay in the folder, and is of no run

    def inside(self, name: str) -> Claim:
        """A folder in this one, for one run of several. Raises OSError."""
        return Claim(writable_folder(self.path / file_name(name)), self.restart, outer=self.path)

    def begins(self) -> None:
        """The run has its first sample: what it replaces is removed."""
        shutil.rmtree((self.outer or self.path) / REPLACED, ignore_errors=True)


Folder = str | os.PathLike[str] | Claim | None


def check_file_names(where: str, names: Iterable[str]) -> None:
    """Refuse names that would share a folder. Raises :class:`ParameterError`."""
    known: dict[str, str] = {}
    for name in names:
        folder = file_name(name).lower()  # some file systems know no capital letters
        if folder in known or not folder.strip(". "):
            other = f": '{known[folder]}' would have the same folder" if folder in known else ""
            raise ParameterError(f"{where}: '{name}' is not allowed as a name{other}")
        known[folder] = name


@contextmanager
def claimed(
    folder: str | os.PathLike[str] | Claim, *, restart: bool = False, overwrite: bool = False,
    about: Mapping[str, Any] | None = None,
) -> Iterator[Claim]:  # fmt: skip
    """A folder that is this run's own for as long as the context lasts; one that is already stays so.

    Raises :class:`ParameterError` where another process writes to it, or where it holds a run, or files by names of
    its own, and neither ``restart`` nor ``overwrite`` is asked for; OSError where it cannot be written.
    """
    if restart and overwrite:
        raise ParameterError("restart and overwrite are not allowed together: go on with a run, or begin anew")
    if isinstance(folder, Claim):
        yield folder
        return
    path = writable_folder(folder)
    lock = FileLock(path / LOCK)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        raise ParameterError(f"the folder '{path}' is in use: another run writes to it now") from None
    try:
        for rest in (*path.glob(".*.part*"), *path.glob("*/.*.part*")):  # of a run that was killed
            rest.unlink(missing_ok=True)
        _bring_back(path)  # a run that was to replace it ended before it had begun
        if (path / STUDY).exists():
            raise ParameterError(f"the folder '{path}' holds a study: choose another folder")
        if not restart and not overwrite:
            _refuse_what_is_there(path)
        there = {each.name for each in path.iterdir() if not each.name.startswith(".")}
        others = there - {each.relative_to(path).parts[0] for each in _of_runs(path)}
        if overwrite:
            _set_aside(path)
        yield (claim := Claim(path, restart, dict(about or {}), others=tuple(sorted(others))))
        claim.begins()  # of a run without samples, too
    finally:
        _bring_back(path)
        lock.release()


def _refuse_what_is_there(folder: Path) -> None:
    if (folder / RUN).exists():
        raise ParameterError(
            f"the folder '{folder}' holds a run ({_run_of(folder)}): choose another folder, go on with that run "
            "(--restart), or replace it (--overwrite)"
        )
    if there := [name for name in COMMON if (folder / name).exists()]:
        raise ParameterError(
            f"the folder '{folder}' has {', '.join(there)}, which no run has written and this one would replace: "
            "choose another folder, or replace them (--overwrite)"
        )


def _set_aside(folder: Path) -> None:
    """Move what a run has written to a folder, and to those in it that hold runs, into one of its own."""
    if not (folder / RUN).exists():
        return
    for each in _of_runs(folder):
        if _is_file(each):
            place = folder / REPLACED / each.relative_to(folder)
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(each, place)
        else:
            _remove(each)
    (folder / REPLACED / WHOLE).touch()


def _bring_back(folder: Path) -> None:
    """Undo it: a run that did not begin has replaced nothing."""
    aside = folder / REPLACED
    if not aside.is_dir():
        return
    if (aside / WHOLE).exists():  # what lies in the folder is of the new run
        for each in _of_runs(folder):
            _remove(each)
        (aside / WHOLE).unlink()
    for file in filter(_is_file, sorted(aside.rglob("*"))):
        place = folder / file.relative_to(aside)
        place.parent.mkdir(parents=True, exist_ok=True)
        os.replace(file, place)
    shutil.rmtree(aside)


def tidy(folder: Path) -> None:
    """Remove the checkpoint and the frames of a run that has come to its end; a folder without a run is left alone."""
    if (folder / RUN).exists():
        for each in _of_run(folder, FOR_RESTART):
            _remove(each)


def _of_runs(folder: Path) -> Iterator[Path]:
    """What runs have written to a folder and to those in it that hold runs, and these; contents before their folder."""
    inner = [each for each in sorted(folder.iterdir()) if each.name != REPLACED and (each / RUN).exists()]
    for place in inner:
        yield from _of_run(place, WRITTEN)
        yield place
    yield from _of_run(folder, WRITTEN)


def _of_run(folder: Path, patterns: Iterable[str]) -> Iterator[Path]:
    for pattern in patterns:
        yield from sorted(folder.glob(pattern), reverse=True)  # what is in a folder before the folder


def _is_file(path: Path) -> bool:
    return path.is_symlink() or not path.is_dir()


def _remove(path: Path) -> None:
    """Remove a file, or a folder that is empty."""
    if _is_file(path):
        path.unlink()
    elif not any(path.iterdir()):
        path.rmdir()


def _run_of(folder: Path) -> str:
    """What the record of a folder says about its run, in some words."""
    try:
        record = json.loads((folder / RUN).read_text(encoding="utf-8"))
        status = "killed" if record["status"] == "running" else record["status"]  # nobody holds the lock
        return f"of {record['started'][:16].replace('T', ' ')}, {status}"
    except (OSError, ValueError, KeyError, TypeError):
        return "whose record cannot be read"
