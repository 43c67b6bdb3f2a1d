"""The steady motion of a stage: the velocities that go with its drives. What moves beside it is vibration.

With it is kept the softest motion, with which the search for the next stability margin begins.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grainlaw.engine.parts.drives import Drives
from grainlaw.engine.parts.freedoms import Freedoms
from grainlaw.engine.parts.heat import EvenTemperature
from grainlaw.engine.parts.part import Changing, Part


class SteadyBooks(NamedTuple):
    """Rows (r) of freedoms (n)."""

    field: Changing  #: (r, n) m/s where the drives move at the speeds of the stage, times a pace of 1
    pace: Changing  #: (1,) by which they are multiplied
    share: Changing  #: (1,) of it that counts: 0 while a speed rises, then 1
    mark: Changing  #: (r, n) m, displacement from which the mean motion counts
    since: Changing  #: (1,) s, when that was
    settled: Changing  #: (r, n) m, displacement when the softest motion was settled last, or the stage began
    temperature: Changing  #: (1,) °C, at that time
    softest: Changing  #: (q,) the motion of the last stability margin; empty before there is one


class Steady(Part):
    """The steady motion: at first that of the static solution, then the mean of the motion over some time."""

    any_length = ("softest",)

    def __init__(self, freedoms: Freedoms, heat: EvenTemperature) -> None:
        self._freedoms, self._heat = freedoms, heat
        zeros = np.zeros_like(freedoms.arrays.mass)
        self.books = SteadyBooks(
            zeros, np.ones(1), np.ones(1), zeros.copy(), np.zeros(1), zeros.copy(), np.zeros(1), np.zeros(0)
        )

    @property
    def pace(self) -> float:
        """By which the speeds of all drives are multiplied."""
        return float(self.books.pace[0])

    def soften(self, motion: np.ndarray) -> None:
        """Keep the motion (q,) of a stability margin."""
        self.books = self.books._replace(softest=motion)

    @property
    def velocity(self) -> np.ndarray:
        """(r, n) m/s."""
        return self.pace * self.books.share[0] * self.books.field

    def start(self, field: np.ndarray, pace: float, time: float, *, rises: bool) -> None:
        """A field (r, n) m/s, of another stage, which counts when its speed no longer ``rises``."""
        self.soften(np.zeros(0))
        self.books.settled[:] = self._freedoms.arrays.displacement
        self.books.field[:], self.books.pace[0] = field, pace
        self.rise(time, done=not rises)

    @property
    def rises(self) -> bool:
        """Whether the speed rises, so that nothing is steady."""
        return self.books.share[0] == 0

    def rise(self, time: float, *, done: bool) -> None:
        """Go on to rise, or end to do so at a time (s)."""
        self.books.share[0] = done
        self._mark(time)

    def _mark(self, time: float) -> None:
        self.books.mark[:], self.books.since[0] = self._freedoms.arrays.displacement, time
        self.books.temperature[0] = self._heat.temperature

    def follow(self, driven: Drives, speeds: np.ndarray, time: float, least: float) -> bool:
        """If ``least`` (s) have passed, take the mean motion of this time for the steady motion; whether they have.

        ``speeds`` (columns,) m/s are those of the schedule; the mean is divided by how far drives have moved, or by the
        change of the temperature.
        """
        if time - self.books.since[0] < least:
            return False
        moved, at = self._freedoms.arrays.displacement - self.books.mark, driven.arrays
        wanted = speeds[at.column]
        if self._heat.target is None:
            travel = float(np.sum(moved[at.row, at.place] * wanted) / np.sum(wanted**2))
        else:
            travel = abs(self._heat.temperature - float(self.books.temperature[0]))
        if travel > 0:
            self.books.field[:] = moved / travel
        self._mark(time)
        return True

    def damp_beside(self, beside: bool) -> None:
        """Let damping see velocities beside the steady motion, or, if not ``beside``, all of them."""
        f = self._freedoms.arrays
        f.imposed[:] = np.where(f.free > 0, beside * self.velocity, f.imposed)

    def vibration(self) -> float:
        """J, kinetic energy of the motion beside the steady motion."""
        f = self._freedoms.arrays
        return float(0.5 * np.sum(f.mass * (f.velocity - self.velocity) ** 2))
