"""Draws contact.png: two contacts, what Eqs. (13, 14) of theory.md take from them, and the normal that follows.

Edges run to the right: ``a`` below grain A, ``b`` above grain B. Depths are drawn far too large.
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

A, B, RED, BLUE = "#e8b04a80", "#e3e0d8", "#c8281e", "#1f5fbf"


def turned(angle, points, by=(0, 0)):
    """Points turned about the origin by degrees, then moved."""
    cos, sin = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    return np.array(points) @ np.array([(cos, sin), (-sin, cos)]) + by


def cross(u, v):
    return u[0] * v[1] - u[1] * v[0]


def overlap(a, b):
    """Both ends of the overlap of two edges, the depths there (0 at a crossing), and which edge's corner it is."""
    along_a, along_b = ((e[1] - e[0]) / np.hypot(*(e[1] - e[0])) for e in (a, b))
    tangent = along_a + along_b
    first = max((a[0], 1), (b[0], -1), key=lambda corner: corner[0] @ tangent)
    last = min((a[1], 1), (b[1], -1), key=lambda corner: corner[0] @ tangent)
    meet = a[0] + along_a * cross(b[0] - a[0], along_b) / cross(along_a, along_b)
    ends = []
    for place, whose in (first, last):
        depth = cross(place - b[0], along_b) if whose > 0 else cross(along_a, place - a[0])
        ends.append((place, depth, whose) if depth > 0 else (meet, 0.0, 0))
    return ends, along_a, along_b


def energy(a, b):
    """Eq. (13) over the stiffness."""
    ((x1, d1, _), (x2, d2, _)), along_a, along_b = overlap(a, b)
    square, depths = ((x2 - x1) @ along_a) * ((x2 - x1) @ along_b), (d1**2 + d1 * d2 + d2**2) / 3
    return 0.5 * square**1.5 * depths / (square + depths)


def push(a, b, h=1e-6):
    """Force on A over the stiffness, and its moment about the origin: what the energy loses as A moves."""
    x, y = ((energy(a - step, b) - energy(a + step, b)) / (2 * h) for step in h * np.eye(2))
    turn = np.degrees(h)
    return np.array([x, y]), (energy(turned(-turn, a), b) - energy(turned(turn, a), b)) / (2 * h)


def draw(axes, grain_a, grain_b, edge_a, edge_b):
    axes.fill(*grain_b.T, facecolor=B, edgecolor="0.3")
    axes.fill(*grain_a.T, facecolor=A, edgecolor="0.3")
    ends, along_a, along_b = overlap(edge_a, edge_b)
    for edge, side in ((edge_a, 1), (edge_b, -1)):  # each edge, and its length in contact beside it
        axes.plot(*edge.T, "k", lw=1.8)
        along = along_a if side > 0 else along_b
        across = side * 0.27 * np.array([-along[1], along[0]])
        begin, end = (edge[0] + along * ((place - edge[0]) @ along) + across for place, _, _ in ends)
        axes.annotate("", begin, end, arrowprops={"arrowstyle": "<->", "color": RED, "shrinkA": 0, "shrinkB": 0})
        label = r"$J_a$" if side > 0 else r"$J_b$"
        axes.text(*(0.25 * begin + 0.75 * end + 0.3 * across), label, color=RED, ha="center", va="center", fontsize=13)
    feet = []
    for (place, depth, whose), name, left in zip(ends, ("$d_1$", "$d_2$"), (-1, 1), strict=True):
        along = along_b if whose > 0 else along_a
        foot = place + (whose * depth) * np.array([-along[1], along[0]])
        feet.append((place + foot) / 2)
        axes.plot(*np.array([place, foot]).T, "k", lw=2.2)
        label = name if depth else f"{name} = 0"
        beside = feet[-1] + (0.05 * left, 0 if depth else -0.07)
        axes.text(*beside, label, ha="right" if left < 0 else "left", va="center", fontsize=13)
    force, moment = push(edge_a, edge_b)
    normal = force / np.hypot(*force)
    share = (moment - cross(feet[0], force)) / cross(feet[1] - feet[0], force)
    at = feet[0] + share * (feet[1] - feet[0])
    arrow = {"arrowstyle": "->", "color": BLUE, "lw": 2.2, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", at + 0.5 * normal, at, arrowprops=arrow)
    axes.plot(*at, "o", color=BLUE, ms=5)
    axes.text(*(at + 0.5 * normal + (0.04, 0)), r"$-\mathbf{n}$, on A", color=BLUE, fontsize=13)
    axes.axis("off")


def main():
    figure = Figure(figsize=(11, 4.1), layout="constrained")
    one, other = figure.subplots(1, 2)
    corner = turned(18, [(0, 0), (1.6, 0), (1.6, 0.8), (0, 0.8)], by=(-0.5, -0.2))
    flat = np.array([(-1.4, 0), (1.5, 0), (1.5, -0.6), (-1.4, -0.6)])
    draw(one, corner, flat, corner[:2], flat[:2])
    one.set(aspect="equal", xlim=(-1.2, 1.3), ylim=(-0.62, 1.1), title="a corner in an edge")
    face = turned(3, [(0, 0), (1.7, 0), (1.7, 0.8), (0, 0.8)], by=(-0.5, -0.2))
    low = np.array([(-1.4, 0), (0.7, 0), (0.7, -0.6), (-1.4, -0.6)])
    draw(other, face, low, face[:2], low[:2])
    other.set(aspect="equal", xlim=(-1.2, 1.3), ylim=(-0.62, 1.1), title="two faces")
    for axes, b in ((one, (1.1, -0.45)), (other, (-1.05, -0.45))):
        axes.text(*b, "B", fontsize=16)
        axes.text(0.75, 0.5, "A", fontsize=16)
    one.text(0.72, 0.07, "edge a", rotation=18)
    other.text(0.85, -0.27, "edge a", rotation=3)
    one.text(-1.15, 0.04, "edge b")
    other.text(-1.15, 0.04, "edge b")
    figure.savefig(Path(__file__).with_name("contact.png"), dpi=80)


if __name__ == "__main__":
    main()
