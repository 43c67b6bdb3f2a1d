"""Free thermal strain: how much a grain expands without stress, over the temperature."""

from __future__ import annotations

import itertools
import math
from abc import abstractmethod
from collections.abc import Sequence
from numbers import Real
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.fields import ParameterError, parameter
from grainlaw.material import ABSOLUTE_ZERO
from grainlaw.messages import refusal, short

BENDS = 6  #: corners of a table in one part of it
MOST = 4 * BENDS  #: temperatures in a table


class Expansion(metaclass=Checked):
    """Free strain of a mineral along one direction: a function of the temperature alone."""

    temperatures: tuple[float, float] = (ABSOLUTE_ZERO, math.inf)  #: °C, between which it is known

    @abstractmethod
    def strain(self, temperature: Any) -> Any:
        """Strain at a temperature (°C) from any fixed one, in scalars, compiled as the material is."""


@attrs.frozen
class ConstantExpansion(Expansion):
    """A strain in proportion to the temperature."""

    coefficient: float = parameter("1/K", above=-math.inf, usual=(-2e-5, 1e-4))  #: free strain of one kelvin

    def strain(self, temperature: Any) -> Any:
        return self.coefficient * temperature


@attrs.frozen
class _Bends:
    """Changes of slope, each from its temperature on."""

    t0: float
    t1: float
    t2: float
    t3: float
    t4: float
    t5: float
    c0: float
    c1: float
    c2: float
    c3: float
    c4: float
    c5: float

    def strain(self, t: Any) -> Any:
        first = self.c0 * max(t - self.t0, 0.0) + self.c1 * max(t - self.t1, 0.0) + self.c2 * max(t - self.t2, 0.0)
        last = self.c3 * max(t - self.t3, 0.0) + self.c4 * max(t - self.t4, 0.0) + self.c5 * max(t - self.t5, 0.0)
        return first + last


def _numbers(value: Any) -> tuple[float, ...]:
    listed = isinstance(value, (Sequence, np.ndarray)) and not isinstance(value, str)
    if not listed or not all(isinstance(entry, Real) and not isinstance(entry, bool) for entry in value):
        raise refusal("ExpansionTable", value, "two lists of numbers, temperatures (°C) and strains")
    return tuple(map(float, value))


@attrs.frozen
class ExpansionTable(Expansion):
    """Free strains at rising temperatures (°C), at most 24, with straight lines between them.

    Heating and cooling go along the same table: a strain that is another one on the way back would leave a strain
    behind in every cycle, and energy with it.
    """

    #: temperatures
    at: tuple[float, ...] = attrs.field(converter=_numbers, metadata={"unit": "degC", "bounds": "rising"})
    #: from any fixed temperature
    strains: tuple[float, ...] = attrs.field(converter=_numbers, metadata={"unit": "1", "bounds": ""})

    def __attrs_post_init__(self) -> None:
        if len(self.at) != len(self.strains) or not 2 <= len(self.at) <= MOST:
            raise ParameterError(
                f"ExpansionTable: at has {len(self.at)} temperatures and strains {len(self.strains)} entries; both "
                f"must have the same number, from 2 to {MOST}"
            )
        if not np.isfinite([*self.at, *self.strains]).all() or self.at[0] < ABSOLUTE_ZERO:
            raise refusal("ExpansionTable: at, strains", (self.at, self.strains), "finite, from absolute zero on")
        for before, after in itertools.pairwise(self.at):
            if after <= before:
                raise ParameterError(
                    f"ExpansionTable: at = {short(self.at)} is not allowed: {after:g} °C follows {before:g} °C; "
                    "temperatures must rise, for the free strain is a function of the temperature alone: with one "
                    "table for heating and another for cooling a cycle would leave a strain, and energy, behind"
                )

    @property
    def temperatures(self) -> tuple[float, float]:  # type: ignore[override]
        return self.at[0], self.at[-1]

    def _bends(self, number: int) -> _Bends:
        slopes = np.diff(self.strains) / np.diff(self.at)
        changes = np.zeros(MOST)
        changes[: len(slopes)] = np.diff(slopes, prepend=0.0)
        starts = np.zeros(MOST)
        starts[: len(slopes)] = self.at[:-1]
        own = slice(BENDS * number, BENDS * (number + 1))
        return _Bends(*starts[own].tolist(), *changes[own].tolist())

    first = property(lambda self: self._bends(0))
    second = property(lambda self: self._bends(1))
    third = property(lambda self: self._bends(2))
    fourth = property(lambda self: self._bends(3))
    base = property(lambda self: self.strains[0])

    def strain(self, temperature: Any) -> Any:
        early = self.base + self.first.strain(temperature) + self.second.strain(temperature)
        return early + self.third.strain(temperature) + self.fourth.strain(temperature)


def as_expansion(value: Any) -> Any:
    """A number (1/K) as an expansion; anything else as it is."""
    return ConstantExpansion(float(value)) if isinstance(value, Real) and not isinstance(value, bool) else value


# Linear expansion from 20 °C at 1 bar, a third of that of the volume: (V/V20)^(1/3) - 1, mean over the directions of
# the crystal. Holland and Powell (2011), J. metamorphic Geol. 29, 333-383, doi:10.1111/j.1525-1314.2010.00923.x, data
# set 62, evaluated with BurnMan 2.1.0 (burnman.minerals.HP_2011_ds62: q, ab, mic, ann). Their quartz has the volume of
# a tricritical transition at 847 K, V = V0 + V_D (Q0^2 - Q^2), Q^4 = 1 - T / 847 K, and no expansion above it.
_MINERALS = (20, 100, 200, 300, 400, 500, 600, 700, 800, 900, 1000)
QUARTZ = ExpansionTable(
    (20, 100, 200, 300, 400, 450, 500, 530, 550, 560, 568, 573.85, 1000),
    (0, 1058e-6, 2512e-6, 4172e-6, 6169e-6, 7386e-6, 8882e-6, 10043e-6, 11064e-6, 11745e-6, 12508e-6, 13921e-6,
     13921e-6),
)  # fmt: skip
ALBITE = ExpansionTable(
    _MINERALS, [0, 666e-6, 1587e-6, 2591e-6, 3675e-6, 4840e-6, 6091e-6, 7437e-6, 8864e-6, 10087e-6, 11239e-6]
)
MICROCLINE = ExpansionTable(
    _MINERALS, [0, 460e-6, 1076e-6, 1719e-6, 2381e-6, 3056e-6, 3742e-6, 4438e-6, 5144e-6, 5859e-6, 6581e-6]
)
BIOTITE = ExpansionTable(  #: of annite, its end member rich in iron
    _MINERALS, [0, 1055e-6, 2481e-6, 3998e-6, 5595e-6, 7271e-6, 9026e-6, 10864e-6, 12791e-6, 14815e-6, 16944e-6]
)
