"""Stiffness with which the test gives modulus and Poisson's ratio: cracks before the peak move them off statics."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import attrs
import numpy as np

from grainlaw.calibration.first_look import TRIED, WITHIN, first_match, why_unknown
from grainlaw.calibration.space import Space
from grainlaw.calibration.stiffness_search import Stiffness, UnreachableError
from grainlaw.calibration.targets import Targets, in_words
from grainlaw.calibration.trials import StudySimulator
from grainlaw.calibration.waves import Search
from grainlaw.fields import ParameterError
from grainlaw.results.means import spread
from grainlaw.specimen import Specimen

ROUNDS = 10  #: of statics and tests
SLOPES = (0.5, 4.0)  #: of Poisson's ratio in the test over that of statics

Statics = Callable[[Mapping[str, float]], Stiffness]  #: from modulus and Poisson's ratio, those that are asked for
Measure = Callable[[Stiffness], Mapping[str, float]]  #: the same of the test, nan where it gives none


def meet_moduli(
    search: Search, simulator: StudySimulator, statics: Statics, wanted: Mapping[str, float], first: Stiffness
) -> tuple[Search, Stiffness]:
    """A search among rocks that have the moduli ``wanted`` (SI) in the test, as far as a pilot tells.

    It begins with the ``first`` stiffness, which :func:`expected_stiffness` gives.
    What the pilot has cost is taken off the budget where its tests are of no use for the search.
    """
    search.tell(f"by statics E = {first.modulus / 1e9:.2f} GPa, nu = {first.poisson:.3f}")
    search = stiffened(search, simulator, first)
    best = search.space.mapping(search.pilot())
    spent = len(simulator.points)

    def measure(stiffness: Stiffness) -> dict[str, float]:
        stiffened(search, simulator, stiffness)
        values = simulator.values([best], list(wanted), search.seeds, np.ones(1))
        return {name: float(spread(np.ravel(each))["mean"]) for name, each in values.items()}

    found = fit_moduli(wanted, statics, measure, {name: first.moduli[name] for name in wanted})
    told = in_words(found.tested)
    search.tell(f"tests give {told} with E = {found.modulus / 1e9:.2f} GPa, nu = {found.poisson:.3f} by statics")
    if found.parameters != first.parameters:
        search = attrs.evolve(search, budget=search.budget - spent)
    return stiffened(search, simulator, found), found


def stiffened(search: Search, simulator: StudySimulator, stiffness: Stiffness) -> Search:
    """The search, and its laboratory, with contacts and grains of this stiffness."""
    simulator.stiffen(stiffness.parameters, stiffness.grains)
    return attrs.evolve(search, space=search.space.evolved(stiffness.parameters))


@attrs.frozen
class _Round:
    stiffness: Stiffness
    aims: dict[str, float]  #: of statics
    off: dict[str, float]  #: what the test gives over the target, less one

    @property
    def worst(self) -> float:
        return float(np.max(np.abs(list(self.off.values()))))


def expected_stiffness(
    space: Space, targets: Targets, specimens: Mapping[str, Specimen], statics: Statics, seed: int,
    point: np.ndarray | None = None,
) -> Stiffness:  # fmt: skip
    """The stiffness with which a test should give the elastic targets, by no test.

    Where the emulator that comes with grainlaw knows the rock, it tells how far tests are off statics at a ``point``
    (d,), the likeliest unless given; elsewhere, that of statics. ``specimens`` are one of each shape. Raises
    :class:`ParameterError`.
    """
    wanted = {name: target.value for name, target in targets.elastic.items()}
    if why_unknown(space, targets, specimens):
        return statics(wanted)
    points = space.prior(TRIED, seed)

    def measure(stiffness: Stiffness) -> dict[str, float]:
        match = first_match(space.evolved(stiffness.parameters), targets, specimens, stiffness.grains)
        best = match.likeliest(points) if point is None else point
        if best is None:
            return dict.fromkeys(wanted, math.nan)
        both = match.moduli(best, stiffness.modulus, stiffness.poisson)
        return {name: both[name] for name in wanted}

    return fit_moduli(wanted, statics, measure)


def fit_moduli(
    wanted: Mapping[str, float], statics: Statics, measure: Measure, begin: Mapping[str, float] | None = None
) -> Stiffness:
    """The stiffness with which the test gives ``wanted`` (SI by name) to 1 %, or the nearest that was found.

    It begins where statics give ``begin``, or else what is wanted.

    Each round takes what the test gave more or less than the target off what statics shall give: by the ratio for the
    modulus, by secants for Poisson's ratio, which moves more in the test than in statics as softer shear springs
    crack earlier. Where the test gives no modulus, statics keep the last word. Raises :class:`ParameterError`, also
    where statics do not have the Poisson's ratio and the test has not got it either.
    """
    aims, rounds, refused = dict(begin or wanted), list[_Round](), list[UnreachableError]()
    for _ in range(ROUNDS):
        try:
            stiffness = statics(aims)
        except ParameterError as error:
            if not rounds:
                if refused or not isinstance(error, UnreachableError) or math.isnan(error.nearest):
                    raise
                refused.append(error)
                aims["poissons_ratio"] = error.nearest  # cracks may widen what the test gives
                continue
            aims = {name: (aims[name] + rounds[-1].aims[name]) / 2 for name in wanted}  # statics cannot go so far
            continue
        found = measure(stiffness)
        now = _Round(
            attrs.evolve(stiffness, tested={name: float(found[name]) for name in wanted}), dict(aims),
            {name: found[name] / value - 1 for name, value in wanted.items()},
        )  # fmt: skip
        if not math.isfinite(now.worst):
            if refused:
                raise refused[0]
            return rounds[0].stiffness if rounds else now.stiffness
        rounds.append(now)
        if now.worst <= WITHIN:
            break
        aims = {name: _next(name, rounds, wanted[name]) for name in wanted}
    best = min(rounds, key=lambda each: each.worst)
    if refused and best.worst > WITHIN:
        raise refused[0]
    return best.stiffness


def _next(name: str, rounds: list[_Round], wanted: float) -> float:
    now = rounds[-1]
    if name == "youngs_modulus":
        return now.aims[name] / (1 + now.off[name])
    slope = 1.0
    if len(rounds) > 1:
        step = now.aims[name] - rounds[-2].aims[name]
        if step:
            slope = float(np.clip(wanted * (now.off[name] - rounds[-2].off[name]) / step, *SLOPES))
    return now.aims[name] - wanted * now.off[name] / slope
