"""Pictures of the same laws on several samples: all curves, means and ranges of the peaks, and crack patterns."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from grainlaw.columns import SHEAR_CRACKS, STRAIN, STRESS, TENSILE_CRACKS
from grainlaw.results.figures.curves import (
    draw_cracks,
    label_cracks_and_strain,
    label_stress_and_strain,
    require_stress_and_strain,
)
from grainlaw.results.result import Result
from grainlaw.results.samples import Samples

FAR = 0.3  #: widths of a sample around it that are shown


def plot_samples(samples: Samples) -> Figure:
    """Stress-strain curves of each law on all samples, and how cracks accumulate.

    A cross is at the mean of the peaks of a law, and as long as their range.
    """
    figure = Figure(figsize=(8, 7), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    for k, (name, results) in enumerate(samples.items()):
        require_stress_and_strain(results)
        for number, result in enumerate(results.values()):
            strain, color, first = result.curves[STRAIN] * 100, f"C{k}", number == 0
            upper.plot(strain, result.curves[STRESS] / 1e6, color=color, linewidth=0.8, label=name if first else None)
            for column, style in ((TENSILE_CRACKS, "-"), (SHEAR_CRACKS, "--")):
                label = f"{name}, {column.split('_')[0]}" if first else None
                if any(each.curves[column][-1] for each in results.values()):
                    lower.plot(strain, result.curves[column], style, color=color, linewidth=0.8, label=label)
        _draw_peaks(upper, list(results.values()), f"C{k}")
    label_stress_and_strain(upper)
    upper.set_xlabel("")
    upper.legend(frameon=False, title="mean and range of the peaks", alignment="left")
    label_cracks_and_strain(lower)
    return figure


def _draw_peaks(axes: Axes, results: list[Result], color: str) -> None:
    if not all(len(result.cracks) for result in results):
        return
    places = [int(np.argmax(result.curves[STRESS])) for result in results]
    strain, stress = (
        np.array([result.curves[name][k] * factor for result, k in zip(results, places, strict=True)])
        for name, factor in ((STRAIN, 100), (STRESS, 1e-6))
    )
    ranges = [[[each.mean() - each.min()], [each.max() - each.mean()]] for each in (strain, stress)]
    axes.errorbar(
        strain.mean(), stress.mean(), xerr=ranges[0], yerr=ranges[1], fmt="o", color=color, markersize=6, linewidth=2,
        capsize=4, zorder=3,
    )  # fmt: skip


def plot_cracks_of_samples(name: str, results: Mapping[int, Result]) -> Figure:
    """Crack patterns of one law on all samples, at one scale; fragments that flew far away are cut off."""
    corners = next(iter(results.values())).specimen.grains.vertices * 1e3
    (left, low), (right, high) = corners.min(axis=0), corners.max(axis=0)
    width, height = right - left, high - low
    figure = Figure(figsize=(len(results) * min(8.0, 5.5 * width / height + 0.9), 7.0), layout="constrained")
    every = figure.subplots(1, len(results), squeeze=False)[0]
    for axes, (seed, result) in zip(every, results.items(), strict=True):
        draw_cracks(axes, result)
        axes.set_title(f"{name}, seed {seed}")
    sides = np.array([[*axes.get_xlim(), *axes.get_ylim()] for axes in every])
    for axes in every:
        axes.set_xlim(max(sides[:, 0].min(), left - FAR * width), min(sides[:, 1].max(), right + FAR * width))
        axes.set_ylim(max(sides[:, 2].min(), low - FAR * width), min(sides[:, 3].max(), high + FAR * width))
    return figure
