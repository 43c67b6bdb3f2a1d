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

from grainlaw.geometry.cells.area_share import inside_areas
from grainlaw.geometry.cells.bounded_voronoi import Diagram
from grainlaw.geometry.cells.moved_cells import moved_diagram
from grainlaw.geometry.cells.power_diagram import power_diagram
from grainlaw.geometry.cells.sparse_solve import FEW, solved
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

    def circularity(self) -> float:
        """Mean of 4 pi area / perimeter^2 of whole cells."""
        perimeter = np.bincount(self.diagram.seed, self.diagram.lengths(), len(self.seeds))
        return float((4 * np.pi * self.diagram.areas() / perimeter**2).mean())

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
