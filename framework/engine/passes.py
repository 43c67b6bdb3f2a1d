"""The passes of one time step, each a simple loop over structures of arrays that the compiler vectorises.

Index letters: ``i`` node, ``z`` zone, ``c`` interface, ``p`` contact point, ``g`` grain. Equation numbers are those of
docs/theory.md.
"""

import math

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS

u32 = np.uint32  # unsigned indices need no wrap-around code


@njit(**OPTIONS)
def gather_zones(ux, uy, n0, n1, n2, x1, y1, x2, y2):
    """Motion of the first and second corner of each zone against its third."""
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
    """Force of each zone on its first and second corner, Eq. (5); the third takes the reverse of both."""
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
def scatter_zones(fx, fy, n0, n1, n2, f1x, f1y, f2x, f2y):
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
def gather_contacts(ux, uy, a1, a2, b1, b2, d1x, d1y, d2x, d2y, ex, ey):
    """Motion of grain B against A at both ends of an interface, and the change of its mean edge."""
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
def contact_kinematics(d1x, d1y, d2x, d2y, ex, ey, edge_x, edge_y, weight, nx, ny, inverse, o1, o2, s1, s2):
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
    """How many interfaces have an end that has moved farther than the root of ``reach``."""
    count = 0
    for c in range(d1x.shape[0]):
        first, second = d1x[c] * d1x[c] + d1y[c] * d1y[c], d2x[c] * d2x[c] + d2y[c] * d2y[c]
        count += max(first, second) > reach[c]
    return count


@njit(**OPTIONS)
def contact_work(now, before, traction_now, traction_before, work):
    """Work done on each contact point by the trapezoidal rule, which closes the discrete energy balance, Eq. (12)."""
    for p in range(now.shape[0]):
        work[p] += 0.5 * (traction_now[p] + traction_before[p]) * (now[p] - before[p])


@njit(**OPTIONS)
def contact_forces(
    nx, ny, inverse, half, weight, n1, t1, n2, t2, o1, o2, s1, s2, a1x, a2x, b1x, b2x, a1y, a2y, b1y, b2y
):
    """Nodal forces of an interface, Eq. (8): the tractions, and the couple that balances their offset."""
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
    """Add to each node the forces of the two interface ends it may have, in a fixed order."""
    for i in range(fx.shape[0]):
        j, k = u32(first[i]), u32(second[i])
        fx[i] += cx[j] + cx[k]
        fy[i] += cy[j] + cy[k]


@njit(**OPTIONS)
def press(pressures, column, first, second, edge_x, edge_y, ux, uy, fx, fy, px, py, moved_x, moved_y, work):
    """Add the force of a pressure, normal to each edge as it lies, half to each of its ends; its work, Eq. (11)."""
    for e in range(column.shape[0]):
        i, j = first[e], second[e]
        p = pressures[column[e]]
        force_x = -p * (edge_y[e] + uy[j] - uy[i])
        force_y = p * (edge_x[e] + ux[j] - ux[i])
        fx[i] += 0.5 * force_x
        fx[j] += 0.5 * force_x
        fy[i] += 0.5 * force_y
        fy[j] += 0.5 * force_y
        x, y = 0.5 * (ux[i] + ux[j]), 0.5 * (uy[i] + uy[j])
        work[e] += 0.5 * ((px[e] + force_x) * (x - moved_x[e]) + (py[e] + force_y) * (y - moved_y[e]))
        px[e], py[e], moved_x[e], moved_y[e] = force_x, force_y, x, y


@njit(**OPTIONS)
def impose(velocities, row, index, column, time_step, force, velocity, mass, imposed, reaction, total, work):
    """Set the velocity of driven freedoms; their reaction, its sum over steps and its work, Eq. (11)."""
    for d in range(row.shape[0]):
        r, i = row[d], index[d]
        before = velocity[r, i]
        after = velocities[column[d]]
        imposed[r, i] = after
        external = mass[r, i] * (after - before) / time_step - force[r, i]
        reaction[d] = external
        total[d] += external
        work[d] += external * 0.5 * (before + after) * time_step


@njit(**OPTIONS)
def grain_forces(first, arm_x, arm_y, angle, fx, fy, gx, gy, moment, begin, end):
    """Resultant force and moment on each rigid grain of the forces at its corners."""
    for g in range(begin, end):
        cs, sn = math.cos(angle[g]), math.sin(angle[g])
        sum_x, sum_y, sum_m = 0.0, 0.0, 0.0
        for i in range(first[g], first[g + 1]):
            x = cs * arm_x[i] - sn * arm_y[i]
            y = sn * arm_x[i] + cs * arm_y[i]
            sum_x += fx[i]
            sum_y += fy[i]
            sum_m += x * fy[i] - y * fx[i]
        gx[g] = sum_x
        gy[g] = sum_y
        moment[g] = sum_m


@njit(**OPTIONS)
def place_nodes(first, arm_x, arm_y, angle, gx, gy, ux, uy, begin, end):
    """Put the corners of each rigid grain where its translation and rotation carry them."""
    for g in range(begin, end):
        half = math.sin(0.5 * angle[g])
        cs, sn = -2 * half * half, math.sin(angle[g])  # cos - 1 without cancellation
        for i in range(first[g], first[g + 1]):
            ux[i] = gx[g] + cs * arm_x[i] - sn * arm_y[i]
            uy[i] = gy[g] + sn * arm_x[i] + cs * arm_y[i]


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
