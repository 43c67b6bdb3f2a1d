"""What threads inside one model gain: wall time of a step over that of one thread, alone and beside a busy process.

    python tests/benchmarks/thread_cost.py [--grains 755,7550] [--threads 2,auto] [--rounds 40] [--neighbours 0,1]

Numbers of threads take turns in short runs; "auto" is one number for all of its turns, tried as in a run. Of each the
lower quartile and the median are printed, and their ratios: where the machine is not idle by itself, the lower quartile
is nearer to what it would be.
"""

import argparse
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from support import ROCK, STRONG, advance

import grainlaw as gl
from grainlaw.engine.model import Model
from grainlaw.engine.state import State
from grainlaw.engine.thread_count import ThreadCount, cores
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack

LENGTH = 0.1  #: s of a turn of one thread
SETTLE = 4.0  #: s of steps with "auto" before they are measured: it tries more often at first, and runs are long


@contextmanager
def neighbours(count):
    """Processes that never wait."""
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in busy:
            process.kill()
            process.wait()


def sample(grains):
    scale = (grains / 755) ** 0.5
    specimen = gl.Specimen(Voronoi(grains=grains, seed=1).tessellate(rectangle(50e-3 * scale, 125e-3 * scale)), ROCK)
    return State(Model(specimen, CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300), gl.Detection()))


def seconds(state, steps, threads):
    start = time.perf_counter()
    advance(state, steps, 1e-12, gl.integration.CentralDifference(), threads=threads)
    return (time.perf_counter() - start) / steps


def turns(grains, counts, busy, rounds):
    """Seconds of a step by number of threads, one for each turn, beside so many busy processes each."""
    state = sample(grains)
    steps = max(5, int(LENGTH / min(seconds(state, 20, 1) for _ in range(3))))
    threads = {count: ThreadCount(cores) if count == "auto" else int(count) for count in counts}
    for processes in busy:
        times = {count: [] for count in counts}
        with neighbours(processes):
            time.sleep(0.2)
            if "auto" in threads:
                seconds(state, int(steps * SETTLE / LENGTH), threads["auto"])
            for _ in range(rounds):
                for count in counts:
                    times[count].append(seconds(state, steps, threads[count]))
        yield processes, times


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--grains", default="755,7550")
    parser.add_argument("--threads", default="2,auto")
    parser.add_argument("--rounds", type=int, default=40)
    parser.add_argument("--neighbours", default="0,1")
    options = parser.parse_args()
    counts = ["1", *options.threads.split(",")]
    for grains in map(int, options.grains.split(",")):
        for busy, times in turns(grains, counts, map(int, options.neighbours.split(",")), options.rounds):
            one = np.quantile(times["1"], [0.25, 0.5])
            for count, values in times.items():
                low, middle = np.quantile(values, [0.25, 0.5])
                print(
                    f"{grains:6d} grains, {busy} busy: {count:>4} threads {low * 1e6:8.1f} us per step, median "
                    f"{middle * 1e6:8.1f}; over one thread {low / one[0]:.2f}, median {middle / one[1]:.2f}; "
                    f"least {min(values) / min(times['1']):.2f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
