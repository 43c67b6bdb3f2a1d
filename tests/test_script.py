"""Laws found in files: each with its own helpers, as they are on disk at that moment."""

import sys

import attrs
import pytest

import grainlaw as gl
from grainlaw.cli.law_file import find_with_files
from grainlaw.compiler.batch import compile_law

LAW = """
import attrs
import grainlaw as gl
import {helper}

@attrs.frozen(kw_only=True)
class Law(gl.ContactLaw):
    k: float = gl.parameter("Pa/m", default=1.0)
    stiffness = property(lambda self: (self.k, self.k))

    def traction(self, opening, slip):
        return {helper}.gain(opening), self.k * slip
"""


def write(folder, gain, helper="helpers"):
    """A law whose normal traction is ``gain`` times the opening, by a helper in another file."""
    folder.mkdir(exist_ok=True)
    (folder / "mine.py").write_text(LAW.format(helper=helper))
    (folder / f"{helper}.py").write_text(f"def gain(x):\n    return {gain} * x\n")
    return f"{folder / 'mine.py'}:Law"


def gains(law):
    """Interpreted and compiled."""
    return law.traction(1.0, 0.0)[0], compile_law(law).respond(1.0, 0.0)[0]


def test_helpers_of_one_name_in_two_folders_are_two(tmp_path):
    one, other = (
        find_with_files(write(tmp_path / "a", 2.0), gl.ContactLaw)[0],
        find_with_files(write(tmp_path / "b", 3.0), gl.ContactLaw)[0],
    )
    assert gains(one) == (2.0, 2.0)
    assert gains(other) == (3.0, 3.0)
    assert gains(one) == (2.0, 2.0)


def test_an_edited_helper_is_read_again(tmp_path, monkeypatch):
    """Of the same size and within the same second, so that its date does not tell."""
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    for gain in (2.0, 3.0, 4.0, 2.0):
        assert gains(find_with_files(write(tmp_path, gain), gl.ContactLaw)[0]) == (gain, gain)
    assert not list(tmp_path.rglob("*.pyc"))


def test_an_edited_file_is_read_again(tmp_path):
    reference = write(tmp_path, 1.0)
    file = tmp_path / "mine.py"
    for gain in ("2.0", "3.0", "2.0"):
        file.write_text(LAW.format(helper="helpers").replace("helpers.gain(opening)", f"{gain} * opening"))
        assert gains(find_with_files(reference, gl.ContactLaw)[0]) == (float(gain), float(gain))


def test_a_helper_named_like_a_loaded_module_of_a_user_is_the_one_beside_the_law(tmp_path, monkeypatch):
    write(tmp_path / "elsewhere", 7.0)
    monkeypatch.syspath_prepend(tmp_path / "elsewhere")
    helpers = __import__("helpers")
    try:
        assert gains(find_with_files(write(tmp_path / "here", 2.0), gl.ContactLaw)[0]) == (2.0, 2.0)
        assert sys.modules["helpers"] is helpers
        assert helpers.gain(1.0) == 7.0
    finally:
        del sys.modules["helpers"]


def test_a_law_leaves_no_module_behind(tmp_path):
    before, path = dict(sys.modules), list(sys.path)
    find_with_files(write(tmp_path, 2.0, helper="statistics_of_mine"), gl.ContactLaw)[0]
    assert sys.modules == before
    assert sys.path == path
    (tmp_path / "mine.py").write_text("import helper_that_fails\n")
    (tmp_path / "helper_that_fails.py").write_text("import statistics_of_mine\n1 / 0\n")
    with pytest.raises(gl.ParameterError, match=r"mine\.py:1 does not run: ZeroDivisionError"):
        find_with_files(f"{tmp_path / 'mine.py'}:Law", gl.ContactLaw)[0]
    assert sys.modules == before


def test_classes_of_the_framework_stay_the_same_beside_a_folder_of_that_name(tmp_path):
    for name in ("grainlaw", "numpy", "attrs"):
        (tmp_path / name).mkdir()
    law = find_with_files(write(tmp_path, 2.0), gl.ContactLaw)[0]
    assert isinstance(law, gl.ContactLaw)
    assert law.traction.__globals__["attrs"] is attrs
    assert gains(law) == (2.0, 2.0)


# --- memory -----------------------------------------------------------------------------------------------------------

MEMORY = {
    "slip, damage=2.0": r"damage=2\.0 is not allowed.* begins at 0: leave the default away",
    "slip, *memory": r"\*memory is not allowed.* by position: write each number",
    "slip, *, damage": "damage is not allowed.* by position: write each number",
    "slip, **memory": r"\*\*memory is not allowed.* by position: write each number",
    "*rest": r"must take opening and slip before its memory, not \(opening, \*rest\)",
}


@pytest.mark.parametrize("arguments", MEMORY)
def test_memory_that_cannot_begin_at_zero_under_a_name_is_refused(tmp_path, arguments):
    write(tmp_path, 1.0)
    text = LAW.format(helper="helpers").replace("opening, slip):", f"opening, {arguments}):")
    (tmp_path / "mine.py").write_text(text)
    law = find_with_files(f"{tmp_path / 'mine.py'}:Law", gl.ContactLaw)[0]
    for ask in (compile_law, gl.check_law, lambda law: gl.trace(law, 0, 0)):
        with pytest.raises(gl.ParameterError, match=r"^Law\.traction:? " + MEMORY[arguments]):
            ask(law)
