"""What rules where cracks begin: six textures of one rock, five samples each, in compression and in tension.

    python docs/examples/texture_study.py

300 grains, Mohr-Coulomb bonds. The numbers are of no particular rock: mica is half as stiff, and its bonds have half of
the strength. Prints CI, CD and UCS, tension, and the share of cracks inside of grains; keeps all in texture-study.
"""

import attrs
import numpy as np

import grainlaw as gl
from grainlaw.geometry import Breakable, Laguerre, Lognormal, Minerals, Voronoi, VoronoiCells, rectangle
from grainlaw.laws import MohrCoulomb, WeibullField
from grainlaw.protocols import UniaxialCompression, UniaxialTension
from grainlaw.units import GPa, MPa, mm

ROCK = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=2700)
SOFT = attrs.evolve(ROCK, youngs_modulus=30 * GPa)
BOND = MohrCoulomb(kn=1.05e14, ks=9.45e13, tensile_strength=13 * MPa, cohesion=29 * MPa, friction_angle=54,
                   residual_friction_angle=5)  # fmt: skip
WEAK = attrs.evolve(BOND, tensile_strength=6.5 * MPa, cohesion=14.5 * MPa)
STRONG = attrs.evolve(BOND, tensile_strength=26 * MPa, cohesion=58 * MPa)  # inside of grains
TEXTURES = ("even", "sizes", "minerals", "random strength", "breakable", "all")
SHARES = {"feldspar": 0.6, "quartz": 0.3, "mica": 0.1}
TESTS = {"compression": UniaxialCompression(), "tension": UniaxialTension()}


def case(texture, seed, test):
    together = texture == "all"
    grains = Voronoi(grains=300, seed=seed)
    if together or texture == "sizes":
        grains = Laguerre(grains=300, sizes=Lognormal(deviation=0.5), seed=seed)
    rock, laws = ROCK, {...: BOND}
    if together or texture == "minerals":
        grains = Minerals(grains, SHARES, seed=seed)
        rock, laws = {"mica": SOFT, ...: ROCK}, {("mica", ...): WEAK, ...: BOND}
    if together or texture == "breakable":
        grains = Breakable(grains, VoronoiCells(count=5), seed=seed)
        laws = {"inside": STRONG, **laws}
    specimen = gl.Specimen(grains.tessellate(rectangle(32 * mm, 80 * mm)), rock)
    if together or texture == "random strength":
        laws = WeibullField(modulus=4, seed=seed).scatter(laws, specimen)
    return gl.Run(specimen, laws, TESTS[test])


def main():
    table = gl.Study(case, texture=TEXTURES, seed=range(1, 6), test=list(TESTS)).run("texture-study")
    peak, test = table["peak_stress"], table["test"]
    for texture in TEXTURES:
        pressed, pulled = ((table["texture"] == texture) & (test == name) for name in TESTS)
        ucs, tension = peak[pressed], peak[pulled]
        ratios = {
            "UCS (MPa)": ucs / MPa, "CI/UCS": table["crack_initiation_count"][pressed] / ucs,
            "CD/UCS": table["crack_damage"][pressed] / ucs, "UCS/T": ucs / tension,
        }  # fmt: skip
        cells = [f"{np.nanmean(row):.3g} ({np.nanmin(row):.3g} to {np.nanmax(row):.3g})" for row in ratios.values()]
        print(f"| {texture} | {' | '.join(cells)} | {np.mean(table['steps'][pressed]):.0f} |")


if __name__ == "__main__":
    main()
