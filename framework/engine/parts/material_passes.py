"""Passes over zones whose material is compiled: strain, stress, heat, forces. Letters: ``z`` zone, ``g`` group."""

from __future__ import annotations

import math
from typing import NamedTuple

from numba import njit

from grainlaw.compiler.cache import PASS
from grainlaw.compiler.entry import Kernel
from grainlaw.compiler.numba_private import call
from grainlaw.engine.parts.laws import LANES
from grainlaw.engine.parts.part import Address, Changing, Constant, Scratch, Told
from grainlaw.engine.parts.zones import gather_motion, scatter_forces

BLOCK = 64 * LANES  #: zones that go through their passes together: their scratch stays in the cache
FRAME, STRAIN, STRESS, STORED = 4, 6, 9, 12  #: first rows of the scratch; before them the motion, then the forces


class MaterialArrays(NamedTuple):
    """Zones (z), those of one material consecutive and in the order of the mesh; materials (g)."""

    corner: Constant  #: (3, z) node numbers, counter-clockwise
    b1: Constant  #: (z,) 1/m, gradients of the shape functions of the first two corners: along x
    b2: Constant
    c1: Constant  #: along y
    c2: Constant
    area: Constant  #: (z,) m2
    address: Address  #: (g, 2) of the machine code of ``stress`` and of ``energy``
    numbers: Address  #: (g, 3) addresses of their parameters: of the stress, of the energy now and one step before
    values: Told  #: (n,) these parameters, among them the temperature
    temperature_place: Constant  #: (g, 3) place of the temperature among them, or -1
    temperature_row: Constant  #: (g,) row of the memory with the temperature of each zone, where they conduct; or -1
    course: Changing  #: (2,) one step before and now, how far temperatures of zones that conduct are on their way
    base: Changing  #: (z,) °C, of zones that conduct, where it is 0
    rise: Changing  #: (z,) K, by which they are warmer where it is 1
    keeps: Constant  #: (g,) whether the material has a memory, or knows the temperature
    knows_temperature: Constant  #: (g,) whether it knows the temperature
    fields: Constant  #: (r, z) parameters of the stress that differ from grain to grain
    others: Constant  #: (r, z) those of the energy
    memory: Changing  #: (m, z)
    strain: Changing  #: (3, z) at the last forces, of materials that keep something
    stress: Changing  #: (3, z) Pa
    work: Changing  #: (z,) J/m3 done on them since the start
    thermal: Changing  #: (z,) J/m3 that the stored energy has lost by changes of temperature
    scratch: Scratch  #: (14, z) motion of corners or forces, rotation, strain, stress, stored energy
    few: Scratch  #: (threads, r, ``LANES``) of zones that fill no vector: parameters, memory, rows of the scratch
    share: Constant  #: (g, threads + 1)


@njit(**PASS)
def find_strain(x1, y1, x2, y2, b1, b2, c1, c2, cs, sn, exx, eyy, exy):
    """Rotation and strain of each zone, Eqs. (2, 3)."""
    # Not shared with the elastic zones: taken out of their pass, the compiler rounds their last digit differently.
    for z in range(x1.shape[0]):
        f11 = 1 + b1[z] * x1[z] + b2[z] * x2[z]
        f12 = c1[z] * x1[z] + c2[z] * x2[z]
        f21 = b1[z] * y1[z] + b2[z] * y2[z]
        f22 = 1 + c1[z] * y1[z] + c2[z] * y2[z]
        c, s = f11 + f22, f21 - f12
        r = 1 / math.sqrt(c * c + s * s)
        c *= r
        s *= r
        cs[z], sn[z] = c, s
        exx[z] = c * f11 + s * f21 - 1
        eyy[z] = c * f22 - s * f12 - 1
        exy[z] = 0.5 * (c * (f12 + f21) + s * (f22 - f11))


@njit(**PASS)
def material_forces(cs, sn, exx, eyy, exy, sxx, syy, sxy, b1, b2, c1, c2, area, f1x, f1y, f2x, f2y):
    """Force of each zone on its first and second corner: Eq. (5) with the stress and the turn of Eq. (21)."""
    for z in range(cs.shape[0]):
        c, s, sx, sy, t, a = cs[z], sn[z], sxx[z], syy[z], sxy[z], area[z]
        turn = ((exx[z] - eyy[z]) * t - exy[z] * (sx - sy)) / (2 + exx[z] + eyy[z])
        upper, lower = t + turn, t - turn
        p11 = a * (c * sx - s * lower)
        p12 = a * (c * upper - s * sy)
        p21 = a * (s * sx + c * lower)
        p22 = a * (s * upper + c * sy)
        f1x[z] = b1[z] * p11 + c1[z] * p12
        f1y[z] = b1[z] * p21 + c1[z] * p22
        f2x[z] = b2[z] * p11 + c2[z] * p12
        f2y[z] = b2[z] * p21 + c2[z] * p22


@njit(**PASS)
def add_work(exx, eyy, exy, sxx, syy, sxy, exx0, eyy0, exy0, sxx0, syy0, sxy0, work):
    """Work per volume on each zone since the step before, by the trapezoidal rule as in Eq. (12); keep what is new."""
    for z in range(work.shape[0]):
        along = (sxx[z] + sxx0[z]) * (exx[z] - exx0[z]) + (syy[z] + syy0[z]) * (eyy[z] - eyy0[z])
        work[z] += 0.5 * along + (sxy[z] + sxy0[z]) * (exy[z] - exy0[z])
        exx0[z], eyy0[z], exy0[z] = exx[z], eyy[z], exy[z]
        sxx0[z], syy0[z], sxy0[z] = sxx[z], syy[z], sxy[z]


@njit(**PASS)
def _respond(zones, g, fields, memory, z, rows, s, count):
    """Stress of ``count`` zones of material ``g``, from ``z`` on in ``fields`` and ``memory`` and ``s`` in ``rows``."""
    start, size = rows.ctypes.data + 8 * s, 8 * rows.shape[1]
    call(
        zones.address[g, 0],
        (
            zones.numbers[g, 0], fields.ctypes.data + 8 * z, fields.shape[1], memory.ctypes.data + 8 * z,
            memory.shape[1],
            start + STRAIN * size, start + (STRAIN + 1) * size, start + (STRAIN + 2) * size,
            start + STRESS * size, start + (STRESS + 1) * size, start + (STRESS + 2) * size, count,
        ),
    )  # fmt: skip


@njit(**PASS)
def _filled(few, first, rows, start, count):
    """Put rows of ``count`` zones into ``few``, from row ``first`` on; the row after them.

    The last zone is repeated to fill the vector, so that rounding depends on no share.
    """
    for r in range(rows.shape[0]):
        for lane in range(LANES):
            few[first + r, lane] = rows[r, start + min(lane, count - 1)]
    return first + rows.shape[0]


@njit(**PASS)
def _respond_to_few(zones, g, z, s, count, few):
    """The same for fewer zones than a whole vector."""
    memory = _filled(few, 0, zones.fields, z, count)
    rows = _filled(few, memory, zones.memory, z, count)
    _filled(few, rows + STRAIN, zones.scratch[STRAIN:STRESS], s, count)
    _respond(zones, g, few, few[memory:rows], 0, few[rows:], 0, LANES)
    for k in range(count):
        for r in range(zones.memory.shape[0]):
            zones.memory[r, z + k] = few[memory + r, k]
        for r in range(STRESS, STORED):
            zones.scratch[r, s + k] = few[rows + r, k]


@njit(**PASS)
def _stored_by(zones, numbers, g, fields, memory, z, strain, first, k, out, row, s, count):
    """Stored energy of ``count`` zones, from ``z`` on in ``fields`` and ``memory`` and ``k`` in ``strain``."""
    start, size = strain.ctypes.data + 8 * k, 8 * strain.shape[1]
    call(
        zones.address[g, 1],
        (
            numbers, fields.ctypes.data + 8 * z, fields.shape[1], memory.ctypes.data + 8 * z, memory.shape[1],
            start + first * size, start + (first + 1) * size, start + (first + 2) * size,
            out.ctypes.data + 8 * (row * out.shape[1] + s), count,
        ),
    )  # fmt: skip


@njit(**PASS)
def _warm(zones, g, z, count, course):
    """Bring zones that conduct to their own temperatures, where those are on their ``course``, Eq. (28)."""
    row = zones.temperature_row[g]
    if row >= 0:
        for i in range(z, z + count):
            zones.memory[row, i] = zones.base[i] + zones.rise[i] * course


@njit(**PASS)
def _stored(zones, which, g, z, strain, first, k, row, s, count, few):
    """Stored energy of zones at the temperature now (``which`` 1) or one step before (2), into a row of the scratch."""
    numbers, whole = zones.numbers[g, which], count // LANES * LANES
    _warm(zones, g, z, count, zones.course[2 - which])
    if whole > 0:
        _stored_by(
            zones, numbers, g, zones.others, zones.memory, z, strain, first, k, zones.scratch, row, s, whole
        )  # fmt: skip
    if whole < count:
        memory = _filled(few, 0, zones.others, z + whole, count - whole)
        rows = _filled(few, memory, zones.memory, z + whole, count - whole)
        found = _filled(few, rows, strain[first : first + 3], k + whole, count - whole)
        _stored_by(zones, numbers, g, few, few[memory:rows], 0, few, rows, 0, few, found, 0, LANES)
        for lane in range(count - whole):
            zones.scratch[row, s + whole + lane] = few[found, lane]


@njit(**PASS)
def _add_thermal(zones, g, z, strain, first, k, s, count, few):
    """Take half of what the change of temperature does to the stored energy at a strain that is held, Eq. (22)."""
    _stored(zones, 2, g, z, strain, first, k, STORED + 1, s, count, few)
    _stored(zones, 1, g, z, strain, first, k, STORED, s, count, few)
    for i in range(count):
        zones.thermal[z + i] -= 0.5 * (zones.scratch[STORED, s + i] - zones.scratch[STORED + 1, s + i])


@njit(**PASS)
def take_temperature(zones, before, temperature):
    """Tell the materials the temperatures (°C) of the next step and of the one before it."""
    zones.course[0], zones.course[1] = before, temperature
    for g in range(zones.temperature_place.shape[0]):
        for which in range(3):
            if zones.temperature_place[g, which] >= 0:
                zones.values[zones.temperature_place[g, which]] = temperature if which < 2 else before


@njit(**PASS)
def add_material_forces(zones, nodes, changes, thread):
    """Forces of a thread's zones on their nodes, block by block; ``changes``: whether the temperature does."""
    ux, uy, fx, fy = nodes.displacement[0], nodes.displacement[1], nodes.force[0], nodes.force[1]
    b1, b2, c1, c2, area = zones.b1, zones.b2, zones.c1, zones.c2, zones.area
    w, few = zones.scratch, zones.few[thread]
    for g in range(zones.share.shape[0]):
        first, last = zones.share[g, thread], zones.share[g, thread + 1]
        for z in range(first, last, BLOCK):
            e = min(z + BLOCK, last)
            s = first + e - z  # every block uses the scratch from ``first`` on
            n0, n1, n2 = zones.corner[0, z:e], zones.corner[1, z:e], zones.corner[2, z:e]
            x1, y1, x2, y2 = w[0, first:s], w[1, first:s], w[2, first:s], w[3, first:s]
            cs, sn = w[FRAME, first:s], w[FRAME + 1, first:s]
            exx, eyy, exy = w[STRAIN, first:s], w[STRAIN + 1, first:s], w[STRAIN + 2, first:s]
            sxx, syy, sxy = w[STRESS, first:s], w[STRESS + 1, first:s], w[STRESS + 2, first:s]
            gather_motion(ux, uy, n0, n1, n2, x1, y1, x2, y2)
            find_strain(x1, y1, x2, y2, b1[z:e], b2[z:e], c1[z:e], c2[z:e], cs, sn, exx, eyy, exy)
            warms = changes and zones.knows_temperature[g]
            if warms:
                _add_thermal(zones, g, z, zones.strain, 0, z, first, e - z, few)
            whole = (e - z) // LANES * LANES
            if whole > 0:
                _respond(zones, g, zones.fields, zones.memory, z, w, first, whole)
            if z + whole < e:
                _respond_to_few(zones, g, z + whole, first + whole, e - z - whole, few)
            if warms:
                _add_thermal(zones, g, z, w, STRAIN, first, first, e - z, few)
            if zones.keeps[g]:
                add_work(
                    exx, eyy, exy, sxx, syy, sxy, zones.strain[0, z:e], zones.strain[1, z:e], zones.strain[2, z:e],
                    zones.stress[0, z:e], zones.stress[1, z:e], zones.stress[2, z:e], zones.work[z:e],
                )  # fmt: skip
            material_forces(
                cs, sn, exx, eyy, exy, sxx, syy, sxy, b1[z:e], b2[z:e], c1[z:e], c2[z:e], area[z:e],
                x1, y1, x2, y2,
            )  # fmt: skip
            scatter_forces(fx, fy, n0, n1, n2, x1, y1, x2, y2)


def strains_at(zones, displacement):
    w = zones.scratch
    gather_motion(
        displacement[0], displacement[1], zones.corner[0], zones.corner[1], zones.corner[2], w[0], w[1], w[2], w[3]
    )
    find_strain(
        w[0], w[1], w[2], w[3], zones.b1, zones.b2, zones.c1, zones.c2, w[FRAME], w[FRAME + 1],
        w[STRAIN], w[STRAIN + 1], w[STRAIN + 2],
    )  # fmt: skip


def forces_of_zones(zones, force):
    w, n = zones.scratch, zones.corner
    material_forces(
        w[FRAME], w[FRAME + 1], w[STRAIN], w[STRAIN + 1], w[STRAIN + 2], w[STRESS], w[STRESS + 1], w[STRESS + 2],
        zones.b1, zones.b2, zones.c1, zones.c2, zones.area, w[0], w[1], w[2], w[3],
    )  # fmt: skip
    scatter_forces(force[0], force[1], n[0], n[1], n[2], w[0], w[1], w[2], w[3])


def _forces_of_materials(zones, nodes, changes, thread):
    add_material_forces(zones[0], nodes[0], changes != 0, thread)


forces_of_materials = Kernel(_forces_of_materials)  #: compiled apart: most specimens have no such grain
