"""What the targets say of the parameters: samples of the posterior, and its best point."""

from __future__ import annotations

import contextlib
import zipfile
from pathlib import Path
from typing import Protocol

import attrs
import numpy as np
import scipy

from grainlaw.calibration.emulator import NEEDS, in_one_thread
from grainlaw.calibration.space import Space
from grainlaw.fields import ParameterError
from grainlaw.results.files import write_atomically
from grainlaw.runs.identity import Unknown, digest, sources_hash

WALKERS, BLOCK, BLOCKS = 48, 500, 10
PER_TIME = 30  #: steps that a chain has for each of its correlation times before it is trusted
SAMPLES = 4000  #: that are kept


class Likelihood(Protocol):
    """What tells how likely parameters are."""

    @property
    def space(self) -> Space: ...
    def log_likelihood(self, points: np.ndarray) -> np.ndarray: ...


@attrs.frozen(eq=False)
class Posterior:
    """Samples (n, d) of the parameters, and the one that is most likely."""

    points: np.ndarray
    best: np.ndarray  #: (d,)
    effective: float  #: samples that are independent

    def interval(self, k: int, share: float = 0.95) -> tuple[float, float]:
        """That holds this share of the samples of parameter k, as much below as above."""
        low, high = np.quantile(self.points[:, k], [(1 - share) / 2, (1 + share) / 2])
        return float(low), float(high)


@in_one_thread
def posterior(
    match: Likelihood, start: np.ndarray, seed: int, blocks: int = BLOCKS, folder: Path | None = None
) -> Posterior:
    """Samples by emcee (Foreman-Mackey and others 2013, doi:10.1086/670067), from points (n, d) that are plausible.

    The prior is even over the ranges, of what has dimensions over their logarithm, where the law takes the parameters.
    A ``folder`` keeps them: what was asked before is not sampled again. Raises :class:`ParameterError` without emcee.
    """
    if folder is None:
        return _sampled(match, start, seed, blocks)
    try:  # how likely the first points are tells all that samples depend on, beside the space
        key = digest(sources_hash(), match.space, start, match.log_likelihood(start), seed, blocks)
    except Unknown:
        return _sampled(match, start, seed, blocks)
    file = folder / f"{key}.npz"
    with contextlib.suppress(OSError, ValueError, LookupError, EOFError, zipfile.BadZipFile), np.load(file) as rows:
        return Posterior(rows["points"], rows["best"], float(rows["effective"]))
    found = _sampled(match, start, seed, blocks)
    with contextlib.suppress(OSError):  # they can be made again
        folder.mkdir(parents=True, exist_ok=True)
        write_atomically(file, lambda part: np.savez(part, **attrs.asdict(found)), shared=True)
    return found


def _sampled(match: Likelihood, start: np.ndarray, seed: int, blocks: int) -> Posterior:
    try:
        import emcee
    except ImportError:
        raise ParameterError(NEEDS) from None
    space, random = match.space, np.random.default_rng(seed)
    dimension = len(space.free)
    walkers = max(WALKERS, 4 * dimension)

    def log_posterior(places: np.ndarray) -> np.ndarray:
        found = np.full(len(places), -np.inf)
        inside = np.flatnonzero(((places >= 0) & (places <= 1)).all(axis=1))
        points = space.points(places[inside])
        takes = space.allowed(points)
        if takes.any():
            found[inside[takes]] = match.log_likelihood(points[takes])
        return found

    first = space.places(start)
    first = first[random.choice(len(first), walkers, replace=len(first) < walkers)]
    first = np.clip(first + 1e-3 * random.standard_normal(first.shape), 1e-9, 1 - 1e-9)
    outside = ~np.isfinite(log_posterior(first))
    first[outside] = space.places(start)[random.choice(len(start), int(outside.sum()))]
    # Differences of walkers suit slanting posteriors. emcee's snooker move seemed to give too narrow samples.
    moves = [(emcee.moves.DEMove(), 0.8), (emcee.moves.StretchMove(), 0.2)]
    sampler = emcee.EnsembleSampler(walkers, dimension, log_posterior, vectorize=True, moves=moves)
    sampler.random_state = np.random.RandomState(seed).get_state()  # emcee has the older one
    state = sampler.run_mcmc(first, BLOCK, skip_initial_state_check=True)
    sampler.reset()
    for _ in range(blocks):
        state = sampler.run_mcmc(state, BLOCK, skip_initial_state_check=True)
        time = float(np.max(sampler.get_autocorr_time(quiet=True, tol=0)))
        if np.isfinite(time) and sampler.iteration > PER_TIME * time:
            break
    chain, values = sampler.get_chain(flat=True), sampler.get_log_prob(flat=True)
    rows = random.choice(len(chain), min(SAMPLES, len(chain)), replace=False)  # of all walkers and times
    best = _polished(log_posterior, chain[int(np.argmax(values))])
    effective = len(chain) / max(time, 1.0) if np.isfinite(time) else float("nan")
    return Posterior(space.points(chain[rows]), space.points(best[None])[0], effective)


def _polished(log_posterior: object, place: np.ndarray) -> np.ndarray:
    def cost(at: np.ndarray) -> float:
        value = float(log_posterior(at[None])[0])  # type: ignore[operator]
        return -value if np.isfinite(value) else 1e30

    found = scipy.optimize.minimize(
        cost, place, method="Nelder-Mead", options={"maxiter": 300, "xatol": 1e-4, "fatol": 1e-4}
    )
    return np.asarray(found.x if found.fun <= cost(place) else place)
