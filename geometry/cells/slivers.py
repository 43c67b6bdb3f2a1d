"""What the worst place of a tessellation costs in time steps, and short edges of grains from elsewhere merged."""

from __future__ import annotations

import warnings

import numpy as np

from grainlaw.fields import ParameterError
from grainlaw.geometry.cells.any_voronoi import NEAR
from grainlaw.geometry.cells.joining import tiling_of
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.geometry.cells.sides import region_sides
from grainlaw.mesh import build_mesh
from grainlaw.tessellation import Tessellation

FLATTEST = 1e-7  #: sine of the smallest turn: drawn slivers are far thinner than those that tessellators leave
COSTLY, ENDLESS = 0.1, 1e-6  #: of the step that most zones allow: below them there is a warning, an error


class SliverWarning(UserWarning):
    """The stable time step is ruled by a single place of grains from elsewhere."""


def worst_step(grains: Tessellation) -> tuple[float, int]:
    """Lowest root of mass over stiffness of a node, for density and modulus 1, over the median; and its cell."""
    mesh = build_mesh(grains)
    corners, areas = mesh.nodes[mesh.zones], mesh.zone_areas
    opposite = np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1)
    with np.errstate(divide="ignore", over="ignore"):
        stiffness = np.bincount(mesh.zones.ravel(), ((opposite**2).sum(axis=2) / (4 * areas[:, None])).ravel())
    mass = np.bincount(mesh.zones.ravel(), np.repeat(areas / 3, 3))
    step = np.sqrt(mass / stiffness)
    return float(step.min() / np.median(step)), int(mesh.node_grain[step.argmin()])


def without_short_edges(grains: Tessellation, merge: float) -> Tessellation:
    """Edges shorter than ``merge`` times the grain size merged, and thin triangles, wherever grains stay convex."""
    size, sides = grains.grain_size, region_sides(grains.region)
    tiling = tiling_of(grains.region, grains.vertices[grains.corners], grains.first, NEAR * size)
    return merge_short_edges(tiling, merge * size, merge * size**2 / 2, sides, FLATTEST).tessellation(grains)


def warn_of_slivers(where: str, grains: Tessellation) -> None:
    """Warn (:class:`SliverWarning`) where one place of the grains costs more than ten times the time steps.

    Raises ParameterError where it costs more than a million times as many: no run would end.
    """
    ratio, cell = worst_step(grains)
    if ratio < ENDLESS:
        x, y = grains.centroids[cell]
        raise ParameterError(f"{where}: cell {cell} at ({x:.6g}, {y:.6g}) m is so thin that it has next to no area")
    if ratio < COSTLY:
        edges = grains.edges
        shortest = edges.length[(edges.left == cell) | (edges.right == cell)].min()
        x, y = grains.centroids[cell]
        words = (
            f"{where}: the stable time step is {ratio:.2g} of what most zones allow, ruled by cell {cell} at "
            f"({x:.6g}, {y:.6g}) m, with an edge of {shortest:.2g} m in grains of {grains.grain_size:.2g} m; "
            "merge=0.1 removes edges below a tenth of the grain size"
        )
        warnings.warn(SliverWarning(words), stacklevel=5)
