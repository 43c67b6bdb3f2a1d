"""The cohesive crack on the sample of the paper: its readings, and how even the grains are.

python tests/validation/cohesive_study.py [--write | --check]
"""

from functools import partial

import attrs
from paper_sample import SEEDS, STRENGTH, sample, strength, summaries
from study_tables import DOCS, Table, each, main

from grainlaw.cli.default_rock import LAWS
from grainlaw.laws import PrePeak, Residual
from grainlaw.protocols import UniaxialCompression
from grainlaw.runs.parallel import Run
from grainlaw.units import GPa, MPa

CRACK = LAWS["cohesive-crack"]
READINGS = {
    "default: exponential pre-peak, floor, 150 and 300 J/m2": CRACK,
    "pre-peak as printed": attrs.evolve(CRACK, pre_peak=PrePeak.AS_PRINTED),
    "linear pre-peak": attrs.evolve(CRACK, pre_peak=PrePeak.LINEAR),
    "residual: blend": attrs.evolve(CRACK, residual=Residual.BLEND),
    "energies 5 and 10 J/m2": attrs.evolve(CRACK, mode_i_energy=5, mode_ii_energy=10),
}
RELAXATIONS = {"0": 0, "1": 1, "3 (default)": 3, "10": 10, "30": 30}


def reading(law):
    found = summaries({seed: Run(sample(seed), law, UniaxialCompression()) for seed in SEEDS})
    found = [found[seed] for seed in SEEDS]
    return (
        *strength(found),
        f"{max(one['kinetic_ratio'] for one in found):.0e}",
        f"{max(one['imbalance'] for one in found) * 100:.1f} %",
    )


def evenness(relaxation):
    samples = {seed: sample(seed, relaxation) for seed in (1, 2)}
    brittle, cohesive = (
        summaries({seed: Run(samples[seed], LAWS[law], UniaxialCompression()) for seed in samples})
        for law in ("mohr-coulomb", "cohesive-crack")
    )
    areas = samples[1].grains.areas
    return (
        f"{areas.std() / areas.mean():.2f}",
        each((brittle[seed]["apparent_modulus"] / GPa for seed in samples), ".2f"),
        each((brittle[seed]["strength"] / MPa for seed in samples), ".1f"),
        each((cohesive[seed]["strength"] / MPa for seed in samples), ".1f"),
    )


TABLES = [
    Table(
        page=DOCS / "tables/full-sample.md",
        name="cohesive crack: readings",
        columns=("", *STRENGTH, "kinetic", "imbalance"),
        rows={name: partial(reading, law) for name, law in READINGS.items()},
        firm=("peak (MPa)", "mean", "strain at peak (%)"),
        checked=("default: exponential pre-peak, floor, 150 and 300 J/m2",),
    ),
    Table(
        page=DOCS / "tables/full-sample.md",
        name="even grains",
        columns=(
            "`relaxation`", "spread of areas", "E\\* (GPa)", "Mohr-Coulomb peak (MPa)", "cohesive crack peak (MPa)"
        ),
        rows={name: partial(evenness, times) for name, times in RELAXATIONS.items()},
        firm=("spread of areas", "E\\* (GPa)", "Mohr-Coulomb peak (MPa)", "cohesive crack peak (MPa)"),
        checked=("1",),
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES)
