"""Windows: parts of a specimen in which stresses are averaged."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError, checked_number, checked_points, checked_vector
from grainlaw.messages import short
from grainlaw.polygon import enclosed
from grainlaw.tessellation import Tessellation

Window = Callable[[np.ndarray], np.ndarray]  #: which of the points (k, 2) m lie inside; any such function will do


@checked
def within_rectangle(low: Any, high: Any) -> Window:
    """Window between two corners (m), both included."""
    low, high = checked_vector("within_rectangle: low", low), checked_vector("within_rectangle: high", high)
    return lambda points: ((points >= low) & (points <= high)).all(axis=1)


@checked
def within_circle(centre: Any, radius: float) -> Window:
    """Window round a point (m)."""
    centre = checked_vector("within_circle: centre", centre)
    checked_number("within_circle: radius", radius, "m", above=0)
    return lambda points: np.hypot(*(points - centre).T) <= radius


@checked
def within_polygon(corners: Any) -> Window:
    """Window with corners (n, 2) m in order, clockwise or counter-clockwise; it need not be convex."""
    start = checked_points("within_polygon: corners", corners)
    return lambda points: enclosed(points, start, np.roll(start, -1, axis=0))


def window_mean(grains: Tessellation, stress: np.ndarray, window: Window) -> np.ndarray:
    """(3,) area mean of (g, 3) over the grains whose undeformed centroid lies in a window; nan if there is none."""
    try:
        inside = np.asarray(window(grains.centroids))
    except Exception as error:
        raise ParameterError(f"window: {short(window)} cannot be asked: {type(error).__name__}: {error}") from error
    if inside.shape != (grains.count,) or inside.dtype != bool:
        raise ParameterError(
            f"window: {short(window)} answers {short(inside)} for (n, 2) points, it must be an array of n True or False"
        )
    if not inside.any():
        return np.full(3, np.nan)
    return np.average(stress[inside], axis=0, weights=grains.areas[inside])
