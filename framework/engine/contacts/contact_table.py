"""The table of contacts: their arrays, and a table of contacts that have not begun.

Index letters: ``c`` contact, ``i`` node, ``k`` place in the list of nodes in use, or in a chunk of contacts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from grainlaw.engine.parts.laws import LawTable, table_of
from grainlaw.engine.parts.part import Changing, Constant, Scratch, Told

#: States of a contact: contact_geometry.py says what ends each of them.
APART, WAITING, HELD, CLOSED = range(4)


class ContactArrays(NamedTuple):
    """The table of contacts, sorted by law and edges. The laws' ``first`` and ``last`` are set for each run."""

    laws: LawTable
    compliance: Constant  #: (g,) 1 / ks of each law, m/Pa
    virgin: Constant  #: (m, g) memory of a contact that has just begun
    node: Changing  #: (4, c) places in ``used``: start and end of edge a, of edge b, each counter-clockwise
    largest_overlap: Changing  #: (c,) m
    dashpot: Changing  #: (c,) sqrt(kg/m): damping force over closing rate and over the root of stiffness
    state: Changing  #: (c,) ``APART``, ``WAITING``, ``HELD`` or ``CLOSED``
    offset: Changing  #: (c,) m, opening of the contact less that of its edges
    overlap: Changing  #: (c,) m, mean overlap of the edges after they are moved by offset and lift; 0 where apart
    opening: Changing  #: (c,) m, given to the law: lift less overlap; 0 where apart
    slip: Changing  #: (c,) m
    normal: Changing  #: (c,) Pa, with the dashpot
    shear: Changing  #: (c,) Pa
    length: Changing  #: (c,) m in contact, 0 where apart
    tangent_x: Changing  #: (c,) unit vector
    tangent_y: Changing
    share_a: Changing  #: (c,) where the force acts: distance from the start of edge a, over its length
    force_x: Changing  #: (3, c) N on A, of it on the end of edge a, and on the start of edge b
    force_y: Changing
    damping_force: Changing  #: (c,) N
    opening_work: Changing  #: (c,) J
    slip_work: Changing
    damping_work: Changing
    memory: Changing  #: (m, c) of the laws
    follow: Changing  #: (c,) 1 where more is asked than whether the edges are apart
    active: Changing  #: (c,) contacts that are followed, then those with a force: each thread lists its own
    used: Changing  #: (k,) nodes of these edges, ascending
    cotangent: Changing  #: (k,) of the grain's angle at these nodes, 0 where it is not acute
    origin: Changing  #: (2, k) m, undeformed positions
    place: Changing  #: (2, k) m, present positions
    displacement: Changing  #: (2, k) m
    increment: Changing  #: (2, k) m, incremental displacement of the last step
    searched: Changing  #: (2, k) m, displacement at the last search
    room: Changing  #: (k,) m, how far each node may move from there until the next
    before: Changing  #: (2, i) m, displacement of all nodes before the last step; without columns there is no search
    skin: float  #: m, distance up to which edges are neighbours
    damping: float  #: of the dashpots over the critical one; 0 without
    tally: Told  #: (threads, 8) what each thread has counted, a cache line for each
    rows: Scratch  #: (threads, n) scratch, see contact_rows.py
    chunk: Scratch  #: (threads, n) contacts of the chunk that a thread is at
    used_share: Constant  #: (threads + 1,) bounds in ``used`` of each thread's nodes
    first: Constant  #: (k + 1,) bounds in ``corner`` of the contacts of each node; on a device alone
    corner: Constant  #: (n,) four times the contact, and which of its nodes: ascending
    share: Constant


NUMBERS = (
    "offset", "overlap", "opening", "slip", "normal", "shear", "length", "tangent_x", "tangent_y", "share_a",
    "damping_force", "opening_work", "slip_work", "damping_work",
)  # fmt: skip
PER_NODE = ("cotangent", "origin", "place", "displacement", "increment", "searched", "room")
PER_CONTACT = (
    *NUMBERS,
    "node",
    "largest_overlap",
    "dashpot",
    "state",
    "force_x",
    "force_y",
    "memory",
    "follow",
    "active",
)
KEPT = ("state", *NUMBERS, "force_x", "force_y", "memory")  #: what stays as long as a contact is in the table


def no_contacts(count: int = 0, laws: LawTable | None = None) -> ContactArrays:
    """A table of contacts that are apart and not in use."""
    none = np.zeros(0, dtype=np.int64)
    numbers = {name: np.zeros(count) for name in ("largest_overlap", "dashpot", *NUMBERS)}
    places = {name: np.zeros((2, 0)) for name in ("origin", "place", "displacement", "increment", "before", "searched")}
    return ContactArrays(
        laws=table_of([], bonding=False) if laws is None else laws, compliance=np.zeros(1), virgin=np.zeros((1, 1)),
        node=np.zeros((4, count), dtype=np.int32), state=np.zeros(count, dtype=np.int8), **numbers,
        force_x=np.zeros((3, count)), force_y=np.zeros((3, count)), memory=np.zeros((1, count)),
        follow=np.zeros(count, dtype=np.int8), active=np.zeros(count, dtype=np.int32), used=none, cotangent=np.zeros(0),
        **places, skin=math.inf, damping=0.0, room=np.zeros(0), tally=np.zeros((1, 8), dtype=np.int64),
        rows=np.zeros((1, 0)), chunk=np.zeros((1, 0), dtype=np.int32), used_share=none, first=none,
        corner=none, share=none,
    )  # fmt: skip
