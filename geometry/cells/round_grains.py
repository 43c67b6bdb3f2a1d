"""Grains of prescribed areas as round, in the mean, as is asked for: how far their seeds move to the centroids."""

from __future__ import annotations

from collections.abc import Iterator

import attrs
import numpy as np

from grainlaw.fields import ParameterError
from grainlaw.geometry.cells.area_cells import AreaFit, first_cells, grains_of, rounds_of
from grainlaw.geometry.cells.area_fit import PowerCells, round_cells
from grainlaw.region import Region

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
