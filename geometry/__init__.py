"""Regions, tessellators, minerals, grains from elsewhere, and specimens of several bodies."""

from grainlaw.geometry.bodies import apart, between_platens, block, lying, moved, together, wall
from grainlaw.geometry.breakable import Breakable, Cleavage, GrainCells, Trigons, VoronoiCells
from grainlaw.geometry.cells.slivers import SliverWarning
from grainlaw.geometry.cracked import Cracked
from grainlaw.geometry.joint_sets import JointSet, JointSets
from grainlaw.geometry.joints import Jointed
from grainlaw.geometry.labels import LabelAgreement, from_labels, label_agreement
from grainlaw.geometry.laguerre import Laguerre
from grainlaw.geometry.meshes import from_mesh, write_geo
from grainlaw.geometry.minerals import Minerals
from grainlaw.geometry.neper import read_tess, write_tess
from grainlaw.geometry.polygons import from_polygons
from grainlaw.geometry.region import disc, notched_beam, plate_with_hole, polygon, rectangle, semi_disc, shear_box
from grainlaw.geometry.regular import Bricks, Hexagonal
from grainlaw.geometry.sizes import ByPhase, Empirical, Even, Graded, Lognormal, NaturalGrowth, Sizes
from grainlaw.geometry.texture import Texture, texture
from grainlaw.geometry.voronoi import Voronoi

__all__ = [
    "Breakable", "Bricks", "ByPhase", "Cleavage", "Cracked", "Empirical", "Even", "Graded", "GrainCells",
    "Hexagonal", "JointSet", "JointSets", "Jointed", "LabelAgreement", "Laguerre", "Lognormal", "Minerals",
    "NaturalGrowth", "Sizes", "SliverWarning", "Texture", "Trigons", "Voronoi", "VoronoiCells", "apart",
    "between_platens", "block", "disc", "from_labels", "from_mesh", "from_polygons", "label_agreement", "lying",
    "moved", "notched_beam", "plate_with_hole", "polygon", "read_tess", "rectangle", "semi_disc", "shear_box",
    "texture", "together", "wall", "write_geo", "write_tess",
]  # fmt: skip


def __dir__() -> list[str]:  # a notebook offers what is public, not the modules that it came from
    return [*__all__]
