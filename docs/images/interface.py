"""Draws interface.png: grains with their zones, and one interface opened, with what Eqs. (6, 7) of theory.md call it.

Displacements are drawn far too large.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle

A, B, RED, BLUE = "#e8b04a80", "#e3e0d8", "#c8281e", "#1f5fbf"
WEIGHT = 0.5 - 0.5 / np.sqrt(3)  #: w of Gauss points


def draw_grains(axes):
    """Grains, their zones, and the two contact points of every interface."""
    mesh = gl.Specimen(Voronoi(grains=7, seed=4).tessellate(rectangle(1, 1)), gl.Rigid(density=2700)).mesh
    for zone in mesh.zones:
        axes.add_patch(Polygon(mesh.nodes[zone], facecolor=B, edgecolor="0.75", lw=0.7))
    for edges in mesh.boundary_edges.values():
        for edge in edges:
            axes.plot(*mesh.nodes[edge].T, color="0.3", lw=1.2)
    for start, end in mesh.nodes[mesh.interfaces[:, :2]]:
        axes.plot(*np.array([start, end]).T, "k", lw=2)
        axes.plot(*np.array([start + w * (end - start) for w in (WEIGHT, 1 - WEIGHT)]).T, "o", color=RED, ms=4.5)
    axes.set(aspect="equal", xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), title="grains, their zones, and contact points")
    axes.axis("off")


def arrow(axes, begin, end, label, at, color="k", style="-|>"):
    axes.annotate(
        "", end, begin, arrowprops={"arrowstyle": style, "color": color, "lw": 1.8, "shrinkA": 0, "shrinkB": 0}
    )
    axes.text(*at, label, color=color, fontsize=14, ha="center", va="center")


def draw_interface(axes):
    """The interface of A, on the left, and B: the edge of A runs upwards, so that its normal points at B."""
    a = np.array([(0.0, 0.0), (0.12, 1.0)])
    b = np.array([(0.42, 0.17), (0.70, 1.14)])
    axes.add_patch(Polygon([*a, (-0.35, 1.2), (-0.75, 0.6), (-0.5, -0.1)], facecolor=A, edgecolor="0.3"))
    axes.add_patch(Polygon([*b, (1.15, 1.25), (1.45, 0.7), (1.05, 0.05)], facecolor=B, edgecolor="0.3"))
    mean = ((a[1] - a[0]) + (b[1] - b[0])) / 2
    t = mean / np.hypot(*mean)
    n = np.array([t[1], -t[0]])
    for edge, name, side in ((a, "A", -1), (b, "B", 1)):
        axes.plot(*edge.T, "k", lw=2.2)
        points = np.array([edge[0] + w * (edge[1] - edge[0]) for w in (WEIGHT, 1 - WEIGHT)])
        axes.plot(*points.T, "o", color=RED, ms=6)
        for k in range(2):
            axes.plot(*edge[k], "s", color="k", ms=5)
            axes.text(*(edge[k] + (0.13 * side, -0.02)), f"{name}{k + 1}", ha="center", va="center", fontsize=12)
    on_a, on_b = (edge[0] + (1 - WEIGHT) * (edge[1] - edge[0]) for edge in (a, b))
    between = on_b - on_a
    corner = on_a + (between @ n) * n
    arrow(axes, on_a, corner, "opening $o$", (on_a + corner) / 2 + (0.02, -0.09), RED, "<|-|>")
    arrow(axes, corner, on_b, "slip $s$", (corner + on_b) / 2 + (0.2, -0.02), RED, "<|-|>")
    start = (a[0] + b[0]) / 2 + 0.12 * t
    axes.plot(*np.array([start - 0.12 * t, start + 0.75 * t]).T, "--", color=BLUE, lw=1)
    arrow(axes, start, start + 0.2 * t, r"$\mathbf{t}$", start + 0.2 * t + (-0.06, 0.0), BLUE)
    arrow(axes, start, start + 0.16 * n, r"$\mathbf{n}$", start + 0.16 * n + (-0.02, -0.07), BLUE)
    axes.text(*(start + 0.72 * t + (0.04, 0.06)), "mean edge", color=BLUE, fontsize=10, ha="center")
    axes.text(-0.42, 0.55, "A", fontsize=18)
    axes.text(1.05, 0.7, "B", fontsize=18)
    axes.set(aspect="equal", xlim=(-0.8, 1.5), ylim=(-0.2, 1.35), title="one interface, opened and slipped")
    axes.axis("off")


def main():
    figure = Figure(figsize=(11, 4.6), layout="constrained")
    grains, interface = figure.subplots(1, 2, width_ratios=[1, 1.45])
    draw_grains(grains)
    draw_interface(interface)
    figure.savefig(Path(__file__).with_suffix(".png"), dpi=90)


if __name__ == "__main__":
    main()
