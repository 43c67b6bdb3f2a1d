"""What contact points have lost for good, of the work done on them, and what they would give beyond it."""

from __future__ import annotations

import numpy as np

from grainlaw.engine.parts.laws import LawGroup
from grainlaw.engine.state import State

STEPS = 16  #: of the way back, over each of its two parts; an even number


def balance(state: State) -> tuple[np.ndarray, np.ndarray]:
    """What became of the work done on each point: lost (2, p) J/m2 in opening and in slip, and made (p,) J/m2.

    Lost is the work less what the point would still give back, never negative. Made is what an intact point would give
    back beyond the work: none, if its law keeps an energy.
    """
    surplus = stored(state) - state.bonds.work
    intact = (state.memory("damage") == 0) & ~np.tile(state.bonds.books.replaced, 2)
    return np.maximum(-surplus, 0.0), np.where(intact, np.maximum(surplus.sum(axis=0), 0.0), 0.0)


def stored(state: State) -> np.ndarray:
    """(2, p) J/m2 that each point would give back in opening and in slip.

    The law itself is asked, without being committed: the point is taken back against its traction, the other direction
    held, and the most it gives on the way counts.
    """
    bonds = state.bonds
    result = np.zeros_like(bonds.work)
    for g, group in enumerate(bonds.groups):
        places = group.points(len(bonds))
        for axis in (0, 1) if group.size else ():
            result[axis, places] = _given_back(group, axis, places, bonds.memory_of(g), state)
    result[:, np.tile(state.bonds.books.replaced, 2)] = (
        0.0  # what was stored went over to the contact that took the bond's place
    )
    return result


def _given_back(group: LawGroup, axis: int, places: np.ndarray, memory: np.ndarray, state: State) -> np.ndarray:
    """J/m2: first as far as a spring of the first stiffness would go, then on to no displacement at all.

    By Simpson's rule, lest a closure that stiffens seem to give more than it has taken.
    """
    place = [state.opening[places], state.slip[places]]
    traction = (state.normal, state.shear)[axis][places]
    start = place[axis]
    spring = np.abs(traction) / state.stiffness[axis, places]
    spring = np.where(start * traction > 0, np.minimum(spring, np.abs(start)), spring)
    rest = np.maximum(np.abs(start) - spring, 0.0)
    given, most = np.zeros(len(places)), np.zeros(len(places))
    direction = np.sign(traction)
    for part, way in ((0.0, spring), (spring, rest)):
        for step in range(1, STEPS + 1):
            place[axis] = start - direction * (part + way * (step / STEPS))
            answer = group.compiled.batch(place[0], place[1], memory)[axis]
            if step % 2:
                middle = answer
                continue
            given += direction * (traction + 4 * middle + answer) * way / (3 * STEPS)
            most = np.maximum(most, given)
            traction = answer
    return most
