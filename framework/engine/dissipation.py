"""Energy that contact points have lost for good, and energy that they would give back beyond the work done on them."""

from __future__ import annotations

from collections.abc import Iterator

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
    made = np.where(intact, np.maximum(surplus.sum(axis=0), 0.0), 0.0)
    if made.any():  # each alone may give back the same energy twice, as where sliding opens a joint
        made = np.minimum(made, np.maximum(_given_in_turn(state) - state.bonds.work.sum(axis=0), 0.0))
    return np.maximum(-surplus, 0.0), made


def stored(state: State) -> np.ndarray:
    """(2, p) J/m2 that each point would give back in opening and in slip, each alone.

    The law is evaluated along an unloading path, with a copy of its memory: the point moves against its traction while
    the other displacement stays, and the largest energy returned along the path counts.
    """
    result = np.zeros_like(state.bonds.work)
    for group, places in _groups(state):
        for axis in (0, 1):
            result[axis, places] = _Unloading(group, places, state).give_back(axis)
    return _of_bonds(result, state)


def _given_in_turn(state: State) -> np.ndarray:
    """(p,) J/m2 that each point would give back in one displacement and then in the other: in the better order."""
    result = np.zeros(state.bonds.work.shape[1])
    for group, places in _groups(state):
        for first in (0, 1):
            unloading = _Unloading(group, places, state)
            given = unloading.give_back(first) + unloading.give_back(1 - first)
            result[places] = np.maximum(result[places], given)
    return _of_bonds(result, state)


def _groups(state: State) -> Iterator[tuple[LawGroup, np.ndarray]]:
    for group in state.bonds.groups:
        if group.size:
            yield group, group.points(len(state.bonds))


def _of_bonds(energy: np.ndarray, state: State) -> np.ndarray:
    """Without what went over to the contacts that have replaced bonds."""
    energy[..., np.tile(state.replaced, 2)] = 0.0
    return energy


class _Unloading:
    """The points of a law, as they are unloaded."""

    def __init__(self, group: LawGroup, places: np.ndarray, state: State) -> None:
        self._group, self._memory = group, state.bonds.memory_of(group)
        self._place = [state.opening[places], state.slip[places]]
        self._traction = [state.normal[places], state.shear[places]]
        self._stiffness = state.stiffness[:, places]

    def _answer(self, axis: int, place: list[np.ndarray], memory: np.ndarray) -> np.ndarray:
        answer: np.ndarray = self._group.compiled.batch(*place, memory)[axis]
        return answer

    def give_back(self, axis: int) -> np.ndarray:
        """J/m2, the most along a path against the traction of this axis; the points are left where it is reached.

        First over the displacement of a spring of the initial stiffness, then on to zero displacement.
        By Simpson's rule: the trapezoidal rule would overestimate a closure that stiffens.
        """
        place, memory = list(self._place), self._memory.copy()
        traction, start = self._traction[axis], place[axis]
        spring = np.abs(traction) / self._stiffness[axis]
        spring = np.where(start * traction > 0, np.minimum(spring, np.abs(start)), spring)
        rest = np.maximum(np.abs(start) - spring, 0.0)
        given, most = np.zeros(len(start)), np.zeros(len(start))
        direction = np.sign(traction)
        for passed, distance in ((0.0, spring), (spring, rest)):
            for step in range(1, STEPS + 1):
                place[axis] = start - direction * (passed + distance * (step / STEPS))
                answer = self._answer(axis, place, memory)
                if step % 2:
                    middle = answer
                    continue
                given += direction * (traction + 4 * middle + answer) * distance / (3 * STEPS)
                better = given > most
                most = np.where(better, given, most)
                self._place[axis] = np.where(better, place[axis], self._place[axis])
                self._memory = np.where(better, memory, self._memory)
                traction = answer
        self._traction[1 - axis] = self._answer(1 - axis, self._place, self._memory.copy())
        return most
