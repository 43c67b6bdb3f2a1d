"""The laws of a model, grouped and compiled: used by bonds and contacts alike."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import NamedTuple

import attrs
import numpy as np
from numba import njit

from grainlaw.compiler.batch import Compiled
from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.numba_private import call
from grainlaw.contact import ContactLaw, declared_stiffness
from grainlaw.engine.parts.part import Address, Constant

#: A law is called for a multiple of so many contact points, except for the last of its group: the compiler may round
#: the few that do not fill a vector differently, and which these are must not depend on where threads and tables begin.
LANES = 64
LITTLE = 2.0 ** np.arange(-100, 0, 10)  #: m, trial displacements: some of them are small for any law
#: In place of the row of the damage: a law without damage, and one without tensile strength and cohesion.
NEVER, ALWAYS = -1, -2


class LawTable(NamedTuple):
    """Laws (g) as the step calls them; bonds or contacts of one law are consecutive."""

    address: Address  #: (g,) of the machine code
    numbers: Address  #: (g,) address of its parameters
    rows: Address  #: (g,) address of its parameters that differ from point to point: its first points, then its second
    stride: Constant  #: (g,) length of such a row
    first: Constant  #: (g,) first bond or contact
    last: Constant  #: (g,) and the one after the last
    damage: Constant  #: (g,) row of the memory that is the damage, or ``NEVER``, or ``ALWAYS``
    dilation: Constant  #: (g,) row of the memory that is the dilation, or -1


@njit(forceinline=True, **OPTIONS)
def respond(laws, g, memory, second, first, last, opening, slip, normal, shear):
    """Evaluate law ``g`` at the first contact point of bonds ``first`` to ``last``, or at their ``second``.

    ``memory`` is (m, p); the other rows are addresses of p numbers.
    """
    point = 8 * (first + second * (memory.shape[1] // 2))
    own = 8 * (first - laws.first[g] + second * (laws.last[g] - laws.first[g]))
    call(
        laws.address[g],
        (
            laws.numbers[g], laws.rows[g] + own, laws.stride[g], memory.ctypes.data + point, memory.shape[1],
            opening + point, slip + point, normal + point, shear + point, last - first,
        ),
    )  # fmt: skip


@njit(forceinline=True, **OPTIONS)
def is_unbonded(laws, g, memory, p):
    """Whether contact point ``p`` of law ``g`` is broken, or was never bonded."""
    row = laws.damage[g]
    return row == ALWAYS if row < 0 else memory[row, p] >= 1.0


@attrs.frozen(eq=False)
class LawGroup:
    """Bonds or contacts ``first`` to ``last`` that follow one law."""

    law: ContactLaw
    compiled: Compiled
    virgin: np.ndarray  #: (m,) memory of a virgin contact point
    first: int = 0
    last: int = 0

    @property
    def size(self) -> int:
        """Number of bonds or contacts."""
        return self.last - self.first

    def row(self, name: str) -> int:
        """Place of a name in the law's memory, or -1."""
        return self.compiled.memory.index(name) if name in self.compiled.memory else -1

    @property
    def depth(self) -> int:
        """Rows of memory with which the law is called; one unused row where it has none."""
        return len(self.virgin)

    def points(self, count: int) -> np.ndarray:
        """(2 size,) its contact points among those of ``count`` bonds: the first points, then the second."""
        return np.r_[self.first : self.last, count + self.first : count + self.last]

    @cached_property
    def resists_opening(self) -> np.ndarray:
        """(2 size,) whether each virgin point resists a little opening."""
        return self._resists(0)

    def _resists(self, mode: int) -> np.ndarray:
        memory = np.repeat(self.virgin[:, None], 2 * self.size, axis=1)
        held = np.zeros(2 * self.size, dtype=bool)
        for little in LITTLE:
            opening, slip = np.zeros((2, 2 * self.size))
            (opening, slip)[mode][:] = little
            held |= self.compiled.batch(opening, slip, memory.copy())[mode] > 0
        return held

    @cached_property
    def cohesive(self) -> np.ndarray:
        """(2, size) whether a virgin point resists opening, or slip under no pressure."""
        return (self.resists_opening | self._resists(1)).reshape(2, -1)

    def tangent(
        self, opening: np.ndarray, slip: np.ndarray, memory: np.ndarray, little: np.ndarray | float
    ) -> np.ndarray:
        """(n,) Pa/m, tangent stiffness against a ``little`` more closure (m), with a copy of the ``memory`` (m, n)."""
        now, _ = self.compiled.batch(opening, slip, memory.copy())
        more, _ = self.compiled.batch(opening - little, slip, memory.copy())
        return (now - more) / little

    def tangent_in_slip(
        self, opening: np.ndarray, slip: np.ndarray, memory: np.ndarray, little: np.ndarray
    ) -> np.ndarray:
        """(n,) Pa/m, tangent stiffness against a ``little`` more slip (n,) m of either sign, as ``tangent``."""
        _, now = self.compiled.batch(opening, slip, memory.copy())
        _, more = self.compiled.batch(opening, slip + little, memory.copy())
        return (more - now) / little


def table_of(groups: Sequence[LawGroup], bonding: bool) -> LawTable:
    """The table for the step; with ``bonding`` the groups are bonds, whose damage the step reads."""
    rows = []
    for group in groups:
        fields = group.compiled.rows
        damage = group.row("damage")
        if bonding and not group.resists_opening.any():
            damage = ALWAYS
        rows.append((
            group.compiled.address, group.compiled.numbers.ctypes.data, fields.ctypes.data, fields.shape[1],
            group.first, group.last, damage, group.row("dilation"),
        ))  # fmt: skip
    return LawTable(*np.array(rows, dtype=np.int64).reshape(-1, len(LawTable._fields)).T.copy())


def memory_of(law: Compiled) -> int:
    """Rows of memory with which a law is called; one unused row where it has none."""
    return len(law.memory) or 1


def stiffness_of_points(sizes: Iterable[tuple[ContactLaw, int]]) -> np.ndarray:
    """(2, p) Pa/m: kn and ks of the first response, as the laws of so many bonds each declare them."""
    rows = [np.zeros((2, 2, 0))]
    for law, size in sizes:
        rows.append(np.stack([np.broadcast_to(value, 2 * size).reshape(2, -1) for value in declared_stiffness(law)]))
    return np.concatenate(rows, axis=2).reshape(2, -1)


def by_interface(order: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(k, 2, c) in the order of the mesh, of rows (k, p) of the contact points of bonds."""
    result = np.empty((len(rows), 2, len(order)))
    result[:, :, order] = rows.reshape(len(rows), 2, -1)
    return result
