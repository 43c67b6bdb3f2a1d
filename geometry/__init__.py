"""Regions and tessellators."""

from grainlaw.geometry.bricks import Bricks
from grainlaw.geometry.hexagonal import Hexagonal
from grainlaw.geometry.region import polygon, rectangle, shear_box
from grainlaw.geometry.rock_tests import disc, notched_beam, semi_disc
from grainlaw.geometry.voronoi import Voronoi

__all__ = [
    "Bricks",
    "Hexagonal",
    "Voronoi",
    "disc",
    "notched_beam",
    "polygon",
    "rectangle",
    "semi_disc",
    "shear_box",
]
