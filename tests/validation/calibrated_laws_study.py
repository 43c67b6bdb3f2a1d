"""Two laws calibrated to one rock, under tests that they were not calibrated to: a table of docs/tables/laws.md.

    python tests/validation/calibrated_laws_study.py [--write | --check]

Some fifteen minutes of one core.
"""

import sys
from functools import cache, partial

import attrs
import numpy as np
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.calibration.stiffness_search import with_grains
from grainlaw.cli.default_rock import ROCK
from grainlaw.geometry import Voronoi, disc, semi_disc
from grainlaw.protocols import Brazilian, SemiCircularBend, UniaxialCompression, UniaxialTension
from grainlaw.results.standard_measures import Standard
from grainlaw.studies.statistics import difference
from grainlaw.units import MPa, mm

sys.path.insert(0, str(DOCS / "paper"))
from paper_calibration import SEARCHES, piece, stored
from paper_runs import BRITTLE, CONSISTENT

SEEDS = range(101, 121)
FOUND = stored()
TESTS = {
    "compression": UniaxialCompression(stop_fraction=0.3), "tension": UniaxialTension(stop_fraction=0.3),
    "Brazilian": Brazilian(), "half disc": SemiCircularBend(stop_fraction=0.5),
}  # fmt: skip


def core(seed):
    return gl.Specimen(Voronoi(grains=270, seed=seed).tessellate(disc(54 * mm)), ROCK)


def half_core(seed):
    shape = semi_disc(76 * mm, notch_depth=19 * mm, notch_width=3 * mm, span=46 * mm, bearing=6 * mm)
    return gl.Specimen(Voronoi(grains=270, seed=seed).tessellate(shape), ROCK)


SPECIMENS = {"compression": piece, "tension": piece, "Brazilian": core, "half disc": half_core}


def ratio(name, meaning, above, *below):
    """One number of a result over another, or over the sum of some."""

    def number(laboratory, of):
        found = laboratory.result.summary
        return float(found[of]) if of in found else laboratory.value(of)

    def find(laboratory):
        return number(laboratory, above) / sum(number(laboratory, of) for of in below)

    return Standard(name, meaning, find)


class Fall(gl.Measure):
    """How long the stress takes to fall to half of its peak."""

    name = "fall"
    meaning = "strain from the peak to half of it, over the strain at the peak"
    needs = ("stress",)

    def find(self, laboratory):
        curves = laboratory.result.curves
        stress, strain = np.asarray(curves["stress"]), np.asarray(curves["strain"])
        top = int(stress.argmax())
        after = np.flatnonzero(stress[top:] <= stress[top] / 2)
        return float(strain[top + after[0]] / strain[top] - 1) if len(after) else np.nan


MEASURES = [
    *gl.MEASURES.values(), Fall(),
    ratio("initiation", "CI over UCS", "crack_initiation_lateral", "strength"),
    ratio("damage", "CD over UCS", "crack_damage", "strength"),
    ratio("tensile_share", "share of the length of cracks", "tensile_length", "tensile_length", "shear_length"),
    ratio("slip_share", "share of the energy lost", "lost_slip", "lost_opening", "lost_slip"),
]  # fmt: skip

ROWS = {  # words: test, column, factor, digits
    "UCS (MPa), a target": ("compression", "strength", 1 / MPa, ".1f"),
    "direct tension (MPa), a target": ("tension", "strength", 1 / MPa, ".2f"),
    "Brazilian strength (MPa)": ("Brazilian", "strength", 1 / MPa, ".2f"),
    "toughness of the half disc (MPa √m)": ("half disc", "toughness", 1 / MPa, ".2f"),
    "CI over UCS": ("compression", "initiation", 1, ".2f"),
    "CD over UCS": ("compression", "damage", 1, ".2f"),
    "fall to half of the peak, over the strain there": ("compression", "fall", 1, ".3f"),
    "cracks in compression": ("compression", "cracks", 1, ".0f"),
    "tensile share of their length": ("compression", "tensile_share", 1, ".2f"),
    "lost in opening (J/m)": ("compression", "lost_opening", 1, ".2f"),
    "lost in slip (J/m)": ("compression", "lost_slip", 1, ".1f"),
    "slip's share of the energy lost": ("compression", "slip_share", 1, ".3f"),
    "cracks in tension": ("tension", "cracks", 1, ".0f"),
    "cracks of the disc": ("Brazilian", "cracks", 1, ".0f"),
}


def case(law, test, seed):
    answer = FOUND[law]
    calibrated = attrs.evolve(SEARCHES[law].law, **answer["parameters"])
    return gl.Run(with_grains(SPECIMENS[test](seed), answer["grains"]), calibrated, TESTS[test])


@cache
def table():
    study = gl.Study(case, law=[BRITTLE, CONSISTENT], test=list(TESTS), seed=SEEDS, measures=MEASURES)
    return study.run(progress=False)


def row(test, column, factor, form):
    found = table().where(test=test)
    of_law = {law: found.where(law=law) for law in (BRITTLE, CONSISTENT)}
    pairs = []
    for law in of_law.values():
        order = np.argsort(law["seed"])
        values = law["tensile_cracks"] + law["shear_cracks"] if column == "cracks" else law[column]
        pairs.append(np.asarray(values, float)[order] * factor)
    means = [f"{np.nanmean(values):{form}}" for values in pairs]
    change = difference({}, "law", (BRITTLE, CONSISTENT), np.column_stack(pairs), 0)
    low, high = change.interval
    return [*means, f"{change.mean:{form}} ({low:{form}} to {high:{form}})", f"{change.higher} of {change.count}"]


def curves(file):
    table().where(test="compression").plot_curves("law").savefig(file, dpi=100)


TABLES = [
    Table(
        page=DOCS / "tables/laws.md",
        name="calibrated laws",
        columns=("20 samples", BRITTLE, CONSISTENT, "difference (95 %)", "higher in"),
        rows={words: partial(row, *of) for words, of in ROWS.items()},
        firm=(BRITTLE, CONSISTENT),
    )
]

if __name__ == "__main__":
    main(TABLES, {"calibrated_laws": curves})
