"""The script by which the scheduler Slurm runs a study as an array of jobs."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

from grainlaw.parameter import ParameterError, checked_whole_number

TIME = re.compile(r"(\d+-\d{1,2}(:\d{1,2}){0,2}|\d+(:\d{1,2}){0,2})")  #: as Slurm reads it
BEFORE = 60  #: s before the end of a job's time at which it is asked to end

SCRIPT = """\
#!/bin/bash
#SBATCH --job-name={name}
#SBATCH --array=1-{shards}
#SBATCH --cpus-per-task={cpus}
#SBATCH --time={time}
#SBATCH --signal=B:TERM@{before}
#SBATCH --output={name}-%a.log
#SBATCH --open-mode=append

# {before} s before its time is over a job is sent TERM, and ends: what is finished is kept, what was running is lost.
# Give the same script to sbatch again until "{status}" says that none is missing.

export OMP_NUM_THREADS=1  # one case for each core, and one thread for each case
cd {folder} || exit 1
exec {command}
"""


def script(file: Path, options: list[str], *, shards: int, time: str, cpus: int, cases: int) -> str:
    """A script for sbatch; ``options`` are further ones of the command. Raises :class:`ParameterError`."""
    if not TIME.fullmatch(time):
        raise ParameterError(
            f"--time = '{time}' is not allowed, it must be as Slurm has it: 24:00:00 (hours, minutes, seconds), "
            "2-12 (days and hours), or minutes"
        )
    checked_whole_number("--shards", shards, at_least=1, at_most=cases)
    checked_whole_number("--cpus", cpus, at_least=1)
    given = shlex.join([str(file), *options])
    array = f'--shard "$SLURM_ARRAY_TASK_ID/{shards}" --workers "$SLURM_CPUS_PER_TASK"'
    return SCRIPT.format(
        name=re.sub(r"[^\w-]", "_", file.stem), shards=shards, cpus=cpus, time=time, before=BEFORE,
        folder=shlex.quote(str(Path().resolve())), command=f"{_program()} study {given} {array}",
        status=f"grainlaw study status {given}",
    )  # fmt: skip


def _program() -> str:
    """The command, by its place: a job begins without the virtual environment."""
    beside = Path(sys.executable).with_name("grainlaw")
    return shlex.quote(str(beside)) if beside.exists() else f"{shlex.quote(sys.executable)} -m grainlaw"
