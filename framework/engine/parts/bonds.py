"""Bonds: interfaces of two grains that were made together, with two contact points each.

Index letters: ``c`` bond, ``p`` contact point (the first points of all bonds, then the second), ``i`` node.
Equation numbers are those of docs/theory.md.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.entry import compiled
from grainlaw.detection import Detection
from grainlaw.engine.parts.laws import (
    LANES,
    LawGroup,
    LawTable,
    is_unbonded,
    respond,
    stiffness_of_points,
    table_of,
)
from grainlaw.engine.parts.part import Changing, Constant, Part, Scratch, Split, Told
from grainlaw.specimen import Specimen

# --- the passes: simple loops over structures of arrays, which the compiler vectorises --------------------------------


u32 = np.uint32  # unsigned indices need no wrap-around code


@njit(**OPTIONS)
def gather_motion(ux, uy, a1, a2, b1, b2, d1x, d1y, d2x, d2y, ex, ey):
    """Displacement of grain B relative to A at both ends of a bond, and the change of its mean edge vector."""
    for c in range(a1.shape[0]):
        i, j, k, m = u32(a1[c]), u32(a2[c]), u32(b1[c]), u32(b2[c])
        xi, yi, xj, yj = ux[i], uy[i], ux[j], uy[j]
        xk, yk, xm, ym = ux[k], uy[k], ux[m], uy[m]
        d1x[c] = xk - xi
        d1y[c] = yk - yi
        d2x[c] = xm - xj
        d2y[c] = ym - yj
        ex[c] = 0.5 * (xj - xi + xm - xk)
        ey[c] = 0.5 * (yj - yi + ym - yk)


@njit(**OPTIONS)
def kinematics(d1x, d1y, d2x, d2y, ex, ey, edge_x, edge_y, weight, nx, ny, inverse, o1, o2, s1, s2):
    """Current normal, Eq. (6), and opening and slip at the two contact points, Eq. (7)."""
    for c in range(d1x.shape[0]):
        x = edge_x[c] + ex[c]
        y = edge_y[c] + ey[c]
        r = 1 / math.sqrt(x * x + y * y)
        p = y * r
        q = -x * r
        nx[c] = p
        ny[c] = q
        inverse[c] = r
        o_first = d1x[c] * p + d1y[c] * q
        s_first = d1y[c] * p - d1x[c] * q
        o_change = weight[c] * (d2x[c] * p + d2y[c] * q - o_first)
        s_change = weight[c] * (d2y[c] * p - d2x[c] * q - s_first)
        o1[c] = o_first + o_change
        s1[c] = s_first + s_change
        o2[c] = d2x[c] * p + d2y[c] * q - o_change
        s2[c] = d2y[c] * p - d2x[c] * q - s_change


@njit(**OPTIONS)
def moved_apart(d1x, d1y, d2x, d2y, reach):
    """How many bonds have an end whose relative displacement squared is above ``reach`` (m2)."""
    count = 0
    for c in range(d1x.shape[0]):
        first, second = d1x[c] * d1x[c] + d1y[c] * d1y[c], d2x[c] * d2x[c] + d2y[c] * d2y[c]
        count += max(first, second) > reach[c]
    return count


@njit(**OPTIONS)
def add_work(now, before, traction_now, traction_before, work):
    """Add the work on each contact point by the trapezoidal rule, with which the energy balance of Eq. (12) closes."""
    for p in range(now.shape[0]):
        work[p] += 0.5 * (traction_now[p] + traction_before[p]) * (now[p] - before[p])


@njit(**OPTIONS)
def end_forces(nx, ny, inverse, half, weight, n1, t1, n2, t2, o1, o2, s1, s2, a1x, a2x, b1x, b2x, a1y, a2y, b1y, b2y):
    """Nodal forces of a bond, Eq. (8): from the tractions, and the couple that balances their moment."""
    for c in range(nx.shape[0]):
        x = nx[c] * half[c]
        y = ny[c] * half[c]
        w = weight[c]
        p1x = n1[c] * x - t1[c] * y
        p1y = n1[c] * y + t1[c] * x
        p2x = n2[c] * x - t2[c] * y
        p2y = n2[c] * y + t2[c] * x
        mx = w * (p2x - p1x)
        my = w * (p2y - p1y)
        f1x = p1x + mx
        f1y = p1y + my
        f2x = p2x - mx
        f2y = p2y - my
        couple = 0.5 * inverse[c] * (n1[c] * s1[c] - t1[c] * o1[c] + n2[c] * s2[c] - t2[c] * o2[c])
        gx = -x * couple
        gy = -y * couple
        a1x[c] = f1x + gx
        a1y[c] = f1y + gy
        a2x[c] = f2x - gx
        a2y[c] = f2y - gy
        b1x[c] = gx - f1x
        b1y[c] = gy - f1y
        b2x[c] = -gx - f2x
        b2y[c] = -gy - f2y


@njit(**OPTIONS)
def gather_forces(first, second, cx, cy, fx, fy):
    """Add to each node the forces of the two bond ends it may have, in a fixed order."""
    for i in range(fx.shape[0]):
        j, k = u32(first[i]), u32(second[i])
        fx[i] += cx[j] + cx[k]
        fy[i] += cy[j] + cy[k]


ACROSS = math.sqrt(0.5)  #: half of an edge over the length of the mean of two at right angles
BLOCK = 4096  #: bonds that go through their passes together: their scratch stays in the cache


class BondArrays(NamedTuple):
    """Bonds (c), their contact points (p), and where nodes (i) find their forces."""

    laws: LawTable
    node: Changing  #: (4, c) ends of the edge of grain A, then the same ends on grain B
    slots: Changing  #: (2, i) places of a node's bond ends in the force rows; the last place is zero
    edge_x: Constant  #: (c,) m, vector of the undeformed edge
    edge_y: Constant
    half: Constant  #: (c,) m, half length
    weight: Constant  #: (c,) share of the far end in the motion at a contact point
    reach: Constant  #: (c,) m2, square of the motion of an end from which on a broken bond becomes a contact
    leaving: Told  #: (c,) 1 where it is to become a contact now
    d1x: Scratch  #: (c,) m, motion of B against A at the first end
    d1y: Scratch
    d2x: Scratch  #: (c,) m, at the second end
    d2y: Scratch
    ex: Scratch  #: (c,) m, change of the mean edge
    ey: Scratch
    nx: Scratch  #: (c,) normal
    ny: Scratch
    inverse: Scratch  #: (c,) 1/m, of the present length
    opening: Changing  #: (2, p) m, at this and the previous step in turn
    slip: Changing  #: (2, p) m
    normal: Changing  #: (2, p) Pa
    shear: Changing  #: (2, p) Pa
    opening_work: Changing  #: (p,) J/m2
    slip_work: Changing  #: (p,) J/m2
    memory: Changing  #: (m, p) of the laws
    force_x: Changing  #: (4 c + 1,) N on the four nodes of each bond, and a zero
    force_y: Changing
    share: Constant


class BondBooks(NamedTuple):
    """What is kept between steps."""

    replaced: Changing  #: (c,) whether a contact has taken the bond's place


@njit(**OPTIONS)
def _mark_leaving(bonds, g, first, last, d1x, d1y, d2x, d2y, nx, ny, inverse):
    """Mark bonds that have moved apart and are broken at both points, or have turned far about the one that holds."""
    count, leaving = bonds.half.shape[0], 0
    for c in range(first, last):
        k = c - first
        if max(d1x[k] ** 2 + d1y[k] ** 2, d2x[k] ** 2 + d2y[k] ** 2) > bonds.reach[c]:
            one = is_unbonded(bonds.laws, g, bonds.memory, c)
            other = is_unbonded(bonds.laws, g, bonds.memory, count + c)
            opened = min(d1x[k] * nx[k] + d1y[k] * ny[k], d2x[k] * nx[k] + d2y[k] * ny[k])
            turned = opened < -math.sqrt(bonds.reach[c]) or bonds.half[c] * inverse[k] > ACROSS
            if (one and other) or ((one or other) and turned):
                bonds.leaving[c] = 1
                leaving += 1
    return leaving


@njit(**OPTIONS)
def _one_law(bonds, nodes, g, new, old, first, last):
    """Bonds ``first`` to ``last`` of law ``g``, block by block; returns how many become contacts."""
    count, leaving = bonds.half.shape[0], 0
    ux, uy, cx, cy = nodes.displacement[0], nodes.displacement[1], bonds.force_x, bonds.force_y
    opening, slip, normal, shear = bonds.opening[new], bonds.slip[new], bonds.normal[new], bonds.shear[new]
    o_old, s_old, n_old, t_old = bonds.opening[old], bonds.slip[old], bonds.normal[old], bonds.shear[old]
    addresses = opening.ctypes.data, slip.ctypes.data, normal.ctypes.data, shear.ctypes.data
    for c in range(first, last, BLOCK):
        e = min(c + BLOCK, last)
        s = first + e - c  # every block uses the scratch rows from ``first`` on
        k, m = count + c, count + e  # the second points of these bonds
        d1x, d1y, d2x, d2y = bonds.d1x[first:s], bonds.d1y[first:s], bonds.d2x[first:s], bonds.d2y[first:s]
        ex, ey, nx, ny = bonds.ex[first:s], bonds.ey[first:s], bonds.nx[first:s], bonds.ny[first:s]
        inverse, weight = bonds.inverse[first:s], bonds.weight[c:e]
        o1, o2, s1, s2 = opening[c:e], opening[k:m], slip[c:e], slip[k:m]
        gather_motion(
            ux, uy, bonds.node[0, c:e], bonds.node[1, c:e], bonds.node[2, c:e], bonds.node[3, c:e],
            d1x, d1y, d2x, d2y, ex, ey,
        )  # fmt: skip
        kinematics(
            d1x, d1y, d2x, d2y, ex, ey, bonds.edge_x[c:e], bonds.edge_y[c:e], weight, nx, ny, inverse, o1, o2, s1, s2
        )
        respond(bonds.laws, g, bonds.memory, 0, c, e, *addresses)
        respond(bonds.laws, g, bonds.memory, 1, c, e, *addresses)
        if moved_apart(d1x, d1y, d2x, d2y, bonds.reach[c:e]) > 0:
            leaving += _mark_leaving(bonds, g, c, e, d1x, d1y, d2x, d2y, nx, ny, inverse)
        n1, n2, t1, t2 = normal[c:e], normal[k:m], shear[c:e], shear[k:m]
        add_work(o1, o_old[c:e], n1, n_old[c:e], bonds.opening_work[c:e])
        add_work(o2, o_old[k:m], n2, n_old[k:m], bonds.opening_work[k:m])
        add_work(s1, s_old[c:e], t1, t_old[c:e], bonds.slip_work[c:e])
        add_work(s2, s_old[k:m], t2, t_old[k:m], bonds.slip_work[k:m])
        end_forces(
            nx, ny, inverse, bonds.half[c:e], weight, n1, t1, n2, t2, o1, o2, s1, s2,
            cx[c:e], cx[k:m], cx[count + k : count + m], cx[2 * count + k : 2 * count + m],
            cy[c:e], cy[k:m], cy[count + k : count + m], cy[2 * count + k : 2 * count + m],
        )  # fmt: skip
    return leaving


@njit(**OPTIONS)
def bond_forces(bonds, nodes, step, thread):
    """Kinematics, tractions, work and forces of a thread's bonds, law by law; returns how many become contacts."""
    new, old, leaving = step % 2, (step + 1) % 2, 0
    first, last = bonds.share[thread], bonds.share[thread + 1]
    for g in range(bonds.laws.address.shape[0]):
        leaving += _one_law(bonds, nodes, g, new, old, max(first, bonds.laws.first[g]), min(last, bonds.laws.last[g]))
    return leaving


@njit(**OPTIONS)
def gather_bond_forces(bonds, nodes, thread):
    """Add the forces of bonds to a thread's nodes."""
    i, j = nodes.share[thread], nodes.share[thread + 1]
    gather_forces(
        bonds.slots[0, i:j], bonds.slots[1, i:j], bonds.force_x, bonds.force_y, nodes.force[0, i:j], nodes.force[1, i:j]
    )


def _motion_of_points(bonds, ends, displacement, opening, slip):
    count, gap = bonds.half.shape[0], np.empty((9, bonds.half.shape[0]))
    gather_motion(
        displacement[0], displacement[1], ends[0], ends[1], ends[2], ends[3],
        gap[0], gap[1], gap[2], gap[3], gap[4], gap[5],
    )  # fmt: skip
    kinematics(
        gap[0], gap[1], gap[2], gap[3], gap[4], gap[5], bonds.edge_x, bonds.edge_y, bonds.weight,
        gap[6], gap[7], gap[8], opening[:count], opening[count:], slip[:count], slip[count:],
    )  # fmt: skip


class Bonds(Part):
    """All bonds, in the order of their laws (``order``), undeformed and without load at first."""

    def __init__(
        self, specimen: Specimen, order: np.ndarray, groups: list[LawGroup], detection: Detection | None
    ) -> None:
        mesh, self.order, self.groups = specimen.mesh, order, groups
        self.ends = mesh.interfaces[self.order]  #: (c, 4) nodes
        count = len(self.order)
        edges = mesh.interface_edges[self.order]
        lengths = np.hypot(*edges.T)
        hand_over = np.inf if detection is None else detection.hand_over**2
        depth = max((group.depth for group in self.groups), default=1)
        points = {name: np.zeros((2, 2 * count)) for name in ("opening", "slip", "normal", "shear")}
        rows = {name: np.zeros(count) for name in ("leaving", *"d1x d1y d2x d2y ex ey nx ny inverse".split())}
        self.arrays = BondArrays(
            laws=table_of(self.groups, bonding=True),
            node=np.ascontiguousarray(self.ends.T, dtype=np.int32),
            slots=self._slots(len(mesh.nodes)),
            edge_x=np.ascontiguousarray(edges[:, 0]),
            edge_y=np.ascontiguousarray(edges[:, 1]),
            half=lengths / 2,
            weight=specimen.contact_points.weights(lengths),
            reach=np.full(count, hand_over) * lengths**2,
            opening_work=np.zeros(2 * count),
            slip_work=np.zeros(2 * count),
            memory=np.zeros((depth, 2 * count)),
            force_x=np.zeros(4 * count + 1),
            force_y=np.zeros(4 * count + 1),
            share=np.zeros(2, dtype=np.int64),
            **points,
            **rows,
        )
        self.books = BondBooks(np.zeros(count, dtype=bool))

    def _slots(self, nodes: int) -> np.ndarray:
        """(2, i) places of each node's bond ends, at most two, in the force rows."""
        count = len(self.ends)
        slots = np.full((2, nodes), 4 * count, dtype=np.int32)
        ends = self.ends.T.ravel()  # place k of the force rows belongs to node ends[k]
        by_node = np.argsort(ends, kind="stable")
        sorted_ends = ends[by_node]
        second = np.r_[False, sorted_ends[1:] == sorted_ends[:-1]][: len(sorted_ends)]
        slots[second.astype(int), sorted_ends] = by_node
        return slots

    def __len__(self) -> int:
        return len(self.order)

    def share(self, split: Split) -> np.ndarray:
        """Whole ``LANES`` from the first bond of a group, unless bonds are alone."""
        if split.alone:
            return np.arange(split.threads + 1) * len(self) // split.threads
        firsts, cuts = [group.first for group in self.groups], []
        for thread in range(split.threads):
            cut = thread * len(self) // split.threads
            first = max((first for first in firsts if first <= cut), default=0)
            cuts.append(first + (cut - first) // LANES * LANES)
        return np.array([*cuts, len(self)])

    def energy(self, time_step: float) -> dict[str, float]:
        return {
            "contacts_normal": float((self.lengths * self.arrays.opening_work).sum()),
            "contacts_shear": float((self.lengths * self.arrays.slip_work).sum()),
        }

    def sever(self, chosen: np.ndarray) -> None:
        """Break what is left of bonds that leave with a sound point."""
        for group in self.groups:
            if (row := group.row("damage")) >= 0:
                mine = chosen[(chosen >= group.first) & (chosen < group.last)]
                points = np.concatenate([mine, len(self) + mine])
                self.arrays.memory[row, points] = np.maximum(self.arrays.memory[row, points], 1.0)

    def retire(self, chosen: np.ndarray) -> None:
        """Take bonds out of the step: they rest at no opening, and no node gathers from them."""
        arrays, count = self.arrays, len(self)
        for k in range(4):
            nodes, place = arrays.node[k, chosen], k * count + chosen
            for row in arrays.slots:
                row[nodes[row[nodes] == place]] = 4 * count
        arrays.node[:, chosen] = arrays.node[0, chosen]
        points = np.concatenate([chosen, count + chosen])
        arrays.opening[:, points] = arrays.slip[:, points] = 0.0
        self.books.replaced[chosen] = True

    def motion(self, displacement: np.ndarray) -> np.ndarray:
        """(2, p) m, opening and slip at a displacement (2, i) of the nodes, also of replaced bonds."""
        rows = np.empty((2, 2 * len(self)))
        compiled(_motion_of_points)(self.arrays, np.ascontiguousarray(self.ends.T), displacement, rows[0], rows[1])
        return rows

    @property
    def work(self) -> np.ndarray:
        """(2, p) J/m2 done in opening and in slip."""
        return np.stack([self.arrays.opening_work, self.arrays.slip_work])

    @cached_property
    def lengths(self) -> np.ndarray:
        """(p,) m: half a bond each."""
        return np.tile(self.arrays.half, 2)

    @cached_property
    def stiffness(self) -> np.ndarray:
        """(2, p) Pa/m: kn and ks of the first response, as the laws declare them."""
        return stiffness_of_points((group.law, group.size) for group in self.groups)

    @cached_property
    def gaps(self) -> np.ndarray:
        """(p,) m between the faces before any load, of laws that have such a ``gap``, also within another."""
        found = np.zeros(2 * len(self))
        for group in self.groups:
            law: Any = group.law
            while not hasattr(law, "gap") and hasattr(law, "law"):
                law = law.law
            found[group.points(len(self))] = np.tile(np.broadcast_to(getattr(law, "gap", 0.0), group.size), 2)
        return found

    def memory(self, name: str, otherwise: np.ndarray) -> np.ndarray:
        """(p,) of one name of the laws' memory; ``otherwise`` (p,) where a law has no such memory."""
        values, count = otherwise.copy(), len(self)
        for group in self.groups:
            if (row := group.row(name)) >= 0:
                for mine in (slice(group.first, group.last), slice(count + group.first, count + group.last)):
                    values[mine] = self.arrays.memory[row, mine]
        return values

    def broken(self, enough: float = 1.0) -> np.ndarray:
        """(p,) whether points are damaged by as much, or never resisted opening."""
        found: np.ndarray = self.memory("damage", np.zeros(2 * len(self))) >= enough
        for group in self.groups:
            found[group.points(len(self))] |= ~group.resists_opening
        return found

    def memory_of(self, group: LawGroup) -> np.ndarray:
        """(m, 2 size) copy of the memory of the points of one group, row by row as a law takes it."""
        return np.ascontiguousarray(self.arrays.memory[: group.depth, group.points(len(self))])
