"""The command that shows a material of grains alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import click

from grainlaw.cli.answers import answer, json_option
from grainlaw.cli.default_rock import ROCK
from grainlaw.cli.law import write_picture
from grainlaw.cli.law_file import find_with_files
from grainlaw.cli.running import completed
from grainlaw.fields import ParameterError
from grainlaw.material import Material
from grainlaw.materials import ConstantExpansion, DruckerPrager, MohrCoulombPlastic, Thermal, TransverselyIsotropic
from grainlaw.messages import nearest
from grainlaw.runs.material_check import check_material
from grainlaw.runs.record import described, own_sources
from grainlaw.units import GPa, MPa

_GRAIN: dict[str, Any] = {"youngs_modulus": 60 * GPa, "poissons_ratio": 0.25, "density": 2650}
#: with values of the size of granite's minerals and of a mica schist, to look at their curves
EXAMPLES: dict[str, Material] = {
    "elastic": ROCK,
    "transversely-isotropic": TransverselyIsotropic(
        youngs_modulus=60 * GPa, youngs_modulus_across=30 * GPa, poissons_ratio=0.2, poissons_ratio_across=0.15,
        shear_modulus_across=14 * GPa, density=2750, foliation_angle=30,
    ),
    "drucker-prager": DruckerPrager(**_GRAIN, cohesion=40 * MPa, friction_angle=45, dilation_angle=10),
    "thermal": Thermal(material=ROCK, expansion=ConstantExpansion(8e-6)),
    "mohr-coulomb-plastic": MohrCoulombPlastic(
        **_GRAIN, tensile_strength=15 * MPa, cohesion=40 * MPa, friction_angle=45, dilation_angle=5,
        residual_cohesion=4 * MPa, residual_friction_angle=35, softening_strain=0.02,
    ),
}  # fmt: skip


@click.command(
    help=f"""Show a material of grains: what the conformance kit finds, and the curves of one zone as material_NAME.png;
what it was made with goes to material_NAME.json.

MATERIAL is one of {", ".join(EXAMPLES)}, with values as an example, or FILE.py:MATERIAL, an instance in the file or a
class whose parameters all have defaults. The file is run. The exit code is 1 if a property fails."""
)
@click.argument("material", metavar="MATERIAL", shell_complete=completed(EXAMPLES))
@click.option("--out", type=click.Path(path_type=Path), default="out", show_default=True, help="Folder to write to.")
@json_option
def material(*, material: str, out: Path) -> None:
    from grainlaw.workbench.material_figure import plot_material  # loads matplotlib

    try:
        chosen = find_with_files(material, Material)[0] if ".py" in material else _named(material)
        report, figure = check_material(chosen), plot_material(chosen)
    except (TypeError, ValueError) as error:
        raise click.BadParameter(str(error)) from None
    record = {"material": described(chosen), "sources": own_sources(chosen)}
    where = write_picture(out, "material", material, figure, record)
    answer(f"{report}\n\n{where}", passed=report.passed, **attrs.asdict(report))
    if not report.passed:
        raise SystemExit(1)


def _named(name: str) -> Material:
    if name not in EXAMPLES:
        known = ", ".join(EXAMPLES)
        raise ParameterError(f"there is no material '{name}'{nearest(name, EXAMPLES)} (materials: {known})")
    return EXAMPLES[name]
