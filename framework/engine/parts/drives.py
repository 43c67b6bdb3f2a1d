"""Driven freedoms: the velocity of boundaries, platens and fixed grains is imposed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.engine.parts.freedoms import Freedoms
from grainlaw.engine.parts.grains import Grains
from grainlaw.engine.parts.imposed import STILL, Imposed
from grainlaw.engine.parts.part import START, Changing, Constant, Moment, Part, Split
from grainlaw.loads import Driven, Fixed


class DriveArrays(NamedTuple):
    """Driven freedoms (d), in the order of their places."""

    row: Constant  #: (d,) of the freedoms
    place: Constant  #: (d,) node or rigid grain
    column: Constant  #: (d,) column of the schedule with the velocity
    reaction: Changing  #: (d,) N, of the last step
    total: Changing  #: (d,) N, summed over the steps of a sample
    work: Changing  #: (d,) J
    share: Constant


@njit(**OPTIONS)
def impose(drives, freedoms, velocities, time_step, thread):
    """Set the velocity of a thread's driven freedoms; their reaction, its sum over steps and its work, Eq. (11)."""
    force, velocity, mass, imposed = freedoms.force, freedoms.velocity, freedoms.mass, freedoms.imposed
    for d in range(drives.share[thread], drives.share[thread + 1]):
        r, i = drives.row[d], drives.place[d]
        before = velocity[r, i]
        after = velocities[drives.column[d]]
        imposed[r, i] = after
        external = mass[r, i] * (after - before) / time_step - force[r, i]
        drives.reaction[d] = external
        drives.total[d] += external
        drives.work[d] += external * 0.5 * (before + after) * time_step


class Drives(Part):
    """Freedoms on driven boundaries, and those of fixed grains."""

    takes = (Driven, Fixed)

    def __init__(self, grains: Grains, freedoms: Freedoms) -> None:
        self._grains, self._freedoms = grains, freedoms
        self.begin(Imposed(grains.specimen.mesh), START)

    def begin(self, imposed: Imposed, at: Moment) -> None:
        mesh, grains = self._grains.specimen.mesh, self._grains
        held: dict[tuple[int, int], int] = {}
        by_column: dict[int, Driven] = {}
        for drive in imposed.of(Driven):
            column = imposed.column(drive)
            nodes = mesh.middle(drive.boundary) if drive.roller else mesh.boundaries[drive.boundary]
            places = grains.of_nodes(nodes).tolist()
            before = [by_column.get(held.get((drive.axis, place), STILL)) for place in places]
            grains.check_drive(drive, list(zip(before, places, strict=True)))
            by_column[column] = drive
            held.update({(drive.axis, place): column for place in places})
            if not drive.roller:  # a platen along the edge of a rigid grain keeps it from turning
                held.update({(row, place): STILL for row in grains.turning for place in places})
        fixed = [grain for each in imposed.of(Fixed) for grain in each.grains]
        places = grains.of_grains(np.asarray(fixed, dtype=int)).tolist()
        held.update({(row, place): STILL for place in places for row in range(len(self._freedoms.arrays.mass))})
        rows, free = sorted(held, key=lambda place: (place[1], place[0])), self._freedoms.arrays.free
        row, place = np.array(rows, dtype=np.int64).reshape(-1, 2).T.copy()
        columns = np.array([held[key] for key in rows], dtype=np.int64)
        none = np.zeros(len(rows))
        self.arrays = DriveArrays(row, place, columns, none, none.copy(), none.copy(), np.zeros(2, dtype=np.int64))
        free[:], self._freedoms.arrays.imposed[:] = 1.0, 0.0
        free[row, place] = 0.0

    def share(self, split: Split) -> np.ndarray:
        return np.searchsorted(self.arrays.place, self._freedoms.share(split))

    def energy(self, time_step: float) -> dict[str, float]:
        return {"external": float(self.arrays.work.sum())}
