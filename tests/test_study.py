"""Studies: the same table from any workers, what is finished is not done again, failures are rows."""

import importlib
import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import attrs
import numpy as np
import pytest
from study_cases import LAWS, SHORT, content, refuse_to_run, tiny, tiny_study
from support import ROCK

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.results.standard_measures import MEASURES
from grainlaw.runs.record import grains_hash
from grainlaw.studies import study as studies
from grainlaw.studies.case import Task, found_by
from grainlaw.studies.store import InMemory, Store
from grainlaw.units import mm


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    return tiny_study().run(tmp_path_factory.mktemp("study") / "store", on=ThreadPoolExecutor(1), progress=False)


@pytest.mark.thorough
def test_a_row_is_what_a_run_by_itself_gives(table):
    run = tiny("brittle", 1)
    result = gl.simulate(run.specimen, run.law, run.protocol)
    row = table.rows[1]
    assert (row["law"], row["seed"], row["status"]) == ("brittle", 1, "finished")
    for name, value in result.summary.items():
        assert name == "seconds" or row[name] == value or np.isnan(value)
    for name, value in result.laboratory.properties.items():
        assert row[name] == value or np.isnan(value)
    stored = table.result(law="brittle", seed=1)
    assert all(np.array_equal(stored.curves[name], values) for name, values in result.curves.items())
    assert np.array_equal(stored.cracks.position, result.cracks.position)


def test_cases_are_all_combinations_in_their_order(table):
    assert [(row["law"], row["seed"]) for row in table.rows] == [
        ("brittle", 0), ("brittle", 1), ("linear", 0), ("linear", 1)
    ]  # fmt: skip


@pytest.mark.thorough
def test_the_same_seed_is_the_same_grains_under_all_laws(table):
    grains = {(row["law"], row["seed"]): grains_hash(table.result(law=row["law"], seed=row["seed"]).specimen.grains)
              for row in table.rows}  # fmt: skip
    assert grains["brittle", 0] == grains["linear", 0] != grains["brittle", 1] == grains["linear", 1]


@pytest.mark.thorough
@pytest.mark.parametrize("workers", ["threads", "one process", "two processes", "a pool", "a cluster"])
def test_the_table_does_not_depend_on_who_ran_it(workers, table, tmp_path):
    study, store = tiny_study(), tmp_path / "store"
    if workers == "threads":
        found = study.run(store, on=ThreadPoolExecutor(2), progress=False)
    elif workers == "a pool":
        with ProcessPoolExecutor(2) as pool:
            found = study.run(store, on=pool, progress=False)
    elif workers == "a cluster":
        distributed = pytest.importorskip("distributed")
        with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
            found = study.run(store, on=cluster.scheduler_address, progress=False)
    else:
        found = study.run(store, workers=1 if workers == "one process" else 2, progress=False)
    assert content(found) == content(table)


@pytest.mark.thorough
def test_without_a_folder_it_is_the_same_table_with_its_results(table):
    found = tiny_study().run(on=ThreadPoolExecutor(2), progress=False)
    assert content(found) == content(table)
    stress = [each.result(law="brittle", seed=1).curves["stress"] for each in (found, table)]
    assert np.array_equal(*stress)


def test_of_a_study_without_a_folder_that_is_stopped_the_table_so_far_is_there(monkeypatch):
    stop, write = gl.Stop(), InMemory.write

    def written(store, row, run):
        write(store, row, run)
        stop.ask("enough")

    monkeypatch.setattr(InMemory, "write", written)
    with pytest.raises(gl.Stopped) as stopped:
        tiny_study().run(on=ThreadPoolExecutor(1), progress=False, stop=stop)
    assert len(stopped.value.result) in (1, 2)  # those that had come back by then


@pytest.mark.thorough
def test_shards_and_another_order_give_the_same_table(table, tmp_path):
    study, store = tiny_study(), tmp_path / "store"
    for k in (3, 1):
        part = study.run(store, shard=(k, 3), on=ThreadPoolExecutor(1), progress=False)
    assert len(part) == 3  # cases 0 and 3 of the first, 2 of the third
    other = gl.Study(tiny, seed=[1, 0], law=["linear", "brittle"]).run(store, on=ThreadPoolExecutor(1), progress=False)
    assert len(other) == 4
    found = study.run(store, on=ThreadPoolExecutor(1), progress=False)
    assert content(found) == content(table)


@pytest.mark.thorough
def test_what_is_finished_is_neither_built_nor_run_again(tmp_path, monkeypatch):
    study = tiny_study()
    first = study.run(tmp_path / "s", on=ThreadPoolExecutor(1), progress=False)
    refuse_to_run(monkeypatch)
    monkeypatch.setattr(studies.Recipe, "run", lambda *_: pytest.fail("it is built"))
    assert content(study.run(tmp_path / "s", progress=False)) == content(first)
    assert str(study.status(tmp_path / "s")) == "4 cases: 4 finished, none failed, 0 missing"


def test_portable_code_makes_other_cases(monkeypatch):
    plain = {case for case, _ in tiny_study()._cases()}
    monkeypatch.setattr(studies, "is_portable", lambda: True)
    assert plain.isdisjoint(case for case, _ in tiny_study()._cases())


SOURCE = """
import attrs
import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from study_cases import ROCK, SHORT

@attrs.frozen(kw_only=True)
class Spring(gl.ContactLaw):
    k: float = gl.parameter("Pa/m")
    stiffness = property(lambda self: (2 * self.k, self.k))
    def traction(self, opening, slip):
        return FACTOR * self.k * opening, self.k * slip  # COMMENT

def case(rows, k):
    specimen = gl.Specimen(Bricks(rows=rows).tessellate(rectangle(0.02, 0.04)), ROCK)
    return gl.Run(specimen, Spring(k=k * SCALE), SHORT)
"""


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Writes and loads a user's file anew."""
    monkeypatch.syspath_prepend(tmp_path)

    def load(**names):
        text = SOURCE
        for name, value in ({"FACTOR": "1", "COMMENT": "none", "SCALE": "1"} | names).items():
            text = text.replace(name, value)
        (tmp_path / "own_case.py").write_text(text)
        sys.modules.pop("own_case", None)
        importlib.invalidate_caches()
        sys.dont_write_bytecode, before = True, sys.dont_write_bytecode
        try:
            return importlib.import_module("own_case")
        finally:
            sys.dont_write_bytecode = before

    yield load
    sys.modules.pop("own_case", None)


@pytest.mark.thorough
def test_an_edited_comment_is_the_same_case_and_an_edited_law_another(module, tmp_path, monkeypatch):
    def run(**names):
        table = gl.Study(module(**names).case, rows=[2], k=[1e13]).run(tmp_path / "s", workers=1, progress=False)
        return table.rows[0]["largest_stress"]

    first = run()
    with monkeypatch.context() as only_here:
        refuse_to_run(only_here)
        assert run(COMMENT="quite another") == first
    assert run(FACTOR="2") > 1.02 * first
    assert len(Store(tmp_path / "s")) == 2


def test_a_function_that_is_edited_for_nothing_runs_nothing(module, tmp_path, monkeypatch):
    gl.Study(module().case, rows=[2], k=[1e13]).run(tmp_path / "s", on=ThreadPoolExecutor(1), progress=False)
    refuse_to_run(monkeypatch)
    edited = module(SCALE="(k / k)").case
    table = gl.Study(edited, rows=[2], k=[1e13]).run(tmp_path / "s", on=ThreadPoolExecutor(1), progress=False)
    assert table.rows[0]["status"] == "finished"
    assert len(Store(tmp_path / "s")) == 2


def test_a_case_is_compared_with_an_earlier_run_of_its_factors_that_measured_the_same():
    """No refused case, which has no run, none that was killed, and none of which other measures are kept."""
    study, store = gl.Study(tiny, law=["linear"], seed=range(6)), InMemory()
    (own, _), *_ = study._cases()
    earlier = {"run": "its run", "status": "finished", "measured": study._measured}
    changed = [{}, {"run": "", "status": "refused"}, {"status": "killed"}, {"measured": "other"}, {"case": own}]
    for seed, change in enumerate(changed):
        store.write({"case": f"case {seed}", "factors": {"seed": seed, "law": "linear"}, **earlier, **change}, None)
    tasks = [Task(f"new {seed}", {"law": "linear", "seed": seed}) for seed in range(6)]
    assert [task.known for task in study._with_known(tasks, store)] == [("its run", "case 0")] + 5 * [("", "")]
    assert [task.case for task in study._with_known(tasks, store)] == [f"new {seed}" for seed in range(6)]
    assert study._with_known(tasks, InMemory()) == tasks


def test_a_result_without_frames_or_curves_has_a_summary_and_no_measures():
    """Also one that is stopped before its first sample: nothing is said to have gone wrong with its measures."""
    result = tiny("linear", 0).simulate()
    whole = found_by(result, tuple(MEASURES.values()))
    assert whole["measures"]
    for less in ({"frames": []}, {"curves": {}}, {"frames": [], "curves": {}}):
        found = found_by(attrs.evolve(result, **less), tuple(MEASURES.values()))
        assert found["measures"] == {}
        assert not any("measure" in words for words in found["doubts"])
        assert found["summary"] == whole["summary"]


@attrs.frozen
class Mine(gl.Measure):
    """Fails, or not."""

    name: str
    meaning = "mine"
    unit = "Pa"
    fails: bool = False

    def find(self, laboratory):
        return laboratory.result.nothing if self.fails else 1.0


def test_a_measure_of_ones_own_that_fails_takes_no_other_with_it():
    """Nor does one that has the name of a property of the test: both are doubts of the case."""
    result = tiny("linear", 0).simulate()
    whole = found_by(result, tuple(MEASURES.values()))
    own = [Mine("mine"), Mine("boom", fails=True), Mine("largest_stress")]
    found = found_by(result, (*own, *MEASURES.values()))
    assert found["measures"] == pytest.approx(whole["measures"] | {"mine": 1.0}, nan_ok=True)
    assert found["summary"] == whole["summary"]
    said = [words for words in found["doubts"] if words not in whole["doubts"]]
    assert said == [
        "Mine: find fails for 'boom': AttributeError: 'Result' object has no attribute 'nothing'",
        "the measure 'largest_stress' has the name of a property of the test, which stands there",
    ]
    with pytest.raises(gl.ParameterError, match="find fails for 'boom': AttributeError"):
        gl.Laboratory(result, own).value("boom")
    table = gl.Study(tiny, law=["linear"], seed=[0], measures=own[:2]).run(on=ThreadPoolExecutor(1), progress=False)
    with pytest.raises(gl.ParameterError, match="no case has the measure 'boom': Mine: find fails for 'boom'"):
        table["boom"]


@pytest.mark.thorough
def test_a_script_without_a_guard_runs_once(tmp_path):
    """Cases of __main__ reach the processes, which do not run the script again."""
    script = f"""
import sys
sys.path.insert(0, {os.path.dirname(__file__)!r})
import grainlaw as gl
from study_cases import tiny as inner
print("begins")
def case(seed):
    return inner("linear", seed)
table = gl.Study(case, seed=[0, 1]).run({str(tmp_path / "s")!r}, workers=2, progress=False)
print([row["status"] for row in table.rows], table.rows[0]["strength"])
"""
    for arguments, text in (([str(tmp_path / "script.py")], None), (["-"], script)):  # the second finds it finished
        (tmp_path / "script.py").write_text(script)
        done = subprocess.run(
            [sys.executable, *arguments], input=text, capture_output=True, text=True, timeout=120, check=True
        )
        assert done.stdout.count("begins") == 1
        assert "['finished', 'finished']" in done.stdout


@pytest.mark.thorough
def test_what_it_will_cost_is_known_before(tmp_path, table):
    study = tiny_study()
    probed = study.estimate()
    assert (probed.cases, probed.measured) == (4, False)
    spent = sum(cost["cpu"] for cost in table.costs)
    assert spent / 20 < probed.cpu < 20 * spent
    study.run(tmp_path / "s", shard=(1, 2), on=ThreadPoolExecutor(1), progress=False)
    known = study.estimate(tmp_path / "s")
    assert (known.cases, known.measured) == (2, True)
    assert "2 cases: about" in str(known)


def test_another_level_of_the_same_name_is_another_case():
    def cases(law):
        return [key for key, _ in gl.Study(tiny, law={"mine": law}, seed=[1])._cases()]

    brittle, again, linear = map(cases, (LAWS["brittle"], attrs.evolve(LAWS["brittle"]), LAWS["linear"]))
    assert brittle == again != linear


@pytest.mark.thorough
def test_any_levels_may_be_given_by_names(tmp_path):
    def case(law, grains):
        return gl.Run(gl.Specimen(grains.tessellate(rectangle(20 * mm, 40 * mm)), ROCK), law, SHORT)

    study = gl.Study(case, law=LAWS, grains={"two": Bricks(rows=2), "three": Bricks(rows=3)})
    table = study.run(tmp_path / "s", on=ThreadPoolExecutor(1), progress=False)
    assert table["law"].tolist() == ["brittle", "brittle", "linear", "linear"]
    other = gl.Study(case, law=LAWS, grains={"two": Bricks(rows=2), "three": Bricks(rows=4)})
    assert str(other.status(tmp_path / "s")) == "4 cases: 2 finished, none failed, 2 missing"
