"""The state of a running specimen: the arrays of the engine, and what may be read from them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from grainlaw.assembly import (
    Laws,
    contact_arrays,
    freedom_arrays,
    group_interfaces,
    held_arrays,
    law_groups,
    mesh_arrays,
    pressed_arrays,
)  # fmt: skip
from grainlaw.integration import Motion
from grainlaw.kernels import loop
from grainlaw.loading import Drive, Hold, Pressure
from grainlaw.parameter import ParameterError
from grainlaw.specimen import Specimen

Saved = tuple[list[np.ndarray], int, float, int, float]


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
        self.order, sizes = group_interfaces(specimen, laws)
        self.arrays = mesh_arrays(specimen, self.order)
        self.contacts = contact_arrays(specimen, self.order)
        self.groups, self.table = law_groups(sizes, len(self.order))
        self.freedoms, self.rigid = freedom_arrays(specimen, self.arrays)
        self.driven = loop.Driven(*np.zeros((3, 0), dtype=np.int64), *np.zeros((3, 0)))
        self.pressed = pressed_arrays(specimen, [], 1, self.arrays.displacement)
        self.drive([])
        self.broken_time = np.full(self.contacts.opening.shape[1], np.nan)  #: (p,) s, nan where unbroken
        self.broken_mode = self.broken_time.copy()  #: (p,) share of shear at breaking
        self.broken_work = self.broken_time.copy()  #: (p,) J/m2 spent until the break

    # --- boundary conditions ---------------------------------------------------------------------------------------

    def drive(self, drives: Sequence[Drive | Hold], pressures: Sequence[Pressure] = ()) -> None:
        """Impose what a stage says on boundaries from now on; work done so far is kept."""
        self.adopted_work += float(self.driven.work.sum() + self.pressed.work.sum())
        for imposed in (*drives, *pressures):
            if imposed.boundary not in self.mesh.boundaries:
                names = ", ".join(sorted(self.mesh.boundaries))
                raise ParameterError(
                    f"{type(imposed).__name__}: boundary = {imposed.boundary!r} is not one of the specimen's: {names}"
                )
        freedoms, rigid = self.freedoms, self.rigid.grains > 0
        held: dict[tuple[int, int], int] = {}
        for column, drive in enumerate(drives):
            roller = isinstance(drive, Drive) and drive.roller
            nodes = self.mesh.middle(drive.boundary) if roller else self.mesh.boundaries[drive.boundary]
            places = np.unique(self.mesh.node_grain[nodes]) if rigid else nodes
            held.update({(drive.axis, int(place)): column for place in places})
            if rigid and not roller:  # a platen that lies against a grain's edge keeps it from turning
                held.update({(2, int(place)): len(drives) for place in places})
        rows = sorted(held, key=lambda place: (place[1], place[0]))
        row, index = np.array(rows, dtype=np.int64).reshape(-1, 2).T.copy()
        columns = np.array([held[key] for key in rows], dtype=np.int64)
        self.drives, self.pressures = list(drives), list(pressures)
        self.driven = loop.Driven(row, index, columns, *np.zeros((3, len(rows))))
        freedoms.free[:] = 1.0
        freedoms.imposed[:] = 0.0
        freedoms.free[row, index] = 0.0
        self.held = held_arrays(self.specimen, self.drives, self.driven, freedoms)
        self.pressed = pressed_arrays(self.specimen, self.pressures, len(drives) + 1, self.arrays.displacement)
        self._start = {name: self._mean_displacement(name) for name in self.mesh.boundaries}
        self._samples = 0

    def schedule(self, times: np.ndarray) -> np.ndarray:
        """(t, columns) what the drives, nothing (the rotation of rigid grains), and the pressures are at times (s)."""
        table = np.zeros((len(times), len(self.drives) + 1 + len(self.pressures)))
        for column, drive in enumerate(self.drives):
            length = self.mesh.boundary_lengths[drive.boundary] if isinstance(drive, Hold) else 1.0
            table[:, column] = drive.course(times) * length
        for column, pressure in enumerate(self.pressures, len(self.drives) + 1):
            table[:, column] = pressure.course(times)
        return table

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
        if not self.rigid.grains:
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
        return self._of_groups(name, np.zeros(2 * len(self.order)))

    def _of_groups(self, name: str, values: np.ndarray) -> np.ndarray:
        """``values`` (p,) overwritten where a law has a memory of this name."""
        for group in self.groups:
            row = group.row(name)
            if row is not None:
                values.reshape(2, -1)[:, group.first : group.last] = row
        return values

    @cached_property
    def stiffness(self) -> np.ndarray:
        """(2, p) Pa/m: kn and ks of the first response, as the laws declare them."""
        rows = np.empty((2, 2 * len(self.order)))
        for group in self.groups:
            for row, value in zip(rows, group.law.stiffness, strict=True):
                spread = np.broadcast_to(value, 2 * group.size).reshape(2, -1)
                row.reshape(2, -1)[:, group.first : group.last] = spread
        return rows

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
        return self._of_groups("mode", work[1] / np.maximum(work.sum(axis=0), 1e-300))

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
        if self.rigid.grains:
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
            reaction = np.bincount(self.driven.place[mine], self.driven.reaction[mine], self.rigid.grains)
            nodes = self.mesh.boundaries[drive.boundary]
            share = np.bincount(grain[nodes], minlength=self.rigid.grains)
            forces[drive.axis, nodes] += reaction[grain[nodes]] / share[grain[nodes]]
        return forces

    def reaction(self, boundary: str) -> np.ndarray:
        """(2,) N per metre, of the drives of a boundary on the specimen: mean over the steps since the last sample."""
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
        if self.rigid.grains:
            size = np.diff(self.mesh.first_node)
            rows = np.stack([np.bincount(self.mesh.node_grain, row) / size for row in rows])
        self.freedoms.velocity[:2] += rows
        self.held = held_arrays(self.specimen, self.drives, self.driven, self.freedoms)
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
        if self.rigid.grains:
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
        """Mean force out of balance over mean contact force (mean reaction, if there are no contacts): 0 at rest."""
        free = self.freedoms.free[:2] > 0
        carried = np.hypot(self.normal, self.shear) * self.contact_lengths if len(self.order) else self.driven.reaction
        scale = float(np.mean(np.abs(carried))) if len(carried) else 0.0
        return float(np.mean(np.abs(self.freedoms.force[:2][free]))) / scale if scale > 0 else 1.0

    def closure_tangents(self) -> np.ndarray:
        """(p,) Pa/m: normal stiffness against a little more closure, tried without being committed."""
        little = 1e-3 * max(-float(self.opening.min(initial=0.0)), 1e-12)
        count = len(self.order)
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
        nodes = (self.arrays.displacement, self.arrays.force) if self.rigid.grains else ()  # else the freedoms' own
        return [
            *nodes, freedoms.displacement, freedoms.velocity, freedoms.force, freedoms.loss, freedoms.imposed,
            contacts.opening, contacts.slip, contacts.normal, contacts.shear, contacts.work,
            driven.reaction, driven.total, driven.work, self.held.motion,
            self.pressed.force, self.pressed.moved, self.pressed.work, *(group.memory for group in self.groups),
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
        driven_velocity = f.velocity[driven.row, driven.place]
        supplied = float(driven.reaction @ driven_velocity)
        power = float(np.sum(f.force * f.velocity)) + supplied  # forces of drives cancel where they do not accelerate
        per_point = self.contact_lengths * self.contacts.work
        half = 0.5 * self.time_step
        return {
            "external": self.adopted_work
            + float(driven.work.sum() + self.pressed.work.sum())
            + self.initial_energy
            - half * supplied,
            "kinetic": self._kinetic_energy() - half * power,
            "zones": 0.0 if self.rigid.grains else float(self.zone_state()[1] @ self.mesh.zone_areas),
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
        """Remember when and how contact points broke, to within one sample, and the work it took.

        What the springs of closure and friction store at that moment is no part of it.
        """
        fresh = np.isnan(self.broken_time) & (self.memory("damage") >= 1)
        if not fresh.any():
            return
        self.broken_time[fresh] = self.time
        self.broken_mode[fresh] = self.mode[fresh]
        kn, ks = self.stiffness[:, fresh]
        springs = self.normal[fresh] ** 2 / (2 * kn) + self.shear[fresh] ** 2 / (2 * ks)
        self.broken_work[fresh] = np.maximum(self.contacts.work[:, fresh].sum(axis=0) - springs, 0.0)
