"""The parameters that are looked for: their ranges, the groups of them that tests can tell apart, and their scale."""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np
import scipy

from grainlaw import short_form
from grainlaw.arguments import Checked, is_number
from grainlaw.contact import ContactLaw
from grainlaw.declared import units_of
from grainlaw.fields import Bounds, ParameterError, UnitWarning, checked_number, unusual
from grainlaw.messages import enumeration, nearest, refusal, short, users_line

#: Power of the strengths with which a parameter of a unit grows if the rock becomes stronger and stays as stiff:
#: strains and displacements grow alike, times and lengths of the specimen do not.
POWERS = {"Pa": 1, "J/m2": 2, "m": 1, "m/s": 1, "Pa/m": 0, "deg": 0, "1": 0, "s": 0, "1/s": 0, "kg/m3": 0}
AT_END = 0.01  #: of a range: so near its end lies what would go beyond it
CUT, NARROW = 0.03, 0.75  #: of a range: so near its end an interval is cut off, if it is no wider
ALONG = 201  #: points of a range at which the density of samples is known
APART = 0.05  #: of a range: what lies closer together is one region
FEW, SIDE = 0.1, 0.05  #: density between two regions over that of the lower one; share of all in the smaller one
DIGITS = 5  #: of parameters that are tried
OF_ENDS = 3  #: digits of the ends of an interval
MOST_REFUSED = 200  #: times as many points as are wanted


@attrs.frozen
class Free:
    """A parameter that is looked for between two ends (SI)."""

    name: str
    unit: str
    low: float
    high: float

    @property
    def power(self) -> int:
        return POWERS.get(self.unit, 0)

    @property
    def is_log(self) -> bool:
        """Whether equal factors count alike, not equal differences: for what is above zero by its nature."""
        return self.low > 0 and self.power > 0

    def at(self, share: np.ndarray) -> np.ndarray:
        """Values from shares (0 to 1) of the range."""
        if self.is_log:
            return np.exp(math.log(self.low) + share * math.log(self.high / self.low))
        return self.low + share * (self.high - self.low)

    def share(self, value: np.ndarray) -> np.ndarray:
        if self.is_log:
            return np.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def half(self, best: float, ends: Sequence[float]) -> str:
        """Half of an interval, over the best where equal factors count alike, in words; a factor where it is larger."""
        half = (ends[1] - ends[0]) / 2
        if not self.is_log:
            return f"± {short_form.rounded(half, self.unit, 2)}"
        return f"± {100 * half / best:.0f} %" if half < best else f"within a factor of {(ends[1] / ends[0]) ** 0.5:.2g}"

    def between(self, ends: Sequence[float]) -> str:
        """An interval in words."""
        return " to ".join(short_form.rounded(value, self.unit, OF_ENDS) for value in ends)


@attrs.frozen
class Tie:
    """A parameter that is another one times a number."""

    name: str
    to: str
    times: float


def law_with(law: Any, base: Mapping[str, Any], ties: Sequence[Tie], values: Mapping[str, Any]) -> ContactLaw:
    """A law, or one of a class, with these parameters. Raises :class:`ParameterError` where it refuses them."""
    given = {**base, **values, **{tie.name: tie.times * values[tie.to] for tie in ties}}
    return law(**given) if isinstance(law, type) else attrs.evolve(law, **given)


def rounded(value: float) -> float:
    """A parameter that is tried: the last bits of its computation must not make another case."""
    return short_form.to_digits(value, DIGITS)


@attrs.frozen(eq=False)
class Space(metaclass=Checked):
    """Points are arrays (n, d) of the free parameters in SI; a share (0 to 1) of each range is a place.

    ``scale`` is the parameter whose size one strength of the rock follows (:data:`POWERS`), as all others that have
    dimensions are free with it; None where one of them is fixed. Groups are the other parameters in units of it.
    """

    law: Any  #: a contact law, or its class
    free: tuple[Free, ...]
    ties: tuple[Tie, ...] = ()
    base: Mapping[str, Any] = attrs.field(factory=dict)  #: other parameters of the law, such as stiffnesses

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(free.name for free in self.free)

    @property
    def powers(self) -> dict[str, int]:
        """By name, how each parameter follows one strength of similar rocks."""
        return {free.name: free.power for free in self.free}

    @property
    def kind(self) -> type:
        return self.law if isinstance(self.law, type) else type(self.law)

    def made(self, values: Mapping[str, Any]) -> ContactLaw:
        """The law with these free parameters. Raises :class:`ParameterError` where it refuses them."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UnitWarning)  # told of the ranges
            return law_with(self.law, self.base, self.ties, values)

    @property
    def example(self) -> ContactLaw:
        """One of the laws, for what all of them have in common. Raises :class:`ParameterError` where none is taken."""
        return self.made(self.mapping(self.prior(1, 0)[0]))

    def mapping(self, point: np.ndarray) -> dict[str, float]:
        """A point by the names of its parameters."""
        return dict(zip(self.names, map(float, point), strict=True))

    def in_words(self, point: np.ndarray) -> str:
        """A point (d,) in one line."""
        return ", ".join(f"{f.name} = {short_form.rounded(v, f.unit)}" for f, v in zip(self.free, point, strict=True))

    def evolved(self, parameters: Mapping[str, float]) -> Space:
        """The same with other values of parameters that are not free."""
        return attrs.evolve(self, base={**self.base, **parameters})

    def with_tied(self, values: Mapping[str, float]) -> dict[str, float]:
        """Free parameters by name, and those that follow from them."""
        return {**values, **{tie.name: tie.times * values[tie.to] for tie in self.ties}}

    def points(self, places: np.ndarray) -> np.ndarray:
        """(n, d) parameters from places (n, d)."""
        return np.column_stack([free.at(places[:, k]) for k, free in enumerate(self.free)])

    def places(self, points: np.ndarray) -> np.ndarray:
        return np.column_stack([free.share(points[:, k]) for k, free in enumerate(self.free)])

    def allowed(self, points: np.ndarray) -> np.ndarray:
        """(n,) whether the law takes the parameters."""
        if len(points) < 2:
            return np.array([self._refusal(self.mapping(point)) is None for point in points], dtype=bool)
        error = self._refusal(dict(zip(self.names, points.T, strict=True)))  # as of many contact points, in one go
        if error is None:
            return np.ones(len(points), dtype=bool)
        wrong: Any = getattr(error, "wrong", None)
        if np.shape(wrong) == (len(points),):  # the law says which
            takes = ~np.asarray(wrong)
            takes[takes] = self.allowed(points[takes])
            return takes
        half = len(points) // 2
        return np.concatenate([self.allowed(points[:half]), self.allowed(points[half:])])

    def _refusal(self, values: Mapping[str, Any]) -> Exception | None:
        try:
            self.made(values)
        except (ParameterError, ValueError, TypeError) as error:  # a law of the user's own may not compare arrays
            return error
        return None

    def _why_refused(self, points: np.ndarray) -> str:
        """What the law says of the first of the points (n, d) that it refuses."""
        refused = (self._refusal(self.mapping(point)) for point in points)
        error = next(filter(None, refused), None)
        return f"of one of the others {error}" if error else ""

    def prior(self, count: int, seed: int) -> np.ndarray:
        """(count, d) points of a scrambled Sobol sequence that the law takes. Raises :class:`ParameterError`."""
        drawn = scipy.stats.qmc.Sobol(len(self.free), rng=seed)
        found: list[np.ndarray] = []
        have = asked = 0
        while have < count:
            size = 2 ** max(math.ceil(math.log2(count)), 4)
            points = self.points(drawn.random(size))
            kept = points[self.allowed(points)]
            found.append(kept)
            have, asked = have + len(kept), asked + size
            if asked > MOST_REFUSED * count + 4096:
                raise ParameterError(
                    f"calibrate: free = {short(self.ends)} is not allowed: {self.kind.__name__} refuses nearly all of "
                    f"it, {have} of {asked} points are left; {self._why_refused(points)}"
                )
        return np.concatenate(found)[:count]

    @property
    def ends(self) -> dict[str, tuple[float, float]]:
        return {free.name: (free.low, free.high) for free in self.free}

    def at_ends(self, best: np.ndarray, points: np.ndarray | None = None) -> str:
        """Which of the best parameters (d,), or intervals of points (n, d), end where their range does, in words."""
        shares = self.places(best[None])[0]
        at_end = [free.name for free, share in zip(self.free, shares, strict=True) if min(share, 1 - share) < AT_END]
        cut = []
        for free, given in zip(self.free, () if points is None else points.T, strict=False):
            ends = np.quantile(given, [0.025, 0.975])
            low, high = free.share(ends)
            if free.name not in at_end and min(low, 1 - high) < CUT and high - low < NARROW:
                there, of = map(free.between, (ends, (free.low, free.high)))
                cut.append(f"{free.name}, {of}, cuts off the interval, {there}")
        told = {
            "The best is at an end of the range of {}: a wider one may meet more.": at_end and enumeration(at_end),
            "The range of {}: a wider one may hold more.": " and of ".join(cut),
        }
        return " ".join(words.format(named) for words, named in told.items() if named)

    def two_regions(self, points: np.ndarray) -> list[str]:
        """Of which parameters likely points (n, d) lie in two regions with hardly any between them, in words."""
        told = []
        at = np.linspace(0, 1, ALONG)
        for free, given in zip(self.free, points.T, strict=True):
            places = free.share(given)
            if np.ptp(places) < APART:
                continue
            density = scipy.stats.gaussian_kde(places)(at)
            left, right = np.maximum.accumulate(density), np.maximum.accumulate(density[::-1])[::-1]
            lower = np.minimum(left, right)
            valley = int(np.argmin(np.divide(density, lower, out=np.ones(ALONG), where=lower > 0)))
            is_below = places < at[valley]
            share = float(is_below.mean())
            if density[valley] > FEW * lower[valley] or min(share, 1 - share) < SIDE:
                continue
            sides = ((given[is_below], share), (given[~is_below], 1 - share))
            both = [
                f"{' to '.join(short_form.rounded(end, free.unit) for end in np.quantile(side, [0.025, 0.975]))} "
                f"({100 * part:.0f} %)" for side, part in sides
            ]  # fmt: skip
            told.append(f"{free.name} lies in two regions with hardly anything between them: {' or '.join(both)}.")
        return told

    # --- similarity --------------------------------------------------------------------------------------------------

    @functools.cached_property
    def scale(self) -> Free | None:
        """The first free stress of the law, if nothing with dimensions is fixed and more than it is free."""
        stresses = [free for free in self.free if free.power == 1 and free.is_log]
        if (
            len(self.free) == 1
            or not stresses
            or not all(free.is_log or free.low == 0 for free in self.free if free.power)
        ):
            return None
        moved = {*self.names, *(tie.name for tie in self.ties)}
        made = None if isinstance(self.law, type) else self.law
        fields = attrs.fields(self.kind)
        fixed = [
            (field, self.base.get(field.name, field.default if made is None else getattr(made, field.name)))
            for field in fields
            if field.init and field.name not in moved
        ]
        if any(_has_size(field.metadata.get("unit"), value) for field, value in fixed):
            return None
        units = {field.name: POWERS.get(field.metadata.get("unit", "1")) for field in fields}
        if any(units[tie.name] != self.powers[tie.to] for tie in self.ties):
            return None
        return stresses[0]

    def scales(self, points: np.ndarray) -> np.ndarray:
        """(n,) how many times stronger than the specimens of the design rocks with these parameters are."""
        scale = self.scale
        if scale is None:
            return np.ones(len(points))
        return np.asarray(points[:, self.names.index(scale.name)] / self.reference)

    @property
    def reference(self) -> float:
        """Value of the scale at which tests without confinement are made: the middle of its range."""
        assert self.scale is not None
        return rounded(math.sqrt(self.scale.low * self.scale.high))

    @property
    def weakest(self) -> float:
        """Least scale that the ranges allow; one without a scale."""
        return self.scale.low / self.reference if self.scale else 1.0

    def scaled(self, points: np.ndarray, scales: np.ndarray) -> np.ndarray:
        """(n, d) the parameters of rocks so many times (n,) as strong."""
        return np.asarray(points * scales[:, None] ** np.array([free.power for free in self.free]))

    def at_reference(self, points: np.ndarray) -> np.ndarray:
        """(n, d) the parameters of the same groups with a scale of one, rounded."""
        scales = self.scales(points)
        moved = np.column_stack([points[:, k] / scales**free.power for k, free in enumerate(self.free)])
        return np.array([[rounded(value) for value in row] for row in moved]).reshape(moved.shape)

    @property
    def groups(self) -> tuple[str, ...]:
        """Words of the groups."""
        scale = self.scale
        if scale is None:
            return self.names
        words = {0: "{name}", 1: "{name} / {scale}", 2: "{name} / {scale}^2"}
        return tuple(
            words[free.power].format(name=free.name, scale=scale.name) for free in self.free if free is not scale
        )

    def coordinates(self, points: np.ndarray) -> np.ndarray:
        """(n, g) where points lie in the groups, each from about -1 to 1: what an emulator is given."""
        moved, scale = points / self.scales(points)[:, None] ** np.array([f.power for f in self.free]), self.scale
        columns = []
        for k, free in enumerate(self.free):
            if free is scale:
                continue
            stretch = (scale.high / scale.low) ** (free.power / 2) if scale else 1.0
            if free.is_log:
                low, high = math.log(free.low / stretch), math.log(free.high * stretch)
                columns.append(2 * (np.log(moved[:, k]) - low) / (high - low) - 1)
            else:
                columns.append(2 * (moved[:, k] - free.low) / (free.high * stretch - free.low) - 1)
        return np.column_stack(columns)


def _has_size(unit: str | None, value: Any) -> bool:
    """Whether a fixed parameter, or one of a part, pins the size of stresses or displacements."""
    if attrs.has(type(value)):
        inner = attrs.fields(type(value))
        return any(_has_size(field.metadata.get("unit"), getattr(value, field.name)) for field in inner if field.init)
    if unit is None or value is attrs.NOTHING:
        return False
    known = POWERS.get(unit)
    return known != 0 and bool(np.any((np.asarray(value) != 0) & np.isfinite(value)))


def space_of(law: Any, free: Mapping[str, Any], tied: Mapping[str, Any], base: Mapping[str, Any]) -> Space:
    """Check what is free and what is tied. Raises :class:`ParameterError`."""
    kind = law if isinstance(law, type) else type(law)
    if not (isinstance(kind, type) and issubclass(kind, ContactLaw) and attrs.has(kind)):
        raise refusal("calibrate: law", law, "a ContactLaw, or a class of them")
    units = units_of(kind)
    if not free:
        raise ParameterError("calibrate: free is empty, it must have one parameter with its range at least")
    for name in (*free, *tied):
        if name not in units:
            has = f"{kind.__name__} has: {', '.join(units)}"
            raise ParameterError(f"calibrate: there is no parameter '{name}'{nearest(str(name), units)} ({has})")
    ranges = [_range(name, given, attrs.fields_dict(kind)[name].metadata) for name, given in free.items()]
    ties = [_tie(name, given, units, free) for name, given in tied.items()]
    if both := [tie.name for tie in ties if tie.name in free]:
        raise ParameterError(f"calibrate: '{both[0]}' is free and tied, it must be one of both")
    moved = {*free, *tied, *base}
    if isinstance(law, type):
        fields = [field for field in attrs.fields(kind) if field.init and field.default is attrs.NOTHING]
        if absent := [field.name for field in fields if field.name not in moved]:
            raise ParameterError(
                f"calibrate: law = {kind.__name__} needs {', '.join(absent)}: set them free, or give a law that has "
                f"them, {kind.__name__}({absent[0]}=..., ...)"
            )
    return Space(law, tuple(ranges), tuple(ties), dict(base))


def _range(name: str, given: Any, declared: Mapping[str, Any]) -> Free:
    where, unit = f"calibrate: free: {name}", declared["unit"]
    try:
        low, high = given
    except (TypeError, ValueError):
        raise refusal(where, given, f"(low, high) in {unit}") from None
    low, high = (checked_number(where, end, unit) for end in (low, high))
    if low >= high:
        raise refusal(where, given, f"(low, high) in {unit}, the lower end first")
    bounds, usual = declared.get("bounds"), declared.get("usual")
    for end in (low, high):
        if isinstance(bounds, Bounds) and not bounds.allow(end):
            raise ParameterError(f"{where} = {end:g} {unit} is not allowed, it must be {bounds}")
    if words := usual and next(filter(None, (unusual(where, end, unit, usual) for end in (low, high))), ""):
        warnings.warn(UnitWarning(words), stacklevel=users_line())
    return Free(name, unit, low, high)


def _tie(name: str, given: Any, units: Mapping[str, str], free: Mapping[str, Any]) -> Tie:
    where = f"calibrate: tied: {name}"
    try:
        to, times = given
    except (TypeError, ValueError):
        to, times = None, None
    if not isinstance(to, str) or not is_number(times):
        raise refusal(where, given, "(name of a free parameter, factor), such as ('mode_i_energy', 2)")
    if to not in free:
        raise ParameterError(f"{where}: '{to}' is not free{nearest(to, free)}")
    if units[to] != units[name]:
        raise ParameterError(f"{where} is in {units[name]}, but {to} in {units[to]}")
    return Tie(name, to, checked_number(where, times, above=0))
