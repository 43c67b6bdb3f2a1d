"""Calls from compiled code to compiled code that is known only by its address: laws and integrators.

A jitted function as an argument would do too, but its type is its own: numba would compile the loop over steps anew for
each law.
"""

from __future__ import annotations

from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.numba_private import call, load_float

#: A law is called for a multiple of so many contacts, but for the last interfaces of its group: whether the compiler
#: rounds the few that do not fill its vectors in another order, as it may, then does not depend on where threads and
#: tables begin.
LANES = 64


NEVER, ALWAYS = -1, -2  #: in place of the row of the damage


@njit(forceinline=True, **OPTIONS)
def unbonded(group, g, p):
    """Whether nothing bonds contact point ``p`` of row ``g`` any more."""
    row = group[g, 9]
    if row < 0:
        return row == ALWAYS
    return load_float(group[g, 4] + 8 * (row * group[g, 5] + p - group[g, 8])) >= 1.0


@njit(forceinline=True, **OPTIONS)
def respond(group, g, first, last, opening, slip, normal, shear):
    """Let the law of row ``g`` of a table answer for contact points ``first`` to ``last``.

    A row: address, parameters, per-contact parameters and their stride, memory and its stride, the first and the last
    contact point, the point that the first of the parameters and of the memory belong to, and the row of the memory
    that is the damage (``NEVER`` where there is none, ``ALWAYS`` where the law bonds nothing).
    """
    offset = 8 * (first - group[g, 8])
    call(
        group[g, 0],
        (
            group[g, 1], group[g, 2] + offset, group[g, 3], group[g, 4] + offset, group[g, 5],
            opening + 8 * first, slip + 8 * first, normal + 8 * first, shear + 8 * first, last - first,
        ),
    )  # fmt: skip
