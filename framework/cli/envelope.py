"""The command that finds the strength of a rock over confinement."""

from __future__ import annotations

from pathlib import Path

import click

from grainlaw.cli.law_copy import copied
from grainlaw.cli.law_file import find_law_and_files
from grainlaw.cli.lists import numbers_of, seeds_of
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
from grainlaw.cli.table1 import LAWS, QUICK, ROCK, SAMPLE, law_named
from grainlaw.compiler.cache import is_portable
from grainlaw.engine.thread_count import Threads
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.loading import Adaptive, Constant
from grainlaw.parameter import ParameterError
from grainlaw.protocols import BiaxialCompression
from grainlaw.runs.record import described
from grainlaw.specimen import Specimen
from grainlaw.studies.envelope import Test, strength_envelope
from grainlaw.units import MPa


@click.command()
@click.option("--law", default="cohesive-crack", show_default=True, help=f"One of {', '.join(LAWS)}, or FILE.py:LAW.")
@click.option("--confinement", default="0,1,2,3,4", show_default=True, help="Confinements in MPa, with commas between.")
@click.option("--seeds", default="1", show_default=True, help="Seeds of the grains, with commas between.")
@click.option("--grains", type=int, help=f"Number of Voronoi grains.  [default: {SAMPLE[2]}]")
@click.option("--speed", type=float, help="Constant platen speed in m/s.  [default: as fast as is accurate]")
@click.option("--max-strain", type=float, default=0.01, show_default=True, help="Axial strain at which to end.")
@folder_options
@threads_option("Tests (and threads in a test) at a time.")
@portable_option
@click.option("--quick", is_flag=True, help=f"A small specimen: {QUICK[2]} grains in 20 x 50 mm.")
def envelope(
    *, law: str, confinement: str, seeds: str, grains: int | None, speed: float | None, max_strain: float, out: Path,
    restart: bool, overwrite: bool, threads: Threads, quick: bool,
) -> None:  # fmt: skip
    """Compress a rock specimen under several confinements, and fit Mohr-Coulomb and Hoek-Brown to the peaks.

    Writes envelope.png and summary.json: confinement, peak_stress, cohesion, friction_angle (degrees), ucs, slope, and
    their 95 % intervals. The specimen and the parameters are those of a published study (docs/validation.md).
    """
    width, height, count = QUICK if quick else SAMPLE
    pressures = [value * MPa for value in numbers_of("confinement", confinement)]
    numbers = seeds_of(seeds)
    with refusing():
        chosen, files = find_law_and_files(law) if ".py" in law else (law_named(law), [])
        loading = Adaptive() if speed is None else Constant(speed=speed)
        test = BiaxialCompression(confinement=max(pressures), loading=loading, maximum_strain=max_strain)
        tests = {p: BiaxialCompression(confinement=p, loading=loading, maximum_strain=max_strain) for p in pressures}
        if len(tests) < 2:
            raise ParameterError(f"--confinement = {confinement} is not allowed, it must name at least two")
        tessellators = {seed: Voronoi(grains=count if grains is None else grains, seed=seed) for seed in numbers}
        specimens = {seed: Specimen(t.tessellate(rectangle(width, height)), ROCK) for seed, t in tessellators.items()}
    arguments = {
        "law": law, "confinement": confinement, "seeds": seeds, "grains": tessellators[numbers[0]].grains,
        "speed": speed, "max_strain": max_strain, "threads": threads, "quick": quick, "portable": is_portable(),
    }  # fmt: skip
    parameters = {
        "region": {"width": width, "height": height},
        "tessellator": described(tessellators[numbers[0]]),
        "material": described(ROCK),
        "protocol": described(test),
        "law": described(chosen),
    }
    about = {"command": {"name": "envelope", "arguments": arguments}, "parameters": parameters}
    with writing_to(out, restart, overwrite, about) as claim:
        arguments["law"], claim.about["law_files"] = copied(law, files, claim.path)
        with progress_bars() as progress:
            found = strength_envelope(
                specimens, chosen, pressures, tests.__getitem__, threads=threads, checkpoint=claim,
                observers=lambda key: [ProgressBar(progress, _name(key))],
            )  # fmt: skip
        found.write(claim.path, {"seeds": numbers, "parameters": parameters})
        click.echo(found)
        tell_certificate({_name(key): result for key, result in found.results.items()})
        finished(claim)
    if found.failed:
        raise click.ClickException(f"{len(found.failed)} of {len(found.failed) + len(found.results)} tests failed")


def _name(test: Test) -> str:
    return f"{test[1] / MPa:g} MPa, seed {test[0]}"
