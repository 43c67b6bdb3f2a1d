"""Regions of common shape."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

import numpy as np

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError, checked_points
from grainlaw.messages import short
from grainlaw.polygon import areas_and_centroids
from grainlaw.region import Region


def check_sizes(shape: str, *, below: float = math.inf, unit: str = "m", zero: bool = False, **values: Any) -> None:
    """Refuse values that are no numbers above 0 (or 0) and below a bound."""
    least = "at least 0" if zero else "above 0"
    limit = "" if below == math.inf else f" and below {below:g}"
    for name, value in values.items():
        number = isinstance(value, Real) and not isinstance(value, bool)
        if not number or not (0 < value < below or (zero and value == 0)):
            raise ParameterError(
                f"{shape}: {name} = {short(value)} {unit} is not allowed, it must be a finite number {least}{limit}"
            )


@checked
def rectangle(width: float, height: float) -> Region:
    """Upright rectangle (m), lower left corner at the origin; sides bottom, right, top and left.

    Raises :class:`~grainlaw.fields.ParameterError`.
    """
    check_sizes("rectangle", width=width, height=height)
    corners = np.array([(0, 0), (width, 0), (width, height), (0, height)], dtype=float)
    return Region(corners, ("bottom", "right", "top", "left"))


@checked
def polygon(points: Any, names: str | Sequence[str] = "boundary", holes: Mapping[str, Any] | None = None) -> Region:
    """Simple polygon with corners ``points`` (n, 2) m, clockwise or not.

    ``names`` has the name of the side from each corner to the next, or one for all; ``holes`` has an outline for each
    name. Raises :class:`~grainlaw.fields.ParameterError`.
    """
    outline = checked_points("polygon: points", points)
    sides = (names,) * len(outline) if isinstance(names, str) else tuple(names)
    if _clockwise(outline) and len(sides) == len(outline):
        outline, sides = outline[::-1], (*sides[-2::-1], sides[-1])
    rings = {name: checked_points(f"polygon: hole {short(name)}", ring) for name, ring in (holes or {}).items()}
    clockwise = [ring if _clockwise(ring) else ring[::-1] for ring in rings.values()]
    return Region(outline, sides, clockwise, [(name,) * len(ring) for name, ring in rings.items()])


def _clockwise(ring: np.ndarray) -> bool:
    """Whether a ring runs clockwise; one of too few corners, which the region refuses, runs nowhere."""
    return len(ring) > 2 and bool(areas_and_centroids(ring.astype(float), np.array([0, len(ring)]))[0][0] < 0)


@checked
def shear_box(width: float, height: float, gap: float = 0.0) -> Region:
    """Upright rectangle (m) whose sides are split at half its height, for a shear box in halves.

    Sides bottom, right_lower, right_upper, top, left_upper and left_lower; with a ``gap`` between the halves of the box
    the free pieces right_gap and left_gap too. Raises :class:`~grainlaw.fields.ParameterError`.
    """
    check_sizes("shear_box", width=width, height=height)
    check_sizes("shear_box", below=height, zero=True, gap=gap)
    low, high = (height - gap) / 2, (height + gap) / 2
    right, left = [(width, low), (width, high)], [(0, high), (0, low)]
    between = ["right_gap"], ["left_gap"]
    if gap == 0:
        right, left, between = right[:1], left[:1], ([], [])
    corners = [(0, 0), (width, 0), *right, (width, height), (0, height), *left]
    names = ["bottom", "right_lower", *between[0], "right_upper", "top", "left_upper", *between[1], "left_lower"]
    return Region(np.array(corners, dtype=float), tuple(names))
