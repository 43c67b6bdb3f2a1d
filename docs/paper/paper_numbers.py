"""The numbers of the paper, of its equations by hand, and of this program's runs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np
from joint import Joint, Row, softening
from paper_calibration import verdict_of
from paper_runs import BREAKING, CONFINEMENTS, CONSISTENT, LOCAL, PRINTED, RULES, SEEDS

from grainlaw.laws import BandisClosure, CohesiveCrack, TensionShear
from grainlaw.messages import spelled
from grainlaw.runs.elastic_properties import ElasticProperties
from grainlaw.runs.flutter import Flutter
from grainlaw.studies.envelope import MohrCoulombFit, fit_mohr_coulomb
from grainlaw.studies.table import Table
from grainlaw.units import GPa, MPa, um
from grainlaw.workbench.driver import trace

#: what the paper reports of its sample: cohesion (Pa), friction angle (deg), and the line that they stand for
PAPER = {"cohesion": 18.35 * MPa, "friction_angle": 57.68, "slope": 11.909, "ucs": 126.65 * MPa}
TOGETHER = (2 * um, 5 * um, 10 * um, 20 * um)  #: opening and slip, both
CLOSURES = (1 * um, 5 * um, 10 * um)  #: largest ones
PRESSED = 127 * MPa


@attrs.frozen(eq=False)
class Paper:
    """All that the page shows."""

    joint: Joint
    table: Table  #: of the compressions
    elastic: ElasticProperties  #: of the first specimen, from statics
    held: Mapping[str, Flutter]  #: specimens without damping, by law
    calibrated: Mapping[str, Any]  #: what calibrations of laws have found, see paper_calibration.py

    def compressed(self, law: str, confinement: float = 0.0) -> Table:
        """Compressions with local damping."""
        return self.table.where(law=law, confinement=confinement, damping=LOCAL)

    def lines(self, law: str) -> list[MohrCoulombFit]:
        """The line through the peaks of each seed that was tested under all confinements."""
        found = [self.peaks(law, seed) for seed in SEEDS]
        return [fit_mohr_coulomb(*points.T) for points in found if len(points) == len(CONFINEMENTS)]

    def peaks(self, law: str, seed: int) -> np.ndarray:
        """(k, 2) confinement and peak stress (Pa)."""
        rows = self.table.where(law=law, damping=LOCAL, seed=seed).rows
        known = [(row["confinement"], row["strength"]) for row in rows if row.get("strength") is not None]
        return np.array(known, dtype=float).reshape(-1, 2)

    def by_damping(self, law: str) -> dict[str, float]:
        """Strength (Pa) of the first specimen by the damping."""
        rows = self.table.where(law=law, confinement=0.0, seed=SEEDS[0]).rows
        return {row["damping"]: float(row["strength"]) for row in rows if row.get("strength") is not None}


# --- one contact -----------------------------------------------------------------------------------------------------


def contact_rows() -> list[Row]:
    """Eqs. (11) and (12): both modes at once, and closure; beside what follows from the equations by hand."""
    printed = RULES[PRINTED]
    assert isinstance(printed, CohesiveCrack)
    law = attrs.evolve(printed, tension_shear=TensionShear.CONSTANT)
    unknown = math.nan
    rows: list[Row] = []
    for place in TOGETHER:
        path = np.linspace(0, place, 400)
        answer = trace(law, path, path)
        damage = math.hypot(*(max(share, 0.0) for share in _shares(law, place)))
        rows += [
            (f"tension at {place / um:g} um of both (MPa)", unknown, softening(damage) * law.tensile_strength / MPa,
             float(answer.normal[-1]) / MPa),
            ("  shear (MPa)", unknown, softening(damage) * law.cohesion / MPa, float(answer.shear[-1]) / MPa),
        ]  # fmt: skip
    for most in CLOSURES:
        closing = PRESSED / (law.kn + PRESSED / most)  # Eq. (12), solved for the closure
        pressed = attrs.evolve(law, closure=BandisClosure(maximum_closure=most))
        answer = trace(pressed, np.linspace(0, -closing, 50), 0.0)
        words = f"pressure at {closing / um:.4f} um, V_m = {most / um:g} um (MPa)"
        rows.append((words, unknown, PRESSED / MPa, -float(answer.normal[-1]) / MPa))
    return rows


def _shares(law: CohesiveCrack, place: float) -> tuple[float, float]:
    """Damage of each mode at an opening and a slip without pressure, Eqs. (3, 4, 6, 8) with L = 3."""
    tension, shear = law.tensile_strength, law.cohesion
    return (
        (place - math.e * tension / law.kn) / (3 * law.mode_i_energy / tension),
        (place - math.e * shear / law.ks) / (3 * law.mode_ii_energy / shear),
    )


def cycle_work(law: Any) -> float:
    """J/m2 that a contact gives in a cycle: slip 0.8 um, press to 100 MPa, slip back, release."""
    closed, slipped, share = -100 * MPa / law.kn, 0.8 * um, np.linspace(0, 1, 500)
    opening = np.concatenate([0 * share, closed * share, closed + 0 * share, closed * share[::-1]])
    slip = np.concatenate([slipped * share, slipped + 0 * share, slipped * share[::-1], 0 * share])
    return -float(trace(law, opening, slip).work[-1])


# --- the sample ------------------------------------------------------------------------------------------------------


def macroscopic(paper: Paper) -> list[list[str]]:
    """Properties of the sample: paper, statics, as printed, consistent, Mohr-Coulomb; headings first."""
    lines = {law: paper.lines(law) for law in BREAKING}
    rows = [["", "paper", "statics", *BREAKING]]

    def add(words: str, known: float, static: float, of: Any, factor: float, form: str) -> None:
        said = [f"{value / factor:{form}}" if math.isfinite(value) else "-" for value in (known, static)]
        rows.append([words, *said, *(of(law) for law in BREAKING)])

    def range_of(name: str, factor: float, form: str) -> Any:
        return lambda law: _range(paper.compressed(law)[name] / factor, form)

    def fitted(name: str, factor: float, form: str) -> Any:
        return lambda law: _range(np.array([getattr(line, name) / factor for line in lines[law]]), form)

    unknown, e = math.nan, paper.elastic
    add("E* (GPa)", unknown, e.apparent_modulus, range_of("apparent_modulus", GPa, ".2f"), GPa, ".2f")
    add("nu*", unknown, e.apparent_poisson, range_of("apparent_poisson", 1, ".3f"), 1, ".3f")
    add("UCS (MPa)", unknown, unknown, range_of("strength", MPa, ".1f"), MPa, ".1f")
    add("UCS by the line (MPa)", PAPER["ucs"], unknown, fitted("ucs", MPa, ".1f"), MPa, ".2f")
    add("slope of the line", PAPER["slope"], unknown, fitted("slope", 1, ".2f"), 1, ".2f")
    add("cohesion (MPa)", PAPER["cohesion"], unknown, fitted("cohesion", MPa, ".1f"), MPa, ".2f")
    add("friction angle (deg)", PAPER["friction_angle"], unknown, fitted("friction_angle", 1, ".1f"), 1, ".2f")
    return rows


def _range(values: np.ndarray, form: str) -> str:
    """Mean of several samples, and their range."""
    known = values[np.isfinite(values)]
    if not len(known):
        return "-"
    span = f" ({known.min():{form}} to {known.max():{form}})" if len(known) > 1 else ""
    return f"{known.mean():{form}}{span}"


def _line(lines: Sequence[MohrCoulombFit]) -> str:
    ucs, slope = (np.array([getattr(line, name) for line in lines]) for name in ("ucs", "slope"))
    return f"{_range(ucs / MPa, '.0f')} MPa and a slope of {_range(slope, '.1f')}"


def statement(paper: Paper) -> list[str]:
    """What agrees, what does not, and why, with the numbers of these runs."""
    printed, consistent = (paper.lines(law) for law in (PRINTED, CONSISTENT))
    found = [
        f"One contact and one joint agree with the paper's equations: the largest deviation from theory in Figs. 5 and "
        f"6 is {100 * paper.joint.worst:.2f} %. With L = 3 the softening branch dissipates 1.159 times the fracture "
        "energy that it is given; with L = 2.589 exactly that."
    ]
    if printed and consistent:
        found.append(
            f"The sample does not agree. With Table 1 and local damping of 0.8 the line of the printed model has "
            f"{_line(printed)}, and that of the consistent reading {_line(consistent)}; the paper's has "
            f"{PAPER['ucs'] / MPa:.2f} MPa and a slope of {PAPER['slope']:.2f}."
        )
    peaks = paper.by_damping(PRINTED)
    if len(peaks) > 1:
        low = min(peaks, key=peaks.__getitem__)
        found.append(
            f"As printed, the same sample carries {peaks[LOCAL] / MPa:.0f} MPa with local damping and "
            f"{peaks[low] / MPa:.0f} MPa with {low}: its contacts make energy, and the damping decides how much of it "
            "is left. The paper states neither its damping nor its loading speed, so its strength cannot be "
            "reproduced from what it prints."
        )
    for law, answer in paper.calibrated.items():
        checks = [each for each in answer.get("checks", ()) if each["target"]]
        verdicts = {each["name"].replace("_", " "): verdict_of(each) for each in checks}
        others = [f"{name} {verdict}" for name, verdict in verdicts.items() if verdict != "met"]
        known = answer.get("identifiability", {}).get("parameters", ())
        unknown = [spelled(each["name"]) for each in known if each["verdict"] == "not determined"]
        found.append(
            f"{law}, calibrated: {len(checks) - len(others)} of {len(checks)} targets are met on fresh seeds"
            + (f", {', '.join(others)}" if others else "")
            + (f"; these tests do not determine {', '.join(unknown)}." if unknown else ".")
        )
    found.append(
        "Grains, contact points and fracture energies move these numbers too: docs/paper.md tells by how much."
    )
    return found
