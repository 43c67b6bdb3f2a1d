"""Voronoi or power cells that fill a region of any shape, as convex polygons that meet along whole edges.

The cells of a convex frame round the region are cut by its sides. What a cell has beyond a notch or a hole, out of
sight of its seed, goes to the seeds that see it: there the cells are those of the seeds on that side alone. Seeds with
weights may lie outside their cells and the region: there the centroid of the largest part of a cell is what sees.
"""

from __future__ import annotations

import math
from functools import cached_property

import attrs
import numpy as np
from scipy.spatial import cKDTree

from grainlaw.geometry.cells.bounded_voronoi import Diagram, bounded_diagram, polygons
from grainlaw.geometry.cells.convex import Point, Polygon, area, centroid, depth, hull, joined, polygon_of, split
from grainlaw.geometry.cells.cutting import Cutter, Reentrant
from grainlaw.geometry.cells.joining import tiling_of_parts
from grainlaw.geometry.cells.power_diagram import power_diagram
from grainlaw.geometry.cells.sides import STRAIGHT, turns
from grainlaw.geometry.cells.tiling import Tiling
from grainlaw.region import Region

NEAR = 1e-10  #: of the grain size: nearer points are one
HEIRS = 8  #: seeds that share what another one does not see
SMALL = 0.2  #: of the mean area: smaller parts of a cell get no seed of their own


def frame(region: Region) -> Region:
    """Smallest convex region round another, without straight corners."""
    outer = set(hull(polygon_of(region.outline)))
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
        return polygon_of(self._whole.vertices[corners])

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
        return tiling_of_parts(self.region, parts, self._cutter.near)


# --- seeds moved so that a boundary of cells begins in every corner of more than 180 degrees --------------------------
# Both parts of such a corner are then convex.


FURTHEST = 0.5  #: grain sizes that a seed may be moved
NEAREST = 0.2  #: grain sizes that a moved seed keeps from all others
CANDIDATES = 12  #: nearest seeds, among which the two in sight of a corner are looked for
ROUNDS = 8  #: of choosing pairs again, where moved seeds have changed which are the nearest
STEPS = 8  #: of Newton's method, which doubles the digits in each


@attrs.frozen
class Pair:
    """Two seeds, the boundary of whose cells is to begin in a corner, and to run along ``turned`` if that is given."""

    corner: Point
    seeds: tuple[int, int]
    turned: Point | None = attrs.field(eq=False)


def settled(seeds: np.ndarray, cutter: Cutter, size: float) -> np.ndarray:
    """Seeds (g, 2) m of grains of a ``size`` (m), moved where they are near reentrant corners.

    Where the two nearest seeds in sight are equally far from a corner, the boundary of their cells ends in it. Left
    alone are all but one of the corners with the same two seeds, and those that would move a seed too far, out of sight
    or onto another.
    """
    if not cutter.reentrant or len(seeds) < 2:
        return seeds
    refused: set[Pair] = set()
    moved = seeds
    for _ in range(ROUNDS):
        pairs = [pair for pair in _pairs(moved, cutter) if pair not in refused]
        then = _equally_far(moved, pairs, size)
        stray = np.hypot(*(then - seeds).T) > FURTHEST * size
        stray |= cKDTree(then).query(then, 2)[0][:, 1] < NEAREST * size
        touched = np.flatnonzero((then != moved).any(axis=1) & ~stray)
        stray[[g for g in touched if not cutter.sees(seeds[g], then[g : g + 1])[0]]] = True
        wrong = {pair for pair in pairs if stray[list(pair.seeds)].any()}
        if not wrong:
            if np.allclose(then, moved, rtol=0, atol=1e-3 * cutter.near):
                return then
            moved = then
        refused |= wrong
    return moved


def _pairs(seeds: np.ndarray, cutter: Cutter) -> list[Pair]:
    """For each reentrant corner the two nearest seeds in sight.

    Moved seeds are equally far from a corner but for rounding: the first in number is then the nearer.
    """
    corners = list(cutter.reentrant.values())
    away, near = cKDTree(seeds).query([found.corner for found in corners], min(CANDIDATES, len(seeds)))
    near = np.take_along_axis(near, np.lexsort((near, np.round(away / cutter.near))), axis=1)
    pairs: dict[tuple[int, int], Pair] = {}
    for found, around in zip(corners, near, strict=True):
        # From a little inside: seen from the corner itself, the sides that meet there could hide seeds by rounding.
        eye = np.array(found.corner) + 1e3 * cutter.near * np.array(found.bisector)
        seen = tuple(sorted(around[cutter.sees(eye, seeds[around])][:2].tolist()))
        if len(seen) == 2:
            pairs.setdefault(seen, Pair(found.corner, seen, _turned(found, seeds[list(seen)])))
    return list(pairs.values())


def _turned(found: Reentrant, seeds: np.ndarray) -> Point | None:
    """Direction, if need be, that the boundary must be turned into to leave less than 180 degrees on either side."""
    rays = seeds - np.array(found.corner)
    (ax, ay), (bx, by) = rays / np.maximum(np.hypot(*rays.T), np.finfo(float).tiny)[:, None]
    (u, v), ex, ey = found.bisector, by - ay, ax - bx  # the boundary is perpendicular to the line between the seeds
    skew = math.remainder(math.atan2(u * ey - v * ex, u * ex + v * ey), math.pi)
    if abs(skew) < 0.9 * found.play:
        return None
    angle = math.copysign(0.8 * found.play, skew)
    return u * math.cos(angle) - v * math.sin(angle), u * math.sin(angle) + v * math.cos(angle)


def _equally_far(seeds: np.ndarray, pairs: list[Pair], size: float) -> np.ndarray:
    """Seeds moved as little as makes those of each pair equally far from its corner.

    Where not all can be, the least squares of lengths over ``size`` (m) are the same at any scale.
    """
    seeds = seeds.copy()
    if not pairs:
        return seeds
    used, place = np.unique([pair.seeds for pair in pairs], return_inverse=True)
    one, other = place.reshape(-1, 2).T
    corners, row = np.array([pair.corner for pair in pairs]), np.arange(len(pairs))
    bent = np.array([i for i, pair in enumerate(pairs) if pair.turned], dtype=int)
    turned = np.array([pairs[i].turned for i in bent]).reshape(-1, 2)
    for _ in range(STEPS):
        a, b = seeds[used[one]] - corners, seeds[used[other]] - corners
        slopes = np.zeros((len(pairs) + len(bent), len(used), 2))
        slopes[row, one], slopes[row, other] = 2 * a / size, -2 * b / size
        slopes[len(pairs) + np.arange(len(bent)), one[bent]] = turned
        slopes[len(pairs) + np.arange(len(bent)), other[bent]] = -turned
        excess = np.concatenate([(a * a - b * b).sum(axis=1) / size, ((a - b)[bent] * turned).sum(axis=1)])
        step = np.linalg.lstsq(slopes.reshape(len(excess), -1), -excess, rcond=None)[0]
        seeds[used] += step.reshape(-1, 2)
    return seeds
