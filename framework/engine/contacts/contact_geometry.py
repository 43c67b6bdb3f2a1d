"""How contacts, pairs of edges without a bond, overlap: passes for their normal, opening and length.

Index letters: ``c`` contact of an edge a of grain A with an edge b of grain B, ``i`` node, ``k`` place in the list of
nodes in use, or in a row of a chunk of contacts. ``t`` is the table of contacts and ``r`` its rows (contact_table.py).
Equation numbers are those of docs/theory.md. A contact is in one of four states:

========  ==================================================================================================
state     what ends the state
========  ==================================================================================================
APART     an overlap
WAITING   edges that were just found, or lie beside each other, as both sides of one corner do: it begins when
          they do not lie beside each other, and the overlap of that moment becomes its offset
HELD      apart, with an offset, or with faces that were lifted: an overlap deeper than the offset, which
          shrinks as the edges part
CLOSED    the overlap to end, or (grains too deep in each other) the run to stop
========  ==================================================================================================
"""

import math  # noqa: I001 - the rows in few lines

import numpy as np
from numba import njit

from grainlaw.compiler.cache import PASS
from grainlaw.engine.contacts import overlap
from grainlaw.engine.contacts.contact_rows import (
    ANGLE_1A, ANGLE_1B, ANGLE_2A, ANGLE_2B, AX, AY, BLOCK, BX, BY, DAX, DAY, DBX, DBY, DWX, DWY, LARGEST, LENGTH,
    LEVER_A, LEVER_B, LIFT, OFFSET, OPENED, OPENING, OVERLAP, SHARE_A, SHARE_B, SLID, STANDS, STATE, TOUCH, TWIST, TX,
    TY, WX, WY,
)  # fmt: skip
from grainlaw.engine.contacts.contact_table import APART, CLOSED, HELD, WAITING
from grainlaw.engine.parts.laws import LANES
from grainlaw.engine.contacts.overlap import BEHIND, BESIDE

u32 = np.uint32
NARROW = 1e-9  #: square of the length over that of the depth: narrower overlaps belong to the contact of other faces
LEAST = 1e-13  #: depth over length of an overlap: below it, it is only rounding
STRIP = 64  #: contacts that are listed together
CLEARLY = 1e-12  #: in front: more than rounding, which may differ where a loop does not fill a vector
NOT, SOME, FAR = 0.0, 1.0, 2.0  #: how edges overlap; ``FAR`` is much too deep


@njit(**PASS)
def gather_edges(t, place, r, contact):
    """Both edges, and the vector between them, where nodes are at a ``place`` (2, k) m."""
    x, y, node = place[0], place[1], t.node
    for p in range(contact.shape[0]):
        c = contact[p]
        i, j, k, m = u32(node[0, c]), u32(node[1, c]), u32(node[2, c]), u32(node[3, c])
        r[AX + p], r[AY + p], r[BX + p], r[BY + p] = x[j] - x[i], y[j] - y[i], x[k] - x[m], y[k] - y[m]
        r[WX + p], r[WY + p] = x[m] - x[i], y[m] - y[i]


@njit(**PASS)
def gather_angles(t, r, contact):
    """The angles of the grains at the ends of both edges."""
    cotangent, node = t.cotangent, t.node
    for p in range(contact.shape[0]):
        c = contact[p]
        i, j, k, m = u32(node[0, c]), u32(node[1, c]), u32(node[2, c]), u32(node[3, c])
        r[ANGLE_1A + p], r[ANGLE_2A + p] = cotangent[i], cotangent[j]
        r[ANGLE_1B + p], r[ANGLE_2B + p] = cotangent[k], cotangent[m]


@njit(**PASS)
def gather_increments(t, r, contact):
    """The increments, in the last step, of both edges and of the vector between them."""
    vx, vy, node = t.increment[0], t.increment[1], t.node
    for p in range(contact.shape[0]):
        c = contact[p]
        i, j, k, m = u32(node[0, c]), u32(node[1, c]), u32(node[2, c]), u32(node[3, c])
        r[DAX + p], r[DAY + p], r[DBX + p], r[DBY + p] = vx[j] - vx[i], vy[j] - vy[i], vx[k] - vx[m], vy[k] - vy[m]
        r[DWX + p], r[DWY + p] = vx[m] - vx[i], vy[m] - vy[i]


@njit(forceinline=True, **PASS)
def edges(r, k):
    """Edge a, edge b in the same direction, and the vector from the first corner of a to that of b."""
    return r[AX + k], r[AY + k], r[BX + k], r[BY + k], r[WX + k], r[WY + k]


@njit(**PASS)
def arrangements(r, count, skin):
    """How edges that do not touch stand to each other."""
    for k in range(count):
        ax, ay, bx, by, wx, wy = edges(r, k)
        r[STANDS + k] = overlap.arrangement(ax, ay, bx, by, wx, wy, skin)


@njit(**PASS)
def overlaps(r, count):
    """Overlap of two edges after b is moved by offset less lift, Eq. (13), its normal and length, Eq. (14)."""
    for k in range(count):
        ax, ay, bx, by, wx, wy = edges(r, k)
        offset = r[OFFSET + k] - r[LIFT + k]  # Eq. (16): lifted faces touch while their edges are still apart
        qa, qb = 1 / math.sqrt(ax * ax + ay * ay), 1 / math.sqrt(bx * bx + by * by)
        ex, ey, fx, fy = qa * ax, qa * ay, qb * bx, qb * by  # unit vectors of both edges
        tx, ty = overlap.mean_tangent(ax, ay, bx, by, qa, qb)
        ux, uy = wx + offset * ty, wy - offset * tx
        # Eq. (13): the common interval, the depths d1 and d2 at its ends, and its lengths J_a and J_b.
        begin, end, first, last, deeper = overlap.strip(tx, ty, ax, ay, bx, by, ux, uy)
        x1, y1, d1, x2, y2, d2 = overlap.ends(first, last, begin, end, ax, ay, bx, by, ux, uy, ex, ey, fx, fy)
        along_a, along_b = ex * (x2 - x1) + ey * (y2 - y1), fx * (x2 - x1) + fy * (y2 - y1)
        # Where a corner of A and one of B dig into each other: acute corners overlap over less length.
        angle_1a, angle_2a, angle_1b, angle_2b = r[ANGLE_1A + k], r[ANGLE_2A + k], r[ANGLE_1B + k], r[ANGLE_2B + k]
        cut_a = 0.0 if first * last >= 0 else (angle_1a if first > 0 else angle_2a)
        cut_b = 0.0 if first * last >= 0 else (angle_1b if first > 0 else angle_2b)
        both = overlap.harmonic_mean(d1, d2)  # 0 where either corner leaves the other edge: the energy does not jump
        along_a -= cut_a * both
        along_b -= cut_b * both
        mean, narrow = 0.5 * (d1 + d2), along_a * along_b < NARROW * (d1 * d1 + d1 * d2 + d2 * d2)
        some = (deeper > 0) & (along_a > 0) & (along_b > 0) & (mean > LEAST * along_a) & (not narrow)
        r[TOUCH + k] = (FAR if mean > 2 * r[LARGEST + k] else SOME) if some else NOT
        # Eq. (14): the gradient of the energy at both ends gives normal and length; ``share`` is J^2 / (J^2 + D^2).
        g1x, g1y, g2x, g2y, share = overlap.gradient(
            first, last, d1, d2, along_a, along_b, cut_a, cut_b, ex, ey, fx, fy
        )
        nx, ny = -g1x - g2x, -g1y - g2y
        size, depth = math.sqrt(nx * nx + ny * ny), mean * math.sqrt(share)
        inverse = 1 / size
        nx, ny = nx * inverse, ny * inverse
        # The force acts in the middle between the edges; ``twist`` gives the moment that this point leaves out.
        centre = -(g2x * nx + g2y * ny) * inverse
        h1, h2 = 0.5 * (1 - centre) * d1, 0.5 * centre * d2
        x = (1 - centre) * x1 + centre * x2 + (h1 * ey if first < 0 else -h1 * fy) + (h2 * ey if last < 0 else -h2 * fy)
        y = (1 - centre) * y1 + centre * y2 - (h1 * ex if first < 0 else -h1 * fx) - (h2 * ex if last < 0 else -h2 * fx)
        moment = -((x1 - x) * g1y - (y1 - y) * g1x + (x2 - x) * g2y - (y2 - y) * g2x) * inverse
        x, y = x - 0.5 * offset * ty, y + 0.5 * offset * tx
        r[OVERLAP + k] = depth if some else 0.0
        r[LENGTH + k] = size / depth if some else 0.0
        r[TX + k] = -ny if some else 0.0
        r[TY + k] = nx if some else 0.0
        r[SHARE_A + k] = (x * ex + y * ey) * qa if some else 0.0
        r[SHARE_B + k] = ((x - wx) * fx + (y - wy) * fy) * qb if some else 0.0
        r[LEVER_A + k] = (x * ey - y * ex) * qa if some else 0.0
        r[LEVER_B + k] = ((y - wy) * fx - (x - wx) * fy) * qb if some else 0.0
        r[TWIST + k] = moment if some else 0.0


@njit(**PASS)
def find_followed(r, state, follow):
    """Which contacts are asked more than whether their edges are clearly apart: ``follow`` is 1 or 0."""
    for k in range(follow.shape[0]):
        ax, ay, bx, by, wx, wy = edges(r, k)
        room = CLEARLY * (ax * ax + ay * ay + bx * bx + by * by + wx * wx + wy * wy)
        may = not overlap.in_front(ax, ay, bx, by, wx, wy, -room)
        follow[k] = (state[k] != APART) | (may & overlap.may_overlap(ax, ay, bx, by, wx, wy, CLEARLY))


@njit(**PASS)
def drop_apart(t, r, contact, count):
    """Follow no further which of these contacts are apart, do not touch, and do not lie beside each other."""
    gather_edges(t, t.place, r, contact)
    gather_angles(t, r, contact)
    for k in range(contact.shape[0]):
        r[OFFSET + k], r[LIFT + k] = 0.0, 0.0
    arrangements(r, contact.shape[0], t.skin)
    overlaps(r, contact.shape[0])
    for k in range(count):
        t.follow[contact[k]] = (r[TOUCH + k] != NOT) | (r[STANDS + k] == BESIDE)


@njit(**PASS)
def _list(follow, first, last, active, place):
    """List contacts with a ``follow`` of 1 from ``place`` on; returns where the list ends."""
    for begin in range(first, last, STRIP):
        end, number = min(begin + STRIP, last), 0
        for c in range(begin, end):
            number += follow[c]
        for c in range(begin, end if number > 0 else begin):  # of edges that are only near most strips have none
            active[place] = c
            place += follow[c]
    return place


@njit(**PASS)
def list_followed(t, r, contact, first, last, place):
    """List followed contacts from ``place`` on; returns where the list ends. ``r`` and ``contact`` are scratch."""
    active, state, follow = t.active, t.state, t.follow
    for begin in range(first, last, BLOCK):
        end = min(begin + BLOCK, last)
        for c in range(begin, end):
            contact[c - begin] = c
        gather_edges(t, t.place, r, contact[: end - begin])
        find_followed(r, state[begin:end], follow[begin:end])
        until, count = _list(follow, begin, end, active, place), 0
        for k in range(place, until):
            contact[count] = active[k]
            count += state[active[k]] == APART
        filled = (count + LANES - 1) // LANES * LANES
        for k in range(count, filled):  # whole vectors, as in the chunks that follow
            contact[k] = contact[count - 1]
        drop_apart(t, r, contact[:filled], count)
        for k in range(place, until):
            c = active[k]
            active[place] = c
            place += follow[c]
    return place


@njit(**PASS)
def close(r, count):
    """Which of them are closed, and their opening, Eq. (16): of the others overlap, length and opening are 0."""
    for k in range(count):
        state, stands = r[STATE + k], r[STANDS + k]
        may = (state == CLOSED) | ((state == HELD) & (stands != BESIDE)) | ((state == APART) & (stands == BEHIND))
        closed = may & (r[TOUCH + k] == SOME)
        r[OPENING + k] = r[LIFT + k] - r[OVERLAP + k] if closed else 0.0
        r[OVERLAP + k] = r[OVERLAP + k] if closed else 0.0
        r[LENGTH + k] = r[LENGTH + k] if closed else 0.0


@njit(**PASS)
def motions(r, count):
    """How contacts have opened and slid in the last step where their force acts."""
    for k in range(count):
        ax, ay, bx, by, tx, ty = r[AX + k], r[AY + k], r[BX + k], r[BY + k], r[TX + k], r[TY + k]
        dax, day, dbx, dby = r[DAX + k], r[DAY + k], r[DBX + k], r[DBY + k]
        turn_a = r[LEVER_A + k] * (ax * day - ay * dax) / (ax * ax + ay * ay)
        turn_b = r[LEVER_B + k] * (bx * dby - by * dbx) / (bx * bx + by * by)
        x = r[DWX + k] + r[SHARE_B + k] * dbx - r[SHARE_A + k] * dax - turn_b * bx - turn_a * ax
        y = r[DWY + k] + r[SHARE_B + k] * dby - r[SHARE_A + k] * day - turn_b * by - turn_a * ay
        closed = r[LENGTH + k] > 0
        r[OPENED + k] = x * ty - y * tx if closed else 0.0
        r[SLID + k] = x * tx + y * ty if closed else 0.0


@njit(forceinline=True, **PASS)
def _is_near(ax, ay, bx, by, wx, wy, room):
    """Whether edges overlap, seen along their mean tangent, once b is moved away from a by ``room`` (m)."""
    tx, ty = overlap.mean_tangent(ax, ay, bx, by, 1 / math.sqrt(ax * ax + ay * ay), 1 / math.sqrt(bx * bx + by * by))
    return overlap.strip(tx, ty, ax, ay, bx, by, wx + room * ty, wy - room * tx)[4] > 0


@njit(**PASS)
def settle(r, k):
    """What becomes of a contact that is not closed: its state, offset and lift."""
    ax, ay, bx, by, wx, wy = edges(r, k)
    state, stands, offset, lift = r[STATE + k], r[STANDS + k], r[OFFSET + k], r[LIFT + k]
    if state == CLOSED or (state == HELD and stands != BESIDE):
        # Lifted faces keep their lift until they are farther apart than grains may overlap. A positive offset shrinks
        # to the overlap that the edges still have, a negative one vanishes, both without a force.
        kept = lift if lift > 0 and _is_near(ax, ay, bx, by, wx, wy, offset - lift - r[LARGEST + k]) else 0.0
        left = 0.0 if offset == 0 else max(min(offset, overlap.deepest(ax, ay, bx, by, wx, wy)), 0.0)
    elif state == WAITING and stands == BEHIND:  # without a force: the overlap they have becomes their offset
        kept, left = 0.0, 0.0 if r[TOUCH + k] == NOT else overlap.deepest(ax, ay, bx, by, wx, wy)
    else:
        kept, left = 0.0, 0.0
    now = WAITING if state != CLOSED and stands == BESIDE else (HELD if left > 0 or kept > 0 else APART)
    return now, left, kept
