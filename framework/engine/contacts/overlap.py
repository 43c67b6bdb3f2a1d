"""How two edges are arranged, and where and how deep they overlap; without branches, so that loops vectorise.

Edge ``a`` runs from the first corner of A; edge ``b`` in about the same direction from the second corner of B. That
corner is at ``w`` from the first corner of A (at ``u`` with the contact's offset). ``e`` and ``f`` are unit vectors.
Where edges do not overlap, numbers may be infinite or none at all; ``overlaps`` of the same call says so.
Equation numbers are those of docs/theory.md.
"""

import math

from numba import njit

from grainlaw.compiler.cache import OPTIONS

FACING = 0.2  #: cosine between outward normals above which edges face in the same direction
IN_FRONT, BESIDE, BEHIND = 0.0, 1.0, 2.0  #: arrangement of two edges that do not touch


@njit(forceinline=True, **OPTIONS)
def behind(ax, ay, bx, by, wx, wy):
    """Depth of the corners of b behind the line of a, and of those of a behind that of b, times the line's length."""
    first, second = ax * wy - ay * wx, ax * (wy + by) - ay * (wx + bx)
    third, fourth = bx * wy - by * wx, bx * (wy - ay) - by * (wx - ax)
    return first, second, third, fourth


@njit(forceinline=True, **OPTIONS)
def beside(ax, ay, bx, by, wx, wy, facing, out, deep):
    """Whether two edges face in the same direction, or are the two sides of one corner.

    Either the cosine of their outward normals is above ``facing``, or each edge begins at most ``out`` (m) in front of
    the other's line and ends more than ``deep`` (m) behind it.
    """
    length_a, length_b = math.sqrt(ax * ax + ay * ay), math.sqrt(bx * bx + by * by)
    same_way = -ax * bx - ay * by > facing * length_a * length_b
    first, second, third, fourth = behind(ax, ay, bx, by, wx, wy)
    begins = (min(first, second) >= -out * length_a) & (min(third, fourth) >= -out * length_b)
    ends = (max(first, second) > deep * length_a) & (max(third, fourth) > deep * length_b)
    return same_way | (begins & ends)


@njit(forceinline=True, **OPTIONS)
def in_front(ax, ay, bx, by, wx, wy, room):
    """Whether one edge is on the outer side of the other's line, or behind it by at most ``room`` over its length."""
    first, second, third, fourth = behind(ax, ay, bx, by, wx, wy)
    return (max(first, second) <= room) | (max(third, fourth) <= room)


@njit(forceinline=True, **OPTIONS)
def arrangement(ax, ay, bx, by, wx, wy, skin):
    """Arrangement of two edges that do not touch: ``IN_FRONT``, ``BESIDE`` or ``BEHIND``.

    ``IN_FRONT``: one edge is on the outer side of the other's line, so that they do not overlap. ``BESIDE``: no force
    acts between them, as touching edges are nowhere farther behind each other than the skin. ``BEHIND``: they may
    overlap.
    """
    is_beside = beside(ax, ay, bx, by, wx, wy, FACING, 2 * skin, skin)
    return IN_FRONT if in_front(ax, ay, bx, by, wx, wy, 0.0) else (BESIDE if is_beside else BEHIND)


@njit(forceinline=True, **OPTIONS)
def mean_tangent(ax, ay, bx, by, qa, qb):
    tx, ty = qa * ax + qb * bx, qa * ay + qb * by
    r = 1 / math.sqrt(max(tx * tx + ty * ty, 1e-30))
    return r * tx, r * ty


@njit(forceinline=True, **OPTIONS)
def strip(tx, ty, ax, ay, bx, by, wx, wy):
    """Where two edges overlap, seen along a tangent: begin and end as shares of edge a, the kinds of both ends, depth.

    The kind of an end is 1 at a corner of A, -1 at a corner of B, 0 where the edges cross. The depth (m) is that of
    the deeper end, 0 without an overlap.
    """
    span_a, span_b = ax * tx + ay * ty, bx * tx + by * ty
    start = wx * tx + wy * ty
    begin, end = max(0.0, start), min(span_a, start + span_b)
    inverse, slope_b = 1 / span_a, (bx * ty - by * tx) / span_b
    slope = (ax * ty - ay * tx) * inverse - slope_b
    level = wx * ty - wy * tx - slope_b * start  # of b, at the corner of A
    d1, d2 = slope * begin - level, slope * end - level
    overlaps = (span_a > 0) & (span_b > 0) & (begin < end) & ((d1 > 0) | (d2 > 0))
    first = 0.0 if d1 < 0 else (1.0 if start <= 0 else -1.0)
    last = 0.0 if d2 < 0 else (1.0 if span_a <= start + span_b else -1.0)
    begin = begin - d1 / slope if d1 < 0 else begin
    end = end - d2 / slope if d2 < 0 else end
    return begin * inverse, end * inverse, first, last, max(d1, d2) if overlaps else 0.0


@njit(**OPTIONS)
def may_overlap(ax, ay, bx, by, wx, wy, share):
    """Whether edges overlap, seen along their mean tangent, or miss it by no more than a ``share`` of their lengths."""
    length_a, length_b = math.sqrt(ax * ax + ay * ay), math.sqrt(bx * bx + by * by)
    tx, ty = mean_tangent(ax, ay, bx, by, 1 / length_a, 1 / length_b)
    room = share * (length_a + length_b + abs(wx) + abs(wy))
    span_a, span_b, start = ax * tx + ay * ty, bx * tx + by * ty, wx * tx + wy * ty
    begin, end = max(0.0, start), min(span_a, start + span_b)
    slope_a, slope_b = (ax * ty - ay * tx) / span_a, (bx * ty - by * tx) / span_b
    level = wx * ty - wy * tx - slope_b * start
    d1, d2 = (slope_a - slope_b) * begin - level, (slope_a - slope_b) * end - level
    return (begin < end + room) & (max(d1, d2) > -room)


@njit(**OPTIONS)
def deepest(ax, ay, bx, by, wx, wy):
    """How deep two edges overlap (m), seen along the mean tangent."""
    tx, ty = mean_tangent(ax, ay, bx, by, 1 / math.sqrt(ax * ax + ay * ay), 1 / math.sqrt(bx * bx + by * by))
    return strip(tx, ty, ax, ay, bx, by, wx, wy)[4]


@njit(forceinline=True, **OPTIONS)
def ends(first, last, begin, end, ax, ay, bx, by, ux, uy, ex, ey, fx, fy):
    """Positions of both ends of an overlap, of the kinds that `strip` returns, and their depths in the other grain."""
    x1, y1 = ux if first < 0 else begin * ax, uy if first < 0 else begin * ay
    x2, y2 = ux + bx if last < 0 else end * ax, uy + by if last < 0 else end * ay
    d1 = ex * y1 - ey * x1 if first < 0 else (fy * (x1 - ux) - fx * (y1 - uy) if first > 0 else 0.0)
    d2 = ex * y2 - ey * x2 if last < 0 else (fy * (x2 - ux) - fx * (y2 - uy) if last > 0 else 0.0)
    return x1, y1, d1, x2, y2, d2


@njit(forceinline=True, **OPTIONS)
def harmonic_mean(d1, d2):
    return 2 * d1 * d2 / max(d1 + d2, 1e-300)


@njit(forceinline=True, **OPTIONS)
def _end(kind, sign, depth, length_a, length_b, ax, ay, bx, by):
    """Gradient of the energy by the displacement of B at one end, from derivatives by its depth and both lengths."""
    q = (length_a + length_b * (ax * bx + ay * by)) / (ay * bx - ax * by)  # both edges cross
    # A corner of A moves against edge b, one of B against edge a.
    x = -depth * by - sign * length_b * bx if kind > 0 else -depth * ay + sign * length_a * ax
    y = depth * bx - sign * length_b * by if kind > 0 else depth * ax + sign * length_a * ay
    return (
        sign * (-q * by - length_b * bx) if kind == 0 else x,
        sign * (q * bx - length_b * by) if kind == 0 else y,
    )


@njit(forceinline=True, **OPTIONS)
def gradient(first, last, d1, d2, along_a, along_b, cut_a, cut_b, ex, ey, fx, fy):
    """Gradient of the energy, Eq. (13) over kn, by the displacement of B at both ends; and J^2 / (J^2 + D^2)."""
    square, squares = along_a * along_b, d1 * d1 + d1 * d2 + d2 * d2
    run, share = math.sqrt(square), square / (square + squares * (1 / 3))
    f = share * share * (1 / 6)
    by_length = 0.5 * f * squares * (1 + squares / square) / run
    by_a, by_b = by_length * along_b, by_length * along_a
    by_1, by_2 = f * run * (2 * d1 + d2), f * run * (d1 + 2 * d2)
    cut, inverse = cut_a * by_a + cut_b * by_b, 1 / max(d1 + d2, 1e-300)
    by_1 -= 2 * (d2 * inverse) * (d2 * inverse) * cut  # of the harmonic mean
    by_2 -= 2 * (d1 * inverse) * (d1 * inverse) * cut
    g1x, g1y = _end(first, -1.0, by_1, by_a, by_b, ex, ey, fx, fy)
    g2x, g2y = _end(last, 1.0, by_2, by_a, by_b, ex, ey, fx, fy)
    return g1x, g1y, g2x, g2y, share
