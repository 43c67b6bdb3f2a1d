"""How the peak of the Mohr-Coulomb sample moves with numerics: the table of docs/tables/full-sample.md.

    python tests/validation/strength_study.py [--write | --check]

Each row changes one thing against the first.
"""

from functools import partial

import attrs
from paper_sample import SEEDS, STRENGTH, sample, strength, summaries
from study_tables import DOCS, Table, each, main

import grainlaw as gl
from grainlaw.cli.default_rock import LAWS
from grainlaw.protocols import UniaxialCompression
from grainlaw.runs.parallel import Run

TEST = UniaxialCompression()
CASES = {
    "base: default loading, Gauss points": {},
    "half the rate of loading": {"test": attrs.evolve(TEST, loading=TEST.loading.slower())},
    "time step halved": {"time_step_factor": 0.5},
    "zones refined once": {"refinement": 1},
    "contact points at the ends": {"contact_points": gl.EndPoints()},
    "contact points inset 0.1 mm": {"contact_points": gl.InsetPoints(inset=1e-4)},
}


def row(test=TEST, time_step_factor=1.0, **options):
    runs = {seed: Run(sample(seed, **options), LAWS["mohr-coulomb"], test) for seed in SEEDS}
    found = [one for _, one in sorted(summaries(runs, time_step_factor=time_step_factor).items())]
    return (
        *strength(found),
        each((one["kinetic_ratio"] for one in found), ".0e"),
        each((one["imbalance"] * 100 for one in found), ".1f") + " %",
    )


TABLES = [
    Table(
        page=DOCS / "tables/full-sample.md",
        name="strength",
        columns=("case", *STRENGTH, "kinetic ratio", "imbalance"),
        rows={name: partial(row, **case) for name, case in CASES.items()},
        firm=("peak (MPa)", "mean", "strain at peak (%)"),
        checked=("base: default loading, Gauss points", "half the rate of loading"),
    )
]

if __name__ == "__main__":
    main(TABLES)
