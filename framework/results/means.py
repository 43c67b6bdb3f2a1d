"""Results of the same laws on several samples: means, ranges and intervals of their properties."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
import scipy

from grainlaw.arguments import is_number
from grainlaw.quantity import Quantity
from grainlaw.results.certificate import is_open, least_of
from grainlaw.results.result import Result

CONFIDENCE = 0.95
ENOUGH = 10  #: specimens that tell a threshold of cracking: one draw moves it by as much as half
Samples = Mapping[str, Mapping[int, Result]]  #: results by law, and by the seed of the sample


def means(summaries: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Mean of each number that all summaries have."""
    shared = [name for name in summaries[0] if all(is_number(summary.get(name)) for summary in summaries)]
    return {name: float(np.mean([summary[name] for summary in summaries])) for name in shared}


def mean_and_range(look: Quantity, results: Collection[Result], name: str) -> str:
    """``3.00 (2.00 to 5.00)``; the mean alone where all are shown alike, a dash where one does not exist.

    ``> `` before it where one is only known to be above a value; means alone of lists, as of one value per cycle.
    """
    found = [least_of(name, result) for result in results]
    if all(isinstance(value, list) for value in found) and len({len(value) for value in found}) == 1:
        return look.text(np.mean(found, axis=0).tolist())
    values = np.array([value if is_number(value) else np.nan for value in found], dtype=float)
    if not len(values) or np.isnan(values).any():
        return "-"
    above = "> " if any(is_open(name, result) for result in results) else ""
    mean, low, high = (look.text(float(v)) for v in (values.mean(), values.min(), values.max()))
    return above + (mean if low == high else f"{mean} ({low} to {high})")


def quantile(count: int) -> float:
    """Of Student's distribution, for an interval of a mean of so many samples."""
    return float(scipy.stats.t.ppf(0.5 + CONFIDENCE / 2, count - 1)) if count > 1 else math.nan


def spread(samples: np.ndarray) -> dict[str, Any]:
    """Count, mean, deviation and interval, without nan: the fields of a ``Spread``."""
    values = samples[~np.isnan(samples)]
    n = len(values)
    mean = float(values.mean()) if n else math.nan
    deviation = float(values.std(ddof=1)) if n > 1 else math.nan
    half = quantile(n) * deviation / math.sqrt(n) if n > 1 else math.nan
    return {"count": n, "mean": mean, "deviation": deviation, "interval": (mean - half, mean + half)}


def mean_and_interval(look: Quantity, values: np.ndarray) -> str:
    """``3.0 (2.5 to 3.5), 9 of 10``: mean and its 95 % interval, of those specimens that have it, where not all do."""
    found = spread(values)
    if not found["count"]:
        return "-"
    low, high = found["interval"]
    interval = "" if math.isnan(low) else f" ({look.text(low)} to {look.text(high)})"
    some = f", {found['count']} of {len(values)}" if found["count"] < len(values) else ""
    return f"{look.text(found['mean'])}{interval}{some}"
