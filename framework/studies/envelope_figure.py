"""The picture of a strength envelope."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from grainlaw.columns import STRAIN, STRESS
from grainlaw.drawing.figure import Figure
from grainlaw.drawing.palette import BLUE, VERMILLION, color, marker
from grainlaw.results.figures.curves import EVERY, label_stress_and_strain, require_stress_and_strain
from grainlaw.studies.groups import rest

if TYPE_CHECKING:
    from grainlaw.studies.envelope import StrengthEnvelope


def plot_envelope(envelope: StrengthEnvelope) -> Figure:
    """Stress-strain curves by confinement, and strengths over confinement with the criteria fitted to them."""
    table = envelope.table
    results = {k: table.run(k) for k in range(len(table)) if table.is_finished(k)}
    require_stress_and_strain(results)
    figure = Figure(figsize=(11, 5), layout="constrained")
    left, right = figure.subplots(1, 2)
    others = rest(table, envelope.confinement)
    samples = {k: tuple(table.rows[k][name] for name in others) for k in results}
    styles = dict(zip(dict.fromkeys(samples.values()), itertools.cycle(("-", "--", ":")), strict=False))
    confinements = [float(p) for p in np.unique(envelope.strengths[:, 0])]
    for k, result in results.items():
        p, first = float(table.rows[k][envelope.confinement]), samples[k] == next(iter(styles))
        strain, stress = result.curves[STRAIN] * 100, result.curves[STRESS] / 1e6
        label = f"{p / 1e6:g} MPa" if first else None
        number = confinements.index(p)
        look = {"color": color(number), "marker": marker(number), "markevery": EVERY, "markersize": 4}
        left.plot(strain, stress, styles[samples[k]], linewidth=1.3, label=label, **look)
    label_stress_and_strain(left)
    left.legend(title="confinement", frameon=False)
    x, y = envelope.strengths.T / 1e6
    line, parabola = envelope.mohr_coulomb, envelope.hoek_brown
    at = np.linspace(0, max(x), 100)
    right.plot(x, y, "o", color="0.2", markersize=5)
    label = f"Mohr-Coulomb: c = {line.cohesion / 1e6:.2f} MPa, φ = {line.friction_angle:.2f}°"
    right.plot(at, line.ucs / 1e6 + line.slope * at, color=BLUE, label=label)
    ucs = parabola.ucs / 1e6
    label = f"Hoek-Brown: m = {parabola.m:.1f}, UCS = {ucs:.1f} MPa"
    right.plot(at, at + np.sqrt(np.maximum(parabola.m * ucs * at + ucs**2, 0)), "--", color=VERMILLION, label=label)
    right.set_xlabel("confinement (MPa)")
    right.set_ylabel("strength (MPa)")
    right.set_ylim(bottom=0)
    right.legend(frameon=False, loc="lower right")
    right.grid(alpha=0.25)
    return figure
