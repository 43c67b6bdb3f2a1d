"""How much of the cells of a convex frame lies inside a region of any shape.

The boundary of what a cell has inside consists of pieces of its own edges and of pieces of the sides of the region.
By Green's theorem its area is half the sum of ``a x b`` over all of these, and a straight piece of the line from a to b
that is a share s of it adds ``s a x b``: only the shares are wanted. They follow from where edges and sides cross.
"""

from __future__ import annotations

import numpy as np

from grainlaw.geometry.cells.bounded_voronoi import Diagram
from grainlaw.geometry.cells.sides import convex_sides
from grainlaw.polygon import cross
from grainlaw.region import Region

NEAR = 1e-9  #: of the extent: a side of the region with both ends nearer to one of the frame lies on it
WITHIN = 0.4142  #: of an edge, where it is asked whether it is inside: hardly ever on a side of the region


def inside_areas(region: Region, frame: Region, diagram: Diagram, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(g,) m2 of the cells inside the region, and (e,) the share inside it of the edges ``diagram.once``."""
    left, right = diagram.seed[diagram.once], diagram.other[diagram.once]
    p, q = diagram.vertices[diagram.start[diagram.once]], diagram.vertices[diagram.end[diagram.once]]
    low, high = np.minimum(p, q), np.maximum(p, q)
    origin, extent = region.bounds.mean(axis=0), np.ptp(region.bounds, axis=0).max()
    away = abs(convex_sides(frame).distance(region.start)) < NEAR * extent
    on_frame = away & away[region.after]  # side of the region, side of the frame
    share = region.contains(p + WITHIN * (q - p)).astype(float)
    twice = np.zeros(len(diagram.seeds))
    for k, (a, b) in enumerate(zip(region.start, region.end, strict=True)):
        if on_frame[k].any():
            owner, part = _along_frame(diagram, int(on_frame[k].argmax()), a, b)
        else:
            near = np.flatnonzero(((low <= np.maximum(a, b)) & (high >= np.minimum(a, b))).all(axis=1))
            which, s, t, leaves = _crossings(a, b, p[near], q[near])
            e, way = near[which], np.where(leaves, 1.0, -1.0)
            np.add.at(share, e, way * (s - (s > WITHIN)))
            # An edge leaves the region where the side passes from its right to its left.
            last = np.where(leaves, left[e], right[e])[t.argmax()] if len(e) else _cell_at(diagram.seeds, weights, b)
            owner, part = np.concatenate([left[e], right[e], [last]]), np.concatenate([-way * t, way * t, [1.0]])
        np.add.at(twice, owner, part * cross(a - origin, b - origin))
    area = share * cross(p - origin, q - origin)
    twice += np.bincount(left, area, len(twice)) - np.bincount(right, area, len(twice))
    return twice / 2, share


def _along_frame(diagram: Diagram, side: int, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cells at a side of the frame, and what share of the line from a to b on it each has."""
    h = np.flatnonzero(diagram.side == side)
    along = (b - a) / ((b - a) @ (b - a))
    begin, finish = (np.clip((diagram.vertices[ends[h]] - a) @ along, 0, 1) for ends in (diagram.start, diagram.end))
    return diagram.seed[h], finish - begin


def _crossings(
    a: np.ndarray, b: np.ndarray, p: np.ndarray, q: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Which lines from p to q cross that from a to b, where along p to q, where along a to b, and whether to its right.

    The region is on the left of a side: who crosses it to the right leaves.
    """
    of_p, of_q = cross(b - a, p - a), cross(b - a, q - a)
    of_a, of_b = cross(q - p, a - p), cross(q - p, b - p)
    which = np.flatnonzero(((of_p > 0) != (of_q > 0)) & ((of_a > 0) != (of_b > 0)))
    s, t = of_p / np.where(of_p == of_q, 1, of_p - of_q), of_a / np.where(of_a == of_b, 1, of_a - of_b)
    return which, s[which], t[which], of_p[which] > 0


def _cell_at(seeds: np.ndarray, weights: np.ndarray, point: np.ndarray) -> int:
    return int((((seeds - point) ** 2).sum(axis=1) - weights).argmin())
