"""The published study on one page.

python docs/paper/paper.py [--out FOLDER] [--workers N] [--recalibrate] [--full] [--portable] [--quick]
"""

from __future__ import annotations

import os
from pathlib import Path

import click
from joint import joint
from paper_calibration import recalibrate as calibrated_anew
from paper_calibration import stored
from paper_numbers import Paper, macroscopic
from paper_page import write
from paper_runs import CONSISTENT, PRINTED, RULES, SEEDS, specimen, study

from grainlaw.cli.default_rock import LAWS, QUICK, SAMPLE
from grainlaw.cli.running import portable_option
from grainlaw.cli.study import ending
from grainlaw.quantity import aligned
from grainlaw.results.files import writable_folder
from grainlaw.results.tables import write_json
from grainlaw.runs.elastic_properties import elastic_properties
from grainlaw.runs.flutter import hold
from grainlaw.runs.record import origin
from grainlaw.units import MPa

RUNS = "runs"  #: folder of the study
HELD = 51 * MPa  #: stress of the specimens without damping


@click.command()
@click.option("--out", type=click.Path(path_type=Path), default="paper", show_default=True, help="Folder to write to.")
@click.option("--workers", type=int, help="Runs at a time.  [default: one for each core]")
@click.option("--recalibrate", is_flag=True, help="Calibrate anew, which takes an hour or more; without it, as stored.")
@click.option("--full", is_flag=True, help="All laws on three seeds under all confinements, and all dampings.")
@portable_option
@click.option("--quick", is_flag=True, help="A small specimen: shows the page, not the numbers.")
def paper(*, out: Path, workers: int | None, recalibrate: bool, full: bool, quick: bool) -> None:
    """Repeat the paper of the cohesive crack model, and write it as one page.

    The paper is "Application of cohesive crack model to simulation of rocks mechanical behavior in grain-based distinct
    element model" (2019), also that of joint.py.

    Figures 5, 6, 8 and 9 and what belongs to them, with the numbers of Table 1: the paper, its equations by hand, the
    model as printed, the reading that grainlaw takes by default, and laws calibrated to the paper's rock; Mohr-Coulomb
    and linear contacts beside. Writes paper.html and paper.json, and keeps the runs in a study: what is finished is
    kept, and the same call goes on.
    """
    cases = study(quick, full)
    with ending(cases, out / RUNS):
        folder = writable_folder(out)
        table = cases.run(folder / RUNS, workers=workers)
        first = specimen(SEEDS[0], QUICK if quick else SAMPLE)
        found = Paper(
            joint(), table, elastic_properties(first, LAWS["linear"]),
            {law: hold(first, RULES[law], HELD) for law in (PRINTED, CONSISTENT)},
            calibrated_anew(folder, workers) if recalibrate else stored(),
        )  # fmt: skip
        write(found, folder / "paper.html")
        rows = macroscopic(found)
        write_json(folder / "paper.json", {"sample": rows, "runs": table.rows, **origin()})
    click.echo(aligned(rows, rule=True))
    click.echo(f"\nwritten to {folder}{os.sep}: paper.html, paper.json, {RUNS}{os.sep}")
    if table.failed:
        raise click.ClickException(f"{len(table.failed)} of {len(table)} tests failed")


if __name__ == "__main__":
    paper()
