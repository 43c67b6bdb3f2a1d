"""Which contacts are in the table: pairs of exposed edges that may meet before the next search.

A grid finds all pairs within the skin, seldom. Among these the pairs are chosen, more often, that grains can bring
together in the next steps, each at its own speed. Where bonds break, only what is near their edges is found, and all
else stays. No result depends on when this happens.
"""

from __future__ import annotations

import numpy as np

from grainlaw.compiler.entry import compiled
from grainlaw.engine.contacts import contact_search

REACH = 0.5  #: of the skin: when two nodes have moved so far, their distance may have shrunk by the skin
AHEAD = 50  #: steps for which pairs are chosen
LEAST = 0.05  #: of the skin: the least way for which they are chosen
SPENT = 0.8  #: of that way: when a node has moved so far they are chosen again, before any can overlap
TORN = 10.0  #: times its undeformed length: no edge is so long in a stable run
FEW = 200  #: edges that are searched without the grid: each edge costs as much there as with so many others here


class Neighbours:
    """The search of near pairs of exposed edges; ``room`` says until when what it found last holds.

    ``edges`` (e, 2) nodes, ``grain`` (i,) of each node, ``first`` (g + 1,) first node of each grain, ``width`` (g,) m
    their least width, ``skin`` m, ``origin`` (2, i) m undeformed positions.
    """

    def __init__(
        self,
        edges: np.ndarray,
        grain: np.ndarray,
        first: np.ndarray,
        width: np.ndarray,
        skin: float,
        origin: np.ndarray,
    ) -> None:
        self._edges, self._grain, self._grain_of_node = edges, grain[edges[:, 0]], grain
        self._first, self._width = first, width
        self._skin, self._origin = skin, origin
        lengths = np.hypot(*(origin[:, edges[:, 1]] - origin[:, edges[:, 0]]))
        self._cell = float(2 * skin + (np.median(lengths) if len(edges) else 1.0))
        self._longest, self._ends, self._turn = TORN * lengths, np.zeros((4, len(edges))), (skin / width)[self._grain]
        self.forget()

    def forget(self) -> None:
        """Search with a grid next time."""
        self.pairs = np.zeros((0, 2), dtype=np.int32)  #: (n, 2) within the skin at the last search with a grid
        self.searched = np.zeros((2, 0))  #: (2, i) m, displacement at that search; without columns there was none
        self.way = np.zeros(len(self._width))  #: (g,) m, for which pairs were chosen last
        self._fresh = np.zeros(0, dtype=np.int32)

    def expose(self, edges: np.ndarray) -> None:
        """Search the neighbours of these edges, too, next time."""
        self._fresh = edges.astype(np.int32)

    def find(self, displacement: np.ndarray, before: np.ndarray, exposed: np.ndarray) -> np.ndarray | None:
        """(n, 2) pairs of edges, that of the lower grain first; ``room`` says how far nodes may move meanwhile.

        None in a run that has become unstable: the check of the energies reports where.
        """
        chosen = np.flatnonzero(exposed).astype(np.int32)
        if not self._placed(displacement, chosen):
            return None
        way, moved = self._ways(displacement, before)
        if self._search(displacement, moved, chosen):
            way, moved = self._ways(displacement, before)
        alone = np.ones(len(way), dtype=bool)
        alone[self._grain[self.pairs]] = False  # for such there is nothing to choose
        way[alone] = REACH * self._skin - moved[alone]
        self.way = way
        return self.pairs[self._still_near(self.pairs, way, contact_search.DEEP * self._skin)]

    def find_beside(self, displacement: np.ndarray, exposed: np.ndarray, used: np.ndarray) -> np.ndarray | None:
        """(n, 2) pairs of edges that were exposed since the last search; all others stay, as does ``room``.

        ``used`` (k,) are the nodes of all exposed edges. None where everything has to be searched: after long ways, for
        many edges, and in a run that has become unstable.
        """
        fresh = self._fresh
        if not self.searched.size or len(fresh) > FEW:
            return None
        moved = displacement.take(used, axis=1) - self.searched.take(used, axis=1)
        chosen = np.flatnonzero(exposed).astype(np.int32)
        if not (moved * moved).sum(axis=0).max(initial=0.0) < (REACH * self._skin / 2) ** 2:
            return None
        if not self._placed(displacement, chosen):
            return None
        self._fresh = fresh[:0]
        more = self._near_those(chosen, fresh)
        self.pairs = np.concatenate([self.pairs, more])
        # Nodes may be away from where they were when the ways were chosen, and come back: twice the way.
        return more[self._still_near(more, 2 * self.way, contact_search.DEEP * self._skin)]

    def room(self, nodes: np.ndarray, displacement: np.ndarray) -> np.ndarray:
        """(k,) m, how far nodes (k,) may move from a displacement (2, i) until the next search.

        Together with what they have moved since the last search with a grid that is at most the reach.
        """
        x, y = displacement.take(nodes, axis=1) - self.searched.take(nodes, axis=1)
        left = np.maximum(REACH * self._skin - np.hypot(x, y), 0.0)
        return SPENT * np.minimum(self.way[self._grain_of_node[nodes]], left)

    def any_within(self, displacement: np.ndarray, exposed: np.ndarray) -> bool:
        """Whether any are nearer than half the skin, or than the skin if behind each other; whenever searched."""
        chosen = np.flatnonzero(exposed).astype(np.int32)
        if not self._placed(displacement, chosen):
            return False
        _, moved = self._ways(displacement, displacement)
        self._search(displacement, moved, chosen)
        return bool(self._still_near(self.pairs, np.full(len(self._width), self._skin / 4), self._skin / 2).any())

    def _placed(self, displacement: np.ndarray, chosen: np.ndarray) -> bool:
        """Note where the ends of the chosen edges are; False where one is torn."""
        return compiled(contact_search.place_ends)(
            self._edges, chosen, self._origin, displacement, self._longest, self._ends
        )

    def _ways(self, displacement: np.ndarray, before: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        searched = self.searched if self.searched.size else displacement
        way, moved = compiled(contact_search.ways)(
            displacement, before, searched, self._first, AHEAD, LEAST * self._skin, REACH * self._skin
        )
        return way, moved

    def _search(self, displacement: np.ndarray, moved: np.ndarray, chosen: np.ndarray) -> bool:
        """Find all pairs within the skin, unless no node has moved (g,) by more than half the reach; whether done.

        If none has, what is near edges that were exposed meanwhile is found without the grid.
        """
        fresh, self._fresh = self._fresh, self._fresh[:0]
        if self.searched.size and moved.max(initial=0.0) < REACH * self._skin / 2 and len(fresh) <= FEW:
            if len(fresh):
                self.pairs = np.concatenate([self.pairs, self._near_those(chosen, fresh)])
            return False
        found = compiled(contact_search.near_pairs)(
            *(row[chosen] for row in self._ends), self._grain[chosen], self._turn[chosen], self._skin, self._cell
        )
        self.pairs, self.searched = chosen[found], displacement.copy()
        return True

    def _near_those(self, chosen: np.ndarray, fresh: np.ndarray) -> np.ndarray:
        """(n, 2) pairs of ``fresh`` edges with the ``chosen`` ones that may meet before the next search with a grid.

        Nodes have moved by at most half the reach since the last one, and will by at most the reach: from here by one
        and a half.
        """
        return compiled(contact_search.near_those)(
            *self._ends, self._grain, 1.5 * self._turn, chosen, fresh, 3 * REACH * self._skin, self._skin
        )

    def _still_near(self, pairs: np.ndarray, way: np.ndarray, deep: float) -> np.ndarray:
        """(n,) which of these pairs (n, 2) may meet while nodes of each grain move by its ``way`` (g,) m."""
        turn = 2 * way / self._width
        return compiled(contact_search.still_near)(pairs, *self._ends, self._grain, turn, way, self._skin, deep)
