"""Bars that say how far runs are: on a terminal and in a notebook, not elsewhere; what stays of them."""

import io
import logging
import sys
import time
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from study_cases import tiny_study
from support import BRITTLE, PULL, STIFF, small_sample

import grainlaw as gl
from grainlaw.laws import Linear
from grainlaw.runs import progress
from grainlaw.runs.progress import Progress
from grainlaw.studies.case import Task
from grainlaw.studies.workers import Watcher

SHORT = attrs.evolve(PULL, samples=20)


class Terminal(io.StringIO):
    """Keeps what is written."""

    is_terminal = True

    def isatty(self):
        return self.is_terminal


@pytest.fixture
def terminal(monkeypatch):
    monkeypatch.setattr(progress, "OFTEN", 0.0)
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.setenv("TERM", "xterm")
    stream = Terminal()
    monkeypatch.setattr(progress, "sys", SimpleNamespace(stdout=io.StringIO(), stderr=stream))
    return stream


def test_a_terminal_sees_how_far_a_run_is_and_nothing_of_it_stays(terminal):
    gl.simulate(small_sample(12), BRITTLE, SHORT)
    seen = [line for line in terminal.getvalue().splitlines() if "tension, " in line]
    assert len(seen) > 10
    assert "MohrCoulomb" in seen[-1]
    assert any(line.rstrip().endswith(" left") for line in seen)
    assert terminal.getvalue().rstrip().endswith("\x1b[2K")  # the line is empty at the end


def test_bars_of_a_command_stay(terminal):
    with Progress(stays=True) as bars:
        bars.bar("compression").tell(1.0, "axial, 0.1 %")
    assert "compression" in terminal.getvalue().splitlines()[-2]


def test_a_run_fits_a_terminal_of_80_columns(terminal, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    words = "compression, 0.5000 %, 250.0 MPa, 3.25 min left"
    with Progress(stays=True) as bars:
        bars.bar("cohesive-crack").tell(0.5, words)
    assert words in terminal.getvalue().splitlines()[-2]


def test_what_is_compiled_is_said_beside_the_bars(terminal):
    with Progress():
        logging.getLogger("grainlaw").warning("compiling %s", "the time loop")
    assert "compiling the time loop" in terminal.getvalue()
    assert not logging.getLogger("grainlaw").handlers


@pytest.mark.thorough
@pytest.mark.parametrize(("is_terminal", "told"), [(True, False), (False, True)])
def test_nothing_is_said_if_not_wanted_or_without_a_terminal(terminal, is_terminal, told):
    terminal.is_terminal = is_terminal
    gl.simulate(small_sample(12), BRITTLE, SHORT, progress=told)
    gl.compare(small_sample(12), {"one": BRITTLE}, SHORT, threads=1, progress=told)
    assert not terminal.getvalue()


def test_what_speaks_says_a_line_now_and_then_without_a_terminal(capsys, monkeypatch):
    with Progress(speaks=True) as bars:
        bar = bars.bar("compression")
        bar.tell(0.1, "axial")
        assert capsys.readouterr().err == ""
        later = time.monotonic() + 31.0
        monkeypatch.setattr(time, "monotonic", lambda: later)
        bar.tell(0.5, "axial, 0.1 %")
        bar.tell(0.6, "axial, 0.2 %")
    assert capsys.readouterr().err == "compression: 50%, axial, 0.1 %\n"


def test_a_notebook_sees_bars_below_its_cell(monkeypatch):
    stream = type("OutStream", (io.StringIO,), {"__module__": "ipykernel.iostream"})()
    monkeypatch.setattr(progress, "sys", SimpleNamespace(stdout=stream, stderr=sys.stderr))
    assert progress._console() is not None


def test_the_time_left_is_that_of_the_steps_that_usually_follow(monkeypatch):
    """From 100 steps at 50 s to 300 at 54 s: 20 ms a step, and (6 - 2) s / 0.01 s of them to come."""
    clock, said = iter([49.0, 50.0, 54.0, 55.0, 56.0]), []
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    told = progress.Bar(None, "run", None)
    monkeypatch.setattr(told, "tell", lambda share, words: said.append((share, words)))
    bar = progress.RunBar(told)
    stage, curves = SimpleNamespace(name="axial"), {"strain": np.array([0.0, 1e-3]), "stress": np.array([0.0, 5e6])}
    state = SimpleNamespace(usual_end=6.0, time=1.0, time_step=0.01, steps=100)
    bar.observe(state, curves, stage, 0.1)
    state.time, state.steps = 2.0, 300
    bar.observe(state, curves, stage, 0.4)
    state.time, state.steps = 7.0, 800  # it takes longer than usual
    bar.observe(state, curves, stage, 0.9)
    bar.observe(state, curves, stage, 1.0)
    where = "axial, 0.1000 %, 5.00 MPa"
    assert said == [(0.1, where), (0.4, f"{where}, 8 s left"), (0.9, where), (1.0, where)]


def test_a_checkpoint_keeps_nothing_of_bars():
    bar = progress.RunBar(progress.Bar(None, "run", None))
    assert progress.without_bars([bar, "watcher"]) == ["watcher"]


@pytest.mark.thorough
def test_laws_have_a_bar_each(terminal):
    gl.compare(small_sample(12), {"one": BRITTLE, "two": Linear(**STIFF)}, SHORT, threads=1)
    last = terminal.getvalue()
    assert "one" in last
    assert "two" in last


@pytest.mark.thorough
def test_a_study_says_how_many_cases_are_done_and_what_workers_do(terminal, tmp_path, monkeypatch):
    monkeypatch.setattr("grainlaw.studies.workers.OFTEN", 0.0)
    tiny_study().run(tmp_path / "s", workers=1)
    seen = terminal.getvalue()
    assert "4 of 4" in seen.splitlines()[-2]
    assert "brittle, seed = 0" in seen


def test_the_time_left_is_that_of_cases_of_their_kind(monkeypatch):
    """Two workers: 4 s of work are done in 2 s; left are one case of 1 s and two of 3 s."""
    now = iter([100.0, 102.0])
    monkeypatch.setattr("grainlaw.studies.workers.time", SimpleNamespace(monotonic=lambda: next(now)))
    tasks = [Task(f"{k}", {"law": law, "seed": k}) for k, law in enumerate(["slow", "fast", "slow", "fast", "slow"])]
    watcher = Watcher(tasks, None, None)
    for task, seconds in zip(tasks[:2], (3.0, 1.0), strict=True):
        watcher.done(task, {"status": "finished", "cost": {"seconds": seconds}})
    assert watcher.seconds_left() == pytest.approx((1 + 2 * 3) / 2)


def test_cases_of_a_kind_of_which_none_is_done_take_the_mean_of_all(monkeypatch):
    """One worker: 6 s of work are done in 6 s, by three cases; two others are left."""
    now = iter([100.0, 106.0])
    monkeypatch.setattr("grainlaw.studies.workers.time", SimpleNamespace(monotonic=lambda: next(now)))
    tasks = [Task(f"{k}", {"law": law, "seed": k}) for k, law in enumerate("AABCC")]
    watcher = Watcher(tasks, None, None)
    assert watcher.seconds_left() == 0
    for task, seconds in zip(tasks[:3], (1.0, 1.0, 4.0), strict=True):
        watcher.done(task, {"status": "finished", "cost": {"seconds": seconds}})
    assert watcher.seconds_left() == pytest.approx(2 * 2)


@pytest.mark.thorough
def test_a_run_that_was_watched_goes_on_unwatched(terminal, tmp_path):
    stop = gl.Stop()

    class Asks(gl.Observer):
        def observe(self, state, curves, stage, progress):
            if progress > 0.5:
                stop.ask("it is late")

    with pytest.raises(gl.Stopped):
        gl.simulate(small_sample(12), BRITTLE, SHORT, checkpoint=tmp_path, observers=[Asks()], stop=stop)
    assert terminal.getvalue()
    again = gl.simulate(
        small_sample(12), BRITTLE, SHORT, checkpoint=tmp_path, restart=True, observers=[Asks()], progress=False
    )
    whole = gl.simulate(small_sample(12), BRITTLE, SHORT, progress=False)
    assert np.array_equal(again.curves["stress"], whole.curves["stress"])
