"""A component by itself as files: its curves as a picture, and what it was made with."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from grainlaw.results.files import file_name, writable_folder, write_atomically
from grainlaw.results.tables import write_json
from grainlaw.runs.record import origin


def write_picture(folder: Path, kind: str, reference: str, figure: Any, record: Mapping[str, Any]) -> str:
    """Write ``KIND_NAME.png`` and ``.json``, named as on the command line; returns where, in words."""
    try:
        file = writable_folder(folder) / f"{kind}_{file_name(reference.rpartition(':')[2])}.png"
        write_atomically(file, lambda path: figure.savefig(path, dpi=110))
        write_json(file.with_suffix(".json"), {**record, **origin()})
    except OSError as error:
        raise click.ClickException(str(error)) from None
    return f"written to {file} and {file.with_suffix('.json').name}"
