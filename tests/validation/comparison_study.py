"""All laws on the same samples: tables of docs/tables/laws.md and variants.md, figures.

They are made by the examples that the pages show.

python tests/validation/comparison_study.py [--write | --check]
"""

import sys
from functools import cache, partial
from tempfile import TemporaryDirectory

import numpy as np
from study_tables import DOCS, Table, main

from grainlaw.units import GPa, MPa

sys.path.insert(0, str(DOCS / "examples"))
from compare_laws import LAWS, study
from take_apart import VARIANTS

COLUMNS = {  # heading: column, unit, digits
    "peak (MPa)": ("strength", MPa, ".1f"), "strain at peak (%)": ("failure_strain", 0.01, ".3f"),
    "E* (GPa)": ("apparent_modulus", GPa, ".2f"), "tensile cracks": ("tensile_cracks", 1, ".0f"),
    "shear cracks": ("shear_cracks", 1, ".0f"), "lost in opening (J/m)": ("lost_opening", 1, ".1f"),
    "lost in slip (J/m)": ("lost_slip", 1, ".1f"),
}  # fmt: skip


@cache
def store():
    return TemporaryDirectory(prefix="comparison-")


def tested(laws):
    """The table of some laws; what the store has is not run again."""
    return study(laws).run(store().name, progress=False)


def row(law):
    """Mean and range of each column; a dash for what does not exist."""
    table = tested({law: (LAWS | VARIANTS)[law]})
    for column, unit, form in COLUMNS.values():
        values = table[column] / unit
        if np.isnan(values).any():  # as the strength of a law that does not break
            yield "-"
            continue
        mean, low, high = (f"{value:{form}}" for value in (values.mean(), values.min(), values.max()))
        yield mean if low == high else f"{mean} ({low} to {high})"


def curves(file):
    tested(LAWS).plot_curves("law").savefig(file, dpi=100)


def cracks(file):
    tested(LAWS).plot_cracks(columns=5).savefig(file, dpi=100)


TABLES = [
    Table(
        page=DOCS / page,
        name=name,
        columns=("law", *COLUMNS),
        rows={law: partial(row, law) for law in laws},
        firm=("peak (MPa)", "E* (GPa)"),
        checked=(checked,),
    )
    for page, name, laws, checked in (
        ("tables/laws.md", "laws", LAWS, "Camacho-Ortiz"),
        ("tables/variants.md", "variants of the cohesive crack", VARIANTS, "linear, G/10, 0 deg"),
    )
]

if __name__ == "__main__":
    main(TABLES, {"compare_laws": curves, "compare_laws_cracks": cracks})
