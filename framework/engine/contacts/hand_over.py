"""Broken bonds whose grains have moved apart become contacts of their edges, without a jump of force."""

from __future__ import annotations

import functools

import attrs
import numpy as np

from grainlaw.compiler.loops import interruptible
from grainlaw.compiler.numba_private import Table
from grainlaw.engine.contacts.contact_passes import Beginning, take_over
from grainlaw.engine.contacts.contact_rows import BLOCK
from grainlaw.engine.parts.laws import LawGroup
from grainlaw.engine.state import State


@attrs.frozen(eq=False)
class Leaving:
    """State of bonds (n) that the contacts that replace them take over."""

    bond: np.ndarray  #: (n,) their numbers c
    force: np.ndarray  #: (2, 4, n) N on the nodes A1, A2, B1, B2
    slip: np.ndarray  #: (n,) m, of the point with the higher pressure
    group: np.ndarray  #: (n,) number of the law of each
    memory: np.ndarray  #: (m, n) of the point with the higher pressure; rows beyond those of a law mean nothing


def hand_over(state: State, threads: int) -> None:
    """Replace the bonds that the step, which ``threads`` did, has marked by contacts.

    The difference between the opening of such a contact and that of its edges is kept as an offset until it parts.
    """
    bonds, contacts = state.bonds, state.contacts
    leaving = _leaving(state)
    chosen, count = leaving.bond, len(bonds)
    bonds.retire(chosen)
    contacts.expose(np.concatenate([chosen, count + chosen]))
    state.search(contacts.arrays.before, beside=True)
    known, keys = contacts.books.keys, contacts.key(chosen, count + chosen)
    place = np.minimum(np.searchsorted(known, keys), max(len(known) - 1, 0))
    found = known[place] == keys if len(known) else np.zeros(len(chosen), dtype=bool)
    table = state.table("contacts", threads)
    then = contacts.arrays.place - contacts.arrays.increment  # the forces are those before the last motion
    force = leaving.force[:, [0, 1, 3, 2]]  # a contact has the nodes of b in reverse order
    for g, group in enumerate(contacts.groups):
        mine = np.flatnonzero(found & (contacts.groups_of(keys) == g))
        memory = _memory(bonds.groups, group, leaving, mine)
        for first in range(0, len(mine), BLOCK):
            some = mine[first : first + BLOCK]
            given = force[:, :, some].copy(), leaving.slip[some], memory[:, first : first + BLOCK].copy()
            beginning = Table(Beginning(g, then, place[some].astype(np.int32), *given))
            do = functools.partial(take_over, table, beginning)
            interruptible(do) if group.compiled.loops else do()


def _memory(laws: list[LawGroup], group: LawGroup, leaving: Leaving, mine: np.ndarray) -> np.ndarray:
    """(m, n) with which contacts of a law begin: that of their bonds, if these remember the same."""
    same = np.array([each.compiled.memory == group.compiled.memory for each in laws])[leaving.group[mine]]
    memory = np.repeat(group.virgin[:, None], len(mine), axis=1)
    memory[:, same] = leaving.memory[: group.depth, mine[same]]
    return memory


def _leaving(state: State) -> Leaving:
    """State of the marked bonds; the marks are removed."""
    bonds = state.bonds
    arrays, count = bonds.arrays, len(bonds)
    chosen = np.flatnonzero(arrays.leaving)
    arrays.leaving[:] = 0
    bonds.sever(chosen)
    slip, normal = (state.last(rows).reshape(2, -1)[:, chosen] for rows in (arrays.slip, arrays.normal))
    pressure = -normal
    point = pressure.argmax(axis=0)
    ends = np.arange(4)[:, None] * count + chosen
    return Leaving(
        bond=chosen,
        force=np.stack([arrays.force_x[ends], arrays.force_y[ends]]),
        slip=np.take_along_axis(slip, point[None], axis=0)[0],
        group=np.searchsorted([group.last for group in bonds.groups], chosen, side="right"),
        memory=arrays.memory[:, point * count + chosen],
    )
