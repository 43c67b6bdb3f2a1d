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
from grainlaw.engine import passes
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
    state = State(specimen, law)
    place = specimen.mesh.nodes - specimen.mesh.nodes.mean(axis=0)
    state.arrays.displacement[:] = (place * [0.28 * strain, -strain]).T
    if strain > 0.005:
        shake = np.random.default_rng(1).normal(size=(specimen.grains.count, 2)) * 3e-5
        state.arrays.displacement[:] += shake[specimen.mesh.node_grain].T
    advance(state, 1)
    return state


def pass_costs(state):
    """Seconds of each pass called by itself on the arrays of a state."""
    m, c = state.arrays, state.contacts
    count = len(c.half)
    half = slice(0, count), slice(count, 2 * count)
    o, s, n, t = c.opening[0], c.slip[0], c.normal[0], c.shear[0]
    rows = [f[k * count : (k + 1) * count] for f in c.force for k in range(4)]
    group = state.groups[0].compiled
    memory = state.groups[0].memory
    calls = {
        "zones: gather": lambda: passes.gather_zones(*m.displacement, *m.corner, *m.motion),
        "zones: force": lambda: passes.zone_forces(*m.motion, *m.shape, *m.modulus, *m.pull),
        "zones: scatter": lambda: passes.scatter_zones(*m.force, *m.corner, *m.pull),
        "contacts: gather": lambda: passes.gather_contacts(*m.displacement, *c.node, *c.gap),
        "contacts: kinematics": lambda: passes.contact_kinematics(
            *c.gap, *c.edge, c.weight, *c.frame, o[half[0]], o[half[1]], s[half[0]], s[half[1]]
        ),
        "contacts: law": lambda: group.batch(o, s, memory),
        "contacts: work": lambda: [
            passes.contact_work(now[h], before[1][h], a[h], b[1][h], work[h])
            for now, before, a, b, work in ((o, c.opening, n, c.normal, c.work[0]), (s, c.slip, t, c.shear, c.work[1]))
            for h in half
        ],
        "contacts: force": lambda: passes.contact_forces(
            *c.frame, c.half, c.weight, n[half[0]], t[half[0]], n[half[1]], t[half[1]],
            o[half[0]], o[half[1]], s[half[0]], s[half[1]], *rows,
        ),
        "nodes: gather": lambda: passes.gather_forces(*m.slots, *c.force, *m.force),
    }  # fmt: skip
    for call in calls.values():
        call()
    return {name: np.median([cpu(call, 20) for _ in range(15)]) for name, call in calls.items()}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--against")
    parser.add_argument("--rounds", type=int, default=7)
    options = parser.parse_args()
    specimen = gl.Specimen(Voronoi(grains=755, seed=1).tessellate(rectangle(50e-3, 125e-3)), ROCK)
    mesh = specimen.mesh
    points = 2 * len(mesh.interfaces)
    print(f"{len(mesh.zones)} zones, {points} contact points, {len(mesh.nodes)} nodes")
    damped = gl.CentralDifference()
    cases = {
        (name, when): (lambda law=law, strain=strain: loaded(specimen, law, strain))
        for name, law in LAWS.items()
        for when, strain in (("before the peak", 0.002), ("after the peak", 0.01))
    }
    for make in cases.values():
        advance(make(), 10, 1e-12, damped)
    times = {case: [] for case in cases}
    other = []
    for _ in range(options.rounds):
        for case, make in cases.items():
            state = make()
            times[case].append(cpu(lambda state=state: advance(state, STEPS, 1e-12, damped)) / STEPS)
        if options.against:
            last = subprocess.run(options.against, shell=True, capture_output=True, text=True, check=True).stdout
            other.append(float(re.search(r"cpu med\s+([\d.]+)", last.strip().splitlines()[-1]).group(1)) * 1e-6)
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
