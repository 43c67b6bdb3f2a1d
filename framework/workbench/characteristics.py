"""A contact law in numbers: stiffness, strengths, displacements at failure and work, found by driving it."""

from __future__ import annotations

import math
from collections.abc import Callable

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked
from grainlaw.contact import ContactLaw
from grainlaw.quantity import aligned
from grainlaw.workbench.driver import Contact, Trace, alone, work_done
from grainlaw.workbench.scale import FAR, measure, peak_along
from grainlaw.workbench.shear_box import pulled, sheared

FINE, QUICK = 1000, 100  #: steps to the peak, from there to the break, and again where either is
Answer = tuple[np.ndarray, np.ndarray, np.ndarray]  #: displacements, tractions, damage
LONG = 30.0  #: breaking displacements after which what remains is residual


@attrs.frozen(kw_only=True)
class Mode(metaclass=Checked):
    """Failure in tension, or in shear under one pressure.

    A number is nan where there is none: a law that never peaks, a contact that never breaks.
    """

    pressure: float = math.nan  #: Pa, held while the contact slips; nan where it is pulled
    peak: float = math.nan  #: Pa
    displacement: float = math.nan  #: m, opening or slip at the peak
    breaking: float = math.nan  #: m, where damage reaches 1 or nothing is left
    residual: float = math.nan  #: Pa, after long opening or slip
    work: float = math.nan  #: J/m2 done in this mode up to the break
    work_after_peak: float = math.nan  #: J/m2


@attrs.frozen(kw_only=True)
class Characteristics(metaclass=Checked):
    """A law in numbers; prints as a table."""

    name: str  #: of the law
    stiffness: tuple[float, float]  #: Pa/m, normal and shear
    tension: Mode  #: the virgin contact pulled
    shear: tuple[Mode, ...]  #: under growing pressures, the first is 0
    fracture_energies: dict[str, float]  #: J/m2, as declared

    def __str__(self) -> str:
        head = ("", "peak", "at", "broken at", "residual", "work", "after peak", "declared")
        rows: list[tuple[str, ...]] = [head, ("", "MPa", "um", "um", "MPa", "J/m2", "J/m2", "J/m2")]
        rows.append(_row("tension", self.tension, self.fracture_energies.get("mode_i", math.nan)))
        for mode in self.shear:
            under = f"shear under {mode.pressure * 1e-6:.4g} MPa" if mode.pressure else "shear, no pressure"
            declared = math.nan if mode.pressure else self.fracture_energies.get("mode_ii", math.nan)
            rows.append(_row(under, mode, declared))
        normal, shear = self.stiffness
        return f"{self.name}: first stiffness {normal:.4g} Pa/m normal, {shear:.4g} Pa/m shear\n{aligned(rows)}"


def _row(name: str, mode: Mode, declared: float) -> tuple[str, ...]:
    values = (
        (mode.peak, 1e-6), (mode.displacement, 1e6), (mode.breaking, 1e6), (mode.residual, 1e-6),
        (mode.work, 1), (mode.work_after_peak, 1), (declared, 1),
    )  # fmt: skip
    return name, *("-" if math.isnan(value) else f"{value * factor:.4g}" for value, factor in values)


@checked
def characteristics(law: ContactLaw) -> Characteristics:
    """Pull a law, and shear it under no pressure and under three that suit its strength.

    The pressures are held while the contact slips. Peaks and works are right to 0.1 %. Raises ParameterError for
    what is no law, and for one whose numbers differ from contact to contact.
    """
    contact = alone(law)
    with np.errstate(all="ignore"):
        tension = tensile_mode(contact)
        shear = tuple(shear_mode(contact, pressure) for pressure in fitting_pressures(contact))
    normal, tangential = map(float, law.stiffness)
    return Characteristics(
        name=type(law).__name__, stiffness=(normal, tangential), tension=tension, shear=shear,
        fracture_energies=dict(law.fracture_energies),
    )  # fmt: skip


def fitting_pressures(contact: Contact) -> tuple[float, ...]:
    """Pressures (Pa) that suit a law: 0, and half, one and two times its larger strength, to two digits."""
    peaks = [mode.peak for mode in (tensile_mode(contact, QUICK), shear_mode(contact, 0.0, QUICK)) if mode.peak > 0]
    unit = float(f"{max(peaks, default=measure(contact).pressures[2]):.1e}")
    return 0.0, unit / 2, unit, 2 * unit


def tensile_mode(contact: Contact, steps: int = FINE) -> Mode:
    """A virgin contact pulled."""

    def drive(openings: np.ndarray) -> Answer:
        run = pulled(contact, openings)
        return run.opening, run.normal, _damage(run)

    return _failure(drive, steps, math.nan)


def shear_mode(contact: Contact, pressure: float, steps: int = FINE) -> Mode:
    """A virgin contact sheared under a ``pressure`` (Pa; below 0 it is a tension) that is held.

    Where the pressure can no longer be held, the contact has broken.
    """

    def drive(slips: np.ndarray) -> Answer:
        run = sheared(contact, -pressure, slips, cut=slips[-1] < FAR[-1])
        return run.slip, run.shear, _damage(run)

    return _failure(drive, steps, pressure)


def _damage(run: Trace) -> np.ndarray:
    return run.memory.get("damage", np.zeros(len(run.slip)))


def _failure(drive: Callable[[np.ndarray], Answer], steps: int, pressure: float) -> Mode:
    """Find the peak and the break: first roughly, then with even steps, then with small steps around both."""
    u, traction, damage = drive(np.concatenate([[0.0], FAR]))
    if len(u) < 3:  # the normal traction cannot even be reached
        return Mode(pressure=pressure)
    scale = peak_along(traction[1:], damage[1:])
    if scale is None:
        return Mode(pressure=pressure, peak=math.nan if np.any(traction > 0) else 0.0)
    past, broken = 1.2 * scale.displacement, max(scale.broken, 1.5 * scale.displacement)
    coarse = np.concatenate([
        np.linspace(0, past, steps), np.linspace(past, broken, steps)[1:], np.geomspace(broken, LONG * broken, 60)[1:],
    ])  # fmt: skip
    u, traction, damage = drive(coarse)
    if len(u) < 3:
        return Mode(pressure=pressure)
    corners = _corners(u, traction, damage, coarse, pressure)
    zooms = [np.linspace(coarse[max(k - 1, 0)], coarse[min(k + 1, len(coarse) - 1)], steps) for k in set(corners)]
    grid = np.unique(np.concatenate([coarse, *zooms]))
    u, traction, damage = drive(grid)
    i, *ends = _corners(u, traction, damage, grid, pressure)
    top, residual = float(traction[i]), float(traction[-1]) if len(u) == len(grid) else math.nan
    residual = 0.0 if residual < 1e-9 * top else residual
    mode = Mode(pressure=pressure, peak=top, displacement=float(u[i]), residual=residual)
    if not ends:
        return mode
    work = work_done((u, traction))
    whole, after = float(work[ends[0]]), float(work[ends[0]] - work[i])
    after = after if after > 1e-5 * whole else 0.0  # a drop is one step wide
    return attrs.evolve(mode, breaking=float(u[ends[0]]), work=whole, work_after_peak=after)


def _corners(u: np.ndarray, traction: np.ndarray, damage: np.ndarray, asked: np.ndarray, pressure: float) -> list[int]:
    """Positions of the peak and, if there is one, of the break. A tension that can no longer be held is a break."""
    top = float(np.nanmax(traction))
    i = int(np.argmax(traction >= (1 - 1e-12) * top))
    gone = np.flatnonzero((damage[i:] >= 1) | (traction[i:] < 1e-6 * top))
    if len(gone):
        return [i, i + int(gone[0])]
    return [i, len(u) - 1] if pressure < 0 and len(u) < len(asked) else [i]


@attrs.frozen(kw_only=True, eq=False)
class Envelope:
    """Shear strength over the normal traction, of virgin contacts and after long slip. All (k,) Pa, tension first."""

    normal: np.ndarray
    peak: np.ndarray
    residual: np.ndarray  #: nan under tension


def envelope(law: ContactLaw, pressure: float | None = None) -> Envelope:
    """Shear strengths from the tensile strength to a ``pressure`` (Pa; without it, one that suits the law).

    Empty for a law that never peaks in shear. Raises as :func:`characteristics`.
    """
    contact = alone(law)
    with np.errstate(all="ignore"):
        tensile = tensile_mode(contact, QUICK).peak
        pressure = fitting_pressures(contact)[-1] if pressure is None else pressure
        tensions = tensile * np.array([1, 0.9, 0.7, 0.5, 0.3, 0.1]) * (1 - 1e-6) if tensile > 0 else np.zeros(0)
        normal = np.concatenate([tensions, -np.linspace(0, pressure, 11)])
        modes = [shear_mode(contact, -held, QUICK) for held in normal]
    peak = np.array([mode.peak for mode in modes])
    if len(tensions) and np.isnan(peak[0]) and np.isfinite(peak).any():
        peak[0] = 0.0  # the strength in tension is used up
    kept = np.isfinite(peak)
    residual = np.where(normal > 0, np.nan, [mode.residual for mode in modes])
    return Envelope(normal=normal[kept], peak=peak[kept], residual=residual[kept])
