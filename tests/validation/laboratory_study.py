"""The laboratory programme on the paper's rock: the tables of docs/tables/laboratory.md.

    python tests/validation/laboratory_study.py [--write | --check]

Compression and direct tension of the sample, splitting of a disc of 50 mm with grains of the same size; each test once
more at half the rate, and with contacts of random strength, on the first of the seeds.
"""

from functools import partial

import attrs
import numpy as np
from paper_sample import SEEDS
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.cli.default_rock import LAWS, ROCK, SAMPLE
from grainlaw.geometry import Voronoi, disc, rectangle
from grainlaw.laws import WeibullField
from grainlaw.protocols import Brazilian, UniaxialCompression, UniaxialTension
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.units import GPa, MPa, mm

WIDTH, HEIGHT, GRAINS = SAMPLE
GRAIN_SIZE = np.sqrt(WIDTH * HEIGHT / GRAINS)
FLAT, SHAPE_FACTOR = 20.0, 0.9644  # deg; Wang et al. 2004
TESTS = {
    "compression": UniaxialCompression(),
    "tension": UniaxialTension(stop_fraction=0.5),
    "Brazilian": Brazilian(shape_factor=SHAPE_FACTOR, stop_fraction=0.8),  # then halves may carry more than the disc
}
NAMES = {"mohr-coulomb": "Mohr-Coulomb", "cohesive-crack": "cohesive crack"}
THRESHOLDS = {
    "CI, count": "crack_initiation_count",
    "CI, lateral strain": "crack_initiation_lateral",
    "CI, crack volume": "crack_initiation_volumetric",
    "damage onset": "damage_onset",
    "CD": "crack_damage",
}


@attrs.frozen
class Case:
    """A test on one specimen."""

    test: str
    law: str
    seed: int
    half: bool = False  #: of the rate of loading
    modulus: float = np.inf  #: of Weibull's distribution of strengths
    diameter: float = 50 * mm  #: of a disc

    def run(self):
        region = disc(self.diameter, loaded=FLAT) if self.test == "Brazilian" else rectangle(WIDTH, HEIGHT)
        specimen = gl.Specimen(Voronoi(grain_size=GRAIN_SIZE, seed=self.seed).tessellate(region), ROCK)
        test, law = TESTS[self.test], LAWS[self.law]
        if self.half:
            test = attrs.evolve(test, loading=test.loading.slower())
        if np.isfinite(self.modulus):
            law = WeibullField(modulus=self.modulus).scatter(law, specimen)
        return Run(specimen, law, test)


FOUND: dict[Case, dict] = {}


def measured(*cases):
    """Summaries and measures of cases, in Pa; each case is run once."""
    missing = {case: case.run() for case in cases if case not in FOUND}
    for case, result in simulate_all(missing).results.items() if missing else ():
        curves, found = result.curves, dict(result.summary)
        if case.test == "compression":
            peak = np.argmax(curves["stress"])
            found |= {name: result.laboratory.properties[name] for name in THRESHOLDS.values()}
            found["cracks"] = f"{curves['tensile_cracks'][peak]:.0f} + {curves['shear_cracks'][peak]:.0f}"
        if case.test == "Brazilian":
            off = np.abs(result.cracks.position[np.argsort(result.cracks.time)[:5], 0])
            found |= {"off": off.max(initial=0.0), "middle": curves["middle_across"].max()}
            found["left"] = curves["middle_across"][-1]
        FOUND[case] = found
    return [FOUND[case] for case in cases]


def strengths(law, seed, **options):
    compression, tension, brazilian = measured(*(Case(test, law, seed, **options) for test in TESTS))
    ucs, direct, split = (one["strength"] / MPa for one in (compression, tension, brazilian))
    moduli = (one["apparent_modulus"] / GPa for one in (compression, tension))
    return (
        f"{ucs:.1f}", f"{direct:.2f}", f"{split:.2f}", f"{split / direct:.2f}", f"{ucs / direct:.1f}",
        f"{ucs / split:.1f}", " / ".join(f"{modulus:.1f}" for modulus in moduli),
    )  # fmt: skip


def thresholds(law, seed, **options):
    (compression,) = measured(Case("compression", law, seed, **options))
    return [f"{compression[name] / compression['strength']:.2f}" for name in THRESHOLDS.values()] + [
        compression["cracks"]
    ]


def quasi_static(test, law):
    """The worst of the seeds, and what half of the rate changes in the peak of seed 1."""
    (half,), found = measured(Case(test, law, 1, half=True)), measured(*(Case(test, law, seed) for seed in SEEDS))
    return (
        f"{max(one['kinetic_ratio'] for one in found):.0e}",
        f"{max(one['imbalance'] for one in found) * 100:.1f} %",
        f"{(half['strength'] / found[0]['strength'] - 1) * 100:+.1f} %",
    )


def split(law, seed):
    """Where a disc splits, and the tension in its middle."""
    disc, direct = measured(*(Case(test, law, seed) for test in ("Brazilian", "tension")))
    return (
        f"{disc['off'] / mm:.1f}",
        f"{disc['middle'] / MPa:.1f}",
        f"{disc['middle'] / direct['strength']:.2f}",
        f"{disc['left'] / MPa:.1f}",
    )


def size(diameter):
    return [f"{one['strength'] / MPa:.1f}" for one in measured(*(
        Case("Brazilian", law, 1, diameter=diameter) for law in NAMES
    ))]  # fmt: skip


def by_specimen(make, *rocks):
    rows = {f"{name}, {seed}": partial(make, law, seed) for law, name in NAMES.items() for seed in SEEDS}
    rows |= {f"{name}, 1, scattered": partial(make, law, 1, modulus=3.0) for law, name in NAMES.items()}
    return {**rows, "rocks": lambda: rocks}


FIRST = ("Mohr-Coulomb, 1",)
TABLES = [
    Table(
        page=DOCS / "tables/laboratory.md",
        name="laboratory: strengths",
        columns=(
            "law, seed", "UCS (MPa)", "direct tension (MPa)", "Brazilian (MPa)", "Brazilian over direct",
            "UCS over direct", "UCS over Brazilian", "E\\*, compression / tension (GPa)",
        ),
        rows=by_specimen(strengths, "126.65, the paper's", "", "", "1.1 to 1.4", "8 to 20", "8 to 20", ""),
        firm=("UCS (MPa)", "direct tension (MPa)", "Brazilian (MPa)"),
        checked=FIRST,
    ),
    Table(
        page=DOCS / "tables/laboratory.md",
        name="laboratory: thresholds",
        columns=("law, seed", *(f"{name}/UCS" for name in THRESHOLDS), "cracks at the peak, tensile + shear"),
        rows=by_specimen(thresholds, "0.4 to 0.5", "0.4 to 0.5", "0.4 to 0.5", "", "0.7 to 0.8", ""),
        checked=FIRST,
    ),
    Table(
        page=DOCS / "tables/laboratory.md",
        name="laboratory: rate",
        columns=("test, law", "kinetic ratio", "imbalance", "half the rate"),
        rows={f"{test}, {name}": partial(quasi_static, test, law) for test in TESTS for law, name in NAMES.items()},
        checked=("tension, Mohr-Coulomb",),
    ),
    Table(
        page=DOCS / "tables/laboratory.md",
        name="laboratory: split discs",
        columns=(
            "law, seed", "first five cracks off the middle (mm)", "largest tension there (MPa)", "over direct tension",
            "tension left (MPa)",
        ),
        rows={f"{name}, {seed}": partial(split, law, seed) for law, name in NAMES.items() for seed in SEEDS},
        firm=("largest tension there (MPa)",),
        checked=FIRST,
    ),
    Table(
        page=DOCS / "tables/laboratory.md",
        name="laboratory: size of discs",
        columns=("diameter (mm)", *(f"Brazilian, {name} (MPa)" for name in NAMES.values())),
        rows={f"{diameter}": partial(size, diameter * mm) for diameter in (25, 50, 100)},
        checked=("25",),
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES)
