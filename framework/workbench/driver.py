"""One contact driven along designed paths that are scaled from what the law itself shows: stiffness, peak and break.

Steps are as fine as the tractions ask for, so that a jump is found as the step that no refinement makes small, and
the work is exact at a brittle drop as well. Paths are corners of (opening, slip) in metres.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from typing import Any

import attrs
import numpy as np

from grainlaw.contact import ContactLaw, answered, memory_names
from grainlaw.parameter import parameters

Corners = Sequence[tuple[float, float]]
COARSEST, FINEST = 1 / 12, 2.0**-22  #: steps, as shares of a leg
RESOLUTION = 0.03  #: of a strength: increments above it are refined
MOST_JUMPS, MOST_STEPS = 12, 20_000  #: of a path; then it goes on in coarse steps
REACH = 1e-6  #: m, how far a mode is driven that has no peak of its own


class Contact:
    """A law's answer for one contact as floats; an error of the law is nan, and its words are kept."""

    def __init__(self, law: ContactLaw) -> None:
        self.law = law
        self.names = memory_names(law)
        self.start = (0.0,) * len(self.names)
        self.error = ""

    def step(self, opening: float, slip: float, state: Iterable[float]) -> tuple[float, ...]:
        """Normal, shear, then the memory. Raises TypeError for another number of results."""
        try:
            answer = self.law.traction(opening, slip, *state)
        except (ArithmeticError, ValueError) as error:
            self.error = f"{type(error).__name__}: {error}"
            return (math.nan,) * (2 + len(self.names))
        return answered(self.law, self.names, answer)

    def run(self, path: Iterable[tuple[float, float]]) -> np.ndarray:
        """Answers (i, 2 + m) to a sequence of openings and slips, from a fresh contact."""
        state, rows = self.start, []
        for opening, slip in path:
            answer = self.step(opening, slip, state)
            state = answer[2:]
            rows.append(answer)
        return np.array(rows)


def alone(law: Any) -> Contact:
    """One contact of a law. Raises TypeError for what is no law, ValueError where its numbers are not single ones."""
    if not isinstance(law, ContactLaw) or not attrs.has(type(law)):
        raise TypeError(f"this takes an instance of an attrs class that is a gl.ContactLaw, not {law!r}")
    if any(isinstance(value, list) for value in parameters(law).values()):
        name = type(law).__name__
        raise ValueError(f"{name}: give the law of one contact, and give single numbers instead of arrays")
    if not all(math.isfinite(k) and k > 0 for k in law.stiffness):
        raise ValueError(f"{type(law).__name__}.stiffness must be two positive numbers (Pa/m), not {law.stiffness!r}")
    return Contact(law)


@attrs.frozen
class Peak:
    """Where a mode is strongest and where it has broken."""

    strength: float  #: Pa
    displacement: float  #: m
    breaking: float  #: m
    found: bool  #: whether there is a peak; else the numbers only set a scale


FAR = np.geomspace(1e-13, 1e-1, 500)  #: m, twelve decades in which a peak is looked for


def find_peak(contact: Contact, mode: int, closure: float = 0.0) -> Peak:
    """Pull (``mode`` 0) or shear (1) a fresh contact, closed by ``closure``, through twelve decades."""
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
    """Whether a fresh contact resists opening, on the way to its ``tension`` peak."""
    return bool(contact.run([(share * tension.displacement, 0.0) for share in (1e-6, 1e-3, 1.0)])[:, 0].any())


def find_closure(contact: Contact, pressure: float) -> float:
    """Closure (m) at which a fresh contact resists with ``pressure`` (Pa)."""

    def enough(closure: float) -> bool:
        return not contact.step(-closure, 0.0, contact.start)[0] > -pressure

    high = pressure / contact.law.stiffness[0]
    for _ in range(20):
        if enough(high):
            break
        high *= 2
    low = 0.0
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high


@attrs.frozen
class Jump:
    """An increment of a traction (Pa) that stays however fine the step."""

    opening: float
    slip: float
    size: float
    kind: str  #: "normal" or "shear"


@attrs.frozen(eq=False)
class Response:
    """The answer along a path: arrays over its steps, and where each corner is among them."""

    name: str
    points: np.ndarray  #: (i, 2), opening and slip
    answers: np.ndarray  #: (i, 2 + m)
    corners: list[int]  #: as far as the answers are finite
    legs: int  #: asked for
    jumps: list[Jump]

    @property
    def complete(self) -> bool:
        """Whether all answers were finite."""
        return len(self.corners) == self.legs + 1

    @property
    def work(self) -> np.ndarray:
        """J/m2 done on the contact since the start."""
        mean = (self.answers[1:, :2] + self.answers[:-1, :2]) / 2
        return np.concatenate([[0.0], np.cumsum((mean * np.diff(self.points, axis=0)).sum(axis=1))])


def drive(contact: Contact, name: str, corners: Corners, scale: Scale) -> Response:
    """Drive a fresh contact through ``corners``, refining each step until the tractions change little or jump."""
    at, legs = corners[0], len(corners) - 1
    answer = contact.step(*at, contact.start)
    points, answers, reached = [at], [answer], [0]
    jumps: list[Jump] = []
    for start, end in itertools.pairwise(corners):
        x, h = 0.0, COARSEST
        while x < 1:
            share = min(x + h, 1.0)
            trial = (start[0] + (end[0] - start[0]) * share, start[1] + (end[1] - start[1]) * share)
            new = contact.step(*trial, answer[2:])
            if not all(map(math.isfinite, new)):
                return Response(name, np.array(points), np.array(answers), reached, legs, jumps)
            limit = scale.pulled if trial[0] > 0 or points[-1][0] > 0 else scale.pressed
            normal, shear = abs(new[0] - answer[0]) / limit, abs(new[1] - answer[1]) / scale.sheared
            change = max(normal, shear)
            fine = len(jumps) < MOST_JUMPS and len(points) < MOST_STEPS
            if change > 1 and fine and h > FINEST:
                h /= 2
                continue
            if change > 1 and fine:
                size = abs(new[0] - answer[0]) if normal > shear else abs(new[1] - answer[1])
                jumps.append(Jump(*trial, size, "normal" if normal > shear else "shear"))
                h = COARSEST
            elif change < 0.5 or not fine:
                h = min(2 * h, COARSEST)
            x, answer = share, new
            points.append(trial)
            answers.append(new)
        reached.append(len(points) - 1)
    return Response(name, np.array(points), np.array(answers), reached, legs, jumps)


@attrs.frozen
class Scale:
    """What a law shows of itself: its peaks, and the pressures and closures to try it under."""

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


def designed_paths(scale: Scale) -> dict[str, Corners]:
    """Closed paths that catch what random ones miss."""
    t, s = scale.tension.displacement, scale.shear.displacement
    to, so = 1.1 * scale.tension.breaking, 1.1 * scale.shear.breaking
    th, sh = t + 0.3 * (scale.tension.breaking - t), s + 0.3 * (scale.shear.breaking - s)  # half broken
    c, d, far = scale.closures[1], scale.closures[3], scale.far
    paths: dict[str, Corners] = {
        "pull, release, pull on": [(0, 0), (0.8 * t, 0), (0, 0), (th, 0), (0, 0), (to, 0), (0, 0)],
        "shear, reverse": [(0, 0), (0, 0.8 * s), (0, -0.8 * s), (0, sh), (0, -sh), (0, so), (0, -so), (0, 0)],
        "shear under pressure, reverse": [(0, 0), (-c, 0), (-c, sh), (-c, -sh), (-c, far), (-c, 0), (0, 0)],
        "shear under high pressure": [(0, 0), (-d, 0), (-d, far), (-d, -far), (-d, 0), (0, 0)],
        "pull, release, press, shear": [(0, 0), (th, 0), (0, 0), (-c, 0), (-c, far), (-c, 0), (0, 0)],
        "open, slide, close": [(0, 0), (to, 0), (to, so), (-c, so), (-c, far + so), (0, far + so), (0, 0)],
        "press, slip, open": [(0, 0), (-c, 0), (-c, sh), (to, sh), (0, sh), (0, 0)],
        "slip, press, slip back, release": [(0, 0), (0, 0.8 * s), (-c, 0.8 * s), (-c, 0), (0, 0)],
        "slip, press hard, slip back, release": [(0, 0), (0, s), (-d, s), (-d, 0), (0, 0)],
        "slip far, press, slip back, release": [(0, 0), (0, sh), (-c, sh), (-c, 0), (0, 0)],
        "slip, pull, slip back": [(0, 0), (0, 0.5 * s), (0.8 * t, 0.5 * s), (0.8 * t, 0), (0, 0), (0, s), (0, 0)],
        "pull far, slip, close, slip back": [(0, 0), (th, 0), (th, s), (0, s), (0, 0)],
        "pull, slip, release": [(0, 0), (0.8 * t, 0), (0.8 * t, s), (0, s), (0, 0)],
        "pull, release, shear to the end": [(0, 0), (th, 0), (0, 0), (0, so), (0, 0)],
        "shear, slip back, pull to the end": [(0, 0), (0, sh), (0, 0), (to, 0), (0, 0)],
        "all ways": [(0, 0), (th, s), (0.3 * t, -s), (-c, s), (2 * t, so), (-c, -far), (0, 0)],
    }
    for share in (0.25, 0.5, 0.75):
        a, b = share, 1 - share
        mixed = [(0, 0), (a * t, b * s), (0, 0), (a * th, b * sh), (0, 0), (to, so * b / a), (0, 0)]
        paths[f"mixed, {a:g} opening to {b:g} slip"] = mixed
    return paths


def random_paths(scale: Scale, count: int) -> dict[str, Corners]:
    """Closed paths of random corners about the peaks, the same at every call."""
    random = np.random.default_rng(11)
    size = np.array([2 * scale.tension.displacement, 3 * scale.shear.displacement])
    corners = random.normal(size=(count, 5, 2)) * size
    corners[..., 0] = np.maximum(corners[..., 0], -scale.closures[2])
    return {f"random path {k}": [(0, 0), *map(tuple, c.tolist()), (0, 0)] for k, c in enumerate(corners)}


def even_steps(corners: Corners, steps: int) -> list[tuple[float, float]]:
    """Points (opening, slip) along straight lines through ``corners``, ``steps`` to a leg."""
    shares = np.arange(steps)[:, None] / steps
    ends = np.array(corners, dtype=float)
    legs = [a + (b - a) * shares for a, b in itertools.pairwise(ends)]
    return [(float(o), float(s)) for o, s in np.concatenate([*legs, ends[-1:]])]


def words(value: Any, unit: str) -> str:
    """A number for a report: lengths in um, tractions in MPa."""
    factor, shown = {"m": (1e6, "um"), "Pa": (1e-6, "MPa"), "J/m2": (1.0, "J/m2")}[unit]
    return f"{float(value) * factor:.4g} {shown}"
