"""Irregular grains: the cells of random seeds."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from scipy.spatial import cKDTree

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError, checked_field, parameter, whole_number
from grainlaw.geometry.cells.any_voronoi import SMALL, Cells
from grainlaw.geometry.cells.bounded_voronoi import bounded_diagram, polygons
from grainlaw.geometry.cells.grain_size import check_memory, grain_count, length, require_one, some_points
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.geometry.cells.seeds import hilbert_order, scattered_points, uniform_points
from grainlaw.geometry.cells.sides import depths, is_convex
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation, Tessellator

CLOSEST = 1e-6  #: of the grain size: nearer points are the same, or on a side


def _points(where: str, value: Any) -> tuple[tuple[float, float], ...] | None:
    return None if value is None else some_points(where, value)


@attrs.frozen(kw_only=True)
class Voronoi(Tessellator):
    """Voronoi cells of random seeds that Lloyd's algorithm has spread out.

    Give either ``grains``, their number, or ``grain_size``, the square root of their mean area, or seeds of your own:
    ``points`` (n, 2) m inside the region, which stay where they are. Other seeds are first
    independent and uniform, too close pairs not rejected: Lloyd's algorithm parts them in its first iteration, and
    ``relaxation=0, merge=0`` is the Poisson-Voronoi tessellation that the literature has statistics of. Corners of more
    than 180 degrees part cells, to keep them convex: such regions get a few grains more.

    Lloyd 1982, doi:10.1109/TIT.1982.1056489.
    """

    grains: int | None = whole_number(at_least=1, default=None)  #: number of grains; give this, grain_size or points
    grain_size: float | None = length()  #: square root of their mean area
    points: tuple[tuple[float, float], ...] | None = checked_field(_points, default=None)  #: seeds, m
    seed: int = whole_number(at_least=0, default=1)  #: of the random numbers
    relaxation: int = whole_number(at_least=0, at_most=1000, default=3)  #: Lloyd iterations: the more, the more even
    merge: float = parameter("grain sizes", default=0.25, at_least=0, below=1)  #: shorter edges vanish where they can

    def __attrs_post_init__(self) -> None:
        require_one(self, "points")

    @checked
    def tessellate(self, region: Region) -> Tessellation:
        """Fill a region; grains near in space are near in number. Raises ParameterError."""
        own = self._own_points(region)
        count = grain_count(self, region) if own is None else len(own)
        size, random = np.sqrt(region.area / count), np.random.default_rng(self.seed)
        rounds = self.relaxation if own is None else 0
        if is_convex(region):
            seeds = uniform_points(region, count, random) if own is None else own
            for _ in range(rounds):
                seeds = bounded_diagram(region, seeds).centroids()
            cells, smallest = polygons(region, bounded_diagram(region, seeds[hilbert_order(seeds)])), 0.0
        else:
            seeds = scattered_points(region, count, random) if own is None else own
            for _ in range(rounds):
                seeds = Cells(region, seeds, size).next_seeds(relaxed=True)
            cells, smallest = Cells(region, seeds[hilbert_order(seeds)], size).tiling(), SMALL * size**2
        return merge_short_edges(cells, self.merge * size, smallest).tessellation()

    def _own_points(self, region: Region) -> np.ndarray | None:
        """(n, 2) m. Raises ParameterError for one that is not inside, or all but on another one."""
        if self.points is None:
            return None
        points = np.array(self.points)
        near = CLOSEST * np.sqrt(region.area / len(points))
        outside = depths(region, points) <= near
        if outside.any():
            number = int(outside.argmax())
            raise ParameterError(f"Voronoi: points[{number}] = {self.points[number]} m is not inside the region")
        check_memory("Voronoi", f"{len(points)} points", len(points))
        pairs = cKDTree(points).query_pairs(near, output_type="ndarray")
        if len(pairs):
            low, high = min(map(tuple, np.sort(pairs, axis=1).tolist()))
            raise ParameterError(f"Voronoi: points[{low}] and points[{high}] = {self.points[high]} m are the same")
        return points
