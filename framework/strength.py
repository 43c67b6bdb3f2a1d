"""Strength: the first failure of a specimen, one definition for all tests (docs/strength.md)."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping

import attrs
import numpy as np

from grainlaw.columns import DEVIATOR, NOISE, STAGE, STRAIN, STRESS

NORMAL = 0.6745  #: median of what is normally distributed, over its standard deviation
WITHIN = 0.01  #: of the deformation: a load that has not grown while this has grown by so much has failed,
GROWTH = 0.001  #: that is by less than this share of it;
FALL = 0.05  #: and so has one that has fallen by this share
CLEAR = 8  #: times the noise: so much more load than before is no chance
LEAST = 0.1  #: of the largest load: what happens below is no failure, such as the first wave of a platen

#: columns of the load and of the deformation that strength is read from, in the order in which they are looked for
LOADS = (
    (DEVIATOR, STRAIN),
    ("shear_stress", "displacement"),
    ("normal", "opening"),
    (STRESS, STRAIN),
    ("force", "deflection"),
)


class Until(enum.Enum):
    """When a test ends that loads a specimen until it fails."""

    FALL = enum.auto()  #: when the load has fallen to the stop_fraction of the largest
    FAILURE = enum.auto()  #: at the first failure; what is left is not loaded on


@attrs.frozen(kw_only=True)
class Borne:
    """What a specimen has borne, as numbers of samples."""

    failed: bool  #: whether it has failed
    at: int  #: the largest load up to the first failure, or of all if there is none
    largest: int  #: the largest load of all


def borne(load: np.ndarray, deformation: np.ndarray, stage: np.ndarray, noise: float = 0.0) -> Borne | None:
    """The first failure in a record of (t,) samples; None where no load is above zero.

    ``noise`` is the standard deviation of the load as it is measured: where 1 % of the deformation raises the load by
    less than ``CLEAR`` times that, it is looked at over more, and a fall is larger by as much.

    The deformation counts from the beginning of the stage in which the load first reaches a tenth of its largest; a
    load that is there before any deformation, as of heating, counts with the one that it would have taken. What has
    been unloaded counts again from where it was: of the deformation only what is new. Loads of different stages are
    not compared: a loop of unloading may take some of the load for good. Nor is it a failure that the load falls
    with the deformation in a stage in which it has not grown, or before it exceeds what it was: a loop in a record of a
    laboratory. Where it never does the specimen has failed though its deformation fell (class II).
    """
    if not len(load) or not load.max() > 0:
        return None
    largest = int(np.argmax(load))
    first = int(np.argmax(stage == stage[np.argmax(load >= LEAST * load[largest])]))
    way = _with_that_before(deformation[first:] - (deformation[first - 1] if first else 0.0), load[first:])
    highest = np.maximum.accumulate(load[first:])
    fresh = np.flatnonzero(way >= np.maximum.accumulate(np.append(0.0, way))[:-1])
    least = np.minimum.reduceat(way, fresh) if len(fresh) else fresh  # until the next of them
    loops = np.cumsum(np.append(0, least[:-1] < (1 - WITHIN) * way[fresh[:-1]])) if len(fresh) else fresh
    parts = np.split(fresh, stage_begins(stage[first:][fresh] + loops))
    stopped = [_stopped(part, way, load[first:], noise) for part in parts]
    is_new = np.append(True, load[first:][1:] > highest[:-1])
    sample = np.arange(len(way))
    top = np.maximum.accumulate(np.where(is_new, sample, 0))  # where it was the highest for the first time
    # Where a stage unloads, the load may still grow a little before it falls with the deformation.
    began = np.maximum.accumulate(np.where(np.append(True, np.diff(stage[first:]) != 0), sample, 0))
    comes_back = np.maximum.accumulate(load[first:][::-1])[::-1] > highest
    loads = (way >= way[top]) | ((load[first:][began[top]] <= (1 - FALL) * highest) & ~comes_back)
    same = stage[first:] == stage[first:][top]
    fallen = np.flatnonzero((load[first:] <= (1 - FALL) * highest - CLEAR * noise) & same & loads)
    failed = np.concatenate([*stopped, fallen])
    failed = failed[highest[failed] >= LEAST * load[largest]]
    if not len(failed):
        return Borne(failed=False, at=largest, largest=largest)
    return Borne(failed=True, at=first + int(top[failed.min()]), largest=largest)


def stage_begins(stage: np.ndarray) -> np.ndarray:
    """Where a stage begins after another."""
    return np.flatnonzero(np.diff(stage)) + 1


def _with_that_before(way: np.ndarray, load: np.ndarray) -> np.ndarray:
    """The deformation, and what the load at its beginning would have taken, where that was mostly there before.

    At the stiffness with which the load then grows by a tenth of what it still gains.
    """
    begins = int(np.argmax(way > 0))
    there = load[begins]
    if not way[begins] > 0 or there < LEAST / 2 * load.max():
        return way
    later = begins + int(np.argmax(load[begins:] >= there + LEAST * (load[begins:].max() - there)))
    if way[later] <= way[begins]:
        return way
    compliance = (way[later] - way[begins]) / (load[later] - there)
    before = compliance * there - way[begins]
    if before <= way[begins]:
        return way
    return np.append(np.minimum(compliance * np.maximum.accumulate(load[:begins]), before), way[begins:] + before)


def _stopped(samples: np.ndarray, way: np.ndarray, load: np.ndarray, noise: float) -> np.ndarray:
    """Those of the samples of a stage at which the load has not grown for so much of the deformation."""
    if not len(samples):
        return samples
    reached, highest = way[samples], np.maximum.accumulate(load[samples])
    if samples[0] == 0:  # it begins without a load
        reached, highest = np.append(0.0, reached), np.append(0.0, highest)
    now = highest[-len(samples) :]
    within = np.maximum(WITHIN, CLEAR * noise / np.maximum(now, max(noise, 1e-300)))
    before = np.interp(way[samples] / (1 + within), reached, highest, left=-np.inf)
    has_moved = way[samples] > 0  # where a record begins under load the first one tells nothing
    return samples[has_moved & (now <= (1 + GROWTH * (within / WITHIN)) * before)]


def strength_of(found: Borne | None, values: np.ndarray) -> tuple[float, float]:
    """A column (t,) at the first failure, nan where there is none, and at the largest load; such as the strength."""
    if found is None:
        return math.nan, math.nan
    return float(values[found.at]) if found.failed else math.nan, float(values[found.largest])


def borne_in(curves: Mapping[str, np.ndarray]) -> Borne | None:
    """The same by the columns of a run, the first of ``LOADS`` that it has; None where it has none of them."""
    for load, deformation in LOADS:
        if load in curves and deformation in curves:
            return borne(curves[load], curves[deformation], curves[STAGE], noise_of(curves))
    return None


def noise_of(curves: Mapping[str, np.ndarray]) -> float:
    """Standard deviation (Pa) of the load in a record; 0 in a run."""
    return float(curves[NOISE][0]) if NOISE in curves and len(curves[NOISE]) else 0.0


def measured_noise(load: np.ndarray) -> float:
    """The same of a load (t,) that was measured: by its second differences, or by its smallest steps.

    They tell of what changes from sample to sample, and not of what drifts.
    """
    bends, steps = np.abs(np.diff(load, 2)), np.abs(np.diff(load))
    by_bends = float(np.median(bends)) / (NORMAL * math.sqrt(6)) if len(bends) else 0.0
    by_steps = (
        float(np.median(steps[steps > 0])) / 2 if np.count_nonzero(steps) < len(steps) / 2 and steps.any() else 0.0
    )
    return max(by_bends, by_steps)
