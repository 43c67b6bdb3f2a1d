"""Broken bonds whose grains have moved apart become contacts of their edges, without a jump of force."""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.compiler.entry import compiled
from grainlaw.engine.parts.contact_geometry import edges_of, overlaps_of
from grainlaw.engine.parts.contact_rows import BLOCK, LARGEST, LENGTH, LIFT, OFFSET, OVERLAP, SHARE_A, TX, TY, rows_of
from grainlaw.engine.parts.contact_table import CLOSED, HELD, WAITING, ContactArrays
from grainlaw.engine.parts.laws import LawGroup
from grainlaw.engine.state import State

HALVINGS = 60  #: of the interval that contains the offset


@attrs.frozen(eq=False)
class Leaving:
    """State of bonds (n) that the contacts that replace them take over."""

    bond: np.ndarray  #: (n,) their numbers c
    force: np.ndarray  #: (2, 4, n) N on the nodes A1, A2, B1, B2
    slip: np.ndarray  #: (n,) m, of the point with the higher pressure
    names: list[tuple[str, ...]]  #: of the memory of each bond's law
    memory: list[np.ndarray]  #: (m,) of the point with the higher pressure


def hand_over(state: State) -> None:
    """Replace the bonds that the step has marked by contacts.

    The difference between the opening of such a contact and that of its edges is kept as an offset until it parts.
    """
    bonds, contacts = state.bonds, state.contacts
    leaving = _leaving(state)
    chosen, count = leaving.bond, len(bonds)
    bonds.retire(chosen)
    contacts.expose(np.concatenate([chosen, count + chosen]))
    state.search(contacts.arrays.before)
    known, keys = contacts.books.keys, contacts.key(chosen, count + chosen)
    place = np.minimum(np.searchsorted(known, keys), max(len(known) - 1, 0))
    found = known[place] == keys if len(known) else np.zeros(len(chosen), dtype=bool)
    for g, group in enumerate(contacts.groups):
        mine = np.flatnonzero(found & (contacts.groups_of(keys) == g))
        if len(mine):
            same = [leaving.names[k] == group.compiled.memory for k in mine]
            memory = np.stack(
                [leaving.memory[k] if equal else group.virgin for k, equal in zip(mine, same, strict=True)], axis=1
            )
            force = leaving.force[:, :, mine][:, [0, 1, 3, 2]]  # a contact has the nodes of b in reverse order
            _take_over(contacts.arrays, g, group, place[mine], force, leaving.slip[mine], memory)


def _leaving(state: State) -> Leaving:
    """State of the marked bonds; the marks are removed."""
    bonds = state.bonds
    arrays, count = bonds.arrays, len(bonds)
    chosen = np.flatnonzero(arrays.leaving)
    arrays.leaving[:] = 0
    slip, pressure = state.slip.reshape(2, -1)[:, chosen], -state.normal.reshape(2, -1)[:, chosen]
    point = pressure.argmax(axis=0)
    ends = np.arange(4)[:, None] * count + chosen
    groups = [next(group for group in bonds.groups if group.first <= c < group.last) for c in chosen.tolist()]
    return Leaving(
        bond=chosen,
        force=np.stack([arrays.force_x[ends], arrays.force_y[ends]]),
        slip=np.take_along_axis(slip, point[None], axis=0)[0],
        names=[group.compiled.memory for group in groups],
        memory=[
            arrays.memory[: group.depth, p * count + c]
            for group, p, c in zip(groups, point.tolist(), chosen.tolist(), strict=True)
        ],
    )


def _take_over(
    table: ContactArrays, g: int, group: LawGroup, place: np.ndarray, force: np.ndarray, slip: np.ndarray,
    memory: np.ndarray,
) -> None:  # fmt: skip
    """Let contacts ``place`` of law ``g`` begin with the nodal forces (2, 4, n) of the bonds they replace.

    Bisection finds the offset for which the normal force, along the contact's own normal, is the same, and Newton's
    method the slip for which the shear force is the same.
    """
    law, lift, count = group.compiled, group.row("dilation"), len(place)
    trial, rows = table._replace(place=table.place - table.increment), rows_of(-(-count // BLOCK), 0)
    compiled(edges_of)(trial, rows, place)

    def found(begin: int) -> np.ndarray:
        """(n,) what all rows have at one place."""
        return rows[:, begin : begin + BLOCK].reshape(-1)[:count]

    def give(begin: int, values: np.ndarray | float) -> None:
        padded = np.zeros(len(rows) * BLOCK)
        padded[:count] = values
        rows[:, begin : begin + BLOCK] = padded.reshape(-1, BLOCK)

    give(LARGEST, np.inf)
    give(LIFT, memory[lift] if lift >= 0 else 0.0)
    wanted = force[:, :2].sum(axis=1)  # (2, n) on A

    def opening() -> np.ndarray:
        return np.where(found(LENGTH) > 0, found(LIFT) - found(OVERLAP), 0.0)

    def normal_force(offset: np.ndarray) -> np.ndarray:
        give(OFFSET, offset)
        compiled(overlaps_of)(rows)
        return np.minimum(law.batch(opening(), slip, memory.copy())[0], 0.0) * found(LENGTH)

    def along(component: str) -> np.ndarray:
        tx, ty = found(TX), found(TY)
        x, y = (ty, -tx) if component == "normal" else (tx, ty)
        return wanted[0] * x + wanted[1] * y

    closed, opened = -4 * table.largest_overlap[place], 4 * table.largest_overlap[place]
    for _ in range(HALVINGS):
        middle = (closed + opened) / 2
        enough = (normal_force(middle) <= along("normal")) & (found(LENGTH) > 0)
        closed, opened = np.where(enough, middle, closed), np.where(enough, opened, middle)
    normal_force(closed)
    length = found(LENGTH)
    target = along("shear") / np.where(length > 0, length, np.inf)
    stiffness = group.law.stiffness[1]
    for _ in range(3):
        shear = law.batch(opening(), slip, memory.copy())[1]
        slip = slip + (target - shear) / np.mean(stiffness)
    normal, shear = law.batch(opening(), slip, memory)
    pushes = (length > 0) & (along("normal") < 0)
    held_open = np.flatnonzero(along("normal") >= 0)
    table.offset[place[held_open]] = np.maximum(opened[held_open], 0.0)
    lifted = memory[lift] > 0 if lift >= 0 else np.zeros(count, dtype=bool)
    table.state[place] = np.where(pushes, CLOSED, np.where((table.offset[place] > 0) | lifted, HELD, WAITING))
    mine, into = np.flatnonzero(pushes), place[pushes]
    table.opening[into] = opening()[mine]
    for name, begin in (("offset", OFFSET), ("overlap", OVERLAP), ("length", LENGTH), ("tangent_x", TX),
                        ("tangent_y", TY), ("share_a", SHARE_A)):  # fmt: skip
        getattr(table, name)[into] = found(begin)[mine]
    table.slip[into], table.normal[into], table.shear[into] = slip[mine], normal[mine], shear[mine]
    for row, (start_a, end_a, start_b, _) in zip((table.force_x, table.force_y), force[:, :, mine], strict=True):
        row[:, into] = start_a + end_a, end_a, start_b
    table.memory[: len(memory), into] = memory[:, mine]
    if lift >= 0:  # also for faces that do not touch at this moment
        table.memory[lift, place] = memory[lift]
