"""What a stage imposes on boundaries: drives, load-controlled platens, pressures, tractions; and which are quiet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from grainlaw.boundary_conditions import Drive, Hold, Pressure, Quiet, Traction
from grainlaw.columns import ABSORBED
from grainlaw.engine.parts.drives import Drives
from grainlaw.engine.parts.freedoms import Freedoms, Nodes
from grainlaw.engine.parts.grains import Grains
from grainlaw.engine.parts.part import Changing, Part
from grainlaw.engine.parts.platens import Platens
from grainlaw.engine.parts.pressures import Pressures
from grainlaw.engine.parts.quiet import QuietBoundaries
from grainlaw.engine.parts.tractions import Tractions
from grainlaw.parameter import ParameterError
from grainlaw.specimen import Specimen
from grainlaw.time_series import Imposed


class BoundaryBooks(NamedTuple):
    """What is recorded between stages and samples."""

    done: Changing  #: (1,) J, work in earlier stages
    absorbed: Changing  #: (1,) J, that quiet boundaries took in earlier stages
    samples: Changing  #: (1,) steps since the last sample
    start: Changing  #: (b, 2) m, mean displacement of each named boundary at the last sample


def check_boundaries(specimen: Specimen, imposed: Sequence[Imposed | Quiet]) -> None:
    """Raise :class:`ParameterError` for something imposed on a boundary that the specimen does not have."""
    for one in imposed:
        if one.boundary not in specimen.mesh.boundaries:
            names = ", ".join(sorted(specimen.mesh.boundaries))
            raise ParameterError(
                f"{type(one).__name__}: boundary = {one.boundary!r} is not one of the specimen's: {names}"
            )


class Boundaries(Part):
    """All that the present stage imposes on boundaries, and the work done in earlier stages."""

    def __init__(self, grains: Grains, nodes: Nodes, freedoms: Freedoms) -> None:
        self._grains, self._nodes, self._freedoms = grains, nodes, freedoms
        self._mesh = grains.specimen.mesh
        self._number = {name: k for k, name in enumerate(self._mesh.boundaries)}
        self.books = BoundaryBooks(
            np.zeros(1), np.zeros(1), np.zeros(1, dtype=np.int64), np.zeros((len(self._number), 2))
        )
        self._impose([], [], [], [], [], nodes.arrays.displacement)

    def impose(
        self, drives: Sequence[Drive | Hold], pressures: Sequence[Pressure] = (), fixed: Sequence[int] = (),
        tractions: Sequence[Traction] = (), quiet: Sequence[Quiet] = (), before: np.ndarray | None = None,
    ) -> None:  # fmt: skip
        """Impose all that a stage does, and fix the grains ``fixed``. Raises :class:`ParameterError`.

        ``before`` (2, i) m is the displacement at the last forces; None where nothing moves.
        """
        check_boundaries(self._grains.specimen, [*drives, *pressures, *tractions, *quiet])
        now = self._nodes.arrays.displacement
        self.books.done[0] += float(self.driven.arrays.work.sum())
        self.books.done[0] += self.pressed.work + self.pressed.last_work(now)
        self.books.done[0] += float(self.loaded.arrays.work.sum()) + self.loaded.last_work(now)
        self.books.absorbed[0] -= float(self.quiet.arrays.work.sum()) + self.quiet.last_work(now)
        self._impose(drives, pressures, fixed, tractions, quiet, now if before is None else before)

    def _impose(
        self, drives: Sequence[Drive | Hold], pressures: Sequence[Pressure], fixed: Sequence[int],
        tractions: Sequence[Traction], quiet: Sequence[Quiet], before: np.ndarray,
    ) -> None:  # fmt: skip
        self.drives, self.loads = list(drives), [*pressures, *tractions]
        specimen = self._grains.specimen
        self.driven = Drives(self._grains, self._freedoms, self.drives, fixed)
        self.hold()
        self.pressed = Pressures(specimen, self.drives, pressures, before)
        self.loaded = Tractions(self._mesh, tractions, len(self.drives) + 1 + len(pressures), before)
        self.quiet = QuietBoundaries(specimen, quiet, self._freedoms, before)
        self.new_sample()

    @property
    def parts(self) -> dict[str, Part]:
        """All by name, in the order in which the ledger adds them up."""
        return {
            "drives": self.driven, "pressures": self.pressed, "tractions": self.loaded, "quiet": self.quiet,
            "platens": self.platens, "boundaries": self,
        }  # fmt: skip

    def follow_rim(self, before: np.ndarray) -> None:
        """Lay membranes anew where the rim has parted; ``before`` (2, i) m is the displacement at the last forces."""
        self.pressed.follow_rim(self._nodes.arrays.displacement, before)

    def hold(self) -> None:
        """Give each platen the mass and the momentum of the freedoms on its boundary."""
        self.platens = Platens(self._grains.specimen, self.drives, self.driven, self._freedoms)

    def energy(self, time_step: float) -> dict[str, float]:
        return {"external": float(self.books.done[0]), ABSORBED: float(self.books.absorbed[0])}

    def schedule(self, begin: np.ndarray, end: np.ndarray, pace: float) -> np.ndarray:
        """(t, columns) of steps between times (s) of the stage: drives, a column of zeros, pressures, tractions.

        The speeds of the drives are multiplied by ``pace``. The zeros are for rotations and fixed grains.
        """
        table = np.zeros((len(end), len(self.drives) + 1 + len(self.loads)))
        for column, drive in enumerate(self.drives):
            factor = self._mesh.boundary_lengths[drive.boundary] if isinstance(drive, Hold) else pace
            table[:, column] = drive.course(begin, end) * factor
        for column, load in enumerate(self.loads, len(self.drives) + 1):
            table[:, column] = load.course(begin, end)
        return table

    @property
    def speeds(self) -> np.ndarray:
        """(d,) m/s of the drives at a pace of 1, the largest of those that change; 0 of boundaries under a force."""
        found = [0.0] * len(self.drives)
        for column, drive in enumerate(self.drives):
            if isinstance(drive, Drive):
                found[column] = drive.speed if isinstance(drive.speed, float) else drive.largest
        return np.array(found)

    @property
    def lasts(self) -> float:
        """s since the stage began, until when its loads change."""
        return max((one.lasts for one in (*self.drives, *self.loads)), default=0.0)

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

    def _mean(self, boundary: str, displacement: np.ndarray) -> np.ndarray:
        found: np.ndarray = displacement.T[self._mesh.boundaries[boundary]].mean(axis=0)
        return found

    def moved(self, boundary: str, at_forces: np.ndarray) -> np.ndarray:
        """(2,) m: mean displacement of a boundary, averaged over the forces since the last sample.

        Nodes are displaced by ``at_forces`` (2, i) m at the last of them.
        """
        return (self.books.start[self._number[boundary]] + self._mean(boundary, at_forces)) / 2

    def new_sample(self) -> None:
        """Begin a new interval over which means are taken."""
        self.driven.arrays.total[:] = 0.0
        self.books.samples[0] = 0
        for name, k in self._number.items():
            self.books.start[k] = self._mean(name, self._nodes.arrays.displacement)

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
