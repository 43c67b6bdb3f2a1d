"""What strengths converge to over zones, contact points and grains: the tables of docs/tables/convergence.md.

    python tests/validation/convergence_study.py [--only NAMES] [--write | --check]

300 grains of 31 x 78 mm, the bonds of the README, up to the first failure. Finished tests are kept in out/convergence,
so that a study that is stopped goes on. All of it takes some two hours of two cores, most of them the tests with zones
cut three times.
"""

import functools
from functools import partial

import numpy as np
from first_failure_study import LAWS, ROCK
from scipy.stats import ttest_1samp, ttest_ind
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import WeibullField
from grainlaw.protocols import BiaxialCompression, UniaxialCompression, UniaxialTension
from grainlaw.units import MPa, mm

KEPT = DOCS.parent / "out" / "convergence"
SEEDS = range(1, 11)
POINTS = {"Gauss": gl.GaussPoints(), "inset": gl.InsetPoints(inset=0.15 * mm), "ends": gl.EndPoints()}
FINEST = 3
GRAINS = (40, 150, 600)  #: of one size, so that each specimen is twice as wide as that before
LOADS = {
    "0 MPa": UniaxialCompression(until=gl.Until.FAILURE),
    "10 MPa": BiaxialCompression(confinement=10 * MPa, maximum_strain=0.02, until=gl.Until.FAILURE),
    "tension": UniaxialTension(until=gl.Until.FAILURE),
}
GROUPS = {f"{law}, {load}": (law, load) for law in LAWS for load in ("0 MPa", "10 MPa")}


def case(law, load, points, refinement, grains, seed):
    times = np.sqrt(grains / 300)
    made = Voronoi(grains=grains, seed=seed).tessellate(rectangle(31.1 * times * mm, 77.8 * times * mm))
    rock = gl.Specimen(made, ROCK, contact_points=POINTS[points], refinement=refinement)
    return gl.Run(rock, LAWS[law], LOADS[load])


@functools.cache
def column(name, law, load, points="Gauss", refinement=0, grains=300):
    """(s,) of a table, by seed."""
    levels = {"law": law, "load": load, "points": points, "refinement": refinement, "grains": grains}
    study = gl.Study(case, **{factor: [level] for factor, level in levels.items()}, seed=list(SEEDS))
    table = study.run(KEPT / "-".join(map(str, levels.values())).replace(" ", "-"))
    assert not table.failed, table.failed
    return table[name]


def strengths(*group, **more):
    """(s,) MPa, by seed."""
    return column("strength", *group, **more) / MPa


def ratio(values, others):
    """Mean of the ratios of the same specimens, with the 95 % interval of Student's paired t."""
    ratios = values / others
    low, high = ttest_1samp(ratios, 1).confidence_interval()
    return f"{ratios.mean():.3f} ({low:.3f} to {high:.3f})"


def over_finest(points, refinement):
    for group in GROUPS.values():
        found = strengths(*group, points, refinement)
        yield f"{found.mean():.1f} ± {found.std(ddof=1):.1f}"
        yield ratio(found, strengths(*group, "Gauss", FINEST))


def between_points(points, refinement):
    for group in GROUPS.values():
        yield ratio(strengths(*group, points, refinement), strengths(*group, "Gauss", refinement))


def price(refinement):
    """Steps, and steps times zones over those of uncut zones: what the step costs goes with them."""
    for group in GROUPS.values():
        steps, usual = (column("steps", *group, "Gauss", k).mean() for k in (refinement, 0))
        yield f"{steps:,.0f}"
        yield f"{4**refinement * steps / usual:.1f}"


FIELDS = {
    "even": None,
    "by contact": WeibullField(modulus=6),
    "over 5 mm": WeibullField(modulus=6, correlation_length=5 * mm),
}


@functools.cache
def tensions(name, refinement):
    """(s,) MPa, of 60 grains with even bonds, or with those of a random field."""
    field, found = FIELDS[name], []
    for seed in SEEDS:
        grains = Voronoi(grains=60, seed=seed).tessellate(rectangle(20 * mm, 50 * mm))
        rock, law = gl.Specimen(grains, ROCK, refinement=refinement), LAWS["Mohr-Coulomb"]
        law = field.scatter(law, rock) if field else law
        found.append(gl.simulate(rock, law, UniaxialTension(), threads=1, frames=1).summary["strength"] / MPa)
    return np.array(found)


def scattered(name):
    for refinement in range(3):
        yield f"{tensions(name, refinement).mean():.2f}"
        if refinement < 2:
            yield ratio(tensions(name, refinement), tensions(name, 2))


def over_most(law, grains):
    """Means and their ratios to those of the most grains: other specimens, so with the interval of Welch's t."""
    for load in LOADS:
        found, most = (strengths(law, load, grains=count) for count in (grains, GRAINS[-1]))
        low, high = np.exp(ttest_ind(np.log(found), np.log(most), equal_var=False).confidence_interval())
        yield f"{found.mean():.1f} ± {found.std(ddof=1):.1f}"
        yield f"{np.exp(np.log(found).mean() - np.log(most).mean()):.2f} ({low:.2f} to {high:.2f})"


PAGE = DOCS / "tables/convergence.md"
TABLES = [
    Table(
        page=PAGE, name="zones",
        columns=("zones", *(f"{group}{what}" for group in GROUPS for what in (" (MPa)", ": over the finest"))),
        rows={f"cut {k} times": partial(over_finest, "Gauss", k) for k in range(FINEST + 1)}, checked=None,
    ),
    Table(
        page=PAGE, name="contact points",
        columns=("points, zones", *GROUPS),
        rows={
            f"{points}, cut {k} times": partial(between_points, points, k)
            for points in ("inset", "ends") for k in range(FINEST)
        },
        checked=("ends, cut 0 times",),
    ),
    Table(
        page=PAGE, name="price",
        columns=("zones", *(f"{group}{what}" for group in GROUPS for what in (": steps", ": work"))),
        rows={f"cut {k} times": partial(price, k) for k in range(FINEST + 1)}, checked=("cut 0 times",),
    ),
    Table(
        page=PAGE, name="random strengths",
        columns=("bonds", "uncut (MPa)", "over twice cut", "cut once (MPa)", "over twice cut", "cut twice (MPa)"),
        rows={name: partial(scattered, name) for name in FIELDS}, checked=("even",),
    ),
    Table(
        page=PAGE, name="grains",
        columns=("grains", *(f"{load}{what}" for load in LOADS for what in (" (MPa)", ": over the most grains"))),
        rows={f"{law}, {grains:,}": partial(over_most, law, grains) for law in LAWS for grains in GRAINS},
        checked=None,
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES)
