"""Power cells of seeds that have moved a little, or got other weights: cut one by one out of a convex region.

A cell is what the power lines against all other seeds leave of the region. Those against some of them leave as much or
more: cells cut by the seeds nearby are the right ones if, and only if, their areas add up to that of the region. So the
neighbours from before and theirs cut each cell, and where cells then disagree on who meets in a corner, seeds farther
away cut them again. Stars of triangles are repaired in the same way (Shewchuk 2005, doi:10.1145/1064092.1064129).

Compiled when first called, in 2 s.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from grainlaw.geometry.cells.bounded_voronoi import Diagram
from grainlaw.region import Region

RINGS = (2, 3, 5)  #: of neighbours, and theirs, that cut a cell: at first, and where that was too few
EXCESS = 1e-9  #: of the mean area: by so little may all cells together be too large
ROUNDING = 1e-13  #: of the mean area: by so little powers do not differ
CORNERS = 500  #: of one cell, at most, beside those of the region
EDGES = 8  #: of all cells on average, at most; in a tessellation they have less than six


def moved_diagram(region: Region, seeds: np.ndarray, weights: np.ndarray, before: Diagram) -> Diagram | None:
    """As :func:`~grainlaw.geometry.cells.power_diagram.power_diagram`, from a diagram ``before`` of the same seeds.

    Each cell has vertices of its own; an empty one has none. None if the diagram before is too different.
    """
    size = region.area / len(seeds)
    first, near = _neighbours(before)
    who, begin, number = np.arange(len(seeds)), *np.zeros((2, len(seeds)), dtype=np.int64)
    vertices, beyond = np.empty((0, 2)), np.empty(0, dtype=np.int64)
    for rings in RINGS:
        room = EDGES * len(who) + CORNERS + len(region.outline)
        cut = _cells(who, rings, seeds, weights, first, near, region.outline, ROUNDING * size, room)
        if len(cut[2]) == 0:
            return None
        begin[who], number[who] = len(beyond) + np.cumsum(cut[2]) - cut[2], cut[2]
        vertices, beyond = np.concatenate([vertices, cut[0]]), np.concatenate([beyond, cut[1]])
        diagram = _diagram(seeds, vertices, beyond, begin, number)
        if abs(diagram.areas().sum() - region.area) < EXCESS * size:
            return diagram
        who = np.flatnonzero(_at_odds(beyond, begin, number))
    return None


def _neighbours(diagram: Diagram) -> tuple[np.ndarray, np.ndarray]:
    """(g + 1,) where those of each seed begin, and the neighbours of all seeds in a row."""
    inner = np.flatnonzero(diagram.other >= 0)
    inner = inner[np.argsort(diagram.seed[inner], kind="stable")]
    number = np.bincount(diagram.seed[inner], minlength=len(diagram.seeds))
    return np.concatenate([[0], np.cumsum(number)]), diagram.other[inner].astype(np.int64)


def _diagram(
    seeds: np.ndarray, vertices: np.ndarray, beyond: np.ndarray, begin: np.ndarray, number: np.ndarray
) -> Diagram:
    seed, last = np.repeat(np.arange(len(seeds)), number), np.cumsum(number)
    row = np.arange(len(seed))
    end = row + 1
    end[last[number > 0] - 1] = (last - number)[number > 0]
    at = row + np.repeat(begin - (last - number), number)
    other = beyond[at]
    side = np.where(other < 0, -1 - other, -1)
    return Diagram(seeds, vertices[at], seed, np.maximum(other, -1), row, end, side)


@njit(error_model="numpy")
def _cells(who, rings, seeds, weights, first, near, outline, tolerance, room):
    """Cells of the seeds ``who`` (w,), cut by so many rings of neighbours.

    (h, 2) m, their vertices, counter-clockwise; (h,) the seed beyond the edge that begins there, or -1 - k on side k of
    the region; (w,) how many of them a cell has, none at all if there is no ``room`` for them.
    """
    vertices, beyond, number = np.empty((room, 2)), np.empty(room, np.int64), np.zeros(len(who), np.int64)
    asked, seen = np.empty(len(seeds), np.int64), np.full(len(seeds), -1)
    # Corners seen from the seed, what is beyond the edge from each, and its power; the same of what a cut leaves.
    most = CORNERS + len(outline)
    x, y, over, power = np.empty(most), np.empty(most), np.empty(most, np.int64), np.empty(most)
    left_x, left_y, left_over = np.empty(most), np.empty(most), np.empty(most, np.int64)
    h = 0
    for w in range(len(who)):
        i = who[w]
        n, reach = len(outline), np.inf  # m2, squared distance of the farthest corner
        for k in range(n):
            x[k], y[k], over[k] = outline[k, 0] - seeds[i, 0], outline[k, 1] - seeds[i, 1], -1 - k
        seen[i], asked[0], count, begin = i, i, 1, 0
        for _ in range(rings):
            end = count
            for a in range(begin, end):
                for b in range(first[asked[a]], first[asked[a] + 1]):
                    j = near[b]
                    if seen[j] == i:
                        continue
                    seen[j], asked[count] = i, j
                    count += 1
                    dx, dy = seeds[j, 0] - seeds[i, 0], seeds[j, 1] - seeds[i, 1]
                    apart = dx * dx + dy * dy
                    level = (apart + weights[i] - weights[j]) / 2
                    if level > 0 and level * level > reach * apart:  # the power line passes all corners by
                        continue
                    out = False
                    for k in range(n):
                        power[k] = dx * x[k] + dy * y[k] - level
                        out |= power[k] > tolerance
                    if not out:
                        continue
                    m, reach = 0, 0.0
                    for k in range(n):
                        after = k + 1 if k + 1 < n else 0
                        inside, inside_after = power[k] <= tolerance, power[after] <= tolerance
                        if m + 2 > most:
                            return vertices[:0], beyond[:0], number[:0]
                        if inside:
                            left_x[m], left_y[m], left_over[m] = x[k], y[k], over[k]
                            reach = max(reach, x[k] * x[k] + y[k] * y[k])
                            m += 1
                        if inside != inside_after:
                            share = power[k] / (power[k] - power[after])
                            px, py = x[k] + share * (x[after] - x[k]), y[k] + share * (y[after] - y[k])
                            left_x[m], left_y[m], left_over[m] = px, py, j if inside else over[k]
                            reach = max(reach, px * px + py * py)
                            m += 1
                    n = m
                    x, y, over, left_x, left_y, left_over = left_x, left_y, left_over, x, y, over
            begin = end
        if h + n > room:
            return vertices[:0], beyond[:0], number[:0]
        for k in range(n):
            vertices[h + k, 0], vertices[h + k, 1] = x[k] + seeds[i, 0], y[k] + seeds[i, 1]
            beyond[h + k] = over[k]
        number[w] = n
        h += n
    return vertices[:h], beyond[:h], number


@njit(error_model="numpy")
def _at_odds(beyond, begin, number):
    """(g,) whether a cell, or one that it meets in a corner, does not know another one there."""
    odd = np.zeros(len(begin), np.bool_)
    for i in range(len(begin)):
        for k in range(number[i]):
            j, other = beyond[begin[i] + k], beyond[begin[i] + (k + 1 if k + 1 < number[i] else 0)]
            for way in range(3):
                a, b = (j, i) if way == 0 else (j, other) if way == 1 else (other, j)
                if a < 0 or b < 0:
                    continue
                known = False
                for e in range(begin[a], begin[a] + number[a]):
                    known |= beyond[e] == b
                if not known:
                    odd[i] = odd[a] = odd[b] = True
    return odd
