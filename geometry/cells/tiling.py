"""Polygons in the making: a tessellation whose vertices know which sides of the region hold them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import attrs
import numpy as np

from grainlaw.polygon import following
from grainlaw.region import Region
from grainlaw.tessellation import Tessellation


def rows(first: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the given rows of a ragged array, one after another, and for each which of them it belongs to."""
    sizes = first[which + 1] - first[which]
    owner = np.repeat(np.arange(len(which)), sizes)
    return np.arange(len(owner)) + np.repeat(first[which] - (np.cumsum(sizes) - sizes), sizes), owner


def without_repetition(corners: np.ndarray, first: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions of corners left if none is twice in a row, where polygons of three or more begin, and their numbers."""
    stay = corners != corners[following(first)]
    sizes = np.diff(np.concatenate([[0], np.cumsum(stay)])[first])
    wide = sizes > 2
    stay &= np.repeat(wide, np.diff(first))
    return np.flatnonzero(stay), np.concatenate([[0], np.cumsum(sizes[wide])]), np.flatnonzero(wide)


@attrs.frozen(eq=False)
class Tiling:
    """Polygons as in a :class:`~grainlaw.tessellation.Tessellation`."""

    region: Region
    vertices: np.ndarray  #: (v, 2) m
    on: np.ndarray  #: (v, 2) sides of the region the vertex lies on, -1 for none; two in a corner
    corners: np.ndarray  #: vertex numbers of all grains in a row
    first: np.ndarray  #: (g + 1,)
    owner: np.ndarray = attrs.field()  #: (g,) grain that the polygon was cut out of, its own number unless given
    kind: np.ndarray = attrs.field()  #: of the edge from each corner to the next: 0, or the number of a joint from 1

    @owner.default
    def _itself(self) -> np.ndarray:
        return np.arange(len(self.first) - 1)

    @kind.default
    def _no_joint(self) -> np.ndarray:
        return np.zeros(len(self.corners), dtype=np.int64)

    @cached_property
    def next(self) -> np.ndarray:
        """Position of the following corner of the same grain."""
        return following(self.first)

    @cached_property
    def previous(self) -> np.ndarray:
        """Position of the corner before in the same grain."""
        return np.argsort(self.next)

    @cached_property
    def grain(self) -> np.ndarray:
        """Grain of each corner."""
        return np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))

    def corners_at(self, vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions of all corners at the given vertices, and for each at which of them."""
        order = np.argsort(self.corners, kind="stable")
        first = np.searchsorted(self.corners[order], np.arange(len(self.vertices) + 1))
        positions, owner = rows(first, vertices)
        return order[positions], owner

    def tessellation(self, grains: Tessellation | None = None, joints: Sequence[str] = ()) -> Tessellation:
        """Checked; vertices numbered as the grains meet them, unused ones left out.

        Polygons cut out of ``grains`` have their phases and are cells of them; ``joints`` are the names of kinds of
        edges from 1.
        """
        used, at, place = np.unique(self.corners, return_index=True, return_inverse=True)
        order = np.argsort(at)
        tessellation = Tessellation(self.region, self.vertices[used[order]], np.argsort(order)[place], self.first)
        if joints:
            ends = np.sort(np.column_stack([tessellation.corners, tessellation.corners[self.next]]), axis=1)
            edges, edge, times = np.unique(ends, axis=0, return_inverse=True, return_counts=True)
            inner = times[edge.ravel()] == 2
            named = {name: edges[np.unique(edge.ravel()[inner & (self.kind == k)])] for k, name in enumerate(joints, 1)}
            tessellation = attrs.evolve(tessellation, joints=named)
        if grains is not None:
            phase, parent = grains.phase[self.owner], grains.parent[self.owner]
            tessellation = attrs.evolve(tessellation, phase=phase, parent=parent, phase_names=grains.phase_names)
        tessellation.check()
        return tessellation
