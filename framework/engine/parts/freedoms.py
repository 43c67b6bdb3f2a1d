"""Nodes and freedoms: the components of nodes, or the translations and rotations of rigid grains."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.numba_private import call
from grainlaw.engine.parts.part import Changing, Constant, Part, Split
from grainlaw.integration import Motion


class NodeArrays(NamedTuple):
    """Nodes (i)."""

    displacement: Changing  #: (2, i) m
    force: Changing  #: (2, i) N, of zones, bonds and contacts; kept until the next step begins
    share: Constant


@njit(**OPTIONS)
def clear_forces(nodes, thread):
    """Begin a step: no force on a thread's nodes."""
    first, last = nodes.share[thread], nodes.share[thread + 1]
    nodes.force[0, first:last] = 0.0
    nodes.force[1, first:last] = 0.0


class Nodes(Part):
    """The nodes of all grains."""

    def __init__(self, count: int) -> None:
        self.arrays = NodeArrays(np.zeros((2, count)), np.zeros((2, count)), np.zeros(2, dtype=np.int64))

    def share(self, split: Split) -> np.ndarray:
        return split.node


class FreedomArrays(NamedTuple):
    """Rows (r) of nodes or rigid grains (n)."""

    force: Changing  #: (r, n) N, or N m for rotations
    earlier: Changing  #: (r, n) the same, of the step before
    velocity: Changing  #: (r, n) m/s, of the moment half a step before the displacement
    displacement: Changing  #: (r, n) m, or rad
    mass: Constant  #: (r, n) kg, or kg m2
    free: Constant  #: (r, n) 1, or 0 where the velocity is imposed
    imposed: Changing  #: (r, n) m/s: velocity of driven freedoms; of others that of the steady motion
    loss: Changing  #: (r, n) J, dissipated by damping
    share: Constant


class FreedomBooks(NamedTuple):
    """What is recorded between steps."""

    given: Changing  #: (1,) J, kinetic energy added when stages begin
    halted: Changing  #: (1,) J, kinetic energy removed by halts
    lag: Changing  #: (r, n) m, on which the next forces do work that the ledger lacks
    lags: Changing  #: (1,) whether there is any


@njit(**OPTIONS)
def integrate(freedoms, integrator, parameters, thread):
    """Move a thread's freedoms by the integrator, which is called by its address, Eq. (9)."""
    first, last = freedoms.share[thread], freedoms.share[thread + 1]
    offset = 8 * first
    for row in range(freedoms.force.shape[0]):
        call(
            integrator,
            (
                parameters, freedoms.force[row].ctypes.data + offset, freedoms.earlier[row].ctypes.data + offset,
                freedoms.velocity[row].ctypes.data + offset, freedoms.displacement[row].ctypes.data + offset,
                freedoms.mass[row].ctypes.data + offset,
                freedoms.free[row].ctypes.data + offset, freedoms.imposed[row].ctypes.data + offset,
                freedoms.loss[row].ctypes.data + offset, last - first,
            ),
        )  # fmt: skip


class Freedoms(Part):
    """The freedoms of a model; ``bounds`` gives those of each thread from the split of the model."""

    def __init__(
        self, force: np.ndarray, displacement: np.ndarray, mass: np.ndarray, bounds: Callable[[Split], np.ndarray]
    ) -> None:
        ones, zeros = np.ones(mass.shape), np.zeros(mass.shape)
        self._bounds = bounds
        none = [zeros.copy() for _ in range(3)]
        self.arrays = FreedomArrays(
            force, none[0], zeros.copy(), displacement, mass, ones, none[1], none[2], np.zeros(2, dtype=np.int64)
        )
        self.books = FreedomBooks(np.zeros(1), np.zeros(1), zeros.copy(), np.zeros(1, dtype=np.int64))

    def share(self, split: Split) -> np.ndarray:
        return self._bounds(split)

    @property
    def kinetic_energy(self) -> float:
        """J, of the velocities half a step after the last forces."""
        return float(0.5 * np.sum(self.arrays.mass * self.arrays.velocity**2))

    def energy(self, time_step: float) -> dict[str, float]:
        """Without the kinetic energy, which the ledger takes at the moment of the forces."""
        return {
            "external": float(self.books.given[0]),
            "damping": float(self.arrays.loss.sum()) + float(self.books.halted[0]),
        }

    def displacement_at_forces(self, time_step: float) -> np.ndarray:
        """(r, n) m, at the moment of the last forces, one step before the present displacement."""
        return self.arrays.displacement - self.arrays.velocity * time_step

    def motion(self) -> Motion:
        """Copies of what an integrator sees between bursts."""
        f = self.arrays
        return Motion(f.velocity.copy(), f.displacement.copy(), f.force * f.free, f.mass)

    def stop(self) -> None:
        """Set the velocity of all free freedoms to zero."""
        self.arrays.velocity[self.arrays.free > 0] = 0.0

    def change_velocity(self, change: np.ndarray, time_step: float) -> None:
        """Add ``change`` (r, n) m/s to the velocity between two steps; record the energy.

        The ledger takes the power of the next forces with the new velocity, while nodes have come to where these forces
        act with the old one. It lacks the work of these forces on the difference, half a step of ``change``.
        """
        before = self.kinetic_energy
        self.arrays.velocity[:] += change
        self.books.given[0] += self.kinetic_energy - before
        self._lag(0.5 * time_step * change)

    def change_time_step(self, before: float, after: float) -> None:
        """Record, in the same way, that the velocity has moved the nodes for a time step (s) other than the next."""
        self._lag(0.5 * (after - before) * self.arrays.velocity)

    def _lag(self, way: np.ndarray) -> None:
        self.books.lag[:] += way
        self.books.lags[0] = 1

    @property
    def lags(self) -> bool:
        """Whether the ledger lacks the work of the next forces on a way."""
        return bool(self.books.lags[0])

    def catch_up(self, held: bool = False) -> None:
        """After one step: record the work of its forces on the way that was lacking.

        It is given from outside; free freedoms that are ``held`` to a motion whatever their forces lose less instead.
        """
        work = self.arrays.force * self.books.lag
        own = work * self.arrays.free if held else np.zeros_like(work)
        self.arrays.loss[:] -= own
        self.books.given[0] += float(np.sum(work - own))
        self.books.lag[:], self.books.lags[0] = 0.0, 0

    def start_from_rest(self, lost: np.ndarray, time_step: float) -> None:
        """Let the first step after ``stop`` begin from rest; record the energy of the velocity (r, n) that was lost.

        In a step from rest the force acts for half a step only, so that it gives half the velocity; without this
        correction a halt would excite the fast modes.
        """
        f = self.arrays
        gained = f.velocity * f.free
        f.velocity[:] -= gained / 2
        f.displacement[:] -= gained / 2 * time_step
        lost = lost * f.free
        self.books.halted[0] += float(np.sum(f.mass * lost**2 / 2 + f.force * (lost / 2 + gained / 8) * time_step))
