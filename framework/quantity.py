"""The quantity: how a number is shown, by words, unit and digits; and lines of a table."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from numbers import Real
from typing import Any

import attrs

from grainlaw.arguments import Checked
from grainlaw.messages import refusal, spelled
from grainlaw.unit_text import factor_into

THREE = "three digits"  #: in place of a form of Python


def _is_form(quantity: Quantity, attribute: Any, value: Any) -> None:
    try:
        is_one = isinstance(value, str) and (value == THREE or bool(format(1.5, value)))
    except ValueError:
        is_one = False
    if not is_one:
        raise refusal("Quantity: form", value, "how Python formats a number, as '.4g'")


@attrs.frozen(repr=False)
class Quantity(metaclass=Checked):
    """A number by its name: in which words, unit and digits it is shown, and whether it is shown unasked.

    Who records a number declares it: a test in :attr:`LoadingProtocol.quantities`, a measure by itself; those that
    several tests have are in ``grainlaw.columns``. Values are in SI; ``gl.Quantity("force", "kN/m")`` shows them in
    kN/m. A number that nobody has declared is shown as it is.

    Raises :class:`ParameterError` for a unit that is none of mechanics, unless its ``factor`` is given.
    """

    name: str  #: of a column, of an entry of a summary, of an array
    unit: str = "1"  #: in which it is shown
    words: str = attrs.field(kw_only=True)  #: in place of the name; the name with blanks, if not given
    form: str = attrs.field(kw_only=True, default=".4g", validator=_is_form)  #: its digits, as Python formats them
    meaning: str = attrs.field(kw_only=True, default="")  #: what it is, for a report
    is_main: bool = attrs.field(kw_only=True, default=False)  #: whether tables show it unasked
    #: whether a test counts it from its own beginning, where stages before it only prepare the specimen
    counts: bool = attrs.field(kw_only=True, default=False)
    #: a value in SI times this is the value in ``unit``; by the unit, if not given
    factor: float = attrs.field(kw_only=True)

    @words.default
    def _name_with_blanks(self) -> str:
        return spelled(self.name)

    @factor.default
    def _by_unit(self) -> float:
        return factor_into(self.unit, f"Quantity {self.name}: unit")

    @property
    def unit_shown(self) -> str:
        """The unit, empty where there is none."""
        return "" if self.unit == "1" else self.unit

    @property
    def heading(self) -> str:
        """Words and unit, as over a column or at an axis."""
        return f"{self.words} ({self.unit})" if self.unit_shown else self.words

    @property
    def brief(self) -> Quantity:
        """The same with three digits, as in reports."""
        return attrs.evolve(self, form=THREE)

    def text(self, value: Any) -> str:
        """A value in SI, or several, as digits in the unit shown; a dash for what does not exist."""
        if isinstance(value, (list, tuple)):
            return ", ".join(map(self.text, value)) or "-"
        if value is None or (isinstance(value, Real) and math.isnan(value)):
            return "-"
        if not isinstance(value, Real):
            return str(value)
        return three_digits(value * self.factor) if self.form == THREE else f"{value * self.factor:z{self.form}}"

    def with_unit(self, value: Any) -> str:
        """A value in SI as text, with its unit."""
        return f"{self.text(value)} {self.unit_shown}".rstrip()


def three_digits(value: Any) -> str:
    """Three digits that count, and whole numbers of more digits in full."""
    return f"{value:.0f}" if 1000 <= abs(value) < 1e9 else f"{value:.3g}"


def digits_that_count(value: float, resolution: float = 0.0) -> str:
    """At most three digits, and none below the first one of the ``resolution``, by which the value may be wrong.

    Zeros that count are written: ``80.0`` where a half is known. 0 where the resolution is not known.
    """
    if not value or not math.isfinite(value) or not resolution > 0:
        return three_digits(value)
    finest = -math.floor(math.log10(resolution))
    places = min(finest, max(0, 2 - math.floor(math.log10(abs(value)))))
    return f"{round(value, places):.{max(places, 0)}f}"


def aligned(rows: Iterable[Sequence[str]], *, rule: bool = False) -> str:
    """A table of texts, its first column aligned left, the others right; with a ``rule`` below the first row."""
    rows = list(rows)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))]).rstrip()
        for row in rows
    ]
    if rule:
        lines.insert(1, "  ".join("-" * width for width in widths).rstrip())
    return "\n".join(lines)
