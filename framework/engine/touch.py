"""Contacts between edges that are no bonded interface: geometry, forces, work, and who gathers what.

Index letters: ``c`` contact of an edge a of grain A with an edge b of grain B, ``i`` node. Equation numbers are those
of docs/theory.md.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.calls import LANES, call
from grainlaw.engine import overlap

u32 = np.uint32
BLOCK = 512  #: contacts that go through geometry, law and forces together; a multiple of ``LANES``
NARROW = 1e-9  #: square of the length over that of the depth: narrower overlaps are those of other faces
LEAST = 1e-13  #: depth over length of an overlap: what is less is rounding


class Touching(NamedTuple):
    """Pairs of edges (c) of different grains that touch or may soon; rows of scratch pass from pass to pass."""

    node: np.ndarray  #: (4, c) places in ``touched``: start and end of edge a, of edge b, each counter-clockwise
    acute: np.ndarray  #: (4, c) cotangents of the corners at these nodes, 0 where they are not acute
    limit: np.ndarray  #: (c,) largest overlap (m)
    dashpot: np.ndarray  #: (c,) sqrt(kg/m): damping force over rate and root of stiffness
    ease: np.ndarray  #: (c,) 1 / ks, m/Pa
    offset: np.ndarray  #: (c,) m, how much more open the contact is than its edges; infinite before it begins
    depth: np.ndarray  #: (c,) m, mean overlap of the edges, moved by offset and by the lift of dilation; 0 where apart
    opening: np.ndarray  #: (c,) m, of the law: the lift less the depth; 0 where apart
    slip: np.ndarray  #: (c,) m
    normal: np.ndarray  #: (c,) Pa
    shear: np.ndarray  #: (c,) Pa
    length: np.ndarray  #: (c,) m in contact, 0 where apart
    frame: np.ndarray  #: (9, c) tangent, shares of both edges, distances from both, opened, slid, twist
    force: np.ndarray  #: (2, 4, c) N on the four nodes
    carried: np.ndarray  #: (3, c) N: normal, shear, damping of the last step
    work: np.ndarray  #: (3, c) J done in opening, in slip, on the dashpot
    memory: np.ndarray  #: (m, c) of the laws
    fresh: np.ndarray  #: (m, groups) memory of a contact that has just come to be
    touched: np.ndarray  #: (k,) nodes of these edges, ascending
    origin: np.ndarray  #: (2, k) undeformed places (m)
    place: np.ndarray  #: (2, k) present places (m)
    seen: np.ndarray  #: (2, k) displacements there (m)
    way: np.ndarray  #: (2, k) way of the last step (m)
    active: np.ndarray  #: (c,) contacts that are closed, or were before this step: each thread lists its own
    before: np.ndarray  #: (2, i) displacement of all nodes a step ago (m), where the loop has done all its steps
    built: np.ndarray  #: (2, i) displacement of all nodes when neighbours were last searched (m); none: do not search
    skin: float  #: m, how far neighbours are searched
    reach: float  #: m, a node that has moved farther asks for a new search
    tally: np.ndarray  #: (threads, 8) nodes moved too far, contacts too deep, active ones; a cache line for each thread


@njit(forceinline=True, **OPTIONS)
def _edges(t, c):
    """Edge a, edge b the same way, and the way from the first corner of a to that of b."""
    x, y = t.place[0], t.place[1]
    i, j, k, m = u32(t.node[0, c]), u32(t.node[1, c]), u32(t.node[2, c]), u32(t.node[3, c])
    return x[j] - x[i], y[j] - y[i], x[k] - x[m], y[k] - y[m], x[m] - x[i], y[m] - y[i]


@njit(forceinline=True, **OPTIONS)
def _part(t, g, c, deepest, row, lift):
    """Forget what a contact of edges that are apart has been through, but for the ``lift`` of its faces.

    Parting without a force, they take back what they were more open than they are.
    """
    t.offset[c] = max(min(t.offset[c], deepest), 0.0)
    t.length[c] = 0.0
    t.depth[c] = 0.0
    t.opening[c] = 0.0
    t.slip[c] = 0.0
    for n in range(t.memory.shape[0]):
        t.memory[n, c] = t.fresh[n, g]
    if row >= 0 and lift > 0:
        t.memory[row, c] = lift


@njit(forceinline=True, **OPTIONS)
def _slide(t, c, x, y, nx, ny, before, ax, ay, bx, by, wx, wy, ex, ey, fx, fy, qa, qb):
    """Where on both edges a contact at x, y acts, and how it has moved since the last step."""
    xa, xb = (x * ex + y * ey) * qa, ((x - wx) * fx + (y - wy) * fy) * qb
    off_a, off_b = x * ey - y * ex, (y - wy) * fx - (x - wx) * fy
    vx, vy = t.way[0], t.way[1]
    i, j, k, m = u32(t.node[0, c]), u32(t.node[1, c]), u32(t.node[2, c]), u32(t.node[3, c])
    dix, diy, djx, djy, dkx, dky, dmx, dmy = vx[i], vy[i], vx[j], vy[j], vx[k], vy[k], vx[m], vy[m]
    turn_a = (ax * (djy - diy) - ay * (djx - dix)) * (qa * qa)
    turn_b = (bx * (dky - dmy) - by * (dkx - dmx)) * (qb * qb)
    rx = dmx + xb * (dkx - dmx) - dix - xa * (djx - dix) - off_b * turn_b * fx - off_a * turn_a * ex
    ry = dmy + xb * (dky - dmy) - diy - xa * (djy - diy) - off_b * turn_b * fy - off_a * turn_a * ey
    slid = ry * nx - rx * ny
    grown = 1 - before / t.length[c]
    if grown > 0:  # what has just come into contact has not slipped: else it would be given elastic energy
        t.slip[c] -= grown * t.ease[c] * t.shear[c]
    t.slip[c] += slid
    t.frame[0, c] = -ny
    t.frame[1, c] = nx
    t.frame[2, c] = xa
    t.frame[3, c] = xb
    t.frame[4, c] = off_a * qa
    t.frame[5, c] = off_b * qb
    t.frame[6, c] = rx * nx + ry * ny
    t.frame[7, c] = slid


@njit(**OPTIONS)
def touch_geometry(g, t, first, last, place, row):
    """Frame, opening, length and slip of contacts, Eqs. (13, 14, 16).

    ``row`` of the memory is the lift of dilation, or -1. Lists the active ones from ``place`` on; returns where the
    list ends, and how many overlap too much.
    """
    deep = 0
    for c in range(first, last):
        ax, ay, bx, by, wx, wy = _edges(t, c)
        offset, before = t.offset[c], t.length[c]
        lift = t.memory[row, c] if row >= 0 else 0.0
        beginning = offset == np.inf
        if before == 0:
            stand = overlap.standing(ax, ay, bx, by, wx, wy, t.skin)
            if stand != overlap.BEHIND and (stand == overlap.BESIDE or (offset == 0 and lift == 0) or beginning):
                t.offset[c] = np.inf if stand == overlap.BESIDE else 0.0
                if row >= 0:
                    t.memory[row, c] = t.fresh[row, g]
                continue
        offset = (0.0 if beginning else offset) - lift  # lifted faces touch where their edges are apart
        qa, qb = 1 / math.sqrt(ax * ax + ay * ay), 1 / math.sqrt(bx * bx + by * by)
        ex, ey, fx, fy = qa * ax, qa * ay, qb * bx, qb * by  # unit vectors of both edges
        tx, ty = overlap.mean_tangent(ax, ay, bx, by, qa, qb)
        ux, uy = wx + offset * ty, wy - offset * tx
        begin, end, first_end, last_end, _ = overlap.strip(tx, ty, ax, ay, bx, by, ux, uy)
        x1, y1, d1, x2, y2, d2 = overlap.ends(first_end, last_end, begin, end, ax, ay, bx, by, ux, uy, ex, ey, fx, fy)
        along_a, along_b = ex * (x2 - x1) + ey * (y2 - y1), fx * (x2 - x1) + fy * (y2 - y1)
        cut_a, cut_b = 0.0, 0.0  # where corners of A and B dig into each other: acute ones hold less
        if first_end * last_end < 0:
            cut_a, cut_b = (t.acute[0, c], t.acute[2, c]) if first_end > 0 else (t.acute[1, c], t.acute[3, c])
            along_a -= cut_a * (d2 if first_end > 0 else d1)
            along_b -= cut_b * (d1 if first_end > 0 else d2)
        mean, narrow = 0.5 * (d1 + d2), along_a * along_b < NARROW * (d1 * d1 + d1 * d2 + d2 * d2)
        apart = begin >= end or along_a <= 0 or along_b <= 0 or mean <= LEAST * along_a or narrow
        if beginning:  # without a force: what they overlap already becomes their offset
            t.offset[c] = 0.0 if apart else overlap.deepest(ax, ay, bx, by, wx, wy)
            continue
        far = mean > 2 * t.limit[c]
        if before > 0 or not (apart or far):
            t.active[place] = c
            place += 1
        if apart or far:
            deep += far and t.depth[c] > 0.5 * t.limit[c]
            if lift > 0:  # remembered until the faces are apart by more than grains may overlap
                room = offset - t.limit[c]
                _, _, _, _, near = overlap.strip(tx, ty, ax, ay, bx, by, wx + room * ty, wy - room * tx)
                lift = lift if near > 0 else 0.0
            _part(t, g, c, 0.0 if offset == 0 else overlap.deepest(ax, ay, bx, by, wx, wy), row, lift)
            continue
        g1x, g1y, g2x, g2y, share = overlap.gradient(
            first_end, last_end, d1, d2, along_a, along_b, cut_a, cut_b, ex, ey, fx, fy
        )
        nx, ny = -g1x - g2x, -g1y - g2y  # the energy of the overlap pushes along the normal
        size, depth = math.sqrt(nx * nx + ny * ny), mean * math.sqrt(share)
        nx, ny = nx / size, ny / size
        deep += depth > t.limit[c]
        t.length[c] = size / depth
        t.depth[c] = depth
        t.opening[c] = lift - depth
        # It acts half-way between the edges.
        centre = -(g2x * nx + g2y * ny) / size
        p1, q1, p2, q2 = (1 - centre) * x1, (1 - centre) * y1, centre * x2, centre * y2
        h1, h2 = 0.5 * (1 - centre) * d1, 0.5 * centre * d2
        p1, q1 = (p1 + h1 * ey, q1 - h1 * ex) if first_end < 0 else (p1 - h1 * fy, q1 + h1 * fx)
        p2, q2 = (p2 + h2 * ey, q2 - h2 * ex) if last_end < 0 else (p2 - h2 * fy, q2 + h2 * fx)
        x, y = p1 + p2, q1 + q2
        t.frame[8, c] = -((x1 - x) * g1y - (y1 - y) * g1x + (x2 - x) * g2y - (y2 - y) * g2x) / size
        x, y = x - 0.5 * offset * ty, y + 0.5 * offset * tx
        _slide(t, c, x, y, nx, ny, before, ax, ay, bx, by, wx, wy, ex, ey, fx, fy, qa, qb)
    return place, deep


def carry(rows, found):
    """Rows (r, c) of contacts that were in these places (c,) before; zero where they are new, -1."""
    new = np.zeros((rows.shape[0], found.shape[0]))
    for r in range(rows.shape[0]):
        for c in range(found.shape[0]):
            if found[c] >= 0:
                new[r, c] = rows[r, found[c]]
    return new


def geometry_of(t, g, row):
    """:func:`touch_geometry` of all contacts."""
    return touch_geometry(g, t, 0, t.length.shape[0], 0, row)


@njit(**OPTIONS)
def touch_forces(t, time_step, first, last, row):
    """Nodal forces of active contacts, Eq. (15), and their work by the trapezoidal rule, Eq. (12).

    A dashpot resists the closing of lifted faces, and not their lifting.
    """
    vx, vy = t.way[0], t.way[1]
    for c in t.active[first:last]:
        length = t.length[c]
        i, j, k, m = u32(t.node[0, c]), u32(t.node[1, c]), u32(t.node[2, c]), u32(t.node[3, c])
        tx, ty, xa, xb = t.frame[0, c], t.frame[1, c], t.frame[2, c], t.frame[3, c]
        normal, shear = min(t.normal[c], 0.0) * length, t.shear[c] * length
        damping, opened = 0.0, 0.0
        if length > 0:
            lifted = t.memory[row, c] - t.opening[c] - t.depth[c] if row >= 0 else 0.0  # in this step
            opened = t.frame[6, c] - lifted
            if t.dashpot[c] > 0:
                stiffness = max(-normal / max(t.depth[c] + lifted, 1e-300), 0.0)
                damping = min(t.dashpot[c] * math.sqrt(stiffness) * opened / time_step, -normal)  # never pulls
        push = normal + damping
        px, py = push * ty + shear * tx, shear * ty - push * tx  # on A; the reverse acts on B
        ax, ay, bx, by, _, _ = _edges(t, c)
        twist = t.frame[8, c] * normal
        qa = (t.frame[4, c] * (ax * px + ay * py) + twist) / (ax * ax + ay * ay)
        qb = (t.frame[5, c] * (bx * px + by * py) - twist) / (bx * bx + by * by)
        fx = (1 - xa) * px + qa * ay, xa * px - qa * ay, qb * (-by) - xb * px, (xb - 1) * px + qb * by
        fy = (1 - xa) * py - qa * ax, xa * py + qa * ax, qb * bx - xb * py, (xb - 1) * py - qb * bx
        total = 0.0
        for n, node in enumerate((i, j, k, m)):
            total -= (t.force[0, n, c] + fx[n]) * vx[node] + (t.force[1, n, c] + fy[n]) * vy[node]
            t.force[0, n, c] = fx[n]
            t.force[1, n, c] = fy[n]
        in_slip = 0.5 * (t.carried[1, c] + shear) * (t.frame[7, c] if length > 0 else 0.0)
        on_dashpot = 0.5 * (t.carried[2, c] + damping) * opened
        t.work[0, c] += 0.5 * total - in_slip - on_dashpot
        t.work[1, c] += in_slip
        t.work[2, c] += on_dashpot
        t.carried[0, c] = normal
        t.carried[1, c] = shear
        t.carried[2, c] = damping


@njit(**OPTIONS)
def _answer(t, group, g, first, last, rows):
    """Let a law answer for active contacts, by way of scratch ``rows``.

    They fill whole vectors of its code: how a contact is rounded does not depend on its place in the table. The law has
    no parameters of single contacts.
    """
    count, depth, size = last - first, t.memory.shape[0], 8 * rows.shape[1]
    for k in range(count):
        c = t.active[first + k]
        rows[0, k], rows[1, k] = t.opening[c], t.slip[c]
        for n in range(depth):
            rows[4 + n, k] = t.memory[n, c]
    start = rows.ctypes.data
    call(
        group[g, 0],
        (
            group[g, 1], group[g, 1], 0, start + 4 * size, rows.shape[1],
            start, start + size, start + 2 * size, start + 3 * size, (count + LANES - 1) // LANES * LANES,
        ),
    )  # fmt: skip
    for k in range(count):
        c = t.active[first + k]
        t.normal[c], t.shear[c] = rows[2, k], rows[3, k]
        for n in range(depth):
            t.memory[n, c] = rows[4 + n, k]


@njit(**OPTIONS)
def touch(t, group, time_step, first, last):
    """Contacts ``first`` to ``last``, law by law; returns how many overlap too much, and how many are active."""
    deep, listed = 0, first
    rows = np.zeros((4 + t.memory.shape[0], BLOCK))
    for g in range(group.shape[0]):
        final = min(last, group[g, 3])
        for begin in range(max(first, group[g, 2]), final, BLOCK):
            before = listed
            listed, too_deep = touch_geometry(g, t, begin, min(begin + BLOCK, final), listed, group[g, 4])
            deep += too_deep
            if listed > before:
                _answer(t, group, g, before, listed, rows)
                touch_forces(t, time_step, before, listed, group[g, 4])
    return deep, listed - first


@njit(**OPTIONS)
def gather_touching(t, parts, fx, fy, first, last):
    """Add the forces of all threads' contacts to the nodes ``first`` to ``last`` of ``touched``, in a fixed order."""
    for thread in range(t.tally.shape[0]):
        for c in t.active[parts[thread] : parts[thread] + t.tally[thread, 2]]:
            for n in range(4):
                k = t.node[n, c]
                if first <= k < last:
                    i = t.touched[k]
                    fx[i] += t.force[0, n, c]
                    fy[i] += t.force[1, n, c]


@njit(**OPTIONS)
def follow(t, ux, uy, first, last):
    """Take over where nodes have moved."""
    for k in range(first, last):
        i = t.touched[k]
        x, y = ux[i], uy[i]
        t.way[0, k], t.way[1, k] = x - t.seen[0, k], y - t.seen[1, k]
        t.seen[0, k], t.seen[1, k] = x, y
        t.place[0, k], t.place[1, k] = t.origin[0, k] + x, t.origin[1, k] + y


@njit(**OPTIONS)
def moved_far(ux, uy, bx, by, reach):
    """How many nodes have moved farther than ``reach``."""
    count = 0
    for i in range(ux.shape[0]):
        x, y = ux[i] - bx[i], uy[i] - by[i]
        count += x * x + y * y > reach * reach
    return count
