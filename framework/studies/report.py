"""The report of a study: one page of HTML, with its tables and pictures."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from grainlaw.columns import STRAIN, STRESS, quantity_of
from grainlaw.messages import enumeration
from grainlaw.results.figures.pages import headed, write_page
from grainlaw.results.means import ENOUGH
from grainlaw.results.standard_measures import ratios, thresholds
from grainlaw.runs.estimate import in_words
from grainlaw.runs.record import versions
from grainlaw.studies import groups
from grainlaw.studies.export import doubts
from grainlaw.studies.figures import MOST_PATTERNS, plot_strip
from grainlaw.studies.statistics import Listing, level, mean_in_words

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure
    from grainlaw.studies.table import Table

LEVELS = 12  #: levels of a factor that are written out
MOST_GROUPS = 24  #: groups of which means are written
MOST_PAIRED = 4  #: levels of a factor of numbers whose differences are written
MOST_DRAWN = 8  #: quantities of which pictures are drawn
MOST_CURVES = 300  #: runs that are read for the picture of curves
REASONS = 100  #: cases that failed and are listed
OF_CRACKING = {measure.name for measure in (*thresholds(), *ratios())}  #: what few specimens do not tell


def write_report(table: Table, file: str | os.PathLike[str], title: str, over: Sequence[str]) -> None:
    """Write what a study is, what it found and what it cost. Raises OSError where it cannot write."""
    by = _grouped(table, over)
    finished = len(table) > len(table.failed)
    write_page(
        file, "studies/report.html", title=title or f"Study of {', '.join(table.factors) or 'one case'}",
        count=len(table), failed=len(table.failed), doubts=doubts(table), factors=_factors(table),
        means=_means(table, by, over) if finished else None, pairs=_pairs(table, over) if finished else [],
        **(_pictures(table, by, over) if finished else {"curves": None, "cracks": None}), failures=_failures(table),
        cost=_cost(table), versions=_versions(table),
    )  # fmt: skip


def _means(table: Table, by: Sequence[str], over: Sequence[str]) -> dict[str, Any]:
    means, main = table.means(*by), table.main
    strips = [(plot_strip(table, name, by, over or table.factors, None), _told(table, name)) for name in _drawn(table)]
    return {
        "how": f"over {', '.join(over)}" if over and not set(over) & set(by) else "over all other factors",
        "listings": [_listing(means[name]) for name in main],
        "strips": strips,
        "others": _others(table, by),
        "too_few": any(0 < each.count < ENOUGH for name in OF_CRACKING & {*table.columns} for each in means[name]),
    }


def _pairs(table: Table, over: Sequence[str]) -> list[dict[str, Any]]:
    """Of each factor with several levels, few unless they have names."""
    names = [name for name in table.factors if name not in over and over and len(table.levels(name)) > 1]
    return [
        _paired(table, name, over) for name in names if _is_named(table, name) or len(table.levels(name)) <= MOST_PAIRED
    ]


def _paired(table: Table, factor: str, over: Sequence[str]) -> dict[str, Any]:
    paired = table.paired(factor, over)
    drawn = [name for name in _drawn(table) if len(paired[name]) <= MOST_GROUPS]
    return {
        "factor": quantity_of(factor).words,
        "over": enumeration(over),
        "listings": [_listing(paired[name]) for name in table.main],
        "figures": [(table.plot_paired(name, factor, over), _told(table, name)) for name in drawn],
    }


def _drawn(table: Table) -> list[str]:
    """The first of the main quantities, and what measures of the user's own have found."""
    return [*dict.fromkeys([*table.main[:1], *table.own])][:MOST_DRAWN]


def _told(table: Table, name: str) -> str:
    look = table.quantity(name)
    return f"{look.words} ({look.meaning})" if look.meaning and name in table.own else look.words


def _pictures(table: Table, by: Sequence[str], over: Sequence[str]) -> dict[str, Figure | None]:
    """From the stored runs."""
    first = next(k for k in range(len(table)) if table.is_finished(k))
    if not table.has_run(first):
        return {"curves": None, "cracks": None}
    runs = (table.run(k) for k in range(len(table)) if table.is_finished(k))
    drawn = len(table) <= MOST_CURVES and all({STRAIN, STRESS} <= set(run.curves) for run in runs)
    cases = groups.first_of_each(table, over)
    return {
        "curves": table.plot_curves(by) if drawn else None,
        "cracks": table.plot_cracks(cases) if 0 < len(cases) <= MOST_PATTERNS else None,
    }


def _listing(listing: Listing) -> dict[str, Any]:
    return {**headed(listing.lines), "words": listing.look.words} if listing else {"rows": [], "heads": [], "words": ""}


def _others(table: Table, by: Sequence[str]) -> dict[str, Any] | None:
    """Means of all other quantities, with half of their intervals."""
    names = table.others
    if not names:
        return None
    means = table.means(*by)
    columns = [", ".join(level(n, v) for n, v in entry.group.items()) or "all" for entry in means[names[0]]]
    most = [max(entry.count for entry in entries) for entries in zip(*(means[name] for name in names), strict=True)]
    rows = []
    for name in names:
        look = table.quantity(name)
        cells = (mean_in_words(entry, look, n) for entry, n in zip(means[name], most, strict=True))
        rows.append([look.heading, *cells])
    return {"rows": rows, "heads": [", ".join(quantity_of(n).heading for n in by), *columns]}


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
        rows.append([quantity_of(name).heading, ", ".join(texts), f"{len(levels)} level{'s' * (len(levels) != 1)}"])
    return rows


def _failures(table: Table) -> dict[str, Any]:
    rows = [
        [*(level(name, case[name]) for name in table.factors), case["status"], case["reason"]]
        for case in table.failed[:REASONS]
    ]
    heads = [*(quantity_of(name).heading for name in table.factors), "status", "reason"]
    return {"rows": rows, "heads": heads, "more": max(0, len(table.failed) - REASONS)}


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
    about = table.store.about
    begun = [
        ["store begun by grainlaw", str(about.get("grainlaw", "-"))],
        ["format of the store", str(about.get("format"))],
    ]
    return [*(begun if about else []), *([name, number] for name, number in versions().items())]
