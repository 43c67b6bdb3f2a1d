"""The command that runs any test of a specimen under any law."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from grainlaw.cli.configuration import Configuration, configured
from grainlaw.cli.running import ProgressBar, progress_bars, versions
from grainlaw.cli.sections import Sections, assign, read_file, toml
from grainlaw.cli.setups import SETUPS
from grainlaw.compiler.batch import CompilationError
from grainlaw.compiler.cache import compile_portably
from grainlaw.engine.stepping import InstabilityError
from grainlaw.naming import aligned, shown
from grainlaw.parameter import ParameterError
from grainlaw.results.files import writable_folder, write_atomically
from grainlaw.results.result import Result
from grainlaw.results.tables import write_curves, write_json
from grainlaw.results.vtk import VtkWriter
from grainlaw.runs.first_questions import ask_first_questions
from grainlaw.runs.simulation import simulate
from grainlaw.stage import StageError


@click.command(
    help=f"""Run a laboratory test of a rock specimen under a contact law, and report it.

NAME is one of {", ".join(SETUPS)}. Every parameter can be given: in a TOML file with the sections [sample], [rock],
[law], [test] and [numerics], or one by one, as in --set test.speed="20 mm/s" (docs/configuration.md). Others are
those of a published study.

Writes report.html, summary.json, curves.csv, grains.pvd and cracks.pvd for ParaView, and config.toml, which runs the
same test again. The exit code is 2 for what is refused before the test, 1 for a test that could not end; what it
recorded is written all the same."""
)
@click.argument("name", metavar="NAME")
@click.option("--law", help="Name of a law, or FILE.py:LAW.  [default: cohesive-crack]")
@click.option("--grains", type=int, help="Number of grains.")
@click.option("--seed", type=int, help="Seed of the grains.")
@click.option("--config", type=click.Path(path_type=Path, dir_okay=False), help="TOML file with parameters.")
@click.option("--set", "assignments", metavar="KEY=VALUE", multiple=True, help="One parameter; can be repeated.")
@click.option("--out", type=click.Path(path_type=Path), default="out", show_default=True, help="Folder to write to.")
@click.option("--threads", type=int, help="Threads in the model, for large ones.  [default: 1]")
@click.option("--portable", is_flag=True, help="The same bits on every processor, for some more time.")
@click.option("--quick", is_flag=True, help="A small specimen.")
def test(
    *, name: str, law: str | None, grains: int | None, seed: int | None, config: Path | None,
    assignments: tuple[str, ...], out: Path, threads: int | None, quick: bool, portable: bool,
) -> None:  # fmt: skip
    options = {("law", "type"): law, ("sample", "grains"): grains, ("sample", "seed"): seed}
    options["numerics", "threads"] = threads
    try:
        if portable:
            compile_portably()
        sections: Sections = read_file(config) if config else {}
        for (section, key), value in options.items():
            if value is not None:
                sections.setdefault(section, {})[key] = value
        for assignment in assignments:
            assign(sections, assignment)
        chosen = configured(name, sections, quick)
        ask_first_questions(chosen.law)
    except (ParameterError, OSError, CompilationError, MemoryError) as error:
        raise click.UsageError(str(error)) from None
    try:
        folder = writable_folder(out)
        heading = "".join(f"# {package} {number}\n" for package, number in versions().items())
        text = f"# grainlaw test {name} --config config.toml\n{heading}\n{toml(chosen.sections)}"
        write_atomically(folder / "config.toml", lambda file: file.write_text(text, encoding="utf-8"))
        result, reason = _run(name, chosen, folder)
        _write(result, chosen.sections, folder, reason)
    except (ParameterError, OSError, CompilationError, MemoryError) as error:
        raise click.ClickException(str(error)) from None
    click.echo(_table(result.summary))
    files = "report.html, summary.json, curves.csv, grains.pvd, cracks.pvd, config.toml"
    click.echo(f"\nwritten to {os.fspath(folder)}{os.sep}: {files}")
    if reason:
        raise click.ClickException(reason)


def _run(name: str, chosen: Configuration, folder: Path) -> tuple[Result, str]:
    """The result, and why the test could not end, if it could not."""
    numerics = chosen.numerics
    with progress_bars() as progress:
        try:
            result = simulate(
                chosen.specimen, chosen.law, chosen.protocol, threads=numerics.threads, frames=numerics.frames,
                time_step_factor=numerics.time_step_factor, mass_scaling=numerics.mass_scaling,
                observers=[ProgressBar(progress, name), VtkWriter(folder, numerics.frames)],
            )  # fmt: skip
        except (StageError, InstabilityError) as error:
            return error.result, str(error)
    return result, ""


def _write(result: Result, sections: Sections, folder: Path, reason: str) -> None:
    record = {"versions": versions(), "configuration": sections}
    unfinished = {"incomplete": reason} if reason else {}
    write_json(folder / "summary.json", {"properties": result.summary, **unfinished, **record})
    write_curves(folder / "curves.csv", {sections["law"]["type"]: result.curves})
    shown_too = {key: sections[key] for key in ("sample", "numerics")}
    result.write_report(folder / "report.html", record={**shown_too, "versions": versions()}, incomplete=reason)


def _table(summary: Mapping[str, Any]) -> str:
    rows = [(shown(name).heading, shown(name).text(value)) for name, value in summary.items()]
    return aligned(rows)
