"""The time loop: N steps compiled once for every law, integrator and number of threads."""

from __future__ import annotations

import functools
import threading
from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.calls import call, respond, unbonded
from grainlaw.compiler.entry import compiled
from grainlaw.engine import barrier, passes, touch

BLOCK = 4096  #: zones, or interfaces, that go through their passes together: their scratch stays in the cache


class Mesh(NamedTuple):
    """Nodes (i) and zones (z)."""

    displacement: np.ndarray  #: (2, i) m
    force: np.ndarray  #: (2, i) N, of zones and contacts, left standing after each step
    slots: np.ndarray  #: (2, i) places of a node's interface ends in the contact force rows; the last place is zero
    corner: np.ndarray  #: (3, z) node numbers, counter-clockwise
    shape: np.ndarray  #: (5, z) shape function gradients b1, b2, c1, c2 (1/m) and area (m2)
    modulus: np.ndarray  #: (3, z) elastic constants (Pa)
    motion: np.ndarray  #: (4, z) scratch
    pull: np.ndarray  #: (4, z) scratch


class Contacts(NamedTuple):
    """Interfaces (c) and their contact points (p): the first points of all interfaces, then the second."""

    node: np.ndarray  #: (4, c) ends of the edge of grain A, then the same ends on grain B
    edge: np.ndarray  #: (2, c) vector of the undeformed edge (m)
    half: np.ndarray  #: (c,) half length (m)
    weight: np.ndarray  #: (c,) share of the far end in the motion at a contact point
    reach: np.ndarray  #: (c,) m2, square of the motion of an end from which on the interface is handed over once broken
    leaving: np.ndarray  #: (c,) 1 where it is to be handed over now
    gap: np.ndarray  #: (6, c) scratch
    frame: np.ndarray  #: (3, c) normal and inverse length
    opening: np.ndarray  #: (2, p) m, at this and the previous step in turn
    slip: np.ndarray  #: (2, p) m
    normal: np.ndarray  #: (2, p) Pa
    shear: np.ndarray  #: (2, p) Pa
    work: np.ndarray  #: (2, p) J/m2 done in opening and in slip
    force: np.ndarray  #: (2, 4 c + 1) forces on the four nodes of each interface, and a zero


class Freedoms(NamedTuple):
    """What is integrated: rows (r) of nodes or rigid grains (n)."""

    force: np.ndarray  #: (r, n)
    velocity: np.ndarray  #: (r, n)
    displacement: np.ndarray  #: (r, n)
    mass: np.ndarray  #: (r, n)
    free: np.ndarray  #: (r, n) 1, or 0 where the velocity is imposed
    imposed: np.ndarray  #: (r, n) velocity of driven freedoms
    weight: np.ndarray  #: (r, n) N, of gravity
    loss: np.ndarray  #: (r, n) J, taken by damping


class Driven(NamedTuple):
    """Freedoms (d) whose velocity is imposed."""

    row: np.ndarray  #: (d,)
    place: np.ndarray  #: (d,) node or grain
    column: np.ndarray  #: (d,) which velocity of the schedule
    reaction: np.ndarray  #: (d,) N, of the last step
    total: np.ndarray  #: (d,) N, summed over steps
    work: np.ndarray  #: (d,) J


class Held(NamedTuple):
    """Boundaries (k) that move as one body under a force: platens."""

    column: np.ndarray  #: (k,) which force of the schedule, and which velocity of the driven freedoms
    stiffness: np.ndarray  #: (k,) N/m of a spring that pulls back to where the stage began
    motion: np.ndarray  #: (threads, 7, k) what the integrator needs, a copy for each thread: rows of ``Freedoms``


class Pressed(NamedTuple):
    """Edges (e) of grains under a pressure that stays normal to them as they move."""

    column: np.ndarray  #: (e,) which pressure of the schedule
    node: np.ndarray  #: (2, e) ends, counter-clockwise round the grain
    edge: np.ndarray  #: (2, e) undeformed, from the first end to the second (m)
    force: np.ndarray  #: (2, e) N, of the last step
    moved: np.ndarray  #: (2, e) displacement of the middle at the last step (m)
    work: np.ndarray  #: (e,) J


class Rigid(NamedTuple):
    """Corners of rigid grains; ``grains`` 0 says that grains deform."""

    grains: int
    first: np.ndarray  #: (g + 1,) first node of each grain
    arm: np.ndarray  #: (2, i) m from the grain's centroid, undeformed


class Parts(NamedTuple):
    """What a thread works on: (threads + 1,) bounds of each."""

    zone: np.ndarray
    node: np.ndarray
    interface: np.ndarray
    freedom: np.ndarray
    driven: np.ndarray
    pressed: np.ndarray
    grain: np.ndarray
    touch: np.ndarray
    touched: np.ndarray


@njit(**OPTIONS)
def _zones(mesh, first, last):
    """Forces of zones ``first`` to ``last``, block by block: what passes hand on stays in the cache."""
    ux, uy, fx, fy = mesh.displacement[0], mesh.displacement[1], mesh.force[0], mesh.force[1]
    for z in range(first, last, BLOCK):
        e = min(z + BLOCK, last)
        s = first + e - z  # every block uses the scratch rows from ``first`` on
        n0, n1, n2 = mesh.corner[0, z:e], mesh.corner[1, z:e], mesh.corner[2, z:e]
        x1, y1 = mesh.motion[0, first:s], mesh.motion[1, first:s]
        x2, y2 = mesh.motion[2, first:s], mesh.motion[3, first:s]
        p1, r1 = mesh.pull[0, first:s], mesh.pull[1, first:s]
        p2, r2 = mesh.pull[2, first:s], mesh.pull[3, first:s]
        passes.gather_zones(ux, uy, n0, n1, n2, x1, y1, x2, y2)
        passes.zone_forces(
            x1, y1, x2, y2, mesh.shape[0, z:e], mesh.shape[1, z:e], mesh.shape[2, z:e], mesh.shape[3, z:e],
            mesh.shape[4, z:e], mesh.modulus[0, z:e], mesh.modulus[1, z:e], mesh.modulus[2, z:e], p1, r1, p2, r2,
        )  # fmt: skip
        passes.scatter_zones(fx, fy, n0, n1, n2, p1, r1, p2, r2)


@njit(**OPTIONS)
def _leave(contacts, group, g, first, last, d1x, d1y, d2x, d2y):
    """Mark interfaces that have moved apart and have nothing left that bonds them; returns how many."""
    count, leaving = contacts.half.shape[0], 0
    for c in range(first, last):
        k = c - first
        if max(d1x[k] ** 2 + d1y[k] ** 2, d2x[k] ** 2 + d2y[k] ** 2) > contacts.reach[c]:
            if unbonded(group, g, c) and unbonded(group, g + 1, count + c):
                contacts.leaving[c] = 1
                leaving += 1
    return leaving


@njit(**OPTIONS)
def _group(mesh, contacts, group, g, new, old, first, last):
    """Interfaces ``first`` to ``last`` of one law; returns how many are to be handed over."""
    count, leaving = contacts.half.shape[0], 0
    ux, uy = mesh.displacement[0], mesh.displacement[1]
    cx, cy = contacts.force[0], contacts.force[1]
    opening, slip, normal, shear = contacts.opening[new], contacts.slip[new], contacts.normal[new], contacts.shear[new]
    o_old, s_old, n_old, t_old = contacts.opening[old], contacts.slip[old], contacts.normal[old], contacts.shear[old]
    o_work, s_work = contacts.work[0], contacts.work[1]
    addresses = opening.ctypes.data, slip.ctypes.data, normal.ctypes.data, shear.ctypes.data
    for c in range(first, last, BLOCK):
        e = min(c + BLOCK, last)
        s = first + e - c
        k, m = count + c, count + e  # the second points of these interfaces
        d1x, d1y, d2x = contacts.gap[0, first:s], contacts.gap[1, first:s], contacts.gap[2, first:s]
        d2y, ex, ey = contacts.gap[3, first:s], contacts.gap[4, first:s], contacts.gap[5, first:s]
        nx, ny, inverse = contacts.frame[0, first:s], contacts.frame[1, first:s], contacts.frame[2, first:s]
        weight = contacts.weight[c:e]
        o1, o2, s1, s2 = opening[c:e], opening[k:m], slip[c:e], slip[k:m]
        passes.gather_contacts(
            ux, uy, contacts.node[0, c:e], contacts.node[1, c:e], contacts.node[2, c:e], contacts.node[3, c:e],
            d1x, d1y, d2x, d2y, ex, ey,
        )  # fmt: skip
        passes.contact_kinematics(
            d1x, d1y, d2x, d2y, ex, ey, contacts.edge[0, c:e], contacts.edge[1, c:e], weight, nx, ny, inverse,
            o1, o2, s1, s2,
        )  # fmt: skip
        respond(group, g, c, e, *addresses)
        respond(group, g + 1, k, m, *addresses)
        if passes.moved_apart(d1x, d1y, d2x, d2y, contacts.reach[c:e]) > 0:
            leaving += _leave(contacts, group, g, c, e, d1x, d1y, d2x, d2y)
        n1, n2, t1, t2 = normal[c:e], normal[k:m], shear[c:e], shear[k:m]
        passes.contact_work(o1, o_old[c:e], n1, n_old[c:e], o_work[c:e])
        passes.contact_work(o2, o_old[k:m], n2, n_old[k:m], o_work[k:m])
        passes.contact_work(s1, s_old[c:e], t1, t_old[c:e], s_work[c:e])
        passes.contact_work(s2, s_old[k:m], t2, t_old[k:m], s_work[k:m])
        passes.contact_forces(
            nx, ny, inverse, contacts.half[c:e], weight, n1, t1, n2, t2, o1, o2, s1, s2,
            cx[c:e], cx[k:m], cx[count + k : count + m], cx[2 * count + k : 2 * count + m],
            cy[c:e], cy[k:m], cy[count + k : count + m], cy[2 * count + k : 2 * count + m],
        )  # fmt: skip
    return leaving


@njit(**OPTIONS)
def _interfaces(mesh, contacts, group, new, old, first, last):
    """Kinematics, tractions, work and forces of interfaces ``first`` to ``last``, law by law, block by block.

    Returns how many are to be handed over.
    """
    leaving = 0
    for g in range(0, group.shape[0], 2):  # a row for the first points of its interfaces, one for the second
        leaving += _group(mesh, contacts, group, g, new, old, max(first, group[g, 6]), min(last, group[g, 7]))
    return leaving


@njit(**OPTIONS)
def _hold(held, motion, schedule, rate, freedoms, driven, integrator, parameters):
    """Move platens under their forces by one step; every thread does it, alike, for itself.

    A platen has the mass of the freedoms it holds, and is integrated like them.
    """
    for k in range(held.column.shape[0]):
        force = schedule[held.column[k]] - held.stiffness[k] * motion[2, k]
        for d in range(driven.row.shape[0]):
            if driven.column[d] == held.column[k]:
                force += freedoms.force[driven.row[d], driven.place[d]]
        motion[0, k] = force
    rows = motion.ctypes.data
    size = 8 * motion.shape[1]
    call(
        integrator,
        (
            parameters, rows, rows + size, rows + 2 * size, rows + 3 * size, rows + 4 * size, rows + 5 * size,
            rows + 6 * size, motion.shape[1],
        ),
    )  # fmt: skip
    for k in range(held.column.shape[0]):
        rate[held.column[k]] = motion[1, k]


def _steps(
    thread, threads, meeting, pause, steps, now, time_step, mesh, contacts, group, freedoms, driven, held, pressed,
    schedule, rigid, parts, integrator, parameters, touching, touch_group, weighed,
):  # fmt: skip
    """Returns how many steps were done: fewer where contacts change hands, must be searched anew, or are too deep."""
    # A thread works on the zones and nodes of its grains, on its interfaces, and on its freedoms.
    i0, i1 = parts.node[thread], parts.node[thread + 1]
    f0, f1 = parts.freedom[thread], parts.freedom[thread + 1]
    d0, d1 = parts.driven[thread], parts.driven[thread + 1]
    e0, e1 = parts.pressed[thread], parts.pressed[thread + 1]
    g0, g1 = parts.grain[thread], parts.grain[thread + 1]
    c0, c1 = parts.touch[thread], parts.touch[thread + 1]
    t0, t1 = parts.touched[thread], parts.touched[thread + 1]
    searching = touching.built.shape[1] > 0
    ux, uy = mesh.displacement[0], mesh.displacement[1]
    fx, fy = mesh.force[0], mesh.force[1]
    my_fx, my_fy = fx[i0:i1], fy[i0:i1]
    cx, cy = contacts.force[0], contacts.force[1]
    slot1, slot2 = mesh.slots[0, i0:i1], mesh.slots[1, i0:i1]
    rate = np.empty(schedule.shape[1])
    for step in range(steps):
        new, old = (now + step) % 2, (now + step + 1) % 2
        my_fx[:] = 0.0
        my_fy[:] = 0.0
        if rigid.grains == 0:
            _zones(mesh, parts.zone[thread], parts.zone[thread + 1])
        leaving = _interfaces(mesh, contacts, group, new, old, parts.interface[thread], parts.interface[thread + 1])
        deep = 0
        if searching:
            touching.tally[thread, 3] = leaving
        if c0 < c1:
            deep, touching.tally[thread, 2] = touch.touch(touching, touch_group, time_step, c0, c1)
        barrier.wait(meeting, threads, pause)
        if searching:
            leaving = 0
            for other in range(threads):
                leaving += touching.tally[other, 3]
        passes.gather_forces(slot1, slot2, cx, cy, my_fx, my_fy)
        if t0 < t1:
            touch.gather_touching(touching, parts.touch, fx, fy, t0, t1)
        if e0 < e1:
            passes.press(
                schedule[step], pressed.column[e0:e1], pressed.node[0, e0:e1], pressed.node[1, e0:e1],
                pressed.edge[0, e0:e1], pressed.edge[1, e0:e1], ux, uy, fx, fy, pressed.force[0, e0:e1],
                pressed.force[1, e0:e1], pressed.moved[0, e0:e1], pressed.moved[1, e0:e1], pressed.work[e0:e1],
            )  # fmt: skip
        if rigid.grains > 0:
            passes.grain_forces(
                rigid.first, rigid.arm[0], rigid.arm[1], freedoms.displacement[2], fx, fy,
                freedoms.force[0], freedoms.force[1], freedoms.force[2], g0, g1,
            )  # fmt: skip
        if weighed:
            for row in range(freedoms.force.shape[0]):
                freedoms.force[row, f0:f1] += freedoms.weight[row, f0:f1]
        rate[:] = schedule[step]
        if held.column.shape[0] > 0:
            barrier.wait(meeting, threads, pause)  # forces on all of a platen's freedoms
            _hold(held, held.motion[thread], schedule[step], rate, freedoms, driven, integrator, parameters)
        passes.impose(
            rate, driven.row[d0:d1], driven.place[d0:d1], driven.column[d0:d1], time_step,
            freedoms.force, freedoms.velocity, freedoms.mass, freedoms.imposed,
            driven.reaction[d0:d1], driven.total[d0:d1], driven.work[d0:d1],
        )  # fmt: skip
        if searching and (step == steps - 1 or leaving > 0):
            touching.before[0, i0:i1] = ux[i0:i1]
            touching.before[1, i0:i1] = uy[i0:i1]
        for row in range(freedoms.force.shape[0]):
            offset = 8 * f0
            call(
                integrator,
                (
                    parameters, freedoms.force[row].ctypes.data + offset, freedoms.velocity[row].ctypes.data + offset,
                    freedoms.displacement[row].ctypes.data + offset, freedoms.mass[row].ctypes.data + offset,
                    freedoms.free[row].ctypes.data + offset, freedoms.imposed[row].ctypes.data + offset,
                    freedoms.loss[row].ctypes.data + offset, f1 - f0,
                ),
            )  # fmt: skip
        if rigid.grains > 0:
            passes.place_nodes(
                rigid.first, rigid.arm[0], rigid.arm[1], freedoms.displacement[2],
                freedoms.displacement[0], freedoms.displacement[1], ux, uy, g0, g1,
            )  # fmt: skip
        if t0 < t1:
            touch.follow(touching, ux, uy, t0, t1)
        if searching:
            touching.tally[thread, 0] = touch.moved_far(
                ux[i0:i1], uy[i0:i1], touching.built[0, i0:i1], touching.built[1, i0:i1], touching.reach
            )
            touching.tally[thread, 1] = deep
        barrier.wait(meeting, threads, pause)
        if searching:  # all threads read the same: the next barrier comes before anything is written
            stop = leaving
            for other in range(threads):
                stop += touching.tally[other, 0] + touching.tally[other, 1]
            if stop > 0:
                return step + 1
    return steps


def _zone_state(mesh, displacement, rows):
    x1, y1, x2, y2 = mesh.motion[0], mesh.motion[1], mesh.motion[2], mesh.motion[3]
    passes.gather_zones(
        displacement[0], displacement[1], mesh.corner[0], mesh.corner[1], mesh.corner[2], x1, y1, x2, y2
    )
    passes.zone_state(
        x1, y1, x2, y2, mesh.shape[0], mesh.shape[1], mesh.shape[2], mesh.shape[3],
        mesh.modulus[0], mesh.modulus[1], mesh.modulus[2], rows[0], rows[1], rows[2], rows[3],
    )  # fmt: skip


def zone_state(mesh: Mesh, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Stress (z, 3) Pa as xx, yy, xy in the fixed axes, and strain energy density (z,) J/m3, at (2, i) m."""
    rows = np.empty((4, mesh.corner.shape[1]))
    compiled(_zone_state)(mesh, displacement, rows)
    return rows[:3].T, rows[3]


_pause = functools.cache(barrier.pause_address)


def run(
    threads: int, steps: int, now: int, time_step: float, mesh: Mesh, contacts: Contacts, group: np.ndarray,
    freedoms: Freedoms, driven: Driven, held: Held, pressed: Pressed, schedule: np.ndarray, rigid: Rigid, parts: Parts,
    integrator: int, parameters: int, touching: touch.Touching, touch_group: np.ndarray, weighed: bool,
) -> int:  # fmt: skip
    """Advance by a chunk of steps in ``threads`` threads; the result is the same bit for bit for any number.

    ``group`` and ``touch_group`` are the tables of laws, ``integrator`` and ``parameters`` are addresses. The
    interpreter lock is released meanwhile. Returns how many steps were done: fewer where something has moved so far
    that contacts must be searched anew, or where they overlap too much (``touching.tally``).
    """
    loop = compiled(_steps)
    meeting = np.zeros(barrier.SIZE, dtype=np.int64)
    own = held._replace(motion=np.repeat(held.motion, threads, axis=0))
    arguments = (
        threads, meeting, _pause(), steps, now, time_step, mesh, contacts, group, freedoms, driven, own, pressed,
        schedule, rigid, parts, integrator, parameters, touching, touch_group, weighed,
    )  # fmt: skip
    helpers = [threading.Thread(target=loop, args=(thread, *arguments)) for thread in range(1, threads)]
    for helper in helpers:
        helper.start()
    done: int = loop(0, *arguments)
    for helper in helpers:
        helper.join()
    held.motion[:] = own.motion[:1]
    return done
