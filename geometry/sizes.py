"""How large grains are to each other, and how sizes grow away from a place of interest."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Mapping
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, fits, floats_or_nan
from grainlaw.fields import ParameterError, checked_field, parameter
from grainlaw.geometry.cells.grain_size import some_points
from grainlaw.messages import refusal, short


class Sizes(metaclass=Checked):
    """Draws the areas of grains.

    A whole one, of two diameters::

        @attrs.frozen(kw_only=True)
        class Bimodal(geometry.Sizes):
            ratio: float = gl.parameter("1", above=1)

            def draw(self, count, random):
                return np.where(random.random(count) < 0.5, 1, self.ratio**2)
    """

    @abstractmethod
    def draw(self, count: int, random: np.random.Generator) -> np.ndarray:
        """(count,) areas above 0; only what they are to each other counts."""


@attrs.frozen(kw_only=True)
class Even(Sizes):
    """Grains of one size."""

    diameter: float = parameter("1", default=1.0)  #: beside those of other phases, in the same unit

    def draw(self, count: int, random: np.random.Generator) -> np.ndarray:
        """All the same."""
        return np.full(count, self.diameter**2)


@attrs.frozen(kw_only=True)
class Lognormal(Sizes):
    """Grains whose diameters, those of circles of the same area, have a logarithm that is normally distributed.

    ``deviation`` is the standard deviation of the diameters over their mean. That of their logarithm is
    sqrt(ln(1 + deviation^2)).
    """

    deviation: float = parameter("1", at_least=0, at_most=1)  #: standard deviation of the diameters over their mean
    diameter: float = parameter("1", default=1.0)  #: mean, beside those of other phases in the same unit

    def draw(self, count: int, random: np.random.Generator) -> np.ndarray:
        """Independent of each other."""
        variance = math.log(1 + self.deviation**2)
        return self.diameter**2 * np.exp(2 * math.sqrt(variance) * random.standard_normal(count) - variance)


@attrs.frozen(kw_only=True)
class NaturalGrowth(Sizes):
    """The sizes of grains that have grown at the cost of their neighbours: lognormal diameters, deviation 0.42.

    It is the grain growth of Neper in two dimensions, ``diameq:lognormal(1,0.42)``, where the first number is the mean
    of the diameters and the second their standard deviation (documentation of its option -morpho; Quey and Renversade
    2018, doi:10.1016/j.cma.2017.10.029). Neper also gives these grains a circularity.
    """

    diameter: float = parameter("1", default=1.0)  #: mean, beside those of other phases in the same unit

    def draw(self, count: int, random: np.random.Generator) -> np.ndarray:
        """Independent of each other."""
        return Lognormal(deviation=0.42, diameter=self.diameter).draw(count, random)


def _row(where: str, value: Any) -> tuple[float, ...] | None:
    if value is None:
        return None
    row = floats_or_nan(value)
    if row.ndim != 1 or not row.size or not np.isfinite(row).all() or row.min() < 0:
        raise refusal(where, value, "a list of finite numbers, none below 0")
    return tuple(row.tolist())


def numbers(unit: str, **default: Any) -> Any:
    """Declare a list of numbers of a component, none below 0, with its unit."""
    return checked_field(_row, metadata={"unit": unit}, **default)


@attrs.frozen(kw_only=True)
class Empirical(Sizes):
    """Grains whose diameters are drawn from measured ones, or from the classes of a histogram of them.

    Diameters are those of circles of the same area. ``weights`` are the numbers of grains, or shares of their number;
    those of equal weight unless given.
    """

    diameters: tuple[float, ...] = numbers("m")  #: of circles of the same area as the grains
    #: numbers of grains of each diameter; equal if not given
    weights: tuple[float, ...] | None = numbers("1", default=None)

    def __attrs_post_init__(self) -> None:
        if self.diameters is None or min(self.diameters) <= 0:
            raise refusal("Empirical: diameters", self.diameters, "above 0")
        if self.weights is not None and (len(self.weights) != len(self.diameters) or sum(self.weights) <= 0):
            raise refusal("Empirical: weights", self.weights, f"{len(self.diameters)} numbers, one for each diameter")

    def draw(self, count: int, random: np.random.Generator) -> np.ndarray:
        """Independent of each other."""
        weights = np.ones(len(self.diameters)) if self.weights is None else np.array(self.weights)
        return np.array(self.diameters)[random.choice(len(weights), count, p=weights / weights.sum())] ** 2


def _sizes_by_name(value: Any) -> dict[str, Sizes]:
    if not fits(value, Mapping[str, Sizes]) or not value:
        raise refusal("ByPhase: sizes", value, "a mapping from names of phases to Sizes")
    return dict(value)


@attrs.frozen
class ByPhase(metaclass=Checked):
    """Sizes of the grains of each phase: ``ByPhase({"quartz": Lognormal(deviation=0.3, diameter=2 * mm), ...})``.

    The diameters of the phases count beside each other.
    """

    sizes: Mapping[str, Sizes] = attrs.field(converter=_sizes_by_name)  #: by name of the phase

    def draw(
        self, fractions: Mapping[str, float], count: int, random: np.random.Generator
    ) -> tuple[np.ndarray, np.ndarray]:
        """(count,) phases, by their place in ``fractions``, and (count,) areas as shares of the whole.

        The areas of each phase add up to its fraction exactly. Of a phase there are as many grains as its fraction over
        the mean area of its grains asks for, at least one. Raises ParameterError.
        """
        self.require(fractions)
        names = list(fractions)
        share = np.array([float(fractions[name]) for name in names])
        if len(names) > count:
            raise ParameterError(f"ByPhase: {count} grains are not allowed for {len(names)} phases, each needs one")
        sample = [self.sizes[name].draw(SAMPLE, np.random.default_rng(0)).mean() for name in names]
        grains = _whole_numbers(share / np.array(sample), count)
        areas = [self.sizes[name].draw(int(each), random) for name, each in zip(names, grains, strict=True)]
        phases = np.repeat(np.arange(len(names)), grains)
        order = random.permutation(count)
        return phases[order], np.concatenate([a / a.sum() * f for a, f in zip(areas, share, strict=True)])[order]

    def require(self, names: Iterable[str]) -> None:
        """Raise ParameterError for the first phase that has no sizes."""
        for name in names:
            if name not in self.sizes:
                raise ParameterError(f"ByPhase: sizes has none for {short(name)} (it has: {', '.join(self.sizes)})")


SAMPLE = 10_000  #: grains of whose areas the mean decides how many grains a phase has


def _whole_numbers(wanted: np.ndarray, count: int) -> np.ndarray:
    """At least 1 and nearly in proportion to what is wanted, with this sum: the largest remainders are rounded up."""
    wanted = wanted / wanted.sum() * count
    whole = np.maximum(np.floor(wanted).astype(int), 1)
    while whole.sum() != count:
        if whole.sum() < count:
            whole[np.argmax(wanted - whole)] += 1
        else:
            whole[np.argmax(np.where(whole > 1, whole - wanted, -np.inf))] -= 1
    return whole


@attrs.frozen(kw_only=True)
class Graded(metaclass=Checked):
    """A size that grows with the distance from a place: ``size + growth * distance``, at most ``largest``.

    Fine grains at the tip of a notch, and coarse ones far from it::

        Laguerre(grain_size=Graded(place=[(0.05, 0.02)], size=1 * mm, growth=0.2, largest=5 * mm))
    """

    place: tuple[tuple[float, float], ...] = checked_field(some_points, metadata={"unit": "m"})  #: point or polyline
    size: float = parameter("m")  #: at the place
    growth: float = parameter("1", at_least=0, at_most=10)  #: m for each m of distance
    largest: float = parameter("m")  #: not exceeded anywhere

    def __attrs_post_init__(self) -> None:
        if self.largest < self.size:
            raise ParameterError(
                f"Graded: largest = {self.largest:g} m is not allowed, it must be at least the size, {self.size:g} m"
            )

    def at(self, points: np.ndarray) -> np.ndarray:
        """(n,) m, at points (n, 2) m."""
        corners = np.array(self.place)
        start, along = corners[:-1], np.diff(corners, axis=0)
        if len(corners) == 1:
            start, along = corners, np.zeros((1, 2))
        away = np.full(len(points), np.inf)
        for a, d in zip(start, along, strict=True):
            share = np.clip((points - a) @ d / max(d @ d, np.finfo(float).tiny), 0, 1)
            away = np.minimum(away, np.hypot(*(points - a - share[:, None] * d).T))
        return np.minimum(self.size + self.growth * away, self.largest)
