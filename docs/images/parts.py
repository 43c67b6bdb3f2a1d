"""Draws parts.png: the interfaces, what they make, and how a run composes them."""

from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch

OWN, DATA, RUN = "#fde3c0", "#eceff3", "#cfe3f5"  #: an interface, which a part of your own fills; data; what runs
ROW = 0.62  #: height of a box


def box(axes, x, y, name, says="", color=DATA, width=2.2, height=ROW):
    """A box round its centre."""
    shape = FancyBboxPatch(
        (x - width / 2, y - height / 2), width, height, boxstyle="round,pad=0,rounding_size=0.08",
        facecolor=color, edgecolor="0.35", linewidth=0.9,
    )  # fmt: skip
    axes.add_patch(shape)
    axes.text(x, y + (0.11 if says else 0), name, ha="center", va="center", fontsize=9.5, weight="bold")
    if says:
        axes.text(x, y - 0.14, says, ha="center", va="center", fontsize=7.2, color="0.25")


def arrow(axes, begin, end, label="", curve=0.0):
    style = {"arrowstyle": "-|>", "color": "0.35", "lw": 1.1, "shrinkA": 1, "shrinkB": 1}
    axes.annotate("", end, begin, arrowprops=style | {"connectionstyle": f"arc3,rad={curve}"})
    if label:
        x, y = (begin[0] + end[0]) / 2, (begin[1] + end[1]) / 2
        axes.text(x + 0.15, y - 0.1, label, fontsize=7, color="0.35")


def main():
    figure = Figure(figsize=(12, 5.6))
    axes = figure.add_axes([0, 0, 1, 1])
    axes.set(xlim=(-0.2, 14.3), ylim=(0, 6.7), xticks=[], yticks=[])
    axes.axis("off")

    box(axes, 1.4, 6.0, "Region", "outline with named sides")
    box(axes, 1.4, 4.9, "Tessellator", "fills it with grains", OWN)
    box(axes, 4.2, 4.9, "Tessellation", "grains, edges, minerals")
    box(axes, 4.2, 3.8, "Material", "stress of a zone", OWN)
    box(axes, 7.1, 4.9, "Specimen", "the rock that is tested")
    box(axes, 7.1, 3.3, "simulate", "one run, step by step", RUN, height=0.9)
    box(axes, 4.2, 2.7, "ContactLaw", "tractions of a contact", OWN)
    box(axes, 4.2, 1.6, "LoadingProtocol", "stages, what is measured", OWN)
    box(axes, 1.4, 2.7, "Stage", "what moves, until when")
    box(axes, 1.4, 1.6, "Loading", "how fast", OWN)
    box(axes, 1.4, 0.6, "Integrator", "one step of a node", OWN)
    box(axes, 7.1, 1.6, "Observer", "sees every sample", OWN)
    box(axes, 10.0, 3.3, "Result", "curves, cracks, frames")
    box(axes, 10.0, 1.6, "Measure", "a number of a result", OWN)
    box(axes, 12.9, 3.3, "pictures, report,\nParaView", width=2.0, height=0.8)
    box(axes, 12.9, 1.6, "Laboratory", "moduli, thresholds, events", width=2.3)
    box(axes, 10.0, 4.9, "Study, compare,\ncalibrate", "", RUN, height=0.8)
    box(axes, 12.9, 4.9, "Table", "with intervals", width=2.0)

    arrow(axes, (1.4, 5.69), (1.4, 5.21))
    arrow(axes, (2.5, 4.9), (3.1, 4.9))
    arrow(axes, (5.3, 4.9), (6.0, 4.9))
    arrow(axes, (5.3, 3.95), (6.4, 4.59))
    arrow(axes, (7.1, 4.59), (7.1, 3.75))
    arrow(axes, (5.3, 2.8), (6.0, 3.15))
    arrow(axes, (5.3, 1.75), (6.2, 2.85))
    arrow(axes, (2.5, 2.6), (3.1, 1.85))
    arrow(axes, (1.4, 1.91), (1.4, 2.39))
    arrow(axes, (0.3, 0.75), (0.3, 2.6), curve=-0.35)
    arrow(axes, (7.1, 1.91), (7.1, 2.85))
    arrow(axes, (8.2, 3.3), (8.9, 3.3))
    arrow(axes, (11.1, 3.3), (11.9, 3.3))
    arrow(axes, (10.0, 2.99), (12.2, 1.91))
    arrow(axes, (11.1, 1.6), (11.75, 1.6))
    arrow(axes, (8.9, 4.8), (7.8, 3.75), "many runs")
    arrow(axes, (11.1, 4.9), (11.9, 4.9))
    for x, (color, words) in zip((7.0, 9.6, 11.3), ((OWN, "interface: yours or ours"), (DATA, "data"), (RUN, "runs")),
                                 strict=True):  # fmt: skip
        box(axes, x, 0.6, "", "", color, width=0.35, height=0.25)
        axes.text(x + 0.28, 0.6, words, va="center", fontsize=8.5)
    figure.savefig(Path(__file__).with_suffix(".png"), dpi=110)


if __name__ == "__main__":
    main()
