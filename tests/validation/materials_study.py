"""How much the failure of grains that soften depends on their zones: a table of docs/tables/materials.md.

python tests/validation/materials_study.py [--write | --check]
"""

from functools import partial

from study_tables import DOCS, Table, main

import grainlaw as gl
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import Linear
from grainlaw.materials import MohrCoulombPlastic
from grainlaw.protocols import UniaxialCompression
from grainlaw.units import GPa, MPa, mm

SOFTENING = MohrCoulombPlastic(
    youngs_modulus=60 * GPa, poissons_ratio=0.25, density=2650, tensile_strength=15 * MPa, cohesion=40 * MPa,
    friction_angle=30, dilation_angle=5, residual_cohesion=10 * MPa, residual_friction_angle=25, softening_strain=0.05,
)  # fmt: skip
TEST = UniaxialCompression(maximum_strain=0.012, samples=240, stop_fraction=0)


def row(refinement):
    """Strength, stress at the end, and what the grains have dissipated by then."""
    grains = Voronoi(grains=12, seed=1).tessellate(rectangle(20 * mm, 40 * mm))
    curves = gl.simulate(gl.Specimen(grains, SOFTENING, refinement=refinement), Linear(kn=2e14, ks=2e14), TEST).curves
    yield f"{curves['stress'].max() / MPa:.1f}"
    yield f"{curves['stress'][-1] / MPa:.0f}"
    yield f"{curves['energy_zones_dissipated'][-1]:.0f}"


TABLES = [
    Table(
        page=DOCS / "tables/materials.md",
        name="softening by refinement",
        columns=("zones cut into four", "strength (MPa)", "stress at 1.2 % (MPa)", "dissipated (J/m)"),
        rows={name: partial(row, times) for times, name in enumerate(("never", "once", "twice", "three times"))},
        firm=("strength (MPa)",),
        checked=("never", "once"),
    )
]

if __name__ == "__main__":
    main(TABLES)
