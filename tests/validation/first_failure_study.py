"""What a strength depends on, and what not: the tables of docs/tables/strength.md.

    python tests/validation/first_failure_study.py [--only NAMES] [--write | --check]

150 grains in 22 x 55 mm with the bonds of the README, uniaxial and biaxial compression; and bent columns of 24 blocks.
All tables take about ten minutes of two cores; nearly all of it are the tests at a sixteenth of the rate.
"""

import functools
import math
from functools import partial

import attrs
import numpy as np
from scipy.linalg import eigh
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.geometry import Voronoi, from_polygons, polygon, rectangle
from grainlaw.laws import CohesiveCrack, Linear, MohrCoulomb
from grainlaw.protocols import BiaxialCompression, Platens, UniaxialCompression
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.strength import borne
from grainlaw.studies.envelope import fit_mohr_coulomb
from grainlaw.units import GPa, MPa, mm

BOND = {
    "kn": 1.05e14, "ks": 9.45e13, "tensile_strength": 13 * MPa, "cohesion": 29 * MPa, "friction_angle": 54,
    "residual_friction_angle": 5,
}  # fmt: skip
LAWS = {
    "Mohr-Coulomb": MohrCoulomb(**BOND),
    "cohesive crack": CohesiveCrack(**BOND, mode_i_energy=15, mode_ii_energy=30),
}
ROCK = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
SEEDS = range(1, 11)
FEW = (1, 2, 3, 4, 5)
CONFINEMENTS = (0, 5, 10, 20)
SLOW = 16
GROUPS = {f"{law}, {p} MPa": (law, p) for law in LAWS for p in CONFINEMENTS}


def specimen(seed, **options):
    grains = Voronoi(grains=150, seed=seed).tessellate(rectangle(22 * mm, 55 * mm))
    return gl.Specimen(grains, ROCK, **options)


DAMPINGS = {
    "none": gl.integration.Undamped(),
    "vibration, 0.4": gl.integration.VibrationDamping(fraction=0.4),
    "vibration, 0.8": gl.integration.VibrationDamping(),
    "mass, 1e5 per s": gl.integration.MassDamping(coefficient=1e5),
    "local, 0.1": gl.integration.LocalDamping(fraction=0.1),
    "local, 0.4": gl.integration.LocalDamping(fraction=0.4),
    "local, 0.8": gl.integration.LocalDamping(fraction=0.8),
}


USUAL = "vibration, 0.8"


def loading(confinement, slow, damping=USUAL, **options):
    """Of this confinement (MPa); it ends when the load has fallen by a tenth, to try several definitions on it."""
    options["integrator"] = gl.integration.CentralDifference(damping=DAMPINGS[damping])
    options = {"loading": gl.Adaptive(rate=gl.Adaptive().rate / slow), "stop_fraction": 0.9, **options}
    if not confinement:
        return UniaxialCompression(**options)
    return BiaxialCompression(confinement=confinement * MPa, maximum_strain=0.02, **options)


@functools.cache
def records(law, confinement, slow=1, seeds=tuple(SEEDS), options=(), numerics=()):
    """Results by seed."""
    runs = {
        seed: Run(specimen(seed, **dict(numerics)), LAWS[law], loading(confinement, slow, **dict(options)))
        for seed in seeds
    }
    found = simulate_all(runs, frames=1, progress=False)
    assert not found.failed, found.failed
    return [found.results[seed] for seed in seeds]


def load_of(result):
    return result.curves["deviator" if "deviator" in result.curves else "stress"]


def mpa(result, load):
    """Axial stress from a load (Pa)."""
    return (load + getattr(result.protocol, "confinement", 0.0)) / MPa


def strengths(results):
    return np.array([result.summary["strength"] for result in results]) / MPa


def largest(results):
    return np.array([result.summary["largest_stress"] for result in results]) / MPa


# --- definitions ------------------------------------------------------------------------------------------------------


def after_a_fall(share):
    def find(result):
        load = load_of(result)
        highest = np.maximum.accumulate(load)
        fallen = (load <= (1 - share) * highest) & (highest >= 0.1 * load.max())
        return mpa(result, highest[np.argmax(fallen)] if fallen.any() else math.nan)

    return find


def not_grown(within):
    """The definition of the framework, with another share of the deformation."""

    def find(result):
        import grainlaw.strength as module

        usual, module.WITHIN = module.WITHIN, within
        try:
            load = load_of(result)
            found = borne(load, result.curves["strain"], result.curves["stage"])
        finally:
            module.WITHIN = usual
        return mpa(result, load[found.at] if found.failed else math.nan)

    return find


DEFINITIONS = {
    "largest stress": lambda result: mpa(result, load_of(result).max()),
    "before a fall by 2 %": after_a_fall(0.02),
    "before a fall by 3 %": after_a_fall(0.03),
    "before a fall by 5 %": after_a_fall(0.05),
    "no growth within 0.5 %": not_grown(0.005),
    "**no growth within 1 %**": not_grown(0.01),
    "no growth within 2 %": not_grown(0.02),
    "no growth within 3 %": not_grown(0.03),
    "no growth within 5 %": not_grown(0.05),
}


def definition(find):
    ratios, scatter = [], []
    for group in GROUPS.values():
        usual, slow = (np.array([find(result) for result in records(*group, rate)]) for rate in (1, SLOW))
        ratios.append(usual / slow)
        scatter.append(np.std(usual, ddof=1) / np.mean(usual))
    means, every = np.array([each.mean() for each in ratios]), np.concatenate(ratios)
    return (
        f"{means.min():.3f} to {means.max():.3f}",
        f"{np.nanmin(every):.3f} to {np.nanmax(every):.3f}",
        f"{np.count_nonzero(np.abs(every - 1) > 0.03)} of {len(every)}",
        f"{100 * np.mean(scatter):.1f} %",
    )


def pace(law, confinement):
    usual, slow = records(law, confinement), records(law, confinement, SLOW)
    ratio, other = strengths(usual) / strengths(slow), largest(usual) / largest(slow)
    return (
        f"{strengths(usual).mean():.1f}", f"{strengths(slow).mean():.1f}", f"{ratio.mean():.3f}",
        f"{ratio.min():.3f} to {ratio.max():.3f}",
        f"{other.mean():.3f}", f"{other.min():.3f} to {other.max():.3f}",
        f"{100 * max(result.summary['imbalance'] for result in usual):.2f} %",
    )  # fmt: skip


# --- what else it does not depend on ----------------------------------------------------------------------------------

SAMPLES = (100, 300, 1200)
CHANGES = {
    **{f"{count} samples": {"options": (("samples", count),)} for count in SAMPLES},
    "rough platens": {"options": (("platens", Platens.ROUGH),)},
    "contact points at the ends": {"numerics": (("contact_points", gl.EndPoints()),)},
    "zones refined once": {"numerics": (("refinement", 1),)},
}


def change(**changed):
    cells = []
    for law in LAWS:
        for confinement in (0, 10):
            base, other = records(law, confinement, 1, FEW), records(law, confinement, 1, FEW, **changed)
            ratio = strengths(other) / strengths(base)
            above = largest(other) / largest(base)
            cells += [f"{ratio.mean():.3f} ({ratio.min():.3f} to {ratio.max():.3f})", f"{above.mean():.3f}"]
    return cells


def damped(name):
    cells = []
    for law in LAWS:
        for confinement in (0, 10):
            found = records(law, confinement, 1, FEW, (("damping", name),))
            cells += [f"{strengths(found).mean():.1f}", f"{np.mean([one.summary['steps'] for one in found]):,.0f}"]
    return cells


# --- what follows -----------------------------------------------------------------------------------------------------


def angles(law, read):
    """Friction angle of each specimen (deg), by a line through its strengths from 0 to 20 MPa."""
    stresses = np.array([read(records(law, p)) for p in CONFINEMENTS])
    return np.array([fit_mohr_coulomb(np.array(CONFINEMENTS) * MPa, one * MPa).friction_angle for one in stresses.T])


def envelope(law):
    first, most = angles(law, strengths), angles(law, largest)
    top = max(largest(records(law, 20)))
    return (
        f"{first.mean():.1f}", f"{first.std(ddof=1):.1f}", f"{most.mean():.1f}", f"{most.std(ddof=1):.1f}",
        f"{max(strengths(records(law, 20))):.0f}", f"{top:.0f}",
    )  # fmt: skip


# --- columns ----------------------------------------------------------------------------------------------------------

BLOCKS, WIDTH, HEIGHT = 24, 0.01, 0.01
KN, KS, E, NU = 6e11, 6e12, 600 * GPa, 0.25


def column(bend):
    """Blocks one upon the other, bent by a share of their width between ends that do not turn."""
    y = np.arange(BLOCKS + 1) * HEIGHT
    x = bend * WIDTH * (1 - np.cos(2 * np.pi * y / y[-1])) / 2
    x[:2], x[-2:] = x[0], x[-1]
    blocks = [
        [(x[k], y[k]), (x[k] + WIDTH, y[k]), (x[k + 1] + WIDTH, y[k + 1]), (x[k + 1], y[k + 1])] for k in range(BLOCKS)
    ]
    rim = [(x[k] + WIDTH, y[k]) for k in range(BLOCKS + 1)] + [(x[k], y[k]) for k in range(BLOCKS, -1, -1)]
    names = ["right"] * BLOCKS + ["top"] + ["left"] * BLOCKS + ["bottom"]
    grains = from_polygons(blocks, ["a"] * BLOCKS, polygon(rim, names))
    return gl.Specimen(grains, gl.Elastic(youngs_modulus=E, poissons_ratio=NU, density=2700), refinement=1)


def buckling_stress():
    """Pa: rigid blocks on hinges, each a spring of two contact points at the Gauss points of the joint.

    Turning by d moves them by w d/(2 sqrt 3), so that a joint resists with kn w^3/12 N m per rad, and with it half of
    the two blocks bends. The ends do not turn and do not move sideways.
    """
    joint = WIDTH**3 / 12 / (1 / KN + HEIGHT / (E / (1 - NU**2)))
    inner = BLOCKS - 2  # blocks that turn; those at the ends do not
    turn = np.diff(np.vstack([np.zeros(inner), np.eye(inner), np.zeros(inner)]), axis=0)
    closed = np.eye(inner)[:, :-1] - np.eye(inner)[:, 1:]  # turns whose sum is zero: the top stays above the bottom
    stiffness, geometry = closed.T @ (joint * turn.T @ turn) @ closed, closed.T @ (HEIGHT * closed)
    return eigh(stiffness, geometry, eigvals_only=True)[0] / WIDTH


@functools.cache
def pressed(bend, slow):
    run = UniaxialCompression(
        platens=Platens.ROUGH, maximum_strain=0.008, stop_fraction=0, samples=200,
        loading=gl.Adaptive(rate=gl.Adaptive().rate / slow),
    )  # fmt: skip
    return gl.simulate(column(bend), Linear(kn=KN, ks=KS), run, detection=None, progress=False, frames=1)


def buckled(bend, slow):
    result = pressed(bend, slow)
    stress, margin = result.curves["stress"], result.curves["stability"]
    early = (margin > 0.3) & (margin < 0.9) & (np.arange(len(margin)) < np.nanargmin(margin))
    crossing = np.polyval(np.polyfit(margin[early], stress[early], 1), 0.0)
    return (
        f"{buckling_stress() / MPa:.2f}", f"{stress.max() / MPa:.2f}", f"{crossing / MPa:.2f}",
        f"{result.summary['steps']:,}", f"{result.summary['kinetic_ratio']:.0e}",
    )  # fmt: skip


GRANITES = ("lac-du-bonnet-granite", "lac-du-bonnet-granite-cohesive")
BONDS = {law: (LAWS[law], ROCK) for law in LAWS} | {
    name: (gl.rocks[name].law, gl.rocks[name].material) for name in GRANITES
}
AGAIN = (0.0, 1e-13, 2e-13, 3e-13)  #: by which the normal stiffness of bonds is larger


def again(bonds):
    """Strengths of specimens, each several times with bonds that differ by rounding."""
    law, rock = BONDS[bonds]
    runs = {
        (change, seed): Run(
            gl.Specimen(specimen(seed).grains, rock), attrs.evolve(law, kn=law.kn * (1 + change)),
            UniaxialCompression(until=gl.Until.FAILURE),
        )
        for change in AGAIN for seed in SEEDS
    }  # fmt: skip
    found = simulate_all(runs, frames=1, progress=False)
    assert not found.failed, found.failed
    strength = np.array([[found.results[change, seed].summary["strength"] for seed in SEEDS] for change in AGAIN]) / MPa
    means, spans = strength.mean(axis=1), np.ptp(strength, axis=0) / strength.mean(axis=0)
    yield f"{strength.mean():.1f}"
    yield f"{strength.mean(axis=0).std(ddof=1):.1f}"
    yield f"{math.sqrt(strength.var(axis=0, ddof=1).mean()):.2f}"
    yield f"{np.count_nonzero(spans > 0.01)} of {len(SEEDS)}"
    yield f"{100 * spans.max():.2g} %"
    yield f"{means.min():.1f} to {means.max():.1f}"


PAGE = DOCS / "tables/strength.md"
TABLES = [
    Table(
        page=PAGE, name="definitions",
        columns=("definition", "means of the ratio", "of single tests", "off by more than 3 %", "scatter"),
        rows={name: partial(definition, find) for name, find in DEFINITIONS.items()}, checked=("largest stress",),
    ),
    Table(
        page=PAGE, name="pace of strengths",
        columns=("law, confinement", "strength (MPa)", "slow", "ratio", "of single tests", "largest stress: ratio",
                 "of single ones", "imbalance"),
        rows={name: partial(pace, *group) for name, group in GROUPS.items()}, checked=("Mohr-Coulomb, 0 MPa",),
        firm=("strength (MPa)",),
    ),
    Table(
        page=PAGE, name="numerics of strengths",
        columns=("changed", *(f"{law}, {p} MPa{what}" for law in LAWS for p in (0, 10) for what in ("", ": largest"))),
        rows={name: partial(change, **changed) for name, changed in CHANGES.items()}, checked=("100 samples",),
    ),
    Table(
        page=PAGE, name="rounding",
        columns=("bonds", "strength (MPa)", "scatter of specimens", "of one specimen", "by more than 1 %", "at most",
                 "mean of ten"),
        rows={name: partial(again, name) for name in BONDS}, checked=("Mohr-Coulomb",),
    ),
    Table(
        page=PAGE, name="damping of strengths",
        columns=("damping", *(f"{law}, {p} MPa{what}" for law in LAWS for p in (0, 10) for what in ("", ": steps"))),
        rows={f"**{name}**" if name == USUAL else name: partial(damped, name) for name in DAMPINGS},
        checked=(f"**{USUAL}**",),
    ),
    Table(
        page=PAGE, name="angles",
        columns=("law", "angle by strengths (deg)", "scatter", "by largest stresses", "scatter of these",
                 "highest strength at 20 MPa", "highest stress"),
        rows={law: partial(envelope, law) for law in LAWS}, checked=("Mohr-Coulomb",),
    ),
    Table(
        page=PAGE, name="columns",
        columns=(
            "bent by, rate", "buckling load (MPa)", "largest stress", "margin points to", "steps", "kinetic ratio"
        ),
        rows={
            f"{100 * bend:g} %, {'default' if slow == 1 else f'1/{slow}'}": partial(buckled, bend, slow)
            for bend in (0.001, 0.005, 0.02) for slow in (1, SLOW)
        },
        firm=("buckling load (MPa)", "largest stress"),
        checked=("0.5 %, default",),
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES)
