"""How quantities are shown: words, a usual unit, digits, and lines of a table."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from numbers import Real
from typing import Any

import attrs

from grainlaw.columns import AGED, AGED_LOSS, ENERGY, JUMPS

THREE = "three digits"  #: in place of a form of Python


@attrs.frozen
class Shown:
    """How a quantity is shown: a value in SI times ``factor`` is one in ``unit``."""

    words: str
    unit: str = ""
    factor: float = 1.0
    form: str = ".4g"

    @property
    def heading(self) -> str:
        return f"{self.words} ({self.unit})" if self.unit else self.words

    @property
    def brief(self) -> Shown:
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
        return three_digits(value * self.factor) if self.form == THREE else f"{value * self.factor:{self.form}}"


def three_digits(value: Any) -> str:
    """Three digits that count, and whole numbers of more digits in full."""
    return f"{value:.0f}" if 1000 <= abs(value) < 1e9 else f"{value:.3g}"


NAMED = {
    "strength": Shown("strength", "MPa", 1e-6, ".2f"),
    "largest_stress": Shown("largest stress", "MPa", 1e-6, ".2f"),
    "failure_strain": Shown("strain at failure", "%", 1e2, ".4f"),
    "apparent_modulus": Shown("E*", "GPa", 1e-9, ".2f"),
    "apparent_poisson": Shown("nu*", "", 1, ".3f"),
    "modulus": Shown("E", "GPa", 1e-9, ".2f"),
    "poisson": Shown("nu", "", 1, ".3f"),
    "tensile_cracks": Shown("tensile cracks", "", 1, ".0f"),
    "shear_cracks": Shown("shear cracks", "", 1, ".0f"),
    "kinetic_ratio": Shown("kinetic ratio", "", 1, ".1e"),
    "imbalance": Shown("imbalance", "%", 1e2, ".2f"),
    "unstable_rise": Shown("rise while unstable", "%", 1e2, ".2f"),
    "energy_error": Shown("energy error", "", 1, ".1e"),
    "energy_made": Shown("energy made", "", 1, ".1e"),
    "energy_returned": Shown("energy returned", "", 1, ".1e"),
    "steps": Shown("steps", "", 1, ".0f"),
    "seconds": Shown("seconds", "", 1, ".1f"),
    "time_step": Shown("time step", "s", 1, ".3e"),
    "without_static_solution": Shown("static stages brought under their loads in motion", "", 1, ".0f"),
    "mass_added": Shown("mass added", "%", 1e2, ".3g"),
    AGED: Shown("time passed in jumps", "s"),
    JUMPS: Shown("jumps", "", 1, ".0f"),
    AGED_LOSS: Shown("energy lost in jumps", "J/m"),
    "work_of_fracture": Shown("work of fracture", "J/m2"),
    "normal": Shown("normal traction", "MPa", 1e-6),
    "shear": Shown("shear traction", "MPa", 1e-6),
}
#: for names that are not listed above: by the first of these words that is in the name
USUAL = {
    r"stress|strength|pressure|confinement|deviator": ("MPa", 1e-6, ".2f"),
    r"modulus|moduli": ("GPa", 1e-9, ".2f"),
    r"strain": ("%", 1e2, ".4f"),
    r"slip|opening|displacement|dilation|deflection|closure": ("µm", 1e6, ".4g"),
    r"toughness": ("MPa √m", 1e-6, ".3f"),
    r"angle": ("deg", 1.0, ".1f"),
    r"load|force": ("kN/m", 1e-3, ".4g"),
    r"time": ("s", 1.0, ".4g"),
    r"velocity": ("m/s", 1.0, ".4g"),
}


def shown(name: str) -> Shown:
    """How a quantity in a summary or in curves is shown, by its name; in plain SI if the name says nothing."""
    if name in NAMED:
        return NAMED[name]
    words = name.replace("_", " ")
    if name.startswith(ENERGY):
        return Shown(words, "J/m")  # of thickness
    for pattern, usual in USUAL.items():
        if re.search(rf"(^|_)({pattern})(_|$)", name):
            return Shown(words, *usual)
    return Shown(words)


def aligned(rows: Iterable[Sequence[str]], *, rule: bool = False) -> str:
    """A table of texts, its first column aligned left, the others right; with a ``rule`` below the first row."""
    rows = list(rows)
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = [
        "  ".join([row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))])
        for row in rows
    ]
    if rule:
        lines.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(lines)
