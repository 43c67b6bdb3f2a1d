"""How contacts, pairs of edges without a bond, overlap: their normal, opening, length and slip.

Index letters: ``c`` contact of an edge a of grain A with an edge b of grain B, ``i`` node, ``k`` place in the list of
nodes in use. ``t`` is the table of contacts (``ContactArrays`` in contact_table.py). Equation numbers are those of
docs/theory.md. A contact is in one of four states:

========  ==========  ========  ==================================================================================
state     ``length``  offset    what ends the state
========  ==========  ========  ==================================================================================
beside    0           infinite  edges that lie beside each other, as both sides of one corner do: it begins when they
                                no longer do, and the overlap of that moment becomes its offset
apart     0           0         an overlap
offset    0           not 0     an overlap deeper than the offset, which shrinks as the edges part
closed    above 0     any       the overlap to end, or (grains too deep in each other) the run to stop
========  ==========  ========  ==================================================================================
"""

import math

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.engine.parts import overlap

u32 = np.uint32
NARROW = 1e-9  #: square of the length over that of the depth: narrower overlaps belong to the contact of other faces
LEAST = 1e-13  #: depth over length of an overlap: below it, it is only rounding


@njit(forceinline=True, **OPTIONS)
def both_edges(node, place, c):
    """Edge a, edge b in the same direction, and the vector from the first corner of a to that of b."""
    x, y = place[0], place[1]
    i, j, k, m = u32(node[0, c]), u32(node[1, c]), u32(node[2, c]), u32(node[3, c])
    return x[j] - x[i], y[j] - y[i], x[k] - x[m], y[k] - y[m], x[m] - x[i], y[m] - y[i]


@njit(forceinline=True, **OPTIONS)
def _is_near(ax, ay, bx, by, wx, wy, tx, ty, room):
    """Whether edges overlap, seen along a tangent, once b is moved away from a by ``room`` (m)."""
    _, _, _, _, depth = overlap.strip(tx, ty, ax, ay, bx, by, wx + room * ty, wy - room * tx)
    return depth > 0


@njit(forceinline=True, **OPTIONS)
def _motion(node, increment, c, x, y, nx, ny, ax, ay, bx, by, wx, wy, ex, ey, fx, fy, qa, qb):
    """Where on both edges a contact at x, y acts (shares, levers), and how it has opened and slid in the last step."""
    xa, xb = (x * ex + y * ey) * qa, ((x - wx) * fx + (y - wy) * fy) * qb
    off_a, off_b = x * ey - y * ex, (y - wy) * fx - (x - wx) * fy
    vx, vy = increment[0], increment[1]
    i, j, k, m = u32(node[0, c]), u32(node[1, c]), u32(node[2, c]), u32(node[3, c])
    dix, diy, djx, djy, dkx, dky, dmx, dmy = vx[i], vy[i], vx[j], vy[j], vx[k], vy[k], vx[m], vy[m]
    turn_a = (ax * (djy - diy) - ay * (djx - dix)) * (qa * qa)
    turn_b = (bx * (dky - dmy) - by * (dkx - dmx)) * (qb * qb)
    rx = dmx + xb * (dkx - dmx) - dix - xa * (djx - dix) - off_b * turn_b * fx - off_a * turn_a * ex
    ry = dmy + xb * (dky - dmy) - diy - xa * (djy - diy) - off_b * turn_b * fy - off_a * turn_a * ey
    return xa, xb, off_a * qa, off_b * qb, rx * nx + ry * ny, ry * nx - rx * ny


@njit(**OPTIONS)
def contact_geometry(g, t, first, last, place, row):
    """Frame, opening, length and slip of contacts, Eqs. (13, 14, 16).

    ``row`` of the memory is the lift of dilation, or -1 without one. Lists the active contacts from ``place`` on;
    returns where the list ends, and how many contacts overlap too much.
    """
    deep = 0
    for c in range(first, last):
        ax, ay, bx, by, wx, wy = both_edges(t.node, t.place, c)
        offset, before = t.offset[c], t.length[c]
        lift = t.memory[row, c] if row >= 0 else 0.0
        beginning = offset == np.inf
        if before == 0:
            arrangement = overlap.arrangement(ax, ay, bx, by, wx, wy, t.skin)
            is_beside = arrangement == overlap.BESIDE
            if arrangement != overlap.BEHIND and (is_beside or (offset == 0 and lift == 0) or beginning):
                t.offset[c] = np.inf if is_beside else 0.0
                if row >= 0:
                    t.memory[row, c] = t.virgin[row, g]
                continue
        # Eq. (16): lifted faces touch while their edges are still apart; b is moved by offset less lift.
        offset = (0.0 if beginning else offset) - lift
        qa, qb = 1 / math.sqrt(ax * ax + ay * ay), 1 / math.sqrt(bx * bx + by * by)
        ex, ey, fx, fy = qa * ax, qa * ay, qb * bx, qb * by  # unit vectors of both edges
        tx, ty = overlap.mean_tangent(ax, ay, bx, by, qa, qb)
        ux, uy = wx + offset * ty, wy - offset * tx
        # Eq. (13): the common interval, the depths d1 and d2 at its ends, and its lengths J_a and J_b.
        begin, end, first_end, last_end, _ = overlap.strip(tx, ty, ax, ay, bx, by, ux, uy)
        x1, y1, d1, x2, y2, d2 = overlap.ends(first_end, last_end, begin, end, ax, ay, bx, by, ux, uy, ex, ey, fx, fy)
        along_a, along_b = ex * (x2 - x1) + ey * (y2 - y1), fx * (x2 - x1) + fy * (y2 - y1)
        # Where a corner of A and one of B dig into each other: acute corners overlap over less length.
        cut_a, cut_b = 0.0, 0.0
        if first_end * last_end < 0:
            cut_a, cut_b = (
                (t.cotangent[0, c], t.cotangent[2, c]) if first_end > 0 else (t.cotangent[1, c], t.cotangent[3, c])
            )
            along_a -= cut_a * (d2 if first_end > 0 else d1)
            along_b -= cut_b * (d1 if first_end > 0 else d2)
        mean, narrow = 0.5 * (d1 + d2), along_a * along_b < NARROW * (d1 * d1 + d1 * d2 + d2 * d2)
        apart = begin >= end or along_a <= 0 or along_b <= 0 or mean <= LEAST * along_a or narrow
        if beginning:  # without a force: the overlap they already have becomes their offset
            t.offset[c] = 0.0 if apart else overlap.deepest(ax, ay, bx, by, wx, wy)
            continue
        far = mean > 2 * t.largest_overlap[c]
        if before > 0 or not (apart or far):
            t.active[place] = c
            place += 1
        if apart or far:
            deep += far and t.overlap[c] > 0.5 * t.largest_overlap[c]
            if lift > 0:  # kept until the faces are farther apart than grains may overlap
                lift = lift if _is_near(ax, ay, bx, by, wx, wy, tx, ty, offset - t.largest_overlap[c]) else 0.0
            # A positive offset shrinks to the overlap that the edges still have, a negative one vanishes, both without
            # a force; all but the lift is reset.
            deepest = 0.0 if offset == 0 else overlap.deepest(ax, ay, bx, by, wx, wy)
            t.offset[c] = max(min(t.offset[c], deepest), 0.0)
            t.length[c] = 0.0
            t.overlap[c] = 0.0
            t.opening[c] = 0.0
            t.slip[c] = 0.0
            for n in range(t.memory.shape[0]):
                t.memory[n, c] = t.virgin[n, g]
            if row >= 0 and lift > 0:
                t.memory[row, c] = lift
            continue
        # Eq. (14): the gradient of the energy at both ends gives normal and length; ``share`` is J^2 / (J^2 + D^2).
        g1x, g1y, g2x, g2y, share = overlap.gradient(
            first_end, last_end, d1, d2, along_a, along_b, cut_a, cut_b, ex, ey, fx, fy
        )
        nx, ny = -g1x - g2x, -g1y - g2y
        size, depth = math.sqrt(nx * nx + ny * ny), mean * math.sqrt(share)
        nx, ny = nx / size, ny / size
        deep += depth > t.largest_overlap[c]
        t.length[c] = size / depth
        t.overlap[c] = depth
        t.opening[c] = lift - depth  # Eq. (16)
        # The force acts in the middle between the edges; ``twist`` gives the moment that this point leaves out.
        centre = -(g2x * nx + g2y * ny) / size
        p1, q1, p2, q2 = (1 - centre) * x1, (1 - centre) * y1, centre * x2, centre * y2
        h1, h2 = 0.5 * (1 - centre) * d1, 0.5 * centre * d2
        p1, q1 = (p1 + h1 * ey, q1 - h1 * ex) if first_end < 0 else (p1 - h1 * fy, q1 + h1 * fx)
        p2, q2 = (p2 + h2 * ey, q2 - h2 * ex) if last_end < 0 else (p2 - h2 * fy, q2 + h2 * fx)
        x, y = p1 + p2, q1 + q2
        t.twist[c] = -((x1 - x) * g1y - (y1 - y) * g1x + (x2 - x) * g2y - (y2 - y) * g2x) / size
        x, y = x - 0.5 * offset * ty, y + 0.5 * offset * tx
        xa, xb, lever_a, lever_b, opened, slid = _motion(
            t.node, t.increment, c, x, y, nx, ny, ax, ay, bx, by, wx, wy, ex, ey, fx, fy, qa, qb
        )
        grown = 1 - before / t.length[c]
        if grown > 0:  # new length in contact has not slipped: otherwise it would gain elastic energy
            t.slip[c] -= grown * t.compliance[c] * t.shear[c]
        t.slip[c] += slid
        t.tangent_x[c] = -ny
        t.tangent_y[c] = nx
        t.share_a[c] = xa
        t.share_b[c] = xb
        t.lever_a[c] = lever_a
        t.lever_b[c] = lever_b
        t.opened[c] = opened
        t.slid[c] = slid
    return place, deep


def geometry_of_all(t, g, row):
    """:func:`contact_geometry` of all contacts."""
    return contact_geometry(g, t, 0, t.length.shape[0], 0, row)
