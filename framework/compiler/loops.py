"""Loops in a component's code: where they are, and how to wait for code that has one."""

from __future__ import annotations

import dis
import functools
import threading
import types
from collections.abc import Callable, Iterable
from typing import Any

from grainlaw.compiler.fingerprint import reached

WAIT = 0.05  #: s between looks whether a call is done; meanwhile Ctrl-C reaches the thread that waits


def has_loop(functions: Iterable[Any]) -> bool:
    """Whether a function, or a helper that it reaches, jumps back: without that it always ends."""
    return any(_jumps_back(function.__code__) for function in reached(*functions))


@functools.cache
def _jumps_back(code: types.CodeType) -> bool:
    jumps = {*dis.hasjrel, *dis.hasjabs}
    if any(each.opcode in jumps and each.argval < each.offset for each in dis.get_instructions(code)):
        return True
    return any(_jumps_back(inner) for inner in code.co_consts if isinstance(inner, types.CodeType))


def interruptible(call: Callable[[], Any]) -> Any:
    """The result of compiled code that may never end.

    It runs in a thread of its own. A thread in compiled code cannot be stopped: after Ctrl-C it goes on until Python
    ends, which does not wait for it.
    """
    results: list[Any] = []
    thread = threading.Thread(target=lambda: results.append(_tried(call)), daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(WAIT)
    result, error = results[0]
    if error is not None:
        raise error
    return result


def _tried(call: Callable[[], Any]) -> tuple[Any, BaseException | None]:
    try:
        return call(), None
    except BaseException as error:  # it is raised in the thread that waits
        return None, error
