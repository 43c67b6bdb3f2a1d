"""A convex polygon filled with cells: those of random seeds, and triangles."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy.spatial import Delaunay

from grainlaw.geometry.cells.convex import Point, Polygon, area, centroid, depth, split

TRIANGLE = 2 / 3**0.25  #: edge of an equilateral triangle of area 1
FLAT = 1e-9  #: of the squared edge: smaller triangles are what rounding leaves on a straight edge


def voronoi_cells(
    polygon: Polygon, count: int, relaxation: int, near: float, random: np.random.Generator
) -> list[Polygon]:
    """Cells of ``count`` random seeds, after so many iterations of Lloyd's algorithm."""
    if count == 1:
        return [polygon]
    seeds = _scattered(polygon, count, random)
    cells = _cells(polygon, seeds, near)
    for _ in range(relaxation):
        cells = _cells(polygon, [centroid(cell) for cell in cells], near)
    return cells


def _scattered(polygon: Polygon, count: int, random: np.random.Generator) -> list[Point]:
    """Independent points of uniform density, drawn from a fan of triangles."""
    (ox, oy), fan = polygon[0], list(pairwise(polygon[1:]))
    shares = np.maximum([area([polygon[0], a, b]) for a, b in fan], 0.0)
    points = []
    for k in random.choice(len(fan), size=count, p=shares / shares.sum()).tolist():
        (ax, ay), (bx, by) = fan[k]
        out, across = math.sqrt(random.random()), random.random()
        points.append(
            (ox + out * (ax - ox + across * (bx - ax)), oy + out * (ay - oy + across * (by - ay)))
        )  # fmt: skip
    return points


def _cells(polygon: Polygon, seeds: list[Point], near: float) -> list[Polygon]:
    """What is nearer to each seed than to all others; those farther than twice its corners cannot matter."""
    places = np.array(seeds)
    cells = []
    for x, y in seeds:
        away = np.hypot(places[:, 0] - x, places[:, 1] - y)
        cell, reach = polygon, math.inf
        for k in np.argsort(away, kind="stable")[1:].tolist():
            if away[k] > reach:
                break
            u, v = seeds[k]
            cell = split(cell, ((x + u) / 2, (y + v) / 2), (y - v, u - x), near)[0]
            reach = 2 * max(math.hypot(p - x, q - y) for p, q in cell) + near
        cells.append(cell)
    return cells


def triangles(polygon: Polygon, size: float, random: np.random.Generator) -> list[Polygon]:
    """Delaunay triangles with areas of about ``size`` squared; neighbours divide a shared edge at the same points."""
    edge = TRIANGLE * size
    rim = [
        (ax + (bx - ax) * k / parts, ay + (by - ay) * k / parts)
        for (ax, ay), (bx, by) in zip(polygon, polygon[1:] + polygon[:1], strict=True)
        for parts in [max(1, round(math.hypot(bx - ax, by - ay) / edge))]
        for k in range(parts)
    ]
    points = rim + _lattice(polygon, edge, random)
    if len(points) == 3:
        return [polygon]
    made = []
    for i, j, k in Delaunay(np.array(points)).simplices.tolist():
        triangle = [points[i], points[j], points[k]]
        if 2 * area(triangle) > FLAT * edge**2:
            made.append(triangle)
    return made


def _lattice(polygon: Polygon, edge: float, random: np.random.Generator) -> list[Point]:
    """Points of a triangular lattice, turned and moved at random, well inside; else the centroid of a large polygon."""
    x, y = centroid(polygon)
    reach = max(math.hypot(p - x, q - y) for p, q in polygon)
    turn, dx, dy = random.random() * math.pi / 3, random.random(), random.random()
    steps = range(-math.ceil(2 * reach / edge) - 1, math.ceil(2 * reach / edge) + 2)
    points = []
    for row in steps:
        for place in steps:
            u, v = edge * (place + dx + (row + dy) / 2), edge * (row + dy) * math.sqrt(0.75)
            point = x + u * math.cos(turn) - v * math.sin(turn), y + u * math.sin(turn) + v * math.cos(turn)
            if depth(polygon, point) > edge / 2:
                points.append(point)
    if not points and area(polygon) > 3 * edge**2 / TRIANGLE**2:
        return [(x, y)]
    return points


def strips(polygon: Polygon, angle: float, spacing: float, near: float) -> list[Polygon]:
    """Strips of equal width, as near to ``spacing`` as fits, between lines at an ``angle`` (rad) from the x axis."""
    tx, ty = math.cos(angle), math.sin(angle)
    heights = [y * tx - x * ty for x, y in polygon]
    low, width = min(heights), max(heights) - min(heights)
    count = max(1, round(width / spacing))
    made, rest = [], polygon
    for k in range(1, count):
        height = low + width * k / count
        rest, below = split(rest, (-height * ty, height * tx), (tx, ty), near)
        made += [below] if below else []
    return [*made, rest]
