"""Tractions on boundaries: a stress beyond them that does not turn, times a factor of time, on edges as they move."""

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
    """Ends of loaded edges (n), ascending by node: two for each edge, that at its start and that at its end."""

    column: Constant  #: (n,) column of the schedule with the factor
    node: Constant  #: (n,)
    first: Constant  #: (n,) start of the edge, the grain on the left
    last: Constant  #: (n,) its end
    edge_x: Constant  #: (n,) m, undeformed, from start to end
    edge_y: Constant
    xx: Constant  #: (n,) Pa, stress at a factor of 1
    yy: Constant
    xy: Constant
    force_x: Changing  #: (n,) N, of the last step
    force_y: Changing
    moved_x: Changing  #: (n,) m, displacement at the last step
    moved_y: Changing
    work: Changing  #: (n,) J
    share: Constant


@njit(**OPTIONS)
def load(tractions, nodes, schedule, thread):
    """Add the forces of tractions on the edges as they lie to a thread's nodes, half to each end; work, Eq. (11)."""
    ux, uy, fx, fy = nodes.displacement[0], nodes.displacement[1], nodes.force[0], nodes.force[1]
    px, py, moved_x, moved_y = tractions.force_x, tractions.force_y, tractions.moved_x, tractions.moved_y
    for n in range(tractions.share[thread], tractions.share[thread + 1]):
        i, j, k = tractions.node[n], tractions.first[n], tractions.last[n]
        half = 0.5 * schedule[tractions.column[n]]
        along_x, along_y = tractions.edge_x[n] + ux[k] - ux[j], tractions.edge_y[n] + uy[k] - uy[j]
        x = half * (tractions.xx[n] * along_y - tractions.xy[n] * along_x)  # normal times length: (along_y, -along_x)
        y = half * (tractions.xy[n] * along_y - tractions.yy[n] * along_x)
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
        mesh, tractions = self._mesh, imposed.of(Traction)
        each = [mesh.boundary_edges[traction.boundary] for traction in tractions]
        column = np.array([imposed.column(traction) for traction in tractions], dtype=np.int64)
        edges = np.concatenate([np.zeros((0, 2), dtype=np.int64), *each])
        order = np.argsort(edges.ravel(), kind="stable")  # of both ends of each edge
        of = np.repeat(np.arange(len(each)), [len(some) for some in each])[order // 2]
        (first, last), node = edges[order // 2].T, edges.ravel()[order]
        along, count = (mesh.nodes[last] - mesh.nodes[first]).T, len(node)
        xx, yy, xy = np.array([one.stress for one in tractions]).reshape(-1, 3)[of].T
        self.arrays = TractionArrays(
            column[of], node, first.copy(), last.copy(), along[0].copy(), along[1].copy(),
            xx.copy(), yy.copy(), xy.copy(), np.zeros(count), np.zeros(count),
            at.at_forces[0, node], at.at_forces[1, node], np.zeros(count), np.zeros(2, dtype=np.int64),
        )  # fmt: skip

    def share(self, split: Split) -> np.ndarray:
        return np.searchsorted(self.arrays.node, split.node)

    def points(self, displacement: np.ndarray) -> np.ndarray:
        return displacement[:, self.arrays.node]
