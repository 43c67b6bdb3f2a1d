"""Pictures of cracks: on the specimen at one moment, of several results at one scale, and moving."""

from __future__ import annotations

import math
import os
import textwrap
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import Collection, LineCollection, PolyCollection
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.transforms import offset_copy

from grainlaw.arguments import checked
from grainlaw.columns import TIME
from grainlaw.drawing.figure import Figure, LengthUnit, given_or_new, grid, length_unit, to_scale
from grainlaw.drawing.grains import phase_legend
from grainlaw.drawing.palette import BLUE, VERMILLION
from grainlaw.fields import checked_whole_number
from grainlaw.messages import refusal
from grainlaw.region import Region
from grainlaw.results.archive import law_name
from grainlaw.results.files import write_atomically
from grainlaw.results.frames import Frame
from grainlaw.results.result import Cracks, Result, contact_segments

FAR = 0.3  #: of the larger side of a specimen: as far around it grains are shown
MARGIN = 0.03  #: of the height, around it
MOST_ACROSS = 6  #: panels in a row
BELOW = 32  #: points, for the words of an axis
DPI = 110  #: of an animation
TITLE = 0.1  #: inch, a letter of a title
TENSILE, SHEAR = VERMILLION, BLUE
WIDTHS = {"tensile": 1.0, "shear": 1.8}  #: points: told apart on a grey page
GRAIN, RIM = "#efece4", "#b9b2a3"
PALE = 0.45  #: of the colour of a mineral, so that cracks are seen on it
ROUND = (1, 2, 5)


def unit_of(*results: Result) -> LengthUnit:
    """The unit of lengths of one picture of all of them."""
    return length_unit(*(result.specimen.grains.vertices for result in results))


def draw_cracks(
    axes: Axes, result: Result, frame: int = -1, *, phases: bool = False, unit: LengthUnit | None = None
) -> None:
    """Broken contact points on the deformed specimen: tensile thin and orange, shear thick and blue.

    With ``phases`` the grains are in the colours of their minerals.
    Without frames they are drawn on the outline of the specimen before the test.
    """
    unit = unit or unit_of(result)
    if not result.frames and frame == -1:
        draw_stored_cracks(axes, result, unit)
        return
    moment = result.frame("plot_cracks", frame)
    lines = draw_deformed(axes, result, moment, unit, phases=phases)
    broken = ~np.isnan(moment.bonds["broken_time"])
    draw_modes(axes, lines[broken], moment.bonds["mode"][broken] < 0.5)
    to_scale(axes, unit)


def draw_deformed(
    axes: Axes, result: Result, moment: Frame, unit: LengthUnit, *, phases: bool = False,
    fills: Mapping[str, Any] | None = None,
) -> np.ndarray:  # fmt: skip
    """Draw the deformed grains; (p, 2, 2) in the unit, the two ends of what belongs to each contact point.

    Grains have one colour, with ``phases`` those of their minerals; ``fills`` say other ones for the zones.
    """
    place = (result.mesh.nodes + moment.displacement) * unit.factor
    parts = [(np.arange(len(result.mesh.zones)), fills or {"facecolor": GRAIN, "edgecolor": GRAIN})]
    if phases and (minerals := phase_legend(result.specimen.grains)):
        of, numbers = result.specimen.grains.phase[result.mesh.zone_grain], np.unique(result.specimen.grains.phase)
        paints = [tuple(1 - PALE * (1 - np.array(each.get_facecolor()))) for each in minerals]
        parts = [
            (np.flatnonzero(of == k), {"facecolor": paint, "edgecolor": paint, "label": each.get_label()})
            for k, paint, each in zip(numbers, paints, minerals, strict=True)
        ]
    for zones, look in parts:
        axes.add_collection(PolyCollection(place[result.mesh.zones[zones]], linewidth=0.2, **look))
    axes.add_collection(LineCollection(list(place[outlines(result)]), colors=RIM, linewidths=0.35))
    return contact_segments(place, result.interfaces)


def outlines(result: Result) -> np.ndarray:
    """(k, 2) node pairs of the boundaries of all grains: edges that belong to one zone only."""
    zones = result.mesh.zones
    edges = zones[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    ordered = np.sort(edges, axis=1)
    _, first, times = np.unique(ordered[:, 0] * len(result.mesh.nodes) + ordered[:, 1], True, False, True)
    return edges[first[times == 1]]


def count_below(axes: Axes) -> None:
    """What has a label, as the number of cracks of each mode, below the picture."""
    below = offset_copy(axes.transAxes, axes.get_figure(root=True), y=-BELOW, units="points")
    look: dict[str, Any] = {"ncols": 2, "frameon": False, "handlelength": 1.2}
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, 0.0), bbox_transform=below, **look)


@checked
def plot_cracks(
    result: Result, frame: int = -1, *, title: str | None = None, phases: bool = False, ax: Any = None
) -> Figure:
    """Draw the cracks on the deformed specimen at one frame, counted from the end if negative.

    Tensile cracks are thin and orange, shear cracks thick and blue; with ``phases`` they lie on the minerals. Draws
    into the axes ``ax`` of matplotlib, if they
    are given. Returns the figure. A result without frames shows its cracks on the outline of the specimen before the
    test. Raises ParameterError for a frame that is not there.
    """
    width, height = np.ptp(result.specimen.grains.vertices, axis=0)
    figure, axes = given_or_new("plot_cracks", ax, (min(10.0, 6.5 * width / height + 1.6), 8.0))
    draw_cracks(axes, result, frame, phases=phases)
    count_below(axes)
    axes.set_title(law_name(result.law) if title is None else title)
    return figure


@checked
def side_by_side(results: Any, frame: int = -1, *, columns: int | None = None) -> Figure:
    """Draw the cracks of several results beside each other, all at one scale and in the same colours.

    ``results`` are results by name, as a comparison or a dictionary, or a list of results, named by their laws. At most
    ``columns`` stand in one row. Returns the figure. Raises ParameterError for a frame that is not there.
    """
    if columns is not None:
        checked_whole_number("side_by_side: columns", columns, at_least=1)
    results = named_results("side_by_side", results)
    figure, panels, corners = _panels(results, dict.fromkeys(results, frame), columns)
    unit = unit_of(*results.values())
    for name, axes in panels.items():
        draw_cracks(axes, results[name], frame, unit=unit)
        fit(axes, *corners)
        counts = ", ".join(text.replace(": ", " ") for text in axes.get_legend_handles_labels()[1])
        axes.set_title(f"{_in_lines(name, panels)}\n{counts}", fontsize="medium")
        axes.label_outer()
    label_cracks(figure)
    return figure


def _panels(
    results: Mapping[str, Result], frames: Mapping[str, int], columns: int | None
) -> tuple[Figure, dict[str, Axes], np.ndarray]:
    """A figure with axes for each result at its frame, and the corners (2, 2) of what they all show, in their unit."""
    unit = unit_of(*results.values())
    low, high = hull([box(result, [frames[name]], unit) for name, result in results.items()])
    wide, tall = high - low
    across = min(columns or MOST_ACROSS, len(results))
    down = math.ceil(len(results) / across)
    each = float(np.clip(6.0 * wide / tall, 1.8, max(1.8, 13.0 / across)))
    more = max(_wrapped(name, each).count("\n") for name in results)  # lines of a title
    size = each * across + 0.8, (each * tall / wide + 0.6 + 0.22 * more) * down + 0.7
    figure, panels = grid(len(results), across, size)
    return figure, dict(zip(results, panels, strict=True)), np.stack([low, high])


def pressures_side_by_side(results: Mapping[str, Result]) -> Figure | None:
    """Draw the pressure of a fluid in the cracks of several results, each at its last frame with one; None without."""

    def is_wet(moment: Frame) -> bool:
        return bool(np.any(moment.bonds.get("fluid_pressure", 0.0) > 0))

    def draw(axes: Axes, result: Result, moment: Frame, unit: LengthUnit) -> Collection:
        lines, pressure = draw_deformed(axes, result, moment, unit), moment.bonds["fluid_pressure"] / 1e6
        full = pressure > 0
        return LineCollection(list(lines[full]), array=pressure[full], cmap="viridis", linewidths=2.0)

    return _last_side_by_side(results, is_wet, draw, "pressure of the fluid (MPa)", low=0.0)


def temperatures_side_by_side(results: Mapping[str, Result]) -> Figure | None:
    """Draw the temperature of zones of several results, each at its last frame in which it is uneven; None without."""

    def is_uneven(moment: Frame) -> bool:
        return bool(np.ptp(moment.zones.get("temperature", 0.0)) > 0)

    def draw(axes: Axes, result: Result, moment: Frame, unit: LengthUnit) -> Collection:
        place = (result.mesh.nodes + moment.displacement) * unit.factor
        return PolyCollection(place[result.mesh.zones], array=moment.zones["temperature"], cmap="inferno")

    return _last_side_by_side(results, is_uneven, draw, "temperature (°C)")


def _last_side_by_side(
    results: Mapping[str, Result], shows: Callable[[Frame], bool], draw: Callable[..., Collection], label: str,
    low: float | None = None,
) -> Figure | None:  # fmt: skip
    """What is drawn of results, each at its last frame that shows it, in the same colours from ``low`` on, if given."""
    every = {name: [k for k, frame in enumerate(result.frames) if shows(frame)] for name, result in results.items()}
    frames = {name: numbers[-1] for name, numbers in every.items() if numbers}
    if not frames:
        return None
    shown = {name: results[name] for name in frames}
    figure, panels, corners = _panels(shown, frames, None)
    unit = unit_of(*shown.values())
    drawn = {name: draw(panels[name], result, result.frames[frames[name]], unit) for name, result in shown.items()}
    values = np.concatenate([np.asarray(each.get_array()) for each in drawn.values()])
    for name, axes in panels.items():
        drawn[name].set_clim(float(values.min()) if low is None else low, float(values.max()))
        axes.add_collection(drawn[name])
        to_scale(axes, unit)
        fit(axes, *corners)
        axes.set_title(f"{_in_lines(name, panels)}\n{how_far(shown[name], frames[name])}", fontsize="medium")
        axes.label_outer()
    figure.colorbar(drawn[name], ax=list(panels.values()), label=label, shrink=0.6)
    return figure


def _in_lines(name: str, panels: Mapping[str, Axes]) -> str:
    """A name in lines as wide as one of the panels."""
    axes = next(iter(panels.values()))
    width = axes.figure.figure.get_figwidth() / axes.get_subplotspec().get_gridspec().ncols  # type: ignore[union-attr]
    return _wrapped(name, width)


def _wrapped(name: str, width: float) -> str:
    """A name in lines of a width (inch)."""
    return textwrap.fill(name, max(int(width / TITLE), 8))


def named_results(where: str, results: Any) -> dict[str, Result]:
    """Results by name: by their laws, with a number where several have the same law."""
    if isinstance(results, Result):
        results = [results]
    named: dict[str, Result] = {}
    if isinstance(results, Mapping):
        named = {
            ", ".join(map(str, name)) if isinstance(name, tuple) else str(name): result
            for name, result in results.items()
        }
    elif isinstance(results, (list, tuple)) and all(isinstance(each, Result) for each in results):
        for each in results:
            name = law_name(each.law)
            taken = sum(other.split(" (")[0] == name for other in named)
            named[f"{name} ({taken + 1})" if taken else name] = each
    if not named or not all(isinstance(each, Result) for each in named.values()):
        raise refusal(f"{where}: results", results, "results by name, or a list of at least one result")
    return named


def animate(result: Result, file: str | os.PathLike[str], per_second: float) -> None:
    """See :meth:`Result.animate`."""
    from matplotlib.animation import FFMpegWriter, PillowWriter

    path = Path(file)
    writers: dict[str, Any] = {".gif": PillowWriter, ".mp4": FFMpegWriter}
    if path.suffix.lower() not in writers:
        raise refusal("animate: file", str(file), "a file whose name ends in .gif or .mp4")
    writer = writers[path.suffix.lower()]
    if not writer.isAvailable():
        raise refusal(
            "animate: file", str(file), "a .gif, because the program ffmpeg, which makes .mp4, is not installed"
        )
    result.frame("animate", -1)
    every = range(len(result.frames))
    low, high = box(result, every, unit_of(result))
    wide, tall = (high - low) * min(6.5 / (high - low)[1], 10 / (high - low)[0])  # inches
    width, height = max(3.2, wide + 1.2), max(2.2, tall + 1.2)
    figure = Figure(figsize=(width, height), dpi=DPI)
    figure.subplots_adjust(left=0.75 / width, right=1 - 0.25 / width, bottom=0.85 / height, top=1 - 0.35 / height)
    axes = figure.subplots()

    def write(part: Path) -> None:
        film = writer(fps=per_second)
        with film.saving(figure, str(part), DPI):
            for k in every:
                axes.clear()
                draw_cracks(axes, result, k)
                fit(axes, low, high)
                count_below(axes)
                axes.set_title(how_far(result, k))
                film.grab_frame()

    write_atomically(path, write)


def how_far(result: Result, frame: int) -> str:
    """How far the test is at a frame: what its first panel is drawn over, or the time where that has not begun."""
    time = result.frames[frame].time
    if result.curves:
        look = result.quantity(result.panels[0].over)
        value = np.interp(time, result.curves[TIME], result.curves[look.name])
        if np.isfinite(value):
            return f"{look.words} {look.with_unit(float(value))}"
    return f"time {time * 1e3:.4g} ms"


# --- without frames --------------------------------------------------------------------------------------------------


def crack_lines(cracks: Cracks) -> np.ndarray:
    """(k, 2, 2) m, both ends of each crack on the deformed specimen."""
    half = cracks.length[:, None] / 2 * np.column_stack([np.cos(cracks.orientation), np.sin(cracks.orientation)])
    return np.stack([cracks.position - half, cracks.position + half], axis=1)


def draw_stored_cracks(axes: Axes, result: Result, unit: LengthUnit, title: str = "") -> None:
    """Cracks where they lie on the deformed specimen, on the outline of the specimen before the test."""
    for region in result.specimen.grains.regions:
        axes.add_patch(PathPatch(_path(region, unit), facecolor=GRAIN, edgecolor=RIM, linewidth=0.8))
    draw_modes(axes, crack_lines(result.cracks) * unit.factor, result.cracks.tensile)
    to_scale(axes, unit)
    if title:
        axes.set_title(title, fontsize=9)


def draw_modes(axes: Axes, lines: np.ndarray, tensile: np.ndarray) -> None:
    """Cracks as lines (k, 2, 2) by their mode, tensile thin and shear thick, each with its number."""
    for name, chosen, color in (("shear", ~tensile, SHEAR), ("tensile", tensile, TENSILE)):
        label = f"{name}: {int(chosen.sum())}"
        axes.add_collection(
            LineCollection(list(lines[chosen]), colors=color, linewidths=WIDTHS[name], label=label, capstyle="round")
        )


def label_cracks(figure: Figure) -> None:
    """A legend of the modes below all panels."""
    handles = [
        Line2D([], [], color=color, linewidth=WIDTHS[name] + 0.5, label=name)
        for name, color in (("tensile", TENSILE), ("shear", SHEAR))
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False, fontsize=9)


def round_below(value: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is not above a value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(k * power for k in ROUND if k * power <= value * (1 + 1e-9)))


def scale_bar(axes: Axes, width: float, unit: LengthUnit) -> None:
    """A bar of a round length, about a third of a width (m), below the drawing."""
    length = round_below(width / 3)
    left, bottom = axes.get_xlim()[0], axes.get_ylim()[0]
    start = left + (width - length) / 2 * unit.factor
    ends = [start, start + length * unit.factor]
    axes.plot(ends, [bottom] * 2, color="black", linewidth=2, clip_on=False, solid_capstyle="butt")
    words = f"{length * unit.factor:g} {unit.name}"
    axes.annotate(
        words, (np.mean(ends), bottom), (0, -4), textcoords="offset points", ha="center", va="top",
        fontsize=8, annotation_clip=False,
    )  # fmt: skip


def _path(region: Region, unit: LengthUnit) -> Outline:
    """Outline and holes as one path."""
    rings = [np.concatenate([ring, ring[:1]]) * unit.factor for ring in (region.outline, *region.holes)]
    codes = [[Outline.MOVETO] + [Outline.LINETO] * (len(ring) - 2) + [Outline.CLOSEPOLY] for ring in rings]
    return Outline(np.concatenate(rings), np.concatenate(codes))


# --- one scale -------------------------------------------------------------------------------------------------------


def box(result: Result, frames: Sequence[int], unit: LengthUnit) -> np.ndarray:
    """(2, 2) in the unit, the corners of what is shown at some frames; grains that flew far away are left out."""
    corners = result.specimen.grains.vertices
    low, high = corners.min(axis=0), corners.max(axis=0)
    room = FAR * float((high - low).max())
    ends = [np.stack([low, high])]
    if result.frames:
        places = (result.mesh.nodes + result.frame("plot_cracks", k).displacement for k in frames)
        ends += [np.clip([place.min(axis=0), place.max(axis=0)], low - room, high + room) for place in places]
    return hull(ends) * unit.factor


def hull(boxes: Sequence[np.ndarray]) -> np.ndarray:
    """(2, 2) the corners of what holds all boxes."""
    return np.stack([np.min([each[0] for each in boxes], axis=0), np.max([each[1] for each in boxes], axis=0)])


def fit(axes: Axes, low: np.ndarray, high: np.ndarray) -> None:
    """Show what lies between two corners, with a little room around it."""
    room = MARGIN * float((high - low).max())
    axes.set(xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room))
