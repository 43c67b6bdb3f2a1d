"""Regions, tessellators, grains from elsewhere, and specimens of several bodies."""

from grainlaw.geometry.bodies import block, moved, together
from grainlaw.geometry.bricks import Bricks
from grainlaw.geometry.hexagonal import Hexagonal
from grainlaw.geometry.joint_sets import JointSet, JointSets
from grainlaw.geometry.labels import LabelAgreement, from_labels, label_agreement
from grainlaw.geometry.laguerre import Laguerre
from grainlaw.geometry.loose import apart, wall
from grainlaw.geometry.meshes import from_mesh, write_geo
from grainlaw.geometry.neper import read_tess, write_tess
from grainlaw.geometry.platens import between_platens
from grainlaw.geometry.polygons import from_polygons
from grainlaw.geometry.region import polygon, rectangle, shear_box
from grainlaw.geometry.shapes import disc, notched_beam, semi_disc
from grainlaw.geometry.sizes import ByPhase, Empirical, Even, Lognormal, NaturalGrowth, Sizes
from grainlaw.geometry.voronoi import Voronoi

__all__ = [
    "Bricks",
    "ByPhase",
    "Empirical",
    "Even",
    "Hexagonal",
    "JointSet",
    "JointSets",
    "LabelAgreement",
    "Laguerre",
    "Lognormal",
    "NaturalGrowth",
    "Sizes",
    "Voronoi",
    "apart",
    "between_platens",
    "block",
    "disc",
    "from_labels",
    "from_mesh",
    "from_polygons",
    "label_agreement",
    "moved",
    "notched_beam",
    "polygon",
    "read_tess",
    "rectangle",
    "semi_disc",
    "shear_box",
    "together",
    "wall",
    "write_geo",
    "write_tess",
]
