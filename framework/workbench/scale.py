"""The scale of a law, found by pulling and shearing it: its peaks, and the pressures that suit it."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from grainlaw.workbench.driver import Contact

RESOLUTION = 0.03  #: of a strength: increments above it are refined
REACH = 1e-6  #: m, how far a mode is driven that has no peak of its own


@attrs.frozen
class Peak:
    """The peak of a mode, and the displacement at which it has broken."""

    strength: float  #: Pa
    displacement: float  #: m
    breaking: float  #: m
    found: bool  #: whether there is a peak; if not, the numbers only set a scale

    @property
    def half_broken(self) -> float:
        """A displacement (m) between the peak and the break."""
        return self.displacement + 0.3 * (self.breaking - self.displacement)

    @property
    def broken(self) -> float:
        """A displacement (m) beyond the break."""
        return 1.1 * self.breaking


FAR = np.geomspace(1e-13, 1e-1, 500)  #: m, twelve decades in which a peak is looked for


def find_peak(contact: Contact, mode: int, closure: float = 0.0) -> Peak:
    """Pull (``mode`` 0) or shear (1) a virgin contact, closed by ``closure``, through twelve decades."""
    path = [(u, 0.0) if mode == 0 else (-closure, u) for u in FAR]
    answers = contact.run([(-closure, 0.0), *path])[1:]
    damage = answers[:, 2 + contact.names.index("damage")] if "damage" in contact.names else None
    return peak_along(answers[:, mode], damage) or Peak(contact.law.stiffness[mode] * REACH, REACH, 3 * REACH, False)


def peak_along(traction: np.ndarray, damage: np.ndarray | None) -> Peak | None:
    """The peak of a traction (Pa) along the first displacements of ``FAR``; None if it still grows at a decimetre."""
    traction = np.where(np.isfinite(traction), traction, 0.0)
    top = float(traction.max(initial=0.0))
    i = int(np.argmax(traction >= 0.999 * top))
    if top <= 0 or i > len(FAR) - 10:
        return None
    gone = traction < 1e-6 * top
    if damage is not None:
        gone |= damage >= 1
    after = np.flatnonzero(gone[i:])
    breaking = float(FAR[i + after[0]]) if len(after) else 10 * float(FAR[i])
    return Peak(top, float(FAR[i]), breaking, True)


def is_bonded(contact: Contact, tension: Peak) -> bool:
    """Whether a virgin contact resists opening, up to its ``tension`` peak."""
    return bool(contact.run([(share * tension.displacement, 0.0) for share in (1e-6, 1e-3, 1.0)])[:, 0].any())


def find_closure(contact: Contact, pressure: float) -> float:
    """Closure (m) at which a virgin contact resists with ``pressure`` (Pa)."""

    def enough(closure: float) -> bool:
        return not contact.step(-closure, 0.0, contact.start)[0] > -pressure

    high = pressure / contact.law.stiffness[0]
    for _ in range(20):
        if enough(high):
            break
        high *= 2
    return bisected(enough, high, 40)


def bisected(enough: Callable[[float], bool], high: float, times: int) -> float:
    """The least number above 0 that is enough, from one that is, by halving the interval so many times."""
    low = 0.0
    for _ in range(times):
        middle = (low + high) / 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high


@attrs.frozen
class Scale:
    """The peaks of a law, and the pressures and closures under which it is tried."""

    tension: Peak
    shear: Peak
    pressures: tuple[float, ...]  #: Pa, growing, the first is 0
    closures: tuple[float, ...]  #: m
    sheared_under: tuple[Peak, ...]  #: one for each pressure

    @property
    def pulled(self) -> float:
        """Largest increment (Pa) of the normal traction of an open contact."""
        return RESOLUTION * self.tension.strength

    @property
    def pressed(self) -> float:
        """Largest increment (Pa) of the normal traction of a closed contact."""
        return RESOLUTION * self.pressures[-1]

    @property
    def sheared(self) -> float:
        """Largest increment (Pa) of the shear traction."""
        return RESOLUTION * self.shear.strength

    @property
    def far(self) -> float:
        """Slip (m) after which the contact slides, under every pressure."""
        return max(peak.breaking + 2 * peak.displacement for peak in self.sheared_under)


def measure(contact: Contact) -> Scale:
    """Probe tension, and shear under several pressures."""
    tension, shear = find_peak(contact, 0), find_peak(contact, 1)
    if not shear.found:  # held by friction alone, or elastic
        under = find_peak(contact, 1, find_closure(contact, tension.strength))
        shear = under if under.found else shear
    unit = max(tension.strength, shear.strength)
    pressures = (0.0, 0.5 * unit, unit, 2 * unit)
    closures = tuple(find_closure(contact, p) if p else 0.0 for p in pressures)
    peaks = tuple(find_peak(contact, 1, closure) for closure in closures)
    return Scale(tension, shear, pressures, closures, peaks)
