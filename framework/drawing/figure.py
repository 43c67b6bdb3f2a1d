"""What pictures are drawn on. Imported where it draws, for matplotlib takes long to load."""

from __future__ import annotations

import io
from typing import Any, cast

import matplotlib.figure
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter

from grainlaw.messages import refusal


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


LARGE = 1000.0  #: mm, from which lengths are shown in m


def to_scale(axes: Axes, unit: str = "mm") -> None:
    """Show all that was drawn, with equal scales of x and y; many mm with metres at the axes."""
    axes.set_aspect("equal")
    axes.autoscale_view()
    spans = [abs(high - low) for low, high in (axes.get_xlim(), axes.get_ylim())]
    if unit == "mm" and max(spans) >= LARGE:
        unit = "m"
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value / 1000:g}"))
    axes.set(xlabel=f"x ({unit})", ylabel=f"y ({unit})")
