"""Which edges lie near each other: a grid of cells, and the distance of segments.

Index letter ``e``: exposed edges, given by the places of their ends.
"""

import math

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.engine.contacts.overlap import FACING, behind, beside, in_front, mean_tangent

AWAY = math.sqrt(1 - FACING**2)  #: the sine of the same angle
DEEP = 2.0  #: skins: edges that touch are nowhere farther from each other, as their mean overlap is at most so deep


@njit(forceinline=True, **OPTIONS)
def _rows(x0, y0, x1, y1, pad, size, column):
    """First and last cell of a column that a segment, widened by ``pad`` (m), passes."""
    low, high = column * size - pad, (column + 1) * size + pad
    ya, yb = y0, y1
    if x1 != x0:
        slope = (y1 - y0) / (x1 - x0)
        least, most = min(x0, x1), max(x0, x1)
        left, right = min(max(least, low), most), max(min(most, high), least)  # on it, however far away
        ya, yb = y0 + slope * (left - x0), y0 + slope * (right - x0)
    return math.floor((min(ya, yb) - pad) / size), math.floor((max(ya, yb) + pad) / size)


@njit(forceinline=True, **OPTIONS)
def _columns(x0, x1, pad, size):
    return math.floor((min(x0, x1) - pad) / size), math.floor((max(x0, x1) + pad) / size)


@njit(forceinline=True, **OPTIONS)
def _bucket(column, row, mask):
    return (column * 73856093 ^ row * 19349663) & mask


@njit(forceinline=True, **OPTIONS)
def _to_segment(px, py, x0, y0, x1, y1):
    """Square of the distance of a point from a segment."""
    ax, ay, bx, by = x1 - x0, y1 - y0, px - x0, py - y0
    share = min(max((ax * bx + ay * by) / (ax * ax + ay * ay), 0.0), 1.0)
    dx, dy = bx - share * ax, by - share * ay
    return dx * dx + dy * dy


@njit(forceinline=True, **OPTIONS)
def _stay_beside(ax, ay, bx, by, cx, cy, turn, reach, skin):
    """Whether edges a and b (from corner c on) stay beside each other while they turn by ``turn`` (rad) and move."""
    facing = FACING * math.cos(turn) + AWAY * math.sin(turn) if turn < 1 else 2.0  # never
    # A corner moves against the line of the other edge, and the line turns.
    way = reach + turn * (math.sqrt(ax * ax + ay * ay) + math.sqrt(bx * bx + by * by))
    return beside(ax, ay, -bx, -by, cx + bx, cy + by, facing, 2 * skin - way, skin + way)


@njit(forceinline=True, **OPTIONS)
def _are_behind(ax, ay, bx, by, wx, wy, turn, reach):
    """Whether edges are behind each other and, seen along their mean tangent, may overlap after they have moved.

    Such edges may lie deep in each other, far from where they cross.
    """
    length_a, length_b = math.sqrt(ax * ax + ay * ay), math.sqrt(bx * bx + by * by)
    tx, ty = mean_tangent(ax, ay, bx, by, 1 / length_a, 1 / length_b)
    start = wx * tx + wy * ty
    overlap = min(ax * tx + ay * ty, start + bx * tx + by * ty) - max(0.0, start)
    return not in_front(ax, ay, bx, by, wx, wy, 0.0) and overlap > -reach - turn * (length_a + length_b)


@njit(forceinline=True, **OPTIONS)
def _clearly_in_front(ax, ay, bx, by, wx, wy, reach):
    """Whether one edge is at least ``reach`` (m) in front of the other's line."""
    first, second, third, fourth = behind(ax, ay, bx, by, wx, wy)
    over_a, over_b = max(first, second), max(third, fourth)
    square = reach * reach
    return (over_a <= 0 and over_a * over_a >= square * (ax * ax + ay * ay)) or (
        over_b <= 0 and over_b * over_b >= square * (bx * bx + by * by)
    )


@njit(**OPTIONS)
def _near(x0, y0, x1, y1, turn, e, f, reach, skin, deep):
    """Whether two edges may overlap before the next search, until when they come nearer by at most ``reach``.

    Both together turn by at most ``turn`` (rad). Edges that are behind each other count up to a distance of ``deep``
    and ``reach``.
    """
    ax, ay, bx, by = x1[e] - x0[e], y1[e] - y0[e], x1[f] - x0[f], y1[f] - y0[f]
    cx, cy = x0[f] - x0[e], y0[f] - y0[e]
    if _clearly_in_front(ax, ay, -bx, -by, cx + bx, cy + by, reach):  # most are, and this is found soonest
        return False
    if _stay_beside(ax, ay, bx, by, cx, cy, turn, reach, skin):
        return False
    denominator = ax * by - ay * bx
    if denominator != 0:
        s, r = (cx * by - cy * bx) / denominator, (cx * ay - cy * ax) / denominator
        if 0 <= s <= 1 and 0 <= r <= 1:
            return True
    nearest = min(
        min(
            _to_segment(x0[e], y0[e], x0[f], y0[f], x1[f], y1[f]), _to_segment(x1[e], y1[e], x0[f], y0[f], x1[f], y1[f])
        ),
        min(
            _to_segment(x0[f], y0[f], x0[e], y0[e], x1[e], y1[e]), _to_segment(x1[f], y1[f], x0[e], y0[e], x1[e], y1[e])
        ),
    )
    return nearest < reach * reach or (
        nearest < (deep + reach) * (deep + reach) and _are_behind(ax, ay, -bx, -by, cx + bx, cy + by, turn, reach)
    )


@njit(**OPTIONS)
def _with_room(found, count):
    """The rows (n, 2), twice as many where all ``count`` of them are in use."""
    if count < found.shape[0]:
        return found
    longer = np.empty((2 * count, 2), dtype=np.int32)
    for n in range(count):  # to copy slices takes 3 s more to compile
        longer[n, 0], longer[n, 1] = found[n, 0], found[n, 1]
    return longer


def near_pairs(x0, y0, x1, y1, grain, turn, reach, size):
    """(n, 2) pairs of near edges of different grains, that of the lower grain first; a pair may occur twice.

    ``reach`` (m) is the skin, by which edges come nearer at most until the next search, while each turns by at most
    ``turn`` (rad): near are those within it, and those that lie deep behind each other. Each edge is entered in the
    cells of ``size`` (m) that it passes. Cells are hashed to a table, so that a long floor or a grain that flies far
    away costs no more than the length of its edges.
    """
    count = x0.shape[0]
    pad = 0.5 * (DEEP + 1) * reach
    mask = 1
    while mask < 2 * count:
        mask *= 2
    mask -= 1
    first = np.zeros(mask + 2, dtype=np.int64)
    for e in range(count):
        left, right = _columns(x0[e], x1[e], pad, size)
        for column in range(left, right + 1):
            low, high = _rows(x0[e], y0[e], x1[e], y1[e], pad, size, column)
            for row in range(low, high + 1):
                first[_bucket(column, row, mask) + 1] += 1
    for k in range(mask + 1):
        first[k + 1] += first[k]
    total = first[mask + 1]
    entry, cell = np.empty(total, dtype=np.int32), np.empty((2, total), dtype=np.int32)
    fill = first[:-1].copy()
    for e in range(count):
        left, right = _columns(x0[e], x1[e], pad, size)
        for column in range(left, right + 1):
            low, high = _rows(x0[e], y0[e], x1[e], y1[e], pad, size, column)
            for row in range(low, high + 1):
                k = _bucket(column, row, mask)
                entry[fill[k]], cell[0, fill[k]], cell[1, fill[k]] = e, column, row
                fill[k] += 1
    found, size_found = np.empty((256, 2), dtype=np.int32), 0
    for k in range(mask + 1):
        for p in range(first[k], first[k + 1]):
            for q in range(p + 1, first[k + 1]):
                e, f = entry[p], entry[q]
                if grain[e] == grain[f] or cell[0, p] != cell[0, q] or cell[1, p] != cell[1, q]:
                    continue
                if grain[e] > grain[f]:
                    e, f = f, e
                if _near(x0, y0, x1, y1, turn[e] + turn[f], e, f, reach, reach, DEEP * reach):
                    found = _with_room(found, size_found)
                    found[size_found, 0], found[size_found, 1] = e, f
                    size_found += 1
    return found[:size_found]


def near_those(x0, y0, x1, y1, grain, turn, chosen, some, reach, skin):
    """(n, 2) pairs as :func:`near_pairs` finds them, of ``some`` edges with the ``chosen`` ones, each with each.

    They come nearer by at most ``reach`` (m).
    """
    found, count, room = np.empty((256, 2), dtype=np.int32), 0, DEEP * skin + reach
    for a in some:
        left, right, low, high = min(x0[a], x1[a]), max(x0[a], x1[a]), min(y0[a], y1[a]), max(y0[a], y1[a])
        for b in chosen:
            apart = (min(x0[b], x1[b]) > right + room) | (max(x0[b], x1[b]) < left - room)
            apart |= (min(y0[b], y1[b]) > high + room) | (max(y0[b], y1[b]) < low - room)
            if apart or grain[a] == grain[b]:
                continue
            e, f = (b, a) if grain[a] > grain[b] else (a, b)
            if _near(x0, y0, x1, y1, turn[e] + turn[f], e, f, reach, skin, DEEP * skin):
                found = _with_room(found, count)
                found[count, 0], found[count, 1] = e, f
                count += 1
    return found[:count]


def place_ends(edges, chosen, origin, displacement, longest, ends):
    """Fill (4, e) x0, y0, x1, y1 m of the chosen edges; whether each is whole, shorter than ``longest`` (e,) m."""
    for e in chosen:
        for k in range(2):
            i = edges[e, k]
            ends[2 * k, e], ends[2 * k + 1, e] = origin[0, i] + displacement[0, i], origin[1, i] + displacement[1, i]
        x, y = ends[2, e] - ends[0, e], ends[3, e] - ends[1, e]
        if not x * x + y * y < longest[e] * longest[e]:
            return False
    return True


def widths(x, y, first):
    """(g,) m, least width between two parallel lines round a convex polygon with corners first[g]:first[g+1]."""
    result = np.empty(first.shape[0] - 1)
    for g in range(result.shape[0]):
        least = math.inf
        for i in range(first[g], first[g + 1]):
            j = i + 1 if i + 1 < first[g + 1] else first[g]
            ax, ay = x[j] - x[i], y[j] - y[i]
            farthest = 0.0
            for k in range(first[g], first[g + 1]):
                farthest = max(farthest, ax * (y[k] - y[i]) - ay * (x[k] - x[i]))
            least = min(least, farthest / math.sqrt(ax * ax + ay * ay))
        result[g] = least
    return result


def ways(displacement, before, searched, first, ahead, least, most):
    """(g,) m, how far nodes of each grain may move until near pairs are chosen again, and how far one has moved most.

    That is the way of ``ahead`` steps at the present speed, or ``least``; with what nodes have moved since the last
    search it is at most ``most`` (m). ``before`` is the displacement one step ago.
    """
    way, farthest = np.empty(first.shape[0] - 1), np.empty(first.shape[0] - 1)
    for g in range(way.shape[0]):
        step, moved = 0.0, 0.0
        for i in range(first[g], first[g + 1]):
            x, y = displacement[0, i] - before[0, i], displacement[1, i] - before[1, i]
            step = max(step, x * x + y * y)
            x, y = displacement[0, i] - searched[0, i], displacement[1, i] - searched[1, i]
            moved = max(moved, x * x + y * y)
        way[g] = max(min(max(ahead * math.sqrt(step), least), most - math.sqrt(moved)), 0.0)
        farthest[g] = math.sqrt(moved)
    return way, farthest


def still_near(pairs, x0, y0, x1, y1, grain, turn, way, skin, deep):
    """(n,) whether the edges of each pair (n, 2) may meet while each ``grain`` (e,) moves its ``way`` (g,) and turns.

    Grains turn by ``turn`` (g,) rad. ``deep`` (m) is how far apart edges behind each other may be.
    """
    result = np.empty(pairs.shape[0], dtype=np.bool_)
    for n in range(pairs.shape[0]):
        e, f = pairs[n, 0], pairs[n, 1]
        g, h = grain[e], grain[f]
        result[n] = _near(x0, y0, x1, y1, turn[g] + turn[h], e, f, way[g] + way[h], skin, deep)
    return result


def nodes_of(pairs, edges, place):
    """(4, c) places of start and end of edge a, and of edge b, of each pair (c, 2) of edges (e, 2)."""
    node = np.empty((4, pairs.shape[0]), dtype=np.int32)
    for c in range(pairs.shape[0]):
        a, b = pairs[c, 0], pairs[c, 1]
        node[0, c], node[1, c], node[2, c], node[3, c] = (
            place[edges[a, 0]], place[edges[a, 1]], place[edges[b, 0]], place[edges[b, 1]]
        )  # fmt: skip
    return node


def matches(keys, old):
    """For each of ``keys`` its place in ``old``, or -1 where it is not there; both ascending."""
    found, k = np.full(keys.shape[0], np.int32(-1)), 0
    for c in range(keys.shape[0]):
        while k < old.shape[0] and old[k] < keys[c]:
            k += 1
        if k < old.shape[0] and old[k] == keys[c]:
            found[c] = k
    return found
