"""Irregular grains of prescribed areas: the power cells of weighted seeds."""

from __future__ import annotations

import math
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError, checked_number, parameter, part, whole_number
from grainlaw.geometry.cells.area_cells import AreaFit, areas_cells, checked_areas, grains_of_circularity, scattered
from grainlaw.geometry.cells.grain_size import check_memory, grain_count, require_one
from grainlaw.geometry.sizes import Graded, NaturalGrowth, Sizes, numbers
from grainlaw.messages import refusal
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation, Tessellator

AT_ONCE, MOST = 1_000_000, 1_000_000_000  #: points that graded grains are chosen from: in one piece, and in all
ROUNDEST = math.pi / math.sqrt(12)  #: circularity of regular hexagons, the roundest grains that fill the plane
SUM = 0.01  #: of the area of the region: so far from it may the sum of given areas be


def _circularity(value: Any) -> float | None:
    if value is None:
        return None
    number = checked_number("Laguerre: circularity", value, above=0)
    if number >= ROUNDEST:
        raise refusal("Laguerre: circularity", value, f"above 0 and below {ROUNDEST:.4f}, that of regular hexagons")
    return number


def _grain_size(value: Any) -> float | Graded | None:
    if value is None or isinstance(value, Graded):
        return value
    return checked_number("Laguerre: grain_size", value, "m", above=0)


@attrs.frozen(kw_only=True)
class Laguerre(Tessellator):
    """Convex grains whose sizes have a distribution: power cells of prescribed areas, by optimal transport.

    Give either ``grains``, their number, or ``grain_size``, the square root of their mean area, and the ``sizes``; or
    ``areas``, one for each grain, which must add up to the area of the region to 1 %; grains are numbered by their
    place, ``fit(region).owner`` says which area each has. A ``grain_size`` that is :class:`Graded` is that of the mean
    area at each place. The first seeds are independent
    and uniform. In each round of ``relaxation`` they move to the centroids of their cells, which become rounder; with
    ``circularity``, the mean of 4 pi area / perimeter^2 that is asked for, they move as often as it needs, and
    ``relaxation`` does not count.

    In a convex region all areas are met to 2 %, as a rule to 0.3 %; :meth:`fit` reports it. Elsewhere a grain has the
    area that it has inside the region, and a cell that the region cuts gives several grains, which have that area
    together. There, too, areas are met to 0.3 % as a rule, but nothing holds it where grains are as large as the parts
    of the region.

    Edges shorter than ``merge`` times the size of the smallest grain at their ends vanish, after which vertices move a
    little to make the areas right again; fewer edges vanish where that fails.

    Kitagawa, Merigot and Thibert 2019, doi:10.4171/JEMS/889; Bourne, Kok, Roper and Spanjer 2020,
    doi:10.1080/14786435.2020.1790053.
    """

    grains: int | None = whole_number(at_least=1, default=None)  #: number of grains; give this, grain_size or areas
    #: square root of their mean area
    grain_size: float | Graded | None = attrs.field(default=None, converter=_grain_size, metadata={"unit": "m"})
    areas: tuple[float, ...] | None = numbers("m2", default=None)  #: of each grain; they must fill the region
    sizes: Sizes = part(Sizes, NaturalGrowth())  #: distribution of the sizes
    seed: int = whole_number(at_least=0, default=1)  #: of the random numbers
    relaxation: int = whole_number(at_least=0, at_most=1000, default=5)  #: rounds
    #: wanted mean of 4 pi area / perimeter^2
    circularity: float | None = attrs.field(default=None, converter=_circularity)
    merge: float = parameter("grain sizes", default=0.25, at_least=0, below=1)  #: shorter edges vanish where they can

    def __attrs_post_init__(self) -> None:
        require_one(self, "areas")
        if self.areas is not None:
            checked_areas("Laguerre: areas", np.array(self.areas))

    @checked
    def tessellate(self, region: Region) -> Tessellation:
        """Fill a region; grains near in space are near in number. Raises ParameterError."""
        return self.fit(region).tessellation

    def fit(self, region: Region) -> AreaFit:
        """Grains, and the largest and rms error of their areas before and after short edges were merged."""
        random = np.random.default_rng(self.seed)
        if isinstance(self.grain_size, Graded):
            seeds = graded_points(region, self.grain_size, random)
            areas = drawn(self.sizes, len(seeds), random) * self.grain_size.at(seeds) ** 2
        else:
            areas = self._areas(region, random)
            seeds = scattered(region, len(areas), random)
        if self.circularity is None:
            return areas_cells(region, areas, seeds, self.relaxation, self.merge)
        return grains_of_circularity("Laguerre", region, areas, seeds, self.circularity, self.merge)

    def _areas(self, region: Region, random: np.random.Generator) -> np.ndarray:
        if self.areas is None:
            return drawn(self.sizes, grain_count(self, region), random)
        total = sum(self.areas)
        if abs(total / region.area - 1) > SUM:
            raise ParameterError(
                f"Laguerre: areas are not allowed, they add up to {total:g} m2, the region has {region.area:g} m2"
            )
        check_memory("Laguerre", f"{len(self.areas)} areas", len(self.areas))
        return np.array(self.areas)


def graded_points(region: Region, size: Graded, random: np.random.Generator) -> np.ndarray:
    """(n, 2) m, independent points in a region, as many on an area as grains of the sizes fill it.

    Raises ParameterError for more than the memory holds.
    """
    left, found, first = max(1, round(min(region.area / size.size**2, 2.0 * MOST))), [np.empty((0, 2))], None
    if left > MOST:
        raise refusal("Laguerre: grain_size.size", size.size, f"at least {math.sqrt(region.area / MOST):.2g} m here")
    while left > 0:
        points = scattered(region, min(left, AT_ONCE), random)
        first = points[:1] if first is None else first
        found.append(points[random.random(len(points)) < (size.size / size.at(points)) ** 2])
        left -= len(points)
        count = sum(map(len, found))
        check_memory("Laguerre", f"grain_size.size = {size.size:g} m, which makes more than {count} grains,", count)
    chosen = np.concatenate(found)
    return chosen if len(chosen) or first is None else first


def drawn(sizes: Sizes, count: int, random: np.random.Generator) -> np.ndarray:
    """(count,) relative areas. Raises ParameterError for what a user's own sizes draw that cannot be areas."""
    where = f"{type(sizes).__name__}: areas that draw gave"
    areas = checked_areas(where, sizes.draw(count, random))
    if len(areas) != count:
        raise ParameterError(f"{where} are {len(areas)}, they must be {count}")
    return areas
