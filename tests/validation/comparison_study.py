"""All laws on the same samples: the tables and figure of docs/comparing-laws.md, by the examples that it shows.

python tests/validation/comparison_study.py [--write | --check]
"""

import sys
from functools import cache, partial

from paper_sample import SEEDS
from study_tables import DOCS, Table, main

sys.path.insert(0, str(DOCS / "examples"))
from compare_laws import COLUMNS, LAWS, SAMPLE, cells, picture, run
from take_apart import VARIANTS


@cache
def tested(name):
    """Results and numbers of a law, by seed."""
    law = (LAWS | VARIANTS)[name]
    return [run({name: law}, *SAMPLE, seed) for seed in SEEDS]


def row(name):
    return cells([numbers[name] for _, numbers in tested(name)])


def figure(file):
    picture([{name: tested(name)[k][0][name] for name in LAWS} for k in range(len(SEEDS))]).savefig(file, dpi=100)


HEADINGS = [heading for heading, *_ in COLUMNS]
TABLES = [
    Table(
        page=DOCS / "comparing-laws.md",
        name=name,
        columns=("law", *HEADINGS),
        rows={law: partial(row, law) for law in laws},
        firm=("peak (MPa)", "E* (GPa)"),
        checked=(checked,),
    )
    for name, laws, checked in (
        ("laws", LAWS, "Camacho-Ortiz"), ("variants of the cohesive crack", VARIANTS, "linear, G/10, 0 deg")
    )
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES, {"compare_laws": figure})
