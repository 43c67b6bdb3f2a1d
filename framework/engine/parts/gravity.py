"""Gravity: a constant force on every freedom that is a translation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.engine.parts.freedoms import Freedoms
from grainlaw.engine.parts.imposed import Imposed
from grainlaw.engine.parts.part import Changing, Constant, Moment, Part, Split
from grainlaw.loads import Gravity


class GravityArrays(NamedTuple):
    """Rows (r) of freedoms (n)."""

    weight: Constant  #: (r, n) N
    share: Constant


class GravityBooks(NamedTuple):
    """What is recorded when the weight changes."""

    since: Changing  #: (r, n) m, displacement from which the work of the present weight counts
    done: Changing  #: (1,) J, of those before in this stage


@njit(**OPTIONS)
def add_weight(gravity, freedoms, thread):
    """Add the weight of a thread's freedoms to their force."""
    first, last = gravity.share[thread], gravity.share[thread + 1]
    if first < last:
        for row in range(freedoms.force.shape[0]):
            for n in range(first, last):  # of slices numba compiles a check of their shapes, with its words
                freedoms.force[row, n] += gravity.weight[row, n]


class Weight(Part):
    """The weight of all freedoms; without gravity the step skips it."""

    takes = (Gravity,)

    def __init__(self, freedoms: Freedoms, true_mass: np.ndarray) -> None:
        self._freedoms, self._mass = freedoms, true_mass
        zeros = np.zeros(freedoms.arrays.mass.shape)
        self.arrays = GravityArrays(zeros, np.zeros(2, dtype=np.int64))
        self.new = zeros.copy()  #: (r, n) N that the present stage has added
        self.books = GravityBooks(freedoms.arrays.displacement.copy(), np.zeros(1))

    def share(self, split: Split) -> np.ndarray:
        return self._freedoms.share(split) if self.arrays.weight.any() else super().share(split)

    def begin(self, imposed: Imposed, at: Moment) -> None:
        self.books.done[0] = 0.0
        self.books.since[:] = self._freedoms.displacement_at_forces(at.time_step)
        before, weight = self.arrays.weight, np.zeros_like(self.arrays.weight)
        for gravity in imposed.of(Gravity):
            weight[:2] += np.array(gravity.acceleration)[:, None] * self._mass
        self.arrays, self.new = self.arrays._replace(weight=weight), weight - before
        self._freedoms.arrays.earlier[:] += self.new

    def raise_to(self, weight: np.ndarray, time_step: float) -> None:
        """Impose another weight (r, n) N between two steps of a specimen that goes from equilibrium to equilibrium.

        Eq. (12), the trapezoidal rule: the weight before works on half of the motion of the last step.
        """
        if np.array_equal(weight, self.arrays.weight):
            return
        at_forces = self._freedoms.displacement_at_forces(time_step)
        way = self._freedoms.arrays.displacement - at_forces
        self.books.done[0] += self._work(time_step) - 0.5 * float(np.sum((weight - self.arrays.weight) * way))
        self.books.since[:] = at_forces
        self.arrays = self.arrays._replace(weight=weight)

    def energy(self, time_step: float) -> dict[str, float]:
        return {"external": float(self.books.done[0]) + self._work(time_step)}

    def _work(self, time_step: float) -> float:
        """J of the present weight, until the last forces."""
        if not self.arrays.weight.any():
            return 0.0
        return float(np.sum(self.arrays.weight * (self._freedoms.displacement_at_forces(time_step) - self.books.since)))
