"""What contact points have lost for good, of the work done on them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from grainlaw.assembly import Group
    from grainlaw.state import State

STEPS = 8  #: of the way back, over each of its two parts


def lost(state: State) -> np.ndarray:
    """(2, p) J/m2 in opening and in slip: the work done on each point less what it would still give back.

    The law itself is asked for the latter, without being committed: the point is taken back against its traction, the
    other direction held, and the most it gives on the way counts. Never negative.
    """
    stored = np.zeros_like(state.contacts.work)
    count = len(state.order)
    for group in state.groups:
        places = np.r_[group.first : group.last, count + group.first : count + group.last]
        for axis in (0, 1) if group.size else ():
            stored[axis, places] = _given_back(group, axis, places, state)
    stored[:, np.tile(state.retired, 2)] = 0.0  # what was stored went over to the contact that took the bond's place
    return np.maximum(state.contacts.work - stored, 0.0)


def _given_back(group: Group, axis: int, places: np.ndarray, state: State) -> np.ndarray:
    """J/m2: first as far as a spring of the first stiffness would go, then on to no displacement at all."""
    place = [state.opening[places], state.slip[places]]
    traction = (state.normal, state.shear)[axis][places]
    start, memory = place[axis], group.memory.copy()
    spring = np.abs(traction) / state.stiffness[axis, places]
    rest = np.maximum(np.abs(start) - spring, 0.0)
    given, most = np.zeros(len(places)), np.zeros(len(places))
    before, direction = start, -np.sign(traction)
    for step in range(1, 2 * STEPS + 1):
        way = spring * min(step / STEPS, 1) + rest * max(step / STEPS - 1, 0)
        place[axis] = start + direction * way
        answer = group.compiled.batch(place[0], place[1], memory)[axis]
        given += (traction + answer) / 2 * (before - place[axis])
        most = np.maximum(most, given)
        before, traction = place[axis], answer
    return most
