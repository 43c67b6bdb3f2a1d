"""Which parameters the tests determine, which directions they do not see, and which further test would tell most."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import attrs
import numpy as np
import scipy

from grainlaw.calibration.emulator import in_one_thread
from grainlaw.calibration.matching import Match
from grainlaw.calibration.posterior import Posterior
from grainlaw.calibration.targets import AIMS, USUAL_UNCERTAINTY
from grainlaw.messages import enumeration

NOT_DETERMINED, WEAKLY = 0.75, 0.5  #: of the width of the prior
UNSEEN = 0.5  #: standard deviation of the posterior along a direction, over that of the prior
NAMED = 0.3  #: parts of a direction that are named
INDEX_POINTS = 1024  #: of each Sobol index; a power of two
PRIOR_POINTS = 4096
TOGETHER = 0.8  #: correlation of two parameters of which tests know the sum, or the difference, better than each
ENOUGH = 0.5  #: of the points have a quantity that is no target, if anything is said of it
PREDICTED = 0.5  #: Q2 of an emulator: what it predicts worse says nothing of what rules a quantity


@attrs.frozen
class Determined:
    """How well the tests determine a parameter (SI)."""

    name: str
    best: float
    interval: tuple[float, float]  #: 95 %
    width: float  #: of the interval, over that of the prior

    @property
    def verdict(self) -> str:
        if self.width >= NOT_DETERMINED:
            return "not determined"
        return "weakly determined" if self.width >= WEAKLY else "determined"


@attrs.frozen
class Direction:
    """A combination of parameters, in shares of their ranges, and what of its prior width the tests leave."""

    parts: dict[str, float]
    width: float

    @property
    def words(self) -> str:
        """Parameters that change together: they grow, or one falls as another grows."""
        largest = max(self.parts, key=lambda name: abs(self.parts[name]))
        named = {name: part for name, part in self.parts.items() if abs(part) >= NAMED}
        if len(named) == 1:
            return largest
        same = [name for name, part in named.items() if part * self.parts[largest] > 0]
        other = [name for name in named if name not in same]
        return f"{enumeration(same)} up" + (f" with {enumeration(other)} down" if other else " together")


@attrs.frozen
class Telling:
    """What a further test would tell."""

    quantity: str
    gain: float  #: bits about the parameters
    helped: str  #: the parameter whose width shrinks most
    width: float  #: what is left of its present width


@attrs.frozen(eq=False)
class Identifiability:
    """Answers of all kinds; arrays are in the order of the parameters."""

    parameters: tuple[Determined, ...]
    correlation: np.ndarray  #: (d, d) of the posterior
    directions: tuple[Direction, ...]  #: all, the least seen first
    further: tuple[Telling, ...]  #: of the quantities that are no targets, the most telling first
    first_order: np.ndarray  #: (q, d) Sobol indices of the quantities over the prior
    total_order: np.ndarray  #: (q, d)
    quantities: tuple[str, ...]  #: that emulators predict, Q2 of at least 0.5

    @property
    def unseen(self) -> tuple[Direction, ...]:
        """Directions of which the tests leave more than half."""
        return tuple(each for each in self.directions if each.width >= UNSEEN)

    @property
    def trade_offs(self) -> list[tuple[str, str, float]]:
        """Two parameters that change together in the posterior, and their correlation."""
        pairs = itertools.combinations(range(len(self.parameters)), 2)
        found = ((self.parameters[i].name, self.parameters[j].name, float(self.correlation[i, j])) for i, j in pairs)
        return [each for each in found if abs(each[2]) >= TOGETHER]

    @property
    def not_determined(self) -> tuple[str, ...]:
        """Parameters of which the tests leave more than three quarters of the range."""
        return tuple(each.name for each in self.parameters if each.width >= NOT_DETERMINED)


@in_one_thread
def identifiability(match: Match, found: Posterior, seed: int) -> Identifiability:
    """From samples of the posterior and of the prior, in shares of the ranges."""
    space = match.space
    prior, after = space.places(space.prior(PRIOR_POINTS, seed)), space.places(found.points)
    widths = width_of(after) / width_of(prior)
    parameters = tuple(
        Determined(name, float(found.best[k]), found.interval(k), float(widths[k]))
        for k, name in enumerate(space.names)
    )
    spread = prior.std(axis=0)
    covariance = np.atleast_2d(np.cov((after / spread).T))
    values, vectors = np.linalg.eigh(covariance)
    directions = tuple(
        Direction(dict(zip(space.names, vectors[:, k].tolist(), strict=True)), float(np.sqrt(max(values[k], 0.0))))
        for k in np.argsort(-values)
    )
    deviation = np.sqrt(np.diag(covariance))
    count = len(match.samples.means)
    names = tuple(
        name for name, each in match.emulators.items()
        if each.q_squared >= PREDICTED and (name in match.targets or len(each.points) >= ENOUGH * count)
    )  # fmt: skip
    first, total = sobol(match, names, seed)
    return Identifiability(
        parameters, covariance / np.outer(deviation, deviation), directions,
        further(match, found, [name for name in names if name not in match.targets]), first, total, names,
    )  # fmt: skip


def width_of(places: np.ndarray) -> np.ndarray:
    """(d,) of the intervals of 95 % of samples (n, d)."""
    low, high = np.quantile(places, [0.025, 0.975], axis=0)
    return np.asarray(high - low)


def further(match: Match, found: Posterior, names: Sequence[str]) -> tuple[Telling, ...]:
    """What quantities that are no targets would tell, if a laboratory measured them to 2 %.

    By a regression of the quantity on the samples of the posterior: the gain is that of its spread there over what
    seeds, emulator and laboratory leave open.
    """
    if not names:
        return ()
    after = match.space.places(found.points)
    means, variances = match.predicted(found.points, names)
    entries = []
    for k, name in enumerate(names):
        size = 1.0 if AIMS[name].is_log else abs(float(means[:, k].mean()))
        noise = float(variances[:, k].mean() + match.scatter([name])[0, 0]) + (USUAL_UNCERTAINTY * size) ** 2
        signal = float(means[:, k].var())
        if signal <= 0:
            continue
        likeness = np.array([np.corrcoef(after[:, j], means[:, k])[0, 1] for j in range(after.shape[1])])
        left = np.sqrt(1 - np.nan_to_num(likeness) ** 2 * signal / (signal + noise))
        helped = int(np.argmin(left))
        gain = 0.5 * float(np.log2(1 + signal / noise))
        entries.append(Telling(name, gain, match.space.names[helped], float(left[helped])))
    return tuple(sorted(entries, key=lambda entry: -entry.gain))


def sobol(match: Match, names: Sequence[str], seed: int) -> tuple[np.ndarray, np.ndarray]:
    """First and total indices (q, d) of quantities over the whole ranges, by their emulators (Saltelli 2010).

    Where the law refuses a part of the ranges the emulators reach beyond their points.
    """
    space = match.space

    def quantities(places: np.ndarray) -> np.ndarray:
        return match.predicted(space.points(np.clip(places.T, 0, 1)), names)[0].T

    shape = len(names), len(space.free)
    if len(space.free) == 1 or not names:  # all of any variance is its own
        return np.ones(shape), np.ones(shape)
    ranges = [scipy.stats.uniform(0, 1)] * len(space.free)
    found = scipy.stats.sobol_indices(func=quantities, n=INDEX_POINTS, dists=ranges, rng=np.random.default_rng(seed))
    return found.first_order.reshape(shape), found.total_order.reshape(shape)
