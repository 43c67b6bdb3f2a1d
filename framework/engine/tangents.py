"""Elastic stiffness of the contacts of a running specimen, at the state they are in."""

from __future__ import annotations

import numpy as np
import scipy

from grainlaw.engine.parts.laws import LawGroup, by_interface
from grainlaw.engine.stability import add_springs, triplets
from grainlaw.engine.state import State

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
