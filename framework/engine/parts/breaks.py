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
    before: Changing  #: (2, p) m, opening and slip beyond the elastic ones at the last sample at which it was whole
    source: Changing  #: (2, p) m, gained by them when waves have left its vicinity; nan until then


class Breaks(Part):
    """The record of breaks; ``passage`` (s) is the time that waves take to leave the vicinity of a break."""

    def __init__(self, points: int, passage: float) -> None:
        time, mode, work = (np.full(points, np.nan) for _ in range(3))
        self.books = BreakBooks(time, mode, work, np.zeros((2, points)), np.full((2, points), np.nan))
        self._passage = passage

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

    def whole(self, beyond: np.ndarray) -> None:
        """Take the motion beyond the elastic one, (2, p) m, of points that have not broken."""
        np.copyto(self.books.before, beyond, where=np.isnan(self.books.time))

    def waiting(self, time: float) -> np.ndarray:
        """(p,) whether points have broken so long before a sample at ``time`` (s) that their source is known now."""
        books = self.books
        return (books.time < time) & (books.time + self._passage <= time) & np.isnan(books.source[0])

    def settle(self, points: np.ndarray, beyond: np.ndarray) -> None:
        """Take the source of points, from their motion beyond the elastic one, (2, p) m, at this sample."""
        self.books.source[:, points] = beyond[:, points] - self.books.before[:, points]
