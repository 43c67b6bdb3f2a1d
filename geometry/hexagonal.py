"""Regular grains: hexagons."""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.geometry.bounded_voronoi import bounded_diagram, polygons
from grainlaw.geometry.grain_size import grain_count, length, require_one, whole_number
from grainlaw.geometry.merging import merge_short_edges
from grainlaw.geometry.ordering import hilbert_order
from grainlaw.geometry.sides import convex_sides
from grainlaw.tessellation import Region, Tessellation, Tessellator

SHORTEST = 0.25  #: of the grain size: the shortest edge that the sides of the region may cut off


@attrs.frozen(kw_only=True)
class Hexagonal(Tessellator):
    """Regular hexagons about the middle of a convex region; those at its sides are cut by them or reach out to them.

    Give either ``grain_size``, the square root of the area of a whole hexagon, or ``grains``, about how many fit.
    """

    grains: int | None = whole_number(at_least=1, default=None)
    grain_size: float | None = length()  #: m

    def __attrs_post_init__(self) -> None:
        require_one(self)

    def tessellate(self, region: Region) -> Tessellation:
        """Fill a convex region; grains near in space are near in number."""
        count = grain_count(self, region)
        size = self.grain_size or np.sqrt(region.area / count)
        seeds = _lattice(region, size * np.sqrt(2 / np.sqrt(3)))
        cells = polygons(region, bounded_diagram(region, seeds[hilbert_order(seeds)]))
        return merge_short_edges(cells, SHORTEST * size).tessellation()


def _lattice(region: Region, spacing: float) -> np.ndarray:
    """(n, 2) m, the middle of the region and all centres of hexagons round it that lie well inside."""
    pitch = spacing * np.array([1, np.sqrt(0.75)])
    n, m = np.ceil(np.ptp(region.bounds, axis=0) / pitch) + 1
    row, place = (i.ravel() for i in np.mgrid[-m : m + 1, -n : n + 1])
    points = region.outline.mean(axis=0) + pitch * np.column_stack([place + row % 2 / 2, row])
    depth = convex_sides(region).distance(points).min(axis=1)
    # Thinner cuts would be slivers; the middle stays also where the region is narrower than that.
    return points[depth > min(spacing / 4, depth.max() / 2)]
