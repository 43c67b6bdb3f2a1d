"""Contacts between edges that are no bonded interface: geometry, forces, work, and who gathers what.

Index letters: ``c`` contact of an edge a of grain A with an edge b of grain B, ``i`` node. Equation numbers are those
of docs/theory.md.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.kernels.cache import OPTIONS
from grainlaw.kernels.foreign import call

u32 = np.uint32
STEEPEST = 1e-3  #: cosine between an edge and the tangent: steeper ones carry nothing
STOPS = 2  #: places of a thread's entry in ``stop``: nodes that have moved too far, contacts that overlap too much


class Touching(NamedTuple):
    """Pairs of edges (c) of different grains that touch or may soon; rows of scratch pass from pass to pass."""

    node: np.ndarray  #: (4, c) start and end of edge a, start and end of edge b, counter-clockwise round their grains
    limit: np.ndarray  #: (c,) largest overlap (m)
    dashpot: np.ndarray  #: (c,) sqrt(kg/m): damping force over rate and root of stiffness
    offset: np.ndarray  #: (c,) m, how much more open the contact is than its edges
    opening: np.ndarray  #: (c,) m, the mean over the contact, negative; 0 where apart
    slip: np.ndarray  #: (c,) m
    normal: np.ndarray  #: (c,) Pa
    shear: np.ndarray  #: (c,) Pa
    length: np.ndarray  #: (c,) m in contact, 0 where apart
    frame: np.ndarray  #: (9, c) tangent, shares of both edges, half depth, opened and slid now, old length, end effect
    force: np.ndarray  #: (2, 4, c) N on the four nodes
    carried: np.ndarray  #: (3, c) N: normal, shear, damping of the last step
    work: np.ndarray  #: (3, c) J done in opening, in slip, on the dashpot
    memory: np.ndarray  #: (m, c) of the laws
    fresh: np.ndarray  #: (m, groups) memory of a contact that has just come to be
    origin: np.ndarray  #: (2, i) undeformed places of all nodes (m)
    seen: np.ndarray  #: (2, i) displacement at the last step (m)
    built: np.ndarray  #: (2, i) displacement when the neighbours were last searched (m)
    touched: np.ndarray  #: (k,) nodes that may have forces, ascending
    first: np.ndarray  #: (k + 1,) where the forces of each begin in ``slot``
    slot: np.ndarray  #: (4 c,) places in the rows of ``force``
    reach: float  #: m, a node that has moved farther asks for a new search
    stop: np.ndarray  #: (threads, 8) counts of ``STOPS`` kinds, in a cache line for each thread


@njit(forceinline=True, **OPTIONS)
def strip(tx, ty, ax, ay, bx, by, wx, wy, offset):
    """Where two edges overlap, seen along the tangent: begin, end, depths there, how the chord leads, whose ends.

    ``a`` runs from the first corner of A, ``b`` the same way from the second corner of B, which lies at ``w``. The
    chord joins where the outlines cross: at a corner of A on b, at a corner of B on a, Eq. (15). No overlap: begin is
    end. The last is 1 where it begins at a corner of B and ends at one of A, -1 the other way round.
    """
    span_a, span_b = ax * tx + ay * ty, bx * tx + by * ty
    if span_a <= STEEPEST * math.sqrt(ax * ax + ay * ay) or span_b <= STEEPEST * math.sqrt(bx * bx + by * by):
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    start = wx * tx + wy * ty
    slope_a, slope_b = (ax * ty - ay * tx) / span_a, (bx * ty - by * tx) / span_b
    level = wx * ty - wy * tx + offset - slope_b * start  # height of b, where the tangent passes the corner of A
    begin, end = max(0.0, start), min(span_a, start + span_b)
    if begin >= end:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    d1 = slope_a * begin - level - slope_b * begin
    d2 = slope_a * end - level - slope_b * end
    if d1 <= 0 and d2 <= 0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    by_a, to_a = start <= 0, span_a <= start + span_b  # whether it begins, and ends, at a corner of A
    h1 = slope_a * begin - (d1 if by_a else 0.0)
    h2 = slope_a * end - (d2 if to_a else 0.0)
    if d1 < 0:
        begin -= d1 * (end - begin) / (d2 - d1)
        d1, h1 = 0.0, slope_a * begin
    if d2 < 0:
        end += d2 * (end - begin) / (d1 - d2)
        d2, h2 = 0.0, slope_a * end
    return begin, end, d1, d2, h2 - h1, 1.0 * to_a - 1.0 * by_a


@njit(forceinline=True, **OPTIONS)
def _edges(t, c, ux, uy):
    """Edge a, edge b the same way, the way from the first corner of a to that of b, and the mean tangent."""
    x0, y0 = t.origin[0], t.origin[1]
    i, j, k, m = u32(t.node[0, c]), u32(t.node[1, c]), u32(t.node[2, c]), u32(t.node[3, c])
    ix, iy, mx, my = x0[i] + ux[i], y0[i] + uy[i], x0[m] + ux[m], y0[m] + uy[m]
    ax, ay, bx, by = x0[j] + ux[j] - ix, y0[j] + uy[j] - iy, x0[k] + ux[k] - mx, y0[k] + uy[k] - my
    qa, qb = 1 / math.sqrt(ax * ax + ay * ay), 1 / math.sqrt(bx * bx + by * by)
    tx, ty = qa * ax + qb * bx, qa * ay + qb * by
    r = 1 / math.sqrt(max(tx * tx + ty * ty, 1e-30))
    return ax, ay, bx, by, mx - ix, my - iy, r * tx, r * ty


@njit(**OPTIONS)
def touch_geometry(g, t, ux, uy, first, last):
    """Frame, mean opening, length and slip of contacts, Eqs. (15, 16); returns how many overlap too much."""
    sx, sy = t.seen[0], t.seen[1]
    deep = 0
    for c in range(first, last):
        ax, ay, bx, by, wx, wy, tx, ty = _edges(t, c, ux, uy)
        offset = t.offset[c]
        begin, end, d1, d2, rise, ends = strip(tx, ty, ax, ay, bx, by, wx, wy, offset)
        if begin < end:  # once more along the chord
            run = end - begin
            q = 1 / math.sqrt(run * run + rise * rise)
            tx, ty = q * (run * tx + rise * ty), q * (run * ty - rise * tx)
            begin, end, d1, d2, rise, ends = strip(tx, ty, ax, ay, bx, by, wx, wy, offset)
        run = end - begin
        low = min(d1, d2)
        mean = 0.5 * (d1 + d2)
        t.frame[7, c] = t.length[c]
        if run <= 0 or mean <= 0 or mean > 2 * t.limit[c]:
            if offset != 0:  # parting without a force, the edges take back what they were more open than they are
                _, _, d1, d2, _, _ = strip(tx, ty, ax, ay, bx, by, wx, wy, 0.0)
                t.offset[c] = max(min(offset, max(d1, d2)), 0.0)
            t.length[c] = 0.0
            t.opening[c] = 0.0
            t.slip[c] = 0.0
            t.frame[5, c] = 0.0
            for n in range(t.memory.shape[0]):
                t.memory[n, c] = t.fresh[n, g]
            continue
        share = run * run / (run * run + low * low)
        deep += mean > t.limit[c] and share > 0.5 and run > 0.3 * mean
        t.length[c] = run * share
        t.opening[c] = -mean
        s = begin + run * (d1 + 2 * d2) / (3 * (d1 + d2))
        start = wx * tx + wy * ty
        xa, xb = s / (ax * tx + ay * ty), (s - start) / (bx * tx + by * ty)
        half = 0.5 * (d1 + (d2 - d1) * (s - begin) / run + offset)
        i, j, k, m = u32(t.node[0, c]), u32(t.node[1, c]), u32(t.node[2, c]), u32(t.node[3, c])
        dix, diy, djx, djy = ux[i] - sx[i], uy[i] - sy[i], ux[j] - sx[j], uy[j] - sy[j]
        dkx, dky, dmx, dmy = ux[k] - sx[k], uy[k] - sy[k], ux[m] - sx[m], uy[m] - sy[m]
        turn_a = (ax * (djy - diy) - ay * (djx - dix)) / (ax * ax + ay * ay)
        turn_b = (bx * (dky - dmy) - by * (dkx - dmx)) / (bx * bx + by * by)
        rx = dmx + xb * (dkx - dmx) - dix - xa * (djx - dix)
        ry = dmy + xb * (dky - dmy) - diy - xa * (djy - diy)
        slid = rx * tx + ry * ty + half * (turn_a + turn_b)
        t.slip[c] += slid
        t.frame[0, c] = tx
        t.frame[1, c] = ty
        t.frame[2, c] = xa
        t.frame[3, c] = xb
        t.frame[4, c] = half
        t.frame[5, c] = rx * ty - ry * tx
        t.frame[6, c] = slid
        t.frame[8, c] = 0.5 * ends * d1 * d2 / mean
    return deep


def forgive(t, ux, uy, fresh):
    """Let contacts ``fresh`` begin without a force: what they overlap already becomes their offset."""
    for c in fresh:
        ax, ay, bx, by, wx, wy, tx, ty = _edges(t, c, ux, uy)
        _, _, d1, d2, _, _ = strip(tx, ty, ax, ay, bx, by, wx, wy, 0.0)
        t.offset[c] = max(d1, d2)


def geometry_of(t, g):
    """:func:`touch_geometry` of all contacts, where nodes were seen last."""
    return touch_geometry(g, t, t.seen[0], t.seen[1], 0, t.length.shape[0])


@njit(**OPTIONS)
def touch_forces(t, ux, uy, time_step, first, last):
    """Nodal forces of contacts, Eq. (17), and their work by the trapezoidal rule, Eq. (12)."""
    x0, y0, sx, sy = t.origin[0], t.origin[1], t.seen[0], t.seen[1]
    for c in range(first, last):
        length = t.length[c]
        if length == 0 and t.frame[7, c] == 0:
            continue
        i, j, k, m = u32(t.node[0, c]), u32(t.node[1, c]), u32(t.node[2, c]), u32(t.node[3, c])
        tx, ty, xa, xb, half = t.frame[0, c], t.frame[1, c], t.frame[2, c], t.frame[3, c], t.frame[4, c]
        normal, shear = min(t.normal[c], 0.0) * length, t.shear[c] * length
        damping = 0.0
        if t.dashpot[c] > 0 and length > 0:
            stiffness = -normal / max(-t.opening[c], 1e-300)
            rate = t.frame[5, c] / time_step
            damping = min(t.dashpot[c] * math.sqrt(max(stiffness, 0.0)) * rate, -normal)  # never pulls
        push = normal + damping
        pull = shear - min(t.normal[c], 0.0) * t.frame[8, c]  # the length that slides in or out of contact is loaded
        px, py = push * ty + pull * tx, pull * ty - push * tx  # on A; the reverse acts on B
        ax, ay = x0[j] + ux[j] - x0[i] - ux[i], y0[j] + uy[j] - y0[i] - uy[i]
        bx, by = x0[k] + ux[k] - x0[m] - ux[m], y0[k] + uy[k] - y0[m] - uy[m]
        couple = -half * pull
        qa, qb = couple / (ax * ax + ay * ay), couple / (bx * bx + by * by)
        fx = (1 - xa) * px + qa * ay, xa * px - qa * ay, qb * (-by) - xb * px, (xb - 1) * px + qb * by
        fy = (1 - xa) * py - qa * ax, xa * py + qa * ax, qb * bx - xb * py, (xb - 1) * py - qb * bx
        total = 0.0
        for n, node in enumerate((i, j, k, m)):
            total -= (t.force[0, n, c] + fx[n]) * (ux[node] - sx[node])
            total -= (t.force[1, n, c] + fy[n]) * (uy[node] - sy[node])
            t.force[0, n, c] = fx[n]
            t.force[1, n, c] = fy[n]
        slid, opened = (t.frame[6, c], t.frame[5, c]) if length > 0 else (0.0, 0.0)
        in_slip = 0.5 * (t.carried[1, c] + shear) * slid
        on_dashpot = 0.5 * (t.carried[2, c] + damping) * opened
        t.work[0, c] += 0.5 * total - in_slip - on_dashpot
        t.work[1, c] += in_slip
        t.work[2, c] += on_dashpot
        t.carried[0, c] = normal
        t.carried[1, c] = shear
        t.carried[2, c] = damping


@njit(forceinline=True, **OPTIONS)
def respond(group, g, first, last, opening, slip, normal, shear):
    """Let the law of row ``g`` answer for contact points ``first`` to ``last``."""
    offset = 8 * (first - group[g, 8])
    call(
        group[g, 0],
        (
            group[g, 1], group[g, 2] + offset, group[g, 3], group[g, 4] + offset, group[g, 5],
            opening + 8 * first, slip + 8 * first, normal + 8 * first, shear + 8 * first, last - first,
        ),
    )  # fmt: skip


@njit(**OPTIONS)
def touch(t, group, ux, uy, time_step, first, last):
    """Contacts ``first`` to ``last``, law by law; returns how many overlap too much."""
    deep = 0
    addresses = t.opening.ctypes.data, t.slip.ctypes.data, t.normal.ctypes.data, t.shear.ctypes.data
    for g in range(group.shape[0]):
        begin, end = max(first, group[g, 6]), min(last, group[g, 7])
        if begin < end:
            deep += touch_geometry(g, t, ux, uy, begin, end)
            respond(group, g, begin, end, *addresses)
            touch_forces(t, ux, uy, time_step, begin, end)
    return deep


@njit(**OPTIONS)
def gather_touching(t, ux, uy, fx, fy, first, last):
    """Add the forces of contacts to their nodes, in a fixed order, and remember where the nodes are."""
    cx, cy = t.force[0].reshape(-1), t.force[1].reshape(-1)
    for k in range(first, last):
        i = t.touched[k]
        for s in range(t.first[k], t.first[k + 1]):
            fx[i] += cx[t.slot[s]]
            fy[i] += cy[t.slot[s]]
        t.seen[0, i] = ux[i]
        t.seen[1, i] = uy[i]


@njit(**OPTIONS)
def moved_far(ux, uy, bx, by, reach):
    """How many nodes have moved farther than ``reach``."""
    count = 0
    for i in range(ux.shape[0]):
        x, y = ux[i] - bx[i], uy[i] - by[i]
        count += x * x + y * y > reach * reach
    return count
