"""Fluids: a pressure on the faces of broken contact points that a boundary feeds, and on that boundary itself.

Of a fluid that is pumped in, pressures follow from its volume and from the room that it has, at every step: one, or
where it is viscous that of each contact point (:mod:`~grainlaw.engine.parts.flow`).

Index letters: ``c`` bond, ``p`` contact point, ``i`` node, ``f`` face: the half of a bond that belongs to a contact
point, on either grain, or an edge of the rim; ``v`` vertex of the flow: the room behind the boundary of an injection,
then contact points, then middles of bonds, then corners.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.engine.parts.bonds import Bonds
from grainlaw.engine.parts.flow import Network, network
from grainlaw.engine.parts.imposed import STILL, Imposed
from grainlaw.engine.parts.part import (
    Changing,
    Constant,
    Moment,
    PointForces,
    Split,
    check_names,
    check_places,
    check_row,
)
from grainlaw.loads import FluidPressure, Injection, enclosed_area
from grainlaw.mesh import Mesh
from grainlaw.polygon import linked
from grainlaw.specimen import Specimen

DRY = STILL
BEHIND = 0  #: vertex of what lies behind the boundary of an injection
VERTICES = ("room", "content", "pressure", "at_first")  #: what is of vertices
FLOW = 50  #: steps after which a fluid enters what has broken: a wave crosses a few grains meanwhile


class Connection:
    """The corners of grains, where each of the two points of a bond touches one, and what of it is connected.

    Nodes of different grains are one corner if ties or bonds join them, whether these are broken or not.
    """

    def __init__(self, mesh: Mesh, ends: np.ndarray) -> None:
        one, other = ends[:, :2].T.ravel(), ends[:, 2:].T.ravel()
        tied = mesh.ties[:, :2].T.ravel(), mesh.ties[:, 2:].T.ravel()
        both = np.concatenate([one, tied[0]]), np.concatenate([other, tied[1]])
        self.corner = linked(len(mesh.nodes), *both)  #: (i,) number of the corner at each node
        self.at = self.corner[one]  #: (p,) corner that each point touches

    def pieces(self, broken: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Number of the connected piece of each contact point (p,) and of the corner at each node (i,).

        Pieces connect through points that are ``broken`` (p,); one that is not is a piece by itself.
        """
        points = len(self.at)
        first, both = np.flatnonzero(broken), np.flatnonzero(broken.reshape(2, -1).all(axis=0))
        one = np.concatenate([first, both])
        other = np.concatenate([points + self.at[first], points // 2 + both])
        found = linked(points + int(self.corner.max(initial=-1)) + 1, one, other)
        return found[:points], found[points + self.corner]


class FluidArrays(NamedTuple):
    """Faces (f) that a fluid may wet, in the order of their first nodes; none before the first fluid is imposed."""

    column: Changing  #: (f,) of the schedule with the pressure; ``DRY`` without one
    node: Constant  #: (2, f) ends of the edge, the grain on the left
    edge_x: Constant  #: (f,) m, undeformed, from the first end to the second
    edge_y: Constant
    fraction: Constant  #: (f,) of the length of the edge that the face takes
    weight: Constant  #: (f,) share of the second end in the motion where the force acts
    profile: Changing  #: (f,) of the pressure of its fluid at its height, less above and more below
    force_x: Changing  #: (f,) N, of the last step
    force_y: Changing
    moved_x: Changing  #: (f,) m, displacement of where it acts at the last step
    moved_y: Changing
    work: Changing  #: (f,) J
    rate: Constant  #: (n,) column of the schedule with the rate of an injection, one or none
    bulk: Constant  #: (n,) Pa, bulk modulus of its fluid
    least: Constant  #: (n,) share of the room of points that is left however far they close
    vertex: Constant  #: (f,) whose pressure the face has, of faces of the injection
    network: Network  #: what the injection has wetted
    room: Changing  #: (v,) m2 before faces have moved; of points that of closed ones without stress
    content: Changing  #: (v,) m2 that the fluid there would fill without pressure; what has left, at a given pressure
    pressure: Changing  #: (v,) Pa
    normal_x: Changing  #: (f,) m, force of a unit of pressure at the last step, of faces of the injection
    normal_y: Changing
    swept: Changing  #: (f,) m2 by which faces of the injection have made room; half of a crack that it has entered
    share: Constant


class FluidBooks(NamedTuple):
    """What only Python needs."""

    fluid: Changing  #: (p,) number of the fluid of the present stage on the faces of each point, from 1; ``DRY``
    at_first: Changing  #: (v,) m2, content when the injection began


@njit(**OPTIONS)
def sweep(fluids, nodes, thread):
    """The room that a thread's faces of an injection have made by their motion, as work is counted, Eq. (11)."""
    ux, uy = nodes.displacement[0], nodes.displacement[1]
    for f in range(fluids.share[thread], fluids.share[thread + 1]):
        if fluids.column[f] == fluids.rate[0]:
            i, j, w = fluids.node[0, f], fluids.node[1, f], fluids.weight[f]
            across = -fluids.fraction[f] * (fluids.edge_y[f] + uy[j] - uy[i])
            along = fluids.fraction[f] * (fluids.edge_x[f] + ux[j] - ux[i])
            x, y = (1 - w) * ux[i] + w * ux[j], (1 - w) * uy[i] + w * uy[j]
            fluids.swept[f] += 0.5 * (
                (fluids.normal_x[f] + across) * (x - fluids.moved_x[f])
                + (fluids.normal_y[f] + along) * (y - fluids.moved_y[f])
            )
            fluids.normal_x[f], fluids.normal_y[f] = across, along


@njit(**OPTIONS)
def press_fluids(fluids, nodes, schedule, thread):
    """Add the forces of fluids on a thread's faces to its nodes, and their work by the trapezoidal rule, Eq. (11)."""
    ux, uy, nodal_x, nodal_y = nodes.displacement[0], nodes.displacement[1], nodes.force[0], nodes.force[1]
    first, second, edge_x, edge_y = fluids.node[0], fluids.node[1], fluids.edge_x, fluids.edge_y
    px, py, moved_x, moved_y = fluids.force_x, fluids.force_y, fluids.moved_x, fluids.moved_y
    for f in range(fluids.share[thread], fluids.share[thread + 1]):
        column = fluids.column[f]
        if column != DRY or px[f] != 0 or py[f] != 0:  # a face that has just dried has half a step of work to come
            i, j, w = first[f], second[f], fluids.weight[f]
            injected = fluids.rate.shape[0] > 0 and column == fluids.rate[0]
            # A dry face has the column of zeros.
            level = fluids.pressure[fluids.vertex[f]] if injected else schedule[column] * fluids.profile[f]
            p = fluids.fraction[f] * level
            force_x = -p * (edge_y[f] + uy[j] - uy[i])
            force_y = p * (edge_x[f] + ux[j] - ux[i])
            x, y = (1 - w) * ux[i] + w * ux[j], (1 - w) * uy[i] + w * uy[j]
            fluids.work[f] += 0.5 * ((px[f] + force_x) * (x - moved_x[f]) + (py[f] + force_y) * (y - moved_y[f]))
            px[f], py[f], moved_x[f], moved_y[f] = force_x, force_y, x, y
            nodal_x[i] += (1 - w) * force_x
            nodal_y[i] += (1 - w) * force_y
            nodal_x[j] += w * force_x
            nodal_y[j] += w * force_y


class Fluids(PointForces):
    """The fluids of the present stage, the faces that they wet, and the work of all since the run began."""

    takes = (FluidPressure, Injection)

    def __init__(self, specimen: Specimen, bonds: Bonds) -> None:
        self._specimen, self._mesh, self._bonds = specimen, specimen.mesh, bonds
        self.imposed: list[FluidPressure | Injection] = []
        self.injection: Injection | None = None
        self._columns = np.array([DRY])
        self._connection: Connection | None = None
        self._pieces: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
        self._lay(none=True)

    def _lay(self, none: bool) -> None:
        """Make the faces that a fluid may wet, all dry, or none; the order of ``self._face`` is that of the arrays."""
        mesh, (a1, a2, b1, b2) = self._mesh, self._bonds.ends.T
        far, count = self._bonds.arrays.weight, len(self._bonds)
        rim = np.concatenate([np.zeros((0, 2), dtype=np.int64), *mesh.boundary_edges.values()])
        half, whole = np.full(2 * count, 0.5), np.ones(len(rim))
        # On grain B the edge runs the other way: its second end is the first of the bond.
        pieces = [
            (np.tile([a1, a2], 2), half, np.concatenate([far, 1 - far])),
            (np.tile([b2, b1], 2), half, np.concatenate([1 - far, far])),
            (rim.T, whole, 0.5 * whole),
        ]
        node, fraction, weight = (np.concatenate(rows, axis=-1) for rows in zip(*pieces, strict=True))
        y = mesh.nodes[node, 1]
        self._height = (1 - weight) * y[0] + weight * y[1]  #: (f,) m, of faces in the order of points and rim
        self._face = np.zeros(0, dtype=np.int64) if none else np.argsort(node[0], kind="stable")
        node = np.ascontiguousarray(node[:, self._face])
        edge = (mesh.nodes[node[1]] - mesh.nodes[node[0]]).T
        names = ("force_x", "force_y", "moved_x", "moved_y", "work", "normal_x", "normal_y", "swept")
        changing = {name: np.zeros(len(self._face)) for name in names}
        changing |= {name: np.zeros(self._vertices(none)) for name in VERTICES[:-1]}
        empty = np.zeros(0, dtype=np.int64)
        self.arrays = FluidArrays(
            column=np.full(len(self._face), DRY), node=node, edge_x=edge[0].copy(), edge_y=edge[1].copy(),
            fraction=fraction[self._face], weight=weight[self._face],
            profile=np.ones(len(self._face)), **changing, rate=empty, bulk=np.zeros(0), least=np.zeros(0),
            vertex=np.zeros(len(self._face), dtype=np.int64),
            network=network(empty, empty, empty, np.zeros((2, 0), dtype=np.int64), np.zeros(0), {}),
            share=np.zeros(2, dtype=np.int64),
        )  # fmt: skip
        self.books = FluidBooks(np.zeros(2 * count, dtype=np.int64), np.zeros(self._vertices(none)))

    def _vertices(self, none: bool) -> int:
        """How many there are; one where no faces are laid."""
        return 1 if none else 1 + 3 * len(self._bonds) + 1 + int(self.connection.corner.max(initial=-1))

    @property
    def connection(self) -> Connection:
        """Found when it is asked for the first time."""
        self._connection = self._connection or Connection(self._mesh, self._bonds.ends)
        return self._connection

    def share(self, split: Split) -> np.ndarray:
        return np.searchsorted(self.arrays.node[0], split.node)

    def points(self, displacement: np.ndarray) -> np.ndarray:
        (i, j), w = self.arrays.node, self.arrays.weight
        return (1 - w) * displacement[:, i] + w * displacement[:, j]

    def end(self, displacement: np.ndarray) -> dict[str, float]:
        return {}  # a face that dries has half a step of work to come, and keeps it

    @property
    def forces(self) -> np.ndarray:
        """(f,) N on wet faces."""
        wet = self.arrays.column != DRY
        return np.hypot(self.arrays.force_x[wet], self.arrays.force_y[wet])

    def check_saved(self, saved: Mapping[str, np.ndarray]) -> None:
        """As of every part; faces may not have been laid yet, and columns are those of the schedule."""
        own = self.save()
        check_names(own, saved)
        faces, points = len(saved["column"]), 2 * len(self._bonds)
        sizes = {"fluid": points, **dict.fromkeys(VERTICES, self._vertices(none=not faces))}
        if faces not in (0, 2 * points + sum(map(len, self._mesh.boundary_edges.values()))):
            raise ValueError(f"column has {faces} faces, which is neither none nor all")
        for name, row in own.items():
            check_row(name, saved[name], row.dtype, (sizes.get(name, faces),))
        check_places("column", saved["column"], int(self._columns.max(initial=DRY)) + 1)
        check_places("fluid", saved["fluid"], len(self.imposed) + 1)

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        self._pieces = None
        if len(saved["column"]) != len(self.arrays.column):
            kept = {name: getattr(self.arrays, name) for name in ("rate", "bulk", "least")}
            self._lay(none=not len(saved["column"]))
            self.arrays = self.arrays._replace(**kept)
            self._take_vertices()
        super().restore(saved)
        self._follow_network()

    def begin(self, imposed: Imposed, at: Moment) -> None:
        before, was_pumped = self.injection, self._is_pumped
        self.imposed = imposed.of(FluidPressure, Injection)
        self.injection = next(iter(imposed.of(Injection)), None)
        self._columns = np.array([DRY, *map(imposed.column, self.imposed)])
        if self.imposed and not len(self.arrays.column):
            self._lay(none=False)
            was_pumped = self._is_pumped
        pumped = [] if self.injection is None else [self.injection]
        self.arrays = self.arrays._replace(
            rate=np.array([imposed.column(one) for one in pumped], dtype=np.int64),
            bulk=np.array([one.bulk_modulus for one in pumped]),
            least=np.array([one.residual_aperture / one.aperture if one.viscosity else 1.0 for one in pumped]),
        )
        self._take_vertices()
        fresh = self.injection is not None and not (before is not None and self.injection.goes_on(before))
        if self.injection is not None and fresh:
            was_pumped[:] = False
            self._fill(self.injection, at.at_forces)
        self._flow(0.0, at.at_forces, was_pumped)
        self._lay_network()
        if self.injection is not None and fresh:
            self._soak(self.injection)

    @property
    def _viscosity(self) -> float:
        """Pa s of the injection; 0 without one."""
        return self.injection.viscosity if self.injection else 0.0

    def _take_vertices(self) -> None:
        """Say whose pressure faces of an injection have: with viscosity each point its own, else all the same."""
        points = 2 * len(self._bonds)
        own = np.where(self._face < 2 * points, 1 + self._face % max(points, 1), BEHIND)
        self.arrays = self.arrays._replace(vertex=own if self._viscosity else np.full(len(own), BEHIND))

    def _fill(self, injection: Injection, displacement: np.ndarray) -> None:
        """Let the room behind a boundary be full of fluid, at the pressure with which the injection begins."""
        room = injection.volume
        if room is None:
            room = enclosed_area(self._mesh.nodes, self._mesh.boundary_edges[injection.boundary], displacement.T)
        a = self.arrays
        a.room[:] = a.content[:] = a.pressure[:] = 0.0
        a.room[BEHIND], a.pressure[BEHIND] = room, injection.pressure
        a.room[self._points] = injection.aperture * self._bonds.lengths
        a.content[BEHIND] = room * (1 + injection.pressure / injection.bulk_modulus)

    def _soak(self, injection: Injection) -> None:
        """Let the cracks be full too that a viscous fluid is in when it begins; what is broken later is empty."""
        a = self.arrays
        cells = a.network.vertex[a.network.cell]
        a.content[cells] = self.volumes[cells] * (1 + injection.pressure / injection.bulk_modulus)
        a.pressure[a.network.vertex] = injection.pressure
        self.books.at_first[:] = a.content

    def _follow_network(self) -> None:
        """Lay the network anew where the injection has wetted other faces."""
        if not np.array_equal(np.flatnonzero(self._is_pumped), self.arrays.network.face):
            self._lay_network()

    def _lay_network(self) -> None:
        """Lay the network of what an injection has wetted."""
        mine = np.flatnonzero(self._is_pumped)
        cells, ends, cube, columns = np.zeros(0, dtype=np.int64), np.zeros((2, 0), dtype=np.int64), np.zeros(0), {}
        if self.injection is not None and self._viscosity:
            count, nodes = len(self._bonds), self._mesh.boundaries
            corner = 1 + 3 * count + self.connection.corner
            given = [(corner[nodes[one.boundary]], self._columns[k]) for k, one in enumerate(self.imposed, 1)]
            columns = {vertex: column for some, column in given for vertex in some.tolist()}
            points = np.flatnonzero(self.books.fluid == 1 + self.imposed.index(self.injection))
            at = 1 + 3 * count + self.connection.at[points]
            at[np.isin(at, corner[nodes[self.injection.boundary]])] = BEHIND
            cells, ends = 1 + points, np.stack([at, 1 + 2 * count + points % count])
            cube = 1 / (6 * self._viscosity * self._bonds.lengths[points] ** 4)
        self.arrays = self.arrays._replace(network=network(mine, self.arrays.vertex[mine], cells, ends, cube, columns))

    @property
    def _points(self) -> slice:
        """The vertices that are contact points."""
        return slice(1, 1 + 2 * len(self._bonds))

    @property
    def _is_pumped(self) -> np.ndarray:
        """(f,) whether faces belong to the injection."""
        a = self.arrays
        return a.column == a.rate[0] if len(a.rate) else np.zeros(len(a.column), dtype=bool)

    @property
    def volumes(self) -> np.ndarray:
        """(v,) m2 that an injection has at every vertex."""
        a, mine = self.arrays, self._is_pumped
        found: np.ndarray = a.room + np.bincount(a.vertex[mine], a.swept[mine], len(a.room))
        found[1:] = np.maximum(found[1:], a.room[1:] * a.least) if len(a.least) else found[1:]
        return found

    @property
    def pressure(self) -> float:
        """Pa of an injection behind its boundary; 0 without one."""
        return float(self.arrays.pressure[BEHIND]) if self.injection else 0.0

    @property
    def pumped_in(self) -> float:
        """m2 without pressure that have been pumped in since the injection began; 0 without one."""
        return float((self.arrays.content - self.books.at_first).sum()) if self.injection else 0.0

    @property
    def in_cracks(self) -> float:
        """m2 without pressure of that which are in cracks; without viscosity they have a share by their room."""
        if self.injection is None:
            return 0.0
        if self._viscosity:
            return float((self.arrays.content - self.books.at_first)[self._points].sum())
        room, cracks = self.room
        return float(self.arrays.content[BEHIND]) * cracks / (room + cracks)

    @property
    def out(self) -> float:
        """m2 without pressure that have left an injection at boundaries with a pressure of their own."""
        return float(self.arrays.content[self._points.stop :].sum()) if self.injection else 0.0

    @property
    def room(self) -> tuple[float, float]:
        """m2 of the room behind the boundary and of cracks that an injection has; (0, 0) without one."""
        if self.injection is None:
            return 0.0, 0.0
        if self._viscosity:
            volumes, net = self.volumes, self.arrays.network
            return float(volumes[BEHIND]), float(volumes[net.vertex[net.cell]].sum())
        mine, of_rim = self._is_pumped, self._face >= 4 * len(self._bonds)
        swept = [float(self.arrays.swept[mine & chosen].sum()) for chosen in (of_rim, ~of_rim)]
        return float(self.arrays.room[BEHIND]) + swept[0], swept[1]

    def stiffness(self, masses: np.ndarray) -> float:
        """1/s2: by how much the compressed fluid raises the square of the highest frequency at most; masses (2, i) kg.

        The stiffness of each vertex is K/V a a^T, with its room V and the sums a of the normals of its faces at the
        nodes. Of what is behind the boundary this is found exactly, of cells by Gershgorin's theorem.
        """
        if self.injection is None:
            return 0.0
        a, mine = self.arrays, self._is_pumped
        (i, j), w, at, count = self._mesh.point[a.node[:, mine]], a.weight[mine], a.vertex[mine], masses.shape[1]
        normals = a.normal_x[mine], a.normal_y[mine]
        volumes = self.volumes
        if not self._viscosity:
            volumes[BEHIND] = sum(self.room)
        behind, some = at == BEHIND, np.unique(at)
        stiff = np.zeros(len(volumes))
        stiff[some] = (a.bulk[0] + a.pressure[some]) / volumes[some]
        lengths = np.bincount(at, np.abs(normals[0]) + np.abs(normals[1]), len(volumes))
        total, largest = 0.0, 0.0
        for normal, mass in zip(normals, masses, strict=True):
            own = np.where(behind, normal, 0.0)
            sums = np.bincount(i, (1 - w) * own, count) + np.bincount(j, w * own, count)
            total += float(np.sum(sums**2 / mass))
            rows = np.where(behind, 0.0, np.abs(normal) * (stiff * lengths)[at])
            sums = np.bincount(i, (1 - w) * rows, count) + np.bincount(j, w * rows, count)
            largest = max(largest, float(np.max(sums / mass)))
        return float(stiff[BEHIND]) * total + largest

    def follow(self, time: float, before: np.ndarray) -> None:
        """Let fluids enter what has broken, at a time (s) since the stage began.

        ``before`` (2, i) m is the displacement at the last forces.
        """
        if self.imposed:
            self._flow(time, before, self._is_pumped)
            self._follow_network()

    def at_points(self, time: float) -> np.ndarray:
        """(p,) Pa on the faces of contact points, at a time (s) since the stage began; 0 where dry."""
        fluid = self.books.fluid
        found = np.append(0.0, self._pressures(time))[fluid] * self._shares(fluid, self._height[: len(fluid)])
        if self.injection is not None and self._viscosity:
            mine = self.books.fluid == 1 + self.imposed.index(self.injection)
            found[mine] = self.arrays.pressure[self._points][mine]
        return found

    def _shares(self, fluid: np.ndarray, height: np.ndarray) -> np.ndarray:
        """(n,) of the pressure of the fluids (n,), by number, at heights (n,) m."""
        shares = np.ones(len(fluid))
        for k, one in enumerate(self.imposed, 1):
            if isinstance(one, FluidPressure) and one.water_table is not None:
                shares[fluid == k] = one.share(self._mesh, height[fluid == k])
        return shares

    def _pressures(self, time: float) -> np.ndarray:
        """(fluids,) Pa at a time (s) since the stage began."""
        return np.array([self.pressure if isinstance(one, Injection) else one.at(time) for one in self.imposed])

    def _flow(self, time: float, before: np.ndarray, was_pumped: np.ndarray) -> None:
        """Find which fluid wets which faces, and let the newly wet ones begin from where they are."""
        fluid = self._reached(time)
        self.books.fluid[:] = fluid
        number = np.concatenate([fluid, fluid, self._on_rim()])
        a, column = self.arrays, self._columns[number[self._face]]
        a.profile[:] = self._shares(number, self._height)[self._face]
        new = np.flatnonzero((a.column == DRY) & (column != DRY) & (a.force_x == 0) & (a.force_y == 0))
        a.moved_x[new], a.moved_y[new] = self.points(before)[:, new]
        a.column[:] = column
        fresh = self._is_pumped & ~was_pumped
        if fresh.any():
            self._enter(fresh, before)

    def _enter(self, fresh: np.ndarray, displacement: np.ndarray) -> None:
        """Let the fluid of an injection fill what cracks have opened, at faces (f,) that it has just reached."""
        a, bonds = self.arrays, self._bonds
        edge = np.stack([a.edge_x, a.edge_y]) + displacement[:, a.node[1]] - displacement[:, a.node[0]]
        a.normal_x[fresh], a.normal_y[fresh] = (a.fraction * [-edge[1], edge[0]])[:, fresh]
        gap = bonds.motion(displacement)[0]
        if not self._viscosity:  # of which closed points give their residual aperture, and count from where they meet
            gap = np.maximum(gap, 0.0)
        gap = gap * bonds.lengths / 2
        rim = len(self._face) - 2 * len(gap)
        a.swept[fresh] = np.concatenate([gap, gap, np.zeros(rim)])[self._face][fresh]

    def _on_rim(self) -> np.ndarray:
        """(e,) number of the fluid on each edge of the rim."""
        on = {one.boundary: k for k, one in enumerate(self.imposed, 1) if not one.cracks_only}
        edges = self._mesh.boundary_edges
        return np.repeat([on.get(name, DRY) for name in edges], [len(each) for each in edges.values()]).astype(int)

    def _reached(self, time: float) -> np.ndarray:
        """(p,) number of the fluid on each broken contact point; the highest pressure fills a crack that joins two."""
        fluid = np.zeros(2 * len(self._bonds), dtype=np.int64)
        if not self.imposed:
            return fluid
        broken, points, corners = self._connected()
        pressures = self._pressures(time)
        if self.injection is not None and self._viscosity:  # flows to where another pressure is given
            pressures[self.imposed.index(self.injection)] = np.inf
        for k in np.argsort(pressures, kind="stable").tolist():
            fed = np.isin(points, corners[self._mesh.boundaries[self.imposed[k].boundary]])
            fluid[broken & fed] = k + 1
        return fluid

    def _connected(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Whether points (p,) are broken, and the connected pieces of points (p,) and of the corners at nodes (i,)."""
        broken = self._bonds.broken(self.injection.entry_damage if self.injection else 1.0)
        if self._pieces is None or not np.array_equal(broken, self._pieces[0]):
            self._pieces = broken, *self.connection.pieces(broken)
        return self._pieces
