"""The table of a study as text, and in forms for other programs."""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from grainlaw.fields import ParameterError
from grainlaw.quantity import Quantity, aligned
from grainlaw.results.files import write_atomically, write_text
from grainlaw.results.tables import csv_text, data_frame, latex, latex_heading, latex_table, plain
from grainlaw.short_form import html_table
from grainlaw.studies.statistics import label, level

if TYPE_CHECKING:
    import pandas
    import xarray

    from grainlaw.studies.table import Table


LINES = 40  #: rows that are printed
MOST_EMPTY = 1_000_000  #: places of an array that may have no case


def as_text(table: Table) -> str:
    """Aligned rows, doubts about the cases that finished, and the reasons of those that failed."""
    doubted = "".join(f"\n{words}" for words in doubts(table))
    reasons = "".join(
        f"\n{label(table.factors, row)}: {row['status']}, {row['reason']}" for row in table.failed[:LINES]
    )
    return aligned(_texts(table), rule=True) + (f"\n{_more(table)}" if _more(table) else "") + doubted + reasons


def doubts(table: Table) -> list[str]:
    """What to doubt in the cases that finished, and in how many: ``3 of 30 cases: the highest stress is the last``."""
    return [f"{len(rows)} of {len(table)} cases: {words}" for words, rows in table.doubts.items()]


def as_html(table: Table) -> str:
    """The same rows for a notebook."""
    heads, *rows = _texts(table)
    last = [line for line in (_more(table), *doubts(table)) if line]
    return html_table([*rows, *([line] for line in last)], heads)


def _more(table: Table) -> str:
    return f"... and {len(table) - LINES} more" if len(table) > LINES else ""


def _texts(table: Table) -> list[list[str]]:
    names = [*table.factors, "status", *table.main]
    rows = [[_text(table, name, table.value(row, name)) for name in names] for row in table.rows[:LINES]]
    return [[table.quantity(name).heading for name in names], *rows]


def _text(table: Table, name: str, value: Any) -> str:
    return level(name, value) if name in table.factors else table.quantity(name).text(value)


def to_pandas(table: Table) -> pandas.DataFrame:
    """The rows as a DataFrame. Raises ParameterError without pandas."""
    return data_frame("Table.to_pandas", _columns(table, table.__getitem__))


def _columns(table: Table, entries: Callable[[str], Any]) -> dict[str, Any]:
    """Columns by name; of lists, as of a number for each cycle, by name_1, name_2 ..., nan where one is short."""
    columns: dict[str, Any] = {}
    for name in table.columns:
        column = entries(name)
        if name not in table.factors and any(isinstance(value, list) for value in column):
            lists = (value if isinstance(value, list) else [] for value in column)
            numbers = itertools.zip_longest(*lists, fillvalue=math.nan)
            columns |= {f"{name}_{k}": np.array(each, float) for k, each in enumerate(numbers, 1)}
        else:
            columns[name] = column
    return columns


def to_latex(table: Table) -> str:
    """All rows as a table for a paper (LaTeX, package booktabs): factors, and the main quantities with three digits."""
    names = [*table.factors, *table.main]
    looks = [table.quantity(name).brief for name in names]
    heads = [latex_heading(look.heading) for look in looks]

    def cell(name: str, look: Quantity, value: Any) -> str:
        return latex(level(name, value) if name in table.factors else look.text(value))

    pairs = list(zip(names, looks, strict=True))
    rows = [[cell(name, look, table.value(row, name)) for name, look in pairs] for row in table.rows]
    return latex_table(heads, rows, "l" * len(table.factors) + "r" * len(table.main))


def to_xarray(table: Table) -> xarray.Dataset:
    """The quantities, with the factors as axes. Raises ParameterError without xarray, and for equal cases."""
    try:
        import xarray  # noqa: F401
    except ImportError:
        raise ParameterError("Table.to_xarray needs xarray: pip install 'grainlaw[study]'") from None
    if not table.factors:
        raise ParameterError("Table.to_xarray: there are no factors to be axes")
    indexed = to_pandas(table).set_index(list(table.factors))
    if not indexed.index.is_unique:
        raise ParameterError("Table.to_xarray: several cases have the same levels")
    cells = math.prod(len(table.levels(name)) for name in table.factors)
    if cells > max(MOST_EMPTY, 2 * len(table)):
        raise ParameterError(
            f"Table.to_xarray: {len(table)} cases would fill an array of {cells:,} places, one for each combination of "
            "levels; to_pandas has a row for each case"
        )
    return indexed.to_xarray()


def write_csv(table: Table, file: str | os.PathLike[str]) -> None:
    """Write the rows, numbers with all their digits. Raises OSError."""
    columns = _columns(table, lambda name: [table.value(row, name) for row in table.rows])
    rows = zip(*columns.values(), strict=True)
    write_text(Path(file), csv_text([map(plain, columns), *(map(_cell, row) for row in rows)]))


def write_parquet(table: Table, file: str | os.PathLike[str]) -> None:
    """Write the rows for other programs. Raises ParameterError without pandas and pyarrow, OSError."""
    frame = to_pandas(table)
    for name in (name for name in frame if frame[name].dtype == object):
        if len({type(value) for value in frame[name] if value is not None}) > 1:  # a column has one kind there
            frame[name] = frame[name].map(lambda value: value if value is None else str(value))
    try:
        write_atomically(Path(file), frame.to_parquet)
    except ImportError:
        raise ParameterError("Table.write_parquet needs pyarrow: pip install 'grainlaw[study]'") from None


def _cell(value: Any) -> str:
    return "" if value is None else repr(float(value)) if isinstance(value, float) else str(plain(value))
