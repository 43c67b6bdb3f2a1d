"""Minerals dealt to grains: by shares of the area, and clustered or mixed as asked."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import refusal
from grainlaw.geometry.cells.dealing import dealt, expected_share, rearranged, refined
from grainlaw.parameter import ParameterError, is_number, parameter, whole_number
from grainlaw.region import Region
from grainlaw.tessellation import BETWEEN, INSIDE, Tessellation, Tessellator

SUM = 1e-6  #: by how much fractions may miss one: what rounding to percent leaves is more, and is a mistake
REACHED = 0.02  #: by how much of it the wanted share of like boundary may be missed; by half a grain's among few grains


def _fractions(value: Any) -> dict[str, float]:
    if not isinstance(value, Mapping) or not value:
        raise refusal("Minerals: fractions", value, "a mapping of names to shares of the area")
    for name, share in value.items():
        if not isinstance(name, str) or not name or name in (BETWEEN, INSIDE):
            raise refusal("Minerals: fractions: name", name, f"a text, not {BETWEEN} or {INSIDE}")
        if not is_number(share) or not 0 < share <= 1:
            raise refusal(f"Minerals: fractions: {name}", share, "a number above 0 and at most 1")
    total = math.fsum(value.values())
    if abs(total - 1) > SUM:
        raise ParameterError(f"Minerals: fractions sum to {total:.7g}, they must sum to 1")
    return {name: float(share) for name, share in value.items()}


@attrs.frozen
class Minerals(Tessellator):
    """The grains of another tessellator, dealt to minerals by shares of the area, at random.

    ``Minerals(Voronoi(grains=755), {"quartz": 0.31, "feldspar": 0.60, "mica": 0.09})``. Swaps bring the shares to
    0.1 %, where grains are small enough. ``clustering`` is the share of the boundary between grains that has one
    mineral on both sides, over what it is on average for grains dealt at random: above 1 minerals cluster, below 1 they
    mix. Grains are then swapped until it is reached; at 1 they stay as they were dealt.

    All cells of a breakable grain are of one mineral. ParameterError is raised for fractions that do not sum to one,
    for a clustering beyond what any arrangement has, and for one that swaps do not reach.
    """

    tessellator: Tessellator
    fractions: Mapping[str, float] = attrs.field(converter=_fractions)
    clustering: float = parameter("1", default=1.0)
    seed: int = whole_number(at_least=0, default=1)  #: of the random numbers

    def __attrs_post_init__(self) -> None:
        most = 1 / math.fsum(share**2 for share in self.fractions.values())
        if self.clustering != 1 and self.clustering >= most:
            raise ParameterError(
                f"Minerals: clustering = {self.clustering:g} is not allowed, with these fractions it must be below "
                f"{most:.3g}, where all boundary is between like grains"
            )

    def tessellate(self, region: Region) -> Tessellation:
        """Fill a region, and deal the grains."""
        cells = self.tessellator.tessellate(region)
        grain = np.unique(cells.parent, return_inverse=True)[1]
        areas, shares = np.bincount(grain, cells.areas), np.array(list(self.fractions.values()))
        random = np.random.default_rng(self.seed)
        phase = refined(dealt(areas, shares, random), areas, shares, random)
        if self.clustering != 1 and len(shares) > 1:
            phase = self._clustered(cells, grain, phase, areas, shares, random)
        return attrs.evolve(cells, phase=phase[grain], phase_names=tuple(self.fractions))

    def _clustered(
        self,
        cells: Tessellation,
        grain: np.ndarray,
        phase: np.ndarray,
        areas: np.ndarray,
        shares: np.ndarray,
        random: np.random.Generator,
    ) -> np.ndarray:
        edges = cells.edges
        between = (edges.right >= 0) & (grain[edges.left] != grain[edges.right])
        pairs = grain[np.column_stack([edges.left, edges.right])[between]]
        wanted = self.clustering * expected_share(phase)
        phase, reached = rearranged(phase, pairs, edges.length[between], areas, shares, wanted, random)
        if abs(reached - wanted) > max(REACHED * wanted, 1 / len(areas)):
            raise ParameterError(
                f"Minerals: clustering = {self.clustering:g} is not reached, swaps bring these {len(areas)} grains to "
                f"{reached / expected_share(phase):.3g}"
            )
        return phase
