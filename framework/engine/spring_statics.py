"""Static solutions of an undeformed specimen whose contact points are springs; each takes one sparse factorisation.

Index letters: ``i`` node, ``q`` freedom, in the order of :meth:`Grains.flat`.
"""

from __future__ import annotations

import numpy as np
import scipy

from grainlaw.engine.parts.deformable_grains import DeformableGrains
from grainlaw.engine.parts.rigid_grains import RigidGrains
from grainlaw.engine.stability import rigid_map, stiffness_matrix
from grainlaw.engine.stage_statics import LOOSE, factorised
from grainlaw.specimen import Specimen

NONE = 1e-12  #: of the largest compliance: what no stress strains


class ElasticModel:
    """A specimen whose contact points have the stiffness ``kn``, ``ks``: (2, c) Pa/m in the order of the mesh.

    ``more`` is the stiffness (N/m) of other contacts over node components (2 i).
    """

    def __init__(
        self, specimen: Specimen, kn: np.ndarray, ks: np.ndarray, more: scipy.sparse.csr_matrix | None = None
    ) -> None:
        self._specimen, mesh = specimen, specimen.mesh
        self._grains = RigidGrains(specimen) if specimen.is_rigid else DeformableGrains(specimen)
        size = 2 * len(mesh.nodes)
        self._carry = rigid_map(specimen) if specimen.is_rigid else scipy.sparse.identity(size, format="csr")
        matrix = stiffness_matrix(specimen, kn, ks)
        self._stiffness = self._grains.over_freedoms(matrix if more is None else matrix + more)
        self._place = self._grains.unflat(np.arange(self._carry.shape[1]))  # (r, n) of the freedoms
        self._rim = np.concatenate(list(mesh.boundary_edges.values()))
        self._area = float(specimen.grains.areas.sum())

    def between_smooth_platens(self) -> tuple[float, np.ndarray]:
        """Stress (Pa) over strain and displacement (i, 2) m per strain, shortened along y between smooth platens.

        The stress is the mean of both platens, over the width.
        """
        mesh, low, high = self._specimen.mesh, *self._specimen.grains.region.bounds
        ends = [self._grains.of_nodes(mesh.boundaries[name]) for name in ("top", "bottom")]
        top, bottom = (self._place[1, end] for end in ends)
        turning = self._place[list(self._grains.turning)][:, np.concatenate(ends)].ravel()
        side = self._place[:1, ends[1][0]]  # platens leave the specimen free to slide as a whole
        held = np.unique(np.concatenate([top, bottom, turning, side]))
        given = np.zeros((self._carry.shape[1], 1))
        given[top] = low[1] - high[1]
        motion = self._solve(held, given)
        force = self._stiffness @ motion[:, 0]
        stress = float(force[bottom].sum() - force[top].sum()) / 2 / float(high[0] - low[0])
        return stress, (self._carry @ motion).reshape(-1, 2)

    def under_uniform_strain(self) -> np.ndarray:
        """(3, 3) Pa, xx, yy, xy: the rim follows a displacement that is linear in the position.

        A rigid grain at the rim follows it in the middle of its nodes at the rim, and does not turn.
        """
        nodes = np.unique(self._rim)
        places = self._grains.of_nodes(nodes)
        owner = np.searchsorted(places, self._specimen.mesh.node_grain[nodes] if self._grains.is_rigid else nodes)
        x, y = (np.bincount(owner, row) / np.bincount(owner) for row in self._specimen.mesh.nodes[nodes].T)
        given = np.zeros((self._carry.shape[1], 3))
        given[self._place[0, places]] = np.stack([x, 0 * x, y / 2], axis=1)
        given[self._place[1, places]] = np.stack([0 * y, y, x / 2], axis=1)
        motion = self._solve(self._place[:, places].ravel(), given)
        return np.asarray(motion.T @ (self._stiffness @ motion)) / self._area

    def under_uniform_stress(self) -> np.ndarray:
        """(3, 3) Pa, xx, yy, xy: every edge of the rim bears the traction of a uniform stress.

        Infinite for a strain that no stress makes, as across a column of rigid grains.
        """
        mesh = self._specimen.mesh
        edge = mesh.nodes[self._rim[:, 1]] - mesh.nodes[self._rim[:, 0]]
        x, y, none = edge[:, 1], -edge[:, 0], np.zeros(len(edge))  # outward normal times length
        forces = np.zeros((2 * len(mesh.nodes), 3))
        for end in self._rim.T:
            np.add.at(forces, 2 * end, np.stack([x, none, y], axis=1) / 2)
            np.add.at(forces, 2 * end + 1, np.stack([none, y, x], axis=1) / 2)
        forces = self._carry.T @ forces
        motion = self._solve(self._at_rest(), np.zeros_like(forces), forces)
        compliance = np.asarray(forces.T @ motion) / self._area
        some = np.flatnonzero(np.abs(compliance).max(axis=0) > NONE * np.abs(compliance).max())
        stiffness = np.diag(np.full(3, np.inf))
        stiffness[np.ix_(some, some)] = np.linalg.inv(compliance[np.ix_(some, some)])
        return stiffness

    def _at_rest(self) -> np.ndarray:
        """Three freedoms without which the specimen as a whole cannot move."""
        if self._grains.is_rigid:
            return self._place[:, 0]
        bottom = self._specimen.mesh.boundaries["bottom"]
        along = self._specimen.mesh.nodes[bottom, 0]
        first, last = bottom[np.argmin(along)], bottom[np.argmax(along)]
        return np.array([*self._place[:, first], self._place[1, last]])

    def _solve(self, held: np.ndarray, given: np.ndarray, forces: np.ndarray | float = 0.0) -> np.ndarray:
        """(q, k): displacements in equilibrium with ``forces`` (q, k), those ``held`` as ``given`` (q, k)."""
        motion = np.zeros_like(given)
        motion[held] = given[held]
        free = np.setdiff1d(np.arange(len(given)), held)
        if not len(free):
            return motion
        right = (forces - self._stiffness @ motion)[free]
        matrix = self._stiffness[free][:, free]
        springs = matrix.diagonal()
        loose = LOOSE * np.where(springs > 0, springs, springs.max(initial=0.0) or 1.0)  # parts that nothing holds
        motion[free] = factorised(scipy.sparse.csc_matrix(matrix + scipy.sparse.diags(loose))).solve(right)
        return motion
