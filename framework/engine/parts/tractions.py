"""Tractions on boundaries: forces on their nodes, in directions that do not change, times a factor of time."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.engine.parts.imposed import Imposed
from grainlaw.engine.parts.part import START, Changing, Constant, Moment, PointForces, Split
from grainlaw.loads import Traction
from grainlaw.mesh import Mesh


class TractionArrays(NamedTuple):
    """Loaded nodes (n), ascending; one that two tractions load is there twice."""

    column: Constant  #: (n,) column of the schedule with the factor
    node: Constant  #: (n,)
    full_x: Constant  #: (n,) N at a factor of 1
    full_y: Constant
    force_x: Changing  #: (n,) N, of the last step
    force_y: Changing
    moved_x: Changing  #: (n,) m, displacement at the last step
    moved_y: Changing
    work: Changing  #: (n,) J
    share: Constant


@njit(**OPTIONS)
def load(tractions, nodes, schedule, thread):
    """Add the forces of tractions to a thread's nodes; their work, Eq. (11)."""
    ux, uy, fx, fy = nodes.displacement[0], nodes.displacement[1], nodes.force[0], nodes.force[1]
    px, py, moved_x, moved_y = tractions.force_x, tractions.force_y, tractions.moved_x, tractions.moved_y
    for n in range(tractions.share[thread], tractions.share[thread + 1]):
        i, factor = tractions.node[n], schedule[tractions.column[n]]
        x, y = factor * tractions.full_x[n], factor * tractions.full_y[n]
        tractions.work[n] += 0.5 * ((px[n] + x) * (ux[i] - moved_x[n]) + (py[n] + y) * (uy[i] - moved_y[n]))
        px[n], py[n], moved_x[n], moved_y[n] = x, y, ux[i], uy[i]
        fx[i] += x
        fy[i] += y


class Tractions(PointForces):
    """The tractions of a stage."""

    takes = (Traction,)

    def __init__(self, mesh: Mesh) -> None:
        self._mesh = mesh
        self.begin(Imposed(mesh), START)

    def begin(self, imposed: Imposed, at: Moment) -> None:
        mesh = self._mesh
        rows: list[np.ndarray] = [np.zeros((0, 4))]
        for traction in imposed.of(Traction):
            edges = mesh.boundary_edges[traction.boundary]
            along = mesh.nodes[edges[:, 1]] - mesh.nodes[edges[:, 0]]
            xx, yy, xy = traction.stress
            outward = np.column_stack([along[:, 1], -along[:, 0]])  # normal times length: the grain is on the left
            half = outward @ np.array([[xx, xy], [xy, yy]]) / 2
            node, place = np.unique(edges, return_inverse=True)
            force = np.stack([np.bincount(place.ravel(), np.repeat(row, 2), len(node)) for row in half.T], axis=1)
            rows.append(np.column_stack([np.full(len(node), imposed.column(traction)), node, force]))
        table = np.concatenate(rows)
        table = table[np.argsort(table[:, 1], kind="stable")]
        node, count = table[:, 1].astype(np.int64), len(table)
        self.arrays = TractionArrays(
            table[:, 0].astype(np.int64), node, table[:, 2].copy(), table[:, 3].copy(), np.zeros(count),
            np.zeros(count), at.at_forces[0, node], at.at_forces[1, node], np.zeros(count), np.zeros(2, dtype=np.int64),
        )  # fmt: skip

    def share(self, split: Split) -> np.ndarray:
        return np.searchsorted(self.arrays.node, split.node)

    def points(self, displacement: np.ndarray) -> np.ndarray:
        return displacement[:, self.arrays.node]
