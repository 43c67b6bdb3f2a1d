"""Grains as data: the region they fill, the polygons that fill it, and the interface of what makes them."""

from __future__ import annotations

from abc import ABC, abstractmethod

import attrs
import numpy as np


@attrs.frozen(eq=False)
class Region:
    """A simple polygon to be filled with grains; every side carries the name of the boundary it belongs to."""

    outline: np.ndarray  #: (n, 2) m, counter-clockwise
    sides: tuple[str, ...]  #: name of the side from corner k to corner k + 1


@attrs.frozen(eq=False)
class Tessellation:
    """Convex polygons that cover a region without gap or overlap and meet along whole edges.

    Index letters: ``v`` vertex, ``g`` grain. The corners of grain g are ``corners[first[g]:first[g + 1]]``,
    counter-clockwise.
    """

    region: Region
    vertices: np.ndarray  #: (v, 2) m
    corners: np.ndarray  #: vertex numbers of all grains in a row
    first: np.ndarray  #: (g + 1,)
    phase: np.ndarray  #: (g,) mineral phase of each grain


class Tessellator(ABC):
    """Makes grains."""

    @abstractmethod
    def tessellate(self, region: Region) -> Tessellation:
        """Fill the region; the same component gives the same grains."""
