"""The main job: samples of a rock compressed under several contact laws."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import click

from grainlaw.cli import running
from grainlaw.cli.answers import answer, json_option
from grainlaw.cli.components import refuse_unknown
from grainlaw.cli.configuration import CONFIG, Configuration, configured
from grainlaw.cli.default_rock import LAWS, QUICK, SAMPLE, law_named
from grainlaw.cli.law_copy import copied_files
from grainlaw.cli.minerals import table_of
from grainlaw.cli.sections import Sections, gathered, toml, with_options
from grainlaw.compiler.cache import is_portable
from grainlaw.contact import Laws
from grainlaw.declared import parameters_of
from grainlaw.engine.device import Gpu
from grainlaw.engine.thread_count import Threads
from grainlaw.fields import ParameterError
from grainlaw.observation import Observer
from grainlaw.results.certificate import warnings_of
from grainlaw.results.files import file_name, write_text
from grainlaw.results.paraview import write_script
from grainlaw.results.result import Result
from grainlaw.results.vtk import VtkWriter
from grainlaw.runs.claim import Claim
from grainlaw.runs.progress import Progress, RunBar
from grainlaw.runs.record import described, versions
from grainlaw.specimen import Specimen
from grainlaw.studies.comparison import Comparison, Key, folder_name, in_words
from grainlaw.studies.comparison import compare as compare_laws

COMPARED = "linear,mohr-coulomb,cohesive-crack"
SEEDS = "1,2,3"  #: of one rock; three samples differ by up to a quarter of the mean
TEST = "uniaxial-compression"


@click.command()
@click.option("--grains", type=int, help=f"Number of Voronoi grains.  [default: {SAMPLE[2]}]")
@click.option("--seeds", help=f"Seeds of the grains, with commas between: a sample for each.  [default: {SEEDS}]")
@click.option("--seed", type=int, help="One seed: one sample.")
@click.option("--laws", default=COMPARED, show_default=True, help="Contact laws, separated by commas.")
@click.option("--speed", type=float, help="Constant platen speed in m/s.  [default: as fast as is accurate]")
@click.option("--max-strain", type=float, help="Axial strain at which to end.  [default: 0.01]")
@click.option("--config", type=click.Path(path_type=Path, dir_okay=False), help="TOML file with parameters.")
@click.option("--set", "assignments", metavar="KEY=VALUE", multiple=True, help="One parameter; can be repeated.")
@running.folder_options
@running.threads_option("Models (and threads in a model) at a time.", default=None)
@running.device_option
@running.portable_option
@click.option("--quick", is_flag=True, help=f"A small specimen, seconds: {QUICK[2]} grains in 20 x 50 mm.")
@json_option
def compare(
    *, grains: int | None, seeds: str | None, seed: int | None, laws: str, speed: float | None,
    max_strain: float | None, config: Path | None, assignments: tuple[str, ...], out: Path, restart: bool,
    overwrite: bool, threads: Threads | None, device: str | None, quick: bool,
) -> None:  # fmt: skip
    """Compress samples of a rock to failure under several contact laws, and compare the laws: means and ranges.

    Writes report.html, comparison.png, cracks_LAW.png, summary.json, curves.csv and run.json, and for each run a folder
    with its curves, cracks.csv, and grains.pvd and cracks.pvd for ParaView; show_in_paraview.py opens all of them
    there. The samples and the parameters are those of a published study (docs/validation.md) if --config and --set, as
    of grainlaw test, give no others. Each law takes those parameters of [law] that it has; its type does not count.
    A run that fails does not touch the others.
    """
    if seed is not None and seeds is not None:
        raise click.UsageError("--seed and --seeds are not allowed together: give the seeds with commas between")
    given = str(seed) if seed is not None else seeds
    asked = None if given is None else running.seeds_of(given)
    loading = None if speed is None else {"type": "constant", "speed": speed}
    options = {
        ("sample", "grains"): grains, ("test", "loading"): loading, ("test", "maximum_strain"): max_strain,
        ("numerics", "threads"): threads,
    }  # fmt: skip
    with running.refusing():
        names = list(dict.fromkeys(name.strip() for name in laws.split(",")))
        own = gathered(config, {}, assignments)
        own.get("law", {}).pop("type", None)
        rows = _configurations(names, with_options(own, options), asked, quick)
    first = next(iter(rows.values()))
    numbers = list(dict.fromkeys(number for _, number in rows))
    specimens = {number: rows[names[0], number].specimen for number in numbers}
    compared = {name: rows[name, numbers[0]].law for name in names}
    with running.refusing():
        for law in compared.values():
            attrs.evolve(first, law=law).check()
        does_steps = running.device_of(device)
    arguments = {
        "grains": grains, "seeds": given, "laws": ",".join(names), "speed": speed, "max_strain": max_strain,
        "threads": threads, "quick": quick, "portable": is_portable(), "config": CONFIG if own else None,
    }  # fmt: skip
    parameters = {
        "sample": {key: value for key, value in first.sections["sample"].items() if key != "seed"},
        "material": described(first.specimen.material),
        "contact_points": described(first.specimen.contact_points),
        "protocol": described(first.protocol),
        "laws": {name: described(law) for name, law in compared.items()},
    }
    about = {"command": {"name": "compare", "arguments": arguments}, "parameters": parameters}
    with running.writing_to(out, restart, overwrite, about) as claim:
        if own:
            kept, copies = copied_files(first, own, claim.path)
            claim.about.update(copies)
            write_text(claim.path / CONFIG, toml(kept))
        comparison = _compared(specimens, compared, first, does_steps, claim)
        made = {"seed": numbers[0]} if len(numbers) == 1 else {"seeds": numbers}
        comparison.write(claim.path, {**made, "parameters": parameters})
        write_script(claim.path, _rows(comparison))
        record = {"sample": first.sections["sample"], "versions": versions()}
        comparison.write_report(claim.path / "report.html", record=record, files=running.linked(claim.path))
        doubts = list(warnings_of(comparison.named))
        answer(comparison, folder=str(claim.path), **comparison.content, doubts=doubts)
        running.tell_works(specimens[numbers[0]].cite)
        running.finished(claim)
    if comparison.failed:
        count, what = len(comparison.failed) + len(comparison.results), "laws" if len(numbers) == 1 else "runs"
        raise click.ClickException(f"{len(comparison.failed)} of {count} {what} failed")


def _configurations(
    names: list[str], sections: Sections, seeds: list[int] | None, quick: bool
) -> dict[tuple[str, int], Configuration]:
    """The first law on each sample, and every law on the first; raises ParameterError.

    Without seeds they are those of the file, or ``SEEDS``; grains that need no seed are one sample, number 1.
    """
    parameters = sections.get("law", {})
    for name in names:
        if ".py" in name:
            raise ParameterError(
                f"compare: '{name}' is a law of yours, and compare takes those of grainlaw; write FILE.toml with "
                f'[test] type = "{TEST}" and [vary] law = {json.dumps(names)}, "sample.seed" = [1, 2, 3]: '
                "grainlaw study FILE.toml (docs/studies.md)"
            )
        law_named(name)  # refuses what there is not
    fields = {name: [row[0] for row in parameters_of(type(law))] for name, law in LAWS.items()}
    any_of_them = dict.fromkeys(field for own in fields.values() for field in own)
    refuse_unknown("law", parameters, any_of_them)
    beside = {key: table_of(entry, f"laws.{key}") for key, entry in sections.get("laws", {}).items()}
    for key, table in beside.items():
        if "type" not in table:
            refuse_unknown(f"laws.{key}", table, any_of_them)

    def of(name: str, sample: Mapping[str, Any]) -> Configuration:
        def its(table: Mapping[str, Any]) -> dict[str, Any]:
            return {key: value for key, value in table.items() if key in fields[name]}

        laws = {key: table if "type" in table else its(table) for key, table in beside.items()}
        law = {"type": name, **its(parameters)}
        return configured(TEST, {**sections, "law": law, "laws": laws, "sample": dict(sample)}, quick)

    sample = sections.get("sample", {})
    alone = of(names[0], sample).sections["sample"].get("seed")
    if seeds is None and alone is not None and "seed" not in sample:
        seeds = running.seeds_of(SEEDS)
    samples = {alone or 1: sample} if seeds is None else {seed: {**sample, "seed": seed} for seed in seeds}
    found = {(names[0], seed): of(names[0], each) for seed, each in samples.items()}
    first, grains = next(iter(samples.items()))
    return found | {(name, first): of(name, grains) for name in names[1:]}


def _compared(
    specimens: Mapping[int, Specimen], laws: Mapping[str, Laws], chosen: Configuration, device: Gpu | None, claim: Claim
) -> Comparison:
    """Each law on each sample; of one sample the runs have the names of their laws alone."""
    numerics = chosen.numerics
    options: dict[str, Any] = {**numerics.step_options, "threads": numerics.threads, "frames": numerics.frames}
    with Progress(stays=True, speaks=True) as progress:

        def watch(run: Key) -> list[Observer]:
            label = run if isinstance(run, str) else f"{run[0]} {run[1]}"
            writer = VtkWriter(claim.path / folder_name(run), numerics.frames, zones=numerics.zones)
            return [RunBar(progress.bar(label)), writer]

        one = next(iter(specimens.values()))
        return compare_laws(
            one if len(specimens) == 1 else specimens, laws, chosen.protocol, observers=watch, checkpoint=claim,
            device=device, progress=False, **options,
        )  # fmt: skip


def _rows(comparison: Comparison) -> list[list[tuple[str, str, Result]]]:
    """Names, folders and results of the runs: a column for each law, a row for each sample."""
    found = [(run, (in_words(run), file_name(folder_name(run)), result)) for run, result in comparison.items()]
    of_seed = (
        [row for run, row in found if isinstance(run, str) or run[1] == seed] for seed in comparison.seeds or [0]
    )
    return [rows for rows in of_seed if rows]
