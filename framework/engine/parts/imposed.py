"""The loads of the present stage, and the table of what they impose by step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grainlaw.loads import BoundaryLoad, Drive
from grainlaw.mesh import Mesh
from grainlaw.stage import L, Load, loads_of

STILL = 0  #: column of zeros: rotations of driven grains, fixed grains, and what bears no load


class Imposed:
    """Loads by their class, each with a level in a column of its own, after that of zeros."""

    def __init__(self, mesh: Mesh, loads: Sequence[Load] = ()) -> None:
        self._mesh, self.loads = mesh, list(loads)
        self._levels = self.of(BoundaryLoad)  # in the columns from 1 on

    def of(self, *kinds: type[L]) -> list[L]:
        """The loads of some classes, in their order."""
        return loads_of(self.loads, *kinds)

    def column(self, load: BoundaryLoad) -> int:
        """Of the schedule."""
        return 1 + next(k for k, one in enumerate(self._levels) if one is load)

    def schedule(self, begin: np.ndarray, end: np.ndarray, pace: float) -> np.ndarray:
        """(t, columns) of steps between times (s) of the stage; ``pace`` multiplies the speeds of the drives."""
        table = np.zeros((len(end), 1 + len(self._levels)))
        for column, load in enumerate(self._levels, 1):
            table[:, column] = load.schedule(begin, end, pace, self._mesh.boundary_lengths[load.boundary])
        return table

    @property
    def speeds(self) -> np.ndarray:
        """(columns,) m/s of the drives at a pace of 1, the largest of those that change; 0 in all other columns."""
        found = np.zeros(1 + len(self._levels))
        for column, load in enumerate(self._levels, 1):
            if isinstance(load, Drive):
                found[column] = load.speed if isinstance(load.speed, float) else load.largest
        return found

    @property
    def lasts(self) -> float:
        """s since the stage began, until when its loads change."""
        return max((load.lasts for load in self.loads), default=0.0)
