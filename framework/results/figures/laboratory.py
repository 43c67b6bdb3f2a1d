"""The picture of a laboratory report."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator

from grainlaw.columns import TIME
from grainlaw.drawing.figure import Figure, given_or_new, to_scale
from grainlaw.drawing.grains import FILLS
from grainlaw.drawing.palette import BLACK, BLUE, GREEN, ORANGE, PURPLE
from grainlaw.messages import refusal
from grainlaw.results.acoustic import KINDS, OPENS
from grainlaw.results.figures.cracks import GRAIN, RIM, SHEAR, TENSILE, WIDTHS, unit_of
from grainlaw.results.laboratory import Laboratory

THRESHOLDS: dict[str, tuple[str, str, Any]] = {
    "crack_closure": ("CC", BLUE, (0, (5, 4))),
    "crack_initiation_count": ("CI, cracks", GREEN, "-"),
    "crack_initiation_lateral": ("CI, lateral", ORANGE, "--"),
    "crack_initiation_volumetric": ("CI, volumetric", PURPLE, "-."),
    "crack_damage": ("CD", BLACK, ":"),
    "crack_damage_cylinder": ("CD, cylinder", BLACK, (0, (1, 4))),
}
MECHANISMS = dict(
    zip(KINDS, ((TENSILE, "o", WIDTHS["tensile"]), (SHEAR, "s", WIDTHS["shear"]), (GREEN, "v", 1.0)), strict=True)
)


def plot_laboratory(laboratory: Laboratory) -> Figure:
    """Curves with thresholds, growth of cracks, orientations; fragments, events, their mechanisms, energy lost.

    Of a result that was saved without frames what is found from them is left out.
    """
    figure = Figure(figsize=(18, 9.5), layout="constrained")
    drawn = [name for name in PANELS if laboratory.result.frames or name not in OF_FRAMES]
    for k, name in enumerate(drawn, 1):
        PANELS[name](figure.add_subplot(2, 4, k, projection="polar" if name == "rose" else None), laboratory)
    return figure


def plot_panel(laboratory: Laboratory, panel: str | None, ax: Any) -> Figure:
    """One panel; see :meth:`Laboratory.plot`."""
    if panel is None or panel not in PANELS:
        raise refusal("Laboratory.plot: panel", panel, ", ".join(PANELS))
    if panel != "rose":
        figure, axes = given_or_new("Laboratory.plot", ax, (5.4, 4.6))
    elif ax is None:
        figure = Figure(figsize=(5.4, 4.6), layout="constrained")
        axes = figure.add_subplot(projection="polar")
    elif isinstance(ax, PolarAxes):
        figure, axes = given_or_new("Laboratory.plot", ax, (0, 0))
    else:
        raise refusal("Laboratory.plot: ax", ax, "polar axes of matplotlib: figure.add_subplot(projection='polar')")
    PANELS[panel](axes, laboratory)
    return figure


def draw_thresholds(axes: Axes, laboratory: Laboratory) -> None:
    """Load over axial, lateral and volumetric strain up to the peak, extension positive."""
    path = laboratory.path
    if not np.isfinite(path.axial).any():
        words = "the test recorded no peak or no strains"
        axes.set_axis_off()
        axes.text(0.5, 0.5, words, ha="center", va="center", transform=axes.transAxes)
        return
    for values, label, style in (
        (path.axial, "axial", "-"), (path.lateral, "lateral", "--"), (path.volumetric, "volumetric", ":")
    ):  # fmt: skip
        axes.plot(values * 100, (path.load + path.confinement) / 1e6, style, color="#444444", label=label)
    for name, (label, color, style) in THRESHOLDS.items():
        stress = laboratory.value(name)
        if np.isfinite(stress):
            text = f"{label}: {stress / 1e6:.1f} MPa"
            axes.axhline(stress / 1e6, color=color, linestyle=style, linewidth=1.2, label=text)
    axes.set(xlabel="strain (%), extension positive", ylabel="axial stress (MPa)")
    axes.locator_params(axis="x", nbins=5)
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, fontsize="small", loc="lower left")


def _along(laboratory: Laboratory) -> tuple[np.ndarray, str]:
    """Values of the horizontal axis, and its label."""
    name = TIME if laboratory.result.begins else laboratory.result.course  # of the whole run
    return laboratory.result.shown(name), laboratory.result.quantity(name).heading


def draw_growth(axes: Axes, laboratory: Laboratory) -> None:
    """Length of cracks by mode."""
    along, label = _along(laboratory)
    for name, color, style in (("tensile", TENSILE, "-"), ("shear", SHEAR, "--")):
        axes.plot(along, laboratory.growth[f"{name}_length"] * 1e3, style, color=color, label=name)
    _from_zero(axes, label, "length of cracks (mm)")


def _from_zero(axes: Axes, x: str, y: str) -> None:
    """Begin at zero; of nothing but zeros show the axis, not a range that matplotlib invents."""
    axes.set(xlabel=x, ylabel=y, ylim=(0, None if axes.dataLim.y1 > 0 else 1))
    axes.grid(alpha=0.25)
    axes.legend(frameon=False)


def draw_rose(axes: Axes, laboratory: Laboratory) -> None:
    """Length of cracks by orientation, drawn in both directions; the failure plane as a line."""
    rose, plane = laboratory.rose, laboratory.plane
    middle, width = (rose.edges[1:] + rose.edges[:-1]) / 2, rose.edges[1] - rose.edges[0]
    for turn in (0, np.pi):
        label = ("tensile", "shear") if turn == 0 else (None, None)
        axes.bar(middle + turn, rose.tensile * 1e3, width, color=TENSILE, label=label[0])
        shear: dict[str, Any] = {"color": SHEAR, "hatch": "////", "edgecolor": "white", "linewidth": 0}
        axes.bar(middle + turn, rose.shear * 1e3, width, bottom=rose.tensile * 1e3, label=label[1], **shear)
    if np.isfinite(plane.angle):
        reach = float((rose.tensile + rose.shear).max()) * 1e3
        turned = float(np.degrees(plane.angle))
        leans = f" ({min(turned, 180 - turned):.0f}° to the x axis)" if turned > 90 else ""
        name = f"failure plane {turned:.0f}°{leans}, alignment {plane.strength:.2f}"
        axes.plot([plane.angle + np.pi, 0, plane.angle], [reach, 0, reach], "k--", linewidth=1.2, label=name)
    axes.set_xlabel("length of cracks by orientation (mm)")  # a title would lie on the mark of 90 degrees
    axes.set_rlabel_position(float(np.degrees(middle[np.argmin(rose.tensile + rose.shear)])))  # type: ignore[attr-defined]
    if not (rose.tensile + rose.shear).any():
        axes.set(xlabel="no cracks", yticks=[])
        return
    axes.set_yticks(MaxNLocator(3).tick_values(0, axes.get_ylim()[1])[1:-1])
    axes.legend(frameon=False, fontsize="small", loc="upper center", bbox_to_anchor=(0.5, -0.14))


def _draw_specimen(axes: Axes, laboratory: Laboratory, colors: str | np.ndarray) -> None:
    """The grains at the last frame, or before the test where there is none; a colour for all, or for each zone."""
    result = laboratory.result
    unit = unit_of(result)
    place = (result.mesh.nodes + (result.frames[-1].displacement if result.frames else 0.0)) * unit.factor
    axes.add_collection(PolyCollection(place[result.mesh.zones], facecolor=colors, edgecolor=colors, linewidth=0.3))
    ends = place[result.interfaces[:, :2]]
    axes.add_collection(LineCollection(list(ends), colors=RIM, linewidths=0.35))
    to_scale(axes, unit)


def draw_fragments(axes: Axes, laboratory: Laboratory) -> None:
    """Fragments of several grains in colours, the largest in the colour of grains, single grains white."""
    found = laboratory.fragments
    palette = np.array([GRAIN, *(FILLS[k % (len(FILLS) - 1)] for k in range(len(found) - 1))])
    palette[found.grains == 1] = "white"
    palette[0] = GRAIN
    _draw_specimen(axes, laboratory, palette[found.of_grain[laboratory.result.mesh.zone_grain]])
    several = int(np.count_nonzero(found.grains > 1))
    words = f"{len(found)} fragment{'s' * (len(found) != 1)}, {several} of several grains\n(single grains white)"
    axes.set_title(words, fontsize="medium")


def draw_events(axes: Axes, laboratory: Laboratory) -> None:
    """Acoustic events as circles whose area is their energy, with both planes of their sources, by mechanism."""
    events = laboratory.events
    _draw_specimen(axes, laboratory, GRAIN)
    if not len(events):
        axes.set_title("no acoustic events", fontsize="medium")
    else:
        size = 400 * events.energy / max(float(events.energy.max()), 1e-300)
        unit = unit_of(laboratory.result)
        x, y = (events.position * unit.factor).T
        lines = events.plane_lines * unit.factor
        for kind, (color, _, width) in MECHANISMS.items():
            chosen = events.kind == kind
            look: dict[str, Any] = {"facecolors": "none", "edgecolors": color, "linewidths": width}
            axes.scatter(x[chosen], y[chosen], s=size[chosen], **look)
            planes = list(lines[chosen & np.isfinite(lines).all(axis=(1, 2, 3))].reshape(-1, 2, 2))
            axes.add_collection(LineCollection(planes, colors=color, linewidths=0.6))
        axes.set_title(
            f"{len(events)} events, magnitude {np.nanmin(events.magnitude):.1f} to {np.nanmax(events.magnitude):.1f}\n"
            "(lines: both planes of a source)"
            if (events.energy > 0).any() else f"{len(events)} events without energy", fontsize="medium",
        )  # fmt: skip


def _of_events(laboratory: Laboratory) -> tuple[np.ndarray, str]:
    """Where events are on the horizontal axis, and its label."""
    along, label = _along(laboratory)
    return np.interp(laboratory.events.time, laboratory.result.curves[TIME], along), label


def draw_mechanisms(axes: Axes, laboratory: Laboratory) -> None:
    """Isotropic share of the moment of each event, its size by the moment: opening above, shear between, closing."""
    events, (along, label) = laboratory.events, _of_events(laboratory)
    size = 8 + 150 * np.nan_to_num(
        events.scalar_moment / max(float(np.nanmax(events.scalar_moment, initial=0)), 1e-300)
    )
    for kind, (color, marker, _) in MECHANISMS.items():
        chosen = events.kind == kind
        look: dict[str, Any] = {"marker": marker, "facecolors": "none", "edgecolors": color}
        axes.scatter(along[chosen], events.isotropic[chosen], size[chosen], **look)
        axes.scatter([], [], 30, label=f"{kind}: {int(chosen.sum())}", **look)
    axes.locator_params(axis="x", nbins=5)
    if not len(events) and len(course := _along(laboratory)[0]):
        axes.set_xlim(float(course[0]), float(course[-1]))
    for end in (-OPENS, OPENS):
        axes.axhline(end, color=RIM, linewidth=0.8)
    axes.set(xlabel=label, ylabel="isotropic share of the moment", ylim=(-1.05, 1.05))
    axes.legend(frameon=False, fontsize="small", loc="lower left")


def draw_moments(axes: Axes, laboratory: Laboratory) -> None:
    """Scalar moment of the events until then, by mechanism, for 1 m of thickness."""
    events, (along, label) = laboratory.events, _of_events(laboratory)
    course, _ = _along(laboratory)
    ends = np.array([course[0], course[-1]]) if len(course) else np.zeros(2)
    for kind, (color, _, _) in MECHANISMS.items():
        chosen = events.kind == kind
        sums = np.cumsum(np.nan_to_num(events.scalar_moment[chosen]))
        steps = np.concatenate([[0.0], sums, sums[-1:] if len(sums) else [0.0]]) / 1e3
        axes.step([ends[0], *along[chosen], ends[1]], steps, where="post", color=color, label=kind)
    _from_zero(axes, label, "scalar moment of events (kN m)")


def draw_lost(axes: Axes, laboratory: Laboratory) -> None:
    """Energy lost by contacts in opening and in slip, frame by frame."""
    result = laboratory.result
    time = np.array([frame.time for frame in result.frames])
    along, label = _along(laboratory)
    for name, color, style in (("opening", TENSILE, ".-"), ("slip", SHEAR, "x--")):
        sums = (float(laboratory.half_lengths @ frame.bonds[f"lost_{name}"]) for frame in result.frames)
        values = [laboratory.beyond_rounding(value) for value in sums]
        axes.plot(np.interp(time, result.curves[TIME], along), values, style, color=color, label=f"in {name}")
    _from_zero(axes, label, "energy lost by contacts (J/m)")


OF_FRAMES = ("fragments", "lost")
PANELS: dict[str, Callable[[Axes, Laboratory], None]] = {
    "thresholds": draw_thresholds, "growth": draw_growth, "rose": draw_rose, "fragments": draw_fragments,
    "events": draw_events, "mechanisms": draw_mechanisms, "moments": draw_moments, "lost": draw_lost,
}  # fmt: skip
