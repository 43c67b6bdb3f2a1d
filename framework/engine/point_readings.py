"""What may be read of the contact points of bonds in a running specimen."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np

from grainlaw.arguments import Checked
from grainlaw.engine.parts.bonds import Bonds
from grainlaw.engine.parts.breaks import Breaks


class PointReadings(metaclass=Checked):
    """What :class:`~grainlaw.engine.state.State` shows of contact points ``p``: the first points of all bonds, then the
    second.
    """

    bonds: Bonds
    breaks: Breaks

    @property
    @abstractmethod
    def steps(self) -> int:
        """Steps done."""

    @property
    @abstractmethod
    def positions(self) -> np.ndarray:
        """(i, 2) m."""

    @abstractmethod
    def displacement_at_forces(self) -> np.ndarray:
        """(2, i) m, at the moment of the last forces."""

    @property
    def opening(self) -> np.ndarray:
        """(p,) m."""
        return self._at_points(self.bonds.arrays.opening, 0)

    @property
    def slip(self) -> np.ndarray:
        """(p,) m."""
        return self._at_points(self.bonds.arrays.slip, 1)

    @property
    def normal(self) -> np.ndarray:
        """(p,) Pa, tension positive; 0 at bonds that a contact has replaced."""
        return self._at_points(self.bonds.arrays.normal)

    @property
    def shear(self) -> np.ndarray:
        """(p,) Pa; 0 at bonds that a contact has replaced."""
        return self._at_points(self.bonds.arrays.shear)

    def _at_points(self, rows: np.ndarray, motion: int | None = None) -> np.ndarray:
        """(p,) from the last step; at replaced bonds ``motion`` of their points, or 0."""
        row, replaced = rows[(self.steps + 1) % 2], self.bonds.books.replaced
        if not replaced.any():
            return row
        moved = 0.0 if motion is None else self.bonds.motion(self.displacement_at_forces())[motion]
        return np.where(np.tile(replaced, 2), moved, row)

    @property
    def replaced(self) -> np.ndarray:
        """(c,) whether a contact has taken the place of a bond, in the order of ``bonds.order``."""
        return self.bonds.books.replaced

    def memory(self, name: str) -> np.ndarray:
        """(p,) one variable of the laws' memory; zero where a law has no such memory."""
        return self.bonds.memory(name, np.zeros(2 * len(self.bonds)))

    @property
    def mode(self) -> np.ndarray:
        """(p,) share of shear in the damage: by the law itself, or from the work done in opening and in slip."""
        work = np.maximum(self.bonds.work, 0)
        return self.bonds.memory("mode", work[1] / np.maximum(work.sum(axis=0), 1e-300))

    @property
    def stiffness(self) -> np.ndarray:
        """(2, p) Pa/m: kn and ks of the first response, as the laws declare them."""
        return self.bonds.stiffness

    @property
    def contact_lengths(self) -> np.ndarray:
        """(p,) m: half the length of the bond."""
        return self.bonds.lengths

    @property
    def contact_positions(self) -> np.ndarray:
        """(p, 2) m: middle of the half of the bond that belongs to each point, on the deformed specimen."""
        ends = self.positions[self.bonds.ends]
        first, second = (ends[:, 0] + ends[:, 2]) / 2, (ends[:, 1] + ends[:, 3]) / 2
        return np.concatenate([0.75 * first + 0.25 * second, 0.25 * first + 0.75 * second])

    @property
    def broken_time(self) -> np.ndarray:
        """(p,) s to within one sample, nan where unbroken."""
        return self.breaks.books.time

    @property
    def broken_mode(self) -> np.ndarray:
        """(p,) share of shear at breaking."""
        return self.breaks.books.mode

    @property
    def broken_work(self) -> np.ndarray:
        """(p,) J/m2 spent until the point broke."""
        return self.breaks.books.work
