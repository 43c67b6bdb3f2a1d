"""Pressures on boundaries, normal to each edge as it moves: a fluid behind a thin membrane, which follows the rim."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.engine.parts.imposed import Imposed
from grainlaw.engine.parts.part import START, Changing, Constant, Moment, PointForces, Split, half_step_work
from grainlaw.loads import Driven, Pressure
from grainlaw.specimen import Specimen

PARTED = 0.05  #: of the grain size: how far the rim may part, and nodes may move, until membranes are laid anew
WIDE = 0.5  #: of the grain size: a membrane enters a gap that is wider
SAME = 1e-9  #: of the grain size: nodes nearer to each other are one corner of the undeformed rim
SMALLER = 1e-3  #: by which grains shrink while the line is found, so that no two nodes lie in one place


def membrane(place: np.ndarray, grain: np.ndarray, platens: np.ndarray, gap: float) -> np.ndarray:
    """(n, 2) ends of the parts of a membrane, the specimen on the left, in the order of their first ends.

    The empty room round the specimen is dug out of a triangulation of all nodes on edges of grains, from outside,
    through gaps that are wider than a grain (Duckham and others, 2008, doi:10.1016/j.patcog.2008.03.023). What bounds
    this room is the membrane. It is closed but for the platens, so that an even pressure on it has no resultant besides
    theirs; and it goes all round a piece that has flown away, on which it then has none.

    ``place`` (i, 2) m and ``grain`` (i,) of nodes; ``platens`` (i, b), which nodes lie on each driven boundary: the
    membrane ends there. It spans gaps up to ``gap`` (m).
    """
    count = np.bincount(grain)
    centre = np.stack([np.bincount(grain, row) for row in place.T], axis=1) / np.maximum(count, 1)[:, None]
    triangles = scipy.spatial.Delaunay(place + SMALLER * (centre[grain] - place))
    corners, neighbours = triangles.simplices, triangles.neighbors
    ends = np.stack([np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1)], axis=-1)  # (t, 3, 2), each opposite
    first, second = ends[..., 0], ends[..., 1]
    sealed = (platens[first] & platens[second]).any(axis=-1)
    wide = np.hypot(*(place[second] - place[first]).transpose(2, 0, 1)) > gap
    passable = wide & ~sealed & (grain[first] != grain[second])
    outside = np.zeros(len(corners) + 1, dtype=bool)
    outside[-1] = True  # the neighbour -1 of triangles at the hull
    front = np.flatnonzero((passable & (neighbours < 0)).any(axis=1))
    while len(front):
        outside[front] = True
        beyond = neighbours[front][passable[front]]
        front = np.unique(beyond[~outside[beyond]])
    bounds = ~outside[:-1, None] & outside[neighbours] & ~sealed
    found = ends[bounds]
    return found[np.lexsort((found[:, 1], found[:, 0]))]


class PressureArrays(NamedTuple):
    """Straight parts (e) of membranes, in the order of their first nodes: edges of grains, and spans between them."""

    column: Changing  #: (e,) column of the schedule with the pressure
    node: Changing  #: (2, e) ends, the specimen on the left
    edge_x: Changing  #: (e,) m, undeformed, from the first end to the second
    edge_y: Changing
    force_x: Changing  #: (e,) N, of the last step
    force_y: Changing
    moved_x: Changing  #: (e,) m, displacement of the middle at the last step
    moved_y: Changing
    work: Changing  #: (e,) J
    share: Constant


class PressureBooks(NamedTuple):
    """What is recorded when membranes are laid anew."""

    laid: Changing  #: (2, i) m, displacement at which they were; without columns they lie on the edges of the mesh
    done: Changing  #: (1,) J, work of those before


@njit(**OPTIONS)
def press(pressures, nodes, schedule, thread):
    """Force of pressures on a thread's parts of membranes, and its work, Eq. (11)."""
    ux, uy = nodes.displacement[0], nodes.displacement[1]
    first, second, edge_x, edge_y = pressures.node[0], pressures.node[1], pressures.edge_x, pressures.edge_y
    px, py, moved_x, moved_y = pressures.force_x, pressures.force_y, pressures.moved_x, pressures.moved_y
    for e in range(pressures.share[thread], pressures.share[thread + 1]):
        i, j = first[e], second[e]
        p = schedule[pressures.column[e]]
        force_x = -p * (edge_y[e] + uy[j] - uy[i])
        force_y = p * (edge_x[e] + ux[j] - ux[i])
        x, y = 0.5 * (ux[i] + ux[j]), 0.5 * (uy[i] + uy[j])
        pressures.work[e] += 0.5 * ((px[e] + force_x) * (x - moved_x[e]) + (py[e] + force_y) * (y - moved_y[e]))
        px[e], py[e], moved_x[e], moved_y[e] = force_x, force_y, x, y


@njit(**OPTIONS)
def gather_pressures(pressures, nodes, thread):
    """Add the force on each part of a membrane, half to each end, to a thread's nodes, in a fixed order."""
    low, high, fx, fy = nodes.share[thread], nodes.share[thread + 1], nodes.force[0], nodes.force[1]
    for e in range(pressures.node.shape[1]):
        i, j, x, y = pressures.node[0, e], pressures.node[1, e], pressures.force_x[e], pressures.force_y[e]
        if low <= i < high:
            fx[i] += 0.5 * x
            fy[i] += 0.5 * y
        if low <= j < high:
            fx[j] += 0.5 * x
            fy[j] += 0.5 * y


class Pressures(PointForces):
    """The pressures of a stage, on membranes between its driven boundaries."""

    takes = (Pressure,)

    def __init__(self, specimen: Specimen) -> None:
        mesh = self._mesh = specimen.mesh
        self._room, self._gap = (share * specimen.grains.grain_size for share in (PARTED, WIDE))
        self._near = SAME * specimen.grains.grain_size
        self.begin(Imposed(mesh), START)

    def begin(self, imposed: Imposed, at: Moment) -> None:
        mesh, pressures = self._mesh, imposed.of(Pressure)
        self._pressed = [pressure.boundary for pressure in pressures]
        self._columns = np.array([imposed.column(pressure) for pressure in pressures], dtype=np.int64)
        self._driven = {drive.boundary for drive in imposed.of(Driven)} - set(self._pressed)
        edges = [mesh.boundary_edges[boundary] for boundary in self._pressed]
        pressed = np.repeat(np.arange(len(edges)), [len(e) for e in edges])
        node = np.concatenate([np.zeros((0, 2), dtype=np.int64), *edges])
        order = np.argsort(node[:, 0], kind="stable")
        rim = np.unique(node)
        near = scipy.spatial.cKDTree(mesh.nodes[rim]).query_pairs(self._near, output_type="ndarray")
        self._joined = rim[near]  #: (n, 2) nodes of neighbours on the undeformed rim
        self.books = PressureBooks(np.zeros((2, 0)), np.zeros(1))
        self._lay(node[order], pressed[order], at.at_forces)

    def _lay(self, node: np.ndarray, pressed: np.ndarray, displacement: np.ndarray) -> None:
        """Let membranes be ``node`` (e, 2), each under one of the pressures ``pressed`` (e,)."""
        node = np.ascontiguousarray(node.T)
        vector = np.diff(self._mesh.nodes[node], axis=0)[0].T
        middle = displacement[:, node].mean(axis=1)
        count = node.shape[1]
        self.arrays = PressureArrays(
            self._columns[pressed], node, vector[0].copy(), vector[1].copy(), np.zeros(count), np.zeros(count),
            middle[0].copy(), middle[1].copy(), np.zeros(count), np.zeros(2, dtype=np.int64),
        )  # fmt: skip

    def share(self, split: Split) -> np.ndarray:
        return np.searchsorted(self.arrays.node[0], split.node)

    def energy(self, time_step: float) -> dict[str, float]:
        return {self.kind: float(self.books.done[0]) + float(self.arrays.work.sum())}

    def points(self, displacement: np.ndarray) -> np.ndarray:
        return displacement[:, self.arrays.node].mean(axis=1)

    def follow_rim(self, displacement: np.ndarray, before: np.ndarray) -> None:
        """Lay membranes anew where the rim has parted; ``before`` (2, i) m is the displacement at the last forces."""
        if not self._pressed or not self._has_changed(displacement):
            return
        node = self._membrane(displacement)
        nearest = self._nearest(node)
        node, nearest = node[nearest >= 0], nearest[nearest >= 0]
        done = self.books.done + self.arrays.work.sum() + half_step_work(self.arrays, self.points(displacement))
        self.books = PressureBooks(displacement.copy(), done)
        self._lay(node, nearest, before)

    def _has_changed(self, displacement: np.ndarray) -> bool:
        if not np.isfinite(displacement).all():  # the check of the energies reports where the run became unstable
            return False
        if self.books.laid.size:
            way = displacement - self.books.laid
        else:
            way = displacement[:, self._joined[:, 0]] - displacement[:, self._joined[:, 1]]
        return bool((np.hypot(*way) > self._room).any())

    def _membrane(self, displacement: np.ndarray) -> np.ndarray:
        """(e, 2) nodes of the line round the whole specimen but for its driven boundaries."""
        mesh = self._mesh
        edges = (mesh.interfaces, mesh.ties, *mesh.boundary_edges.values())
        used = np.unique(np.concatenate([each.ravel() for each in edges]))
        platens = [np.isin(used, mesh.boundaries[name]) for name in sorted(self._driven)]
        sealed = np.stack([np.zeros(len(used), dtype=bool), *platens], axis=1)
        place = (mesh.nodes + displacement.T)[used]
        return used[membrane(place, mesh.node_grain[used], sealed, self._gap)]

    def _nearest(self, node: np.ndarray) -> np.ndarray:
        """(e,) number of the pressure on the boundary that was nearest in the undeformed specimen; -1 if it has none.

        Driven boundaries do not count: what comes to the rim beside a platen is under the membrane.
        """
        mesh, names = self._mesh, [name for name in self._mesh.boundary_edges if name not in self._driven]
        number = [self._pressed.index(name) if name in self._pressed else -1 for name in names]
        middles = [mesh.nodes[mesh.boundary_edges[name]].mean(axis=1) for name in names]
        of = np.repeat(number, [len(middle) for middle in middles])
        _, nearest = scipy.spatial.cKDTree(np.concatenate(middles)).query(mesh.nodes[node].mean(axis=1))
        return of[nearest]
