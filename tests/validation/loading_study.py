"""What the loading of a test costs and how exact it is: the tables of docs/validation.md under "Loading".

    python tests/validation/loading_study.py [--write]

``--write`` puts the tables into the page, between the marks that name them. 755 grains of the published sample, and the
default specimens of the other tests.
"""

import argparse
import os
import re
from pathlib import Path

import attrs

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.cli.table1 import LAWS, ROCK, SAMPLE
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import PrePeak
from grainlaw.protocols import UniaxialCompression
from grainlaw.runs.parallel import Run, simulate_all
from grainlaw.units import MPa

PAGE = Path(__file__).parents[2] / "docs" / "validation.md"
MOHR_COULOMB, CRACK = LAWS["mohr-coulomb"], LAWS["cohesive-crack"]
PLAIN = gl.CentralDifference(beside_loading=False)
#: test, seed, what it is given, speed and ramp at which it was loaded before
TESTS = [
    *(("uniaxial-compression", seed, {}, (0.05, 0.0)) for seed in (1, 2, 3)),
    ("uniaxial-tension", 1, {}, (0.005, 0.0)),
    ("biaxial-compression", 1, {"confinement": "10 MPa"}, (0.05, 0.0)),
    ("brazilian", 1, {}, (0.02, 2e-4)),
    ("direct-shear", None, {"normal_stress": "5 MPa"}, (0.01, 0.0)),
    ("semi-circular-bend", 1, {}, (0.01, 2e-4)),
]
RATES = (0.006, 0.003, 0.0015, 0.00075)
DAMPINGS = {
    "local, 0.8": gl.LocalDamping(fraction=0.8), "local, 0.4": gl.LocalDamping(fraction=0.4),
    "local, 0.1": gl.LocalDamping(fraction=0.1), "mass, 3e4 per s": gl.MassDamping(coefficient=3e4),
}  # fmt: skip
DAMPED = {
    "Mohr-Coulomb": MOHR_COULOMB, "cohesive crack": CRACK,
    "its linear pre-peak": attrs.evolve(CRACK, pre_peak=PrePeak.LINEAR),
    "its printed pre-peak": attrs.evolve(CRACK, pre_peak=PrePeak.AS_PRINTED),
}  # fmt: skip


def sample(seed):
    width, height, grains = SAMPLE
    return gl.Specimen(Voronoi(grains=grains, seed=seed).tessellate(rectangle(width, height)), ROCK)


def all_of(runs):
    outcome = simulate_all(runs, frames=1)
    return {key: result.summary for key, result in outcome.results.items()}


def peak(found):
    return found["peak_stress"] / MPa if "peak_stress" in found else found["peak_force"] / 1e3


def cell(found):
    return f"{peak(found):.4g}, {found['steps'] / 1000:,.0f}, {found['platen_imbalance'] * 100:.2g} %"


def cost():
    """Every test as it was loaded before, and as it is."""
    runs = {}
    for name, seed, given, (speed, ramp) in TESTS:
        for law in ("mohr-coulomb", "cohesive-crack"):
            sections = {"law": {"type": law}, "test": given} | ({"sample": {"seed": seed}} if seed else {})
            made = configured(name, sections)
            before = attrs.evolve(made.protocol, loading=gl.Constant(speed=speed, ramp=ramp), integrator=PLAIN)
            runs[name, seed, law, "before"] = Run(made.specimen, made.law, before)
            runs[name, seed, law, "now"] = Run(made.specimen, made.law, made.protocol)
    found = all_of(runs)
    lines = [
        "| test | seed | Mohr-Coulomb: constant speed | adaptive | cohesive crack: constant speed | adaptive |",
        "|---|---|---|---|---|---|",
    ]
    for name, seed, _, _ in TESTS:
        cells = [
            cell(found[name, seed, law, when])
            for law in ("mohr-coulomb", "cohesive-crack") for when in ("before", "now")
        ]  # fmt: skip
        lines.append(f"| {name} | {seed or ''} | {' | '.join(cells)} |")
    return lines


def rates():
    """Peak and steps over the rate of loading."""
    laws = {"Mohr-Coulomb": MOHR_COULOMB, "cohesive crack": CRACK}
    runs = {
        (name, seed, rate): Run(sample(seed), law, UniaxialCompression(loading=gl.Adaptive(rate=rate)))
        for name, law in laws.items() for seed in (1, 2, 3) for rate in RATES
    }  # fmt: skip
    found = all_of(runs)
    lines = ["| law, seed | " + " | ".join(f"rate {rate:g}" for rate in RATES) + " |", "|---" * (len(RATES) + 1) + "|"]
    for name in laws:
        for seed in (1, 2, 3):
            cells = " | ".join(cell(found[name, seed, rate]) for rate in RATES)
            lines.append(f"| {name}, {seed} | {cells} |")
    return lines


def damping():
    """Strength over kind and strength of damping."""
    kinds = {
        name: gl.CentralDifference(damping=kind) for name, kind in DAMPINGS.items()
    } | {"local, 0.8, of all motion": PLAIN}  # fmt: skip
    runs = {
        (law, kind): Run(sample(1), made, UniaxialCompression(integrator=integrator))
        for law, made in DAMPED.items() for kind, integrator in kinds.items()
    }  # fmt: skip
    found = all_of(runs)
    lines = ["| damping | " + " | ".join(DAMPED) + " |", "|---" * (len(DAMPED) + 1) + "|"]
    for kind in kinds:
        cells = (f"{peak(found[law, kind]):.1f}" if (law, kind) in found else "-" for law in DAMPED)
        lines.append(f"| {kind} | {' | '.join(cells)} |")
    return lines


TABLES = {"loading: cost": cost, "loading: rates": rates, "loading: damping": damping}


def write(name, lines):
    """Put a table between its marks in the page."""
    page = PAGE.read_text(encoding="utf-8")
    mark = re.compile(rf"(<!-- table {re.escape(name)} -->\n).*?(<!-- end -->)", re.DOTALL)
    text, count = mark.subn(lambda found: found[1] + "\n".join(lines) + "\n" + found[2], page)
    assert count == 1, f"{PAGE} has no place for the table {name}"
    beside = PAGE.with_suffix(".part")
    beside.write_text(text, encoding="utf-8")
    os.replace(beside, PAGE)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    for name, table in TABLES.items():
        if options.only in name:
            lines = table()
            print(f"\n{name}\n", *lines, sep="\n", flush=True)
            if options.write:
                write(name, lines)


if __name__ == "__main__":
    main()
