"""One contact pulled, or sheared while its normal traction is held, as in a shear box."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from grainlaw.contact import Trace
from grainlaw.probing import REACH, Contact, find_closure, find_peak

TRIALS = 30  #: of an opening under which the normal traction is the one that is held


def pulled(contact: Contact, openings: Sequence[float] | np.ndarray) -> Trace:
    """Pull a fresh contact through ``openings`` (m), without slip."""
    points = [(float(opening), 0.0) for opening in openings]
    return as_trace(contact, np.array(points), contact.run(points))


def sheared(contact: Contact, normal: float, slips: Sequence[float] | np.ndarray) -> Trace:
    """Shear a fresh contact through ``slips`` (m) under a ``normal`` traction (Pa, tension positive) that is held.

    A step in which it cannot be held is made at the opening before: a law that drops and dilates lifts in the next
    one. After two such steps the contact has failed, and the trace ends before them.
    """
    opening, slope = opening_at(contact, normal), contact.law.stiffness[0]
    tolerance = 1e-10 * abs(normal) + 1e-12 * slope * REACH
    state, points, answers, failed = contact.start, [], [], 0
    for slip in map(float, slips):
        held = before = opening
        gap = np.nan
        for _ in range(TRIALS):
            answer = contact.step(opening, slip, state)
            last, gap = gap, answer[0] - normal
            if not abs(gap) > tolerance:
                break
            if opening != before and (gap - last) * (opening - before) > 0:  # else the slope of before serves
                slope = (gap - last) / (opening - before)
            before, opening = opening, opening - gap / slope
        failed = 0 if abs(gap) <= tolerance else failed + 1
        if failed:
            opening, slope = held, contact.law.stiffness[0]
            answer = contact.step(opening, slip, state)
        state = answer[2:]
        points.append((opening, slip))
        answers.append(answer)
        if failed == 2:
            break
    count = len(points) - failed
    rows = np.array(answers).reshape(-1, 2 + len(contact.names))
    return as_trace(contact, np.array(points).reshape(-1, 2)[:count], rows[:count])


def opening_at(contact: Contact, normal: float) -> float:
    """Opening (m) at which a fresh contact has a normal traction (Pa, tension positive, at most its strength)."""
    if normal <= 0:
        return -find_closure(contact, -normal) if normal else 0.0
    low, high = 0.0, find_peak(contact, 0).displacement
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (low, middle) if contact.step(middle, 0.0, contact.start)[0] >= normal else (middle, high)
    return high


def as_trace(contact: Contact, points: np.ndarray, answers: np.ndarray) -> Trace:
    """Openings and slips (i, 2) with the answers (i, 2 + m) to them."""
    steps = ((answers[1:, :2] + answers[:-1, :2]) / 2 * np.diff(points, axis=0)).sum(axis=1)
    work = np.concatenate([[0.0], np.cumsum(steps)])[: len(points)]
    memory = dict(zip(contact.names, answers[:, 2:].T, strict=True))
    return Trace(points[:, 0], points[:, 1], answers[:, 0], answers[:, 1], work, memory)
