"""Which parameters the targets leave plausible, which points would tell most, and which targets are in conflict."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Protocol

import attrs
import numpy as np
import scipy

from grainlaw.calibration.emulator import Emulator, Samples, in_one_thread, restored
from grainlaw.calibration.space import Space
from grainlaw.calibration.targets import AIMS, Target, as_emulated
from grainlaw.messages import enumeration

LIMIT = 3.0  #: implausibility (Pukelsheim 1994: three deviations hold 95 % of any distribution with one peak)
TRIED = 8192  #: points of the prior that are looked at
KEPT = 1000  #: plausible points that are looked for
ROUNDS, BEST = 8, 60  #: of a search around the best points


class Knowledge(Protocol):
    """What is known of targets without these tests, such as a first look."""

    @property
    def targets(self) -> Mapping[str, Target]: ...
    def known(self, points: np.ndarray) -> np.ndarray:
        """(n,) whether anything is known of these points."""
        ...

    def predicted(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Means (n, k) of what is emulated of the targets, and their covariances (n, k, k)."""
        ...


@attrs.frozen
class Known:
    """Standard errors by which a target and what the tests say of it are known, over its value."""

    laboratory: float
    specimens: float  #: by the scatter of those that were tested
    emulator: float  #: at one point
    together: float  #: of the last two, and of what was known without these tests

    @property
    def largest(self) -> str:
        """Which of the first three."""
        return max(("laboratory", "specimens", "emulator"), key=lambda name: float(getattr(self, name)))


@attrs.frozen(eq=False)
class Match:
    """Emulators beside the targets.

    The implausibility of a point is |mu - z| / sqrt(var_emulator + var_seeds + var_target) for each target (Craig,
    Goldstein, Seheult and Smith 1997, doi:10.1007/978-1-4612-2290-3_2). What is known without these tests counts by
    its covariance, as another set of tests would.
    """

    space: Space
    targets: Mapping[str, Target]
    emulators: Mapping[str, Emulator]  #: of the targets, and of all else that was measured
    samples: Samples
    before: Knowledge | None = None  #: without these tests

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.targets)

    @property
    def wanted(self) -> np.ndarray:
        """(t,) targets as they are emulated."""
        return as_emulated(self.targets)[0]

    @property
    def target_variance(self) -> np.ndarray:
        """(t,) of the targets, as they are emulated."""
        return as_emulated(self.targets)[1]

    def scatter(self, names: Sequence[str]) -> np.ndarray:
        """(t, t) covariance by the seeds."""
        rows = self._rows(names)
        return np.asarray(self.samples.scatter[np.ix_(rows, rows)])

    def _rows(self, names: Iterable[str]) -> list[int]:
        return [self.samples.names.index(name) for name in names]

    def predicted(self, points: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Means and variances (n, q) of quantities, as they are emulated but for the rock's own scale."""
        where, scales = self.space.coordinates(points), np.log(self.space.scales(points))
        found = [self.emulators[name].predict(where) for name in names]
        powers = np.array([AIMS[name].power for name in names])
        shift = (self.samples.shift + self.samples.of_mean)[self._rows(names)]
        means = np.column_stack([mean for mean, _ in found]) + scales[:, None] * powers + shift
        return means, np.column_stack([variance for _, variance in found])

    def by_tests(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Means (n, t) and covariances (n, t, t) of the targets of all specimens, with what the seeds make of them."""
        means, variances = self.predicted(points, self.names)
        return means, self.scatter(self.names) + np.einsum("nt,tu->ntu", variances, np.eye(len(self.names)))

    def expected(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same by the tests and by what was known before, each by its covariance.

        What was known counts less the further it lies from the tests at a point, and from the limit of implausibility
        on not at all: its covariance is over what of the square of the limit is left.
        """
        means, covariances = self.by_tests(points)
        if self.before is None:
            return means, covariances
        at, others, errors, apart = self._beside(points, means, covariances)
        counts = 1 - (apart.max(axis=1, initial=0.0) / LIMIT) ** 2
        inside = counts > 0
        at, others, errors = at[inside], others[inside], errors[inside] / counts[inside, None, None]
        shared = covariances[at][:, :, self._known]  # (m, t, k)
        gain = np.linalg.solve(shared[:, self._known] + errors, shared.transpose(0, 2, 1)).transpose(0, 2, 1)
        means[at] += np.einsum("mtk,mk->mt", gain, others - means[at][:, self._known])
        covariances[at] -= np.einsum("mtk,muk->mtu", gain, shared)
        return means, covariances

    def apart(self, points: np.ndarray) -> dict[str, np.ndarray]:
        """By target, in standard errors, how far (m,) tests lie from what was known before, at its points."""
        if self.before is None:
            return {}
        *_, apart = self._beside(points, *self.by_tests(points))
        return dict(zip(self.before.targets, apart.T, strict=True))

    @property
    def _known(self) -> list[int]:
        """Which targets something was known of before."""
        return [] if self.before is None else [self.names.index(name) for name in self.before.targets]

    def _beside(
        self, points: np.ndarray, means: np.ndarray, covariances: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The points (m,) of which something was known, its means and covariances, and how far (m, k) tests lie off."""
        assert self.before is not None
        at, k = np.flatnonzero(self.before.known(points)), len(self._known)
        if not len(at):
            return at, np.empty((0, k)), np.empty((0, k, k)), np.empty((0, k))
        others, errors = self.before.predicted(points[at])
        others = others + self.samples.of_mean[self._rows(self.before.targets)]
        variance = np.einsum("mkk->mk", covariances[at][:, self._known][:, :, self._known] + errors)
        return at, others, errors, np.abs(means[at][:, self._known] - others) / np.sqrt(variance)

    def one(self, points: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray]:
        """Mean (n,) and variance (n,) of a quantity of all specimens, target or not, as it is emulated."""
        if name in self.targets:
            means, covariances = self.expected(points)
            k = self.names.index(name)
            return means[:, k], covariances[:, k, k]
        means, variances = self.predicted(points, [name])
        return means[:, 0], variances[:, 0] + self.scatter([name])[0, 0]

    def known_to(self, point: np.ndarray) -> dict[str, Known]:
        """How well each target is known, at a point (d,)."""
        emulated = self.predicted(point[None], self.names)[1]
        together = self.expected(point[None])[1][0]
        rows = np.sqrt([self.target_variance, np.diag(self.scatter(self.names)), emulated[0], np.diag(together)])
        sizes = [1.0 if AIMS[name].is_log else abs(target.value) for name, target in self.targets.items()]
        return {name: Known(*map(float, each)) for name, each in zip(self.names, (rows / sizes).T, strict=True)}

    def implausibility(self, points: np.ndarray) -> np.ndarray:
        """(n, t) of each target."""
        means, covariances = self.expected(points)
        known = np.einsum("ntt->nt", covariances) + self.target_variance
        return np.asarray(np.abs(means - self.wanted) / np.sqrt(known))

    def log_likelihood(self, points: np.ndarray) -> np.ndarray:
        """(n,) of the targets, normal, with what the seeds make of several targets at once."""
        means, covariances = self.expected(points)
        return normal_likelihood(means - self.wanted, covariances + np.diag(self.target_variance))


def normal_likelihood(off: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """(n,) logarithms for normal departures (n, t) with these covariances (n, t, t), but for a constant."""
    solved = np.linalg.solve(covariance, off[:, :, None])[:, :, 0]
    return np.asarray(-0.5 * (np.einsum("nt,nt->n", off, solved) + np.linalg.slogdet(covariance)[1]))


@attrs.frozen(eq=False)
class Plausible:
    """Points that no target excludes."""

    points: np.ndarray  #: (n, d), perhaps none
    share: float  #: of the prior
    least: float  #: largest implausibility of the best point
    best: np.ndarray  #: (d,)


@in_one_thread
def plausible(match: Match, points: np.ndarray, seed: int) -> Plausible:
    """Of points (n, d) of the prior those with no implausibility above the limit; searched for where they are few."""
    worst = match.implausibility(points).max(axis=1)
    share = float(np.mean(worst <= LIMIT))
    kept, values = points[worst <= LIMIT], worst
    for near, values in _searched(match, points, worst, lambda each: each.max(axis=1), seed):
        kept = np.concatenate([kept, near[values <= LIMIT]]) if len(kept) < KEPT else kept
    best = int(np.argmin(values))
    return Plausible(kept[:KEPT], share, float(values[best]), near[best])


Worst = Callable[[np.ndarray], np.ndarray]


def _searched(
    match: Match, points: np.ndarray, values: np.ndarray, worst: Worst, seed: int
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The best points of each round of a search around those of the round before, and their values."""
    random, space = np.random.default_rng(seed), match.space
    reach = 0.15
    for _ in range(ROUNDS):
        chosen = np.argsort(values, kind="stable")[:BEST]
        points, values = points[chosen], values[chosen]
        yield points, values
        near = np.repeat(space.places(points), 20, axis=0)
        near = np.clip(near + reach * random.standard_normal(near.shape), 0, 1)
        moved = space.points(near)
        moved = moved[space.allowed(moved)]
        if len(moved):
            points = np.concatenate([points, moved])
            values = np.concatenate([values, worst(match.implausibility(moved))])
        reach *= 0.6
    chosen = np.argsort(values, kind="stable")
    yield points[chosen], values[chosen]


@in_one_thread
def telling(match: Match, candidates: np.ndarray, count: int, first: np.ndarray) -> np.ndarray:
    """(count, d) points whose tests would tell most, ``first`` (k, d) among them.

    One after the other: where the emulators know least compared with what seeds and targets leave open; after each, as
    much as its tests would tell is taken off.
    """
    where = match.space.coordinates(np.concatenate([first, candidates]))
    known = np.diag(match.scatter(match.names)) + match.target_variance
    covariances, noises = [], []
    for name in match.names:
        emulator = match.emulators[name]
        across = emulator.kernel(where, emulator.points)
        solved = scipy.linalg.cho_solve((emulator.factor, True), across.T)
        covariances.append(emulator.size**2 * (emulator.kernel(where, where) - across @ solved))
        column = match.samples.noise[:, match.samples.names.index(name)]
        noises.append(float(np.nanmean(column)) + emulator.size**2 * emulator.rough)
    chosen: list[int] = []
    for step in range(min(count, len(where))):
        gain = sum(np.log1p(np.maximum(np.diag(c), 0) / (v + 1e-300)) for c, v in zip(covariances, known, strict=True))
        gain = np.asarray(gain)
        gain[chosen] = -np.inf
        at = step if step < len(first) else int(np.argmax(gain))
        chosen.append(at)
        for k, noise in enumerate(noises):
            column = covariances[k][:, at].copy()
            covariances[k] -= np.outer(column, column) / (max(column[at], 0.0) + noise + 1e-300)
    return np.concatenate([first, candidates])[chosen]


@attrs.frozen
class Conflict:
    """Targets that no parameters in the ranges meet together, though they meet all fewer of them."""

    targets: tuple[str, ...]
    implausibility: float  #: the largest of them where it is least
    values: dict[str, float]  #: what the targets would be there, as they are emulated

    def __str__(self) -> str:
        return f"{enumeration(self.targets)} (at best {self.implausibility:.1f} deviations off)"


@in_one_thread
def conflicts(match: Match, points: np.ndarray, seed: int) -> list[Conflict]:
    """The smallest sets of targets that are implausible together; the search begins with points of the prior."""
    every = match.implausibility(points)
    found: list[Conflict] = []
    for size in range(1, len(match.names) + 1):
        for chosen in itertools.combinations(range(len(match.names)), size):
            names = tuple(match.names[k] for k in chosen)
            if any(set(conflict.targets) <= set(names) for conflict in found):
                continue
            rows = list(chosen)
            worst: Worst = lambda each, rows=rows: each[:, rows].max(axis=1)  # type: ignore[misc]  # noqa: E731
            best, values = list(_searched(match, points, worst(every), worst, seed))[-1]
            if values[0] > LIMIT:
                means = match.expected(best[:1])[0][0]
                there = {name: float(restored(name, mean)) for name, mean in zip(match.names, means, strict=True)}
                found.append(Conflict(names, float(values[0]), there))
    return found
