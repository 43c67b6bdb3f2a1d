"""Convex polygons cut by a trace, a line of several straight segments that may begin and end inside of them."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from grainlaw.geometry.cells.convex import Point, Polygon, depth, polygon_of, split

THROUGH = 0.5  #: share of its chord from which on a trace that ends in a polygon cuts it

Chord = tuple[Point, Point]


def cut_by(parts: list[list[Polygon]], trace: np.ndarray, near: float) -> list[Chord]:
    """Cut the polygons that a trace (n, 2) m runs through, in place; and the cuts, from side to side.

    ``parts`` has a list of polygons for each grain. Each is cut along the straight line between the points where the
    trace enters and leaves it.
    """
    points = polygon_of(trace)
    low, high = np.minimum(trace[:-1], trace[1:]) - near, np.maximum(trace[:-1], trace[1:]) + near
    chords: list[Chord] = []
    for g, polygons in enumerate(parts):
        every = np.array([corner for polygon in polygons for corner in polygon])
        if not ((low <= every.max(axis=0)) & (high >= every.min(axis=0))).all(axis=1).any():
            continue
        after: list[Polygon] = []
        for polygon in polygons:
            cut, made = _cut(polygon, points, near)
            after += cut
            chords += made
        parts[g] = after
    return chords


def _cut(polygon: Polygon, trace: list[Point], near: float) -> tuple[list[Polygon], list[Chord]]:
    pieces, chords = [polygon], []
    for begin, finish in _passages(polygon, trace):
        middle = (begin[0] + finish[0]) / 2, (begin[1] + finish[1]) / 2
        along = finish[0] - begin[0], finish[1] - begin[1]
        pieces.sort(key=lambda piece: -depth(piece, middle))
        here = pieces[0]
        if math.hypot(*along) <= near or depth(here, middle) <= near:
            continue
        whole = _inside(here, begin, (begin[0] + along[0], begin[1] + along[1]), -math.inf, math.inf)
        if whole is None or whole[1] - whole[0] > 1 / THROUGH:
            continue
        parted = split(here, begin, along, near)
        if all(parted):
            pieces[:1] = parted
            chords.append((_at(begin, along, whole[0]), _at(begin, along, whole[1])))
    return pieces, chords


def _passages(polygon: Polygon, trace: list[Point]) -> list[Chord]:
    """Where a trace enters and leaves a polygon, or begins and ends in it, each time that it does."""
    passages: list[Chord] = []
    goes_on = False
    for begin, finish in pairwise(trace):
        inside = _inside(polygon, begin, finish, 0.0, 1.0)
        if inside is None:
            goes_on = False
            continue
        along = finish[0] - begin[0], finish[1] - begin[1]
        enters, leaves = _at(begin, along, inside[0]), _at(begin, along, inside[1])
        if goes_on and inside[0] == 0:
            passages[-1] = passages[-1][0], leaves
        else:
            passages.append((enters, leaves))
        goes_on = inside[1] == 1
    return passages


def _at(begin: Point, along: Point, share: float) -> Point:
    return begin[0] + share * along[0], begin[1] + share * along[1]


def _inside(polygon: Polygon, begin: Point, finish: Point, low: float, high: float) -> tuple[float, float] | None:
    """From which to which share, between two bounds, of the way from begin to finish one is inside; None if never.

    Cyrus and Beck 1978, doi:10.1016/0097-8493(78)90021-3.
    """
    for (ax, ay), (bx, by) in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        dx, dy = bx - ax, by - ay
        first = dx * (begin[1] - ay) - dy * (begin[0] - ax)
        last = dx * (finish[1] - ay) - dy * (finish[0] - ax)
        if first == last:
            if first < 0:
                return None
        elif first < last:
            low = max(low, first / (first - last))
        else:
            high = min(high, first / (first - last))
    return (low, high) if low < high else None
