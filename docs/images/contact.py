"""Draws contact.png: a corner that lies on an edge, and what the contact is made of."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

BLOCK = np.array([(-0.35, -0.1), (1.0, 0.35), (0.7, 1.25), (-0.65, 0.8)])
DEPTH = 0.1


def main():
    figure = Figure(figsize=(6.5, 4), layout="constrained")
    axes = figure.subplots()
    axes.fill([-1.4, 1.6, 1.6, -1.4], [0, 0, -0.6, -0.6], facecolor="#e3e0d8", edgecolor="0.3")
    axes.fill(*BLOCK.T, facecolor="#e8b04a80", edgecolor="0.3")
    corner, right = BLOCK[0], BLOCK[1]
    out = corner + (right - corner) * DEPTH / (right - corner)[1]  # where the edge leaves B
    at = corner + (out - corner) / 3  # the centre of the depth: it falls from the corner to nothing
    axes.fill([corner[0], out[0], corner[0]], [corner[1], 0, 0], color="#c8281e", alpha=0.35)
    axes.annotate("", (corner[0], -0.2), (out[0], -0.2), arrowprops={"arrowstyle": "<->", "color": "#c8281e"})
    axes.text((corner[0] + out[0]) / 2, -0.31, "length in contact", color="#c8281e", ha="center")
    axes.annotate("", (corner[0], -0.1), (corner[0], 0.0), arrowprops={"arrowstyle": "-", "color": "k", "lw": 1.5})
    axes.text(corner[0] - 0.04, -0.075, "depth", ha="right")
    arrow = {"arrowstyle": "<-", "color": "#1f5fbf", "lw": 1.8}
    axes.annotate("force on A", (at[0], 0), (at[0] - 0.2, 0.5), arrowprops=arrow, color="#1f5fbf", ha="right")
    axes.text(0.2, 0.75, "A", fontsize=16)
    axes.text(1.2, -0.4, "B", fontsize=16)
    axes.text(0.75, 0.17, "edge a", rotation=18.4, ha="center")
    axes.text(-1.1, 0.03, "edge b", ha="center")
    axes.set(aspect="equal", xlim=(-1.4, 1.6), ylim=(-0.6, 1.3))
    axes.axis("off")
    figure.savefig(Path(__file__).with_name("contact.png"), dpi=80)


if __name__ == "__main__":
    main()
