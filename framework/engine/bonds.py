"""Bonded interfaces as their grains move on: the motion of their points, and how broken ones are handed over."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from grainlaw.compiler.entry import compiled
from grainlaw.engine import touch
from grainlaw.engine.touching import Touches, no_touching

if TYPE_CHECKING:
    from grainlaw.engine.state import State

HALVINGS = 60  #: of the offset's bracket


def motion_of_points(state: State) -> np.ndarray:
    """(2, p) m, opening and slip at the contact points of all interfaces at the last forces, Eq. (7)."""
    first, second, edge = _motion_of_ends(state)
    w = state.contacts.weight[:, None]
    points = np.concatenate([(1 - w) * first + w * second, w * first + (1 - w) * second])
    x, y = np.tile(edge / np.hypot(*edge.T)[:, None], (2, 1)).T
    return np.stack([points[:, 0] * y - points[:, 1] * x, points[:, 0] * x + points[:, 1] * y])


def _motion_of_ends(state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(c, 2) m each: motion of B against A at both ends, and the mean edge."""
    ends = state.mesh.interfaces[state.order]
    u = state.displacement_at_forces().T
    a1, a2, b1, b2 = (u[ends[:, k]] for k in range(4))
    edge = state.mesh.nodes[ends[:, 1]] - state.mesh.nodes[ends[:, 0]] + (a2 - a1 + b2 - b1) / 2
    return b1 - a1, b2 - a2, edge


def hand_over(state: State) -> None:
    """Turn the interfaces that the loop has marked into contacts of their edges, without a jump of force.

    How much more or less open such a contact is than its edges is kept as an offset, until it parts.
    """
    touches, chosen = state.touches, np.flatnonzero(state.contacts.leaving)
    assert touches is not None
    state.contacts.leaving[:] = 0
    slip, pressure = state.slip.reshape(2, -1)[:, chosen], -state.normal.reshape(2, -1)[:, chosen]
    count, contacts = len(state.order), state.contacts
    rows = contacts.force[:, np.arange(4)[:, None] * count + chosen]  # (2, 4, n): on A1, A2, B1, B2
    memories = _memories(state, chosen, pressure.argmax(axis=0))
    _retire(state, chosen)
    touches.exposed[chosen] = touches.exposed[count + chosen] = True
    state.search(touches.arrays.before)
    keys = touches.key(chosen, count + chosen)
    place = np.minimum(np.searchsorted(touches.keys, keys), max(len(touches.keys) - 1, 0))
    found = touches.keys[place] == keys if len(touches.keys) else np.zeros(len(chosen), dtype=bool)
    strongest = np.take_along_axis(slip, pressure.argmax(axis=0)[None], axis=0)[0]
    for group, law in enumerate(touches.groups):
        mine = np.flatnonzero(found & (touches.groups_of(keys) == group))
        if len(mine):
            same = [names == law.compiled.memory for names, _ in (memories[k] for k in mine)]
            memory = np.stack(
                [memories[k][1] if equal else law.broken for k, equal in zip(mine, same, strict=True)], axis=1
            )
            _take_over(touches, group, place[mine], rows[:, :, mine][:, [0, 1, 3, 2]], strongest[mine], memory)


def _memories(state: State, chosen: np.ndarray, point: np.ndarray) -> list[tuple[tuple[str, ...], np.ndarray]]:
    """Names and values (m,) of the law's memory at one point of each chosen interface."""
    result = []
    for c, p in zip(chosen.tolist(), point.tolist(), strict=True):
        group = next(group for group in state.groups if group.first <= c < group.last)
        result.append((group.compiled.memory, group.memory[:, p * group.size + c - group.first].copy()))
    return result


def _retire(state: State, chosen: np.ndarray) -> None:
    """Take interfaces out of the engine: they rest at no opening, and no node gathers from them."""
    count, contacts, slots = len(state.order), state.contacts, state.arrays.slots
    for k in range(4):
        nodes, place = contacts.node[k, chosen], k * count + chosen
        for row in slots:
            row[nodes[row[nodes] == place]] = 4 * count
    contacts.node[:, chosen] = contacts.node[0, chosen]
    points = np.concatenate([chosen, count + chosen])
    contacts.opening[:, points] = contacts.slip[:, points] = 0.0
    state.retired[chosen] = True


def _take_over(
    touches: Touches, g: int, place: np.ndarray, force: np.ndarray, slip: np.ndarray, memory: np.ndarray
) -> None:
    """Give contacts ``place`` the nodal forces (2, 4, n) of the bonds they replace."""
    table, law = touches.arrays, touches.groups[g].compiled
    count = len(place)
    trial = no_touching(count)._replace(
        node=np.ascontiguousarray(table.node[:, place]),
        acute=np.ascontiguousarray(table.acute[:, place]), ease=table.ease[place],
        limit=np.full(count, np.inf), place=table.place - table.way, way=np.zeros_like(table.way),
        memory=memory.copy(), fresh=table.fresh[: len(memory)],
    )  # fmt: skip
    wanted = force[:, :2].sum(axis=1)  # (2, n) on A

    def normal_force(offset: np.ndarray) -> np.ndarray:
        trial.offset[:], trial.memory[:], trial.slip[:] = offset, memory, slip
        compiled(touch.geometry_of)(trial, g, touches.groups[g].lift)
        apart = trial.length == 0
        trial.memory[:, apart] = memory[:, apart]
        trial.offset[:], trial.slip[:] = offset, slip
        return np.minimum(law.batch(trial.opening, slip, memory.copy())[0], 0.0) * trial.length

    def along(component: str) -> np.ndarray:
        tx, ty = trial.frame[:2]
        x, y = (ty, -tx) if component == "normal" else (tx, ty)
        return wanted[0] * x + wanted[1] * y

    closed, opened = -4 * table.limit[place], 4 * table.limit[place]
    for _ in range(HALVINGS):
        middle = (closed + opened) / 2
        enough = (normal_force(middle) <= along("normal")) & (trial.length > 0)
        closed, opened = np.where(enough, middle, closed), np.where(enough, opened, middle)
    normal_force(closed)
    target = along("shear") / np.where(trial.length > 0, trial.length, np.inf)
    stiffness = touches.groups[g].law.stiffness[1]
    for _ in range(3):
        shear = law.batch(trial.opening, slip, memory.copy())[1]
        slip = slip + (target - shear) / np.mean(stiffness)
    normal, shear = law.batch(trial.opening, slip, memory)
    carrying = np.flatnonzero((trial.length > 0) & (along("normal") < 0))
    held_open = np.flatnonzero(along("normal") >= 0)
    table.offset[place[held_open]] = np.maximum(opened[held_open], 0.0)
    into = place[carrying]
    for name in ("offset", "depth", "opening", "length"):
        getattr(table, name)[into] = getattr(trial, name)[carrying]
    table.slip[into], table.normal[into], table.shear[into] = slip[carrying], normal[carrying], shear[carrying]
    table.frame[:, into] = trial.frame[:, carrying]
    table.force[:, :, into] = force[:, :, carrying]
    table.carried[0, into], table.carried[1, into] = along("normal")[carrying], along("shear")[carrying]
    table.memory[: len(memory), into] = memory[:, carrying]
    lift = touches.groups[g].lift
    if lift >= 0:  # also of faces that do not touch at this moment
        table.memory[lift, place] = memory[lift]
