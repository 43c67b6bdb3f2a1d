"""Cost of one time step and of each of its passes, per law, on the 755-grain sample; one thread.

    python tests/benchmarks/step_cost.py [--against COMMAND]

Figures are medians of CPU time over alternating rounds. ``--against`` runs a command once per round in the same run
(a hand-written step, for instance) and prints the ratio to the number of microseconds after "cpu med" in its last
line of output.
"""

import argparse
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from support import ROCK, STIFF, STRONG, advance

import grainlaw as gl
from grainlaw.engine.model import Model
from grainlaw.engine.parts import bonds, zones
from grainlaw.engine.state import State
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack, Linear, MohrCoulomb

LAWS = {
    "linear": Linear(**STIFF),
    "mohr-coulomb": MohrCoulomb(**STRONG),
    "cohesive-crack": CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300),
}
STEPS = 1000


def cpu(function, repeats=1):
    start = time.thread_time()
    for _ in range(repeats):
        function()
    return (time.thread_time() - start) / repeats


def loaded(specimen, law, strain):
    """A state under homogeneous compression, or beyond its peak: pulled apart and pressed at random."""
    state = State(Model(specimen, law))
    place = specimen.mesh.nodes - specimen.mesh.nodes.mean(axis=0)
    state.nodes.arrays.displacement[:] = (place * [0.28 * strain, -strain]).T
    if strain > 0.005:
        shake = np.random.default_rng(1).normal(size=(specimen.grains.count, 2)) * 3e-5
        state.nodes.arrays.displacement[:] += shake[specimen.mesh.node_grain].T
    advance(state, 1)
    return state


def pass_costs(state):
    """Seconds of each pass called by itself on the arrays of a state."""
    u, f, z, b = *state.nodes.arrays[:2], state.zones.arrays, state.bonds.arrays
    count = len(b.half)
    half = slice(0, count), slice(count, 2 * count)
    o, s, n, t = b.opening[0], b.slip[0], b.normal[0], b.shear[0]
    rows = [row[k * count : (k + 1) * count] for row in (b.force_x, b.force_y) for k in range(4)]
    shape, modulus = (z.b1, z.b2, z.c1, z.c2, z.area), (z.d0, z.d1, z.d2)
    moved, pull = (z.x1, z.y1, z.x2, z.y2), (z.f1x, z.f1y, z.f2x, z.f2y)
    gap, frame = (b.d1x, b.d1y, b.d2x, b.d2y, b.ex, b.ey), (b.nx, b.ny, b.inverse)
    law, memory = state.bonds.groups[0].compiled, state.bonds.memory_of(state.bonds.groups[0])
    calls = {
        "zones: gather": lambda: zones.gather_motion(*u, *z.corner, *moved),
        "zones: force": lambda: zones.zone_forces(*moved, *shape, *modulus, *pull),
        "zones: scatter": lambda: zones.scatter_forces(*f, *z.corner, *pull),
        "bonds: gather": lambda: bonds.gather_motion(*u, *b.node, *gap),
        "bonds: kinematics": lambda: bonds.kinematics(
            *gap, b.edge_x, b.edge_y, b.weight, *frame, o[half[0]], o[half[1]], s[half[0]], s[half[1]]
        ),
        "bonds: law": lambda: law.batch(o, s, memory),
        "bonds: work": lambda: [
            bonds.add_work(now[h], before[1][h], a[h], c[1][h], work[h])
            for now, before, a, c, work in (
                (o, b.opening, n, b.normal, b.opening_work), (s, b.slip, t, b.shear, b.slip_work)
            )
            for h in half
        ],
        "bonds: force": lambda: bonds.end_forces(
            *frame, b.half, b.weight, n[half[0]], t[half[0]], n[half[1]], t[half[1]],
            o[half[0]], o[half[1]], s[half[0]], s[half[1]], *rows,
        ),
        "nodes: gather": lambda: bonds.gather_forces(*b.slots, b.force_x, b.force_y, *f),
    }  # fmt: skip
    for call in calls.values():
        call()
    return {name: np.median([cpu(call, 20) for _ in range(15)]) for name, call in calls.items()}


def sample():
    return gl.Specimen(Voronoi(grains=755, seed=1).tessellate(rectangle(50e-3, 125e-3)), ROCK)


def step_times(specimen, rounds, against=None):
    """Seconds of a step by law and moment, one for each round, and of a round of the command ``against``."""
    damped = gl.integration.CentralDifference()
    cases = {
        (name, when): (lambda law=law, strain=strain: loaded(specimen, law, strain))
        for name, law in LAWS.items()
        for when, strain in (("before the peak", 0.002), ("after the peak", 0.01))
    }
    for make in cases.values():
        advance(make(), 10, 1e-12, damped)
    times = {case: [] for case in cases}
    other = []
    for _ in range(rounds):
        for case, make in cases.items():
            state = make()
            times[case].append(cpu(lambda state=state: advance(state, STEPS, 1e-12, damped)) / STEPS)
        if against:
            last = subprocess.run(against, shell=True, capture_output=True, text=True, check=True).stdout
            other.append(float(re.search(r"cpu med\s+([\d.]+)", last.strip().splitlines()[-1]).group(1)) * 1e-6)
    return times, other


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--against")
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    specimen = sample()
    mesh = specimen.mesh
    points = 2 * len(mesh.interfaces)
    print(f"{len(mesh.zones)} zones, {points} contact points, {len(mesh.nodes)} nodes")
    times, other = step_times(specimen, options.rounds, options.against)
    if other:
        print(f"against: {np.median(other) * 1e6:.1f} us")
    for (name, when), values in times.items():
        ratio = f"  ratio {np.median(np.array(values) / np.array(other)):.2f}" if other else ""
        print(f"{name:15} {when:16} {np.median(values) * 1e6:7.1f} us per step{ratio}")
    for name, law in LAWS.items():
        costs = pass_costs(loaded(specimen, law, 0.002))
        shares = ", ".join(f"{key} {value * 1e6:.1f}" for key, value in costs.items())
        print(f"passes of {name} (us): {shares}")


if __name__ == "__main__":
    main()
