"""One contact of a law, driven by itself."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

import attrs
import numpy as np

from grainlaw.contact import ContactLaw, answered, memory_names
from grainlaw.parameter import parameters


class Contact:
    """A law's answer for one contact as floats; an error of the law is nan, and its words are kept."""

    def __init__(self, law: ContactLaw) -> None:
        self.law = law
        self.names = memory_names(law)
        self.start = (0.0,) * len(self.names)
        self.error = ""

    def step(self, opening: float, slip: float, state: Iterable[float]) -> tuple[float, ...]:
        """Normal, shear, then the memory. Raises TypeError for another number of results."""
        try:
            answer = self.law.traction(opening, slip, *state)
        except (ArithmeticError, ValueError) as error:
            self.error = f"{type(error).__name__}: {error}"
            return (math.nan,) * (2 + len(self.names))
        return answered(self.law, self.names, answer)

    def run(self, path: Iterable[tuple[float, float]]) -> np.ndarray:
        """Answers (i, 2 + m) to a sequence of openings and slips, from a fresh contact."""
        state, rows = self.start, []
        for opening, slip in path:
            answer = self.step(opening, slip, state)
            state = answer[2:]
            rows.append(answer)
        return np.array(rows)


def alone(law: Any) -> Contact:
    """One contact of a law. Raises TypeError for what is no law, ValueError where its numbers are not single ones."""
    if not isinstance(law, ContactLaw) or not attrs.has(type(law)):
        raise TypeError(f"this takes an instance of an attrs class that is a gl.ContactLaw, not {law!r}")
    if any(isinstance(value, list) for value in parameters(law).values()):
        name = type(law).__name__
        raise ValueError(f"{name}: give the law of one contact, and give single numbers instead of arrays")
    if not all(math.isfinite(k) and k > 0 for k in law.stiffness):
        raise ValueError(f"{type(law).__name__}.stiffness must be two positive numbers (Pa/m), not {law.stiffness!r}")
    return Contact(law)
