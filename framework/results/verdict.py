"""One line on a contact point that a probe has followed: whether it broke, how, and near which strength."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from grainlaw.contact import memory_names
from grainlaw.workbench.characteristics import QUICK, shear_mode, tensile_mode
from grainlaw.workbench.driver import alone
from grainlaw.workbench.finding import words

if TYPE_CHECKING:
    from grainlaw.results.probe import ContactPath


def verdict(path: ContactPath) -> str:
    """Name the contact, say whether and how it broke, and give its highest tractions before with its strengths.

    Tractions between two samples are not known.
    """
    x, y = path.position * 1e3
    a, b = path.grains
    who = f"contact {path.point} between grains {a} and {b} at ({x:.1f}, {y:.1f}) mm"
    return f"{who}: {_end(path)}; {_tension(path)}, {_shear(path)}"


def _end(path: ContactPath) -> str:
    at = min(path.unbroken, len(path.time) - 1)
    where = f"opening {words(path.opening[at], 'm')}, slip {words(path.slip[at], 'm')}"
    if path.unbroken < len(path.time):
        mode = "in tension" if path.mode < 0.5 else "in shear"
        return f"broke at {path.broken:.4g} s {mode} (share of shear {path.mode:.2f}), {where}"
    counted = "damage" in memory_names(path.law)
    return f"did not break, {f'damage {path.damage[-1]:.3g}, ' if counted else ''}{where}"


def _tension(path: ContactPath) -> str:
    highest = float(path.normal[: max(path.unbroken, 1)].max())
    if highest <= 0:
        return "never in tension"
    with np.errstate(all="ignore"):
        strength = tensile_mode(alone(path.law), QUICK).peak
    return f"peak tension {_of(highest, strength)}"


def _shear(path: ContactPath) -> str:
    i = int(np.argmax(np.abs(path.shear[: max(path.unbroken, 1)])))
    normal, shear = float(path.normal[i]), float(abs(path.shear[i]))
    with np.errstate(all="ignore"):
        strength = shear_mode(alone(path.law), -normal, QUICK).peak
    sign = "a tension" if normal > 0 else "a pressure"
    return f"peak shear {_of(shear, strength)} under {sign} of {words(abs(normal), 'Pa')}"


def _of(value: float, strength: float) -> str:
    return words(value, "Pa") if np.isnan(strength) else f"{value * 1e-6:.4g} of {words(strength, 'Pa')}"
