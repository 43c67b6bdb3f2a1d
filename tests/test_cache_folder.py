"""The folder of compiled code: whose it must be, how much it may hold, and what the command says of it."""

import os
import stat
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from command_line import invoke

import grainlaw as gl
from grainlaw.compiler.cache_folder import Folder, NotPrivateError, cache_folder, limit

posix = pytest.mark.skipif(not hasattr(os, "geteuid"), reason="Windows has no owners and modes of this kind")
NAMES = [f"{k:040x}" for k in range(6)]
HEADER, CODE = {"function": "f"}, bytes(range(256)) * 400  # 0.1 MB


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("GRAINLAW_CACHE", str(tmp_path / "parent" / "cache"))
    monkeypatch.delenv("GRAINLAW_CACHE_LIMIT", raising=False)
    return Folder(cache_folder())


def fill(folder):
    """Write all files, each an hour younger than the one before it."""
    for k, name in enumerate(NAMES):
        folder.write(name, HEADER, CODE)
        moment = time.time() - 3600 * (len(NAMES) - k)
        os.utime(folder.path / f"{name}.code", (moment, moment))


def names(folder):
    return [path.stem for path, _ in folder.files()]


def test_what_is_written_is_read(folder):
    assert folder.read(NAMES[0]) is None
    folder.write(NAMES[0], HEADER, CODE)
    assert folder.read(NAMES[0]) == (HEADER, CODE)
    assert folder.read(NAMES[1]) is None


@posix
def test_folder_and_files_are_the_users_alone(folder):
    folder.write(NAMES[0], HEADER, CODE)
    modes = [stat.S_IMODE(path.stat().st_mode) for path in (folder.path, *folder.path.iterdir())]
    assert modes == [0o700, 0o600]


@posix
@pytest.mark.parametrize("mode", [0o770, 0o707, 0o720])
@pytest.mark.parametrize("which", ["folder", "file"])
def test_what_others_may_write_is_refused_by_name(folder, which, mode):
    folder.write(NAMES[0], HEADER, CODE)
    path = folder.path if which == "folder" else folder.path / f"{NAMES[0]}.code"
    path.chmod(mode)
    with pytest.raises(NotPrivateError, match=f"others may write to .*{path.name} .mode {mode:o}: chmod go-w"):
        folder.read(NAMES[0])
    if which == "folder":
        with pytest.raises(NotPrivateError, match="others may write"):
            folder.write(NAMES[1], HEADER, CODE)
        assert names(folder) == NAMES[:1]
    else:
        folder.write(NAMES[0], HEADER, CODE)  # one's own in its place
        assert folder.read(NAMES[0]) == (HEADER, CODE)


@posix
@pytest.mark.parametrize("mode", [0o755, 0o700, 0o500])
def test_what_others_may_only_read_is_used(folder, mode):
    folder.write(NAMES[0], HEADER, CODE)
    folder.path.chmod(mode)
    assert folder.read(NAMES[0]) == (HEADER, CODE)
    folder.path.chmod(0o700)


@posix
def test_another_owner_is_refused(folder, monkeypatch):
    folder.write(NAMES[0], HEADER, CODE)
    monkeypatch.setattr(os, "geteuid", lambda: folder.path.stat().st_uid + 1)
    with pytest.raises(NotPrivateError, match="cache belongs to another user"):
        folder.read(NAMES[0])


@posix
def test_a_file_of_another_owner_is_refused_in_ones_own_folder(folder, monkeypatch):
    folder.write(NAMES[0], HEADER, CODE)
    whole = os.fstat

    def foreign(handle):
        return os.stat_result(n + 1 if k == 4 else n for k, n in enumerate(whole(handle)))

    monkeypatch.setattr(os, "fstat", foreign)
    with pytest.raises(NotPrivateError, match=f"{NAMES[0]}.code belongs to another user"):
        folder.read(NAMES[0])


def test_a_file_under_another_name_is_not_taken_for_that_function(folder):
    folder.write(NAMES[0], HEADER, CODE)
    os.rename(folder.path / f"{NAMES[0]}.code", folder.path / f"{NAMES[1]}.code")
    assert folder.read(NAMES[1]) is None


def test_above_the_limit_those_not_used_for_longest_go(folder, monkeypatch):
    fill(folder)
    assert folder.read(NAMES[0]) == (HEADER, CODE)  # now the one used last
    assert names(folder) == [*NAMES[1:], NAMES[0]]
    size = (folder.path / f"{NAMES[0]}.code").stat().st_size
    monkeypatch.setenv("GRAINLAW_CACHE_LIMIT", str(4 * size / 1e6))
    folder.write(NAMES[2], HEADER, CODE)
    assert names(folder) == [NAMES[4], NAMES[5], NAMES[0], NAMES[2]]


def test_what_was_just_written_stays_whatever_the_limit(folder, monkeypatch):
    fill(folder)
    monkeypatch.setenv("GRAINLAW_CACHE_LIMIT", "0")
    (folder.path / "notes.txt").write_text("not ours")
    folder.write(NAMES[2], HEADER, CODE)
    assert names(folder) == [NAMES[2]]
    assert (folder.path / "notes.txt").exists()


def test_what_a_killed_process_has_left_is_removed_in_time(folder):
    folder.write(NAMES[0], HEADER, CODE)
    abandoned, recent = (folder.path / f"{NAMES[1]}.{32 * digit}" for digit in "ab")
    for file, age in ((abandoned, 7200), (recent, 60)):
        file.write_bytes(b"half")
        os.utime(file, 2 * (time.time() - age,))
    folder.write(NAMES[2], HEADER, CODE)
    assert not abandoned.exists()
    assert recent.exists()


def test_many_at_once_read_write_and_remove(folder, monkeypatch):
    """What is read is whole or missing, and in the end the folder keeps to its limit."""
    monkeypatch.setenv("GRAINLAW_CACHE_LIMIT", "0.35")

    def work(k):
        for turn in range(40):
            folder.write(NAMES[(k + turn) % 6], HEADER, CODE)
            assert folder.read(NAMES[(k + 2 * turn) % 6]) in (None, (HEADER, CODE))

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(work, range(8)))
    folder.write(NAMES[0], HEADER, CODE)
    assert sum(status.st_size for _, status in folder.files()) <= 0.35e6
    assert len(list(folder.path.iterdir())) == 3


def test_a_file_is_replaced_in_one_step(folder):
    """Whoever reads while others write the same finds it whole, never missing."""
    folder.write(NAMES[0], HEADER, CODE)

    def work(k):
        for _ in range(100):
            if k < 4:
                folder.write(NAMES[0], HEADER, CODE)
            else:
                assert folder.read(NAMES[0]) == (HEADER, CODE)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(work, range(8)))


def test_the_folder_is_where_the_system_keeps_such_files(monkeypatch, tmp_path):
    for name in ("GRAINLAW_CACHE", "XDG_CACHE_HOME", "LOCALAPPDATA"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(Path, "home", lambda: tmp_path)
    monkeypatch.setattr(sys, "platform", "linux")
    assert cache_folder() == tmp_path / ".cache" / "grainlaw"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "x"))
    assert cache_folder() == tmp_path / "x" / "grainlaw"
    monkeypatch.setattr(sys, "platform", "win32")
    assert cache_folder() == tmp_path / "grainlaw"
    monkeypatch.setenv("LOCALAPPDATA", str(tmp_path / "local"))
    assert cache_folder() == tmp_path / "local" / "grainlaw"
    monkeypatch.setenv("GRAINLAW_CACHE", str(tmp_path / "given"))
    assert cache_folder() == tmp_path / "given"


def test_the_limit_is_500_megabytes_if_nothing_is_said(folder, monkeypatch):
    assert limit() == 500_000_000
    monkeypatch.setenv("GRAINLAW_CACHE_LIMIT", "1.5")
    assert limit() == 1_500_000


@pytest.mark.parametrize("text", ["-1", "much", "nan", "inf", "500 MB"])
def test_a_limit_that_is_no_number_is_refused(folder, monkeypatch, text):
    monkeypatch.setenv("GRAINLAW_CACHE_LIMIT", text)
    with pytest.raises(gl.ParameterError, match=f"GRAINLAW_CACHE_LIMIT = {text} is not allowed"):
        limit()
    result = invoke("cache")
    assert result.exit_code == 2
    assert "GRAINLAW_CACHE_LIMIT" in result.output


def test_the_command_says_where_and_how_much_and_clears(folder):
    empty = invoke("cache")
    assert (empty.exit_code, "functions" in empty.output) == (0, True)
    fill(folder)
    (folder.path / "notes.txt").write_text("not ours")
    (folder.path / f"{NAMES[1]}.{32 * 'a'}").write_bytes(b"half")
    output = invoke("cache").output
    assert [line[:11] for line in output.splitlines()] == ["folder     ", "functions  ", "size       ", "limit      "]
    lines = dict(line.split(maxsplit=1) for line in output.splitlines())
    assert lines == {"folder": str(folder.path), "functions": "6", "size": "0.6 MB", "limit": "500 MB"}
    cleared = invoke("cache", "--clear")
    assert cleared.exit_code == 0
    assert "6 functions" in cleared.output
    assert [file.name for file in folder.path.iterdir()] == ["notes.txt"]


@posix
def test_the_command_says_that_a_folder_is_not_used_and_clears_it(folder):
    folder.write(NAMES[0], HEADER, CODE)
    folder.path.chmod(0o777)
    assert "not used: others may write to" in " ".join(invoke("cache").output.split())
    assert invoke("cache", "--clear").exit_code == 0
    assert not names(folder)
