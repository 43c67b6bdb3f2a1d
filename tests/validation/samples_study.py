"""Three laws on twenty samples: the table of docs/tables/laws.md and the figure of docs/studies.md, by its example.

    python tests/validation/samples_study.py [--write | --check]

Some six minutes of one core.
"""

import sys
from functools import cache, partial
from tempfile import TemporaryDirectory

import numpy as np
from scipy.stats import ttest_ind
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.units import MPa

sys.path.insert(0, str(DOCS / "examples"))
from law_study import LAWS, case

SEEDS = range(1, 21)
PAIRS = [("cohesive crack", "Mohr-Coulomb"), ("Munjiza", "Mohr-Coulomb"), ("Munjiza", "cohesive crack")]


@cache
def store():
    return TemporaryDirectory(prefix="samples-")


def tested(*laws):
    """The table of some laws; what the store has is not run again."""
    return gl.Study(case, law={law: LAWS[law] for law in laws}, seed=SEEDS).run(store().name, progress=False)


def mean(law):
    [found] = tested(law).means()["strength"]
    low, high = (end / MPa for end in found.interval)
    return f"{found.mean / MPa:.1f}", f"{low:.1f} to {high:.1f}", f"{found.deviation / MPa:.1f}", *["-"] * 5


def pair(one, other):
    """The difference, and what would be known of it without pairs."""
    table = tested(other, one)
    [found] = table.paired("law")["strength"]
    peaks = [table.where(law=law)["strength"] / MPa for law in (one, other)]
    low, high = (end / MPa for end in found.interval)
    yield from (f"{found.mean / MPa:.1f}", f"{low:.1f} to {high:.1f}", f"{found.deviation / MPa:.1f}")
    yield from (f"{100 * found.share:+.1f} %", f"{found.higher} of {found.count}", f"{found.p_value:.2g}")
    yield from (f"{ttest_ind(*peaks).pvalue:.2g}", f"{np.corrcoef(*peaks)[0, 1]:.2f}")


def joined(file):
    tested(*LAWS).plot_paired("strength", "law").savefig(file, dpi=110)


ROWS = {law: partial(mean, law) for law in LAWS} | {f"{a} - {b}": partial(pair, a, b) for a, b in PAIRS}
TABLES = [
    Table(
        page=DOCS / "tables/laws.md",
        name="three laws on twenty samples",
        columns=("UCS", "MPa", "95 %", "deviation", "share", "higher in", "p", "p without pairs", "correlation"),
        rows=ROWS,
        firm=("MPa",),
        checked=("Mohr-Coulomb",),
    )
]

if __name__ == "__main__":
    main(TABLES, {"law_study": joined})
