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
BLOCK = 512  #: contacts that go through geometry, law and forces together; a multiple of the loop's ``LANES``
STEEPEST = 1e-3  #: cosine (about) between an edge and the tangent: steeper ones carry nothing
STOPS = 2  #: places of a thread's entry in ``stop``: nodes that have moved too far, contacts that overlap too much


class Touching(NamedTuple):
    """Pairs of edges (c) of different grains that touch or may soon; rows of scratch pass from pass to pass."""

    node: np.ndarray  #: (4, c) places in ``touched``: start and end of edge a, of edge b, each counter-clockwise
    inverse: np.ndarray  #: (2, c) inverse lengths of both edges, undeformed (1/m)
    limit: np.ndarray  #: (c,) largest overlap (m)
    dashpot: np.ndarray  #: (c,) sqrt(kg/m): damping force over rate and root of stiffness
    ease: np.ndarray  #: (c,) 1 / ks, m/Pa
    offset: np.ndarray  #: (c,) m, how much more open the contact is than its edges
    opening: np.ndarray  #: (c,) m, the mean over the contact, negative; 0 where apart
    slip: np.ndarray  #: (c,) m
    normal: np.ndarray  #: (c,) Pa
    shear: np.ndarray  #: (c,) Pa
    length: np.ndarray  #: (c,) m in contact, 0 where apart
    frame: (
        np.ndarray
    )  #: (10, c) tangent, shares of both edges, half depth, opened, slid, old length, tilt, twist
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
    first: np.ndarray  #: (k + 1,) where the forces of each node begin in ``slot``
    slot: np.ndarray  #: (4 c,) places in the rows of ``force``
    built: np.ndarray  #: (2, i) displacement of all nodes when neighbours were last searched (m); none: do not search
    reach: float  #: m, a node that has moved farther asks for a new search
    stop: np.ndarray  #: (threads, 8) counts of ``STOPS`` kinds, in a cache line for each thread


@njit(forceinline=True, **OPTIONS)
def _strip(tx, ty, ax, ay, bx, by, wx, wy, offset, qa, qb):
    """Where two edges overlap, seen along a tangent: begin, end, depths there, whose ends, inverse spans.

    ``a`` runs from the first corner of A, ``b`` the same way from the second corner of B, which lies at ``w``; ``qa``,
    ``qb`` are inverse lengths. An end is 1 at a corner of A, -1 at one of B, 0 where the edges cross. No overlap: begin
    is end.
    """
    span_a, span_b = ax * tx + ay * ty, bx * tx + by * ty
    if span_a * qa <= STEEPEST or span_b * qb <= STEEPEST:
        return 0.0, 0.0, 0.0, 0.0, 0, 0, 0.0, 0.0
    start = wx * tx + wy * ty
    begin, end = max(0.0, start), min(span_a, start + span_b)
    if begin >= end:
        return 0.0, 0.0, 0.0, 0.0, 0, 0, 0.0, 0.0
    inverse_a, inverse_b = 1 / span_a, 1 / span_b
    slope = (ax * ty - ay * tx) * inverse_a - (bx * ty - by * tx) * inverse_b
    level = wx * ty - wy * tx + offset - (bx * ty - by * tx) * inverse_b * start  # of b, beside the corner of A
    d1, d2 = slope * begin - level, slope * end - level
    if d1 <= 0 and d2 <= 0:
        return 0.0, 0.0, 0.0, 0.0, 0, 0, 0.0, 0.0
    first, last = 1 if start <= 0 else -1, 1 if span_a <= start + span_b else -1
    if d1 < 0:
        begin -= d1 / slope
        d1, first = 0.0, 0
    if d2 < 0:
        end -= d2 / slope
        d2, last = 0.0, 0
    return begin, end, d1, d2, first, last, inverse_a, inverse_b


@njit(forceinline=True, **OPTIONS)
def _gradient(run, d1, d2, first, last):
    """Derivatives of the energy of an overlap over the stiffness, Eqs. (13, 14): by closure, slip; centre; by turning.

    The energy is kn/2 J^3 D^2 / (J^2 + D^2): of an elastic foundation where the overlap is long, and small where it is
    deep, because then other sides of the same corners touch.
    """
    squares = d1 * d1 + d1 * d2 + d2 * d2
    share = run * run / (run * run + squares * (1 / 3))
    f = share * share * (1 / 6)
    in_length = f * squares * (1 + squares / (run * run))
    at_first, at_last = f * run * (2 * d1 + d2), f * run * (d1 + 2 * d2)
    tilt = 0.5 * (d2 - d1) / run
    along = 0.5 * (first - last) * in_length - tilt * (first * at_first + last * at_last)
    if first == 0:
        at_first = in_length * run / d2
    if last == 0:
        at_last = in_length * run / d1
    across = at_first + at_last
    return across, along, at_last / across, 0.25 * (d2 - d1) * in_length, share


@njit(forceinline=True, **OPTIONS)
def _edges(t, c):
    """Edge a, edge b the same way, and the way from the first corner of a to that of b."""
    x, y = t.place[0], t.place[1]
    i, j, k, m = u32(t.node[0, c]), u32(t.node[1, c]), u32(t.node[2, c]), u32(t.node[3, c])
    return x[j] - x[i], y[j] - y[i], x[k] - x[m], y[k] - y[m], x[m] - x[i], y[m] - y[i]


@njit(forceinline=True, **OPTIONS)
def _in_front(ax, ay, bx, by, wx, wy):
    """Whether one edge lies on the outer side of the other's line: then they do not overlap."""
    first, second = ax * wy - ay * wx, ax * (wy + by) - ay * (wx + bx)  # of b over a, against a's inner side
    third, fourth = bx * wy - by * wx, bx * (wy - ay) - by * (wx - ax)  # of a under b
    return max(first, second) <= 0 or max(third, fourth) <= 0


@njit(forceinline=True, **OPTIONS)
def _mean_tangent(ax, ay, bx, by, qa, qb):
    tx, ty = qa * ax + qb * bx, qa * ay + qb * by
    r = 1 / math.sqrt(max(tx * tx + ty * ty, 1e-30))
    return r * tx, r * ty


@njit(**OPTIONS)
def touch_geometry(g, t, first, last):
    """Frame, opening, length and slip of contacts, Eqs. (13, 14); returns how many overlap too much."""
    vx, vy = t.way[0], t.way[1]
    deep = 0
    for c in range(first, last):
        ax, ay, bx, by, wx, wy = _edges(t, c)
        offset, qa, qb = t.offset[c], t.inverse[0, c], t.inverse[1, c]
        t.frame[7, c] = t.length[c]
        if offset == 0 and t.length[c] == 0 and _in_front(ax, ay, bx, by, wx, wy):
            continue
        tx, ty = _mean_tangent(ax, ay, bx, by, qa, qb)
        begin, end, d1, d2, one, other, ia, ib = _strip(tx, ty, ax, ay, bx, by, wx, wy, offset, qa, qb)
        run, mean = end - begin, 0.5 * (d1 + d2)
        if run <= 0 or mean <= 0 or mean > 2 * t.limit[c]:
            if offset != 0:  # parting without a force, the edges take back what they were more open than they are
                t.offset[c] = max(min(offset, _overlap(ax, ay, bx, by, wx, wy, qa, qb)), 0.0)
            t.length[c] = 0.0
            t.opening[c] = 0.0
            t.slip[c] = 0.0
            for n in range(t.memory.shape[0]):
                t.memory[n, c] = t.fresh[n, g]
            continue
        across, along, centre, twist, share = _gradient(run, d1, d2, one, other)
        size = math.sqrt(across * across + along * along)
        depth = mean * math.sqrt(share)
        deep += depth > t.limit[c]
        t.length[c] = size / depth
        t.opening[c] = -depth
        s = begin + run * centre
        xa, xb = s * ia, (s - wx * tx - wy * ty) * ib
        half = 0.5 * (d1 + (d2 - d1) * centre + offset)
        up, side = across / size, along / size  # the force of the overlap is along the normal, across it friction
        nx, ny = up * ty - side * tx, -up * tx - side * ty
        i, j, k, m = u32(t.node[0, c]), u32(t.node[1, c]), u32(t.node[2, c]), u32(t.node[3, c])
        dix, diy, djx, djy, dkx, dky, dmx, dmy = vx[i], vy[i], vx[j], vy[j], vx[k], vy[k], vx[m], vy[m]
        turn_a = (ax * (djy - diy) - ay * (djx - dix)) * (qa * qa)
        turn_b = (bx * (dky - dmy) - by * (dkx - dmx)) * (qb * qb)
        turn = half * (turn_a + turn_b)  # moves the surfaces along the mean tangent
        rx = dmx + xb * (dkx - dmx) - dix - xa * (djx - dix) + turn * tx
        ry = dmy + xb * (dky - dmy) - diy - xa * (djy - diy) + turn * ty
        slid = ry * nx - rx * ny
        grown = 1 - t.frame[7, c] / t.length[c]
        if grown > 0:  # what has just come into contact has not slipped: else it would be given elastic energy
            t.slip[c] -= grown * t.ease[c] * t.shear[c]
        t.slip[c] += slid
        t.frame[0, c] = -ny
        t.frame[1, c] = nx
        t.frame[2, c] = xa
        t.frame[3, c] = xb
        t.frame[4, c] = half * up
        t.frame[8, c] = half * side
        t.frame[9, c] = twist / size
        t.frame[5, c] = rx * nx + ry * ny
        t.frame[6, c] = slid
    return deep


@njit(**OPTIONS)
def _overlap(ax, ay, bx, by, wx, wy, qa, qb):
    """The larger of the depths at both ends (m), seen along the mean tangent."""
    tx, ty = _mean_tangent(ax, ay, bx, by, qa, qb)
    _, _, d1, d2, _, _, _, _ = _strip(tx, ty, ax, ay, bx, by, wx, wy, 0.0, qa, qb)
    return max(d1, d2)


def carry_over(t, old, found):
    """Give contacts the state of those they were before (c,); -1 is new.

    New ones begin without a force: what they overlap already becomes their offset.
    """
    for c in range(found.shape[0]):
        k = found[c]
        if k >= 0:
            t.offset[c], t.opening[c], t.slip[c] = old.offset[k], old.opening[k], old.slip[k]
            t.normal[c], t.shear[c], t.length[c] = old.normal[k], old.shear[k], old.length[k]
            t.frame[:, c] = old.frame[:, k]
            t.force[:, :, c] = old.force[:, :, k]
            t.carried[:, c] = old.carried[:, k]
            t.work[:, c] = old.work[:, k]
            t.memory[:, c] = old.memory[:, k]
            continue
        ax, ay, bx, by, wx, wy = _edges(t, c)
        t.offset[c] = _overlap(ax, ay, bx, by, wx, wy, t.inverse[0, c], t.inverse[1, c])


def geometry_of(t, g):
    """:func:`touch_geometry` of all contacts."""
    return touch_geometry(g, t, 0, t.length.shape[0])


@njit(**OPTIONS)
def touch_forces(t, time_step, first, last):
    """Nodal forces of contacts, Eq. (15), and their work by the trapezoidal rule, Eq. (12)."""
    vx, vy = t.way[0], t.way[1]
    for c in range(first, last):
        length = t.length[c]
        if length == 0 and t.frame[7, c] == 0:
            continue
        i, j, k, m = u32(t.node[0, c]), u32(t.node[1, c]), u32(t.node[2, c]), u32(t.node[3, c])
        tx, ty, xa, xb = t.frame[0, c], t.frame[1, c], t.frame[2, c], t.frame[3, c]
        normal, shear = min(t.normal[c], 0.0) * length, t.shear[c] * length
        damping = 0.0
        if t.dashpot[c] > 0 and length > 0:
            stiffness = -normal / max(-t.opening[c], 1e-300)
            rate = t.frame[5, c] / time_step
            damping = min(t.dashpot[c] * math.sqrt(max(stiffness, 0.0)) * rate, -normal)  # never pulls
        push = normal + damping
        px, py = push * ty + shear * tx, shear * ty - push * tx  # on A; the reverse acts on B
        ax, ay, bx, by, _, _ = _edges(t, c)
        couple = t.frame[8, c] * push - t.frame[4, c] * shear
        twist = t.frame[9, c] * normal
        qa, qb = (couple + twist) / (ax * ax + ay * ay), (couple - twist) / (bx * bx + by * by)
        fx = (1 - xa) * px + qa * ay, xa * px - qa * ay, qb * (-by) - xb * px, (xb - 1) * px + qb * by
        fy = (1 - xa) * py - qa * ax, xa * py + qa * ax, qb * bx - xb * py, (xb - 1) * py - qb * bx
        total = 0.0
        for n, node in enumerate((i, j, k, m)):
            total -= (t.force[0, n, c] + fx[n]) * vx[node] + (t.force[1, n, c] + fy[n]) * vy[node]
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
def touch(t, group, time_step, first, last):
    """Contacts ``first`` to ``last``, law by law; returns how many overlap too much."""
    deep = 0
    addresses = t.opening.ctypes.data, t.slip.ctypes.data, t.normal.ctypes.data, t.shear.ctypes.data
    for g in range(group.shape[0]):
        final = min(last, group[g, 7])
        for begin in range(max(first, group[g, 6]), final, BLOCK):
            end = min(begin + BLOCK, final)
            deep += touch_geometry(g, t, begin, end)
            respond(group, g, begin, end, *addresses)
            touch_forces(t, time_step, begin, end)
    return deep


@njit(**OPTIONS)
def gather_touching(t, fx, fy, first, last):
    """Add the forces of contacts to their nodes, in a fixed order."""
    cx, cy = t.force[0].reshape(-1), t.force[1].reshape(-1)
    for k in range(first, last):
        x, y = 0.0, 0.0
        for s in range(t.first[k], t.first[k + 1]):
            x += cx[t.slot[s]]
            y += cy[t.slot[s]]
        fx[t.touched[k]] += x
        fy[t.touched[k]] += y


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
