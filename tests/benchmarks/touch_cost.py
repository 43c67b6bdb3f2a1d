"""Cost of contact detection: in a specimen that stays whole, of one contact, and in rigid grains that are poured.

    python tests/benchmarks/touch_cost.py [--grains 100000] [--steps 10000] [--threads 1] [--skin 0.15]

The first figure is the ratio of medians of CPU time over alternating rounds, with detection against without. The second
part compares hexagons that are nearly in contact, or pressed, with some among which no pairs are found. The third lets
grains fall into a box: microseconds per step, the share of the search, contacts per grain, time, memory at its peak.
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
from grainlaw.engine.contacts.contact_table import APART
from grainlaw.engine.ledger import energies
from grainlaw.engine.model import Model
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
    """Seconds of a step without detection and with it, on the 755-grain sample before its peak."""
    specimen = gl.Specimen(Voronoi(grains=755, seed=1).tessellate(rectangle(50e-3, 125e-3)), ROCK)
    law = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300)
    states = [State(Model(specimen, law, detection)) for detection in (None, gl.Detection())]
    damped = gl.integration.CentralDifference()
    place = specimen.mesh.nodes - specimen.mesh.nodes.mean(axis=0)
    for state in states:
        state.nodes.arrays.displacement[:] = (place * [0.28 * 0.002, -0.002]).T
        advance(state, 10, 1e-12, damped)
    times = [[cpu(lambda state=state: advance(state, STEPS, 1e-12, damped)) for state in states] for _ in range(rounds)]
    return np.median(times, axis=0) / STEPS


def pack(count, gap):
    """Rigid hexagons whose faces are ``gap`` (of their size) apart; those that overlap are in contact."""
    size = 0.01
    width = size * np.sqrt(2 * count)
    loose = 0.03
    grains = apart(Hexagonal(grains=count).tessellate(rectangle(width, width / 2)), loose * size)
    law = Friction(kn=1e10, ks=1e10, friction_angle=30)
    state = State(Model(gl.Specimen(grains, gl.Rigid(density=2600)), law, gl.Detection(damping=0.2)))
    centre = state.grain_motion()[0]
    spacing = np.sqrt(2 / np.sqrt(3))  # of the centres of hexagons, over the root of their area
    shift = -(loose - gap) / spacing * (centre - centre.mean(axis=0))
    turn = np.random.default_rng(0).uniform(-0.1, 0.1, len(shift)) * loose  # no two corners stand alike
    state.freedoms.arrays.displacement[:, : len(shift)] = [*shift.T, turn]
    state.nodes.arrays.displacement[:] = state.grains.nodes_at(state.freedoms.arrays.displacement)
    state.search(state.nodes.arrays.displacement)
    state.contacts.arrays.state[:] = APART  # they meet with a force
    return state


def one_contact(count, rounds):
    """Nanoseconds that a step takes longer for each near pair, for each closed contact; how many each grain has."""
    states = [pack(count, gap) for gap in (0.02, 0.003, -0.002)]
    rest = gl.integration.CentralDifference(damping=gl.integration.Undamped())
    steps = max(200_000 // count, 10)
    for state in states:
        advance(state, 2, 1e-12, rest)
    times = [[cpu(lambda state=state: advance(state, steps, 1e-12, rest)) for state in states] for _ in range(rounds)]
    far, near, pressed = 1e9 * np.median(times, axis=0) / steps
    pairs, closed = len(states[1].contacts), int(np.count_nonzero(states[2].contacts.arrays.length))
    each = (near - far) / pairs
    return each, (pressed - far - each * (len(states[2].contacts) - closed)) / closed, pairs / count, closed / count


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
    state = State(Model(specimen, law, gl.Detection(damping=0.2, skin=skin)))
    integrator = gl.integration.CentralDifference(damping=gl.integration.Undamped(), safety=0.8)
    state.begin(
        gl.Stage(
            name="pour",
            until=[gl.conditions.Reaches("time", 1)],
            interval=1,
            loads=[gl.loads.Gravity(), gl.loads.Fixed(grains=range(total - 3, total))],
        )
    )
    state.time_step = StableStep(state).step(integrator)
    print(f"{total} rigid grains, set up in {time.perf_counter() - start:.1f} s, step {state.time_step:.3g} s")
    compiled = compile_integrator(integrator)
    stepping.advance(state, compiled, 1, threads=threads)
    state.contacts.seconds = 0.0
    start_of_pour = time.perf_counter()
    for _ in range(10):
        start, before, searched = time.perf_counter(), state.contacts.searches, state.contacts.seconds
        stepping.advance(state, compiled, max(steps // 10, 1), threads=threads)
        seconds = time.perf_counter() - start
        energy = energies(state)
        ledger = energy["external"] - sum(value for name, value in energy.items() if name != "external")
        closed = int(np.count_nonzero(state.contacts.arrays.length))
        searches, share = state.contacts.searches - before, (state.contacts.seconds - searched) / seconds
        print(
            f"t = {state.time:.4f} s: {1e6 * seconds / max(steps // 10, 1):.0f} us per step, "
            f"search {100 * share:.1f} % ({searches} times), per grain {len(state.contacts) / total:.1f} pairs, "
            f"{closed / total:.1f} closed contacts, kinetic energy {energy['kinetic']:.4g} J, ledger gap {ledger:.1e} J"
        )
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"{time.perf_counter() - start_of_pour:.0f} s, memory at its peak {peak:.2f} GB")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--grains", type=int, default=2000)
    parser.add_argument("--steps", type=int, default=10000)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--skin", type=float, default=0.15)
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    without, with_detection = whole_specimen(options.rounds)
    print(f"whole specimen: {1e6 * without:.1f} us per step, with detection {with_detection / without:.3f} of it")
    count = min(options.grains, 20_000)
    near, closed, pairs, contacts = one_contact(count, options.rounds)
    print(
        f"{count} hexagons: {near:.1f} ns per near pair, {closed:.0f} ns per closed contact "
        f"({pairs:.1f} pairs, {contacts:.1f} closed contacts per grain)"
    )
    pour(options.grains, options.steps, options.threads, options.skin)


if __name__ == "__main__":
    main()
