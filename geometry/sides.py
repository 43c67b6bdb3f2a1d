"""The sides of a convex region as straight lines that points are near to, mirrored over, or held on."""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.parameter import ParameterError
from grainlaw.tessellation import Region


@attrs.frozen(eq=False)
class Sides:
    """Lines through the sides; index letter ``k``. Points know up to two sides they lie on: (n, 2), -1 for none."""

    start: np.ndarray  #: (k, 2) m
    inward: np.ndarray  #: (k, 2) unit normals

    def distance(self, points: np.ndarray) -> np.ndarray:
        """(n, k) m from each point to each side, positive inside."""
        return np.einsum("nki,ki->nk", points[:, None] - self.start, self.inward)

    def hold(self, points: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Points (n, 2) moved onto the side they lie ``on``, or into the corner between two; the others as they are."""
        points = points.copy()
        corner = on[:, 1] >= 0
        one = (on[:, 0] >= 0) & ~corner
        start, inward = self.start[on[one, 0]], self.inward[on[one, 0]]
        points[one] -= ((points[one] - start) * inward).sum(axis=1)[:, None] * inward
        low, high = np.sort(on[corner], axis=1).T
        points[corner] = self.start[np.where(low + 1 == high, high, low)]  # the last side meets the first in corner 0
        return points


def convex_sides(region: Region) -> Sides:
    """Sides of a convex region; any other raises :class:`~grainlaw.parameter.ParameterError`."""
    along = np.roll(region.outline, -1, axis=0) - region.outline
    along /= np.hypot(*along.T)[:, None]
    onward = np.roll(along, -1, axis=0)
    turn = along[:, 0] * onward[:, 1] - along[:, 1] * onward[:, 0]
    if turn.min() <= 1e-9:
        corner = region.outline[(turn.argmin() + 1) % len(turn)]
        raise ParameterError(f"region: outline must be convex, it does not turn left at its corner {corner}")
    return Sides(region.outline, np.column_stack([-along[:, 1], along[:, 0]]))
