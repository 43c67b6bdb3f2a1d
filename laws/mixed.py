"""One damage for two modes, shared by the laws that measure it along the softening branches."""

from __future__ import annotations

import math

TINY = 1e-30  #: in place of a divisor of 0, times a size of the law: without strength the peak slip is 0


def joined(d1: float, d2: float) -> tuple[float, float]:
    """Damage of a contact, and the share of shear in it, from the damage in tension ``d1`` and in shear ``d2`` alone.

    D = sqrt(D_I^2 + D_II^2), up to 1.
    """
    square = d1 * d1 + d2 * d2
    return min(math.sqrt(square), 1.0), d2 * d2 / max(square, TINY)
