"""The measures of every laboratory report; ``docs/measures.md`` has the definitions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

import attrs
import numpy as np

from grainlaw.columns import DAMAGED, LATERAL_STRAIN, STRESS, TIME
from grainlaw.moduli import converted
from grainlaw.results.measure import Measure
from grainlaw.results.thresholds import (
    Path,
    Sought,
    crack_closure,
    crack_damage,
    initiation_by_crack_volume,
    initiation_by_lateral_strain,
    secant_constants,
    stress_at_share,
    tangent_constants,
)

if TYPE_CHECKING:
    from grainlaw.results.laboratory import Laboratory


@attrs.frozen
class Standard(Measure):
    """A measure that is found by a function of the laboratory."""

    name: str
    meaning: str
    find_in: Callable[[Laboratory], float]
    unit: str = "1"
    source: str = ""
    needs: Sequence[str] = ()
    why_in: Callable[[Laboratory], str] = lambda _: ""
    of_curves: bool = False
    of_frames: bool = False
    resolution_in: Callable[[Laboratory], float] = lambda _: 0.0

    @property
    def is_main(self) -> bool:
        """A few of the many."""
        return self.name == "crack_damage"

    def find(self, laboratory: Laboratory) -> float:
        return self.find_in(laboratory)

    def why(self, laboratory: Laboratory) -> str:
        return self.why_in(laboratory)

    def resolution(self, laboratory: Laboratory) -> float:
        return self.resolution_in(laboratory)


ISRM = "ISRM (1979, 1999)"
POTYONDY = "Potyondy and Cundall (2004)"
NICKSIAR = "Nicksiar and Martin (2012)"
MARTIN = "Martin and Chandler (1994)"
PENG = "after Peng and others (2015)"
GUTENBERG = "Gutenberg and Richter (1956)"
AKI = "Aki (1965)"
MARDIA = "Mardia and Jupp (2000)"

STRAINS = (STRESS, LATERAL_STRAIN)  #: and the axial strain, see :class:`Path`

Constants = Callable[[Path], tuple[float, float]]


def elastic_constants(name: str, constants: Constants, where: str) -> list[Standard]:
    """Modulus and Poisson's ratio: apparent, those of the plane problem with a star, and those of the rock."""

    def apparent(laboratory: Laboratory) -> tuple[float, float]:
        return constants(laboratory.path)

    def of_rock(laboratory: Laboratory) -> tuple[float, float]:
        return converted(*constants(laboratory.path), laboratory.result.specimen)

    return [*modulus_and_poisson(f"apparent_{name}", f"*{where}", apparent), *modulus_and_poisson(name, where, of_rock)]


def modulus_and_poisson(name: str, where: str, both: Callable[[Laboratory], tuple[float, float]]) -> list[Standard]:
    return [
        Standard(f"{name}_modulus", f"E{where}", lambda lab: both(lab)[0], "GPa", ISRM, STRAINS, of_curves=True),
        Standard(f"{name}_poisson", f"nu{where}", lambda lab: both(lab)[1], source=ISRM, needs=STRAINS, of_curves=True),
    ]


def by_strains(name: str, meaning: str, seek: Callable[[Path], Sought], source: str) -> Standard:
    """A threshold in the strains, which says why there is none."""
    return Standard(
        name, meaning, lambda lab: seek(lab.path).value, "MPa", source, STRAINS, lambda lab: seek(lab.path).why,
        of_curves=True, resolution_in=lambda lab: lab.path.spacing(lab.value(name)),
    )  # fmt: skip


def no_crack(laboratory: Laboratory) -> str:
    return "" if len(laboratory.result.cracks) else "nothing has broken"


def thresholds() -> list[Standard]:
    """Axial stresses at which damage begins, open cracks have closed, cracks begin, and cracks become unstable."""
    return [
        Standard(
            "damage_onset", "onset of damage, 1 % of the damaged points at the peak",
            stress_at_damage, "MPa", needs=[STRESS],
        ),
        by_strains("crack_closure", "CC, axial strain response", crack_closure, PENG),
        Standard(
            "crack_initiation_count", "CI, 1 % of the cracks at the peak",
            stress_at_cracks, "MPa", POTYONDY, [STRESS], no_crack,
            resolution_in=lambda lab: lab.path.spacing(lab.value("crack_initiation_count")),
        ),
        by_strains("crack_initiation_lateral", "CI, lateral strain response", initiation_by_lateral_strain, NICKSIAR),
        by_strains("crack_initiation_volumetric", "CI, crack-volumetric strain", initiation_by_crack_volume, MARTIN),
        by_strains("crack_damage", "CD, reversal of the volumetric strain", crack_damage, MARTIN),
        by_strains(
            "crack_damage_cylinder", "CD, reversal of axial and twice the lateral strain",
            partial(crack_damage, laterals=2), MARTIN,
        ),
    ]  # fmt: skip


def ratios() -> list[Standard]:
    """The thresholds over the strength: CI/UCS and CD/UCS where nothing confines the specimen."""

    def over_peak(name: str) -> Callable[[Laboratory], float]:
        return lambda lab: math.nan if has_not_failed(lab) else lab.value(name) / peak_of(lab)

    def why(measure: Standard) -> Callable[[Laboratory], str]:
        return lambda lab: measure.why(lab) or has_not_failed(lab)

    def finest(measure: Standard) -> Callable[[Laboratory], float]:
        return lambda lab: measure.resolution(lab) / peak_of(lab)

    found = []
    for measure in thresholds()[1:]:
        short, _, rest = measure.meaning.partition(", ")
        name, meaning = f"{measure.name}_ratio", f"{short}/UCS, {rest}"
        made = attrs.evolve(measure, name=name, meaning=meaning, find_in=over_peak(measure.name), unit="1")
        found.append(attrs.evolve(made, why_in=why(measure), resolution_in=finest(measure)))
    return found


def peak_of(laboratory: Laboratory) -> float:
    """Pa, the axial stress at the peak, of which thresholds are shares."""
    path = laboratory.path
    return float(path.load[-1] + path.confinement) if len(path.load) else float("nan")


def has_not_failed(laboratory: Laboratory) -> str:
    """In words, that the strength is not known; empty where it is, or where a test has none."""
    is_open = math.isnan(laboratory.result.summary.get("strength", 0.0))
    return "the specimen has not failed: its strength is not known" if is_open else ""


def stress_at_damage(laboratory: Laboratory, share: float = 0.01) -> float:
    """Pa, when a share of the points damaged at the peak were damaged."""
    curves = laboratory.result.of_test().curves
    if DAMAGED not in curves:
        return math.nan
    return stress_at_share(curves, curves[TIME], curves[DAMAGED], share)


def stress_at_cracks(laboratory: Laboratory, share: float = 0.01) -> float:
    """Pa, when a share of the points broken at the peak had broken."""
    whole, curves = laboratory.result.curves, laboratory.result.of_test().curves
    cracks = np.searchsorted(laboratory.result.cracks.time, whole[TIME], side="right")
    before = cracks[: len(whole[TIME]) - len(curves[TIME])]
    return stress_at_share(curves, curves[TIME], cracks[len(before) :] - before.max(initial=0), share)


def length_of(laboratory: Laboratory, *, tensile: bool) -> float:
    """m of cracks of one mode."""
    cracks = laboratory.result.cracks
    return float(cracks.length[cracks.tensile == tensile].sum())


def energy_lost() -> list[Standard]:
    """Energies lost by contacts up to the last frame: in opening, in slip, and by kind of crack."""

    def lost(name: str, by: str, rows: Callable[[Laboratory], np.ndarray]) -> Standard:
        return Standard(
            name, f"energy lost by {by}", lambda lab: lab.beyond_rounding(float(rows(lab).sum())), "J/m", of_frames=True
        )

    def both(laboratory: Laboratory) -> np.ndarray:
        opening, slip = laboratory.energy_lost
        return opening + slip

    return [
        lost("lost_opening", "contacts in opening", lambda lab: lab.energy_lost[0]),
        lost("lost_slip", "contacts in slip", lambda lab: lab.energy_lost[1]),
        lost("lost_tensile_cracks", "tensile cracks", lambda lab: both(lab)[lab.broken & lab.tensile]),
        lost("lost_shear_cracks", "shear cracks", lambda lab: both(lab)[lab.broken & ~lab.tensile]),
        lost("lost_unbroken", "contacts that have not broken", lambda lab: both(lab)[~lab.broken]),
    ]


def largest_magnitude(laboratory: Laboratory) -> float:
    """Of all acoustic events; nan where none has energy."""
    events = laboratory.events
    return float(np.nanmax(events.magnitude)) if (events.energy > 0).any() else float("nan")


def largest_fragment(laboratory: Laboratory) -> float:
    """Area of the largest fragment over the area of all."""
    areas = laboratory.fragments.areas
    return float(areas[0] / areas.sum())


MEASURES: dict[str, Measure] = {
    measure.name: measure
    for measure in [
        *elastic_constants("tangent", tangent_constants, "_t50, tangent at 50 % of the peak"),
        *elastic_constants("secant", secant_constants, "_s50, secant up to 50 % of the peak"),
        *thresholds(),
        *ratios(),
        Standard("tensile_length", "length of tensile cracks", lambda lab: length_of(lab, tensile=True), "mm"),
        Standard("shear_length", "length of shear cracks", lambda lab: length_of(lab, tensile=False), "mm"),
        *energy_lost(),
        Standard("fragments", "fragments", lambda lab: len(lab.fragments), of_frames=True),
        Standard("largest_fragment", "largest fragment, share of the area", largest_fragment, "%", of_frames=True),
        Standard("acoustic_events", "acoustic events", lambda lab: len(lab.events)),
        Standard("largest_magnitude", "largest magnitude, 1 m thick", largest_magnitude, source=GUTENBERG),
        Standard(
            "b_value", "b-value", lambda lab: lab.events.b_value()[0], source=AKI,
            resolution_in=lambda lab: lab.value("b_error"),
        ),
        Standard("b_error", "standard error of the b-value", lambda lab: lab.events.b_value()[1], source=AKI),
        Standard(
            "failure_plane_angle", "failure plane to the x axis, whichever way it leans",
            lambda lab: min(lab.plane.angle, math.pi - lab.plane.angle), "deg", MARDIA,
        ),
        Standard(
            "failure_plane_strength", "alignment of the failure plane", lambda lab: lab.plane.strength, source=MARDIA
        ),
    ]
}  # fmt: skip
