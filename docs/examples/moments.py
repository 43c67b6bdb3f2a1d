"""What the examples of contact share: their command line, and grains drawn at several moments side by side."""

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure


def command_line(description, **more):
    """Options ``quick`` and ``out``, a folder that exists, and ``more`` by their names."""
    parser = argparse.ArgumentParser(description=description.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="smaller or shorter, some seconds")
    parser.add_argument("--out", type=Path, default="out", help="folder of the picture and the files for ParaView")
    for name, settings in more.items():
        parser.add_argument(f"--{name}", **settings)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    return options


def outlines(result, frame):
    """Corners (n, 2) m of each grain of a specimen without refinement."""
    place = result.mesh.nodes + frame.displacement
    return [place[begin : end - 1] for begin, end in pairwise(result.mesh.first_node)]  # the last node is the middle


def frame_at(result, time):
    """The frame nearest to a time (s)."""
    return min(result.frames, key=lambda frame: abs(frame.time - time))


def draw(axes, result, frame, colors, rim=0.4):
    """Grains in their ``colors``."""
    axes.add_collection(PolyCollection(outlines(result, frame), facecolor=colors, edgecolor="0.25", linewidth=rim))
    axes.set(aspect="equal", xticks=[], yticks=[])


def moments(result, times, colors, columns=None, width=4.0, view=None):
    """Figure of the frames nearest to ``times`` (s); ``view`` is (left, right, bottom, top) m, else all is shown."""
    columns = columns or len(times)
    rows = -(-len(times) // columns)
    frames = [frame_at(result, time) for time in times]
    left, right, bottom, top = view or _box(result, frames)
    height = width * (top - bottom) / (right - left)
    figure = Figure(figsize=(columns * width, rows * (height + 0.4)), layout="constrained")
    for axes, frame in zip(figure.subplots(rows, columns, squeeze=False).flat, frames, strict=False):
        draw(axes, result, frame, colors)
        axes.set(xlim=(left, right), ylim=(bottom, top))
        axes.set_title(f"{frame.time:.2f} s", fontsize=9)
    return figure


def _box(result, frames):
    points = np.concatenate([result.mesh.nodes + frame.displacement for frame in frames])
    low, high = points.min(axis=0), points.max(axis=0)
    (left, bottom), (right, top) = low - 0.02 * (high - low), high + 0.02 * (high - low)
    return left, right, bottom, top
