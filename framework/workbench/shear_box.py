"""One contact pulled, or sheared while its normal traction is held, as in a shear box."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from grainlaw.workbench.driver import Contact, Trace
from grainlaw.workbench.scale import REACH, bisected, find_closure, find_peak

TRIALS = 20  #: of an opening under which the normal traction is the one that is held
MOST_CUTS, DEEPEST = 200, 14  #: of a step of slip: trials, and how often it is halved


def pulled(contact: Contact, openings: Sequence[float] | np.ndarray) -> Trace:
    """Pull a virgin contact through ``openings`` (m), without slip."""
    return contact.trace([(float(opening), 0.0) for opening in openings])


def sheared(contact: Contact, normal: float, slips: Sequence[float] | np.ndarray, *, cut: bool = True) -> Trace:
    """Shear a virgin contact through ``slips`` (m) under a ``normal`` traction (Pa, tension positive) that is held.

    Where the normal traction cannot be held, the step is halved, unless ``cut`` is False. Where that does not help, as
    at a brittle drop, the step is made at the opening of the step before. After two such steps in a row the contact
    has failed, and the trace ends before them.
    """
    opening, state, last = opening_at(contact, normal), contact.start, float(slips[0])
    points: list[tuple[float, float]] = []
    answers: list[tuple[float, ...]] = []
    failed = good = 0
    for slip in map(float, slips):
        waiting = [slip]
        for _ in range(MOST_CUTS):
            found = _held(contact, normal, opening, waiting[-1], state)
            if found is None and cut and len(waiting) < DEEPEST:
                waiting.append((last + waiting[-1]) / 2)
                continue
            failed = failed + 1 if found is None else 0
            opening, answer = found or (opening, contact.step(opening, waiting[-1], state))
            state, last = answer[2:], waiting.pop()
            if not waiting or failed == 2:
                break
        if waiting:
            break
        points.append((opening, slip))
        answers.append(answer)
        good = good if failed else len(points)
    return contact.as_trace(points[:good], answers[:good])


def _held(
    contact: Contact, normal: float, opening: float, slip: float, state: tuple[float, ...]
) -> tuple[float, tuple[float, ...]] | None:
    """Opening, and answer, with which a step to ``slip`` keeps the normal traction (Pa), by the secant method."""
    slope = contact.law.stiffness[0]
    tolerance = 1e-10 * abs(normal) + 1e-12 * slope * REACH
    before, last = opening, math.nan
    for _ in range(TRIALS):
        answer = contact.step(opening, slip, state)
        gap = answer[0] - normal
        if not abs(gap) > tolerance:
            return None if math.isnan(gap) else (opening, answer)
        if opening != before and (gap - last) * (opening - before) > 0:  # else the slope of before serves
            slope = (gap - last) / (opening - before)
        before, last, opening = opening, gap, opening - gap / slope
    return None


def opening_at(contact: Contact, normal: float) -> float:
    """Opening (m) at which a virgin contact has a normal traction (Pa, tension positive, at most its strength)."""
    if normal <= 0:
        return -find_closure(contact, -normal) if normal else 0.0
    peak = find_peak(contact, 0).displacement
    return bisected(lambda opening: contact.step(opening, 0.0, contact.start)[0] >= normal, peak, 60)
