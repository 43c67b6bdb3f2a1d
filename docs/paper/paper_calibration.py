"""Contact parameters that give the paper's rock: how they are found, and those that were."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
from paper_runs import BRITTLE, CONSISTENT, specimen

from grainlaw.calibration.calibrate import calibrate
from grainlaw.calibration.check import Compared
from grainlaw.calibration.targets import AIMS, Target, Targets
from grainlaw.cli.default_rock import LAWS
from grainlaw.contact import ContactLaw
from grainlaw.laws import CohesiveCrack
from grainlaw.messages import spelled
from grainlaw.results.tables import write_json
from grainlaw.specimen import Specimen
from grainlaw.unit_text import written
from grainlaw.units import GPa, MPa, mm

STORED = "paper_calibrated.json"  #: beside this file; remade by ``paper.py --recalibrate``
_NUMBERS: dict[str, Any] = {
    "youngs_modulus": 60 * GPa, "poissons_ratio": 0.25, "ucs": 126.65 * MPa, "cohesion": 18.35 * MPa,
    "friction_angle": 57.68, "tensile_strength": 10 * MPa, "confinements": [2 * MPa, 4 * MPa],
}  # fmt: skip
TARGETS = Targets(**_NUMBERS)
STRENGTHS: dict[str, tuple[float, float]] = {
    "tensile_strength": (5 * MPa, 30 * MPa), "cohesion": (10 * MPa, 60 * MPa), "friction_angle": (30, 65),
}  # fmt: skip


MORE = 27  #: specimens of the best points: strengths scatter by 8 %, which twelve do not know well


@attrs.frozen
class Search:
    """A law, what of it is free, and how many points are tested."""

    law: ContactLaw
    free: Mapping[str, tuple[float, float]]
    tied: Mapping[str, tuple[str, float]]
    budget: int


SEARCHES = {
    CONSISTENT: Search(
        LAWS["cohesive-crack"], {**STRENGTHS, "mode_i_energy": (2, 200)},
        {"mode_ii_energy": ("mode_i_energy", 2)}, 60,
    ),
    BRITTLE: Search(LAWS["mohr-coulomb"], STRENGTHS, {}, 40),
}  # fmt: skip


def piece(seed: int) -> Specimen:
    """270 grains of the size of the paper's, in 30 mm x 75 mm: what a search can afford."""
    return specimen(seed, (30 * mm, 75 * mm, 270))


def recalibrate(folder: Path, workers: int | None) -> dict[str, Any]:
    """Find the parameters anew, by law; what is found is also written to ``paper_calibrated.json`` in the folder."""
    found = {}
    for name, search in SEARCHES.items():
        answer = calibrate(
            TARGETS, search.law, search.free, piece, store=folder / name.replace(" ", "-"), tied=search.tied,
            elastic="grains", budget=search.budget, more=MORE, also=("crack_initiation", "crack_damage"),
            workers=workers,
        )  # fmt: skip
        found[name] = answer.summary
    write_json(folder / STORED, found)
    return found


def stored() -> dict[str, Any]:
    """What the last calibration has found, by law."""
    found: dict[str, Any] = json.loads((Path(__file__).parent / STORED).read_text(encoding="utf-8"))
    return found


def targets_met(found: Mapping[str, Any]) -> list[list[str]]:
    """Each target, and what the calibrated laws give on fresh seeds; headings first."""
    rows = [["on ten fresh seeds", "paper", *found]]
    for name in dict.fromkeys(each["name"] for answer in found.values() for each in answer.get("checks", ())):
        look, target = AIMS[name].shown, TARGETS.given.get(name)
        shown = look.text(target.value) if target else "-"
        rows.append([look.heading, shown, *(checked_cell(answer, name) for answer in found.values())])
    return rows


def checked_cell(answer: Mapping[str, Any], name: str) -> str:
    """A quantity on fresh seeds, its interval, and whether it is the target's."""
    checks = {each["name"]: each for each in answer.get("checks", ())}
    if name not in checks:
        return "-"
    look, each = AIMS[name].shown, checks[name]
    low, high = each["interval"]
    between = "" if low is None else f" ({look.text(low)} to {look.text(high)})"
    said = verdict_of(each)
    return f"{look.text(each['measured'])}{between}{said and f', {said}'}"


def verdict_of(check: Mapping[str, Any]) -> str:
    """Whether what fresh seeds gave is the target; empty without one."""
    ends = tuple(math.nan if end is None else end for end in check["interval"])
    target = Target(**check["target"]) if check["target"] else None
    return Compared(check["name"], target, math.nan, ends, check["measured"], ends, check["count"]).verdict


def parameters(found: Mapping[str, Any]) -> list[list[str]]:
    """Parameters of the calibrated laws with 95 % intervals, beside those of Table 1; headings first."""
    rows = [["parameter", "Table 1", *found]]
    names = list(dict.fromkeys(name for answer in found.values() for name in answer["parameters"]))
    table_1 = LAWS["cohesive-crack"]
    assert isinstance(table_1, CohesiveCrack)
    units = {field.name: field.metadata.get("unit", "") for field in attrs.fields(CohesiveCrack)}
    for name in names:
        of_laws = (parameter_cell(answer, name, units[name]) for answer in found.values())
        rows.append([spelled(name), _value(getattr(table_1, name), units[name]), *of_laws])
    rows.append(["modulus of the grains, over Table 1", "1", *(f"{answer['grains']:.4g}" for answer in found.values())])
    return rows


def parameter_cell(answer: Mapping[str, Any], name: str, unit: str) -> str:
    """A parameter as it was found, with its interval and whether the tests determine it."""
    if name not in answer["parameters"]:
        return "-"
    text = _value(answer["parameters"][name], unit)
    known = {each["name"]: each for each in answer.get("identifiability", {}).get("parameters", ())}
    if name in known:
        low, high = (_value(end, unit) for end in known[name]["interval"])
        text += f" ({low} to {high}), {known[name]['verdict']}"
    return text


def _value(value: float, unit: str) -> str:
    return written(float(f"{value:.3g}"), unit)
