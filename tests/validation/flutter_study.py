"""What the damping does to the strength, by reading of the cohesive crack: tables and picture of docs/flutter.md.

    python tests/validation/flutter_study.py [--seeds 1,2,3] [--plots FOLDER]

755 grains in 50 x 125 mm, Table 1 of the paper. First each law is held at three stresses without damping, then the
uniaxial strength is found with local damping and with ever less mass-proportional damping.
"""

import argparse
from pathlib import Path

import attrs
import numpy as np
from matplotlib.figure import Figure

import grainlaw as gl
from grainlaw.cli.table1 import LAWS, ROCK, SAMPLE
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import PrePeak
from grainlaw.protocols import UniaxialCompression
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.units import MPa

WIDTH, HEIGHT, GRAINS = SAMPLE
CRACK = LAWS["cohesive-crack"]
HELD = {
    "cohesive crack": CRACK,
    "cohesive crack, as printed": attrs.evolve(CRACK, pre_peak=PrePeak.AS_PRINTED),
    "cohesive crack, linear": attrs.evolve(CRACK, pre_peak=PrePeak.LINEAR),
    "Munjiza": LAWS["munjiza"],
    "Mohr-Coulomb": LAWS["mohr-coulomb"],
    "Camacho-Ortiz": LAWS["camacho-ortiz"],
    "bilinear mixed mode": LAWS["bilinear-mixed-mode"],
    "Xu-Needleman": LAWS["xu-needleman"],
}
STRESSES = (26 * MPa, 51 * MPa, 99 * MPa)
LOADED = ("cohesive crack", "cohesive crack, as printed", "cohesive crack, linear", "Munjiza", "Mohr-Coulomb")
DAMPINGS = {
    "local 0.8": gl.LocalDamping(),
    "mass 1e5 1/s": gl.MassDamping(coefficient=1e5),
    "mass 3e4 1/s": gl.MassDamping(coefficient=3e4),
    "mass 1e4 1/s": gl.MassDamping(coefficient=1e4),
}


def sample(seed):
    return gl.Specimen(Voronoi(grains=GRAINS, seed=seed).tessellate(rectangle(WIDTH, HEIGHT)), ROCK)


def hold(specimen):
    """Print the table of held samples; return what became of them by law and stress."""
    print("| law | " + " | ".join(f"{stress / MPa:g} MPa" for stress in STRESSES) + " |")
    print("|---" * (len(STRESSES) + 1) + "|")
    found = {}
    for name, law in HELD.items():
        cells = []
        for stress in STRESSES:
            try:
                held = found[name, stress] = gl.hold(specimen, law, stress)
            except gl.StageError:
                cells.append("fails before")
                continue
            tenfold = np.log(10) / held.rate * 1e6 if held.flutters else np.inf
            cells.append(f"flutters, tenfold in {tenfold:.3g} us" if held.flutters else f"{held.kinetic.max():.0e} J/m")
        print(f"| {name} | {' | '.join(cells)} |", flush=True)
    return found


def load(seeds):
    """Print the table of strengths by law and damping."""
    runs = {
        (name, damping, seed): Run(
            sample(seed), HELD[name], UniaxialCompression(integrator=gl.CentralDifference(damping=DAMPINGS[damping]))
        )
        for name in LOADED for damping in DAMPINGS for seed in seeds
    }  # fmt: skip
    results = simulate_all(runs, frames=20).results
    print("\n| law | damping | peak (MPa) | mean | kinetic ratio | imbalance | energy made |")
    print("|---|---|---|---|---|---|---|")
    for name in LOADED:
        for damping in DAMPINGS:
            found = [results[name, damping, seed].summary for seed in seeds]
            peaks = [one["peak_stress"] / MPa for one in found]
            worst = {key: max(s[key] for s in found) for key in ("kinetic_ratio", "platen_imbalance", "energy_made")}
            print(
                f"| {name} | {damping} | {' / '.join(f'{peak:.1f}' for peak in peaks)} | {np.mean(peaks):.1f} "
                f"| {worst['kinetic_ratio']:.0e} | {worst['platen_imbalance'] * 100:.1f} % "
                f"| {worst['energy_made']:.0e} |",
                flush=True,
            )


def picture(held):
    """Kinetic energy of the held samples over time."""
    figure = Figure(figsize=(9, 4), layout="constrained")
    for axes, stress in zip(figure.subplots(1, 2, sharey=True), STRESSES[1:], strict=True):
        for k, name in enumerate(HELD):
            if (name, stress) in held:
                one = held[name, stress]
                axes.semilogy(one.time * 1e6, np.maximum(one.kinetic, 1e-13), color=f"C{k}", label=name, lw=1.3)
        axes.set(xlabel="time without damping (us)", title=f"held at {stress / MPa:g} MPa")
        axes.grid(alpha=0.25)
        axes.legend(frameon=False, fontsize=7)
    figure.axes[0].set_ylabel("kinetic energy (J/m)")
    return figure


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", default="1,2,3")
    parser.add_argument("--plots", type=Path, help="folder for the picture")
    options = parser.parse_args()
    held = hold(sample(1))
    if options.plots:
        options.plots.mkdir(parents=True, exist_ok=True)
        picture(held).savefig(options.plots / "flutter.png", dpi=110)
    load([int(seed) for seed in options.seeds.split(",")])


if __name__ == "__main__":
    main()
