"""Power cells with prescribed areas and centroids, in a convex region.

Areas and centroids decide a power diagram (Bourne, Pearce and Roper 2024, Inverting Laguerre tessellations,
arXiv:2406.00871): the seeds are moved by what the centroids of their cells miss, and the weights fitted to the areas.
Moves are halved where they bring the centroids no nearer, as is all that remains where no power diagram has them.
"""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.geometry.cells.area_fit import PowerCells, fitted
from grainlaw.region import Region
from grainlaw.tessellation import TilingError

TOLERANCE = 0.005  #: of each area
CLOSE = 0.002  #: of the size of the grains: root mean square distance of centroids at which to stop
ROUNDS = 40
GROWTH = 1.3  #: of moves that bring the centroids nearer


def cells_at(region: Region, areas: np.ndarray, centroids: np.ndarray) -> PowerCells:
    """Cells of ``areas`` (g,) m2 that add up to the region's, near to ``centroids`` (g, 2) m inside it.

    Raises :class:`~grainlaw.tessellation.TilingError` where the areas are not found with seeds at the centroids.
    """
    size, reach = float(np.sqrt(areas.mean())), 2 * float(np.sqrt(areas.max()))
    cells = fitted(PowerCells(region, region, centroids, np.zeros(len(areas)), reach), areas, TOLERANCE)
    missed, step = _missed(cells, areas, centroids), 1.0
    for _ in range(ROUNDS):
        if missed < CLOSE * size:
            break
        then = _moved(cells, step * (centroids - cells.diagram.centroids()), areas)
        nearer = np.inf if then is None else _missed(then, areas, centroids)
        if then is None or nearer >= missed:
            step /= 2
        else:
            cells, missed, step = then, nearer, GROWTH * step
    return cells


def _moved(cells: PowerCells, shift: np.ndarray, areas: np.ndarray) -> PowerCells | None:
    """With seeds moved by ``shift`` (g, 2) m; None where the areas are not found."""
    moved = attrs.evolve(cells, seeds=cells.seeds + shift)
    try:
        return fitted(moved, areas, TOLERANCE) if moved.areas.min() > 0 else None
    except TilingError:
        return None


def _missed(cells: PowerCells, areas: np.ndarray, centroids: np.ndarray) -> float:
    """Root mean square distance (m) of centroids, by area."""
    squares = ((cells.diagram.centroids() - centroids) ** 2).sum(axis=1)
    return float(np.sqrt(np.average(squares, weights=areas)))
