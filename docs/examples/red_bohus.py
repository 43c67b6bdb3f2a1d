"""Triaxial strengths that were not calibrated: python docs/examples/red_bohus.py [--seeds 10] [--write]

Red Bohus granite bears 404, 599, 703 and 798 MPa under 20, 50, 75 and 100 MPa. Cohesion and friction angle of the bonds
are found by the strengths at 20 and 75 MPa alone; those at 50 and 100 MPa, and CI and CD at all four, are predicted on
specimens that the search has not seen, and only then compared. Keeps all in the folder red-bohus, and goes on where it
was interrupted.
"""

import numpy as np
from rock_study import asked, markdown, mean_and_half, write

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import BiaxialCompression, UniaxialCompression
from grainlaw.strength import Until
from grainlaw.units import GPa, MPa, mm

MEASURED = {20: 404, 50: 599, 75: 703, 100: 798}  #: MPa by MPa
INITIATION, DAMAGE = {20: 0.57, 50: 0.55, 75: 0.53, 100: 0.58}, {20: 0.65, 50: 0.73, 75: 0.74, 100: 0.67}  #: of q
FITTED = (20, 75)
ROCK = gl.Elastic(youngs_modulus=87 * GPa, poissons_ratio=0.25, density=2650)  # stiffness as of Lac du Bonnet granite
BOND = MohrCoulomb(kn=1.5e14, ks=5.8e13, tensile_strength=10 * MPa, cohesion=50 * MPa, friction_angle=45,
                   residual_friction_angle=30)  # fmt: skip
FREE = {"cohesion": (15 * MPa, 150 * MPa), "friction_angle": (10, 60)}
TIED = {"tensile_strength": ("cohesion", 0.2)}


def specimen(seed):
    return gl.Specimen(Voronoi(grains=150, seed=seed).tessellate(rectangle(22 * mm, 56 * mm)), ROCK)


def case(law, pressure, seed):
    return gl.Run(specimen(seed), law, BiaxialCompression(confinement=pressure * MPa, maximum_strain=0.03))


def calibrated(folder, workers):
    return gl.calibrate(
        gl.Targets(triaxial={p * MPa: MEASURED[p] * MPa for p in FITTED}), law=BOND, free=FREE, tied=TIED,
        specimens=specimen, store=f"{folder}/calibration", workers=workers, budget=24, fresh=10,
        tests={"compression": UniaxialCompression(maximum_strain=0.03, until=Until.FAILURE),
               "confined": BiaxialCompression(confinement=0, maximum_strain=0.03, until=Until.FAILURE)},
    )  # fmt: skip


def predicted(law, seeds, folder, workers):
    return gl.Study(case, law={"found": law}, pressure=list(MEASURED), seed=range(101, 101 + seeds)).run(
        f"{folder}/prediction", workers=workers
    )


def table_of(table):
    heads = ["confinement (MPa)", "fitted", "strength (MPa)", "laboratory", "CI/q", "laboratory", "CD/q", "laboratory"]
    lines = []
    for p in MEASURED:
        of = table.where(pressure=p)
        deviator = of["strength"] - p * MPa
        ratios = [(of[name] - p * MPa) / deviator for name in ("crack_initiation_count", "crack_damage_cylinder")]
        strength, ci, cd = (words(values) for values in (of["strength"] / MPa, *ratios))
        lines.append([f"{p}", "yes" if p in FITTED else "", strength, f"{MEASURED[p]}",
                      ci, f"{INITIATION[p]}", cd, f"{DAMAGE[p]}"])  # fmt: skip
    return markdown(heads, lines)


def words(values):
    """Mean and half of its 95 % interval, of those that have it; one of them alone is told without an interval."""
    known = values[~np.isnan(values)]
    if not len(known):
        return "-"
    few = f" ({len(known)} of {len(values)})" if len(known) < len(values) else ""
    half = mean_and_half(known)[1]
    digits = "" if np.isnan(half) else f" ± {np.format_float_positional(half, 2, fractional=False, trim='-')}"
    return f"{known.mean():.3g}{digits}{few}"


def main():
    given = asked(__doc__, "red-bohus", seeds={"default": 10, "help": "specimens of the prediction"})
    found = calibrated(given.folder, given.workers)
    print(found)
    text = table_of(predicted(found.law, given.seeds, given.folder, given.workers))
    print(text)
    if given.write:
        write("red bohus", text)


if __name__ == "__main__":
    main()
