"""Pictures of a calibration: targets over parameters, the posterior, left out points, the envelope."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from grainlaw.calibration.check import NORMAL
from grainlaw.calibration.emulator import restored
from grainlaw.calibration.targets import AIMS
from grainlaw.drawing.figure import Figure
from grainlaw.drawing.palette import BLACK, BLUE, VERMILLION
from grainlaw.messages import spelled
from grainlaw.studies.envelope import fit_mohr_coulomb
from grainlaw.unit_text import factor_into, written

if TYPE_CHECKING:
    from grainlaw.calibration.result import Calibration
    from grainlaw.calibration.space import Free

ALONG = 60  #: points of a line
BINS = 30
COMMON = (0.05, 0.95)  #: quantiles of what was tested that are seen where nothing is plausible
LIES = 0.001, 0.999  #: quantiles of the posterior that are seen
BESIDE = 0.3  #: room beside them, over their distance
NARROWEST = 0.01  #: room beside what has no width
TICKS = 4
WIDE = 4.0  #: times the least is the largest: else axes are linear
AROUND = 0.1  #: of what has to be seen, above and below


def bands(found: Calibration) -> Figure:
    """Each target over each parameter."""
    match, space = found.found.match, found.space
    best = _middle(found)
    design, scale = found.found.design, space.scales(best[None])[0]
    shift = match.samples.shift + match.samples.of_mean
    rows, columns, windows = len(match.names), len(space.free), _windows(found)
    figure = Figure(figsize=(2.5 * columns + 0.6, 2.1 * rows + 0.4), layout="constrained")
    places = figure.subplots(rows, columns, squeeze=False, sharey="row")
    for i, name in enumerate(match.names):
        aim, target = AIMS[name], match.targets[name]
        k = match.samples.names.index(name)
        value, half_width = (part * aim.shown.factor for part in (target.value, NORMAL * target.uncertainty))
        reach = [value - half_width, value + half_width]  # of what has to be seen
        tested = restored(name, match.samples.means[:, k] + shift[k], scale) * aim.shown.factor
        for j, free in enumerate(space.free):
            axes = places[i, j]
            line = np.repeat(best[None], ALONG, axis=0)
            line[:, j] = free.at(np.linspace(windows[j, 0], windows[j, 1], ALONG))
            line = line[space.allowed(line)]
            points = design.points[:, j] * scale**free.power if space.scale else design.points[:, j]
            if free is not space.scale:
                axes.plot(free.share(points), tested, ".", color="0.6", markersize=4)
            if len(line):
                mean, variance = match.one(line, name)
                half = NORMAL * np.sqrt(variance)
                low, middle, high = (restored(name, mean + d) * aim.shown.factor for d in (-half, 0, half))
                axes.fill_between(free.share(line[:, j]), low, high, color=BLUE, alpha=0.25, linewidth=0)
                axes.plot(free.share(line[:, j]), middle, color=BLUE)
                reach += [low.min(), high.max()]
            axes.axhspan(value - half_width, value + half_width, color=VERMILLION, alpha=0.2, lw=0)
            axes.axhline(value, color=VERMILLION, linewidth=1)
            axes.set_xlim(*windows[j])
            _ticks(axes.xaxis, free, i == rows - 1)
            if i == rows - 1:
                axes.set_xlabel(_label(free))
            if j == 0:
                axes.set_ylabel(aim.shown.heading)
            axes.grid(alpha=0.25)
        if found.found.posterior is None:
            reach += [*np.nanquantile(tested, COMMON)]
        beyond = AROUND * (max(reach) - min(reach))
        places[i, 0].set_ylim(min(reach) - beyond, max(reach) + beyond)  # all of the row: points far off are not seen
    looks = [
        Line2D([], [], color="0.6", marker=".", linestyle="", label="tested"),
        Line2D([], [], color=BLUE, label="emulator"),
        Patch(color=BLUE, alpha=0.25, label="its 95 %"), Line2D([], [], color=VERMILLION, label="target"),
        Patch(color=VERMILLION, alpha=0.2, label="its 95 %"),
    ]  # fmt: skip
    figure.legend(handles=looks, loc="outside upper center", ncols=len(looks), frameon=False, fontsize=9)
    return figure


def corner(found: Calibration) -> Figure:
    """The posterior, where it lies."""
    posterior, space = found.found.posterior, found.space
    assert posterior is not None
    d, windows = len(space.free), _windows(found)
    figure = Figure(figsize=(1.9 * d + 0.8, 1.9 * d + 0.6), layout="constrained")
    places = figure.subplots(d, d, squeeze=False)
    shares, best = space.places(posterior.points), space.places(posterior.best[None])[0]
    for i in range(d):
        for j in range(d):
            axes: Axes = places[i, j]
            if j > i:
                axes.remove()
                continue
            if i == j:
                axes.hist(shares[:, j], bins=BINS, range=windows[j], color=BLUE, alpha=0.7)
                axes.axvline(best[j], color=BLACK, linewidth=1)
                axes.set_yticks([])
            else:
                axes.hist2d(shares[:, j], shares[:, i], bins=BINS, range=windows[[j, i]], cmap="Blues")
                axes.plot(best[j], best[i], "+", color=VERMILLION, markersize=9, markeredgewidth=1.8)
                axes.set_ylim(*windows[i])
                _ticks(axes.yaxis, space.free[i], j == 0)
            axes.set_xlim(*windows[j])
            _ticks(axes.xaxis, space.free[j], i == d - 1)
            if i == d - 1:
                axes.set_xlabel(_label(space.free[j]))
            if j == 0 and i:
                axes.set_ylabel(_label(space.free[i]))
    return figure


def fit(found: Calibration) -> Figure | None:
    """How far fresh specimens lie from each target, beside how well it is known; None without a check."""
    checks = [each for each in found.checks if each.target is not None and each.target.value and each.count]
    if not checks:
        return None
    figure = Figure(figsize=(6, 0.55 * len(checks) + 1.4), layout="constrained")
    axes = figure.subplots()
    names = []
    for row, each in enumerate(reversed(checks)):
        assert each.target is not None
        shown, value, hidden = AIMS[each.name].shown, each.target.value, "_" if row else ""  # in the legend once
        known = 100 * NORMAL * each.target.uncertainty / value
        given = np.array([*each.values, *each.interval, each.measured])
        *single, low, high, mean = 100 * (given / value - 1)
        axes.barh(
            row, 2 * known, left=-known, height=0.6, color=VERMILLION, alpha=0.25, lw=0, label=hidden + "target, 95 %"
        )
        axes.plot(single, [row] * len(single), "o", color="0.55", markersize=4, label=hidden + "fresh specimens")
        reach = [[mean - low], [high - mean]]
        label = hidden + "their mean, 95 %"
        axes.errorbar(mean, row, xerr=reach, fmt="D", color=BLUE, capsize=4, zorder=3, label=label)
        names.append(f"{shown.words}: {shown.with_unit(value)}")
    axes.axvline(0, color=VERMILLION, linewidth=1)
    axes.set_yticks(range(len(names)), names)
    axes.set_xlabel("off the target (%)")
    axes.grid(axis="x", alpha=0.25)
    figure.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=9)
    return figure


def left_out(found: Calibration) -> Figure:
    """Predictions of points that were left out, over what they are."""
    match, samples = found.found.match, found.found.match.samples
    every, scale = list(match.emulators.values()), found.space.scales(_middle(found)[None])[0]
    columns = min(4, len(every))
    rows = math.ceil(len(every) / columns)
    figure = Figure(figsize=(2.7 * columns + 0.4, 2.6 * rows), layout="constrained")
    places = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, emulator in zip(places, every, strict=False):
        aim, (value, predicted, deviation) = AIMS[emulator.name], emulator.left_out.T
        shift = (samples.shift + samples.of_mean)[samples.names.index(emulator.name)]
        tested, low, middle, high = (
            restored(emulator.name, each + shift, scale) * aim.shown.factor
            for each in (value, predicted - 2 * deviation, predicted, predicted + 2 * deviation)
        )
        reach = [middle - low, high - middle]
        axes.errorbar(tested, middle, reach, fmt=".", color=BLUE, ecolor="0.75", markersize=5)
        ends = [tested.min(), tested.max()]
        if aim.is_log and ends[1] > WIDE * ends[0]:
            _logarithmic(axes)
        axes.plot(ends, ends, color=BLACK, linewidth=0.8)
        share = emulator.q_squared
        said = f"Q2 {share:.3f}" if math.isfinite(share) else "the same at all points, by similarity"
        axes.set_title(f"{aim.shown.heading}\n{said}", fontsize=9)
        axes.grid(alpha=0.25)
        axes.set_xlabel("tested", fontsize=9)
        axes.set_ylabel("predicted from the others", fontsize=9)
    for axes in places[len(every) :]:
        axes.remove()
    return figure


def envelope(found: Calibration) -> Figure | None:
    """Strengths of the fresh seeds and the targets over confinement, with their lines; None without confined tests."""
    checks = {each.name: each for each in found.checks}
    under = {AIMS[name].confinement: each for name, each in checks.items() if AIMS[name].confinement or name == "ucs"}
    lines: dict[str, tuple[float, float]] = {}
    if found.targets.pressures and {"cohesion", "friction_angle"} <= set(checks):
        lines["fresh seeds"] = checks["cohesion"].measured, checks["friction_angle"].measured
    if "ucs" not in checks or not (lines or len(under) > 1):
        return None
    if found.targets.cohesion and found.targets.friction_angle:
        lines["targets"] = found.targets.cohesion.value, found.targets.friction_angle.value
    if not lines:  # those of triaxial tests are points
        lines["fresh seeds"] = _line({pressure: each.measured for pressure, each in under.items()})
        lines["targets"] = _line({pressure: each.target.value for pressure, each in under.items() if each.target})
    figure = Figure(figsize=(5, 3.8), layout="constrained")
    axes = figure.subplots()
    at = np.linspace(0, max([*found.targets.pressures, *under]), 2)
    for words, (cohesion, angle) in lines.items():
        if not (math.isfinite(cohesion) and math.isfinite(angle)):
            continue
        root = math.tan(math.pi / 4 + math.radians(angle) / 2)
        label = f"{words}: c = {cohesion / 1e6:.2f} MPa, phi = {angle:.2f} deg"
        color = VERMILLION if words == "targets" else BLUE
        axes.plot(at / 1e6, (2 * cohesion * root + root**2 * at) / 1e6, color=color, label=label)
    for pressure, each in under.items():
        reach = np.array([[each.measured - each.interval[0]], [each.interval[1] - each.measured]]) / 1e6
        label = "mean of the fresh seeds, 95 %"
        axes.errorbar(pressure / 1e6, each.measured / 1e6, reach, fmt="o", color=BLUE, capsize=3, label=label)
        if each.target:
            known = each.target.value / 1e6, NORMAL * each.target.uncertainty / 1e6
            label = "target, 95 %"
            axes.errorbar(pressure / 1e6, *known, fmt="D", color=VERMILLION, capsize=3, label=label)
    axes.set_xlabel("confinement (MPa)")
    axes.set_ylabel("strength (MPa)")
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.25)
    shown, names = axes.get_legend_handles_labels()
    each_once = dict(zip(names, shown, strict=True))
    axes.legend(each_once.values(), each_once.keys(), frameon=False, fontsize=9, loc="lower right")
    return figure


def _line(strengths: Mapping[float, float]) -> tuple[float, float]:
    """Cohesion and friction angle of the straight line through strengths by confinement; nan where there is none."""
    known = {pressure: strength for pressure, strength in strengths.items() if math.isfinite(strength)}
    if len(known) < 2:
        return math.nan, math.nan
    fitted = fit_mohr_coulomb([*known], [*known.values()])
    return fitted.cohesion, fitted.friction_angle


def _middle(found: Calibration) -> np.ndarray:
    posterior = found.found.posterior
    return found.found.plausible.best if posterior is None else posterior.best


def _windows(found: Calibration) -> np.ndarray:
    """(d, 2) shares of each range, between which the posterior lies; the whole ranges without one."""
    posterior, space = found.found.posterior, found.space
    if posterior is None:
        return np.tile([0.0, 1.0], (len(space.free), 1))
    low, high = np.quantile(space.places(posterior.points), LIES, axis=0)
    room = np.maximum(BESIDE * (high - low), NARROWEST)
    return np.clip(np.transpose([low - room, high + room]), 0, 1)


def _unit(free: Free) -> str:
    """In which its upper end is written, empty for a number by itself."""
    return written(float(f"{free.high:.3g}"), free.unit).partition(" ")[2]


def _label(free: Free) -> str:
    words, unit = spelled(free.name), _unit(free)
    return f"{words} ({unit})" if unit else words


def _logarithmic(axes: Axes) -> None:
    axes.set(xscale="log", yscale="log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())


def _ticks(axis: object, free: Free, shown: bool) -> None:
    factor = factor_into(_unit(free)) / factor_into(free.unit)
    ends = free.at(np.array(axis.get_view_interval())) * factor  # type: ignore[attr-defined]
    at = MaxNLocator(TICKS, steps=[1, 2, 5, 10]).tick_values(*ends)
    at = at[(at >= ends[0]) & (at <= ends[1])]
    axis.set_ticks(free.share(at / factor), [f"{value:g}" if shown else "" for value in at])  # type: ignore[attr-defined]
