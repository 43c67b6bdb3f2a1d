"""Tables of results in the documents: made by the studies of this folder, and held to by a slow test.

    python tests/validation/NAME_study.py [--only NAMES] [--write | --check]

prints the tables of a study. ``--write`` puts them into their pages, between the marks that name them, and its figures
into docs/images; ``--check`` makes some rows anew and says where a page has something else.

What breaks is chaotic: a last digit that is rounded otherwise moves the number of cracks. So a study starts itself
again with code and linear algebra that round alike on all processors; the end mark of a table says what else decides
its digits. Where that is the same, the text must be the same. Elsewhere columns that are ``firm`` must agree to
``TOLERANCE``.
"""

import argparse
import os
import platform
import re
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

import attrs
import numpy as np
from PIL import Image

DOCS = Path(__file__).parents[2] / "docs"
ROUNDING = {"GRAINLAW_PORTABLE": "1", "OPENBLAS_CORETYPE": "Haswell"}
TOLERANCE = 0.05  #: of firm numbers elsewhere: rounding moves the peak of a specimen by up to 2 % (confined: 3 %)
TABLE = "<!-- table {} -->\n"


@attrs.frozen(kw_only=True)
class Table:
    """Results in a page, a row for each name."""

    page: Path  #: in docs
    name: str
    columns: Sequence[str]  #: headings; the first is that of the names of rows
    rows: Mapping[str, Callable[[], Sequence[str]]]  #: what makes the cells of a row, by its name
    firm: Sequence[str] = ()  #: columns that depend little on rounding
    #: rows that the slow test makes anew; all if empty, none if None: where each of them takes hours
    checked: Sequence[str] | None = ()

    def row(self, name: str) -> str:
        return f"| {' | '.join([name, *self.rows[name]()])} |"

    @property
    def head(self) -> list[str]:
        return [f"| {' | '.join(self.columns)} |", "|---" * len(self.columns) + "|"]

    def place(self, text: str) -> tuple[str, list[str], str]:
        """What stands in the page before, in, and after the table, from the text of the page."""
        before, mark, rest = text.partition(TABLE.format(self.name))
        assert mark, f"{self.page.name} has no place for the table {self.name}"
        lines, end, after = rest.partition("<!-- end")
        assert end, f"the table {self.name} in {self.page.name} has no end"
        assert "<!--" not in lines, f"the table {self.name} in {self.page.name} has no end"
        return before + mark, lines.splitlines(), after

    def write(self, lines: Sequence[str]) -> None:
        before, _, after = self.place(self.page.read_text("utf-8"))
        made = "\n".join(lines)
        beside = self.page.with_suffix(".part")
        beside.write_text(f"{before}{made}\n<!-- end: {environment()} -->{after.partition('-->')[2]}", encoding="utf-8")
        os.replace(beside, self.page)

    def differences(self, made: Mapping[str, str]) -> list[str]:
        """Where the page has another row, of those made anew, than it should have."""
        _, lines, after = self.place(self.page.read_text("utf-8"))
        shown = {cells(line)[0]: line for line in lines[2:]}
        same_digits = after.partition("-->")[0].strip(": ") == environment()
        found = [f"other head: {lines[:2]}"] if lines[:2] != self.head else []
        found += [f"other rows: {[*shown]}"] if [*shown] != [*self.rows] else []
        for name, line in made.items():
            agree = shown.get(name) == line if same_digits else self._close(shown.get(name, ""), line)
            found += [] if agree else [f"shown {shown.get(name)}\n made {line}"]
        return found

    def _close(self, shown: str, made: str) -> bool:
        places = [self.columns.index(column) for column in self.firm]
        both = [[numbers(cells(line)[place]) for place in places] for line in (shown, made) if line]
        return len(both) == 2 and all(
            len(one) == len(other) and np.allclose(one, other, rtol=TOLERANCE, atol=0)
            for one, other in zip(*both, strict=True)
        )


def cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip()[1:-1].split("|")]


def numbers(cell: str) -> list[float]:
    return [float(number) for number in re.findall(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?", cell)]


def environment() -> str:
    """What decides the last digits beside the code."""
    packages = (f"{name} {version(name)}" for name in ("numba", "numpy", "scipy"))
    return ", ".join([platform.machine(), *packages])


def each(values, form: str = "") -> str:
    """Numbers of one cell."""
    return " / ".join(format(value, form) for value in values)


def main(tables: Sequence[Table], figures: Mapping[str, Callable[[Path], object]] | None = None) -> None:
    """The command line of a study; ``figures`` writes each to a file."""
    if ROUNDING.items() - os.environ.items():
        sys.exit(subprocess.run(sys.orig_argv, env=os.environ | ROUNDING).returncode)
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", default="", help="pattern in the names of tables and figures")
    group = parser.add_mutually_exclusive_group()
    group.add_argument("--write", action="store_true")
    group.add_argument("--check", action="store_true")
    options = parser.parse_args()
    wrong = []
    for table in tables:
        if not re.search(options.only, table.name):
            continue
        names = table.rows
        if options.check and table.checked != ():
            names = table.checked or ()
        print(f"\n{table.name}\n", *table.head, sep="\n", flush=True)
        made = {}
        for name in names:
            made[name] = table.row(name)
            print(made[name], flush=True)
        if options.write:
            table.write([*table.head, *made.values()])
        if options.check:
            wrong += [f"{table.page.name}, table {table.name}: {one}" for one in table.differences(made)]
    if options.write:
        for name, figure in (figures or {}).items():
            if re.search(options.only, name):
                file = DOCS / "images" / f"{name}.png"
                figure(file)
                smaller = (
                    Image.open(file).convert("RGB").quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
                )
                smaller.save(file, optimize=True)
    if wrong:
        sys.exit("\n".join(["", *wrong, "", f"to make the tables anew: python {sys.argv[0]} --write"]))
