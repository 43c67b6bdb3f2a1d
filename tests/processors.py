"""Every test of whole runs as other processors round it: a tier of its own.

    .venv/bin/python tests/processors.py [NAMES]

What breaks is chaotic, and the last digits of a processor decide what a specimen does after its failure. No outcome of
a test may depend on that. This runs the tests that make whole runs with the code that numba makes for several
processors, each with a cache of its own, and says which tests fail. It takes some twenty minutes for each. Tests that
the bits are the same for any number of threads are left out, as are those of portable code: they compare runs of one
processor.
"""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

from llvmlite.binding import get_host_cpu_features

HERE = Path(__file__).parent
#: what is set, and the feature that this machine must have to run it
PROCESSORS = {
    "native": ({}, ""),
    "portable": ({"GRAINLAW_PORTABLE": "1"}, ""),
    "generic": ({"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}, ""),
    "haswell": ({"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": ""}, "fma"),
    "skylake-avx512": ({"NUMBA_CPU_NAME": "skylake-avx512", "NUMBA_CPU_FEATURES": ""}, "avx512f"),
}
#: words of a test that makes whole runs, by itself or by a command
RUNS = r"\b(simulate|compare|certify|Study|calibrate|command_line|CliRunner)\b"
#: tests of processors themselves, of compilation and of killed processes, which say nothing here
WITHOUT = (
    "test_portable", "test_cache", "test_compil", "test_numba", "test_kill", "test_study_kill", "test_law_that_runs",
)  # fmt: skip


def files(names):
    """Test files that make whole runs; those whose name contains one of ``names``."""
    found = (file for file in sorted(HERE.glob("test_*.py")) if re.search(RUNS, file.read_text("utf-8")))
    chosen = [file for file in found if not file.stem.startswith(WITHOUT)]
    return [str(file) for file in chosen if not names or any(name in file.stem for name in names)]


def outcomes(settings, chosen):
    """Tests that fail."""
    with tempfile.TemporaryDirectory() as cache:
        done = subprocess.run(
            [sys.executable, "-m", "pytest", "-rfE", "-m", "not slow", "-k", "not threads and not portable", *chosen],
            env=os.environ | settings | {"GRAINLAW_CACHE": cache}, capture_output=True, text=True, cwd=HERE.parent,
        )  # fmt: skip
    lines = done.stdout.strip().splitlines()
    print(lines[-1], flush=True)
    return {line.split(" - ")[0].split(" ", 1)[1] for line in lines if line.startswith(("FAILED ", "ERROR "))}


def main():
    chosen, has = files(sys.argv[1:]), get_host_cpu_features()
    print(f"{len(chosen)} files of tests")
    failed = {}
    for name, (settings, feature) in PROCESSORS.items():
        if feature and not has.get(feature):
            print(f"{name}: this machine has no {feature}")
            continue
        print(f"{name}: ", end="", flush=True)
        failed[name] = outcomes(settings, chosen)
    every = set().union(*failed.values())
    for test in sorted(every):
        print(f"{test} fails with {', '.join(name for name, tests in failed.items() if test in tests)}")
    sys.exit(bool(every))


if __name__ == "__main__":
    main()
