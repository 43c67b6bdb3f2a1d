"""A law whose loop does not end, found before anything waits for it."""

from __future__ import annotations

import threading

import numpy as np

from grainlaw.compiler.batch import CompilationError, Compiled, compile_law
from grainlaw.contact import ContactLaw
from grainlaw.fields import ParameterError

SECONDS = 10.0  #: for all points; a law without an endless loop needs some milliseconds
SIZES = 10.0 ** np.arange(-12, 1, 2)  #: m
DISPLACEMENTS = [0.0, *(sign * 0.927 * size for size in SIZES.tolist() for sign in (1, -1))]
POINTS = [(opening, slip) for opening in DISPLACEMENTS for slip in DISPLACEMENTS]


def refuse_endless(law: ContactLaw, compiled: Compiled | None = None) -> None:
    """Raise :class:`ParameterError`, with opening and slip, for a law that does not return; ask those with a loop only.

    The compiled code is asked, in a thread that is left behind if it does not return.
    """
    if compiled is None:
        try:
            compiled = compile_law(law)
        except CompilationError:  # it is told elsewhere what cannot be compiled
            return
    if not compiled.loops:
        return
    asked: list[tuple[float, float]] = []
    thread = threading.Thread(target=_ask, args=(compiled, asked), daemon=True)
    thread.start()
    thread.join(SECONDS)
    if thread.is_alive():
        opening, slip = asked[-1]
        raise ParameterError(
            f"{type(law).__name__}: at opening {opening:.4g} m, slip {slip:.4g} m the law did not return within "
            f"{SECONDS:g} s: a loop in its code does not end"
        )


def _ask(compiled: Compiled, asked: list[tuple[float, float]]) -> None:
    """Each point from a virgin contact, and all of them one after the other."""
    path = np.zeros((max(len(compiled.memory), 1), 1))
    for point in POINTS:
        asked.append(point)
        for memory in (np.zeros_like(path), path):
            compiled.call(np.array([point[0]]), np.array([point[1]]), memory)
