"""The line of a membrane round a specimen: which nodes it lies on, found anew as the rim changes.

The empty room round the specimen is dug out of a triangulation of all nodes on edges of grains, from outside, through
gaps that are wider than a grain (Duckham and others, 2008, doi:10.1016/j.patcog.2008.03.023). What bounds this room is
the membrane. It is closed but for the platens, so that an even pressure on it has no resultant besides theirs; and it
goes all round a piece that has flown away, on which it then has none.
"""

from __future__ import annotations

import numpy as np
import scipy

SMALLER = 1e-3  #: by which grains shrink while the line is found, so that no two nodes lie in one place


def membrane(place: np.ndarray, grain: np.ndarray, platens: np.ndarray, gap: float) -> np.ndarray:
    """(n, 2) ends of the parts of a membrane, the specimen on the left, in the order of their first ends.

    ``place`` (i, 2) m and ``grain`` (i,) of nodes; ``platens`` (i, b), which nodes lie on each driven boundary: the
    membrane ends there. It spans gaps up to ``gap`` (m).
    """
    count = np.bincount(grain)
    centre = np.stack([np.bincount(grain, row) for row in place.T], axis=1) / np.maximum(count, 1)[:, None]
    triangles = scipy.spatial.Delaunay(place + SMALLER * (centre[grain] - place))
    corners, neighbours = triangles.simplices, triangles.neighbors
    ends = np.stack([np.roll(corners, -1, axis=1), np.roll(corners, -2, axis=1)], axis=-1)  # (t, 3, 2), each opposite
    first, second = ends[..., 0], ends[..., 1]
    sealed = (platens[first] & platens[second]).any(axis=-1)
    wide = np.hypot(*(place[second] - place[first]).transpose(2, 0, 1)) > gap
    passable = wide & ~sealed & (grain[first] != grain[second])
    outside = np.zeros(len(corners) + 1, dtype=bool)
    outside[-1] = True  # the neighbour -1 of triangles at the hull
    front = np.flatnonzero((passable & (neighbours < 0)).any(axis=1))
    while len(front):
        outside[front] = True
        beyond = neighbours[front][passable[front]]
        front = np.unique(beyond[~outside[beyond]])
    bounds = ~outside[:-1, None] & outside[neighbours] & ~sealed
    found = ends[bounds]
    ordered: np.ndarray = found[np.lexsort((found[:, 1], found[:, 0]))]
    return ordered
