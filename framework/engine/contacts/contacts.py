"""Contacts: pairs of edges of different grains that touch, or may soon, without a bond; their search and state.

Index letters: ``c`` contact, ``e`` exposed edge, ``i`` node, ``k`` place in the list of nodes in use.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from grainlaw.compiler.entry import compiled
from grainlaw.detection import Detection
from grainlaw.engine.contacts import contact_search
from grainlaw.engine.contacts.contact_neighbours import Neighbours
from grainlaw.engine.contacts.contact_rows import BLOCK, ROW, rows_of
from grainlaw.engine.contacts.contact_table import (
    HELD,
    KEPT,
    PER_CONTACT,
    PER_NODE,
    WAITING,
    ContactArrays,
    no_contacts,
)
from grainlaw.engine.parts.grains import Grains
from grainlaw.engine.parts.laws import LawGroup, table_of
from grainlaw.engine.parts.part import Changing, Part, Split, check_names, check_places, check_row
from grainlaw.polygon import cross


class ContactBooks(NamedTuple):
    """What only the search needs."""

    keys: Changing  #: (c,) ascending: law, edge a, edge b
    pairs: Changing  #: (c, 2) edges a and b
    exposed: Changing  #: (e,) whether the edge takes part in the search
    listed: Changing  #: (n, 2) edges of all pairs within the skin, and
    listed_at: Changing  #: (2, i) m, the displacement at which they were found: the next searches depend on it
    way: Changing  #: (g,) m, for which pairs were chosen among these
    gone: Changing  #: (3,) J, work in opening, in slip and on dashpots of contacts that have left the table


class Contacts(Part):
    """The table of contacts, the search that fills it, and the work of contacts that have left it.

    Edges are numbered: those of bonds on grain A, the same on grain B, then those on the rim of the specimen. Only
    exposed edges take part: the rim, and edges of bonds that were handed over. Without a ``detection`` there are none.
    ``pairs`` are the laws of phases that can meet.
    """

    def __init__(
        self, grains: Grains, pairs: Mapping[tuple[int, int], LawGroup], detection: Detection | None, bonded: np.ndarray
    ) -> None:
        specimen, mesh, self.detection = grains.specimen, grains.specimen.mesh, detection
        self._mesh = mesh
        rim = np.concatenate([np.zeros((0, 2), dtype=np.int64), *mesh.boundary_edges.values()])
        self.groups = list(pairs.values())
        self._origin = np.ascontiguousarray(mesh.nodes.T)
        self._place = np.zeros(len(mesh.nodes), dtype=np.int32)  # in the list of nodes in use, of those
        self.edges = np.concatenate([bonded[:, [0, 1]], bonded[:, [3, 2]], np.unique(rim, axis=0)])
        self.rim = self.edges[2 * len(bonded) :]  #: (r, 2) nodes of the edges that were never bonded
        self.edge_grain = mesh.node_grain[self.edges[:, 0]]
        self.searches, self.seconds = 0, 0.0  #: number of searches, and the time spent on them (s)
        self.arrays, self._scratch = no_contacts(), dict[str, np.ndarray]()
        none, exposed = np.zeros((0, 2), dtype=np.int32), np.arange(len(self.edges)) >= 2 * len(bonded)
        self.books = ContactBooks(
            np.zeros(0, dtype=np.int64),
            none,
            exposed,
            none,
            np.zeros((2, 0)),
            np.zeros(specimen.grains.count),
            np.zeros(3),
        )
        if detection is None:
            return
        self._skin = detection.skin * specimen.grains.grain_size
        corners = specimen.grains.vertices[specimen.grains.corners]
        width = compiled(contact_search.widths)(corners[:, 0].copy(), corners[:, 1].copy(), specimen.grains.first)
        self._largest = np.minimum(detection.largest_overlap * width, self._skin)  #: (g,) m
        self._cotangent = self._cotangents()
        self._neighbours = Neighbours(self.edges, mesh.node_grain, mesh.first_node, width, self._skin, self._origin)
        self._mass = grains.mass_behind(self.edges)
        phases, self._phase = np.unique(specimen.grains.phase[self.edge_grain], return_inverse=True)
        self._group = np.zeros((len(phases), len(phases)), dtype=np.int64)  #: law of each pair of phases
        for k, pair in enumerate(pairs):
            one, other = np.searchsorted(phases, pair)
            self._group[one, other] = self._group[other, one] = k
        self.arrays = self._nothing = self._empty(0)
        self._used = np.zeros(0, dtype=np.int64)  # (k,) nodes of exposed edges, ascending
        self.expose(np.flatnonzero(exposed))

    def __len__(self) -> int:
        return len(self.books.keys)

    def share(self, split: Split) -> np.ndarray:
        return np.arange(split.threads + 1) * len(self) // split.threads

    def shared(self, split: Split) -> ContactArrays:
        bounds = np.searchsorted(self.books.keys, np.arange(len(self.groups) + 1) * len(self.edges) ** 2)
        scratch, depth = self._scratch, len(self.arrays.memory)
        width, row = (1, 1) if split.alone else (BLOCK, ROW)
        if "chunk" not in scratch or scratch["chunk"].shape != (split.threads, width):
            scratch = self._scratch = {
                "tally": np.zeros((split.threads, 8), dtype=np.int64), "rows": rows_of(split.threads, depth, row),
                "chunk": np.zeros((split.threads, width), dtype=np.int32),
            }  # fmt: skip
        return self.arrays._replace(
            laws=self.arrays.laws._replace(first=bounds[:-1], last=bounds[1:]),
            used_share=np.searchsorted(self.arrays.used, split.node),
            share=self.share(split),
            **scratch,
            **(self._by_node() if split.alone else {}),
        )

    def _by_node(self) -> dict[str, np.ndarray]:
        """Which contacts meet at each node in use."""
        node = self.arrays.node.T.ravel()
        corner = np.argsort(node, kind="stable")
        return {"first": np.searchsorted(node[corner], np.arange(len(self.arrays.used) + 1)), "corner": corner}

    def energy(self, time_step: float) -> dict[str, float]:
        opening, slip, dashpot = self.work.tolist()
        return {"contacts_normal": opening, "contacts_shear": slip, "damping": dashpot}

    def _cotangents(self) -> np.ndarray:
        """(i,) of the grain's angle at each node of the edges, of tied grains together; 0 where it is not acute."""
        origin, mesh = self._origin, self._mesh
        follower = np.zeros(origin.shape[1], dtype=np.int64)
        follower[self.edges[:, 0]] = np.arange(len(self.edges))
        after = follower[self.edges[:, 1]]  # each node is the start of one edge
        x, y = origin[:, self.edges[:, 1]] - origin[:, self.edges[:, 0]]
        turn, ahead = x * y[after] - y * x[after], x * x[after] + y * y[after]
        result = np.zeros(origin.shape[1])
        result[self.edges[:, 1]] = np.where(ahead < 0, -ahead / np.maximum(turn, 1e-300), 0.0)
        if len(mesh.ties):
            corners = mesh.nodes[mesh.zones]
            one, other = np.roll(corners, -1, axis=1) - corners, np.roll(corners, -2, axis=1) - corners
            angle = np.arctan2(cross(one, other), (one * other).sum(axis=-1))
            whole = np.bincount(mesh.point[mesh.zones].ravel(), angle.ravel())[mesh.point]
            angle = whole[mesh.tied]
            result[mesh.tied] = np.where(angle < np.pi / 2, 1 / np.tan(np.minimum(angle, np.pi / 2)), 0.0)
        return result

    # --- what may be read ------------------------------------------------------------------------------------------

    @property
    def work(self) -> np.ndarray:
        """(3,) J done on contacts: in opening, in slip, on dashpots."""
        arrays = self.arrays
        return self.books.gone + np.array(
            [row.sum() for row in (arrays.opening_work, arrays.slip_work, arrays.damping_work)]
        )

    @property
    def grains(self) -> np.ndarray:
        """(c, 2) grains A and B."""
        return self.edge_grain[self.books.pairs]

    @property
    def forces(self) -> np.ndarray:
        """(2, 4, c) N on start and end of edge a, and on start and end of edge b."""
        rows = np.stack([self.arrays.force_x, self.arrays.force_y])
        on_a, end_a, start_b = rows[:, 0], rows[:, 1], rows[:, 2]
        return np.stack([on_a - end_a, end_a, start_b, -on_a - start_b], axis=1)

    def closed(self) -> dict[str, np.ndarray]:
        """Closed contacts (k): position, tangent (k, 2), length, opening, slip (m), tractions (Pa), grains."""
        arrays = self.arrays
        chosen = np.flatnonzero(arrays.length > 0)
        start, end = arrays.place[:, arrays.node[:2, chosen]].transpose(1, 2, 0)
        rows = {name: getattr(arrays, name)[chosen] for name in ("length", "opening", "slip", "normal", "shear")}
        position = start + arrays.share_a[chosen, None] * (end - start)
        tangent = np.stack([arrays.tangent_x[chosen], arrays.tangent_y[chosen]], axis=1)
        return {"position": position, "tangent": tangent, **rows, "grains": self.grains[chosen]}

    def deepest(self) -> str:
        """The contact with the largest overlap over the allowed one, in words."""
        assert self.detection is not None
        arrays = self.arrays
        c = int(np.argmax(arrays.overlap / arrays.largest_overlap))
        (a, b), place = self.grains[c], arrays.place[:, arrays.node[0, c]]
        deep, allowed = arrays.overlap[c], arrays.largest_overlap[c]
        found = f"grains {a} and {b} overlap by {deep:.4g} m near ({place[0]:.4g}, {place[1]:.4g}) m"
        if deep > allowed:
            found += f", more than the {allowed:.4g} m allowed"
        else:  # the contact that was too deep has lost its touch
            found = f"an edge has passed through a grain; of what still touches {found}, {allowed:.4g} m are allowed"
        return (
            f"{found} (largest_overlap = {self.detection.largest_overlap:g} of the smaller grain's width, at most the "
            "skin): give contacts a higher normal stiffness, load more slowly, or allow more with "
            "Detection(largest_overlap=..., skin=...)"
        )

    # --- the search ---------------------------------------------------------------------------------------------------

    def search(self, displacement: np.ndarray, before: np.ndarray, *, beside: bool = False) -> None:
        """Search neighbours at a displacement (2, i), one step after ``before``; contacts keep their state.

        Only ``beside`` edges that were exposed since the last search, if that will do: all others stay.
        """
        if self.detection is None:
            return
        clock = time.perf_counter()
        near = self._neighbours.find_beside(displacement, self.books.exposed, self._used) if beside else None
        if whole := near is None:
            near = self._neighbours.find(displacement, before, self.books.exposed)
        if near is None:
            return
        old = self.books.keys
        keys = np.sort(
            np.concatenate([old[self.arrays.state >= HELD] if whole else old, self.key(*near.T)]), kind="stable"
        )
        del near
        other = np.ones(len(keys), dtype=bool)
        np.not_equal(keys[1:], keys[:-1], out=other[1:])
        keys = keys[other]
        self.searches += 1
        self._note_list()
        if whole and np.array_equal(keys, old) and np.array_equal(self._used, self.arrays.used):
            self._look_again(displacement, before)
            self.seconds += time.perf_counter() - clock
            return
        size = len(self.edges)
        pairs = np.empty((len(keys), 2), dtype=np.int32)
        pairs[:, 0], pairs[:, 1] = keys // size % size, keys % size
        found = compiled(contact_search.matches)(keys, old)
        if whole:
            lost = np.ones(len(old), dtype=bool)
            lost[found[found >= 0]] = False
            for k, name in enumerate(("opening_work", "slip_work", "damping_work")):
                self.books.gone[k] += getattr(self.arrays, name)[lost].sum()
        self.books = self.books._replace(keys=keys, pairs=pairs)
        nodes = self._nodes_in_use(displacement, before, whole)
        self._place[nodes["used"]] = np.arange(len(nodes["used"]), dtype=np.int32)  # others are cast one by one
        before = before if before is self.arrays.before else before.copy()
        kept = self._kept(found)
        self.arrays = self._nothing._replace(
            **nodes, **kept, node=compiled(contact_search.nodes_of)(pairs, self.edges, self._place),
            largest_overlap=np.minimum(*self._largest[self.edge_grain[pairs.T]]), dashpot=self._dashpots(pairs),
            follow=np.zeros(len(keys), dtype=np.int8), active=np.zeros(len(keys), dtype=np.int32), before=before,
        )  # fmt: skip
        new = np.flatnonzero(found < 0)
        self.arrays.state[new] = WAITING
        self.arrays.memory[:, new] = self.arrays.virgin[:, self.groups_of(keys[new])]
        self.seconds += time.perf_counter() - clock

    def _look_again(self, displacement: np.ndarray, before: np.ndarray) -> None:
        """Go on with the same table until nodes have moved as far again."""
        arrays = self.arrays
        arrays.searched[:] = displacement[:, arrays.used]
        arrays.room[:] = self._neighbours.room(arrays.used, displacement)
        arrays.before[:] = before

    def are_near(self, displacement: np.ndarray) -> bool:
        """Whether any exposed edges are nearer than half the skin."""
        if self.detection is None:
            return False
        near = self._neighbours.any_within(displacement, self.books.exposed)
        self._note_list()
        return near

    def expose(self, edges: np.ndarray) -> None:
        """Let edges take part in the search from now on."""
        self.books.exposed[edges] = True
        nodes = np.unique(self.edges[edges])
        place = np.searchsorted(self._used, nodes)
        new = np.ones(len(nodes), dtype=bool)
        new[place < len(self._used)] = self._used[place[place < len(self._used)]] != nodes[place < len(self._used)]
        self._used = np.insert(self._used, place[new], nodes[new])
        self._neighbours.expose(edges)

    def _exposed_nodes(self) -> np.ndarray:
        """(k,) nodes of exposed edges, ascending."""
        found = np.zeros(self._origin.shape[1], dtype=bool)
        found[self.edges[self.books.exposed]] = True
        return np.flatnonzero(found)

    def check_saved(self, saved: Mapping[str, np.ndarray]) -> None:
        """As of every part, of any number of contacts; all edges, nodes and laws that they name must be there."""
        own = self.save()
        check_names(own, saved)
        contacts, used, edges, nodes = len(saved["keys"]), len(saved["used"]), len(self.edges), self._origin.shape[1]
        many = {"pairs": (contacts, 2), "listed": (len(saved["listed"]), 2), "used": (used,), "keys": (contacts,)}
        for name, row in own.items():
            shape = row.shape
            if name in many:
                shape = many[name]
            elif name in PER_CONTACT:
                shape = (*row.shape[:-1], contacts)
            elif name in PER_NODE:
                shape = (*row.shape[:-1], used)
            elif name in ("before", "listed_at") and saved[name].size:
                shape = (2, nodes)
            check_row(name, saved[name], row.dtype, shape)
        for name, count in (
            ("node", used), ("active", contacts), ("used", nodes), ("pairs", edges), ("listed", edges), ("state", 4),
        ):  # fmt: skip
            check_places(name, saved[name], count)
        keys = saved["keys"]
        check_places("keys", keys, max(len(self.groups), 1) * edges**2)
        if (np.diff(keys) <= 0).any() or (np.diff(saved["used"]) <= 0).any():
            raise ValueError("keys and used must rise")
        if not np.array_equal(saved["pairs"], np.stack([keys // edges % edges, keys % edges], axis=1)):
            raise ValueError("pairs are not those of keys")

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """As of every part, and of the search."""
        super().restore(saved)
        if self.detection is not None:
            self._used = self._exposed_nodes()
            known, books = self._neighbours, self.books
            known.pairs, known.searched, known.way = books.listed.copy(), books.listed_at.copy(), books.way.copy()

    def _note_list(self) -> None:
        known = self._neighbours
        self.books = self.books._replace(listed=known.pairs, listed_at=known.searched, way=known.way)

    def _dashpots(self, pairs: np.ndarray) -> np.ndarray:
        """(c,) sqrt(kg/m) for pairs (c, 2) of edges."""
        if self.detection is None or self.detection.damping == 0:
            return np.zeros(len(pairs))
        mass_a, mass_b = self._mass[pairs.T]
        return 2 * self.detection.damping * np.sqrt(mass_a * mass_b / (mass_a + mass_b))

    def _nodes_in_use(self, displacement: np.ndarray, before: np.ndarray, whole: bool) -> dict[str, Any]:
        """Nodes of exposed edges, where they are, and after a ``whole`` search that it was there."""
        used, known = self._used, self.arrays
        found = compiled(contact_search.matches)(used, known.used)
        new = np.flatnonzero(found < 0)

        def with_known(row: np.ndarray, of_new: np.ndarray) -> np.ndarray:
            result = (
                row.take(found, axis=-1, mode="wrap") if len(known.used) else np.empty((*row.shape[:-1], len(used)))
            )
            result[..., new] = of_new
            return result

        there, origin = displacement.take(used, axis=1), self._origin.take(used, axis=1)
        # Copied, not found again: rounding must not depend on how often neighbours are searched.
        increment = with_known(known.increment, there[:, new] - before.take(used[new], axis=1))
        if whole:
            searched, room = there.copy(), self._neighbours.room(used, displacement)
        else:
            searched, room = (
                with_known(known.searched, there[:, new]),
                with_known(known.room, self._neighbours.room(used[new], displacement)),
            )
        return {
            "used": used, "cotangent": self._cotangent[used], "origin": origin, "place": origin + there,
            "displacement": there, "increment": increment, "searched": searched, "room": room,
        }  # fmt: skip

    def _kept(self, found: np.ndarray) -> dict[str, Any]:
        """State of contacts that were at these places; each old field is freed once it is copied, to save memory."""
        rows = self.arrays._asdict()
        self.arrays = self._nothing
        new, result = np.flatnonzero(found < 0), dict[str, Any]()
        for name in KEPT:
            old = rows.pop(name)
            if old.shape[-1]:
                result[name] = old.take(found, axis=-1, mode="wrap")  # -1 is the last, in place of nothing
                result[name][..., new] = 0
            else:
                result[name] = np.zeros((*old.shape[:-1], len(found)), dtype=old.dtype)
        return result

    def _empty(self, count: int) -> ContactArrays:
        depth = max((group.depth for group in self.groups), default=1)
        virgin = np.zeros((depth, max(len(self.groups), 1)))
        for g, group in enumerate(self.groups):
            virgin[: group.depth, g] = group.virgin
        compliance = np.array([1 / np.mean(group.law.stiffness[1]) for group in self.groups], dtype=float)
        return no_contacts(count, table_of(self.groups, bonding=False))._replace(
            memory=np.zeros((depth, count)), virgin=virgin, compliance=compliance, skin=self._skin,
            damping=0.0 if self.detection is None else float(self.detection.damping),
        )  # fmt: skip

    def key(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(c,) keys by which contacts of edges a and b are sorted: law, edge a, edge b."""
        size = len(self.edges)
        return (self._group[self._phase[a], self._phase[b]] * size + a) * size + b

    def groups_of(self, keys: np.ndarray) -> np.ndarray:
        """(c,) number of the law of each key."""
        return keys // len(self.edges) ** 2 if len(self.edges) else keys
