"""Pictures of curves (matplotlib), and a window with the specimen (pyvista)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from grainlaw.arguments import checked
from grainlaw.columns import LOAD, SHARED, SHEAR_CRACKS, STRAIN, STRESS, TENSILE_CRACKS, course, require
from grainlaw.drawing.figure import Figure, given_or_new
from grainlaw.drawing.palette import color, marker, style
from grainlaw.fields import ParameterError
from grainlaw.quantity import Quantity
from grainlaw.results.archive import law_name
from grainlaw.results.figures.cracks import SHEAR, TENSILE, count_below, draw_cracks, named_results
from grainlaw.results.means import Samples
from grainlaw.results.result import Result
from grainlaw.strength import borne_in

EVERY = 0.12  #: of a picture's width between two markers


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
