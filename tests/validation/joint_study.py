"""The published model on one joint: table and figures of docs/tables/joint.md, by ``docs/paper/joint.py``.

python tests/validation/joint_study.py [--write | --check]
"""

import json
import math
import sys
import tempfile
from functools import cache, partial
from pathlib import Path

from click.testing import CliRunner
from study_tables import DOCS, Table, main

sys.path.insert(0, str(DOCS / "paper"))
from joint import verify

#: names of the rows of the command, in its order; two of them occur there twice
NAMES = (
    "peak tension (MPa)", "at an opening of (um)", "tension at 5 um (MPa)", "tension at 10 um (MPa)",
    "tension at 20 um (MPa)", "unloading from 5 um (TPa/m)",
    "broken at an opening of, L = 3 (um)", "broken at an opening of, exact L (um)",
    "closing again (TPa/m)", "tension when pulled again (MPa)", "work beyond the rise, L = 3 (J/m2)",
    "work beyond the rise, exact L (J/m2)", "peak shear (MPa)", "at a slip of (um)", "shear at 5 um (MPa)",
    "shear at 10 um (MPa)", "shear at 20 um (MPa)", "broken at a slip of, L = 3 (um)", "residual shear (MPa)",
    "residual shear after reversal (MPa)", "work to the break, L = 3 (J/m2)", "normal stress, least (MPa)",
    "normal stress, largest (MPa)",
)  # fmt: skip


@cache
def verified():
    """The rows of the command, and its figures by name."""
    with tempfile.TemporaryDirectory() as folder:
        done = CliRunner().invoke(verify, ["--out", folder])
        assert done.exit_code == 0, done.output
        table = json.loads((Path(folder) / "verify.json").read_text("utf-8"))["table"]
        figures = {file.stem: file.read_bytes() for file in Path(folder).glob("*.png")}
    assert len(table) == len(NAMES)
    return table, figures


def row(place):
    one = verified()[0][place]
    found = (one[column] for column in ("paper", "theory", "grainlaw"))
    return ["-" if value is None or math.isnan(value) else f"{value:.4f}" for value in found]


def figure(name, file):
    file.write_bytes(verified()[1][name])


TABLES = [
    Table(
        page=DOCS / "tables/joint.md",
        name="joint",
        columns=("", "paper", "theory", "grainlaw"),
        rows={name: partial(row, place) for place, name in enumerate(NAMES)},
        firm=("paper", "theory"),
    )
]

if __name__ == "__main__":
    main(TABLES, {name: partial(figure, name) for name in ("verify_tension", "verify_shear")})
