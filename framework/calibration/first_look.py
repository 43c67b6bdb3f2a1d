"""What the targets say of the contacts before any test: an emulator that comes with grainlaw for each of two laws.

Even, whole, elastic grains of one material between Mohr-Coulomb contacts or cohesive cracks; by similarity all that
counts are ratios. The numbers are in mohr_coulomb.json and cohesive_crack.json, made by
tests/validation/emulator_study.py from 1,000 and 700 rocks.
"""

from __future__ import annotations

import functools
import itertools
import json
import math
from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.calibration.check import NORMAL
from grainlaw.calibration.emulator import restored
from grainlaw.calibration.matching import LIMIT, normal_likelihood
from grainlaw.calibration.posterior import Posterior, posterior
from grainlaw.calibration.space import Space
from grainlaw.calibration.stiffness_search import Stiffness, with_grains
from grainlaw.calibration.targets import AIMS, Target, Targets, as_emulated, in_words, strength_at
from grainlaw.contact import ContactLaw
from grainlaw.declared import units_of
from grainlaw.fields import ParameterError
from grainlaw.laws import CohesiveCrack, MohrCoulomb
from grainlaw.material import Elastic
from grainlaw.messages import enumeration, spelled
from grainlaw.quantity import aligned
from grainlaw.short_form import rounded
from grainlaw.specimen import Specimen
from grainlaw.studies.envelope import angle_and_cohesion

FILES: dict[Any, str] = {MohrCoulomb: "mohr_coulomb.json", CohesiveCrack: "cohesive_crack.json"}
TRIED = 16384  #: points of the prior that are looked at
STARTS = 60  #: of them the chains begin at
DEGREE = 3  #: of the polynomials
EVEN = 0.8  #: largest deviation of the areas of grains over their mean
#: inputs beyond whose ends the value at the end is taken: of the specimen, of stiffnesses that statics found, and the
#: length of a crack's energy, short of which bonds are brittle, and beyond which they keep their strength
CLIPPED = ("width", "slenderness", "pressure", "stiffness", "ratio", "length")
BEYOND = {
    "stiffness": "kn times grain size over E", "ratio": "ks over kn",
    "length": "the mode I energy times E over tensile strength squared and grain size",
}  # fmt: skip
WITHIN = 0.01  #: of the elastic targets: near enough
WIDENED = 2.0  #: times as far from the middle as the posterior are the points that a search begins with
COMPRESSIVE = ("ucs", "cohesion", "friction_angle")
MODULI = ("modulus", "poisson")  #: how far they are off in a test
TENSILE = {"tension": "tensile_strength", "brazilian": "brazilian_strength"}  #: targets by what is emulated


# --- the emulator -----------------------------------------------------------------------------------------------------


@functools.cache
def terms(dimension: int) -> np.ndarray:
    """(f, d) degrees in each of d inputs of the products of polynomials, the constant first."""
    found = [np.zeros(dimension, dtype=int)]
    for total in range(1, DEGREE + 1):
        for chosen in itertools.combinations_with_replacement(range(dimension), total):
            found.append(np.bincount(chosen, minlength=dimension))
    return np.array(found)


def features(places: np.ndarray) -> np.ndarray:
    """(n, f) products of Legendre polynomials up to a total degree, of inputs (n, d) from -1 to 1."""
    each = np.polynomial.legendre.legvander(places, DEGREE)  # (n, d, DEGREE + 1)
    first, *others = terms(places.shape[1]).T
    found = each[:, 0, first]
    for k, degrees in enumerate(others, 1):
        found *= each[:, k, degrees]
    return found


Inputs = Mapping[str, np.ndarray]  #: (n,) each
Ends = Mapping[str, tuple[float, float]]  #: of each input


def places(inputs: Inputs, names: Sequence[str], ends: Ends) -> np.ndarray:
    """(n, d) from -1 to 1 over the range of each input."""
    found = [2 * (np.asarray(inputs[name]) - ends[name][0]) / (ends[name][1] - ends[name][0]) - 1 for name in names]
    return np.column_stack(found)


@attrs.frozen(eq=False)
class Fit:
    """A quantity as a polynomial of its inputs."""

    inputs: Sequence[str]
    coefficients: np.ndarray = attrs.field(converter=np.array)  #: (f,)
    error: float  #: standard deviation of the polynomial from the mean of many specimens, as it is on unseen rocks
    scatter: float  #: standard deviation of one specimen


@attrs.frozen(eq=False)
class ShippedEmulator:
    """Quantities of rocks without dimensions: ``ucs``, the logarithm of the strength over the cohesion of the contacts;
    ``tension`` and ``brazilian``, those over their tensile strength; ``steepness``, the logarithm of the strength under
    a confinement over that without, over the logarithm of one and the confinement over the strength without;
    ``modulus`` and ``poisson``, how far those of a compression test are off statics, as contacts crack before half of
    the strength: the logarithm of the one over the other, and the difference.
    """

    ends: Ends
    fits: Mapping[str, Fit]

    @classmethod
    def read(cls, law: Any) -> ShippedEmulator:
        """That of the package for a class of laws."""
        given = json.loads(resources.files("grainlaw.calibration").joinpath(FILES[law]).read_text("utf-8"))
        return cls(given["ends"], {name: Fit(**fit) for name, fit in given["fits"].items()})

    def __call__(self, name: str, inputs: Inputs) -> np.ndarray:
        """(n,) of a quantity."""
        fit = self.fits[name]
        return features(places(inputs, fit.inputs, self.ends)) @ fit.coefficients

    def knows(self, inputs: Inputs) -> np.ndarray:
        """(n,) whether these inputs are in their ranges."""
        return np.all([(each >= self.ends[n][0]) & (each <= self.ends[n][1]) for n, each in inputs.items()], axis=0)

    def clipped(self, name: str, value: Any) -> np.ndarray:
        return np.clip(value, *self.ends[name])


shipped = functools.cache(ShippedEmulator.read)


# --- what it can be asked ---------------------------------------------------------------------------------------------


def known_targets(targets: Targets) -> dict[str, Target]:
    """Those that the emulator knows."""
    known = (*COMPRESSIVE, *TENSILE.values())
    return {name: each for name, each in targets.tested.items() if name in known or AIMS[name].confinement}


def why_unknown(space: Space, targets: Targets, specimens: Mapping[str, Specimen]) -> str:
    """Why the emulator knows nothing of this rock; empty where it does."""
    if space.kind not in FILES:
        return f"it knows {enumeration(law.__name__ for law in FILES)}, not {space.kind.__name__}"
    law: Any = space.example
    numbers = _numbers(law)
    if any(map(np.ndim, numbers.values())):
        return "it knows the same contacts between all grains"
    if isinstance(law, MohrCoulomb) and (law.residual_cohesion or law.residual_tensile_strength):
        return "it knows broken contacts without cohesion"
    for field in attrs.fields(space.kind):
        if field.name not in numbers and getattr(law, field.name) != field.default:
            return f"it knows the default {spelled(field.name)} of {space.kind.__name__}"
    for specimen in specimens.values():
        grains, areas = specimen.grains, specimen.grains.areas
        if not isinstance(specimen.material, Elastic):
            return "it knows elastic grains of one material"
        if grains.is_breakable or grains.joints:
            return "it knows whole grains, bonded everywhere"
        if areas.std() > EVEN * areas.mean():
            return "it knows grains of about the same size"
    return "" if known_targets(targets) else f"it knows none of the targets {', '.join(targets.tested)}"


def _numbers(law: Any) -> dict[str, Any]:
    """The parameters of a law that have a unit, by name."""
    return {name: getattr(law, name) for name in units_of(type(law))}


@attrs.frozen(eq=False)
class FirstMatch:
    """The emulator beside the targets: :class:`~grainlaw.calibration.matching.Match` without a test."""

    space: Space
    targets: Mapping[str, Target]
    pressures: Sequence[float]  #: Pa, behind cohesion and friction angle
    specimens: Mapping[str, Specimen]  #: by shape
    grains: float  #: times the modulus of the grains
    emulator: ShippedEmulator

    @functools.cached_property
    def _fixed(self) -> dict[str, float]:
        """Parameters of the law; those that are free or tied are of no use."""
        return _numbers(self.space.example)

    @functools.cached_property
    def _needed(self) -> set[str]:
        """Inputs on which the targets depend, without those that are taken as at an end."""
        asked = {"ucs", *(of for of, target in TENSILE.items() if target in self.targets)}
        asked |= {"steepness"} if self._confinements else set()
        return {name for each in asked for name in self.emulator.fits[each].inputs}.difference(CLIPPED)

    def inputs(self, points: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Inputs of the emulator, not beyond its ends, and parameters of the law, for points (n, d)."""
        inputs, given = self._inputs(points)
        ask = self.emulator.clipped
        return {name: ask(name, value) if name in CLIPPED else value for name, value in inputs.items()}, given

    def beyond(self, point: np.ndarray) -> str:
        """What of a point (d,) and of the specimens the emulator takes as at an end of what it knows, in words."""
        inputs = {name: float(value[0]) for name, value in self._inputs(point[None])[0].items()}
        found = []
        for name, words in BEYOND.items():
            low, high = self.emulator.ends.get(name, (-math.inf, math.inf))
            if not low <= inputs.get(name, 0.0) <= high:
                found.append(
                    f"{words} is {math.exp(inputs[name]):.3g}, it knows {math.exp(low):.3g} to {math.exp(high):.3g}"
                )
        return f"The emulator answers as at the end of what it knows: {enumeration(found)}." if found else ""

    def _inputs(self, points: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        free = dict(zip(self.space.names, points.T, strict=True))
        given = {name: np.full(len(points), value) for name, value in self._fixed.items()} | free
        given |= {tie.name: tie.times * free[tie.to] for tie in self.space.ties}
        prism = next(iter(self.specimens.values()))
        rock: Any = prism.material
        grain, modulus = prism.grains.mean_size, self.grains * rock.youngs_modulus
        slope = np.tan(np.radians(given["friction_angle"]))
        least = self.emulator.ends["residual"][0]  # of those that were drawn between 0 and 1
        residual = np.tan(np.radians(given["residual_friction_angle"])) / np.maximum(slope, 1e-12)
        inputs = {
            "tension": np.log(given["tensile_strength"] / given["cohesion"]), "angle": given["friction_angle"],
            "residual": np.maximum(residual, least),
            "stiffness": np.log(given["kn"] * grain / modulus), "ratio": np.log(given["ks"] / given["kn"]),
            "strain": np.log(given["cohesion"] / modulus),
        }  # fmt: skip
        if "mode_i_energy" in given:
            opening, tension = given["mode_i_energy"], given["tensile_strength"]
            inputs["length"] = np.log(opening * modulus / tension**2 / grain)  # of Hillerborg, over the grains' size
            inputs["energies"] = np.log(given["mode_ii_energy"] / opening)
        return inputs, given

    def _size(self, shape: str, count: int) -> dict[str, np.ndarray]:
        """Inputs (n,) by the shape of a specimen."""
        specimen = self.specimens.get(shape) or next(iter(self.specimens.values()))
        low, high = specimen.grains.region.bounds
        width, height = high - low
        ask = self.emulator.clipped
        found = {
            "width": ask("width", np.log(width / specimen.grains.mean_size)),
            "slenderness": ask("slenderness", height / width),
        }
        return {name: np.full(count, value) for name, value in found.items()}

    def quantities(self, points: np.ndarray) -> dict[str, np.ndarray]:
        """(n,) of each that the targets need, of stresses the logarithm; the steepness by confinement."""
        inputs, law = self.inputs(points)
        prism, disc = ({**inputs, **self._size(shape, len(points))} for shape in ("prism", "disc"))
        found = {"ucs": self.emulator("ucs", prism) + np.log(law["cohesion"])}
        if "tensile_strength" in self.targets:
            found["tension"] = self.emulator("tension", prism) + np.log(law["tensile_strength"])
        if "brazilian_strength" in self.targets:
            found["brazilian"] = self.emulator("brazilian", disc) + np.log(law["tensile_strength"])
        for pressure in self._confinements:
            share = self.emulator.clipped("pressure", np.log(pressure) - found["ucs"])
            found[strength_at(pressure)] = self.emulator("steepness", {**prism, "pressure": share})
        return found

    def likeliest(self, points: np.ndarray) -> np.ndarray | None:
        """(d,) of points (n, d); None where nothing is likely at all."""
        likely = self.log_likelihood(points)
        return points[np.argmax(likely)] if np.isfinite(likely).any() else None

    def moduli(self, point: np.ndarray, youngs_modulus: float, poissons_ratio: float) -> dict[str, float]:
        """Modulus (Pa) and Poisson's ratio that a test of a point (d,) gives where statics give these.

        What the emulator says counts less where it is not larger than its error: in most rocks nothing cracks so early.
        """
        inputs, _ = self.inputs(point[None])
        given = {**inputs, **self._size("prism", 1)}
        softer, wider = (_beyond(float(self.emulator(name, given)[0]), self.emulator.fits[name].error, sign)
                         for name, sign in zip(MODULI, (-1, 1), strict=True))  # fmt: skip
        return {"youngs_modulus": youngs_modulus * math.exp(softer), "poissons_ratio": poissons_ratio + wider}

    def ends_of(self, name: str, value: float) -> tuple[float, float]:
        """Between which ends a modulus (Pa) or Poisson's ratio lies with 95 %, by the emulator's error."""
        modulus, poisson = (NORMAL * self.emulator.fits[each].error for each in MODULI)
        if name == "youngs_modulus":
            return value * math.exp(-modulus), value * math.exp(modulus)
        return value - poisson, value + poisson

    @property
    def _confinements(self) -> set[float]:
        line = {"cohesion", "friction_angle"} & set(self.targets)
        return {*(self.pressures if line else ()), *(AIMS[n].confinement for n in self.targets)} - {0.0}

    def logs(self, found: Mapping[str, np.ndarray], off: Mapping[str, float]) -> np.ndarray:
        """Targets (n, t) as they are emulated, if what the emulator says is ``off`` by so much."""
        ucs = found["ucs"] + off.get("ucs", 0.0)

        def under(pressure: float) -> np.ndarray:
            steep = found[strength_at(pressure)] + off.get("steepness", 0.0)
            return np.asarray(ucs + steep * np.log1p(np.exp(np.log(pressure) - ucs)))

        known = {"ucs": ucs}
        known |= {TENSILE[name]: found[name] + off.get(name, 0.0) for name in TENSILE if name in found}
        if {"cohesion", "friction_angle"} & set(self.targets):
            peaks = np.exp([ucs, *(under(pressure) for pressure in self.pressures)])  # (m + 1, n)
            slope, first = np.polyfit([0.0, *self.pressures], peaks, 1)
            angle, cohesion = angle_and_cohesion(np.maximum(slope, 1.0), np.maximum(first, 1.0))
            known |= {"cohesion": np.log(cohesion), "friction_angle": angle}
        return np.column_stack([
            under(AIMS[name].confinement) if AIMS[name].confinement else known[name] for name in self.targets
        ])  # fmt: skip

    def predicted(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Means (n, t) and covariances (n, t, t) of the targets, as they are emulated, by the emulator's errors."""
        found = self.quantities(points)
        sides = [
            (self.logs(found, {name: fit.error}) - self.logs(found, {name: -fit.error})) / 2
            for name, fit in self.emulator.fits.items()
            if name not in MODULI
        ]
        return self.logs(found, {}), np.einsum("ent,enu->ntu", sides, sides)

    def _off(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far (n, t) predictions lie from the targets, and the covariance of that."""
        means, covariance = self.predicted(points)
        wanted, variance = as_emulated(self.targets)
        return means - wanted, covariance + np.diag(variance)

    def known(self, points: np.ndarray) -> np.ndarray:
        """(n,) whether the emulator knows rocks with these parameters; no input matters on which no target depends."""
        inputs, _ = self.inputs(points)
        return self.emulator.knows({name: inputs[name] for name in self._needed})

    def implausibility(self, points: np.ndarray) -> np.ndarray:
        """(n, t) of each target."""
        off, covariance = self._off(points)
        return np.asarray(np.abs(off) / np.sqrt(np.einsum("ntt->nt", covariance)))

    def log_likelihood(self, points: np.ndarray) -> np.ndarray:
        """(n,) of the targets, normal; none where the emulator knows nothing."""
        return np.where(self.known(points), normal_likelihood(*self._off(points)), -np.inf)


def _beyond(said: float, error: float, sign: int) -> float:
    """What an emulator with this error says, made smaller near 0; cracks move a modulus to one side only.

    A jump instead of this (0 below two errors) leaves a search for a stiffness on one side of its target. Of the
    thousand rocks those near 0 are met better by it than by the jump, by a tenth (rms).
    """
    return said**3 / (said**2 + error**2) if sign * said > 0 else 0.0


# --- the answer -------------------------------------------------------------------------------------------------------


@attrs.frozen(eq=False)
class FirstLook(metaclass=Checked):
    """What the emulator that comes with grainlaw says of a rock, before any test."""

    match: FirstMatch  #: the emulator beside the targets
    posterior: Posterior | None  #: samples; None where no parameters in the ranges are plausible
    least: float  #: implausibility of the best point
    stiffness: Stiffness | None = None  #: that of the contacts; None without elastic targets
    elastic: Mapping[str, Target] = attrs.field(factory=dict)  #: targets that statics meet
    nearest: np.ndarray | None = None  #: (d,) the best point, plausible or not

    @property
    def law(self) -> ContactLaw:
        """With the most likely parameters. Raises :class:`ParameterError` where none is plausible."""
        if self.posterior is None:
            raise ParameterError(f"FirstLook: there is no law: {self.in_words}")
        return self.match.space.made(self.best)

    @property
    def parameters(self) -> dict[str, float]:
        """All that was found of the law: elastic, free and tied; empty where none is plausible."""
        elastic = self.stiffness.parameters if self.stiffness else {}
        return {**elastic, **self.match.space.with_tied(self.best)} if self.best else {}

    def rock(self, specimen: Specimen) -> Specimen:
        """A specimen with grains as stiff as the law takes them to be."""
        return with_grains(specimen, self.match.grains)

    @property
    def best(self) -> dict[str, float]:
        """The most likely parameters by name; empty where none is plausible."""
        return {} if self.posterior is None else self.match.space.mapping(self.posterior.best)

    @property
    def expected(self) -> dict[str, tuple[float, float, float]]:
        """Of each target what the best parameters give, and between which ends with 95 % (SI)."""
        if self.posterior is None:
            return {}
        means, covariance = self.match.predicted(self.posterior.best[None])
        ends = means[0] + NORMAL * np.sqrt(np.diag(covariance[0])) * np.array([[0], [-1], [1]])
        return {
            name: tuple(map(float, restored(name, row)))  # type: ignore[misc]
            for name, row in zip(self.match.targets, ends.T, strict=True)
        }

    @property
    def moduli(self) -> dict[str, float]:
        """What a test of the best parameters gives, by elastic target (SI)."""
        if self.posterior is None or self.stiffness is None:
            return {}
        return self.match.moduli(self.posterior.best, self.stiffness.modulus, self.stiffness.poisson)

    @property
    def meets_moduli(self) -> bool:
        """Whether a test of the best parameters gives the elastic targets to 1 %."""
        found = self.moduli
        return all(abs(found[name] / target.value - 1) <= WITHIN for name, target in self.elastic.items())

    def beginning(self, count: int, seed: int) -> np.ndarray:
        """(n, d) points for a search to begin with, at most ``count``: the posterior, twice as wide."""
        assert self.posterior is not None
        space, random = self.match.space, np.random.default_rng(seed)
        at = space.places(self.posterior.points)
        middle = space.places(self.posterior.best[None])
        wide = np.clip(middle + WIDENED * (at[random.permutation(len(at))] - middle), 0, 1)
        points = space.points(np.concatenate([middle, wide[: 8 * count]]))
        return points[space.allowed(points)][:count]

    @property
    def summary(self) -> dict[str, Any]:
        """All numbers by name (SI)."""
        found: Posterior | None = self.posterior
        names = self.match.space.names
        intervals = {name: list(found.interval(k)) for k, name in enumerate(names)} if found else {}
        return {
            "best": self.best, "intervals": intervals, "expected": self.expected, "implausibility": self.least,
            "parameters": self.parameters, "moduli": self.moduli, "grains": self.match.grains,
        }  # fmt: skip

    @property
    def in_words(self) -> str:
        """The best parameters in one line."""
        if self.posterior is None:
            words = f"nothing in the ranges is plausible, at best {self.least:.1f} deviations off"
            return f"{words}: {self._far}" if self.nearest is not None else words
        return self.match.space.in_words(self.posterior.best)

    @property
    def _far(self) -> str:
        """Which targets the best point does not meet, and what it gives."""
        assert self.nearest is not None
        means, off = self.match.predicted(self.nearest[None])[0][0], self.match.implausibility(self.nearest[None])[0]
        found = []
        for (name, target), mean, each in zip(self.match.targets.items(), means, off, strict=True):
            shown = AIMS[name].shown
            if each > LIMIT:
                value = float(restored(name, mean))
                found.append(f"{shown.words} is {shown.with_unit(value)} and not {shown.with_unit(target.value)}")
        ends = self.match.space.at_ends(self.nearest)
        return f"{', '.join(found)} where {self.match.space.in_words(self.nearest)}{ends and f'. {ends}'}"

    def __str__(self) -> str:
        if self.posterior is None:
            return f"first look, by no test: {self.in_words}"
        rows = [["first look, by no test", "best", "95 %"]]
        for k, free in enumerate(self.match.space.free):
            rows.append([free.name, rounded(self.best[free.name], free.unit), free.between(self.posterior.interval(k))])
        told = [["expected in the mean", "target", "of the best", "95 %"]]
        targets, moduli = {**self.elastic, **self.match.targets}, self.moduli
        elastic = {name: (moduli[name], *self.match.ends_of(name, moduli[name])) for name in self.elastic}
        for name, (value, least, most) in {**elastic, **self.expected}.items():
            text = AIMS[name].shown.text
            told.append([AIMS[name].shown.heading, text(targets[name].value), text(value),
                         f"{text(least)} to {text(most)}"])  # fmt: skip
        ends = self.match.space.at_ends(self.posterior.best, self.posterior.points)
        beyond = self.match.beyond(self.posterior.best)
        two = self.match.space.two_regions(self.posterior.points)
        parts = [aligned(rows, rule=True), *two, *filter(None, (ends, beyond)), aligned(told, rule=True)]
        return "\n\n".join([self._statics, *parts] if self.stiffness else parts)

    @property
    def _statics(self) -> str:
        """What statics gave, and why that is not what is wanted of a test."""
        assert self.stiffness is not None
        wanted = {name: target.value for name, target in self.elastic.items()}
        beside = in_words({name: self.stiffness.moduli[name] for name in wanted}) != in_words(wanted)
        aimed = (
            ": beside the targets, because contacts crack before half of the peak and a test then has another E and nu"
        )
        return self.stiffness.in_words + (aimed if beside else "")


def first_match(
    space: Space, targets: Targets, specimens: Mapping[str, Specimen], grains: float,
    emulator: ShippedEmulator | None = None,
) -> FirstMatch:  # fmt: skip
    """The emulator of the package, or another one, beside the targets that it knows."""
    chosen = emulator or shipped(space.kind)
    return FirstMatch(space, known_targets(targets), targets.pressures, specimens, grains, chosen)


def looked_at(
    space: Space, targets: Targets, specimens: Mapping[str, Specimen], stiffness: Stiffness | None, seed: int,
    emulator: ShippedEmulator | None = None,
) -> FirstLook | str:  # fmt: skip
    """The posterior of the emulator, in seconds, or why it knows nothing of the rock.

    ``specimens`` are one of each shape, ``stiffness`` that of space and grains where statics found it.
    """
    if unknown := why_unknown(space, targets, specimens):
        return unknown
    match = first_match(space, targets, specimens, stiffness.grains if stiffness else 1.0, emulator)
    points = space.prior(TRIED, seed)
    likely = match.log_likelihood(points)
    start = points[np.argsort(-likely, kind="stable")[: min(STARTS, int(np.isfinite(likely).sum()))]]
    if not len(start):
        return "it knows no rock with these parameters; its ranges are in docs/calibration.md"
    found = posterior(match, start, seed)
    least = float(match.implausibility(found.best[None]).max())
    return FirstLook(match, found if least <= LIMIT else None, least, stiffness, targets.elastic, found.best)
