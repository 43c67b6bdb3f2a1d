"""The certificate of a run: the most that its errors may be, what to do if they are more, and whether it has a peak."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from grainlaw.columns import STRESS
from grainlaw.naming import shown

if TYPE_CHECKING:
    from grainlaw.results.result import Result

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


def has_peak(result: Result) -> bool:
    """Whether the stress fell after its peak; also where a test has none."""
    stress = result.curves.get(STRESS, np.zeros(0))
    return "peak_stress" not in result.summary or not len(stress) or int(np.argmax(stress)) < len(stress) - 1


def doubts(result: Result) -> Iterator[str]:
    """In words, each check of the certificate that has failed, or cannot be computed; and a test that was cut short."""
    if not has_peak(result):
        yield "the highest stress is the last one; the specimen had not failed when the test ended"
    for measure, (_, cure) in LIMITS.items():
        value: Any = result.summary.get(measure)
        if not fails(measure, value):
            continue
        if math.isnan(value):
            yield f"the {shown(measure).words} cannot be computed, so the test has failed its certificate"
        else:
            yield f"the {shown(measure).words} is above its limit; {cure}"


def warnings_of(results: Mapping[str, Result]) -> Iterator[str]:
    """The doubts about several runs, a line each."""
    for name, result in results.items():
        for words in doubts(result):
            yield f"{name}: {words}."


def reached(name: str, results: Iterable[Result], text: str) -> str:
    """The text of a property; ``> 602.32`` for the peak of a specimen that had not failed: it bears more than that."""
    is_open = name in ("peak_stress", "peak_strain") and not all(map(has_peak, results))
    return f"> {text}" if is_open else text


def marked(name: str, results: Collection[Result], text: str) -> str:
    """The same with a word if the property fails the certificate in one of the runs that it is of."""
    failed = any(fails(name, result.summary.get(name)) for result in results)
    return f"{reached(name, results, text)}{f' {FAIL}' if failed else ''}"


def texts(result: Result, names: Iterable[str]) -> dict[str, str]:
    """Properties of a run as tables show them, by their headings; those that it has."""
    there = [(name, shown(name), result.summary[name]) for name in names if name in result.summary]
    return {look.heading: reached(name, [result], look.text(value)) for name, look, value in there}
