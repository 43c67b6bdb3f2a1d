"""Voronoi diagram that ends exactly on the sides of a convex region.

Mirrored over a side, a seed has that side as the boundary between it and its image, and no image is ever nearer to a
point of the region than its seed: with enough images the cells of the seeds are the plain cells cut by the region
(Okabe, Boots, Sugihara and Chiu 2000, Spatial Tessellations, doi:10.1002/9780470317013).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import attrs
import numpy as np
from scipy import spatial

from grainlaw.geometry.cells.sides import convex_sides, lines_at
from grainlaw.geometry.cells.tiling import Tiling
from grainlaw.polygon import cross
from grainlaw.region import Region
from grainlaw.tessellation import TilingError

FEW = 100  #: seeds; so few may lie on one line with their images over the near sides, all images are taken


@attrs.frozen(eq=False)
class Diagram:
    """Half-edges of the cells of all seeds: each runs counter-clockwise round its cell."""

    seeds: np.ndarray  #: (g, 2) m
    vertices: np.ndarray  #: (v, 2) m
    seed: np.ndarray  #: (h,)
    other: np.ndarray  #: (h,) seed of the cell beyond, -1 on a side of the region
    start: np.ndarray  #: (h,) vertex
    end: np.ndarray  #: (h,) vertex
    side: np.ndarray  #: (h,) side of the region, -1 inside

    @cached_property
    def _arms(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(h, 2) and (h, 2) from seed to start and end, and (h,) twice the area between them."""
        a, b = (self.vertices[end] - self.seeds[self.seed] for end in (self.start, self.end))
        return a, b, cross(a, b)

    @cached_property
    def once(self) -> np.ndarray:
        """(e,) the half-edges between two cells that run round the one of the lower number."""
        return np.flatnonzero(self.seed < self.other)

    def areas(self) -> np.ndarray:
        """(g,) m2, of the cells."""
        return np.bincount(self.seed, self._arms[2], len(self.seeds)) / 2

    def centroids(self) -> np.ndarray:
        """(g, 2) m, of the cells, from the triangles between seed and half-edge."""
        a, b, twice = self._arms
        count = len(self.seeds)  # the last cells may be empty
        areas = np.bincount(self.seed, twice, minlength=count)
        moments = [np.bincount(self.seed, twice * (a + b)[:, i], minlength=count) for i in (0, 1)]
        return self.seeds + np.column_stack(moments) / (3 * areas[:, None])

    def lengths(self) -> np.ndarray:
        """(h,) m."""
        return np.hypot(*(self.vertices[self.end] - self.vertices[self.start]).T)

    def renumbered(self, order: np.ndarray) -> Diagram:
        """With its seeds in another order (g,)."""
        number = np.argsort(order)
        other = np.where(self.other >= 0, number[self.other], -1)
        return attrs.evolve(self, seeds=self.seeds[order], seed=number[self.seed], other=other)


def bounded_diagram(region: Region, seeds: np.ndarray) -> Diagram:
    """Cells of ``seeds`` (g, 2), distinct points inside a convex region."""
    size, centre = np.sqrt(region.area / len(seeds)), region.bounds.mean(axis=0)
    extent = np.ptp(region.bounds, axis=0).max()

    def voronoi(points: np.ndarray, origin: np.ndarray, side: np.ndarray) -> Diagram | None:
        found = spatial.Voronoi((points - centre) / extent)
        between, ends = np.sort(found.ridge_points, axis=1), np.array(found.ridge_vertices)
        ours = between[:, 0] < len(seeds)
        between, ends = between[ours], ends[ours]
        if ends.min() < 0:  # an open cell
            return None
        image = np.maximum(between[:, 1] - len(seeds), 0)
        mirror = (between[:, 1] >= len(seeds)) & (origin[image] == between[:, 0])
        used, ends = np.unique(ends, return_inverse=True)
        vertices = found.vertices[used] * extent + centre
        if convex_sides(region).distance(vertices).min() <= -1e-6 * size:
            return None
        ends = ends.reshape(-1, 2)
        a, b = (vertices[end] - seeds[between[:, 0]] for end in ends.T)
        return half_edges(seeds, vertices, between, ends, np.where(mirror, side[image], -1), cross(a, b) < 0)

    return mirrored_diagram(region, seeds, 3 * size, voronoi, "Voronoi")


def mirrored_diagram(
    region: Region, seeds: np.ndarray, reach: float, made: Callable[..., Diagram | None], kind: str
) -> Diagram:
    """What is made of seeds (g, 2) m and the images of those nearer than ``reach`` (m) to a side.

    ``made`` is given all points, and of each image its seed and side. Where it gives None, ``reach`` is doubled.
    """
    sides = convex_sides(region)
    distance = sides.distance(seeds)
    reach = reach if len(seeds) > FEW else np.inf
    while True:
        origin, side = np.nonzero(distance < reach)
        images = seeds[origin] - 2 * distance[origin, side, None] * sides.inward[side]
        diagram = made(np.concatenate([seeds, images]), origin, side)
        if diagram is not None:
            return diagram
        if (distance < reach).all():
            raise TilingError(f"the {kind} diagram of {len(seeds)} seeds does not end on the sides of the region")
        reach *= 2


def half_edges(
    seeds: np.ndarray, vertices: np.ndarray, between: np.ndarray, ends: np.ndarray, side: np.ndarray, swap: np.ndarray
) -> Diagram:
    """From edges (e,) ``between`` seeds, or a seed and an image, the ends of some of them to ``swap``.

    Then each runs counter-clockwise round the first of both.
    """
    start, end = np.where(swap, ends[:, ::-1].T, ends.T)
    both = between[:, 1] < len(seeds)
    return Diagram(
        seeds, vertices, seed=np.concatenate([between[:, 0], between[both, 1]]),
        other=np.concatenate([np.where(both, between[:, 1], -1), between[both, 0]]),
        start=np.concatenate([start, end[both]]), end=np.concatenate([end, start[both]]),
        side=np.concatenate([side, side[both]]),
    )  # fmt: skip


def polygons(region: Region, diagram: Diagram, inside: np.ndarray | None = None) -> Tiling:
    """Polygons of the diagram, their vertices on the boundary put exactly there.

    ``inside`` (g, 2) m has a point of each cell, which the seeds are unless they have weights.
    """
    outward = diagram.vertices[diagram.start] - (diagram.seeds if inside is None else inside)[diagram.seed]
    order = np.lexsort((np.arctan2(outward[:, 1], outward[:, 0]), diagram.seed))
    first = np.searchsorted(diagram.seed[order], np.arange(len(diagram.seeds) + 1))
    outer = diagram.side >= 0
    ends = np.concatenate([diagram.start[outer], diagram.end[outer]])
    on = lines_at(len(diagram.vertices), ends, np.tile(diagram.side[outer], 2))
    return Tiling(region, convex_sides(region).hold(diagram.vertices, on), on, diagram.start[order], first)
