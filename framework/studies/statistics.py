"""Means, paired differences and interactions, with what they are worth."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import attrs
import numpy as np
import scipy

from grainlaw.arguments import Checked
from grainlaw.columns import quantity_of
from grainlaw.fields import ParameterError, checked_number
from grainlaw.messages import nearest
from grainlaw.quantity import Quantity, aligned
from grainlaw.results.means import quantile, spread
from grainlaw.results.tables import latex_lines

NO_SHARE = 100.0  #: a difference over a mean at the first level that is next to nothing
MOST = 10_000_000  #: samples that are asked for at most

Interval = tuple[float, float]


@attrs.frozen
class Spread(metaclass=Checked):
    """Mean of samples of a quantity, and how well it is known."""

    count: int  #: samples, without those that are nan
    mean: float  #: in the unit of the quantity
    deviation: float  #: standard deviation of a sample, nan of one
    interval: Interval  #: 95 %, Student's; nan for fewer than two samples

    def samples_for(self, width: float) -> int:
        """Samples that an interval of this width (from end to end) would take, if they scatter as these do.

        Raises :class:`ParameterError` for fewer than two samples, a width that is not positive, or one that would take
        more than ten million.
        """
        width = checked_number("samples_for: width", width, above=0)
        checked_number("samples_for: count of samples", self.count, at_least=2)

        def is_enough(n: int) -> bool:
            return 2 * quantile(n) * self.deviation <= width * math.sqrt(n)

        if not is_enough(MOST):
            raise ParameterError(
                f"samples_for: width = {width:g} is not allowed, it would take more than {MOST:,} samples"
            )
        return 2 + bisect_left(range(2, MOST), True, key=is_enough)


@attrs.frozen
class Mean(Spread):
    """Mean of a quantity over the cases of a group."""

    group: dict[str, Any]  #: levels of the factors by which cases are grouped


def mean_in_words(entry: Spread, look: Quantity, most: int = 0) -> str:
    """``12.3 ± 0.4``: a mean and half of its 95 % interval, which one sample has not.

    Of fewer than ``most`` samples their number follows, ``12.3 ± 0.4 (2)``.
    """
    half = (entry.interval[1] - entry.interval[0]) / 2
    fewer = f" ({entry.count})" if 0 < entry.count < most else ""
    return look.text(entry.mean) + ("" if math.isnan(half) else f" ± {look.text(half)}") + fewer


@attrs.frozen
class Difference(Spread):
    """Mean difference of a quantity between two levels of a factor, of cases that are equal in all else."""

    group: dict[str, Any]  #: levels of the other factors
    factor: str  #: whose levels differ
    levels: tuple[Any, Any]  #: the second less the first
    share: float  #: mean difference over the mean at the first level
    share_interval: Interval  #: 95 %, Fieller's; nan where the mean at the first level may be zero
    higher: int  #: pairs in which the second is higher
    p_value: float  #: of the sign test: how often so many are of one sign by chance
    unpaired: int  #: cases without a partner, which has failed or is missing


@attrs.frozen
class Interaction(Spread):
    """How much the difference between two levels of one factor differs between two levels of another."""

    group: dict[str, Any]  #: levels of the other factors
    factors: tuple[str, str]  #: names of both
    first: tuple[Any, Any]  #: levels of the first factor
    second: tuple[Any, Any]  #: levels of the second factor


def difference(
    group: dict[str, Any], factor: str, levels: tuple[Any, Any], pairs: np.ndarray, unpaired: int
) -> Difference:
    """From pairs (n, 2) of values at the two levels."""
    change = pairs[:, 1] - pairs[:, 0]
    higher, lower = int(np.sum(change > 0)), int(np.sum(change < 0))
    first = float(pairs[:, 0].mean()) if len(pairs) else math.nan
    found = spread(change)
    return Difference(
        **found, group=group, factor=factor, levels=levels, share=found["mean"] / first if first else math.nan,
        share_interval=_share_interval(pairs), higher=higher, unpaired=unpaired,
        p_value=float(scipy.stats.binomtest(higher, higher + lower).pvalue) if higher + lower else math.nan,
    )  # fmt: skip


def _share_interval(pairs: np.ndarray) -> Interval:
    """Of the ratio of the means less 1: ratios r for which the mean of second - r first may be 0 (Fieller 1954)."""
    n = len(pairs)
    if n < 2:
        return math.nan, math.nan
    first, second = pairs.mean(axis=0)
    (xx, xy), (_, yy) = quantile(n) ** 2 / n * np.cov(pairs.T)
    a, b, c = first**2 - xx, first * second - xy, second**2 - yy
    if a <= 0:
        return math.nan, math.nan
    half = math.sqrt(max(b**2 - a * c, 0.0))
    return float((b - half) / a - 1), float((b + half) / a - 1)


_NO_MARKS = str.maketrans("", "", '{}"')


def level(factor: str, value: Any) -> str:
    """A level of a factor as people write it, in the unit of its heading; a table of a file without its marks."""
    look = quantity_of(factor)
    if isinstance(value, str) and value.startswith("{"):
        return value.translate(_NO_MARKS).replace(" = ", " ").strip()
    if isinstance(value, (bool, str)) or (isinstance(value, int) and look.factor == 1):
        return str(value)  # all digits of a seed
    return f"{value * look.factor:.6g}" if isinstance(value, (int, float)) else str(value)


def label(factors: Sequence[str], row: Mapping[str, Any]) -> str:
    """The levels of a row, with the names of their factors."""
    return ", ".join(f"{name} = {level(name, row[name])}" for name in factors)


class Listing(tuple):
    """Several means, differences or interactions of one quantity; prints as a table."""

    name: str
    look: Quantity

    def __new__(cls, name: str, entries: Sequence[Any], look: Quantity | None = None) -> Listing:
        made = super().__new__(cls, entries)
        made.name, made.look = name, look or quantity_of(name)
        return made

    @property
    def lines(self) -> list[list[str]]:
        """The texts of a table, with its headings first; empty where there is nothing."""
        return [_heading(self[0], self.look.heading), *(_row(entry, self.look) for entry in self)] if self else []

    def to_latex(self) -> str:
        """The same table for a paper (LaTeX, package booktabs)."""
        return latex_lines(self.lines)

    def __str__(self) -> str:
        return aligned(self.lines, rule=True) if self else f"there is nothing to say of {self.name}"

    __repr__ = __str__


class By(Mapping[str, Listing]):
    """What is known of each quantity, by its name; found when it is asked for."""

    def __init__(self, names: Sequence[str], find: Callable[[str], Listing]) -> None:
        self._names, self._find = list(names), find

    def __getitem__(self, name: str) -> Listing:
        if name not in self._names:
            raise ParameterError(f"there is no column of single numbers '{name}'{nearest(name, self._names)}")
        return self._find(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


def _heading(entry: Any, name: str) -> list[str]:
    head = [", ".join(quantity_of(name).heading for name in entry.group)]
    if isinstance(entry, Difference):
        return [*head, "levels", "n", name, "95 %", "share", "higher", "p"]
    if isinstance(entry, Interaction):
        return [*head, "levels", "n", name, "95 %"]
    return [*head, "n", name, "95 %", "deviation"]


def _row(entry: Any, look: Quantity) -> list[str]:
    low, high = entry.interval
    value = [look.text(entry.mean), f"{look.text(low)} to {look.text(high)}" if math.isfinite(low) else "-"]
    head = [", ".join(level(name, value) for name, value in entry.group.items()) or "all"]
    if isinstance(entry, Difference):
        first, second = (level(entry.factor, each) for each in entry.levels)
        higher = f"{entry.higher} of {entry.count}"
        p_value = "-" if math.isnan(entry.p_value) else f"{entry.p_value:.2g}"
        return [*head, f"{second} - {first}", str(entry.count), *value, _share(entry), higher, p_value]
    if isinstance(entry, Interaction):
        a, b = (level(entry.factors[0], each) for each in entry.first)
        c, d = (level(entry.factors[1], each) for each in entry.second)
        return [*head, f"({b} - {a}) at {d} - at {c}", str(entry.count), *value]
    return [*head, str(entry.count), *value, look.text(entry.deviation)]


def _share(entry: Difference) -> str:
    """``+4.0 % (1.2 to 6.9)``."""
    if not abs(entry.share) < NO_SHARE:
        return "-"
    low, high = (100 * end for end in entry.share_interval)
    return f"{100 * entry.share:+.1f} %" + (f" ({low:.1f} to {high:.1f})" if math.isfinite(low) else "")
