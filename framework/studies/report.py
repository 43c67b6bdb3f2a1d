"""The report of a study: one page of HTML, with its tables and pictures."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from grainlaw.columns import STRAIN, STRESS, quantity_of
from grainlaw.results.figures import html
from grainlaw.results.files import write_atomically
from grainlaw.runs.estimate import in_words
from grainlaw.runs.record import versions
from grainlaw.studies import groups
from grainlaw.studies.export import doubts
from grainlaw.studies.figures import MOST_PATTERNS, plot_strip
from grainlaw.studies.statistics import Listing, level
from grainlaw.studies.store import STUDY

if TYPE_CHECKING:
    from grainlaw.studies.table import Table

LEVELS = 12  #: levels of a factor that are written out
MOST_GROUPS = 24  #: groups of which means are written
MOST_CURVES = 300  #: runs that are read for the picture of curves
REASONS = 100  #: cases that failed and are listed
STRIP = "A point for each case, the same seed at the same place; mean and its interval (95 %)"
PAIRED = (
    "Each pair is equal in all but {factor}: the same {over}. The interval (95 %) is that of the mean difference; "
    "share is that difference over the mean at the first level; higher counts the pairs in which the second level is "
    "higher, and p says how often so many of them would go one way by chance (sign test)."
)


def write_report(table: Table, file: str | os.PathLike[str], title: str, over: Sequence[str]) -> None:
    """Write what a study is, what it found and what it cost. Raises OSError where it cannot write."""
    name = title or f"Study of {', '.join(table.factors) or 'one case'}"
    content = html.page(name, _parts(name, table, over))
    write_atomically(Path(file), lambda path: path.write_text(content, encoding="utf-8"))


def _parts(title: str, table: Table, over: Sequence[str]) -> Iterator[str]:
    by, main = _grouped(table, over), table.main
    yield html.text("h1", title)
    yield html.text("p", f"grainlaw {versions()['grainlaw']}, {datetime.now():%Y-%m-%d %H:%M}")
    finished = len(table) - len(table.failed)
    yield html.text("p", f"{len(table)} cases: {finished} finished, {len(table.failed)} failed.")
    if table.failed:
        words = "What has failed counts in no mean and in no pair; the reasons are below, at Failures."
        yield html.text("p", words, "warning")
    for words in doubts(table):
        yield html.text("p", f"{words}.", "warning")
    yield html.text("h2", "Factors")
    yield html.table(_factors(table), ["factor", "levels", ""])
    if finished:
        yield from _found(table, main, by, over)
    if table.failed:
        yield html.text("h2", "Failures")
        yield from _failures(table)
    yield html.text("h2", "Cost and versions")
    yield html.side_by_side(
        [html.table(_cost(table), caption="Cost"), html.table(_versions(table), caption="Versions")]
    )


def _found(table: Table, main: Sequence[str], by: Sequence[str], over: Sequence[str]) -> Iterator[str]:
    yield html.text("h2", "Means")
    how = f"over {', '.join(over)}" if over and not set(over) & set(by) else "over all other factors"
    yield html.text("p", f"Mean {how}, its interval (95 %, Student's t), and the standard deviation of one case.")
    means = table.means(*by)
    for name in main:
        yield _listing(means[name])
    if main:
        yield html.picture(
            plot_strip(table, main[0], by, over or table.factors, None), f"{table.quantity(main[0]).words}: {STRIP}"
        )
    yield from _others(table, by)
    factor = next((name for name in table.factors if name not in over and _is_named(table, name)), None)
    if factor and over and len(table.levels(factor)) > 1:
        yield html.text("h2", f"Paired differences: {quantity_of(factor).words}")
        yield html.text("p", PAIRED.format(factor=quantity_of(factor).words, over=" and ".join(over)))
        paired = table.paired(factor, over)
        for name in main:
            yield _listing(paired[name])
        if main and len(paired[main[0]]) <= MOST_GROUPS:
            words = f"{table.quantity(main[0]).words}: lines join cases equal in all but {quantity_of(factor).words}"
            yield html.picture(table.plot_paired(main[0], factor, over), words)
    yield from _runs(table, by, over)


def _runs(table: Table, by: Sequence[str], over: Sequence[str]) -> Iterator[str]:
    """Pictures from the stored runs."""
    first = next(k for k in range(len(table)) if table.is_finished(k))
    if not table.has_run(first):
        return
    if {STRAIN, STRESS} <= set(table.run(first).curves) and len(table) <= MOST_CURVES:
        words = "Stress over strain: each run thin, the median of each group, and the band of 10 to 90 %"
        yield html.text("h2", "Curves")
        yield html.picture(table.plot_curves(by), words)
    cases = groups.first_of_each(table, over)
    if 0 < len(cases) <= MOST_PATTERNS:
        yield html.text("h2", "Cracks")
        words = "Cracks at the end of the tests, on the outline of the specimen before: tensile thin, shear thick"
        yield html.picture(table.plot_cracks(cases), words)


def _listing(listing: Listing) -> str:
    head, *rows = listing.lines
    return html.numbers(rows, head, listing.look.words)


def _others(table: Table, by: Sequence[str]) -> Iterator[str]:
    """Means of all other quantities, with half of their intervals."""
    names = table.others
    if not names:
        return
    means = table.means(*by)
    columns = [", ".join(level(n, v) for n, v in entry.group.items()) or "all" for entry in means[names[0]]]
    rows = []
    for name in names:
        look = table.quantity(name)
        halves = [(entry, (entry.interval[1] - entry.interval[0]) / 2) for entry in means[name]]
        cells = [f"{look.text(entry.mean)} ± {look.text(half)}" if entry.count else "-" for entry, half in halves]
        rows.append([look.heading, *cells])
    yield html.numbers(
        rows,
        [", ".join(quantity_of(n).heading for n in by), *columns],
        caption="Other quantities, mean ± half of the interval",
    )


def _grouped(table: Table, over: Sequence[str]) -> list[str]:
    """The factors by which means are written: all others, or those without numbers where they are too many."""
    by = groups.rest(table, *over)
    if len(list(groups.groups(table, by))) > MOST_GROUPS:
        by = [name for name in by if _is_named(table, name)]
    return by if len(list(groups.groups(table, by))) <= MOST_GROUPS else []


def _is_named(table: Table, factor: str) -> bool:
    return any(isinstance(each, (str, bool)) for each in table.levels(factor))


def _factors(table: Table) -> list[list[str]]:
    rows = []
    for name in table.factors:
        levels = table.levels(name)
        texts = [level(name, each) for each in levels]
        if len(levels) > LEVELS and not _is_named(table, name):
            texts = [f"{level(name, min(levels))} to {level(name, max(levels))}"]
        elif len(levels) > LEVELS:
            texts = [*texts[:LEVELS], "..."]
        rows.append([quantity_of(name).heading, ", ".join(texts), f"{len(levels)} levels"])
    return rows


def _failures(table: Table) -> Iterator[str]:
    rows = [
        [*(level(name, case[name]) for name in table.factors), case["status"], case["reason"]]
        for case in table.failed[:REASONS]
    ]
    heads = [*(quantity_of(name).heading for name in table.factors), "status", "reason"]
    yield html.table(rows, heads)
    if len(table.failed) > REASONS:
        yield html.text("p", f"and {len(table.failed) - REASONS} more")


def _cost(table: Table) -> list[list[str]]:
    def known(name: str) -> np.ndarray:
        return np.array([cost[name] for cost in table.costs if cost.get(name) is not None], dtype=float)

    rows: list[list[str]] = []
    cpu, size = known("cpu"), known("bytes")
    if len(cpu):
        rows.append(["CPU time of all cases", in_words(float(cpu.sum()))])
        rows.append(
            ["CPU time of a case, mean and longest", f"{in_words(float(cpu.mean()))}, {in_words(float(cpu.max()))}"]
        )
    if len(size):
        rows.append(["stored runs", f"{size.sum() / 1e6:.3g} MB"])
        rows.append(["stored run of a case, mean", f"{size.mean() / 1e3:.3g} kB"])
    return rows


def _versions(table: Table) -> list[list[str]]:
    """Of the store, and of what has written this page."""
    rows = [[name, number] for name, number in versions().items()]
    try:
        about: dict[str, Any] = json.loads((table.store.path / STUDY).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return rows
    return [
        ["store begun by grainlaw", str(about.get("grainlaw", "-"))],
        ["format of the store", str(about.get("format"))],
        *rows,
    ]
