"""Nodes, zones and interfaces made from grains: every grain has its own nodes and shares whole edges with others.

Nodes of edges that are tied move as one; the two sides of a slit are boundaries. Neither is an interface.
"""

from __future__ import annotations

from functools import cached_property

import attrs
import numpy as np

from grainlaw.fields import ParameterError
from grainlaw.messages import LIKE, nearest
from grainlaw.polygon import following, linked
from grainlaw.tessellation import Tessellation

Names = tuple[str, ...]
TIED = -1  #: instead of the kind of an edge
ENDLESS = 1e-6  #: of the step that most nodes allow: no run would end


@attrs.frozen(eq=False)
class Mesh:
    """Undeformed geometry. Index letters: ``i`` node, ``z`` zone, ``c`` interface, ``g`` grain.

    Nodes and zones are numbered grain by grain. An interface is an edge shared by grain A and grain B; its normal
    points out of A, and its first end is the one that comes first counter-clockwise round A.
    """

    nodes: np.ndarray  #: (i, 2) m
    node_grain: np.ndarray  #: (i,)
    first_node: np.ndarray  #: (g + 1,)
    zones: np.ndarray  #: (z, 3) nodes, counter-clockwise
    zone_grain: np.ndarray  #: (z,)
    first_zone: np.ndarray  #: (g + 1,)
    interfaces: np.ndarray  #: (c, 4) nodes: both ends on A, the same ends on B
    interface_grains: np.ndarray  #: (c, 2) A and B
    interface_kind: np.ndarray  #: (c,) number into the ``kinds`` of the tessellation
    ties: np.ndarray  #: (t, 4) nodes of edges that are tied, as of interfaces
    boundary_edges: dict[str, np.ndarray]  #: (e, 2) ends of the edges of each named boundary, the grain on the left

    @cached_property
    def point(self) -> np.ndarray:
        """(i,) number of the point that each node is at, in the order of their first nodes: tied nodes share one."""
        count = len(self.nodes)
        if not len(self.ties):
            return np.arange(count)
        one, other = self.ties[:, :2].ravel(), self.ties[:, 2:].ravel()
        _, first, of = np.unique(linked(count, one, other), return_index=True, return_inverse=True)
        rank = np.empty(len(first), dtype=np.int64)
        rank[np.argsort(first)] = np.arange(len(first))
        return rank[of]

    @cached_property
    def tied(self) -> np.ndarray:
        """Nodes that share a point with others, ascending."""
        return np.unique(self.ties)

    @cached_property
    def first_of_point(self) -> np.ndarray:
        """(n,) first node of each point, ascending."""
        return np.unique(self.point, return_index=True)[1]

    @property
    def held_together(self) -> np.ndarray:
        """(k, 2) pairs of grains with a bond or a tie, as long as none is broken."""
        return np.concatenate([self.interface_grains, self.node_grain[self.ties[:, [0, 2]]]])

    @cached_property
    def boundaries(self) -> dict[str, np.ndarray]:
        """Nodes on each named boundary, ascending."""
        return {name: np.unique(edges) for name, edges in self.boundary_edges.items()}

    @cached_property
    def boundary_lengths(self) -> dict[str, float]:
        """m, undeformed, of each named boundary."""
        ends = {name: self.nodes[edges] for name, edges in self.boundary_edges.items()}
        return {name: float(np.hypot(*(place[:, 1] - place[:, 0]).T).sum()) for name, place in ends.items()}

    def middle(self, boundary: str) -> np.ndarray:
        """Nodes nearest to the centre of a boundary's bounding box: one, or those of all grains that meet there."""
        nodes = self.boundaries[boundary]
        place = self.nodes[nodes]
        distance = np.hypot(*(place - (place.min(axis=0) + place.max(axis=0)) / 2).T)
        at = place[np.argmin(distance)]
        return nodes[np.hypot(*(place - at).T) <= 1e-9 * float(np.ptp(self.nodes))]

    @cached_property
    def zone_areas(self) -> np.ndarray:
        """(z,) m2."""
        a, b, c = (self.nodes[self.zones[:, k]] for k in range(3))
        return ((b - a)[:, 0] * (c - a)[:, 1] - (c - a)[:, 0] * (b - a)[:, 1]) / 2

    @cached_property
    def interface_edges(self) -> np.ndarray:
        """(c, 2) m, from the first end to the second."""
        return self.nodes[self.interfaces[:, 1]] - self.nodes[self.interfaces[:, 0]]

    @cached_property
    def worst_step(self) -> tuple[float, int]:
        """Lowest root of mass over stiffness of a node, for density and modulus 1, over the median; and its cell."""
        corners, areas = self.nodes[self.zones], self.zone_areas
        opposite = np.roll(corners, -1, axis=1) - np.roll(corners, 1, axis=1)
        with np.errstate(divide="ignore", over="ignore"):
            stiffness = np.bincount(self.zones.ravel(), ((opposite**2).sum(axis=2) / (4 * areas[:, None])).ravel())
        mass = np.bincount(self.zones.ravel(), np.repeat(areas / 3, 3))
        step = np.sqrt(mass / stiffness)
        return float(step.min() / np.median(step)), int(self.node_grain[step.argmin()])

    def require_boundaries(self, where: str, *names: str) -> None:
        """Raise ParameterError unless there are boundaries of these names."""
        missing, has = sorted({*names} - {*self.boundaries}), ", ".join(sorted(self.boundaries))
        if missing:
            like = nearest(missing[0], self.boundaries, LIKE) if len(missing) == 1 else ""
            named = " or ".join(missing)
            raise ParameterError(f"{where}: the specimen has no boundary named {named}{like} (it has: {has})")

    def check_areas(self, where: str) -> None:
        """Raise ParameterError where the worst step is below a millionth, as of a cell that rounding has left."""
        ratio, cell = self.worst_step
        if ratio < ENDLESS:
            x, y = self.nodes[self.node_grain == cell].mean(axis=0)
            raise ParameterError(f"{where}: cell {cell} at ({x:.6g}, {y:.6g}) m is so thin that it has next to no area")


def build_mesh(grains: Tessellation, refinement: int = 0, tied: np.ndarray | None = None, slits: Names = ()) -> Mesh:
    """Fan of triangles round each grain's centroid, every triangle cut into four ``refinement`` times.

    ``tied`` tells which of the edges are, (e,); ``slits`` are names of joints.
    """
    count = len(grains.first) - 1
    sizes = np.diff(grains.first)
    corner_grain = np.repeat(np.arange(count), sizes)
    corner = np.arange(len(grains.corners))
    corner_node = corner + corner_grain  # a grain's centre follows its corners
    centre = grains.first[1:] + np.arange(count)
    nodes = np.empty((len(corner) + count, 2))
    nodes[corner_node] = grains.vertices[grains.corners]
    nodes[centre] = grains.centroids
    node_grain = np.empty(len(nodes), dtype=np.int64)
    node_grain[corner_node], node_grain[centre] = corner_grain, np.arange(count)
    zones = np.stack([corner_node, corner_node[following(grains.first)], centre[corner_grain]], axis=1)
    edges = grains.edges
    inner, outer, names = edges.right >= 0, edges.right < 0, edges.boundary_names
    faces, sides = [edges.left_corners[outer]], [edges.side[outer]]
    for number, name in enumerate(slits, len(names)):
        slit = inner & (edges.kind == grains.kinds.index(name))
        inner &= ~slit
        faces += [edges.left_corners[slit], edges.right_corners[slit][:, ::-1]]
        sides += [np.full(2 * np.count_nonzero(slit), number)]
    kind = (edges.kind if tied is None else np.where(tied, TIED, edges.kind))[inner]
    shared = corner_node[np.hstack([edges.left_corners[inner], edges.right_corners[inner]])]
    rim, side = corner_node[np.concatenate(faces)], np.concatenate(sides)
    for _ in range(refinement):
        nodes, node_grain, zones, shared, rim = _refine(nodes, node_grain, zones, shared, rim)
        side, kind = np.repeat(side, 2), np.repeat(kind, 2)
    return _number(nodes, node_grain, zones, shared, kind, rim, side, (*names, *slits), count)


def _refine(
    nodes: np.ndarray, node_grain: np.ndarray, zones: np.ndarray, shared: np.ndarray, rim: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Cut each zone into four and each edge into two."""
    size = len(nodes)
    pairs = np.sort(zones[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    keys, place = np.unique(pairs[:, 0] * size + pairs[:, 1], return_inverse=True)
    low, high = keys // size, keys % size

    def middle(i: np.ndarray, j: np.ndarray) -> np.ndarray:
        return size + np.searchsorted(keys, np.minimum(i, j) * size + np.maximum(i, j))

    mid = size + place.reshape(-1, 3)
    a, b, c = zones.T
    ab, bc, ca = mid.T
    zones = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    a1, a2, b1, b2 = shared.T
    ma, mb = middle(a1, a2), middle(b1, b2)
    shared = np.stack([a1, ma, b1, mb, ma, a2, mb, b2], axis=1).reshape(-1, 4)
    i, j = rim.T
    m = middle(i, j)
    rim = np.stack([i, m, m, j], axis=1).reshape(-1, 2)
    nodes = np.concatenate([nodes, (nodes[low] + nodes[high]) / 2])
    return nodes, np.concatenate([node_grain, node_grain[low]]), zones, shared, rim


def _number(
    nodes: np.ndarray, node_grain: np.ndarray, zones: np.ndarray, shared: np.ndarray, kind: np.ndarray,
    rim: np.ndarray, side: np.ndarray, names: tuple[str, ...], count: int,
) -> Mesh:  # fmt: skip
    """Number nodes, zones and interfaces grain by grain."""
    order = np.argsort(node_grain, kind="stable")
    number = np.argsort(order)
    nodes, node_grain = nodes[order], node_grain[order]
    zones, shared, rim = number[zones], number[shared], number[rim]
    zones = zones[np.argsort(node_grain[zones[:, 0]], kind="stable")]
    zone_grain = node_grain[zones[:, 0]]
    pairs = node_grain[shared[:, [0, 2]]]
    flip = pairs[:, 0] > pairs[:, 1]  # A is the grain of lower number
    shared[flip] = shared[flip][:, [3, 2, 1, 0]]
    pairs = np.sort(pairs, axis=1)
    rank = np.lexsort((pairs[:, 1], pairs[:, 0]))
    tied, rank = rank[kind[rank] == TIED], rank[kind[rank] != TIED]
    grain = np.arange(count + 1)
    return Mesh(
        nodes=nodes, node_grain=node_grain, first_node=np.searchsorted(node_grain, grain),
        zones=zones, zone_grain=zone_grain, first_zone=np.searchsorted(zone_grain, grain),
        interfaces=shared[rank], interface_grains=pairs[rank], interface_kind=kind[rank], ties=shared[tied],
        boundary_edges={name: rim[side == k][np.argsort(rim[side == k, 0])] for k, name in enumerate(names)},
    )  # fmt: skip
