"""Irregular grains: the cells of random seeds."""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.geometry.cells.any_voronoi import SMALL, Cells, frame
from grainlaw.geometry.cells.bounded_voronoi import bounded_diagram, polygons
from grainlaw.geometry.cells.grain_size import grain_count, length, require_one
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.geometry.cells.ordering import hilbert_order
from grainlaw.geometry.cells.sides import is_convex
from grainlaw.parameter import parameter, whole_number
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation, Tessellator


@attrs.frozen(kw_only=True)
class Voronoi(Tessellator):
    """Voronoi cells of random seeds that Lloyd's algorithm has spread out.

    Give either ``grains``, their number, or ``grain_size``, the square root of their mean area. The first seeds are
    independent and uniform, too close pairs not rejected: Lloyd's algorithm parts them in its first iteration, and
    ``relaxation=0, merge=0`` is the Poisson-Voronoi tessellation that the literature has statistics of. Corners of more
    than 180 degrees part cells, to keep them convex: such regions get a few grains more.

    Lloyd 1982, doi:10.1109/TIT.1982.1056489.
    """

    grains: int | None = whole_number(at_least=1, default=None)
    grain_size: float | None = length()  #: m
    seed: int = whole_number(at_least=0, default=1)  #: of the random numbers
    relaxation: int = whole_number(at_least=0, at_most=1000, default=3)  #: Lloyd iterations: the more, the more even
    merge: float = parameter("grain sizes", default=0.25, at_least=0, below=1)  #: shorter edges vanish where they can

    def __attrs_post_init__(self) -> None:
        require_one(self)

    def tessellate(self, region: Region) -> Tessellation:
        """Fill a region; grains near in space are near in number."""
        count = grain_count(self, region)
        size, random = np.sqrt(region.area / count), np.random.default_rng(self.seed)
        if is_convex(region):
            seeds = _uniform(region, count, random)
            for _ in range(self.relaxation):
                seeds = bounded_diagram(region, seeds).centroids()
            cells, smallest = polygons(region, bounded_diagram(region, seeds[hilbert_order(seeds)])), 0.0
        else:
            seeds = _scattered(region, count, random)
            for _ in range(self.relaxation):
                seeds = Cells(region, seeds, size).next_seeds(relaxed=True)
            cells, smallest = Cells(region, seeds[hilbert_order(seeds)], size).tiling(), SMALL * size**2
        return merge_short_edges(cells, self.merge * size, smallest).tessellation()


def _uniform(region: Region, count: int, random: np.random.Generator) -> np.ndarray:
    """(count, 2) m, independent points of uniform density in a convex region, drawn from a fan of triangles."""
    corner, a, b = region.outline[0], region.outline[1:-1], region.outline[2:]
    a, b = a - corner, b - corner
    areas = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    triangle = random.choice(len(areas), size=count, p=areas / areas.sum())
    out, across = np.sqrt(random.random(count))[:, None], random.random(count)[:, None]
    return corner + out * (a[triangle] + across * (b - a)[triangle])


def _scattered(region: Region, count: int, random: np.random.Generator) -> np.ndarray:
    """(count, 2) m, independent points of uniform density in a region, drawn from its frame."""
    around, seeds = frame(region), np.empty((0, 2))
    while len(seeds) < count:
        drawn = _uniform(around, count, random)
        seeds = np.concatenate([seeds, drawn[region.contains(drawn)]])
    return seeds[:count]
