"""The page of the paper's results: its figures in its order, beside theory and what this program gives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from joint import HEAD, Row, cells
from paper_calibration import parameters, targets_met
from paper_numbers import PAPER, Paper, contact_rows, cycle_work, macroscopic, statement
from paper_runs import AS_PRINTED, BREAKING, CONFINEMENTS, ELASTIC, LOCAL, RULES, SEEDS

from grainlaw.cli.default_rock import LAWS, ROCK
from grainlaw.drawing.palette import color, marker
from grainlaw.laws import CohesiveCrack
from grainlaw.results.figures.pages import Cell, headed, write_page
from grainlaw.units import GPa, MPa

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure

TEMPLATE = Path(__file__).resolve().with_name("page.html")


def write(paper: Paper, file: Path) -> None:
    """Write the page. Raises OSError."""
    write_page(
        file, TEMPLATE, title="The paper on one page", table_1=_table_1(), joint=paper.joint,
        tension=_listed(paper.joint.tension), shear=_listed(paper.joint.shear), contact=_listed(contact_rows()),
        sample=_sample(paper), flutter=_flutter(paper), calibrated=_calibrated(paper), statement=list(statement(paper)),
    )  # fmt: skip


def _sample(paper: Paper) -> dict[str, Any]:
    free = paper.table.where(confinement=0.0, damping=LOCAL)
    shown = [
        {"law": law, "damping": LOCAL, "confinement": 0.0, "seed": SEEDS[0]}
        for law in BREAKING
        if len(found := free.where(law=law, seed=SEEDS[0])) and found.is_finished(0)
    ]
    return {
        "curves": free.plot_curves("law"),
        "cracks": free.plot_cracks(shown) if shown else None,
        "compressions": list(_compressions(paper)),
        "envelope": _envelope(paper),
        "macroscopic": headed(macroscopic(paper)),
    }


def _compressions(paper: Paper) -> Iterator[Sequence[str]]:
    for law in (*BREAKING, ELASTIC):
        found = paper.compressed(law)
        for k, row in enumerate(found.rows):
            if not found.is_finished(k):
                yield law, str(row["seed"]), f"{row['status']}: {row['reason']}", "", "", ""
                continue
            cracks = (f"{row[name]:.0f}" for name in ("tensile_cracks", "shear_cracks"))
            strength, strain = (found.quantity(name).text(row[name]) for name in ("strength", "failure_strain"))
            yield law, str(row["seed"]), "does not break" if law == ELASTIC else strength, strain, *cracks


def _flutter(paper: Paper) -> dict[str, Any]:
    damped = {law: paper.by_damping(law) for law in RULES}
    dampings = list(dict.fromkeys(name for found in damped.values() for name in found))
    return {
        "cycles": [
            (law, Cell(f"{cycle_work(RULES[law]):.1f}"), str(paper.held[law]).partition(":")[0]) for law in paper.held
        ],
        "dampings": dampings,
        "damped": [
            [law, *(f"{found[name] / MPa:.1f}" if name in found else "" for name in dampings)]
            for law, found in damped.items()
            if len(found) > 1
        ],
    }


def _calibrated(paper: Paper) -> dict[str, Any] | None:
    if not paper.calibrated:
        return None
    conflicts = {law: answer["conflicts"] for law, answer in paper.calibrated.items() if not answer["plausible"]}
    return {
        "tables": [headed(lines) for lines in (parameters(paper.calibrated), targets_met(paper.calibrated))],
        "conflicts": {law: "; ".join(" and ".join(c["targets"]) for c in each) for law, each in conflicts.items()},
    }


def _envelope(paper: Paper) -> Figure:
    """Peaks over confinement and their lines, as the paper's Fig. 9, with the paper's own line."""
    from grainlaw.drawing.figure import Figure

    figure = Figure(figsize=(7, 4.8), layout="constrained")
    axes = figure.subplots()
    along = np.linspace(0, max(CONFINEMENTS), 2)
    for k, law in enumerate(BREAKING):
        for seed in SEEDS:
            points = paper.peaks(law, seed)
            axes.plot(points[:, 0] / MPa, points[:, 1] / MPa, marker=marker(k), linestyle="none", color=color(k), ms=4)
        for n, line in enumerate(paper.lines(law)):
            label = None if n else law
            axes.plot(along / MPa, (line.ucs + line.slope * along) / MPa, color=color(k), lw=1, label=label)
    label = f"paper: c = {PAPER['cohesion'] / MPa} MPa, phi = {PAPER['friction_angle']} deg"
    axes.plot(along / MPa, (PAPER["ucs"] + PAPER["slope"] * along) / MPa, "k--", label=label)
    axes.set_xlabel("confinement (MPa)")
    axes.set_ylabel("strength (MPa)")
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, fontsize=9)
    return figure


def _table_1() -> list[tuple[str, str]]:
    law = LAWS["cohesive-crack"]
    assert isinstance(law, CohesiveCrack)
    readings = ", ".join(f"{name} = {value.name.lower().replace('_', ' ')}" for name, value in AS_PRINTED.items())
    return [
        ("grains", f"E = {ROCK.youngs_modulus / GPa:g} GPa, nu = {ROCK.poissons_ratio:g}, {ROCK.density:g} kg/m3"),
        ("stiffness of contacts", f"k_n = {law.kn:.3g} Pa/m, k_s = {law.ks:.3g} Pa/m"),
        ("strength", f"tension {law.tensile_strength / MPa:g} MPa, cohesion {law.cohesion / MPa:g} MPa, friction "
                     f"{law.friction_angle:g} deg, residual {law.residual_friction_angle:g} deg"),
        ("fracture energies", f"{law.mode_i_energy:g} and {law.mode_ii_energy:g} J/m2"),
        ("as printed", readings),
    ]  # fmt: skip


def _listed(rows: list[Row]) -> dict[str, Any]:
    return {"rows": cells(rows), "heads": HEAD}
