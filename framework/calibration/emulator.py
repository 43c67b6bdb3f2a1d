"""A Gaussian process in the place of simulations: quickly what a quantity is, and how well that is known."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar, cast

import attrs
import numpy as np
import scipy

from grainlaw.calibration.targets import AIMS
from grainlaw.calibration.trials import Values
from grainlaw.fields import ParameterError

Function = TypeVar("Function", bound=Callable)
FEWEST = 5  #: points that an emulator takes
PRIOR_FREEDOM = 4.0  #: weight of the scatter of all points in that of one, in degrees of freedom
#: of strengths among equal specimens of some hundred grains, and its weight in degrees of freedom
USUAL_SCATTER, USUAL_FREEDOM = 0.05, 3.0
LEAST_NOISE = 1e-8  #: of the variance of the values
RESTARTS = 3
NEEDS = "calibrate needs scikit-learn and emcee: pip install 'grainlaw[calibrate]'"


def transformed(name: str, values: np.ndarray) -> np.ndarray:
    """What is emulated of values (SI) at a scale of one: a logarithm, or the value."""
    with np.errstate(invalid="ignore", divide="ignore"):
        found = np.log(values) if AIMS[name].is_log else np.asarray(values)
    return np.where(np.isfinite(found), found, np.nan)


def restored(name: str, found: np.ndarray, scales: np.ndarray | float = 1.0) -> np.ndarray:
    """Values (SI) from what is emulated."""
    aim = AIMS[name]
    return np.asarray((np.exp(found) if aim.is_log else found) * np.asarray(scales) ** aim.power)


@attrs.frozen(eq=False)
class Samples:
    """Means over the seeds and their scatter, of several quantities at the same points; as they are emulated."""

    names: tuple[str, ...]
    shift: np.ndarray  #: (q,) to be added, for the seeds are weak or strong
    means: np.ndarray  #: (n, q), nan where fewer than half of the seeds have a value
    noise: np.ndarray  #: (n, q) variance of a mean by what the seeds do not have in common at all points
    seeds: np.ndarray  #: (q,) how many tell the scatter
    scatter: np.ndarray  #: (q, q) covariance of the mean over the seeds of a point, as an estimate of that of all seeds
    of_shift: np.ndarray  #: (q,) part of its variances that is the error of the shift

    @functools.cached_property
    def of_mean(self) -> np.ndarray:
        """(q,) to be added to a mean of logarithms to have the logarithm of a mean, which is what a laboratory gives.

        Half of the variance of one specimen: of those of a lognormal distribution.
        """
        of_one = self.seeds * (np.diag(self.scatter) - self.of_shift)
        return np.where([AIMS[name].is_log for name in self.names], of_one / 2, 0.0)


def samples_of(values: Values) -> Samples:
    """From the values (n, seeds) of quantities, at a scale of one.

    A seed that is weak is weak at all points: this part of its scatter does not make emulators rough, but all of them
    wrong alike. It is in ``scatter`` with the other part; ``noise`` is the other part alone.
    """
    names = tuple(values)
    y = np.stack([transformed(name, values[name]) for name in names], axis=2)  # (n, seeds, q)
    counts = np.isfinite(y).sum(axis=1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of points without any value
        means = np.nanmean(y, axis=1)
        means[counts < (y.shape[1] + 1) // 2] = np.nan
        centred = y - means[:, None]
        common = np.nanmean(centred, axis=0)
    own = centred - common
    seeds = y.shape[1]
    scatter = _drawn(names, _covariance(centred.reshape(-1, len(names)), seeds), seeds, means)
    none = np.zeros(len(names))
    return Samples(names, none, means, _noise(own, counts), np.full(len(names), seeds), scatter, none)


def _noise(own: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """(n, q) each point's variance drawn towards that of all, for it has few seeds."""
    freedom = np.maximum(counts - 1, 0)
    squares = np.nansum(own**2, axis=1)
    pooled = squares.sum(axis=0) / np.maximum(freedom.sum(axis=0), 1)
    return np.asarray((squares + PRIOR_FREEDOM * pooled) / (freedom + PRIOR_FREEDOM) / np.maximum(counts, 1))


def _covariance(centred: np.ndarray, seeds: int) -> np.ndarray:
    """(q, q) of one seed, from departures (k, q) from the means of so many seeds, where they are known."""
    known = np.isfinite(centred)
    filled = np.where(known, centred, 0.0)
    pairs = np.maximum(known.T.astype(float) @ known, 1.0) * (seeds - 1) / seeds
    return np.asarray(filled.T @ filled / pairs)


def _drawn(names: Sequence[str], covariance: np.ndarray, seeds: int, means: np.ndarray) -> np.ndarray:
    """(q, q) covariance of the means over the seeds.

    All points share the seeds, so however many points there are, their scatter is known from a few seeds only: it is
    drawn towards a usual one, and so is the likeness of two quantities towards none.
    """
    freedom, weight = seeds - 1, USUAL_FREEDOM
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a quantity without any value
        middle = np.nan_to_num(np.nanmedian(np.atleast_2d(means), axis=0))
    usual = np.array([1.0 if AIMS[name].is_log else abs(m) for name, m in zip(names, middle, strict=True)])
    found = np.diag(covariance)
    variance = (freedom * found + weight * (USUAL_SCATTER * usual) ** 2) / (freedom + weight)
    spread = np.sqrt(np.maximum(found, 1e-300))
    likeness = np.clip(covariance / np.outer(spread, spread), -1, 1) * freedom / (freedom + weight)
    np.fill_diagonal(likeness, 1.0)
    values, vectors = np.linalg.eigh(likeness)
    likeness = vectors @ np.diag(np.maximum(values, 1e-3)) @ vectors.T  # gaps may leave it no covariance
    deviation = np.sqrt(variance / seeds)
    return np.asarray(likeness * np.outer(deviation, deviation))


def anchored(samples: Samples, anchors: Mapping[int, Values]) -> Samples:
    """The same, with what points on more seeds tell: by number of the point (1, m), the common seeds first.

    How weak or strong the common seeds are there they are everywhere, but for what each has of its own: ``shift`` takes
    it off, and the scatter left is that of all m seeds. The points themselves are known by all m. A quantity without
    values on most of them stays as it was.
    """
    common, rows = int(samples.seeds[0]), np.array(list(anchors))
    of_rows = [np.column_stack([transformed(n, values[n])[0] for n in samples.names]) for values in anchors.values()]
    y = np.stack(of_rows)  # (k, m, q)
    seeds, there = y.shape[1], np.isfinite(y)
    tells = there[:, :common].all(axis=1) & (there.sum(axis=1) > (seeds + common) / 2)  # (k, q)
    known = tells.any(axis=0)
    if not known.any():
        return samples
    y = np.where(tells[:, None], y, np.nan)[:, :, known]
    names, counts = [name for name, take in zip(samples.names, known, strict=True) if take], tells[:, known].sum(axis=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a quantity without values at one of the points
        middle = np.nanmean(y, axis=1)  # (k, q)
    found = _drawn(names, _covariance((y - middle[:, None]).reshape(-1, len(names)), seeds), seeds, middle)
    shift, scatter, of_shift = np.zeros(len(known)), np.diag(np.diag(samples.scatter)), np.zeros(len(known))
    shift[known] = np.nanmean(middle - y[:, :common].mean(axis=1), axis=0)
    of_shift[known] = np.nanmean(samples.noise[:, known], axis=0) / counts
    scatter[np.ix_(known, known)] = found + np.diag(of_shift[known])
    means, noise = samples.means.copy(), samples.noise.copy()
    for k, row in enumerate(rows):
        own = tells[k]
        means[row, own] = middle[k, own[known]] - shift[own]
        noise[row, own] *= common / seeds
    told = np.where(known, seeds, common)
    return attrs.evolve(
        samples, shift=shift, means=means, noise=noise, scatter=scatter, seeds=told, of_shift=of_shift
    )  # fmt: skip


@attrs.frozen(eq=False)
class Emulator:
    """A quantity over the groups of parameters: a plane and a smooth departure from it, with the seeds' noise.

    Rasmussen and Williams 2006, Gaussian Processes for Machine Learning; a Matern 5/2 kernel with a length for each
    group, by scikit-learn.
    """

    name: str
    kernel: Any
    points: np.ndarray  #: (n, g) coordinates
    factor: np.ndarray  #: (n, n) lower triangle of the covariance
    weights: np.ndarray  #: (n,)
    rough: float  #: variance that is noise beside that of the seeds
    middle: float
    size: float
    left_out: np.ndarray  #: (n, 3) value, prediction without it, standard deviation of that

    def predict(self, coordinates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean (m,) and variance (m,) of what is emulated, of the smooth quantity without noise."""
        across = self.kernel(coordinates, self.points)
        inner = scipy.linalg.solve_triangular(self.factor, across.T, lower=True, check_finite=False)
        variance = self.kernel.diag(coordinates) - self.rough - np.einsum("nm,nm->m", inner, inner)
        return self.middle + self.size * (across @ self.weights), self.size**2 * np.maximum(variance, 0.0)

    @property
    def miss(self) -> float:
        """Root mean square of the errors at points that were left out, as they are emulated."""
        value, predicted, _ = self.left_out.T
        return float(np.sqrt(np.mean((value - predicted) ** 2)))

    @property
    def q_squared(self) -> float:
        """Share of the variance of left out values that is predicted (1 is all of it); nan if they do not vary."""
        value, found, _ = self.left_out.T
        spread = float(np.sum((value - value.mean()) ** 2))
        return float(1 - np.sum((value - found) ** 2) / spread) if spread else float("nan")

    @property
    def errors(self) -> np.ndarray:
        """(n,) errors of the predictions of left out values, over their standard deviation."""
        value, found, deviation = self.left_out.T
        return np.asarray((value - found) / deviation)


def in_one_thread(function: Function) -> Function:
    """A function that handles matrices in one thread: small ones are many times faster so, and always the same."""

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        try:
            from threadpoolctl import threadpool_limits
        except ImportError:
            raise ParameterError(NEEDS) from None
        with threadpool_limits(limits=1):
            return function(*given, **named)

    return cast(Function, call)


@in_one_thread
def emulators(coordinates: np.ndarray, samples: Samples, seed: int) -> dict[str, Emulator]:
    """An emulator of each quantity that has values at enough points."""
    found = {}
    for k, name in enumerate(samples.names):
        known = np.isfinite(samples.means[:, k])
        if known.sum() >= max(FEWEST, coordinates.shape[1] + 2):
            found[name] = fit(name, coordinates[known], samples.means[known, k], samples.noise[known, k], seed)
    return found


def fit(name: str, coordinates: np.ndarray, values: np.ndarray, noise: np.ndarray, seed: int) -> Emulator:
    """An emulator of values (n,) with a noise variance (n,) each. Raises ParameterError without scikit-learn."""
    try:
        from sklearn.exceptions import ConvergenceWarning
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import ConstantKernel, DotProduct, Matern, WhiteKernel
    except ImportError:
        raise ParameterError(NEEDS) from None
    middle, size = float(values.mean()), float(values.std()) or 1.0
    alpha = np.maximum(noise / size**2, LEAST_NOISE)
    smooth = ConstantKernel(0.3, (1e-4, 10)) * Matern(np.ones(coordinates.shape[1]), (0.2, 20), nu=2.5)
    plane = ConstantKernel(0.5, (1e-3, 20)) * DotProduct(1.0, sigma_0_bounds=(0.1, 10))
    process = GaussianProcessRegressor(
        plane + smooth + WhiteKernel(1e-4, (1e-9, 0.3)), alpha=alpha, n_restarts_optimizer=RESTARTS, random_state=seed
    )
    y = (values - middle) / size
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its bound is a group without effect
        process.fit(coordinates, y)
    kernel, factor = process.kernel_, process.L_
    rough = float(kernel.k2.noise_level)
    weights = scipy.linalg.cho_solve((factor, True), y)
    inverse = np.diag(scipy.linalg.cho_solve((factor, True), np.eye(len(y))))
    without = np.column_stack([values, middle + size * (y - weights / inverse), size / np.sqrt(inverse)])
    return Emulator(name, kernel, coordinates, factor, weights, rough, middle, size, without)


def quality(found: Mapping[str, Emulator]) -> list[tuple[str, int, float, float, float]]:
    """Of each: points, share of variance predicted, root mean square of the standardised errors, share within 2."""
    return [
        (name, len(each.points), each.q_squared, float(np.sqrt(np.mean(each.errors**2))),
         float(np.mean(np.abs(each.errors) <= 2)))
        for name, each in found.items()
    ]  # fmt: skip
