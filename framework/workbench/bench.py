"""A law on the bench: its scale and its answers along all paths, each found once, and what breaks a property of it."""

from __future__ import annotations

import functools
from typing import Any

import attrs
import numpy as np

from grainlaw.contact import ContactLaw
from grainlaw.workbench.driver import alone
from grainlaw.workbench.paths import Corners, designed_paths, even_steps, random_paths
from grainlaw.workbench.refined import Response, drive
from grainlaw.workbench.scale import Scale, measure

LAPS = 3  #: of every path, the last of them settled
#: The first path of all, and the last one once more: pulled, sheared, and sheared while pressed, out and back.
FIRST = [(u * o, u * s) for o, s in ((1, 0), (0, 1), (-1e-3, 1)) for u in (0, 1e-7, 1e-6, 1e-5, 1e-3, 1e-6, 0)]


@attrs.frozen
class Finding:
    """A broken property: where, and by how much."""

    text: str
    size: float = 0.0


def place(point: Any) -> str:
    """A point of a path in words."""
    return f"opening {words(point[0], 'm')}, slip {words(point[1], 'm')}"


def words(value: Any, unit: str) -> str:
    """A number for a report: lengths in um, tractions in MPa."""
    factor, shown = {"m": (1e6, "um"), "Pa": (1e-6, "MPa"), "J/m2": (1.0, "J/m2")}[unit]
    return f"{float(value) * factor:.4g} {shown}"


class Bench:
    """A law with its scale and its answers along all paths."""

    def __init__(self, law: ContactLaw) -> None:
        self.law = law
        self.contact = alone(law)
        self.first = self.contact.run(FIRST)

    @functools.cached_property
    def scale(self) -> Scale:
        return measure(self.contact)

    @functools.cached_property
    def paths(self) -> dict[str, Corners]:
        """All paths in even steps."""
        corners = designed_paths(self.scale) | random_paths(self.scale, 3)
        return {name: even_steps(c, 12) for name, c in corners.items()}

    @functools.cached_property
    def answers(self) -> dict[str, np.ndarray]:
        """Answers (i, 2 + m) along ``paths``."""
        return {name: self.contact.run(path) for name, path in self.paths.items()}

    @functools.cached_property
    def drives(self) -> list[Response]:
        """Laps of all paths, in steps as fine as the tractions ask for."""
        corners = designed_paths(self.scale) | random_paths(self.scale, 4)
        return [drive(self.contact, name, [*c, *list(c[1:]) * (LAPS - 1)], self.scale) for name, c in corners.items()]

    def memory(self, answers: np.ndarray, name: str) -> np.ndarray:
        return answers[:, 2 + self.contact.names.index(name)]


def label(bench: Bench, column: Any) -> str:
    """Name of a column of answers."""
    return ("normal traction", "shear traction", *bench.contact.names)[column]
