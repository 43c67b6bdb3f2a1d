"""Broken bonds whose grains have moved apart become contacts of their edges, without a jump of force."""

from __future__ import annotations

import attrs
import numpy as np

from grainlaw.compiler.entry import compiled
from grainlaw.engine.parts.contact_geometry import geometry_of_all
from grainlaw.engine.parts.contact_table import ContactArrays, no_contacts
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
    contacts.books.exposed[chosen] = contacts.books.exposed[count + chosen] = True
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
    law, lift = group.compiled, group.row("dilation")
    trial = no_contacts(len(place), table.laws)._replace(
        node=np.ascontiguousarray(table.node[:, place]),
        cotangent=np.ascontiguousarray(table.cotangent[:, place]), compliance=table.compliance[place],
        largest_overlap=np.full(len(place), np.inf), place=table.place - table.increment,
        increment=np.zeros_like(table.increment), memory=memory.copy(), virgin=table.virgin[: len(memory)],
    )  # fmt: skip
    wanted = force[:, :2].sum(axis=1)  # (2, n) on A

    def normal_force(offset: np.ndarray) -> np.ndarray:
        trial.offset[:], trial.memory[:], trial.slip[:] = offset, memory, slip
        compiled(geometry_of_all)(trial, g, lift)
        apart = trial.length == 0
        trial.memory[:, apart] = memory[:, apart]
        trial.offset[:], trial.slip[:] = offset, slip
        return np.minimum(law.batch(trial.opening, slip, memory.copy())[0], 0.0) * trial.length

    def along(component: str) -> np.ndarray:
        tx, ty = trial.tangent_x, trial.tangent_y
        x, y = (ty, -tx) if component == "normal" else (tx, ty)
        return wanted[0] * x + wanted[1] * y

    closed, opened = -4 * table.largest_overlap[place], 4 * table.largest_overlap[place]
    for _ in range(HALVINGS):
        middle = (closed + opened) / 2
        enough = (normal_force(middle) <= along("normal")) & (trial.length > 0)
        closed, opened = np.where(enough, middle, closed), np.where(enough, opened, middle)
    normal_force(closed)
    target = along("shear") / np.where(trial.length > 0, trial.length, np.inf)
    stiffness = group.law.stiffness[1]
    for _ in range(3):
        shear = law.batch(trial.opening, slip, memory.copy())[1]
        slip = slip + (target - shear) / np.mean(stiffness)
    normal, shear = law.batch(trial.opening, slip, memory)
    pushes = (trial.length > 0) & (along("normal") < 0)
    held_open = np.flatnonzero(along("normal") >= 0)
    table.offset[place[held_open]] = np.maximum(opened[held_open], 0.0)
    mine, into = np.flatnonzero(pushes), place[pushes]
    for name in ("offset", "overlap", "opening", "length", "tangent_x", "tangent_y", "share_a", "share_b", "lever_a",
                 "lever_b", "opened", "slid", "twist"):  # fmt: skip
        getattr(table, name)[into] = getattr(trial, name)[mine]
    table.slip[into], table.normal[into], table.shear[into] = slip[mine], normal[mine], shear[mine]
    table.force_x[:, into], table.force_y[:, into] = force[0][:, mine], force[1][:, mine]
    table.normal_force[into], table.shear_force[into] = along("normal")[mine], along("shear")[mine]
    table.memory[: len(memory), into] = memory[:, mine]
    if lift >= 0:  # also for faces that do not touch at this moment
        table.memory[lift, place] = memory[lift]
