"""The command that finds elastic properties of a specimen without a test."""

from __future__ import annotations

from pathlib import Path

import attrs
import click

from grainlaw.cli.answers import answer, json_option
from grainlaw.cli.configuration import configured
from grainlaw.cli.running import GivenOptions, model_options, refusing
from grainlaw.cli.sections import assign, gathered
from grainlaw.fields import ParameterError
from grainlaw.results.files import writable_folder
from grainlaw.results.tables import write_json
from grainlaw.runs.elastic_properties import BOUNDARIES, elastic_properties
from grainlaw.runs.record import origin


@click.command()
@model_options
@click.option(
    "--boundary", type=click.Choice(list(BOUNDARIES)), default="static", show_default=True,
    help="What the rim follows in the stiffness tensor: a uniform strain or a uniform stress.",
)  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="JSON file to write.")
@click.option("--quick", is_flag=True, help="A small specimen.")
@json_option
def elastic(*, given: GivenOptions, boundary: str, out: Path | None, quick: bool) -> None:
    """Find modulus, Poisson's ratio and stiffness tensor of a rock specimen, without a test.

    They come from static solutions, in less than a second: modulus and Poisson's ratio are those of uniaxial
    compression between smooth platens. The specimen, its rock and its law are given as for grainlaw test, in the
    sections [sample], [rock] and [law]; of the others only numerics.refinement counts.
    """
    with refusing():
        sections = gathered(given.config, given.options, ())
        sections.pop("test", None)  # of a file that grainlaw test has written
        for assignment in given.assignments:
            assign(sections, assignment)
        if "test" in sections:
            raise ParameterError("elastic: there is no test, and no parameter of one to set")
        chosen = configured("uniaxial-compression", sections, quick)
        found = elastic_properties(chosen.specimen, chosen.law, boundary=boundary)
    content = attrs.asdict(found) | {"stiffness": found.stiffness.tolist()}
    answer(found, **content)
    if out is None:
        return
    made_of = {name: section for name, section in chosen.sections.items() if name != "test"}
    made_of["numerics"] = {"refinement": chosen.numerics.refinement}
    with refusing():
        write_json(writable_folder(out.parent) / out.name, {**content, "configuration": made_of, **origin()})
    click.echo(f"\nwritten to {out}")
