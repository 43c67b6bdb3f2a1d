"""Compiled code kept on disk: found again from wherever a law comes, and never stale."""

import errno
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import attrs
import numba
import numpy as np
import pytest
from support import STIFF, small_sample, state_of

import grainlaw as gl
from grainlaw.compiler import batch, entry
from grainlaw.compiler.cache import _warn, keyed_njit, tell_compiling
from grainlaw.compiler.fingerprint import fingerprint
from grainlaw.compiler.numba_private import Table
from grainlaw.engine import step
from grainlaw.engine.step import _steps
from grainlaw.laws import Linear

LAW = """
import attrs, sys
import grainlaw as gl
{imports}
STIFFER = 1.0

@attrs.frozen(kw_only=True)
class Mine(gl.ContactLaw):
    kn: float = gl.parameter("Pa/m")
    stiffness = property(lambda self: (self.kn, self.kn))

    def first(self, x):
        return self.second(x) * 1.0

    def second(self, x):
        return self.kn * x

    def third(self, x):
        return x

    def fourth(self, x):
        return x

    def traction(self, opening, slip):
        slip = self.fourth(self.third(slip))
        return STIFFER * {helper}(self.first(opening)) + self.second(slip), slip

"""
PRINT = "print(gl.trace(Mine(kn=1.0), 1.0, 0.0, compiled=True).normal[0])\n"
NEAR = "from further import *\nimport far\n\ndef near(x):\n    return far.far(x)\n"
FAR = "def far(x):\n    return 2.0 * x\n"


def run(arguments, folder, cache, code=None, seed="0"):
    """What a fresh interpreter prints."""
    environment = os.environ | {
        "GRAINLAW_CACHE": str(cache), "PYTHONHASHSEED": seed, "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")]),
    }  # fmt: skip
    done = subprocess.run(
        [sys.executable, *map(str, arguments)], cwd=folder, env=environment, input=code, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


def kept(cache: Path):
    return {file: file.read_bytes() for file in cache.rglob("*") if file.is_file()}


@pytest.fixture
def cache(tmp_path):
    return tmp_path / "cache"


@pytest.mark.thorough
def test_script_stdin_and_string_hit_on_the_second_start(tmp_path, cache):
    """The same law from three places is the same code, whatever the order of Python's sets."""
    code = LAW.format(imports="", helper="float") + PRINT
    script = tmp_path / "script.py"
    script.write_text(code)
    assert run([script], tmp_path, cache, seed="1") == ["1.0"]
    files = kept(cache)
    assert len(files) == 1
    assert run([script], tmp_path, cache, seed="2") == ["1.0"]
    assert run(["-"], tmp_path, cache, code, seed="3") == ["1.0"]
    assert run(["-c", f"exec({code!r})"], tmp_path, cache) == ["1.0"]
    assert kept(cache) == files


@pytest.mark.thorough
def test_an_edit_anywhere_gives_the_new_result(tmp_path, cache):
    """Of the law, a constant of its module, a helper two modules away; undone, what was compiled is used again."""
    script, near, far = (tmp_path / f"{name}.py" for name in ("script", "near", "far"))
    law = LAW.format(imports="import near", helper="near.near") + PRINT
    (tmp_path / "further.py").write_text("")
    for file, text in ((script, law), (near, NEAR), (far, FAR)):
        file.write_text(text)
    assert run([script], tmp_path, cache) == ["2.0"]
    for number, (file, old, new, expected) in enumerate(
        [
            (script, "x) * 1.0", "x) * 5.0", "10.0"),
            (script, "STIFFER = 1.0", "STIFFER = 3.0", "6.0"),
            (far, "2.0", "7.0", "7.0"),
        ],
        2,
    ):
        text = file.read_text()
        file.write_text(text.replace(old, new))
        assert run([script], tmp_path, cache) == [expected]
        assert len(kept(cache)) == number
        file.write_text(text)
    assert run([script], tmp_path, cache) == ["2.0"]
    assert len(kept(cache)) == 4


@pytest.mark.thorough
def test_laws_compiled_apart_do_not_meet(tmp_path, cache):
    """Two laws of one name, compiled in two processes, loaded into a third."""
    one = LAW.format(imports="", helper="float")
    other = one.replace("self.kn * x", "self.kn * x * 8")
    assert run(["-"], tmp_path, cache, one + PRINT) == ["1.0"]
    assert run(["-"], tmp_path, cache, other + PRINT) == ["8.0"]
    files = kept(cache)
    assert run(["-"], tmp_path, cache, one + PRINT + other + PRINT) == ["1.0", "8.0"]
    assert kept(cache) == files


@attrs.frozen(kw_only=True)
class Plain(gl.ContactLaw):
    kn: float = gl.parameter("Pa/m")
    stiffness = property(lambda self: (self.kn, self.kn))

    def traction(self, opening, slip):
        return 3 * self.kn * opening, slip


@attrs.frozen(kw_only=True)
class Other(Plain):
    def traction(self, opening, slip):
        return 5 * self.kn * opening, slip


@pytest.fixture
def afresh(cache, monkeypatch):
    """As a new process finds the cache."""
    monkeypatch.setenv("GRAINLAW_CACHE", str(cache))
    monkeypatch.setattr(batch, "_done", {})
    return lambda: batch._done.clear() or batch.compile_law(Plain(kn=1)).respond(1.0, 0.0)[0]


DAMAGES = {
    "cut": lambda b: b[: len(b) // 2],
    "empty": lambda b: b"",
    "changed": lambda b: b[:3000] + bytes(255 - each for each in b[3000:3016]) + b[3016:],
    "another function's": lambda b: b.replace(b'"function": "', b'"function": "_'),
    "no header": lambda b: b"[1]" + b[b.index(b"\n") :],
}


@pytest.mark.thorough
@pytest.mark.parametrize("damage", DAMAGES.values(), ids=DAMAGES)
def test_a_damaged_file_is_repaired(cache, afresh, damage):
    assert afresh() == 3
    files = kept(cache)
    (file,) = files
    file.write_bytes(damage(files[file]))
    assert afresh() == 3
    assert list(kept(cache)) == [file]
    content = file.read_bytes()
    assert content != damage(files[file])
    assert len(content) > 0.9 * len(files[file])
    assert afresh() == 3
    assert file.read_bytes() == content


def test_what_is_found_on_disk_is_not_compiled(afresh, monkeypatch):
    afresh()
    monkeypatch.setattr(batch, "Compilation", None)
    assert afresh() == 3


def test_code_knows_in_which_order_a_table_has_its_names(cache, monkeypatch):
    """Types of compiled code say nothing of them: code for another order read one number for the other."""
    monkeypatch.setenv("GRAINLAW_CACHE", str(cache))
    pair, turned = (NamedTuple("Pair", [(name, int) for name in names]) for names in ("ab", "ba"))
    found = [entry.Kernel(_its_a)(Table(kind(a=1, b=2)), 0) for kind in (pair, turned, pair)]
    assert found == [1, 1, 1]


def _its_a(table, _):
    return table[0].a


def full(*_):
    raise OSError(errno.EROFS, "Read-only file system")


def test_a_folder_that_cannot_be_written_gives_one_warning(cache, afresh):
    cache.write_text("a file, not a folder")
    _warn.cache_clear()
    with pytest.warns(UserWarning, match="not kept in .*cache.*: set GRAINLAW_CACHE to a writable folder") as caught:
        assert [afresh(), afresh()] == [3, 3]
    assert len(caught) == 1


@pytest.mark.thorough
def test_a_folder_that_can_only_be_read_gives_one_warning_and_is_used(afresh, monkeypatch):
    afresh()
    for name in ("mkdir", "open", "replace", "utime"):
        monkeypatch.setattr(os, name, full)
    _warn.cache_clear()
    other = Other(kn=1)
    with pytest.warns(UserWarning, match=r"not kept in .*cache.* \(Read-only file system\): set") as caught:
        assert [batch.compile_law(law).respond(1.0, 0.0)[0] for law in (other, attrs.evolve(other, kn=2.0))] == [5, 10]
    assert len(caught) == 1
    monkeypatch.setattr(batch, "Compilation", None)
    assert afresh() == 3


@pytest.mark.thorough
def test_a_folder_of_another_user_is_not_used(cache, afresh, monkeypatch):
    _warn.cache_clear()
    assert afresh() == 3
    files = kept(cache)
    monkeypatch.setattr(os, "geteuid", lambda: cache.stat().st_uid + 1, raising=False)
    with pytest.warns(UserWarning, match="executed: .*cache belongs to another user") as caught:
        assert [afresh(), afresh()] == [3, 3]
    assert len(caught) == 1
    assert kept(cache) == files


def test_nothing_in_the_cache_is_a_pickle(cache, afresh):
    """A line of JSON, and object code."""
    afresh()
    (content,) = kept(cache).values()
    header, code = content.split(b"\n", 1)
    assert {"function", "environments", "name", "sha256"} <= set(json.loads(header))
    assert code[:4] in (b"\x7fELF", b"\xcf\xfa\xed\xfe") or sys.platform == "win32"


def test_a_wrong_limit_is_refused_before_anything_is_compiled(afresh, monkeypatch):
    monkeypatch.setenv("GRAINLAW_CACHE_LIMIT", "much")
    monkeypatch.setattr(batch, "Compilation", None)
    with pytest.raises(gl.ParameterError, match="GRAINLAW_CACHE_LIMIT = much is not allowed"):
        afresh()


@pytest.mark.thorough
def test_four_first_starts_at_once(tmp_path, cache):
    """Four processes compile and write the same, and find nothing amiss."""
    code = LAW.format(imports="", helper="float") + PRINT
    with ThreadPoolExecutor(4) as pool:
        found = list(pool.map(lambda _: run(["-W", "error", "-"], tmp_path, cache, code), range(4)))
    assert found == 4 * [["1.0"]]
    assert [file.suffix for file in kept(cache)] == [".code"]


@pytest.mark.thorough
def test_the_key_of_the_loop_does_not_depend_on_the_process(tmp_path, cache):
    code = "from grainlaw.engine.step import _steps\nfrom grainlaw.compiler.fingerprint import fingerprint\n"
    assert run(["-"], tmp_path, cache, code + "print(fingerprint(_steps))\n", seed="1") == [fingerprint(_steps)]


class Pair(NamedTuple):
    rows: np.ndarray
    factor: int


def doubled(pair, more):
    return int(pair[0].rows[1, 0]) * pair[0].factor + more


def test_what_is_compiled_is_told_and_what_is_kept_is_not(afresh, caplog):
    for first in (True, False):
        tell_compiling.cache_clear()
        caplog.clear()
        assert afresh() == 3
        pair = Table(Pair(np.array([[1.0], [5.0]]), 2))
        assert entry.Kernel(doubled, "a doubling")(pair, 1) == 11
        silent = entry.Kernel(doubled)  # without words nothing is said
        assert silent(pair, 2) == 12
        with pytest.raises(TypeError, match="doubled was compiled for tables of another form"):
            silent(Table(Pair(np.array([[1], [5]]), 2)), 1)  # integers in place of numbers
        told = [record.getMessage() for record in caplog.records if record.name == "grainlaw"]
        assert told == (["compiling Plain", "compiling a doubling"] if first else [])


def test_the_time_loop_is_told(monkeypatch):
    asked = []

    def stored(key, kinds, what):
        asked.append(what)
        raise StopIteration

    monkeypatch.setattr(entry, "stored", stored)
    monkeypatch.setattr(step._loop, "_code", None)
    schedule = np.zeros((1, 2))
    with pytest.raises(StopIteration):
        step.run(
            1, state_of(small_sample(2), Linear(**STIFF)).shared(1), step.Chunk(1, 0, 1.0, schedule, schedule, 0, 0)
        )
    assert asked[0].startswith("the time loop, once")


def test_numba_must_be_allowed_to_compile(monkeypatch):
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 1)
    with pytest.raises(gl.ParameterError, match=r"NUMBA_DISABLE_JIT = 1 is not allowed.*gl\.trace"):
        keyed_njit(fingerprint, "a key")
    assert gl.trace(Linear(kn=1e13, ks=1e13), 1e-9, 0.0).normal == pytest.approx([1e4])
