"""Studies whose cases, workers, folders or input fail: every failure is a row or a clear error, nothing is lost."""

import errno
import importlib
import json
import os
import subprocess
import sys
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from study_cases import SHORT, column, refuse_to_run, tiny, tiny_study
from support import BRITTLE, ROCK, STIFF

import grainlaw as gl
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Linear
from grainlaw.protocols import UniaxialCompression
from grainlaw.runs import identity, progress_file
from grainlaw.runs.identity import Unknown, digest, own_modules
from grainlaw.runs.stopping import Stop
from grainlaw.studies import store as stores
from grainlaw.studies import study as studies
from grainlaw.studies.case import Done, Recipe, Task, watching
from grainlaw.studies.store import Store
from grainlaw.studies.study import packed
from grainlaw.studies.workers import Local, Workers, carry_all
from grainlaw.units import mm


def failing(kind, seed=0):
    grains = Bricks(rows=2).tessellate(rectangle(20 * mm, 40 * mm))
    specimen = gl.Specimen(grains, ROCK)
    if kind == "refused":
        return gl.Run(specimen, BRITTLE, UniaxialCompression(samples=20, maximum_strain=-float(seed)))
    if kind == "stage":
        return gl.Run(specimen, Linear(**STIFF), Endless())
    if kind == "bug":
        raise KeyError("my own")
    if kind == "no run":
        return specimen
    return gl.Run(specimen, Linear(**STIFF), SHORT)


@attrs.frozen(kw_only=True)
class Endless(gl.LoadingProtocol):
    def stages(self, specimen):
        press = gl.loads.Drive(boundary="top", axis=1, speed=-0.1)
        hold = gl.loads.Drive(boundary="bottom", axis=1, speed=0.0)
        return [gl.Stage(name="wait", loads=[press, hold], until=[gl.conditions.Reaches("time", 1.0)], interval=1e-6,
                         sample_limit=3)]  # fmt: skip

    def measure(self, state):
        return {}

    def summary(self, curves, specimen):
        return {"samples": len(curves["time"])}


def test_a_failed_case_is_a_row_and_is_not_tried_again(tmp_path, monkeypatch):
    study = gl.Study(failing, kind=["stage", "well"])
    table = study.run(tmp_path / "s", on=ThreadPoolExecutor(1), progress=False)
    assert [row["status"] for row in table.rows] == ["stage", "finished"]
    assert "did not end within 3 samples" in table.failed[0]["reason"]
    assert table.rows[0]["samples"] == 3  # what it has recorded
    assert "did not end within 3 samples" in str(table)
    assert str(study.status(tmp_path / "s")) == "2 cases: 1 finished, 1 stage, 0 missing"
    refuse_to_run(monkeypatch)
    study.run(tmp_path / "s", on=ThreadPoolExecutor(1), progress=False)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("refused", "kind = 'refused' is refused.*maximum_strain = -0 is not allowed"),
        ("bug", "kind = 'bug' is refused.*KeyError: 'my own'"),
        ("no run", "kind = 'no run' is refused.*returned .*, it must return a grainlaw.Run"),
    ],
)
def test_a_level_that_is_refused_is_named_before_anything_runs(kind, words, tmp_path, monkeypatch):
    refuse_to_run(monkeypatch)
    with pytest.raises(gl.ParameterError, match=words):
        gl.Study(failing, kind=["well", kind]).run(tmp_path / "s", on=ThreadPoolExecutor(1), progress=False)
    with pytest.raises(gl.ParameterError, match=rf"kind = '{kind}' is refused \(in the case seed = 0\): "):
        gl.Study(failing, kind=[kind], seed=[0]).run(tmp_path / "s", on=ThreadPoolExecutor(1), progress=False)
    assert not len(Store(tmp_path / "s"))


@pytest.mark.parametrize(
    ("levels", "tried"),
    [
        ([4, 0, *range(5, 10), 1, 2, 3.5], {4, 0, 9}),  # of many numbers the first and the outermost
        (range(8), set(range(8))),
        ("abcdefghij", set("abcdefghij")),
        ([*range(9), "a"], {*range(9), "a"}),
    ],
)
def test_levels_that_are_tried(levels, tried, monkeypatch):
    seen = []
    run = SimpleNamespace(model=None, specimen=None, protocol=None, key=lambda: str(len(seen)))
    monkeypatch.setattr(studies.Recipe, "run", lambda _, factors: seen.append(factors["level"]) or run)
    monkeypatch.setattr(studies, "stages_of", lambda *_: [])
    monkeypatch.setattr(studies, "warn_of_scales", lambda *_: None)
    study = gl.Study(lambda level: None, level=list(levels))
    study._try_levels([Task(key, factors) for key, factors in study._cases()], compile_too=False)
    assert (len(seen), set(seen)) == (len(tried), tried)


def test_a_shard_is_every_nth_case(tmp_path, monkeypatch):
    carried = []
    monkeypatch.setattr(gl.Study, "_try_levels", lambda *_, **__: None)
    monkeypatch.setattr(gl.Study, "_carry", lambda self, missing, *_: carried.append([t.factors["k"] for t in missing]))
    study = gl.Study(lambda k: None, k=range(8))
    for shard in (None, (1, 3), (3, 3)):
        study.run(shard=shard, workers=1, progress=False)
    assert carried == [list(range(8)), [0, 3, 6], [2, 5]]
    for options, words in (
        ({"shard": (4, 3)}, "shard = 4 is not allowed"),
        ({"shard": (0, 3)}, "shard = 0 is not allowed"),
        ({"shard": 3}, "shard = 3 is not allowed, it must be"),
        ({"workers": 0}, "workers = 0 is not allowed"),
        ({"workers": 1, "on": ThreadPoolExecutor(1)}, "workers and on are not allowed together"),
    ):
        with pytest.raises(gl.ParameterError, match=words):
            study.run(progress=False, **options)


@pytest.mark.thorough
def test_a_combination_that_is_refused_is_a_row(tmp_path):
    """Only one case of each level is built before."""
    study = gl.Study(combined, a=[1, 2], b=[1, 2])
    table = study.run(tmp_path / "s", on=ThreadPoolExecutor(1), progress=False)
    assert [row["status"] for row in table.rows] == ["finished"] * 3 + ["refused"]
    assert "both are 2" in table.failed[0]["reason"]


def combined(a, b):
    if a == b == 2:
        raise gl.ParameterError("both are 2")
    return tiny("linear", a + 2 * b)


@pytest.mark.thorough
def test_a_full_disk_keeps_what_is_finished(tmp_path, monkeypatch):
    study, write, room = tiny_study(), stores._write, [5]

    def full(file, text):
        room[0] -= 1
        if room[0] < 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(file))
        write(file, text)

    with monkeypatch.context() as only_here:
        only_here.setattr(stores, "_write", full)
        with pytest.raises(OSError, match="No space left on device"):
            study.run(tmp_path / "s", on=ThreadPoolExecutor(1), progress=False)
    assert study.status(tmp_path / "s").finished == 2  # of two files each; of the third only one had room
    assert study.run(tmp_path / "s", on=ThreadPoolExecutor(1), progress=False)["status"].tolist() == ["finished"] * 4


@pytest.mark.thorough
def test_workers_that_die_again_and_again_over_a_case_kill_it(tmp_path):
    """Its own process is killed by the case; the others are finished, and the second call tries it again."""
    study = gl.Study(deadly, seed=[0, 1, 2])
    table = study.run(tmp_path / "s", workers=2, progress=False)
    states = table["status"].tolist()
    assert states[1] == "killed"
    assert set(states) <= {"finished", "killed"}
    assert "its worker died" in table.failed[0]["reason"]
    again = study.run(tmp_path / "s", workers=1, progress=False)
    assert again["status"].tolist() == ["finished", "killed", "finished"]


@attrs.frozen(kw_only=True)
class Deadly(gl.LoadingProtocol):
    def stages(self, specimen):
        return SHORT.stages(specimen)

    def measure(self, state):
        os.kill(os.getpid(), 9)

    def summary(self, curves, specimen):
        return {}


def deadly(seed):
    run = tiny("linear", seed)
    return gl.Run(run.specimen, run.law, Deadly()) if seed == 1 else run


class Reluctant(Workers):
    """Does not take the first two cases, as a pool whose process died between cases."""

    count, renewed = 1, 0

    def submit(self, recipe, task):
        if self.renewed < 2:
            raise BrokenExecutor
        future = Future()
        future.set_result(Done({"case": task.case}, None))
        return future

    def renew(self):
        self.renewed += 1
        return set()


def test_workers_that_die_between_cases_are_replaced():
    accepted = []
    tasks = [Task(str(k), {}) for k in range(5)]
    carry_all(iter(tasks), b"", Reluctant(), lambda task, done: accepted.append(task.case), Stop())
    assert sorted(accepted) == ["0", "1", "2", "3", "4"]


def test_processes_are_ended_at_once_and_replaced(tmp_path):
    said = []
    made, after = object.__new__(Local), SimpleNamespace(_processes=None, shutdown=lambda **how: said.append(how))
    (tmp_path / "a.1").write_text("0.5 half")
    made.count, made.folder, made._pool = 2, str(tmp_path), lambda: after
    busy = {k: SimpleNamespace(kill=lambda k=k: said.append(k)) for k in (7, 8)}
    made.pool = SimpleNamespace(_processes=busy, shutdown=after.shutdown)
    assert made.renew() == {"a"}
    assert said == [7, 8, {"wait": True, "cancel_futures": True}]
    assert (made.pool, list(tmp_path.iterdir())) == (after, [])
    made.close()
    assert said[3:] == [{"wait": True, "cancel_futures": True}]
    assert not tmp_path.exists()


class Dying(Workers):
    """One worker, which dies over the case "bad", of which it is known when the next is given."""

    count = 1

    def submit(self, recipe, task):
        future = Future()
        if task.case == "bad":
            future.set_exception(BrokenExecutor())
        else:
            future.set_result(Done({"case": task.case, "status": "finished"}, None))
        return future

    def renew(self):
        return {"bad"}


def test_a_case_over_which_four_workers_died_is_killed():
    accepted = {}
    tasks = [Task(name, {}) for name in ("first", "bad", "last")]
    carry_all(iter(tasks), b"", Dying(), lambda task, done: accepted.update({task.case: done.row}), Stop())
    assert {name: row["status"] for name, row in accepted.items()} == {
        "first": "finished", "last": "finished", "bad": "killed",
    }  # fmt: skip
    assert accepted["bad"]["reason"] == "its worker died 4 times (of too little memory?)"


@pytest.mark.parametrize(("kind", "ends"), [(MemoryError, "killed"), (ValueError, None)])
def test_an_executor_that_gives_back_an_error(kind, ends):
    class Erring(Dying):
        def submit(self, recipe, task):
            future = Future()
            future.set_exception(kind("too much"))
            return future

    rows = []
    if ends:
        carry_all(iter([Task("a", {})]), b"", Erring(), lambda task, done: rows.append(done.row), Stop())
        assert (rows[0]["status"], rows[0]["reason"]) == (ends, "MemoryError: too much")
    else:
        with pytest.raises(gl.ExecutorError, match="could not carry out a case, ValueError: too much"):
            carry_all(iter([Task("a", {})]), b"", Erring(), lambda task, done: rows.append(done.row), Stop())


@pytest.mark.thorough
def test_a_warning_is_given_once_for_a_level_and_not_by_the_workers(tmp_path, capfd):
    """A speed of a tenth of that of waves."""
    study = gl.Study(column, rows=[2], height=[40.0, 41.0], speed=[300.0])
    with pytest.warns(gl.UnitWarning, match="moves at 300 m/s, which is unusual") as heard:
        study.run(tmp_path / "s", workers=1, progress=False)
    assert len([one for one in heard if one.category is gl.UnitWarning]) <= 2  # one for each level
    assert "UnitWarning" not in capfd.readouterr().err


@pytest.mark.thorough
def test_an_executor_of_the_users_that_breaks_keeps_what_is_finished(tmp_path):
    study = gl.Study(deadly, seed=[0, 1])
    with ProcessPoolExecutor(1) as pool, pytest.raises(gl.ExecutorError, match="a worker of the executor has died"):
        study.run(tmp_path / "s", on=pool, progress=False)
    assert study.status(tmp_path / "s").finished <= 1


@pytest.mark.thorough
def test_bad_input_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mine.txt").write_text("")
    tiny_study().run(tmp_path / "old", shard=(1, 4), on=ThreadPoolExecutor(1), progress=False)
    (tmp_path / "old" / "study.json").write_text('{"format": 0}')
    study = tiny_study()
    for folder, words in (
        ("file", "is a file; a study needs a folder"),
        ("other", "is not empty and no store of a study"),
        ("old", "is a store of format 0; this version of grainlaw has 2"),
    ):
        with pytest.raises(gl.ParameterError, match=words):
            study.run(tmp_path / folder)
    with pytest.raises(gl.ParameterError, match="is no store of a study"):
        study.status(tmp_path / "none")
    for options, words in (
        ({"shard": (5, 3)}, "shard = 5 is not allowed"),
        ({"shard": 3}, "shard = 3 is not allowed, it must be"),
        ({"workers": 0}, "workers = 0 is not allowed"),
        ({"on": 7}, "on = 7 is not allowed, it must be a Gpu, an executor"),
        ({"on": "tcp://127.0.0.1:9"}, "no Dask scheduler answers at 'tcp://127.0.0.1:9'"),
        ({"workers": 1, "on": "tcp://127.0.0.1:9"}, "workers and on are not allowed together"),
    ):
        if options.get("on") == "tcp://127.0.0.1:9" and "workers" not in options:
            pytest.importorskip("distributed")
        with pytest.raises(gl.ParameterError, match=words):
            study.run(tmp_path / "s", progress=False, **options)


REACHED = dict.fromkeys(("closure", "default", "constant", "helper", "kind", "array", "instance"), 1)


@pytest.mark.parametrize("change", REACHED)
def test_what_a_case_reaches_is_part_of_its_key(change):
    """Whatever holds it; a test's own field may have any name, and an object that is no value counts by its class."""
    assert key_of_a_case(**REACHED) == key_of_a_case(**REACHED) != key_of_a_case(**REACHED | {change: 2})


def key_of_a_case(closure, default, constant, helper, kind, array, instance):
    text = f"""
import sys
import numpy as np
CONSTANT, LOG, CURVE = {constant}, sys.stderr, np.array([1.0, {array}])
def helper(x):
    return {helper} * x  # of its own
class Own:
    factor = {kind}
    def __init__(self, load):
        self.load = load
    def scale(self, x):
        return self.factor * x
OWN = Own({instance})
def outer(closed):
    def case(seed, given={default}):
        print(file=LOG)
        return helper(closed) + CONSTANT + Own(load=2 * OWN.load).scale(given) + CURVE[0]
    return case
"""
    names = {"__name__": "of_a_user"}
    exec(compile(text, "user.py", "exec"), names)
    return digest(names["outer"](closure))


@pytest.mark.thorough
def test_a_key_is_the_same_in_another_process():
    """Here as there, where the file of what travels is not loaded."""
    script = """
import sys, cloudpickle
from grainlaw.runs import progress_file
from grainlaw.runs.identity import digest
case = cloudpickle.load(sys.stdin.buffer).case
print(digest(case), digest(case(1).law))
"""
    recipe = packed(Recipe(of_ones_own, ()))
    done = subprocess.run([sys.executable, "-c", script], input=recipe, capture_output=True, check=True)
    assert done.stdout.decode().split() == [digest(of_ones_own), digest(of_ones_own(1).law)]


@attrs.frozen(kw_only=True)
class Spring(gl.ContactLaw):
    """With a parameter, whose checks are grainlaw's, and with methods that attrs makes."""

    k: float = gl.parameter("Pa/m")
    stiffness = property(lambda self: (self.k, self.k))

    def traction(self, opening, slip):
        return self.k * opening, self.k * slip


def of_ones_own(seed):
    return gl.Run(tiny("linear", seed).specimen, Spring(k=1e13), tiny("linear", seed).protocol)


class Height(gl.Measure):
    """A measure as docs/how-do-i.md shows one: a class without fields."""

    name = "height"
    meaning = "peak over two"
    unit = "MPa"

    def find(self, laboratory):
        return laboratory.result.summary["largest_stress"] / 2


class Share(Height):
    """And one that was given a number."""

    def __init__(self, share):
        self.share = share


@pytest.mark.thorough
def test_measures_of_ones_own_are_part_of_the_key(tmp_path):
    def case(seed):
        return tiny("brittle", seed)

    found = gl.Study(case, seed=[1], measures=[Height()]).run(tmp_path / "s", progress=False)
    assert found["height"][0] == found["largest_stress"][0] / 2
    assert "height" in str(found).splitlines()[0]  # printed and reported like ours
    found.write_report(tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text("utf-8")
    assert ">height (MPa)<" in page
    assert "height (peak over two): A point" in page  # a picture of its own, and what it is
    read = gl.read_study(tmp_path / "s")
    assert read.own == ["height"]
    assert read.quantity("height").heading == "height (MPa)"
    assert digest(Share(2)) == digest(Share(2)) != digest(Share(3))
    assert digest(Share(2)) != digest(Height())
    with (
        pytest.raises(Unknown, match=r"\.share is a TextIOWrapper, whose content is not known"),
        open(__file__) as file,
    ):
        digest(Share(file))


@pytest.mark.thorough
def test_cases_that_finished_are_doubted_where_the_specimen_had_not_failed(tmp_path):
    table = tiny_study().run(tmp_path / "s", on=ThreadPoolExecutor(1), progress=False)
    [(words, rows)] = [(words, rows) for words, rows in table.doubts.items() if "had not failed" in words]
    assert rows == [
        k for k in range(len(table)) if table.rows[k]["law"] == "brittle" and np.isnan(table["strength"][k])
    ]
    line = f"{len(rows)} of 4 cases: {words}"
    assert line in str(table).splitlines()
    assert line in table._repr_html_()
    table.write_report(tmp_path / "report.html")
    assert f"{line}." in (tmp_path / "report.html").read_text("utf-8")
    kept = table.where(law="brittle")
    assert kept.doubts[words] == [0, 1]


def test_a_class_of_ones_own_is_known_by_what_it_is_not_by_its_file(tmp_path, monkeypatch):
    """A study that is imported from a script, or from a renamed file, has the cases of the script."""
    text = (
        "import grainlaw as gl\n"
        "class Highest(gl.Measure):\n"
        "    name, meaning = 'highest', 'the highest'\n"
        "    def find(self, laboratory):\n"
        "        return FACTOR * laboratory.result.curves['stress'].max()\n"
        "def case(seed):\n"
        "    return Highest\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    found = {}
    for name, factor in (("one_name", "2"), ("other_name", "2"), ("third_name", "3")):
        (tmp_path / f"{name}.py").write_text(text.replace("FACTOR", factor))
        module = importlib.import_module(name)
        found[name] = digest(module.Highest), digest(module.Highest()), digest(module.case)
        sys.modules.pop(name)
    assert found["one_name"] == found["other_name"]
    assert not set(found["one_name"]) & set(found["third_name"])


@pytest.mark.parametrize("code", ["getattr(own_constants, name)", "vars(own_constants)[name]"])
def test_what_is_found_by_a_text_counts_with_all_that_its_module_says(tmp_path, monkeypatch, code):
    monkeypatch.syspath_prepend(tmp_path)
    found = []
    for value in ("10e6", "10e6", "5e6"):
        (tmp_path / "own_constants.py").write_text(f"STRENGTH = {value}\n")
        (tmp_path / "own_reader.py").write_text(f"import own_constants\ndef case(name):\n    return {code}\n")
        importlib.invalidate_caches()
        case = importlib.import_module("own_reader").case
        found.append(digest(case))
        assert own_modules(case) == {"own_reader", "own_constants"}
        for name in ("own_constants", "own_reader"):
            del sys.modules[name]
    assert found[0] == found[1] != found[2]


def found_by_a_text(name):
    return globals()[name]


def test_a_case_that_may_find_anything_is_refused_before_anything_is_run(tmp_path):
    """In another process it would find only what code names."""
    with pytest.raises(gl.ParameterError, match=r"cannot be told: found_by_a_text calls globals\(\): keep in a dict"):
        gl.Study(lambda name: found_by_a_text(name), name=["tiny"]).run(tmp_path / "s", progress=False)


def test_a_worker_says_what_it_does_in_a_file_of_its_own(tmp_path, monkeypatch):
    """At most twice a second: how far it is, where, and the curve so far."""
    stage = gl.Stage(name="pull", loads=[], until=[gl.conditions.AtRest()], interval=1.0)
    state = SimpleNamespace(usual_end=1.0, time=0.5, time_step=0.01, steps=50)
    curves = {"strain": [0.0, 1e-3], "stress": [0.0, 5e6], "tensile_cracks": [0, 2], "shear_cracks": [0, 1]}
    curves = {name: np.array(column) for name, column in curves.items()}
    with watching(str(tmp_path), "abc") as [watch]:
        [file] = tmp_path.iterdir()
        assert (file.name, file.read_text()) == (f"abc.{os.getpid()}", "")
        for now, progress, told in ((100.0, 0.25, 0.25), (100.4, 0.5, 0.25), (100.6, 0.75, 0.75)):
            monkeypatch.setattr(progress_file.time, "monotonic", lambda now=now: now)
            watch.observe(state, curves, stage, progress)
            [file] = tmp_path.iterdir()
            assert json.loads(file.read_text())["share"] == told
        content = json.loads(file.read_text())
        assert (content["where"], content["cracks"]) == ("pull, 0.1000 %, 5.00 MPa", 3)
        assert (content["columns"], content["rows"]) == (["strain", "stress"], [[0.0, 0.0], [1e-3, 5e6]])
    assert not any(tmp_path.iterdir())
    with watching("", "abc") as none:
        assert none == []


# --- a factor that is called like a result ---------------------------------------------------------------------------


def named_like_a_result(strength, law="brittle"):
    return tiny(law, int(strength))


def named_like_a_measure(b_value):
    return tiny("brittle", b_value)


@pytest.mark.thorough
def test_a_factor_with_the_name_of_a_result_is_refused_after_the_first_case(tmp_path):
    study = gl.Study(named_like_a_result, strength=[1, 2, 3])
    with pytest.raises(gl.ParameterError, match=r"the factor 'strength' = [123] has the name of a result.* another"):
        study.run(tmp_path / "s", workers=1, progress=False)
    assert study.status(tmp_path / "s").finished == 1
    table = study.table(tmp_path / "s")
    with pytest.raises(gl.ParameterError, match="the factor 'strength'"):
        table["strength"]


@pytest.mark.parametrize(
    ("names", "unit", "words"),
    [
        (["strength"], "MPa", "the name 'strength' is not allowed, it is that of a property of tests"),
        (["status"], "MPa", "the name 'status' is not allowed, it is that of a property of tests"),
        (["bounce", "bounce"], "MPa", "Study: measures: two are named 'bounce', each must have a name of its own"),
        (["bounce"], "MPaa", "unit = 'MPaa' is not allowed"),
    ],
)
def test_measures_that_cannot_be_recorded_are_refused_before_anything_is_run(names, unit, words):
    def made(name):
        fields = {"name": name, "unit": unit, "meaning": "of a test", "needs": [], "find": lambda _, laboratory: 1.0}
        return type("Own", (gl.Measure,), fields)()

    with pytest.raises(gl.ParameterError, match=words):
        gl.Study(lambda x: x, measures=[made(name) for name in names], x=[1.0])


def test_a_factor_with_the_name_of_a_measure_is_refused_before_anything_is_run():
    with pytest.raises(gl.ParameterError, match="may not be called 'b_value', a measure has this name"):
        gl.Study(named_like_a_measure, b_value=[1])
    assert len(gl.Study(named_like_a_measure, b_value=[1], measures=())) == 1


def test_an_installation_whose_checkout_has_changed_says_so(tmp_path, monkeypatch):
    """An editable one, with links to files of a checkout, of which one has moved."""
    (tmp_path / "laws.py").symlink_to(tmp_path / "gone.py")
    monkeypatch.setattr(identity, "_folders", lambda: {"": tmp_path})
    identity.sources_hash.cache_clear()
    with pytest.raises(gl.ParameterError, match=r"installed from files of which .*laws\.py is gone: install it again"):
        identity.sources_hash()
