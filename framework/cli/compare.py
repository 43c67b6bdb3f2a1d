"""The main job: one rock specimen compressed under several contact laws."""

from __future__ import annotations

import os
from pathlib import Path

import click

from grainlaw.cli.running import FAILURES, ProgressBar, check_threads, described, progress_bars, versions
from grainlaw.cli.table1 import QUICK, ROCK, SAMPLE, law_named
from grainlaw.compiler.cache import compile_portably
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.protocols import UniaxialCompression
from grainlaw.results.files import writable_folder
from grainlaw.results.vtk import VtkWriter
from grainlaw.runs.comparison import compare as compare_laws
from grainlaw.specimen import Specimen
from grainlaw.unit_text import written

COMPARED = "linear,mohr-coulomb,cohesive-crack"


@click.command()
@click.option("--grains", type=int, help=f"Number of Voronoi grains.  [default: {SAMPLE[2]}]")
@click.option("--seed", type=int, default=1, show_default=True, help="Seed of the grains.")
@click.option("--laws", default=COMPARED, show_default=True, help="Contact laws, separated by commas.")
@click.option("--speed", type=float, default=0.05, show_default=True, help="Platen speed in m/s.")
@click.option("--max-strain", type=float, default=0.01, show_default=True, help="Axial strain at which to end.")
@click.option("--out", type=click.Path(path_type=Path), default="out", show_default=True, help="Folder to write to.")
@click.option("--threads", type=int, help="Models (and threads in a model) at a time.  [default: all cores]")
@click.option("--portable", is_flag=True, help="The same bits on every processor, for some more time.")
@click.option("--quick", is_flag=True, help=f"A small specimen, seconds: {QUICK[2]} grains in 20 x 50 mm.")
def compare(
    *, grains: int | None, seed: int, laws: str, speed: float, max_strain: float, out: Path, threads: int | None,
    quick: bool, portable: bool,
) -> None:  # fmt: skip
    """Compress one rock specimen to failure under several contact laws, and compare them.

    Writes report.html, comparison.png, cracks_LAW.png, summary.json and curves.csv, and for each law a folder with
    grains.pvd and cracks.pvd for ParaView. The specimen and the parameters are those of a published study
    (docs/validation.md).
    """
    width, height, count = QUICK if quick else SAMPLE
    try:
        if portable:
            compile_portably()
        chosen = {name.strip(): law_named(name.strip()) for name in laws.split(",")}
        check_threads(threads)
        test = UniaxialCompression(speed=speed, maximum_strain=max_strain)
        tessellator = Voronoi(grains=count if grains is None else grains, seed=seed)
        specimen = Specimen(tessellator.tessellate(rectangle(width, height)), ROCK)
        folder = writable_folder(out)  # only now: what is refused leaves no folder behind
        with progress_bars() as progress:
            comparison = compare_laws(
                specimen, chosen, test, threads=threads,
                observers=lambda name: [ProgressBar(progress, name), VtkWriter(folder / name)],
            )  # fmt: skip
        record = {
            "seed": seed,
            "versions": versions(),
            "parameters": {
                "region": {"width": width, "height": height},
                "tessellator": described(tessellator),
                "material": described(ROCK),
                "contact_points": described(specimen.contact_points),
                "protocol": described(test),
                "laws": {name: described(law) for name, law in chosen.items()},
            },
        }
        comparison.write(folder, record)
        sample = {**described(tessellator), "width": written(width, "m"), "height": written(height, "m")}
        comparison.write_report(folder / "report.html", record={"sample": sample, "versions": versions()})
    except FAILURES as error:
        raise click.ClickException(str(error)) from None
    click.echo(comparison)
    files = "report.html, comparison.png, cracks_<law>.png, summary.json, curves.csv, <law>/*.pvd"
    click.echo(f"\nwritten to {os.fspath(folder)}{os.sep}: {files}")
