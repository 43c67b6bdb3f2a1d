"""The table of contacts: the arrays of contacts, and those of a contact that has not begun.

Index letters: ``c`` contact, ``i`` node, ``k`` place in the list of nodes in use.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from grainlaw.engine.parts.laws import LawTable, table_of
from grainlaw.engine.parts.part import Changing, Constant, Scratch


class ContactArrays(NamedTuple):
    """The table of contacts, sorted by law and edges. The laws' ``first`` and ``last`` are set for each run."""

    laws: LawTable
    node: Changing  #: (4, c) places in ``used``: start and end of edge a, of edge b, each counter-clockwise
    cotangent: Changing  #: (4, c) of the corners at these nodes, 0 where they are not acute
    largest_overlap: Changing  #: (c,) m
    dashpot: Changing  #: (c,) sqrt(kg/m): damping force over rate and root of stiffness
    compliance: Changing  #: (c,) 1 / ks, m/Pa
    offset: Changing  #: (c,) m, how much more open the contact is than its edges; infinite before it begins
    overlap: Changing  #: (c,) m, mean overlap of the edges, moved by offset and by the lift of dilation; 0 where apart
    opening: Changing  #: (c,) m, of the law: the lift less the overlap; 0 where apart
    slip: Changing  #: (c,) m
    normal: Changing  #: (c,) Pa
    shear: Changing  #: (c,) Pa
    length: Changing  #: (c,) m in contact, 0 where apart
    tangent_x: Changing  #: (c,) unit vector
    tangent_y: Changing
    share_a: Changing  #: (c,) where the contact acts: share of edge a from its start
    share_b: Changing  #: (c,) of edge b from its end
    lever_a: Changing  #: (c,) how far beside edge a, over its length
    lever_b: Changing
    opened: Changing  #: (c,) m in the last step
    slid: Changing  #: (c,) m in the last step
    twist: Changing  #: (c,) m, moment over normal force
    force_x: Changing  #: (4, c) N on the four nodes
    force_y: Changing
    normal_force: Changing  #: (c,) N of the last step
    shear_force: Changing
    damping_force: Changing
    opening_work: Changing  #: (c,) J
    slip_work: Changing
    damping_work: Changing
    memory: Changing  #: (m, c) of the laws
    virgin: Constant  #: (m, groups) memory of a contact that has just begun
    used: Changing  #: (k,) nodes of these edges, ascending
    origin: Changing  #: (2, k) m, undeformed places
    place: Changing  #: (2, k) m, present places
    displacement: Changing  #: (2, k) m there
    increment: Changing  #: (2, k) m, incremental displacement of the last step
    active: Changing  #: (c,) contacts that are closed, or were before this step: each thread lists its own
    before: Changing  #: (2, i) m, displacement of all nodes a step ago, where the loop has done all its steps
    searched: Changing  #: (2, i) m, displacement of all nodes at the last search; none: there is no search
    skin: float  #: m, how far neighbours are searched
    reach: float  #: m, a node that has moved farther asks for a new search
    tally: Scratch  #: (threads, 8) what each thread has counted, a cache line for each
    used_share: Scratch  #: (threads + 1,) bounds in ``used`` of each thread's nodes
    share: Scratch


FOUND = ("largest_overlap", "dashpot", "compliance")  #: numbers of a contact that each search gives anew
KEPT = (
    "offset", "overlap", "opening", "slip", "normal", "shear", "length", "tangent_x", "tangent_y", "share_a", "share_b",
    "lever_a", "lever_b", "opened", "slid", "twist", "normal_force", "shear_force", "damping_force", "opening_work",
    "slip_work", "damping_work",
)  #: numbers of a contact that stay as long as it is in the table  # fmt: skip


def no_contacts(count: int = 0, laws: LawTable | None = None) -> ContactArrays:
    """Contacts that are apart, and are not followed."""
    none = np.zeros(0, dtype=np.int64)
    return ContactArrays(
        laws=table_of([], bonding=False) if laws is None else laws,
        node=np.zeros((4, count), dtype=np.int32), cotangent=np.zeros((4, count)),
        **{name: np.zeros(count) for name in (*FOUND, *KEPT)}, force_x=np.zeros((4, count)),
        force_y=np.zeros((4, count)), memory=np.zeros((1, count)), virgin=np.zeros((1, 1)), used=none,
        **{name: np.zeros((2, 0)) for name in ("origin", "place", "displacement", "increment", "before", "searched")},
        active=np.zeros(count, dtype=np.int64), skin=math.inf, reach=math.inf,
        tally=np.zeros((1, 8), dtype=np.int64), used_share=none, share=none,
    )  # fmt: skip
