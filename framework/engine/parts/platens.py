"""Load-controlled platens (servo) and ends of bars: boundaries that move as one body under a force."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.numba_private import call
from grainlaw.engine.parts.drives import Drives
from grainlaw.engine.parts.freedoms import Freedoms
from grainlaw.engine.parts.imposed import Imposed
from grainlaw.engine.parts.part import START, Changing, Constant, Moment, Part, Split
from grainlaw.loads import Forced
from grainlaw.mesh import Mesh
from grainlaw.messages import refusal


class PlatenArrays(NamedTuple):
    """Platens (k). Their motion has a row for each thread: every thread computes it, so that none has to wait."""

    column: Constant  #: (k,) column of the schedule with the force, and column of the velocity for driven freedoms
    stiffness: Constant  #: (k,) N/m of a spring that pulls back to where it began
    dashpot: Constant  #: (k,) N s/m, force over velocity of what carries waves away
    force: Changing  #: (threads, k) N; this and the following rows have the form of freedoms
    earlier: Changing  #: N
    velocity: Changing  #: m/s
    displacement: Changing  #: m, since its spring began
    mass: Changing  #: kg
    free: Changing  #: 1
    imposed: Changing  #: 0
    loss: Changing  #: J
    share: Constant


MOTION = ("force", "earlier", "velocity", "displacement", "mass", "free", "imposed", "loss")


@njit(**OPTIONS)
def move_platens(platens, drives, freedoms, schedule, velocities, time_step, integrator, parameters, thread):
    """Move platens under their forces by one step, and drive their freedoms with their velocity.

    A platen has the mass of the freedoms on its boundary, and is integrated like them. Its dashpot acts on the mean of
    the velocities before and after the step, as those of quiet boundaries do.
    """
    force, displacement = platens.force[thread], platens.displacement[thread]
    velocity, mass = platens.velocity[thread], platens.mass[thread]
    for k in range(platens.column.shape[0]):
        total = schedule[platens.column[k]] - platens.stiffness[k] * displacement[k]
        for d in range(drives.row.shape[0]):
            if drives.column[d] == platens.column[k]:
                total += freedoms.force[drives.row[d], drives.place[d]]
        by, dashpot = 0.5 * time_step / mass[k], platens.dashpot[k]
        force[k] = total - dashpot * (velocity[k] + by * total) / (1 + by * dashpot)
    call(
        integrator,
        (
            parameters, force.ctypes.data, platens.earlier[thread].ctypes.data, velocity.ctypes.data,
            displacement.ctypes.data, mass.ctypes.data, platens.free[thread].ctypes.data,
            platens.imposed[thread].ctypes.data, platens.loss[thread].ctypes.data, platens.column.shape[0],
        ),
    )  # fmt: skip
    for k in range(platens.column.shape[0]):
        velocities[platens.column[k]] = platens.velocity[thread, k]


class Platens(Part):
    """The platens of a stage under a force, whose freedoms the drives hold."""

    def __init__(self, mesh: Mesh, drives: Drives, freedoms: Freedoms) -> None:
        self._mesh, self._drives, self._freedoms = mesh, drives, freedoms
        self._holds: list[Forced] = []  #: of this stage
        self.begin(Imposed(mesh), START)

    def begin(self, imposed: Imposed, at: Moment) -> None:
        """Give each platen mass and momentum of the freedoms on its boundary, and the spring of the stage before."""
        f, lengths = self._freedoms.arrays, self._mesh.boundary_lengths
        holds = [(imposed.column(hold), hold) for hold in imposed.of(Forced)]
        springs = {self._spring(hold): k for k, hold in enumerate(self._holds)}
        rows = {name: np.zeros((1, len(holds))) for name in MOTION}
        for k, (column, hold) in enumerate(holds):
            place = self._freedoms_of(column)
            if not len(place[0]):
                wanted = f"a boundary with a node that is free along axis {hold.axis}: others hold all of them"
                raise refusal(f"{type(hold).__name__}: boundary", hold.boundary, wanted)
            rows["velocity"][0, k] = np.average(f.velocity[place], weights=f.mass[place])
            rows["mass"][0, k] = f.mass[place].sum()
            if (before := springs.get(self._spring(hold))) is not None:
                rows["displacement"][0, k] = self.arrays.displacement[0, before]
        rows["free"][:] = 1.0
        self._holds = [hold for _, hold in holds]
        self.arrays = PlatenArrays(
            column=np.array([column for column, _ in holds], dtype=np.int64),
            stiffness=np.array([hold.spring(lengths[hold.boundary]) for _, hold in holds]),
            dashpot=np.array([hold.dashpot(lengths[hold.boundary]) for _, hold in holds]),
            **rows,
            share=np.zeros(2, dtype=np.int64),
        )

    def _spring(self, hold: Forced) -> tuple[str, int, float]:
        """By which the spring of one stage is known as that of the next."""
        return hold.boundary, hold.axis, hold.spring(self._mesh.boundary_lengths[hold.boundary])

    def follow(self, change: np.ndarray) -> None:
        """Add to each platen's velocity the mean of what was added to its freedoms, ``change`` (r, n) m/s."""
        if not len(self):
            return
        velocity, mass = self.arrays.velocity.copy(), self._freedoms.arrays.mass
        for k, column in enumerate(self.arrays.column.tolist()):
            place = self._freedoms_of(column)
            velocity[0, k] += np.average(change[place], weights=mass[place])
        self.arrays = self.arrays._replace(velocity=velocity)  # other arrays: what the threads share is made anew

    def _freedoms_of(self, column: int) -> tuple[np.ndarray, np.ndarray]:
        """Rows and places of the freedoms that follow a column of the schedule."""
        driven = self._drives.arrays
        mine = driven.column == column
        return driven.row[mine], driven.place[mine]

    def __len__(self) -> int:
        return len(self.arrays.column)

    def shared(self, split: Split) -> PlatenArrays:
        rows = {name: np.repeat(getattr(self.arrays, name), split.threads, axis=0) for name in MOTION if len(self)}
        return self.arrays._replace(**rows, share=self.share(split))

    def take_back(self, shared: PlatenArrays) -> None:
        """Copy the motion of the platens back from the arrays of the threads."""
        for name in MOTION if len(self) else ():
            getattr(self.arrays, name)[:] = getattr(shared, name)[:1]
