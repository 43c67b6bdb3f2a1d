"""How a component shows itself: in one line where its value is printed, as a small table in a notebook.

A class of results says itself what is to be known first, as names and texts in a property ``_facts``; of all others it
is their parameters. One with a larger table for notebooks makes it in ``_html``.
"""

from __future__ import annotations

import enum
import functools
import types
from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from numbers import Real
from typing import Any

import attrs
import numpy as np

from grainlaw.messages import short
from grainlaw.unit_text import written

MOST = 300  #: letters of a component
MOST_OF_LAW = 600  #: letters of a law, which has many parameters
MOST_OF_VALUE = 100  #: letters of one of its values
LINES = 60  #: rows of a table
DIGITS = 4  #: of a number that people write


def in_one_line(component: Any) -> str:
    """``Linear(kn=105 TPa/m, ks=94.5 TPa/m)``: the class and the values that are not the defaults; never fails."""
    kind = type(component)
    try:
        if hasattr(kind, "_facts"):
            parts = [f"{name}: {text}" for name, text in component._facts.items()]
        elif attrs.has(kind):
            parts = [f"{field.name}={_text(value, field)}" for field, value in _own(component)]
        else:
            return object.__repr__(component)
    except Exception:  # one that is not complete, as in the message that refuses it
        return f"{kind.__name__}(...)"
    most = MOST_OF_LAW if getattr(kind, "takes_arrays", False) else MOST
    return _listed(f"{kind.__name__}(", parts, ")", most)


def as_table(component: Any) -> str:
    """What is to be known first, or all values of a component with their units, as HTML; never fails."""
    kind = type(component)
    try:
        if hasattr(kind, "_html"):
            return str(component._html())
        if hasattr(kind, "_facts"):
            return html_table(component._facts.items(), caption=kind.__name__)
        if attrs.has(kind):
            rows = [(field.name, _text(getattr(component, field.name), field)) for field in _shown(kind)]
            return html_table(rows, caption=kind.__name__)
    except Exception:  # as above
        pass
    return escape(repr(component))


def html_table(rows: Iterable[Sequence[str]], heads: Sequence[str] = (), caption: str = "") -> str:
    """A table as HTML, for a notebook; the first cell of each row is its heading."""
    lines = [f"<caption>{escape(caption)}</caption>"] if caption else []
    if heads:
        lines.append("<thead><tr>" + "".join(f"<th>{escape(head)}</th>" for head in heads) + "</tr></thead>")
    rows = list(rows)
    for first, *rest in rows[:LINES]:
        lines.append(f"<tr><th>{escape(first)}</th>" + "".join(f"<td>{escape(cell)}</td>" for cell in rest) + "</tr>")
    if len(rows) > LINES:
        lines.append(f"<tr><th>... and {len(rows) - LINES} more</th></tr>")
    return "<table>" + "".join(lines) + "</table>"


def to_digits(value: float, digits: int = DIGITS) -> float:
    """The nearest number of a few digits."""
    return float(f"{value:.{digits}g}")


def rounded(value: float, unit: str, digits: int = DIGITS) -> str:
    """A few digits with their unit."""
    return written(to_digits(value, digits), unit)


def between(values: np.ndarray, unit: str) -> str:
    """``1 mm to 5 mm``: the least and the largest of some values, once where they are the same."""
    low, high = (rounded(float(end), unit) for end in (np.nanmin(values), np.nanmax(values)))
    return low if low == high else f"{low} to {high}"


def _shown(kind: type) -> list[Any]:
    return [field for field in attrs.fields(kind) if field.init and field.repr]


def _own(component: Any) -> list[tuple[Any, Any]]:
    """Fields whose values differ from their defaults."""
    found = []
    for field in _shown(type(component)):
        value = getattr(component, field.name)
        default = field.default
        if isinstance(default, attrs.Factory):  # type: ignore[arg-type]
            default = default.factory(component) if default.takes_self else default.factory()
        if not _same(value, default):
            found.append((field, value))
    return found


def _same(value: Any, default: Any) -> bool:
    if isinstance(value, np.ndarray) or isinstance(default, np.ndarray):
        return np.array_equal(value, default)
    try:
        return bool(value == default)
    except Exception:
        return value is default


def _text(value: Any, field: Any) -> str:
    unit = field.metadata.get("unit", "")
    if isinstance(value, np.ndarray):
        return _array(value, unit)
    if isinstance(value, Real) and not isinstance(value, (bool, np.bool_)) and (unit or not isinstance(value, int)):
        return written(float(value), unit)
    return _other(value)


def _array(array: np.ndarray, unit: str) -> str:
    if unit and array.ndim == 1 and array.size:
        low, high = (rounded(end, unit) for end in (array.min(), array.max()))
        return f"{array.size} numbers from {low} to {high}"
    return f"array of {' x '.join(map(str, array.shape)) or 'one'}"


def _other(value: Any) -> str:
    if isinstance(value, enum.Enum):
        return f"{type(value).__name__}.{value.name}"
    if isinstance(value, np.ndarray):
        return _array(value, "")
    if isinstance(value, float):
        return written(value, "1")
    if isinstance(value, Mapping) and not attrs.has(type(value)):
        return _several("{", (f"{_other(key)}: {_other(entry)}" for key, entry in value.items()), "}", len(value))
    if type(value) in (list, tuple):
        return _several("(", map(_other, value), ")", len(value))
    if isinstance(value, (types.FunctionType, functools.partial)) or isinstance(value, type):
        return str(getattr(value, "__qualname__", "a function"))
    return short(value, MOST_OF_VALUE)


def _several(begin: str, parts: Iterable[str], end: str, count: int) -> str:
    few = [part for _, part in zip(range(6), parts, strict=False)]
    return _listed(begin, [*few, *([f"... {count} in all"] if count > 6 else [])], end, MOST_OF_VALUE)


def _listed(begin: str, parts: Sequence[str], end: str, most: int) -> str:
    """The parts between begin and end, as many as there is room for."""
    text = begin
    for k, part in enumerate(parts):
        more = part if k == 0 else f", {part}"
        last = k == len(parts) - 1
        if len(text) + len(more) + len(end) + (0 if last else 5) > most:
            return f"{text}{', ' if k else ''}...{end}"
        text += more
    return text + end


Shows = Callable[[Any], str]


def inherited(bases: tuple[type, ...], name: str, otherwise: Shows) -> Any:
    """What a class of these bases would have as ``name``, unless that is Python's own."""
    for base in bases:
        found = getattr(base, name, None)
        if found is not None and found is not getattr(object, name, None):
            return found
    return otherwise
