"""When and how contact points broke."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grainlaw.engine.parts.bonds import Bonds
from grainlaw.engine.parts.part import Changing, Part


class BreakBooks(NamedTuple):
    """Contact points (p); nan where unbroken."""

    time: Changing  #: (p,) s, to within one sample
    mode: Changing  #: (p,) share of shear
    work: Changing  #: (p,) J/m2 spent until then


class Breaks(Part):
    """The record of breaks."""

    def __init__(self, points: int) -> None:
        self.books = BreakBooks(*(np.full(points, np.nan) for _ in range(3)))

    def new(self, damage: np.ndarray) -> np.ndarray:
        """(p,) whether points have broken that are not in the record yet, from their damage (p,)."""
        return np.isnan(self.books.time) & (damage >= 1)

    def in_order(self) -> np.ndarray:
        """(k,) numbers of the points that have broken, in the order of breaking."""
        broken = np.flatnonzero(~np.isnan(self.books.time))
        return broken[np.argsort(self.books.time[broken], kind="stable")]

    def note(self, broken: np.ndarray, bonds: Bonds, time: float, mode: np.ndarray, traction: np.ndarray) -> None:
        """Record that points broke by ``time`` (s), with the mode (p,) and the tractions (2, p) Pa of all points.

        The energy that the springs of closure and friction store at that moment is not part of the recorded work.
        """
        books = self.books
        books.time[broken] = time
        books.mode[broken] = mode[broken]
        kn, ks = bonds.stiffness[:, broken]
        springs = traction[0, broken] ** 2 / (2 * kn) + traction[1, broken] ** 2 / (2 * ks)
        books.work[broken] = np.maximum(bonds.work[:, broken].sum(axis=0) - springs, 0.0)
