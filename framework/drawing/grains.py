"""Pictures of grains; matplotlib is imported where it draws, for it takes long to load."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from grainlaw.messages import refusal

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure

#: the light scheme of Paul Tol (SRON/EPS/TN/09-002, 2021): fills that people who see colours otherwise can tell apart
FILLS = (
    "#77AADD", "#EE8866", "#EEDD88", "#FFAABB", "#99DDFF", "#44BB99", "#BBCC33", "#AAAA00", "#DDDDDD",
)  # fmt: skip
LINES = ("#000000", "#AA3377", "#004488", "#994455", "#117733")
JOINT_STYLES: tuple[Any, ...] = ("solid", (0, (4, 1.5)), (0, (1, 1)), (0, (6, 1, 1, 1)), (0, (2, 2)))
RIM = "#333333"


def draw_grains(grains: Any, by: str, ax: Any) -> Figure:
    """A :class:`~grainlaw.tessellation.Tessellation` by "phase", "area" or "parent", into axes or a new figure."""
    if by not in ("phase", "area", "parent"):
        raise refusal("Tessellation.plot: by", by, "'phase', 'area' or 'parent'")
    from matplotlib.collections import LineCollection, PolyCollection

    from grainlaw.drawing.figure import given_or_new, height_of, length_unit, to_scale

    width, height = np.ptp(grains.vertices, axis=0)
    figure, axes = given_or_new("Tessellation.plot", ax, (7, height_of(width, height, 1.2, 7)))
    unit = length_unit(grains.vertices)
    polygons = np.split(grains.vertices[grains.corners] * unit.factor, grains.first[1:-1])
    legends = []
    if by == "area":
        number = np.unique(grains.parent, return_inverse=True)[1].ravel()
        areas = np.bincount(number, grains.areas)[number] * unit.factor**2
        filled = PolyCollection(polygons, array=areas, cmap="cividis", edgecolor="face")
        axes.add_collection(filled)
        axes.figure.colorbar(filled, ax=axes, label=f"area of the grain ({unit.name}²)", shrink=0.7)
    else:
        group = grains.phase if by == "phase" else _told_apart(grains)
        colors = [FILLS[k % len(FILLS)] for k in group]
        axes.add_collection(PolyCollection(polygons, facecolor=colors, edgecolor=colors))
        legends = phase_legend(grains) if by == "phase" else []
    edges, rim = grains.edges, "white" if by == "area" else RIM
    ends = grains.vertices[np.column_stack([edges.start, edges.end])] * unit.factor
    axes.add_collection(LineCollection(list(ends[edges.kind == 1]), colors=rim, linewidths=0.25))
    axes.add_collection(LineCollection(list(ends[edges.kind == 0]), colors=rim, linewidths=0.7))
    for k, name in enumerate(grains.joints):
        look: Any = {"colors": LINES[k % 5], "linestyles": [JOINT_STYLES[k % 5]], "linewidths": 2.2, "label": name}
        lines = LineCollection(list(ends[edges.kind == k + 2]), **look)
        axes.add_collection(lines)
        legends.append(lines)
    if legends:
        axes.legend(handles=legends, loc="upper left", bbox_to_anchor=(1.01, 1), frameon=False, handlelength=2.5)
    to_scale(axes, unit)
    return figure


def phase_legend(grains: Any) -> list[Any]:
    """What the colours of phases mean, with their shares of the area."""
    from matplotlib.patches import Patch

    if not grains.phase_names and not grains.phase.any():
        return []
    share = np.bincount(grains.phase, grains.areas) / grains.areas.sum()
    return [
        Patch(facecolor=FILLS[k % len(FILLS)], edgecolor=RIM, label=f"{grains.phase_name(k)} {part * 100:.1f} %")
        for k, part in enumerate(share)
        if part > 0
    ]


def _told_apart(grains: Any) -> Sequence[int]:
    """(g,) small numbers, different for grains that share an edge, the same for all cells of one."""
    number = np.unique(grains.parent, return_inverse=True)[1].ravel()
    beside: list[set[int]] = [set() for _ in range(number.max() + 1)]
    inner = grains.edges.right >= 0
    for a, b in number[np.column_stack([grains.edges.left, grains.edges.right])[inner]].tolist():
        beside[max(a, b)].add(min(a, b))
    chosen: list[int] = []
    for own, others in enumerate(beside):
        taken = {chosen[other] for other in others if other != own}
        chosen.append(next(k for k in range(len(taken) + 1) if k not in taken))
    return np.array(chosen)[number].tolist()
