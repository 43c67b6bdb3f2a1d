"""What the worst place of a tessellation costs in time steps, and short edges of grains from elsewhere merged."""

from __future__ import annotations

import warnings

from grainlaw.geometry.cells.any_voronoi import NEAR
from grainlaw.geometry.cells.joining import tiling_of
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.geometry.cells.sides import region_sides
from grainlaw.mesh import build_mesh
from grainlaw.messages import users_line
from grainlaw.tessellation import Tessellation

FLATTEST = 1e-7  #: sine of the smallest turn: drawn slivers are far thinner than those that tessellators leave
COSTLY = 0.1  #: of the step that most zones allow: below it there is a warning


class SliverWarning(UserWarning):
    """The stable time step is ruled by a single place of grains from elsewhere."""


def without_short_edges(grains: Tessellation, merge: float) -> Tessellation:
    """Edges shorter than ``merge`` times the grain size merged, and thin triangles, wherever grains stay convex."""
    size, sides = grains.grain_size, region_sides(grains.region)
    tiling = tiling_of(grains.region, grains.vertices[grains.corners], grains.first, NEAR * size)
    return merge_short_edges(tiling, merge * size, merge * size**2 / 2, sides, FLATTEST).tessellation(grains)


def warn_of_slivers(where: str, grains: Tessellation) -> None:
    """Warn (:class:`SliverWarning`) where one place of the grains costs more than ten times the time steps.

    Raises ParameterError where it costs more than a million times as many: no run would end.
    """
    mesh = build_mesh(grains)
    mesh.check_areas(where)
    ratio, cell = mesh.worst_step
    if ratio < COSTLY:
        edges = grains.edges
        shortest = edges.length[(edges.left == cell) | (edges.right == cell)].min()
        x, y = grains.centroids[cell]
        words = (
            f"{where}: the stable time step is {ratio:.2g} of what most zones allow, ruled by cell {cell} at "
            f"({x:.6g}, {y:.6g}) m, with an edge of {shortest:.2g} m in grains of {grains.grain_size:.2g} m; "
            "merge=0.1 removes edges below a tenth of the grain size"
        )
        warnings.warn(SliverWarning(words), stacklevel=users_line())
