"""What rules where cracks begin: python docs/examples/texture_study.py [--law NAME] [--seeds 5] [--write]

Even grains; a distribution of sizes; minerals with contrast; random strength; grains that break; all of it together.
Each as the mean of some samples in compression and in tension, paired by seed, under Mohr-Coulomb bonds and under
cohesive cracks. The numbers are of no particular rock: mica is half as stiff, and its bonds have half of the strength.
Prints strength, CI and CD over it, the share of cracks that run through grains, and steps; keeps all in texture-study.
"""

from pathlib import Path

import attrs
import numpy as np
from rock_study import asked, markdown, write

import grainlaw as gl
from grainlaw.geometry import Breakable, Laguerre, Lognormal, Minerals, Voronoi, VoronoiCells, rectangle
from grainlaw.laws import CohesiveCrack, MohrCoulomb, WeibullField
from grainlaw.protocols import UniaxialCompression, UniaxialTension
from grainlaw.units import GPa, MPa, mm

ROCK = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=2700)
SOFT = attrs.evolve(ROCK, youngs_modulus=30 * GPa)
BOND = dict(kn=1.05e14, ks=9.45e13, tensile_strength=13 * MPa, cohesion=29 * MPa, friction_angle=54,
            residual_friction_angle=5)  # fmt: skip
# Of energies ten times as high the zone that softens, E G / f_t^2, would be longer than the sample is wide.
LAWS = {
    "mohr-coulomb": MohrCoulomb(**BOND),
    "cohesive-crack": CohesiveCrack(**BOND, mode_i_energy=15, mode_ii_energy=30),
}
SCALED = ("tensile_strength", "cohesion", "mode_i_energy", "mode_ii_energy")
TEXTURES = ("even", "sizes", "minerals", "random strength", "breakable", "all together")
SHARES = {"feldspar": 0.6, "quartz": 0.3, "mica": 0.1}
TESTS = {"compression": UniaxialCompression(), "tension": UniaxialTension()}
COLUMNS = ("texture", "UCS (MPa)", "CI/UCS", "CD/UCS", "UCS/T", "transgranular", "steps")
PAGE = Path(__file__).parents[1] / "tables/textures.md"


def times(law, factor):
    """The same law, as much stronger and tougher."""
    return attrs.evolve(law, **{name: factor * getattr(law, name) for name in SCALED if hasattr(law, name)})


def case(law, texture, seed, test, grains):
    bond, together = LAWS[law], texture == "all together"
    made = Voronoi(grains=grains, seed=seed)
    if together or texture == "sizes":
        made = Laguerre(grains=grains, sizes=Lognormal(deviation=0.5), seed=seed)
    rock, laws = ROCK, {...: bond}
    if together or texture == "minerals":
        made = Minerals(made, SHARES, seed=seed)
        rock, laws = {"mica": SOFT, ...: ROCK}, {("mica", ...): times(bond, 0.5), ...: bond}
    if together or texture == "breakable":
        made = Breakable(made, VoronoiCells(count=5), seed=seed)
        laws = {"inside": times(bond, 2), **laws}
    specimen = gl.Specimen(made.tessellate(rectangle(32 * mm, 80 * mm)), rock)
    if together or texture == "random strength":
        laws = WeibullField(modulus=4, seed=seed).scatter(laws, specimen)
    return gl.Run(specimen, laws, TESTS[test])


def study(laws, seeds, grains):
    return gl.Study(case, law=laws, texture=TEXTURES, seed=range(1, seeds + 1), test=list(TESTS), grains=[grains])


def rows(table, law):
    """Cells of the table of a law: means, and the range over the samples."""
    peak = table["strength"]
    cracks = table["tensile_cracks"] + table["shear_cracks"]
    for texture in TEXTURES:
        of = [(table["law"] == law) & (table["texture"] == texture) & (table["test"] == test) for test in TESTS]
        ucs, tension = peak[of[0]], peak[of[1]]
        ratios = [ucs / MPa, table["crack_initiation_count"][of[0]] / ucs, table["crack_damage"][of[0]] / ucs]
        ratios += [ucs / tension, table["transgranular_cracks"][of[0]] / cracks[of[0]]]
        yield [texture, *map(cell, ratios), f"{np.nanmean(table['steps'][of[0]]):.0f}"]


def cell(values):
    if np.isnan(values).all():
        return "-"
    return f"{np.nanmean(values):.3g} ({np.nanmin(values):.3g} to {np.nanmax(values):.3g})"


def main():
    of_laws = {"type": str, "choices": [*LAWS], "nargs": "+", "default": [*LAWS], "help": "both unless given"}
    given = asked(
        __doc__, "texture-study", "tables into docs/tables/textures.md", law=of_laws, seeds={"default": 5},
        grains={"default": 300},
    )  # fmt: skip
    table = study(given.law, given.seeds, given.grains).run(given.folder, workers=given.workers)
    for law in given.law:
        text = markdown(COLUMNS, rows(table, law))
        print(f"{law}\n\n{text}")
        if given.write:
            write(f"texture study {law}", text, PAGE)


if __name__ == "__main__":
    main()
