"""A granite predicted from the parameters of others: python docs/examples/granite_blind.py [--seeds 2 5] [--write]

Aboayanah and others 2024 (doi:10.1007/s00603-024-03789-7) model a granite of breakable grains by the combined
finite-discrete element method. Their parameters of minerals and boundaries, its joint element and our loading predict
strength, crack initiation and crack damage; nothing is fitted. docs/rock.md says what had to be assumed. Keeps all in
the folder granite-blind, and goes on where it was interrupted.
"""

import math

import numpy as np
from red_bohus import words
from rock_study import asked, at_most_one, markdown, write

import grainlaw as gl
from grainlaw.geometry import Breakable, Minerals, Voronoi, VoronoiCells, rectangle
from grainlaw.laws import MunjizaJoint
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import GPa, MPa, mm

INSIDE = {  #: E (GPa), Poisson's ratio; f_t (MPa), c (MPa), tan phi, G_I, G_II (J/m2) of cracks through the mineral
    "feldspar": (60, 0.32, 8, 33, 1.27, 390, 690),
    "biotite": (29.3, 0.36, 5.5, 30, 1.27, 599, 1198),
    "quartz": (83.1, 0.17, 14, 35, 1.27, 907, 1810),
}
BETWEEN = {  #: the last five, of boundaries
    ("biotite", "biotite"): (4.95, 27, 1.14, 449, 899),
    ("feldspar", "feldspar"): (7.2, 31, 1.14, 1.98, 465),
    ("quartz", "quartz"): (12.6, 31.5, 1.14, 680, 1361),
    ("biotite", "feldspar"): (8.5, 32.5, 0.81, 1.81, 382),
    ("biotite", "quartz"): (8.5, 31, 0.81, 1.07, 382),
    ("quartz", "feldspar"): (2.0, 32, 0.81, 300, 1450),
}
ENERGIES = {"as printed": 1, "three times 200": 200}  #: factor of the three G_I below 2 J/m2
GRAINS = {3135: 2, 784: 5}  #: numbers of grains, those of the paper and of twice the size, and of specimens
WIDTH, HEIGHT = 61 * mm, 137 * mm
LABORATORY = {"strength": 198.8, "initiation": 71 / 198.8, "damage": 162.7 / 198.8}  #: MPa, and over the strength
# What is assumed:
SHARES = {"feldspar": 0.6, "quartz": 0.3, "biotite": 0.1}
CELLS = 4  #: in a grain, along whose edges it breaks
DENSITY = 2650  #: kg/m3
STIFFNESS = 7.5e14  #: Pa/m, k_n at the origin: ten times E of feldspar over the size of a cell; k_s is half


def joint(tensile_strength, cohesion, friction, mode_i, mode_ii):
    angle = math.degrees(math.atan(friction))
    return MunjizaJoint(
        kn=STIFFNESS, ks=STIFFNESS / 2, tensile_strength=tensile_strength * MPa, cohesion=cohesion * MPa,
        friction_angle=angle, residual_friction_angle=angle, mode_i_energy=mode_i, mode_ii_energy=mode_ii,
    )  # fmt: skip


def laws(energies):
    between = {pair: (*v[:3], v[3] * ENERGIES[energies] if v[3] < 2 else v[3], v[4]) for pair, v in BETWEEN.items()}
    return {("inside", mineral): joint(*v[2:]) for mineral, v in INSIDE.items()} | {
        pair: joint(*v) for pair, v in between.items()
    }


def case(energies, grains, seed):
    made = Minerals(Voronoi(grains=grains, seed=seed), SHARES, seed=seed)
    made = Breakable(made, VoronoiCells(count=CELLS), seed=seed)
    rock = {
        name: gl.Elastic(youngs_modulus=v[0] * GPa, poissons_ratio=v[1], density=DENSITY) for name, v in INSIDE.items()
    }
    specimen = gl.Specimen(made.tessellate(rectangle(WIDTH, HEIGHT)), rock)
    return gl.Run(specimen, laws(energies), UniaxialCompression())


def table_of(tables):
    """Of each number of grains, from its table of both readings of the energies."""
    heads = ["grains", "G_I", "strength (MPa)", "CI/UCS, lateral strain", "CI/UCS, 1 % of the cracks"]
    heads += ["CD/UCS, area", "CD/UCS, cylinder", "E (GPa)", "transgranular"]
    lines = []
    for grains, table in tables.items():
        for energies in ENERGIES:
            of = table.where(energies=energies)
            ratios = [of[f"crack_initiation_{name}_ratio"] for name in ("lateral", "count")]
            damage = [of["crack_damage_ratio"], of["crack_damage_cylinder_ratio"]]
            ratios += [np.array([at_most_one(value) for value in values]) for values in damage]
            cracks = of["tensile_cracks"] + of["shear_cracks"]
            found = [of["strength"] / MPa, *ratios, of["modulus"] / GPa, of["transgranular_cracks"] / cracks]
            lines.append([f"{grains}, {len(of)} specimens", energies, *map(words, found)])
    measured = [f"{LABORATORY[name]:.3g}" for name in ("strength", "initiation", "initiation", "damage", "damage")]
    return markdown(heads, [*lines, ["laboratory", "", *measured, "", ""]])


def main():
    seeds = {"nargs": 2, "default": list(GRAINS.values()), "help": "of 3,135, of 784 grains"}
    given = asked(__doc__, "granite-blind", seeds=seeds)
    tables = {}
    for grains, seeds in reversed([*zip(GRAINS, given.seeds, strict=True)]):
        study = gl.Study(case, energies=list(ENERGIES), grains=[grains], seed=range(1, seeds + 1))
        tables[grains] = study.run(f"{given.folder}/{grains}", workers=given.workers)
        text = table_of(dict(reversed(tables.items())))
        print(text)
    if given.write:
        write("granite blind", text)


if __name__ == "__main__":
    main()
