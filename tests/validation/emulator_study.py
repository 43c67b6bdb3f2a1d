"""The emulator that comes with grainlaw: fitted to its rocks, and tried on rocks that it has not seen; a long hour.

python tests/validation/emulator_rocks.py --write
python tests/validation/emulator_rocks.py --unseen --write
python tests/validation/emulator_study.py --fit
python tests/validation/emulator_study.py [--only NAMES] [--write | --check]

``--fit`` writes framework/calibration/mohr_coulomb.json from emulator_rocks.csv, with errors from the rocks of
emulator_unseen.csv. The rest is the judgement of the inverse: hidden rocks are tested as by a laboratory, looked for by
the emulator alone, then by some minutes of tests.
"""

import csv
import json
import os
import sys
from functools import cache, partial
from pathlib import Path
from tempfile import gettempdir

import numpy as np
import scipy
from emulator_rocks import EACH, MODULI, ROCK, ROWS, TESTS, UNSEEN_ROWS
from hidden_rocks_study import specimens, with_errors
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.calibration.calibrate import first_look
from grainlaw.calibration.first_look import FILE, features, places, terms
from grainlaw.calibration.trials import StudySimulator, TrialCase, checked_specimens, checked_tests
from grainlaw.laws import MohrCoulomb
from grainlaw.units import MPa, mm

PACKAGE = Path(__file__).parents[2] / "framework" / "calibration"

# --- the fit ----------------------------------------------------------------------------------------------------------

CONTACTS = ("tension", "angle", "residual", "stiffness", "ratio")
INPUTS = {
    **dict.fromkeys(("ucs", "modulus", "poisson"), (*CONTACTS, "width", "slenderness")),
    "tension": ("tension", "angle", "stiffness", "ratio", "width", "slenderness"),
    "brazilian": (*CONTACTS, "width"),
    "steepness": (*CONTACTS, "strain", "width", "slenderness", "pressure"),
}
LOGS = ("tension", "stiffness", "ratio", "strain", "width")
TAILS = 4  #: degrees of freedom of the scatter: a few specimens bear far more after their first crack
ROUNDS = 8  #: of weights by it
MOST = 0.99  #: of the pressures are in its range


def rocks(file=ROWS):
    """Inputs and values of each specimen by name (n,), nan where a test has none."""
    with file.open(newline="", encoding="utf-8") as text:
        rows = list(csv.DictReader(text))
    given = {name: np.array([float(row[name] or "nan") for row in rows]) for name in rows[0]}
    cohesion = given["strain"] * ROCK.youngs_modulus
    ucs, confined, tension, brazilian = (given[f"{test} strength"] for test in TESTS)
    pressure, bond = given["pressure"] * cohesion, given["tension"] * cohesion
    inputs = {name: np.log(given[name]) if name in LOGS else given[name] for name in INPUTS["steepness"][:-1]}
    inputs["pressure"] = np.log(pressure / ucs)
    return inputs, {
        "ucs": np.log(ucs / cohesion), "tension": np.log(tension / bond), "brazilian": np.log(brazilian / bond),
        "steepness": np.log(confined / ucs) / np.log1p(pressure / ucs),
        "modulus": np.log(given["modulus"]), "poisson": given["poisson"],
    }  # fmt: skip


def fitted(name, inputs, values, ends):
    """Coefficients whose prior has a deviation for each degree, by the largest evidence."""
    known = np.isfinite(values) & np.all([np.isfinite(inputs[each]) for each in INPUTS[name]], axis=0)
    given, y = {each: inputs[each][known] for each in INPUTS[name]}, values[known]
    x, degree = features(places(given, INPUTS[name], ends)), terms(len(INPUTS[name])).sum(axis=1)
    exact = np.log1p(np.exp(given["pressure"])) ** 2 if name == "steepness" else np.ones(len(y))
    exact, weights = exact / exact.mean(), np.ones(len(y))
    middle = np.average(y, weights=exact)

    def covariance(logs):
        prior = np.exp(2 * np.append(3.0, logs[1:]))[degree]
        noise = np.exp(2 * logs[0]) / (exact * weights)
        return prior, noise, (x * prior) @ x.T + np.diag(noise)

    def unlikely(logs):
        lower = np.linalg.cholesky(covariance(logs)[2])
        z = scipy.linalg.solve_triangular(lower, y - middle, lower=True)
        return 0.5 * z @ z + np.log(np.diag(lower)).sum()

    logs = np.array([-2.5, -1.0, -2.0, -3.0])
    for _ in range(ROUNDS):
        options = {"maxiter": 200, "xatol": 0.02, "fatol": 0.05}
        logs = scipy.optimize.minimize(unlikely, logs, method="Nelder-Mead", options=options).x
        prior, _, whole = covariance(logs)
        inverse = np.linalg.inv(whole)
        weighted = inverse @ (y - middle)
        coefficients = prior * (x.T @ weighted)
        off = (y - middle - x @ coefficients) * np.sqrt(exact) / np.exp(logs[0])
        weights = np.ones(len(y)) if name in MODULI else (TAILS + 1) / (TAILS + off**2)
    shared = (x * prior) @ x.T
    of_mean = np.diag(shared) - np.sum((shared @ inverse) * shared, axis=1)
    left = weighted / np.diag(inverse)  # value less what the others predict
    coefficients[0] += middle
    return {
        "inputs": list(INPUTS[name]), "coefficients": [float(f"{c:.6g}") for c in coefficients],
        "error": float(f"{np.sqrt(np.mean(of_mean)):.3g}"),
        "scatter": float(f"{np.sqrt(np.average(left**2, weights=exact)):.3g}"),
    }  # fmt: skip


def off_unseen(name, fit, ends):
    """How far unseen rocks lie from the fit (n,), and the standard error of that by their few specimens."""
    inputs, values = rocks(UNSEEN_ROWS)
    held = {**inputs, "pressure": np.clip(inputs["pressure"], *ends["pressure"])}
    each = values[name] - features(places(held, INPUTS[name], ends)) @ fit["coefficients"]
    exact = np.log1p(np.exp(held["pressure"])) if name == "steepness" else np.ones(len(each))
    each, exact = each.reshape(-1, EACH), exact.reshape(-1, EACH)
    each *= exact / np.sqrt(np.nanmean(exact**2))  # so that none counts more than the strengths that it gives
    means, counts = np.nanmean(each, axis=1), np.isfinite(each).sum(axis=1)
    spread = np.sqrt(np.nanmean((each - means[:, None]) ** 2) * EACH / (EACH - 1))
    for _ in range(ROUNDS if name not in MODULI else 0):
        weights = np.where(np.isfinite(each), (TAILS + 1) / (TAILS + ((each - means[:, None]) / spread) ** 2), 0.0)
        means = np.nansum(weights * each, axis=1) / weights.sum(axis=1)
    scatter = np.nanvar(each, axis=1, ddof=1)
    enough = counts > EACH // 2
    return means[enough], np.sqrt(scatter / counts)[enough]


def error_on_unseen(name, fit, ends):
    """Standard deviation of the fit from the means of many specimens of unseen rocks; a few of these lock.

    By the scale of a t distribution, whose tails are as long.
    """
    off, noise = off_unseen(name, fit, ends)

    def unlikely(log):
        scale = np.hypot(np.exp(log), noise)
        return -np.sum(scipy.stats.t.logpdf(off / scale, TAILS) - np.log(scale))

    size = np.log(np.std(off))
    found = scipy.optimize.minimize_scalar(unlikely, bounds=(size - 4, size + 1), method="bounded")
    return float(np.exp(found.x) * scipy.stats.t.std(TAILS))


def fit():
    inputs, values = rocks()
    ends = {name: [float(f"{end:.6g}") for end in np.nanquantile(each, [0, 1])] for name, each in inputs.items()}
    ends["pressure"] = [float(f"{end:.6g}") for end in np.nanquantile(inputs["pressure"], [1 - MOST, MOST])]
    held = {**inputs, "pressure": np.clip(inputs["pressure"], *ends["pressure"])}
    fits = {name: fitted(name, held, values[name], ends) for name in INPUTS}
    for name, each in fits.items():
        unseen = error_on_unseen(name, each, ends)
        print(
            f"{name}: error {each['error']:.3g} by the fit, {unseen:.3g} on unseen rocks; scatter {each['scatter']:.3g}"
        )
        each["error"] = float(f"{max(each['error'], unseen):.3g}")  # polynomials may not bend as the rocks do
    text = json.dumps({"ends": ends, "fits": fits}, indent=1)
    (PACKAGE / FILE).write_text(text + "\n", encoding="utf-8")


# --- hidden rocks -----------------------------------------------------------------------------------------------------

COUNT, LABORATORY, FRESH = 20, 10, 10
RANGES = {"tensile_strength": (3 * MPa, 40 * MPa), "cohesion": (10 * MPa, 100 * MPa), "friction_angle": (10, 60)}
TRUE = {"cohesion": (20, 60), "tension": (0.15, 0.9), "angle": (15, 55), "stiffness": (1, 10), "ratio": (0.2, 1)}
grains_of = partial(specimens, count=100)
STRENGTHS = ("ucs", "cohesion", "friction_angle", "tensile_strength")
ELASTIC = ("youngs_modulus", "poissons_ratio")
PRESSURE = 0.1  #: of the UCS, about
BUDGET = 18  #: points of the refinement
FIRST = 500  #: seed of the laboratory's specimens


@cache
def hidden():
    """Laws of the rocks, by a Sobol sequence that the emulator has not seen."""
    laws, drawn = [], scipy.stats.qmc.Sobol(len(TRUE), rng=2027)
    while len(laws) < COUNT:
        for share in drawn.random(64):
            cohesion, tension, angle, stiffness, ratio = (
                low * (high / low) ** s for (low, high), s in zip(TRUE.values(), share, strict=True)
            )
            if tension * np.tan(np.radians(angle)) < 0.95:
                kn = stiffness * ROCK.youngs_modulus / np.sqrt(20 * mm * 50 * mm / 100)
                laws.append(MohrCoulomb(
                    kn=kn, ks=ratio * kn, tensile_strength=tension * cohesion * MPa, cohesion=cohesion * MPa,
                    friction_angle=angle, residual_friction_angle=5,
                ))  # fmt: skip
    return laws[:COUNT]


STORE = Path(os.environ.get("EMULATOR_STORE", Path(gettempdir()) / "grainlaw-emulator"))  #: what it has is kept


def simulated(number, law, seeds, pressure):
    """Values (seeds,) of a law on specimens of a rock, by name."""
    names = ("compression", "confined", "tension")
    case = TrialCase(law, {}, (), checked_specimens(grains_of(number), names), checked_tests({}), 1.0)
    rock = StudySimulator(case, {"cohesion": 1}, [pressure], STORE / str(number), progress=False)
    asked = {"cohesion": law.cohesion}
    values = rock.values([asked], (*ELASTIC, *STRENGTHS), seeds, np.ones(1))
    return {name: each[0] for name, each in values.items()}


def pressure_of(number):
    return float(f"{PRESSURE * 4 * hidden()[number].cohesion:.2g}")


@cache
def laboratory(number):
    """Targets from ten specimens of a hidden rock, with their standard errors."""
    values = simulated(number, hidden()[number], range(FIRST, FIRST + LABORATORY), pressure_of(number))
    return with_errors(values)


def asked(number):
    targets = gl.Targets(**laboratory(number), confinements=[pressure_of(number)])
    law = MohrCoulomb(kn=1e14, ks=5e13, tensile_strength=6 * MPa, cohesion=30 * MPa, friction_angle=25,
                      residual_friction_angle=5)  # fmt: skip
    return {"targets": targets, "law": law, "free": RANGES, "specimens": grains_of(number)}


def off(number, values):
    """How far each strength on fresh specimens lies from its target, as a share."""
    return [float(np.nanmean(values[name]) / laboratory(number)[name][0] - 1) for name in STRENGTHS]


def held(number, intervals):
    return sum(low <= getattr(hidden()[number], name) <= high for name, (low, high) in intervals.items())


@cache
def by_look(number):
    """Errors of the first look's best parameters, and how many of its intervals hold the truth."""
    found = first_look(**asked(number))
    if found.posterior is None:
        return [np.nan] * len(STRENGTHS), 0
    space = found.match.space
    fresh = range(FIRST + LABORATORY, FIRST + LABORATORY + FRESH)
    values = simulated(number, space.made(found.best), fresh, pressure_of(number))
    return off(number, values), held(number, found.summary["intervals"])


@cache
def by_tests(number):
    """The same after some minutes of tests."""
    found = gl.calibrate(
        **asked(number), store=STORE / f"{number} calibrated", budget=BUDGET, fresh=FRESH, progress=False
    )
    if not found.is_plausible:
        return [np.nan] * len(STRENGTHS), 0, found.cpu
    measured = {each.name: each.measured for each in found.checks}
    intervals = {each.name: each.interval for each in found.identifiability.parameters}
    return off(number, measured), held(number, intervals), found.cpu


def row(number):
    try:
        (look, truths), (tests, held_then, cpu) = by_look(number), by_tests(number)
    except gl.ParameterError as refusal:  # neither statics nor a test can have its moduli
        print(f"rock {number + 1}: {refusal}", file=sys.stderr)
        return ["-"] * (len(STRENGTHS) + 2)
    return [*(f"{100 * each:+.0f}, {100 * other:+.0f}" for each, other in zip(look, tests, strict=True)),
            f"{truths}, {held_then}", f"{cpu / 60:.0f}"]  # fmt: skip


TABLES = [
    Table(
        page=DOCS / "tables/calibration.md",
        name="first look",
        columns=("rock", *(f"{name.replace('_', ' ').replace('ucs', 'UCS')} (% off)" for name in STRENGTHS),
                 "truths in the intervals, of 3", "core minutes of tests"),
        rows={str(k + 1): partial(row, k) for k in range(COUNT)},
        checked=None,
    )
]  # fmt: skip

if __name__ == "__main__":
    if "--fit" in sys.argv:
        fit()
    else:
        main(TABLES)
