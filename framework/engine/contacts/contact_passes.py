"""The passes over contacts, pairs of edges without a bond: law, forces, work, and who gathers what.

Index letters: ``c`` contact, ``i`` node, ``k`` place in the list of nodes in use, or in a row of a chunk of contacts.
``t`` is the table of contacts and ``r`` its rows (contact_table.py). Equation numbers are those of docs/theory.md.

Followed contacts go in chunks through simple loops over rows. A row is filled to whole vectors with copies of the last
contact: how a contact is rounded depends neither on its place in the table nor on what else is in it.
"""

import math  # noqa: I001 - the rows in few lines
from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import PASS
from grainlaw.compiler.entry import Kernel
from grainlaw.compiler.numba_private import call
from grainlaw.engine.contacts import contact_exchange as exchange
from grainlaw.engine.contacts import contact_geometry as geometry
from grainlaw.engine.contacts.contact_rows import (
    ASKED, AX, AY, BEFORE, BLOCK, BX, BY, DAMPING, DAMPING_FORCE, DAMPING_WORK, DASHPOT, DAX, DAY, DBX, DBY, DWX,
    DWY, FX, FY, GX, GY, HIGH, HIGH_PRESSURE, HX, HY, LARGEST, LENGTH, LEVER_A, LEVER_B, LIFT, LIFT_BEFORE, LOW,
    LOW_PRESSURE, MEMORY, NEW_LIFT, NORMAL, OFFSET, OPENED, OPENING, OPENING_WORK, OVERLAP, ROW, SHARE_A, SHARE_B,
    SHEAR, SHEAR_FORCE, SLID, SLIP, SLIP_WORK, SPRING, STATE, TOUCH, TWIST, TX, TY,
)  # fmt: skip
from grainlaw.engine.contacts.contact_table import CLOSED, HELD, WAITING
from grainlaw.engine.parts.laws import LANES

u32 = np.uint32
EVEN = 1e-6  #: of the pressure: a law that answers so near carries the force
HALVINGS, REFINED = 60, 3  #: of the interval that contains an offset; steps of Newton's method for a slip
ROUNDS = 8  #: in which a law is asked for the opening at which it does; one whose closure does not stiffen in none
MOVED, DEEP, ACTIVE, LEAVING = range(4)  #: columns of the tally of each thread


@njit(**PASS)
def slips(r, count, compliance):
    """The new slip of contacts, and their shear force of the step before.

    New length in contact has not slipped: otherwise it would gain elastic energy.
    """
    for k in range(count):
        before, length, shear = r[BEFORE + k], r[LENGTH + k], r[SHEAR + k]
        slip = r[SLIP + k] - max(1 - before / length, 0.0) * compliance * shear + r[SLID + k]
        r[SHEAR_FORCE + k] = shear * before
        r[SLIP + k] = slip if length > 0 else 0.0


@njit(**PASS)
def _answer(t, g, r, count, opening, memory):
    """Let law ``g`` answer, with the rows of its ``memory``; it has no parameters of single contacts."""
    start, row = r.ctypes.data, t.laws.dilation[g]
    call(
        t.laws.address[g],
        (
            t.laws.numbers[g], t.laws.numbers[g], 0, start + 8 * memory, ROW,
            start + 8 * opening, start + 8 * SLIP, start + 8 * NORMAL, start + 8 * SHEAR, count,
        ),
    )  # fmt: skip
    if row >= 0:
        exchange.copy(r, memory + row * ROW, NEW_LIFT, count)
    else:
        exchange.clear(r, NEW_LIFT, count)


@njit(**PASS)
def springs(r, count):
    """Normal forces of contacts without dashpots."""
    for k in range(count):
        r[SPRING + k], r[DAMPING + k] = min(r[NORMAL + k], 0.0) * r[LENGTH + k], 0.0


@njit(**PASS)
def dashpots(r, count, time_step):
    """Normal forces of spring and dashpot, and the opening at which a linear closure carries both.

    A dashpot resists the closing of lifted faces, not their lifting. The law has answered on trial: where friction has
    to hold more or less than its shear, it has lifted the faces in a way that is not theirs, which is left out here.
    """
    for k in range(count):
        length, lift, overlap = r[LENGTH + k], r[LIFT + k], r[OVERLAP + k]
        lifted = lift - r[LIFT_BEFORE + k] if r[BEFORE + k] > 0 else 0.0
        opened = r[OPENED + k] - lifted if length > 0 else 0.0
        trial = max(r[NEW_LIFT + k] - lift + overlap, 1e-300)
        normal = min(r[NORMAL + k], 0.0) * (overlap / trial if trial > overlap else 1.0) * length
        stiffness = max(-normal / max(overlap, 1e-300), 0.0)
        damping = min(r[DASHPOT + k] * math.sqrt(stiffness) * opened / time_step, -normal)  # never pulls
        r[SPRING + k], r[DAMPING + k], r[OPENED + k] = normal, damping, opened
        r[ASKED + k] = lift - (1 + damping / normal if normal < 0 else 1.0) * overlap
        closing, pressure = damping < 0, -normal / max(length, 1e-300)
        r[LOW + k], r[LOW_PRESSURE + k] = (overlap, pressure) if closing else (0.0, 0.0)
        r[HIGH + k], r[HIGH_PRESSURE + k] = (math.inf, math.inf) if closing else (overlap, pressure)


@njit(forceinline=True, **PASS)
def _misses(length, spring, damping, pressure):
    """Whether the law has answered with another pressure (Pa) than that of the whole normal force."""
    force = -(spring + damping)
    return (length > 0) & (abs(pressure * length - force) > EVEN * force)


@njit(**PASS)
def missed(r, count):
    """How many laws have answered with another pressure and may be asked again."""
    number = 0
    for k in range(count):
        misses = _misses(r[LENGTH + k], r[SPRING + k], r[DAMPING + k], max(-r[NORMAL + k], 0.0))
        number += misses
    return number


@njit(**PASS)
def narrow(r, count):
    """The next closure to ask of laws that have answered with another pressure.

    It lies on the hyperbola (that of Bandis, or a line) through the nearest answers below and above.
    """
    for k in range(count):
        length, spring, x, p = r[LENGTH + k], r[SPRING + k], r[LIFT + k] - r[ASKED + k], max(-r[NORMAL + k], 0.0)
        if not _misses(length, spring, r[DAMPING + k], p):
            continue
        target = -(spring + r[DAMPING + k]) / length
        if p > target:
            r[HIGH + k], r[HIGH_PRESSURE + k] = x, p
        else:
            r[LOW + k], r[LOW_PRESSURE + k] = x, p
        low, low_p, high, high_p = r[LOW + k], r[LOW_PRESSURE + k], r[HIGH + k], r[HIGH_PRESSURE + k]
        if low < high < math.inf:
            found = low + (high - low) * (target - low_p) / (high_p - low_p)
            if low_p > 0:
                bend = (low / low_p - high / high_p) / (high - low)
                room = 1 + bend * target
                found = (low / low_p + bend * low) * target / room if room > 0 else found
            r[ASKED + k] = r[LIFT + k] - min(max(found, low), high)


@njit(**PASS)
def _rub(t, g, r, count):
    """Let law ``g`` answer with the shear that the whole normal force allows; the normal traction is that force's.

    Where its pressure is not met but passed, the dashpot takes away less: the shear never passes its limit.
    """
    trial, rows = MEMORY + t.memory.shape[0] * ROW, t.memory.shape[0] * ROW
    exchange.copy(r, MEMORY, trial, rows)
    _answer(t, g, r, count, ASKED, MEMORY)
    for _ in range(ROUNDS):
        if missed(r, count) == 0:
            break
        narrow(r, count)
        exchange.copy(r, trial, MEMORY, rows)
        _answer(t, g, r, count, ASKED, MEMORY)
    for k in range(count):
        length, spring = r[LENGTH + k], r[SPRING + k]
        whole = min(spring + r[DAMPING + k], r[NORMAL + k] * length)
        r[DAMPING + k] = whole - spring
        r[NORMAL + k] = whole / max(length, 1e-300) if length > 0 else r[NORMAL + k]


@njit(**PASS)
def tractions(t, g, r, count, time_step):
    """What law ``g`` answers, and the dashpots: with them it is asked on trial first, for the force of the spring."""
    if t.damping > 0:
        trial = MEMORY + t.memory.shape[0] * ROW
        exchange.copy(r, MEMORY, trial, t.memory.shape[0] * ROW)
        _answer(t, g, r, count, OPENING, trial)
        dashpots(r, count, time_step)
        _rub(t, g, r, count)
    else:
        _answer(t, g, r, count, OPENING, MEMORY)
        springs(r, count)


@njit(**PASS)
def forces(r, count):
    """Forces of contacts, Eq. (15), and their work by the trapezoidal rule, Eq. (12)."""
    for k in range(count):
        normal, damping, opened = r[SPRING + k], r[DAMPING + k], r[OPENED + k]
        shear = r[SHEAR + k] * r[LENGTH + k]
        # Eq. (15): the force on A, shared between nodes by the lever rule; its distance from the edges as a couple.
        ax, ay, bx, by, tx, ty = r[AX + k], r[AY + k], r[BX + k], r[BY + k], r[TX + k], r[TY + k]
        push, turn, share_a, share_b = normal + damping, r[TWIST + k] * normal, r[SHARE_A + k], r[SHARE_B + k]
        fx, fy = push * ty + shear * tx, shear * ty - push * tx  # on A; the reverse acts on B
        qa = (r[LEVER_A + k] * (ax * fx + ay * fy) + turn) / (ax * ax + ay * ay)
        qb = (r[LEVER_B + k] * (bx * fx + by * fy) - turn) / (bx * bx + by * by)
        gx, gy = share_a * fx - qa * ay, share_a * fy + qa * ax
        hx, hy = -share_b * fx - qb * by, qb * bx - share_b * fy
        # Eq. (12): the work of all nodal forces, and of it that in slip and on the dashpot.
        total = (r[FX + k] + fx) * r[DWX + k] + (r[FY + k] + fy) * r[DWY + k]
        total -= (r[GX + k] + gx) * r[DAX + k] + (r[GY + k] + gy) * r[DAY + k]
        total -= (r[HX + k] + hx) * r[DBX + k] + (r[HY + k] + hy) * r[DBY + k]
        in_slip = 0.5 * (r[SHEAR_FORCE + k] + shear) * r[SLID + k]
        on_dashpot = 0.5 * (r[DAMPING_FORCE + k] + damping) * opened
        r[OPENING_WORK + k] = 0.5 * total - in_slip - on_dashpot
        r[SLIP_WORK + k], r[DAMPING_WORK + k], r[DAMPING_FORCE + k] = in_slip, on_dashpot, damping
        r[FX + k], r[FY + k], r[GX + k], r[GY + k], r[HX + k], r[HY + k] = fx, fy, gx, gy, hx, hy


@njit(**PASS)
def _settle(t, g, r, contact, count, row):
    """What becomes of contacts that are not closed: all but offset and lift is reset; returns how many are too deep."""
    deep = 0
    for k in range(count):
        if r[LENGTH + k] > 0:
            r[STATE + k] = CLOSED
            deep += r[OVERLAP + k] > r[LARGEST + k]
            continue
        deep += r[TOUCH + k] == geometry.FAR and t.overlap[contact[k]] > 0.5 * r[LARGEST + k]
        state, offset, lift = geometry.settle(r, k)
        r[STATE + k], r[OFFSET + k] = state, offset
        r[SLIP + k], r[NORMAL + k], r[SHEAR + k] = 0.0, 0.0, 0.0
        for m in range(t.memory.shape[0]):
            r[MEMORY + m * ROW + k] = t.virgin[m, g]
        if lift > 0:
            r[MEMORY + row * ROW + k] = lift
    return deep


@njit(**PASS)
def _chunk(t, g, r, time_step, first, count, contact):
    """All passes for followed contacts ``first`` to ``first + count`` of the list; returns how many are too deep."""
    row, filled = t.laws.dilation[g], contact.shape[0]
    exchange.fill(t.active, first, count, contact)
    exchange.take_from_table(t, r, contact, row)
    geometry.arrangements(r, filled, t.skin)
    geometry.overlaps(r, filled)
    geometry.close(r, filled)
    geometry.motions(r, filled)
    slips(r, filled, t.compliance[g])
    tractions(t, g, r, filled, time_step)
    forces(r, filled)
    deep = _settle(t, g, r, contact, count, row)
    exchange.put_into_table(t, r, contact, count)
    return deep


@njit(**PASS)
def contact_step(t, time_step, thread):
    """Geometry, law and forces of a thread's contacts, law by law; tells its tally what it found."""
    first, last = t.share[thread], t.share[thread + 1]
    deep, listed = 0, first
    for g in range(t.laws.address.shape[0]):
        begin = listed
        listed = geometry.list_followed(
            t, t.rows[thread], t.chunk[thread], max(first, t.laws.first[g]), min(last, t.laws.last[g]), listed
        )
        for k in range(begin, listed, BLOCK):
            count = min(listed - k, BLOCK)
            filled = (count + LANES - 1) // LANES * LANES
            deep += _chunk(t, g, t.rows[thread], time_step, k, count, t.chunk[thread, :filled])
    t.tally[thread, DEEP], t.tally[thread, ACTIVE] = deep, listed - first


@njit(**PASS)
def gather_contact_forces(t, nodes, thread):
    """Add the forces of all threads' contacts to a thread's nodes, in a fixed order."""
    first, last, fx, fy = t.used_share[thread], t.used_share[thread + 1], nodes.force[0], nodes.force[1]
    for other in range(t.tally.shape[0] if first < last else 0):
        for c in t.active[t.share[other] : t.share[other] + t.tally[other, ACTIVE]]:
            px, py, jx, jy = t.force_x[0, c], t.force_y[0, c], t.force_x[1, c], t.force_y[1, c]
            kx, ky = t.force_x[2, c], t.force_y[2, c]
            i, j, k, m = t.node[0, c], t.node[1, c], t.node[2, c], t.node[3, c]
            if first <= i < last:
                fx[t.used[i]] += px - jx
                fy[t.used[i]] += py - jy
            if first <= j < last:
                fx[t.used[j]] += jx
                fy[t.used[j]] += jy
            if first <= k < last:
                fx[t.used[k]] += kx
                fy[t.used[k]] += ky
            if first <= m < last:
                fx[t.used[m]] -= px + kx
                fy[t.used[m]] -= py + ky


@njit(**PASS)
def gather_at_node(t, nodes, place):
    """Add the forces of contacts to one node in use, in the same order: where threads outnumber contacts."""
    node = t.used[place]
    x, y = nodes.force[0, node], nodes.force[1, node]
    for corner in t.corner[t.first[place] : t.first[place + 1]]:
        c, which = corner // 4, corner % 4
        if t.follow[c] == 0:
            continue
        if which == 0:
            x += t.force_x[0, c] - t.force_x[1, c]
            y += t.force_y[0, c] - t.force_y[1, c]
        elif which == 3:
            x -= t.force_x[0, c] + t.force_x[2, c]
            y -= t.force_y[0, c] + t.force_y[2, c]
        else:
            x += t.force_x[which, c]
            y += t.force_y[which, c]
    nodes.force[0, node], nodes.force[1, node] = x, y


@njit(**PASS)
def follow_nodes(t, nodes, thread):
    """Take over where a thread's nodes in use have moved, and count those that have moved far since the last search."""
    ux, uy, count = nodes.displacement[0], nodes.displacement[1], 0
    for k in range(t.used_share[thread], t.used_share[thread + 1]):
        i = t.used[k]
        x, y, room = ux[i], uy[i], t.room[k]
        t.increment[0, k], t.increment[1, k] = x - t.displacement[0, k], y - t.displacement[1, k]
        t.displacement[0, k], t.displacement[1, k] = x, y
        t.place[0, k], t.place[1, k] = t.origin[0, k] + x, t.origin[1, k] + y
        x, y = x - t.searched[0, k], y - t.searched[1, k]
        count += x * x + y * y > room * room
    t.tally[thread, MOVED] = count


@njit(**PASS)
def _press(t, g, r, count, begin):
    """Let law ``g`` answer on trial with the offsets in the rows that ``begin``."""
    trial = MEMORY + t.memory.shape[0] * ROW
    exchange.copy(r, begin, OFFSET, count)
    geometry.overlaps(r, count)
    for k in range(count):
        r[OPENING + k] = r[LIFT + k] - r[OVERLAP + k] if r[LENGTH + k] > 0 else 0.0
    exchange.copy(r, MEMORY, trial, trial - MEMORY)
    _answer(t, g, r, count, OPENING, trial)


class Beginning(NamedTuple):
    """What at most ``BLOCK`` new contacts (c,) of one law take over from bonds."""

    group: int  #: number of the law
    place: np.ndarray  #: (2, k) m, of the nodes in use, where the forces belong
    contact: np.ndarray  #: (c,) int32, places in the table
    force: np.ndarray  #: (2, 4, c) N, on the nodes
    slip: np.ndarray  #: (c,) m
    memory: np.ndarray  #: (m, c)


def _take_over(t, beginning):
    """Let new contacts begin with the forces, slip and memory of bonds.

    Bisection finds the offset for which the normal force along the contact's own normal is the same, and Newton's
    method the slip for which the shear force is. Called from Python with tables in memory, while no thread does steps.
    """
    t, beginning = t[0], beginning[0]
    g, r, contact = beginning.group, t.rows[0], beginning.contact
    force, slip, memory = beginning.force, beginning.slip, beginning.memory
    count, row, trial = contact.shape[0], t.laws.dilation[g], MEMORY + t.memory.shape[0] * ROW
    geometry.gather_edges(t, beginning.place, r, contact)
    geometry.gather_angles(t, r, contact)
    for k in range(count):
        most = 4 * t.largest_overlap[contact[k]]
        r[LARGEST + k], r[SLIP + k], r[LOW + k], r[HIGH + k] = math.inf, slip[k], -most, most
        r[FX + k], r[FY + k] = force[0, 0, k] + force[0, 1, k], force[1, 0, k] + force[1, 1, k]
        for m in range(memory.shape[0]):
            r[MEMORY + m * ROW + k] = memory[m, k]
        r[LIFT + k] = memory[row, k] if row >= 0 else 0.0
    for _ in range(HALVINGS):
        for k in range(count):
            r[ASKED + k] = 0.5 * (r[LOW + k] + r[HIGH + k])
        _press(t, g, r, count, ASKED)
        for k in range(count):
            normal = r[FX + k] * r[TY + k] - r[FY + k] * r[TX + k]
            if r[LENGTH + k] > 0 and min(r[NORMAL + k], 0.0) * r[LENGTH + k] <= normal:
                r[LOW + k] = r[ASKED + k]
            else:
                r[HIGH + k] = r[ASKED + k]
    _press(t, g, r, count, LOW)
    for _ in range(REFINED):
        for k in range(count):
            shear = r[FX + k] * r[TX + k] + r[FY + k] * r[TY + k]
            target = shear / r[LENGTH + k] if r[LENGTH + k] > 0 else 0.0
            r[SLIP + k] += (target - r[SHEAR + k]) * t.compliance[g]
        exchange.copy(r, MEMORY, trial, trial - MEMORY)
        _answer(t, g, r, count, OPENING, trial)
    _answer(t, g, r, count, OPENING, MEMORY)
    for k in range(count):
        c, lift = contact[k], r[MEMORY + row * ROW + k] if row >= 0 else 0.0
        normal = r[FX + k] * r[TY + k] - r[FY + k] * r[TX + k]
        if row >= 0:  # also for faces that do not touch at this moment
            t.memory[row, c] = lift
        if not (r[LENGTH + k] > 0 and normal < 0):
            t.offset[c] = max(r[HIGH + k], 0.0) if normal >= 0 else t.offset[c]
            t.state[c] = HELD if t.offset[c] > 0 or lift > 0 else WAITING
            continue
        t.state[c], t.opening[c], t.offset[c], t.overlap[c] = CLOSED, r[OPENING + k], r[OFFSET + k], r[OVERLAP + k]
        t.length[c], t.tangent_x[c], t.tangent_y[c] = r[LENGTH + k], r[TX + k], r[TY + k]
        t.share_a[c], t.slip[c], t.normal[c], t.shear[c] = r[SHARE_A + k], r[SLIP + k], r[NORMAL + k], r[SHEAR + k]
        t.force_x[0, c], t.force_x[1, c], t.force_x[2, c] = r[FX + k], force[0, 1, k], force[0, 2, k]
        t.force_y[0, c], t.force_y[1, c], t.force_y[2, c] = r[FY + k], force[1, 1, k], force[1, 2, k]
        for m in range(memory.shape[0]):
            t.memory[m, c] = r[MEMORY + m * ROW + k]


take_over = Kernel(_take_over)
