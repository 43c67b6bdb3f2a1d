"""The passes over bonds, each a simple loop over structures of arrays that the compiler vectorises.

Index letters: ``c`` bond, ``p`` contact point, ``i`` node. Equation numbers are those of docs/theory.md.
"""

import math

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS

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
