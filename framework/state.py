"""The state of a running specimen: the arrays of the engine, and what may be read from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property

import attrs
import numpy as np

from grainlaw.contact import ContactLaw, memory_names
from grainlaw.integration import Motion
from grainlaw.kernels import loop
from grainlaw.kernels.batch import Compiled, compile_law
from grainlaw.loading import Drive
from grainlaw.parameter import ParameterError
from grainlaw.specimen import Specimen
from grainlaw.stability import shape_functions

Saved = tuple[list[np.ndarray], int, float, int, float]
Laws = ContactLaw | Mapping[tuple[int, int], ContactLaw]  #: one law, or one for each pair of phases


@attrs.frozen(eq=False)
class Group:
    """Interfaces ``first`` to ``last`` (in the engine's order) that follow one law."""

    law: ContactLaw
    compiled: Compiled
    first: int
    last: int
    memory: np.ndarray  #: (m, 2 (last - first)): first points, then second points


def _group_interfaces(specimen: Specimen, laws: Laws) -> tuple[np.ndarray, list[tuple[ContactLaw, int]]]:
    """Order of the interfaces in which each law's are contiguous, and the laws with their numbers of interfaces."""
    count = len(specimen.mesh.interfaces)
    if isinstance(laws, ContactLaw):
        return np.arange(count), [(laws, count)]
    if not isinstance(laws, Mapping) or not all(isinstance(law, ContactLaw) for law in laws.values()):
        raise ParameterError(f"law = {laws!r} is not allowed, it must be a ContactLaw or a mapping of phase pairs to laws")
    number = {tuple(sorted(pair)): k for k, pair in enumerate(laws)}
    phases = np.sort(specimen.grains.phase[specimen.mesh.interface_grains], axis=1)
    pairs, place = np.unique(phases, axis=0, return_inverse=True)
    missing = [tuple(pair) for pair in pairs.tolist() if tuple(pair) not in number]
    if missing:
        raise ParameterError(f"law: no law is given for contacts between the phases {missing[0]}")
    which = np.array([number[tuple(pair)] for pair in pairs.tolist()])[place.ravel()]
    sizes = np.bincount(which, minlength=len(number))
    return np.argsort(which, kind="stable"), list(zip(laws.values(), sizes.tolist(), strict=True))


def _split(total: int, weights_end: np.ndarray, threads: int) -> np.ndarray:
    """Grain numbers at which ``threads`` shares of about equal weight begin and end."""
    cuts = np.searchsorted(weights_end, np.arange(1, threads) * weights_end[-1] / threads)
    return np.array([0, *cuts, total])


class State:
    """Everything that changes while a specimen is loaded. Observers and protocols read it; only the engine writes.

    Index letters as in :class:`~grainlaw.mesh.Mesh`, and ``p`` for contact points: the first points of all
    interfaces, then the second.
    """

    def __init__(self, specimen: Specimen, laws: Laws) -> None:
        self.specimen, self.mesh = specimen, specimen.mesh
        self.time, self.steps, self.stage = 0.0, 0, ""
        self.time_step, self.mass_added = 0.0, 0.0
        self.initial_energy = 0.0  #: J, kinetic, given at the start of stages
        self.halted_energy = 0.0  #: J, taken out by halts
        self.adopted_work = 0.0  #: J, work of drives of earlier stages
        self._zone_state: tuple[int, np.ndarray, np.ndarray] | None = None
        self.order, groups = _group_interfaces(specimen, laws)
        self._make_mesh()
        self._make_contacts()
        self._make_groups(groups)
        self._make_freedoms()
        self.drive([])
        self.broken_time = np.full(self.contacts.opening.shape[1], np.nan)  #: (p,) s, nan where unbroken
        self.broken_mode = self.broken_time.copy()  #: (p,) share of shear at breaking

    # --- arrays ------------------------------------------------------------------------------------------------------

    def _make_mesh(self) -> None:
        mesh, count = self.mesh, len(self.mesh.interfaces)
        size, zones = len(mesh.nodes), len(mesh.zones)
        slots = np.full((2, size), 4 * count, dtype=np.int32)
        ends = mesh.interfaces[self.order].T.ravel()  # place k of the force rows belongs to node ends[k]
        order = np.argsort(ends, kind="stable")
        nodes = ends[order]
        second = np.r_[False, nodes[1:] == nodes[:-1]]
        slots[second.astype(int), nodes] = order
        gradients = shape_functions(mesh.nodes, mesh.zones)
        self.arrays = loop.Mesh(
            displacement=np.zeros((2, size)),
            force=np.zeros((2, size)),
            slots=slots,
            corner=np.ascontiguousarray(mesh.zones.T, dtype=np.int32),
            shape=np.ascontiguousarray(gradients[[0, 1, 3, 4, 6]]),
            modulus=self.specimen.zone_constants,
            motion=np.zeros((4, zones)),
            pull=np.zeros((4, zones)),
        )

    def _make_contacts(self) -> None:
        mesh, count = self.mesh, len(self.mesh.interfaces)
        edges = mesh.interface_edges[self.order]
        lengths = np.hypot(*edges.T)
        self.contacts = loop.Contacts(
            node=np.ascontiguousarray(mesh.interfaces[self.order].T, dtype=np.int32),
            edge=np.ascontiguousarray(edges.T),
            half=lengths / 2,
            weight=self.specimen.contact_points.weights(lengths),
            gap=np.zeros((6, count)),
            frame=np.zeros((3, count)),
            opening=np.zeros((2, 2 * count)),
            slip=np.zeros((2, 2 * count)),
            normal=np.zeros((2, 2 * count)),
            shear=np.zeros((2, 2 * count)),
            memory=np.zeros((0, 0)),
            work=np.zeros((2, 2 * count)),
            force=np.zeros((2, 4 * count + 1)),
        )

    def _make_groups(self, laws: Sequence[tuple[ContactLaw, int]]) -> None:
        count = len(self.mesh.interfaces)
        self.groups: list[Group] = []
        rows, first = [], 0
        for law, size in laws:
            compiled = compile_law(law, 2 * size)
            last, memory = first + size, np.zeros((len(compiled.memory) or 1, 2 * size))
            self.groups.append(Group(law, compiled, first, last, memory))
            for begin in (first, count + first):  # the first points of the group, then the second
                base = begin if begin == first else begin - size
                rows.append((
                    compiled.address, compiled.numbers.ctypes.data, compiled.rows.ctypes.data, compiled.rows.shape[1],
                    memory.ctypes.data, memory.shape[1], begin, begin + size, base,
                ))  # fmt: skip
            first = last
        self.table = np.array(rows, dtype=np.int64).reshape(-1, 9)

    def _make_freedoms(self) -> None:
        specimen, mesh = self.specimen, self.mesh
        nodes = specimen.node_masses
        grains = len(mesh.first_node) - 1
        centroid = specimen.grains.centroids[mesh.node_grain]
        arm = mesh.nodes - centroid
        if specimen.is_rigid:
            mass = np.bincount(mesh.node_grain, nodes, grains)
            inertia = self._inertia()
            masses = np.stack([mass, mass, inertia])
            force, displacement = np.zeros((3, grains)), np.zeros((3, grains))
        else:
            masses = np.stack([nodes, nodes])
            force, displacement = self.arrays.force, self.arrays.displacement
        shape = masses.shape
        self.freedoms = loop.Freedoms(
            force, np.zeros(shape), displacement, masses, np.ones(shape), np.zeros(shape), np.zeros(shape)
        )
        self.rigid = loop.Rigid(grains if specimen.is_rigid else 0, mesh.first_node, np.ascontiguousarray(arm.T))

    def _inertia(self) -> np.ndarray:
        """(g,) kg m2 about the centroid: exact for a polygon, from the triangles of its fan."""
        mesh = self.mesh
        a, b, c = (mesh.nodes[mesh.zones[:, k]] - self.specimen.grains.centroids[mesh.zone_grain] for k in range(3))
        squares = sum((p * q).sum(axis=1) for p, q in ((a, a), (b, b), (c, c), (a, b), (b, c), (c, a)))
        return np.bincount(mesh.zone_grain, self.specimen.zone_masses * squares / 6, len(mesh.first_node) - 1)

    # --- boundary conditions ---------------------------------------------------------------------------------------

    def drive(self, drives: Sequence[Drive]) -> None:
        """Impose velocities on boundaries from now on; work done so far is kept."""
        if hasattr(self, "driven"):
            self.adopted_work += float(self.driven.work.sum())
        freedoms, rigid = self.freedoms, self.rigid.count > 0
        held: dict[tuple[int, int], int] = {}
        for column, drive in enumerate(drives):
            if drive.boundary not in self.mesh.boundaries:
                names = ", ".join(sorted(self.mesh.boundaries))
                raise ParameterError(f"Drive: boundary = {drive.boundary!r} is not one of the specimen's: {names}")
            nodes = self.mesh.boundaries[drive.boundary]
            places = np.unique(self.mesh.node_grain[nodes]) if rigid else nodes
            held.update({(drive.axis, int(place)): column for place in places})
            if rigid:  # a platen that lies against a grain's edge keeps it from turning
                held.update({(2, int(place)): len(drives) for place in places})
        rows = sorted(held, key=lambda place: (place[1], place[0]))
        row, index = np.array(rows, dtype=np.int64).reshape(-1, 2).T.copy()
        column = np.array([held[key] for key in rows], dtype=np.int64)
        self.drives = list(drives)
        zero = [np.zeros(len(rows)) for _ in range(3)]
        self.driven = loop.Driven(row, index, column, *zero)
        freedoms.free[:] = 1.0
        freedoms.imposed[:] = 0.0
        freedoms.free[row, index] = 0.0
        self._start = {name: self._mean_displacement(name) for name in self.mesh.boundaries}
        self._samples = 0

    def share_out(self, threads: int) -> loop.Parts:
        """Which grains, interfaces and driven freedoms each thread works on."""
        mesh = self.mesh
        grain = _split(len(mesh.first_node) - 1, mesh.first_node[1:], threads)
        node = mesh.first_node[grain]
        freedom = grain if self.rigid.count else node
        return loop.Parts(
            zone=mesh.first_zone[grain],
            node=node,
            interface=np.arange(threads + 1) * len(mesh.interfaces) // threads,
            freedom=freedom,
            driven=np.searchsorted(self.driven.index, freedom),
            grain=grain,
        )

    # --- what may be read ------------------------------------------------------------------------------------------

    @property
    def displacement(self) -> np.ndarray:
        """(i, 2) m."""
        return self.arrays.displacement.T

    @property
    def positions(self) -> np.ndarray:
        """(i, 2) m."""
        return self.mesh.nodes + self.displacement

    @property
    def velocity(self) -> np.ndarray:
        """(i, 2) m/s."""
        rows = self.freedoms.velocity
        if not self.rigid.count:
            return rows.T
        grain = self.mesh.node_grain
        arm = self.positions - (self.specimen.grains.centroids + self.freedoms.displacement[:2].T)[grain]
        spin = rows[2, grain]
        return np.stack([rows[0, grain] - spin * arm[:, 1], rows[1, grain] + spin * arm[:, 0]], axis=1)

    @property
    def _now(self) -> int:
        return (self.steps + 1) % 2  # the row of the step done last

    @property
    def opening(self) -> np.ndarray:
        """(p,) m."""
        return self.contacts.opening[self._now]

    @property
    def slip(self) -> np.ndarray:
        """(p,) m."""
        return self.contacts.slip[self._now]

    @property
    def normal(self) -> np.ndarray:
        """(p,) Pa, tension positive."""
        return self.contacts.normal[self._now]

    @property
    def shear(self) -> np.ndarray:
        """(p,) Pa."""
        return self.contacts.shear[self._now]

    def memory(self, name: str) -> np.ndarray:
        """(p,) of one name of the laws' memory; zero where a law has no such memory."""
        count = len(self.mesh.interfaces)
        values = np.zeros(2 * count)
        for group in self.groups:
            names = memory_names(group.law)
            if name in names:
                row, size = group.memory[names.index(name)], group.last - group.first
                values[group.first : group.last] = row[:size]
                values[count + group.first : count + group.last] = row[size:]
        return values

    @cached_property
    def contact_lengths(self) -> np.ndarray:
        """(p,) m: half an interface each."""
        return np.tile(self.contacts.half, 2)

    @property
    def contact_positions(self) -> np.ndarray:
        """(p, 2) m: of the middle of each point's half of its interface, on the deformed specimen."""
        place = self.positions
        ends = place[self.mesh.interfaces[self.order]]
        first, second = (ends[:, 0] + ends[:, 2]) / 2, (ends[:, 1] + ends[:, 3]) / 2
        return np.concatenate([0.75 * first + 0.25 * second, 0.25 * first + 0.75 * second])

    @property
    def mode(self) -> np.ndarray:
        """(p,) share of shear in the damage: the law's own, or from the work done in opening and in slip."""
        work = np.maximum(self.contacts.work, 0)
        shares = work[1] / np.maximum(work.sum(axis=0), 1e-300)
        count = len(self.mesh.interfaces)
        for group in self.groups:
            names = memory_names(group.law)
            if "mode" in names:
                row, size = group.memory[names.index("mode")], group.last - group.first
                shares[group.first : group.last] = row[:size]
                shares[count + group.first : count + group.last] = row[size:]
        return shares

    def zone_state(self) -> tuple[np.ndarray, np.ndarray]:
        """Stress (z, 3) Pa as xx, yy, xy in the fixed axes, and strain energy density (z,) J/m3.

        Of the moment of the last forces, like the tractions: nodes have moved on by one step since.
        """
        if self._zone_state is None or self._zone_state[0] != self.steps:
            self._zone_state = self.steps, *loop.zone_state(self.arrays, self._displacement_at_forces())
        return self._zone_state[1:]

    def _displacement_at_forces(self) -> np.ndarray:
        return self.arrays.displacement - self.freedoms.velocity[:2] * self.time_step

    def grain_stress(self) -> np.ndarray:
        """(g, 3) Pa, xx, yy, xy: mean over zones, or of the forces on a rigid grain's rim (Love's formula)."""
        grains, of = self.specimen.grains, self.mesh.node_grain
        if self.rigid.count:
            x, y = (self.positions - (grains.centroids + self.freedoms.displacement[:2].T)[of]).T
            fx, fy = self.arrays.force + self._platen_forces()
            rows, of = (x * fx, y * fy, (x * fy + y * fx) / 2), of
        else:
            rows, of = tuple(self.zone_state()[0].T * self.mesh.zone_areas), self.mesh.zone_grain
        return np.stack([np.bincount(of, row, grains.count) for row in rows], axis=1) / grains.areas[:, None]

    def _platen_forces(self) -> np.ndarray:
        """(2, i) N on the nodes of rigid grains: a grain's reaction, spread evenly over its nodes on the boundary."""
        forces, grain = np.zeros_like(self.arrays.force), self.mesh.node_grain
        for column, drive in enumerate(self.drives):
            mine = self.driven.column == column
            reaction = np.bincount(self.driven.index[mine], self.driven.reaction[mine], self.rigid.count)
            nodes = self.mesh.boundaries[drive.boundary]
            share = np.bincount(grain[nodes], minlength=self.rigid.count)
            forces[drive.axis, nodes] += reaction[grain[nodes]] / share[grain[nodes]]
        return forces

    def reaction(self, boundary: str) -> np.ndarray:
        """(2,) N per metre: force of the drives of a boundary on the specimen, mean over the steps since the last sample."""
        result = np.zeros(2)
        for column, drive in enumerate(self.drives):
            if drive.boundary == boundary:
                result[drive.axis] = self.driven.total[self.driven.column == column].sum() / max(self._samples, 1)
        return result

    def _mean_displacement(self, boundary: str) -> np.ndarray:
        return self.displacement[self.mesh.boundaries[boundary]].mean(axis=0)

    def moved(self, boundary: str) -> np.ndarray:
        """(2,) m: mean displacement of a boundary, averaged over the steps since the last sample."""
        return (self._start[boundary] + self._mean_displacement(boundary)) / 2

    # --- for the engine ----------------------------------------------------------------------------------------------

    def give_velocity(self, velocity: np.ndarray | None) -> None:
        """Add a velocity field (i, 2) m/s, of which rigid grains take the mean and keep from turning."""
        if velocity is None:
            return
        before = self._kinetic_energy()
        rows = np.asarray(velocity, dtype=float).T
        if self.rigid.count:
            size = np.diff(self.mesh.first_node)
            rows = np.stack([np.bincount(self.mesh.node_grain, row) / size for row in rows])
        self.freedoms.velocity[:2] += rows
        self.initial_energy += self._kinetic_energy() - before

    def _kinetic_energy(self) -> float:
        return float(0.5 * np.sum(self.freedoms.mass * self.freedoms.velocity**2))

    def motion(self) -> Motion:
        """What an integrator may see between bursts: copies."""
        f = self.freedoms
        return Motion(f.velocity.copy(), f.displacement.copy(), f.force * f.free, f.mass)

    def stop(self) -> None:
        """Take the velocity of all free freedoms."""
        self.freedoms.velocity[self.freedoms.free > 0] = 0.0

    def start_from_rest(self, lost: np.ndarray) -> None:
        """Make the first step after ``stop`` one from rest, and book the energy of the velocity (r, n) that was lost.

        A step from rest gives half the velocity of a step from zero velocity half a step ago; without this, a halt
        would feed the fast modes.
        """
        f, dt = self.freedoms, self.time_step
        gained = f.velocity * f.free
        f.velocity[:] -= gained / 2
        f.displacement[:] -= gained / 2 * dt
        if self.rigid.count:
            self._place_nodes()
        lost = lost * f.free
        self.halted_energy += float(np.sum(f.mass * lost**2 / 2 + f.force * (lost / 2 + gained / 8) * dt))

    def _place_nodes(self) -> None:
        """Put the nodes of rigid grains where their grains are."""
        x, y, angle = self.freedoms.displacement[:, self.mesh.node_grain]
        arm_x, arm_y = self.rigid.arm
        self.arrays.displacement[0] = x + (np.cos(angle) - 1) * arm_x - np.sin(angle) * arm_y
        self.arrays.displacement[1] = y + np.sin(angle) * arm_x + (np.cos(angle) - 1) * arm_y

    def unbalanced(self) -> float:
        """Mean force out of balance over mean contact force: 0 at rest."""
        free = self.freedoms.free[:2] > 0
        contact = float(np.mean(np.hypot(self.normal, self.shear) * self.contact_lengths)) if len(self.order) else 0.0
        return float(np.mean(np.abs(self.freedoms.force[:2][free]))) / contact if contact > 0 else 1.0

    def closure_tangents(self) -> np.ndarray:
        """(p,) Pa/m: normal stiffness against a little more closure, tried without being committed."""
        little = 1e-3 * max(-float(self.opening.min(initial=0.0)), 1e-12)
        count = len(self.mesh.interfaces)
        tangents = np.empty(2 * count)
        for group in self.groups:
            places = np.r_[group.first : group.last, count + group.first : count + group.last]
            closed = np.minimum(self.opening[places], 0.0)
            slip = self.slip[places]
            now, _ = group.compiled.batch(closed, slip, group.memory.copy())
            more, _ = group.compiled.batch(closed - little, slip, group.memory.copy())
            tangents[places] = (now - more) / little
        return tangents

    def _mutable(self) -> list[np.ndarray]:
        freedoms, contacts, driven = self.freedoms, self.contacts, self.driven
        return [
            self.arrays.displacement, freedoms.velocity, freedoms.displacement, freedoms.loss, freedoms.imposed,
            contacts.opening, contacts.slip, contacts.normal, contacts.shear, contacts.work,
            driven.reaction, driven.total, driven.work, *(group.memory for group in self.groups),
        ]  # fmt: skip

    def save(self) -> Saved:
        """Copy what steps change."""
        return [array.copy() for array in self._mutable()], self.steps, self.time, self._samples, self.halted_energy

    def restore(self, saved: Saved) -> None:
        """Go back to where ``save`` was called."""
        self._zone_state = None
        arrays, self.steps, self.time, self._samples, self.halted_energy = saved
        for array, copy in zip(self._mutable(), arrays, strict=True):
            array[:] = copy

    # --- energy ------------------------------------------------------------------------------------------------------

    def energies(self) -> dict[str, float]:
        """The energy ledger (J per metre of thickness), Eq. (12), at the moment of the last forces.

        Velocities live half a step later, so that half a step of power is taken back from what they have gained.
        """
        f, driven = self.freedoms, self.driven
        power = float(np.sum(f.free * f.force * f.velocity))
        supplied = float(driven.reaction @ f.velocity[driven.row, driven.index])
        per_point = self.contact_lengths * self.contacts.work
        half = 0.5 * self.time_step
        return {
            "external": self.adopted_work + float(driven.work.sum()) + self.initial_energy - half * supplied,
            "kinetic": self._kinetic_energy() - half * power,
            "zones": 0.0 if self.rigid.count else float(self.zone_state()[1] @ self.mesh.zone_areas),
            "contacts_normal": float(per_point[0].sum()),
            "contacts_shear": float(per_point[1].sum()),
            "damping": float(f.loss.sum()) + self.halted_energy,
        }

    def new_sample(self) -> None:
        """Begin a new interval of means."""
        self.driven.total[:] = 0.0
        self._samples = 0
        self._start = {name: self._mean_displacement(name) for name in self.mesh.boundaries}

    def count_steps(self, steps: int) -> None:
        """Book steps that the engine has done."""
        self.steps += steps
        self._samples += steps
        self.time += steps * self.time_step

    def note_breaks(self) -> None:
        """Remember when and how contact points broke, to within one sample."""
        fresh = np.isnan(self.broken_time) & (self.memory("damage") >= 1)
        self.broken_time[fresh] = self.time
        self.broken_mode[fresh] = self.mode[fresh]
