"""Stages that come before a test and do not count as a part of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from grainlaw.columns import STAGE, since
from grainlaw.conditions import Curves
from grainlaw.protocol import LoadingProtocol
from grainlaw.quantity import Quantity

Counted = Callable[[Curves, int], Curves]  #: :meth:`LoadingProtocol.counted`


def samples_before(curves: Curves, stages: int) -> int:
    """The number of samples in the first ``stages``."""
    return int(np.searchsorted(curves[STAGE], stages))


def after_stages(curves: Curves, stages: int, declared: Sequence[Quantity]) -> dict[str, np.ndarray]:
    """Samples after the first ``stages``; numbers of stages count from there, and what a test ``counts``."""
    end = samples_before(curves, stages)
    after = since(curves, end, {each.name: each for each in declared})
    if end:
        after[STAGE] = after[STAGE] - stages
    return after


def begins_after(test: LoadingProtocol, curves: Curves, stages: int) -> int:
    """Number of the sample with which a test begins that comes after ``stages``; its own ones may prepare, too."""
    end = samples_before(curves, stages)
    return end + test.begins(after_stages(curves, stages, test.quantities)) if end < len(curves[STAGE]) else end


def counted_after(counted: Counted, curves: Curves, first: int, stages: int, declared: Sequence[Quantity]) -> Curves:
    """What the conditions of a stage see whose first sample is ``first``, of a test that comes after ``stages``."""
    end = samples_before(curves, stages)
    if first < end:
        return {name: values[first:] for name, values in curves.items()}
    return counted(after_stages(curves, stages, declared), first - end)
