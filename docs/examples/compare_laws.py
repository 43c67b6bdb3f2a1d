"""Contact laws on the same grains under the same compression: strength, cracks, and where the energy goes.

    python docs/examples/compare_laws.py [--quick] [--out FOLDER]

All laws have the same stiffness, strength and, where they have any, fracture energies. 755 grains, seeds 1, 2, 3:
some minutes on two cores; --quick: 120 grains, one seed, less than a minute. FOLDER holds the study and its pictures.
"""

import argparse
from pathlib import Path

import grainlaw as gl
from grainlaw import laws
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import GPa, MPa, mm

ROCK = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=3100)
stiff = dict(kn=1.05e14, ks=9.45e13)
even = stiff | dict(tensile_strength=13 * MPa, cohesion=29 * MPa, residual_friction_angle=5)
rough, strong = even | dict(residual_friction_angle=54), even | dict(friction_angle=54)
tough = dict(mode_i_energy=150, mode_ii_energy=300)
LAWS = {
    "linear": laws.Linear(**stiff),
    "Mohr-Coulomb": laws.MohrCoulomb(**strong),
    "cohesive crack": laws.CohesiveCrack(**strong, **tough),
    "Munjiza": laws.MunjizaJoint(**strong, **tough),
    "Camacho-Ortiz": laws.CamachoOrtiz(**even, **tough),
    "bilinear mixed mode": laws.BilinearMixedMode(**even, **tough),
    "Xu-Needleman": laws.XuNeedleman(**even),  # stiffness and strength are its fracture energies, 8.7 and 14.7 J/m2
    "Camacho-Ortiz, 54 deg": laws.CamachoOrtiz(**rough, **tough),
    "bilinear mixed mode, 54 deg": laws.BilinearMixedMode(**rough, **tough),
}


def study(laws, quick=False):
    """Each law on each sample."""
    grains, width, height = (120, 20 * mm, 50 * mm) if quick else (755, 50 * mm, 125 * mm)

    def case(law, seed):
        tessellation = Voronoi(grains=grains, seed=seed).tessellate(rectangle(width, height))
        return gl.Run(gl.Specimen(tessellation, ROCK), law, UniaxialCompression())

    return gl.Study(case, law=laws, seed=[1] if quick else [1, 2, 3])


def main(laws, name):
    parser = argparse.ArgumentParser()
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--out", type=Path, default=name)
    options = parser.parse_args()
    table = study(laws, options.quick).run(options.out)
    means = table.means("law")
    print(table, means["strength"], means["lost_opening"], means["lost_slip"], sep="\n\n")
    table.plot_curves("law").savefig(options.out / "curves.png", dpi=100)
    table.plot_cracks(columns=5).savefig(options.out / "cracks.png", dpi=100)


if __name__ == "__main__":
    main(LAWS, "compare-laws")
