"""Messages that refuse a value: the kind of error, the value in few words, the nearest name that exists."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any

import numpy as np


class ParameterError(ValueError):
    """A value outside what its declaration allows; the message names component, parameter, value and bound."""


def short(value: Any) -> str:
    """A value for a message: one line, and never a page of an array."""
    kind = type(value).__name__
    if isinstance(value, np.ndarray) and value.size > 6:
        return f"an array of shape {value.shape}"
    try:
        text = " ".join(repr(value).split())
    except Exception:
        return f"a {kind}"
    if len(text) <= 100:
        return text
    return f"{text[:60]}..." if isinstance(value, (str, bytes, list, tuple, dict, int)) else f"a {kind}"


def refusal(where: str, value: Any, wanted: str) -> ParameterError:
    """What to raise for a value: ``refusal("Stage: until", value, "a list of conditions")``."""
    return ParameterError(f"{where} = {short(value)} is not allowed, it must be {wanted}")


def nearest(name: str, known: Iterable[str], likeness: float = 0.5) -> str:
    """A question that suggests the nearest known name, or nothing where none is as like (0 to 1)."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=likeness)
    return f"; did you mean '{near[0]}'?" if near else ""
