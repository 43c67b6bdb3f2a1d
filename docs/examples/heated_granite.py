"""A granite heated, cooled and crushed: python docs/examples/heated_granite.py [--grains 60] [--seeds 1]

Minerals expand by different amounts, quartz most of all near its transition at 573 °C, and break their boundaries.
Elastic constants are round numbers of the size of the minerals', bonds are those of no particular granite: brittle
ones, and cohesive cracks of the same strength. Prints strength and modulus over the temperature, and keeps the runs in
heated-granite.
"""

import argparse

import grainlaw as gl
from grainlaw.geometry import Minerals, Voronoi, rectangle
from grainlaw.laws import CohesiveCrack, MohrCoulomb
from grainlaw.materials import ALBITE, BIOTITE, MICROCLINE, QUARTZ, Thermal
from grainlaw.protocols import Heating, UniaxialCompression
from grainlaw.units import GPa, MPa, mm

SHARES = {"quartz": 0.3, "plagioclase": 0.35, "microcline": 0.25, "biotite": 0.1}


def mineral(youngs_modulus, poissons_ratio, density, expansion):
    grain = gl.Elastic(youngs_modulus=youngs_modulus * GPa, poissons_ratio=poissons_ratio, density=density)
    return Thermal(material=grain, expansion=expansion)


ROCK = {
    "quartz": mineral(96, 0.08, 2650, QUARTZ),
    "plagioclase": mineral(70, 0.35, 2630, ALBITE),
    "microcline": mineral(40, 0.32, 2560, MICROCLINE),
    "biotite": mineral(34, 0.25, 3050, BIOTITE),
}
BOND = {"kn": 1e14, "ks": 0.5e14, "tensile_strength": 13 * MPa, "cohesion": 40 * MPa, "friction_angle": 50,
        "residual_friction_angle": 35}  # fmt: skip
LAWS = {"brittle": MohrCoulomb(**BOND), "cohesive": CohesiveCrack(**BOND, mode_i_energy=15, mode_ii_energy=30)}
CRUSH = UniaxialCompression(loading=gl.Adaptive(rate=0.003), samples=200, maximum_strain=0.008)


def case(law, temperature, seed, grains):
    """Heat to a temperature (°C), cool, and compress."""
    made = Minerals(Voronoi(grains=grains, seed=seed), SHARES, seed=seed).tessellate(rectangle(20 * mm, 50 * mm))
    heated = temperature != 20
    test = Heating(to=(temperature, 20), samples=50, test=CRUSH) if heated else CRUSH
    return gl.Run(gl.Specimen(made, ROCK), LAWS[law], test)


def study(temperatures, seeds, grains):
    return gl.Study(case, law=[*LAWS], temperature=temperatures, seed=range(1, seeds + 1), grains=[grains])


def main():
    words = argparse.ArgumentParser(description=__doc__)
    words.add_argument("--temperatures", type=float, nargs="+", default=[20, 100, 300, 600])
    words.add_argument("--grains", type=int, default=60)
    words.add_argument("--seeds", type=int, default=1)
    words.add_argument("--folder", default="heated-granite")
    given = words.parse_args()
    table = study(given.temperatures, given.seeds, given.grains).run(given.folder)
    for row in range(len(table["temperature"])):
        heated, strength, modulus = (table[name][row] for name in ("temperature", "strength", "apparent_modulus"))
        print(f"{table['law'][row]:8} {heated:6.0f} °C  UCS {strength / MPa:5.1f} MPa  E {modulus / GPa:5.1f} GPa")


if __name__ == "__main__":
    main()
