"""The certificate of a run: the most that its errors may be, and what to do if they are more."""

from __future__ import annotations

from collections.abc import Iterable
from numbers import Real
from typing import Any

#: docs/theory.md, Measures
LIMITS = {
    "kinetic_ratio": (0.01, "the test was not quasi-static: load more slowly, with a lower rate or speed"),
    "platen_imbalance": (0.02, "waves ran through the specimen: load more slowly, with a lower rate or speed"),
    "energy_error": (0.005, "the time steps were too long: lower the time_step_factor"),
    "energy_made": (1e-4, "intact contacts made energy: the law may flutter, and the strength depend on the damping"),
}
FAIL = "FAIL"


def fails(name: str, value: Any) -> bool:
    """Whether a property of a run is a check of the certificate that has failed, or cannot be computed."""
    return name in LIMITS and isinstance(value, Real) and not value <= LIMITS[name][0]


def marked(name: str, values: Iterable[Any], text: str) -> str:
    """The text of a property in a table, with a word if it fails the certificate in one of the runs it is of."""
    return f"{text} {FAIL}" if any(fails(name, value) for value in values) else text
