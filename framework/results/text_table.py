"""Columns of numbers in a text file of any laboratory: what separates them, the decimal sign, names and units."""

from __future__ import annotations

import codecs
import csv
import itertools
import os
import re
from collections.abc import Sequence
from pathlib import Path

import attrs
import numpy as np

from grainlaw.fields import ParameterError
from grainlaw.unit_text import factor_into, is_unit

LARGEST = 500_000_000  #: bytes of a file
SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", None: "blanks"}  #: in the order in which they are tried


def _number(decimal: str, thousands: str) -> re.Pattern[str]:
    """A number: one sign alone in it is the decimal one, so that 1,234 is not a thousand."""
    d, t = re.escape(decimal), re.escape(thousands)
    grouped = rf"[1-9]\d{{0,2}}({t}\d{{3}})+{d}\d*|[1-9]\d{{0,2}}({t}\d{{3}}){{2,}}"
    return re.compile(rf"[+-]?({grouped}|\d+{d}?\d*|{d}\d+)([eE][+-]?\d+)?")


NUMBERS = {".": _number(".", ","), ",": _number(",", ".")}
EMPTY = ("", "-", "--", "nan", "na", "n/a", "null")  #: a place without a number
RUN = 5  #: rows of numbers below each other: fewer may belong to the lines above them
TRIED = 200  #: rows by which a form is judged
BRACKETED = re.compile(r"[^()\[\]]+[(\[][^)\]]*[)\]]")  #: a name and a unit in brackets
WITH_UNIT = (  #: a name and its unit, as people write them over a column
    re.compile(r"(?P<name>.*?)\s*\[\s*(?P<unit>[^\[\]]*?)\s*\]"),
    re.compile(r"(?P<name>.*?)\s*\(\s*(?P<unit>[^()]*?)\s*\)"),
    re.compile(r"(?P<name>.+?)\s*,\s*(?P<unit>\S+)"),
    re.compile(r"(?P<name>.+?)\s+in\s+(?P<unit>\S+)"),
    re.compile(r"(?P<name>.+?)\s*/\s*(?P<unit>[^\s/]+)"),
    re.compile(r"(?P<name>.+?)[\s_]+(?P<unit>[^\W\d_]{2,}|%)"),
)
USUAL = ("MPa", "kPa", "GPa", "Pa", "kN", "N", "mm", "um", "cm", "s", "min", "h")
SPELT = {each.lower(): each for each in USUAL} | {
    "sec": "s", "secs": "s", "seconds": "s", "hours": "h", "-": "1", "in/in": "1",
    **dict.fromkeys(("µε", "με", "ue", "µstrain", "μstrain", "ustrain", "microstrain", "microstrains"), "um/m"),
    **dict.fromkeys(("mε", "mstrain", "millistrain"), "mm/m"),
}  # fmt: skip


@attrs.frozen(eq=False)
class TextColumn:
    """One column of a file."""

    name: str  #: as it stands over the column, without its unit
    unit: str  #: as ``unit_text`` reads it; empty where none is written
    values: np.ndarray  #: (n,) as they are written; nan where there is none

    @property
    def title(self) -> str:
        """As messages name it."""
        return f"'{self.name}'"


@attrs.frozen(eq=False)
class TextTable:
    """The columns of a file, and in which form they are written."""

    columns: Sequence[TextColumn]
    form: str


def unit_of(text: str) -> str:
    """A unit as a laboratory spells it, in the spelling of ``unit_text``; empty for what is none."""
    text = text.strip().strip("[]()").strip()
    if is_unit(text):
        return text
    return SPELT.get(text.lower(), "")


def in_si(values: np.ndarray, unit: str) -> np.ndarray:
    """Values in a unit, in SI."""
    return values / factor_into(unit)


def read_table(where: str, file: str | os.PathLike[str]) -> TextTable:
    """Read the rows of numbers of a file, with the names and units above them.

    Raises ParameterError, which begins with ``where``, for a file that is no text or has no such rows, and for a place
    in them that is neither empty nor a number where the first rows have numbers.
    """
    lines = _lines(where, file)
    separator, decimal = max(
        itertools.product(SEPARATORS, NUMBERS), key=lambda form: _score(lines, *form)
    )  # of equals the first
    rows = [_cells(line, separator) for line in lines]
    first = _first(rows, decimal)
    if first is None:
        raise ParameterError(f"{where}: {os.fspath(file)} has no two columns of numbers below each other")
    width = len(rows[first])
    above = [row for line in lines[:first] if len(row := _head_cells(line, separator, width)) >= width]
    title = next((cells for row in reversed(rows[:first]) if any(cells := [cell for cell in row if cell])), [])
    if separator == "," and 2 * len(title) == width:
        raise ParameterError(
            f"{where}: {os.fspath(file)} has {len(title)} names ({', '.join(title)}) above {width} columns: is the "
            "comma the decimal sign too? save it with semicolons between the columns"
        )
    names, units = _heads(above, width)
    body = [(k, row) for k, row in enumerate(rows[first:], first + 1) if any(row)]
    columns = []
    for j in range(width):
        if not _is_number(rows[first][j], decimal) and rows[first][j].lower() not in EMPTY:
            continue  # dates, remarks
        values = np.full(len(body), np.nan)
        for i, (line, row) in enumerate(body):
            cell = row[j] if j < len(row) else ""
            if _is_number(cell, decimal):
                values[i] = float(cell.replace("," if decimal == "." else ".", "").replace(decimal, "."))
            elif cell.lower() not in EMPTY:
                raise ParameterError(
                    f"{where}: {os.fspath(file)}, line {line}: {cell[:40]!r} in the column '{names[j]}' is not "
                    "allowed, it must be a number"
                )
        columns.append(TextColumn(names[j], units[j], values))
    sign = "decimal comma" if decimal == "," else "decimal point"
    return TextTable(columns, f"{len(body)} rows, columns separated by {SEPARATORS[separator]}, {sign}")


def _lines(where: str, file: str | os.PathLike[str]) -> list[str]:
    path = Path(file)
    try:
        size = path.stat().st_size
        if size > LARGEST:
            raise ParameterError(f"{where}: {path} has {size:,} bytes, it may have {LARGEST:,}")
        content = path.read_bytes()
    except OSError as error:
        raise ParameterError(f"{where}: {path} cannot be read: {error.strerror}") from None
    if content.startswith((b"PK", b"\xd0\xcf\x11\xe0")):
        raise ParameterError(f"{where}: {path} is a workbook, it must be text: save its sheet as .csv")
    wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    for encoding in ("utf-16",) if wide else ("utf-8-sig", "cp1252", "latin-1"):
        try:
            text = content.decode(encoding)
            break
        except UnicodeDecodeError:
            continue
    else:
        text = ""
    if "\0" in text or not text.strip():
        raise ParameterError(f"{where}: {path} is {'no text' if text.strip() else 'empty'}, it must have columns")
    return text.splitlines()


def _cells(line: str, separator: str | None) -> list[str]:
    try:
        split = line.split() if separator is None else next(csv.reader([line], delimiter=separator), [])
    except csv.Error:  # a line too long for it, which is none of numbers
        split = []
    cells = [cell.strip().strip('"').strip() for cell in split]
    return cells[:-1] if len(cells) > 1 and not cells[-1] else cells  # a separator at the end of the line


def _first(rows: Sequence[Sequence[str]], decimal: str) -> int | None:
    """Where the first rows of numbers below each other begin, as many as ``RUN`` or as there are; None without any."""
    runs: list[tuple[int, int]] = []  # where they begin, and how many rows they have
    for k, row in enumerate(rows):
        if not _balance(row, decimal):
            continue
        begin, count = runs[-1] if runs else (k, 0)
        if begin + count != k or len(rows[begin]) != len(row):
            begin, count = k, 0
        runs.append((begin, count + 1))
        if count + 1 == RUN:
            return begin
    return max(runs, key=lambda run: run[1])[0] if runs else None


def _head_cells(line: str, separator: str | None, width: int) -> list[str]:
    """The cells of a line above the numbers: between blanks, names have blanks of their own."""
    if separator is not None:
        return _cells(line, separator)
    ways = (re.split(r"\s{2,}|\t", line.strip()), BRACKETED.findall(line), line.split())
    return next(([cell.strip() for cell in cells] for cells in ways if len(cells) == width), [])


def _is_number(cell: str, decimal: str) -> bool:
    return NUMBERS[decimal].fullmatch(cell) is not None


def _balance(cells: Sequence[str], decimal: str) -> int:
    """How many more places have a number than have something else; 0 where it is no row of numbers."""
    numbers = sum(_is_number(cell, decimal) for cell in cells)
    others = sum(cell.lower() not in EMPTY for cell in cells) - numbers
    return numbers - others if numbers > 1 and numbers > others else 0


def _score(lines: Sequence[str], separator: str | None, decimal: str) -> int:
    """How well a form fits: numbers less other entries, of rows with the commonest count of columns."""
    middle = len(lines) // 2
    tried = [_cells(line, separator) for line in [*lines[:TRIED], *lines[max(TRIED, middle) :][:TRIED]]]
    counts: dict[int, int] = {}
    for cells in tried:
        counts[len(cells)] = counts.get(len(cells), 0) + _balance(cells, decimal)
    return max(counts.values(), default=0)


def _heads(above: Sequence[Sequence[str]], width: int) -> tuple[list[str], list[str]]:
    """Names and units of the columns: of one line with both, or of a line of names and one of units."""
    plain = [f"column {j + 1}" for j in range(width)]
    if not above:
        return plain, [""] * width
    last = above[-1]
    below = [unit_of(cell) for cell in last[:width]]
    if len(above) > 1 and sum(map(bool, below)) * 2 > sum(map(bool, last[:width])):
        names, units = above[-2], below
    else:
        names, units = last, [""] * width
    found = [_split(name) for name in names[:width]]
    found += [("", "")] * (width - len(found))
    return (
        [name or plain[j] for j, (name, _) in enumerate(found)],
        [units[j] or unit for j, (_, unit) in enumerate(found)],
    )


def _split(text: str) -> tuple[str, str]:
    """A name and the unit beside it."""
    for form in WITH_UNIT:
        match = form.fullmatch(text.strip())
        if match and match["unit"] != "1" and (unit := unit_of(match["unit"])):  # the first of several columns
            return match["name"].strip(), unit
    return text.strip(), ""
