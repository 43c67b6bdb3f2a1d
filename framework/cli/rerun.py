"""The command that repeats a run from its folder, and says what differs."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import numpy as np

from grainlaw.cli.answers import answer, json_option
from grainlaw.messages import cut
from grainlaw.runs.claim import RUN, STUDY

#: what decides the results of a run, in its record
DECIDING = {"specimen": "specimen", "law": "law", "protocol": "test", "options": "options", "engine": "engine"}


@click.command()
@click.argument("folder", metavar="FOLDER", type=click.Path(path_type=Path, file_okay=False))
@click.option("--out", type=click.Path(path_type=Path), help="Folder to write to.  [default: FOLDER-again]")
@json_option
@click.pass_context
def rerun(context: click.Context, *, folder: Path, out: Path | None) -> None:
    """Repeat the run that FOLDER holds, and say what differs from it.

    Compares what decided the run (grains, law, test, versions, processor) and all that was recorded. The exit code is 0
    if every number is the same, 1 if not. Law files are those that were copied to FOLDER.
    """
    record = _read(folder / RUN)
    if out is None:
        named = folder.resolve() if folder.name in ("", "..") else folder
        out = named.with_name(f"{named.name}-again")
    try:
        name, arguments = record["command"]["name"], dict(record["command"]["arguments"])
    except KeyError:
        name, arguments = "", {}
    command = context.parent.command.get_command(context, name)  # type: ignore[union-attr]
    if command is None:
        program = " ".join(record.get("program", []))
        raise click.UsageError(f"{folder} was not made by a command, but by {program}: run that again")
    if any((out / name).exists() for name in (RUN, STUDY)):
        raise click.UsageError(f"{out} holds a run or a study: choose another folder (--out), or remove it")
    if arguments.get("config"):
        arguments["config"] = folder / arguments["config"]
    elif ".py" in str(arguments.get("law", "")):
        arguments["law"] = str(folder / arguments["law"])
    if name == "test" and ".py" in arguments["name"]:
        arguments["name"] = str(folder / arguments["name"])
    context.invoke(command, **arguments, out=out)
    click.echo("")
    different = [line for line in _differences(folder, out) if line]
    if not different:
        answer(f"every number is the same as in {folder}", same=True, differences=[])
        return
    lines = [line.strip() for line in different]
    answer(f"different from {folder}:\n" + "\n".join(different), same=False, differences=lines)
    context.exit(1)


def _read(file: Path) -> dict[str, Any]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise click.UsageError(f"{file.parent} holds no run: {file}: {error.strerror}") from None
    except ValueError as error:
        raise click.UsageError(f"{file} cannot be read: {error}") from None
    if not isinstance(content, dict):
        raise click.UsageError(f"{file} is no record of a run")
    return content


def _differences(before: Path, now: Path) -> Iterator[str]:
    """Lines that say what differs between two folders of the same command."""
    one, other = _read(before / RUN), _read(now / RUN)
    for key, value in one["made_with"].items():
        if other["made_with"].get(key) != value:
            yield f"  made with another {key}: {cut(str(value), 60)} -> {cut(str(other['made_with'].get(key)), 60)}"
    if one["status"] != other["status"]:
        yield f"  it ended otherwise: {one['status']} -> {other['status']}"
    if (before / STUDY).exists():
        found = _changed(_read(before / "summary.json"), _read(now / "summary.json"))
        yield from (f"  {line}" for line in found)
        return
    for name in one.get("runs", [""]):
        yield from _of_run(name, before / name, now / name)


def _of_run(name: str, before: Path, now: Path) -> Iterator[str]:
    where = f"  {name}: " if name else "  "
    one, other = _read(before / RUN), _read(now / RUN)
    for key, word in DECIDING.items():
        if one.get(key) != other.get(key):
            yield f"{where}another {word}: {', '.join(_changed(one.get(key), other.get(key)))}"
    for file in ("curves.csv", "cracks.csv"):
        if (before / file).read_bytes() != (now / file).read_bytes():
            yield f"{where}{file}: {_of_tables(before / file, now / file)}"


def _changed(one: Any, other: Any, place: str = "") -> Iterator[str]:
    """Names of what differs in two nested records."""
    if isinstance(one, dict) and isinstance(other, dict):
        for key in dict.fromkeys([*one, *other]):
            if one.get(key) != other.get(key):
                yield from _changed(one.get(key), other.get(key), f"{place}.{key}" if place else key)
    elif isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        yield from _changed(dict(enumerate(one)), dict(enumerate(other)), place)
    else:
        yield f"{place} {cut(str(one), 60)} -> {cut(str(other), 60)}"


def _of_tables(before: Path, now: Path) -> str:
    """Where two tables part, and by how much in the end."""
    one, other = (np.genfromtxt(file, delimiter=",", names=True, ndmin=1) for file in (before, now))
    if one.dtype.names != other.dtype.names:
        return "other columns"
    count = min(len(one), len(other))
    names = list(one.dtype.names or ())
    rows = np.array([np.abs(one[name][:count] - other[name][:count]) for name in names])
    size = np.array([np.nanmax(np.abs(one[name]), initial=1e-300) for name in names])
    parts = np.flatnonzero((np.nan_to_num(rows) > 0).any(axis=0))
    lengths = f"{len(one)} rows -> {len(other)}; " if len(one) != len(other) else ""
    if not len(parts):
        return f"{lengths}the rows that both have are the same"
    ratio = np.nan_to_num(rows / size[:, None])
    first, worst = int(parts[0]), int(np.argmax(ratio.max(axis=1)))
    begin = int(np.argmax(ratio[:, first]))
    return (
        f"{lengths}they part in row {first + 1} of {count} ({names[begin]}, by {ratio[begin, first]:.1e} of its "
        f"largest value); the largest difference is {ratio[worst].max():.1e} ({names[worst]})"
    )
