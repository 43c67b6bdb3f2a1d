"""Results for other programs: files of JSON and CSV, and tables of pandas, which is imported where it is used."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from grainlaw.fields import ParameterError
from grainlaw.results.files import without_nan, write_text

if TYPE_CHECKING:
    import pandas

    from grainlaw.engine.state import State

PLACE, PLANE, TENSOR = ("x", "y"), ("_x", "_y"), ("_xx", "_yy", "_xy")


def write_json(file: Path, content: Mapping[str, Any]) -> None:
    """Write nested names and values, null for what is not a finite number. Raises OSError."""
    write_text(file, json.dumps(without_nan(content), indent=2, allow_nan=False) + "\n")


def lines(columns: Iterable[np.ndarray]) -> str:
    """Rows of numbers, each with the fewest digits from which the same number is read again."""
    return "".join(",".join(map(repr, row)) + "\n" for row in zip(*(c.tolist() for c in columns), strict=True))


def as_csv(table: Mapping[str, np.ndarray]) -> str:
    """Columns by name as CSV, with a line of names."""
    return csv_text([map(plain, table)]) + lines(table.values())


def csv_text(rows: Iterable[Iterable[Any]]) -> str:
    """Rows as CSV."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def plain(text: Any) -> Any:
    """A text that no spreadsheet takes for a formula: ' before one that begins as such; other things as they are."""
    if not isinstance(text, str):
        return text
    text = text.replace("\r", " ")  # which ends a line for some
    return f"'{text}" if text.startswith(("=", "+", "-", "@", "\t", " =")) else text


def write_curves(
    file: Path, curves: Mapping[tuple[Any, ...], Mapping[str, np.ndarray]], names: Sequence[str] = ("law",)
) -> None:
    """Write the curves of several runs below each other; first columns with ``names`` tell them apart. Raises OSError.

    ``curves`` are by the entries of these columns.
    """
    columns = list(dict.fromkeys(name for recorded in curves.values() for name in recorded))
    rows = [[*map(plain, [*names, *columns])]]
    for entries, recorded in curves.items():
        count = len(next(iter(recorded.values()), ()))
        table = [recorded.get(column, np.full(count, np.nan)).tolist() for column in columns]
        rows += ([*map(plain, entries), *map(repr, row)] for row in zip(*table, strict=True))
    write_text(file, csv_text(rows))


def breaks(state: State) -> dict[str, np.ndarray]:
    """Contact points that have broken, in this order, by column name: what :class:`Cracks` has and does not change.

    Position (x, y) in m and orientation (rad from the x axis) are those on the undeformed specimen.
    """
    point = state.breaks.in_order()
    mesh, count = state.mesh, len(state.bonds)
    interface = state.bonds.order[point % count] if count else point
    ends = mesh.nodes[mesh.interfaces[interface]]
    first, second = ends[:, 0], ends[:, 1]
    near = np.where(point < count, 0.25, 0.75)[:, None]
    x, y = (first + near * (second - first)).T
    along = second - first
    grain_a, grain_b = mesh.interface_grains[interface].T
    return {
        "time": state.broken_time[point], "point": point, "grain_a": grain_a, "grain_b": grain_b, "x": x, "y": y,
        "orientation": np.arctan2(along[:, 1], along[:, 0]) % np.pi, "length": state.contact_lengths[point],
        "mode": state.broken_mode[point], "spent": state.broken_work[point],
        "inside": (mesh.interface_kind[interface] == 1).astype(int), "kind": mesh.interface_kind[interface],
    }  # fmt: skip


def data_frame(where: str, columns: Mapping[str, Any]) -> pandas.DataFrame:
    """Arrays by name, one row for each entry; those with several numbers for each become several columns.

    ``position`` becomes x and y, ``grains`` grain_a and grain_b, ``phases`` alike, other vectors end in _x and _y,
    tensors in _xx, _yy and _xy. Raises ParameterError, which begins with ``where``, without pandas.
    """
    try:
        import pandas
    except ImportError:
        raise ParameterError(f"{where} needs pandas: pip install 'grainlaw[study]'") from None
    flat: dict[str, Any] = {}
    for name, values in columns.items():
        rows = np.asarray(values)
        if rows.ndim == 1:
            flat[name] = rows
        else:
            flat |= dict(zip(_names(name, rows.shape[1]), rows.T, strict=True))
    return pandas.DataFrame(flat)


NEGATIVE = re.compile(r"(?<![^\s(])(-\d[\d.]*(?:e[+-]?\d+)?)")  #: a number, after a blank or at the begin
SYMBOL = re.compile(r"(E|nu)(\*?)_(\w+)")  #: of a modulus, in the words of a measure
ESCAPED = str.maketrans(
    {each: f"\\{each}" for each in "%&#_{}"} | {"$": r"\$", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
    | {"\\": r"\textbackslash{}", "°": r"$^\circ$", "µ": r"\textmu{}", "√": r"$\surd$", "<": "$<$", ">": "$>$"}
)  # fmt: skip


def latex_table(heads: Sequence[str], rows: Iterable[Sequence[str]], places: str) -> str:
    """A tabular of LaTeX with the rules of booktabs, of cells in LaTeX; ``places`` as l and r of its columns."""
    head, *body = (" & ".join(row) + r" \\" for row in (heads, *rows))
    ends = rf"\begin{{tabular}}{{{places}}}", r"\end{tabular}"
    return "\n".join([ends[0], r"\toprule", head, r"\midrule", *body, r"\bottomrule", ends[1]])


def latex_lines(lines: Sequence[Sequence[str]]) -> str:
    """The texts of a printed table, its headings first, as a table for a paper; the first column has words."""
    if not lines:
        return latex_table([], [], "")
    heads, *rows = lines
    cells = [[latex_heading(first), *map(latex, others)] for first, *others in rows]
    return latex_table([*map(latex_heading, heads)], cells, "l" + "r" * (len(heads) - 1))


def latex_heading(text: str) -> str:
    """Words with their unit in brackets."""
    words, bracket, unit = text.removesuffix(")").rpartition(" (")
    return f"{latex(words)} ({latex_unit(unit)})" if bracket and text.endswith(")") else latex(text)


def latex(text: str) -> str:
    """Words or a number in LaTeX: what has a meaning there is escaped, the symbol of a modulus and a minus are set."""
    if text == "-":
        return "--"
    if NEGATIVE.match(text):
        return NEGATIVE.sub(r"$\1$", text.translate(ESCAPED))
    symbol = SYMBOL.match(text)
    if symbol is None:
        return text.translate(ESCAPED)
    letter = "E" if symbol[1] == "E" else r"\nu"
    return f"${letter}{'^*' * bool(symbol[2])}_{{{symbol[3]}}}${text[symbol.end() :].translate(ESCAPED)}"


def latex_unit(unit: str) -> str:
    """A unit in LaTeX, its powers raised."""
    if unit == "deg":
        return r"$^\circ$"
    return re.sub(r"(?<=[A-Za-z])(-?\d)", r"$^{\1}$", unit.translate(ESCAPED))


def _names(name: str, count: int) -> list[str]:
    if name == "position":
        return list(PLACE)
    if name in ("grains", "phases"):
        return [f"{name[:-1]}_{side}" for side in "ab"]
    return [name + ending for ending in (PLANE if count == 2 else TENSOR)]
