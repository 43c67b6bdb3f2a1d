"""Convex polygons cut by the sides of any region into convex pieces.

A polygon is cut in two along the line of a side that runs through it, and its parts again, until no side runs through a
part: a binary space partition (Fuchs, Kedem and Naylor 1980, doi:10.1145/965105.807481). Where it holds a corner of
the region of more than 180 degrees, the first cut goes through that corner and parts the angle.
"""

from __future__ import annotations

import math
from functools import cached_property

import attrs
import numpy as np

from grainlaw.geometry.cells.convex import Point, Polygon, centroid, depth, joined, split
from grainlaw.geometry.cells.sides import STRAIGHT, turns
from grainlaw.polygon import cross
from grainlaw.region import Region

SKEWEST = 0.35  #: rad from the bisector, up to which a cut rather goes to a corner of the polygon


@attrs.frozen
class Reentrant:
    """A corner of the region of more than 180 degrees."""

    corner: Point
    bisector: Point  #: unit vector into the region
    play: float  #: rad, how far from the bisector a cut still leaves no angle above 180 degrees


@attrs.frozen(eq=False)
class Cutter:
    """Cuts polygons by a region; what is nearer than ``near`` (m) is the same point. Index letter ``k``: side."""

    region: Region
    near: float

    @cached_property
    def reentrant(self) -> dict[int, Reentrant]:
        """By the side that ends there."""
        along = self.region.end - self.region.start
        along /= np.hypot(*along.T)[:, None]
        onward = along[self.region.after]
        turn = np.arctan2(cross(along, onward), (along * onward).sum(axis=1))
        inward = np.column_stack([-along[:, 1] - onward[:, 1], along[:, 0] + onward[:, 0]])
        inward /= np.hypot(*inward.T)[:, None]
        return {
            int(k): Reentrant(tuple(self.region.end[k]), tuple(inward[k]), float(math.pi + turn[k]) / 2)
            for k in np.flatnonzero(turns(self.region) < -STRAIGHT)
        }

    def pieces(self, polygon: Polygon, sides: list[int]) -> list[Polygon]:
        """Convex parts of a polygon inside the region, few and whole; ``sides`` are those that may run through it."""
        return joined(self._parts(polygon, sides))

    def _parts(self, polygon: Polygon, sides: list[int]) -> list[Polygon]:
        sides = [k for k in sides if self._runs_through(k, polygon)]
        if not sides:
            return [polygon] if self.region.contains(np.array([centroid(polygon)]))[0] else []
        left, right = split(polygon, *self._cut(polygon, sides), self.near)
        return [part for half in (left, right) if half for part in self._parts(half, sides)]

    def _cut(self, polygon: Polygon, sides: list[int]) -> tuple[Point, Point]:
        """Point and direction of the line to cut along."""
        for k in sides:
            found = self.reentrant.get(k)
            if found and depth(polygon, found.corner) > self.near:
                return found.corner, _parting(found, polygon)
        start, end = self.region.start[sides[0]], self.region.end[sides[0]]
        return tuple(start), tuple(end - start)

    def _runs_through(self, k: int, polygon: Polygon) -> bool:
        """Whether a side comes nearer to the inside than its edges' ``near``."""
        (x, y), (u, v) = self.region.start[k].tolist(), self.region.end[k].tolist()
        begin, finish = 0.0, 1.0
        for (ax, ay), (bx, by) in zip(polygon, polygon[1:] + polygon[:1], strict=True):
            dx, dy = bx - ax, by - ay
            norm = math.hypot(dx, dy)
            at_start = (dx * (y - ay) - dy * (x - ax)) / norm - self.near
            at_end = (dx * (v - ay) - dy * (u - ax)) / norm - self.near
            if at_start <= 0 and at_end <= 0:
                return False
            if at_start < 0:
                begin = max(begin, at_start / (at_start - at_end))
            elif at_end < 0:
                finish = min(finish, at_start / (at_start - at_end))
        return (finish - begin) * math.hypot(u - x, v - y) > self.near

    def sees(self, eye: np.ndarray, points: np.ndarray) -> np.ndarray:
        """(n,) whether the straight lines from ``eye`` to points (n, 2) cross no side."""
        start, end = self.region.start, self.region.end
        sight = (points - eye)[:, None]
        apart = cross(sight, start - eye) * cross(sight, end - eye) < 0
        along = end - start
        passed = cross(along, eye - start) * cross(along, points[:, None] - start) < 0
        return ~(apart & passed).any(axis=1)


def _parting(found: Reentrant, polygon: Polygon) -> Point:
    """Direction from a reentrant corner to the corner of the polygon nearest to the bisector, or the bisector."""
    (x, y), (u, v) = found.corner, found.bisector
    best, direction = min(SKEWEST, 0.9 * found.play), found.bisector
    for px, py in polygon:
        skew = abs(math.atan2(u * (py - y) - v * (px - x), u * (px - x) + v * (py - y)))
        if skew < best:
            best, direction = skew, (px - x, py - y)
    return direction
