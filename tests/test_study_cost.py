"""What a study will cost: sums by hand over finished cases and over probes, and what the workers have left to do."""

from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import attrs
import pytest
from study_cases import LAWS, SHORT, tiny_study
from study_rows import row
from support import ROCK

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.studies import case, cost, workers
from grainlaw.studies.case import SAME, Task
from grainlaw.studies.cost import KINDS, ROW, cost_of
from grainlaw.studies.workers import GivenExecutor, Watcher


def tasks(law, count):
    return [Task(f"{law}{k}", {"law": law, "seed": k}) for k in range(count)]


FINISHED = [
    row({"law": "A", "seed": 8}, cost={"cpu": 2.0, "bytes": 100}),
    row({"law": "A", "seed": 9}, cost={"cpu": 4.0, "bytes": 300}),
    row({"law": "B", "seed": 9}, status="killed") | {"cost": {}},
]


def test_cases_cost_what_finished_ones_of_their_kind_did():
    found = cost_of(tasks("A", 3), FINISHED, lambda task: pytest.fail("it is built"))
    assert (found.cases, found.cpu, found.disk, found.measured) == (3, 3 * 3.0, 3 * (200 + ROW), True)


def test_one_case_of_each_other_kind_is_probed(monkeypatch):
    monkeypatch.setattr(cost, "probe", lambda case: (10.0, 1000.0) if case == "B1" else pytest.fail(case))
    found = cost_of([*tasks("A", 3), *tasks("B", 2)], FINISHED, lambda task: task.case)
    assert (found.cases, found.cpu, found.disk, found.measured) == (5, 9.0 + 20.0, 3 * (200 + ROW) + 2000.0, False)


def test_of_many_kinds_some_are_probed_and_the_others_cost_their_mean(monkeypatch):
    monkeypatch.setattr(cost, "probe", lambda number: (float(number), 10.0 * number))
    many = [task for k in range(1, KINDS + 3) for task in tasks(f"law {k}", 1)]
    found = cost_of(many, [], lambda task: int(task.factors["law"].split()[1]))
    each = KINDS * (KINDS + 1) / 2
    assert (found.cpu, found.disk) == (each + 2 * each / KINDS, 10 * each + 20 * each / KINDS)


def test_a_probe_is_its_start_the_steps_and_all_samples(monkeypatch):
    """By a clock, and with steps that take 100 s; four bricks touch at four sides."""
    looks, steps = iter([7, 9, 20, 26] * 2), []
    monkeypatch.setattr(cost, "time", SimpleNamespace(process_time=lambda: next(looks)))
    monkeypatch.setattr(cost, "estimate", lambda count, *_: steps.append(count) or SimpleNamespace(seconds=100.0))
    specimen = gl.Specimen(Bricks(rows=2, columns=2).tessellate(rectangle(0.02, 0.02)), ROCK)
    bytes_ = 3000 + 6 * (26 * 20 + 10 * 4 * 4 + 20 * 4 * 2)
    run = gl.Run(specimen, LAWS["linear"], SHORT)
    for factor in (0.8, 0.4):
        assert cost.probe(attrs.evolve(run, time_step_factor=factor)) == (2 + 100 + 20 * 6 / 3, bytes_)
    assert steps[1] == pytest.approx(2 * steps[0])


def test_a_case_says_what_it_has_cost(monkeypatch):
    """By two clocks, and the size of its file."""
    wall, cpu = iter([100.0, 107.0] * 2), iter([5.0, 8.0] * 2)
    clocks = SimpleNamespace(perf_counter=lambda: next(wall), process_time=lambda: next(cpu))
    monkeypatch.setattr(case, "time", clocks)
    monkeypatch.setattr(case, "_loaded", lambda recipe: None)
    monkeypatch.setattr(case, "_answered", lambda *_: ({"status": "finished", "run": "ab"}, b"12345"))
    (task,) = tasks("A", 1)
    done = case.carry_out(b"", task)
    expected = {"case": "A0", "run": "ab", "factors": {"law": "A", "seed": 0}, "status": "finished"}
    assert done.row == expected | {"cost": {"seconds": 7.0, "cpu": 3.0, "bytes": 5}}
    assert done.run == b"12345"

    def too_large(*_):
        raise MemoryError("8 GB")

    monkeypatch.setattr(case, "_answered", too_large)
    row = case.carry_out(b"", task).row
    assert (row["status"], row["reason"], row["cost"]["bytes"]) == ("killed", "not enough memory: 8 GB", 0)


# --- what the workers are doing ---------------------------------------------------------------------------------------


class Told:
    """Bars that keep what they were told, by name."""

    def __init__(self):
        self.is_seen, self.said = True, {}

    def bar(self, name):
        def tell(share, words):
            self.said[name] = share, words

        return SimpleNamespace(tell=tell, remove=lambda: self.said.pop(name))


def test_bars_say_what_is_done_failed_and_at_work(monkeypatch, tmp_path):
    """One worker: 2 s are done in 4 s, so that the other case, of 2 s, takes as long."""
    clock, bars, by = [100.0], Told(), GivenExecutor(None)
    monkeypatch.setattr(workers, "time", SimpleNamespace(monotonic=lambda: clock[0]))
    by.folder = str(tmp_path)
    first, second, third = tasks("A", 3)
    watcher = Watcher([first, second, third], by, bars)
    (tmp_path / "A0.77").write_text('{"share": 0.25, "where": "load, 3 samples"}')
    (tmp_path / "A1.78").write_text("")
    (tmp_path / "other.79").write_text('{"share": 0.5, "where": "not of this study"}')
    (tmp_path / "A2.80").write_text('{"share": 0.5, "whe')
    watcher.look()
    assert bars.said == {}  # it has just begun
    clock[0] += 0.6
    bars.is_seen = False
    watcher.look()
    assert bars.said == {"cases": (0.0, "0 of 3")}  # a line now and then where nobody looks
    bars.is_seen = True
    clock[0] += 0.6
    watcher.look()
    assert bars.said == {
        "A, seed = 0": (0.25, "load, 3 samples"), "A, seed = 1": (0.0, "starting"),
        "A, seed = 2": (0.0, "starting"), "cases": (0.0, "0 of 3"),
    }  # fmt: skip
    for file in ("A0.77", "A2.80"):
        (tmp_path / file).unlink()
    clock[0] = 104.0
    watcher.done(first, {"status": "finished", "cost": {"seconds": 1.0}})
    watcher.done(third, {"status": "unstable", "cost": {"seconds": 1.0}})
    watcher.look()
    assert bars.said == {
        "A, seed = 1": (0.0, "starting"), "cases": (2 / 3, "2 of 3, about 2 s left, 1 failed"),
    }  # fmt: skip
    watcher.done(second, {"status": SAME, "cost": {}})
    assert bars.said["cases"] == (1.0, "3 of 3, 1 failed")
    watcher.remove()  # where others are told, too
    assert bars.said == {}
    Watcher([first], by, None).remove()


def test_a_case_of_many_factors_is_named_by_names_and_seed_first():
    factors = {"tensile_strength": 7552000.0, "cohesion": 26250000.0, "test": "tension", "seed": 2}
    assert workers._label(factors) == "tension, seed = 2, tensile_streng..."
    everything = "tension, seed = 2, tensile_strength = 7.55 MPa, cohesion = 26.25 MPa"
    assert workers._label(factors, 110) == everything
    confined = {"confinement": 5e6, "seed": 2}
    assert workers._label(confined) == "seed = 2, confinement = 5.00 MPa"
    assert workers._label({"kind": "a" * 40}) == f"{'a' * 33}..."
    assert workers._label({"law": "a", "seed": 1}) == "a, seed = 1"


def test_at_most_eight_workers_are_shown(monkeypatch, tmp_path):
    by, bars = GivenExecutor(ThreadPoolExecutor(3)), Told()
    monkeypatch.setattr(workers, "OFTEN", 0.0)
    by.folder = str(tmp_path)
    for k in range(10):
        (tmp_path / f"A{k}.1").write_text('{"share": 0.5, "where": "load"}')
    Watcher(tasks("A", 10), by, bars).look()
    assert len(bars.said) == 1 + 8
    assert (by.count, by.ahead) == (3, 9)
    assert GivenExecutor(None).ahead == 1000  # of some whose number is not known


@pytest.mark.parametrize(("workers", "count"), [(1, 1), (3, 3), (4, 4), (5, 4)])
def test_there_are_no_more_workers_than_cases(workers, count, monkeypatch):
    """Of four cases."""
    asked = []
    monkeypatch.setattr(
        gl.Study, "_try_levels", lambda study, tasks, compile_too: asked.append((len(tasks), compile_too))
    )
    monkeypatch.setattr(gl.Study, "_carry", lambda study, missing, store, on, count, *_: asked.append(count))
    tiny_study().run(workers=workers, progress=False)
    assert asked == [(4, True), count]
