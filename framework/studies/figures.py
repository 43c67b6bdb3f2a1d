"""Pictures of the table of a study: strips of cases, pairs, curves with a band, crack patterns, an envelope."""

from __future__ import annotations

import itertools
import math
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from grainlaw.columns import quantity_of
from grainlaw.drawing.figure import Figure, draw_legend, given_or_new
from grainlaw.drawing.palette import BLACK, BLUE, COLORS, STYLES, VERMILLION, color, marker
from grainlaw.fields import ParameterError
from grainlaw.quantity import Quantity
from grainlaw.results.figures.cracks import draw_stored_cracks, label_cracks, scale_bar, unit_of
from grainlaw.results.figures.curves import EVERY, common_panel, label_panel
from grainlaw.studies import groups
from grainlaw.studies.statistics import Difference, Mean, level

if TYPE_CHECKING:
    from grainlaw.results.result import Result
    from grainlaw.studies.envelope import StrengthEnvelope
    from grainlaw.studies.table import Table

BAND = (10, 90)  #: percentiles of the curves
POINTS = 400  #: of a median curve
MOST_PATTERNS = 24  #: crack patterns in a picture
WIDEST = 14.0  #: inch
MOST_PER_COLUMN = 6  #: entries of a legend


def plot_strip(table: Table, column: str, by: Sequence[str], over: Sequence[str], ax: Axes | None) -> Figure:
    """A point for each case, in a strip for each group; beside it the mean with its 95 % interval."""
    look, found = table.quantity(column), groups.means(table, column, by)
    members = [rows for _, rows in groups.groups(table, by)]
    blocks = [tuple(entry.group[name] for name in by[:-1]) for entry in found]
    places = np.cumsum([0.0] + [1.0 if one == other else 1.4 for one, other in itertools.pairwise(blocks)])
    figure, axes = given_or_new("Table.plot", ax, (min(max(3.4, 1.2 + 0.85 * (places[-1] + 1)), WIDEST), 4.2))
    of_case = [tuple(row[name] for name in over) for row in table.rows]
    ranks = {key: k for k, key in enumerate(dict.fromkeys(of_case))}
    colors = {key: COLORS[k % len(COLORS)] for k, key in enumerate(dict.fromkeys(e.group[by[0]] for e in found if by))}
    for x, entry, rows in zip(places, found, members, strict=False):
        color = colors[entry.group[by[0]]] if by else BLUE
        known = [k for k in rows if np.isfinite(table[column][k])]
        share = np.array([(ranks[of_case[k]] + 0.5) / len(ranks) for k in known])
        values = table[column][known] * look.factor
        # the same seed lies at the same place in each strip
        axes.plot(x - 0.3 + 0.45 * share, values, "o", color=color, markersize=4.5, alpha=0.65, markeredgewidth=0)
        if entry.count:
            low, high = (np.nan_to_num(end, nan=entry.mean) for end in entry.interval)
            reach = np.array([[entry.mean - low], [high - entry.mean]]) * look.factor
            axes.errorbar(
                x + 0.3, entry.mean * look.factor, reach, fmt="D", color=color, markeredgecolor=BLACK, ecolor=BLACK,
                markersize=5.5, capsize=3.5, elinewidth=1.3,
            )  # fmt: skip
    ticks = [_ticked(e, by[-1:], len(r)) for e, r in zip(found, members, strict=True)]
    axes.set_xticks(places[: len(found)], ticks)
    axes.set_xlim(-0.6, places[-1] + 0.6)
    heading = ", ".join(quantity_of(name).heading for name in reversed(by))
    if len(by) > 1:  # what several strips have in common stands once below them
        below = -12 - 12.5 * max(text.count("\n") + 1 for text in ticks)  # points, under the longest tick
        for block in dict.fromkeys(blocks):
            middle = np.mean([x for x, each in zip(places, blocks, strict=False) if each == block])
            words = _label(dict(zip(by[:-1], block, strict=True)))
            axes.annotate(
                words, (middle, 0), (0, below), xycoords=("data", "axes fraction"), textcoords="offset points",
                ha="center", va="top",
            )  # fmt: skip
    axes.set_xlabel(heading, labelpad=26 if len(by) > 1 else None)
    _finish(axes, look.heading)
    return figure


def plot_paired(table: Table, column: str, factor: str, over: Sequence[str], ax: Axes | None) -> Figure:
    """A line for each pair, which rises solid or falls dashed; means in black; mean differences in the title."""
    look = table.quantity(column)
    found = groups.differences(table, column, factor, over)
    blocks = [
        (group, groups.values_by_level(table, column, factor, over, rows))
        for group, rows in groups.groups(table, groups.rest(table, factor, *over))
    ]
    said = list(_said(found, look))
    wide = max(0.95 * sum(len(values) + 0.5 for _, values in blocks), 0.068 * max(map(len, said), default=0))
    figure, axes = given_or_new("Table.plot_paired", ax, (min(max(3.8, 1.2 + wide), WIDEST), 4.2 + 0.16 * len(said)))
    ticks: list[tuple[float, str]] = []
    left = 0.0
    for group, values in blocks:
        at = {each: left + k for k, each in enumerate(values)}
        for first, second in itertools.pairwise(values):
            _join(axes, [at[first], at[second]], values[first], values[second], look.factor)
        for each, of_case in values.items():
            axes.plot([at[each]] * len(of_case), [v * look.factor for v in of_case.values()], "o", color="0.45", ms=3.5)
            ticks.append((at[each], level(factor, each)))
        if group:
            words = "\n".join(_labels(group))
            middle = left + (len(values) - 1) / 2
            axes.annotate(words, (middle, 1), xycoords=("data", "axes fraction"), va="top", ha="center", fontsize=9)
        left += len(values) + 0.5
    axes.set_xticks([x for x, _ in ticks], [text.replace(" ", "\n") for _, text in ticks])
    axes.set_xlim(-0.5, max(left - 1, 0.5))
    axes.set_xlabel(quantity_of(factor).heading)
    axes.margins(y=0.16)
    axes.set_title("\n".join(said), fontsize=9, loc="left")
    _finish(axes, look.heading)
    return figure


def plot_curves(table: Table, by: Sequence[str], y: str, x: str, ax: Axes | None) -> Figure:
    """Curves of the stored runs of each group, thin; their median and 10 to 90 % until half of them have ended."""
    figure, axes = given_or_new("Table.plot_curves", ax, (6.2, 4.4))
    across, up = table.quantity(x), table.quantity(y)
    drawn = 0
    for k, (group, rows) in enumerate(groups.groups(table, by)):
        curves = [curve for row in rows if (curve := _curve(table, row, x, y)) is not None]
        if not curves:
            continue
        color, style = COLORS[k % len(COLORS)], STYLES[k % len(STYLES)]
        for along, values in curves:
            axes.plot(along * across.factor, values * up.factor, color=color, linewidth=0.5, alpha=0.35)
        label = f"{_label(group) or 'all'} (n = {len(curves)})"
        grid, (low, median, high) = on_common_grid(curves)
        if len(curves) > 2:
            band = low * up.factor, high * up.factor
            axes.fill_between(grid * across.factor, *band, color=color, alpha=0.22, linewidth=0)
        axes.plot(grid * across.factor, median * up.factor, color=color, linestyle=style, linewidth=2, label=label)
        drawn += 1
    if not drawn:
        raise ParameterError(f"Table.plot_curves: no finished case has a run with the columns {x} and {y}")
    axes.set_xlabel(across.heading)
    draw_legend(axes, fontsize=9, handlelength=3)
    _finish(axes, up.heading)
    return figure


def on_common_grid(curves: Sequence[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """(m,) points until half of the curves have ended, and (3, m) low, middle and high percentiles of their values.

    A curve that has ended counts with its last value: a specimen that has failed carries no more than that, and the
    median would leap up if it were left out. One that turns back is followed where it goes farther than before.
    """
    turn = -1.0 if curves[0][0][-1] < curves[0][0][0] else 1.0
    forward = []
    for along, values in curves:
        farthest = np.maximum.accumulate(turn * along)
        new = np.r_[True, farthest[1:] > farthest[:-1]]
        forward.append((farthest[new], values[new]))
    first, half = max(a[0] for a, _ in forward), float(np.median([a[-1] for a, _ in forward]))
    grid = np.linspace(first, max(first, half), POINTS)
    sampled = np.array([np.interp(grid, a, v) for a, v in forward])
    low, high = BAND
    return turn * grid, np.percentile(sampled, (low, 50, high), axis=0)


def plot_cracks(
    table: Table, cases: Sequence[Mapping[str, Any]], columns: int | None, ax: Sequence[Axes] | None
) -> Figure:
    """Crack patterns of cases side by side at one scale, on the outline of their specimens before the test."""
    if not 1 <= len(cases) <= MOST_PATTERNS:
        raise ParameterError(
            f"Table.plot_cracks: {len(cases)} cases cannot be drawn in one picture; give 1 to {MOST_PATTERNS}, "
            "as cases=[{'seed': 1, ...}, ...]"
        )
    results = [table.result(**case) for case in cases]
    unit, box = unit_of(*results), np.array([_box(result) for result in results])
    low, high = box[:, 0].min(axis=0), box[:, 1].max(axis=0)
    wide, tall = high - low
    across = min(columns or MOST_PER_COLUMN, len(results))
    down = math.ceil(len(results) / across)
    if ax is None:
        each = float(np.clip(4.2 * wide / tall, 1.0, 10.0 / across))
        figure = Figure(figsize=(each * across + 0.6, (each * tall / wide + 0.5) * down + 1.0), layout="compressed")
        places = list(figure.subplots(down, across, squeeze=False).ravel())
    else:
        places = list(np.ravel(np.asarray(ax, dtype=object)))
        figure = places[0].figure
    if len(places) < len(results):
        raise ParameterError(f"Table.plot_cracks: ax has {len(places)} axes for {len(results)} cases")
    named = [{name: case[name] for name in (*table.factors, *case) if name in case} for case in cases]
    common = {name: v for name, v in named[0].items() if all(name in each and each[name] == v for each in named)}
    own = [{name: v for name, v in each.items() if name not in common} for each in named]
    for axes, levels, result in zip(places, own, results, strict=False):
        draw_stored_cracks(axes, result, unit, title="\n".join(_labels(levels)))
        axes.set_xlim(low[0] * unit.factor, high[0] * unit.factor)
        axes.set_ylim(low[1] * unit.factor, high[1] * unit.factor)
        axes.set_axis_off()
    if ax is None:
        for axes in places[len(results) :]:
            axes.remove()
        figure.suptitle(_label(common), fontsize=10)
        label_cracks(figure)
    scale_bar(places[(down - 1) * across], float(wide), unit)
    return figure


def plot_envelope(envelope: StrengthEnvelope) -> Figure:
    """The usual picture of the test by confinement, and strengths over confinement with the criteria fitted to them."""
    table = envelope.table
    results = {k: table.run(k) for k in range(len(table)) if table.is_finished(k)}
    panel = common_panel(results)
    figure = Figure(figsize=(11, 5), layout="constrained")
    left, right = figure.subplots(1, 2)
    others = groups.rest(table, envelope.confinement)
    samples = {k: tuple(table.rows[k][name] for name in others) for k in results}
    styles = dict(zip(dict.fromkeys(samples.values()), itertools.cycle(("-", "--", ":")), strict=False))
    confinements = sorted({float(table.rows[k][envelope.confinement]) for k in results})
    for k, result in results.items():
        p, first = float(table.rows[k][envelope.confinement]), samples[k] == next(iter(styles))
        x, y = map(result.shown, panel.names[:2])
        label = f"{p / 1e6:g} MPa" if first else None
        number = confinements.index(p)
        look = {"color": color(number), "marker": marker(number), "markevery": EVERY, "markersize": 4}
        left.plot(x, y, styles[samples[k]], linewidth=1.3, label=label, **look)
    label_panel(left, panel, result)
    left.legend(title="confinement", frameon=False)
    x, y = envelope.strengths.T / 1e6
    line, parabola = envelope.mohr_coulomb, envelope.hoek_brown
    at = np.linspace(0, max(x), 100)
    right.plot(x, y, "o", color="0.2", markersize=5)
    label = f"Mohr-Coulomb: c = {line.cohesion / 1e6:.2f} MPa, φ = {line.friction_angle:.2f}°"
    right.plot(at, line.ucs / 1e6 + line.slope * at, color=BLUE, label=label)
    ucs = parabola.ucs / 1e6
    label = f"Hoek-Brown: m = {parabola.m:.1f}, UCS = {ucs:.1f} MPa"
    right.plot(at, at + np.sqrt(np.maximum(parabola.m * ucs * at + ucs**2, 0)), "--", color=VERMILLION, label=label)
    right.set_xlabel("confinement (MPa)")
    right.set_ylabel("strength (MPa)")
    right.set_ylim(bottom=0)
    right.legend(frameon=False, loc="lower right")
    right.grid(alpha=0.25)
    return figure


# --- parts -----------------------------------------------------------------------------------------------------------


def _finish(axes: Axes, heading: str) -> None:
    axes.set_ylabel(heading)
    axes.yaxis.set_major_locator(MaxNLocator(7, steps=[1, 2, 2.5, 5, 10]))
    axes.grid(axis="y", alpha=0.25)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


def _label(group: Mapping[str, Any]) -> str:
    return ", ".join(_labels(group))


def _labels(group: Mapping[str, Any]) -> list[str]:
    """Levels with their units, and the names of factors whose levels do not say what they are."""
    words = []
    for name, value in group.items():
        look, text = quantity_of(name), level(name, value)
        words.append(text if isinstance(value, str) else f"{look.words} {text} {look.unit_shown}".rstrip())
    return words


def _ticked(entry: Mean, by: Sequence[str], cases: int) -> str:
    """What a strip shows: its level, and how many cases have a value."""
    words = [textwrap.fill(level(name, entry.group[name]), 10, break_long_words=False) for name in by] or ["all"]
    absent = f" of {cases}" if entry.count < cases else ""
    return "\n".join([*words, f"n = {entry.count}{absent}"])


def _join(axes: Axes, at: Sequence[float], first: Mapping, second: Mapping, factor: float) -> None:
    """Lines between the pairs of two levels, and between their means."""
    pairs = np.array([(first[k], second[k]) for k in first if k in second]).reshape(-1, 2) * factor
    for pair in pairs:
        color, style = (BLUE, "-") if pair[1] >= pair[0] else (VERMILLION, "--")
        axes.plot(at, pair, color=color, linestyle=style, linewidth=1, alpha=0.75)
    if len(pairs):
        axes.plot(at, pairs.mean(axis=0), "D-", color=BLACK, linewidth=2.2, markersize=5, zorder=4)


def _said(found: Sequence[Difference], look: Quantity) -> Iterator[str]:
    """A line for each difference, for a title."""
    for entry in found[:MOST_PER_COLUMN]:
        one, other = (level(entry.factor, each) for each in entry.levels)
        where = f"{_label(entry.group)}: " if entry.group else ""
        unit = f" {look.unit}" if look.unit_shown else ""
        low, high = (look.text(end) for end in entry.interval)
        sign = "+" if entry.mean > 0 else ""
        interval = f"{sign}{look.text(entry.mean)}{unit} (95 %: {low} to {high}, n = {entry.count})"
        yield f"{where}{other} less {one}: {interval}"
    if len(found) > MOST_PER_COLUMN:
        yield f"and {len(found) - MOST_PER_COLUMN} more"


def _curve(table: Table, row: int, x: str, y: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Two columns of the run of a finished case."""
    if not table.is_finished(row):
        return None
    curves = table.run(row).of_test(x).curves
    for name in (x, y):
        if name not in curves:
            raise ParameterError(f"Table.plot_curves: a run has no column '{name}'; it has {', '.join(curves)}")
    whole = np.isfinite(curves[x]) & np.isfinite(curves[y])
    return (curves[x][whole], curves[y][whole]) if whole.sum() > 1 else None


def _box(result: Result) -> np.ndarray:
    """(2, 2) m, what holds the specimen and its cracks, with a little room."""
    corners = np.concatenate([*(region.outline for region in result.specimen.grains.regions), result.cracks.position])
    low, high = corners.min(axis=0), corners.max(axis=0)
    room = 0.03 * (high - low).max()
    return np.array([low - room, high + room])
