"""Grains that part: each a body of its own, with or without a gap to the next."""

from __future__ import annotations

from itertools import pairwise

import attrs
import numpy as np

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError
from grainlaw.geometry.cells.convex import Polygon, polygon_of, split
from grainlaw.geometry.region import check_sizes, rectangle
from grainlaw.polygon import following
from grainlaw.region import ROUNDING
from grainlaw.tessellation import LOOSE, Tessellation

MOST_BRICKS = 10_000  #: along a side of a wall


@checked
def apart(grains: Tessellation, gap: float = 0.0) -> Tessellation:
    """Every grain loose, with vertices of its own; sides that face each other are moved ``gap`` m apart.

    Sides of grains on sides of the region stay there and keep the boundary's name, all others are the boundary
    "grains". Edges too short for the gap vanish. A slope of blocks without bond between them::

        slope = polygon([(0, 0), (40, 0), (40, 10), (20, 10), (10, 30), (0, 30)])
        grains = apart(Voronoi(grain_size=1.0).tessellate(slope))

    Raises :class:`~grainlaw.fields.ParameterError` for a gap in which a grain would vanish, with its number.
    """
    check_sizes("apart", zero=True, gap=gap)
    edges = grains.edges
    inward = np.full(len(grains.corners), gap / 2)
    names = np.array(edges.boundary_names)
    kept = (edges.right < 0) & (names[edges.side] != LOOSE)
    inward[edges.left_corners[kept, 0]] = 0.0
    points, first = _shrunk(grains.vertices[grains.corners], grains.first, inward, gap)
    return attrs.evolve(
        grains, vertices=points, corners=np.arange(len(points)), first=first, loose=np.ones(grains.count, dtype=bool),
        joints={},
    )  # fmt: skip


def _shrunk(points: np.ndarray, first: np.ndarray, inward: np.ndarray, gap: float) -> tuple[np.ndarray, np.ndarray]:
    """Corners in a row of convex polygons whose sides, from each corner on, are moved ``inward`` (m)."""
    after = following(first)
    before = np.argsort(after)
    along = points[after] - points
    shortest = ROUNDING * np.hypot(*along.T)
    along /= np.hypot(*along.T)[:, None]
    b = np.column_stack([-along[:, 1], along[:, 0]])
    a = b[before]
    mean, half = (inward[before] + inward) / 2, (inward[before] - inward) / 2
    # The corner moves by w with w.a = mean + half and w.b = mean - half; a + b and a - b are at right angles.
    with np.errstate(divide="ignore", invalid="ignore"):
        part = np.where(half == 0, 0.0, 2 * half / ((a - b) ** 2).sum(axis=1))
        made = points + (2 * mean / ((a + b) ** 2).sum(axis=1))[:, None] * (a + b) + part[:, None] * (a - b)
        length = ((made[after] - made) * along).sum(axis=1)
        intact = np.isfinite(made).all(axis=1) & (length > shortest)
    grain = np.repeat(np.arange(len(first) - 1), np.diff(first))
    faulty = np.unique(grain[~intact])
    if not len(faulty):
        return made, first
    pieces = np.split(made, first[1:-1])
    for g in faulty:
        row = slice(first[g], first[g + 1])
        left = _cut(points[row], along[row], b[row], inward[row])
        if not left:
            raise ParameterError(f"apart: gap = {gap:g} m is not allowed, grain {g} would vanish in it")
        pieces[g] = np.array(left)
    return np.concatenate(pieces), np.cumsum([0, *map(len, pieces)])


def _cut(points: np.ndarray, along: np.ndarray, normal: np.ndarray, inward: np.ndarray) -> Polygon:
    """What is left of a polygon inside all its sides moved inward; an empty list for nothing."""
    left = polygon_of(points)
    near = ROUNDING * float(np.ptp(points, axis=0).max())
    for k in np.flatnonzero(inward):
        if left:
            on, direction = polygon_of(np.array([points[k] + inward[k] * normal[k], along[k]]))
            left = split(left, on, direction, near)[0]
    return left


@checked
def wall(width: float, height: float, brick_width: float, brick_height: float, gap: float = 0.0) -> Tessellation:
    """A wall (m) of loose bricks in running bond, lower left corner at the origin, its joints ``gap`` m wide.

    Every other course begins with half a brick, so bricks and gaps are counted within ``width``, which must be a whole
    number of half bricks, and ``height`` one of bricks. The outside has boundaries bottom, right, top and left; the
    sides in the joints are the boundary "grains". Ten courses of bricks of 24 cm by 8 cm::

        grains = wall(2.4, 0.8, brick_width=0.24, brick_height=0.08)

    Raises :class:`~grainlaw.fields.ParameterError`.
    """
    check_sizes("wall", width=width, height=height, brick_width=brick_width, brick_height=brick_height)
    check_sizes("wall", below=min(brick_width / 2, brick_height), zero=True, gap=gap)
    halves = _times("width", width, brick_width / 2, "half bricks", least=2)
    courses = _times("height", height, brick_height, "bricks", least=1)
    x, y = np.linspace(0, width, halves + 1), np.linspace(0, height, courses + 1)
    joints = ([*range(0, halves, 2), halves], [0, *range(1, halves, 2), halves])  # of even and odd courses
    boxes = [
        (x[left], y[course], x[right], y[course + 1])
        for course in range(courses)
        for left, right in pairwise(joints[course % 2])
    ]
    corners = np.array(boxes)[:, [0, 1, 2, 1, 2, 3, 0, 3]].reshape(-1, 2)
    bricks = Tessellation(
        rectangle(width, height), corners, np.arange(len(corners)), np.arange(0, len(corners) + 1, 4),
        loose=np.ones(len(boxes), dtype=bool),
    )  # fmt: skip
    return apart(bricks, gap)


def _times(name: str, whole: float, part: float, kind: str, *, least: int) -> int:
    count = round(whole / part)
    if not least <= count <= MOST_BRICKS or abs(whole / part - count) > 1e-6:
        raise ParameterError(
            f"wall: {name} = {whole:g} m is not allowed, it must be {part:g} m times a whole number of {kind}, "
            f"from {least} to {MOST_BRICKS}"
        )
    return count
