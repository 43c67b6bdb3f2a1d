"""A strip whose long faces are cooled at once: a table of docs/tables/heat.md.

python tests/validation/conduction_study.py [--write | --check]
"""

from functools import cache, partial

import numpy as np
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack
from grainlaw.materials import Thermal
from grainlaw.protocols import ThermalShock

E, NU, ALPHA, K, C, RHO = 60e9, 0.25, 12e-6, 3.0, 800.0, 2650.0
STRENGTH, ENERGY = 20e6, 10.0
LENGTH, HEIGHT, SIZE = 30e-3, 10e-3, 0.4e-3
ROCK = Thermal(
    material=gl.Elastic(youngs_modulus=E, poissons_ratio=NU, density=RHO), expansion=ALPHA, conductivity=K,
    heat_capacity=C,
)  # fmt: skip
LAW = CohesiveCrack(
    kn=1e15, ks=1e15, tensile_strength=STRENGTH, cohesion=40e6, friction_angle=30, residual_friction_angle=30,
    mode_i_energy=ENERGY, mode_ii_energy=10 * ENERGY,
)  # fmt: skip
TIME = 2.0  #: s of heat
DEPTHS = (0.5e-3, 1e-3, 2e-3)
CHANGES = (30, 40, 60, 90, 135, 200)  #: K
APART = 1.5  #: grain sizes, from which on two crossings of a line are two cracks


@cache
def shocked(change, seed=1, speedup=1e4):
    grains = Voronoi(grain_size=SIZE, seed=seed).tessellate(rectangle(LENGTH, HEIGHT))
    test = ThermalShock(
        hot=20, bath=20 - change, duration=TIME, speedup=speedup, samples=50, boundaries=("bottom", "top")
    )
    return gl.simulate(gl.Specimen(grains, ROCK), LAW, test, threads=1, frames=2, progress=False)


def crossings(result, depth):
    """How many cracks cross lines at a depth (m) below both faces, per length (1/m)."""
    ends = result.mesh.nodes[result.interfaces][:, :2]
    middle = ends.mean(axis=1, keepdims=True)
    segments = np.concatenate([np.concatenate([ends[:, :1], middle], 1), np.concatenate([middle, ends[:, 1:2]], 1)])
    broken = segments[~np.isnan(result.frames[-1].bonds["broken_time"])]
    count = 0
    for line in (depth, HEIGHT - depth):
        low, high = broken[:, :, 1].min(axis=1), broken[:, :, 1].max(axis=1)
        x = np.sort(broken[(low <= line) & (line < high)].mean(axis=1)[:, 0])
        count += int(len(x) > 0) + int((np.diff(x) > APART * SIZE).sum())
    return count / (2 * LENGTH)


def spacing(result, depth):
    """m between cracks at a depth, as text in mm."""
    density = crossings(result, depth)
    return f"{1e3 / density:.1f}" if density else "-"


def row(change, **options):
    result = shocked(change, **options)
    stress = E * ALPHA * change / (1 - NU)
    return (
        f"{stress / STRENGTH:.1f}",
        f"{E / (1 - NU**2) * ENERGY / stress**2 * 1e3:.2f}",
        *(spacing(result, depth) for depth in DEPTHS),
        str(result.summary["shock_cracks"]),
        f"{result.summary['shock_kinetic_ratio']:.0e}",
    )


TABLES = [
    Table(
        page=DOCS / "tables/heat.md",
        name="shock",
        columns=(
            "change (K)",
            "stress of the face over the strength",
            "$E'G/\\sigma^2$ (mm)",
            *(f"between cracks at {depth * 1e3:g} mm (mm)" for depth in DEPTHS),
            "broken points",
            "kinetic ratio",
        ),
        rows={f"{change}": partial(row, change) for change in CHANGES}
        | {"135, other grains": partial(row, 135, seed=2), "135, half the speedup": partial(row, 135, speedup=5e3)},
        firm=("stress of the face over the strength",),
        checked=("30",),
    )
]

if __name__ == "__main__":
    main(TABLES)
