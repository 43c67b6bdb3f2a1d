"""Weights of seeds that give the cells of their power diagram prescribed areas: semi-discrete optimal transport.

The areas are the gradient of a concave function of the weights, and Newton's method converges from any weights that
leave no cell empty if its step is halved until the smallest cell stays large enough and the error falls (Kitagawa,
Merigot and Thibert 2019, doi:10.4171/JEMS/889). With areas that are given as shares of the region's, the Hessian is the
graph Laplacian of the cells, each edge with its length over twice the distance of its seeds.
"""

from __future__ import annotations

from functools import cached_property

import attrs
import numpy as np
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

from grainlaw.geometry.cells.bounded_voronoi import Diagram
from grainlaw.geometry.cells.moved_cells import moved_diagram
from grainlaw.geometry.cells.power_diagram import power_diagram
from grainlaw.geometry.cells.sides import convex_sides
from grainlaw.geometry.cells.sparse_solve import FEW, solved
from grainlaw.polygon import cross
from grainlaw.region import Region
from grainlaw.tessellation import TilingError

SMALLEST_STEP = 1e-9
NEIGHBOURS = 12  #: nearest seeds that may take the place of another one


@attrs.frozen(eq=False)
class PowerCells:
    """Power cells inside a region; index letter ``g``."""

    region: Region
    frame: Region  #: convex, round the region or the region itself
    seeds: np.ndarray  #: (g, 2) m
    weights: np.ndarray  #: (g,) m2
    reach: float  #: m, to the sides of the frame
    before: Diagram | None = None  #: of these seeds in other places or with other weights

    @property
    def diagram(self) -> Diagram:
        """Of the frame; of many seeds each cell may have vertices of its own."""
        return self.joined if self._moved is None else self._moved

    @cached_property
    def _moved(self) -> Diagram | None:
        if self.before is None or len(self.seeds) <= FEW:
            return None
        return moved_diagram(self.frame, self.seeds, self.weights, self.before)

    @cached_property
    def joined(self) -> Diagram:
        """Of the frame, cells with their vertices in common."""
        return power_diagram(self.frame, self.seeds, self.weights, self.reach)

    @cached_property
    def _inside(self) -> tuple[np.ndarray, np.ndarray]:
        if self.frame is self.region:
            return self.diagram.areas(), np.ones(len(self.diagram.once))
        return inside_areas(self.region, self.frame, self.diagram, self.weights)

    @property
    def areas(self) -> np.ndarray:
        """(g,) m2 inside the region."""
        return self._inside[0]

    def error(self, areas: np.ndarray) -> float:
        """Largest of the differences from prescribed areas (g,) m2, each over the prescribed one."""
        return float(abs(self.areas / areas - 1).max())

    def change(self, areas: np.ndarray) -> np.ndarray:
        """(g,) m2, of the weights, that would give ``areas`` (g,) m2 if these depended linearly on them."""
        half, n = self.diagram.once, len(self.seeds)
        i, j = self.diagram.seed[half], self.diagram.other[half]
        apart = np.hypot(*(self.seeds[j] - self.seeds[i]).T)
        slope = self._inside[1] * self.diagram.lengths()[half] / (2 * apart)
        sums = np.bincount(i, slope, n) + np.bincount(j, slope, n)
        row, column = np.concatenate([i, j, np.arange(n)]), np.concatenate([j, i, np.arange(n)])
        # A part of the region that no edge joins to the rest would leave its own sum of weights free.
        laplacian = coo_array(
            (np.concatenate([-slope, -slope, sums + 1e-12 * sums.max()]), (row, column)), shape=(n, n)
        )
        change = solved(laplacian.tocsc()[:-1, :-1], (areas - self.areas)[:-1])
        return np.append(change, 0.0)  # all weights may change by the same: one is kept


def fitted(cells: PowerCells, areas: np.ndarray, tolerance: float) -> PowerCells:
    """With weights that give ``areas`` (g,) m2 to within a ``tolerance`` times each of them.

    Raises :class:`~grainlaw.tessellation.TilingError` where Newton's method ends before.
    """
    least = min(cells.areas.min(), areas.min()) / 2
    while cells.error(areas) > tolerance:
        change, away, step = cells.change(areas), np.linalg.norm(cells.areas - areas), 1.0
        while True:
            then = with_weights(cells, cells.weights + step * change)
            if then.areas.min() > least and np.linalg.norm(then.areas - areas) <= (1 - step / 2) * away:
                break
            step /= 2
            if step < SMALLEST_STEP:
                raise TilingError(
                    f"cells of the prescribed areas were not found, one is wrong by {cells.error(areas):.2g}"
                )
        cells = then
    return cells


def with_weights(cells: PowerCells, weights: np.ndarray) -> PowerCells:
    """Of the same seeds."""
    return attrs.evolve(cells, weights=weights - weights.mean(), before=cells.diagram)


def round_cells(cells: PowerCells, seeds: np.ndarray, areas: np.ndarray) -> PowerCells:
    """None of them empty, of ``seeds`` that are centroids: as if they were discs of ``areas`` (g,) m2."""
    weights = areas / np.pi
    apart, near = cKDTree(seeds).query(seeds, min(NEIGHBOURS, len(seeds)))
    if len(seeds) > 1:
        # A seed keeps its own place if no other has less power there.
        weights = np.maximum(weights, (weights[near] - apart**2)[:, 1:].max(axis=1) + areas / (4 * np.pi))
    then = attrs.evolve(cells, seeds=seeds, weights=weights - weights.mean(), before=cells.diagram)
    return then if then.areas.min() > 0.01 * areas.min() else attrs.evolve(then, weights=np.zeros(len(seeds)))


# --- how much of the cells of a convex frame lies inside a region of any shape ----------------------------------------
# The boundary of what a cell has inside consists of pieces of its own edges and of pieces of the sides of the region.
# By Green's theorem its area is half the sum of a x b over all of these, and a straight piece of the line from a to b
# that is a share s of it adds s a x b: only the shares are wanted. They follow from where edges and sides cross.


NEAR = 1e-9  #: of the extent: a side of the region with both ends nearer to one of the frame lies on it
WITHIN = 0.4142  #: of an edge, where it is asked whether it is inside: hardly ever on a side of the region


def inside_areas(region: Region, frame: Region, diagram: Diagram, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(g,) m2 of the cells inside the region, and (e,) the share inside it of the edges ``diagram.once``."""
    left, right = diagram.seed[diagram.once], diagram.other[diagram.once]
    p, q = diagram.vertices[diagram.start[diagram.once]], diagram.vertices[diagram.end[diagram.once]]
    low, high = np.minimum(p, q), np.maximum(p, q)
    origin, extent = region.bounds.mean(axis=0), np.ptp(region.bounds, axis=0).max()
    away = abs(convex_sides(frame).distance(region.start)) < NEAR * extent
    on_frame = away & away[region.after]  # side of the region, side of the frame
    share = region.contains(p + WITHIN * (q - p)).astype(float)
    twice = np.zeros(len(diagram.seeds))
    for k, (a, b) in enumerate(zip(region.start, region.end, strict=True)):
        if on_frame[k].any():
            owner, part = _along_frame(diagram, int(on_frame[k].argmax()), a, b)
        else:
            near = np.flatnonzero(((low <= np.maximum(a, b)) & (high >= np.minimum(a, b))).all(axis=1))
            which, s, t, leaves = _crossings(a, b, p[near], q[near])
            e, way = near[which], np.where(leaves, 1.0, -1.0)
            np.add.at(share, e, way * (s - (s > WITHIN)))
            # An edge leaves the region where the side passes from its right to its left.
            last = np.where(leaves, left[e], right[e])[t.argmax()] if len(e) else _cell_at(diagram.seeds, weights, b)
            owner, part = np.concatenate([left[e], right[e], [last]]), np.concatenate([-way * t, way * t, [1.0]])
        np.add.at(twice, owner, part * cross(a - origin, b - origin))
    area = share * cross(p - origin, q - origin)
    twice += np.bincount(left, area, len(twice)) - np.bincount(right, area, len(twice))
    return twice / 2, share


def _along_frame(diagram: Diagram, side: int, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cells at a side of the frame, and what share of the line from a to b on it each has."""
    h = np.flatnonzero(diagram.side == side)
    along = (b - a) / ((b - a) @ (b - a))
    begin, finish = (np.clip((diagram.vertices[ends[h]] - a) @ along, 0, 1) for ends in (diagram.start, diagram.end))
    return diagram.seed[h], finish - begin


def _crossings(
    a: np.ndarray, b: np.ndarray, p: np.ndarray, q: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Which lines from p to q cross that from a to b, where along p to q, where along a to b, and whether to its right.

    The region is on the left of a side: who crosses it to the right leaves.
    """
    of_p, of_q = cross(b - a, p - a), cross(b - a, q - a)
    of_a, of_b = cross(q - p, a - p), cross(q - p, b - p)
    which = np.flatnonzero(((of_p > 0) != (of_q > 0)) & ((of_a > 0) != (of_b > 0)))
    s, t = of_p / np.where(of_p == of_q, 1, of_p - of_q), of_a / np.where(of_a == of_b, 1, of_a - of_b)
    return which, s[which], t[which], of_p[which] > 0


def _cell_at(seeds: np.ndarray, weights: np.ndarray, point: np.ndarray) -> int:
    return int((((seeds - point) ** 2).sum(axis=1) - weights).argmin())


# --- areas and centroids, in a convex region --------------------------------------------------------------------------
# They decide a power diagram (Bourne, Pearce and Roper 2024, Inverting Laguerre tessellations, arXiv:2406.00871): the
# seeds are moved by what the centroids of their cells miss, and the weights fitted to the areas. Moves are halved where
# they bring the centroids no nearer, as is all that remains where no power diagram has them.


MET = 0.005  #: of each area
CLOSE = 0.002  #: of the size of the grains: root mean square distance of centroids at which to stop
ROUNDS = 40
GROWTH = 1.3  #: of moves that bring the centroids nearer


def cells_at(region: Region, areas: np.ndarray, centroids: np.ndarray) -> PowerCells:
    """Cells of ``areas`` (g,) m2 that add up to the region's, near to ``centroids`` (g, 2) m inside it.

    Raises :class:`~grainlaw.tessellation.TilingError` where the areas are not found with seeds at the centroids.
    """
    size, reach = float(np.sqrt(areas.mean())), 2 * float(np.sqrt(areas.max()))
    cells = fitted(PowerCells(region, region, centroids, np.zeros(len(areas)), reach), areas, MET)
    missed, step = _missed(cells, areas, centroids), 1.0
    for _ in range(ROUNDS):
        if missed < CLOSE * size:
            break
        then = _shifted(cells, step * (centroids - cells.diagram.centroids()), areas)
        nearer = np.inf if then is None else _missed(then, areas, centroids)
        if then is None or nearer >= missed:
            step /= 2
        else:
            cells, missed, step = then, nearer, GROWTH * step
    return cells


def _shifted(cells: PowerCells, shift: np.ndarray, areas: np.ndarray) -> PowerCells | None:
    """With seeds moved by ``shift`` (g, 2) m; None where the areas are not found."""
    moved = attrs.evolve(cells, seeds=cells.seeds + shift)
    try:
        return fitted(moved, areas, MET) if moved.areas.min() > 0 else None
    except TilingError:
        return None


def _missed(cells: PowerCells, areas: np.ndarray, centroids: np.ndarray) -> float:
    """Root mean square distance (m) of centroids, by area."""
    squares = ((cells.diagram.centroids() - centroids) ** 2).sum(axis=1)
    return float(np.sqrt(np.average(squares, weights=areas)))
