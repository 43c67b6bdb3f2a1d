"""Specimens crushed to 5 % of strain, with a membrane and without: a table of docs/tables/contacts.md.

python tests/validation/membrane_study.py [--write | --check]
"""

import sys
from functools import cache, partial

import numpy as np
from paper_sample import SEEDS
from study_tables import DOCS, Table, each, main

from grainlaw.units import MPa, um

sys.path.insert(0, str(DOCS / "examples"))
from crushed_sample import FULL, LAW, QUICK, drift, mobilised, rankine, residual, run

MEMBRANES = (2, 5, 10)  #: MPa
SHORTER = (1.0, 0.97, 0.94)  #: time steps, over the default


@cache
def crushed(size, pressure, seed, share):
    """A specimen under a membrane (Pa), and what its observer saw."""
    return run(*size, pressure, seed=seed, time_step_factor=share, threads=1)


def row(size, pressure, seeds=SEEDS, shares=(1.0,)):
    """Cells of the runs of all seeds and time steps."""
    found = [crushed(size, pressure, seed, share) for seed in seeds for share in shares]
    left = [residual(result.curves) for result, _ in found]
    width = np.ptp(found[0][0].specimen.grains.region.bounds[:, 0])
    moved = [abs(drift(result, result.frames[-1])) / width * 100 for result, _ in found]
    return (
        each((result.summary["strength"] / MPa for result, _ in found), ".0f"),
        each((one / MPa for one in left), ".1f"),
        f"{rankine(pressure, LAW.residual_friction_angle) / MPa:.1f}",
        each((mobilised(one, pressure) for one in left), ".0f") if pressure else "-",
        each(moved, ".1f") + " %",
        f"{max(watcher.deepest for _, watcher in found) / um:.0f}",
        f"{max(result.summary['energy_error'] for result, _ in found):.0e}",
    )


TABLES = [
    Table(
        page=DOCS / "tables/contacts.md",
        name="membrane",
        columns=(
            "", "strength (MPa)", "residual (MPa)", "Rankine (MPa)", "friction angle (deg)", "moved sideways",
            "deepest overlap (um)", "error of the energies",
        ),
        rows={
            "755 grains, seed 1": partial(row, FULL, 0.0, (1,)),
            **{f"120 grains, {p} MPa, seeds 1 / 2 / 3": partial(row, QUICK, p * MPa) for p in MEMBRANES},
            "120 grains, 10 MPa, seed 1, time step 1 / 0.97 / 0.94": partial(row, QUICK, 10 * MPa, (1,), SHORTER),
        },
        firm=("strength (MPa)", "Rankine (MPa)"),
        checked=("120 grains, 2 MPa, seeds 1 / 2 / 3",),
    )
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES)
