"""Pictures of curves (matplotlib), and a window with the specimen (pyvista)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import attrs
import numpy as np
from matplotlib.axes import Axes

from grainlaw.arguments import checked
from grainlaw.columns import (
    ENERGIES,
    ENERGY,
    LATERAL_STRAIN,
    LOAD,
    SHARED,
    SHEAR_CRACKS,
    STABILITY,
    STRAIN,
    STRESS,
    TENSILE_CRACKS,
    TIME,
    VOLUMETRIC_STRAIN,
    course,
    is_of_every_test,
    require,
)
from grainlaw.drawing.figure import Figure, given_or_new
from grainlaw.drawing.palette import color, marker, style
from grainlaw.fields import ParameterError
from grainlaw.quantity import Quantity
from grainlaw.results.archive import law_name
from grainlaw.results.figures.cracks import SHEAR, TENSILE, count_below, draw_cracks, named_results
from grainlaw.results.means import Samples
from grainlaw.results.result import Result
from grainlaw.strength import LOADS, borne_in

EVERY = 0.12  #: of a picture's width between two markers
FAR = 3.0  #: ranges before the peak: curves that go farther after it are cut off
WAVES = ("incident", "reflected", "transmitted")  #: columns of a specimen between bars
OF_MODE = {TENSILE_CRACKS: TENSILE, SHEAR_CRACKS: SHEAR}


def require_stress_and_strain(results: Mapping[Any, Result]) -> None:
    """Raise ParameterError for a test that does not record what is drawn here."""
    for result in results.values():
        require("a plot of stress over strain (write_report draws other columns)", result.curves, STRAIN, STRESS)


def draw_curves(axes: Axes, results: Mapping[str, Result]) -> None:
    """Axial stress over axial strain; a full mark at the strength, an open one at a largest stress above it."""
    require_stress_and_strain(results)
    for k, (name, result) in enumerate(results.items()):
        strain, stress = result.curves[STRAIN] * 100, result.curves[STRESS] / 1e6
        found = borne_in(result.curves)
        failed = found is not None and found.failed
        look: dict[str, Any] = {"color": color(k), "marker": marker(k), "markersize": 6}
        at = [found.at] if found and failed else []
        axes.plot(strain, stress, label=name, linewidth=1.6, linestyle=style(k), markevery=at, **look)
        if found and failed and stress[found.largest] > stress[found.at]:
            axes.plot(strain[found.largest], stress[found.largest], linestyle="none", fillstyle="none", **look)
    label_stress_and_strain(axes)
    axes.legend(frameon=False)


def label_stress_and_strain(axes: Axes) -> None:
    """Axes that begin at zero, for axial stress in MPa over axial strain in %."""
    axes.set(xlabel="axial strain (%)", ylabel="axial stress (MPa)", xlim=(0, None), ylim=(0, None))
    axes.grid(alpha=0.25)


def label_cracks_and_strain(axes: Axes) -> None:
    """Axes for the number of broken contact points over axial strain in %."""
    axes.set(xlabel="axial strain (%)", ylabel="broken contact points")
    axes.grid(alpha=0.25)
    if axes.lines:
        axes.legend(frameon=False, fontsize="small")


def draw_crack_numbers(axes: Axes, k: int, name: str, results: Sequence[Result]) -> None:
    """Broken contact points over strain of law number ``k`` (one result or several): tensile solid, shear dashed."""
    for column, line, fill in ((TENSILE_CRACKS, "-", "full"), (SHEAR_CRACKS, "--", "none")):
        if not any(each.curves[column][-1] for each in results):
            continue
        marks: dict[str, Any] = {"marker": marker(k), "fillstyle": fill, "markevery": EVERY, "markersize": 4}
        for number, result in enumerate(results):
            label = f"{name}, {column.split('_')[0]}" if number == 0 else None
            strain, count = result.curves[STRAIN] * 100, result.curves[column]
            axes.plot(strain, count, line, color=color(k), linewidth=1.0, label=label, **marks)


def plot_stress_and_strain(results: Mapping[str, Result]) -> Figure:
    """Stress-strain curves of several laws, and how their cracks accumulate."""
    figure = Figure(figsize=(8, 7), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    draw_curves(upper, results)
    upper.set_xlabel("")
    for k, (name, result) in enumerate(results.items()):
        draw_crack_numbers(lower, k, name, [result])
    label_cracks_and_strain(lower)
    return figure


def plot_samples(samples: Samples) -> Figure:
    """Stress-strain curves of each law on all samples, and how cracks accumulate.

    A cross is at the mean of the peaks of a law, and as long as their range.
    """
    figure = Figure(figsize=(8, 7), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    for k, (name, results) in enumerate(samples.items()):
        require_stress_and_strain(results)
        for number, result in enumerate(results.values()):
            look: dict[str, Any] = {"color": color(k), "linestyle": style(k), "linewidth": 0.8}
            label = name if number == 0 else None
            upper.plot(result.curves[STRAIN] * 100, result.curves[STRESS] / 1e6, label=label, **look)
        draw_crack_numbers(lower, k, name, list(results.values()))
        _draw_peaks(upper, list(results.values()), k)
    label_stress_and_strain(upper)
    upper.set_xlabel("")
    upper.legend(frameon=False, title="mean and range of the strengths", alignment="left")
    label_cracks_and_strain(lower)
    return figure


def _draw_peaks(axes: Axes, results: list[Result], k: int) -> None:
    found = [borne_in(result.curves) for result in results]
    places = [each.at for each in found if each is not None and each.failed]
    if len(places) < len(results):
        return
    strain, stress = (
        np.array([result.curves[name][at] * factor for result, at in zip(results, places, strict=True)])
        for name, factor in ((STRAIN, 100), (STRESS, 1e-6))
    )
    ranges = [[[each.mean() - each.min()], [each.max() - each.mean()]] for each in (strain, stress)]
    axes.errorbar(
        strain.mean(), stress.mean(), xerr=ranges[0], yerr=ranges[1], fmt=marker(k), color=color(k), markersize=6,
        linewidth=2, capsize=4, zorder=3,
    )  # fmt: skip


@checked
def plot_curves(results: Any, y: str | None = None, x: str | None = None, *, ax: Any = None) -> Figure:
    """Draw one column of the curves of one result or several over another, by their names in ``Result.curves``.

    Without names: what the test applies (stress or force) over how far it is (strain or displacement). ``results`` are
    as for :func:`side_by_side`, or one result. Draws into the axes ``ax`` of matplotlib, if they are given. Returns the
    figure. Raises ParameterError for a column that was not recorded.
    """
    results = named_results("plot_curves", results)
    first = next(iter(results.values())).curves
    if not first:
        raise ParameterError("plot_curves: the result has no curves")
    across, up = x or course(first), y or next(name for name in LOAD if name in first)
    for result in results.values():
        require("plot_curves", result.curves, across, up)
    figure, axes = given_or_new("plot_curves", ax, (6.4, 4.4))
    for k, (name, result) in enumerate(results.items()):
        look: dict[str, Any] = {"color": color(k), "linestyle": style(k)}
        axes.plot(result.shown(across), result.shown(up), label=name, linewidth=1.5, **look)
    axes.set(xlabel=course_heading(result.quantity(across)), ylabel=course_heading(result.quantity(up)))
    axes.grid(alpha=0.25)
    if len(results) > 1:
        axes.legend(frameon=False)
    return figure


def axes_of(result: Result) -> tuple[str, str]:
    """The columns of its usual picture: how far the test is, and what it applies."""
    return course(result.curves), next(name for name in LOAD if name in result.curves)


def course_heading(quantity: Quantity) -> str:
    """The words and unit of a column in pictures: stress and strain that a test does not name are along its axis."""
    is_axial = any(quantity == SHARED[name] for name in (STRAIN, STRESS))
    return f"axial {quantity.heading}" if is_axial else quantity.heading


def plot_result(result: Result) -> Figure:
    """Stress-strain curve next to the crack pattern."""
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


@attrs.frozen
class Panel:
    """Columns that are drawn over a column; several have common words for the axis."""

    over: str
    columns: Sequence[str]
    words: str = ""


#: the panels of a test: the first row of which it records all columns
CURVES = (
    (Panel("displacement", ["shear_stress"]), Panel("displacement", ["dilation"])),
    (Panel("opening", ["normal"]), Panel(STRAIN, [STRESS])),
    (Panel(STRAIN, [STRESS]), Panel(STRAIN, [VOLUMETRIC_STRAIN, LATERAL_STRAIN], "strain, extension positive")),
    (Panel(STRAIN, [STRESS]),),
    (Panel("deflection", ["force"]),),
)


def plot_report_curves(results: Mapping[str, Result]) -> Figure:
    """What the test measured, broken contact points, and energies."""
    curves = next(iter(results.values())).curves
    along = course(curves)
    panels = [*_panels(curves, along), Panel(along, [TENSILE_CRACKS, SHEAR_CRACKS], "broken contact points")]
    if any(np.isfinite(result.curves.get(STABILITY, np.zeros(0))).any() for result in results.values()):
        panels.append(Panel(along, [STABILITY]))
    if set(WAVES) <= set(curves):
        panels.append(Panel(TIME, WAVES, "stress of the waves in the bars"))
    if len(results) == 1:  # those of several laws cannot be told apart
        panels.append(Panel(along, [ENERGY + name for name in ENERGIES], "energy"))
    rows = (len(panels) + 1) // 2
    figure = Figure(figsize=(10, 3.4 * rows), layout="constrained")
    places = figure.subplots(rows, 2, squeeze=False).ravel()
    for axes, panel in zip(places, panels, strict=False):
        _draw(axes, panel, results)
    for axes in places[len(panels) :]:
        axes.remove()
    return figure


def _panels(curves: Mapping[str, np.ndarray], along: str) -> Sequence[Panel]:
    for panels in CURVES:
        if all(name in curves for panel in panels for name in (panel.over, *panel.columns)):
            return panels
    own = [name for name in curves if name != along and not is_of_every_test(name)]
    return [Panel(along, [name]) for name in own[:4]]


def _draw(axes: Axes, panel: Panel, results: Mapping[str, Result]) -> None:
    several, many = len(results) > 1, len(panel.columns) > 1
    for k, (name, result) in enumerate(results.items()):
        for j, column in enumerate(panel.columns):
            label = ", ".join([name] * several + [result.quantity(column).words.removeprefix("energy ")] * many)
            look: dict[str, Any] = {"color": OF_MODE.get(column, color(j))}
            if several:
                look = {"color": color(k), "marker": marker(k), "markevery": EVERY, "markersize": 4}
            x, y = map(result.shown, (panel.over, column))
            axes.plot(x, y, linestyle=style(j), linewidth=1.3, label=label or None, **look)
            _mark_strength(axes, panel, column, result, look["color"])
    across, up = (result.quantity(name) for name in (panel.over, panel.columns[0]))
    axes.set(xlabel=across.heading, ylabel=attrs.evolve(up, words=panel.words).heading if many else up.heading)
    axes.grid(alpha=0.25)
    cut = _fit_before_peak(axes, panel, results)
    if several or many:
        axes.legend(frameon=False, fontsize="small", loc="upper left" if cut else "best")


def _mark_strength(axes: Axes, panel: Panel, column: str, result: Result, paint: Any) -> None:
    """A full mark at the first failure, an open one at a largest load above it."""
    found = borne_in(result.curves) if (column, panel.over) in LOADS else None
    if found is None or not found.failed:
        return
    for at, filling in ((found.at, "full"), (found.largest, "none")):
        x, y = (result.shown(name)[at] for name in (panel.over, column))
        axes.plot(x, y, "o", color=paint, fillstyle=filling, markersize=6)


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
        axes.set_title(f"up to the strength; then to {most:.3g} {unit}", fontsize="small")
    return cut
