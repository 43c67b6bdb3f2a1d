"""How the peak of the Mohr-Coulomb sample moves with numerics: the table of docs/validation.md.

    python tests/validation/strength_study.py [--seeds 1,2,3] [--only NAME]

755 grains, Table 1 of the paper, unconfined. Each row changes one thing against the first.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from support import ROCK, STRONG

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import UniaxialCompression

CASES = {
    "base: default loading, gauss points": {},
    "half the rate of loading": {"test": {"loading": gl.Adaptive(rate=0.00075)}},
    "time step halved": {"run": {"time_step_factor": 0.5}},
    "zones refined once": {"specimen": {"refinement": 1}},
    "contact points at the ends": {"specimen": {"contact_points": gl.EndPoints()}},
    "contact points inset 0.1 mm": {"specimen": {"contact_points": gl.InsetPoints(inset=1e-4)}},
}


def run(seed, specimen=None, test=None, run=None):
    grains = Voronoi(grains=755, seed=seed).tessellate(rectangle(50e-3, 125e-3))
    sample = gl.Specimen(grains, ROCK, **(specimen or {}))
    protocol = UniaxialCompression(maximum_strain=0.008, samples=800, **(test or {}))
    return gl.simulate(sample, MohrCoulomb(**STRONG), protocol, frames=1, **(run or {}))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", default="1,2,3")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    seeds = [int(seed) for seed in options.seeds.split(",")]
    print("| case | peak (MPa) | strain at peak (%) | stress left at the end | tensile + shear | kinetic | imbalance |")
    print("|---|---|---|---|---|---|---|")
    for name, case in CASES.items():
        if options.only in name:
            results = [run(seed, **case) for seed in seeds]
            s = [result.summary for result in results]
            end = [r.curves["stress"][-1] / r.summary["peak_stress"] for r in results]

            def row(values, form):
                return " / ".join(form.format(value) for value in values)

            print(
                f"| {name} | {row([x['peak_stress'] / 1e6 for x in s], '{:.1f}')} "
                f"(mean {np.mean([x['peak_stress'] for x in s]) / 1e6:.1f}) "
                f"| {row([x['peak_strain'] * 100 for x in s], '{:.3f}')} | {row(end, '{:.2f}')} "
                f"| {row([str(x['tensile_cracks']) + ' + ' + str(x['shear_cracks']) for x in s], '{}')} "
                f"| {row([x['kinetic_ratio'] for x in s], '{:.1e}')} "
                f"| {row([x['platen_imbalance'] * 100 for x in s], '{:.1f} %')} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
