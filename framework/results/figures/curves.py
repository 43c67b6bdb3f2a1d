"""Pictures of curves and cracks (matplotlib), and a window with the specimen (pyvista)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from grainlaw.columns import SHEAR_CRACKS, STRAIN, STRESS, TENSILE_CRACKS, require
from grainlaw.results.archive import called
from grainlaw.results.figures.stored_cracks import GRAIN, RIM, SHEAR, TENSILE, draw_stored_cracks

if TYPE_CHECKING:
    from grainlaw.results.result import Result


def _outlines(result: Result) -> np.ndarray:
    """(k, 2) node pairs of the boundaries of all grains: edges that belong to one zone only."""
    zones = result.mesh.zones
    edges = zones[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    ordered = np.sort(edges, axis=1)
    _, first, times = np.unique(ordered[:, 0] * len(result.mesh.nodes) + ordered[:, 1], True, False, True)
    return edges[first[times == 1]]


def draw_cracks(axes: Axes, result: Result) -> None:
    """Broken contacts on the deformed specimen at the last frame: tensile red, shear blue.

    Without frames they are drawn on the outline of the specimen before the test.
    """
    if not result.frames:
        draw_stored_cracks(axes, result)
        _label_cracks(axes)
        return
    frame = result.frames[-1]
    place = (result.mesh.nodes + frame.displacement) * 1e3
    axes.add_collection(PolyCollection(place[result.mesh.zones], facecolor=GRAIN, edgecolor=GRAIN, linewidth=0.2))
    axes.add_collection(LineCollection(list(place[_outlines(result)]), colors=RIM, linewidths=0.35))
    ends = place[result.interfaces]
    first, second = (ends[:, 0] + ends[:, 2]) / 2, (ends[:, 1] + ends[:, 3]) / 2
    middle = (first + second) / 2
    lines = np.stack([np.concatenate([first, middle]), np.concatenate([middle, second])], axis=1)
    broken = ~np.isnan(frame.bonds["broken_time"])
    tensile = frame.bonds["mode"] < 0.5
    for chosen, color, name in ((broken & ~tensile, SHEAR, "shear"), (broken & tensile, TENSILE, "tensile")):
        label = f"{name}: {int(chosen.sum())}"
        cracks = LineCollection(list(lines[chosen]), colors=color, linewidths=1.2, label=label, capstyle="round")
        axes.add_collection(cracks)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("x (mm)")
    axes.set_ylabel("y (mm)")
    _label_cracks(axes)


def _label_cracks(axes: Axes) -> None:
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.08), ncols=2, frameon=False, handlelength=1.2)


def require_stress_and_strain(results: Mapping[Any, Result]) -> None:
    """Raise ParameterError for a test that does not record what is drawn here."""
    for result in results.values():
        require("a plot of stress over strain (write_report draws other columns)", result.curves, STRAIN, STRESS)


def draw_curves(axes: Axes, results: Mapping[str, Result]) -> None:
    """Axial stress over axial strain, the peak marked."""
    require_stress_and_strain(results)
    for name, result in results.items():
        strain, stress = result.curves[STRAIN] * 100, result.curves[STRESS] / 1e6
        (line,) = axes.plot(strain, stress, label=name, linewidth=1.6)
        if len(result.cracks):
            peak = int(np.argmax(stress))
            axes.plot(strain[peak], stress[peak], "o", color=line.get_color(), markersize=5)
    label_stress_and_strain(axes)
    axes.legend(frameon=False)


def label_stress_and_strain(axes: Axes) -> None:
    """Axes that begin at zero, for axial stress in MPa over axial strain in %."""
    axes.set_xlabel("axial strain (%)")
    axes.set_ylabel("axial stress (MPa)")
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.25)


def label_cracks_and_strain(axes: Axes) -> None:
    """Axes for the number of broken contact points over axial strain in %."""
    axes.set_xlabel("axial strain (%)")
    axes.set_ylabel("broken contact points")
    axes.grid(alpha=0.25)
    if axes.lines:
        axes.legend(frameon=False, fontsize="small")


def plot_curves(results: Mapping[str, Result]) -> Figure:
    """Stress-strain curves of several laws, and how their cracks accumulate."""
    figure = Figure(figsize=(8, 7), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    draw_curves(upper, results)
    upper.set_xlabel("")
    for k, (name, result) in enumerate(results.items()):
        strain = result.curves[STRAIN] * 100
        for column, style in ((TENSILE_CRACKS, "-"), (SHEAR_CRACKS, "--")):
            label = f"{name}, {column.split('_')[0]}"
            if result.curves[column][-1]:
                lower.plot(strain, result.curves[column], style, color=f"C{k}", linewidth=1.2, label=label)
    label_cracks_and_strain(lower)
    return figure


def plot_cracks(result: Result, title: str = "") -> Figure:
    """Crack pattern on the deformed specimen."""
    corners = result.specimen.grains.vertices
    low, high = corners.min(axis=0), corners.max(axis=0)
    width, height = high - low
    figure = Figure(figsize=(min(10.0, 6.5 * width / height + 1.6), 8.0), layout="constrained")
    axes = figure.subplots()
    draw_cracks(axes, result)
    axes.set_title(title or called(result.law))
    return figure


def plot_result(result: Result) -> Figure:
    """Stress-strain curve next to the crack pattern."""
    figure = Figure(figsize=(11, 6.5), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=[1.5, 1])
    draw_curves(left, {called(result.law): result})
    draw_cracks(right, result)
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
    broken = ~np.isnan(frame.bonds["broken_time"])
    for chosen, color in ((frame.bonds["mode"] < 0.5, TENSILE), (frame.bonds["mode"] >= 0.5, SHEAR)):
        interfaces = result.interfaces[np.flatnonzero(broken & chosen) % len(result.interfaces)]
        if len(interfaces):
            lines = pyvista.line_segments_from_points(place[interfaces[:, :2].ravel()])
            plotter.add_mesh(lines, color=color, line_width=3)
    plotter.view_xy()
    plotter.show()
