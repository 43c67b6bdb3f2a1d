"""The command that shows a contact law alone."""

from __future__ import annotations

from pathlib import Path

import click

from grainlaw.cli.law_file import LawReferenceError, find_law
from grainlaw.cli.table1 import LAWS, law_named
from grainlaw.results.files import file_name, writable_folder, write_atomically
from grainlaw.results.tables import write_json
from grainlaw.runs.record import described, fingerprints, origin, own_sources
from grainlaw.workbench.characteristics import characteristics
from grainlaw.workbench.plot import plot_law


@click.command(
    help=f"""Show a contact law: strengths, displacements at failure and work as a table, and curves as law_NAME.png;
what it was made with goes to law_NAME.json.

LAW is one of {", ".join(LAWS)}, with the values of a published rock, or FILE.py:LAW, an instance in the file or a class
whose parameters all have defaults. The file is run."""
)
@click.argument("law", metavar="LAW")
@click.option("--out", type=click.Path(path_type=Path), default="out", show_default=True, help="Folder to write to.")
def law(*, law: str, out: Path) -> None:
    try:
        chosen = find_law(law) if ".py" in law else law_named(law)
        table, figure = characteristics(chosen), plot_law(chosen)
    except (LawReferenceError, TypeError, ValueError) as error:
        raise click.BadParameter(str(error)) from None
    try:
        file = writable_folder(out) / f"law_{file_name(law.rpartition(':')[2])}.png"
        write_atomically(file, lambda path: figure.savefig(path, dpi=110))
        record = {"law": described(chosen), "fingerprint": fingerprints(chosen), "sources": own_sources(chosen)}
        write_json(file.with_suffix(".json"), {**record, **origin()})
    except OSError as error:
        raise click.ClickException(str(error)) from None
    click.echo(table)
    click.echo(f"\nwritten to {file} and {file.with_suffix('.json').name}")
