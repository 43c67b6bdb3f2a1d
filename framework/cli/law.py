"""The command that shows a contact law alone."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import click

from grainlaw.cli.answers import answer, json_option
from grainlaw.cli.default_rock import LAWS, law_or_file
from grainlaw.cli.running import completed
from grainlaw.engine.model import prepared
from grainlaw.results.files import file_name, writable_folder, write_atomically
from grainlaw.results.tables import write_json
from grainlaw.runs.record import described, origin, own_sources
from grainlaw.workbench.characteristics import characteristics


@click.command(
    help=f"""Show a contact law: strengths, displacements at failure and work as a table, and curves as law_NAME.png;
what it was made with goes to law_NAME.json.

LAW is one of {", ".join(LAWS)}, with the values of a published rock, or FILE.py:LAW, an instance in the file or a class
whose parameters all have defaults. The file is run, and its picture is law_FILE_LAW.png."""
)
@click.argument("law", metavar="LAW", shell_complete=completed(LAWS))
@click.option("--out", type=click.Path(path_type=Path), default="out", show_default=True, help="Folder to write to.")
@json_option
def law(*, law: str, out: Path) -> None:
    from grainlaw.workbench.law_figure import plot_law  # loads matplotlib

    try:
        chosen = law_or_file(law)
        table, figure = characteristics(chosen), plot_law(chosen)
    except (TypeError, ValueError) as error:
        raise click.BadParameter(str(error)) from None
    record = {"law": described(chosen), "fingerprint": prepared(chosen).compiled.key, "sources": own_sources(chosen)}
    where = write_picture(out, "law", law, figure, record)
    answer(f"{table}\n\n{where}", **attrs.asdict(table))


def write_picture(folder: Path, kind: str, reference: str, figure: Any, record: Mapping[str, Any]) -> str:
    """Write ``KIND_NAME.png`` and ``.json``, of what a file has with the name of the file; returns where, in words."""
    source, _, name = reference.rpartition(":")
    try:
        file = (
            writable_folder(folder) / f"{kind}_{file_name('_'.join([Path(source).stem] * bool(source) + [name]))}.png"
        )
        write_atomically(file, lambda path: figure.savefig(path, dpi=110))
        write_json(file.with_suffix(".json"), {**record, **origin()})
    except OSError as error:
        raise click.ClickException(str(error)) from None
    return f"written to {file} and {file.with_suffix('.json').name}"
