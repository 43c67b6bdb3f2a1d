"""The answer of one contact along a path of opening and slip."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from grainlaw.compiler.batch import compile_law
from grainlaw.contact import ContactLaw, answered, memory_names


@attrs.frozen(eq=False)
class Trace:
    """Answer of one contact along a path: arrays of equal length, the memory under its own names."""

    opening: np.ndarray  #: m
    slip: np.ndarray  #: m
    normal: np.ndarray  #: Pa, tension positive
    shear: np.ndarray  #: Pa
    work: np.ndarray  #: J/m2 done on the contact since the first point
    memory: dict[str, np.ndarray]

    def __getattr__(self, name: str) -> np.ndarray:
        if not name.startswith("_") and name in self.memory:
            return self.memory[name]
        raise AttributeError(f"a trace has opening, slip, normal, shear, work and {', '.join(self.memory)}; not {name}")


def trace(law: ContactLaw, opening: Any, slip: Any, *, compiled: bool = False) -> Trace:
    """Drive one contact alone along arrays of ``opening`` and ``slip`` (m; either may be a single number).

    Interpreted, or through the ``compiled`` code a simulation runs; both agree to 1e-12. Raises TypeError for a law
    that returns anything but its two tractions and its memory.
    """
    opening, slip = (np.array(a, dtype=float) for a in np.broadcast_arrays(np.atleast_1d(opening), np.atleast_1d(slip)))
    names = memory_names(law)
    respond = compile_law(law).respond if compiled else law.traction
    rows = np.empty((2 + len(names), len(opening)))
    state = (0.0,) * len(names)
    for i in range(len(opening)):
        answer = answered(law, names, respond(float(opening[i]), float(slip[i]), *state))
        rows[:, i] = answer
        state = answer[2:]
    normal, shear = rows[:2]
    steps = (normal[1:] + normal[:-1]) / 2 * np.diff(opening) + (shear[1:] + shear[:-1]) / 2 * np.diff(slip)
    work = np.concatenate([[0.0], np.cumsum(steps)])
    return Trace(opening, slip, normal, shear, work, dict(zip(names, rows[2:], strict=True)))
