"""What a study costs beside its cases: two workers against one, overhead of a case, rows written in a second.

    python tests/benchmarks/study_cost.py [cases, 40] [--dask]

Needs two idle cores. Cases are those of tests/study_cases.py.
"""

import shutil
import statistics
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from study_cases import column, tiny

import grainlaw as gl
from grainlaw.studies.store import Store
from grainlaw.studies.table import Table


def timed(study: gl.Study, **options) -> tuple[float, Table]:
    folder = Path(tempfile.mkdtemp())
    try:
        began = time.perf_counter()
        table = study.run(folder / "store", progress=False, **options)
        return time.perf_counter() - began, list(table.costs)
    finally:
        shutil.rmtree(folder)


def main() -> None:
    numbers = [int(word) for word in sys.argv[1:] if word.isdigit()]
    count = numbers[0] if numbers else 40
    long = gl.Study(column, height=[40 + k / 10 for k in range(count)], rows=[4], speed=[0.01])
    timed(long, workers=2)  # compiles
    ratios = []
    for _ in range(3):
        (one, _), (two, _) = timed(long, workers=1), timed(long, workers=2)
        ratios.append(two / one)
        print(f"{count} cases: {one:.1f} s with one worker, {two:.1f} s with two, {two / one:.3f}", flush=True)
    print(f"two workers take {statistics.median(ratios):.3f} of the time of one (median)")

    short = gl.Study(tiny, law=["linear"], seed=range(200))
    wall, costs = timed(short, workers=1)
    inside = sum(cost["seconds"] for cost in costs)
    print(f"200 short cases: {1e3 * (wall - inside) / 200:.1f} ms each beside their own {1e3 * inside / 200:.1f} ms")
    wall, costs = timed(short, on=ThreadPoolExecutor(1))
    inside = sum(cost["seconds"] for cost in costs)
    print(f"the same in a thread: {1e3 * (wall - inside) / 200:.1f} ms each")
    if "--dask" in sys.argv:
        from distributed import LocalCluster

        with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
            wall, costs = timed(short, on=cluster.scheduler_address)
            inside = sum(cost["seconds"] for cost in costs)
            print(f"the same on a cluster of one: {1e3 * (wall - inside) / 200:.1f} ms each")

    folder, content = Path(tempfile.mkdtemp()), bytes(180_000)
    store, began = Store(folder / "store"), time.perf_counter()
    for k in range(2000):
        row = {"case": f"{k:064x}", "run": f"{k:064x}", "factors": {"seed": k}, "status": "finished", "reason": "",
               "summary": {f"q{j}": j / 7 for j in range(45)}, "measures": {}, "measured": "", "cost": {}}  # fmt: skip
        store.write(row, content)
    wall = time.perf_counter() - began
    began = time.perf_counter()
    packed = store.pack(1)
    rate = packed / (time.perf_counter() - began)
    print(f"{2000 / wall:.0f} rows with their runs written in a second, {rate:.0f} packed")
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
