"""Rigid grains: two translations and a rotation each, with which their corners move."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np
import scipy

from grainlaw.engine.parts.freedoms import Freedoms, Nodes
from grainlaw.engine.parts.grains import GrainArrays, Grains
from grainlaw.engine.parts.part import Split
from grainlaw.engine.stability import rigid_map
from grainlaw.fields import ParameterError
from grainlaw.loads import Driven
from grainlaw.specimen import Specimen


class RigidGrains(Grains):
    """Two translations and a rotation each; corners follow."""

    is_rigid = True
    turning = (2,)

    def __init__(self, specimen: Specimen) -> None:
        self.specimen = specimen
        mesh = specimen.mesh
        none = np.zeros(0, dtype=np.int64)
        arm = (mesh.nodes - specimen.grains.centroids[mesh.node_grain]).T
        self.arrays = GrainArrays(
            mesh.first_node, np.ascontiguousarray(arm[0]), np.ascontiguousarray(arm[1]),
            none, none, np.zeros(2, dtype=np.int64),
        )  # fmt: skip

    def share(self, split: Split) -> np.ndarray:
        return split.grain

    @property
    def carry(self) -> scipy.sparse.csr_matrix:
        return rigid_map(self.specimen)

    def true_mass(self) -> np.ndarray:
        return self.specimen.grain_masses

    def mass_behind(self, edges: np.ndarray) -> np.ndarray:
        return self.true_mass()[self.specimen.mesh.node_grain[edges[:, 0]]]

    def freedoms(self, nodes: Nodes) -> Freedoms:
        mass = self.true_mass()
        rows = np.stack([mass, mass, self._inertia()])
        return Freedoms(np.zeros(rows.shape), np.zeros(rows.shape), rows, lambda split: split.grain)

    def _inertia(self) -> np.ndarray:
        """(g,) kg m2 about the centroid: exact for a polygon, from the triangles of its fan."""
        specimen, mesh = self.specimen, self.specimen.mesh
        a, b, c = (mesh.nodes[mesh.zones[:, k]] - specimen.grains.centroids[mesh.zone_grain] for k in range(3))
        squares = sum((p * q).sum(axis=1) for p, q in ((a, a), (b, b), (c, c), (a, b), (b, c), (c, a)))
        return np.bincount(mesh.zone_grain, specimen.zone_masses * squares / 6, specimen.grains.count)

    def of_nodes(self, nodes: np.ndarray) -> np.ndarray:
        return np.unique(self.specimen.mesh.node_grain[nodes])

    def of_grains(self, grains: np.ndarray) -> np.ndarray:
        return np.unique(grains)

    def check_drive(self, drive: Driven, before: Sequence[tuple[Driven | None, int]]) -> None:
        """A rigid grain on two boundaries cannot strain, so that both must move it alike."""
        for other, grain in before:
            if other is not None and attrs.evolve(other, boundary=drive.boundary) != drive:  # type: ignore[misc]
                raise ParameterError(
                    f"{type(drive).__name__}: boundary = {drive.boundary!r} is not allowed, rigid grain {grain} lies "
                    f"on {other.boundary!r} too, which is moved differently along the same axis"
                )

    def _arms(self, freedoms: Freedoms, positions: np.ndarray) -> np.ndarray:
        """(i, 2) m, from the centre of its grain to each node."""
        return positions - self.centres(freedoms, positions)[0][self.specimen.mesh.node_grain]

    def centres(self, freedoms: Freedoms, positions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        f = freedoms.arrays
        return self.specimen.grains.centroids + f.displacement[:2].T, f.velocity[:2].T

    def rotations(self, freedoms: Freedoms, positions: np.ndarray) -> np.ndarray:
        return freedoms.arrays.displacement[2]

    def nodes_at(self, displacement: np.ndarray) -> np.ndarray:
        x, y, angle = displacement[:, self.specimen.mesh.node_grain]
        arm_x, arm_y = self.arrays.arm_x, self.arrays.arm_y
        sine, versed = np.sin(angle), 2 * np.sin(angle / 2) ** 2
        return np.stack([x - versed * arm_x - sine * arm_y, y + sine * arm_x - versed * arm_y])

    def node_velocity(self, freedoms: Freedoms, positions: np.ndarray) -> np.ndarray:
        rows, grain = freedoms.arrays.velocity, self.specimen.mesh.node_grain
        arm = self._arms(freedoms, positions)
        spin = rows[2, grain]
        return np.stack([rows[0, grain] - spin * arm[:, 1], rows[1, grain] + spin * arm[:, 0]], axis=1)

    def field(self, velocity: np.ndarray, freedoms: Freedoms, positions: np.ndarray) -> np.ndarray:
        """Mean velocity and spin of the corners of each grain, unless it is fixed."""
        grain = self.specimen.mesh.node_grain
        mean = np.stack([np.bincount(grain, row) for row in velocity]) / np.bincount(grain)
        arm = self._arms(freedoms, positions).T
        x, y = velocity - mean[:, grain]
        spin = np.bincount(grain, arm[0] * y - arm[1] * x) / np.bincount(grain, (arm**2).sum(axis=0))
        return np.stack([*mean, spin * freedoms.arrays.free[2]])

    def stress(self, force: np.ndarray, freedoms: Freedoms, positions: np.ndarray) -> np.ndarray:
        """(g, 3) Pa, xx, yy, xy, of the forces (2, i) N on their nodes (Love's formula)."""
        grains, of = self.specimen.grains, self.specimen.mesh.node_grain
        x, y = self._arms(freedoms, positions).T
        fx, fy = force
        rows = x * fx, y * fy, (x * fy + y * fx) / 2
        return np.stack([np.bincount(of, row, grains.count) for row in rows], axis=1) / grains.areas[:, None]

    def over_freedoms(
        self, matrix: scipy.sparse.csr_matrix, nodes: np.ndarray | None = None
    ) -> scipy.sparse.csr_matrix:
        carry = rigid_map(self.specimen, nodes)
        return (carry.T @ matrix @ carry).tocsr()

    def flat(self, rows: np.ndarray) -> np.ndarray:
        return rows.ravel()  # all x, all y, all angles

    @property
    def places(self) -> np.ndarray:
        return np.tile(self.specimen.grains.centroids, (3, 1))

    def unflat(self, values: np.ndarray) -> np.ndarray:
        return values.reshape(3, -1)

    def alike(self, count: int) -> np.ndarray:
        return np.concatenate([np.tile(np.arange(count), 2), count + np.arange(count)])
