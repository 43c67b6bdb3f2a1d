"""What things cost on this machine: the figures under "Steps" in docs/tables/speed.md, with processor and date.

    python tests/benchmarks/speed.py [--rounds 9]

A table in Markdown. Figures are medians over rounds in which the cases take turns; processor time, but for threads and
starts, where it is wall time. Some minutes. Worth writing down where the machine does nothing else: the table says how
busy it was.
"""

import argparse
import os
import platform
import re
import tempfile
from datetime import date
from pathlib import Path

import numpy as np
from growth import start, step_cost
from law_cost import costs
from step_cost import sample, step_times
from thread_cost import turns
from touch_cost import one_contact, whole_specimen


def processor():
    """Its name, where the system tells it."""
    told = Path("/proc/cpuinfo")
    name = re.search(r"model name\s*: (.*)", told.read_text("utf-8")) if told.exists() else None
    return name.group(1) if name else platform.processor() or platform.machine()


def starts():
    """Seconds to the first sample with an empty cache, and with a full one."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["GRAINLAW_CACHE"] = folder
        said = [start() for _ in range(4)]
        del os.environ["GRAINLAW_CACHE"]
    first, *later = (float(re.search(r"all ([\d.]+) s", one).group(1)) for one in said)
    return first, np.median(later)


def rows(rounds):
    """What is measured, and the figure."""
    times, _ = step_times(sample(), rounds)
    for (law, when), values in times.items():
        yield f"a step of 755 grains, {law}, {when}", f"{np.median(values) * 1e6:.0f} us"
    base, *more = (step_cost(grains, rounds)[0] / grains for grains in (755, 7550, 75500))
    for times_grains, cost in zip((10, 100), more, strict=True):
        yield f"a step of {times_grains} times the grains, over {times_grains} times the cost", f"{cost / base:.2f}"
    for grains in (755, 7550):
        for busy, found in turns(grains, ("1", "2", "auto"), (0, 1), 4 * rounds):
            one, two, auto = (np.median(values) for values in found.values())
            what = f'two threads / "auto" over one thread, {grains} grains, {busy} busy process{"es" * (busy != 1)}'
            yield what, f"{two / one:.2f} / {auto / one:.2f}"
    laws = costs()
    for name in ("a user's Hillerborg", "the same with branches"):
        yield f"{name}, over the same by hand", f"{laws[name] / laws['Hillerborg by hand']:.2f}"
    without, with_detection = whole_specimen(rounds)
    yield "a step of 755 grains with detection, over one without", f"{with_detection / without:.3f}"
    near, closed, *_ = one_contact(20_000, rounds)
    yield "a near pair of edges / a closed contact, in a step", f"{near:.1f} / {closed:.0f} ns"
    yield "first start, which compiles / a later one", "{:.1f} / {:.1f} s".format(*starts())


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--rounds", type=int, default=9)
    options = parser.parse_args()
    busy = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    machine = f"{processor()}, {os.cpu_count()} cores, {busy:.1f} processes before, {date.today()}"
    print(f"| {machine} | |\n|---|---|", flush=True)
    for what, figure in rows(options.rounds):
        print(f"| {what} | {figure} |", flush=True)


if __name__ == "__main__":
    main()
