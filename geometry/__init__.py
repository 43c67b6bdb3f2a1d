"""Regions, tessellators, and specimens of several bodies."""

from grainlaw.geometry.bodies import block, moved, together
from grainlaw.geometry.breakable import Breakable, Cleavage, GrainCells, Trigons, VoronoiCells
from grainlaw.geometry.bricks import Bricks
from grainlaw.geometry.hexagonal import Hexagonal
from grainlaw.geometry.joint_sets import JointSet, JointSets
from grainlaw.geometry.joints import Jointed
from grainlaw.geometry.loose import apart, wall
from grainlaw.geometry.minerals import Minerals
from grainlaw.geometry.platens import between_platens
from grainlaw.geometry.region import polygon, rectangle, shear_box
from grainlaw.geometry.shapes import disc, notched_beam, semi_disc
from grainlaw.geometry.texture import Texture, texture
from grainlaw.geometry.voronoi import Voronoi

__all__ = [
    "Breakable",
    "Bricks",
    "Cleavage",
    "GrainCells",
    "Hexagonal",
    "JointSet",
    "JointSets",
    "Jointed",
    "Minerals",
    "Texture",
    "Trigons",
    "Voronoi",
    "VoronoiCells",
    "apart",
    "between_platens",
    "block",
    "disc",
    "moved",
    "notched_beam",
    "polygon",
    "rectangle",
    "semi_disc",
    "shear_box",
    "texture",
    "together",
    "wall",
]
