"""Voronoi or power cells that fill a region of any shape, as convex polygons that meet along whole edges.

The cells of a convex frame round the region are cut by its sides. What a cell has beyond a notch or a hole, out of
sight of its seed, goes to the seeds that see it: there the cells are those of the seeds on that side alone. Seeds with
weights may lie outside their cells and the region: there the centroid of the largest part of a cell is what sees.
"""

from __future__ import annotations

from functools import cached_property

import attrs
import numpy as np
from scipy.spatial import cKDTree

from grainlaw.geometry.cells.bounded_voronoi import Diagram, bounded_diagram, polygons
from grainlaw.geometry.cells.convex import Polygon, area, centroid, depth, hull, joined, split
from grainlaw.geometry.cells.corner_seeds import settled
from grainlaw.geometry.cells.cutting import Cutter
from grainlaw.geometry.cells.joining import tiling_of
from grainlaw.geometry.cells.power_diagram import power_diagram
from grainlaw.geometry.cells.sides import STRAIGHT, turns
from grainlaw.geometry.cells.tiling import Tiling
from grainlaw.region import Region

NEAR = 1e-10  #: of the grain size: nearer points are one
HEIRS = 8  #: seeds that share what another one does not see
SMALL = 0.2  #: of the mean area: smaller parts of a cell get no seed of their own


def frame(region: Region) -> Region:
    """Smallest convex region round another, without straight corners."""
    outer = set(hull([(x, y) for x, y in region.outline.tolist()]))
    corners = np.array([corner for corner in region.outline.tolist() if tuple(corner) in outer])
    bent = abs(np.roll(turns(Region(corners, ("frame",) * len(corners))), 1)) > STRAIGHT
    return Region(corners[bent], ("frame",) * int(bent.sum()))


@attrs.frozen(eq=False)
class Cells:
    """The cells of seeds (g, 2) inside a region; index letter ``g``."""

    region: Region
    seeds: np.ndarray  #: (g, 2) m
    size: float  #: m, of the grains
    weights: np.ndarray | None = None  #: (g,) m2 of the seeds of power cells
    large: float = np.inf  #: m2: parts out of sight that are larger stay with their seed
    near: float = NEAR  #: of the size: nearer points are one

    @cached_property
    def _cutter(self) -> Cutter:
        return Cutter(self.region, self.near * self.size)

    @cached_property
    def _frame(self) -> Region:
        return frame(self.region)

    @cached_property
    def _diagram(self) -> Diagram:
        if self.weights is None:
            return bounded_diagram(self._frame, self.seeds)
        return power_diagram(self._frame, self.seeds, self.weights, 3 * self.size)

    @cached_property
    def _whole(self) -> Tiling:
        """Cells of the frame, before the region cuts them."""
        return polygons(self._frame, self._diagram, None if self.weights is None else self._diagram.centroids())

    @cached_property
    def _cut(self) -> dict[int, list[Polygon]]:
        """Pieces of the cells that the sides of the region cut, first that of the seed, or the largest."""
        corners = self._whole.vertices[self._whole.corners]
        arm = np.hypot(*(corners - self.seeds[self._whole.grain]).T)
        reach = np.maximum.reduceat(arm, self._whole.first[:-1])
        near: dict[int, list[int]] = {}
        for k, (start, end) in enumerate(zip(self.region.start, self.region.end, strict=True)):
            along = end - start
            share = np.clip((self.seeds - start) @ along / (along @ along), 0, 1)
            away = np.hypot(*(self.seeds - start - share[:, None] * along).T)
            for g in np.flatnonzero(away < reach):
                near.setdefault(int(g), []).append(k)
        pieces = {g: self._cutter.pieces(self._cell(g), sides) for g, sides in near.items()}
        return {
            g: sorted(
                parts, key=lambda part: -(depth(part, tuple(self.seeds[g])) if self.weights is None else area(part))
            )
            for g, parts in pieces.items()
            if parts != [self._cell(g)]
        }

    def _cell(self, g: int) -> Polygon:
        corners = self._whole.corners[self._whole.first[g] : self._whole.first[g + 1]]
        return [(x, y) for x, y in self._whole.vertices[corners].tolist()]

    @cached_property
    def _eyes(self) -> np.ndarray:
        """(g, 2) m, the points from which cells see."""
        return self.seeds if self.weights is None else self.middles()

    def middles(self) -> np.ndarray:
        """(g, 2) m, the centroids of the largest parts of the cells of seeds with weights."""
        middles = self._diagram.centroids()
        for g, (main, *_others) in self._cut.items():
            middles[g] = centroid(main)
        return middles

    @cached_property
    def _changed(self) -> dict[int, list[Polygon]]:
        """Convex polygons of the seeds whose cells are not whole cells of the frame."""
        owned: dict[int, list[Polygon]] = {}
        tree = cKDTree(self._eyes)
        for g, (main, *others) in self._cut.items():
            owned.setdefault(g, []).append(main)
            for piece in others:
                if area(piece) > self.large:
                    owned[g].append(piece)
                    continue
                for heir, part in self._shared(g, piece, tree):
                    whole = [] if heir in self._cut else [self._cell(heir)]
                    owned.setdefault(heir, whole).append(part)
        return {g: joined(pieces) for g, pieces in owned.items()}

    def _shared(self, g: int, piece: Polygon, tree: cKDTree) -> list[tuple[int, Polygon]]:
        """A piece parted among the nearest seeds that see it, if seed g does not; else left to seed g."""
        middle = np.array(centroid(piece))
        if self._cutter.sees(middle, self._eyes[g : g + 1])[0]:
            return [(g, piece)]
        near = np.atleast_1d(tree.query(middle, min(len(self.seeds), 6 * HEIRS))[1])
        heirs = near[self._cutter.sees(middle, self._eyes[near])][:HEIRS].tolist()
        shares = []
        for heir in heirs:
            part = piece
            for other in heirs:
                if part and other != heir:
                    x, y = self.seeds[other] - self.seeds[heir]
                    between = tuple((self.seeds[other] + self.seeds[heir]) / 2)
                    if self.weights is not None:
                        share = (self.weights[heir] - self.weights[other]) / (2 * (x * x + y * y))
                        between = between[0] + share * x, between[1] + share * y
                    part = split(part, between, (-y, x), self._cutter.near)[0]
            if part:
                shares.append((heir, part))
        return shares or [(g, piece)]

    def next_seeds(self, *, relaxed: bool) -> np.ndarray:
        """Seeds for better cells, perhaps more: one in each large part of a cell, drawn to the corners of the region.

        ``relaxed`` puts all of them into the centroids of their cells, as Lloyd's algorithm does.
        """
        moved = self._diagram.centroids() if relaxed else self.seeds.copy()
        more = []
        for g, parts in self._changed.items():
            large = [part for part in parts if area(part) > SMALL * self.size**2] or [max(parts, key=area)]
            if relaxed or len(large) > 1:
                moved[g] = centroid(large[0])
                more += [centroid(part) for part in large[1:]]
        return settled(np.concatenate([moved, np.reshape(more, (-1, 2))]), self._cutter, self.size)

    def tiling(self) -> Tiling:
        """The cells as polygons, those of one seed after those of another."""
        parts = [self._changed.get(g) or [self._cell(g)] for g in range(len(self.seeds))]
        cells = [part for each in parts for part in each]
        first = np.concatenate([[0], np.cumsum([len(cell) for cell in cells])])
        points = np.array([point for cell in cells for point in cell])
        owner = np.repeat(np.arange(len(parts)), [len(each) for each in parts])
        return tiling_of(self.region, points, first, self._cutter.near, owner)
