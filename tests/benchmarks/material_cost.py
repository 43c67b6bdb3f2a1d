"""Cost of the zones of each material per step, and over that of elastic zones, on the 755-grain sample; one thread.

    python tests/benchmarks/material_cost.py

Medians of CPU time of the pass over all zones, with elastic and other materials in turn; plastic materials in grains of
which none, and of which most have yielded.
"""

import sys
import time
from pathlib import Path

import numpy as np
from numba import njit

sys.path.insert(0, str(Path(__file__).parents[1]))
from support import ROCK, STIFF, nodal_forces

import grainlaw as gl
from grainlaw.compiler.cache import OPTIONS
from grainlaw.engine.model import Model
from grainlaw.engine.parts.material_passes import add_material_forces
from grainlaw.engine.parts.zones import add_zone_forces
from grainlaw.engine.state import State
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import Linear
from grainlaw.materials import DruckerPrager, MohrCoulombPlastic, TransverselyIsotropic

CALLS, ROUNDS = 200, 25
GRAIN = {"youngs_modulus": 60e9, "poissons_ratio": 0.25, "density": 3100}
SCHIST = {
    "youngs_modulus": 60e9, "youngs_modulus_across": 30e9, "poissons_ratio": 0.2, "poissons_ratio_across": 0.15,
    "shear_modulus_across": 15e9, "density": 2700,
}  # fmt: skip
MOHR = {"tensile_strength": 8e6, "cohesion": 30e6, "friction_angle": 45, "dilation_angle": 10}


@njit(**OPTIONS)
def elastic(zones, nodes, calls):
    for _ in range(calls):
        add_zone_forces(zones, nodes, 0)


@njit(**OPTIONS)
def material(zones, nodes, calls):
    for _ in range(calls):
        add_material_forces(zones, nodes, False, 0)


def main():
    grains = Voronoi(grains=755, seed=1).tessellate(rectangle(50e-3, 125e-3))
    angles = np.random.default_rng(0).uniform(0, 180, grains.count)
    materials = {
        "elastic": ROCK,
        "transversely isotropic": TransverselyIsotropic(**SCHIST, foliation_angle=30),
        "the same, angle by grain": TransverselyIsotropic(**SCHIST, foliation_angle=angles),
        "Drucker-Prager": DruckerPrager(**GRAIN, cohesion=30e6, friction_angle=40, dilation_angle=10),
        "Mohr-Coulomb": MohrCoulombPlastic(**GRAIN, **MOHR),
    }
    cases, states = {}, []
    for name, one in materials.items():
        for strain in (5e-4, 5e-3) if name in ("Drucker-Prager", "Mohr-Coulomb") else (5e-4,):
            state = State(Model(gl.Specimen(grains, one), Linear(**STIFF)))
            nodal_forces(state, (state.mesh.nodes - state.mesh.nodes.mean(axis=0)) * [0.28 * strain, -strain])
            parts = state.shared(1).parts
            run, zones = (elastic, parts.zones) if one is ROCK else (material, parts.materials)
            share = float(np.mean(state.materials.memory("plastic_strain") > 0))
            note = f", {share:.0%} yielded" if "-" in name else ""
            states.append(state)  # their arrays are called by address
            cases[name + note] = lambda run=run, zones=zones, nodes=parts.nodes: run(zones, nodes, CALLS)
            cases[name + note]()
    times = {name: [] for name in cases}
    for _ in range(ROUNDS):
        for name, call in cases.items():
            start = time.thread_time()
            call()
            times[name].append((time.thread_time() - start) / CALLS)
    reference = np.array(times["elastic"])
    print(f"{len(states[0].mesh.zones)} zones")
    for name, values in times.items():
        ratio = np.median(np.array(values) / reference)
        print(f"{name:32} {np.median(values) * 1e6:7.2f} us  {ratio:.2f} of elastic")


if __name__ == "__main__":
    main()
