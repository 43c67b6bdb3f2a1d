"""The main job: samples of a rock compressed under several contact laws."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click

from grainlaw.cli.lists import seeds_of
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
from grainlaw.contact import ContactLaw
from grainlaw.engine.thread_count import Threads
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.loading import Adaptive, Constant
from grainlaw.observation import Observer
from grainlaw.protocols import UniaxialCompression
from grainlaw.results.vtk import VtkWriter
from grainlaw.runs.claim import Claim
from grainlaw.runs.comparison import Comparison
from grainlaw.runs.comparison import compare as compare_laws
from grainlaw.runs.record import described, versions
from grainlaw.runs.samples import SampleComparison, compare_samples, folder_name
from grainlaw.specimen import Specimen
from grainlaw.unit_text import written

COMPARED = "linear,mohr-coulomb,cohesive-crack"
SEEDS = "1,2,3"  #: of one rock; three samples differ by up to a quarter of the mean


@click.command()
@click.option("--grains", type=int, help=f"Number of Voronoi grains.  [default: {SAMPLE[2]}]")
@click.option("--seeds", help=f"Seeds of the grains, with commas between: a sample for each.  [default: {SEEDS}]")
@click.option("--seed", type=int, help="One seed: one sample.")
@click.option("--laws", default=COMPARED, show_default=True, help="Contact laws, separated by commas.")
@click.option("--speed", type=float, help="Constant platen speed in m/s.  [default: as fast as is accurate]")
@click.option("--max-strain", type=float, default=0.01, show_default=True, help="Axial strain at which to end.")
@folder_options
@threads_option("Models (and threads in a model) at a time.")
@portable_option
@click.option("--quick", is_flag=True, help=f"A small specimen, seconds: {QUICK[2]} grains in 20 x 50 mm.")
def compare(
    *, grains: int | None, seeds: str | None, seed: int | None, laws: str, speed: float | None, max_strain: float,
    out: Path, restart: bool, overwrite: bool, threads: Threads, quick: bool,
) -> None:  # fmt: skip
    """Compress samples of a rock to failure under several contact laws, and compare the laws: means and ranges.

    Writes report.html, comparison.png, cracks_LAW.png, summary.json, curves.csv and run.json, and for each run a folder
    with its curves, cracks.csv, and grains.pvd and cracks.pvd for ParaView. The samples and the parameters are those
    of a published study (docs/validation.md). A run that fails does not touch the others.
    """
    if seed is not None and seeds is not None:
        raise click.UsageError("--seed and --seeds are not allowed together: give the seeds with commas between")
    given = seeds or SEEDS if seed is None else str(seed)
    numbers = seeds_of(given)
    width, height, count = QUICK if quick else SAMPLE
    with refusing():
        names = list(dict.fromkeys(name.strip() for name in laws.split(",")))
        chosen = {name: law_named(name) for name in names}
        loading = Adaptive() if speed is None else Constant(speed=speed)
        test = UniaxialCompression(loading=loading, maximum_strain=max_strain)
        tessellators = {k: Voronoi(grains=count if grains is None else grains, seed=k) for k in numbers}
        specimens = {k: Specimen(t.tessellate(rectangle(width, height)), ROCK) for k, t in tessellators.items()}
    tessellator, specimen = tessellators[numbers[0]], specimens[numbers[0]]
    arguments = {
        "grains": tessellator.grains, "seeds": given, "laws": ",".join(names), "speed": speed,
        "max_strain": max_strain, "threads": threads, "quick": quick, "portable": is_portable(),
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
        comparison = _compared(specimens, chosen, test, claim, threads)
        made = {"seed": numbers[0]} if len(numbers) == 1 else {"seeds": numbers}
        comparison.write(claim.path, {**made, "parameters": parameters})
        sample = {**described(tessellator), "width": written(width, "m"), "height": written(height, "m")}
        comparison.write_report(claim.path / "report.html", record={"sample": sample, "versions": versions()})
        click.echo(comparison)
        tell_certificate(comparison.named if isinstance(comparison, SampleComparison) else comparison.results)
        finished(claim)
    if comparison.failed:
        count, what = len(comparison.failed) + len(comparison.results), "laws" if len(numbers) == 1 else "runs"
        raise click.ClickException(f"{len(comparison.failed)} of {count} {what} failed")


def _compared(
    specimens: Mapping[int, Specimen], laws: Mapping[str, ContactLaw], test: UniaxialCompression, claim: Claim,
    threads: Threads,
) -> Comparison | SampleComparison:  # fmt: skip
    """Each law on each sample; of one sample the runs have the names of their laws alone."""
    with progress_bars() as progress:

        def watch(folder: str, label: str) -> list[Observer]:
            return [ProgressBar(progress, label), VtkWriter(claim.path / folder)]

        if len(specimens) == 1:
            (specimen,) = specimens.values()
            return compare_laws(
                specimen, laws, test, threads=threads, checkpoint=claim, observers=lambda law: watch(law, law)
            )
        return compare_samples(
            specimens, laws, test, threads=threads, checkpoint=claim,
            observers=lambda run: watch(folder_name(run), f"{run[0]} {run[1]}"),
        )  # fmt: skip
