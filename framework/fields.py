"""A declared quantity: an attrs field with a unit and a bound, checked once when the component is made."""

from __future__ import annotations

import math
import operator
import warnings
from collections.abc import Callable, Mapping
from enum import Enum
from types import FunctionType
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked, floats, floats_or_nan, is_number
from grainlaw.messages import ParameterError, in_python, refusal, short, users_line
from grainlaw.unit_text import is_unit

LARGEST = 1e30  #: no quantity of mechanics is larger in SI; beyond it products overflow
FARTHEST = 1e12  #: m from the origin: beyond it products of lengths lose digits
STRENGTHS = (1e3, 1e10)  #: Pa: usual, from soft soil to single crystals
IN_SITU = (-1e9, -1e3)  #: Pa: usual stresses of rock in its place, compression negative
SURFACES = (0.3, 1e5)  #: J/m2: usual fracture energies; new surface alone costs more than the first
WITHOUT = "without"  #: key of what a part does not take


class UnitWarning(UserWarning):
    """A number far from what is usual, as after a slip of units.

    ``warnings.simplefilter("ignore", gl.UnitWarning)`` silences it.
    """


@attrs.frozen
class Bounds:
    """Limits of a parameter."""

    at_least: float | None = None
    above: float | None = None
    at_most: float | None = None
    below: float | None = None
    infinite: bool = False

    def allow(self, value: float) -> bool:
        """Whether ``value`` is a number inside the bounds."""
        if math.isnan(value) or (math.isinf(value) and not self.infinite):
            return False
        if LARGEST < abs(value) < math.inf or (self.above == 0 and value < 1 / LARGEST):
            return False
        return (
            (self.at_least is None or value >= self.at_least)
            and (self.above is None or value > self.above)
            and (self.at_most is None or value <= self.at_most)
            and (self.below is None or value < self.below)
        )

    def __str__(self) -> str:
        words = [
            f"{name} {bound:g}"
            for name, bound in (
                ("at least", self.at_least), ("above", self.above), ("at most", self.at_most), ("below", self.below),
            )
            if bound is not None and math.isfinite(bound)
        ]  # fmt: skip
        return " and ".join(["a number" if self.infinite else "a finite number", *words])

    def why_not(self, value: float) -> str:
        """What else is wrong with a number that these words allow."""
        is_odd = 0 < abs(value) < 1 / LARGEST or LARGEST < abs(value) < math.inf
        return f", of size {1 / LARGEST:g} to {LARGEST:g}" if is_odd else ""


NO_UNITS = ("its own", "grain sizes", "cell sizes", "spacings")  #: of parameters, that no table of units has


@checked
def parameter(
    unit: str, *, default: Any = attrs.NOTHING, at_least: float | None = None, above: float | None = None,
    at_most: float | None = None, below: float | None = None, infinite: bool = False,
    usual: tuple[float, float] | None = None,
) -> Any:  # fmt: skip
    """Declare a number of a component: ``cohesion: float = parameter("Pa", at_least=0)``.

    Without a bound the value must be above 0; ``above=-math.inf`` allows either sign, ``infinite=True`` infinity. A
    contact law and its parts may be given an array, one entry per contact point. Outside of
    what is ``usual`` (lowest, highest; 0 is, where it is allowed) it warns (:class:`UnitWarning`). Raises
    :class:`ParameterError`.
    """
    if at_least is above is at_most is below is None:
        above = 0.0
    bounds = Bounds(at_least, above, at_most, below, infinite)
    if not (is_unit(unit) or unit in NO_UNITS):
        raise refusal("parameter: unit", unit, "a unit such as 'Pa', 'deg' or 'm/s', or '1' for a number without one")
    measured = "" if unit in ("1", "its own") else f" {unit}"
    if isinstance(default, (int, float)) and not bounds.allow(default):
        raise refusal("parameter: default", default, f"{bounds}, or another bound given, as at_least=0")

    def check(component: Any, attribute: Any, value: Any) -> None:
        values = np.atleast_1d(value) if isinstance(value, np.ndarray) else (value,)
        for entry in values:
            if not bounds.allow(entry):
                raise ParameterError(
                    f"{type(component).__name__}: {attribute.name} = {entry:g}{measured} is not allowed, "
                    f"it must be {bounds}{bounds.why_not(entry)}"
                )
        for entry in values:
            if words := usual and unusual(f"{type(component).__name__}: {attribute.name}", entry, unit, usual):
                warnings.warn(UnitWarning(words), stacklevel=users_line())
                break  # of an array one is enough

    def convert(value: Any, component: Any, attribute: Any) -> Any:
        try:
            if isinstance(value, (bool, str, bytes)) or value is None:
                raise TypeError
            if isinstance(value, (np.ndarray, list, tuple)):
                array = floats(value)
                kind = type(component)  # parameters may differ between contacts in laws, parts, and a user's classes
                takes_arrays = getattr(kind, "takes_arrays", not isinstance(kind, Checked))
                if array.ndim != 1 or not array.size or not takes_arrays:
                    raise TypeError
                array.flags.writeable = False
                return array
            return float(value)
        except (TypeError, ValueError, OverflowError):
            wanted = f"{bounds}{measured and f' ({unit})'}"
            raise refusal(f"{type(component).__name__}: {attribute.name}", value, wanted) from None

    return attrs.field(
        default=default,
        converter=attrs.Converter(convert, takes_self=True, takes_field=True),
        validator=check,
        metadata={"unit": unit, "bounds": bounds, "usual": usual},
        eq=attrs.cmp_using(eq=np.array_equal),
    )


def unusual(where: str, value: float, unit: str, usual: tuple[float, float]) -> str:
    """What to warn of where a number lies outside of what is usual; empty for 0 and for one that does not."""
    if not value or usual[0] <= value <= usual[1]:
        return ""
    measured = "" if unit == "1" else f" {unit}"
    words = f"{where} = {value:g}{measured} is unusual, usual are {usual[0]:g} to {usual[1]:g}{measured}"
    return f"{words}: is the {'sign' if usual[0] <= -value <= usual[1] else 'unit'} right?"


def optional(unit: str, *, above: float | None = None, usual: tuple[float, float] | None = None) -> Any:
    """Declare a number that may be left away: ``volume: float | None = optional("m2", above=0)``.

    One that is not ``usual`` warns (:class:`UnitWarning`).
    """

    def check(where: str, value: Any) -> float | None:
        return None if value is None else checked_number(where, value, unit, above=above, usual=usual)

    return checked_field(check, default=None, metadata={"unit": unit, "bounds": str(Bounds(None, above))})


def angle_of_friction(default: Any = attrs.NOTHING) -> Any:
    """Declare an angle of friction in degrees; one that looks like radians warns."""
    return parameter("deg", default=default, at_least=0, below=90, usual=(2, 90))


def checked_number(
    where: str, value: Any, unit: str = "1", *, at_least: float | None = None, above: float | None = None,
    at_most: float | None = None, usual: tuple[float, float] | None = None,
) -> float:  # fmt: skip
    """The value as a finite float; one that is not ``usual`` warns.

    Raises :class:`ParameterError`, which begins with ``where``: ``"hold: stress"``.
    """
    bounds = Bounds(at_least, above, at_most=at_most)
    if not is_number(value) or not bounds.allow(float(value)):
        measured = "" if unit == "1" or isinstance(value, str) else f" {unit}"
        hint = in_python(value)
        raise ParameterError(f"{where} = {short(value)}{measured} is not allowed, it must be {bounds}{hint}")
    if words := usual and unusual(where, float(value), unit, usual):
        warnings.warn(UnitWarning(words), stacklevel=users_line())
    return float(value)


def checked_points(where: str, value: Any) -> np.ndarray:
    """(n, 2) m, finite. Raises :class:`ParameterError`, which begins with ``where``."""
    points = floats_or_nan(value)
    if points.ndim != 2 or points.shape[1] != 2 or not (np.abs(points) <= FARTHEST).all():
        raise refusal(where, value, f"a list of points (x, y) in m, all finite and within {FARTHEST:g}")
    return points


def checked_vector(where: str, value: Any, unit: str = "m", names: tuple[str, ...] = ("x", "y")) -> np.ndarray:
    """Two or three finite numbers, one of each name. Raises :class:`ParameterError`, which begins with ``where``."""
    try:
        vector = np.array(value, dtype=float) if all(map(is_number, value)) else np.zeros(0)
    except (TypeError, ValueError, OverflowError):
        vector = np.zeros(0)
    if vector.shape != (len(names),) or not np.isfinite(vector).all():
        count = {2: "two", 3: "three"}[len(names)]
        raise refusal(where, value, f"{count} finite numbers ({', '.join(names)}) in {unit}")
    return vector


def checked_whole_number(where: str, value: Any, *, at_least: int, at_most: int | None = None) -> int:
    """The value as an int; numpy's integers are whole numbers too, ``2.0`` and ``True`` are not.

    Raises :class:`ParameterError`, which begins with ``where``: ``"Specimen: refinement"``.
    """
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or value < at_least or (at_most is not None and value > at_most):
        bounds = f", at least {at_least}" if at_most is None else f" from {at_least} to {at_most}"
        raise refusal(where, value, f"a whole number{bounds}")
    return int(value)


def checked_field(check: Callable[[str, Any], Any], **options: Any) -> Any:
    """Declare a field of a component by what checks and converts it, given ``"Stage: pieces"`` and the value."""

    def convert(value: Any, component: Any, attribute: Any) -> Any:
        return check(f"{type(component).__name__}: {attribute.name}", value)

    return attrs.field(converter=attrs.Converter(convert, takes_self=True, takes_field=True), **options)


def whole_number(*, default: int | None, at_least: int, at_most: int | None = None) -> Any:
    """Declare a whole number of a component: ``samples: int = whole_number(default=1000, at_least=10)``.

    None is allowed where it is the default. Raises :class:`ParameterError`.
    """

    def check(where: str, value: Any) -> int | None:
        if value is None and default is None:
            return None
        return checked_whole_number(where, value, at_least=at_least, at_most=at_most)

    bounds = f"at least {at_least}" if at_most is None else f"{at_least} to {at_most}"
    limits = {"bounds": bounds, "at_least": at_least, "at_most": at_most}
    return checked_field(check, default=default, metadata=limits)


def vector(unit: str, names: tuple[str, ...] = ("x", "y"), **default: Any) -> Any:
    """Declare two or three finite numbers of a component, one of each name: ``gravity = vector("m/s2")``."""

    def check(where: str, value: Any) -> tuple[float, ...]:
        return tuple(checked_vector(where, value, unit, names).tolist())

    return checked_field(check, metadata={"unit": unit}, **default)


def grain_numbers(*, default: tuple[int, ...] | None = ()) -> Any:
    """Declare grains of a component by their numbers: ``fixed: Sequence[int] = grain_numbers()``.

    None by default; where the default is None, all grains, and a list has at least one.
    """

    def check(where: str, value: Any) -> tuple[int, ...] | None:
        if value is None and default is None:
            return None
        try:
            numbers = tuple(operator.index(entry) for entry in value)
        except TypeError:
            raise refusal(where, value, "a list of grain numbers") from None
        if not numbers and default is None:
            raise refusal(where, value, "at least one grain number, or None for all grains")
        return numbers

    return checked_field(check, default=default)


@checked
def part(kind: Any, default: Any, without: type | None = None) -> Any:
    """Declare a part of a component, which must be a ``kind`` (an interface or an enumeration).

    The default is an instance: ``closure: Closure = part(Closure, LinearClosure())``. ``without`` is a class of the
    kind that does not fit here. Raises :class:`ParameterError`.
    """

    def wanted() -> str:
        if issubclass(kind, Enum):
            return f"one of {', '.join(f'{kind.__name__}.{member.name}' for member in kind)}"
        return f"a {kind.__name__} such as {short(default)}{f', and no {without.__name__}' if without else ''}"

    def check(component: Any, attribute: Any, value: Any) -> None:
        if not isinstance(value, kind) or (without and isinstance(value, without)):
            raise refusal(f"{type(component).__name__}: {attribute.name}", value, wanted())

    return attrs.field(default=default, validator=check, metadata={WITHOUT: without})


@checked
def parameters(component: Any) -> dict[str, Any]:
    """All fields of a component by name, nested components as dictionaries: what a summary file records.

    Raises :class:`ParameterError` for what is no component.
    """
    if not attrs.has(type(component)):
        raise refusal("parameters: component", component, "of an attrs class")

    def plain(value: Any) -> Any:
        if attrs.has(type(value)):
            return {"type": type(value).__name__, **parameters(value)}
        if isinstance(value, np.ndarray):
            return value.tolist()
        if isinstance(value, (list, tuple)):
            return [plain(entry) for entry in value]
        if isinstance(value, Mapping):
            return {key: plain(entry) for key, entry in value.items()}
        if hasattr(value, "name") and hasattr(value, "value"):  # an enumeration's member
            return value.name.lower()
        if isinstance(value, FunctionType):
            return f"function {value.__qualname__}"
        return value

    return {field.name: plain(getattr(component, field.name)) for field in attrs.fields(type(component)) if field.init}
