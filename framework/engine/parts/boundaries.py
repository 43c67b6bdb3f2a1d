"""What boundaries do in a stage: their reactions and their motion, means over the steps of a sample."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from grainlaw.engine.parts.drives import Drives
from grainlaw.engine.parts.freedoms import Nodes
from grainlaw.engine.parts.imposed import STILL, Imposed
from grainlaw.engine.parts.part import Changing, Moment, Part
from grainlaw.loads import Driven
from grainlaw.mesh import Mesh


class BoundaryBooks(NamedTuple):
    """What is recorded between samples."""

    samples: Changing  #: (1,) steps since the last sample
    start: Changing  #: (2, i) m, displacement of the nodes at the last sample


class Boundaries(Part):
    """Reactions and displacements of the named boundaries."""

    def __init__(self, mesh: Mesh, nodes: Nodes, drives: Drives) -> None:
        self._mesh, self._nodes, self._drives = mesh, nodes, drives
        self._columns: list[tuple[int, Driven]] = []
        self.books = BoundaryBooks(np.zeros(1, dtype=np.int64), np.zeros_like(nodes.arrays.displacement))

    def begin(self, imposed: Imposed, at: Moment) -> None:
        self._columns = [(imposed.column(drive), drive) for drive in imposed.of(Driven)]
        self.new_sample()

    def largest_load(self) -> float:
        """N per metre: the largest force of one drive, mean over the steps since the last sample.

        What holds turns and fixed grains still is not of a drive, and has moments.
        """
        driven, steps = self._drives.arrays, max(int(self.books.samples[0]), 1)
        forces = np.bincount(driven.column, driven.total, STILL + 1)[STILL + 1 :]
        return float(np.abs(forces).max(initial=0.0)) / steps

    def reaction(self, boundary: str) -> np.ndarray:
        """(2,) N per metre, reaction of the drives of a boundary, mean over the steps since the last sample."""
        result = np.zeros(2)
        driven, steps = self._drives.arrays, max(int(self.books.samples[0]), 1)
        for column, drive in self._columns:
            if drive.boundary == boundary:
                result[drive.axis] = driven.total[driven.column == column].sum() / steps
        return result

    def mean_displacement(self, at_forces: np.ndarray) -> np.ndarray:
        """(2, i) m of the nodes, averaged over the forces since the last sample; ``at_forces`` (2, i) at the last."""
        return (self.books.start + at_forces) / 2

    def new_sample(self) -> None:
        """Begin a new interval over which means are taken."""
        self._drives.arrays.total[:] = 0.0
        self.books.samples[0] = 0
        self.books.start[:] = self._nodes.arrays.displacement

    def forces_on_rigid_nodes(self) -> np.ndarray:
        """(2, i) N on the nodes of rigid grains: a grain's reaction, spread evenly over its nodes on the boundary."""
        forces, grain = np.zeros_like(self._nodes.arrays.force), self._mesh.node_grain
        driven, count = self._drives.arrays, len(self._mesh.first_node) - 1
        for column, drive in self._columns:
            mine = driven.column == column
            reaction = np.bincount(driven.place[mine], driven.reaction[mine], count)
            nodes = self._mesh.boundaries[drive.boundary]
            share = np.bincount(grain[nodes], minlength=count)
            forces[drive.axis, nodes] += reaction[grain[nodes]] / share[grain[nodes]]
        return forces
