"""Numbers along space: what is near in space gets a near number, and lies near in memory."""

from __future__ import annotations

import numpy as np

LEVELS = 20  #: halvings of the box; 4 ** 20 cells still fit a 64 bit key


def hilbert_order(points: np.ndarray) -> np.ndarray:
    """Order of ``points`` (n, 2) along Hilbert's curve through the square round them (Hilbert 1891)."""
    low = points.min(axis=0)
    extent = max(np.ptp(points, axis=0).max(), np.finfo(float).tiny)
    x, y = np.minimum((points - low) / extent * 2**LEVELS, 2**LEVELS - 1).astype(np.int64).T
    key = np.zeros(len(points), dtype=np.int64)
    for level in reversed(range(LEVELS)):
        right, upper = x >> level & 1, y >> level & 1
        key = 4 * key + (3 * right ^ upper)
        # The quarters at the curve's ends are passed transposed, the last one upside down as well.
        flip = (upper == 0) & (right == 1)
        x, y = np.where(flip, ~x, x), np.where(flip, ~y, y)
        x, y = np.where(upper == 0, y, x), np.where(upper == 0, x, y)
    return np.argsort(key, kind="stable")
