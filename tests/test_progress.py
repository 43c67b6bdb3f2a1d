"""The line that says how far a run is: on a terminal and in a notebook, not elsewhere, and nothing of it stays."""

import logging
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import BRITTLE, PULL, STIFF, small_sample

import grainlaw as gl
from grainlaw.laws import Linear
from grainlaw.runs import progress

SHORT = attrs.evolve(PULL, samples=20)


class Terminal:
    """Keeps what is written."""

    def __init__(self, is_terminal=True):
        self.is_terminal, self.texts = is_terminal, []

    def isatty(self):
        return self.is_terminal

    def write(self, text):
        self.texts.append(text)

    def flush(self):
        pass


@pytest.fixture
def terminal(monkeypatch):
    monkeypatch.setattr(progress, "OFTEN", 0.0)
    stream = Terminal()
    monkeypatch.setattr(progress, "sys", SimpleNamespace(stdout=Terminal(False), stderr=stream))
    return stream


def test_a_terminal_sees_how_far_a_run_is(terminal):
    gl.simulate(small_sample(12), BRITTLE, SHORT)
    seen = [text.strip() for text in terminal.texts if "tension" in text]
    assert len(seen) > 10
    assert seen[-1] == "MohrCoulomb tension 100%"
    assert any("about" in text and text.endswith("left") for text in seen)
    assert all(text.startswith("\r") and len(text) == progress.LONGEST + 1 for text in terminal.texts[:-1])
    assert terminal.texts[-2].strip() == ""  # the line is empty at the end
    assert terminal.texts[-1] == "\r"


def test_what_is_compiled_is_said_in_the_line(terminal):
    with progress.told(False):
        logging.getLogger("grainlaw").warning("compiling %s", "the time loop")
    assert terminal.texts[0].strip() == "compiling the time loop"
    assert not logging.getLogger("grainlaw").handlers


@pytest.mark.parametrize(("is_terminal", "quiet"), [(True, True), (False, False)])
def test_nothing_is_said_if_quiet_or_without_a_terminal(terminal, is_terminal, quiet):
    terminal.is_terminal = is_terminal
    gl.simulate(small_sample(12), BRITTLE, SHORT, quiet=quiet)
    gl.compare(small_sample(12), {"one": BRITTLE}, SHORT, threads=1, quiet=quiet)
    assert not terminal.texts


def test_a_notebook_sees_it_below_its_cell(terminal):
    cell = type("OutStream", (Terminal,), {"__module__": "ipykernel.iostream"})()
    progress.sys.stdout, terminal.is_terminal = cell, False
    gl.simulate(small_sample(12), BRITTLE, SHORT)
    assert any("tension" in text for text in cell.texts)
    assert not terminal.texts


def test_laws_share_one_line(terminal):
    gl.compare(small_sample(12), {"one": BRITTLE, "two": Linear(**STIFF)}, SHORT, threads=1)
    assert any("one tension" in text and "two tension" in text for text in terminal.texts)


def test_a_run_that_was_watched_goes_on_unwatched(terminal, tmp_path):
    stop = gl.Stop()

    class Asks(gl.Observer):
        def observe(self, state, curves, stage, progress):
            if progress > 0.5:
                stop.ask("it is late")

    with pytest.raises(gl.Stopped):
        gl.simulate(small_sample(12), BRITTLE, SHORT, checkpoint=tmp_path, observers=[Asks()], stop=stop)
    assert terminal.texts
    again = gl.simulate(
        small_sample(12), BRITTLE, SHORT, checkpoint=tmp_path, restart=True, observers=[Asks()], quiet=True
    )
    whole = gl.simulate(small_sample(12), BRITTLE, SHORT, quiet=True)
    assert np.array_equal(again.curves["stress"], whole.curves["stress"])
