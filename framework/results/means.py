"""Results of the same laws on several samples: means and ranges of their properties."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from numbers import Real
from typing import Any

import numpy as np

from grainlaw.quantity import Quantity
from grainlaw.results.certificate import is_open, least_of
from grainlaw.results.result import Result

Samples = Mapping[str, Mapping[int, Result]]  #: results by law, and by the seed of the sample


def means(summaries: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Mean of each number that all summaries have."""
    shared = [name for name in summaries[0] if all(_is_number(summary.get(name)) for summary in summaries)]
    return {name: float(np.mean([summary[name] for summary in summaries])) for name in shared}


def mean_and_range(look: Quantity, results: Collection[Result], name: str) -> str:
    """``3.00 (2.00 to 5.00)``; the mean alone where all are shown alike, a dash where one does not exist.

    ``> `` before it where one is only known to be above a value.
    """
    found = [least_of(name, result) for result in results]
    values = np.array([value if _is_number(value) else np.nan for value in found], dtype=float)
    if not len(values) or np.isnan(values).any():
        return "-"
    above = "> " if any(is_open(name, result) for result in results) else ""
    mean, low, high = (look.text(float(v)) for v in (values.mean(), values.min(), values.max()))
    return above + (mean if low == high else f"{mean} ({low} to {high})")


def _is_number(value: Any) -> bool:
    return isinstance(value, (Real, np.number)) and not isinstance(value, bool)
