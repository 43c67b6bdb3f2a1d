"""Static solutions of an undeformed specimen whose contact points are springs; each takes one sparse factorisation.

Index letters: ``i`` node, ``q`` freedom, in the order of :meth:`Grains.flat`.
"""

from __future__ import annotations

import numpy as np
import scipy

from grainlaw.engine.factors import Factors
from grainlaw.engine.parts.laws import LawGroup, by_interface
from grainlaw.engine.stability import add_springs, stiffness_matrix, triplets
from grainlaw.engine.stage_statics import LOOSE
from grainlaw.engine.state import State, grains_of
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
        self._grains = grains_of(specimen)
        self._carry = self._grains.carry
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
        mesh = self._specimen.mesh
        owner = np.searchsorted(places, (mesh.node_grain if self._grains.is_rigid else mesh.point)[nodes])
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
        mesh = self._specimen.mesh
        bottom = mesh.boundaries["bottom"]
        along = mesh.nodes[bottom, 0]
        first, last = mesh.point[bottom[[np.argmin(along), np.argmax(along)]]]
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
        motion[free] = Factors(matrix + scipy.sparse.diags(loose), self._grains.places[free]).solve(right)
        return motion


# --- stiffness of contacts at the state they are in -------------------------------------------------------------------


LITTLE, LEAST = 1e-6, 1e-9  #: trial displacement: of that of the point, and at least of the grain size


def stiffness_of_bonds(state: State) -> np.ndarray:
    """(2, 2, c) Pa/m, kn and ks of both points of each bond, in the order of the mesh; 0 where a contact replaced it.

    Normal: against a little more closure, so that an open broken point gives nothing. Shear: of a bonded point against
    a little less slip, as it unloads; of a broken one against a little more, so that it gives nothing while it slides.
    """
    bonds = state.bonds
    rows = np.zeros((2, 2 * len(bonds)))
    for group in bonds.groups:
        places, memory = group.points(len(bonds)), bonds.memory_of(group)
        damage = group.row("damage")
        broken = memory[damage] >= 1 if damage >= 0 else ~group.resists_opening
        rows[:, places] = _tangents(state, group, state.opening[places], state.slip[places], memory, broken)
    rows[:, np.tile(state.replaced, 2)] = 0.0
    return by_interface(bonds.order, rows)


def stiffness_of_contacts(state: State) -> scipy.sparse.csr_matrix:
    """N/m over node components (2 i): closed contacts without a bond, each as two points like those of a bond."""
    contacts, arrays, size = state.contacts, state.contacts.arrays, 2 * len(state.mesh.nodes)
    closed = np.flatnonzero(arrays.length > 0)
    groups, springs = contacts.groups_of(contacts.books.keys)[closed], np.zeros((2, len(closed)))
    for g in np.unique(groups).tolist():
        group, chosen = contacts.groups[g], groups == g
        places = closed[chosen]
        memory = np.ascontiguousarray(arrays.memory[: group.depth, places])
        broken = np.ones(len(places), dtype=bool)
        springs[:, chosen] = _tangents(state, group, arrays.opening[places], arrays.slip[places], memory, broken)
    node, length = arrays.node[:, closed], arrays.length[closed]
    tangent = np.stack([arrays.tangent_x[closed], arrays.tangent_y[closed]], axis=1)
    start, end = arrays.place[:, node[[0, 3]]], arrays.place[:, node[[1, 2]]]
    offset = length / np.hypot(*(end - start)) / np.sqrt(12)  # of both points along edges a and b
    along = end - start
    share_a, edge_b = arrays.share_a[closed], along[:, 1]
    force = start[:, 0] + share_a * along[:, 0]  # where it acts; the same place on edge b
    share_b = np.sum((force - start[:, 1]) * edge_b, axis=0) / np.sum(edge_b**2, axis=0)
    values = np.zeros((len(closed), 8, 8))
    for side in (-1, 1):
        a, b = share_a + side * offset[0], share_b + side * offset[1]
        share = np.stack([a - 1, -a, b, 1 - b], axis=1)  # of the four nodes in the motion of B against A
        add_springs(values, share, tangent, (springs[0] * length / 2, springs[1] * length / 2))
    data, rows, columns = triplets(values, arrays.used[node.T])
    return scipy.sparse.coo_matrix((data, (rows, columns)), (size, size)).tocsr()


def _tangents(
    state: State, group: LawGroup, opening: np.ndarray, slip: np.ndarray, memory: np.ndarray, broken: np.ndarray
) -> np.ndarray:
    """(2, n) Pa/m, at least 0: a point that softens in the trial has no elastic stiffness."""
    least = LEAST * state.specimen.grains.grain_size
    little = np.maximum(LITTLE * np.maximum(np.abs(opening), np.abs(slip)), least)
    _, shear = group.compiled.batch(opening, slip, memory.copy())
    trial = np.where(broken == (shear >= 0), little, -little)
    rows = group.tangent(opening, slip, memory, little), group.tangent_in_slip(opening, slip, memory, trial)
    return np.maximum(rows, 0.0)
