"""Pictures of curves (matplotlib), and a window with the specimen (pyvista)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

import attrs
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from grainlaw.arguments import checked
from grainlaw.columns import (
    DEVIATOR,
    ENERGIES,
    ENERGY,
    LATERAL_STRAIN,
    SHEAR_CRACKS,
    STABILITY,
    STAGE,
    STRAIN,
    STRESS,
    TENSILE_CRACKS,
    TIME,
    Panel,
    require,
)
from grainlaw.drawing.figure import MOST_INSIDE, Figure, draw_legend, given_or_new, grid
from grainlaw.drawing.palette import BLACK, color, marker, style
from grainlaw.fields import ParameterError
from grainlaw.messages import refusal
from grainlaw.moduli import in_plane_strain
from grainlaw.results.archive import law_name
from grainlaw.results.certificate import is_whole
from grainlaw.results.figures.cracks import SHEAR, TENSILE, count_below, draw_cracks, named_results
from grainlaw.results.means import Samples
from grainlaw.results.measured import MeasuredCurve
from grainlaw.results.result import Result
from grainlaw.strength import LOADS, Borne, borne_in

LONG = 40  #: letters of an axis on a panel; longer ones are broken at their comma
EVERY = 0.12  #: of a picture's width between two markers
SHORT = 0.03  #: of the time of a test: a shorter stage has no room for its name
NOTHING = 0.02  #: of the largest value: what is below zero by less begins at zero, such as a first wave
FAR = 3.0  #: ranges before the peak: curves that go farther after it are cut off
PLATE = "plane strain: 1/(1 − ν²) as steep as a cylinder"
OF_MODE = {TENSILE_CRACKS: TENSILE, SHEAR_CRACKS: SHEAR}


def draw_curves(axes: Axes, results: Mapping[str, Result]) -> None:
    """The first panel of a test; a full mark at the strength, an open one at a largest load above it.

    Several columns of a panel differ by their lines.
    """
    panel = common_panel(results)
    if len(panel.columns) > 1:
        _draw(axes, panel, results)
        return
    column, results = panel.columns[0], _of_test(results, panel.over)
    for k, (name, result) in enumerate(results.items()):
        x, y = map(result.shown, panel.names)
        look: dict[str, Any] = {"color": color(k), "marker": marker(k), "markersize": 6}
        axes.plot(x, y, label=name, linewidth=1.6, linestyle=style(k), markevery=[], **look)
        _mark_strength(axes, panel.over, column, result, is_named=False, **look)
    label_panel(axes, panel, result)
    draw_legend(axes)


def _of_test(results: Mapping[str, Result], over: str) -> dict[str, Result]:
    return {name: result.of_test(over) for name, result in results.items()}


def common_panel(results: Mapping[Any, Result]) -> Panel:
    """The usual picture of the test. Raises ParameterError for a result without curves, or without its columns."""
    first = next(iter(results.values()))
    if not first.curves:
        raise ParameterError("a plot of a result needs its curves, and it has none")
    for result in results.values():
        require("a plot of several results", result.curves, *first.panels[0].names)
    return first.panels[0]


def label_panel(axes: Axes, panel: Panel, result: Result) -> None:
    """Words and units as the test declares them; axes of what is not below zero begin there."""
    across, up = (result.quantity(name) for name in panel.names[:2])
    heading = attrs.evolve(up, words=panel.words or up.words).heading
    if len(heading) > LONG:
        heading = heading.replace(", ", ",\n", 1)
    axes.set(xlabel=across.heading, ylabel=heading)
    axes.grid(alpha=0.25)
    drawn = np.concatenate([line.get_xydata() for line in axes.lines] or [np.zeros((0, 2))])
    if _begins_at_zero(*drawn.T):
        axes.set_xlim(0, None)
    if _begins_at_zero(*drawn.T[::-1]):
        axes.set_ylim(0, None)
    if panel.over == TIME and len(result.stages) > 1:
        _draw_stages(axes, result)


def _begins_at_zero(values: np.ndarray, others: np.ndarray) -> bool:
    """Whether next to nothing of points lies below zero on an axis, and on the ``other`` one nowhere apart."""
    known = np.isfinite(values) & np.isfinite(others)
    values, others = values[known], others[known]
    low, high = values.min(initial=np.inf), values.max(initial=-np.inf)
    if not -NOTHING * high <= low <= high / 2:
        return False
    below, above = others[values < 0], others[values >= 0]
    apart = max(above.min() - below.min(), below.max() - above.max()) if len(below) else 0.0
    return bool(apart <= NOTHING * np.ptp(others))


def _draw_stages(axes: Axes, result: Result) -> None:
    """Where each stage begins, with its name; not of those too short to be seen."""
    time, stage = result.shown(TIME), result.curves[STAGE]
    for number in np.unique(stage).astype(int):
        if np.ptp(time[stage == number]) < SHORT * np.ptp(time):
            continue
        begin = time[max(int(np.argmax(stage == number)) - 1, 0)]
        axes.axvline(begin, color="0.6", linewidth=0.8, zorder=0)
        place: dict[str, Any] = {"xycoords": axes.get_xaxis_transform(), "textcoords": "offset points", "va": "bottom"}
        axes.annotate(result.stages[number], (begin, 0), (2, 3), fontsize=8, color="0.4", rotation=90, **place)


def draw_crack_numbers(axes: Axes, over: str, samples: Samples) -> None:
    """Broken contact points over a column, by law and sample: tensile solid, shear dashed."""
    for k, (name, results) in enumerate(samples.items()):
        _draw_crack_numbers(axes, over, k, name, list(results.values()), len(samples) <= MOST_INSIDE / 2)
    first = next(iter(next(iter(samples.values())).values()))
    axes.set(xlabel=first.quantity(over).heading, ylabel="broken contact points")
    axes.grid(alpha=0.25)
    if len(samples) > MOST_INSIDE / 2:  # the colours are those of the picture above
        axes.plot([], [], "-", color="0.3", label="tensile")
        axes.plot([], [], "--", color="0.3", label="shear")
    if axes.lines:
        axes.legend(frameon=False, fontsize="small")


def _draw_crack_numbers(axes: Axes, over: str, k: int, name: str, results: Sequence[Result], named: bool) -> None:
    for column, line, fill in ((TENSILE_CRACKS, "-", "full"), (SHEAR_CRACKS, "--", "none")):
        if not any(each.curves[column][-1] for each in results):
            continue
        marks: dict[str, Any] = {"marker": marker(k), "fillstyle": fill, "markevery": EVERY, "markersize": 4}
        for number, result in enumerate(each.of_test(over) for each in results):
            label = f"{name}, {column.split('_')[0]}" if number == 0 and named else None
            axes.plot(
                result.shown(over), result.curves[column], line, color=color(k), linewidth=1.0, label=label, **marks
            )


def plot_laws(results: Mapping[str, Result]) -> Figure:
    """The usual picture of a test under several laws, and how their cracks accumulate."""
    figure = Figure(figsize=(8, 7), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    draw_curves(upper, results)
    upper.set_xlabel("")
    draw_crack_numbers(lower, common_panel(results).over, {name: {0: result} for name, result in results.items()})
    return figure


def plot_samples(samples: Samples) -> Figure:
    """The usual picture of a test under each law on all samples, and how cracks accumulate.

    A cross is at the mean of the strengths of a law, and as long as their range.
    """
    every = {(name, seed): result for name, each in samples.items() for seed, result in each.items()}
    panel = common_panel(every)
    figure = Figure(figsize=(8, 7), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    drawn = False
    for k, (name, results) in enumerate(samples.items()):
        for number, result in enumerate(results.values()):
            look: dict[str, Any] = {"color": color(k), "linestyle": style(k), "linewidth": 0.8}
            for column in panel.columns:
                label = name if number == 0 and column == panel.columns[0] else None
                upper.plot(result.shown(panel.over), result.shown(column), label=label, **look)
        drawn |= _draw_peaks(upper, panel, list(results.values()), k)
    label_panel(upper, panel, result)
    upper.set_xlabel("")
    draw_legend(upper, title="mean and range of the strengths" if drawn else None, alignment="left")
    draw_crack_numbers(lower, panel.over, samples)
    return figure


def _draw_peaks(axes: Axes, panel: Panel, results: list[Result], k: int) -> bool:
    """Whether there was a strength of all of them to draw."""
    if (panel.columns[0], panel.over) not in LOADS:
        return False
    found = [_failure(result, panel.columns[0], panel.over) for result in results]
    places = [each.at for each in found if each is not None and each.failed]
    if len(places) < len(results):
        return False
    x, y = (
        np.array([result.shown(name)[at] for result, at in zip(results, places, strict=True)])
        for name in panel.names[:2]
    )
    ranges = [[[each.mean() - each.min()], [each.max() - each.mean()]] for each in (x, y)]
    axes.errorbar(
        x.mean(), y.mean(), xerr=ranges[0], yerr=ranges[1], fmt=marker(k), color=color(k), markersize=6,
        linewidth=2, capsize=4, zorder=3,
    )  # fmt: skip
    return True


@checked
def plot_curves(
    results: Any, y: str | None = None, x: str | None = None, *, measured: Any = None, ax: Any = None
) -> Figure:
    """Draw one column of the curves of one result or several over another, by their names in ``Result.curves``.

    Without names: the usual picture of the test, as it declares it. ``results`` are as for :func:`side_by_side`, or one
    result. ``measured`` are curves of a laboratory, drawn beside them in black: one :class:`MeasuredCurve`, a list, or
    several by name. A full mark is at the strength, an open one at a larger load. Draws into the axes ``ax`` of
    matplotlib, if they are given. Returns the figure. Raises ParameterError for a column that was not recorded.
    """
    results = named_results("plot_curves", results)
    first = next(iter(results.values()))
    if not first.curves:
        raise ParameterError("plot_curves: the result has no curves")
    beside = _measured("plot_curves", measured)
    if x is None and y is None and not beside and len(first.panels[0].columns) > 1:
        figure, axes = given_or_new("plot_curves", ax, (6.4, 4.4))
        draw_curves(axes, results)
        return figure
    across, up = x or first.panels[0].over, y or first.panels[0].columns[0]
    for each in (*results.values(), *beside.values()):
        require("plot_curves", each.curves, across, up)
    results = _of_test(results, across)
    figure, axes = given_or_new("plot_curves", ax, (6.4, 4.4))
    for k, (name, result) in enumerate(results.items()):
        x_shown, y_shown = result.shown(across), result.shown(up)
        axes.plot(x_shown, y_shown, label=name, linewidth=1.5, color=color(k), linestyle=style(k))
    for k, result in enumerate(results.values()):  # after the names of all curves in the legend
        _mark_strength(axes, across, up, result, color=color(k))
    for k, (name, curve) in enumerate(beside.items()):  # in the units of ours
        x_shown, y_shown = (curve.curves[column] * result.quantity(column).factor for column in (across, up))
        axes.plot(x_shown, y_shown, label=name, linewidth=1.0, color=BLACK, linestyle=style(k))
    axes.set(xlabel=result.quantity(across).heading, ylabel=result.quantity(up).heading)
    axes.grid(alpha=0.25)
    if len(results) + len(beside) > 1:
        cylinders = any(curve.laterals > 1 for curve in beside.values())
        loaded = across == STRAIN and up in (STRESS, DEVIATOR)
        steeper = cylinders and loaded and any(in_plane_strain(each.specimen) for each in results.values())
        draw_legend(axes, title=PLATE if steeper else None)
    return figure


def _measured(where: str, curves: Any) -> dict[str, MeasuredCurve]:
    """Measured curves by name: by their files, with a number where several have the same."""
    if curves is None:
        return {}
    if isinstance(curves, Mapping):
        named = {str(name): curve for name, curve in curves.items()}
    else:
        listed = list(curves) if isinstance(curves, (list, tuple)) else [curves]
        files = [getattr(curve, "name", "") for curve in listed]
        named = {
            f"{file} ({files[:k].count(file) + 1})" if file in files[:k] else file: curve
            for k, (file, curve) in enumerate(zip(files, listed, strict=True))
        }
    if not named or not all(isinstance(curve, MeasuredCurve) for curve in named.values()):
        raise refusal(f"{where}: measured", curves, "a curve of read_curve, a list of them, or several by name")
    return named


def plot_result(result: Result) -> Figure:
    """The usual picture of a test next to the crack pattern."""
    figure = Figure(figsize=(11, 6.5), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.5, 1])
    draw_curves(left, {law_name(result.law): result})
    draw_cracks(right, result)
    count_below(right)
    return figure


def show_result(result: Result, **options: Any) -> None:
    """Open a window on the last frame: grains coloured by axial stress, broken contacts as lines."""
    import pyvista

    frame, mesh = result.frame("show", -1), result.mesh
    place = np.column_stack([mesh.nodes + frame.displacement, np.zeros(len(mesh.nodes))])
    grains = pyvista.PolyData.from_regular_faces(place, mesh.zones)
    grains.cell_data["stress yy (MPa)"] = frame.stress[mesh.zone_grain, 1] / 1e6
    plotter = pyvista.Plotter(**options)
    plotter.add_mesh(grains, cmap="cividis")
    broken, tensile = ~np.isnan(frame.bonds["broken_time"]), frame.bonds["mode"] < 0.5
    for chosen, paint in ((tensile, TENSILE), (~tensile, SHEAR)):
        interfaces = result.interfaces[np.flatnonzero(broken & chosen) % len(result.interfaces)]
        if len(interfaces):
            lines = pyvista.line_segments_from_points(place[interfaces[:, :2].ravel()])
            plotter.add_mesh(lines, color=paint, line_width=3)
    plotter.view_xy()
    plotter.show()


# --- of a laboratory report ------------------------------------------------------------------------------------------


def plot_report_curves(results: Mapping[str, Result]) -> Figure:
    """What the test measured, broken contact points, and energies."""
    first = next(iter(results.values()))
    along = first.course
    panels = [*first.panels]
    if not any(set(OF_MODE) <= set(panel.columns) for panel in panels):
        panels.append(Panel(along, [*OF_MODE], "broken contact points"))
    if any(np.isfinite(result.curves.get(STABILITY, np.zeros(0))).any() for result in results.values()):
        panels.append(Panel(along, [STABILITY]))
    if len(results) == 1:  # those of several laws cannot be told apart
        kinds = [ENERGY + kind for kind in ENERGIES if first.curves[ENERGY + kind].any()]
        panels += [Panel(along, kinds, "energy")] if kinds else []
    figure, places = grid(len(panels), 2, (10, 3.4 * math.ceil(len(panels) / 2)))
    for axes, panel in zip(places, panels, strict=True):
        _draw(axes, panel, results)
    if len(results) > MOST_INSIDE:
        draw_legend(next(axes for axes, panel in zip(places, panels, strict=True) if len(panel.columns) == 1))
    return figure


def _draw(axes: Axes, panel: Panel, results: Mapping[str, Result]) -> None:
    several, many = len(results) > 1, len(panel.columns) > 1
    results = _of_test(results, panel.over)
    for k, (name, result) in enumerate(results.items()):
        for j, column in enumerate(panel.columns):
            words = [name] * several + [result.quantity(column).words.removeprefix("energy ")] * many
            if len(results) > MOST_INSIDE and many:  # what the lines of each mean is said once
                words = words[1:] if k == 0 else []
            label = ", ".join(words)
            look: dict[str, Any] = {"color": OF_MODE.get(column, color(j))}
            if several:
                look = {"color": color(k), "marker": marker(k), "markevery": EVERY, "markersize": 4}
            x, y = map(result.shown, (panel.over, column))
            axes.plot(x, y, linestyle=style(j), linewidth=1.3, label=label or None, **look)
            _mark_strength(axes, panel.over, column, result, color=look["color"])
    label_panel(axes, panel, result)
    axes.xaxis.set_major_locator(MaxNLocator(5))
    if set(panel.columns) <= set(OF_MODE):
        axes.yaxis.set_major_locator(MaxNLocator("auto", integer=True))
        axes.set_ylim(top=max(1.0, axes.get_ylim()[1]))
    cut = _fit_before_peak(axes, panel, results)
    if (several and len(results) <= MOST_INSIDE) or many:
        axes.legend(frameon=False, fontsize="small", loc="upper left" if cut else "best")


def _failure(result: Result, column: str, over: str) -> Borne | None:
    """The failure of a load over its deformation, None for other columns: that of the run, or where a test's own is.

    The summary of a test of several stages may judge one of them alone, and find that nothing failed there.
    """
    strength = result.summary.get("strength", 0.0)
    if isinstance(strength, Real) and math.isnan(strength):
        return None
    found = borne_in(result.curves) if (column, over) in LOADS else None
    own = np.flatnonzero(result.curves[column] == result.summary.get("strength"))
    if found is None or not len(own) or found.at in own:
        return found
    return attrs.evolve(found, failed=True, at=int(own[0]))


def _mark_strength(
    axes: Axes, over: str, column: str, result: Result, *, is_named: bool = True, marker: str = "o", **look: Any
) -> None:
    """A full mark at the first failure, an open one at a largest load above it; with their names for the legend."""
    found = _failure(result, column, over)
    if found is None or not found.failed or is_whole(result):
        return
    named = {line.get_label() for line in axes.lines}
    marks = [(found.at, "full", "strength"), (found.largest, "none", "largest load")]
    look = {"markersize": 6, "linestyle": "none", **look}
    for at, filling, words in marks[: 1 + (found.largest != found.at)]:
        x, y = (result.shown(name)[at] for name in (over, column))
        label = words if is_named and words not in named else None
        axes.plot(x, y, marker=marker, fillstyle=filling, label=label, **look)


def _fit_before_peak(axes: Axes, panel: Panel, results: Mapping[str, Result]) -> bool:
    """Where strains after the peak are far larger than before, show those before, and say what is cut off."""
    if panel.over != STRAIN or LATERAL_STRAIN not in panel.columns:
        return False
    before, every = [], []
    for result in results.values():
        found = borne_in(result.curves)
        peak = 1 + (found.at if found else 0)
        for column in panel.columns:
            values = result.shown(column)
            before.append((values[:peak].min(), values[:peak].max()))
            every.append((values.min(), values.max()))
    low, high = np.min(before, axis=0)[0], np.max(before, axis=0)[1]
    least, most = np.min(every, axis=0)[0], np.max(every, axis=0)[1]
    room = high - low
    cut = bool(room > 0 and most - least > FAR * room)
    if cut:
        axes.set_ylim(max(least, low - 0.1 * room), min(most, high + 0.6 * room))
        unit = result.quantity(panel.over).unit_shown
        ends = f"{least:.3g} to {most:.3g}" if least < low - 0.1 * room else f"to {most:.3g}"
        axes.set_title(f"up to the strength; then {ends} {unit}", fontsize="small")
    return cut
