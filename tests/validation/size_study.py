"""Compression of larger and larger specimens to their first failure: time, memory, and what takes them.

    python tests/validation/size_study.py [--only "755 grains, ..."] [--write | --check]

Each row is a process of its own on one thread. 30,000 grains take an hour of a core that others use, too.
"""

import json
import os
import resource
import subprocess
import sys
import time
import warnings
from collections import Counter
from functools import partial

from study_tables import DOCS, ROUNDING, Table, main

import grainlaw as gl
from grainlaw.engine import stepping
from grainlaw.engine.factors import Factors
from grainlaw.engine.margin import Margin
from grainlaw.engine.state import State
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import UniaxialCompression
from grainlaw.runs.execution import Execution
from grainlaw.units import MPa

ROCK = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=3100)
LAW = MohrCoulomb(
    kn=1.05e14, ks=9.45e13, tensile_strength=13e6, cohesion=29e6, friction_angle=54, residual_friction_angle=5
)
GRAINS = (755, 3000, 10_000, 30_000)
PARTS = {
    "steps": (stepping.step, "run"), "searched": (State, "search"), "handed over": (stepping, "hand_over"),
    "margin": (Margin, "find"), "factors": (Factors, "__init__"), "samples": (Execution, "_record"),
}  # fmt: skip


def measured(grains):
    """What a run of so many grains says of itself; what it compiles is left out by a small run before."""
    warnings.simplefilter("ignore")
    seconds, calls = Counter(), Counter()

    def counted(name, function):
        def call(*given, **named):
            start = time.process_time()
            try:
                return function(*given, **named)
            finally:
                seconds[name] += time.process_time() - start
                calls[name] += 1

        return call

    tested(100)
    for name, (where, attribute) in PARTS.items():
        setattr(where, attribute, counted(name, getattr(where, attribute)))
    start = time.process_time()
    result = tested(grains)
    whole = time.process_time() - start
    return {
        "whole": whole, "steps": result.summary["steps"], "samples": calls["samples"], "seconds": dict(seconds),
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, "strength": result.summary["strength"],
    }  # fmt: skip


def tested(grains):
    specimen = gl.Specimen(Voronoi(grains=grains, seed=3).tessellate(rectangle(0.02, 0.04)), ROCK)
    return gl.simulate(specimen, LAW, UniaxialCompression(stop_fraction=0.95), threads=1, progress=False)


def row(grains):
    own = {name: value for name, value in os.environ.items() if name not in ROUNDING}  # code of this processor
    done = subprocess.run(
        [sys.executable, __file__, "--grains", str(grains)], env=own, check=True, capture_output=True, text=True
    )
    found = json.loads(done.stdout)
    spent, whole = found["seconds"], found["whole"]
    outside = whole - spent["steps"]
    yield from (f"{found['strength'] / MPa:.1f}", f"{found['steps']}", f"{found['samples']}", f"{whole:.0f}")
    yield f"{spent['steps'] / found['steps'] / grains * 1e9:.0f}"
    yield f"{outside / found['samples'] / grains * 1e6:.1f}"
    for name in ("steps", "margin", "factors", "handed over"):
        yield f"{100 * spent.get(name, 0.0) / whole:.0f} %"
    yield f"{found['memory']:.0f}"


TABLES = [
    Table(
        page=DOCS / "tables/speed.md",
        name="larger specimens",
        columns=(
            "", "first failure, MPa", "number of steps", "of samples", "CPU, s", "ns a step and grain",
            "rest, us a sample and grain", "steps", "margin", "factors", "hand-over", "MiB",
        ),
        rows={f"{grains:,} grains": partial(row, grains) for grains in GRAINS},
        checked=None,
    )
]  # fmt: skip

if __name__ == "__main__":
    if "--grains" in sys.argv:
        print(json.dumps(measured(int(sys.argv[-1]))))
    else:
        main(TABLES, {})
