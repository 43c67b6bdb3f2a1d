"""Convex polygons one at a time: lists of corners (x, y), counter-clockwise."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np

Point = tuple[float, float]
Polygon = list[Point]

MANY = 8  #: pieces of which all subsets are still tried


def polygon_of(corners: np.ndarray) -> Polygon:
    """From corners (n, 2) m."""
    return [(x, y) for x, y in corners.tolist()]


def area(polygon: Polygon) -> float:
    """m2."""
    (ox, oy), total = polygon[0], 0.0
    for (ax, ay), (bx, by) in pairwise(polygon[1:]):
        total += (ax - ox) * (by - oy) - (ay - oy) * (bx - ox)
    return total / 2


def centroid(polygon: Polygon) -> Point:
    """Of the area."""
    (ox, oy), total, x, y = polygon[0], 0.0, 0.0, 0.0
    for (ax, ay), (bx, by) in pairwise(polygon[1:]):
        twice = (ax - ox) * (by - oy) - (ay - oy) * (bx - ox)
        total, x, y = total + twice, x + twice * (ax + bx - 2 * ox), y + twice * (ay + by - 2 * oy)
    return ox + x / (3 * total), oy + y / (3 * total)


def depth(polygon: Polygon, point: Point) -> float:
    """Distance (m) to the nearest edge's line, positive inside."""
    return min(
        ((bx - ax) * (point[1] - ay) - (by - ay) * (point[0] - ax)) / ((bx - ax) ** 2 + (by - ay) ** 2) ** 0.5
        for (ax, ay), (bx, by) in zip(polygon, polygon[1:] + polygon[:1], strict=True)
    )


def split(polygon: Polygon, on: Point, along: Point, near: float) -> tuple[Polygon, Polygon]:
    """What lies left and right of the line through ``on``; an empty list for a side that has nothing.

    Corners nearer than ``near`` to the line are taken to lie on it: both parts are cut along a chord and stay convex.
    """
    norm = (along[0] ** 2 + along[1] ** 2) ** 0.5
    height = [((y - on[1]) * along[0] - (x - on[0]) * along[1]) / norm for x, y in polygon]
    height = [0.0 if abs(h) <= near else h for h in height]
    if min(height) >= 0 or max(height) <= 0:
        return (polygon, []) if min(height) >= 0 else ([], polygon)
    left, right = [], []
    for i, (point, h) in enumerate(zip(polygon, height, strict=True)):
        if h >= 0:
            left.append(point)
        if h <= 0:
            right.append(point)
        other, further = polygon[(i + 1) % len(polygon)], height[(i + 1) % len(polygon)]
        if h * further < 0:
            share = h / (h - further)
            cut = (point[0] + share * (other[0] - point[0]), point[1] + share * (other[1] - point[1]))
            left.append(cut)
            right.append(cut)
    return left, right


def hull(points: list[Point]) -> Polygon:
    """Smallest convex polygon round the points (Andrew 1979, doi:10.1016/0020-0190(79)90072-3)."""
    points = sorted(set(points))
    halves = []
    for ordered in (points, points[::-1]):
        chain: Polygon = []
        for x, y in ordered:
            while len(chain) > 1:
                (ax, ay), (bx, by) = chain[-2], chain[-1]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                    break
                chain.pop()
            chain.append((x, y))
        halves.append(chain[:-1])
    return halves[0] + halves[1]


def joined(pieces: list[Polygon]) -> list[Polygon]:
    """Pieces that do not overlap, those joined whose union is convex: the union has the area of its hull."""
    pieces = sorted(pieces, key=area)
    areas = [area(piece) for piece in pieces]
    sizes = range(len(pieces), 1, -1) if len(pieces) <= MANY else (2,)
    for size in sizes:
        for chosen in combinations(range(len(pieces)), size):
            union = hull([point for i in chosen for point in pieces[i]])
            if area(union) <= sum(areas[i] for i in chosen) * (1 + 1e-10):
                return joined([union, *(piece for i, piece in enumerate(pieces) if i not in chosen)])
    return pieces
