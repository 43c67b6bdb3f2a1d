"""Deformable grains: the freedoms are the components of their nodes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from grainlaw.engine.parts.freedoms import Freedoms, Nodes
from grainlaw.engine.parts.grains import GrainArrays, Grains
from grainlaw.engine.parts.part import Split
from grainlaw.loads import Driven
from grainlaw.specimen import Specimen


class DeformableGrains(Grains):
    """Their nodes are the freedoms."""

    is_rigid = False
    turning = ()

    def __init__(self, specimen: Specimen) -> None:
        self.specimen, self._point = specimen, specimen.mesh.point
        none, first = np.zeros(0), np.zeros(1, dtype=np.int64)
        self.arrays = GrainArrays(first, none, none, first[:0], first[:0], np.zeros(2, dtype=np.int64))

    @property
    def carry(self) -> scipy.sparse.csr_matrix:
        rows = np.arange(2 * len(self._point))
        columns = (2 * self._point[:, None] + np.arange(2)).ravel()
        return scipy.sparse.csr_matrix((np.ones(len(rows)), (rows, columns)))

    def true_mass(self) -> np.ndarray:
        return np.bincount(self._point, self.specimen.node_masses)

    def mass_behind(self, edges: np.ndarray) -> np.ndarray:
        return self.true_mass()[self._point[edges]].sum(axis=1)

    def freedoms(self, nodes: Nodes) -> Freedoms:
        mass = np.stack([self.true_mass()] * 2)
        return Freedoms(nodes.arrays.force, nodes.arrays.displacement, mass, lambda split: split.node)

    def of_nodes(self, nodes: np.ndarray) -> np.ndarray:
        return np.unique(self._point[nodes])

    def of_grains(self, grains: np.ndarray) -> np.ndarray:
        return self.of_nodes(np.flatnonzero(np.isin(self.specimen.mesh.node_grain, grains)))

    def check_drive(self, drive: Driven, before: Sequence[tuple[Driven | None, int]]) -> None:
        """No conflict: a node on two boundaries follows the later drive, as its grain can deform."""

    def nodes_at(self, displacement: np.ndarray) -> np.ndarray:
        return displacement

    def node_velocity(self, freedoms: Freedoms, positions: np.ndarray) -> np.ndarray:
        return freedoms.arrays.velocity.T

    def centres(self, freedoms: Freedoms, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        means = self.specimen.grain_means
        return means(positions), means(self.node_velocity(freedoms, positions))

    def rotations(self, freedoms: Freedoms, positions: np.ndarray) -> np.ndarray:
        return self.specimen.grain_rotations(positions)

    def field(self, velocity: np.ndarray, freedoms: Freedoms, positions: np.ndarray) -> np.ndarray:
        """The mean of the nodes of each point."""
        return np.stack([np.bincount(self._point, row) for row in velocity]) / np.bincount(self._point)

    def over_freedoms(
        self, matrix: scipy.sparse.csr_matrix, nodes: np.ndarray | None = None
    ) -> scipy.sparse.csr_matrix:
        return matrix

    def flat(self, rows: np.ndarray) -> np.ndarray:
        return rows.T.ravel()  # node components in pairs

    @property
    def places(self) -> np.ndarray:
        mesh = self.specimen.mesh
        return np.repeat(mesh.nodes[mesh.first_of_point], 2, axis=0)

    def unflat(self, values: np.ndarray) -> np.ndarray:
        return values.reshape(-1, 2).T

    def alike(self, count: int) -> np.ndarray:
        return np.repeat(np.arange(count), 2)


class TiedGrains(DeformableGrains):
    """Their points are the freedoms: some nodes share one, others have one each."""

    def __init__(self, specimen: Specimen) -> None:
        super().__init__(specimen)
        order = np.argsort(self._point, kind="stable")
        first = np.searchsorted(self._point[order], np.arange(len(specimen.mesh.first_of_point) + 1))
        self.arrays = self.arrays._replace(first=first, node=order, point=self._point)

    def share(self, split: Split) -> np.ndarray:
        return np.searchsorted(self.specimen.mesh.first_of_point, split.node)

    def freedoms(self, nodes: Nodes) -> Freedoms:
        mass = np.stack([self.true_mass()] * 2)
        return Freedoms(np.zeros(mass.shape), np.zeros(mass.shape), mass, self.share)

    def nodes_at(self, displacement: np.ndarray) -> np.ndarray:
        return displacement[:, self._point]

    def node_velocity(self, freedoms: Freedoms, positions: np.ndarray) -> np.ndarray:
        return freedoms.arrays.velocity.T[self._point]

    def over_freedoms(
        self, matrix: scipy.sparse.csr_matrix, nodes: np.ndarray | None = None
    ) -> scipy.sparse.csr_matrix:
        carry = self.carry
        return (carry.T @ matrix @ carry).tocsr()
