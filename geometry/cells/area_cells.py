"""Grains of prescribed areas, and as round as asked, in any region: seeds, weights, merged edges, errors of areas."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import count, islice

import attrs
import numpy as np

from grainlaw.fields import ParameterError
from grainlaw.geometry.cells.any_voronoi import SMALL, Cells, frame
from grainlaw.geometry.cells.area_fit import PowerCells, fitted, round_cells, with_weights
from grainlaw.geometry.cells.bounded_voronoi import polygons
from grainlaw.geometry.cells.merging import merge_short_edges
from grainlaw.geometry.cells.seeds import hilbert_order, scattered_points, uniform_points
from grainlaw.geometry.cells.sides import is_convex
from grainlaw.geometry.cells.tiling import Tiling
from grainlaw.geometry.cells.vertex_fit import owned_areas, with_areas
from grainlaw.messages import refusal
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation

TOLERANCE = 0.005  #: of each area, of the cells
ROUGHLY = 0.1  #: of each area, of cells that will move on
AFTER = 0.02  #: of each area, at most, where edges are merged; elsewhere they are left
GRADUAL = 3  #: rounds in which the areas go from those of Voronoi cells to the prescribed ones
INHERITANCES = 6  #: fits of cells in a concave region, each to what those before left out of sight
ATTEMPTS = 16  #: to merge, each with fewer edges round grains that miss their area
SMALLEST = 1e-6  #: of the mean area


@attrs.frozen(eq=False)
class AreaFit:
    """Grains, and how well they have the areas that were asked for; index letter ``n``: of the areas asked for.

    A concave region may cut the cell of one area in several grains.
    """

    tessellation: Tessellation
    owner: np.ndarray  #: (g,) which of the areas a grain belongs to
    asked: np.ndarray  #: (n,) m2
    before: np.ndarray  #: (n,) m2, of the cells before short edges were merged

    @cached_property
    def after(self) -> np.ndarray:
        """(n,) m2, of the grains."""
        return np.bincount(self.owner, self.tessellation.areas, len(self.asked))

    @property
    def largest_before(self) -> float:
        """Largest error of an area over the area asked for, before short edges were merged."""
        return float(abs(self.before / self.asked - 1).max())

    @property
    def largest_after(self) -> float:
        """Largest error of an area over the area asked for, of the grains."""
        return float(abs(self.after / self.asked - 1).max())

    @property
    def rms_before(self) -> float:
        """Root mean square of all such errors before short edges were merged."""
        return float(np.sqrt(((self.before / self.asked - 1) ** 2).mean()))

    @property
    def rms_after(self) -> float:
        """Root mean square of all such errors of the grains."""
        return float(np.sqrt(((self.after / self.asked - 1) ** 2).mean()))

    @cached_property
    def circularity(self) -> np.ndarray:
        """(g,) 4 pi area / perimeter^2 of each grain: 1 of a circle, 0.907 of a regular hexagon."""
        return circularities(self.tessellation)

    def __str__(self) -> str:
        grains = f"{self.tessellation.count} grains, mean circularity {self.circularity.mean():.3f}"
        return (
            f"{len(self.asked)} areas, {grains}\n"
            f"error of the areas before merging: largest {self.largest_before:.2%}, rms {self.rms_before:.2%}\n"
            f"error of the areas of the grains:  largest {self.largest_after:.2%}, rms {self.rms_after:.2%}"
        )


def circularities(tessellation: Tessellation) -> np.ndarray:
    """(g,) 4 pi area / perimeter^2."""
    edges, inner = tessellation.edges, tessellation.edges.right >= 0
    perimeter = np.bincount(edges.left, edges.length, tessellation.count)
    perimeter += np.bincount(edges.right[inner], edges.length[inner], tessellation.count)
    return 4 * np.pi * tessellation.areas / perimeter**2


def areas_cells(region: Region, areas: np.ndarray, seeds: np.ndarray, rounds: int, merge: float) -> AreaFit:
    """Grains whose areas are to each other as ``areas`` (n,), and that fill a region of any shape.

    They begin as cells of ``seeds`` (n, 2) m, distinct points inside the region; these move to the centroids in each of
    ``rounds``. Grains are in the order of space, ``owner`` of the result has the number of their area. Edges shorter
    than ``merge`` times the size of the smallest grain at their ends vanish where no area suffers. Raises
    ParameterError.
    """
    cells, asked, order = first_cells(region, areas, seeds)
    return grains_of(next(islice(rounds_of(cells, asked[order]), rounds, None)), asked, order, merge)


def scattered(region: Region, number: int, random: np.random.Generator) -> np.ndarray:
    """(number, 2) m, independent points of uniform density in a region."""
    return (uniform_points if is_convex(region) else scattered_points)(region, number, random)


def first_cells(region: Region, areas: np.ndarray, seeds: np.ndarray) -> tuple[PowerCells, np.ndarray, np.ndarray]:
    """Voronoi cells of seeds (n, 2) m in the order of space, the areas (n,) m2 asked for, and the order.

    Raises ParameterError.
    """
    asked = checked_areas("areas_cells: areas", areas) * (region.area / np.sum(areas))
    order = hilbert_order(seeds)
    around = region if is_convex(region) else frame(region)
    reach = 2 * float(np.sqrt(asked.max()))
    return PowerCells(region, around, seeds[order], np.zeros(len(seeds)), reach), asked, order


def checked_areas(where: str, areas: np.ndarray) -> np.ndarray:
    """(n,) above 0 and not too uneven. Raises ParameterError, which begins with ``where``."""
    areas = np.asarray(areas, dtype=float)
    if areas.ndim != 1 or not len(areas) or not np.isfinite(areas).all() or areas.min() <= 0:
        raise refusal(where, areas, "a list of finite numbers above 0")
    if areas.min() < SMALLEST * areas.mean():
        share = f"number {areas.argmin()} is {areas.min() / areas.mean():.2g} of their mean"
        raise ParameterError(f"{where} are not allowed, {share}, it must be at least {SMALLEST:g}")
    return areas


def rounds_of(cells: PowerCells, areas: np.ndarray) -> Iterator[PowerCells]:
    """Cells of nearly the areas (g,) m2 after 0, 1, 2 ... moves of the seeds to the centroids (Bourne, Kok, Roper and
    Spanjer 2020, doi:10.1080/14786435.2020.1790053, algorithm 2).

    The first move is that of Lloyd's algorithm for Voronoi cells. In the next ones the areas go step by step from those
    of these cells to the prescribed ones, by one step of Newton's method each.
    """
    for number in count():
        yield cells
        if number > 0:
            left = max(1, GRADUAL + 1 - number)
            goal = cells.areas ** (1 - 1 / left) * areas ** (1 / left)
            cells = _toward(cells, goal * (areas.sum() / goal.sum()), areas.min())
        seeds = middles(cells)
        cells = round_cells(cells, seeds, cells.areas if number else np.zeros(len(seeds)))


def _toward(cells: PowerCells, goal: np.ndarray, smallest: float) -> PowerCells:
    """One step of Newton's method, as long as leaves no cell empty."""
    change, step = cells.change(goal), 1.0
    while True:
        then = with_weights(cells, cells.weights + step * change)
        if then.areas.min() > min(0.01 * smallest, cells.areas.min() / 2):
            return then
        step /= 2


def middles(cells: PowerCells) -> np.ndarray:
    """(g, 2) m, the centroids of the cells, of their largest part where the region cuts them."""
    if cells.frame is cells.region:
        return cells.diagram.centroids()
    return _cut(cells).middles()


def _cut(cells: PowerCells) -> Cells:
    size = float(np.sqrt(cells.region.area / len(cells.seeds)))
    return Cells(cells.region, cells.seeds, size, cells.weights, SMALL * cells.areas.min())


def grains_of(cells: PowerCells, asked: np.ndarray, order: np.ndarray, merge: float) -> AreaFit:
    """Grains of the cells of the areas ``asked[order]``, in the order of space."""
    again = hilbert_order(cells.seeds)
    order = order[again]
    cells = attrs.evolve(
        cells, seeds=cells.seeds[again], weights=cells.weights[again], before=cells.diagram.renumbered(again)
    )
    areas = asked[order]
    if cells.frame is cells.region:
        cells, smallest = fitted(cells, areas, TOLERANCE), 0.0
        tiling = polygons(cells.region, cells.joined, cells.joined.centroids())
    else:
        tiling, smallest = _cut_tiling(cells, areas), SMALL * areas.min()
    before = np.empty(len(asked))
    before[order] = owned_areas(tiling, len(asked))
    tiling = _merged(tiling, areas, merge * np.sqrt(areas), smallest)
    return AreaFit(tiling.tessellation(), order[tiling.owner], asked, before)


def _cut_tiling(cells: PowerCells, areas: np.ndarray) -> Tiling:
    """Of cells in a concave region, where seeds inherit what others have out of their sight: they ask for less."""
    goal, tried, errors = areas, [], []
    for _ in range(INHERITANCES):
        cells = fitted(cells, goal, TOLERANCE)
        tried.append(_cut(cells).tiling())
        missing = areas - owned_areas(tried[-1], len(areas))
        errors.append(((missing / areas) ** 2).mean())
        if abs(missing / areas).max() <= TOLERANCE:
            break
        goal = np.clip(goal + missing, areas / 10, 2 * areas)
        goal = goal * (areas.sum() / goal.sum())
    return tried[int(np.argmin(errors))]


def _merged(tiling: Tiling, areas: np.ndarray, limit: np.ndarray, smallest: float) -> Tiling:
    """Short edges merged, and the areas made right again; fewer of them round grains that would miss theirs."""
    tried, errors = [], []
    for _ in range(ATTEMPTS):
        tried.append(with_areas(merge_short_edges(tiling, limit, smallest), areas, TOLERANCE / 2))
        error = abs(owned_areas(tried[-1], len(areas)) / areas - 1)
        errors.append((error**2).mean())
        if error.max() <= AFTER:
            return tried[-1]
        less = np.where(limit > 0.1 * np.sqrt(areas), limit / 2, 0)
        limit = np.where(_near(tiling, error > AFTER), less, limit)
    error = abs(owned_areas(tiling, len(areas)) / areas - 1)
    return tiling if error.max() <= AFTER else tried[int(np.argmin(errors))]  # rather none merged than areas missed


def _near(tiling: Tiling, seeds: np.ndarray) -> np.ndarray:
    """(n,) whether a grain of a seed has a corner in common with one of those chosen (n,)."""
    touched = np.zeros(len(tiling.vertices), dtype=bool)
    owner = tiling.owner[tiling.grain]
    touched[tiling.corners[seeds[owner]]] = True
    near = seeds.copy()
    near[owner[touched[tiling.corners]]] = True
    return near


EXACT = 0.003  #: of a mean circularity
MOST = 60  #: rounds
TRIALS = 12  #: between two rounds


@attrs.define
class _Moves:
    """Cells after any number of rounds, also between two whole ones."""

    areas: np.ndarray
    rounds: Iterator[PowerCells]
    made: list[PowerCells] = attrs.field(factory=list)

    def after(self, number: float) -> PowerCells:
        low, share = int(number), number % 1
        while len(self.made) < low + 2:
            self.made.append(next(self.rounds))
        here, there = self.made[low], self.made[low + 1]
        if share == 0:
            return here
        seeds = here.seeds + share * (there.seeds - here.seeds)
        outside = ~here.region.contains(seeds)
        seeds[outside] = here.seeds[outside]
        return round_cells(here, seeds, here.areas)


def grains_of_circularity(
    where: str, region: Region, areas: np.ndarray, seeds: np.ndarray, wanted: float, merge: float
) -> AreaFit:
    """As :func:`~grainlaw.geometry.cells.area_cells.areas_cells`, with this mean circularity, to 0.003 as a rule.

    It grows with the rounds. Raises ParameterError where it is out of reach.
    """
    cells, asked, order = first_cells(region, areas, seeds)
    moves = _Moves(asked[order], rounds_of(cells, asked[order]))

    def made(rounds: float) -> AreaFit:
        return grains_of(moves.after(rounds), asked, order, merge)

    low, high = 0.0, 4.0
    least, most = made(low), made(high)
    while _mean(most) < wanted - EXACT and high < MOST:
        low, high, least = high, min(2 * high, MOST), most
        most = made(high)
    if not _mean(least) - EXACT <= wanted <= _mean(most) + EXACT:
        reached = f"from {_mean(least):.3f}" if wanted < _mean(least) else f"up to {_mean(most):.3f}"
        raise ParameterError(
            f"{where}: circularity = {wanted:g} is not allowed, grains of these sizes reach {reached} in this region"
        )
    best = min(least, most, key=lambda fit: abs(_mean(fit) - wanted))
    for _ in range(TRIALS):
        if abs(_mean(best) - wanted) <= EXACT:
            break
        middle = (low + high) / 2
        fit = made(middle)
        best = min(best, fit, key=lambda fit: abs(_mean(fit) - wanted))
        low, high = (middle, high) if _mean(fit) < wanted else (low, middle)
    return best


def _mean(fit: AreaFit) -> float:
    return float(fit.circularity.mean())
