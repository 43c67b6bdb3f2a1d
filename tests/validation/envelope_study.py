"""Strength over confinement: the tables and figures of docs/tables/envelope.md.

python tests/validation/envelope_study.py [--write | --check]
"""

from functools import cache, partial

import numpy as np
from paper_sample import SEEDS, sample
from study_tables import DOCS, Table, each, main

import grainlaw as gl
from grainlaw.cli.default_rock import LAWS
from grainlaw.protocols import BiaxialCompression
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.units import MPa

NAMES = {"mohr-coulomb": "Mohr-Coulomb", "cohesive-crack": "cohesive crack"}
CONFINEMENTS = (0, 1, 2, 3, 4)  # MPa
POINTS = {"Gauss": gl.GaussPoints(), "inset 0.1 mm": gl.InsetPoints(inset=1e-4), "ends": gl.EndPoints()}
FALL = 0.05  #: of the largest stress so far, that ends a first peak


def test(confinement):
    return BiaxialCompression(confinement=confinement, maximum_strain=0.02)


def case(law, seed, confinement):
    return Run(sample(seed), LAWS[law], test(confinement))


@cache
def tested(law):
    study = gl.Study(case, law=[law], seed=SEEDS, confinement=[p * MPa for p in CONFINEMENTS])
    return study.run(progress=False)


def peaks(confinement):
    row = []
    for law in NAMES:
        found = tested(law).where(confinement=confinement * MPa)["strength"] / MPa
        row += [each(found, ".1f"), f"{np.mean(found):.1f}"]
    return row


def line(law, seed=None):
    """The line through the peaks of one seed, or of all."""
    fit = gl.StrengthEnvelope(tested(law).where(**{} if seed is None else {"seed": seed})).mohr_coulomb

    def with_interval(name, unit, form):
        low, high = (value / unit for value in getattr(fit, f"{name}_interval"))
        return f"{getattr(fit, name) / unit:{form}} ({low:{form}} to {high:{form}})"

    return [
        with_interval(*column)
        for column in (
            ("slope", 1, ".2f"), ("ucs", MPa, ".1f"), ("cohesion", MPa, ".1f"), ("friction_angle", 1, ".1f")
        )
    ]  # fmt: skip


def pooled(law):
    """What the pooled points say beside the line."""
    table = tested(law)
    parabola = gl.StrengthEnvelope(table).hoek_brown
    slopes = [gl.StrengthEnvelope(table.where(seed=seed)).mohr_coulomb.slope for seed in SEEDS]
    half = 4.3027 * np.std(slopes, ddof=1) / np.sqrt(len(slopes))  # Student's 97.5 % with two degrees of freedom
    low, high = parabola.m_interval
    return (
        f"{np.mean(slopes):.2f} ({np.mean(slopes) - half:.2f} to {np.mean(slopes) + half:.2f})",
        f"{parabola.m:.1f} ({low:.1f} to {high:.1f})",
        f"{table['kinetic_ratio'].max():.0e}",
        f"{table['imbalance'].max() * 100:.1f} %",
    )


def first_peak(stress):
    """Largest stress before it first falls by ``FALL`` of it."""
    largest = np.maximum.accumulate(stress)
    fallen = np.flatnonzero(stress < (1 - FALL) * largest)
    return largest[fallen[0]] if len(fallen) else largest[-1]


def points(kind, time_step_factor=1.0):
    """Peaks of seed 1 over confinement, and the slopes between the first and the last."""
    specimen = sample(1, contact_points=kind)
    runs = {p: Run(specimen, LAWS["mohr-coulomb"], test(p * MPa)) for p in (0, 2, 4)}
    results = simulate_all(runs, frames=1, time_step_factor=time_step_factor).results
    stress = [results[p].curves["stress"] / MPa for p in runs]
    both = np.array([(first_peak(one), one.max()) for one in stress])
    return (*(each(one, ".1f") for one in both), each((both[-1] - both[0]) / 4, ".1f"))


def figure(law, file):
    gl.StrengthEnvelope(tested(law)).plot().savefig(file, dpi=150)


PAGE = DOCS / "tables/envelope.md"
TABLES = [
    Table(
        page=PAGE,
        name="envelope: peaks",
        columns=("confinement (MPa)", "Mohr-Coulomb", "mean", "cohesive crack", "mean "),
        rows={f"{p}": partial(peaks, p) for p in CONFINEMENTS},
        firm=("Mohr-Coulomb", "cohesive crack"),
        checked=(),
    ),
    Table(
        page=PAGE,
        name="envelope: lines",
        columns=("line", "slope", "UCS (MPa)", "cohesion (MPa)", "friction (deg)"),
        rows={
            "paper": lambda: ("11.909", "126.65", "18.35", "57.68"),
            **{
                f"{name}, {f'seed {seed}' if seed else 'all 15'}": partial(line, law, seed)
                for law, name in NAMES.items() for seed in (None, *SEEDS)
            },
        },
    ),
    Table(
        page=PAGE,
        name="envelope: pooled",
        columns=("", "mean of three slopes", "Hoek and Brown's m", "kinetic ratio", "imbalance"),
        rows={name: partial(pooled, law) for law, name in NAMES.items()},
    ),
    Table(
        page=PAGE,
        name="envelope: contact points",
        columns=("contact points", "0 MPa, first / largest", "2 MPa", "4 MPa", "slope"),
        rows={
            **{name: partial(points, kind) for name, kind in POINTS.items()},
            **{f"{name}, time step 3 % shorter": partial(points, kind, 0.97) for name, kind in POINTS.items()},
        },
        checked=("Gauss",),
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES, {f"envelope_{law}": partial(figure, law) for law in NAMES})
