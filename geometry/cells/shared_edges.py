"""Polygons drawn one by one, as their neighbours see them: near corners joined, hanging ones split in.

A vertex of one polygon that lies on an edge of its neighbour is hanging: it becomes a corner of both.
"""

from __future__ import annotations

import attrs
import numpy as np
from scipy.spatial import cKDTree

from grainlaw.fields import ParameterError
from grainlaw.polygon import areas_and_centroids, cross, crossing_sides, following, linked
from grainlaw.region import ROUNDING


def place(point: np.ndarray) -> str:
    """For a message."""
    return f"({point[0]:.6g}, {point[1]:.6g}) m"


@attrs.frozen(eq=False)
class Polygons:
    """Polygons as in a :class:`~grainlaw.tessellation.Tessellation`, each with the number it was given by."""

    vertices: np.ndarray  #: (v, 2) m
    corners: np.ndarray  #: vertex numbers of all polygons in a row
    first: np.ndarray  #: (p + 1,)
    given: np.ndarray  #: (p,) number of the polygon among those given: cut ones have several here

    @property
    def owner(self) -> np.ndarray:
        """Number, as given, of the polygon of each corner."""
        return np.repeat(self.given, np.diff(self.first))

    @property
    def next(self) -> np.ndarray:
        """Vertex that follows each corner."""
        return self.corners[following(self.first)]

    @property
    def loose(self) -> np.ndarray:
        """Positions of corners whose edge to the next one no other polygon runs along the other way."""
        run, wanted = self.corners * len(self.vertices) + self.next, self.next * len(self.vertices) + self.corners
        return np.flatnonzero(~np.isin(run, wanted))

    @property
    def areas(self) -> np.ndarray:
        """(p,) m2."""
        return areas_and_centroids(self.vertices[self.corners], self.first)[0]

    @property
    def concave(self) -> np.ndarray:
        """Polygons with a corner of more than 180 degrees."""
        along = self.vertices[self.next] - self.vertices[self.corners]
        onward = along[following(self.first)]
        bad = cross(along, onward) < -ROUNDING * np.hypot(*along.T) * np.hypot(*onward.T)
        return np.unique(np.repeat(np.arange(len(self.given)), np.diff(self.first))[bad])

    def ring(self, p: int) -> np.ndarray:
        """Vertices of polygon p."""
        return self.corners[self.first[p] : self.first[p + 1]]


def joined(where: str, points: np.ndarray, first: np.ndarray, tolerance: float, fixed: np.ndarray) -> Polygons:
    """Polygons whose corners ``points`` (n, 2) lie in a row; points nearer than ``tolerance`` (m) become one.

    The first of them stays where it is, one of ``fixed`` (f, 2) before all. Raises ParameterError for a polygon that is
    smaller than that or that crosses itself.
    """
    vertices, number = merged(np.concatenate([fixed, points]), tolerance)
    return cleaned(where, vertices, number[len(fixed) :], first)


def merged(points: np.ndarray, tolerance: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n, 2) of which those nearer than ``tolerance`` (m) are one, and for each its number among them.

    The first of them stays where it is.
    """
    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    _, at, number = np.unique(linked(len(points), *pairs.T), return_index=True, return_inverse=True)
    return points[at], number


def cleaned(where: str, vertices: np.ndarray, corners: np.ndarray, first: np.ndarray) -> Polygons:
    """Counter-clockwise polygons without a corner twice in a row. Raises ParameterError as :func:`joined`."""
    stay = corners != corners[following(first)]
    left = np.add.reduceat(stay, first[:-1])
    if left.min() < 3:
        p = int(left.argmin())
        raise ParameterError(
            f"{where}: polygon {p} at {place(vertices[corners[first[p]]])} has less than 3 different corners"
        )
    first = np.concatenate([[0], np.cumsum(left)])
    made = Polygons(vertices, corners[stay], first, np.arange(len(first) - 1))
    _refuse_crossing(where, made)
    clockwise = made.areas < 0
    position = np.arange(first[-1])
    of = made.owner
    position = np.where(clockwise[of], first[of] + first[of + 1] - 1 - position, position)
    return attrs.evolve(made, corners=made.corners[position])


def _refuse_crossing(where: str, made: Polygons) -> None:
    """Only what does not turn once round, always to the same side, can cross itself."""
    along = made.vertices[made.next] - made.vertices[made.corners]
    onward = along[following(made.first)]
    turn = np.arctan2(cross(along, onward), (along * onward).sum(axis=1))
    total = np.add.reduceat(turn, made.first[:-1])
    steady = np.add.reduceat(abs(turn), made.first[:-1])
    for p in np.flatnonzero((abs(abs(total) - 2 * np.pi) > 1e-6) | (steady > 2 * np.pi + 1e-6)).tolist():
        start = made.vertices[made.ring(p)]
        found = crossing_sides(start, np.roll(start, -1, axis=0), np.roll(np.arange(len(start)), -1))
        if found:
            k, m = found
            point = crossing(start[k], start[(k + 1) % len(start)], start[m], start[(m + 1) % len(start)])
            raise ParameterError(f"{where}: polygon {p} crosses or touches itself near {place(point)}")


def crossing(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Where the straight lines a-b and c-d cross; c where they are parallel."""
    turn = cross(b - a, d - c)
    return c if turn == 0 else a + (b - a) * cross(c - a, d - c) / turn


def split_at_hanging(polygons: Polygons, tolerance: float, fixed: int = 0) -> Polygons:
    """Every vertex that lies within ``tolerance`` (m) of an edge becomes a corner there, and is put exactly on it.

    The first ``fixed`` vertices lie where they are, and may be where no polygon has a corner yet.
    """
    loose, vertices = polygons.loose, polygons.vertices.copy()
    start, end = polygons.corners[loose], polygons.next[loose]
    candidates = np.union1d(np.arange(fixed), np.concatenate([start, end])).astype(np.int64)
    tree = cKDTree(vertices[candidates])
    a, b = vertices[start], vertices[end]
    length = np.hypot(*(b - a).T)
    found = tree.query_ball_point((a + b) / 2, length / 2 + tolerance)
    edge = np.repeat(np.arange(len(loose)), [len(hits) for hits in found])
    vertex = candidates[np.array([v for hits in found for v in hits], dtype=np.int64)]
    along = (b - a)[edge] / length[edge, None]
    from_start = vertices[vertex] - a[edge]
    share = (along * from_start).sum(axis=1)
    on = (abs(cross(along, from_start)) <= tolerance) & (vertex != start[edge]) & (vertex != end[edge])
    on &= (share > 0) & (share < length[edge])
    edge, vertex, share, along = edge[on], vertex[on], share[on], along[on]
    moving = vertex >= fixed
    vertices[vertex[moving]] = (a[edge] + share[:, None] * along)[moving]
    at = np.concatenate([np.arange(len(polygons.corners)), loose[edge]])
    order = np.lexsort((np.concatenate([np.zeros(len(polygons.corners)), share]), at))
    grown = np.bincount(loose[edge], minlength=len(polygons.corners)) + 1
    corners = np.concatenate([polygons.corners, vertex])[order]
    return attrs.evolve(
        polygons, vertices=vertices, corners=corners, first=np.concatenate([[0], np.cumsum(grown)])[polygons.first]
    )
