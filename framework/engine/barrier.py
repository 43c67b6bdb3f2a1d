"""Where the threads of one model wait for each other: a spin barrier, 0.3 us for two threads."""

from __future__ import annotations

import ctypes
import sys
from typing import Any

from numba import njit, types
from numba.extending import intrinsic

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.calls import call

SIZE = 32  #: length of the int64 array a barrier lives in; the two counters lie in different cache lines


def _pointer(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    return builder.gep(context.make_array(kind)(context, builder, array).data, [index])


@intrinsic
def atomic_add(typing: Any, array: Any, index: Any, value: Any) -> Any:
    """Add to an entry and return what it was."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = _pointer(context, builder, signature.args[0], args[0], args[1])
        return builder.atomic_rmw("add", place, args[2], "seq_cst")

    return types.int64(array, types.int64, types.int64), generate


@intrinsic
def atomic_load(typing: Any, array: Any, index: Any) -> Any:
    """Read an entry that another thread may write."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.load_atomic(_pointer(context, builder, signature.args[0], *args), "acquire", 8)

    return types.int64(array, types.int64), generate


@intrinsic
def atomic_store(typing: Any, array: Any, index: Any, value: Any) -> Any:
    """Write an entry that another thread may read."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = _pointer(context, builder, signature.args[0], args[0], args[1])
        builder.store_atomic(args[2], place, "release", 8)
        return context.get_dummy_value()

    return types.void(array, types.int64, types.int64), generate


SPINS = 2000  #: then give the core away: with more threads than cores, spinning delays the one waited for


@njit(**OPTIONS)
def wait(barrier, threads, pause):
    """Return when all ``threads`` have called; ``pause`` is the address of a function that yields the core."""
    if threads == 1:
        return
    generation = atomic_load(barrier, 16)
    if atomic_add(barrier, 0, 1) == threads - 1:
        atomic_store(barrier, 0, 0)
        atomic_add(barrier, 16, 1)
        return
    spins = 0
    while atomic_load(barrier, 16) == generation:
        spins += 1
        if spins > SPINS:
            call(pause, ())
            spins = 0


def pause_address() -> int:
    """Address of the system's function that yields the core."""
    if sys.platform == "win32":
        library = ctypes.windll.kernel32.SwitchToThread
    else:
        library = ctypes.CDLL(None).sched_yield
    return ctypes.cast(library, ctypes.c_void_p).value or 0
