"""Studies whose workers, or which themselves, are killed at random moments: nothing is lost, and nothing is twice."""

import json
import os
import random
import subprocess
import sys
import time

import psutil
import pytest
from study_cases import column, content

import grainlaw as gl
from grainlaw.studies.store import Store

pytestmark = [
    pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="signals are those of Unix")
]  # fmt: skip

CASES = 200
SCRIPT = f"""
import sys
sys.path.insert(0, {os.path.dirname(__file__)!r})
import grainlaw as gl
from study_cases import column
if __name__ == "__main__":
    gl.Study(column, height=[40 + k / 10 for k in range({CASES})], rows=[2], speed=[0.03]).run(sys.argv[1], workers=2)
"""


def study():
    return gl.Study(column, height=[40 + k / 10 for k in range(CASES)], rows=[2], speed=[0.03])


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    return study().run(tmp_path_factory.mktemp("whole") / "s", workers=2, progress=False)


def start(store):
    script = store.parent / "script.py"
    script.write_text(SCRIPT)
    return subprocess.Popen([sys.executable, str(script), str(store)], stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


def workers_of(process):
    """The processes that carry out cases: children of the one that makes copies of itself."""
    try:
        every = psutil.Process(process.pid).children(recursive=True)
        parents = {child.ppid() for child in every}
        return [child for child in every if child.ppid() in parents - {process.pid} and child.status() != "zombie"]
    except psutil.NoSuchProcess:
        return []


def check(store, undisturbed):
    """Every file is whole, every case there once; a second call completes what was killed."""
    for file in (store / "cases").rglob("*.json"):
        json.loads(file.read_text())
    rows = [row for row in Store(store, make=False).rows(Store(store).cases()) if row]
    assert len({row["case"] for row in rows}) == len(rows) == CASES
    assert {row["status"] for row in rows} <= {"finished", "killed"}
    table = study().run(store, workers=2, progress=False)
    assert content(table) == content(undisturbed)
    for row in table.rows[:: CASES // 5]:
        assert len(table.result(height=row["height"]).curves["time"])


def test_fifty_workers_killed(tmp_path, undisturbed):
    store, rng, killed = tmp_path / "s", random.Random(1), 0
    process = start(store)
    while process.poll() is None:
        time.sleep(rng.uniform(0.1, 0.9))
        if (found := workers_of(process)) and killed < 50:
            rng.choice(found).kill()
            killed += 1
    assert process.returncode == 0, process.stdout.read()
    assert killed == 50
    check(store, undisturbed)


def test_the_study_killed_twenty_times(tmp_path, undisturbed):
    store, rng = tmp_path / "s", random.Random(2)
    for _ in range(20):
        process = start(store)
        time.sleep(rng.uniform(1.0, 4.0))
        process.kill()
        process.communicate()
    last = start(store)
    assert last.wait(600) == 0, last.stdout.read()
    check(store, undisturbed)
    time.sleep(1)
    assert not [p for p in psutil.process_iter() if str(store) in " ".join(_command(p))]


def _command(process):
    try:
        return process.cmdline()
    except psutil.Error:
        return []


def running(cluster):
    """Workers that are at work: Dask does not start again one that dies before."""
    processes = [nanny.process for nanny in cluster.workers.values()]
    return [worker.pid for worker in processes if worker and worker.pid and worker.status.name == "running"]


def test_fifty_workers_of_a_cluster_killed(tmp_path, undisturbed):
    distributed, dask = pytest.importorskip("distributed"), pytest.importorskip("dask")
    store, rng, killed = tmp_path / "s", random.Random(3), 0
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with (
        dask.config.set(
            {
                "distributed.scheduler.allowed-failures": 10,
                "distributed.deploy.lost-worker-timeout": "10 minutes",  # of a busy machine; it gives up one after 15 s
            }
        ),
        distributed.LocalCluster(**options) as cluster,
    ):
        script = tmp_path / "script.py"
        script.write_text(SCRIPT.replace("workers=2", f"on={cluster.scheduler_address!r}"))
        output = tmp_path / "output.txt"  # not a pipe: Dask says of each lost worker more than a pipe holds
        with output.open("w") as stream:
            process = subprocess.Popen(
                [sys.executable, str(script), str(store)], stdout=stream, stderr=subprocess.STDOUT
            )
        while process.poll() is None:
            time.sleep(rng.uniform(0.5, 1.5))
            pids = running(cluster)
            if pids and killed < 50:
                try:
                    psutil.Process(rng.choice(pids)).kill()
                    killed += 1
                except psutil.NoSuchProcess:
                    continue
        assert process.returncode == 0, output.read_text()
    assert killed >= 20
    check(store, undisturbed)
