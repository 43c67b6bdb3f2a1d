"""The report of a calibration: one page of HTML."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grainlaw.calibration.check import NOT_MET, UNCHECKED
from grainlaw.calibration.targets import AIMS
from grainlaw.results.figures.pages import Cell, headed, write_page
from grainlaw.runs.record import versions
from grainlaw.unit_text import written

if TYPE_CHECKING:
    from grainlaw.calibration.result import Calibration
    from grainlaw.drawing.figure import Figure


def write_report(found: Calibration, file: Path, drawn: Mapping[str, Figure | None]) -> None:
    """The page, with pictures by their names. Raises OSError."""
    ranges = [[f.name, f"{written(f.low, f.unit)} to {written(f.high, f.unit)}"] for f in found.space.free]
    ranges += [[tie.name, f"{tie.times:g} times {tie.to}"] for tie in found.space.ties]
    waves = [
        [str(number), str(wave.count), f"{100 * wave.share:.2g} %", f"{wave.least:.2f}"]
        for number, wave in enumerate(found.found.waves, 1)
    ]
    write_page(
        file, "calibration/report.html", title=f"Calibration of {found.space.kind.__name__}",
        head=found.head.splitlines(), names=list(found.space.names),
        answer=_answer(found) if found.is_plausible else None,
        unchecked=UNCHECKED, conflict=found.conflict, conflicts=list(_conflicts(found)), targets=_targets(found),
        figures=drawn, tried=found.tried_in_words, ranges=ranges, waves=waves,
        quality=headed(found.quality_lines), failures=found.failure_words if found.failures else "",
        versions=list(versions().items()),
    )  # fmt: skip


def _answer(found: Calibration) -> dict[str, Any]:
    seen = found.identifiability
    assert seen is not None
    return {
        "missed": found.judged(NOT_MET),
        "parameters": headed(found.parameter_lines),
        "known": headed(found.known_lines),
        "verdicts": found.verdicts,
        "check_words": found.check_words,
        "checks": headed(found.check_lines) if found.checks else None,
        "fresh": [
            [shown.heading, ", ".join("-" if math.isnan(value) else shown.text(value) for value in each.values)]
            for each in found.checks
            if each.values and (shown := AIMS[each.name].shown)
        ],
        "correlations": [
            [name, *(f"{c:+.2f}" for c in row)] for name, row in zip(found.space.names, seen.correlation, strict=True)
        ],
        "directions": [[each.words, f"{100 * each.width:.0f} %"] for each in seen.directions],
        "further": [
            [AIMS[e.quantity].shown.words, Cell(f"{e.gain:.2f}"), e.helped, Cell(f"{100 * e.width:.0f} %")]
            for e in seen.further
        ],
        "sobol": [
            [AIMS[name].shown.words, *(f"{max(a, 0):.2f}, {max(b, 0):.2f}" for a, b in zip(first, total, strict=True))]
            for name, first, total in zip(seen.quantities, seen.first_order, seen.total_order, strict=True)
        ],
    }


def _conflicts(found: Calibration) -> Iterator[str]:
    for conflict in found.found.conflicts:
        there = ", ".join(f"{AIMS[n].shown.words} {AIMS[n].shown.with_unit(v)}" for n, v in conflict.values.items())
        yield f"{conflict}; the nearest there is: {there}"


def _targets(found: Calibration) -> list[list[str]]:
    rows = []
    for name, target in found.targets.given.items():
        look = AIMS[name].shown
        rows.append([look.heading, f"{look.text(target.value)} ± {look.text(target.uncertainty)}"])
    if {"cohesion", "friction_angle"} & {*found.targets.given}:
        rows.append(["confinements (MPa)", ", ".join(f"{p / 1e6:g}" for p in found.targets.pressures)])
    return rows
