"""The main job: one rock specimen compressed under several contact laws."""

from __future__ import annotations

from pathlib import Path

import click

from grainlaw.cli.running import (
    ProgressBar,
    finished,
    folder_options,
    portable_option,
    progress_bars,
    refusing,
    tell_certificate,
    threads_option,
    writing_to,
)
from grainlaw.cli.table1 import QUICK, ROCK, SAMPLE, law_named
from grainlaw.compiler.cache import is_portable
from grainlaw.engine.thread_count import Threads
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.loading import Adaptive, Constant
from grainlaw.protocols import UniaxialCompression
from grainlaw.results.vtk import VtkWriter
from grainlaw.runs.comparison import compare as compare_laws
from grainlaw.runs.record import described, versions
from grainlaw.specimen import Specimen
from grainlaw.unit_text import written

COMPARED = "linear,mohr-coulomb,cohesive-crack"


@click.command()
@click.option("--grains", type=int, help=f"Number of Voronoi grains.  [default: {SAMPLE[2]}]")
@click.option("--seed", type=int, default=1, show_default=True, help="Seed of the grains.")
@click.option("--laws", default=COMPARED, show_default=True, help="Contact laws, separated by commas.")
@click.option("--speed", type=float, help="Constant platen speed in m/s.  [default: as fast as is accurate]")
@click.option("--max-strain", type=float, default=0.01, show_default=True, help="Axial strain at which to end.")
@folder_options
@threads_option("Models (and threads in a model) at a time.")
@portable_option
@click.option("--quick", is_flag=True, help=f"A small specimen, seconds: {QUICK[2]} grains in 20 x 50 mm.")
def compare(
    *, grains: int | None, seed: int, laws: str, speed: float | None, max_strain: float, out: Path, restart: bool,
    overwrite: bool, threads: Threads, quick: bool,
) -> None:  # fmt: skip
    """Compress one rock specimen to failure under several contact laws, and compare them.

    Writes report.html, comparison.png, cracks_LAW.png, summary.json, curves.csv and run.json, and for each law a folder
    with its curves, cracks.csv, and grains.pvd and cracks.pvd for ParaView. The specimen and the parameters are those
    of a published study (docs/validation.md). A law whose run fails does not touch the others.
    """
    width, height, count = QUICK if quick else SAMPLE
    with refusing():
        names = list(dict.fromkeys(name.strip() for name in laws.split(",")))
        chosen = {name: law_named(name) for name in names}
        loading = Adaptive() if speed is None else Constant(speed=speed)
        test = UniaxialCompression(loading=loading, maximum_strain=max_strain)
        tessellator = Voronoi(grains=count if grains is None else grains, seed=seed)
        specimen = Specimen(tessellator.tessellate(rectangle(width, height)), ROCK)
    arguments = {
        "grains": tessellator.grains, "seed": seed, "laws": ",".join(names), "speed": speed, "max_strain": max_strain,
        "threads": threads, "quick": quick, "portable": is_portable(),
    }  # fmt: skip
    parameters = {
        "region": {"width": width, "height": height},
        "tessellator": described(tessellator),
        "material": described(ROCK),
        "contact_points": described(specimen.contact_points),
        "protocol": described(test),
        "laws": {name: described(law) for name, law in chosen.items()},
    }
    about = {"command": {"name": "compare", "arguments": arguments}, "parameters": parameters}
    with writing_to(out, restart, overwrite, about) as claim:
        with progress_bars() as progress:
            comparison = compare_laws(
                specimen, chosen, test, threads=threads, checkpoint=claim,
                observers=lambda name: [ProgressBar(progress, name), VtkWriter(claim.path / name)],
            )  # fmt: skip
        comparison.write(claim.path, {"seed": seed, "parameters": parameters})
        sample = {**described(tessellator), "width": written(width, "m"), "height": written(height, "m")}
        comparison.write_report(claim.path / "report.html", record={"sample": sample, "versions": versions()})
        click.echo(comparison)
        tell_certificate(comparison.results)
        finished(claim)
    if comparison.failed:
        raise click.ClickException(f"{len(comparison.failed)} of {len(chosen)} laws failed")
