"""The static solution of a stage: velocities with which a specimen stays in equilibrium while its drives move."""

from __future__ import annotations

import numpy as np
import scipy

from grainlaw.engine.factors import Factors
from grainlaw.engine.state import State

FIRST = 0.01  #: of the change of temperature of a stage, by which the free strain at its beginning is found
LOOSE = 1e-12  #: of the highest squared frequency: inertia by which parts that nothing holds stay at rest


def steady_motion(state: State, stiffness: scipy.sparse.csr_matrix, highest_frequency: float) -> np.ndarray:
    """(r, n) m/s of the freedoms, in equilibrium at every moment while the drives move, or it heats by 1 K/s.

    The drives move at the speeds of the stage. ``stiffness`` (N/m) is that of the freedoms, in the order of
    :meth:`Grains.flat`. A boundary under a force keeps it and moves as one body. What nothing holds moves with the
    least kinetic energy: the inertia that is added for it counts nowhere else. One sparse factorisation: 0.05 s for 755
    grains of 9,264 freedoms, 2 s for 10,000 grains.
    """
    driven, imposed = state.drives.arrays, np.zeros_like(state.freedoms.arrays.mass)
    imposed[driven.row, driven.place] = state.imposed.speeds[driven.column]
    given = state.grains.flat(imposed)
    carry, matrix, places = unknowns(state, stiffness, highest_frequency)
    right = carry.T @ (_heated(state) - stiffness @ given)
    return state.grains.unflat(given + carry @ Factors(matrix, places).solve(right) if right.any() else given)


def _heated(state: State) -> np.ndarray | float:
    """N/s on the freedoms at 1 K/s towards the temperature of the stage, in the order of :meth:`Grains.flat`."""
    heat = state.heat
    if not heat.sign or heat.target is None:
        return 0.0
    by = (heat.target - heat.temperature) * FIRST
    force = state.materials.force_per_kelvin(state.nodes.arrays.displacement, heat.temperature, by) * heat.sign
    heat.reach(heat.temperature)
    return state.grains.carry.T @ force.T.ravel()


def unknowns(
    state: State, stiffness: scipy.sparse.csr_matrix, highest_frequency: float
) -> tuple[scipy.sparse.csr_matrix, scipy.sparse.csc_matrix, np.ndarray]:
    """How the freedoms follow what is to be found (q), platens under a force and then free freedoms; their stiffness.

    And their places (q, 2) m, nan of platens.
    """
    f, flat = state.freedoms.arrays, state.grains.flat
    driven, platens = state.drives.arrays, state.platens.arrays
    place = np.full(f.mass.shape, -1.0)
    place[driven.row, driven.place] = driven.column
    column = flat(place)
    unknown = np.full(len(column), -1)  # that moves a freedom
    for number, platen in enumerate(platens.column.tolist()):
        unknown[column == platen] = number
    free = np.flatnonzero(column < 0)
    unknown[free] = len(platens.column) + np.arange(len(free))
    moved = np.flatnonzero(unknown >= 0)
    size = len(column), len(platens.column) + len(free)
    carry = scipy.sparse.coo_matrix((np.ones(len(moved)), (moved, unknown[moved])), size).tocsr()
    springs = np.append(platens.stiffness, np.zeros(len(free)))
    loose = scipy.sparse.diags(LOOSE * highest_frequency**2 * flat(f.mass))
    matrix = scipy.sparse.csc_matrix(carry.T @ (stiffness + loose) @ carry + scipy.sparse.diags(springs))
    return carry, matrix, np.concatenate([np.full((len(platens.column), 2), np.nan), state.grains.places[free]])


def stiffness_along(state: State, stiffness: scipy.sparse.csr_matrix, field: np.ndarray) -> float:
    """N/m per (m/s)^2 of a field (r, n): the force that its drives need over their displacement."""
    flat = state.grains.flat(field)
    return float(np.sum(flat * (stiffness @ flat)))
