"""What is seen of runs, studies and calibrations in their folders: going on, ended, killed, half written."""

import csv
import json
import os
import platform
import re
import shutil
import signal
import subprocess
import sys
import time
from types import SimpleNamespace

import numpy as np
import pytest
from command_line import FILE, invoke, study_file
from study_cases import tiny_study
from support import BRITTLE, PULL, small_sample

import grainlaw as gl
from grainlaw.cli import watch
from grainlaw.runs import progress_file
from grainlaw.runs.progress_file import ProgressFile, lives, of_process, read, this_process
from grainlaw.studies.watch_words import as_characters, head, reason, rows, write_watch_page
from grainlaw.studies.watched import Part, Watched, watched
from grainlaw.studies.workers import Whole

CURVES = "strain,stress,tensile_cracks,shear_cracks\n0.0,0.0,0,0\n0.001,6e7,2,1\n"
RECORD = {
    "status": "running", "program": ["/usr/bin/grainlaw", "test", "creep", "--overwrite", "--out", "a b"],
    "command": {"name": "test", "arguments": {"name": "creep"}},
}  # fmt: skip


def dead():
    """The process of a program that has ended."""
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    return {"host": platform.node(), "pid": ended.pid, "began": time.time()}


def run_folder(path, curves=CURVES, told=None, **record):
    path.mkdir(parents=True, exist_ok=True)
    (path / "run.json").write_text(json.dumps({**RECORD, "process": this_process(), **record}))
    (path / "curves.csv").write_text(curves)
    if told is not None:
        (path / "progress.json").write_text(json.dumps(told))
    return path


# --- processes and their files ---------------------------------------------------------------------------------------


def test_a_process_lives_until_it_ends_and_another_of_its_number_is_not_it():
    mine = this_process()
    assert lives(mine) is True
    assert lives(dead()) is False
    assert lives({**mine, "began": mine["began"] - 3600}) is False
    assert lives({**mine, "host": "elsewhere"}) is None
    for broken in (None, {}, [], {**mine, "pid": "x"}, {"host": platform.node()}):
        assert lives(broken) is None


def test_a_file_of_progress_goes_with_its_work_and_says_how_other_work_ended(tmp_path):
    with ProgressFile(tmp_path / "p" / "one.json", {"about": 1}) as file:
        file.tell(share=np.nan, left=2.0)
        assert read(file.file) == {"about": 1, "share": None, "left": 2.0}
        assert not file.is_due
    assert not (tmp_path / "p").exists()
    file = ProgressFile(tmp_path / "one.json")
    file.tell(share=0.5)
    file.__exit__(ValueError, ValueError("it is late"), None)
    assert read(tmp_path / "one.json") == {"share": 0.5, "status": "it is late"}
    ProgressFile(tmp_path / "none" / "deeper" / "one.json").tell(share=1.0)  # where it cannot be written, nothing


def test_a_study_that_begins_removes_what_ended_processes_have_left(tmp_path, monkeypatch):
    folder = tmp_path / "progress"
    folder.mkdir()
    left = {"dead": {"process": dead()}, "stopped": {"status": "stopped", "process": this_process()}}
    kept = {"here": {"process": this_process()}, "elsewhere": {"process": {**this_process(), "host": "elsewhere"}}}
    for name, told in {**left, **kept}.items():
        (folder / f"{name}.json").write_text(json.dumps(told))
    (folder / "torn.json").write_text('{"process": ')
    of_process(tmp_path, {})
    assert {file.stem for file in folder.iterdir()} == set(kept)
    monkeypatch.setattr(progress_file, "SILENT", -1.0)
    of_process(tmp_path, {})
    assert not folder.exists()


# --- runs ------------------------------------------------------------------------------------------------------------


def test_a_run_that_goes_on_has_share_time_left_readings_and_curve(tmp_path):
    told = {"share": 0.25, "where": "axial, 0.1 %", "seconds": 10.0, "left": 30.0}
    seen = watched(run_folder(tmp_path / "a", told=told))
    assert (seen.kind, seen.state, seen.share, seen.left, seen.total) == ("test", "running", 0.25, 30.0, 1)
    (part,) = seen.parts
    assert part == Part(
        "creep", "running", 0.25, "axial, 0.1 %", 30.0, 3, "", ("strain", "stress"), ((0.0, 0.0), (0.001, 6e7))
    )
    assert head(seen) == "test running, 25 %, about 30 s left"
    assert list(rows(seen)) == [["creep", "running", "25 %", "axial, 0.1 %", "30 s", "3"]]
    assert (reason(seen), seen.is_over) == ("", False)


def test_a_run_whose_process_has_died_is_stopped_and_says_how_to_go_on(tmp_path):
    process = dead()
    seen = watched(run_folder(tmp_path / "a", process=process))
    assert (seen.state, seen.is_over, seen.left) == ("stopped", True, 0.0)
    again = "grainlaw test creep --out 'a b' --restart"
    assert reason(seen) == f"its process {process['pid']} has died. Go on with: {again}"
    assert seen.parts[0].where == "0.1000 %, 60.00 MPa"  # by its curve
    assert invoke("watch", tmp_path / "a").exit_code == 1
    (run_folder(tmp_path / "c", process=process, status="finished") / "checkpoint.npz").touch()  # its last files lack
    assert watched(tmp_path / "c").state == "stopped"
    (tmp_path / "c" / "checkpoint.npz").unlink()
    assert watched(tmp_path / "c").state == "finished"
    script = watched(run_folder(tmp_path / "b", process=process, program=["/home/me/granite.py", "3"]))
    assert script.again == "run granite.py again with restart=True"


@pytest.mark.parametrize(
    ("record", "state", "why"),
    [
        ({"status": "finished"}, "finished", ""),
        ({"status": "stopped by the signal SIGTERM", "stopped": True}, "stopped", "stopped by the signal SIGTERM"),
        ({"status": "it became unstable", "stopped": False}, "failed", "it became unstable"),
    ],
)
def test_how_a_run_ended_is_what_its_record_says(record, state, why, tmp_path):
    seen = watched(run_folder(tmp_path, **record))
    assert (seen.state, seen.reason, seen.is_over) == (state, why, True)
    assert bool(seen.again) == (state == "stopped")


def test_a_run_on_another_computer_goes_on_as_long_as_it_writes(tmp_path):
    folder = run_folder(tmp_path, process={**this_process(), "host": "node7"})
    assert watched(folder).state == "running"
    old = time.time() - 600
    for file in folder.iterdir():
        os.utime(file, (old, old))
    seen = watched(folder)
    assert (seen.state, seen.is_over) == ("unknown", False)
    assert seen.reason.startswith("nothing was written for 10 min; whether it goes on cannot be seen here")
    assert "'node7'" in seen.reason


def test_what_is_half_written_is_no_error(tmp_path):
    for torn in ("0.002,1.2", "0.002,1.2e7,3,1"):  # perhaps of 1.2e71, or 11
        folder = run_folder(tmp_path, CURVES + torn, {"share": "?", "left": None})
        assert watched(folder).parts[0].rows == ((0.0, 0.0), (0.001, 6e7))
    for text in ("", "strain,stress", "strain,stress\n", "strain,stress\n0.1\nx,y\n", "\x00\n\n", "a,b\n1,2\n"):
        (folder / "curves.csv").write_text(text)
        (folder / "progress.json").write_text('{"share": 0.')
        assert watched(folder).parts[0].share == 0.0
        assert invoke("watch", folder, "--once").exit_code == 0
    for text in ("", '{"status": "run', "[]", "3"):
        (folder / "run.json").write_text(text)
        assert watched(folder).state == "unknown"
        assert invoke("watch", folder, "--once").exit_code == 0


def test_a_comparison_takes_as_long_as_the_runs_that_wait(tmp_path):
    """Two go on, 10 and 30 s old, for 20 and 10 s more; one has taken 50 s; so one waits for 40 s: 70 s for two."""
    run_folder(tmp_path, runs=["one", "two", "done", "waits"])
    run_folder(tmp_path / "one", told={"share": 0.4, "seconds": 10.0, "left": 20.0})
    run_folder(tmp_path / "two", told={"share": 0.8, "seconds": 30.0, "left": 10.0})
    run_folder(tmp_path / "done", status="finished", duration=50.0)
    (tmp_path / "waits").mkdir()
    seen = watched(tmp_path)
    assert [part.state for part in seen.parts] == ["running", "running", "finished", "waiting"]
    assert (seen.kind, seen.done, seen.total) == ("comparison", 1, 4)
    assert seen.share == pytest.approx((0.4 + 0.8 + 1) / 4)
    mean = (10 + 20 + 30 + 10 + 50) / 3
    assert seen.left == pytest.approx((20 + 10 + mean) / 2)


def test_a_folder_without_a_run_says_what_was_looked_for(tmp_path):
    looked = "looked for run.json (a test or a comparison), study.json (a study) and tests/study.json (a calibration)"
    for place, what in ((tmp_path, "holds no run that has begun"), (tmp_path / "none", "is no folder")):
        done = invoke("watch", place)
        assert done.exit_code == 2
        assert f"'{place}' {what}: {looked}" in done.output


@pytest.mark.thorough
def test_a_run_says_how_far_it_is_and_leaves_nothing_of_it(tmp_path):
    shares = []

    class Looks(gl.Observer):
        def observe(self, state, curves, stage, progress):
            shares.append((watched(tmp_path / "a"), progress, len(curves["strain"])))

    monkey = pytest.MonkeyPatch()
    monkey.setattr(progress_file, "OFTEN", 0.0)
    with monkey.context():
        gl.simulate(small_sample(12), BRITTLE, PULL, checkpoint=tmp_path / "a", observers=[Looks()], progress=False)
    monkey.undo()
    for (seen, _, count), (_, before, _) in zip(shares[1:], shares, strict=False):
        assert seen.state == "running"
        assert seen.share == pytest.approx(before)  # observers are told one after the other
        assert len(seen.parts[0].rows) == count
    assert watched(tmp_path / "a").state == "finished"
    assert not (tmp_path / "a" / "progress.json").exists()


# --- studies ---------------------------------------------------------------------------------------------------------


def study_folder(path, **told):
    (path / "progress").mkdir(parents=True)
    (path / "study.json").write_text("{}")
    content = {"process": this_process(), "program": ["grainlaw", "study", "granite.toml"], **told}
    (path / "progress" / "a.json").write_text(json.dumps(content))
    return path


DOING = {"name": "seed = 3", "share": 0.5, "where": "axial, 0.1 %", "left": 4.0, "cracks": 7,
         "columns": ["strain", "stress"], "rows": [[0.0, 0.0], [0.001, 5e7]]}  # fmt: skip
TOLD = {
    "done": 2, "total": 8, "failed": 1, "left": 90.0, "doing": [DOING, {"name": "seed = 4"}],
    "last": [{"name": "seed = 1", "state": "finished"}, {"name": "seed = 2", "state": "stage", "reason": "too slow"}],
}  # fmt: skip


def test_a_study_that_goes_on_has_its_cases_and_the_time_left(tmp_path):
    seen = watched(study_folder(tmp_path / "s", **TOLD))
    assert (seen.kind, seen.state, seen.done, seen.total, seen.left) == ("study", "running", 2, 8, 90.0)
    assert [part.state for part in seen.parts] == ["running", "running", "finished", "failed"]
    assert seen.parts[0].rows == ((0.0, 0.0), (0.001, 5e7))
    assert [row[3] for row in rows(seen)] == ["axial, 0.1 %", "starting", "", "stage: too slow"]
    assert head(seen) == "study running, 2 of 8 cases, 25 %, about 90 s left"


def test_a_study_that_was_killed_says_how_to_go_on_and_one_without_a_process_is_finished(tmp_path):
    killed = watched(study_folder(tmp_path / "s", **TOLD | {"process": dead()}))
    assert (killed.state, killed.again, killed.left) == ("stopped", "grainlaw study granite.toml", 0.0)
    asked = watched(study_folder(tmp_path / "t", **TOLD | {"status": "stopped by the signal SIGTERM"}))
    assert (asked.state, asked.reason) == ("stopped", "stopped by the signal SIGTERM")
    (tmp_path / "t" / "progress" / "a.json").unlink()
    assert watched(tmp_path / "t").state == "finished"


def test_jobs_that_share_a_study_are_added_up(tmp_path):
    folder = study_folder(tmp_path / "s", **TOLD)
    other = {"process": dead(), **TOLD, "done": 3, "left": 500.0}
    (folder / "progress" / "b.json").write_text(json.dumps(other))
    (folder / "progress" / "c.json").write_text('{"done": 7')  # half written
    seen = watched(folder)
    assert (seen.state, seen.done, seen.total, len(seen.parts)) == ("running", 5, 16, 8)


def test_processes_that_do_the_same_cases_are_not_added_up(tmp_path):
    folder = study_folder(tmp_path / "s", **TOLD, shard=[0, 1])
    for name, shard in (("b", [0, 1]), ("c", [1, 2])):
        other = {"process": this_process(), **TOLD, "done": 3, "left": 60.0, "shard": shard}
        (folder / "progress" / f"{name}.json").write_text(json.dumps(other))
    seen = watched(folder)
    assert (seen.state, seen.done, seen.total, seen.left) == ("running", 6, 16, 60.0)


def test_a_study_that_another_process_has_finished_is_not_stopped(tmp_path):
    """One of two processes that do the same cases was killed; one that does others was, too, and is still told of."""
    tiny_study().run(tmp_path / "s", workers=1, progress=False)
    for shard in ([0, 1], [1, 2]):
        folder = study_folder(tmp_path / "_", **TOLD | {"process": dead()}, shard=shard)
        (folder / "progress").rename(tmp_path / "s" / "progress")
        shutil.rmtree(folder)
        assert watched(tmp_path / "s").state == "stopped"
        tiny_study().run(tmp_path / "s", workers=1, progress=False)
        assert watched(tmp_path / "s").state == ("finished" if shard == [0, 1] else "stopped")


def test_names_are_cut_to_the_width_of_the_terminal(tmp_path):
    lines = [["", "state"], ["a" * 90, "running"], ["short", "waiting"]]
    assert [len(line) for line in watch._table(lines, 60)] == [60, 60, 60]
    assert watch._table(lines, 60)[1] == f"{'a' * 48}...  running"
    assert watch._table(lines, 120)[1] == f"{'a' * 90}  running"
    assert watch._table(lines, 20)[1] == f"{'a' * 27}...  running"  # more is not cut


def test_a_calibration_tells_what_it_has_found(tmp_path):
    (tmp_path / "tests").mkdir()
    whole = Whole("calibration", 12, of_process(tmp_path / "tests", {}), None)
    for words in ("pilot", "wave 1", "the best set", "fresh specimens"):
        whole.say(words)
    assert watched(tmp_path).said == ("wave 1", "the best set", "fresh specimens")
    assert "wave 1\nthe best set\nfresh specimens" in invoke("watch", tmp_path, "--once", "--page").output
    assert "<p>the best set</p>" in (tmp_path / "watch.html").read_text()


def test_a_calibration_is_seen_as_a_whole(tmp_path):
    whole = {"name": "calibration", "done": 30, "total": 600, "left": 7200.0}
    study_folder(tmp_path / "granite" / "tests", **TOLD | {"whole": whole})
    seen = watched(tmp_path / "granite")
    assert (seen.kind, seen.share, seen.left) == ("calibration", 0.05, 7200.0)
    assert head(seen) == "calibration running, 30 of at most 600 tests, 5 %, at most about 2 h left"
    (tmp_path / "granite" / "tests" / "progress" / "a.json").unlink()
    assert watched(tmp_path / "granite").state == "stopped"
    (tmp_path / "granite" / "calibration.json").write_text("{}")
    assert watched(tmp_path / "granite").state == "finished"


@pytest.mark.thorough
def test_a_study_says_how_far_it_is_and_leaves_nothing_of_it(tmp_path, monkeypatch):
    """What it told is kept at each time; its store then has nothing beside its cases."""
    told, tell = [], ProgressFile.tell

    def kept(file, **content):
        tell(file, **content)
        told.append(watched(tmp_path / "s"))

    monkeypatch.setattr(ProgressFile, "tell", kept)
    monkeypatch.setattr(progress_file, "OFTEN", 0.0)
    tiny_study().run(tmp_path / "s", workers=1, progress=False)
    assert {seen.state for seen in told} == {"running"}
    assert [seen.done for seen in told if seen.done] == sorted(seen.done for seen in told if seen.done)
    assert told[-1].done == told[-1].total == 4
    assert sum(part.state == "finished" for part in told[-1].parts) == 4
    seen = watched(tmp_path / "s")
    assert (seen.state, seen.done) == ("finished", 4)
    assert not (tmp_path / "s" / "progress").exists()


# --- what is shown ---------------------------------------------------------------------------------------------------


def with_curves(count=2):
    line = tuple((0.001 * k, 1e7 * k) for k in range(11))
    parts = tuple(Part(f"law {k}", "running", 0.5, columns=("strain", "stress"), rows=line) for k in range(count))
    return Watched("out", "comparison", "running", 0.5, parts=(*parts, Part("late", "waiting")), total=count + 1)


def test_curves_are_drawn_with_characters_in_the_units_of_the_laboratory():
    drawn = as_characters(with_curves(), 40, 8, colored=False)
    assert "(stress, MPa) ^" in drawn
    assert "(strain, %)" in drawn
    lines = [line for line in drawn.splitlines() if re.search("[\u2801-\u28ff]", line)]
    assert len(lines) == 8  # a line from the one corner to the other
    numbers = [float(number) for number in re.findall(r"^ *([\d.]+) \|", drawn, re.M)]
    assert (max(numbers), min(numbers)) == (100.0, 0.0)
    assert as_characters(with_curves(0), 40, 8, colored=False) == ""


def test_a_page_is_loaded_anew_as_long_as_it_goes_on(tmp_path):
    write_watch_page(with_curves(), tmp_path / "watch.html", goes_on=True)
    page = (tmp_path / "watch.html").read_text()
    assert '<meta http-equiv="refresh" content="3">' in page
    assert re.search(r"As of 20\d\d-\d\d-\d\d \d\d:\d\d:\d\d; renewed every 3 s as long as", page)
    assert "0 of 3 runs, 50 %" in page
    assert page.count("data:image/png;base64,") == 1
    write_watch_page(with_curves(0), tmp_path / "watch.html", goes_on=False)
    assert "refresh" not in (tmp_path / "watch.html").read_text()


def test_a_run_that_is_replaced_has_no_files_for_a_moment(tmp_path, monkeypatch):
    """It is looked at again; where its folder is gone, the command says so."""
    folder, looks = run_folder(tmp_path / "a"), []

    def sleep(_):
        looks.append(0)
        if len(looks) == 1:
            (folder / "run.json").rename(folder / "aside")
        if len(looks) == 2:
            (folder / "aside").rename(folder / "run.json")
            (folder / "run.json").write_text(json.dumps({"status": "finished"}))

    monkeypatch.setattr("grainlaw.cli.watch.time.sleep", sleep)
    done = invoke("watch", folder, "--page")
    assert (done.exit_code, len(looks)) == (0, 2)
    assert "test finished" in done.output
    assert "refresh" not in (folder / "watch.html").read_text()


def test_into_a_pipe_it_tells_a_line_every_half_minute(tmp_path, monkeypatch):
    folder, clock = run_folder(tmp_path / "a"), [0.0]

    def sleep(_):
        clock[0] += 20.0
        if clock[0] == 80.0:
            (folder / "run.json").write_text(json.dumps({"status": "finished"}))

    monkeypatch.setattr("grainlaw.cli.watch.time", SimpleNamespace(sleep=sleep, monotonic=lambda: clock[0]))
    done = invoke("watch", folder)
    lines = [line for line in done.output.splitlines() if line.startswith("test ")]
    assert [line.split(",")[0] for line in lines] == ["test running", "test running", "test finished"]  # 0 s, 40 s


# --- whole commands --------------------------------------------------------------------------------------------------

SLOW = ["--quick", "--grains", "40", "--set", "test.samples=2000"]


def start(*arguments):
    command = [sys.executable, "-m", "grainlaw", *map(str, arguments)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def wait_for(condition, *processes, seconds=300):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        assert all(process.poll() is None for process in processes)
        time.sleep(0.1)


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of Unix")
def test_a_run_is_watched_from_another_terminal_and_killed(tmp_path):
    """The watcher ends with the run it watches; a look takes no lock and changes no file of the run."""
    folder = tmp_path / "out"
    running = start("test", "uniaxial-compression", *SLOW, "--out", folder)
    try:
        wait_for(lambda: (folder / "progress.json").exists() and watched(folder).share > 0, running)
        once = json.loads(invoke("watch", folder, "--once", "--json").stdout)
        assert (once["state"], once["kind"]) == ("running", "test")
        watching = start("watch", folder, "--page")
        wait_for(lambda: (folder / "watch.html").exists(), running, watching)
        assert 'http-equiv="refresh"' in (folder / "watch.html").read_text()
    finally:
        running.kill()
        running.communicate()
    output, _ = watching.communicate(timeout=120)
    assert watching.returncode == 1
    assert f"its process {running.pid} has died. Go on with: " in output
    assert "--restart" in output
    assert 'http-equiv="refresh"' not in (folder / "watch.html").read_text()
    with (folder / "curves.csv").open() as file:
        assert len(list(csv.reader(file))) > 1


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform == "win32", reason="signals are those of Unix")
def test_ctrl_c_ends_the_look_and_not_what_is_looked_at(tmp_path):
    folder = run_folder(tmp_path / "a", told={"share": 0.5, "left": 60.0, "where": "axial", "seconds": 1.0})
    watching = subprocess.Popen(
        [sys.executable, "-m", "grainlaw", "watch", str(folder), "--page"], stdout=subprocess.PIPE, text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    wait_for(lambda: (folder / "watch.html").exists(), watching)
    time.sleep(1.0)
    watching.send_signal(signal.SIGINT)
    output, _ = watching.communicate(timeout=60)
    assert watching.returncode == 0
    assert "test running, 50 %, about 60 s left" in output


@pytest.mark.thorough
def test_a_study_of_a_command_is_watched(tmp_path):
    file = study_file(tmp_path, '"sample.seed" = "1..3"\n', FILE.replace("samples = 10", "samples = 2000"))
    folder = tmp_path / "granite"
    running = start("study", file, "--workers", "1")
    try:
        wait_for(lambda: folder.exists() and (folder / "study.json").exists() and watched(folder).parts, running)
        wait_for(lambda: watched(folder).left > 0, running)
        seen = watched(folder)
        assert (seen.kind, seen.state, seen.total) == ("study", "running", 3)
        assert seen.done < 3
        assert seen.parts[0].rows
    finally:
        running.kill()
        running.communicate()
    assert watched(folder).again == f"grainlaw study {file} --workers 1"
