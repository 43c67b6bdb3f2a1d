"""A study of 1,000 compression tests of 270 grains, two laws and 500 seeds: cases a minute, and what a worker needs.

    python tests/benchmarks/thousand_cases.py [seeds, 500] [workers, 2]

Needs as many idle cores as workers. The share of the steps is that of some cases by themselves, in one process.
"""

import sys
import tempfile
import threading
import time
import warnings
from pathlib import Path

import psutil

import grainlaw as gl
from grainlaw.engine import step
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack, MohrCoulomb
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import mm

ROCK = gl.Elastic(youngs_modulus=60e9, poissons_ratio=0.25, density=3100)
BOND = dict(kn=1.05e14, ks=9.45e13, tensile_strength=13e6, cohesion=29e6, friction_angle=54, residual_friction_angle=5)
LAWS = {
    "Mohr-Coulomb": MohrCoulomb(**BOND),
    "cohesive crack": CohesiveCrack(**BOND, mode_i_energy=15, mode_ii_energy=30),
}
ALONE = range(1, 7)  #: seeds of the cases by themselves


def case(law, seed):
    grains = Voronoi(grains=270, seed=seed).tessellate(rectangle(30 * mm, 75 * mm))
    return gl.Run(gl.Specimen(grains, ROCK), law, UniaxialCompression())


def memory(done: threading.Event, most: list[float]) -> None:
    """Keep the largest memory (MB) of a child."""
    while not done.wait(1.0):
        for child in psutil.Process().children(recursive=True):
            try:
                most[0] = max(most[0], child.memory_info().rss / 1e6)
            except psutil.NoSuchProcess:
                continue


def share_of_steps(law: gl.ContactLaw) -> float:
    """CPU time of the steps over that of whole cases."""
    inside, run = [0.0], step.run
    of = case(law, ALONE[0])
    gl.simulate(of.specimen, of.law, of.protocol, threads=1, progress=False)  # its code is loaded

    def counted(*given, **named):
        began = time.process_time()
        try:
            return run(*given, **named)
        finally:
            inside[0] += time.process_time() - began

    step.run = counted
    try:
        began = time.process_time()
        for seed in ALONE:
            of = case(law, seed)
            gl.simulate(of.specimen, of.law, of.protocol, threads=1, progress=False)
        return inside[0] / (time.process_time() - began)
    finally:
        step.run = run


def main() -> None:
    seeds, workers = ([int(word) for word in sys.argv[1:]] + [500, 2][len(sys.argv) - 1 :])[:2]
    warnings.simplefilter("ignore")
    most, done = [0.0], threading.Event()
    with tempfile.TemporaryDirectory() as folder:
        gl.Study(case, law=LAWS, seed=[1]).run(Path(folder) / "compiled", workers=1, progress=False)
        threading.Thread(target=memory, args=(done, most), daemon=True).start()
        began = time.perf_counter()
        store = Path(folder) / "store"
        table = gl.Study(case, law=LAWS, seed=range(1, seeds + 1)).run(store, workers=workers, progress=False)
        wall = time.perf_counter() - began
        done.set()
        stored = sum(file.stat().st_size for file in store.rglob("*") if file.is_file()) / 1e6
        rows = list(zip(table.costs, table["law"], strict=True))
    cpu = sum(cost["cpu"] for cost, _ in rows)
    print(f"{len(rows)} cases in {wall / 60:.1f} minutes on {workers} workers: {len(rows) / wall * 60:.0f} a minute")
    print(f"{100 * cpu / workers / wall:.0f} % of the workers' time is CPU time of cases")
    print(f"{most[0]:.0f} MB a worker at most, {stored:.0f} MB in the store")
    for name, law in LAWS.items():
        spent = [cost["cpu"] for cost, of in rows if of == name]
        print(f"{name}: {sum(spent) / len(spent):.2f} s a case, {100 * share_of_steps(law):.0f} % of it in steps")


if __name__ == "__main__":
    main()
