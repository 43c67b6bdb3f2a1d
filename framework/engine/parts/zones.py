"""Zones: the triangles that make grains deformable. Index letters: ``i`` node, ``z`` zone."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.entry import compiled
from grainlaw.engine.parts.part import Constant, Part, Scratch, Split
from grainlaw.engine.stability import shape_functions
from grainlaw.specimen import Specimen

u32 = np.uint32  # unsigned indices need no wrap-around code
BLOCK = 4096  #: zones that go through their passes together: their scratch stays in the cache


class ZoneArrays(NamedTuple):
    """Zones (z) of grains that are :class:`~grainlaw.Elastic`; those of other materials are a part of their own."""

    corner: Constant  #: (3, z) node numbers, counter-clockwise
    b1: Constant  #: (z,) 1/m, gradients of the shape functions of the first two corners: along x
    b2: Constant
    c1: Constant  #: along y
    c2: Constant
    area: Constant  #: (z,) m2
    d0: Constant  #: (z,) Pa, stress per strain: along the axis, across it, in shear
    d1: Constant
    d2: Constant
    x1: Scratch  #: (z,) m, displacement of the first two corners relative to the third
    y1: Scratch
    x2: Scratch
    y2: Scratch
    f1x: Scratch  #: (z,) N on the first two corners
    f1y: Scratch
    f2x: Scratch
    f2y: Scratch
    share: Constant


@njit(**OPTIONS)
def gather_motion(ux, uy, n0, n1, n2, x1, y1, x2, y2):
    """Displacement of the first and second corner of each zone relative to its third."""
    for z in range(n0.shape[0]):
        i, j, k = u32(n0[z]), u32(n1[z]), u32(n2[z])
        x1[z] = ux[i] - ux[k]
        y1[z] = uy[i] - uy[k]
        x2[z] = ux[j] - ux[k]
        y2[z] = uy[j] - uy[k]


@njit(forceinline=True, **OPTIONS)
def rotated_stress(x1, y1, x2, y2, b1, b2, c1, c2, d0, d1, d2):
    """Rotation (cosine, sine) of a zone, Eq. (2), and its stress in the rotated frame, Eqs. (3, 4)."""
    f11 = 1 + b1 * x1 + b2 * x2
    f12 = c1 * x1 + c2 * x2
    f21 = b1 * y1 + b2 * y2
    f22 = 1 + c1 * y1 + c2 * y2
    cs = f11 + f22
    sn = f21 - f12
    r = 1 / math.sqrt(cs * cs + sn * sn)
    cs *= r
    sn *= r
    exx = cs * f11 + sn * f21 - 1
    eyy = cs * f22 - sn * f12 - 1
    gxy = cs * f12 + sn * f22 - sn * f11 + cs * f21
    return cs, sn, d0 * exx + d1 * eyy, d1 * exx + d0 * eyy, d2 * gxy, exx, eyy, gxy


@njit(**OPTIONS)
def zone_forces(x1, y1, x2, y2, b1, b2, c1, c2, area, d0, d1, d2, f1x, f1y, f2x, f2y):
    """Force of each zone on its first and second corner, Eq. (5); that on the third is minus their sum."""
    for z in range(x1.shape[0]):
        cs, sn, sx, sy, sxy, _, _, _ = rotated_stress(
            x1[z], y1[z], x2[z], y2[z], b1[z], b2[z], c1[z], c2[z], d0[z], d1[z], d2[z]
        )
        a = area[z]
        p11 = a * (cs * sx - sn * sxy)
        p12 = a * (cs * sxy - sn * sy)
        p21 = a * (sn * sx + cs * sxy)
        p22 = a * (sn * sxy + cs * sy)
        f1x[z] = b1[z] * p11 + c1[z] * p12
        f1y[z] = b1[z] * p21 + c1[z] * p22
        f2x[z] = b2[z] * p11 + c2[z] * p12
        f2y[z] = b2[z] * p21 + c2[z] * p22


@njit(**OPTIONS)
def scatter_forces(fx, fy, n0, n1, n2, f1x, f1y, f2x, f2y):
    """Add zone forces to nodes; a grain owns its nodes, so threads that own grains never meet here."""
    for z in range(n0.shape[0]):
        i, j, k = u32(n0[z]), u32(n1[z]), u32(n2[z])
        ax, ay, bx, by = f1x[z], f1y[z], f2x[z], f2y[z]
        fx[i] -= ax
        fy[i] -= ay
        fx[j] -= bx
        fy[j] -= by
        fx[k] += ax + bx
        fy[k] += ay + by


@njit(**OPTIONS)
def add_zone_forces(zones, nodes, thread):
    """Forces of a thread's zones on their nodes, block by block."""
    ux, uy, fx, fy = nodes.displacement[0], nodes.displacement[1], nodes.force[0], nodes.force[1]
    first, last = zones.share[thread], zones.share[thread + 1]
    for z in range(first, last, BLOCK):
        e = min(z + BLOCK, last)
        s = first + e - z  # every block uses the scratch rows from ``first`` on
        n0, n1, n2 = zones.corner[0, z:e], zones.corner[1, z:e], zones.corner[2, z:e]
        x1, y1, x2, y2 = zones.x1[first:s], zones.y1[first:s], zones.x2[first:s], zones.y2[first:s]
        f1x, f1y, f2x, f2y = zones.f1x[first:s], zones.f1y[first:s], zones.f2x[first:s], zones.f2y[first:s]
        gather_motion(ux, uy, n0, n1, n2, x1, y1, x2, y2)
        zone_forces(
            x1, y1, x2, y2, zones.b1[z:e], zones.b2[z:e], zones.c1[z:e], zones.c2[z:e], zones.area[z:e],
            zones.d0[z:e], zones.d1[z:e], zones.d2[z:e], f1x, f1y, f2x, f2y,
        )  # fmt: skip
        scatter_forces(fx, fy, n0, n1, n2, f1x, f1y, f2x, f2y)


@njit(**OPTIONS)
def zone_state(x1, y1, x2, y2, b1, b2, c1, c2, d0, d1, d2, sx, sy, sxy, energy):
    """Stress in the fixed axes (Cauchy's to within the strain) and strain energy density of each zone."""
    for z in range(x1.shape[0]):
        cs, sn, p, q, t, exx, eyy, gxy = rotated_stress(
            x1[z], y1[z], x2[z], y2[z], b1[z], b2[z], c1[z], c2[z], d0[z], d1[z], d2[z]
        )
        energy[z] = 0.5 * (p * exx + q * eyy + t * gxy)
        sx[z] = cs * cs * p + sn * sn * q - 2 * cs * sn * t
        sy[z] = sn * sn * p + cs * cs * q + 2 * cs * sn * t
        sxy[z] = cs * sn * (p - q) + (cs * cs - sn * sn) * t


def _zone_states(zones, displacement, rows):
    gather_motion(
        displacement[0], displacement[1], zones.corner[0], zones.corner[1], zones.corner[2],
        zones.x1, zones.y1, zones.x2, zones.y2,
    )  # fmt: skip
    zone_state(
        zones.x1, zones.y1, zones.x2, zones.y2, zones.b1, zones.b2, zones.c1, zones.c2, zones.d0, zones.d1, zones.d2,
        rows[0], rows[1], rows[2], rows[3],
    )  # fmt: skip


class Zones(Part):
    """The zones of elastic grains."""

    def __init__(self, specimen: Specimen) -> None:
        mesh = specimen.mesh
        chosen = specimen.is_elastic[mesh.zone_grain]
        self.chosen = slice(None) if chosen.all() else np.flatnonzero(chosen)  #: of the zones of the mesh
        gradients = shape_functions(mesh.nodes, mesh.zones)[[0, 1, 3, 4, 6]][:, self.chosen]
        stiffness = specimen.zone_stiffness[self.chosen]
        count = gradients.shape[1]
        self._before = np.concatenate([[0], np.cumsum(chosen)])[mesh.first_zone]
        corner = np.ascontiguousarray(mesh.zones[self.chosen].T, dtype=np.int32)
        constants = (stiffness[:, 0, 0], stiffness[:, 0, 1], stiffness[:, 2, 2])
        rows = [np.ascontiguousarray(row) for row in (*gradients, *constants)]
        rows += [np.zeros(count) for _ in range(8)] + [np.zeros(2, dtype=np.int64)]
        self.arrays = ZoneArrays(corner, *rows)

    def share(self, split: Split) -> np.ndarray:
        return self._before[split.grain]

    def stress_and_energy(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Stress (z, 3) Pa as xx, yy, xy in the fixed axes, and strain energy density (z,) J/m3, at (2, i) m."""
        rows = np.empty((4, self.arrays.corner.shape[1]))
        compiled(_zone_states)(self.arrays, displacement, rows)
        return rows[:3].T, rows[3]
