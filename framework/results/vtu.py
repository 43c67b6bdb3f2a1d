"""One .vtu file: a mesh with its arrays, and field data: texts and numbers on the whole file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

import meshio

Fields = Mapping[str, str | float | Sequence[str]]  #: by name: a text, a number, or several texts

GRID = "<UnstructuredGrid>\n"


def write_vtu(path: Path, mesh: meshio.Mesh, fields: Fields) -> None:
    """Write a mesh; the field data, which meshio cannot write, are put in. Raises OSError."""
    mesh.write(path, file_format="vtu")
    before, grid, after = path.read_text(encoding="ascii").partition(GRID)
    entries = "".join(_entry(name, value) for name, value in fields.items())
    path.write_text(f"{before}{grid}<FieldData>\n{entries}</FieldData>\n{after}", encoding="ascii")


def _entry(name: str, value: str | float | Sequence[str]) -> str:
    """Texts are the codes of their letters in UTF-8, each text with a 0 at its end."""
    if isinstance(value, (int, float)):
        return _array(name, "Float64", 1, repr(float(value)))
    texts = [value] if isinstance(value, str) else value
    codes = " ".join(str(code) for text in texts for code in (*text.encode("utf-8"), 0))
    return _array(name, "String", len(texts), codes)


def _array(name: str, kind: str, count: int, content: str) -> str:
    about = f'type="{kind}" Name={quoteattr(name)} NumberOfTuples="{count}" format="ascii"'
    return f"<DataArray {about}>\n{content}\n</DataArray>\n"
