"""The command that runs a study, and those that tell what it has found."""

from __future__ import annotations

import functools
import os
import re
import shlex
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import attrs
import click

from grainlaw.cli.answers import answer, json_option
from grainlaw.cli.running import contents, device_of, device_option, end_stopped, refusing, tell_works
from grainlaw.cli.study_file import StudyFile, study_of
from grainlaw.columns import quantity_of
from grainlaw.compiler.cache import compile_portably
from grainlaw.fields import ParameterError, checked_whole_number
from grainlaw.messages import short
from grainlaw.quantity import aligned
from grainlaw.results.files import write_atomically
from grainlaw.runs.stopping import Stopped
from grainlaw.studies.statistics import Mean, label, level, mean_in_words
from grainlaw.studies.study import Study
from grainlaw.studies.table import Table
from grainlaw.studies.workers import ExecutorError

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
# Give the same script to sbatch again until "grainlaw study status" says that none is missing.

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
    for text in (str(file), *options, str(Path().resolve())):
        if not text.isprintable():
            raise ParameterError(
                f"study slurm: {short(text)} is not allowed, it has a character that cannot be printed"
            )
    given = shlex.join([str(file), *options])
    array = f'--shard "$SLURM_ARRAY_TASK_ID/{shards}" --workers "$SLURM_CPUS_PER_TASK"'
    return SCRIPT.format(
        name=re.sub(r"[^\w-]", "_", file.stem), shards=shards, cpus=cpus, time=time, before=BEFORE,
        folder=shlex.quote(str(Path().resolve())), command=f"{_program()} study {given} {array}",
    )  # fmt: skip


def _program() -> str:
    """The command, by its place: a job begins without the virtual environment."""
    beside = Path(sys.executable).with_name("grainlaw")
    return shlex.quote(str(beside)) if beside.exists() else f"{shlex.quote(sys.executable)} -m grainlaw"


class _Study(click.Group):
    """Runs a file where no other command is named."""

    def parse_args(self, context: click.Context, args: list[str]) -> list[str]:
        if args and args[0] not in (*self.commands, *context.help_option_names):
            args = ["run", *args]
        return super().parse_args(context, args)


@click.group(cls=_Study, subcommand_metavar="[COMMAND] FILE.toml [OPTIONS]")
def study() -> None:
    """Run many cases of a test, and keep them as one table.

    FILE.toml is the file of "grainlaw test" (docs/configuration.md), with its test named by [test] type = "...", and a
    further table [vary], such as "sample.seed" = "1..20", "law.tensile_strength" = ["10 MPa", "13 MPa"] and
    law = ["mohr-coulomb", "cohesive-crack"]. The cases are all combinations.

    Without a command the cases are run that are not finished (the options: grainlaw study run --help). What is
    finished is kept: a study that is stopped goes on with the same call.
    """


def file_options(command: Callable[..., None]) -> Callable[..., None]:
    """The file of a study and what belongs to its cases; the command is given the study and the folder of its store."""

    @click.argument("file", metavar="FILE.toml", type=click.Path(path_type=Path))
    @click.option("--set", "assignments", metavar="KEY=VALUE", multiple=True, help="One parameter; can be repeated.")
    @click.option("--quick", is_flag=True, help="A small specimen.")
    @click.option("--portable", is_flag=True, help="The same bits on every processor; such cases are others.")
    @click.option(
        "--out", type=click.Path(path_type=Path),
        help="Folder of the study.  [default: the file's name without its ending]",
    )  # fmt: skip
    @functools.wraps(command)
    def run(
        *, file: Path, assignments: tuple[str, ...], quick: bool, portable: bool, out: Path | None, **options: Any
    ) -> None:
        with refusing():
            if portable:
                compile_portably()
            chosen = study_of(file, assignments, quick)
        command(chosen, chosen.folder if out is None else out, **options)

    return run


def _shard(_context: Any, _option: Any, value: str | None) -> tuple[int, int] | None:
    if value is None:
        return None
    found = re.fullmatch(r"(\d{1,9})/(\d{1,9})", value)
    shard = (int(found[1]), int(found[2])) if found else (0, 0)
    if not 1 <= shard[0] <= shard[1]:
        raise click.UsageError(
            f"--shard = '{value}' is not allowed, it must be a number and of how many, such as 3/64: from 1/64 to 64/64"
        )
    return shard


@study.command()
@file_options
@click.option("--on", metavar="ADDRESS", help="Scheduler of a Dask cluster, such as tcp://host:8786.")
@click.option("--workers", type=int, help="Cases at a time on this machine.  [default: one for each core]")
@device_option
@click.option("--shard", metavar="K/N", callback=_shard, help="The K-th of N parts, for N jobs that share the folder.")
@json_option
def run(
    chosen: StudyFile, folder: Path, *, on: str | None, workers: int | None, device: str | None,
    shard: tuple[int, int] | None,
) -> None:  # fmt: skip
    """Run the cases that are not finished, and print the means over the seeds."""
    with ending(chosen.study, folder):
        if on is not None and device is not None:
            raise ParameterError("--on and --device are not allowed together: a cluster or a device does the steps")
        works = chosen.try_first()
        table = chosen.study.run(folder, on=device_of(device) or on, workers=workers, shard=shard)
    found = chosen.study.status(folder)
    answer(means(table, chosen.by), folder=str(folder), **attrs.asdict(found), **_content(table), cite=list(works))
    tell_works(works)
    click.echo(f"\n{found}\n{contents(folder)}")
    if table.failed:
        raise click.ClickException(f"{len(table.failed)} of {len(table)} cases failed{_reasons(table)}")


@contextmanager
def ending(study: Study, folder: Path) -> Iterator[None]:
    """End in words: what is refused with exit code 2, what is stopped with how far it is."""
    try:
        with refusing():
            yield
    except Stopped as stopped:
        end_stopped(stopped, str(study.status(folder)), f"{contents(folder)}\ngo on with the same command")
    except ExecutorError as error:
        raise click.ClickException(f"{error}; {study.status(folder)}; go on with the same command") from None


def _reasons(table: Table) -> str:
    """Of each kind of failure the first reason."""
    counts = Counter(row["status"] for row in table.failed)
    first = {row["status"]: row for row in reversed(table.failed)}
    return "".join(
        f"\n{count} {kind}, the first {label(table.factors, first[kind])}: {first[kind]['reason']}"
        for kind, count in counts.items()
    )


@study.command()
@file_options
@json_option
def estimate(chosen: StudyFile, folder: Path) -> None:
    """Tell what the missing cases will take: from finished cases, or from a probe of some steps."""
    with refusing():
        found = chosen.study.estimate(folder)
    answer(found, **attrs.asdict(found))


@study.command()
@file_options
@json_option
def status(chosen: StudyFile, folder: Path) -> None:
    """Tell how many cases are finished, have failed and are missing."""
    with refusing():
        try:
            found = chosen.study.status(folder)
        except ParameterError:
            chosen.try_first()  # where a case cannot be there is no folder
            raise
        table = chosen.study.table(folder) if found.failed else None
    reasons = table.failed if table else []
    answer(f"{found}{_reasons(table) if table else ''}", **attrs.asdict(found), reasons=reasons)


@study.command()
@file_options
@click.option("--csv", type=click.Path(path_type=Path), help="File to write as text.")
@click.option("--parquet", type=click.Path(path_type=Path), help="File to write for pandas and other programs.")
@json_option
def table(chosen: StudyFile, folder: Path, *, csv: Path | None, parquet: Path | None) -> None:
    """Print the table, one row for each case, or write it to a file in SI units."""
    with refusing():
        found = chosen.study.table(folder)
        if csv is not None:
            found.write_csv(csv)
        if parquet is not None:
            found.write_parquet(parquet)
    if csv is None and parquet is None:
        answer(found, **_content(found))
    else:
        files = [str(file) for file in (csv, parquet) if file]
        answer(f"{len(found)} cases written to {', '.join(files)}", **_content(found), files=files)


@study.command()
@file_options
@click.option("--column", help="Column of the table.  [default: the first that the table shows, as strength]")
@click.option("--to", type=click.Path(path_type=Path), help="File to write.  [default: COLUMN.png in the folder]")
def plot(chosen: StudyFile, folder: Path, *, column: str | None, to: Path | None) -> None:
    """Draw a column: each case, and means with their intervals."""
    with refusing():
        found = _with_rows(chosen, folder)
        column = column or next(iter(found.main), "strength")
        file = folder / f"{column}.png" if to is None else to
        figure = found.plot(column, over=chosen.over)
        if file.suffix[1:].lower() not in (known := figure.canvas.get_supported_filetypes()):
            raise ParameterError(f"--to = '{file}' is not allowed, its ending must be one of {', '.join(known)}")
        write_atomically(file, lambda path: figure.savefig(path, dpi=150))
    click.echo(f"written to {file}")


@study.command()
@file_options
@click.option("--to", type=click.Path(path_type=Path), help="File to write.  [default: report.html in the folder]")
def report(chosen: StudyFile, folder: Path, *, to: Path | None) -> None:
    """Write the report of the study: one page that opens anywhere."""
    file = folder / "report.html" if to is None else to
    with refusing():
        _with_rows(chosen, folder).write_report(file, over=chosen.over)
    click.echo(f"written to {file}")


def _with_rows(chosen: StudyFile, folder: Path) -> Table:
    found = chosen.study.table(folder)
    if not len(found):
        raise ParameterError(f"{folder}: no case of {chosen.file} is finished")
    return found


@study.command()
@click.option("--shards", type=int, required=True, help="Jobs of the array.")
@click.option("--time", metavar="TIME", required=True, help="Longest time of a job, such as 24:00:00.")
@click.option("--cpus", type=int, default=1, show_default=True, help="Cores of a job: cases at a time.")
@file_options
def slurm(chosen: StudyFile, folder: Path, *, shards: int, time: str, cpus: int) -> None:
    """Print a script for sbatch: the study as an array of jobs of the scheduler Slurm, which share the folder."""
    options = [*chosen.options, *([] if folder == chosen.folder else ["--out", os.fspath(folder)])]
    with refusing():
        chosen.try_first()
        text = script(chosen.file, options, shards=shards, time=time, cpus=cpus, cases=len(chosen.study))
    click.echo(text, nl=False)


def _content(table: Table) -> dict[str, Any]:
    """The rows of a table (SI), and the names of its factors."""
    values = [{name: table.value(row, name) for name in table.columns} for row in table.rows]
    return {"factors": list(table.factors), "rows": values}


# --- what is printed -------------------------------------------------------------------------------------------------


def means(table: Table, by: list[str]) -> str:
    """Mean of each group of cases and half of its 95 % interval, over the seeds."""
    names = table.main
    if not names or len(table) == len(table.means(*by)[names[0]]):
        return str(table)
    found = table.means(*by)
    columns = [found[name] for name in names]
    rows = [[*(quantity_of(name).heading for name in by), "n", *(table.quantity(name).heading for name in names)]]
    for entries in zip(*columns, strict=True):
        group: Mean = entries[0]
        most = max(entry.count for entry in entries)
        cells = [mean_in_words(e, table.quantity(name), most) for name, e in zip(names, entries, strict=True)]
        rows.append([*(level(name, group.group[name]) for name in by), str(most), *cells])
    said = "means over the seeds, ± half of the 95 % interval; (2): over so many where fewer than n have it"
    return f"{aligned(rows, rule=True)}\n{said}"
