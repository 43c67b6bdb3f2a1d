"""Pages of HTML by templates (jinja2), without scripts: text, tables and figures in one file."""

from __future__ import annotations

import base64
import functools
import io
import os
from collections.abc import Sequence
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from grainlaw.results.files import write_text

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure

ROOT = Path(__file__).parents[2]  #: of the package, from which templates are named


class Cell(str):
    """Text of a table cell, with the name of its style."""

    style: str

    def __new__(cls, text: str, style: str = "number") -> Cell:
        cell = super().__new__(cls, text)
        cell.style = style
        return cell


def write_page(file: str | os.PathLike[str], template: str | Path, **content: Any) -> None:
    """Write a template of the package (``"studies/report.html"``), or of a path, with what it shows. Raises OSError.

    A table is rows of texts, the first of each its heading; a cell with a style is a :class:`Cell`. Figures are
    embedded.
    """
    folder, name = (str(template.parent), template.name) if isinstance(template, Path) else ("", template)
    write_text(Path(file), _templates(folder).get_template(name).render(content))


@functools.cache
def _templates(folder: str) -> Any:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    made = Environment(
        loader=FileSystemLoader([*([folder] if folder else []), ROOT]), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    made.filters |= {"image": _image, "link": quote}
    made.globals |= {"written_by": _written_by}
    return made


def _image(figure: Figure) -> str:
    """A figure as the address of an image."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=120)
    return f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode('ascii')}"


def _written_by() -> str:
    return f"grainlaw {version('grainlaw')}, {datetime.now():%Y-%m-%d %H:%M}"


def headed(lines: Sequence[Sequence[str]]) -> dict[str, Any]:
    """Rows and heads of a table, from lines of which the first is the heads."""
    head, *rows = lines
    return {"rows": rows, "heads": head}
