"""Stress in a part of a specimen."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from grainlaw.polygon import enclosed
from grainlaw.tessellation import Tessellation

Window = Callable[[np.ndarray], np.ndarray]  #: which of the points (k, 2) m lie inside; any such function will do


def within_rectangle(low: Any, high: Any) -> Window:
    """Window between two corners (m), both included."""
    return lambda points: ((points >= low) & (points <= high)).all(axis=1)


def within_circle(centre: Any, radius: float) -> Window:
    """Window round a point (m)."""
    return lambda points: np.hypot(*(points - np.asarray(centre)).T) <= radius


def within_polygon(corners: Any) -> Window:
    """Window with corners (n, 2) m, one after the other either way round; it need not be convex."""
    start = np.asarray(corners, dtype=float)
    return lambda points: enclosed(points, start, np.roll(start, -1, axis=0))


def window_mean(grains: Tessellation, stress: np.ndarray, window: Window) -> np.ndarray:
    """(3,) mean over the area of the grains whose undeformed centroid lies in a window, of (g, 3); nan if none does."""
    inside = window(grains.centroids)
    if not inside.any():
        return np.full(3, np.nan)
    return np.average(stress[inside], axis=0, weights=grains.areas[inside])
