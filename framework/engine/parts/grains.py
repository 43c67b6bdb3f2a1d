"""Grains: how nodes follow the freedoms. Nodes of deformable grains move freely, corners of rigid grains with them."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.engine.parts.freedoms import Freedoms, Nodes
from grainlaw.engine.parts.part import Constant, Part
from grainlaw.loads import Driven
from grainlaw.specimen import Specimen


class GrainArrays(NamedTuple):
    """Rigid grains (g) and their corners, or points (g) and their tied nodes; neither where all nodes are free."""

    first: Constant  #: (g + 1,) first node of each grain, or place in ``node`` of those of each point
    arm_x: Constant  #: (i,) m from the grain's centroid, undeformed
    arm_y: Constant
    node: Constant  #: (i,) nodes in the order of their points; empty without ties
    point: Constant  #: (i,) of each node
    share: Constant


@njit(**OPTIONS)
def collect_forces(grains, nodes, freedoms, thread):
    """Resultant force and moment on each rigid grain of the forces at its corners."""
    turn = freedoms.displacement.shape[0] - 1
    angle, fx, fy = freedoms.displacement[turn], nodes.force[0], nodes.force[1]
    first, arm_x, arm_y = grains.first, grains.arm_x, grains.arm_y
    gx, gy, moment = freedoms.force[0], freedoms.force[1], freedoms.force[turn]
    for g in range(grains.share[thread], grains.share[thread + 1]):
        cs, sn = math.cos(angle[g]), math.sin(angle[g])
        sum_x, sum_y, sum_m = 0.0, 0.0, 0.0
        for i in range(first[g], first[g + 1]):
            x = cs * arm_x[i] - sn * arm_y[i]
            y = sn * arm_x[i] + cs * arm_y[i]
            sum_x += fx[i]
            sum_y += fy[i]
            sum_m += x * fy[i] - y * fx[i]
        gx[g] = sum_x
        gy[g] = sum_y
        moment[g] = sum_m


@njit(**OPTIONS)
def place_corners(grains, nodes, freedoms, thread):
    """Move the corners of each rigid grain by its translation and rotation."""
    gx, gy = freedoms.displacement[0], freedoms.displacement[1]
    angle = freedoms.displacement[freedoms.displacement.shape[0] - 1]
    first, arm_x, arm_y = grains.first, grains.arm_x, grains.arm_y
    ux, uy = nodes.displacement[0], nodes.displacement[1]
    for g in range(grains.share[thread], grains.share[thread + 1]):
        half = math.sin(0.5 * angle[g])
        cs, sn = -2 * half * half, math.sin(angle[g])  # cos - 1 without cancellation
        for i in range(first[g], first[g + 1]):
            ux[i] = gx[g] + cs * arm_x[i] - sn * arm_y[i]
            uy[i] = gy[g] + sn * arm_x[i] + cs * arm_y[i]


@njit(**OPTIONS)
def collect_tied_forces(grains, nodes, freedoms, thread):
    """Sum of the forces on the tied nodes of each point."""
    fx, fy, gx, gy = nodes.force[0], nodes.force[1], freedoms.force[0], freedoms.force[1]
    for g in range(grains.share[thread], grains.share[thread + 1]):
        sum_x, sum_y = 0.0, 0.0
        for i in grains.node[grains.first[g] : grains.first[g + 1]]:
            sum_x += fx[i]
            sum_y += fy[i]
        gx[g], gy[g] = sum_x, sum_y


@njit(**OPTIONS)
def place_tied_nodes(grains, nodes, freedoms, thread):
    """Move a thread's nodes with their points."""
    for i in range(nodes.share[thread], nodes.share[thread + 1]):
        for row in range(2):
            nodes.displacement[row, i] = freedoms.displacement[row, grains.point[i]]


class Grains(Part, ABC):
    """What differs between deformable and rigid grains; index letters ``r, n`` as in :class:`Freedoms`."""

    specimen: Specimen
    is_rigid: bool
    turning: tuple[int, ...]  #: rows of the freedoms that are rotations

    @property
    @abstractmethod
    def carry(self) -> scipy.sparse.csr_matrix:
        """(2 i, q) displacement of node components from the freedoms, in the order of ``flat``, undeformed."""

    @abstractmethod
    def true_mass(self) -> np.ndarray:
        """(n,) kg, without what mass scaling adds."""

    @abstractmethod
    def mass_behind(self, edges: np.ndarray) -> np.ndarray:
        """(e,) kg that a force on each of the edges (e, 2) accelerates directly."""

    @abstractmethod
    def freedoms(self, nodes: Nodes) -> Freedoms:
        """The freedoms, at rest and undeformed."""

    @abstractmethod
    def of_nodes(self, nodes: np.ndarray) -> np.ndarray:
        """Places (n) of the freedoms that move these nodes, ascending."""

    @abstractmethod
    def of_grains(self, grains: np.ndarray) -> np.ndarray:
        """Places (n) of the freedoms that move these grains, ascending."""

    @abstractmethod
    def check_drive(self, drive: Driven, before: Sequence[tuple[Driven | None, int]]) -> None:
        """Raise :class:`ParameterError` where a drive contradicts one ``before`` it on the same place."""

    @abstractmethod
    def nodes_at(self, displacement: np.ndarray) -> np.ndarray:
        """(2, i) m, displacement of the nodes at a displacement (r, n) of the freedoms."""

    @abstractmethod
    def node_velocity(self, freedoms: Freedoms, positions: np.ndarray) -> np.ndarray:
        """(i, 2) m/s at the present positions (i, 2) of the nodes."""

    @abstractmethod
    def centres(self, freedoms: Freedoms, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Centres of mass (g, 2) m and their velocities (g, 2) m/s."""

    @abstractmethod
    def rotations(self, freedoms: Freedoms, positions: np.ndarray) -> np.ndarray:
        """(g,) rad, counter-clockwise, since the specimen was made; of grains that deform, from -pi to pi."""

    @abstractmethod
    def field(self, velocity: np.ndarray, freedoms: Freedoms, positions: np.ndarray) -> np.ndarray:
        """Velocity (rows, n) of the freedoms that fits a velocity field (2, i) of the nodes best."""

    @abstractmethod
    def over_freedoms(
        self, matrix: scipy.sparse.csr_matrix, nodes: np.ndarray | None = None
    ) -> scipy.sparse.csr_matrix:
        """Transform a stiffness matrix over node components (2 i) to the freedoms, in the order of ``flat``.

        ``nodes`` (i, 2) m are those of grains that have turned about their centroids.
        """

    @abstractmethod
    def flat(self, rows: np.ndarray) -> np.ndarray:
        """Values (r, n) in the order of the stiffness matrix."""

    @property
    @abstractmethod
    def places(self) -> np.ndarray:
        """(q, 2) m, where each freedom is in the undeformed specimen, in the order of ``flat``."""

    @abstractmethod
    def unflat(self, values: np.ndarray) -> np.ndarray:
        """The reverse of ``flat``."""

    @abstractmethod
    def alike(self, count: int) -> np.ndarray:
        """Numbers in the order of ``flat``, equal for freedoms of one mass, for ``count`` nodes or grains."""
