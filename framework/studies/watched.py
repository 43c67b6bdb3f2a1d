"""What is to be seen of a run, a comparison, a study or a calibration in its folder: read, never written.

No lock is taken, and a file that is missing or half written is no error: the next look may find it.
"""

from __future__ import annotations

import csv
import json
import math
import os
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from grainlaw.columns import SHEAR_CRACKS, TENSILE_CRACKS, leading, readings
from grainlaw.fields import ParameterError
from grainlaw.results.files import without_nan
from grainlaw.runs.claim import CHECKPOINT, RUN, STUDY
from grainlaw.runs.progress_file import FOLDER, PROGRESS, lives, read, silent
from grainlaw.studies.store import CASES, KILLED, PACKS

RUNNING, FINISHED, STOPPED, FAILED, UNKNOWN, WAITING = "running", "finished", "stopped", "failed", "unknown", "waiting"
AGAIN = "the command of before"  #: where nothing says which that was
HEARD = 120.0  #: s for which what another computer does counts as going on
#: of the command calibrate: its study, its answer, and that as a page
TESTS, NUMBERS, ANSWER = "tests", "calibration.json", "report.html"


@attrs.frozen
class Part:
    """One run, or one case of a study; SI."""

    name: str
    state: str
    share: float = 0.0  #: of its present stage
    where: str = ""  #: the stage, and the last readings
    left: float = 0.0  #: s that it still takes; 0 where that is not known
    cracks: int | None = None  #: broken contact points
    reason: str = ""  #: why it failed or was stopped
    columns: tuple[str, ...] = ()  #: how far a test is, and what it applies
    rows: tuple[tuple[float, ...], ...] = ()  #: of these columns, as far as they are


@attrs.frozen
class Watched:
    """What is known of a folder."""

    folder: str
    kind: str  #: test, comparison, study or calibration
    state: str
    share: float  #: of all runs or cases that are done
    left: float = 0.0  #: s for all of it; 0 where that is not known
    done: int = 0  #: runs or cases
    total: int = 0  #: of which it may be fewer in a calibration; 0 where that is not known
    parts: tuple[Part, ...] = ()
    reason: str = ""  #: why it ended, if it did not come to its end
    again: str = ""  #: how to go on with it
    said: tuple[str, ...] = ()  #: by a calibration: what it has found, and what it does now

    @property
    def is_over(self) -> bool:
        """Whether nothing more comes."""
        return self.state in (FINISHED, STOPPED, FAILED)

    @property
    def content(self) -> dict[str, Any]:
        """All of it as JSON holds it."""
        return without_nan(attrs.asdict(self))


def watched(folder: str | os.PathLike[str]) -> Watched:
    """What a folder holds. Raises :class:`ParameterError` where that is no run and no study."""
    path = Path(folder)
    if (path / RUN).exists() and not _is_study(path):
        return _runs(path)
    for place in (path, path / TESTS):
        if _is_study(place):
            return _study(path, place)
    looked = f"{RUN} (a test or a comparison), {STUDY} (a study) and {TESTS}/{STUDY} (a calibration)"
    what = "holds no run that has begun" if path.is_dir() else "is no folder"
    raise ParameterError(f"'{path}' {what}: looked for {looked}")


def _is_study(path: Path) -> bool:
    return (path / STUDY).exists() or bool(_told(path))


# --- runs -------------------------------------------------------------------------------------------------------------


def _runs(path: Path) -> Watched:
    """One run, or several beside each other."""
    record = read(path / RUN) or {}
    names = [str(name) for name in record.get("runs") or ()]
    state, reason = _state(record, path)
    parts = tuple(_part(path / name, name) for name in names) or (_part(path, _name(record, path)),)
    ended = [part for part in parts if part.state in (FINISHED, FAILED)]
    share = sum(1.0 if part in ended else part.share for part in parts) / len(parts)
    return Watched(
        str(path), "comparison" if names else "test", state, 1.0 if state == FINISHED else share,
        _left(path, parts) if state == RUNNING else 0.0, len(ended), len(parts), parts, reason,
        again=_again(record, "--restart") if state == STOPPED else "",
    )  # fmt: skip


def _state(record: Mapping[str, Any], path: Path) -> tuple[str, str]:
    """Of a run, from its record and its process; and why it did not come to its end."""
    status = str(record.get("status") or UNKNOWN)
    writes = status == FINISHED and "command" in record and (path / CHECKPOINT).exists()  # which it removes in the end
    if status == FINISHED and not writes:
        return FINISHED, ""
    if status not in (RUNNING, FINISHED):
        unknown = status == UNKNOWN
        return UNKNOWN if unknown else STOPPED if record.get("stopped") else FAILED, "" if unknown else status
    files = [*path.glob("*.*"), *path.glob("*/curves.csv")]
    return _alive(record.get("process"), min(map(silent, files), default=math.inf))


def _alive(process: Any, silence: float) -> tuple[str, str]:
    """State of what says that it goes on, and why it does not."""
    alive = lives(process)
    if alive:
        return RUNNING, ""
    host = process.get("host", "") if isinstance(process, Mapping) else ""
    if alive is None:
        known = f"nothing was written for {silence / 60:.0f} min; whether it goes on cannot be seen here"
        return (RUNNING, "") if silence < HEARD else (UNKNOWN, known + (f", it was begun on '{host}'" if host else ""))
    return STOPPED, f"its process {process['pid']} has died"


def _part(path: Path, name: str) -> Part:
    """One run by the files of its folder."""
    record, told = read(path / RUN), read(path / PROGRESS) or {}
    if record is None:
        return Part(name, WAITING)
    state, reason = _state(record, path)
    columns, rows, cracks = _curve(path / "curves.csv")
    share, left = (_number(told.get(key)) if state == RUNNING else 0.0 for key in ("share", "left"))
    if state != RUNNING:
        share = 1.0 if state == FINISHED else _number(told.get("share"))
    where = str(told.get("where") or "") or readings(columns, rows[-1] if rows else ())
    return Part(name, state, share, where, left, cracks, reason, columns, rows)


def _left(path: Path, parts: tuple[Part, ...]) -> float:
    """s for all runs: those that wait take as long as the others, as many at a time as now."""
    going = [part for part in parts if part.state == RUNNING]
    if not going or not all(part.left for part in going):
        return 0.0
    spent = [part.left + _of(path, parts, part, PROGRESS, "seconds") for part in going]
    spent += [_of(path, parts, part, RUN, "duration") for part in parts if part.state == FINISHED]
    waiting = sum(part.state == WAITING for part in parts) * sum(spent) / len(spent)
    return max(*(part.left for part in going), (sum(part.left for part in going) + waiting) / len(going))


def _of(path: Path, parts: tuple[Part, ...], part: Part, file: str, name: str) -> float:
    """A number of a file of one run, which has a folder of its own where there are several."""
    place = path / part.name if len(parts) > 1 else path
    return _number((read(place / file) or {}).get(name))


def _name(record: Mapping[str, Any], path: Path) -> str:
    command = record.get("command")
    arguments = command.get("arguments") if isinstance(command, Mapping) else None
    protocol = record.get("protocol")
    named = arguments.get("name") if isinstance(arguments, Mapping) else None
    return str(named or (protocol.get("type") if isinstance(protocol, Mapping) else "") or path.resolve().name)


def _curve(file: Path) -> tuple[tuple[str, ...], tuple[tuple[float, ...], ...], int | None]:
    """How far a test is and what it applies, at each sample, and its cracks; the last line counts when it is whole."""
    try:
        text = file.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return (), (), None
    lines = list(csv.reader(text[: text.rfind("\n") + 1].splitlines()))
    heads, *body = lines or [[]]
    names = leading(heads)
    rows = [row for row in body if len(row) == len(heads)]
    if not names or not rows:
        return tuple(names), (), None
    numbers = tuple(tuple(_number(row[heads.index(name)]) for name in names) for row in rows)
    counted = [_number(rows[-1][heads.index(n)]) for n in (TENSILE_CRACKS, SHEAR_CRACKS) if n in heads]
    return tuple(names), numbers, int(sum(counted)) if counted else None


def _number(value: Any) -> float:
    """A finite number, 0 for anything else."""
    try:
        found = float(value)
    except (TypeError, ValueError, OverflowError):
        return 0.0
    return found if math.isfinite(found) else 0.0


def _again(record: Mapping[str, Any], option: str = "") -> str:
    """How to go on with what a record says was begun."""
    program = [str(word) for word in record.get("program") or ()]
    command = Path(program[0]).name if program else ""
    if command in ("grainlaw", "grainlaw.exe", "__main__.py"):
        words = [word for word in program[1:] if word not in ("--overwrite", option)]
        return shlex.join(["grainlaw", *words, *([option] if option else [])])
    return f"run {command or 'the program'} again" + (" with restart=True" if option else "")


# --- studies ----------------------------------------------------------------------------------------------------------


def _told(store: Path) -> dict[Path, dict[str, Any]]:
    """What each process says that carries out cases."""
    found = {file: read(file) for file in sorted((store / FOLDER).glob("*.json")) if not file.name.startswith(".")}
    return {file: told for file, told in found.items() if told is not None}


def _study(path: Path, store: Path) -> Watched:
    """A study, or a calibration, whose study is in a folder of its own: by what its processes say."""
    kept, states, parts = _kept(store), [], []
    every = _told(store)
    for file, told in every.items():
        ended = str(told.get("status") or "")
        state, reason = (STOPPED, ended) if ended else _alive(told.get("process"), silent(file))
        states.append((state, reason, told))
        parts += [_case(each, state) for kind in ("doing", "last") for each in told.get(kind) or ()
                  if isinstance(each, Mapping)]  # fmt: skip
    kind = "study" if path == store else "calibration"
    if not states:
        if kind == "calibration" and not (path / NUMBERS).exists():
            return Watched(
                str(path), kind, STOPPED, 0.0, done=kept, reason="no process is at work, and it has no answer"
            )
        return Watched(str(path), kind, FINISHED, 1.0, done=kept)
    order = (RUNNING, UNKNOWN, STOPPED)
    state, reason, told = min(states, key=lambda each: order.index(each[0]))
    wholes = [each[2]["whole"] for each in states if isinstance(each[2].get("whole"), Mapping)]
    counted = wholes or _once_each([each[2] for each in states])
    done, total = (int(sum(_number(each.get(key)) for each in counted)) for key in ("done", "total"))
    left = max(_number(each.get("left")) for each in counted) if state == RUNNING else 0.0
    return Watched(
        str(path), "calibration" if wholes else kind, state, done / total if total else 0.0, left,
        done, total, tuple(parts), reason, _again(told) if state == STOPPED else "",
        tuple(str(words) for each in wholes for words in each.get("said") or ()),
    )  # fmt: skip


def _once_each(told: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Of processes that carry out the same cases, the one that is farthest; others by their own parts of a study."""
    found: dict[str, Mapping[str, Any]] = {}
    for number, each in enumerate(told):
        key = json.dumps(each.get("shard", number))
        if key not in found or _number(each.get("done")) > _number(found[key].get("done")):
            found[key] = each
    return list(found.values())


def _case(told: Mapping[str, Any], whole: str) -> Part:
    """A case that a worker is at or has done."""
    name = str(told.get("name", ""))
    if "state" in told:
        state = FINISHED if told["state"] in (FINISHED, "same") else FAILED
        words = f"{told['state']}: {told.get('reason') or ''}" if state == FAILED else ""
        return Part(name, state, 1.0, reason=words)
    cracks, columns = told.get("cracks"), tuple(map(str, told.get("columns") or ()))
    rows = (row for row in told.get("rows") or () if isinstance(row, list) and len(row) == len(columns))
    return Part(
        name, whole, _number(told.get("share")), str(told.get("where") or "starting"), _number(told.get("left")),
        None if cracks is None else int(_number(cracks)), "", columns, tuple(tuple(map(_number, row)) for row in rows),
    )  # fmt: skip


def _kept(store: Path) -> int:
    """Cases that a store has."""
    loose = sum(not file.name.endswith(f".{KILLED}.json") for file in store.glob(f"{CASES}/*/*.json"))
    packed = 0
    for index in store.glob(f"{PACKS}/[0-9]*.index"):
        try:
            packed += max(len(index.read_text(encoding="ascii").splitlines()) - 1, 0)
        except (OSError, ValueError):
            continue
    return loose + packed
