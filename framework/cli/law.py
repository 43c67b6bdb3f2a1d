"""The command that shows a contact law alone."""

from __future__ import annotations

from pathlib import Path

import click

from grainlaw.cli.default_rock import LAWS, law_with_files
from grainlaw.cli.law_file import LawReferenceError
from grainlaw.cli.pictures import write_picture
from grainlaw.engine.model import prepared
from grainlaw.runs.record import described, own_sources
from grainlaw.workbench.characteristics import characteristics


@click.command(
    help=f"""Show a contact law: strengths, displacements at failure and work as a table, and curves as law_NAME.png;
what it was made with goes to law_NAME.json.

LAW is one of {", ".join(LAWS)}, with the values of a published rock, or FILE.py:LAW, an instance in the file or a class
whose parameters all have defaults. The file is run."""
)
@click.argument("law", metavar="LAW")
@click.option("--out", type=click.Path(path_type=Path), default="out", show_default=True, help="Folder to write to.")
def law(*, law: str, out: Path) -> None:
    from grainlaw.workbench.law_figure import plot_law  # loads matplotlib

    try:
        chosen, _ = law_with_files(law)
        table, figure = characteristics(chosen), plot_law(chosen)
    except (LawReferenceError, TypeError, ValueError) as error:
        raise click.BadParameter(str(error)) from None
    record = {"law": described(chosen), "fingerprint": prepared(chosen).compiled.key, "sources": own_sources(chosen)}
    where = write_picture(out, "law", law, figure, record)
    click.echo(f"{table}\n\n{where}")
