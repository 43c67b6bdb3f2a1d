"""Pictures of contact points that a probe has followed, together with the curves of their laws."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize

from grainlaw.contact import ContactLaw
from grainlaw.drawing.figure import Figure, grid
from grainlaw.results.probe import ContactPath
from grainlaw.workbench.characteristics import QUICK, Envelope, envelope, fitting_pressures, shear_mode, tensile_mode
from grainlaw.workbench.driver import Contact, alone
from grainlaw.workbench.law_figure import MPA, UM, Reach, along, draw_envelope, reach
from grainlaw.workbench.shear_box import pulled, sheared

MOST_ROWS = 4  #: of paths drawn one below the other
SCREEN = (16.0, 9.0)  #: inch
LAW, INTACT_TO_BROKEN = "0.45", "plasma"
DAMAGE = Normalize(0, 1.1)  # the end of the map is too pale on white


def plot_paths(paths: Sequence[ContactPath]) -> Figure:
    """A row for each path: normal traction over opening, shear over slip, and the two with the strength.

    Of many paths the last alone, so that they fit a screen.
    """
    if len(paths) > MOST_ROWS:
        return _plot_many(paths)
    figure = Figure(figsize=(13.5, 4.4 * max(len(paths), 1)), layout="constrained")
    rows = figure.subfigures(max(len(paths), 1), 1, squeeze=False)[:, 0]
    for row, path, law_strength in zip(rows, paths, _strengths(paths), strict=False):
        pull, shear, strength = row.subplots(1, 3)
        contact = alone(path.law)
        with np.errstate(all="ignore"):
            _pull(pull, contact, path)
            _shear(shear, contact, path)
            _strength(strength, path, law_strength)
        x, y = path.position * 1e3
        a, b = path.grains
        row.suptitle(f"contact {path.point}, grains {a} and {b}, at ({x:.1f}, {y:.1f}) mm: {_end(path)}")
        bar = row.colorbar(strength.collections[0], ax=[pull, shear, strength], label="damage", ticks=[0, 1], pad=0.01)
        bar.ax.set_ylim(0, 1)
    return figure


def _end(path: ContactPath) -> str:
    return "unbroken" if np.isnan(path.broken) else f"broke at {path.broken * 1e3:.4g} ms"


def _plot_many(paths: Sequence[ContactPath]) -> Figure:
    """Tractions of each path with the strength, side by side in the size of a screen."""
    across = math.ceil(math.sqrt(1.6 * len(paths)))
    figure, panels = grid(len(paths), across, SCREEN)
    for axes, path, strength in zip(panels, paths, _strengths(paths), strict=True):
        _strength(axes, path, strength)
        axes.get_legend().remove()  # type: ignore[union-attr]
        axes.set_title(f"contact {path.point}, {_end(path)}", fontsize="small")
        axes.tick_params(labelsize="small")
        axes.set(xlabel="", ylabel="")
    figure.supxlabel("pressure (MPa), tension below 0")
    figure.supylabel("shear traction (MPa)")
    bar = figure.colorbar(panels[0].collections[0], ax=panels, label="damage", ticks=[0, 1], pad=0.01)
    bar.ax.set_ylim(0, 1)
    return figure


def _pull(axes: Axes, contact: Contact, path: ContactPath) -> None:
    mode = tensile_mode(contact, QUICK)
    to = reach(mode.displacement, mode.breaking)
    closed, opened = min(float(path.opening.min()), 0.0), float(path.opening.max())
    for ends in ([0, closed], [0, 1.1 * to.end]):
        run = pulled(contact, along(ends))
        axes.plot(run.opening * UM, run.normal * MPA, color=LAW, linewidth=1, label="law" if ends[1] > 0 else "")
    _followed(axes, path, path.opening * UM, path.normal * MPA)
    right = _right(opened, to)
    left = max(closed, -right) - 0.05 * right
    axes.set(xlabel="opening (µm)", ylabel="normal traction (MPa)", xlim=(left * UM, right * UM))
    _fit(axes)


def _shear(axes: Axes, contact: Contact, path: ContactPath) -> None:
    i = int(np.argmax(np.abs(path.shear[: max(path.unbroken, 1)])))
    sign = 1.0 if path.shear[i] >= 0 else -1.0
    to = Reach(0.0, 0.0)
    for normal, style in ((0.0, ":"), (float(path.normal[i]), "-")):
        mode = shear_mode(contact, -normal, QUICK)
        if np.isnan(mode.displacement) and normal:
            continue
        to = max(to, reach(mode.displacement, mode.breaking), key=lambda each: each.end)
        run = sheared(contact, normal, along([0, 1.1 * to.end]))
        held = f"{-normal * MPA:.3g} MPa pressure" if normal <= 0 else f"{normal * MPA:.3g} MPa tension"
        label = f"law, {held if normal else 'no pressure'}"
        axes.plot(sign * run.slip * UM, sign * run.shear * MPA, style, color=LAW, linewidth=1, label=label)
    _followed(axes, path, path.slip * UM, path.shear * MPA)
    ends = sorted((-0.15 * sign * _right(0.0, to), sign * _right(float((sign * path.slip).max()), to)))
    axes.set(xlabel="slip (µm)", ylabel="shear traction (MPa)", xlim=np.array(ends) * UM)
    _fit(axes)


def _strengths(paths: Sequence[ContactPath]) -> list[Envelope]:
    """The strength of the law of each path, found once for a law, as far as any of its contacts was pressed."""
    laws: list[ContactLaw] = []  # they can be compared, but have no hash
    for path in paths:
        if path.law not in laws:
            laws.append(path.law)

    def strength(law: ContactLaw) -> Envelope:
        highest = max(-float(path.normal.min()) for path in paths if path.law == law)
        return envelope(law, max(1.1 * highest, fitting_pressures(alone(law))[1]))

    with np.errstate(all="ignore"):
        found = [strength(law) for law in laws]
    return [found[laws.index(path.law)] for path in paths]


def _strength(axes: Axes, path: ContactPath, strength: Envelope) -> None:
    draw_envelope(axes, strength)
    _followed(axes, path, -path.normal * MPA, np.abs(path.shear) * MPA)
    axes.set(title="", xlabel="pressure (MPa), tension below 0", ylabel="shear traction (MPa)")


def _followed(axes: Axes, path: ContactPath, x: np.ndarray, y: np.ndarray) -> None:
    """The path from the first sample on, coloured by damage, with a cross where it had broken."""
    points = np.stack([x, y], axis=1)
    lines = LineCollection(
        list(np.stack([points[:-1], points[1:]], axis=1)), cmap=INTACT_TO_BROKEN, norm=DAMAGE, linewidths=2, zorder=3
    )
    lines.set_array(path.damage[1:])
    axes.add_collection(lines)
    axes.scatter(x, y, c=path.damage, cmap=INTACT_TO_BROKEN, norm=DAMAGE, s=7, zorder=4)
    at = path.unbroken
    if at < len(x):
        axes.plot(x[at], y[at], "x", color="black", markersize=8, zorder=5, label="broken")
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, fontsize="small", loc="best")


def _right(farthest: float, to: Reach) -> float:
    """End of an axis (m): the whole path, but not all of a long slide after the break."""
    return max(1.15 * min(farthest, 1.3 * to.end), 3 * to.peak)


def _fit(axes: Axes) -> None:
    """Fit the vertical axis to the points that the horizontal one shows."""
    low, high = axes.get_xlim()
    shown = [np.array(line.get_xydata(), dtype=float) for line in axes.lines]
    shown += [np.array(dots.get_offsets(), dtype=float) for dots in axes.collections[1:]]  # the lines come first
    values = np.concatenate([points[(points[:, 0] >= low) & (points[:, 0] <= high), 1] for points in shown])
    bottom, top = np.nanmin(values), np.nanmax(values)
    axes.set_ylim(bottom - 0.06 * (top - bottom), top + 0.1 * (top - bottom))
