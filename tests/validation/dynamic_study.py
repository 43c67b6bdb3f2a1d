"""Tests with waves against closed forms, and strength over strain rate: tables of docs/tables/waves.md.

python tests/validation/dynamic_study.py [--write | --check]
"""

import sys
import warnings
from functools import cache, partial
from pathlib import Path

import attrs
import numpy as np
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack, JohnsonCook, RateDependent
from grainlaw.protocols import SplitHopkinson, UniaxialCompression

sys.path.insert(0, str(Path(__file__).parents[1]))
from bars import ROCK, broken_up, fragment_size, met, slipped, slips
from support import STRONG
from test_split_hopkinson import errors

PAGE = DOCS / "tables/waves.md"
warnings.filterwarnings("ignore", category=gl.UnitWarning)  # bricks as if of a piece; ends that are fast

# --- closed forms ----------------------------------------------------------------------------------------------------


def specimen_row(bricks):
    return [f"{100 * one:.3f}" for one in errors(bricks)]


def meeting_row(ratio):
    found = [met(bricks, ratio) for bricks in (20, 40, 80)]
    return [f"{1 / ratio:.3f}", *(f"{second - first:.3f}" for first, second in found)]


def joint_row(ratio):
    found = [slipped(bricks, ratio) for bricks in (40, 80)]
    return [f"{cell:.4f}" for k, theory in enumerate(slips(ratio)) for cell in (theory, *(each[k] for each in found))]


def fragment_row(rate):
    cells = [f"{fragment_size(rate):.3f}", f"{4 / rate * np.sinh(np.arcsinh(1.5 * rate) / 3):.3f}"]
    for scatter in (1e-4, 0.02, 0.2):
        sizes = [broken_up(rate, 10, seed, scatter) for seed in range(1, 6)]
        cells.append(f"{np.mean(sizes):.3f} ± {np.std(sizes, ddof=1):.3f}")
    return cells


# --- strength over strain rate ---------------------------------------------------------------------------------------

SIDE, MODULUS, SEEDS = 10e-3, 36e9, (1, 2)
AT_REST = CohesiveCrack(**STRONG, mode_i_energy=40.0, mode_ii_energy=200.0)
LAWS = {False: AT_REST, True: RateDependent(law=AT_REST, effect=JohnsonCook())}
#: 1/s, and the stress (Pa) up to which the wave rises
RATES = {1: 450e6, 10: 500e6, 100: 700e6, 300: 900e6, 1000: 1200e6}


def rock(seed):
    return gl.Specimen(Voronoi(grains=120, seed=seed).tessellate(rectangle(SIDE, SIDE)), ROCK)


@cache
def at_rest(seed):
    """Pa, strength of the slow test."""
    slow = UniaxialCompression(maximum_strain=0.03)
    return gl.simulate(rock(seed), AT_REST, slow, frames=1, progress=False).summary["strength"]


def pressed(rate, seed, by_rate):
    """The test at a strain rate: the wave rises to what holds both bars apart at it, and then as the specimen loads."""
    test = SplitHopkinson(test=UniaxialCompression(until=gl.Until.FAILURE))
    offset, rise, duration = test.impedance * SIDE * rate / 2, 3e-6, RATES[rate] / MODULUS / rate
    wave = [(0, 0), (rise, -offset - MODULUS * rate * rise), (duration, -offset - MODULUS * rate * duration)]
    test = attrs.evolve(test, wave=wave, duration=duration, samples=1500)
    return gl.simulate(rock(seed), LAWS[by_rate], test, frames=1, progress=False).summary


def concrete(rate):
    """Factor of the fib Model Code 2010 for concrete in compression, its reference 3e-5 /s; numbers second-hand."""
    share = rate / 3e-5
    return share**0.014 if rate <= 30 else 0.012 * share ** (1 / 3)


def tuff(rate):
    """Factor of dry tuff over its strength below 82 /s, from where it grows as the cube root (Olsson 1989)."""
    return max(rate / 82, 1) ** (1 / 3)


def rate_row(rate):
    runs = {by_rate: [pressed(rate, seed, by_rate) for seed in SEEDS] for by_rate in (False, True)}
    factors = {
        by_rate: [run["strength"] / at_rest(seed) for run, seed in zip(each, SEEDS, strict=True)]
        for by_rate, each in runs.items()
    }
    plain = runs[False]
    return [
        " / ".join(f"{run['strain_rate']:.3g}" for run in plain),
        " / ".join(f"{100 * run['end_difference']:.1f}" for run in plain),
        *(" / ".join(f"{one:.2f}" for one in factors[by_rate]) for by_rate in (False, True)),
        f"{tuff(rate):.2f}",
        f"{concrete(rate):.2f}",
    ]


TABLES = [
    Table(
        page=PAGE,
        name="elastic specimen",
        columns=("bricks on the height", "largest error (% of the wave)", "root mean square (%)"),
        rows={str(bricks): partial(specimen_row, bricks) for bricks in (10, 20, 40)},
        checked=("20",),
    ),
    Table(
        page=PAGE,
        name="bars that meet",
        columns=("length of the second bar", "theory", "20 bricks", "40 bricks", "80 bricks"),
        rows={f"{ratio} times": partial(meeting_row, ratio) for ratio in (1, 2, 3)},
        firm=("theory", "80 bricks"),
        checked=("2 times",),
    ),
    Table(
        page=PAGE,
        name="slipping joint",
        columns=(
            "strength / amplitude", "energy through", "40 bricks", "80", "energy taken", "40 bricks", "80",
            "first harmonic", "40 bricks", "80",
        ),
        rows={f"{ratio:g}": partial(joint_row, ratio) for ratio in (0.3, 0.6, 0.9)},
        firm=("energy through", "energy taken", "first harmonic"),
        checked=("0.6",),
    ),
    Table(
        page=PAGE,
        name="fragments",
        columns=("strain rate", "fit", "energy balance", "no defects", "strengths ± 2 %", "strengths ± 20 %"),
        rows={f"{rate:g}": partial(fragment_row, rate) for rate in (0.1, 0.3, 1.0, 3.0, 10.0)},
        firm=("fit", "energy balance"),
        checked=("1",),
    ),
    Table(
        page=DOCS / "waves.md",
        name="strain rate",
        columns=(
            "strain rate wanted (1/s)", "had (1/s)", "difference of end forces (%)", "inertia alone",
            "law that knows the rate", "dry tuff (Olsson)", "concrete (Model Code)",
        ),
        rows={str(rate): partial(rate_row, rate) for rate in RATES},
        firm=("inertia alone",),
        checked=("1000",),
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES)
