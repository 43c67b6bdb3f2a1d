"""One damage for two modes, shared by the laws that measure it along the softening branches."""

from __future__ import annotations

import math

TINY = 1e-30  # of what a law has of its own, in place of a zero divisor: no strength gives a peak slip of nothing


def joined(d1: float, d2: float) -> tuple[float, float]:
    """Damage of a contact as far (0 or more) along its branches in tension and shear, and the share of shear in it.

    D = sqrt(D_I^2 + D_II^2), up to 1.
    """
    square = d1 * d1 + d2 * d2
    return min(math.sqrt(square), 1.0), d2 * d2 / max(square, TINY)
