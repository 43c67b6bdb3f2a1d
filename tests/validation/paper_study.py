"""The sample of the paper as docs/paper/paper.py has it, and what calibrations have found: docs/tables/paper.md.

python tests/validation/paper_study.py [--write | --check]
"""

import sys
from functools import cache, partial

from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.cli.default_rock import LAWS

sys.path.insert(0, str(DOCS / "paper"))
from joint import Joint
from paper_calibration import parameters, stored, targets_met
from paper_numbers import Paper, macroscopic
from paper_runs import BREAKING, SEEDS, specimen, study

QUANTITIES = (
    "E* (GPa)", "nu*", "UCS (MPa)", "UCS by the line (MPa)", "slope of the line", "cohesion (MPa)",
    "friction angle (deg)",
)  # fmt: skip


@cache
def rows():
    table = study(quick=False, full=False).run(progress=False)
    elastic = gl.elastic_properties(specimen(SEEDS[0]), LAWS["linear"])
    paper = Paper(Joint([], [], None, None, {}), table, elastic, {}, {})
    return {words: cells for words, *cells in macroscopic(paper)}


def quantity(name):
    return rows()[name]


PAGE = DOCS / "tables/paper.md"


def stored_table(name, made):
    head, *rows = made(stored())
    columns, cells = ("", *head[1:]), {words: entries for words, *entries in rows}
    return Table(page=PAGE, name=name, columns=columns, rows={n: partial(cells.get, n) for n in cells})


TABLES = [
    stored_table("paper: calibrated parameters", parameters),
    stored_table("paper: calibrated", targets_met),
    Table(
        page=PAGE,
        name="paper: sample",
        columns=("", "paper", "statics", *BREAKING),
        rows={name: partial(quantity, name) for name in QUANTITIES},
        firm=BREAKING,
    ),
]

if __name__ == "__main__":
    main(TABLES)
