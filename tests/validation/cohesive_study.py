"""The cohesive crack on the sample of the paper: the tables of its readings and of how even the grains are.

    python tests/validation/cohesive_study.py

755 grains, Table 1 of the paper, unconfined, default loading; docs/validation.md has both tables.
"""

import attrs
import numpy as np

import grainlaw as gl
from grainlaw.cli.table1 import LAWS, ROCK, SAMPLE
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import PrePeak, Residual
from grainlaw.protocols import UniaxialCompression
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.units import GPa, MPa

WIDTH, HEIGHT, GRAINS = SAMPLE
CRACK = LAWS["cohesive-crack"]
READINGS = {
    "default: exponential pre-peak, floor, 150 and 300 J/m2": CRACK,
    "pre-peak as printed": attrs.evolve(CRACK, pre_peak=PrePeak.AS_PRINTED),
    "linear pre-peak": attrs.evolve(CRACK, pre_peak=PrePeak.LINEAR),
    "residual: blend": attrs.evolve(CRACK, residual=Residual.BLEND),
    "energies 5 and 10 J/m2": attrs.evolve(CRACK, mode_i_energy=5, mode_ii_energy=10),
}
RELAXATIONS = (0, 1, 3, 10, 30)


def sample(seed, relaxation=3):
    grains = Voronoi(grains=GRAINS, seed=seed, relaxation=relaxation).tessellate(rectangle(WIDTH, HEIGHT))
    return gl.Specimen(grains, ROCK)


def by_reading():
    samples = {seed: sample(seed) for seed in (1, 2, 3)}
    runs = {
        (name, seed): Run(samples[seed], law, UniaxialCompression())
        for name, law in READINGS.items()
        for seed in samples
    }
    results = simulate_all(runs, frames=1).results
    print("| | peak (MPa) | mean | strain at peak (%) | tensile + shear | kinetic | imbalance |")
    print("|---|---|---|---|---|---|---|")
    for name in READINGS:
        found = [results[name, seed].summary for seed in samples]
        peaks = [one["peak_stress"] / MPa for one in found]
        strains = " / ".join(f"{one['peak_strain'] * 100:.3f}" for one in found)
        cracks = " / ".join(f"{one['tensile_cracks']} + {one['shear_cracks']}" for one in found)
        print(
            f"| {name} | {' / '.join(f'{peak:.1f}' for peak in peaks)} | {np.mean(peaks):.1f} "
            f"| {strains} | {cracks} "
            f"| {max(one['kinetic_ratio'] for one in found):.0e} "
            f"| {max(one['platen_imbalance'] for one in found) * 100:.1f} % |",
            flush=True,
        )


def by_evenness():
    runs = {
        (relaxation, law, seed): Run(sample(seed, relaxation), LAWS[law], UniaxialCompression())
        for relaxation in RELAXATIONS for law in ("mohr-coulomb", "cohesive-crack") for seed in (1, 2)
    }  # fmt: skip
    results = simulate_all(runs, frames=1).results
    print("\n| `relaxation` | spread of areas | E\\* (GPa) | Mohr-Coulomb peak (MPa) | cohesive crack peak (MPa) |")
    print("|---|---|---|---|---|")
    for relaxation in RELAXATIONS:
        areas = runs[relaxation, "mohr-coulomb", 1].specimen.grains.areas
        cells = [
            " / ".join(f"{results[relaxation, law, seed].summary[name] / unit:{form}}" for seed in (1, 2))
            for law, name, unit, form in (
                ("mohr-coulomb", "apparent_modulus", GPa, ".2f"), ("mohr-coulomb", "peak_stress", MPa, ".1f"),
                ("cohesive-crack", "peak_stress", MPa, ".1f"),
            )
        ]  # fmt: skip
        print(f"| {relaxation} | {areas.std() / areas.mean():.2f} | {' | '.join(cells)} |", flush=True)


if __name__ == "__main__":
    by_reading()
    by_evenness()
