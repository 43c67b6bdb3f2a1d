"""Messages that refuse a value: the kind of error, the value in few words, the nearest name that exists."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any

import attrs
import numpy as np

LONGEST = 100  #: letters of a value in a message


class ParameterError(ValueError):
    """A value outside what its declaration allows; the message names component, parameter, value and bound."""


def short(value: Any, most: int = LONGEST) -> str:
    """A value for a message: one line, and never a page of an array."""
    kind = type(value).__name__
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


def refusal(where: str, value: Any, wanted: str) -> ParameterError:
    """What to raise for a value: ``refusal("Stage: until", value, "a list of conditions")``."""
    return ParameterError(f"{where} = {short(value)} is not allowed, it must be {wanted}")


def nearest(name: str, known: Iterable[str], likeness: float = 0.5) -> str:
    """A question that suggests the nearest known name, or nothing where none is as like (0 to 1)."""
    names = {each.lower(): each for each in known}  # kN is nearer to kn than to ks
    near = [names[each] for each in difflib.get_close_matches(name.lower(), names, n=1, cutoff=likeness)]
    return f"; did you mean '{near[0]}'?" if near else ""
