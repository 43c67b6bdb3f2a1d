"""The state of a running specimen: the arrays of the engine, and what may be read from them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from grainlaw.contact import Laws
from grainlaw.detection import Detection
from grainlaw.engine import step as loop
from grainlaw.engine import touch
from grainlaw.engine.assembly import (
    check_boundaries,
    contact_arrays,
    driven_arrays,
    freedom_arrays,
    group_interfaces,
    held_arrays,
    law_groups,
    mesh_arrays,
    pressed_arrays,
)  # fmt: skip
from grainlaw.engine.bonds import motion_of_points
from grainlaw.engine.touching import Touches, no_touching
from grainlaw.integration import Motion
from grainlaw.specimen import Specimen
from grainlaw.stage import Drive, Hold, Pressure, Stage

Saved = tuple[list[np.ndarray], int, float, int, float, Touches | None, np.ndarray, tuple[float, int, float]]


class State:
    """Everything that changes while a specimen is loaded. Observers and protocols read it; only the engine writes.

    Index letters as in :class:`~grainlaw.mesh.Mesh`, and ``p`` for contact points: the first points of all
    interfaces, then the second.
    """

    def __init__(self, specimen: Specimen, laws: Laws, detection: Detection | None = None) -> None:
        self.specimen, self.mesh = specimen, specimen.mesh
        self.time, self.steps, self.stage, self.began = 0.0, 0, "", 0.0
        self.time_step, self.mass_added = 0.0, 0.0
        self._clock = 0.0, 0, 0.0  #: time, steps and time step when the latter last changed
        self.initial_energy = 0.0  #: J, kinetic, given at the start of stages
        self.halted_energy = 0.0  #: J, taken out by halts
        self.adopted_work = 0.0  #: J, work of drives of earlier stages
        self._zone_state: tuple[int, np.ndarray, np.ndarray] | None = None
        self.order, sizes = group_interfaces(specimen, laws)
        self.arrays = mesh_arrays(specimen, self.order)
        self.contacts = contact_arrays(specimen, self.order, detection)
        self.groups, self.table = law_groups(sizes, len(self.order))
        self.freedoms, self.rigid = freedom_arrays(specimen, self.arrays)
        self.driven = loop.Driven(*np.zeros((3, 0), dtype=np.int64), *np.zeros((3, 0)))
        self.pressed = pressed_arrays(specimen, [], 1, self.arrays.displacement)
        self.weighed = False
        self._weighed_from = self.freedoms.displacement.copy()
        self.impose([])
        self.retired = np.zeros(len(self.order), dtype=bool)  #: (c,) interfaces that were handed over to touches
        self.touches = None
        if detection is not None:
            self.touches = Touches(specimen, laws, detection, self.order, np.ascontiguousarray(self.mesh.nodes.T))
            self.search()
        self.broken_time = np.full(self.contacts.opening.shape[1], np.nan)  #: (p,) s, nan where unbroken
        self.broken_mode = self.broken_time.copy()  #: (p,) share of shear at breaking
        self.broken_work = self.broken_time.copy()  #: (p,) J/m2 spent until the break

    # --- boundary conditions ---------------------------------------------------------------------------------------

    def begin(self, stage: Stage) -> None:
        """Impose what a stage says from now on; work done so far is kept."""
        self.stage, self.began = stage.name, self.time
        self.adopted_work += self.work_of_gravity()
        self._weighed_from = self._freedoms_at_forces()
        before = self.freedoms.weight.copy()
        self.freedoms.weight[:2] = np.array(stage.gravity)[:, None] * self._true_mass
        self._new_weight = self.freedoms.weight - before
        self.weighed = bool(np.any(self.freedoms.weight))
        self.impose(stage.drives, stage.pressures, stage.fixed)
        self.give_velocity(stage.initial_velocity)

    def take_back_half_a_step_of_gravity(self) -> None:
        """Velocities live half a step before what is given of them; of a new weight this shows in time."""
        f = self.freedoms
        gain = self.time_step * f.free * self._new_weight / f.mass
        f.velocity[:] -= gain / 2
        self.initial_energy -= float(np.sum(f.mass * gain**2)) / 8  # energy is the product of both half steps

    def impose(
        self, drives: Sequence[Drive | Hold], pressures: Sequence[Pressure] = (), fixed: Sequence[int] = ()
    ) -> None:
        """Drive and press boundaries, and hold ``fixed`` grains."""
        self.adopted_work += float(self.driven.work.sum() + self.pressed.work.sum())
        check_boundaries(self.specimen, [*drives, *pressures])
        self.drives, self.pressures = list(drives), list(pressures)
        self.driven = driven_arrays(self.specimen, drives, fixed)
        self.freedoms.free[:] = 1.0
        self.freedoms.imposed[:] = 0.0
        self.freedoms.free[self.driven.row, self.driven.place] = 0.0
        self.held = held_arrays(self.specimen, self.drives, self.driven, self.freedoms)
        self.pressed = pressed_arrays(self.specimen, self.pressures, len(drives) + 1, self.arrays.displacement)
        self._start = {name: self._mean_displacement(name) for name in self.mesh.boundaries}
        self._samples = 0

    @cached_property
    def _true_mass(self) -> np.ndarray:
        """(n,) kg of each node or rigid grain, without what mass scaling adds."""
        nodes = self.specimen.node_masses
        return np.bincount(self.mesh.node_grain, nodes) if self.rigid.grains else nodes

    def work_of_gravity(self) -> float:
        """J since the present stage began, until the last forces."""
        if not self.weighed:
            return 0.0
        return float(np.sum(self.freedoms.weight * (self._freedoms_at_forces() - self._weighed_from)))

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
        return self._at_points(self.contacts.opening, 0)

    @property
    def slip(self) -> np.ndarray:
        """(p,) m."""
        return self._at_points(self.contacts.slip, 1)

    @property
    def normal(self) -> np.ndarray:
        """(p,) Pa, tension positive; 0 at interfaces that were handed over."""
        return self._at_points(self.contacts.normal)

    @property
    def shear(self) -> np.ndarray:
        """(p,) Pa; 0 at interfaces that were handed over."""
        return self._at_points(self.contacts.shear)

    def _at_points(self, rows: np.ndarray, motion: int | None = None) -> np.ndarray:
        """(p,) as the engine has it, but at interfaces that were handed over the motion of their points, or nothing."""
        row = rows[self._now]
        if not self.retired.any():
            return row
        return np.where(np.tile(self.retired, 2), 0.0 if motion is None else motion_of_points(self)[motion], row)

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
            self._zone_state = self.steps, *loop.zone_state(self.arrays, self.displacement_at_forces())
        return self._zone_state[1:]

    def _freedoms_at_forces(self) -> np.ndarray:
        return self.freedoms.displacement - self.freedoms.velocity * self.time_step

    def displacement_at_forces(self) -> np.ndarray:
        """(2, i) m, at the moment of the last forces."""
        freedoms = self._freedoms_at_forces()
        return self._carried(freedoms) if self.rigid.grains else freedoms

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

    # --- neighbours --------------------------------------------------------------------------------------------------

    def search(self, before: np.ndarray | None = None) -> None:
        """Search neighbours anew; ``before`` is the displacement a step ago, if it is known to the last digit."""
        assert self.touches is not None
        self.touches.update(self.arrays.displacement, self.displacement_at_forces() if before is None else before)

    def touching(self, threads: int) -> tuple[touch.Touching, np.ndarray]:
        """Contacts that are no interfaces, for the engine, and the table of their laws."""
        if self.touches is None:
            return no_touching(), np.zeros((0, 5), dtype=np.int64)
        self.touches.arrays = self.touches.arrays._replace(tally=np.zeros((threads, 8), dtype=np.int64))
        return self.touches.arrays, self.touches.table

    # --- for the engine ----------------------------------------------------------------------------------------------

    def give_velocity(self, velocity: np.ndarray | None) -> None:
        """Add a velocity field (i, 2) m/s, of which rigid grains take the mean and the spin, unless they are held."""
        if velocity is None:
            return
        before = self.kinetic_energy
        rows = np.asarray(velocity, dtype=float).T
        if self.rigid.grains:
            rows = self._of_rigid(rows)
        self.freedoms.velocity[: len(rows)] += rows
        self.held = held_arrays(self.specimen, self.drives, self.driven, self.freedoms)
        self.initial_energy += self.kinetic_energy - before

    def _of_rigid(self, field: np.ndarray) -> np.ndarray:
        """(3, g) velocities of rigid grains: mean and spin of a field (2, i) of corners."""
        grain = self.mesh.node_grain
        mean = np.stack([np.bincount(grain, row) for row in field]) / np.bincount(grain)
        arm = (self.positions - (self.specimen.grains.centroids + self.freedoms.displacement[:2].T)[grain]).T
        x, y = field - mean[:, grain]
        spin = np.bincount(grain, arm[0] * y - arm[1] * x) / np.bincount(grain, (arm**2).sum(axis=0))
        return np.stack([*mean, spin * self.freedoms.free[2]])

    @property
    def kinetic_energy(self) -> float:
        """J, of the velocities half a step after the last forces."""
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
            self.arrays.displacement[:] = self._carried(f.displacement)
        lost = lost * f.free
        self.halted_energy += float(np.sum(f.mass * lost**2 / 2 + f.force * (lost / 2 + gained / 8) * dt))

    def _carried(self, freedoms: np.ndarray) -> np.ndarray:
        """(2, i) m, displacement of the nodes of rigid grains whose freedoms (3, g) are given."""
        x, y, angle = freedoms[:, self.mesh.node_grain]
        arm_x, arm_y = self.rigid.arm
        sine, versed = np.sin(angle), 2 * np.sin(angle / 2) ** 2
        return np.stack([x - versed * arm_x - sine * arm_y, y + sine * arm_x - versed * arm_y])

    def _mutable(self) -> list[np.ndarray]:
        freedoms, contacts, driven = self.freedoms, self.contacts, self.driven
        nodes = (self.arrays.displacement, self.arrays.force) if self.rigid.grains else ()  # else the freedoms' own
        return [
            *nodes, freedoms.displacement, freedoms.velocity, freedoms.force, freedoms.loss, freedoms.imposed,
            contacts.opening, contacts.slip, contacts.normal, contacts.shear, contacts.work, contacts.force,
            contacts.node, self.arrays.slots,
            driven.reaction, driven.total, driven.work, self.held.motion,
            self.pressed.force, self.pressed.moved, self.pressed.work, *(group.memory for group in self.groups),
        ]  # fmt: skip

    def save(self) -> Saved:
        """Copy what steps change."""
        touches = None if self.touches is None else self.touches.copy()
        arrays = [array.copy() for array in self._mutable()]
        retired = self.retired.copy()
        return arrays, self.steps, self.time, self._samples, self.halted_energy, touches, retired, self._clock

    def restore(self, saved: Saved) -> None:
        """Go back to where ``save`` was called."""
        self._zone_state = None
        arrays, self.steps, self.time, self._samples, self.halted_energy, touches, retired, self._clock = saved
        self.touches, self.retired = None if touches is None else touches.copy(), retired.copy()
        for array, copy in zip(self._mutable(), arrays, strict=True):
            array[:] = copy

    def new_sample(self) -> None:
        """Begin a new interval of means."""
        self.driven.total[:] = 0.0
        self._samples = 0
        self._start = {name: self._mean_displacement(name) for name in self.mesh.boundaries}

    def next_times(self, count: int) -> np.ndarray:
        """(count,) s of the next steps; the same to the last digit, however many are asked for at a time."""
        if self._clock[2] != self.time_step:
            self._clock = self.time, self.steps, self.time_step
        since, steps, step = self._clock
        return since + step * (self.steps - steps + 1 + np.arange(count))

    def count_steps(self, steps: int, time: float) -> None:
        """Book steps that the engine has done until ``time`` (s)."""
        self.steps += steps
        self._samples += steps
        self.time = time

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
