"""Regions of common shape."""

from __future__ import annotations

import math
from numbers import Real

import numpy as np

from grainlaw.parameter import ParameterError
from grainlaw.tessellation import Region


def rectangle(width: float, height: float) -> Region:
    """Upright rectangle (m), lower left corner at the origin; sides bottom, right, top and left.

    Raises :class:`~grainlaw.parameter.ParameterError`.
    """
    for name, value in (("width", width), ("height", height)):
        if not isinstance(value, Real) or isinstance(value, bool) or not 0 < value < math.inf:
            raise ParameterError(f"rectangle: {name} = {value!r} m is not allowed, it must be a finite number above 0")
    corners = np.array([(0, 0), (width, 0), (width, height), (0, height)], dtype=float)
    return Region(corners, ("bottom", "right", "top", "left"))
