"""The energy ledger of a running specimen, Eq. (12) of docs/theory.md, and how far it is from rest."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from grainlaw.engine.state import State


def energies(state: State) -> dict[str, float]:
    """J per metre of thickness by kind, at the moment of the last forces.

    Velocities live half a step later, so that half a step of power is taken back from what they have gained.
    """
    f, driven = state.freedoms, state.driven
    driven_velocity = f.velocity[driven.row, driven.place]
    supplied = float(driven.reaction @ driven_velocity)
    power = float(np.sum(f.force * f.velocity)) + supplied  # forces of drives cancel where they do not accelerate
    per_point = state.contact_lengths * state.contacts.work
    touching = np.zeros(3) if state.touches is None else state.touches.work
    half = 0.5 * state.time_step
    return {
        "external": state.adopted_work
        + float(driven.work.sum() + state.pressed.work.sum())
        + state.work_of_gravity()
        + state.initial_energy
        - half * supplied,
        "kinetic": state.kinetic_energy - half * power,
        "zones": 0.0 if state.rigid.grains else float(state.zone_state()[1] @ state.mesh.zone_areas),
        "contacts_normal": float(per_point[0].sum() + touching[0]),
        "contacts_shear": float(per_point[1].sum() + touching[1]),
        "damping": float(f.loss.sum() + touching[2]) + state.halted_energy,
    }


def unbalanced(state: State) -> float:
    """Mean force out of balance over mean contact force (mean reaction, if there are no contacts): 0 at rest."""
    free = state.freedoms.free[:2] > 0
    if not free.any():
        return 0.0
    carried = np.hypot(state.normal, state.shear) * state.contact_lengths
    if state.touches is not None:
        closed = state.touches.arrays.length > 0
        carried = np.append(carried, np.hypot(*state.touches.arrays.carried[:2, closed]))
    carried = carried if len(carried) else state.driven.reaction
    scale = float(np.mean(np.abs(carried))) if len(carried) else 0.0
    return float(np.mean(np.abs(state.freedoms.force[:2][free]))) / scale if scale > 0 else 1.0


def motion(state: State, energy: Mapping[str, float]) -> float:
    """Root of kinetic over stored energy, up to 1: about the way still to go over that gone so far, 0 at rest.

    1 while a load of the stage still changes, as what follows it slowly is balanced all the time. Along an axis that
    nothing drives the specimen may drift as a whole.
    """
    ramps = [one.ramp for one in (*state.drives, *state.pressures)]
    if state.time - state.began < max(ramps, default=0.0):
        return 1.0
    stored = sum(energy[name] for name in ("zones", "contacts_normal", "contacts_shear"))
    kinetic = max(state.kinetic_energy - _drift(state), 0.0)
    return math.sqrt(min(kinetic / stored, 1.0)) if stored > 0 else float(kinetic > 0)


def _drift(state: State) -> float:
    """J, kinetic energy of the mean velocity along axes in which no freedom is driven."""
    mass, velocity = state.freedoms.mass, state.freedoms.velocity
    free = [axis for axis in (0, 1) if not np.any(state.driven.row == axis)]
    return sum(0.5 * float(mass[axis] @ velocity[axis]) ** 2 / float(mass[axis].sum()) for axis in free)
