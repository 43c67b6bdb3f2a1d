"""The sample of the paper as ``grainlaw paper`` has it: the table of docs/paper.md.

python tests/validation/paper_study.py [--write | --check]
"""

from functools import cache, partial
from tempfile import TemporaryDirectory

from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.cli.paper_numbers import Paper, macroscopic
from grainlaw.cli.paper_runs import BRITTLE, CONSISTENT, PRINTED, SEEDS, specimen, study
from grainlaw.cli.table1 import LAWS
from grainlaw.cli.verify import Joint

QUANTITIES = (
    "E* (GPa)", "nu*", "UCS (MPa)", "UCS by the line (MPa)", "slope of the line", "cohesion (MPa)",
    "friction angle (deg)",
)  # fmt: skip


@cache
def rows():
    with TemporaryDirectory(prefix="paper-") as folder:
        table = study(quick=False, full=False).run(folder, quiet=True)
        elastic = gl.elastic_properties(specimen(SEEDS[0]), LAWS["linear"])
        return {
            words: cells for words, *cells in macroscopic(Paper(Joint([], [], None, None, {}), table, elastic, {}, {}))
        }


def quantity(name):
    return rows()[name]


TABLES = [
    Table(
        page=DOCS / "paper.md",
        name="paper: sample",
        columns=("", "paper", "statics", PRINTED, CONSISTENT, BRITTLE),
        rows={name: partial(quantity, name) for name in QUANTITIES},
        firm=(PRINTED, CONSISTENT, BRITTLE),
    )
]

if __name__ == "__main__":
    main(TABLES)
