"""The cohesive crack model on one joint between two blocks, as its paper verifies it.

python docs/paper/joint.py [--out FOLDER]
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import click
import numpy as np
import scipy

from grainlaw.cli.default_rock import LAWS, ROCK
from grainlaw.cli.setups import PULLED, SHEARED, WIDTH
from grainlaw.columns import STAGE
from grainlaw.conditions import StageError
from grainlaw.drawing.palette import color
from grainlaw.engine.stepping import InstabilityError
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import CohesiveCrack, SofteningLength
from grainlaw.loading import Constant
from grainlaw.protocols import DirectShear, JointTension
from grainlaw.quantity import aligned
from grainlaw.results.files import writable_folder, write_atomically
from grainlaw.results.tables import write_json
from grainlaw.runs.record import described, origin
from grainlaw.runs.simulation import simulate
from grainlaw.specimen import Specimen
from grainlaw.units import MPa, mm, um
from grainlaw.workbench.driver import trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grainlaw.drawing.figure import Figure

Curves = Mapping[str, np.ndarray]
Row = tuple[str, float, float, float]  #: quantity, paper (nan where it gives none), theory, this program
COLUMN = 125 * mm  #: height of the blocks of the paper, beside the low ones
PRESSURE = 40 * MPa  #: normal stress of the shear test
SLOW = Constant(speed=5 * mm)  #: per second
TENSION = JointTension(loading=SLOW)
FINE = attrs.evolve(TENSION, resolution=0.0025 * um)  # a peak is at 0.34
SHEAR = DirectShear(normal_stress=PRESSURE, maximum_slip=40 * um, reverse_to=0.5, loading=SLOW, resolution=0.01 * um)
PLACES = (5 * um, 10 * um, 20 * um)
TOLERANCE = 0.01
HEAD = ("", "paper", "theory", "grainlaw", "off by")


@click.command()
@click.option("--out", type=click.Path(path_type=Path), default="out", show_default=True, help="Folder to write to.")
def verify(*, out: Path) -> None:
    """Verify the cohesive crack model on one joint between two blocks.

    A joint is pulled, unloaded, reloaded until it breaks, closed and pulled again, and sheared under a constant normal
    stress and back. Prints each quantity as the paper of the model (see paper.py) has it, by theory and by this
    program, writes the table and what it was made with to verify.json, and draws verify_tension.png and
    verify_shear.png. The exit code is 1 if one is more than 1 % from theory.
    """
    try:
        folder = writable_folder(out)
        found = joint()
        for name, figure in (("tension", found.tension_figure), ("shear", found.shear_figure)):
            write_atomically(folder / f"verify_{name}.png", lambda file, f=figure: f.savefig(file, dpi=130))  # type: ignore[misc]
        names = ("quantity", "paper", "theory", "grainlaw")
        table = [dict(zip(names, row, strict=True)) for row in (*found.tension, *found.shear)]
        write_json(folder / "verify.json", {"table": table, **found.laws, **origin()})
    except (InstabilityError, StageError, OSError) as error:
        raise click.ClickException(str(error)) from None
    click.echo(aligned([HEAD, *cells([*found.tension, *found.shear])]))
    click.echo(f"\nwritten to {folder}{os.sep}: verify_tension.png, verify_shear.png, verify.json")
    if found.worst > TOLERANCE:
        raise click.ClickException(f"{100 * found.worst:.2f} % from theory, more than {100 * TOLERANCE:g} %")


@attrs.frozen(eq=False)
class Joint:
    """What one joint between two blocks does, beside what it should."""

    tension: list[Row]
    shear: list[Row]
    tension_figure: Figure
    shear_figure: Figure
    laws: dict[str, Any]  #: described

    @property
    def worst(self) -> float:
        """The largest deviation from theory, relative."""
        rows = (*self.tension, *self.shear)
        return max(abs(program / theory - 1) for _, _, theory, program in rows if theory)


def joint() -> Joint:
    """Pull and shear a joint. Raises as :func:`simulate`."""
    exact = LAWS["cohesive-crack"]
    assert isinstance(exact, CohesiveCrack)
    printed = attrs.evolve(exact, softening_length=SofteningLength.CLOSED_FORM)
    frictionless = _without_friction(printed)
    pulled, pulled_exact = _run(printed, FINE, PULLED), _run(exact, TENSION, PULLED)
    tall = _run(printed, JointTension(), COLUMN)
    sheared = _run(frictionless, SHEAR, SHEARED)
    return Joint(
        _tension_rows(printed, pulled, exact, pulled_exact), _shear_rows(frictionless, sheared),
        _tension_figure(printed, pulled, tall), _shear_figure(frictionless, sheared),
        {"law": described(printed), "exact": described(exact), "sheared": described(frictionless)},
    )  # fmt: skip


def _without_friction(law: CohesiveCrack) -> CohesiveCrack:
    """The same with the shear strength of no friction under ``PRESSURE``: f_s = c there."""
    angle = law.residual_friction_angle  # a contact cannot gain friction by breaking
    return attrs.evolve(law, friction_angle=angle, cohesion=law.cohesion - PRESSURE * math.tan(math.radians(angle)))


def _run(law: CohesiveCrack, test: JointTension | DirectShear, height: float) -> Curves:
    blocks = Specimen(Bricks(rows=2).tessellate(rectangle(WIDTH, height)), ROCK)
    return simulate(blocks, law, test, frames=1, progress=False).curves


# --- the table -------------------------------------------------------------------------------------------------------


def softening(damage: float) -> float:
    """Eq. (2) of the paper, in the terms of the paper."""
    a, b, c = 0.63, 1.8, 6
    fall = 1 - (a + b - 1) / (a + b) * math.exp(damage * (a + c * b) / ((a + b) * (1 - a - b)))
    return fall * (a * (1 - damage) + b * (1 - damage) ** c)


def _breaks(curves: Curves) -> int:
    """The first sample at which the whole joint has broken."""
    return int(np.argmax(curves["broken"] >= 1))


def _loading(curves: Curves, displacement: str) -> np.ndarray:
    """Samples before the break at which a displacement is larger than ever before."""
    before = curves[displacement][: _breaks(curves)]
    return np.flatnonzero(before >= np.maximum.accumulate(before))


def _slope(curves: Curves, chosen: np.ndarray) -> float:
    return float(np.polyfit(curves["opening"][chosen], curves["normal"][chosen], 1)[0]) * 1e-12


def _tension_rows(law: CohesiveCrack, curves: Curves, exact: CohesiveCrack, exact_curves: Curves) -> list[Row]:
    opening, normal = curves["opening"], curves["normal"]
    strength, energy = law.tensile_strength, law.mode_i_energy
    peak = math.e * strength / law.kn  # Eq. (1)
    last, exact_last = (peak + length * energy / strength for length in (3, exact.softening.length))  # Eq. (4)

    def softened(place: float) -> float:
        return softening((place - peak) / (last - peak)) * strength / MPa

    out, end = _loading(curves, "opening"), _breaks(curves)
    back = np.setdiff1d(np.arange(end), out)
    turn = opening[: back[0]].max()  # the upper block does not turn round at once
    secant = back[(opening[back] > 1 * um) & (opening[back] < 4 * um)]
    again = normal[end:][opening[end:] > 0]
    rise = (1 - 2 / math.e) * law.kn * peak**2
    worked, exact_worked = (c["energy_contacts_normal"][_breaks(c)] / WIDTH for c in (curves, exact_curves))
    unknown = math.nan
    return [
        ("peak tension (MPa)", strength / MPa, strength / MPa, normal[out].max() / MPa),
        ("  at an opening of (um)", peak / um, peak / um, opening[out[np.argmax(normal[out])]] / um),
        *((f"tension at {x / um:g} um (MPa)", unknown, softened(x), np.interp(x, opening[out], normal[out]) / MPa)
          for x in PLACES),
        (f"unloading from {turn / um:.3f} um (TPa/m)", unknown, softened(turn) / (turn / um), _slope(curves, secant)),
        ("broken at, L = 3 (um)", last / um, last / um, opening[end] / um),
        ("broken at, exact L (um)", unknown, exact_last / um, exact_curves["opening"][_breaks(exact_curves)] / um),
        ("closing again (TPa/m)", law.kn * 1e-12, law.kn * 1e-12, _slope(curves, np.flatnonzero(opening < 0))),
        ("tension when pulled again (MPa)", 0.0, 0.0, np.abs(again).max() / MPa),
        ("work beyond the rise, L = 3 (J/m2)", energy, 3 * energy * _integral(softening), worked - rise),
        ("work beyond the rise, exact L (J/m2)", energy, energy, exact_worked - rise),
    ]  # fmt: skip


def _shear_rows(law: CohesiveCrack, curves: Curves) -> list[Row]:
    slip, shear = curves["slip"], curves["shear"]
    strength = law.cohesion + PRESSURE * math.tan(math.radians(law.friction_angle))
    friction = PRESSURE * math.tan(math.radians(law.residual_friction_angle))  # Eq. (7)
    peak = math.e * strength / law.ks  # Eq. (9)
    last = peak + 3 * law.mode_ii_energy / strength  # Eq. (8)

    def softened(damage: float) -> float:
        return max(softening(damage) * strength, friction)

    out, end = _loading(curves, "slip"), _breaks(curves)
    sheared = int(np.flatnonzero(curves[STAGE] == 1)[-1])  # before it turns back
    rise = (1 - 2 / math.e) * law.ks * peak**2
    unknown = math.nan
    return [
        ("peak shear (MPa)", strength / MPa, strength / MPa, shear.max() / MPa),
        ("  at a slip of (um)", peak / um, peak / um, slip[np.argmax(shear)] / um),
        *((f"shear at {x / um:g} um (MPa)", unknown, softened((x - peak) / (last - peak)) / MPa,
           np.interp(x, slip[out], shear[out]) / MPa) for x in PLACES),
        ("broken at, L = 3 (um)", last / um, last / um, slip[end] / um),
        ("residual shear (MPa)", friction / MPa, friction / MPa, shear[sheared] / MPa),
        ("  after reversal (MPa)", -friction / MPa, -friction / MPa, shear[-1] / MPa),
        ("work to the break, L = 3 (J/m2)", unknown, rise + (last - peak) * _integral(softened),
         curves["energy_contacts_shear"][end] / WIDTH),
        ("normal stress, least and largest (MPa)", PRESSURE / MPa, PRESSURE / MPa,
         curves["normal_stress"][_settled(curves)].min() / MPa),
        ("", PRESSURE / MPa, PRESSURE / MPa, curves["normal_stress"][_settled(curves)].max() / MPa),
    ]  # fmt: skip


def _settled(curves: Curves) -> np.ndarray:
    """Samples after the normal stress has come up."""
    return curves["displacement"] > 0.1 * um


def _integral(function: Callable[[float], float]) -> float:
    """Over [0, 1]."""
    return float(scipy.integrate.quad(function, 0, 1, limit=200)[0])


def cells(rows: list[Row]) -> list[tuple[str, ...]]:
    """Rows as texts, under ``HEAD``."""
    found: list[tuple[str, ...]] = []
    for quantity, paper, theory, program in rows:
        off = f"{100 * (program / theory - 1):+.2f} %" if theory else "-"
        found.append((quantity, "-" if math.isnan(paper) else f"{paper:.4f}", f"{theory:.4f}", f"{program:.4f}", off))
    return found


# --- the figures -----------------------------------------------------------------------------------------------------


def _tension_figure(law: CohesiveCrack, curves: Curves, tall: Curves) -> Figure:
    """Like the paper's Fig. 5."""
    figure, axes = _axes("opening of the joint (µm)", "normal stress (MPa)")
    alone = trace(law, np.append(0, curves["opening"]), 0.0)
    axes.plot(tall["opening"] / um, tall["normal"] / MPa, color=color(1), lw=1, label="125 mm column: snaps back")
    axes.plot(curves["opening"] / um, curves["normal"] / MPa, color=color(0), lw=2.2, label="10 mm blocks")
    axes.plot(alone.opening / um, alone.normal / MPa, "k--", lw=0.9, label="the law alone")
    axes.set_title("pull, unload, reload, break, close, pull again")
    axes.legend(frameon=False)
    return figure


def _shear_figure(law: CohesiveCrack, curves: Curves) -> Figure:
    """Like the paper's Fig. 6."""
    figure, axes = _axes("slip of the joint (µm)", "shear stress (MPa)")
    alone = trace(law, np.append(0, curves["opening"]), np.append(0, curves["slip"]))
    axes.plot(curves["slip"] / um, curves["shear_stress"] / MPa, color=color(0), lw=2.2, label="4 mm blocks")
    axes.plot(alone.slip / um, alone.shear / MPa, "k--", lw=0.9, label="the law alone")
    axes.set_title(f"shear under {PRESSURE / MPa:g} MPa, and back")
    axes.legend(frameon=False)
    return figure


def _axes(along: str, up: str) -> tuple[Figure, Axes]:
    from grainlaw.drawing.figure import Figure

    figure = Figure(figsize=(7, 4.5), layout="constrained")
    axes = figure.subplots()
    axes.set_xlabel(along)
    axes.set_ylabel(up)
    axes.grid(alpha=0.25)
    axes.axhline(0, color="0.5", lw=0.6)
    return figure, axes


if __name__ == "__main__":
    verify()
