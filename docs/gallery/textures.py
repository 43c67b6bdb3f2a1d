"""
Textures side by side
=====================

Grains of one size, of prescribed sizes, finer along one side; minerals, grains that can break, and joints.
"""

import numpy as np
from matplotlib.figure import Figure

from grainlaw.geometry import (
    Breakable,
    Graded,
    Hexagonal,
    Jointed,
    Laguerre,
    Lognormal,
    Minerals,
    Voronoi,
    VoronoiCells,
    rectangle,
)
from grainlaw.units import mm

region = rectangle(20 * mm, 40 * mm)
even = Voronoi(grains=100, seed=1)
sizes = Laguerre(grains=100, sizes=Lognormal(deviation=0.5), seed=1)
fine = Graded(place=[(0, 0), (0, 40 * mm)], size=1 * mm, growth=0.15, largest=4 * mm)
minerals = Minerals(
    even, {"quartz": 0.3, "feldspar": 0.6, "mica": 0.1}, clustering=1.3, seed=1
)
coarse = Minerals(Voronoi(grains=40, seed=1), {"quartz": 0.4, "mica": 0.6}, seed=1)
joints = {
    "bedding": [[(0, 12 * mm), (20 * mm, 18 * mm)]],
    "fault": [[(4 * mm, 0), (14 * mm, 40 * mm)]],
}
textures = {
    "hexagonal": Hexagonal(grains=100),
    "Voronoi": even,
    "prescribed sizes": sizes,
    "finer along one side": Laguerre(
        grain_size=fine, sizes=Lognormal(deviation=0.2), seed=1
    ),
    "minerals": minerals,
    "breakable, jointed": Jointed(Breakable(coarse, VoronoiCells(size=1.5 * mm)), joints),
}
made = {name: each.tessellate(region) for name, each in textures.items()}

figure = Figure(figsize=(9, 9), layout="constrained")
for panel, (name, grains) in zip(figure.subfigures(2, 3).flat, made.items(), strict=True):
    axes = panel.subplots()
    grains.plot(by="phase" if len(grains.phase_names) else "parent", ax=axes)
    axes.set_title(f"{name}\n{grains.count} cells", fontsize=9)
    if legend := axes.get_legend():
        words = [text.get_text() for text in legend.get_texts()]
        place = {
            "loc": "upper center",
            "bbox_to_anchor": (0.5, -0.16),
            "ncols": 2,
            "fontsize": 7,
        }
        axes.legend(legend.legend_handles, words, **place)
figure

# %%
# **Check.** The areas are those that were asked for, and so are the shares of the minerals.
fit = sizes.fit(region)
print(fit)
assert fit.largest_after < 0.02
grains = made["minerals"]
shares = np.bincount(grains.phase, grains.areas) / grains.areas.sum()
print(dict(zip(grains.phase_names, shares.round(3).tolist(), strict=True)))
assert np.allclose(shares, [0.3, 0.6, 0.1], atol=2e-3)
