"""CPU time of what a newcomer types, with an empty cache of compiled code and with a full one.

    .venv/bin/python tests/benchmarks/first_minute.py [REPEATS]

Other processes are started, so that each figure includes the start of Python and what it loads.
"""

import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

GRAINLAW = os.path.join(os.path.dirname(sys.executable), "grainlaw")
QUICK = [GRAINLAW, "test", "uniaxial-compression", "--quick", "--out"]


def took(command: list[str], cache: str) -> tuple[float, float]:
    """CPU time and time by the clock, s."""
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(command, check=True, capture_output=True, env=os.environ | {"GRAINLAW_CACHE": cache})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, time.perf_counter() - start


def main() -> None:
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 3
    found: dict[str, list[tuple[float, float]]] = {}
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder:
            cache = os.path.join(folder, "cache")
            commands = {
                "import grainlaw": [sys.executable, "-c", "import grainlaw"],
                "grainlaw --help": [GRAINLAW, "--help"],
                "grainlaw test --quick, cold": [*QUICK, os.path.join(folder, "cold")],
                "grainlaw test --quick, warm": [*QUICK, os.path.join(folder, "warm")],
            }
            for name, command in commands.items():
                found.setdefault(name, []).append(took(command, cache))
    for name, times in found.items():
        cpu, clock = (statistics.median(column) for column in zip(*times, strict=True))
        print(f"{name:30} {cpu:6.2f} s CPU {clock:6.2f} s")


if __name__ == "__main__":
    main()
