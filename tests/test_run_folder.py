"""The folder of a run: whole at any moment, one run at a time, and a full disk stops no run."""

import csv
import importlib
import json
import linecache
import math
import multiprocessing
import os
import resource
import stat
import subprocess
import sys
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
from support import STRONG, small_sample
from test_restart import same

import grainlaw as gl
from grainlaw.cli.running import contents, finished, linked
from grainlaw.integration import CentralDifference
from grainlaw.laws import CohesiveCrack
from grainlaw.protocols import UniaxialTension
from grainlaw.results import files
from grainlaw.results.files import OutputWarning
from grainlaw.results.vtk import VtkWriter
from grainlaw.runs import claim, execution, run_folder
from grainlaw.runs.claim import Claim, claimed, tidy
from grainlaw.runs.record import own_sources

WEAK = CohesiveCrack(**STRONG, mode_i_energy=1.5, mode_ii_energy=3)
PULL = UniaxialTension(loading=gl.Constant(speed=0.3), maximum_strain=5e-4, samples=25, stop_fraction=0)
RUN = {"specimen": small_sample(), "law": WEAK, "protocol": PULL}


def table(file):
    with file.open() as stream:
        return list(csv.DictReader(stream))


class Look(gl.Observer):
    """Reads the curves file while the run goes on."""

    def __init__(self, folder):
        self.folder, self.counts = folder, []

    def observe(self, state, curves, stage, progress):
        rows = table(self.folder / "curves.csv")
        assert float(rows[-1]["time"]) == state.time
        self.counts.append(len(rows))


@pytest.mark.thorough
def test_curves_and_cracks_are_there_at_every_sample_and_hold_every_digit(tmp_path):
    look = Look(tmp_path)
    result = gl.simulate(**RUN, checkpoint=tmp_path, observers=[look])
    assert look.counts == list(range(1, len(result.curves["time"]) + 1))
    rows = table(tmp_path / "curves.csv")
    for name, values in result.curves.items():
        assert np.array_equal([float(row[name]) for row in rows], values, equal_nan=True), name
    cracks = table(tmp_path / "cracks.csv")
    assert [float(row["time"]) for row in cracks] == result.cracks.time.tolist()
    for name in ("mode", "spent", "length"):
        assert [float(row[name]) for row in cracks] == getattr(result.cracks, name).tolist()
    moved = np.hypot(*(result.cracks.position.T - np.array([[float(row[n]) for row in cracks] for n in "xy"])))
    assert moved.max() < 1e-4  # the result has them on the deformed specimen, pulled by 0.02 mm
    assert [[int(row["grain_a"]), int(row["grain_b"])] for row in cracks] == result.cracks.grains.tolist()


@pytest.mark.thorough
def test_a_summary_is_written_while_the_run_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr(run_folder, "SUMMARY", 0.0)
    seen = []

    class Read(gl.Observer):
        def observe(self, state, curves, stage, progress):
            if (tmp_path / "summary.json").exists():
                seen.append(json.loads((tmp_path / "summary.json").read_text()))

    result = gl.simulate(**RUN, checkpoint=tmp_path, observers=[Read()])
    assert seen[-1]["incomplete"] == "running"
    assert seen[-1]["properties"]["steps"] == result.curves["step"][-2]
    last = json.loads((tmp_path / "summary.json").read_text())
    assert "incomplete" not in last
    assert last["properties"]["strength"] == result.summary["strength"]


@pytest.mark.thorough
def test_the_record_says_what_decides_the_results(tmp_path):
    gl.simulate(**RUN, checkpoint=tmp_path, threads=2, frames=7)
    record = json.loads((tmp_path / "run.json").read_text())
    assert record["status"] == "finished"
    assert record["duration"] > 0
    assert record["threads"] == 2
    assert record["law"]["mode_ii_energy"] == 3
    assert record["law"]["softening"]["type"] == "EvansMarathe"
    assert record["protocol"]["samples"] == 25
    assert record["options"]["frames"] == 7
    assert record["options"]["detection"]["hand_over"] == 0.05
    assert record["made_with"]["processor"]
    assert {"python", "numpy", "numba", "llvmlite"} <= set(record["made_with"]["versions"])
    assert record["program"]


@pytest.mark.thorough
def test_the_key_follows_what_decides_the_results_and_nothing_else(tmp_path):
    def key(**other):
        gl.simulate(**RUN | other, checkpoint=tmp_path, overwrite=True)
        return json.loads((tmp_path / "run.json").read_text())["key"]

    first = key()
    assert key(threads=2, specimen=small_sample(), every=1.0) == first
    others = [
        key(specimen=small_sample(seed=2)),
        key(protocol=UniaxialTension(loading=gl.Constant(speed=0.31), maximum_strain=1e-4)),
        key(law=CohesiveCrack(**STRONG, mode_i_energy=1.6, mode_ii_energy=3)), key(frames=3), key(detection=None),
        key(specimen=small_sample(material=gl.Rigid(density=3100))), key(integrator=CentralDifference(safety=0.5)),
    ]  # fmt: skip
    assert len({first, *others}) == len(others) + 1


def test_a_component_whose_file_is_no_python_any_more_has_no_source(tmp_path):
    file = tmp_path / "mine.py"
    file.write_text("import attrs\n\n\n@attrs.frozen\nclass Mine:\n    def size(self):\n        return 1\n")
    scope = {"__name__": "mine"}
    exec(compile(file.read_text(), str(file), "exec"), scope)
    source = own_sources(scope["Mine"]())["Mine"]["source"]
    assert source.startswith("@attrs.frozen\nclass Mine:")
    file.write_text("class Mine: def\n")
    linecache.clearcache()
    assert own_sources(scope["Mine"]())["Mine"]["source"] == ""


def test_a_function_of_a_module_has_its_own_source(tmp_path, monkeypatch):
    """From its first line on to its last, between others."""
    text = "def before():\n    return 1\n\n\ndef mine(x):\n    return x\n\n\ndef after():\n    return 2\n"
    (tmp_path / "functions.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    mine = importlib.import_module("functions").mine
    assert own_sources({"a": mine})["mine"]["source"] == "def mine(x):\n    return x\n"


def test_a_table_grows_by_its_new_rows_until_it_has_other_columns(tmp_path):
    """Rows that a file has are not written again, as who follows it would see."""
    file = tmp_path / "curves.csv"
    grown = run_folder._Table(file)
    grown.grow({"x": np.array([1.0, 2.0])})
    file.write_text("x\n10\n20\n")  # of somebody else
    grown.grow({"x": np.array([1.0, 2.0, 3.0])})
    assert [row["x"] for row in table(file)] == ["10", "20", "3.0"]
    grown.grow({"x": np.array([1.0, 2.0, 3.0]), "y": np.array([4.0, 5.0, 6.0])})
    assert [(float(row["x"]), float(row["y"])) for row in table(file)] == [(1, 4), (2, 5), (3, 6)]
    grown.close()


def test_cracks_are_written_where_there_are_more_of_them_and_not_before_it_is_time(tmp_path, monkeypatch):
    written = []
    monkeypatch.setattr(run_folder, "breaks", lambda state: {"time": state.broken_time[~np.isnan(state.broken_time)]})
    monkeypatch.setattr(run_folder.time, "monotonic", lambda: 100.0)
    folder = run_folder.RunFolder(SimpleNamespace(path=tmp_path, begins=lambda: None), 1.0, "key")
    grow = folder._cracks.grow
    folder._cracks.grow = lambda table: (written.append(len(table["time"])), grow(table))
    for times in ([np.nan, np.nan], [np.nan, np.nan], [1.0, np.nan], [1.0, np.nan]):
        folder.sample({"time": np.array([0.0])}, SimpleNamespace(broken_time=np.array(times)))
    assert written == [0, 1]
    folder._cracks.again = 101.0
    folder.sample({"time": np.array([0.0])}, SimpleNamespace(broken_time=np.array([1.0, 2.0])))
    assert written == [0, 1]
    folder.sample({"time": np.array([0.0])}, SimpleNamespace(broken_time=np.array([1.0, 2.0])), last=True)
    assert written == [0, 1, 2]


@pytest.mark.parametrize(
    "curves", [{"x": np.zeros(2), "y": np.zeros(3)}, {"x": np.zeros((2, 2)), "y": np.zeros((2, 2))}]
)
def test_curves_that_are_no_table_are_refused(curves):
    with pytest.raises(ValueError, match="the curves are not of equal length"):
        execution.CurveTable().fill(curves)


# --- whose folder it is ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("status", "words"), [("running", "killed"), ("stopped", "stopped")])
def test_a_run_that_no_process_does_any_more_was_killed(status, words, tmp_path):
    (tmp_path / "run.json").write_text(
        json.dumps({"status": status, "started": "2026-11-27T14:57:10"}), encoding="utf-8"
    )
    with pytest.raises(gl.ParameterError, match=rf"holds a run \(of 2026-11-27 14:57, {words}\)"), claimed(tmp_path):
        pass


def test_no_run_lies_in_the_folder_of_a_study(tmp_path):
    """It would replace the report of the study."""
    (tmp_path / "study.json").write_text("{}")
    for options in ({}, {"restart": True}, {"overwrite": True}):
        with pytest.raises(gl.ParameterError, match="holds a study: choose another"), claimed(tmp_path, **options):
            pass


@pytest.mark.thorough
def test_a_folder_with_a_run_is_refused_or_replaced(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    first = gl.simulate(**RUN, checkpoint=tmp_path, observers=[VtkWriter(tmp_path)])
    before = (tmp_path / "curves.csv").read_bytes()
    with pytest.raises(gl.ParameterError, match=r"holds a run \(of .*, finished\): choose another folder"):
        gl.simulate(**RUN, checkpoint=tmp_path)
    assert (tmp_path / "curves.csv").read_bytes() == before
    same(first, gl.simulate(**RUN, checkpoint=tmp_path, overwrite=True))
    assert (tmp_path / "notes.txt").read_text() == "mine"
    assert not list(tmp_path.glob("*.vtu"))


HOLD = (
    "import sys; from grainlaw.runs.claim import claimed\nwith claimed(sys.argv[1]): print('held', flush=True); input()"
)


@pytest.mark.thorough
def test_a_folder_in_use_is_refused(tmp_path):
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen([sys.executable, "-c", HOLD, str(tmp_path)], **pipes) as other:
        assert other.stdout.readline() == "held\n"
        for options in ({}, {"restart": True}, {"overwrite": True}):
            with pytest.raises(gl.ParameterError, match="in use: another run writes to it now"):
                gl.simulate(**RUN, checkpoint=tmp_path, **options)
        other.communicate("\n")
    gl.simulate(**RUN, checkpoint=tmp_path)


@pytest.mark.thorough
def test_a_comparison_is_cleared_with_the_folders_of_its_laws(tmp_path):
    laws = {"one": WEAK, "two": WEAK}
    gl.compare(RUN["specimen"], laws, PULL, checkpoint=tmp_path)
    (tmp_path / "one" / "notes.txt").write_text("mine")
    assert (tmp_path / "two" / "checkpoint.npz").exists()
    with claimed(tmp_path, overwrite=True):
        pass
    left = {file.relative_to(tmp_path).as_posix() for file in tmp_path.rglob("*") if file.is_file()}
    assert {file for file in left if not file.endswith(".grainlaw.lock")} == {"one/notes.txt"}


@pytest.mark.parametrize("name", ["config.toml", "curves.csv", "report.html", "summary.json", "result.npz"])
def test_files_of_the_users_own_are_replaced_only_if_asked_to(name, tmp_path):
    (tmp_path / name).write_text("mine")
    (tmp_path / "notes.txt").touch()
    words = f"has {name}, which no run has written and this one would replace: choose another folder, or replace them"
    with pytest.raises(gl.ParameterError, match=words), claimed(tmp_path):
        pass
    assert (tmp_path / name).read_text() == "mine"
    for option in ("restart", "overwrite"):  # a run that was killed before it had a record goes on, too
        with claimed(tmp_path, **{option: True}) as claim:
            assert claim.others == ("notes.txt",)


def test_what_was_made_of_a_run_goes_with_it_and_is_nobody_elses(tmp_path):
    """A certificate of the run before would stand beside another run."""
    for name in ("run.json", "certificate.json", "show_in_paraview.py", "notes.txt"):
        (tmp_path / name).write_text("{}")
    with claimed(tmp_path, overwrite=True) as claim:
        assert claim.others == ("notes.txt",)
    assert sorted(each.name for each in tmp_path.iterdir()) == [".grainlaw.lock", "notes.txt"]


def test_a_folder_that_holds_no_run_is_left_alone(tmp_path):
    (tmp_path / "curves.csv").write_text("mine")
    with claimed(tmp_path, overwrite=True):
        pass
    assert (tmp_path / "curves.csv").read_text() == "mine"


def test_copies_of_law_files_are_removed_with_the_folders_of_their_helpers(tmp_path):
    (tmp_path / "run.json").write_text("{}")
    for place in ("law.py", "helpers/curve.py", "helpers/deep/table.py"):
        file = tmp_path / "law_files" / place
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    with claimed(tmp_path, overwrite=True):
        pass
    assert [each.name for each in tmp_path.iterdir()] == [".grainlaw.lock"]


def test_an_empty_folder_of_the_users_own_stays(tmp_path):
    for place in ("run.json", "law/run.json", "law/frames/00001.npz"):
        (tmp_path / place).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / place).write_text("{}")
    for place in ("mine", "law/frames/mine", "pictures/raw"):
        (tmp_path / place).mkdir(parents=True)
    with claimed(tmp_path, overwrite=True) as claim:
        assert not (tmp_path / "law" / "run.json").exists()
        claim.begins()
    left = {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*")} - {".grainlaw.lock"}
    assert left == {"law", "law/frames", "law/frames/mine", "mine", "pictures", "pictures/raw"}


def there(folder):
    """Names and contents of all files but the lock."""
    files = (file for file in folder.rglob("*") if file.is_file() and file.name != ".grainlaw.lock")
    return {file.relative_to(folder).as_posix(): file.read_bytes() for file in files}


class Refuses(gl.LoadingProtocol):
    """A test that ends before its first sample."""

    def stages(self, specimen):
        return PULL.stages(specimen)

    def measure(self, state):
        raise gl.InstabilityError("it broke at once")

    def summary(self, curves, specimen):
        return {}


@pytest.mark.thorough
@pytest.mark.parametrize("several", [False, True])
def test_a_run_that_does_not_begin_replaces_nothing(several, tmp_path):
    def run(protocol, **options):
        if several:
            gl.compare(RUN["specimen"], {"one": WEAK, "two": WEAK}, protocol, checkpoint=tmp_path, **options)
        else:
            gl.simulate(RUN["specimen"], WEAK, protocol, checkpoint=tmp_path, **options)

    run(PULL)
    before = there(tmp_path)
    assert len(before) > 5
    for wrong in (
        {"protocol": Refuses()},
        {"protocol": PULL, "frames": -1},
        {"protocol": PULL, "mass_scaling": [1, 2]},
    ):
        with pytest.raises((gl.InstabilityError, gl.ParameterError)):
            run(**wrong, overwrite=True)
        assert there(tmp_path) == before
    run(PULL, overwrite=True, frames=3)
    after = there(tmp_path)
    assert not any(name.startswith(".replaced") for name in after)
    assert after != before


def begin_another(folder):
    (folder / "run.json").write_text("{}")
    (folder / "report.html").write_text("new")
    raise KeyboardInterrupt


@pytest.mark.thorough
@pytest.mark.parametrize("moved", [0, 3, None])
def test_a_run_that_was_killed_before_it_began_has_replaced_nothing(moved, tmp_path, monkeypatch):
    """While the old run was moved aside, or after that."""
    gl.simulate(**RUN, checkpoint=tmp_path)
    before = there(tmp_path)
    left = [math.inf if moved is None else moved]
    replace = os.replace

    def killed(*files):
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt
        replace(*files)

    with monkeypatch.context() as only_here:
        only_here.setattr(claim, "_bring_back", lambda folder: None)  # nothing more is done by what is killed
        only_here.setattr(os, "replace", killed)
        with pytest.raises(KeyboardInterrupt), claimed(tmp_path, overwrite=True):
            begin_another(tmp_path)
    assert (there(tmp_path) == before) == (moved == 0)
    with pytest.raises(gl.ParameterError, match="holds a run"):
        gl.simulate(**RUN, checkpoint=tmp_path)
    assert there(tmp_path) == before


@pytest.mark.thorough
def test_what_only_a_restart_needs_is_removed(tmp_path):
    gl.simulate(**RUN, checkpoint=tmp_path)
    assert (tmp_path / "frames").is_dir()
    tidy(tmp_path)
    assert {file.name for file in tmp_path.iterdir()} == {
        "run.json", "summary.json", "curves.csv", "cracks.csv", ".grainlaw.lock",
    }  # fmt: skip


def test_a_folder_of_the_users_own_is_not_tidied(tmp_path):
    (tmp_path / "run.json").write_text("{}")
    for folder in ("law", "mine"):
        (tmp_path / folder / "frames").mkdir(parents=True)
        (tmp_path / folder / "frames" / "0000.npz").touch()
    (tmp_path / "law" / "run.json").write_text("{}")
    finished(Claim(tmp_path))
    assert not (tmp_path / "law" / "frames").exists()
    assert (tmp_path / "mine" / "frames" / "0000.npz").exists()


def test_names_that_would_share_a_folder_are_refused(tmp_path):
    with pytest.raises(gl.ParameterError, match=r"'a\?b' is not allowed as a name: 'a:b' would have the same folder"):
        gl.compare(RUN["specimen"], {"a:b": WEAK, "a?b": WEAK}, PULL, checkpoint=tmp_path)


def test_a_folder_that_cannot_be_written_is_refused(tmp_path):
    tmp_path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    if os.access(tmp_path, os.W_OK):
        pytest.skip("needs a user who may not write everywhere")
    with pytest.raises(OSError, match="cannot write to the folder"):
        gl.simulate(**RUN, checkpoint=tmp_path / "new")


# --- a full disk -----------------------------------------------------------------------------------------------------


@pytest.mark.thorough
def test_pictures_stop_before_the_disk_is_full(tmp_path, monkeypatch):
    whole = gl.simulate(**RUN)
    free = type("Disk", (), {"free": 2**20, "total": 2**40})
    monkeypatch.setattr(files.shutil, "disk_usage", lambda folder: free)
    with pytest.warns(OutputWarning) as told:
        result = gl.simulate(**RUN, checkpoint=tmp_path, observers=[VtkWriter(tmp_path)])
    same(whole, result)
    words = [str(warning.message) for warning in told]
    assert (
        sum("no more pictures for ParaView are written" in message and "only 1.0 MB" in message for message in words)
        == 1
    )
    assert not list(tmp_path.glob("*.vtu"))
    assert len(table(tmp_path / "curves.csv")) == len(whole.curves["time"])


LONGER = {"protocol": UniaxialTension(loading=gl.Constant(speed=0.3), maximum_strain=5e-4, samples=60, stop_fraction=0)}


def limited(folder, size, results):
    """A run in a process that may write no file above a size (bytes), which looks to it like a full disk."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        result = gl.simulate(**RUN | LONGER, checkpoint=folder, every=0, observers=[VtkWriter(folder)])
    results.put((result.curves["time"].tolist(), [str(warning.message) for warning in told]))


@pytest.mark.thorough
@pytest.mark.parametrize("size", [30_000, 12_000])
def test_a_file_that_cannot_grow_stops_no_run(size, tmp_path):
    context = multiprocessing.get_context("fork")
    results = context.Queue()
    process = context.Process(target=limited, args=(tmp_path, size, results))
    process.start()
    times, told = results.get(timeout=120)
    process.join()
    assert times == gl.simulate(**RUN | LONGER).curves["time"].tolist()
    assert any("checkpoint.npz cannot be written (File too large)" in message for message in told)
    rows = (tmp_path / "curves.csv").read_text().splitlines() if (tmp_path / "curves.csv").exists() else []
    assert all(row.count(",") == rows[0].count(",") for row in rows)  # no row is torn
    assert 10 < len(rows) < len(times) or size == 30_000
    assert not list(tmp_path.glob(".*.part.*"))


@pytest.mark.thorough
def test_what_could_not_be_written_is_written_when_there_is_room_again(tmp_path, monkeypatch):
    monkeypatch.setattr(run_folder, "AGAIN", 0.0)
    grow, calls = run_folder._Table._append, []

    def full(self, text):
        calls.append(text)
        if 3 <= len(calls) <= 6:
            raise OSError(28, "No space left on device", str(self.file))
        grow(self, text)

    monkeypatch.setattr(run_folder._Table, "_append", full)
    with pytest.warns(
        OutputWarning, match=r"curves.csv cannot be written \(No space left on device\); the run goes on"
    ):
        result = gl.simulate(**RUN, checkpoint=tmp_path)
    assert [float(row["time"]) for row in table(tmp_path / "curves.csv")] == result.curves["time"].tolist()


@pytest.mark.thorough
def test_a_claim_is_passed_on(tmp_path):
    with claimed(tmp_path, about={"question": "why"}) as claim:
        gl.simulate(**RUN, checkpoint=claim)
    assert isinstance(claim, Claim)
    assert json.loads((tmp_path / "run.json").read_text())["question"] == "why"


def test_what_was_written_is_said_without_the_pictures_of_a_series(tmp_path):
    for name in ("grains_0001.vtu", "grains.pvd", ".hidden", "curves.csv"):
        (tmp_path / name).touch()
    (tmp_path / "frames").mkdir()
    assert contents(tmp_path) == f"written to {tmp_path}{os.sep}: curves.csv, frames{os.sep}, grains.pvd"


def test_a_checkpoint_and_a_summary_are_due_after_their_time(monkeypatch):
    made = object.__new__(run_folder.RunFolder)
    made.every, made._last_checkpoint, made._last_summary = 60.0, 1000.0, 1000.0
    for now, due in ((1059, False), (1061, True)):
        monkeypatch.setattr(run_folder.time, "monotonic", lambda now=now: now)
        assert made.checkpoint_is_due() is due
    for after, due in ((0.9, False), (1.1, True)):
        monkeypatch.setattr(run_folder.time, "monotonic", lambda now=1000 + after * run_folder.SUMMARY: now)
        assert made.summary_is_due() is due


def unstarted(folder):
    made = object.__new__(run_folder.RunFolder)
    made.path, made.failed, made._frames = folder, set(), 0
    return made


@pytest.mark.parametrize(("status", "more"), [("finished", {}), ("running", {"incomplete": "running"})])
def test_a_summary_says_why_it_is_incomplete_or_nothing(status, more, tmp_path):
    unstarted(tmp_path).summarize({"steps": 3}, status)
    assert json.loads((tmp_path / "summary.json").read_text()) == {"properties": {"steps": 3}, **more}


NODES = np.zeros((3, 2))


def test_frames_are_not_written_again_unless_one_of_them_cannot_be_read(tmp_path, monkeypatch):
    monkeypatch.setattr(run_folder, "packed", lambda frame: {"number": np.array(frame)})
    monkeypatch.setattr(run_folder, "unpacked", lambda arrays, nodes: int(arrays["number"]))
    made, places = unstarted(tmp_path), [tmp_path / run_folder.FRAMES / f"000{k}.npz" for k in range(3)]
    made.keep([7, 8, 9])
    assert made.frames(2, NODES) == [7, 8]
    made.keep([1, 2, 10])  # the third alone is new
    assert made.frames(3, NODES) == [7, 8, 10]
    places[1].write_bytes(b"half of it")
    with pytest.warns(OutputWarning, match=r"a picture of the run before is missing, .*0001\.npz"):
        assert made.frames(3, NODES) == [7, 10]
    made.keep([7, 10])
    assert made.frames(2, NODES) == [7, 10]


def test_a_checkpoint_of_another_run_is_refused_and_one_of_another_machine_is_warned_of(tmp_path, monkeypatch):
    file, here = tmp_path / run_folder.CHECKPOINT, {"versions": {"numpy": "2"}, "processor": "a", "system": "b"}
    monkeypatch.setattr(run_folder, "made_with", lambda: here)
    assert run_folder.checkpoint_of(tmp_path, "key") is None
    file.touch()
    stored = SimpleNamespace(key="key", made_with=dict(here))
    monkeypatch.setattr(run_folder.checkpoint, "load", lambda asked: stored if asked == file else None)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert run_folder.checkpoint_of(tmp_path, "key") is stored
    stored.made_with["processor"] = "c"
    with pytest.warns(OutputWarning, match="was written with other processor: the last digits may differ"):
        assert run_folder.checkpoint_of(tmp_path, "key") is stored
    with pytest.raises(gl.ParameterError, match="belongs to another run"):
        run_folder.checkpoint_of(tmp_path, "other")


def test_a_finished_run_without_a_checkpoint_is_not_gone_on_with_as_another(tmp_path):
    record = tmp_path / "run.json"
    for content in ("half of it", "[]", "{}", '{"key": 1}', '{"key": "key"}'):
        record.write_text(content)
        assert run_folder.checkpoint_of(tmp_path, "key") is None
    with pytest.raises(gl.ParameterError, match=r"run\.json belongs to another run: specimen, law, test"):
        run_folder.checkpoint_of(tmp_path, "other")


def test_a_page_links_the_data_of_its_folder_and_of_the_runs_in_it(tmp_path):
    names = "b.json a.csv .hidden.csv picture.png report.html script.py no_run/cracks.csv run/curves.csv run/cracks.pvd"
    for name in names.split():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    given = ["a.csv", "b.json", "script.py", "run/curves.csv", "run/cracks.pvd"]
    assert linked(tmp_path) == given


def test_a_folder_is_begun_by_a_sample_that_is_not_the_last():
    begun, written = [], []
    made = object.__new__(run_folder.RunFolder)
    made._claim = SimpleNamespace(begins=lambda: begun.append(True))
    made._curves, made._cracks = SimpleNamespace(again=0.0), SimpleNamespace(again=0.0, rows=0, columns=("time",))
    made._try = lambda name, write: written.append(name)
    state = SimpleNamespace(broken_time=np.array([np.nan, np.nan]))
    made.sample({}, state, last=True)
    assert (begun, written) == ([], ["curves.csv"])
    made.sample({}, state)
    made.sample({}, state)
    assert begun == [True]
    state.broken_time[1] = 1.0
    made.sample({}, state)
    assert written[-2:] == ["curves.csv", "cracks.csv"]
    made._curves.again = made._cracks.again = 1e300
    made.sample({}, state)
    assert len(written) == 5
    made.sample({}, state, last=True)
    assert len(written) == 7


@pytest.mark.parametrize("option", ["restart", "overwrite"])
def test_what_is_asked_of_a_folder_needs_one(option):
    with pytest.raises(gl.ParameterError, match="restart and overwrite need a checkpoint"):
        gl.simulate(small_sample(2), CohesiveCrack(**STRONG, mode_i_energy=1, mode_ii_energy=1), UniaxialTension(),
                    **{option: True})  # fmt: skip


def test_a_table_that_could_not_be_written_is_tried_again_after_ten_seconds(tmp_path, monkeypatch):
    monkeypatch.setattr(run_folder.time, "monotonic", lambda: 1000.0)
    one, two = {"time": np.array([0.0])}, {"time": np.array([0.0, 1.5])}
    made = run_folder._Table(tmp_path / "none" / "curves.csv")
    with pytest.raises(OSError, match="curves"):
        made.grow(one)
    assert (made.again, made.rows) == (1010.0, 0)
    made.file = tmp_path / "curves.csv"
    made.grow(one)
    assert (made.again, made.rows) == (0.0, 1)
    monkeypatch.setattr(run_folder._Table, "_append", lambda self, text: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        made.grow(two)
    assert (made.again, made.rows) == (1010.0, 1)
    monkeypatch.undo()
    made.grow(two)
    assert (made.again, made.rows) == (0.0, 2)
    made.grow(two | {"stress": np.array([3.0, 4.0])})  # a column more: the whole file
    made.close()
    assert made.file.read_text().splitlines() == ["time,stress", "0.0,3.0", "1.5,4.0"]
