"""The sides of a region, and lines inside it, as straight lines that points are near to, mirrored over, or held on."""

from __future__ import annotations

import attrs
import numpy as np
from scipy.spatial import cKDTree

from grainlaw.fields import ParameterError
from grainlaw.geometry.cells.tiling import Tiling
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


def vertices_on(vertices: np.ndarray, start: np.ndarray, end: np.ndarray, near: float) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of a vertex (v, 2) m and a line from ``start`` to ``end`` (n, 2) m that it is nearer to than ``near``."""
    reach = np.hypot(*(end - start).T) / 2 + 2 * near
    found = cKDTree(vertices).query_ball_point((start + end) / 2, reach) if len(start) else []
    line = np.repeat(np.arange(len(start)), [len(hits) for hits in found])
    vertex = np.concatenate([np.array(hits, dtype=np.int64) for hits in found]) if len(start) else line
    along = (end - start)[line]
    away = vertices[vertex] - start[line]
    height = abs(along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0]) / np.hypot(*along.T)
    return vertex[height < 2 * near], line[height < 2 * near]


def lines_at(count: int, vertex: np.ndarray, line: np.ndarray) -> np.ndarray:
    """(count, 2 or more) lines that each vertex lies on, ascending, -1 for none, of pairs of a vertex and a line."""
    lines = int(line.max(initial=0)) + 1
    vertex, line = np.divmod(np.unique(vertex * lines + line), lines)
    place = np.arange(len(vertex)) - np.searchsorted(vertex, vertex)
    on = np.full((count, max(2, int(place.max(initial=0)) + 1)), -1)
    on[vertex, place] = line
    return on


def held(
    tiling: Tiling, start: np.ndarray, end: np.ndarray, pairs: tuple[np.ndarray, np.ndarray]
) -> tuple[Tiling, Sides]:
    """The tiling whose vertices know which of these lines (n, 2) m they lie on too; and sides and lines together.

    ``pairs`` are vertices and their lines, as of :func:`vertices_on`. Vertices on one line alone are put exactly there.
    """
    sides = region_sides(tiling.region)
    along = (end - start) / np.hypot(*(end - start).T)[:, None]
    lines = Sides(
        np.concatenate([sides.start, start]),
        np.concatenate([sides.inward, np.column_stack([-along[:, 1], along[:, 0]])]),
        np.concatenate([sides.after, np.arange(len(start)) + len(sides.start)]),
    )
    vertex, line = pairs
    own, column = np.nonzero(tiling.on >= 0)
    vertex = np.concatenate([own, vertex])
    line = np.concatenate([tiling.on[own, column], line + len(sides.start)])
    on = lines_at(len(tiling.vertices), vertex, line)
    alone = np.where(on[:, 1:2] < 0, on[:, :2], -1)
    return attrs.evolve(tiling, vertices=lines.hold(tiling.vertices, alone), on=on), lines


def released(tiling: Tiling) -> Tiling:
    """The tiling whose vertices know the sides of the region alone."""
    on = np.where(tiling.on < len(tiling.region.start), tiling.on, -1)
    return attrs.evolve(tiling, on=-np.sort(-on, axis=1)[:, :2])


def marked(tiling: Tiling, start: np.ndarray, end: np.ndarray, kind: np.ndarray, near: float) -> Tiling:
    """The tiling with all edges that lie on a line (n, 2) m marked as of its kind (n,)."""
    vertex, line = vertices_on(tiling.vertices, start, end, near)
    if not len(vertex):
        return tiling
    pair = np.sort(vertex * len(start) + line)
    order = np.lexsort((line, vertex))
    vertex, line = vertex[order], line[order]
    first = np.searchsorted(vertex, np.arange(len(tiling.vertices) + 1))
    begin, finish = tiling.corners, tiling.corners[tiling.next]
    kinds = tiling.kind.copy()
    for place in range(int(np.diff(first).max())):  # the lines of the edge's first end, one after another
        has = np.flatnonzero(first[begin] + place < first[begin + 1])
        which = line[first[begin[has]] + place]
        wanted = finish[has] * len(start) + which
        both = pair[np.minimum(np.searchsorted(pair, wanted), len(pair) - 1)] == wanted
        kinds[has[both]] = kind[which[both]]
    return attrs.evolve(tiling, kind=kinds)
