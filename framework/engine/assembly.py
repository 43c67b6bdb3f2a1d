"""The arrays of the engine, made from a specimen and its laws."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import attrs
import numpy as np

from grainlaw.compiler.batch import Compiled, compile_law
from grainlaw.compiler.calls import ALWAYS, LANES, NEVER
from grainlaw.contact import ContactLaw, Laws, check_laws
from grainlaw.detection import Detection
from grainlaw.engine import step as loop
from grainlaw.engine.stability import shape_functions
from grainlaw.engine.touching import Touches
from grainlaw.parameter import ParameterError
from grainlaw.specimen import Specimen
from grainlaw.stage import Drive, Hold, Pressure

LITTLE = 2.0 ** np.arange(-100, 0, 10)  #: m: some are small for any law, and none is too small for rounding


@attrs.frozen(eq=False)
class Group:
    """Interfaces ``first`` to ``last`` (in the engine's order) that follow one law."""

    law: ContactLaw
    compiled: Compiled
    first: int
    last: int
    memory: np.ndarray  #: (m, 2 (last - first)): first points, then second points

    @property
    def size(self) -> int:
        """Number of interfaces."""
        return self.last - self.first

    @cached_property
    def cohesive(self) -> np.ndarray:
        """(2, size) whether a fresh point resists opening, or slip under no pressure."""
        fresh = np.zeros_like(self.memory)
        return (_resists(self.compiled, fresh, 0) | _resists(self.compiled, fresh, 1)).reshape(2, -1)

    def row(self, name: str) -> np.ndarray | None:
        """(2, size) of one name of the law's memory, or None."""
        names = self.compiled.memory
        return self.memory[names.index(name)].reshape(2, -1) if name in names else None


def group_interfaces(specimen: Specimen, laws: Laws) -> tuple[np.ndarray, list[tuple[ContactLaw, int]]]:
    """Order of the interfaces in which each law's are contiguous, and the laws with their numbers of interfaces.

    Raises :class:`ParameterError` for what is not a law, and for a pair of phases without one.
    """
    check_laws("law", laws)
    count = len(specimen.mesh.interfaces)
    if isinstance(laws, ContactLaw):
        return np.arange(count), [(laws, count)]
    number = {tuple(sorted(pair)): k for k, pair in enumerate(laws)}
    phases = np.sort(specimen.grains.phase[specimen.mesh.interface_grains], axis=1)
    pairs, place = np.unique(phases, axis=0, return_inverse=True)
    missing = [tuple(pair) for pair in pairs.tolist() if tuple(pair) not in number]
    if missing:
        raise ParameterError(f"law: no law is given for contacts between the phases {missing[0]}")
    which = np.array([number[tuple(pair)] for pair in pairs.tolist()], dtype=int)[place.ravel()]
    sizes = np.bincount(which, minlength=len(number))
    return np.argsort(which, kind="stable"), list(zip(laws.values(), sizes.tolist(), strict=True))


def mesh_arrays(specimen: Specimen, order: np.ndarray) -> loop.Mesh:
    """Nodes and zones; ``order`` is that of the interfaces."""
    mesh, count = specimen.mesh, len(order)
    size, zones = len(mesh.nodes), len(mesh.zones)
    slots = np.full((2, size), 4 * count, dtype=np.int32)
    ends = mesh.interfaces[order].T.ravel()  # place k of the force rows belongs to node ends[k]
    by_node = np.argsort(ends, kind="stable")
    nodes = ends[by_node]
    second = np.r_[False, nodes[1:] == nodes[:-1]][: len(nodes)]
    slots[second.astype(int), nodes] = by_node
    gradients = shape_functions(mesh.nodes, mesh.zones)
    return loop.Mesh(
        displacement=np.zeros((2, size)),
        force=np.zeros((2, size)),
        slots=slots,
        corner=np.ascontiguousarray(mesh.zones.T, dtype=np.int32),
        shape=np.ascontiguousarray(gradients[[0, 1, 3, 4, 6]]),
        modulus=specimen.zone_constants,
        motion=np.zeros((4, zones)),
        pull=np.zeros((4, zones)),
    )


def contact_arrays(specimen: Specimen, order: np.ndarray, detection: Detection | None) -> loop.Contacts:
    """Interfaces, undeformed and without load."""
    mesh, count = specimen.mesh, len(order)
    edges = mesh.interface_edges[order]
    lengths = np.hypot(*edges.T)
    return loop.Contacts(
        node=np.ascontiguousarray(mesh.interfaces[order].T, dtype=np.int32),
        edge=np.ascontiguousarray(edges.T),
        half=lengths / 2,
        weight=specimen.contact_points.weights(lengths),
        reach=np.full(count, np.inf if detection is None else detection.hand_over**2) * lengths**2,
        leaving=np.zeros(count),
        gap=np.zeros((6, count)),
        frame=np.zeros((3, count)),
        opening=np.zeros((2, 2 * count)),
        slip=np.zeros((2, 2 * count)),
        normal=np.zeros((2, 2 * count)),
        shear=np.zeros((2, 2 * count)),
        work=np.zeros((2, 2 * count)),
        force=np.zeros((2, 4 * count + 1)),
    )


def _resists(law: Compiled, memory: np.ndarray, mode: int) -> np.ndarray:
    """(p,) whether points with a ``memory`` (m, p) resist a little opening (``mode`` 0) or slip (1)."""
    held = np.zeros(memory.shape[1], dtype=bool)
    for little in LITTLE:
        opening, slip = np.zeros((2, memory.shape[1]))
        (opening, slip)[mode][:] = little
        held |= law.batch(opening, slip, memory.copy())[mode] > 0
    return held


def law_groups(laws: Sequence[tuple[ContactLaw, int]], count: int) -> tuple[list[Group], np.ndarray]:
    """Compiled laws with their memory, and the table by which the loop calls them for ``count`` interfaces."""
    groups, rows, first = [], [], 0
    for law, size in laws:
        compiled = compile_law(law, 2 * size)
        memory = np.zeros((len(compiled.memory) or 1, 2 * size))
        names, bonded = compiled.memory, bool(_resists(compiled, memory, 0).any())
        damage = names.index("damage") if "damage" in names else NEVER
        groups.append(Group(law, compiled, first, first + size, memory))
        for begin, base in ((first, first), (count + first, count + first - size)):  # first points, second points
            rows.append((
                compiled.address, compiled.numbers.ctypes.data, compiled.rows.ctypes.data, compiled.rows.shape[1],
                memory.ctypes.data, memory.shape[1], begin, begin + size, base, damage if bonded else ALWAYS,
            ))  # fmt: skip
        first += size
    return groups, np.array(rows, dtype=np.int64).reshape(-1, 10)


def freedom_arrays(specimen: Specimen, mesh: loop.Mesh) -> tuple[loop.Freedoms, loop.Rigid]:
    """What is integrated: node components, or translations and rotations of rigid grains."""
    geometry, nodes = specimen.mesh, specimen.node_masses
    grains = specimen.grains.count
    if specimen.is_rigid:
        mass = np.bincount(geometry.node_grain, nodes, grains)
        masses = np.stack([mass, mass, _inertia(specimen)])
        force, displacement = np.zeros((3, grains)), np.zeros((3, grains))
    else:
        masses = np.stack([nodes, nodes])
        force, displacement = mesh.force, mesh.displacement
    shape = masses.shape
    arm = geometry.nodes - specimen.grains.centroids[geometry.node_grain]
    rigid = loop.Rigid(grains if specimen.is_rigid else 0, geometry.first_node, np.ascontiguousarray(arm.T))
    freedoms = loop.Freedoms(
        force, np.zeros(shape), displacement, masses, *(np.full(shape, value) for value in (1.0, 0.0, 0.0, 0.0))
    )
    return freedoms, rigid


def _inertia(specimen: Specimen) -> np.ndarray:
    """(g,) kg m2 about the centroid: exact for a polygon, from the triangles of its fan."""
    mesh = specimen.mesh
    a, b, c = (mesh.nodes[mesh.zones[:, k]] - specimen.grains.centroids[mesh.zone_grain] for k in range(3))
    squares = sum((p * q).sum(axis=1) for p, q in ((a, a), (b, b), (c, c), (a, b), (b, c), (c, a)))
    return np.bincount(mesh.zone_grain, specimen.zone_masses * squares / 6, specimen.grains.count)


def _cuts(firsts: Sequence[int], count: int, threads: int) -> np.ndarray:
    """(threads + 1,) where the threads' interfaces begin: whole ``LANES`` from the first of a group."""
    cuts = []
    for thread in range(threads):
        cut = thread * count // threads
        first = max((first for first in firsts if first <= cut), default=0)
        cuts.append(first + (cut - first) // LANES * LANES)
    return np.array([*cuts, count])


def check_boundaries(specimen: Specimen, imposed: Sequence[Drive | Hold | Pressure]) -> None:
    """Raise :class:`ParameterError` for something imposed on a boundary that the specimen does not have."""
    for one in imposed:
        if one.boundary not in specimen.mesh.boundaries:
            names = ", ".join(sorted(specimen.mesh.boundaries))
            raise ParameterError(
                f"{type(one).__name__}: boundary = {one.boundary!r} is not one of the specimen's: {names}"
            )


def driven_arrays(specimen: Specimen, drives: Sequence[Drive | Hold], fixed: Sequence[int]) -> loop.Driven:
    """Freedoms on driven boundaries and of ``fixed`` grains; the latter follow the column after those of the drives."""
    mesh, still = specimen.mesh, len(drives)
    held: dict[tuple[int, int], int] = {}
    for column, drive in enumerate(drives):
        roller = isinstance(drive, Drive) and drive.roller
        nodes = mesh.middle(drive.boundary) if roller else mesh.boundaries[drive.boundary]
        places = np.unique(mesh.node_grain[nodes]) if specimen.is_rigid else nodes
        if specimen.is_rigid:
            _check_one_way(drives, column, [(held.get((drive.axis, place)), place) for place in places.tolist()])
        held.update({(drive.axis, place): column for place in places.tolist()})
        if specimen.is_rigid and not roller:  # a platen that lies against a grain's edge keeps it from turning
            held.update({(2, place): still for place in places.tolist()})
    specimen.check_grain_numbers("Stage: fixed", fixed)
    places = np.asarray(fixed, dtype=int)
    if not specimen.is_rigid:
        places = np.flatnonzero(np.isin(mesh.node_grain, places))
    held.update({(row, place): still for place in places.tolist() for row in range(3 if specimen.is_rigid else 2)})
    rows = sorted(held, key=lambda place: (place[1], place[0]))
    row, index = np.array(rows, dtype=np.int64).reshape(-1, 2).T.copy()
    columns = np.array([held[key] for key in rows], dtype=np.int64)
    return loop.Driven(row, index, columns, *np.zeros((3, len(rows))))


def _check_one_way(drives: Sequence[Drive | Hold], column: int, before: Sequence[tuple[int | None, int]]) -> None:
    """Raise :class:`ParameterError` where a rigid grain would have to move in two ways at once, and so strain."""
    drive = drives[column]
    for other, grain in before:
        if other is not None and attrs.evolve(drives[other], boundary=drive.boundary) != drive:
            raise ParameterError(
                f"{type(drive).__name__}: boundary = {drive.boundary!r} is not allowed, rigid grain {grain} lies on "
                f"{drives[other].boundary!r} too, which is moved along the same axis in another way"
            )


def held_arrays(
    specimen: Specimen, drives: Sequence[Drive | Hold], driven: loop.Driven, freedoms: loop.Freedoms
) -> loop.Held:
    """Platens, each with the mass and the momentum of what it holds."""
    holds = [(column, drive) for column, drive in enumerate(drives) if isinstance(drive, Hold)]
    motion = np.zeros((1, 7, len(holds)))
    for k, (column, _) in enumerate(holds):
        mine = driven.column == column
        mass = freedoms.mass[driven.row[mine], driven.place[mine]]
        motion[0, 1, k] = np.average(freedoms.velocity[driven.row[mine], driven.place[mine]], weights=mass)
        motion[0, 3, k] = mass.sum()
    motion[0, 4] = 1.0
    lengths = specimen.mesh.boundary_lengths
    stiffness = np.array([drive.stiffness * lengths[drive.boundary] for _, drive in holds])
    return loop.Held(np.array([column for column, _ in holds], dtype=np.int64), stiffness, motion)


def pressed_arrays(
    specimen: Specimen, pressures: Sequence[Pressure], first_column: int, displacement: np.ndarray
) -> loop.Pressed:
    """Edges under pressure, grain by grain."""
    edges = [specimen.mesh.boundary_edges[pressure.boundary] for pressure in pressures]
    column = np.repeat(np.arange(len(edges)) + first_column, [len(e) for e in edges])
    node = np.concatenate([np.zeros((0, 2), dtype=np.int64), *edges])
    order = np.argsort(node[:, 0], kind="stable")
    node = np.ascontiguousarray(node[order].T)
    vector = np.diff(specimen.mesh.nodes[node], axis=0)[0].T.copy()
    moved = displacement[:, node].mean(axis=1)
    return loop.Pressed(column[order], node, vector, np.zeros_like(vector), moved, np.zeros(node.shape[1]))


def share_out(
    specimen: Specimen, groups: Sequence[Group], driven: loop.Driven, pressed: loop.Pressed, touches: Touches | None,
    threads: int,
) -> loop.Parts:  # fmt: skip
    """Which grains, contacts and driven freedoms each thread works on; grains by their number of nodes."""
    mesh = specimen.mesh
    ends = mesh.first_node[1:]
    cuts = np.searchsorted(ends, np.arange(1, threads) * ends[-1] / threads)
    grain = np.array([0, *cuts, specimen.grains.count])
    node = mesh.first_node[grain]
    freedom = grain if specimen.is_rigid else node
    contacts = 0 if touches is None else len(touches)
    touched = np.zeros(0) if touches is None else touches.arrays.touched
    return loop.Parts(
        zone=mesh.first_zone[grain],
        node=node,
        interface=_cuts([group.first for group in groups], len(mesh.interfaces), threads),
        freedom=freedom,
        driven=np.searchsorted(driven.place, freedom),
        pressed=np.searchsorted(pressed.node[0], node),
        grain=grain,
        touch=np.arange(threads + 1) * contacts // threads,
        touched=np.searchsorted(touched, node),
    )
