"""Where the threads of one model wait for each other: a spin barrier, 0.3 us for two threads."""

from __future__ import annotations

import ctypes
import sys

from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.numba_private import atomic_add, atomic_load, atomic_store, call

SIZE = 32  #: length of the int64 array a barrier lives in; its two counters are in different cache lines


SPINS = 200  #: before the core is yielded: with more threads than cores, a spinning thread delays the one it waits for


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
