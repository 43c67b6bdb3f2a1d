"""Rocks that the emulators of the package are fitted to: random contacts of a law, four tests each; a core hour or two.

python tests/validation/emulator_rocks.py [--law cohesive-crack] [--unseen] [--points 1000] [--workers N]
    [--folder emulator-rocks] [--write]

Goes on where it was interrupted, and after the rocks that the table beside this file has. The second half of a longer
sequence fills the gaps of the first. With ``--unseen`` the rocks that follow the first thousand, each on several
specimens: they tell how much the emulator errs.
"""

import argparse
import csv
import warnings
from pathlib import Path

import numpy as np
import scipy

import grainlaw as gl
from grainlaw.geometry import Voronoi, disc, rectangle
from grainlaw.laws import CohesiveCrack, MohrCoulomb
from grainlaw.protocols import BiaxialCompression, Brazilian, UniaxialCompression, UniaxialTension
from grainlaw.strength import Until
from grainlaw.units import GPa, mm

ROWS = {"mohr-coulomb": Path(__file__).with_suffix(".csv")}
ROWS["cohesive-crack"] = ROWS["mohr-coulomb"].with_stem("emulator_crack_rocks")
UNSEEN_ROWS = {law: file.with_stem(file.stem.replace("rocks", "unseen")) for law, file in ROWS.items()}
UNSEEN, EACH, AFTER = 48, 8, 10_000  # rocks, specimens of each, and the number that their seeds begin after
BEFORE = 1000  # rocks of the sequence that those follow
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
OF_CRACKS = {
    "length": (0.1, 30),  # energy in mode I times modulus over tensile strength squared (Hillerborg), in grain sizes
    "energies": (1, 10),  # that in mode II over that in mode I
}
LOGS_OF = {"mohr-coulomb": LOGS, "cohesive-crack": {**LOGS, **OF_CRACKS}}
EVEN = {"angle": (5, 65), "residual": (0, 1), "slenderness": (2, 3)}  # deg; tan(residual angle) over tan(angle)
SEED = 37
MODULI = ("modulus", "poisson")
TESTS = ("compression", "confined", "tension", "brazilian")


def points(law, count):
    """Of a scrambled Sobol sequence those that the law takes, by name."""
    logs = LOGS_OF[law]
    drawn = scipy.stats.qmc.Sobol(len(logs) + len(EVEN), rng=SEED)
    found = []
    while len(found) < count:
        for share in drawn.random(1024):
            point = {name: low * (high / low) ** s for (name, (low, high)), s in zip(logs.items(), share, strict=False)}
            ends = zip(EVEN.items(), share[len(logs) :], strict=True)
            point |= {name: low + s * (high - low) for (name, (low, high)), s in ends}
            if point["tension"] * np.tan(np.radians(point["angle"])) <= 0.98:
                found.append({name: float(f"{value:.5g}") for name, value in point.items()})
    return found[:count]


def law_of(point):
    cohesion, kn = point["strain"] * ROCK.youngs_modulus, point["stiffness"] * ROCK.youngs_modulus / GRAIN
    residual = np.degrees(np.arctan(point["residual"] * np.tan(np.radians(point["angle"]))))
    given = {
        "kn": kn, "ks": point["ratio"] * kn, "tensile_strength": point["tension"] * cohesion, "cohesion": cohesion,
        "friction_angle": point["angle"], "residual_friction_angle": float(residual),
    }  # fmt: skip
    if "length" not in point:
        return MohrCoulomb(**given)
    energy = point["length"] * GRAIN * given["tensile_strength"] ** 2 / ROCK.youngs_modulus
    return CohesiveCrack(**given, mode_i_energy=energy, mode_ii_energy=point["energies"] * energy)


def case(test, seed, **point):
    width, law = point["width"] * GRAIN, law_of(point)
    region = disc(width) if test == "brazilian" else rectangle(width, point["slenderness"] * width)
    specimen = gl.Specimen(Voronoi(grain_size=GRAIN, seed=seed).tessellate(region), ROCK)
    pressure = point["pressure"] * law.cohesion
    root = np.tan(np.pi / 4 + np.radians(point["angle"]) / 2)
    strong = 2 * law.cohesion * root  # of one plane
    soft = ROCK.youngs_modulus / (1 + 1.5 / point["stiffness"] / min(point["ratio"], 1))
    more = 2 * getattr(law, "softening_opening", 0.0) / width
    far = min(4 * (strong + (root**2 + 1) * pressure * (test == "confined")) / soft + more, 0.4)
    return gl.Run(specimen, law, {
        "compression": UniaxialCompression(until=Until.FAILURE, maximum_strain=far, samples=2000),
        "confined": BiaxialCompression(
            confinement=pressure, until=Until.FAILURE, maximum_strain=far, samples=2000
        ),
        "tension": UniaxialTension(
            until=Until.FAILURE, maximum_strain=8 * law.tensile_strength / soft + more, samples=2000
        ),
        "brazilian": Brazilian(
            until=Until.FAILURE, maximum_strain=min(20 * law.tensile_strength / soft + more, 0.2), samples=2000
        ),
    }[test])  # fmt: skip


def design(law, count):
    return [{"test": test, "seed": k + 1, **point} for k, point in enumerate(points(law, count)) for test in TESTS]


def unseen(law):
    following = points(law, BEFORE + UNSEEN)[BEFORE:]
    of = [(AFTER + EACH * k + s, point) for k, point in enumerate(following) for s in range(EACH)]
    return [{"test": test, "seed": seed, **point} for seed, point in of for test in TESTS]


def moduli(row, drawn):
    if row["modulus"] is None or row["modulus"] != row["modulus"]:
        return "", ""
    run = case("compression", row["seed"], **drawn)
    found = gl.elastic_properties(run.specimen, run.law)
    return f"{row['modulus'] / found.modulus:.5g}", f"{row['poisson'] - found.poisson:.5g}"


def write(table, law, file):
    """A specimen in each row: what was drawn, its strengths (Pa), and how far its moduli in the test are off those of
    statics: the modulus over it, Poisson's ratio less it. Empty where a test has none. Those before stay.
    """
    rocks, names = {}, (*LOGS_OF[law], *EVEN)
    for row in table.rows:
        strength = row["strength"] if row["status"] == "finished" else None
        known = strength is not None and strength == strength
        drawn = {name: row[name] for name in names}
        rock = rocks.setdefault(row["seed"], drawn)
        rock[f"{row['test']} strength"] = f"{strength:.5g}" if known else ""
        if row["test"] == "compression":
            rock |= dict(zip(MODULI, moduli(row, drawn) if known else ("", ""), strict=True))
    is_new = not file.exists()
    with file.open("a", newline="", encoding="utf-8") as to:
        rows = csv.DictWriter(to, (*names, *(f"{test} strength" for test in TESTS), *MODULI), lineterminator="\n")
        if is_new:
            rows.writeheader()
        rows.writerows(rocks.values())


def there(file):
    """How many specimens a table has."""
    return len(file.read_text("utf-8").splitlines()) - 1 if file.exists() else 0


def main():
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--law", choices=LOGS_OF, default="mohr-coulomb")
    arguments.add_argument("--points", type=int, default=1000)
    arguments.add_argument("--workers", type=int)
    arguments.add_argument("--folder", default="emulator-rocks")
    arguments.add_argument("--unseen", action="store_true", help="the rocks that follow, on several specimens each")
    arguments.add_argument("--write", action="store_true", help="the table beside this file")
    given = arguments.parse_args()
    warnings.simplefilter("ignore", gl.CostWarning)
    file = (UNSEEN_ROWS if given.unseen else ROWS)[given.law]
    every = unseen(given.law) if given.unseen else design(given.law, given.points)
    cases = every[len(TESTS) * there(file) :]
    if not cases:
        raise SystemExit(f"{file} has all of them")
    table = gl.Study(case, cases=cases, measures=[]).run(given.folder, workers=given.workers)
    print(table)
    if given.write:
        write(table, given.law, file)


if __name__ == "__main__":
    main()
