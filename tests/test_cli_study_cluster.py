"""Studies on a cluster from the command line: arrays of jobs, and Dask."""

import importlib
import json
import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from command_line import LAWS, invoke, study_file
from hypothesis import example, given
from hypothesis import strategies as st

import grainlaw as gl
from grainlaw.cli.study import script


@pytest.mark.thorough
def test_a_job_of_the_array_is_stopped_and_goes_on(tmp_path, monkeypatch):
    """The script that is printed, run as the scheduler would, and asked to end before its time is over."""
    monkeypatch.chdir(tmp_path)
    file = study_file(tmp_path, '"sample.seed" = "1..24"\n')
    call = ("study", "slurm", file.name, "--quick", "--set", "sample.grains=20", "--shards", 2, "--time", "24:00:00")
    result = invoke(*call, "--cpus", 2)
    assert result.exit_code == 0, result.output
    assert "#SBATCH --array=1-2\n#SBATCH --cpus-per-task=2\n#SBATCH --time=24:00:00\n" in result.output
    (tmp_path / "job.sh").write_text(result.output)
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST")}
    environment |= {"SLURM_ARRAY_TASK_ID": "2", "SLURM_CPUS_PER_TASK": "1"}
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    job = subprocess.Popen(["bash", "job.sh"], env=environment, **streams)
    ended = time.monotonic() + 120
    while not list(tmp_path.glob("granite/cases/*/*.json")) and time.monotonic() < ended and job.poll() is None:
        time.sleep(0.05)
    job.send_signal(signal.SIGTERM)
    output, _ = job.communicate(timeout=60)
    assert job.returncode == 128 + signal.SIGTERM, output
    assert "stopped by the signal SIGTERM; 24 cases: " in output
    assert "go on with the same command" in output
    rows = list(tmp_path.glob("granite/cases/*/*.json"))
    assert 0 < len(rows) < 12
    subprocess.run(["bash", "job.sh"], env=environment, check=True, timeout=300, **streams)
    finished = {json.loads(path.read_text())["factors"]["seed"] for path in tmp_path.glob("granite/cases/*/*.json")}
    assert finished == set(range(2, 25, 2))
    assert set(rows) < set(tmp_path.glob("granite/cases/*/*.json"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--shards", "4", "--time", "1:00:00"], "--shards = 4 is not allowed, it must be a whole number"),
        (["--shards", "2", "--time", "a day"], "--time = 'a day' is not allowed"),
        (["--shards", "2", "--time", "1-00", "--cpus", "0"], "--cpus = 0 is not allowed"),
        (["--shards", "2", "--time", "1-00", "--set", "sample.grains=0"], "grains = 0 is not allowed"),
    ],
)
def test_scripts_are_refused_in_words(options, words, tmp_path):
    file = study_file(tmp_path, '"sample.seed" = "1..3"\n')
    result = invoke("study", "slurm", file, "--quick", *options)
    assert result.exit_code == 2
    assert words in " ".join(result.output.split())


def test_the_script_names_the_folder_where_it_is_not_that_of_the_file(tmp_path, monkeypatch):
    chosen = SimpleNamespace(
        file=Path("granite.toml"), folder=Path("granite"), options=["--quick"], study=range(4), try_first=lambda: [],
    )  # fmt: skip
    monkeypatch.setattr(importlib.import_module("grainlaw.cli.study"), "study_of", lambda *_: chosen)
    for options, said in (([], []), (["--out", "granite"], []), (["--out", "other"], ["--out", "other"])):
        result = invoke("study", "slurm", "granite.toml", "--shards", 2, "--time", "1:00:00", *options)
        words = shlex.split(result.output.splitlines()[-1])
        assert words[words.index("study") + 1 : words.index("--shard")] == ["granite.toml", "--quick", *said]


PRINTED = st.text(st.characters(codec="utf-8", exclude_categories=["C", "Z"], exclude_characters="/"), min_size=1)


@pytest.mark.thorough
@given(name=PRINTED, value=PRINTED)
@example(name="1", value="0")
@example(name="--shard", value="0")
@example(name="$(touch here).toml", value="`id`; \"'$HOME")
def test_nothing_that_is_given_is_a_command_of_the_script(name, value):
    """No comment has it, and the shell reads it back as it was."""
    text = script(Path(name), ["--set", f"law={value}"], shards=2, time="1:00:00", cpus=1, cases=4)
    *others, last = text.splitlines()
    assert last.startswith("exec ")
    words = shlex.split(last)
    given = words[words.index("study") + 1 : len(words) - 1 - words[::-1].index("--shard")]
    assert given == [str(Path(name)), "--set", f"law={value}"]
    plain = script(Path("a.toml"), [], shards=2, time="1:00:00", cpus=1, cases=4).splitlines()
    said = re.sub(r"[^\w-]", "_", Path(name).stem)
    named = {
        "#SBATCH --job-name=a": f"#SBATCH --job-name={said}",
        "#SBATCH --output=a-%a.log": f"#SBATCH --output={said}-%a.log",
    }
    assert others == [named.get(line, line) for line in plain[:-1]]


@pytest.mark.parametrize("wrong", ["a\nrm -rf x.toml", "a\rb.toml", "a\x1b[2J.toml", "a\u2028b.toml"])
def test_a_name_that_would_begin_a_line_is_refused(wrong):
    said = f"^study slurm: {re.escape(repr(wrong))} is not allowed, it has a character that cannot be printed"
    with pytest.raises(gl.ParameterError, match=said):
        script(Path(wrong), [], shards=2, time="1:00:00", cpus=1, cases=4)
    with pytest.raises(gl.ParameterError, match=said):
        script(Path("a.toml"), ["--set", wrong], shards=2, time="1:00:00", cpus=1, cases=4)


@pytest.mark.skipif(shutil.which("shellcheck") is None, reason="shellcheck is not installed")
def test_the_script_is_clean(tmp_path):
    (tmp_path / "job.sh").write_text(script(Path("it's.toml"), [], shards=2, time="1:00:00", cpus=1, cases=4))
    done = subprocess.run(["shellcheck", tmp_path / "job.sh"], capture_output=True, text=True, check=False)
    assert done.stdout == ""


@pytest.mark.thorough
def test_a_cluster_gives_the_same_table(tmp_path):
    """Its workers do not see the folder of the law."""
    distributed = pytest.importorskip("distributed")
    file = study_file(tmp_path, LAWS)
    for name, options in (("here", ("--workers", 1)), ("there", ("--on",))):
        if name == "there":
            with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
                done = invoke("study", file, "--quick", "--out", tmp_path / name, *options, cluster.scheduler_address)
        else:
            done = invoke("study", file, "--quick", "--out", tmp_path / name, *options)
        assert done.exit_code == 0, done.output
        call = ("study", "table", file, "--quick", "--out", tmp_path / name, "--csv", tmp_path / f"{name}.csv")
        assert "4 cases written to" in invoke(*call).output
    assert (tmp_path / "there.csv").read_bytes() == (tmp_path / "here.csv").read_bytes()


@pytest.mark.thorough
@pytest.mark.skipif(shutil.which("openssl") is None, reason="no openssl to make a certificate")
def test_dask_with_tls_as_the_documents_show(tmp_path):
    """Their lines word for word, at a port that is free; who has no certificate is refused."""
    pytest.importorskip("distributed")
    study_file(tmp_path, '"sample.seed" = "1..2"\n').rename(tmp_path / "granite.toml")
    page = (Path(__file__).parents[1] / "docs/studies.md").read_text(encoding="utf-8")
    block = re.search(r"```sh\n(openssl.*?)```", page, re.DOTALL)[1]
    with socket.socket() as free:
        free.bind(("localhost", 0))
        port = str(free.getsockname()[1])
    block = block.replace("8786", port).replace("granite.toml", "granite.toml --quick --set sample.grains=20")
    bare = f"""
        cp granite.toml other.toml; unset DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION
        grainlaw study other.toml --quick --on tcp://localhost:{port}"""
    shell = f"trap 'kill $(jobs -p)' EXIT\n{block}\necho ended $?\n{bare}\necho bare $?\n"
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST")}
    environment["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{environment['PATH']}"
    done = subprocess.run(
        ["bash", "-c", shell], cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=200
    )
    assert "ended 0" in done.stdout, done.stdout + done.stderr[-2000:]
    assert "bare 2" in done.stdout, done.stdout
    assert "no Dask scheduler answers" in done.stderr
    assert len(list(tmp_path.glob("granite/cases/*/*.json"))) == 2
