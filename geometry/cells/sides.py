"""The sides of a region as straight lines that points are near to, mirrored over, or held on."""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.fields import ParameterError
from grainlaw.polygon import cross
from grainlaw.region import Region

STRAIGHT = 1e-9  #: sine of the largest turn at a corner that counts as none


@attrs.frozen(eq=False)
class Sides:
    """Lines through the sides; index letter ``k``. Points know up to two sides they lie on: (n, 2), -1 for none."""

    start: np.ndarray  #: (k, 2) m
    inward: np.ndarray  #: (k, 2) unit normals
    after: np.ndarray  #: (k,) the side that follows

    def distance(self, points: np.ndarray) -> np.ndarray:
        """(n, k) m from each point to the line of each side, positive to its left."""
        return np.einsum("nki,ki->nk", points[:, None] - self.start, self.inward)

    def hold(self, points: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Points (n, 2) moved onto the side they lie ``on``, or into the corner between two; the others as they are."""
        points = points.copy()
        corner = on[:, 1] >= 0
        one = (on[:, 0] >= 0) & ~corner
        start, inward = self.start[on[one, 0]], self.inward[on[one, 0]]
        points[one] -= ((points[one] - start) * inward).sum(axis=1)[:, None] * inward
        a, b = on[corner].T
        points[corner] = self.start[np.where(self.after[a] == b, b, a)]
        return points


def turns(region: Region) -> np.ndarray:
    """(k,) sine of the turn to the left at the end of each side."""
    along = region.end - region.start
    along /= np.hypot(*along.T)[:, None]
    return cross(along, along[region.after])


def is_convex(region: Region) -> bool:
    """Whether a region has no hole and turns left at every corner."""
    return not region.holes and bool(turns(region).min() > STRAIGHT)


def region_sides(region: Region) -> Sides:
    """Sides of the outline and of the holes."""
    along = region.end - region.start
    along /= np.hypot(*along.T)[:, None]
    return Sides(region.start, np.column_stack([-along[:, 1], along[:, 0]]), region.after)


def convex_sides(region: Region) -> Sides:
    """Sides of a convex region; any other raises :class:`~grainlaw.fields.ParameterError`."""
    if not is_convex(region):
        corner = region.end[turns(region).argmin()]
        raise ParameterError(f"region: outline must be convex, it does not turn left at its corner {corner}")
    return region_sides(region)


def depths(region: Region, points: np.ndarray) -> np.ndarray:
    """(n,) m from each point to the nearest side, negative outside."""
    away = np.full(len(points), np.inf)
    for start, end in zip(region.start, region.end, strict=True):
        along = end - start
        share = np.clip((points - start) @ along / (along @ along), 0, 1)
        away = np.minimum(away, np.hypot(*(points - start - share[:, None] * along).T))
    return np.where(region.contains(points), away, -away)
