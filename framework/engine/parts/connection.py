"""Which broken contact points are connected: by the corners where bonds meet, and within a bond that is broken at both.

Index letters: ``c`` bond, ``p`` contact point (the first points of all bonds, then the second), ``i`` node.
"""

from __future__ import annotations

import numpy as np
import scipy

from grainlaw.mesh import Mesh


def _joined(size: int, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """(size,) number of the connected piece of each vertex of a graph with edges from ``one`` to ``other``."""
    graph = scipy.sparse.coo_matrix((np.ones(len(one), dtype=bool), (one, other)), shape=(size, size))
    pieces: np.ndarray = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
    return pieces


class Connection:
    """The corners of grains, where each of the two points of a bond touches one, and what of it is connected.

    Nodes of different grains are one corner if bonds join them, whether these are broken or not.
    """

    def __init__(self, mesh: Mesh, ends: np.ndarray) -> None:
        one, other = ends[:, :2].T.ravel(), ends[:, 2:].T.ravel()
        self.corner = _joined(len(mesh.nodes), one, other)  #: (i,) number of the corner at each node
        self._at = self.corner[one]  #: (p,) corner that each point touches

    def pieces(self, broken: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Number of the connected piece of each contact point (p,) and of the corner at each node (i,).

        Pieces connect through points that are ``broken`` (p,); one that is not is a piece by itself.
        """
        points = len(self._at)
        first, both = np.flatnonzero(broken), np.flatnonzero(broken.reshape(2, -1).all(axis=0))
        one = np.concatenate([first, both])
        other = np.concatenate([points + self._at[first], points // 2 + both])
        found = _joined(points + int(self.corner.max(initial=-1)) + 1, one, other)
        return found[:points], found[points + self.corner]
