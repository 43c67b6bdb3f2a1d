"""What the damping does to the strength, by reading of the cohesive crack: tables and figure of flutter.

    python tests/validation/flutter_study.py [--write | --check]

Each law is held at three stresses without damping; then the uniaxial strength is found with local damping and with ever
less mass-proportional damping.
"""

from functools import cache, partial

import attrs
import numpy as np
from matplotlib.figure import Figure
from paper_sample import sample
from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.cli.default_rock import LAWS
from grainlaw.laws import PrePeak
from grainlaw.loading import AccuracyError
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import MPa

CRACK = LAWS["cohesive-crack"]
HELD = {
    "cohesive crack": CRACK,
    "cohesive crack, as printed": attrs.evolve(CRACK, pre_peak=PrePeak.AS_PRINTED),
    "cohesive crack, linear": attrs.evolve(CRACK, pre_peak=PrePeak.LINEAR),
    "Munjiza": LAWS["munjiza"],
    "Mohr-Coulomb": LAWS["mohr-coulomb"],
    "Camacho-Ortiz": LAWS["camacho-ortiz"],
    "bilinear mixed mode": LAWS["bilinear-mixed-mode"],
    "Xu-Needleman": LAWS["xu-needleman"],
}
STRESSES = (26 * MPa, 51 * MPa, 99 * MPa)
LOADED = ("cohesive crack", "cohesive crack, as printed", "cohesive crack, linear", "Munjiza", "Mohr-Coulomb")
DAMPINGS = {
    "local 0.8": gl.integration.LocalDamping(),
    "mass 1e5 1/s": gl.integration.MassDamping(coefficient=1e5),
    "mass 3e4 1/s": gl.integration.MassDamping(coefficient=3e4),
    "mass 1e4 1/s": gl.integration.MassDamping(coefficient=1e4),
}


@cache
def held(name, stress):
    """What became of a specimen that was held; None if it failed before."""
    try:
        return gl.hold(sample(1), HELD[name], stress)
    except gl.StageError:
        return None


def hold(name):
    cells = []
    for stress in STRESSES:
        one = held(name, stress)
        if one is None:
            cells.append("fails before")
        elif one.flutters:
            cells.append(f"flutters, tenfold in {np.log(10) / one.rate * 1e6:.3g} us")
        else:
            cells.append(f"{one.kinetic.max():.0e} J/m")
    return cells


def load(name, damping):
    test = UniaxialCompression(integrator=gl.integration.CentralDifference(damping=DAMPINGS[damping]))
    try:
        one = gl.simulate(sample(1), HELD[name], test, frames=1).summary
    except AccuracyError:
        return ("not in balance", "", "", "")
    return (
        f"{one['strength'] / MPa:.1f}",
        f"{one['kinetic_ratio']:.0e}",
        f"{one['imbalance'] * 100:.1f} %",
        f"{one['energy_made']:.0e}",
    )


def figure(file):
    """Kinetic energy of the held samples over time."""
    figure = Figure(figsize=(9, 4), layout="constrained")
    for axes, stress in zip(figure.subplots(1, 2, sharey=True), STRESSES[1:], strict=True):
        for k, name in enumerate(HELD):
            if one := held(name, stress):
                axes.semilogy(one.time * 1e6, np.maximum(one.kinetic, 1e-13), color=f"C{k}", label=name, lw=1.3)
        axes.set(xlabel="time without damping (us)", title=f"held at {stress / MPa:g} MPa")
        axes.grid(alpha=0.25)
        axes.legend(frameon=False, fontsize=7)
    figure.axes[0].set_ylabel("kinetic energy (J/m)")
    figure.savefig(file, dpi=110)


TABLES = [
    Table(
        page=DOCS / "tables/flutter.md",
        name="flutter: held",
        columns=("law", *(f"{stress / MPa:g} MPa" for stress in STRESSES)),
        rows={name: partial(hold, name) for name in HELD},
        checked=("cohesive crack, as printed", "Mohr-Coulomb"),
    ),
    Table(
        page=DOCS / "tables/flutter.md",
        name="flutter: strength",
        columns=("law, damping", "peak (MPa)", "kinetic ratio", "imbalance", "energy made"),
        rows={f"{name}, {damping}": partial(load, name, damping) for name in LOADED for damping in DAMPINGS},
        checked=("Mohr-Coulomb, mass 1e5 1/s",),
    ),
]

if __name__ == "__main__":
    main(TABLES, {"flutter": figure})
