"""Crack patterns of results without frames: lines on the outline of the specimen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path

from grainlaw.drawing.figure import Figure
from grainlaw.drawing.palette import BLUE, VERMILLION

if TYPE_CHECKING:
    from grainlaw.region import Region
    from grainlaw.results.result import Cracks, Result

TENSILE, SHEAR = VERMILLION, BLUE
WIDTHS = {"tensile": 1.0, "shear": 1.8}  #: points: told apart on a grey page
GRAIN, RIM = "#efece4", "#b9b2a3"
ROUND = (1, 2, 5)


def crack_lines(cracks: Cracks) -> np.ndarray:
    """(k, 2, 2) m, both ends of each crack on the deformed specimen."""
    half = cracks.length[:, None] / 2 * np.column_stack([np.cos(cracks.orientation), np.sin(cracks.orientation)])
    return np.stack([cracks.position - half, cracks.position + half], axis=1)


def draw_stored_cracks(axes: Axes, result: Result, title: str = "") -> None:
    """Cracks where they lie on the deformed specimen, on the outline of the specimen before the test."""
    for region in result.specimen.grains.regions:
        axes.add_patch(PathPatch(_path(region), facecolor=GRAIN, edgecolor=RIM, linewidth=0.8))
    draw_modes(axes, crack_lines(result.cracks) * 1e3, result.cracks.tensile)
    if title:
        axes.set_title(title, fontsize=9)


def draw_modes(axes: Axes, lines: np.ndarray, tensile: np.ndarray) -> None:
    """Cracks as lines (k, 2, 2) mm by their mode, tensile thin and shear thick, each with its number, to scale."""
    for name, chosen, color in (("shear", ~tensile, SHEAR), ("tensile", tensile, TENSILE)):
        label = f"{name}: {int(chosen.sum())}"
        axes.add_collection(
            LineCollection(list(lines[chosen]), colors=color, linewidths=WIDTHS[name], label=label, capstyle="round")
        )
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("x (mm)")
    axes.set_ylabel("y (mm)")


def label_cracks(figure: Figure) -> None:
    """A legend of the modes below all panels."""
    handles = [
        Line2D([], [], color=color, linewidth=WIDTHS[name] + 0.5, label=name)
        for name, color in (("tensile", TENSILE), ("shear", SHEAR))
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False, fontsize=9)


def scale_bar(axes: Axes, width: float) -> None:
    """A bar of a round length, about a third of a width (m), below the drawing."""
    power = 10.0 ** np.floor(np.log10(width / 3))
    length = max(k * power for k in ROUND if k * power <= width / 3 * (1 + 1e-9))
    left, bottom = axes.get_xlim()[0], axes.get_ylim()[0]
    start = left + (width - length) / 2 * 1e3
    ends = [start, start + length * 1e3]
    axes.plot(ends, [bottom] * 2, color="black", linewidth=2, clip_on=False, solid_capstyle="butt")
    axes.annotate(
        f"{length * 1e3:g} mm", (np.mean(ends), bottom), (0, -4), textcoords="offset points", ha="center", va="top",
        fontsize=8, annotation_clip=False,
    )  # fmt: skip


def _path(region: Region) -> Path:
    """Outline and holes as one path, in mm."""
    rings = [np.concatenate([ring, ring[:1]]) * 1e3 for ring in (region.outline, *region.holes)]
    codes = [[Path.MOVETO] + [Path.LINETO] * (len(ring) - 2) + [Path.CLOSEPOLY] for ring in rings]
    return Path(np.concatenate(rings), np.concatenate(codes))
