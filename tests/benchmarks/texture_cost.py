"""Why a texture takes more steps than even grains: its time step, its time, and what a little mass would change.

    python tests/benchmarks/texture_cost.py [--seeds 1] [--grains 300] [--pairs SEEDS] [--write]

Samples of docs/examples/texture_study.py under Mohr-Coulomb bonds. For each texture: steps to the end of a compression
test over those of even grains, apart into the shorter time step and the longer time; how much shorter the steps of
single nodes are than that of the median node, by Gershgorin's bound; and how much longer the time step is with a share
of mass added to the nodes that govern it. With --pairs the test is run with at most 1 % of mass and without, for so
many seeds: the ratios of first failure, largest stress, steps and CPU time, with the interval of their mean (95 %).
With --write the table goes into docs/tables/textures.md.
"""

import argparse
import sys
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import grainlaw as gl
from grainlaw.engine.model import Model
from grainlaw.engine.stability import ScaledMass, scale_masses
from grainlaw.engine.stable_step import StableStep
from grainlaw.engine.state import State
from grainlaw.results.means import spread

sys.path.insert(0, str(Path(__file__).parents[2] / "docs" / "examples"))
import texture_study

MOST = 0.01  #: of the mass
GAINS = np.arange(1.25, 3.1, 0.25)


def scaled(run: gl.Run) -> tuple[np.ndarray, list[ScaledMass]]:
    """Steps of nodes over that of the median node (n,), and what lengthening the time step takes, by gain."""
    state = State(Model(run.specimen, run.law, gl.Detection()))
    stable = StableStep(state)
    matrix, mass = stable.stiffness(), state.grains.flat(state.freedoms.arrays.mass)
    alike = state.grains.alike(state.freedoms.arrays.mass.shape[1])
    steps = 1 / np.sqrt(np.asarray(abs(matrix).sum(axis=1)).ravel() / mass)
    return steps / np.median(steps), [scale_masses(matrix, mass, float(gain), alike) for gain in GAINS]


def gain_of(found: list[ScaledMass], most: float) -> float:
    """The largest gain that adds at most a share of the mass."""
    return max([1.0, *(float(g) for g, each in zip(GAINS, found, strict=True) if each.added <= most)])


def carried_out(run: gl.Run, mass_scaling: float = 1.0) -> tuple[gl.Result, float]:
    """A result, and its CPU time (s)."""
    start = time.process_time()
    result = gl.simulate(run.specimen, run.law, run.protocol, mass_scaling=mass_scaling, threads=1, progress=False)
    return result, time.process_time() - start


def shares(seeds: int, grains: int) -> Iterator[str]:
    """The lines of the first table."""
    even: dict[int, tuple[float, float]] = {}
    yield "| texture | steps | shorter step | longer time | 1 %, 0.1 % of nodes, shortest | 1 % of mass, 10 % |"
    yield "|---|---|---|---|---|---|"
    for texture in texture_study.TEXTURES:
        rows = []
        for seed in range(1, seeds + 1):
            run = texture_study.case("mohr-coulomb", texture, seed, "compression", grains)
            result, _ = carried_out(run)
            step, whole = result.summary["time_step"], float(result.curves["time"][-1])
            even.setdefault(seed, (step, whole))
            single, found = scaled(run)
            rows.append([
                even[seed][0] / step * whole / even[seed][1], even[seed][0] / step, whole / even[seed][1],
                *np.quantile(single, [0.01, 0.001, 0.0]), gain_of(found, MOST), gain_of(found, 10 * MOST),
            ])  # fmt: skip
        whole, step, longer, *nodes = (f"{mean:.2f}" for mean in np.mean(rows, axis=0))
        cells = (texture, whole, step, longer, ", ".join(nodes[:3]), ", ".join(nodes[3:]))
        yield f"| {' | '.join(cells)} |"


def pairs(seeds: int, grains: int) -> Iterator[str]:
    """The lines of the table of runs with a little mass."""
    yield "| texture | longer step | first failure | largest stress | steps | CPU time |"
    yield "|---|---|---|---|---|---|"
    for texture in ("sizes", "breakable", "all together"):
        rows = []
        for seed in range(1, seeds + 1):
            run = texture_study.case("mohr-coulomb", texture, seed, "compression", grains)
            gain = gain_of(scaled(run)[1], MOST)
            (true, slow), (heavy, fast) = carried_out(run), carried_out(run, gain)
            ratios = [heavy.summary[name] / true.summary[name] for name in ("strength", "largest_stress", "steps")]
            rows.append([gain, *ratios, fast / slow])
        found = [spread(np.array(column)) for column in zip(*rows, strict=True)]
        columns = (f"{each['mean']:.3f} ± {each['interval'][1] - each['mean']:.3f}" for each in found)
        yield f"| {texture} | {' | '.join(columns)} |"


def main() -> None:
    words = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    words.add_argument("--seeds", type=int, default=1)
    words.add_argument("--grains", type=int, default=300)
    words.add_argument("--pairs", type=int, default=0)
    words.add_argument("--write", action="store_true")
    given = words.parse_args()
    warnings.simplefilter("ignore")
    lines = []
    for line in pairs(given.pairs, given.grains) if given.pairs else shares(given.seeds, given.grains):
        print(line, flush=True)
        lines.append(line)
    if given.write:
        name = "texture study cost, pairs" if given.pairs else "texture study cost"
        texture_study.write(name, "\n".join(lines) + "\n", texture_study.PAGE)


if __name__ == "__main__":
    main()
