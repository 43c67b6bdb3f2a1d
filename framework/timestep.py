"""The stable time step of a running specimen: its highest frequency, scaled masses, and closures that stiffen."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix

from grainlaw.stability import highest_frequency, rigid_map, scale_masses, stiffness_matrix
from grainlaw.state import State

AHEAD = 1.2  #: stiffness that a shorter step allows for beyond the present one, so that shortening is rare


class StableStep:
    """Highest frequency of a state, from the laws' first stiffness on; raises masses first where it is asked to."""

    def __init__(self, state: State, mass_scaling: float = 1.0) -> None:
        self.state = state
        self.allowed = 1.0  #: closure stiffness over kn that the present step allows for
        matrix, mass = self._matrix(self.state.stiffness[0]), self._masses()
        self.frequency = highest_frequency(matrix, mass)  #: 1/s
        if mass_scaling > 1:
            scaled = scale_masses(matrix, mass, mass_scaling, self._sharing())
            state.mass_added, self.frequency = scaled.added, scaled.frequency
            self._set_masses(scaled.mass)

    def has_changed(self) -> bool:
        """Whether a closure has become stiffer than the step allows for (Bandis); the frequency has followed then."""
        tangents = self.state.closure_tangents()
        ratio = float(np.max(tangents / self.state.stiffness[0], initial=1.0))
        if not (np.isfinite(ratio) and ratio > 1.05 * self.allowed):
            return False
        self.allowed = AHEAD * ratio
        self.frequency = highest_frequency(
            self._matrix(np.maximum(self.state.stiffness[0], AHEAD * tangents)), self._masses()
        )
        return True

    def _matrix(self, kn: np.ndarray) -> csr_matrix:
        """Stiffness over the freedoms: node components in pairs, or all x, all y, all angles of rigid grains."""
        specimen, order = self.state.specimen, self.state.order
        rows = [np.empty((2, len(order))) for _ in range(2)]
        for row, values in zip(rows, (kn, self.state.stiffness[1]), strict=True):
            row[:, order] = values.reshape(2, -1)
        matrix = stiffness_matrix(specimen, *rows)
        if not specimen.is_rigid:
            return matrix
        carry = rigid_map(specimen)
        return (carry.T @ matrix @ carry).tocsr()

    def _masses(self) -> np.ndarray:
        """Mass of each freedom, in the order of the matrix."""
        mass = self.state.freedoms.mass
        return mass.ravel() if self.state.rigid.grains else mass.T.ravel()

    def _set_masses(self, flat: np.ndarray) -> None:
        mass = self.state.freedoms.mass
        mass[:] = flat.reshape(mass.shape) if self.state.rigid.grains else flat.reshape(-1, 2).T

    def _sharing(self) -> np.ndarray:
        """Number for each freedom, equal for those that have one mass: a node's two, a rigid grain's x and y."""
        rows, count = self.state.freedoms.mass.shape
        if self.state.rigid.grains:
            return np.concatenate([np.tile(np.arange(count), 2), count + np.arange(count)])
        return np.repeat(np.arange(count), rows)
