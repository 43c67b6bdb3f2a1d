"""Published rocks and the contact parameters that were found for them: tables of docs/tables/calibration.md.

    python tests/validation/published_rocks_study.py [--write | --check]

shows what is stored; docs/examples/published_rocks.py finds it anew, in two and a half hours of one core.
"""

import json
import sys
from functools import partial

from study_tables import DOCS, Table, main

from grainlaw.calibration.targets import AIMS
from grainlaw.messages import spelled

sys.path.insert(0, str(DOCS / "examples"))
sys.path.insert(0, str(DOCS / "paper"))
from paper_calibration import checked_cell, parameter_cell
from published_rocks import ROCKS, STORED

FOUND = json.loads(STORED.read_text("utf-8"))
UNITS = {"tensile_strength": "Pa", "cohesion": "Pa", "friction_angle": "deg", "mode_i_energy": "J/m2"}


def quantity(rock, name):
    """The target, and what each law gives on fresh seeds."""
    target = ROCKS[rock].given.get(name)
    yield AIMS[name].shown.text(target.value) if target else "-"
    for law in FOUND[rock]:
        yield checked_cell(FOUND[rock][law], name)


def parameter(rock, name):
    """The best value and its interval, by law."""
    yield ""
    for law in FOUND[rock]:
        yield parameter_cell(FOUND[rock][law], name, UNITS[name])


def stiffness(rock):
    yield ""
    for law in FOUND[rock]:
        values = FOUND[rock][law]["parameters"]
        yield f"{values['ks'] / values['kn']:.2f}" if values else "-"


def conflict(rock):
    yield ""
    for law in FOUND[rock]:
        sets = [" and ".join(each["targets"]).replace("_", " ") for each in FOUND[rock][law]["conflicts"]]
        yield "; ".join(sets) or "none"


def cost(rock):
    yield ""
    for law in FOUND[rock]:
        yield f"{FOUND[rock][law]['cpu'] / 3600:.2f}"


def measured(rock):
    """Targets, and what was measured though it was none."""
    checks = (each["name"] for law in FOUND[rock] for each in FOUND[rock][law].get("checks", ()))
    return dict.fromkeys((*ROCKS[rock].given, *checks))


def table(rock):
    rows = {AIMS[name].shown.heading: partial(quantity, rock, name) for name in measured(rock)}
    rows |= {f"contacts: {spelled(name)}": partial(parameter, rock, name) for name in UNITS}
    rows |= {"contacts: ks / kn": partial(stiffness, rock), "targets in conflict": partial(conflict, rock)}
    rows |= {"CPU hours": partial(cost, rock)}
    return Table(
        page=DOCS / "tables/calibration.md", name=f"calibrated: {rock}", columns=("", "target", *FOUND[rock]), rows=rows
    )


TABLES = [table(rock) for rock in ROCKS]

if __name__ == "__main__":
    main(TABLES)
