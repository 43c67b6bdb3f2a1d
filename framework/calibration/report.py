"""The report of a calibration: one page of HTML."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from grainlaw.calibration import figures
from grainlaw.calibration.targets import AIMS
from grainlaw.results.figures import html
from grainlaw.results.figures.html import Cell
from grainlaw.results.files import write_atomically
from grainlaw.runs.record import versions
from grainlaw.unit_text import written

if TYPE_CHECKING:
    from grainlaw.calibration.result import Calibration

BANDS = (
    "Each target over each parameter: points tested (mean of the seeds, brought to the strength of the best "
    "parameters), the emulator along a line through the best parameters with its 95 % band, the target with its "
    "uncertainty"
)
CORNER = "The posterior: each parameter, and each two of them, over their whole ranges; a cross at the best parameters"
QUALITY = (
    "Emulators: share of the variance of left out points that is predicted (Q2); root mean square of the errors over "
    "their standard deviation, which should be near 1; share within 2"
)
LEFT_OUT = "Each point left out and predicted from the others: the closer to the line, the better the emulator"


def write_report(found: Calibration, file: Path) -> None:
    """Raises OSError."""
    content = html.page(f"Calibration of {found.space.kind.__name__}", _parts(found))
    write_atomically(file, lambda path: path.write_text(content, encoding="utf-8"))


def _parts(found: Calibration) -> Iterator[str]:
    yield html.text("h1", f"Calibration of {found.space.kind.__name__}")
    yield html.text("p", f"grainlaw {versions()['grainlaw']}, {datetime.now():%Y-%m-%d %H:%M}")
    for line in found.head.splitlines():
        yield html.text("p", line)
    if found.is_plausible:
        yield from _answer(found)
    else:
        yield html.text("p", f"Nothing in the ranges is plausible. In conflict: {found.conflict}.", "warning")
        for conflict in found.found.conflicts:
            there = ", ".join(f"{AIMS[n].shown.words} {AIMS[n].shown.with_unit(v)}" for n, v in conflict.values.items())
            yield html.text("p", f"{conflict}; the nearest there is: {there}")
        yield html.picture(figures.bands(found), BANDS)
    yield html.text("h2", "Ranges and targets")
    yield html.side_by_side([_targets(found), _ranges(found)])
    yield html.text("h2", "Search")
    yield _waves(found)
    yield _table(found.quality_lines, QUALITY)
    yield html.picture(figures.left_out(found), LEFT_OUT)
    if found.failures:
        yield html.text("h2", "Tests without a value")
        yield html.text("p", found.failure_words)
    yield html.text("h2", "Versions")
    yield html.table([[name, number] for name, number in versions().items()])


def _answer(found: Calibration) -> Iterator[str]:
    seen = found.identifiability
    assert seen is not None
    missed = [AIMS[each.name].shown.words for each in found.checks if each.is_met is False]
    if missed:
        yield html.text("p", f"On fresh seeds not met: {', '.join(missed)}.", "warning")
    yield html.text("h2", "Parameters")
    yield _table(found.parameter_lines, "Best parameters, and the interval in which they are with 95 %")
    for line in found.verdicts:
        yield html.text("p", line)
    yield html.text("h2", "Check on fresh seeds")
    yield _table(found.check_lines, "The best parameters on specimens that the search has not seen. Met: within 5 % of "
                 "the target, or the target is in the interval of the mean")  # fmt: skip
    if (picture := figures.envelope(found)) is not None:
        yield html.picture(picture, "Strengths of the fresh seeds, their line, and that of the targets")
    yield html.text("h2", "What determines what")
    yield html.picture(figures.corner(found), CORNER)
    yield html.picture(figures.bands(found), BANDS)
    yield _correlations(found)
    rows = [[each.words, f"{100 * each.width:.0f} %"] for each in seen.directions]
    yield html.numbers(rows, ["direction", "of the prior's deviation left"], "Directions, the least seen first")
    if seen.further:
        rows = [
            [
                AIMS[e.quantity].shown.words,
                Cell(f"{e.gain:.2f}", "number"),
                e.helped,
                Cell(f"{100 * e.width:.0f} %", "number"),
            ]
            for e in seen.further
        ]
        yield html.table(rows, ["measured, but not used", "bits", "helps most", "to, of its width"],
                         "What further tests would tell, if a laboratory measured them to 2 %")  # fmt: skip
    yield _sobol(found)


def _table(lines: Sequence[Sequence[str]], caption: str) -> str:
    head, *rows = lines
    return html.numbers(rows, head, caption)


def _targets(found: Calibration) -> str:
    rows = []
    for name, target in found.targets.given.items():
        look = AIMS[name].shown
        rows.append([look.heading, f"{look.text(target.value)} ± {look.text(target.uncertainty)}"])
    if any("confined" in AIMS[name].tests for name in found.targets.given):
        rows.append(["confinements (MPa)", ", ".join(f"{p / 1e6:g}" for p in found.targets.pressures)])
    return html.table(rows, caption="Targets and their standard uncertainty")


def _ranges(found: Calibration) -> str:
    rows = [[f.name, f"{written(f.low, f.unit)} to {written(f.high, f.unit)}"] for f in found.space.free]
    rows += [[tie.name, f"{tie.times:g} times {tie.to}"] for tie in found.space.ties]
    return html.table(rows, caption="Free parameters")


def _waves(found: Calibration) -> str:
    rows = [
        [str(number), str(wave.count), f"{100 * wave.share:.2g} %", f"{wave.least:.2f}"]
        for number, wave in enumerate(found.found.waves, 1)
    ]
    heads = ["wave", "points", "of the ranges plausible after it", "implausibility of the best point"]
    return html.table(rows, heads)


def _correlations(found: Calibration) -> str:
    seen, names = found.identifiability, found.space.names
    assert seen is not None
    rows = [[name, *(f"{c:+.2f}" for c in row)] for name, row in zip(names, seen.correlation, strict=True)]
    return html.numbers(rows, ["", *names], "Correlations of the posterior")


def _sobol(found: Calibration) -> str:
    seen = found.identifiability
    assert seen is not None
    rows = [
        [
            AIMS[name].shown.words,
            *(f"{max(a, 0):.2f}, {max(b, 0):.2f}" for a, b in zip(first, total, strict=True)),
        ]
        for name, first, total in zip(seen.quantities, seen.first_order, seen.total_order, strict=True)
    ]
    return html.numbers(rows, ["", *found.space.names], "Sobol indices over the ranges: first order, total")
