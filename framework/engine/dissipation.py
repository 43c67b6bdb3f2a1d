"""Energy that contact points have lost for good, and energy that they would give back beyond the work done on them."""

from __future__ import annotations

import numpy as np

from grainlaw.engine.parts.laws import LawGroup
from grainlaw.engine.state import State

STEPS = 16  #: into which each of the two parts of the unloading path is divided; an even number


def balance(state: State) -> tuple[np.ndarray, np.ndarray]:
    """Energy lost (2, p) J/m2 in opening and in slip, and energy made (p,) J/m2, at each point.

    Lost is the work less the energy that the point would still give back, never negative. Made is the energy that an
    intact point would give back beyond the work done on it: zero, if the law has an elastic energy.
    """
    surplus = stored(state) - state.bonds.work
    intact = (state.memory("damage") == 0) & ~np.tile(state.replaced, 2)
    return np.maximum(-surplus, 0.0), np.where(intact, np.maximum(surplus.sum(axis=0), 0.0), 0.0)


def stored(state: State) -> np.ndarray:
    """(2, p) J/m2 that each point would give back in opening and in slip.

    The law is evaluated along an unloading path, with a copy of its memory: the point moves against its traction while
    the other displacement stays, and the largest energy returned along the path counts.
    """
    bonds = state.bonds
    result = np.zeros_like(bonds.work)
    for group in bonds.groups:
        places = group.points(len(bonds))
        for axis in (0, 1) if group.size else ():
            result[axis, places] = _given_back(group, axis, places, bonds.memory_of(group), state)
    # Stored energy went over to the contact that replaced the bond.
    result[:, np.tile(state.replaced, 2)] = 0.0
    return result


def _given_back(group: LawGroup, axis: int, places: np.ndarray, memory: np.ndarray, state: State) -> np.ndarray:
    """J/m2 returned: first over the displacement of a spring of the initial stiffness, then on to zero displacement.

    By Simpson's rule: the trapezoidal rule would overestimate a closure that stiffens.
    """
    place = [state.opening[places], state.slip[places]]
    traction = (state.normal, state.shear)[axis][places]
    start = place[axis]
    spring = np.abs(traction) / state.stiffness[axis, places]
    spring = np.where(start * traction > 0, np.minimum(spring, np.abs(start)), spring)
    rest = np.maximum(np.abs(start) - spring, 0.0)
    given, most = np.zeros(len(places)), np.zeros(len(places))
    direction = np.sign(traction)
    for passed, distance in ((0.0, spring), (spring, rest)):
        for step in range(1, STEPS + 1):
            place[axis] = start - direction * (passed + distance * (step / STEPS))
            answer = group.compiled.batch(place[0], place[1], memory)[axis]
            if step % 2:
                middle = answer
                continue
            given += direction * (traction + 4 * middle + answer) * distance / (3 * STEPS)
            most = np.maximum(most, given)
            traction = answer
    return most
