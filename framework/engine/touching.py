"""The contacts of a running specimen that are no bonded interfaces: found, kept up to date, and read."""

from __future__ import annotations

import copy
import math
import time
from typing import Any

import attrs
import numpy as np

from grainlaw.compiler.batch import Compiled, compile_law
from grainlaw.compiler.entry import compiled
from grainlaw.contact import ContactLaw, Laws, law_of_pair
from grainlaw.detection import Detection
from grainlaw.engine import search, touch
from grainlaw.parameter import ParameterError
from grainlaw.specimen import Specimen

REACH = 0.5  #: of the skin: when a node has moved so far, two grains may have come as near as the skin
TORN = 10.0  #: times its length that an edge cannot be in a run that is stable
PER_CONTACT = ("limit", "dashpot", "ease", "offset", "depth", "opening", "slip", "normal", "shear", "length")
CARRIED = (*PER_CONTACT[3:], "frame", "force", "carried", "work", "memory")


def uniform(component: Any) -> Any:
    """The component with the mean of each parameter that differs between contacts."""
    changes = {}
    for field in attrs.fields(type(component)):
        value = getattr(component, field.name)
        if isinstance(value, np.ndarray):
            changes[field.name] = float(value.mean())
        elif attrs.has(type(value)) and uniform(value) is not value:
            changes[field.name] = uniform(value)
    return attrs.evolve(component, **changes) if changes else component


def broken_memory(law: Compiled) -> np.ndarray:
    """(m,) memory of a contact that was pulled apart and put back."""
    memory = np.zeros((len(law.memory) or 1, 1))
    for opening in (0.0, *2.0 ** np.arange(-60, 41), 0.0):  # m: powers of two, from which laws of any size break alike
        before = memory.copy()
        law.batch(np.array([opening]), np.zeros(1), memory)
        if not np.isfinite(memory).all():
            memory = before
        if "damage" in law.memory and memory[law.memory.index("damage"), 0] >= 1:
            break
    law.batch(np.zeros(1), np.zeros(1), memory)
    return memory[:, 0]


def no_touching(count: int = 0) -> touch.Touching:
    """Contacts that are apart, and are not followed."""
    none = np.zeros(0, dtype=np.int64)
    return touch.Touching(
        node=np.zeros((4, count), dtype=np.int32), acute=np.zeros((4, count)),
        **{name: np.zeros(count) for name in PER_CONTACT},
        frame=np.zeros((9, count)), force=np.zeros((2, 4, count)), carried=np.zeros((3, count)),
        work=np.zeros((3, count)), memory=np.zeros((1, count)), fresh=np.zeros((1, 1)), touched=none,
        **{name: np.zeros((2, 0)) for name in ("origin", "place", "seen", "way", "before", "built")},
        active=np.zeros(count, dtype=np.int64), skin=np.inf, reach=np.inf, tally=np.zeros((1, 8), dtype=np.int64),
    )  # fmt: skip


@attrs.frozen(eq=False)
class TouchGroup:
    """Contacts between two phases, which follow one law."""

    phases: tuple[int, int]
    law: ContactLaw
    compiled: Compiled
    broken: np.ndarray  #: (m,)

    @property
    def lift(self) -> int:
        """The row of the memory that says how far slip has lifted the faces, or -1."""
        names = self.compiled.memory
        return names.index("dilation") if "dilation" in names else -1


def touch_groups(specimen: Specimen, laws: Laws, detection: Detection) -> list[TouchGroup]:
    """The laws of all pairs of phases that can meet. Raises :class:`ParameterError` for a pair without one."""
    phases, counts = np.unique(specimen.grains.phase, return_counts=True)
    groups = []
    for k, one in enumerate(phases.tolist()):
        for other in phases[k + (counts[k] < 2) :].tolist():
            own = None if detection.law is None else law_of_pair(detection.law, one, other)
            law = own or law_of_pair(laws, one, other)
            if law is None:
                raise ParameterError(
                    f"law: no law is given for contacts between the phases {(one, other)}, which may come to touch; "
                    f"give one in law or in Detection(law=...)"
                )
            batch = compile_law(uniform(law))
            groups.append(TouchGroup((one, other), law, batch, broken_memory(batch)))
    return groups


class Touches:
    """The table of contacts, the search that fills it, and what is booked of contacts that have gone."""

    def __init__(self, specimen: Specimen, laws: Laws, detection: Detection, order: np.ndarray, origin: np.ndarray):
        mesh, grains = specimen.mesh, specimen.grains
        self.detection, self.origin = detection, origin
        self.groups = touch_groups(specimen, laws, detection)
        bonded = mesh.interfaces[order]
        rim = np.concatenate([np.zeros((0, 2), dtype=np.int64), *mesh.boundary_edges.values()])
        rim = np.unique(rim, axis=0)
        self.edges = np.concatenate([bonded[:, [0, 1]], bonded[:, [3, 2]], rim])  #: (e, 2) nodes, grain on the left
        self.exposed = np.arange(len(self.edges)) >= 2 * len(bonded)  #: (e,) whether anything may touch the edge
        self.edge_grain = mesh.node_grain[self.edges[:, 0]]
        self.skin = detection.skin * grains.grain_size  #: m
        self._ease = np.array([1 / np.mean(group.law.stiffness[1]) for group in self.groups], dtype=float)
        corners = grains.vertices[grains.corners]
        width = compiled(search.widths)(corners[:, 0].copy(), corners[:, 1].copy(), grains.first)
        self.limits = np.minimum(detection.largest_overlap * width, self.skin)  #: (g,) m
        self._turn = (self.skin / width)[self.edge_grain]  #: (e,) rad, as all nodes move by half the skin
        self._lengths = np.hypot(*(origin[:, self.edges[:, 1]] - origin[:, self.edges[:, 0]]))  #: (e,) m, undeformed
        self._acute = self._cotangents(origin)
        self.cell = float(2 * self.skin + (np.median(self._lengths) if len(self._lengths) else 1.0))
        nodes = np.concatenate([specimen.node_masses, [0.0]])
        mass = np.bincount(mesh.node_grain, specimen.node_masses)[self.edge_grain]
        self.edge_mass = mass if specimen.is_rigid else nodes[self.edges].sum(axis=1)
        phases, self._phase = np.unique(grains.phase[self.edge_grain], return_inverse=True)
        self._group = np.zeros((len(phases), len(phases)), dtype=np.int64)  #: law of each pair of phases
        for k, group in enumerate(self.groups):
            one, other = np.searchsorted(phases, group.phases)
            self._group[one, other] = self._group[other, one] = k
        self.keys = np.zeros(0, dtype=np.int64)
        self.pairs = np.zeros((0, 2), dtype=np.int64)  #: (c, 2) edges a and b
        self.gone = np.zeros(3)  #: J, work on contacts that are no more
        self.searches = 0
        self.seconds = 0.0  #: spent in searches
        self.arrays = self._empty(0)
        self._bounds = np.zeros(len(self.groups) + 1, dtype=np.int64)

    def __len__(self) -> int:
        return len(self.keys)

    def _cotangents(self, origin: np.ndarray) -> np.ndarray:
        """(2, e) of the grain's angles at both ends of each edge; 0 where they are not acute."""
        follower = np.zeros(origin.shape[1], dtype=np.int64)
        follower[self.edges[:, 0]] = np.arange(len(self.edges))
        after = follower[self.edges[:, 1]]  # a node begins one edge
        x, y = origin[:, self.edges[:, 1]] - origin[:, self.edges[:, 0]]
        turn, ahead = x * y[after] - y * x[after], x * x[after] + y * y[after]
        cotangent = np.where(ahead < 0, -ahead / np.maximum(turn, 1e-300), 0.0)
        result = np.zeros((2, len(self.edges)))
        result[1], result[0, after] = cotangent, cotangent
        return result

    @property
    def work(self) -> np.ndarray:
        """(3,) J done on contacts: in opening, in slip, on dashpots."""
        return self.gone + self.arrays.work.sum(axis=1)

    @property
    def grains(self) -> np.ndarray:
        """(c, 2) grains A and B."""
        return self.edge_grain[self.pairs]

    @property
    def lifts(self) -> np.ndarray:
        """(c,) m, how far slip has lifted the faces of each contact."""
        rows = np.array([group.lift for group in self.groups], dtype=int)[self.groups_of(self.keys)]
        return np.where(rows >= 0, self.arrays.memory[rows, np.arange(len(rows))], 0.0)

    def closed(self) -> dict[str, np.ndarray]:
        """Contacts (k) that are closed: position, tangent (k, 2), length, opening, slip (m), tractions (Pa), grains."""
        arrays = self.arrays
        chosen = np.flatnonzero(arrays.length > 0)
        start, end = arrays.place[:, arrays.node[:2, chosen]].transpose(1, 2, 0)
        rows = {name: getattr(arrays, name)[chosen] for name in ("length", "opening", "slip", "normal", "shear")}
        position = start + arrays.frame[2, chosen, None] * (end - start)
        return {"position": position, "tangent": arrays.frame[:2, chosen].T, **rows, "grains": self.grains[chosen]}

    def deepest(self) -> str:
        """The contact that overlaps most, over what is allowed, in words."""
        arrays = self.arrays
        c = int(np.argmax(arrays.depth / arrays.limit))
        (a, b), place = self.grains[c], arrays.place[:, arrays.node[0, c]]
        return (
            f"grains {a} and {b} overlap by {arrays.depth[c]:.4g} m near ({place[0]:.4g}, {place[1]:.4g}) m, more "
            f"than the {arrays.limit[c]:.4g} m allowed (largest_overlap = {self.detection.largest_overlap:g} of the "
            "smaller grain's width, at most the skin): give contacts a higher normal stiffness, load more slowly, or "
            "allow more with Detection(largest_overlap=..., skin=...)"
        )

    def copy(self) -> Touches:
        """The same with arrays of its own."""
        twin = copy.copy(self)
        rows: list[Any] = [np.copy(row) if np.ndim(row) else row for row in self.arrays]
        twin.arrays = touch.Touching(*rows)
        twin.exposed, twin.gone = self.exposed.copy(), self.gone.copy()
        return twin

    # --- the search ---------------------------------------------------------------------------------------------------

    def update(self, displacement: np.ndarray, before: np.ndarray) -> None:
        """Search neighbours at a displacement (2, i); contacts keep their state.

        ``before`` is the displacement a step ago.
        """
        clock, known, last_way = time.perf_counter(), self.arrays.touched, self.arrays.way
        pairs, keys = self._near(displacement)
        found = compiled(search.matches)(keys, self.keys)
        lost = np.ones(len(self.keys), dtype=bool)
        lost[found[found >= 0]] = False
        self.gone += self.arrays.work[:, lost].sum(axis=1)
        carried = self._carried(found)
        a, b = pairs.T
        nodes = np.ascontiguousarray(np.concatenate([self.edges[a], self.edges[b]], axis=1).T)
        touched, node = compiled(search.in_use)(nodes, self.origin.shape[1])
        seen, origin = displacement.take(touched, axis=1), self.origin.take(touched, axis=1)
        way = seen - before.take(touched, axis=1)
        _, now, then = np.intersect1d(touched, known, assume_unique=True, return_indices=True)
        way[:, now] = last_way[:, then]  # the same to the last digit, however often neighbours are searched
        groups, grain, mass = self.groups_of(keys), self.edge_grain, self.edge_mass
        self.arrays = self._empty(0)._replace(
            **carried, node=node, acute=np.stack([*self._acute[:, a], *self._acute[:, b]]), ease=self._ease[groups],
            limit=np.minimum(self.limits[grain[a]], self.limits[grain[b]]),
            dashpot=2 * self.detection.damping * np.sqrt(mass[a] * mass[b] / (mass[a] + mass[b])),
            touched=touched, origin=origin, place=origin + seen, seen=seen, way=way,
            active=np.zeros(len(keys), dtype=np.int64), before=before.copy(), built=displacement.copy(),
        )  # fmt: skip
        new = np.flatnonzero(found < 0)
        self.arrays.offset[new] = np.inf
        self.arrays.memory[:, new] = self.arrays.fresh[:, groups[new]]
        self.keys, self.pairs = keys, pairs
        self._bounds = np.searchsorted(groups, np.arange(len(self.groups) + 1))
        self.searches += 1
        self.seconds += time.perf_counter() - clock

    def _carried(self, found: np.ndarray) -> dict[str, Any]:
        """State of contacts that were in these places; what was is let go field by field, as it is much."""
        count, rows = len(self.keys), self.arrays._asdict()
        self.arrays = self._empty(0)
        result: dict[str, Any] = {}
        for name in CARRIED:
            old = rows.pop(name)
            result[name] = compiled(touch.carry)(old.reshape(math.prod(old.shape[:-1]), count), found)
            result[name] = result[name].reshape(*old.shape[:-1], len(found))
        return result

    def _near(self, displacement: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pairs of exposed edges nearer than the skin, and their keys, ascending: by law, edge a, edge b."""
        chosen = np.flatnonzero(self.exposed)
        place = self.origin + displacement
        (x0, x1), (y0, y1) = (row[self.edges[chosen].T].copy() for row in place)
        with np.errstate(invalid="ignore", over="ignore"):
            sound = np.hypot(x1 - x0, y1 - y0) < TORN * self._lengths[chosen]
        if not sound.all():
            return self.pairs, self.keys  # the check of the energies tells where it went wrong
        turn = self._turn[chosen]
        found = compiled(search.near_pairs)(x0, y0, x1, y1, self.edge_grain[chosen], turn, self.skin, self.cell)
        a, b = chosen[found].T.reshape(2, -1)
        size = len(self.edges)
        keys = np.sort(np.concatenate([self.key(a, b), self.keys[(self.arrays.length > 0) | (self.lifts > 0)]]))
        keys = keys[np.diff(keys, prepend=-1) > 0]
        return np.column_stack([keys // size % size, keys % size]), keys

    def _empty(self, count: int) -> touch.Touching:
        depth = max((len(group.broken) for group in self.groups), default=1)
        fresh = np.zeros((depth, max(len(self.groups), 1)))
        for g, group in enumerate(self.groups):
            fresh[: len(group.broken), g] = group.broken
        none, reach = no_touching(count), REACH * self.skin
        return none._replace(memory=np.zeros((depth, count)), fresh=fresh, skin=self.skin, reach=reach)

    @property
    def table(self) -> np.ndarray:
        """(g, 5) for the loop: where each law and its parameters are, its first contact, the next law's, its lift."""
        laws = [(group.compiled.address, group.compiled.numbers.ctypes.data) for group in self.groups]
        lifts = np.array([group.lift for group in self.groups], dtype=np.int64)
        rows = np.array(laws, dtype=np.int64).reshape(-1, 2)
        return np.column_stack([rows, self._bounds[:-1], self._bounds[1:], lifts])

    def key(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """(c,) what contacts of edges a and b are sorted by: law, edge a, edge b."""
        size = len(self.edges)
        return (self._group[self._phase[a], self._phase[b]] * size + a) * size + b

    def groups_of(self, keys: np.ndarray) -> np.ndarray:
        """(c,) number of the law of each key."""
        return keys // len(self.edges) ** 2
