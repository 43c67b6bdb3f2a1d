"""What a calibration aims at: numbers that a laboratory has measured, and the tests that measure them."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, is_number
from grainlaw.columns import quantity_of
from grainlaw.fields import STRENGTHS, ParameterError, UnitWarning, checked_number, unusual
from grainlaw.messages import nearest, refusal, short, users_line
from grainlaw.quantity import Quantity
from grainlaw.short_form import rounded, to_digits
from grainlaw.unit_text import without_prefixes

COMPRESSION, CONFINED, TENSION = "compression", "confined", "tension"
BRAZILIAN, BENDING = "brazilian", "bending"
TESTS = (COMPRESSION, CONFINED, TENSION, BRAZILIAN, BENDING)
USUAL_UNCERTAINTY = 0.02  #: of a value: what the mean of some ten laboratory tests is known to
KNOWN = (1e-4, 0.5)  #: of a value: its usual uncertainty
CONFINING = (1e4, 1e9)  #: Pa: usual confinements
CONFINED_AT = 0.05  #: of the strength: the confinement, if none is given


@attrs.frozen
class Aim:
    """A number that a laboratory measures."""

    name: str
    tests: tuple[str, ...]  #: that measure it
    column: str = ""  #: of the table of a study
    power: int = 1  #: it grows with this power of the strengths of a rock of the same stiffness
    least: float = 0.0  #: a value is above it
    most: float = math.inf  #: and below it
    is_log: bool = True  #: whether its logarithm is emulated
    confinement: float = 0.0  #: Pa, of a strength under one
    usual: tuple[float, float] = STRENGTHS  #: of rocks

    @property
    def shown(self) -> Quantity:
        """How it is shown."""
        return Quantity(self.name, "MPa", words=self.name, form=".2f") if self.confinement else quantity_of(self.name)

    @property
    def unit(self) -> str:
        """Of its values."""
        return without_prefixes(self.shown.unit)

    @property
    def is_elastic(self) -> bool:
        """Whether it is found by statics."""
        return self.name in ("youngs_modulus", "poissons_ratio")


UNDER = "strength at "  #: a confinement in MPa


def strength_at(pressure: float) -> str:
    """The name of the strength under a confinement (Pa)."""
    return f"{UNDER}{pressure / 1e6:g} MPa"


class Aims(dict[str, Aim]):
    """By name; the strength under a confinement, as "strength at 20 MPa", is made when it is asked for."""

    def __missing__(self, name: str) -> Aim:
        pressure = float(name.removeprefix(UNDER).removesuffix(" MPa")) * 1e6
        return Aim(name, (COMPRESSION, CONFINED), "strength", confinement=pressure)


AIMS = Aims(
    (aim.name, aim)
    for aim in (
        Aim("youngs_modulus", (COMPRESSION,), "modulus", power=0, usual=(1e8, 1e12)),
        Aim("poissons_ratio", (COMPRESSION,), "poisson", power=0, least=-1, most=0.5, is_log=False, usual=(-1, 0.5)),
        Aim("ucs", (COMPRESSION,), "strength"),
        Aim("cohesion", (COMPRESSION, CONFINED)),
        Aim("friction_angle", (COMPRESSION, CONFINED), power=0, most=90, is_log=False, usual=(2, 90)),
        Aim("tensile_strength", (TENSION,), "strength"),
        Aim("brazilian_strength", (BRAZILIAN,), "strength"),
        Aim("fracture_toughness", (BENDING,), "toughness", usual=(1e4, 1e8)),
        Aim("crack_initiation", (COMPRESSION,), "crack_initiation_lateral"),
        Aim("crack_damage", (COMPRESSION,), "crack_damage"),
    )
)


#: of each two of a rock the first is below the second
SMALLER = (
    ("tensile_strength", "ucs"), ("brazilian_strength", "ucs"), ("crack_initiation", "crack_damage"),
    ("crack_initiation", "ucs"), ("cohesion", "ucs"),
)  # fmt: skip


def in_words(values: Mapping[str, float]) -> str:
    """Numbers of a laboratory by name (SI) as it writes them: ``E = 59.87 GPa, nu = 0.250``."""
    return ", ".join(
        f"{AIMS[name].shown.words} = {AIMS[name].shown.with_unit(value)}" for name, value in values.items()
    )


@attrs.frozen
class Target:
    """A value of the laboratory and how well it is known (standard uncertainty); SI, angles in degrees."""

    value: float
    uncertainty: float


def _target(given: Any, _component: Any, attribute: Any) -> Target | None:
    return given if given is None else _target_of(AIMS[attribute.name], given)


def _target_of(aim: Aim, given: Any) -> Target:
    if isinstance(given, Target):
        return given
    where = f"Targets: {aim.name}"
    pair = (given, None) if is_number(given) else given
    if isinstance(pair, (str, bytes)) or not isinstance(pair, Sequence) or len(pair) != 2:
        raise refusal(where, given, f"a number ({aim.unit}) or (value, uncertainty)")
    value = checked_number(where, pair[0], aim.unit, above=aim.least)
    if value == 0 or value >= aim.most:
        raise refusal(where, value, f"below {aim.most:g} and not 0, as it is met to a share of itself")
    _warn(unusual(where, value, aim.unit, aim.usual))
    if pair[1] is None:
        return Target(value, USUAL_UNCERTAINTY * abs(value))
    uncertainty = checked_number(f"{where}: uncertainty", pair[1], at_least=0)
    _warn(unusual(f"{where}: uncertainty over value", uncertainty / abs(value), "1", KNOWN))
    return Target(value, uncertainty)


def _warn(words: str) -> None:
    if words:
        warnings.warn(UnitWarning(words), stacklevel=users_line())


def _triaxial(given: Any) -> dict[float, Target]:
    if not isinstance(given, Mapping):
        raise refusal("Targets: triaxial", given, "a mapping of confinements (Pa) to strengths")
    pressures = [checked_number("Targets: triaxial", each, "Pa", above=0, usual=CONFINING) for each in given]
    found = {p: _target_of(AIMS[strength_at(p)], given[p]) for p in sorted(pressures)}
    for pressure, target in found.items():
        if target.value <= pressure:
            raise ParameterError(
                f"Targets: triaxial: a strength of {rounded(target.value, 'Pa')} under {rounded(pressure, 'Pa')} is "
                "not allowed, it is the axial stress and must be above the confinement"
            )
    return found


def _wanted() -> Any:
    return attrs.field(default=None, converter=attrs.Converter(_target, takes_self=True, takes_field=True))


@attrs.frozen(kw_only=True)
class Targets(metaclass=Checked):
    """Numbers of a laboratory: each a value, or (value, standard uncertainty), in SI units and degrees.

    ``ucs=126.65 * MPa`` or ``ucs=(126.65 * MPa, 4 * MPa)``; the uncertainty is that of the mean, 2 % of the value if it
    is not given. Cohesion and friction angle are those of a straight line through the strengths without and under the
    ``confinements`` (Pa, at most a few), a twentieth of the UCS if none is given. ``triaxial`` are axial stresses at
    failure by confinement, ``{20 * MPa: 404 * MPa, 75 * MPa: (703 * MPa, 20 * MPa)}``. Raises ParameterError for a
    value that no rock has.
    """

    youngs_modulus: Target | None = _wanted()  #: Pa, of the rock, not of its plane problem
    poissons_ratio: Target | None = _wanted()  #: of the rock
    ucs: Target | None = _wanted()  #: Pa, uniaxial compressive strength
    cohesion: Target | None = _wanted()  #: Pa, of the line through strengths over confinement
    friction_angle: Target | None = _wanted()  #: deg
    tensile_strength: Target | None = _wanted()  #: Pa, of direct tension
    brazilian_strength: Target | None = _wanted()  #: Pa, of a disc
    fracture_toughness: Target | None = _wanted()  #: Pa sqrt(m), of the notched half disc
    crack_initiation: Target | None = _wanted()  #: Pa, by the lateral strain
    crack_damage: Target | None = _wanted()  #: Pa, by the volumetric strain
    triaxial: Mapping[float, Any] = attrs.field(factory=dict, converter=_triaxial)  #: Pa by Pa
    confinements: Sequence[float] = ()  #: Pa, of the tests behind cohesion and friction angle

    def __attrs_post_init__(self) -> None:
        for number, value in enumerate(self.confinements):
            checked_number(f"Targets: confinements[{number}]", value, "Pa", above=0, usual=CONFINING)
        if len(set(self.confinements)) < len(self.confinements):
            raise ParameterError(f"Targets: confinements = {short(self.confinements)} is not allowed, each only once")
        for less, more in SMALLER:
            low, high = getattr(self, less), getattr(self, more)
            if low is not None and high is not None and low.value >= high.value:
                raise ParameterError(
                    f"Targets: {less} = {low.value:g} Pa is not allowed beside {more} = {high.value:g} Pa, it must be "
                    "below it: are the two exchanged, or their units?"
                )
        if not self.given:
            raise ParameterError(f"Targets: there is no target; give one or more of {', '.join(AIMS)}")

    @property
    def given(self) -> dict[str, Target]:
        """The targets by name."""
        found = {name: getattr(self, name) for name in AIMS}
        named = {name: target for name, target in found.items() if target is not None}
        return named | {strength_at(pressure): target for pressure, target in self.triaxial.items()}

    @property
    def elastic(self) -> dict[str, Target]:
        """Those that are met by statics."""
        return {name: target for name, target in self.given.items() if AIMS[name].is_elastic}

    @property
    def tested(self) -> dict[str, Target]:
        """Those that take tests to failure."""
        return {name: target for name, target in self.given.items() if not AIMS[name].is_elastic}

    @property
    def confined(self) -> bool:
        """Whether anything is known of confined tests."""
        return bool(self.pressures or self.triaxial)

    @property
    def pressures(self) -> tuple[float, ...]:
        """Pa, confinements of the tests behind cohesion and friction angle."""
        if self.confinements:
            return tuple(sorted(map(float, self.confinements)))
        if self.triaxial and self.cohesion is None and self.friction_angle is None:
            return ()
        if self.ucs is not None:
            return (to_digits(CONFINED_AT * self.ucs.value, 3),)
        if self.cohesion is not None and self.friction_angle is not None:
            phi = math.radians(self.friction_angle.value)
            ucs = 2 * self.cohesion.value * math.cos(phi) / (1 - math.sin(phi))
            return (to_digits(CONFINED_AT * ucs, 3),)
        return ()


def as_emulated(targets: Mapping[str, Target]) -> tuple[np.ndarray, np.ndarray]:
    """Values (t,) and variances of targets, as they are emulated."""
    is_log = np.array([AIMS[name].is_log for name in targets], dtype=bool)
    value = np.array([target.value for target in targets.values()])
    spread = np.array([target.uncertainty for target in targets.values()])
    return np.where(is_log, np.log(np.abs(value)), value), np.where(is_log, spread / value, spread) ** 2


def checked_quantities(where: str, names: Sequence[str]) -> tuple[str, ...]:
    """Names of quantities that tests to failure measure. Raises :class:`ParameterError`."""
    known = [name for name, aim in AIMS.items() if not aim.is_elastic]
    for name in names:
        if name not in known:
            raise ParameterError(f"{where}: there is no quantity {short(name)}{nearest(str(name), known)}")
    return tuple(dict.fromkeys(names))


def needed_tests(names: Sequence[str]) -> tuple[str, ...]:
    """The tests that measure quantities, in the order of :data:`TESTS`."""
    wanted = {test for name in names for test in AIMS[name].tests}
    return tuple(test for test in TESTS if test in wanted)


def measured_by(tests: Sequence[str], targets: Targets) -> tuple[str, ...]:
    """All quantities that some tests measure, asked for or not, under the confinements of the targets."""
    lines = bool(targets.pressures)
    names = [name for name, aim in AIMS.items() if lines or CONFINED not in aim.tests]
    return tuple(name for name in dict.fromkeys([*names, *targets.given]) if set(AIMS[name].tests) <= set(tests))
