"""Elastic moduli of the sample: the table of docs/tables/full-sample.md.

python tests/validation/elastic_study.py [--write | --check]
"""

from functools import cache, partial

import attrs
from paper_sample import SEEDS, sample, summaries
from study_tables import DOCS, Table, each, main

import grainlaw as gl
from grainlaw.cli.default_rock import LAWS
from grainlaw.protocols import Platens, UniaxialCompression
from grainlaw.runs.parallel import Run
from grainlaw.units import GPa

LAW = LAWS["linear"]
MODULUS, POISSON = "apparent_modulus", "apparent_poisson"
#: what, share of k_s in k_n, platens, and the prototype's value
CASES = {
    "E\\* (GPa)": (MODULUS, 0.9, Platens.SMOOTH, "53.3"),
    "nu\\*": (POISSON, 0.9, Platens.SMOOTH, "0.281"),
    "E\\*, rough platens": (MODULUS, 0.9, Platens.ROUGH, "53.8"),
    "nu\\*, rough platens": (POISSON, 0.9, Platens.ROUGH, "0.287"),
    "E\\*, k_s/k_n = 0.5": (MODULUS, 0.5, Platens.SMOOTH, "52.0"),
    "E\\*, k_s/k_n = 0.25": (MODULUS, 0.25, Platens.SMOOTH, "50.2"),
}


@cache
def tested(ratio, platens):
    """Summaries by seed, by tests in the time loop."""
    law = attrs.evolve(LAW, ks=ratio * LAW.kn)
    test = UniaxialCompression(maximum_strain=1e-3, samples=200, platens=platens)
    return summaries({seed: Run(sample(seed), law, test) for seed in SEEDS})


def row(name, ratio, platens, prototype):
    found = tested(ratio, platens)
    law = attrs.evolve(LAW, ks=ratio * LAW.kn)
    statics = [gl.elastic_properties(sample(seed), law) for seed in SEEDS] if platens is Platens.SMOOTH else []
    unit, form = (GPa, ".2f") if name == MODULUS else (1, ".4f")
    return (
        prototype,
        each((found[seed][name] / unit for seed in SEEDS), form),
        each((getattr(one, name) / unit for one in statics), form),
    )


TABLES = [
    Table(
        page=DOCS / "tables/full-sample.md",
        name="elastic",
        columns=("", "prototype", "here, seeds 1 / 2 / 3", "statics, same grains"),
        rows={name: partial(row, *case) for name, case in CASES.items()},
        firm=("here, seeds 1 / 2 / 3", "statics, same grains"),
    )
]

if __name__ == "__main__":
    main(TABLES)
