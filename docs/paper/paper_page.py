"""The page of the paper's results: its figures in its order, beside theory and what this program gives."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from joint import HEAD, Row, cells
from paper_calibration import parameters, targets_met
from paper_numbers import PAPER, Paper, contact_rows, cycle_work, macroscopic, statement
from paper_runs import AS_PRINTED, BREAKING, CONFINEMENTS, ELASTIC, LOCAL, RULES, SEEDS

from grainlaw.cli.default_rock import LAWS, ROCK
from grainlaw.drawing.palette import color, marker
from grainlaw.laws import CohesiveCrack
from grainlaw.results.figures import html
from grainlaw.results.figures.html import Cell
from grainlaw.units import GPa, MPa

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure

READ = (
    "Paper: Application of cohesive crack model to simulation of rocks mechanical behavior in grain-based distinct "
    "element model (2019). Theory is what its equations give by hand. As printed takes its equations literally: the "
    "exponential rise before the peak in loading and unloading, L = 3, and the shear branch that falls below the "
    "residual friction. Cohesive crack is the reading that grainlaw takes by default, in which no contact makes energy."
)
FLUTTER = (
    "As printed, a contact whose shear stiffness follows the pressure can give more work than was done on it. A sample "
    "at rest then begins to vibrate by itself, and its strength depends on the damping, which the paper does not state."
)

CALIBRATED = (
    "Found by grainlaw calibrate on pieces of 270 grains, three seeds, and checked on ten others: mean and its 95 % "
    "interval. A target is met within 5 %, or within that interval."
)


def parts(paper: Paper) -> Iterator[str]:
    """The page, part by part."""
    yield html.text("h1", "The paper on one page")
    yield html.text("p", READ)
    yield html.text("h2", "Table 1: the rock and its contacts")
    yield html.table(_table_1())
    yield html.text("h2", "Fig. 5: a joint is pulled, unloaded, broken, closed, and pulled again; Eqs. (1) to (4)")
    yield html.picture(paper.joint.tension_figure, "Normal stress over opening, L = 3")
    yield _listed(paper.joint.tension)
    yield html.text("h2", "Fig. 6: a joint is sheared under 40 MPa, and back; Eqs. (5) to (9)")
    yield html.picture(paper.joint.shear_figure, "Shear stress over slip, L = 3, no friction before the break")
    yield _listed(paper.joint.shear)
    yield html.text("h2", "Both modes at once and closure; Eqs. (11) and (12)")
    yield _listed(contact_rows())
    yield from _sample(paper)
    yield from _flutter(paper)
    yield from _calibrated(paper)
    yield html.text("h2", "What this says")
    for words in statement(paper):
        yield html.text("p", words)


def _sample(paper: Paper) -> Iterator[str]:
    free = paper.table.where(confinement=0.0, damping=LOCAL)
    yield html.text("h2", "Fig. 8: uniaxial compression")
    yield html.picture(free.plot_curves("law"), "Stress over strain: each seed thin, the median of each law thick")
    shown = [
        {"law": law, "damping": LOCAL, "confinement": 0.0, "seed": SEEDS[0]}
        for law in BREAKING
        if len(found := free.where(law=law, seed=SEEDS[0])) and found.is_finished(0)
    ]
    if shown:
        yield html.picture(free.plot_cracks(shown), "Cracks at the end, seed 1: tensile thin, shear thick")
    yield html.table(_compressions(paper), ["law", "seed", "UCS (MPa)", "strain at failure (%)", "tensile", "shear"])
    yield html.text("h2", "Fig. 9: strength over confinement; Eqs. (13) and (14)")
    yield html.picture(_envelope(paper), "Peaks under 0 to 4 MPa, and the lines through them")
    head, *rows = macroscopic(paper)
    yield html.numbers(rows, head)


def _compressions(paper: Paper) -> Iterator[Sequence[str]]:
    for law in (*BREAKING, ELASTIC):
        found = paper.compressed(law)
        for k, row in enumerate(found.rows):
            if not found.is_finished(k):
                yield law, str(row["seed"]), f"{row['status']}: {row['reason']}", "", "", ""
                continue
            cracks = (f"{row[name]:.0f}" for name in ("tensile_cracks", "shear_cracks"))
            strength, strain = (found.look(name).text(row[name]) for name in ("strength", "failure_strain"))
            yield law, str(row["seed"]), "does not break" if law == ELASTIC else strength, strain, *cracks


def _flutter(paper: Paper) -> Iterator[str]:
    yield html.text("h2", "Flutter: contacts that make energy")
    yield html.text("p", FLUTTER)
    rows = [
        (law, Cell(f"{cycle_work(RULES[law]):.1f}", "number"), str(paper.held[law]).partition(":")[0])
        for law in paper.held
    ]
    yield html.table(rows, ["law", "given in a cycle (J/m2; negative: taken)", "sample held without damping"])
    damped = {law: paper.by_damping(law) for law in RULES}
    dampings = list(dict.fromkeys(name for found in damped.values() for name in found))
    lines = [
        [law, *(f"{found[name] / MPa:.1f}" if name in found else "" for name in dampings)]
        for law, found in damped.items()
        if len(found) > 1
    ]
    yield html.numbers(lines, ["UCS (MPa), seed 1", *dampings])


def _calibrated(paper: Paper) -> Iterator[str]:
    if not paper.calibrated:
        return
    yield html.text("h2", "Calibrated: which contact parameters give the paper's rock")
    yield html.text("p", CALIBRATED)
    for lines in (parameters(paper.calibrated), targets_met(paper.calibrated)):
        head, *rows = lines
        yield html.numbers(rows, head)
    for law, answer in paper.calibrated.items():
        if not answer["plausible"]:
            sets = "; ".join(" and ".join(conflict["targets"]) for conflict in answer["conflicts"])
            yield html.text("p", f"{law}: no parameters in the ranges meet all targets; in conflict: {sets}", "warning")


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


def _listed(rows: list[Row]) -> str:
    return html.numbers(cells(rows), HEAD)
