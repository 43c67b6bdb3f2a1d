"""Pictures of the same laws on several samples: all curves, means and ranges of the peaks, and crack patterns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from grainlaw.columns import STRAIN, STRESS
from grainlaw.drawing.figure import Figure
from grainlaw.drawing.palette import color, marker, style
from grainlaw.results.figures.cracks import side_by_side
from grainlaw.results.figures.curves import (
    draw_crack_numbers,
    label_cracks_and_strain,
    label_stress_and_strain,
    require_stress_and_strain,
)
from grainlaw.results.means import Samples
from grainlaw.results.result import Result
from grainlaw.strength import borne_in


def plot_samples(samples: Samples) -> Figure:
    """Stress-strain curves of each law on all samples, and how cracks accumulate.

    A cross is at the mean of the peaks of a law, and as long as their range.
    """
    figure = Figure(figsize=(8, 7), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    for k, (name, results) in enumerate(samples.items()):
        require_stress_and_strain(results)
        for number, result in enumerate(results.values()):
            look: dict[str, Any] = {"color": color(k), "linestyle": style(k), "linewidth": 0.8}
            label = name if number == 0 else None
            upper.plot(result.curves[STRAIN] * 100, result.curves[STRESS] / 1e6, label=label, **look)
        draw_crack_numbers(lower, k, name, list(results.values()))
        _draw_peaks(upper, list(results.values()), k)
    label_stress_and_strain(upper)
    upper.set_xlabel("")
    upper.legend(frameon=False, title="mean and range of the strengths", alignment="left")
    label_cracks_and_strain(lower)
    return figure


def _draw_peaks(axes: Axes, results: list[Result], k: int) -> None:
    found = [borne_in(result.curves) for result in results]
    places = [each.at for each in found if each is not None and each.failed]
    if len(places) < len(results):
        return
    strain, stress = (
        np.array([result.curves[name][at] * factor for result, at in zip(results, places, strict=True)])
        for name, factor in ((STRAIN, 100), (STRESS, 1e-6))
    )
    ranges = [[[each.mean() - each.min()], [each.max() - each.mean()]] for each in (strain, stress)]
    axes.errorbar(
        strain.mean(), stress.mean(), xerr=ranges[0], yerr=ranges[1], fmt=marker(k), color=color(k), markersize=6,
        linewidth=2, capsize=4, zorder=3,
    )  # fmt: skip


def plot_cracks_of_samples(name: str, results: Mapping[int, Result]) -> Figure:
    """Crack patterns of one law on all samples, at one scale; fragments that flew far away are cut off."""
    return side_by_side({f"{name}, seed {seed}": result for seed, result in results.items()})
