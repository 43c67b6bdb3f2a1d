"""The command that finds the strength of a rock over confinement."""

from __future__ import annotations

from pathlib import Path
from typing import Any, cast

import attrs
import click

from grainlaw.cli.answers import answer, json_option
from grainlaw.cli.configuration import CONFIG, configured, write_config
from grainlaw.cli.law_copy import copied_files
from grainlaw.cli.running import (
    GivenOptions,
    contents,
    model_options,
    numbers_of,
    portable_option,
    refusing,
    seeds_of,
    tell_works,
    threads_option,
)
from grainlaw.cli.sections import gathered, with_options
from grainlaw.cli.study import ending
from grainlaw.cli.study_file import SEED, case_of
from grainlaw.compiler.cache import is_portable
from grainlaw.engine.thread_count import AUTO, Threads
from grainlaw.fields import ParameterError
from grainlaw.protocols import BiaxialCompression
from grainlaw.runs.record import described, recorded
from grainlaw.studies.envelope import StrengthEnvelope
from grainlaw.studies.store import Store
from grainlaw.studies.study import Study
from grainlaw.units import MPa

TEST, CONFINEMENT = "biaxial-compression", "confinement"


@click.command()
@model_options
@click.option("--confinement", default="0,1,2,3,4", show_default=True, help="Confinements in MPa, with commas between.")
@click.option("--seeds", help="Seeds of the grains, with commas between.  [default: one, that of the sample]")
@click.option("--speed", type=float, help="Constant platen speed in m/s.  [default: as fast as is accurate]")
@click.option("--max-strain", type=float, help="Axial strain at which to end.  [default: 0.01]")
@click.option(
    "--out", type=click.Path(path_type=Path), default="out", show_default=True,
    help="Folder of the study, new or of this command.",
)  # fmt: skip
@threads_option("Tests at a time, one thread each.")
@portable_option
@click.option("--quick", is_flag=True, help="A small specimen.")
@json_option
def envelope(
    *, given: GivenOptions, confinement: str, seeds: str | None, speed: float | None, max_strain: float | None,
    out: Path, threads: Threads, quick: bool,
) -> None:  # fmt: skip
    """Compress a rock specimen under several confinements, and fit Mohr-Coulomb and Hoek-Brown to the strengths.

    Writes envelope.png, config.toml and summary.json: confinement, strength, cohesion, friction_angle (degrees), ucs,
    slope, and their 95 % intervals. Specimen, rock and law are given as for grainlaw test biaxial-compression; others
    are those of a published study (docs/validation.md). Each test ends at the first failure.

    The folder holds a study: what is finished is kept, and the same call goes on. A call with other options adds its
    tests, and writes its own envelope.png and summary.json in the place of the last.
    """
    pressures, numbers = [value * MPa for value in numbers_of("confinement", confinement)], seeds and seeds_of(seeds)
    options = {
        ("test", "until"): "failure", ("test", CONFINEMENT): max(pressures), ("test", "maximum_strain"): max_strain,
        ("test", "loading"): None if speed is None else {"type": "constant", "speed": speed},
    }  # fmt: skip
    with refusing():
        if len(pressures) < 2:
            raise ParameterError(f"--confinement = {confinement} is not allowed, it must name at least two")
        sections = gathered(given.config, given.options, given.assignments)
        chosen = configured(TEST, with_options(sections, options), quick)
        pressed = cast(BiaxialCompression, chosen.protocol)
        for pressure in pressures:  # what cannot be is refused before any work
            attrs.evolve(pressed, confinement=pressure)
        levels: dict[str, list] = {CONFINEMENT: pressures}
        if SEED in chosen.sections["sample"]:  # grains of a file have none
            levels = {SEED: numbers or [chosen.sections["sample"][SEED]], **levels}
        elif numbers:
            raise ParameterError(f"--seeds = {seeds} is not allowed, these grains have no seed")
        places = {SEED: ("sample", SEED), CONFINEMENT: ("test", CONFINEMENT)}
        case = case_of(chosen.sections, {name: places[name] for name in levels})
        study = Study(case, **levels)
        Store(out, about={"factors": [*levels]})  # refuses another folder before it writes there
    arguments = {"config": CONFIG, "confinement": confinement, "seeds": seeds, "threads": threads,
                 "portable": is_portable()}  # fmt: skip
    parameters = {
        "sample": case.sections["sample"], "material": described(chosen.specimen.material),
        "protocol": described(chosen.protocol), "law": described(chosen.law),
    }  # fmt: skip
    about: dict[str, Any] = {"command": {"name": "envelope", "arguments": arguments}, "parameters": parameters}
    with ending(study, out):
        there, copies = copied_files(chosen, chosen.sections, out)
        write_config(out / CONFIG, TEST, there)
        with recorded(out, about | copies):
            table = study.run(out, workers=None if threads == AUTO else threads)
        found = StrengthEnvelope(table)
        found.write(out, {"seeds": levels.get(SEED), "parameters": parameters})
        answer(found, folder=str(out), **found.summary)
        tell_works(chosen.specimen.cite)
        click.echo(f"\n{contents(out)}")
    if table.failed:
        raise click.ClickException(f"{len(table.failed)} of {len(table)} tests failed")
