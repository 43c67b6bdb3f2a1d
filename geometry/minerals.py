"""Minerals dealt to grains: by shares of the area, and clustered or mixed as asked."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError, is_number, parameter, whole_number
from grainlaw.geometry.cells.area_cells import AreaFit
from grainlaw.geometry.cells.dealing import (
    carried,
    dealt,
    expected_share,
    like_share,
    rearranged,
    refined,
    shuffled_share,
)  # fmt: skip
from grainlaw.geometry.cells.grain_size import grain_count
from grainlaw.geometry.laguerre import Laguerre
from grainlaw.geometry.sizes import ByPhase, Graded, NaturalGrowth
from grainlaw.messages import refusal, users_line
from grainlaw.region import Region
from grainlaw.tessellation import BETWEEN, INSIDE, Tessellation, Tessellator

SUM = 1e-6  #: by how much fractions may miss one: what rounding to percent leaves is more, and is a mistake
REACHED = 0.02  #: by how much of it the wanted share of like boundary may be missed; by half a grain's among few grains

ROUNDS = 20  #: of changes of place, each with grains made anew, to reach the wanted clustering


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

    With ``sizes`` each mineral has grains of its own sizes, which :class:`~grainlaw.geometry.Laguerre` makes:
    ``Minerals(Laguerre(grains=755), {...}, sizes=ByPhase({"quartz": Even(diameter=1), "feldspar": Even(diameter=3),
    ...}))``. The share on average is then that of grains which meet each other in proportion to their boundary, and
    grains change places, not minerals, until the clustering is reached, also at 1.

    All cells of a breakable grain are of one mineral. ParameterError is raised for fractions that do not sum to one,
    for a clustering beyond what any arrangement has, and for one that swaps do not reach.
    """

    tessellator: Tessellator  #: makes the grains
    fractions: Mapping[str, float] = attrs.field(converter=_fractions)  #: shares of the area by mineral; their sum is 1
    clustering: float = parameter("1", default=1.0)  #: above 1 minerals cluster, below 1 they mix; 1 is random
    seed: int = whole_number(at_least=0, default=1)  #: of the random numbers
    sizes: ByPhase | None = None  #: of the grains of each mineral; those of the tessellator without it

    def __attrs_post_init__(self) -> None:
        if self.sizes is not None:
            self._check_sizes(self.sizes)
            return
        most = 1 / math.fsum(share**2 for share in self.fractions.values())
        if self.clustering != 1 and self.clustering >= most:
            raise ParameterError(
                f"Minerals: clustering = {self.clustering:g} is not allowed, with these fractions it must be below "
                f"{most:.3g}, where all boundary is between like grains"
            )

    def _check_sizes(self, sizes: ByPhase) -> None:
        sizes.require(self.fractions)
        grains = self.tessellator
        if not isinstance(grains, Laguerre):
            raise ParameterError(
                f"Minerals: sizes are not allowed with grains of {type(grains).__name__}, they need those of Laguerre"
            )
        if isinstance(grains.grain_size, Graded):
            raise ParameterError("Minerals: sizes are not allowed with a graded grain_size of Laguerre")
        if grains.areas is not None or grains.sizes != NaturalGrowth():
            other = "sizes" if grains.areas is None else "areas"
            raise ParameterError(f"Minerals: give either sizes or the {other} of Laguerre, not both")

    @checked
    def tessellate(self, region: Region) -> Tessellation:
        """Fill a region, and deal the grains."""
        if self.sizes is not None and isinstance(self.tessellator, Laguerre):
            fit, phase = self._sized(region, self.tessellator, self.sizes)
            return attrs.evolve(fit.tessellation, phase=phase[fit.owner], phase_names=tuple(self.fractions))
        cells = self.tessellator.tessellate(region)
        grain = np.unique(cells.parent, return_inverse=True)[1]
        areas, shares = np.bincount(grain, cells.areas), np.array(list(self.fractions.values()))
        random = np.random.default_rng(self.seed)
        phase = refined(dealt(areas, shares, random), areas, shares, random)
        self._warn_of_missing(phase)
        if self.clustering != 1 and len(shares) > 1:
            pairs, lengths = _boundary(cells, grain)
            average = expected_share(phase)
            wanted = self.clustering * average
            phase, reached = rearranged(phase, pairs, lengths, areas, shares, wanted, random)
            if abs(reached - wanted) > max(REACHED * wanted, 1 / len(areas)):
                raise self._not_reached(len(areas), reached / average)
        return attrs.evolve(cells, phase=phase[grain], phase_names=tuple(self.fractions))

    def _warn_of_missing(self, phase: np.ndarray) -> None:
        """Warn of minerals of which there is less than half a grain."""
        missing = [name for k, name in enumerate(self.fractions) if k not in phase]
        if missing:
            shares = ", ".join(f"{name} ({self.fractions[name]:g})" for name in missing)
            words = f"Minerals: no grain is {shares}: {len(phase)} grains are too few for so small a share"
            warnings.warn(words, stacklevel=users_line())

    def _sized(self, region: Region, grains: Laguerre, sizes: ByPhase) -> tuple[AreaFit, np.ndarray]:
        """Grains of the sizes of their minerals, and (n,) the mineral of each of the areas they were asked to have.

        Swaps on the grains as they are do not foresee what happens to boundaries when large and small grains change
        places: what they miss is left to the next round.
        """
        random = np.random.default_rng(self.seed)
        phase, areas = sizes.draw(self.fractions, grain_count(grains, region), random)
        equal = np.ones(len(areas))
        found = []
        for _ in range(ROUNDS):
            fit = attrs.evolve(grains, grains=None, grain_size=None, areas=tuple(areas * region.area)).fit(region)
            if len(self.fractions) == 1:
                return fit, phase
            pairs, lengths = _boundary(fit.tessellation, fit.owner)
            average = shuffled_share(phase, pairs, lengths)
            found.append(like_share(phase, pairs, lengths) / average)
            if abs(found[-1] - self.clustering) <= max(REACHED * self.clustering, 1 / (len(areas) * average)):
                return fit, phase
            fewest = np.bincount(phase) / len(phase)
            then, _ = rearranged(phase, pairs, lengths, equal, fewest, self.clustering * average, random)
            phase, areas = then, carried(phase, then, areas, random)
        raise self._not_reached(len(areas), min(found, key=lambda each: abs(each - self.clustering)))

    def _not_reached(self, count: int, reached: float) -> ParameterError:
        return ParameterError(
            f"Minerals: clustering = {self.clustering:g} is not reached, swaps bring these {count} grains to "
            f"{reached:.3g}"
        )


def _boundary(cells: Tessellation, grain: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(e, 2) grains, by their number ``grain`` (c,) of each cell, on both sides of edges between two, and (e,) m."""
    edges = cells.edges
    between = (edges.right >= 0) & (grain[edges.left] != grain[edges.right])
    return grain[np.column_stack([edges.left, edges.right])[between]], edges.length[between]
