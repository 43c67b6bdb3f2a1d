"""Contact laws on the same grains under the same compression: curves, cracks, and where the energy goes.

    python docs/examples/compare_laws.py [--quick] [--out FOLDER]

All laws have the same stiffness, strength and, where they have any, fracture energies. 755 grains, seeds 1, 2, 3:
some minutes on two cores; --quick: 120 grains, one seed, less than a minute. Prints a table; writes laws.png and
laws.json.
"""

import argparse
import json
import textwrap
from pathlib import Path

import numpy as np
from dissipation import Dissipation
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

import grainlaw as gl
from grainlaw import laws
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import GPa, MPa, mm

ROCK = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
stiff = dict(kn=1.05e14, ks=9.45e13)
even = stiff | dict(tensile_strength=13 * MPa, cohesion=29 * MPa, residual_friction_angle=5)
rough = even | dict(residual_friction_angle=54)
strong = even | dict(friction_angle=54)
tough = dict(mode_i_energy=150, mode_ii_energy=300)
LAWS = {
    "linear": laws.Linear(**stiff),
    "Mohr-Coulomb": laws.MohrCoulomb(**strong),
    "cohesive crack": laws.CohesiveCrack(**strong, **tough),
    "Munjiza": laws.MunjizaJoint(**strong, **tough),
    "Camacho-Ortiz": laws.CamachoOrtiz(**even, **tough),
    "bilinear mixed mode": laws.BilinearMixedMode(**even, **tough),
    "Xu-Needleman": laws.XuNeedleman(**even),  # stiffness and strength are its fracture energies, 8.7 and 14.7 J/m2
    "Camacho-Ortiz, 54 deg": laws.CamachoOrtiz(**rough, **tough),
    "bilinear mixed mode, 54 deg": laws.BilinearMixedMode(**rough, **tough),
}
SAMPLE, QUICK = (755, 50 * mm, 125 * mm), (120, 20 * mm, 50 * mm)  #: grains, width, height
COLUMNS = (
    ("peak (MPa)", "peak_stress", MPa, ".1f"), ("strain at peak (%)", "peak_strain", 0.01, ".3f"),
    ("E* (GPa)", "apparent_modulus", GPa, ".2f"), ("tensile cracks", "tensile_cracks", 1, ".0f"),
    ("shear cracks", "shear_cracks", 1, ".0f"), ("lost in opening (J/m)", "lost_opening", 1, ".1f"),
    ("lost in slip (J/m)", "lost_slip", 1, ".1f"),
)  # fmt: skip


def run(laws, grains, width, height, seed):
    """Results by the name of the law, and their numbers (SI)."""
    rock = gl.Specimen(Voronoi(grains=grains, seed=seed).tessellate(rectangle(width, height)), ROCK)
    watchers = {name: Dissipation() for name in laws}
    results = gl.compare(rock, laws, UniaxialCompression(), observers=lambda name: [watchers[name]], frames=1)
    numbers = {}
    for name, result in results.items():
        opening, slip = watchers[name].lost(*laws[name].stiffness)
        numbers[name] = {"seed": seed, **result.summary, "lost_opening": opening, "lost_slip": slip}
    return results, numbers


def cells(numbers):
    """Cells of Markdown from the numbers of one law on each specimen: the mean, and the range."""
    for _, key, unit, form in COLUMNS:
        values = np.array([one[key] for one in numbers]) / unit
        spread = f" ({values.min():{form}} to {values.max():{form}})" if np.ptp(values) > 0 else ""
        yield f"{values.mean():{form}}{spread}"


def table(runs):
    """Lines of Markdown: a row for each law."""
    yield "| law | " + " | ".join(heading for heading, *_ in COLUMNS) + " |"
    yield "|---" * (len(COLUMNS) + 1) + "|"
    for name in runs[0]:
        yield f"| {name} | {' | '.join(cells([numbers[name] for numbers in runs]))} |"


def picture(comparisons):
    """Curves of all samples, a colour for each law, over the cracks of the first: tensile red, shear blue."""
    names = [name for name, result in comparisons[0].items() if len(result.cracks)]
    figure = Figure(figsize=(9, 8), layout="constrained")
    grid = figure.add_gridspec(2, len(names), height_ratios=[1.6, 1])
    axes = figure.add_subplot(grid[0, :])
    for results in comparisons:
        for name, result in results.items():
            color, label = (f"C{names.index(name)}" if name in names else "0.7"), name * (results is comparisons[0])
            axes.plot(result.curves["strain"] * 100, result.curves["stress"] / MPa, color=color, label=label, lw=1.1)
    axes.set(xlabel="axial strain (%)", ylabel="axial stress (MPa)", xlim=0, ylim=0)
    axes.legend(frameon=False)
    for k, name in enumerate(names):
        result, axes = comparisons[0][name], figure.add_subplot(grid[1, k])
        cracks, ((left, low), (right, high)) = result.cracks, result.specimen.grains.region.bounds
        half = np.stack([np.cos(cracks.orientation), np.sin(cracks.orientation)]).T * cracks.length[:, None] / 2
        colors = np.where(cracks.tensile, "#c8281e", "#1f5fbf")
        lines = np.stack([cracks.position - half, cracks.position + half], axis=1)
        axes.add_collection(LineCollection(lines, colors=colors, linewidths=0.7))
        axes.set(aspect="equal", xticks=[], yticks=[], xlim=(left - 2 * mm, right + 2 * mm), ylim=(low, high))
        axes.set_title(textwrap.fill(name, 14), fontsize=7)
    return figure


def study(laws, name):
    """Run, print and write what the command line asks for."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--out", type=Path, default="out")
    options = parser.parse_args()
    sample, seeds = (QUICK, [1]) if options.quick else (SAMPLE, [1, 2, 3])
    comparisons, runs = zip(*(run(laws, *sample, seed) for seed in seeds), strict=True)
    print(*table(runs), sep="\n")
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / f"{name}.json").write_text(json.dumps(runs, indent=2), encoding="utf-8")
    picture(comparisons).savefig(options.out / f"{name}.png", dpi=100)


if __name__ == "__main__":
    study(LAWS, "laws")
