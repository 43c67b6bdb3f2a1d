"""What 10 and 100 times the grains cost per step, how long a second start takes, and how much memory a model needs.

    python tests/benchmarks/growth.py [--grains 755,7550,75500]

Medians of CPU time.
"""

import argparse
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

START = """
import time
begin = time.perf_counter()
import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack
from grainlaw.protocols import UniaxialCompression
import sys
sys.path.insert(0, {tests!r})
from support import ROCK, STRONG
imported = time.perf_counter()
specimen = gl.Specimen(Voronoi(grains=755, seed=1).tessellate(rectangle(50e-3, 125e-3)), ROCK)
specimen.mesh
made = time.perf_counter()
law = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300)
class First(gl.Observer):
    def observe(self, state, curves, stage, progress):
        now = time.perf_counter()
        print(f"imports {{imported - begin:.2f}} s, specimen {{made - imported:.2f}} s, "
              f"to the first sample ({{state.steps}} steps) {{now - made:.2f}} s, all {{now - begin:.2f}} s")
        raise SystemExit
gl.simulate(specimen, law, UniaxialCompression(samples=100_000), observers=[First()])
"""


def start():
    """What a start in a process of its own says of its times."""
    code = START.format(tests=str(Path(__file__).parents[1]))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    return done.stdout.strip() or done.stderr


def step_cost(grains, rounds=5):
    from support import ROCK, STRONG, advance

    import grainlaw as gl
    from grainlaw.engine.model import Model
    from grainlaw.engine.state import State
    from grainlaw.geometry import Voronoi, rectangle
    from grainlaw.laws import CohesiveCrack

    scale = (grains / 755) ** 0.5
    begin = time.perf_counter()
    specimen = gl.Specimen(Voronoi(grains=grains, seed=1).tessellate(rectangle(50e-3 * scale, 125e-3 * scale)), ROCK)
    law = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300)
    state = State(Model(specimen, law))
    made = time.perf_counter() - begin
    steps = max(20, 1_000_000 // grains)
    advance(state, steps, 1e-12, gl.integration.CentralDifference())
    times = []
    for _ in range(rounds):
        start = time.thread_time()
        advance(state, steps, 1e-12, gl.integration.CentralDifference())
        times.append((time.thread_time() - start) / steps)
    return float(np.median(times)), made


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--grains", default="755,7550,75500")
    options = parser.parse_args()
    for turn in ("first", "second", "third"):
        print(f"{turn} start: {start()}")
    base = None
    for grains in (int(n) for n in options.grains.split(",")):
        cost, made = step_cost(grains)
        base = base or cost / grains
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(
            f"{grains:7d} grains: {cost * 1e6:10.1f} us per step, {cost / grains / base:.2f} times linear growth; "
            f"made in {made:.1f} s, peak memory so far {memory:.0f} MB"
        )


if __name__ == "__main__":
    main()
