"""The rows by which passes over a chunk of contacts hand numbers to each other: where each begins in the scratch.

``r[AX + k]`` is the x component of edge a of contact ``k`` of the chunk. All rows of a thread lie in one array, at
distances that the compiler knows: it need not ask before a loop whether they share memory, and would not for so many.
"""

from __future__ import annotations

import numpy as np

BLOCK = 512  #: contacts that go through all passes together; a multiple of ``LANES``
ROW = BLOCK + 24  #: not a power of two: equal places of all rows would compete for the same lines of the cache

AX, AY, BX, BY, WX, WY = (n * ROW for n in range(6))  #: m, edge a, edge b in the direction of a, start of a to end of b
DAX, DAY, DBX, DBY, DWX, DWY = (n * ROW for n in range(6, 12))  #: m, increments of these vectors in the last step
ANGLE_1A, ANGLE_2A, ANGLE_1B, ANGLE_2B = (n * ROW for n in range(12, 16))  #: cotangents at start and end of a, of b
STATE, STANDS, OFFSET, LIFT, LARGEST = (n * ROW for n in range(16, 21))  #: STANDS: arrangement of the edges
TOUCH, OVERLAP, LENGTH, TX, TY = (n * ROW for n in range(21, 26))  #: TOUCH: ``NOT``, ``SOME`` or ``FAR``; tangent
SHARE_A, SHARE_B, LEVER_A, LEVER_B = (n * ROW for n in range(26, 30))  #: where the force acts: along edges, off them
TWIST, OPENED, SLID, BEFORE = (n * ROW for n in range(30, 34))  #: moment over normal force; motion; length before (m)
OPENING, SLIP, NORMAL, SHEAR, NEW_LIFT = (n * ROW for n in range(34, 39))  #: of the law
FX, FY, GX, GY, HX, HY = (n * ROW for n in range(39, 45))  #: N, force on A, of it on the end of a, on the start of b
DASHPOT, SHEAR_FORCE, DAMPING_FORCE = (n * ROW for n in range(45, 48))
OPENING_WORK, SLIP_WORK, DAMPING_WORK = (n * ROW for n in range(48, 51))  #: J, in the last step
SPRING, DAMPING = (n * ROW for n in range(51, 53))  #: N along the normal
ASKED, LIFT_BEFORE = (n * ROW for n in range(53, 55))  #: m, opening at which a law is asked again; lift a step before
LOW, LOW_PRESSURE, HIGH, HIGH_PRESSURE = (n * ROW for n in range(55, 59))  #: closures (m) between which one is sought
MEMORY = 59 * ROW  #: as many rows as the laws have, and as many again for a trial


def rows_of(count: int, depth: int, row: int = ROW) -> np.ndarray:
    """(count, n) scratch for so many threads or chunks, and laws with ``depth`` rows of memory."""
    return np.zeros((count, (MEMORY // ROW + 2 * depth) * row))
