"""What a strength costs: adaptive loading beside the constant speed that was the default before.

    python tests/benchmarks/strength_cost.py [--seeds 1,2,3] [--rounds 3]

755 grains, uniaxial compression, one thread, alternating; prints steps, seconds in the time loop (medians) and their
ratio for Mohr-Coulomb, the cohesive crack model and the linear law.
"""

import argparse
from statistics import median

import grainlaw as gl
from grainlaw.cli.default_rock import LAWS, ROCK, SAMPLE
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.protocols import UniaxialCompression

LOADINGS = {"adaptive": gl.Adaptive(), "0.05 m/s": gl.Constant(speed=0.05)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--seeds", default="1,2,3")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--laws", default="linear,mohr-coulomb,cohesive-crack")
    options = parser.parse_args()
    width, height, grains = SAMPLE
    for law in options.laws.split(","):
        for seed in map(int, options.seeds.split(",")):
            sample = gl.Specimen(Voronoi(grains=grains, seed=seed).tessellate(rectangle(width, height)), ROCK)
            times, found = {name: [] for name in LOADINGS}, {}
            for _ in range(options.rounds):
                for name, loading in LOADINGS.items():
                    test = UniaxialCompression(loading=loading)
                    found[name] = gl.simulate(sample, LAWS[law], test, threads=1, frames=1).summary
                    times[name].append(found[name]["seconds"])
            seconds = {name: median(each) for name, each in times.items()}
            words = ", ".join(f"{name} {one['steps']} steps, {seconds[name]:.2f} s" for name, one in found.items())
            print(f"{law}, seed {seed}: {words}; ratio {seconds['adaptive'] / seconds['0.05 m/s']:.2f}", flush=True)


if __name__ == "__main__":
    main()
