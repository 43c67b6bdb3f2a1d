"""A granite predicted from the parameters of others: python docs/examples/granite_blind.py [--seeds 2 5 10] [--write]

Aboayanah and others 2024 (doi:10.1007/s00603-024-03789-7) model a granite of breakable grains by the combined
finite-discrete element method. Their parameters of minerals and boundaries, its joint element and our loading predict
strength, crack initiation and crack damage; nothing is fitted. docs/rock.md says what had to be assumed. Keeps all in
the folder granite-blind, and goes on where it was interrupted.
"""

import attrs
import numpy as np
from red_bohus import words
from rock_study import asked, at_most_one, markdown, write

import grainlaw as gl
from grainlaw.laws import CohesiveCrack
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import GPa, MPa

ROCK = gl.rocks["granite-aboayanah-2024"]  #: its file has their parameters, and what is assumed
CRACKS = "as printed, cohesive cracks"  #: of the same strengths and energies, which make no energy
ENERGIES = {"as printed": 1, "three times 200": 200, CRACKS: 1}  #: factor of the three G_I below 2 J/m2
SAME = ("kn", "ks", "tensile_strength", "cohesion", "friction_angle", "residual_friction_angle", "mode_i_energy",
        "mode_ii_energy")  # fmt: skip
#: numbers of grains, those of the paper and of twice and four times the size, and of specimens
GRAINS = {3135: 2, 784: 5, 196: 10}
LABORATORY = {"strength": 198.8, "initiation": 71 / 198.8, "damage": 162.7 / 198.8}  #: MPa, and over the strength


def laws(energies):
    """The joints; three energies are multiplied."""

    def read(joint):
        factor = ENERGIES[energies] if joint.mode_i_energy < 2 else 1
        joint = attrs.evolve(joint, mode_i_energy=factor * joint.mode_i_energy)
        return CohesiveCrack(**{name: getattr(joint, name) for name in SAME}) if energies == CRACKS else joint

    return {pair: read(joint) for pair, joint in ROCK.law.items()}


def case(energies, grains, seed):
    return gl.Run(ROCK.specimen(grains=grains, seed=seed), laws(energies), UniaxialCompression())


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
    seeds = {"nargs": 3, "default": list(GRAINS.values()), "help": "of 3,135, of 784, of 196 grains"}
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
