"""Is the strength under two laws different? Three laws on the same twenty samples: python docs/examples/law_study.py"""

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack, MohrCoulomb, MunjizaJoint
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import GPa, MPa, mm

ROCK = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
STIFF = {"kn": 1.05e14, "ks": 9.45e13}
STRONG = STIFF | dict(tensile_strength=13 * MPa, cohesion=29 * MPa, friction_angle=54, residual_friction_angle=5)
TOUGH = STRONG | dict(mode_i_energy=150, mode_ii_energy=300)
LAWS = {"Mohr-Coulomb": MohrCoulomb(**STRONG), "cohesive crack": CohesiveCrack(**TOUGH)}
LAWS |= {"Munjiza": MunjizaJoint(**TOUGH)}


def case(law, seed):
    grains = Voronoi(grains=755, seed=seed).tessellate(rectangle(50 * mm, 125 * mm))
    return gl.Run(gl.Specimen(grains, ROCK), law, UniaxialCompression())


if __name__ == "__main__":
    table = gl.Study(case, law=LAWS, seed=range(1, 21)).run("law-study")
    print(table.means("law")["strength"], table.paired("law")["strength"], sep="\n\n")
    table.plot_paired("strength", "law").savefig("law_study.png", dpi=110)
    table.write_csv("law_study.csv")
    table.write_report("law-study.html", title="Three laws on twenty samples")
