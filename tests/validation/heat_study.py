"""A granite heated, cooled and crushed: a table of docs/tables/heat.md, by an example.

python tests/validation/heat_study.py [--write | --check]
"""

import sys
from functools import partial

from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.units import GPa, MPa

sys.path.insert(0, str(DOCS / "examples"))
from heated_granite import LAWS, case

TEMPERATURES = (20, 100, 300, 600)
GRAINS, SEED = 60, 1


def row(law, temperature):
    run = case(law, temperature, SEED, GRAINS)
    result = gl.simulate(run.specimen, run.law, run.protocol, threads=1, frames=2)
    found = result.summary
    return (
        str(found.get("thermal_cracks", 0)),
        f"{found['strength'] / MPa:.0f}",
        f"{found['largest_stress'] / MPa:.0f}",
        f"{slope:.0f}" if (slope := found["apparent_modulus"] / GPa) == slope else "-",  # none in pieces
        f"{found.get('heating_kinetic_ratio', 0):.0e}",
        f"{found['energy_error']:.0e}",
    )


TABLES = [
    Table(
        page=DOCS / "tables/heat.md",
        name="heat",
        columns=(
            "bonds, heated to",
            "cracks by heat",
            "first failure (MPa)",
            "largest stress (MPa)",
            "slope (GPa)",
            "kinetic ratio",
            "error of the energies",
        ),
        rows={f"{law}, {t} °C": partial(row, law, t) for law in LAWS for t in TEMPERATURES},
        firm=("first failure (MPa)",),
        checked=("brittle, 20 °C",),
    )
]

if __name__ == "__main__":
    main(TABLES)
