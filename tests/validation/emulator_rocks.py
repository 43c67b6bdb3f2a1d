"""Rocks that the emulator of the package is fitted to: random Mohr-Coulomb contacts, four tests each; a core hour.

python tests/validation/emulator_rocks.py [--unseen] [--points 1000] [--workers N] [--folder emulator-rocks] [--write]

Goes on where it was interrupted. The second half of a longer sequence fills the gaps of the first. With ``--unseen``
the rocks that follow in the sequence, each on several specimens: they tell how much the emulator errs.
"""

import argparse
import csv
import warnings
from pathlib import Path

import numpy as np
import scipy

import grainlaw as gl
from grainlaw.geometry import Voronoi, disc, rectangle
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import BiaxialCompression, Brazilian, UniaxialCompression, UniaxialTension
from grainlaw.strength import Until
from grainlaw.units import GPa, mm

ROWS = Path(__file__).with_suffix(".csv")
UNSEEN_ROWS = ROWS.with_stem("emulator_unseen")
UNSEEN, EACH, AFTER = 48, 8, 10_000  # rocks, specimens of each, and the number that their seeds begin after
ROCK = gl.Elastic(youngs_modulus=60 * GPa, poissons_ratio=0.25, density=2700)
GRAIN = 2 * mm
LOGS = {
    "tension": (0.06, 1.2),  # tensile strength over cohesion
    "stiffness": (0.5, 20),  # kn times grain size over modulus of the grains
    "ratio": (0.1, 1.2),  # ks over kn
    "strain": (2e-4, 2e-3),  # cohesion over modulus of the grains
    "pressure": (0.03, 2),  # confinement over cohesion
    "width": (4, 12),  # of the specimen, in grain sizes
}
EVEN = {"angle": (5, 65), "residual": (0, 1), "slenderness": (2, 3)}  # deg; tan(residual angle) over tan(angle)
SEED = 37
MODULI = ("modulus", "poisson")
TESTS = ("compression", "confined", "tension", "brazilian")


def points(count):
    """Of a scrambled Sobol sequence those that the law takes, by name."""
    drawn = scipy.stats.qmc.Sobol(len(LOGS) + len(EVEN), rng=SEED)
    found = []
    while len(found) < count:
        for share in drawn.random(1024):
            point = {name: low * (high / low) ** s for (name, (low, high)), s in zip(LOGS.items(), share, strict=False)}
            ends = zip(EVEN.items(), share[len(LOGS) :], strict=True)
            point |= {name: low + s * (high - low) for (name, (low, high)), s in ends}
            if point["tension"] * np.tan(np.radians(point["angle"])) <= 0.98:
                found.append({name: float(f"{value:.5g}") for name, value in point.items()})
    return found[:count]


def law_of(point):
    cohesion, kn = point["strain"] * ROCK.youngs_modulus, point["stiffness"] * ROCK.youngs_modulus / GRAIN
    residual = np.degrees(np.arctan(point["residual"] * np.tan(np.radians(point["angle"]))))
    return MohrCoulomb(
        kn=kn, ks=point["ratio"] * kn, tensile_strength=point["tension"] * cohesion, cohesion=cohesion,
        friction_angle=point["angle"], residual_friction_angle=float(residual),
    )  # fmt: skip


def case(test, seed, **point):
    width, law = point["width"] * GRAIN, law_of(point)
    region = disc(width) if test == "brazilian" else rectangle(width, point["slenderness"] * width)
    specimen = gl.Specimen(Voronoi(grain_size=GRAIN, seed=seed).tessellate(region), ROCK)
    pressure = point["pressure"] * law.cohesion
    root = np.tan(np.pi / 4 + np.radians(point["angle"]) / 2)
    strong = 2 * law.cohesion * root  # of one plane
    soft = ROCK.youngs_modulus / (1 + 1.5 / point["stiffness"] / min(point["ratio"], 1))
    far = min(4 * (strong + (root**2 + 1) * pressure * (test == "confined")) / soft, 0.4)
    return gl.Run(specimen, law, {
        "compression": UniaxialCompression(until=Until.FAILURE, maximum_strain=far, samples=2000),
        "confined": BiaxialCompression(
            confinement=pressure, until=Until.FAILURE, maximum_strain=far, samples=2000
        ),
        "tension": UniaxialTension(
            until=Until.FAILURE, maximum_strain=8 * law.tensile_strength / soft, samples=2000
        ),
        "brazilian": Brazilian(
            until=Until.FAILURE, maximum_strain=min(20 * law.tensile_strength / soft, 0.2), samples=2000
        ),
    }[test])  # fmt: skip


def design(count):
    return [{"test": test, "seed": k + 1, **point} for k, point in enumerate(points(count)) for test in TESTS]


def unseen(count):
    """Of the rocks that follow the first ``count``."""
    of = [(AFTER + EACH * k + s, point) for k, point in enumerate(points(count + UNSEEN)[count:]) for s in range(EACH)]
    return [{"test": test, "seed": seed, **point} for seed, point in of for test in TESTS]


def moduli(row, drawn):
    if row["modulus"] is None or row["modulus"] != row["modulus"]:
        return "", ""
    run = case("compression", row["seed"], **drawn)
    found = gl.elastic_properties(run.specimen, run.law)
    return f"{row['modulus'] / found.modulus:.5g}", f"{row['poisson'] - found.poisson:.5g}"


def write(table, file):
    """A specimen in each row: what was drawn, its strengths (Pa), and how far its moduli in the test are off those of
    statics: the modulus over it, Poisson's ratio less it. Empty where a test has none.
    """
    rocks = {}
    for row in table.rows:
        strength = row["strength"] if row["status"] == "finished" else None
        known = strength is not None and strength == strength
        drawn = {name: row[name] for name in (*LOGS, *EVEN)}
        rock = rocks.setdefault(row["seed"], drawn)
        rock[f"{row['test']} strength"] = f"{strength:.5g}" if known else ""
        if row["test"] == "compression":
            rock |= dict(zip(MODULI, moduli(row, drawn) if known else ("", ""), strict=True))
    with file.open("w", newline="", encoding="utf-8") as to:
        rows = csv.DictWriter(to, (*LOGS, *EVEN, *(f"{test} strength" for test in TESTS), *MODULI), lineterminator="\n")
        rows.writeheader()
        rows.writerows(rocks.values())


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--points", type=int, default=1000)
    arguments.add_argument("--workers", type=int)
    arguments.add_argument("--folder", default="emulator-rocks")
    arguments.add_argument("--unseen", action="store_true", help="the rocks that follow, on several specimens each")
    arguments.add_argument(
        "--write", action="store_true", help="emulator_rocks.csv or emulator_unseen.csv beside this file"
    )
    given = arguments.parse_args()
    warnings.simplefilter("ignore", gl.CostWarning)
    cases = (unseen if given.unseen else design)(given.points)
    table = gl.Study(case, cases=cases, measures=[]).run(given.folder, workers=given.workers)
    print(table)
    if given.write:
        write(table, UNSEEN_ROWS if given.unseen else ROWS)


if __name__ == "__main__":
    main()
