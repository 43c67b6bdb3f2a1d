"""Time to failure under held loads: the tables of docs/tables/long-term.md.

python tests/validation/long_term_study.py [--write | --check]
"""

from functools import cache

import numpy as np
from study_tables import DOCS, Table, each, main

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CharlesGrowth, CohesiveCrack, ExponentialGrowth, StaticFatigue
from grainlaw.protocols import Creep, UniaxialCompression
from grainlaw.units import GPa, MPa, mm

ROCK = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=2700)
BOND = CohesiveCrack(
    kn=1.05e14, ks=9.45e13, tensile_strength=10 * MPa, cohesion=25 * MPa, friction_angle=25,
    residual_friction_angle=15, mode_i_energy=30, mode_ii_energy=100,
)  # fmt: skip
GROWTHS = {"Charles, n = 20": CharlesGrowth(exponent=20), "exponential, b = 30": ExponentialGrowth(activation=30)}
RATE = 1.0  #: 1/s
SEEDS, LOADS = (1, 2, 3), (0.9, 0.8, 0.7)
JUMPS = (0.2, 0.1, 0.05, 0.02, 0.01)  #: largest growths of fatigue in a jump
USUAL = 0.02  #: that of Creep


def sample(seed):
    return gl.Specimen(Voronoi(grains=60, seed=seed).tessellate(rectangle(20 * mm, 40 * mm)), ROCK)


def crushed(seed):
    return gl.Run(sample(seed), BOND, UniaxialCompression())


@cache
def strengths():
    """Pa, by seed."""
    table = gl.Study(crushed, seed=SEEDS).run(progress=False)
    return {seed: float(table.where(seed=seed)["strength"][0]) for seed in SEEDS}


def case(growth, stress, seed, largest):
    law = StaticFatigue(law=BOND, rate=RATE, growth=GROWTHS[growth])
    return gl.Run(sample(seed), law, Creep(load=stress, duration=1e9, largest_growth=largest))


@cache
def crept(growth, load, largest=USUAL):
    """Summaries of all seeds under a share of the strength of each."""
    rows = []
    for seed, strength in strengths().items():
        study = gl.Study(case, growth=[growth], stress=[load * strength], seed=[seed], largest=[largest])
        table = study.run(progress=False)
        rows.append({name: table[name][0] for name in ("time_to_failure", "creep_strain", "cracks", "jumps")})
    return rows


def row(growth, load):
    found = crept(growth, load)
    times = [one["time_to_failure"] for one in found]
    return [
        each(times, ".3g"), f"{np.exp(np.mean(np.log(times))):.3g}",
        each((1e6 * one["creep_strain"] for one in found), ".0f"), each(int(one["cracks"]) for one in found),
        each(int(one["jumps"]) for one in found),
    ]  # fmt: skip


def slope(growth, power):
    """Of ln t over ln of the load, or over the load, by least squares, for each seed."""
    times = np.log([[one["time_to_failure"] for one in crept(growth, load)] for load in LOADS])
    loads = np.log(LOADS) if power else np.array(LOADS)
    return each(np.polyfit(loads, times, 1)[0], ".1f")


def by_jumps(largest):
    """Times to failure of all seeds, and their geometric mean, under the lowest and the highest load."""
    cells = []
    for load in (LOADS[-1], LOADS[0]):
        times = [one["time_to_failure"] for one in crept("Charles, n = 20", load, largest)]
        cells += [each(times, ".3g"), f"{np.exp(np.mean(np.log(times))):.3g}"]
    return cells


TABLES = [
    Table(
        page=DOCS / "tables/long-term.md",
        name="long-term jumps",
        columns=(
            "largest growth of fatigue in a jump", f"time to failure under {LOADS[-1]} (s)", "geometric mean (s)",
            f"under {LOADS[0]} (s)", "geometric mean (s)",
        ),
        rows={f"{largest:g}": lambda g=largest: by_jumps(g) for largest in JUMPS},
        firm=(),
        checked=(f"{JUMPS[0]:g}",),
    ),
    Table(
        page=DOCS / "tables/long-term.md",
        name="long-term",
        columns=(
            "growth, load over strength", "time to failure of three samples (s)", "geometric mean (s)",
            "creep strain (1e-6)", "broken points before failure", "jumps",
        ),
        rows={f"{growth}, {load}": lambda g=growth, x=load: row(g, x) for growth in GROWTHS for load in LOADS},
        firm=(),
        checked=("Charles, n = 20, 0.9",),
    ),
    Table(
        page=DOCS / "tables/long-term.md",
        name="long-term slopes",
        columns=("growth", "slope of ln t over ln load", "slope of ln t over load"),
        rows={growth: lambda g=growth: [slope(g, True), slope(g, False)] for growth in GROWTHS},
        firm=(),
        checked=("Charles, n = 20",),
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES)
