"""Regions and tessellators."""

from grainlaw.geometry.bricks import Bricks
from grainlaw.geometry.hexagonal import Hexagonal
from grainlaw.geometry.region import rectangle
from grainlaw.geometry.voronoi import Voronoi

__all__ = ["Bricks", "Hexagonal", "Voronoi", "rectangle"]
