"""Pressures on boundaries, normal to each edge as it moves: a fluid behind a thin membrane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.engine.parts.part import Changing, Constant, Part, Scratch, Split
from grainlaw.specimen import Specimen
from grainlaw.stage import Pressure


class PressureArrays(NamedTuple):
    """Edges (e) of grains under pressure, in the order of their nodes."""

    column: Constant  #: (e,) column of the schedule with the pressure
    node: Constant  #: (2, e) ends, counter-clockwise round the grain
    edge_x: Constant  #: (e,) m, undeformed, from the first end to the second
    edge_y: Constant
    force_x: Changing  #: (e,) N, of the last step
    force_y: Changing
    moved_x: Changing  #: (e,) m, displacement of the middle at the last step
    moved_y: Changing
    work: Changing  #: (e,) J
    share: Scratch


@njit(**OPTIONS)
def press(pressures, nodes, schedule, thread):
    """Add the force of pressures on a thread's edges, half to each end; their work, Eq. (11)."""
    ux, uy, fx, fy = nodes.displacement[0], nodes.displacement[1], nodes.force[0], nodes.force[1]
    first, second, edge_x, edge_y = pressures.node[0], pressures.node[1], pressures.edge_x, pressures.edge_y
    px, py, moved_x, moved_y = pressures.force_x, pressures.force_y, pressures.moved_x, pressures.moved_y
    for e in range(pressures.share[thread], pressures.share[thread + 1]):
        i, j = first[e], second[e]
        p = schedule[pressures.column[e]]
        force_x = -p * (edge_y[e] + uy[j] - uy[i])
        force_y = p * (edge_x[e] + ux[j] - ux[i])
        fx[i] += 0.5 * force_x
        fx[j] += 0.5 * force_x
        fy[i] += 0.5 * force_y
        fy[j] += 0.5 * force_y
        x, y = 0.5 * (ux[i] + ux[j]), 0.5 * (uy[i] + uy[j])
        pressures.work[e] += 0.5 * ((px[e] + force_x) * (x - moved_x[e]) + (py[e] + force_y) * (y - moved_y[e]))
        px[e], py[e], moved_x[e], moved_y[e] = force_x, force_y, x, y


class Pressures(Part):
    """The pressures of a stage, whose columns of the schedule begin at ``first_column``."""

    def __init__(
        self, specimen: Specimen, pressures: Sequence[Pressure], first_column: int, displacement: np.ndarray
    ) -> None:
        edges = [specimen.mesh.boundary_edges[pressure.boundary] for pressure in pressures]
        column = np.repeat(np.arange(len(edges)) + first_column, [len(e) for e in edges])
        node = np.concatenate([np.zeros((0, 2), dtype=np.int64), *edges])
        order = np.argsort(node[:, 0], kind="stable")
        node = np.ascontiguousarray(node[order].T)
        vector = np.diff(specimen.mesh.nodes[node], axis=0)[0].T
        middle = displacement[:, node].mean(axis=1)
        count = node.shape[1]
        self.arrays = PressureArrays(
            column[order], node, vector[0].copy(), vector[1].copy(), np.zeros(count), np.zeros(count),
            middle[0].copy(), middle[1].copy(), np.zeros(count), np.zeros(2, dtype=np.int64),
        )  # fmt: skip

    def share(self, split: Split) -> np.ndarray:
        return np.searchsorted(self.arrays.node[0], split.node)

    def energy(self, time_step: float) -> dict[str, float]:
        return {"external": float(self.arrays.work.sum())}
