"""The search: points that fill the ranges, then two waves where the targets leave it open; emulators after each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import attrs
import numpy as np

from grainlaw.calibration.emulator import Samples, anchored, emulators, samples_of, transformed
from grainlaw.calibration.matching import (
    LIMIT,
    TRIED,
    Conflict,
    Knowledge,
    Match,
    Plausible,
    conflicts,
    plausible,
    telling,
)
from grainlaw.calibration.posterior import Posterior, posterior
from grainlaw.calibration.space import Space
from grainlaw.calibration.targets import AIMS, CONFINED, Target
from grainlaw.calibration.trials import Simulator, Values
from grainlaw.fields import ParameterError
from grainlaw.short_form import to_digits

PER_GROUP = 10  #: points of the first wave for each free group
LATER = 5  #: of each later one
WAVES = 3
SHARE = 0.6  #: of the budget that the first wave takes at most
ENOUGH = 0.1  #: of the variance of a prediction is the emulator's: then another wave tells little
STEEP = 5.0  #: of strength over confinement, where one test is all that is known
CANDIDATES = 600  #: of which the points of a wave are chosen

MEANING = f" (no target is more than {LIMIT:g} standard errors off: those of laboratory, grains and emulator together)"
Tell = Callable[[str], None]


@attrs.frozen(eq=False)
class SearchWave:
    """Points that were tested together, and what was plausible after them."""

    first: int  #: number of its first point
    count: int
    share: float  #: of the prior that is plausible
    least: float  #: largest implausibility of the best point


@attrs.frozen(eq=False)
class TestedPoints:
    """Everything that was tested; the scale of each point is one."""

    points: np.ndarray  #: (n, d) parameters
    scales: np.ndarray  #: (n,) of the rocks for which confined tests were made
    values: Values  #: of each quantity (n, seeds)
    anchors: Mapping[int, Values] = attrs.field(factory=dict)  #: by number of a point: its values (1, m) on more seeds

    @property
    def samples(self) -> Samples:
        found = samples_of(self.values)
        return anchored(found, self.anchors) if self.anchors else found

    @property
    def more(self) -> dict[int, dict[str, np.ndarray]]:
        """Values (m,) on the further seeds alone, by the number of a point that has them."""
        return {
            number: {name: each[0, self.values[name].shape[1] :] for name, each in values.items()}
            for number, values in self.anchors.items()
        }

    def with_more(self, points: np.ndarray, scales: np.ndarray, values: Values) -> TestedPoints:
        if not len(self.points):
            return TestedPoints(points, scales, values)
        return TestedPoints(
            np.concatenate([self.points, points]), np.concatenate([self.scales, scales]),
            {name: np.concatenate([self.values[name], more]) for name, more in values.items()}, self.anchors,
        )  # fmt: skip


@attrs.frozen(eq=False)
class SearchResult:
    """How a search ended: with a posterior, or with targets that are in conflict."""

    design: TestedPoints
    waves: tuple[SearchWave, ...]
    match: Match
    plausible: Plausible
    posterior: Posterior | None
    conflicts: tuple[Conflict, ...]


@attrs.frozen(eq=False)
class Search:
    """Up to ``budget`` points, each on the same ``seeds``; the same ``seed`` chooses the same points.

    The best point after the first wave, and that after the last of several, are tested on the seeds ``more`` too, to
    know how weak or strong the others are.
    """

    space: Space
    targets: Mapping[str, Target]  #: those that take tests
    quantities: Sequence[str]  #: that are measured, targets or not
    simulator: Simulator
    seeds: Sequence[int]
    budget: int
    seed: int
    more: Sequence[int] = ()
    tell: Tell = lambda words: None
    begin: np.ndarray | None = None  #: (n, d) points to begin with, the likeliest first; None to fill the ranges
    before: Knowledge | None = None  #: what is known without tests
    chains: Path | None = None  #: folder that keeps the samples of posteriors

    def run(self) -> SearchResult:
        groups = len(self.space.groups)
        chosen = self._beginning
        design, waves = TestedPoints(np.empty((0, len(self.space.free))), np.empty(0), {}), list[SearchWave]()
        for number in range(1, WAVES + 1):
            what = " (what is tested together)" if number == 1 else ""
            self.tell(f"wave {number} of at most {WAVES}{what}: {self._in_words(len(chosen))}")
            first = len(design.points)
            design = design.with_more(chosen, *self._tested(chosen, self.seeds))
            match, left = self._looked_at(design, number)
            if number == 1:
                design, match, left = self._with_anchor(design, match, left, number)
            waves.append(SearchWave(first, len(design.points) - first, left.share, left.least))
            self.tell(self._left_in_words(left, MEANING if number == 1 else ""))
            room = (self.budget - len(design.points) - bool(self.more)) // max(WAVES - number, 1)
            room = min(LATER * groups, room)
            chosen = self._next(match, left, room, number) if number < WAVES and room > 0 else chosen[:0]
            if not len(chosen):
                break
        if number > 1:  # else it would be the same point again
            before = left
            design, match, left = self._with_anchor(design, match, left, number)
            if left is not before:
                self.tell(f"with them {self._left_in_words(left)}")
        waves[-1] = SearchWave(first, len(design.points) - first, left.share, left.least)
        if left.least > LIMIT:
            found = conflicts(match, self._tried, self.seed)
            return SearchResult(design, tuple(waves), match, left, None, tuple(found))
        self.tell("how well the targets determine the parameters: chains of samples, some half a minute without tests")
        samples = posterior(match, self._start(left), self.seed, folder=self.chains)
        return SearchResult(design, tuple(waves), match, left, samples, ())

    def pilot(self) -> np.ndarray:
        """(d,) parameters near the best: the first to begin with, or else from the first ones of the first wave."""
        if self.begin is not None:
            return np.asarray(self.space.at_reference(self.begin[:1])[0])
        groups = len(self.space.groups)
        count = max(groups + 4, min(LATER * groups, self.budget // 3))
        chosen = self.space.at_reference(self.space.prior(count, self.seed))
        self.tell(f"pilot: {self._in_words(len(chosen))}")
        match = self._match(TestedPoints(chosen, *self._tested(chosen, self.seeds)))
        best = plausible(match, self._tried, self.seed).best
        near = self.space.at_reference(best[None])
        return np.asarray(near[0] if self.space.allowed(near)[0] else chosen[0])

    def _in_words(self, count: int) -> str:
        return f"{count} sets of parameters, each on {len(self.seeds)} specimens"

    def _left_in_words(self, left: Plausible, meaning: str = "") -> str:
        best = f"the best set is {left.least:.1f} standard errors off, {self.space.in_words(left.best)}"
        return f"by the emulators {100 * left.share:.2g} % of the ranges are plausible{meaning}; {best}"

    @property
    def _beginning(self) -> np.ndarray:
        """(n, d) points of the first wave: half as many where it is known where they should be."""
        groups = len(self.space.groups)
        wanted = PER_GROUP * groups if self.begin is None else LATER * groups + 4
        count = min(wanted, max(int(SHARE * self.budget), groups + 4)) - bool(self.more)
        points = self.space.prior(count, self.seed) if self.begin is None else self.begin[:count]
        return self.space.at_reference(points)

    @property
    def _tried(self) -> np.ndarray:
        """(n, d) points of the prior at which emulators are asked."""
        return self.space.prior(TRIED, self.seed + 1)

    def _looked_at(self, design: TestedPoints, number: int) -> tuple[Match, Plausible]:
        match = self._match(design)
        return match, plausible(match, self._tried, self.seed + number)

    @staticmethod
    def _start(left: Plausible) -> np.ndarray:
        """(n, d) where the samples of a posterior begin."""
        return left.points if len(left.points) else left.best[None]

    def _with_anchor(
        self, design: TestedPoints, match: Match, left: Plausible, number: int
    ) -> tuple[TestedPoints, Match, Plausible]:
        """The best point on more seeds, and what is plausible then."""
        if not self.more:
            return design, match, left
        best = left.best if left.least > LIMIT else self._sampled(match, self._start(left)).best
        point = self.space.at_reference(best[None])
        if not self.space.allowed(point)[0]:
            return design, match, left
        self.tell(f"one set more, the best by now, on {len(self.seeds) + len(self.more)} specimens")
        scales, values = self._tested(point, [*self.seeds, *self.more])
        of_all = {name: each[:, : len(self.seeds)] for name, each in values.items()}
        anchors = {**design.anchors, len(design.points): values}
        design = attrs.evolve(design.with_more(point, scales, of_all), anchors=anchors)
        return design, *self._looked_at(design, number)

    def _match(self, design: TestedPoints) -> Match:
        samples = design.samples
        found = emulators(self.space.coordinates(design.points), samples, self.seed)
        for name in self.targets:
            if name not in found:
                known = int(np.isfinite(design.values[name]).any(axis=1).sum())
                first = next(iter(self.simulator.failures), None)
                why = f" (the first failure: {first.test}, {first.reason})" if first else ""
                raise ParameterError(
                    f"calibrate: {name} has a value at {known} of {len(design.points)} points only{why}; "
                    "narrow the ranges, or change the test"
                )
        return Match(self.space, self.targets, found, samples, self.before)

    def _next(self, match: Match, left: Plausible, room: int, number: int) -> np.ndarray:
        """Points of the next wave: the best one, and those that tell most; none where no more is to be learnt."""
        if left.least > LIMIT:  # perhaps the emulators err: look where it is best
            best, candidates = left.best, self._around(left.best, number)
        else:
            found = self._sampled(match, left.points)
            best, variances = found.best, match.predicted(found.points, match.names)[1].mean(axis=0)
            others = np.diag(match.scatter(match.names)) + match.target_variance
            if np.all(variances <= ENOUGH * (variances + others)):
                self.tell("more tests would not tell more than the laboratory knows: no further wave")
                return np.empty((0, len(self.space.free)))
            half = CANDIDATES // 2
            rows = np.linspace(0, len(found.points) - 1, half).astype(int)
            candidates = np.concatenate([found.points[rows], left.points[:half]])
        candidates = self.space.at_reference(candidates)
        candidates = candidates[self.space.allowed(candidates)]
        first = self.space.at_reference(best[None])
        first = first[self.space.allowed(first)]
        return np.unique(telling(match, candidates, room, first), axis=0)

    def _sampled(self, match: Match, start: np.ndarray) -> Posterior:
        """A few samples, enough to choose points by."""
        return posterior(match, start, self.seed, blocks=1, folder=self.chains)

    def _around(self, best: np.ndarray, number: int) -> np.ndarray:
        random = np.random.default_rng(self.seed + number)
        place = self.space.places(best[None])
        near = np.clip(place + 0.15 / number * random.standard_normal((CANDIDATES, place.shape[1])), 0, 1)
        points = self.space.points(near)
        return np.asarray(points[self.space.allowed(points)])

    # --- tests -------------------------------------------------------------------------------------------------------

    def _tested(self, points: np.ndarray, seeds: Sequence[int]) -> tuple[np.ndarray, Values]:
        """Tests without confinement, which tell how strong the rock is, then those under that share of it."""
        given = [self.space.mapping(point) for point in points]
        confined = [name for name in self.quantities if CONFINED in AIMS[name].tests]
        free = [name for name in self.quantities if name not in confined]
        values = self.simulator.values(given, free, seeds, np.ones(len(points)))
        scales = self._scales(values, len(points))
        if confined:
            values = {**values, **self.simulator.values(given, confined, seeds, scales)}
        return scales, {name: values[name] for name in self.quantities}

    def _scales(self, values: Values, count: int) -> np.ndarray:
        """(count,) how many times stronger than its specimens the rock of each point is, if it meets the targets."""
        scale = self.space.scale
        if scale is None:
            return np.ones(count)
        wanted = {name: t.value for name, t in self.targets.items() if name in values and AIMS[name].power == 1}
        if "ucs" not in wanted and "ucs" in values and {"cohesion", "friction_angle"} <= set(self.targets):
            phi = np.radians(self.targets["friction_angle"].value)
            wanted["ucs"] = float(2 * self.targets["cohesion"].value * np.cos(phi) / (1 - np.sin(phi)))
        if "ucs" not in wanted and "ucs" in values and (line := self._line()):
            wanted["ucs"] = line
        names = ["ucs"] if "ucs" in wanted else list(wanted)
        if not names:
            return np.ones(count)
        logs = [np.log(wanted[name]) - _middle(transformed(name, values[name])) for name in names]
        found = np.exp(_middle(np.array(logs).T))
        ends = scale.low / self.space.reference, scale.high / self.space.reference
        return np.array([to_digits(value) for value in np.clip(np.nan_to_num(found, nan=1.0), *ends)])

    def _line(self) -> float | None:
        """UCS (Pa), about, from triaxial targets: it only decides which rock is tested under confinement."""
        of = [(AIMS[name].confinement, target.value) for name, target in self.targets.items() if AIMS[name].confinement]
        if not of:
            return None
        pressure, strength = np.array(of).T
        steepness = np.polyfit(pressure, strength, 1)[0] if len(of) > 1 else STEEP
        return float(max(strength[0] - steepness * pressure[0], strength[0] / 4))


def _middle(rows: np.ndarray) -> np.ndarray:
    """(n,) means without nan; nan where there is nothing."""
    counts = np.isfinite(rows).sum(axis=1)
    return np.asarray(np.where(counts, np.nansum(rows, axis=1) / np.maximum(counts, 1), np.nan))
