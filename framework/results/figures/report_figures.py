"""Figures of a laboratory report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
from matplotlib.axes import Axes

from grainlaw.columns import (
    ENERGIES,
    ENERGY,
    LATERAL_STRAIN,
    SHEAR_CRACKS,
    STABILITY,
    STRAIN,
    STRESS,
    TENSILE_CRACKS,
    VOLUMETRIC_STRAIN,
    course,
    is_of_every_test,
)
from grainlaw.drawing.figure import Figure
from grainlaw.drawing.palette import color, marker, style
from grainlaw.results.figures.cracks import SHEAR, TENSILE
from grainlaw.results.figures.curves import EVERY
from grainlaw.strength import LOADS, borne_in

if TYPE_CHECKING:
    from grainlaw.results.result import Result

FAR = 3.0  #: ranges before the peak: curves that go farther after it are cut off
COLORS = {TENSILE_CRACKS: TENSILE, SHEAR_CRACKS: SHEAR}


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
            look: dict[str, Any] = {"color": COLORS.get(column, color(j))}
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
