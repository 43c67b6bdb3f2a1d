"""Commands that are killed or stopped at random moments: nothing damaged, and they go on as if nothing had been."""

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from xml.etree import ElementTree

import numpy as np
import pytest

FAST = ["--quick", "--grains", "30"]
FEW = ["--quick", "--grains", "20"]
FASTER = "test.loading={type='constant', speed=0.3}"
FASTEST = ["--set", "test.samples=60", "--set", "test.loading={type='constant', speed=0.5}"]
WEAK = ["--set", "law.tensile_strength=3 MPa", "--set", "law.mode_i_energy=1", "--set", "law.mode_ii_energy=10"]
COMMANDS = {
    "test": ["test", "uniaxial-compression", *FAST, "--set", FASTER, "--set", "test.samples=150"],
    "compare": ["compare", *FAST, "--seeds", "1,2", "--speed", "0.3", "--max-strain", "0.006"],
    "envelope": [
        "envelope", *FAST, "--law", "mohr-coulomb", "--confinement", "0,3", "--speed", "0.3", "--max-strain", "0.004"
    ],
    "heating": [
        "test", "heating", *FEW, "--set", "rock.type=thermal", "--set", "rock.expansion=1e-5", "--set", "test.to=60",
        "--set", "rock.material={type='elastic', youngs_modulus=60e9, poissons_ratio=0.25, density=2700}",
    ],
    "creep": [
        "test", "creep", *FEW, "--set", "test.load=60 MPa", "--set", "test.duration=1e3", "--set", "law.rate=1e-3"
    ],
    "water": ["test", "saturated", *FEW, "--set", "test.pressure=2 MPa"],
    "flow": [
        "test", "hydraulic-fracturing", *FEW, *WEAK, "--set", "test.viscosity=1 mPa s",
        "--set", "test.residual_aperture=2 um", "--set", "test.samples=100", "--set", "test.largest_volume=6 mm2",
    ],
    "shock": [
        "test", "thermal-shock", *FEW, *WEAK, "--set", "test.hot=300", "--set", "test.duration=2",
        "--set", "rock.type=thermal", "--set", "rock.expansion=1e-5",
        "--set", "rock.conductivity=3", "--set", "rock.heat_capacity=800",
        "--set", "rock.material={type='elastic', youngs_modulus=60e9, poissons_ratio=0.25, density=2700}",
    ],
    "breakable grains": [
        "test", "uniaxial-compression", "--quick", "--grains", "12", *FASTEST,
        "--set", "sample.breakable={type='trigons', count=6}",
    ],
    "plastic grains": [
        "test", "uniaxial-compression", *FEW, *FASTEST, "--set", "rock.type=mohr-coulomb-plastic",
        "--set", "rock.youngs_modulus=60e9", "--set", "rock.poissons_ratio=0.25", "--set", "rock.density=2700",
        "--set", "rock.tensile_strength=10 MPa", "--set", "rock.cohesion=20 MPa", "--set", "rock.friction_angle=30",
    ],
}  # fmt: skip
GO_ON = {command: ["--restart"] for command in COMMANDS} | {"envelope": []}  #: a study goes on with the same call
ENDS = (".csv", ".vtu", ".pvd", ".toml")  #: files that must have the same bytes
KILL, TERM, INT = "SIGKILL", "SIGTERM", "SIGINT"
#: what Python runs first in a command whose power will be lost: it notes the content of each file that is forced
NOTES = """
import hashlib, os

def fsync(opened, force=os.fsync):
    force(opened)
    name = os.readlink(f"/proc/self/fd/{opened}")
    if os.path.isfile(name):
        with open(name, "rb") as file, open(os.environ["FORCED"], "a") as notes:
            notes.write(f"{os.stat(name).st_ino} {hashlib.sha256(file.read()).hexdigest()}\\n")

os.fsync = fsync
"""

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals are those of Unix")


def start(command, folder, *options):
    arguments = [sys.executable, "-m", "grainlaw", *COMMANDS[command], "--out", str(folder), *options]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    return subprocess.Popen(
        arguments, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment,
        preexec_fn=None if os.name == "nt" else _heed_ctrl_c,
    )  # fmt: skip


def _heed_ctrl_c():
    """A shell that starts the tests in the background has them ignore it, and a command keeps what it inherits."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def finish(command, folder, *options):
    process = start(command, folder, *options)
    output, _ = process.communicate(timeout=300)
    assert process.returncode == 0, output
    return output


def whole(folder):
    """Every file can be read to its end."""
    for file in folder.rglob("*"):
        if ".part" in file.name:  # what a kill leaves of a file that was being written beside its place
            continue
        if file.suffix == ".json":
            json.loads(file.read_text())
        elif file.suffix == ".npz":
            with np.load(file) as stored:
                assert all(stored[name] is not None for name in stored.files)
        elif file.suffix in (".vtu", ".pvd"):
            ElementTree.parse(file)
        elif file.suffix == ".csv":
            text = file.read_text()
            lines = text.splitlines()
            assert text.endswith("\n")
            assert {line.count(",") for line in lines} == {lines[0].count(",")}


def same(folder, reference):
    def files(place):
        return {file.relative_to(place).as_posix(): file for file in place.rglob("*") if file.suffix in ENDS}

    mine, other = files(folder), files(reference)
    assert mine.keys() == other.keys()
    for name, file in mine.items():
        assert file.read_bytes() == other[name].read_bytes(), name
    for file in reference.rglob("summary.json"):
        its = json.loads((folder / file.relative_to(reference)).read_text())
        assert without_seconds(its) == without_seconds(json.loads(file.read_text()))
    if (reference / "study.json").exists():
        same_study(folder, reference)
    else:
        assert not [f for f in folder.rglob("*.npz") if f.name != "result.npz"] + [*folder.rglob(".*.part*")]


def same_study(folder, reference):
    """Each case once, and its run with the same numbers; what a kill left beside their places counts for nothing."""
    for kind in ("cases/*/*.json", "runs/*/*.npz"):
        names = [sorted(f.relative_to(place).as_posix() for f in place.glob(kind)) for place in (folder, reference)]
        assert names[0] == names[1]
        assert len(names[0]) == 2
    for file in reference.glob("runs/*/*.npz"):
        with np.load(file) as one, np.load(folder / file.relative_to(reference)) as other:
            assert one.files == other.files
            assert all(np.array_equal(one[n], other[n], equal_nan=True) for n in one.files if n != "about")


def without_seconds(content):
    if isinstance(content, dict):
        return {name: without_seconds(value) for name, value in content.items() if name != "seconds"}
    return [without_seconds(value) for value in content] if isinstance(content, list) else content


@pytest.fixture(scope="session")
def reference(tmp_path_factory):
    """Folder and duration (s) of a command that nothing stopped; made when first asked for."""
    done = {}

    def made(command):
        if command not in done:
            finish(command, tmp_path_factory.mktemp(command) / "warm")  # compiles
            folder, begin = tmp_path_factory.mktemp(command) / "out", time.monotonic()
            finish(command, folder)
            done[command] = folder, time.monotonic() - begin
        return done[command]

    return made


def stop_and_go_on(command, name, rng, tmp_path, reference):
    """Stop a command at random moments, until it comes to its end; each time look at what it left."""
    unstopped, duration = reference(command)
    folder, options = tmp_path / f"{command} {name}", []
    for _ in range(3):
        process = start(command, folder, *options)
        try:
            process.wait(timeout=rng.uniform(0.1, 1.1) * duration)
        except subprocess.TimeoutExpired:
            process.send_signal(getattr(signal, name))
        output, _ = process.communicate(timeout=120)
        # Python's own words: while it loads modules, or where it ignores Ctrl-C because it is clearing up memory.
        by_python = name == INT and any(words in output for words in (" in <module>", "Exception ignored in"))
        assert "Traceback" not in output or by_python, output
        if folder.exists():
            whole(folder)
        if process.returncode == 0:
            break
        options = GO_ON[command]
    if process.returncode != 0:
        finish(command, folder, *GO_ON[command])
    same(folder, unstopped)


@pytest.mark.slow
def test_a_killed_comparison_goes_on(tmp_path, reference):
    stop_and_go_on("compare", KILL, np.random.default_rng(1), tmp_path, reference)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("name", [KILL, TERM, INT])
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_goes_on_from_any_moment(command, name, seed, tmp_path, reference):
    stop_and_go_on(command, name, np.random.default_rng(seed), tmp_path, reference)


@pytest.fixture
def notes(tmp_path, monkeypatch):
    """File with the contents that commands have forced to the disk."""
    (tmp_path / "sitecustomize.py").write_text(NOTES)
    (tmp_path / "forced").touch()
    before = os.environ.get("PYTHONPATH")
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{before}" if before else str(tmp_path))
    monkeypatch.setenv("FORCED", str(tmp_path / "forced"))
    return tmp_path / "forced"


def lose_power(folder, forced, rng):
    """Cut every file that was not forced to the disk as it is."""
    for file in sorted(each for each in folder.rglob("*") if each.is_file()):
        content = file.read_bytes()
        if f"{file.stat().st_ino} {hashlib.sha256(content).hexdigest()}" not in forced:
            os.truncate(file, rng.choice([0, rng.integers(0, len(content) + 1), len(content)]))


@pytest.mark.slow
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="names of open files are those of Linux")
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("command", ["test", "water", "flow", "shock", "heating", "envelope"])
def test_what_is_promised_outlasts_a_loss_of_power(command, seed, tmp_path, reference, notes):
    """It goes on to the same files, from the last checkpoint or the cases that are done."""
    (unstopped, duration), rng = reference(command), np.random.default_rng(seed)
    folder, options = tmp_path / command, []
    for _ in range(3):
        process = start(command, folder, *options)
        try:
            process.wait(timeout=rng.uniform(0.3, 1.0) * duration)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
        process.communicate(timeout=120)
        if process.returncode == 0:
            break
        if folder.exists():
            lose_power(folder, set(notes.read_text().splitlines()), rng)
        options = GO_ON[command]
    if process.returncode != 0:
        finish(command, folder, *GO_ON[command])
    same(folder, unstopped)


@pytest.mark.thorough
@pytest.mark.parametrize("name", [TERM, INT])
def test_a_command_that_is_stopped_says_what_is_there_and_how_to_go_on(name, tmp_path):
    folder = tmp_path / "out"
    process = start("test", folder, "--set", "test.loading={type='constant', speed=0.002}")
    deadline = time.monotonic() + 60
    while not (folder / "curves.csv").exists() and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(0.3)
    process.send_signal(getattr(signal, name))
    output, _ = process.communicate(timeout=30)
    assert process.returncode == 128 + getattr(signal, name)
    assert "Traceback" not in output
    words = " ".join(output.split())
    assert {TERM: "stopped by the signal SIGTERM", INT: "interrupted from the keyboard"}[name] in words
    assert "checkpoint.npz" in words
    assert f"--restart --out {folder}" in words
    assert json.loads((folder / "run.json").read_text())["status"] != "running"
    assert json.loads((folder / "summary.json").read_text())["incomplete"]
