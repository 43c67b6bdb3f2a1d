"""What a stage imposes on boundaries: drives, load-controlled platens and pressures, as functions of time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from grainlaw.engine.parts.drives import Drives
from grainlaw.engine.parts.freedoms import Freedoms, Nodes
from grainlaw.engine.parts.grains import Grains
from grainlaw.engine.parts.part import Changing, Part
from grainlaw.engine.parts.platens import Platens
from grainlaw.engine.parts.pressures import Pressures
from grainlaw.parameter import ParameterError
from grainlaw.specimen import Specimen
from grainlaw.stage import Drive, FluidPressure, Hold, Pressure


class BoundaryBooks(NamedTuple):
    """What is recorded between stages and samples."""

    done: Changing  #: (1,) J, work in earlier stages
    samples: Changing  #: (1,) steps since the last sample
    start: Changing  #: (b, 2) m, mean displacement of each named boundary at the last sample


def check_boundaries(specimen: Specimen, imposed: Sequence[Drive | Hold | Pressure | FluidPressure]) -> None:
    """Raise :class:`ParameterError` for something imposed on a boundary that the specimen does not have."""
    for one in imposed:
        if one.boundary not in specimen.mesh.boundaries:
            names = ", ".join(sorted(specimen.mesh.boundaries))
            raise ParameterError(
                f"{type(one).__name__}: boundary = {one.boundary!r} is not one of the specimen's: {names}"
            )


class Boundaries(Part):
    """The drives, platens and pressures of the present stage, and the work done in earlier stages."""

    def __init__(self, grains: Grains, nodes: Nodes, freedoms: Freedoms) -> None:
        self._grains, self._nodes, self._freedoms = grains, nodes, freedoms
        self._mesh = grains.specimen.mesh
        self._number = {name: k for k, name in enumerate(self._mesh.boundaries)}
        self.books = BoundaryBooks(np.zeros(1), np.zeros(1, dtype=np.int64), np.zeros((len(self._number), 2)))
        self._impose([], [], [])

    def impose(
        self, drives: Sequence[Drive | Hold], pressures: Sequence[Pressure] = (), fixed: Sequence[int] = ()
    ) -> None:
        """Impose drives and pressures on boundaries, and fix the grains ``fixed``. Raises :class:`ParameterError`."""
        check_boundaries(self._grains.specimen, [*drives, *pressures])
        self.books.done[0] += float(self.driven.arrays.work.sum()) + self.pressed.work
        self._impose(drives, pressures, fixed)

    def _impose(self, drives: Sequence[Drive | Hold], pressures: Sequence[Pressure], fixed: Sequence[int]) -> None:
        self.drives, self.pressures = list(drives), list(pressures)
        self.driven = Drives(self._grains, self._freedoms, self.drives, fixed)
        self.hold()
        self.pressed = Pressures(self._grains.specimen, self.drives, self.pressures, self._nodes.arrays.displacement)
        self.new_sample()

    def follow_rim(self, before: np.ndarray) -> None:
        """Lay membranes anew where the rim has parted; ``before`` (2, i) m is the displacement at the last forces."""
        self.pressed.follow_rim(self._nodes.arrays.displacement, before)

    def hold(self) -> None:
        """Give each platen the mass and the momentum of the freedoms on its boundary."""
        self.platens = Platens(self._grains.specimen, self.drives, self.driven, self._freedoms)

    def energy(self, time_step: float) -> dict[str, float]:
        return {"external": float(self.books.done[0])}

    def schedule(self, times: np.ndarray, pace: float) -> np.ndarray:
        """(t, columns) at times (s) of the stage: drives, a column of zeros (rotations and fixed grains), pressures.

        The speeds of the drives are multiplied by ``pace``.
        """
        table = np.zeros((len(times), len(self.drives) + 1 + len(self.pressures)))
        for column, drive in enumerate(self.drives):
            factor = self._mesh.boundary_lengths[drive.boundary] if isinstance(drive, Hold) else pace
            table[:, column] = drive.course(times) * factor
        for column, pressure in enumerate(self.pressures, len(self.drives) + 1):
            table[:, column] = pressure.course(times)
        return table

    @property
    def speeds(self) -> np.ndarray:
        """(d,) m/s of the drives at a pace of 1; 0 of boundaries under a force."""
        return np.array([drive.speed if isinstance(drive, Drive) else 0.0 for drive in self.drives])

    def largest_load(self) -> float:
        """N per metre: the largest force of one drive, mean over the steps since the last sample."""
        driven, steps = self.driven.arrays, max(int(self.books.samples[0]), 1)
        loads = np.bincount(driven.column, driven.total, len(self.drives) + 1)
        return float(np.abs(loads).max()) / steps

    def reaction(self, boundary: str) -> np.ndarray:
        """(2,) N per metre, reaction of the drives of a boundary, mean over the steps since the last sample."""
        result = np.zeros(2)
        driven, steps = self.driven.arrays, max(int(self.books.samples[0]), 1)
        for column, drive in enumerate(self.drives):
            if drive.boundary == boundary:
                result[drive.axis] = driven.total[driven.column == column].sum() / steps
        return result

    def _mean_displacement(self, boundary: str) -> np.ndarray:
        return self._nodes.arrays.displacement.T[self._mesh.boundaries[boundary]].mean(axis=0)

    def moved(self, boundary: str) -> np.ndarray:
        """(2,) m: mean displacement of a boundary, averaged over the steps since the last sample."""
        return (self.books.start[self._number[boundary]] + self._mean_displacement(boundary)) / 2

    def new_sample(self) -> None:
        """Begin a new interval over which means are taken."""
        self.driven.arrays.total[:] = 0.0
        self.books.samples[0] = 0
        for name, k in self._number.items():
            self.books.start[k] = self._mean_displacement(name)

    def forces_on_rigid_nodes(self) -> np.ndarray:
        """(2, i) N on the nodes of rigid grains: a grain's reaction, spread evenly over its nodes on the boundary."""
        forces, grain = np.zeros_like(self._nodes.arrays.force), self._mesh.node_grain
        driven, count = self.driven.arrays, len(self._mesh.first_node) - 1
        for column, drive in enumerate(self.drives):
            mine = driven.column == column
            reaction = np.bincount(driven.place[mine], driven.reaction[mine], count)
            nodes = self._mesh.boundaries[drive.boundary]
            share = np.bincount(grain[nodes], minlength=count)
            forces[drive.axis, nodes] += reaction[grain[nodes]] / share[grain[nodes]]
        return forces
