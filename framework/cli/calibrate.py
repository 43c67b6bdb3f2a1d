"""The command that finds the contact parameters of a rock."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from grainlaw.calibration.calibrate import calibrate as run
from grainlaw.calibration.result import Calibration
from grainlaw.cli.calibration_file import CalibrationFile, calibration_of
from grainlaw.cli.components import settings
from grainlaw.cli.law_copy import copied
from grainlaw.cli.running import contents, end_stopped, refusing
from grainlaw.cli.sections import toml
from grainlaw.contact import ContactLaw
from grainlaw.results.files import writable_folder, write_atomically
from grainlaw.runs.record import versions
from grainlaw.runs.stopping import Stopped
from grainlaw.studies.workers import ExecutorError

STORE, CALIBRATED = "tests", "calibrated.toml"


@click.command()
@click.argument("file", metavar="FILE.toml", type=click.Path(path_type=Path))
@click.option(
    "--set",
    "assignments",
    metavar="KEY=VALUE",
    multiple=True,
    help="One parameter of the specimen, the rock or the law; can be repeated.",
)
@click.option("--quick", is_flag=True, help="Small specimens.")
@click.option(
    "--out", type=click.Path(path_type=Path), help="Folder to write to.  [default: the file's name without its ending]"
)
@click.option("--budget", type=int, help="Points that are tested at most.  [default: 100]")
@click.option("--seeds", type=int, help="Specimens of each point.  [default: 3]")
@click.option("--workers", type=int, help="Tests at a time on this machine.  [default: one for each core]")
@click.option("--on", metavar="ADDRESS", help="Scheduler of a Dask cluster, such as tcp://host:8786.")
def calibrate(
    *, file: Path, assignments: tuple[str, ...], quick: bool, out: Path | None, budget: int | None, seeds: int | None,
    workers: int | None, on: str | None,
) -> None:  # fmt: skip
    """Find the contact parameters of a rock from its laboratory tests, and which of them the tests determine.

    FILE.toml is the file of "grainlaw test" (docs/configuration.md) with the tables [targets], such as
    ucs = "126 MPa", and [free], such as tensile_strength = ["5 MPa", "30 MPa"] (docs/calibration.md).

    Writes report.html, calibration.json with all numbers, and calibrated.toml, the rock for "grainlaw test NAME
    --config". All tests are kept in the folder: a calibration that is stopped goes on with the same call. The exit code
    is 1 where targets are in conflict.
    """
    with refusing():
        asked = calibration_of(file, assignments, quick, {"budget": budget, "seeds": seeds})
        folder = writable_folder(asked.folder if out is None else out)
    try:
        with refusing():
            found = run(**asked.given, specimens=asked.specimens, store=folder / STORE, workers=workers, on=on)
            found.write(folder)
            if found.is_plausible:
                _write_rock(found, asked, folder)
    except Stopped as stopped:
        end_stopped(stopped, contents(folder), "go on with the same command")
    except ExecutorError as error:
        raise click.ClickException(f"{error}; go on with the same command") from None
    click.echo(f"{found}\n\n{contents(folder)}")
    if not found.is_plausible:
        raise click.ClickException("the targets are in conflict: no parameters in the ranges meet them together")


def _write_rock(found: Calibration, asked: CalibrationFile, folder: Path) -> None:
    chosen = asked.chosen
    sections = {name: section for name, section in chosen.sections.items() if name not in ("test", "rock", "rocks")}
    material = found.rock(chosen.specimen).material
    if isinstance(material, Mapping):
        sections["rocks"] = {str(name): _plain(rock) for name, rock in material.items() if name is not ...}
    else:
        sections["rock"] = settings(material)
    law_there, _ = copied(chosen.sections["law"]["type"], chosen.law_files, folder)
    sections["law"] = settings(found.law, ContactLaw) | {"type": law_there}
    heading = "".join(f"# {package} {number}\n" for package, number in versions().items())
    text = f"# grainlaw test NAME --config {CALIBRATED}\n{heading}\n{toml(sections)}"
    write_atomically(folder / CALIBRATED, lambda path: path.write_text(text, encoding="utf-8"))


def _plain(rock: Any) -> dict[str, Any]:
    return {name: value for name, value in settings(rock).items() if name != "type"}
