"""Quiet boundaries: dashpots that take waves in as the rock beyond would (Lysmer and Kuhlemeyer 1969)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.columns import ABSORBED
from grainlaw.compiler.cache import OPTIONS
from grainlaw.engine.parts.freedoms import Freedoms
from grainlaw.engine.parts.imposed import Imposed
from grainlaw.engine.parts.part import START, Changing, Constant, Moment, PointForces, Split
from grainlaw.loads import Quiet
from grainlaw.specimen import Specimen


class QuietArrays(NamedTuple):
    """Nodes (n) on quiet boundaries, ascending."""

    node: Constant  #: (n,)
    xx: Constant  #: (n,) N s/m: force along x over the velocity along x; 0 where that is imposed
    yy: Constant
    xy: Constant
    force_x: Changing  #: (n,) N, of the last step
    force_y: Changing
    moved_x: Changing  #: (n,) m, displacement at the last step
    moved_y: Changing
    work: Changing  #: (n,) J
    share: Constant


@njit(**OPTIONS)
def absorb(quiet, freedoms, time_step, thread):
    """Add the forces of dashpots to a thread's nodes; their work, Eq. (11).

    They act on the mean of the velocities before and after the step, which follows from all other forces: so they are
    stable at any time step, as :class:`MassDamping` is.
    """
    force, velocity, mass, half = freedoms.force, freedoms.velocity, freedoms.mass, 0.5 * time_step
    px, py, moved_x, moved_y = quiet.force_x, quiet.force_y, quiet.moved_x, quiet.moved_y
    for n in range(quiet.share[thread], quiet.share[thread + 1]):
        i, xx, yy, xy = quiet.node[n], quiet.xx[n], quiet.yy[n], quiet.xy[n]
        by_x, by_y = half / mass[0, i], half / mass[1, i]
        ax, ay = velocity[0, i] + by_x * force[0, i], velocity[1, i] + by_y * force[1, i]
        a, b, c, d = 1 + by_x * xx, by_x * xy, by_y * xy, 1 + by_y * yy
        size = a * d - b * c
        vx, vy = (d * ax - b * ay) / size, (a * ay - c * ax) / size
        x, y = -(xx * vx + xy * vy), -(xy * vx + yy * vy)
        ux, uy = freedoms.displacement[0, i], freedoms.displacement[1, i]
        quiet.work[n] += 0.5 * ((px[n] + x) * (ux - moved_x[n]) + (py[n] + y) * (uy - moved_y[n]))
        px[n], py[n], moved_x[n], moved_y[n] = x, y, ux, uy
        force[0, i] += x
        force[1, i] += y


class QuietBoundaries(PointForces):
    """The quiet boundaries of a stage."""

    takes, kind, sign = (Quiet,), ABSORBED, -1.0

    def __init__(self, specimen: Specimen, freedoms: Freedoms) -> None:
        self._specimen, self._freedoms = specimen, freedoms
        self.begin(Imposed(specimen.mesh), START)

    def begin(self, imposed: Imposed, at: Moment) -> None:
        mesh = self._specimen.mesh
        total = np.zeros((len(mesh.first_of_point), 3))
        for each in imposed.of(Quiet):
            edges = mesh.boundary_edges[each.boundary]
            length, dashpots = _dashpots(self._specimen, edges, each)
            np.add.at(total, mesh.point[edges].ravel(), np.repeat(dashpots * length[:, None] / 2, 2, axis=0))
        node = np.flatnonzero(total.any(axis=1))
        first = mesh.first_of_point[node]
        free_x, free_y = self._freedoms.arrays.free[:2, node] if len(node) else np.zeros((2, 0))
        (xx, yy, xy), count = total[node].T, len(node)
        self.arrays = QuietArrays(
            node, xx * free_x, yy * free_y, xy * free_x * free_y, np.zeros(count), np.zeros(count),
            at.at_forces[0, first], at.at_forces[1, first], np.zeros(count), np.zeros(2, dtype=np.int64),
        )  # fmt: skip

    def share(self, split: Split) -> np.ndarray:
        return np.searchsorted(self.arrays.node, self._freedoms.share(split))

    def points(self, displacement: np.ndarray) -> np.ndarray:
        return displacement[:, self._specimen.mesh.first_of_point[self.arrays.node]]


def _dashpots(specimen: Specimen, edges: np.ndarray, quiet: Quiet) -> tuple[np.ndarray, np.ndarray]:
    """Lengths (e,) m of edges (e, 2), and traction over velocity, xx, yy, xy (e, 3) Pa s/m, of the rock beyond.

    A plane wave along the normal n has the traction Z v with Z = sqrt(rho G), G the acoustic tensor of the elastic
    stiffness for n: rho cp along n and rho cs across it where the material is isotropic.
    """
    mesh = specimen.mesh
    along = mesh.nodes[edges[:, 1]] - mesh.nodes[edges[:, 0]]
    length = np.hypot(*along.T)
    x, y = along[:, 1] / length, -along[:, 0] / length
    zone = mesh.first_zone[mesh.node_grain[edges[:, 0]]]
    density = specimen.zone_masses[zone] / mesh.zone_areas[zone]
    if quiet.p_speed is not None and quiet.s_speed is not None:
        p, s = density * quiet.p_speed, density * quiet.s_speed
        return length, np.column_stack([p * x * x + s * y * y, p * y * y + s * x * x, (p - s) * x * y])
    operator = np.zeros((len(edges), 3, 2))  # strain of a motion along each axis that changes along n
    operator[:, 0, 0], operator[:, 1, 1], operator[:, 2, 0], operator[:, 2, 1] = x, y, y, x
    squared = density[:, None, None] * np.einsum(
        "eki,ekl,elj->eij", operator, specimen.zone_stiffness[zone], operator, optimize=True
    )
    xx, yy, xy = squared[:, 0, 0], squared[:, 1, 1], squared[:, 0, 1]
    root = np.sqrt(xx * yy - xy**2)
    scale = np.sqrt(xx + yy + 2 * root)  # the square root of a 2 x 2 matrix, by Cayley and Hamilton
    return length, np.column_stack([(xx + root) / scale, (yy + root) / scale, xy / scale])
