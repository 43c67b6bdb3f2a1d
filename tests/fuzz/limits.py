"""One random case: it runs, or is refused in words, within a limit of time."""

from __future__ import annotations

import contextlib
import signal
import traceback
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

import attrs

import grainlaw as gl

SECONDS = 10
#: errors that the documents name
REFUSED = (gl.ParameterError, gl.TilingError, gl.CompilationError, gl.StageError, gl.InstabilityError, OSError)


@attrs.frozen
class Case:
    label: str
    run: Callable[[], object]
    shown: str


class TooLongError(BaseException):
    """No ``except Exception`` of the code under test catches it."""


def compiles(frame: FrameType | None) -> bool:
    """Whether numba is at work: it takes long on a busy machine, and left in the middle it keeps its locks for ever."""
    while frame is not None:
        if {"numba", "llvmlite"} & {*Path(frame.f_code.co_filename).parts}:
            return True
        frame = frame.f_back
    return False


@contextlib.contextmanager
def limit(seconds: float) -> Iterator[None]:
    """Raises :class:`TooLongError` after some time; while numba compiles, when that is done."""

    def stop(_: int, frame: FrameType | None) -> None:
        if compiles(frame):
            signal.setitimer(signal.ITIMER_REAL, 0.5)
            return
        raise TooLongError(f"not done in {seconds} s")

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def fault_of(case: Case, seconds: float = SECONDS) -> str:
    """What is wrong with how a case ends; nothing where it runs or is refused in one line."""
    try:
        with warnings.catch_warnings(), limit(seconds):
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", gl.UnitWarning)
            warnings.simplefilter("ignore", gl.CostWarning)  # words for a run that may be long
            case.run()
    except REFUSED as error:
        return "" if 0 < len(str(error)) < 700 and "\n" not in str(error) else f"{case.label}: says {str(error)!r:.900}"
    except TooLongError as error:
        frames = [Path(frame.filename).name for frame in traceback.extract_tb(error.__traceback__)]
        return (
            "" if "stepping.py" in frames else f"{case.label}: {case.shown}\nno end: {frames[-6:]}"
        )  # a run may be long
    except Exception:
        return f"{case.label}: {case.shown}\n{traceback.format_exc(limit=-4)}"
    return ""
