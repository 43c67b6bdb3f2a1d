"""The command that finds the strength of a rock over confinement."""

from __future__ import annotations

import math
import os
from pathlib import Path

import click

from grainlaw.cli.law_file import LawReferenceError, find_law
from grainlaw.cli.running import FAILURES, ProgressBar, check_threads, described, progress_bars, versions
from grainlaw.cli.table1 import LAWS, QUICK, ROCK, SAMPLE, law_named
from grainlaw.compiler.cache import compile_portably
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.parameter import ParameterError
from grainlaw.protocols import BiaxialCompression
from grainlaw.results.files import writable_folder
from grainlaw.runs.envelope import strength_envelope
from grainlaw.specimen import Specimen
from grainlaw.units import MPa


@click.command()
@click.option("--law", default="cohesive-crack", show_default=True, help=f"One of {', '.join(LAWS)}, or FILE.py:LAW.")
@click.option("--confinement", default="0,1,2,3,4", show_default=True, help="Confinements in MPa, with commas between.")
@click.option("--seeds", default="1", show_default=True, help="Seeds of the grains, with commas between.")
@click.option("--grains", type=int, help=f"Number of Voronoi grains.  [default: {SAMPLE[2]}]")
@click.option("--speed", type=float, default=0.05, show_default=True, help="Platen speed in m/s.")
@click.option("--max-strain", type=float, default=0.01, show_default=True, help="Axial strain at which to end.")
@click.option("--out", type=click.Path(path_type=Path), default="out", show_default=True, help="Folder to write to.")
@click.option("--threads", type=int, help="Tests (and threads in a test) at a time.  [default: all cores]")
@click.option("--portable", is_flag=True, help="The same bits on every processor, for some more time.")
@click.option("--quick", is_flag=True, help=f"A small specimen: {QUICK[2]} grains in 20 x 50 mm.")
def envelope(
    *, law: str, confinement: str, seeds: str, grains: int | None, speed: float, max_strain: float, out: Path,
    threads: int | None, quick: bool, portable: bool,
) -> None:  # fmt: skip
    """Compress a rock specimen under several confinements, and fit Mohr-Coulomb and Hoek-Brown to the peaks.

    Writes envelope.png and summary.json: confinement, peak_stress, cohesion, friction_angle (degrees), ucs, slope, and
    their 95 % intervals. The specimen and the parameters are those of a published study (docs/validation.md).
    """
    width, height, count = QUICK if quick else SAMPLE
    pressures = [value * MPa for value in _numbers("confinement", confinement)]
    numbers = _seeds(seeds)
    try:
        if portable:
            compile_portably()
        chosen = find_law(law) if ".py" in law else law_named(law)
        check_threads(threads)
        test = BiaxialCompression(confinement=max(pressures), speed=speed, maximum_strain=max_strain)
        tests = {p: BiaxialCompression(confinement=p, speed=speed, maximum_strain=max_strain) for p in pressures}
        if len(tests) < 2:
            raise ParameterError(f"--confinement = {confinement} is not allowed, it must name at least two")
        tessellators = {seed: Voronoi(grains=count if grains is None else grains, seed=seed) for seed in numbers}
        specimens = {seed: Specimen(t.tessellate(rectangle(width, height)), ROCK) for seed, t in tessellators.items()}
        folder = writable_folder(out)
        with progress_bars() as progress:
            found = strength_envelope(
                specimens, chosen, pressures, tests.__getitem__, threads=threads,
                observers=lambda key: [ProgressBar(progress, f"{key[1] / MPa:g} MPa, seed {key[0]}")],
            )  # fmt: skip
        first = tessellators[numbers[0]]
        record = {
            "seeds": numbers,
            "versions": versions(),
            "parameters": {
                "region": {"width": width, "height": height},
                "tessellator": described(first),
                "material": described(ROCK),
                "protocol": described(test),
                "law": described(chosen),
            },
        }
        found.write(folder, record)
    except LawReferenceError as error:
        raise click.BadParameter(str(error)) from None
    except FAILURES as error:
        raise click.ClickException(str(error)) from None
    click.echo(found)
    click.echo(f"\nwritten to {os.fspath(folder)}{os.sep}: envelope.png, summary.json")


def _seeds(text: str) -> list[int]:
    numbers = _numbers("seeds", text)
    if not all(number.is_integer() for number in numbers):
        raise click.BadParameter(f"--seeds = {text} is not allowed, it must be whole numbers with commas between")
    return [int(number) for number in numbers]


def _numbers(name: str, text: str) -> list[float]:
    """The numbers of a list with commas, each once. Raises click.BadParameter."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        raise click.BadParameter(f"--{name} = {text} is not allowed, it must be numbers with commas between") from None
    if not all(map(math.isfinite, numbers)) or len(set(numbers)) < len(numbers):
        raise click.BadParameter(f"--{name} = {text} is not allowed, it must be finite numbers, each once")
    return numbers
