"""The certificate of a run: the most that its errors may be, what to do if they are more, and what is no strength."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any

from grainlaw.columns import (
    DAMAGED,
    ENERGY,
    IN_MOTION,
    LOST,
    SHEAR_CRACKS,
    STAGE,
    TENSILE_CRACKS,
    WET,
    quantity_of,
    work_done,
)
from grainlaw.contact import ContactLaw, memory_names
from grainlaw.engine.ledger import ROUNDING
from grainlaw.quantity import Quantity
from grainlaw.results.thresholds import strains_disagree

if TYPE_CHECKING:
    from grainlaw.results.result import Result

SLOWER = "load more slowly: loading=gl.Adaptive(rate=0.0005), or --set test.loading.rate=0.0005"
SHORTER = "time_step_factor={0}, or --set numerics.time_step_factor={0}"
#: docs/theory.md, Measures
LIMITS = {
    "kinetic_ratio": (0.01, f"the test was not quasi-static; {SLOWER}"),
    "imbalance": (0.01, f"the load was not in balance; {SLOWER}"),
    "unstable_rise": (0.03, f"the load rose above what the specimen can bear, which was unstable; {SLOWER}"),
    # Ravichandran and Subhash 1994, doi:10.1111/j.1151-2916.1994.tb06987.x
    "end_difference": (
        0.05,
        "the forces on both ends were not in balance at failure: let the wave rise more slowly, or take a shorter "
        "specimen, as by --set sample.height=0.02",
    ),
    "energy_error": (0.005, f"the time steps were too long: {SHORTER.format(0.5)}"),
    "energy_made": (1e-4, "intact contacts made energy: the law may flutter, and the strength depend on the damping"),
    "energy_returned": (5e-3, f"contacts that open and close within a step made energy: {SHORTER.format(0.3)}"),
}
COST = ("steps", "time_step", "seconds", "mass_added")  #: of a run; like its errors no property of the rock
FAIL = "FAIL"
#: properties that are read at the first failure, and the largest of the same quantity, which there may be later
STRENGTHS = {
    "strength": "largest_stress", "failure_force": "largest_force", "breakdown_pressure": "largest_pressure",
}  # fmt: skip
DAMPED = 0.01  #: of the work of the loads: as much may damping make
HIGHER = 0.01  #: of the strength: a largest stress that is said to be above it


def fails(name: str, value: Any) -> bool:
    """Whether a property of a run is a check of the certificate that has failed, or cannot be computed."""
    return name in LIMITS and isinstance(value, Real) and not value <= LIMITS[name][0]


def has_failed(result: Result) -> bool:
    """Whether the specimen has failed; also where a test has no strength."""
    return not any(map(math.isnan, _numbers(result, STRENGTHS).values()))


def _numbers(result: Result, names: Iterable[str]) -> dict[str, float]:
    """The properties of these names that are numbers."""
    found: dict[str, Any] = {name: result.summary.get(name) for name in names}
    return {name: float(value) for name, value in found.items() if isinstance(value, Real)}


def stopped_before(result: Result) -> Sequence[str]:
    """Names of the stage in which the run ended and of the next one, which it has not come to; else none."""
    stage = result.curves.get(STAGE, ())
    names = result.stages[int(stage[-1]) :][:2] if len(stage) else ()
    return names if len(names) == 2 else ()


def can_fail(result: Result) -> bool:
    """Whether a contact was damaged, or could have been: a law that counts no damage does not break."""
    damaged = result.curves.get(DAMAGED, ())
    laws = result.law.values() if isinstance(result.law, Mapping) else (result.law,)
    counts = any(isinstance(law, ContactLaw) and "damage" in memory_names(law) for law in laws)
    return counts or bool(len(damaged) and damaged[-1] > 0)


def _broken_at_first(result: Result) -> int:
    """Contact points that had broken when the first stage ended."""
    first = [k for k, stage in enumerate(result.curves.get(STAGE, ())) if stage == 0]
    counts = (result.curves.get(name, ()) for name in (TENSILE_CRACKS, SHEAR_CRACKS))
    return int(sum(count[first[-1]] for count in counts if first and len(count)))


def _made_by_damping(result: Result) -> float:
    """Energy that damping has made in the end, over the largest work of the loads, or a strain that is rounding."""
    if not len(lost := result.curves.get(ENERGY + LOST, ())):
        return 0.0
    specimen = result.specimen
    rounding = ROUNDING**2 * float(specimen.grain_stiffness[:, 0, 0] @ specimen.grains.areas)
    work = max(work_done(result.curves), rounding)
    return max(-float(lost[-1]), 0.0) / work if work > 0 else 0.0


def is_whole(result: Result) -> bool:
    """Whether nothing was damaged of what could have been."""
    damaged = result.curves.get(DAMAGED, ())
    return bool(len(damaged)) and not damaged[-1] > 0 and can_fail(result)


def doubts(result: Result) -> Iterator[str]:
    """In words, each check of the certificate that has failed, or cannot be computed; and what is no strength."""
    summary, numbers = result.summary, _numbers(result, (*STRENGTHS, *STRENGTHS.values()))
    ends = () if any(math.isfinite(numbers.get(name, math.nan)) for name in STRENGTHS) else stopped_before(result)
    if ends:
        yield "the test ended in its stage '{}', before its stage '{}'".format(*ends)
    elif not has_failed(result) and can_fail(result):
        yield "the specimen had not failed when the test ended"
    for name, largest in STRENGTHS.items():
        if numbers.get(largest, -math.inf) > (1 + HIGHER) * numbers.get(name, math.nan):
            words = result.quantity(largest).words
            yield (
                f"after its first failure the specimen bore more than its strength, its {words} is that of what was "
                "left of it"
            )
    for measure, (_, cure) in LIMITS.items():
        value: Any = summary.get(measure)
        if not fails(measure, value) or (ends and math.isnan(value)):  # of a stage that was not reached
            continue
        if math.isnan(value):
            yield f"the {quantity_of(measure).words} cannot be computed, so the test has failed its certificate"
        else:
            yield f"the {quantity_of(measure).words} is above its limit; {cure}"
    if strains_disagree(result.of_test().curves):
        yield (
            "the axial strain by volumetric_strain and lateral_strain is not the column strain: one of the three is "
            "wrong, and moduli with it"
        )
    if summary.get(IN_MOTION) and (broken := _broken_at_first(result)):
        yield (
            f"{broken} contact points broke in the stage '{result.stages[0]}', whose loads came on in motion as they "
            "have no static solution: give them a longer ramp, and see whether as many break"
        )
    if (made := _made_by_damping(result)) > DAMPED:
        yield (
            f"the damping made {made:.0%} of the energy: what a steady force moves freely, such as a body that falls, "
            "gets too fast by it; take CentralDifference(damping=Undamped())"
        )
    if summary.get(WET) == 0:
        yield "the fluid has reached no contact point"
    asked = getattr(getattr(result.protocol, "loading", None), "imbalance", math.inf)
    if asked < summary.get("imbalance", 0.0) <= LIMITS["imbalance"][0]:
        yield f"the imbalance of {asked:g} that was asked for was not had before the failure; {SLOWER}"


def warnings_of(results: Mapping[str, Result]) -> Iterator[str]:
    """The doubts about several runs, a line each."""
    for name, result in results.items():
        for words in doubts(result):
            yield f"{name}: {words}."


def text_of(name: str, look: Quantity, result: Result) -> str:
    """A property as text; ``> 602.32`` for the strength of a specimen that had not failed: it bears more than that."""
    return f"> {look.text(least_of(name, result))}" if is_open(name, result) else look.text(result.summary.get(name))


def is_open(name: str, result: Result) -> bool:
    """Whether a strength is not known because the specimen, which could have, had not failed."""
    value = result.summary.get(name)
    return name in STRENGTHS and isinstance(value, Real) and math.isnan(value) and can_fail(result)


def least_of(name: str, result: Result) -> Any:
    """A property; of a strength that is not known the largest stress, which it is above."""
    return result.summary.get(STRENGTHS[name] if is_open(name, result) else name)


def marked(name: str, results: Collection[Result], text: str) -> str:
    """A text of a property, with a word if it fails the certificate in one of the runs that it is of."""
    failed = any(fails(name, result.summary.get(name)) for result in results)
    return f"{text}{f' {FAIL}' if failed else ''}"


def texts(result: Result, names: Iterable[str]) -> dict[str, str]:
    """Properties of a run as tables show them, by their headings; those that it has."""
    return {
        (look := result.quantity(name)).heading: marked(name, [result], text_of(name, look, result))
        for name in names
        if name in result.summary
    }
