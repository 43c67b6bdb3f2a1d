"""The passes over contacts, pairs of edges without a bond: law, forces, work, and who gathers what.

Index letters: ``c`` contact, ``i`` node, ``k`` place in the list of nodes in use. ``t`` is the table of contacts
(:class:`~grainlaw.engine.parts.contact_table.ContactArrays`). Equation numbers are those of docs/theory.md.
"""

import math

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.numba_private import call
from grainlaw.engine.parts.contact_geometry import both_edges, contact_geometry
from grainlaw.engine.parts.laws import LANES

u32 = np.uint32
BLOCK = 512  #: contacts that go through geometry, law and forces together; a multiple of ``LANES``
MOVED, DEEP, ACTIVE, LEAVING = range(4)  #: columns of the tally of each thread
OPENING, SLIP, NORMAL, SHEAR, MEMORY = range(5)  #: rows of the scratch by which laws answer; the memory is the last


@njit(**OPTIONS)
def contact_forces(t, time_step, first, last, row):
    """Nodal forces of active contacts, Eq. (15), and their work by the trapezoidal rule, Eq. (12).

    A dashpot resists the closing of lifted faces, and not their lifting.
    """
    vx, vy = t.increment[0], t.increment[1]
    for c in t.active[first:last]:
        length = t.length[c]
        i, j, k, m = u32(t.node[0, c]), u32(t.node[1, c]), u32(t.node[2, c]), u32(t.node[3, c])
        tx, ty, xa, xb = t.tangent_x[c], t.tangent_y[c], t.share_a[c], t.share_b[c]
        normal, shear = min(t.normal[c], 0.0) * length, t.shear[c] * length
        damping, opened = 0.0, 0.0
        if length > 0:
            lifted = t.memory[row, c] - t.opening[c] - t.overlap[c] if row >= 0 else 0.0  # in this step
            opened = t.opened[c] - lifted
            if t.dashpot[c] > 0:
                stiffness = max(-normal / max(t.overlap[c] + lifted, 1e-300), 0.0)
                damping = min(t.dashpot[c] * math.sqrt(stiffness) * opened / time_step, -normal)  # never pulls
        # Eq. (15): the force on A, shared between nodes by the lever rule; its distance from the edges as a couple.
        push = normal + damping
        px, py = push * ty + shear * tx, shear * ty - push * tx  # on A; the reverse acts on B
        ax, ay, bx, by, _, _ = both_edges(t.node, t.place, c)
        twist = t.twist[c] * normal
        qa = (t.lever_a[c] * (ax * px + ay * py) + twist) / (ax * ax + ay * ay)
        qb = (t.lever_b[c] * (bx * px + by * py) - twist) / (bx * bx + by * by)
        fx = (1 - xa) * px + qa * ay, xa * px - qa * ay, qb * (-by) - xb * px, (xb - 1) * px + qb * by
        fy = (1 - xa) * py - qa * ax, xa * py + qa * ax, qb * bx - xb * py, (xb - 1) * py - qb * bx
        # Eq. (12): the work of all nodal forces, and of it that in slip and on the dashpot.
        total = 0.0
        for n, node in enumerate((i, j, k, m)):
            total -= (t.force_x[n, c] + fx[n]) * vx[node] + (t.force_y[n, c] + fy[n]) * vy[node]
            t.force_x[n, c] = fx[n]
            t.force_y[n, c] = fy[n]
        in_slip = 0.5 * (t.shear_force[c] + shear) * (t.slid[c] if length > 0 else 0.0)
        on_dashpot = 0.5 * (t.damping_force[c] + damping) * opened
        t.opening_work[c] += 0.5 * total - in_slip - on_dashpot
        t.slip_work[c] += in_slip
        t.damping_work[c] += on_dashpot
        t.normal_force[c] = normal
        t.shear_force[c] = shear
        t.damping_force[c] = damping


@njit(**OPTIONS)
def _answer(t, g, first, last, rows):
    """Let law ``g`` answer for active contacts; scratch ``rows`` take what goes in and out.

    They fill whole vectors of its code: how a contact is rounded does not depend on its place in the table. The law has
    no parameters of single contacts.
    """
    count, depth, size = last - first, t.memory.shape[0], 8 * rows.shape[1]
    for k in range(count):
        c = t.active[first + k]
        rows[OPENING, k], rows[SLIP, k] = t.opening[c], t.slip[c]
        for n in range(depth):
            rows[MEMORY + n, k] = t.memory[n, c]
    start = rows.ctypes.data
    call(
        t.laws.address[g],
        (
            t.laws.numbers[g], t.laws.numbers[g], 0, start + MEMORY * size, rows.shape[1],
            start + OPENING * size, start + SLIP * size, start + NORMAL * size, start + SHEAR * size,
            (count + LANES - 1) // LANES * LANES,
        ),
    )  # fmt: skip
    for k in range(count):
        c = t.active[first + k]
        t.normal[c], t.shear[c] = rows[NORMAL, k], rows[SHEAR, k]
        for n in range(depth):
            t.memory[n, c] = rows[MEMORY + n, k]


@njit(**OPTIONS)
def contact_step(t, time_step, thread):
    """Geometry, law and forces of a thread's contacts, law by law; tells its tally what it found."""
    first, last = t.share[thread], t.share[thread + 1]
    deep, listed = 0, first
    rows = np.zeros((MEMORY + t.memory.shape[0], BLOCK if first < last else 0))
    for g in range(t.laws.address.shape[0]):
        final = min(last, t.laws.last[g])
        for begin in range(max(first, t.laws.first[g]), final, BLOCK):
            before = listed
            listed, too_deep = contact_geometry(g, t, begin, min(begin + BLOCK, final), listed, t.laws.dilation[g])
            deep += too_deep
            if listed > before:
                _answer(t, g, before, listed, rows)
                contact_forces(t, time_step, before, listed, t.laws.dilation[g])
    t.tally[thread, DEEP], t.tally[thread, ACTIVE] = deep, listed - first


@njit(**OPTIONS)
def gather_contact_forces(t, nodes, thread):
    """Add the forces of all threads' contacts to a thread's nodes, in a fixed order."""
    first, last, fx, fy = t.used_share[thread], t.used_share[thread + 1], nodes.force[0], nodes.force[1]
    for other in range(t.tally.shape[0] if first < last else 0):
        for c in t.active[t.share[other] : t.share[other] + t.tally[other, ACTIVE]]:
            for n in range(4):
                k = t.node[n, c]
                if first <= k < last:
                    i = t.used[k]
                    fx[i] += t.force_x[n, c]
                    fy[i] += t.force_y[n, c]


@njit(**OPTIONS)
def follow_nodes(t, nodes, thread):
    """Take over where the nodes in use have moved, and count all nodes that have moved far since the last search."""
    ux, uy, count = nodes.displacement[0], nodes.displacement[1], 0
    for k in range(t.used_share[thread], t.used_share[thread + 1]):
        i = t.used[k]
        x, y = ux[i], uy[i]
        t.increment[0, k], t.increment[1, k] = x - t.displacement[0, k], y - t.displacement[1, k]
        t.displacement[0, k], t.displacement[1, k] = x, y
        t.place[0, k], t.place[1, k] = t.origin[0, k] + x, t.origin[1, k] + y
    for i in range(nodes.share[thread], nodes.share[thread + 1]):
        x, y = ux[i] - t.searched[0, i], uy[i] - t.searched[1, i]
        count += x * x + y * y > t.reach * t.reach
    t.tally[thread, MOVED] = count
