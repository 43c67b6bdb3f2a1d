"""The best parameters on specimens that the search has not seen."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import attrs
import numpy as np

from grainlaw.calibration.emulator import restored
from grainlaw.calibration.matching import Match
from grainlaw.calibration.targets import AIMS, Target, Targets, measured_by
from grainlaw.calibration.trials import Simulator, by_shape
from grainlaw.results.means import spread

NEAR = 0.05  #: of a target
MET, WITHIN, NOT_MET, UNDECIDED = "met", "within errors", "not met", "undecided"
UNCHECKED = "Not tried on fresh specimens: it was stopped before. The same call goes on."
WIDE = 0.1  #: of a target: half of an interval by which nothing is shown
SAFE = 1.5  #: times as many specimens as the scatter of few says
FAR = 1.5  #: times the median: what specimens bear in which grains lock
NORMAL = 1.959964  #: deviations of a normal distribution that hold 95 %


@attrs.frozen
class Compared:
    """A quantity of the best parameters on fresh seeds (SI); nan for what is not known."""

    name: str
    target: Target | None
    predicted: float
    predicted_interval: tuple[float, float]  #: 95 %, of the mean of the fresh seeds
    measured: float  #: mean
    interval: tuple[float, float]  #: 95 % of the mean
    count: int
    values: tuple[float, ...] = ()  #: of each specimen, nan where it has none

    @property
    def off(self) -> float:
        """Measured less target, over the target; nan without one."""
        return self.measured / self.target.value - 1 if self.target and self.target.value else math.nan

    @property
    def verdict(self) -> str:
        """``met`` within 5 % of the target, else ``within errors`` or ``not met``; empty without a target.

        Within errors (95 %) of the mean and of the target; ``undecided`` where those of the mean are too wide to tell.
        """
        if self.target is None:
            return ""
        low, high = self.interval
        known = math.hypot((high - low) / 2, NORMAL * self.target.uncertainty)
        is_near, is_within = abs(self.off) <= NEAR, abs(self.measured - self.target.value) <= known
        if not (is_near or is_within):
            return NOT_MET
        return UNDECIDED if high - low > 2 * WIDE * abs(self.target.value) else MET if is_near else WITHIN

    @property
    def is_foreseen(self) -> bool:
        """Whether the mean lies in what was predicted of it; also where nothing was."""
        low, high = self.predicted_interval
        return not (self.measured < low or self.measured > high)

    @property
    def enough(self) -> int:
        """How many fresh specimens should tell whether a target is met where these do not; else as many as now.

        Their scatter is known from few: half as many more than it says.
        """
        if self.target is None or self.verdict != UNDECIDED:
            return self.count
        low, high = self.interval
        return round(SAFE * self.count * ((high - low) / (2 * WIDE * abs(self.target.value))) ** 2)

    @property
    def outliers(self) -> str:
        """How many specimens have far more than most of them, in words; empty where none has."""
        middle = float(np.nanmedian(self.values)) if self.count else math.nan
        far = sum(value > FAR * middle for value in self.values)
        if not far:
            return ""
        shown = AIMS[self.name].shown
        of_median = f"{FAR:g} times the median {shown.words}, {shown.with_unit(middle)}"
        return f"{far} of {self.count} have more than {of_median}"

    @property
    def scatter_in_words(self) -> str:
        """Standard deviation of one specimen, over the mean."""
        deviation = spread(np.array(self.values))["deviation"]
        return f"{100 * deviation / abs(self.measured):.0f} %" if math.isfinite(deviation) else ""


def check(
    match: Match, targets: Targets, simulator: Simulator, best: np.ndarray, tests: Sequence[str],
    seeds: Mapping[str, Sequence[int]],
) -> list[Compared]:  # fmt: skip
    """Test the best parameters (d,) themselves on seeds by shape, and compare with targets and predictions."""
    names, given, values = measured_by(tests, targets), targets.given, dict[str, np.ndarray]()
    for of_shape, own in by_shape(names, seeds):
        values |= simulator.values([match.space.mapping(best)], of_shape, own, np.ones(1))
    rows = [_row(match, name, given, best, values[name][0]) for name in names]
    return sorted(rows, key=lambda row: row.target is None)


def _row(match: Match, name: str, given: Mapping[str, Target], best: np.ndarray, values: np.ndarray) -> Compared:
    measured = spread(values)
    predicted, ends = math.nan, (math.nan, math.nan)
    if name in match.emulators:
        mean, variance = match.one(best[None], name)
        k = match.samples.names.index(name)
        of_seeds = float(match.scatter([name])[0, 0] - match.samples.of_shift[k])  # of the mean over the search's seeds
        deviation = math.sqrt(float(variance[0]) + of_seeds * float(match.samples.seeds[k]) / max(measured["count"], 1))
        low, middle, high = restored(name, mean[0] + NORMAL * deviation * np.array([-1, 0, 1]))
        predicted, ends = float(middle), (float(low), float(high))
    return Compared(
        name, given.get(name), predicted, ends, measured["mean"], measured["interval"], measured["count"],
        tuple(map(float, values)),
    )  # fmt: skip
