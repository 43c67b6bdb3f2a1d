"""Messages that refuse a value: the kind of error, the value in few words, the nearest name that exists."""

from __future__ import annotations

import difflib
import inspect
import os
import re
import sys
from collections.abc import Iterable, Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw import units

QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-z%].*?)\s*")
LONGEST = 100  #: letters of a value in a message
_FILES = (__file__, attrs.__file__, inspect.getfile(attrs.evolve))
#: beginnings of names of files whose code is not the user's
_OURS = (*(os.path.dirname(os.path.abspath(file)) + os.sep for file in _FILES), "<attrs")


class ParameterError(ValueError):
    """A value outside what its declaration allows; the message names component, parameter, value and bound."""

    wrong: np.ndarray | None = None  #: (n,) which of several values are refused, where that is known


def users_line() -> int:
    """The ``stacklevel`` of a warning that shall name the line of the user's that led to it."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back and frame.f_code.co_filename.startswith(_OURS):
        level, frame = level + 1, frame.f_back
    return level


def refuse_twice(where: str, names: Sequence[str], why: str = "") -> None:
    """Raise :class:`ParameterError` where two things have one name; it begins with ``where``."""
    if twice := [name for name in names if names.count(name) > 1]:
        raise ParameterError(f"{where}: two are named {twice[0]!r}, each must have a name of its own{why}")


def short(value: Any, most: int = LONGEST) -> str:
    """A value for a message: one line, and never a page of an array."""
    kind = type(value).__name__
    if kind == "_CountingAttr":
        return "what a class declares that lacks @attrs.frozen"
    if isinstance(value, np.ndarray) and value.size > 6:
        return f"an array of shape {value.shape}"
    try:
        text = " ".join(repr(value).split())
    except Exception:
        return f"{'an' if kind[0] in 'AEIOU' else 'a'} {kind}"
    if len(text) <= most:
        return text
    if attrs.has(type(value)):
        whole = text[: most - 6].rpartition(", ")[0]
        return f"{whole}, ...)" if "(" in whole else f"{kind}(...)"
    if isinstance(value, (str, bytes, list, tuple, dict, int)):
        return f"{text[: int(0.6 * most)]}..."
    return f"{'an' if kind[0] in 'AEIOU' else 'a'} {kind}"


def cut(text: str, most: int) -> str:
    """At most so many letters of a text, with dots where it goes on."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


def refusal(where: str, value: Any, wanted: str) -> ParameterError:
    """What to raise for a value: ``refusal("Stage: until", value, "a list of conditions")``."""
    hint = in_python(value) if "number" in wanted else ""
    return ParameterError(f"{where} = {short(value)} is not allowed, it must be {wanted}{hint}")


def enumeration(names: Iterable[str]) -> str:
    """``a, b and c``."""
    *before, last = names
    return f"{', '.join(before)} and {last}" if before else last


def spelled(name: str) -> str:
    """A name of code in words, modes in Roman figures: ``mode_ii_energy`` is "mode II energy"."""
    return " ".join({"i": "I", "ii": "II"}.get(word, word) for word in name.split("_"))


def in_python(value: Any) -> str:
    """How a text such as "29 MPa" is written in Python, "; write 29 * MPa"; nothing for other texts and values."""
    found = QUANTITY.fullmatch(value) if isinstance(value, str) else None
    if found is None:
        return ""
    number, unit = found.groups()
    if unit == "%":
        return f"; write {number} / 100"
    factors = re.split(r"([*/ ])", unit.replace("^", "").replace("²", "2").replace("³", "3"))
    powers = [re.fullmatch(r"([A-Za-z]+)(\d?)", each) for each in factors[::2]]
    if not all(each and hasattr(units, each[1]) for each in powers):
        return ""
    written = [f"{each[1]}**{each[2]}" if each[2] else each[1] for each in powers if each]
    signs = [sign.replace(" ", "*") for sign in factors[1::2]]
    rest = "".join(f" {sign} {each}" for sign, each in zip(signs, written[1:], strict=True))
    return f"; write {number} * {written[0]}{rest} (grainlaw.units)"


#: what names stand for that are not like the words of who does not know them
MEANT = {
    "uniaxial_compressive_strength": "ucs",
    "normal_stiffness": "kn",
    "shear_stiffness": "ks",
    "tension": "tensile_strength",
}
LIKE = 0.75  #: of two names, one of which is most likely misspelt


def nearest(name: str, known: Iterable[str], likeness: float = 0.5) -> str:
    """A question that suggests the nearest known name, or nothing where none is as like (0 to 1)."""
    known = list(known)
    names = {words: each for words, each in MEANT.items() if each in known}
    names |= {each.lower(): each for each in known}  # kN is nearer to kn than to ks
    near = [names[each] for each in difflib.get_close_matches(name.lower(), names, n=1, cutoff=likeness)]
    return f"; did you mean '{near[0]}'?" if near else ""
