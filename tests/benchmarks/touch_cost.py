"""Cost of contact detection: in a specimen that stays whole, and in rigid grains that are poured.

    python tests/benchmarks/touch_cost.py [--grains 100000] [--steps 10000] [--threads 1] [--skin 0.15]

The first figure is the ratio of medians of CPU time over alternating rounds, with detection against without. The second
part lets grains fall into a box: microseconds per step, the share of the search, contacts, and the memory at its peak.
"""

import argparse
import resource
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from support import ROCK, STRONG, advance

import grainlaw as gl
from grainlaw.compiler.batch import compile_integrator
from grainlaw.engine import stepping
from grainlaw.engine.ledger import energies
from grainlaw.engine.stable_step import StableStep
from grainlaw.engine.state import State
from grainlaw.geometry import Hexagonal, Voronoi, apart, block, rectangle, together
from grainlaw.laws import CohesiveCrack, Friction

STEPS = 1000


def cpu(function):
    start = time.thread_time()
    function()
    return time.thread_time() - start


def whole_specimen(rounds):
    """Ratio of a step with detection to one without, on the 755-grain sample before its peak."""
    specimen = gl.Specimen(Voronoi(grains=755, seed=1).tessellate(rectangle(50e-3, 125e-3)), ROCK)
    law = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300)
    states = [State(specimen, law, detection) for detection in (None, gl.Detection())]
    damped = gl.CentralDifference()
    place = specimen.mesh.nodes - specimen.mesh.nodes.mean(axis=0)
    for state in states:
        state.nodes.arrays.displacement[:] = (place * [0.28 * 0.002, -0.002]).T
        advance(state, 10, 1e-12, damped)
    times = [[cpu(lambda state=state: advance(state, STEPS, 1e-12, damped)) for state in states] for _ in range(rounds)]
    without, with_detection = np.median(times, axis=0)
    print(
        f"whole specimen: {1e6 * without / STEPS:.1f} us per step, with detection {with_detection / without:.3f} of it"
    )


def pour(count, steps, threads, skin):
    """Loose grains fall into a box that is a little wider than they are."""
    size = 0.01
    width = size * np.sqrt(2 * count)
    start = time.perf_counter()
    grains = apart(Hexagonal(grains=count).tessellate(rectangle(width, width / 2)), 0.03 * size)
    thick, gap = 4 * size, 0.05 * size
    left, right, top = -gap, width + gap, 2 * width
    walls = [
        block(
            [(left - thick, -gap - thick), (right + thick, -gap - thick), (right + thick, -gap), (left - thick, -gap)]
        ),
        block([(left - thick, -gap), (left, -gap), (left, top), (left - thick, top)]),
        block([(right, -gap), (right + thick, -gap), (right + thick, top), (right, top)]),
    ]
    specimen = gl.Specimen(together(grains, *walls), gl.Rigid(density=2600))
    total = specimen.grains.count
    law = Friction(kn=1e10, ks=1e10, friction_angle=30)
    state = State(specimen, law, gl.Detection(damping=0.2, skin=skin))
    integrator = gl.CentralDifference(damping=gl.Undamped(), safety=0.8)
    state.begin(
        gl.Stage(
            name="pour", until=[gl.Reaches("time", 1)], interval=1, gravity=(0, -9.81), fixed=range(total - 3, total)
        )
    )
    state.time_step = StableStep(state).step(integrator)
    print(f"{total} rigid grains, set up in {time.perf_counter() - start:.1f} s, step {state.time_step:.3g} s")
    compiled = compile_integrator(integrator)
    stepping.advance(state, compiled, 1, threads=threads)
    state.contacts.seconds = 0.0
    for _ in range(10):
        start, before, searched = time.perf_counter(), state.contacts.searches, state.contacts.seconds
        stepping.advance(state, compiled, max(steps // 10, 1), threads=threads)
        seconds = time.perf_counter() - start
        energy = energies(state)
        ledger = energy["external"] - sum(value for name, value in energy.items() if name != "external")
        closed = int(np.count_nonzero(state.contacts.arrays.length))
        print(
            f"t = {state.time:.4f} s: {1e6 * seconds / max(steps // 10, 1):.0f} us per step, search "
            f"{100 * (state.contacts.seconds - searched) / seconds:.1f} % ({state.contacts.searches - before} times), "
            f"{len(state.contacts)} pairs, {closed} closed, kinetic energy {energy['kinetic']:.4g} J, "
            f"ledger gap {ledger:.1e} J"
        )
    print(f"memory at its peak {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.2f} GB")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--grains", type=int, default=2000)
    parser.add_argument("--steps", type=int, default=10000)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--skin", type=float, default=0.15)
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    whole_specimen(options.rounds)
    pour(options.grains, options.steps, options.threads, options.skin)


if __name__ == "__main__":
    main()
