"""Stiffness of contacts, or of contacts and grains, from modulus and Poisson's ratio of a rock: statics, no test."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import attrs
import numpy as np
import scipy

from grainlaw.contact import ContactLaw
from grainlaw.fields import ParameterError, UnitWarning
from grainlaw.material import Elastic, Material, Rigid
from grainlaw.runs.elastic_properties import elastic_properties
from grainlaw.short_form import rounded, to_digits
from grainlaw.specimen import Specimen

STIFF = "Pa/m"
ACCURACY = 0.005  #: of modulus and Poisson's ratio
REACH = 1e4  #: times the stiffness to begin with, and its inverse
RATIOS = (0.01, 4.0)  #: of shear to normal stiffness
INSIDE = 0.02  #: of the range of Poisson's ratios: how far from its ends the nearest of them lies
CONTACTS, GRAINS = "contacts", "grains"  #: what is found


class UnreachableError(ParameterError):
    """Statics do not have the Poisson's ratio that is asked for; ``nearest`` is the one that they have, or nan."""

    def __init__(self, message: str, nearest: float) -> None:
        super().__init__(message)
        self.nearest = nearest


@attrs.frozen(kw_only=True)
class Stiffness:
    """What gives a rock its elastic constants."""

    parameters: dict[str, float]  #: of the law, Pa/m
    grains: float  #: times the modulus of the grains as they were given
    modulus: float  #: Pa, mean of the seeds, by statics
    poisson: float
    solutions: int  #: how many were made
    tested: Mapping[str, float] = attrs.field(factory=dict)  #: what the test gives instead, by target; SI

    @property
    def moduli(self) -> dict[str, float]:
        """What statics gave (SI), by the names of targets."""
        return {"youngs_modulus": self.modulus, "poissons_ratio": self.poisson}

    @property
    def in_words(self) -> str:
        """What statics gave by which stiffness, in one line."""
        found = ", ".join(f"{name} = {rounded(value, STIFF)}" for name, value in self.parameters.items())
        more = f", grains {self.grains:.4g} times as stiff" if self.grains != 1 else ""
        return f"by statics E = {self.modulus / 1e9:.2f} GPa and nu = {self.poisson:.3f} with {found}{more}"


def stiffness_names(law: Any) -> tuple[str, str]:
    """The parameters that are the law's normal and shear stiffness. Raises :class:`ParameterError`."""
    names = [field.name for field in attrs.fields(type(law)) if field.metadata.get("unit") == STIFF]
    found: dict[str, str] = {}
    before = law.stiffness
    for name in names:
        after = attrs.evolve(law, **{name: 1.01 * getattr(law, name)}).stiffness
        for place, one, other in zip(("normal", "shear"), before, after, strict=True):
            if np.allclose(other, np.multiply(one, 1.01), rtol=1e-9):
                found.setdefault(place, name)
    if len(set(found.values())) < 2:
        raise ParameterError(
            f"calibrate: {type(law).__name__} has no parameters in Pa/m that are its normal and its shear stiffness, "
            "which elastic targets need; leave youngs_modulus and poissons_ratio out"
        )
    return found["normal"], found["shear"]


def with_grains(specimen: Specimen, times: float) -> Specimen:
    """The same with grains so many times stiffer. Raises :class:`ParameterError` for rigid grains."""
    if times == 1.0:
        return specimen
    if isinstance(specimen.material, Mapping):
        return attrs.evolve(specimen, material={key: _times(rock, times) for key, rock in specimen.material.items()})
    return attrs.evolve(specimen, material=_times(specimen.material, times))


def _times(rock: Material | Rigid, times: float) -> Elastic:
    if not isinstance(rock, Elastic):
        raise ParameterError(
            f"calibrate: elastic = 'grains' looks for the modulus of Elastic grains, these are {type(rock).__name__}; "
            "let elastic be 'contacts'"
        )
    return attrs.evolve(rock, youngs_modulus=times * rock.youngs_modulus)


class StiffnessSearch:
    """Elastic constants of specimens, by normal stiffness and the ratio of shear to normal stiffness."""

    def __init__(self, specimens: Sequence[Specimen], law: ContactLaw) -> None:
        self.specimens, self.law, self.count = specimens, law, 0
        self.names = stiffness_names(law)
        self.known: dict[tuple[float, float], tuple[float, float]] = {}

    def law_of(self, normal: float, ratio: float) -> ContactLaw:
        law: Any = self.law
        return attrs.evolve(law, **dict(zip(self.names, (normal, ratio * normal), strict=True)))

    def constants(self, normal: float, ratio: float) -> tuple[float, float]:
        """Modulus (Pa) and Poisson's ratio, means over the specimens."""
        if (normal, ratio) not in self.known:
            law = self.law_of(normal, ratio)
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", UnitWarning)  # a search goes through what is unusual
                found = [elastic_properties(specimen, law) for specimen in self.specimens]
            self.count += len(found)
            modulus = float(np.mean([each.modulus for each in found]))
            self.known[normal, ratio] = modulus, float(np.mean([each.poisson for each in found]))
        return self.known[normal, ratio]

    def ratio_for(self, poisson: float | None, normal: float, now: float, what: str) -> float:
        """The ratio of the stiffnesses that gives a Poisson's ratio. Raises :class:`ParameterError`."""
        if poisson is None:
            return now

        def gap(log: float) -> float:
            return self.constants(normal, math.exp(log))[1] - poisson

        ends = [math.log(end) for end in RATIOS]
        if gap(ends[0]) * gap(ends[1]) > 0:
            low, high = sorted(gap(end) + poisson for end in ends)
            raise UnreachableError(
                f"calibrate: poissons_ratio = {poisson:g} cannot be had {what}: ratios of shear to normal stiffness "
                f"from {RATIOS[0]:g} to {RATIOS[1]:g} give {low:.3f} to {high:.3f}; grains with another Poisson's "
                "ratio give others",
                _within(poisson, low, high),
            )
        return math.exp(scipy.optimize.brentq(gap, *ends, xtol=1e-5))


def fit_stiffness(
    specimens: Sequence[Specimen], law: ContactLaw, modulus: float | None, poisson: float | None, what: str
) -> Stiffness:
    """Stiffnesses with which specimens have a modulus (Pa) and a Poisson's ratio to 0.5 %, on average.

    ``what`` is "contacts": the stiffnesses of the contacts, between grains as they are; or "grains": the modulus of the
    grains and the stiffnesses in their proportion, and the ratio of the stiffnesses. Raises :class:`ParameterError`
    with what can be had.
    """
    search = StiffnessSearch(specimens, law)
    normal, ratio = (float(np.mean(getattr(law, name))) for name in search.names)
    ratio /= normal
    if what == GRAINS:
        ratio = search.ratio_for(poisson, normal, ratio, "with grains of this Poisson's ratio")
        grains = 1.0 if modulus is None else modulus / search.constants(normal, ratio)[0]
        stiff = [with_grains(specimen, grains) for specimen in specimens]
        return _found(StiffnessSearch(stiff, law), grains * normal, ratio, grains, search.count)
    if modulus is None:
        ratio = search.ratio_for(poisson, normal, ratio, "with this normal stiffness")
        return _found(search, normal, ratio, 1.0, 0)
    stiffest = search.constants(normal * REACH, RATIOS[1])[0]
    if not modulus < stiffest * (1 - ACCURACY):
        raise ParameterError(
            f"calibrate: youngs_modulus = {_pa(modulus)} cannot be had between these grains: contacts as stiff as can "
            f"be give {_pa(stiffest)}; take stiffer grains, or let elastic be 'grains', which finds their modulus too"
        )
    if poisson is None:
        normal = _normal_for(search, modulus, normal, lambda log: ratio)
    else:
        normal, ratio = _both(search, modulus, poisson, normal, ratio)
    return _found(search, normal, ratio, 1.0, 0)


def _found(search: StiffnessSearch, normal: float, ratio: float, grains: float, before: int) -> Stiffness:
    normal, shear = map(to_digits, (normal, ratio * normal))
    modulus, poisson = search.constants(normal, shear / normal)
    values = dict(zip(search.names, (normal, shear), strict=True))
    return Stiffness(
        parameters=values, grains=grains, modulus=modulus, poisson=poisson, solutions=before + search.count
    )


def _normal_for(search: StiffnessSearch, modulus: float, normal: float, ratio: Callable[[float], float]) -> float:
    def gap(log: float) -> float:
        return search.constants(math.exp(log), ratio(log))[0] / modulus - 1

    ends = math.log(normal / REACH), math.log(normal * REACH)
    if gap(ends[0]) * gap(ends[1]) > 0:
        low, high = sorted(modulus * (gap(end) + 1) for end in ends)
        raise ParameterError(
            f"calibrate: youngs_modulus = {_pa(modulus)} cannot be had with this ratio of the stiffnesses, it gives "
            f"{_pa(low)} to {_pa(high)}"
        )
    return math.exp(scipy.optimize.brentq(gap, *ends, xtol=1e-4))


def _pa(value: float) -> str:
    """A modulus in words."""
    return rounded(value, "Pa")


def _both(search: StiffnessSearch, modulus: float, poisson: float, normal: float, ratio: float) -> tuple[float, float]:
    first = StiffnessSearch(search.specimens[:1], search.law)  # near enough to begin with
    start = np.log([_normal_for(first, modulus, normal, lambda log: ratio), ratio])
    low, high = np.log([normal / REACH, RATIOS[0]]), np.log([normal * REACH, RATIOS[1]])

    def gaps(of: StiffnessSearch) -> Callable[[np.ndarray], list[float]]:
        def gap(logs: np.ndarray) -> list[float]:
            young, nu = of.constants(*map(float, np.exp(logs)))
            return [young / modulus - 1, nu - poisson]

        return gap

    logs: Any = np.clip(start, low + 1e-6, high - 1e-6)
    for each in (first, search):
        logs = scipy.optimize.least_squares(gaps(each), logs, bounds=(low, high), xtol=1e-6, ftol=1e-8, max_nfev=40).x
    search.count += first.count
    off = gaps(search)(logs)
    if abs(off[0]) > ACCURACY or abs(off[1]) > ACCURACY * max(abs(poisson), 0.1):
        nus = _poisson_range(search, modulus, float(np.exp(logs[0])))
        raise UnreachableError(
            f"calibrate: youngs_modulus = {_pa(modulus)} with poissons_ratio = {poisson:g} cannot be had between these "
            f"grains: with this modulus Poisson's ratio lies between {min(nus):.3f} and {max(nus):.3f}; take other "
            "grains, or let elastic be 'grains'",
            _within(poisson, min(nus), max(nus)),
        )
    normal, ratio = map(float, np.exp(logs))
    return normal, ratio


def _within(poisson: float, low: float, high: float) -> float:
    """The nearest Poisson's ratio from ``low`` to ``high``, a little inside, where it is no longer at an end."""
    margin = INSIDE * (high - low)
    return min(max(poisson, low + margin), high - margin)


def _poisson_range(search: StiffnessSearch, modulus: float, normal: float) -> list[float]:
    found = []
    for ratio in RATIOS:
        try:
            there = _normal_for(search, modulus, normal, lambda log, r=ratio: r)  # type: ignore[misc]
        except ParameterError:
            continue
        found.append(search.constants(there, ratio)[1])
    return found or [math.nan, math.nan]
