"""Sizes that grow away from a place of interest."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.fields import ParameterError, checked_points, parameter
from grainlaw.messages import refusal


def _place(value: Any) -> tuple[tuple[float, float], ...]:
    points = checked_points("Graded: place", value)
    if not len(points):
        raise refusal("Graded: place", value, "a list of at least one point (x, y) in m")
    return tuple((x, y) for x, y in points.tolist())


@attrs.frozen(kw_only=True)
class Graded(metaclass=Checked):
    """A size that grows with the distance from a place: ``size + growth * distance``, at most ``largest``.

    Fine grains at the tip of a notch, and coarse ones far from it::

        Laguerre(grain_size=Graded(place=[(0.05, 0.02)], size=1 * mm, growth=0.2, largest=5 * mm))
    """

    place: tuple[tuple[float, float], ...] = attrs.field(converter=_place, metadata={"unit": "m"})  #: point or polyline
    size: float = parameter("m")  #: at the place
    growth: float = parameter("1", at_least=0, at_most=10)  #: m for each m of distance
    largest: float = parameter("m")  #: not exceeded anywhere

    def __attrs_post_init__(self) -> None:
        if self.largest < self.size:
            raise ParameterError(
                f"Graded: largest = {self.largest:g} m is not allowed, it must be at least the size, {self.size:g} m"
            )

    def at(self, points: np.ndarray) -> np.ndarray:
        """(n,) m, at points (n, 2) m."""
        corners = np.array(self.place)
        start, along = corners[:-1], np.diff(corners, axis=0)
        if len(corners) == 1:
            start, along = corners, np.zeros((1, 2))
        away = np.full(len(points), np.inf)
        for a, d in zip(start, along, strict=True):
            share = np.clip((points - a) @ d / max(d @ d, np.finfo(float).tiny), 0, 1)
            away = np.minimum(away, np.hypot(*(points - a - share[:, None] * d).T))
        return np.minimum(self.size + self.growth * away, self.largest)
