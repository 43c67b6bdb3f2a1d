"""The table of contacts: their arrays, and a table of contacts that have not begun.

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
    cotangent: Changing  #: (4, c) of the grain's angle at these nodes, 0 where it is not acute
    largest_overlap: Changing  #: (c,) m
    dashpot: Changing  #: (c,) sqrt(kg/m): damping force over closing rate and over the root of stiffness
    compliance: Changing  #: (c,) 1 / ks, m/Pa
    offset: Changing  #: (c,) m, opening of the contact less that of its edges; infinite before it begins
    overlap: Changing  #: (c,) m, mean overlap of the edges after they are moved by offset and lift; 0 where apart
    opening: Changing  #: (c,) m, given to the law: lift less overlap; 0 where apart
    slip: Changing  #: (c,) m
    normal: Changing  #: (c,) Pa
    shear: Changing  #: (c,) Pa
    length: Changing  #: (c,) m in contact, 0 where apart
    tangent_x: Changing  #: (c,) unit vector
    tangent_y: Changing
    share_a: Changing  #: (c,) where the force acts: distance from the start of edge a, over its length
    share_b: Changing  #: (c,) distance from the end of edge b, over its length
    lever_a: Changing  #: (c,) distance of the force from edge a, over the length of a
    lever_b: Changing
    opened: Changing  #: (c,) m, increment of the opening in the last step
    slid: Changing  #: (c,) m, increment of the slip in the last step
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
    origin: Changing  #: (2, k) m, undeformed positions
    place: Changing  #: (2, k) m, present positions
    displacement: Changing  #: (2, k) m
    increment: Changing  #: (2, k) m, incremental displacement of the last step
    active: Changing  #: (c,) contacts that are closed, or were before this step: each thread lists its own
    before: Changing  #: (2, i) m, displacement of all nodes before the last step, set when the loop ends
    searched: Changing  #: (2, i) m, displacement of all nodes at the last search; without columns there is no search
    skin: float  #: m, distance up to which edges are neighbours
    reach: float  #: m, displacement of a node since the last search that causes a new one
    tally: Scratch  #: (threads, 8) what each thread has counted, a cache line for each
    used_share: Scratch  #: (threads + 1,) bounds in ``used`` of each thread's nodes
    share: Scratch


FOUND = ("largest_overlap", "dashpot", "compliance")  #: numbers of a contact that each search finds again
KEPT = (
    "offset", "overlap", "opening", "slip", "normal", "shear", "length", "tangent_x", "tangent_y", "share_a", "share_b",
    "lever_a", "lever_b", "opened", "slid", "twist", "normal_force", "shear_force", "damping_force", "opening_work",
    "slip_work", "damping_work",
)  #: numbers of a contact that stay as long as it is in the table  # fmt: skip


def no_contacts(count: int = 0, laws: LawTable | None = None) -> ContactArrays:
    """A table of contacts that are apart and not in use."""
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
