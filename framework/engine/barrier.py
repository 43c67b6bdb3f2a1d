"""Where the threads of one model wait for each other: a spin barrier, 0.3 us for two threads."""

from __future__ import annotations

import ctypes
import sys
from typing import NamedTuple

from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.numba_private import atomic_add, atomic_load, atomic_store, call

SIZE = 32  #: length of the int64 array a barrier lives in; its two counters are in different cache lines


SPINS = 200  #: before the core is yielded: with more threads than cores, a spinning thread delays the one it waits for
YIELDS = 400  #: before it is given up: beside another busy process the scheduler comes back to who only yields
REST = 20  #: us, for which it is given up then


class Pauses(NamedTuple):
    """Addresses of the system's functions by which a waiting thread lets others run."""

    give_way: int  #: yields the core
    sleep: int  #: gives it up for the time that is its argument; both are called with that


@njit(**OPTIONS)
def wait(barrier, threads, pauses):
    """Return when all ``threads`` have called."""
    if threads == 1:
        return
    generation = atomic_load(barrier, 16)
    if atomic_add(barrier, 0, 1) == threads - 1:
        atomic_store(barrier, 0, 0)
        atomic_add(barrier, 16, 1)
        return
    spins, yields = 0, 0
    while atomic_load(barrier, 16) == generation:
        spins += 1
        if spins > SPINS:
            call(pauses.give_way if yields < YIELDS else pauses.sleep, (REST,))
            spins, yields = 0, yields + 1


def pauses() -> Pauses:
    """Those of this system."""
    if sys.platform == "win32":
        functions = [ctypes.windll.kernel32.SwitchToThread] * 2
    else:
        library = ctypes.CDLL(None)
        functions = [library.sched_yield, library.usleep]
    return Pauses(*(ctypes.cast(function, ctypes.c_void_p).value or 0 for function in functions))
