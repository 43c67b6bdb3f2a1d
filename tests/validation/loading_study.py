"""What the loading of a test costs and how exact it is: docs/tables/loading.md.

    python tests/validation/loading_study.py [--write | --check]

The published sample, and the default specimens of the other tests.
"""

from functools import partial

import attrs
from paper_sample import sample, summaries
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.cli.configuration import configured
from grainlaw.cli.default_rock import LAWS
from grainlaw.integration import CentralDifference, LocalDamping, MassDamping, VibrationDamping
from grainlaw.laws import PrePeak
from grainlaw.protocols import UniaxialCompression
from grainlaw.runs.parallel import Run
from grainlaw.units import MPa

MOHR_COULOMB, CRACK = LAWS["mohr-coulomb"], LAWS["cohesive-crack"]
PLAIN = CentralDifference(damping=LocalDamping(), beside_loading=False)
#: test, seed, what it is given, speed and ramp at which it was loaded before
TESTS = [
    ("uniaxial-compression", 1, {}, (0.05, 0.0)),
    ("uniaxial-tension", 1, {}, (0.005, 0.0)),
    ("biaxial-compression", 1, {"confinement": "10 MPa"}, (0.05, 0.0)),
    ("brazilian", 1, {}, (0.02, 2e-4)),
    ("direct-shear", None, {"normal_stress": "5 MPa"}, (0.01, 0.0)),
    ("semi-circular-bend", 1, {}, (0.01, 2e-4)),
]
RATES = (0.006, 0.003, 0.0015, 0.00075)
DAMPINGS = {
    "vibration, 0.8": VibrationDamping(),
    "local, 0.8": LocalDamping(fraction=0.8), "local, 0.4": LocalDamping(fraction=0.4),
    "local, 0.1": LocalDamping(fraction=0.1), "mass, 3e4 per s": MassDamping(coefficient=3e4),
}  # fmt: skip
DAMPED = {
    "Mohr-Coulomb": MOHR_COULOMB, "cohesive crack": CRACK,
    "its linear pre-peak": attrs.evolve(CRACK, pre_peak=PrePeak.LINEAR),
    "its printed pre-peak": attrs.evolve(CRACK, pre_peak=PrePeak.AS_PRINTED),
}  # fmt: skip


KINDS = {
    **{name: CentralDifference(damping=kind) for name, kind in DAMPINGS.items()}, "local, 0.8, of all motion": PLAIN
}  # fmt: skip


def peak(found):
    return found["strength"] / MPa if "strength" in found else found["failure_force"] / 1e3


def cell(found):
    return f"{peak(found):.4g}, {found['steps'] / 1000:,.0f}, {found['imbalance'] * 100:.2g} %"


def cost(name, seed, given, before):
    """A test as it was loaded before, and as it is."""
    speed, ramp = before
    runs = {}
    for law in ("mohr-coulomb", "cohesive-crack"):
        sections = {"law": {"type": law}, "test": given} | ({"sample": {"seed": seed}} if seed else {})
        made = configured(name, sections)
        constant = attrs.evolve(made.protocol, loading=gl.Constant(speed=speed, ramp=ramp), integrator=PLAIN)
        runs[law, "constant"] = Run(made.specimen, made.law, constant)
        runs[law, "adaptive"] = Run(made.specimen, made.law, made.protocol)
    found = summaries(runs)
    return [cell(found[key]) for key in runs]


def rates(law, seed):
    """Peak and steps over the rate of loading."""
    test = UniaxialCompression()
    found = summaries({
        rate: Run(sample(seed), law, attrs.evolve(test, loading=gl.Adaptive(rate=rate))) for rate in RATES
    })  # fmt: skip
    return [cell(found[rate]) for rate in RATES]


def damping(integrator):
    """Strength by law, where the loading finds the accuracy that is asked for."""
    found = summaries({
        name: Run(sample(1), law, UniaxialCompression(integrator=integrator)) for name, law in DAMPED.items()
    })  # fmt: skip
    return [f"{peak(found[name]):.1f}" if name in found else "-" for name in DAMPED]


PAGE = DOCS / "tables/loading.md"
TABLES = [
    Table(
        page=PAGE,
        name="loading: cost",
        columns=(
            "test, seed", "Mohr-Coulomb: constant speed", "adaptive", "cohesive crack: constant speed", "adaptive "
        ),
        rows={f"{name}, {seed}" if seed else name: partial(cost, name, seed, *rest) for name, seed, *rest in TESTS},
        checked=("uniaxial-compression, 1",),
    ),
    Table(
        page=PAGE,
        name="loading: rates",
        columns=("law, seed", *(f"rate {rate:g}" for rate in RATES)),
        rows={
            f"{name}, {seed}": partial(rates, law, seed)
            for name, law in {"Mohr-Coulomb": MOHR_COULOMB, "cohesive crack": CRACK}.items() for seed in (1, 2, 3)
        },
        checked=("Mohr-Coulomb, 1",),
    ),
    Table(
        page=PAGE,
        name="loading: damping",
        columns=("damping", *DAMPED),
        rows={name: partial(damping, kind) for name, kind in KINDS.items()},
        firm=("cohesive crack", "its linear pre-peak"),
        checked=("local, 0.4",),
    ),
]  # fmt: skip

if __name__ == "__main__":
    main(TABLES)
