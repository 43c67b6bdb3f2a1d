"""Quantities as people write them: ``"13 MPa"`` for a parameter declared in Pa."""

from __future__ import annotations

import math
import re
from decimal import Decimal
from fractions import Fraction
from numbers import Real
from typing import Any

from grainlaw.messages import ParameterError, nearest, refusal, short

#: powers of kilogram, metre, second, kelvin, degree Celsius (no difference), degree of an angle
Dimension = tuple[int, ...]
Unit = tuple[Fraction, Dimension]  #: size in SI (degrees for angles), exact so that "5 um" is the float 5e-6

POUND = Fraction("4.4482216152605") / Fraction("0.00064516")  #: N/m2, its force on a square inch
PREFIXES = {"T": 12, "G": 9, "M": 6, "k": 3, "c": -2, "m": -3, "u": -6, "µ": -6, "μ": -6, "n": -9}
SYMBOLS: dict[str, Unit] = {
    "g": (Fraction(1, 1000), (1, 0, 0, 0, 0, 0)),
    "m": (Fraction(1), (0, 1, 0, 0, 0, 0)),
    "s": (Fraction(1), (0, 0, 1, 0, 0, 0)),
    "N": (Fraction(1), (1, 1, -2, 0, 0, 0)),
    "Pa": (Fraction(1), (1, -1, -2, 0, 0, 0)),
    "J": (Fraction(1), (1, 2, -2, 0, 0, 0)),
    "W": (Fraction(1), (1, 2, -3, 0, 0, 0)),
    "bar": (Fraction(100_000), (1, -1, -2, 0, 0, 0)),
}
PLAIN: dict[str, Unit] = {  #: they take no prefix
    "1": (Fraction(1), (0, 0, 0, 0, 0, 0)),
    "%": (Fraction(1, 100), (0, 0, 0, 0, 0, 0)),
    "permille": (Fraction(1, 1000), (0, 0, 0, 0, 0, 0)),
    "‰": (Fraction(1, 1000), (0, 0, 0, 0, 0, 0)),
    "min": (Fraction(60), (0, 0, 1, 0, 0, 0)),
    "h": (Fraction(3600), (0, 0, 1, 0, 0, 0)),
    "day": (Fraction(86_400), (0, 0, 1, 0, 0, 0)),
    "year": (Fraction(31_557_600), (0, 0, 1, 0, 0, 0)),  # of 365.25 days
    "psi": (POUND, (1, -1, -2, 0, 0, 0)),
    "ksi": (1000 * POUND, (1, -1, -2, 0, 0, 0)),
    "K": (Fraction(1), (0, 0, 0, 1, 0, 0)),
    "degC": (Fraction(1), (0, 0, 0, 0, 1, 0)),
    "°C": (Fraction(1), (0, 0, 0, 0, 1, 0)),
    "deg": (Fraction(1), (0, 0, 0, 0, 0, 1)),
    "°": (Fraction(1), (0, 0, 0, 0, 0, 1)),
    "rad": (Fraction(180 / math.pi), (0, 0, 0, 0, 0, 1)),
}
#: what to suggest for a unit that is misspelt: none that differs from another one by capitals alone
OFTEN = (
    "Pa", "kPa", "MPa", "GPa", "TPa", "Pa/m", "MPa/m", "GPa/m", "TPa/m", "m", "cm", "mm", "um", "km", "m/s", "mm/s",
    "s", "ms", "us", "min", "h", "day", "year", "N", "kN", "MN", "kN/m", "J/m2", "kg/m3", "g/cm3", "deg", "rad", "K",
    "degC", "psi", "ksi", "bar", "%", "permille",
)  # fmt: skip
USUAL = {  #: what to suggest for a declared unit
    "Pa": "13 MPa", "Pa/m": "105 TPa/m", "J/m2": "150 J/m2", "m": "50 mm", "m/s": "50 mm/s", "s": "0.2 ms",
    "kg/m3": "3100 kg/m3", "deg": "54 deg", "1": "25 %", "1/s": "300 1/s",
    "degC": "600 °C", "1/K": "8e-6 1/K",
    "W/m/K": "3 W/m/K", "J/kg/K": "800 J/kg/K", "W/m2/K": "500 W/m2/K", "W/m2": "60 mW/m2", "W/m3": "1 kW/m3",
    "m2": "0.01 m2", "m2/s": "1e-4 m2/s", "Pa s": "1 mPa s",
}  # fmt: skip
SHOWN = {  #: prefixes to write, by power of ten, for units that begin with a symbol
    "Pa": {0: "", 3: "k", 6: "M", 9: "G", 12: "T"}, "m": {0: "", -3: "m", -6: "u"}, "s": {0: "", -3: "m", -6: "u"},
}  # fmt: skip
NUMBER = re.compile(r"\s*([+-]?(?:(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|inf))\s*(.*?)\s*")
FACTOR = re.compile(r"([A-Za-zµμ%‰°]+|1)(?:\^?([+-]?\d)|([²³]))?")


def quantity(value: Any, unit: str, name: str = "the value") -> float:
    """The number, in the declared ``unit``, of a number in that unit or a string such as ``"13 MPa"``.

    Units are those of mechanics with SI prefixes, multiplied by * or a space and divided by /, with powers as in m2 or
    m^2, bar, psi, ksi, min, h, day and year, and %, deg, rad, K and °C. Raises
    :class:`~grainlaw.messages.ParameterError`, which names ``name`` and what is allowed.
    """
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            raise ParameterError(f"{name} = {short(value)} is not allowed, it is too large") from None
    wanted = "a number" if unit == "1" else f"a number in {unit}"
    wanted += f" or a string such as '{USUAL[unit]}'" if unit in USUAL else ""
    found = NUMBER.fullmatch(value) if isinstance(value, str) else None
    if not found:
        raise refusal(name, value, wanted)
    number, written = float(found[1]), found[2]
    if not written:
        if unit != "1" and _unit(unit) and number and not math.isinf(number):
            raise ParameterError(f"{name} = {value!r} is not allowed, a text needs its unit; it must be {wanted}")
        return number
    given, declared = _unit(written), _unit(unit)
    if given is None:
        like = nearest(written, [each for each in OFTEN if dimension(each) == declared[1]], 0.5) if declared else ""
        raise ParameterError(
            f"{name} = {value!r} is not allowed: there is no unit '{written}'{like or ';'} it must be {wanted}"
        )
    if declared is None or declared[1] != given[1]:
        kind = "a number without a unit" if unit == "1" else f"one of {unit}"
        raise ParameterError(f"{name} = {short(value)} is not allowed: '{written}' is not {kind}; it must be {wanted}")
    if number == 0 or math.isinf(number):
        return number
    return float(Fraction(found[1]) * given[0] / declared[0])


def in_si(text: str) -> float | None:
    """The number, in SI units and degrees, of a text such as ``"13 MPa"`` or ``"25 %"``; None for other texts."""
    found = NUMBER.fullmatch(text)
    unit = _unit(found[2] or "1") if found else None
    if found is None or unit is None or math.isinf(float(found[1])):
        return None
    return float(Fraction(found[1]) * unit[0])


def factor_into(unit: str, where: str = "the unit") -> float:
    """A value in SI, angles in rad, times this is the value in ``unit``; 1 for an empty text.

    Raises :class:`~grainlaw.messages.ParameterError`, which begins with ``where``, for what is no unit of mechanics.
    """
    found = _unit(unit or "1")
    if found is None:
        wanted = "a unit such as 'MPa', '%', 'permille', 'mm' or 'J/m2'; for another one, give the factor from SI, too"
        like = nearest(unit, OFTEN, 0.6)
        raise refusal(where, unit, wanted + like)
    size, (*_, angle) = found
    return (180 / math.pi) ** angle * float(1 / size)


def is_unit(text: str) -> bool:
    """Whether a text is a unit of mechanics."""
    return _unit(text) is not None


def spellings(unit: str) -> list[str]:
    """Single symbols, with their prefixes, that have the dimension of a unit; empty for what is none."""
    wanted = dimension(unit)
    every = [*PLAIN, *SYMBOLS, *(prefix + symbol for prefix in PREFIXES for symbol in SYMBOLS)]
    return [each for each in every if dimension(each) == wanted] if wanted else []


def dimension(unit: str) -> Dimension | None:
    """The powers of a unit; None for what is none."""
    found = _unit(unit)
    return found[1] if found else None


def without_prefixes(unit: str) -> str:
    """The unit of the values in SI that are shown in this one: Pa for "MPa", 1 for "%"."""

    def bare(found: re.Match[str]) -> str:
        text = found[0]
        return text[1:] if text not in PLAIN | SYMBOLS and text[:1] in PREFIXES and text[1:] in SYMBOLS else text

    return "1" if unit in ("%", "permille", "‰") else re.sub(r"[^\W\d_]+", bare, unit)


def written(value: float, unit: str) -> str:
    """The number with its unit as people write it, such as ``"13 MPa"``, which :func:`quantity` reads back exactly."""
    number = Decimal(repr(float(value)))
    if not number.is_finite() or unit == "1" or _unit(unit) is None:
        return f"{value:g}" if float(f"{value:g}") == value else repr(float(value))
    prefixes = SHOWN.get(unit.partition("/")[0], {0: ""})
    power = max((p for p in prefixes if p <= number.adjusted()), default=min(prefixes)) if number else 0
    text = f"{number.scaleb(-power).normalize():f}"
    return f"{text} {prefixes[power]}{unit}" if len(text) <= 20 else f"{number} {unit}"


def _unit(text: str) -> Unit | None:
    """None if it is no unit."""
    size, powers = Fraction(1), [0, 0, 0, 0, 0, 0]
    parts = re.split(r"\s*([*/·])\s*", re.sub(r"(?<=\w)\s+(?=\w)", "*", text))
    for sign, part in zip(["*", *parts[1::2]], parts[::2], strict=True):
        match = FACTOR.fullmatch(part)
        symbol = _symbol(match[1]) if match else None
        if match is None or symbol is None:
            return None
        power = int(match[2] or {"²": 2, "³": 3}.get(match[3], 1)) * (-1 if sign == "/" else 1)
        size *= symbol[0] ** power
        powers = [have + power * more for have, more in zip(powers, symbol[1], strict=True)]
    return size, tuple(powers)


def _symbol(text: str) -> Unit | None:
    if text in PLAIN:
        return PLAIN[text]
    if text in SYMBOLS:
        return SYMBOLS[text]
    if text[:1] in PREFIXES and text[1:] in SYMBOLS:
        size, dimension = SYMBOLS[text[1:]]
        return Fraction(10) ** PREFIXES[text[0]] * size, dimension
    return None
