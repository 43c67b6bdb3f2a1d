"""What pictures are drawn on. Imported where it draws, for matplotlib takes long to load."""

from __future__ import annotations

import io
import math
import textwrap
from typing import Any, NamedTuple, cast

import matplotlib.figure
import numpy as np
from matplotlib.axes import Axes

from grainlaw.messages import refusal

MOST_INSIDE = 6  #: entries of a legend among the curves
LONGEST = 40  #: letters of a line of one below them
LETTER = 0.075  #: inch
THIN = 0.2  #: a side over the other one, below which there is no room for many numbers along it


class Figure(matplotlib.figure.Figure):
    """A figure of matplotlib that a notebook shows by itself: without pyplot, which keeps every figure in memory."""

    def _repr_png_(self) -> bytes:
        stream = io.BytesIO()
        self.savefig(stream, format="png")
        return stream.getvalue()


def given_or_new(where: str, ax: Any, size: tuple[float, float]) -> tuple[Figure, Axes]:
    """The axes ``ax`` and their figure; or those of a new figure of a size (inch).

    Raises ParameterError, which begins with ``where``, for what is no axes of matplotlib.
    """
    if ax is None:
        figure = Figure(figsize=size, layout="constrained")
        return figure, figure.subplots()
    if not isinstance(ax, Axes):
        raise refusal(f"{where}: ax", ax, "axes of matplotlib")
    return cast(Figure, ax.figure.figure), ax  # that of a subfigure is the whole figure


def draw_legend(axes: Axes, **look: Any) -> None:
    """The legend of axes: among the curves, or below the picture where it has many entries."""
    lines, names = axes.get_legend_handles_labels()
    if len(names) <= MOST_INSIDE or axes.figure.get_layout_engine() is None:
        axes.legend(frameon=False, **look)
        return
    names = [textwrap.fill(name, LONGEST) for name in names]
    longest = max(len(line) for name in names for line in name.split("\n"))
    across = max(1, int(axes.figure.figure.get_figwidth() / (LETTER * (longest + 8))))
    below = {"ncols": across, "loc": "outside lower center", **{k: v for k, v in look.items() if k != "loc"}}
    axes.figure.figure.legend(lines, names, frameon=False, **(below | {"fontsize": "small"}))


def grid(count: int, across: int, size: tuple[float, float]) -> tuple[Figure, list[Axes]]:
    """A new figure of a size (inch), and its panels, so many of them, ``across`` in a row."""
    figure = Figure(figsize=size, layout="constrained")
    panels = list(figure.subplots(math.ceil(count / across), across, squeeze=False).ravel())
    for axes in panels[count:]:
        axes.remove()
    return figure, panels[:count]


class LengthUnit(NamedTuple):
    """In what lengths are drawn."""

    factor: float  #: a length in m times this is the length that is drawn
    name: str


def length_unit(*vertices: np.ndarray) -> LengthUnit:
    """For one picture of all that has these vertices (n, 2) m: mm where it is smaller than a metre, else m."""
    is_small = max(float(np.ptp(places, axis=0).max()) for places in vertices) < 1
    return LengthUnit(1e3, "mm") if is_small else LengthUnit(1.0, "m")


def height_of(width: float, height: float, room: float, most: float) -> float:
    """Inch of a picture of a specimen of this size (m), with ``room`` around it, at ``most``: a flat one is no page."""
    return min(most, max(most * height / width + room, 1.5 * room))


def to_scale(axes: Axes, unit: LengthUnit) -> None:
    """Show all that was drawn, with equal scales of x and y."""
    axes.set_aspect("equal")
    axes.autoscale_view()
    wide, tall = axes.dataLim.width, axes.dataLim.height
    for axis, size, other in (("x", wide, tall), ("y", tall, wide)):
        if size < THIN / 2 * other:  # numbers would lie on each other
            end = float(axes.dataLim.max[int(axis == "y")])
            axes.set(**{f"{axis}ticks": [end], f"{axis}ticklabels": [f"{end:.3g}"]})
        elif size < THIN * other:
            axes.locator_params(axis=axis, nbins=2)  # type: ignore[arg-type]
    axes.set(xlabel=f"x ({unit.name})", ylabel=f"y ({unit.name})")
