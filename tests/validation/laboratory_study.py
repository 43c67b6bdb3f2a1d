"""The laboratory programme on the paper's rock: the tables of docs/validation.md.

    python tests/validation/laboratory_study.py [--seeds 1,2,3] [--scatter M] [--plots FOLDER]

Compression and direct tension of 755 grains in 50 x 125 mm, splitting of a disc of 50 mm with grains of the same size;
then each test once more at half the speed, on the first of the seeds.
"""

import argparse
from pathlib import Path

import attrs
import numpy as np

import grainlaw as gl
from grainlaw.cli.table1 import LAWS, ROCK, SAMPLE
from grainlaw.geometry import Voronoi, disc, rectangle
from grainlaw.laws import WeibullField
from grainlaw.protocols import Brazilian, UniaxialCompression, UniaxialTension
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.units import mm

WIDTH, HEIGHT, GRAINS = SAMPLE
GRAIN_SIZE = np.sqrt(WIDTH * HEIGHT / GRAINS)
FLAT, SHAPE_FACTOR = 20.0, 0.9644  # deg; Wang et al. 2004
TESTS = {
    "compression": UniaxialCompression(),
    "tension": UniaxialTension(stop_fraction=0.5),
    "Brazilian": Brazilian(shape_factor=SHAPE_FACTOR, stop_fraction=0.8),  # then halves may carry more than the disc
}
THRESHOLDS = {
    "CI count": "crack_initiation_count",
    "CI lateral": "crack_initiation_lateral",
    "CI volumetric": "crack_initiation_volumetric",
    "CD": "crack_damage",
    "damage": "damage_onset",
}


def specimen(test, seed):
    """What a test is made on."""
    region = disc(50 * mm, loaded=FLAT) if test == "Brazilian" else rectangle(WIDTH, HEIGHT)
    return gl.Specimen(Voronoi(grain_size=GRAIN_SIZE, seed=seed).tessellate(region), ROCK)


def tested(test, laws, seeds, scattered):
    """Results by law, seed and factor of the speed, with a row of the table for each."""
    samples = {seed: specimen(test, seed) for seed in seeds}
    slow = attrs.evolve(TESTS[test], loading=gl.Adaptive(rate=TESTS[test].loading.rate / 2))
    runs = {}
    for name in laws:
        for seed, sample in samples.items():
            runs[name, seed, 1.0] = Run(sample, scattered(LAWS[name], sample), TESTS[test])
        runs[name, seeds[0], 0.5] = attrs.evolve(runs[name, seeds[0], 1.0], protocol=slow)
    results = simulate_all(runs).results
    for (law, seed, factor), result in results.items():
        s = result.summary
        change = f"{(s['peak_stress'] / results[law, seed, 1.0].summary['peak_stress'] - 1) * 100:+.1f} %"
        print(
            f"| {test} | {law} | {seed} | {runs[law, seed, factor].protocol.loading.rate:g} "
            f"| {s['peak_stress'] / 1e6:.2f} "
            f"| {s['peak_strain'] * 100:.4f} | {s['tensile_cracks']} + {s['shear_cracks']} | {s['kinetic_ratio']:.1e} "
            f"| {s['platen_imbalance'] * 100:.1f} % | {s['energy_error']:.0e} | {change if factor < 1 else ''} |",
            flush=True,
        )
    return results


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", default="1,2,3")
    parser.add_argument("--laws", default="mohr-coulomb,cohesive-crack")
    parser.add_argument("--scatter", type=float, help="Weibull modulus of the strengths of the contacts")
    parser.add_argument("--plots", type=Path, help="folder for a picture of each run")
    options = parser.parse_args()
    seeds, laws = [int(seed) for seed in options.seeds.split(",")], options.laws.split(",")
    scattered = WeibullField(modulus=options.scatter).scatter if options.scatter else lambda law, sample: law

    print("| test | law | seed | m/s | peak MPa | strain % | tensile + shear | kinetic | imbalance | energy | change |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    results = {test: tested(test, laws, seeds, scattered) for test in ("tension", "Brazilian", "compression")}

    print(f"\n| law | seed | UCS/T | UCS/T Brazilian | {' | '.join(f'{name}/UCS' for name in THRESHOLDS)} |")
    print(f"|---|---|---|---|{'---|' * len(THRESHOLDS)}")
    for law, seed, factor in results["compression"]:
        if factor == 1:
            ucs, t, brazilian = (results[test][law, seed, factor].summary["peak_stress"] for test in TESTS)
            measures = results["compression"][law, seed, factor].laboratory.properties
            shares = " | ".join(f"{measures[name] / ucs:.2f}" for name in THRESHOLDS.values())
            print(f"| {law} | {seed} | {ucs / t:.1f} | {ucs / brazilian:.1f} | {shares} |", flush=True)

    if options.plots:
        options.plots.mkdir(parents=True, exist_ok=True)
        for test, by_key in results.items():
            for (law, seed, factor), result in by_key.items():
                result.laboratory.plot().savefig(options.plots / f"{test}_{law}_{seed}_{factor:g}.png", dpi=80)


if __name__ == "__main__":
    main()
