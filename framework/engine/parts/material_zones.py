"""Zones of grains whose material is compiled, in groups of one material. Index letters: ``z`` zone, ``g`` group."""

from __future__ import annotations

import math
from typing import NamedTuple

import attrs
import numpy as np
from numba import njit

from grainlaw.compiler.batch import Compiled, compile_material
from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.entry import compiled
from grainlaw.compiler.numba_private import call
from grainlaw.engine.parts.laws import LANES
from grainlaw.engine.parts.part import Changing, Constant, Part, Scratch, Split
from grainlaw.engine.parts.zones import gather_motion, scatter_forces
from grainlaw.engine.stability import shape_functions
from grainlaw.material import Material
from grainlaw.specimen import Specimen

BLOCK = 32 * LANES  #: zones that go through their passes together: their scratch stays in the cache
MOTION, FRAME, STRAIN, STRESS, FORCE = 0, 4, 6, 9, 12  #: first rows of the scratch


class MaterialArrays(NamedTuple):
    """Zones (z), those of one material consecutive and in the order of the mesh; materials (g)."""

    corner: Constant  #: (3, z) node numbers, counter-clockwise
    b1: Constant  #: (z,) 1/m, gradients of the shape functions of the first two corners: along x
    b2: Constant
    c1: Constant  #: along y
    c2: Constant
    area: Constant  #: (z,) m2
    address: Constant  #: (g,) of the machine code of ``stress``
    numbers: Constant  #: (g,) address of its parameters
    keeps: Constant  #: (g,) whether the material has a memory
    fields: Constant  #: (r, z) parameters that differ from grain to grain
    memory: Changing  #: (m, z)
    strain: Changing  #: (3, z) at the last forces, of materials with a memory
    stress: Changing  #: (3, z) Pa
    work: Changing  #: (z,) J/m3 done on them since the start
    scratch: Scratch  #: (16, z) motion of corners, rotation, strain, stress, force
    share: Scratch  #: (g, threads + 1)


@njit(**OPTIONS)
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


@njit(**OPTIONS)
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


@njit(**OPTIONS)
def add_work(exx, eyy, exy, sxx, syy, sxy, exx0, eyy0, exy0, sxx0, syy0, sxy0, work):
    """Work per volume on each zone since the step before, by the trapezoidal rule as in Eq. (12); keep what is new."""
    for z in range(work.shape[0]):
        along = (sxx[z] + sxx0[z]) * (exx[z] - exx0[z]) + (syy[z] + syy0[z]) * (eyy[z] - eyy0[z])
        work[z] += 0.5 * along + (sxy[z] + sxy0[z]) * (exy[z] - exy0[z])
        exx0[z], eyy0[z], exy0[z] = exx[z], eyy[z], exy[z]
        sxx0[z], syy0[z], sxy0[z] = sxx[z], syy[z], sxy[z]


@njit(**OPTIONS)
def _respond(zones, g, fields, memory, z, rows, s, count):
    """Stress of ``count`` zones of material ``g``, from ``z`` on in ``fields`` and ``memory`` and ``s`` in ``rows``."""
    start, size = rows.ctypes.data + 8 * s, 8 * rows.shape[1]
    call(
        zones.address[g],
        (
            zones.numbers[g], fields.ctypes.data + 8 * z, fields.shape[1], memory.ctypes.data + 8 * z, memory.shape[1],
            start + STRAIN * size, start + (STRAIN + 1) * size, start + (STRAIN + 2) * size,
            start + STRESS * size, start + (STRESS + 1) * size, start + (STRESS + 2) * size, count,
        ),
    )  # fmt: skip


@njit(**OPTIONS)
def _respond_to_few(zones, g, z, s, count):
    """The same for fewer zones than a whole vector: repeated to fill one, so that rounding depends on no share."""
    fields = np.empty((zones.fields.shape[0], LANES))
    memory = np.empty((zones.memory.shape[0], LANES))
    rows = np.empty((FORCE, LANES))
    for lane in range(LANES):
        k = min(lane, count - 1)
        for r in range(fields.shape[0]):
            fields[r, lane] = zones.fields[r, z + k]
        for r in range(memory.shape[0]):
            memory[r, lane] = zones.memory[r, z + k]
        for r in range(STRAIN, STRESS):
            rows[r, lane] = zones.scratch[r, s + k]
    _respond(zones, g, fields, memory, 0, rows, 0, LANES)
    for k in range(count):
        for r in range(memory.shape[0]):
            zones.memory[r, z + k] = memory[r, k]
        for r in range(STRESS, FORCE):
            zones.scratch[r, s + k] = rows[r, k]


@njit(**OPTIONS)
def add_material_forces(zones, nodes, thread):
    """Forces of a thread's zones on their nodes, block by block."""
    ux, uy, fx, fy = nodes.displacement[0], nodes.displacement[1], nodes.force[0], nodes.force[1]
    b1, b2, c1, c2, area, w = zones.b1, zones.b2, zones.c1, zones.c2, zones.area, zones.scratch
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
            f1x, f1y = w[FORCE, first:s], w[FORCE + 1, first:s]
            f2x, f2y = w[FORCE + 2, first:s], w[FORCE + 3, first:s]
            gather_motion(ux, uy, n0, n1, n2, x1, y1, x2, y2)
            find_strain(x1, y1, x2, y2, b1[z:e], b2[z:e], c1[z:e], c2[z:e], cs, sn, exx, eyy, exy)
            whole = (e - z) // LANES * LANES
            if whole > 0:
                _respond(zones, g, zones.fields, zones.memory, z, w, first, whole)
            if z + whole < e:
                _respond_to_few(zones, g, z + whole, first + whole, e - z - whole)
            if zones.keeps[g]:
                add_work(
                    exx, eyy, exy, sxx, syy, sxy, zones.strain[0, z:e], zones.strain[1, z:e], zones.strain[2, z:e],
                    zones.stress[0, z:e], zones.stress[1, z:e], zones.stress[2, z:e], zones.work[z:e],
                )  # fmt: skip
            material_forces(
                cs, sn, exx, eyy, exy, sxx, syy, sxy, b1[z:e], b2[z:e], c1[z:e], c2[z:e], area[z:e],
                f1x, f1y, f2x, f2y,
            )  # fmt: skip
            scatter_forces(fx, fy, n0, n1, n2, f1x, f1y, f2x, f2y)


def _strains(zones, displacement):
    w = zones.scratch
    gather_motion(
        displacement[0], displacement[1], zones.corner[0], zones.corner[1], zones.corner[2], w[0], w[1], w[2], w[3]
    )
    find_strain(
        w[0], w[1], w[2], w[3], zones.b1, zones.b2, zones.c1, zones.c2, w[FRAME], w[FRAME + 1],
        w[STRAIN], w[STRAIN + 1], w[STRAIN + 2],
    )  # fmt: skip


@attrs.frozen(eq=False)
class ZoneGroup:
    """Zones ``first`` to ``last`` of one material, whose places in the mesh are ``zones``."""

    material: Material
    stress: Compiled
    energy: Compiled
    zones: np.ndarray
    first: int
    last: int

    @property
    def memory(self) -> tuple[str, ...]:
        """Names of the memory."""
        return self.stress.memory


class MaterialZones(Part):
    """The zones of grains whose material is not :class:`~grainlaw.Elastic`; rigid grains have none."""

    def __init__(self, specimen: Specimen) -> None:
        mesh, self.groups = specimen.mesh, _groups(specimen)
        chosen = [group.zones for group in self.groups]
        self.chosen = np.concatenate([np.zeros(0, dtype=np.int64), *chosen])  #: zones of the mesh, in this order
        count = len(self.chosen)
        remembers = any(group.memory for group in self.groups)
        self._before = np.zeros((len(self.groups), len(mesh.first_zone)), dtype=np.int64)
        fields = np.zeros((max((len(group.stress.rows) for group in self.groups), default=0), count))
        for g, group in enumerate(self.groups):
            self._before[g] = group.first + np.searchsorted(group.zones, mesh.first_zone)
            fields[: len(group.stress.rows), group.first : group.last] = group.stress.rows
        gradients = shape_functions(mesh.nodes, mesh.zones)[[0, 1, 3, 4, 6]][:, self.chosen]
        kept, self._count = count if remembers else 0, len(mesh.zones)
        table = [[group.stress.address, group.stress.numbers.ctypes.data, bool(group.memory)] for group in self.groups]
        corner = np.ascontiguousarray(mesh.zones[self.chosen].T, dtype=np.int32)
        rows = [np.ascontiguousarray(row) for row in gradients]
        rows += [*np.array(table, dtype=np.int64).reshape(-1, 3).T.copy(), fields]
        rows.append(np.zeros((max((len(group.memory) for group in self.groups), default=0), count)))
        rows += [np.zeros((3, kept)), np.zeros((3, kept)), np.zeros(kept), np.zeros((FORCE + 4, count))]
        rows.append(np.zeros((len(self.groups), 2), dtype=np.int64))
        self.arrays = MaterialArrays(corner, *rows)

    def share(self, split: Split) -> np.ndarray:
        return np.ascontiguousarray(self._before[:, split.grain])

    def memory(self, name: str) -> np.ndarray:
        """(z,) one variable of the materials' memory, in the order of the mesh; zero where there is none."""
        values = np.zeros(self._count)
        for group in self.groups:
            if name in group.memory:
                values[group.zones] = self.arrays.memory[group.memory.index(name), group.first : group.last]
        return values

    def states(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Stress (z, 3) Pa, stored energy and energy dissipated so far (z,) J/m3 at (2, i) m, that of the last forces.

        In the order of ``chosen``; the stress as xx, yy, xy in the fixed axes.
        """
        a = self.arrays
        compiled(_strains)(a, displacement)
        stress, stored, lost = np.empty((3, len(self.chosen))), np.empty(len(self.chosen)), np.zeros(len(self.chosen))
        for group in self.groups:
            own = slice(group.first, group.last)
            memory = (
                a.memory[: len(group.memory), own].copy() if group.memory else np.zeros((1, group.last - group.first))
            )
            strain = (a.strain if group.memory else a.scratch[STRAIN:STRESS])[:, own]
            stress[:, own] = a.stress[:, own] if group.memory else group.stress.batch(*strain, memory)
            (stored[own],) = group.energy.batch(*strain, memory)
            if group.memory:
                lost[own] = a.work[own] - stored[own]
        (p, q, t), cs, sn = stress, a.scratch[FRAME], a.scratch[FRAME + 1]
        fixed = cs**2 * p + sn**2 * q - 2 * cs * sn * t, sn**2 * p + cs**2 * q + 2 * cs * sn * t
        return np.stack([*fixed, cs * sn * (p - q) + (cs**2 - sn**2) * t], axis=1), stored, lost


def _groups(specimen: Specimen) -> list[ZoneGroup]:
    """The materials that are compiled, with their zones."""
    found: list[ZoneGroup] = []
    owner, first = specimen.mesh.zone_grain, 0
    for material, grains in specimen.materials:
        if not isinstance(material, Material) or specimen.is_elastic[grains[0]]:
            continue
        zones = np.flatnonzero(np.isin(owner, grains))
        each = np.searchsorted(grains, owner[zones])
        stress, energy = (
            attrs.evolve(one, rows=np.ascontiguousarray(one.rows[:, each]))
            for one in compile_material(material, len(grains))
        )
        found.append(ZoneGroup(material, stress, energy, zones, first, first + len(zones)))
        first += len(zones)
    return found
