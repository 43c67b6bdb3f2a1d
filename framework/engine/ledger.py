"""The energy balance of a running specimen, Eq. (12) of docs/theory.md, and measures of its distance from rest."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from grainlaw.columns import DISSIPATED, ENERGIES, KINETIC, STORED, SUPPLIED
from grainlaw.engine.state import State

#: of kinetic energy, of gravity's work over the size of the specimen, and a strain: no run is judged by less
ROUNDING = 1e-9


def energies(state: State) -> dict[str, float]:
    """J per metre of thickness by kind, at the moment of the last forces, of all parts.

    Velocities are those half a step later: half a step of power is subtracted from their kinetic energy.
    """
    f, driven = state.freedoms.arrays, state.drives.arrays
    supplied = float(np.sum(driven.reaction * f.velocity[driven.row, driven.place]))
    # The reaction of a drive cancels the other forces unless its velocity changes.
    power = float(np.sum(f.force * f.velocity)) + supplied
    half = 0.5 * state.time_step
    total = dict.fromkeys(ENERGIES, 0.0)
    for part in state.parts.values():
        for kind, energy in part.energy(state.time_step).items():
            total[kind] += energy
    # No product of vectors, whose last digit depends on the processor: loadings go by these sums.
    _, stored, lost = state.zone_state()
    total["zones"] += float(np.sum(stored * state.every_zone.areas))
    total[DISSIPATED] += float(np.sum(lost * state.every_zone.areas))
    total[SUPPLIED] -= half * supplied
    total[KINETIC] += state.kinetic_energy - half * power
    return total


def least_work(state: State) -> float:
    """J, by which a run is judged at least: all grains at the speed of the drives, or rounding of weight or strain."""
    fastest = state.steady.pace * float(np.abs(state.imposed.speeds).max(initial=0.0))
    size, weight = float(np.hypot(*np.ptp(state.mesh.nodes, axis=0))), float(np.abs(state.gravity.arrays.weight).sum())
    stiff = state.specimen.zone_stiffness[: len(state.every_zone.areas), 0, 0] * state.every_zone.areas
    strained = ROUNDING**2 * float(stiff.sum())  # rounding of strains moves a specimen on which nothing acts
    return max(0.5 * float(state.freedoms.arrays.mass[0].sum()) * fastest**2, ROUNDING * size * weight, strained)


def unbalanced(state: State) -> float:
    """Mean unbalanced force over mean force of contacts, tied nodes and fluids; 0 at rest.

    Where there are none, over the mean reaction; 1 where that is 0 and a force is left.
    """
    free = state.freedoms.arrays.free[:2] > 0
    if not free.any():
        return 0.0
    forces = np.hypot(state.normal, state.shear) * state.contact_lengths
    contacts = state.contacts.arrays
    closed = contacts.length > 0
    normal = np.minimum(contacts.normal[closed], 0.0)
    forces = np.append(forces, np.hypot(normal, contacts.shear[closed]) * contacts.length[closed])
    forces = np.concatenate([forces, np.hypot(*state.nodes.arrays.force[:, state.mesh.tied]), state.fluids.forces])
    forces = forces if len(forces) else state.drives.arrays.reaction
    scale = float(np.mean(np.abs(forces))) if len(forces) else 0.0
    left = float(np.mean(np.abs(state.freedoms.arrays.force[:2][free])))
    return left / scale if scale > 0 else float(left > 0)


def motion(state: State, energy: Mapping[str, float]) -> float:
    """Root of kinetic over stored energy, at most 1: about the displacement still to come over that so far, 0 at rest.

    1 while a load of the stage still changes: a specimen that follows a slow load is always near equilibrium. The
    specimen may drift as a whole along an axis on which nothing is driven; this does not count.
    """
    if state.time - state.began < state.imposed.lasts:
        return 1.0
    stored = sum(energy[name] for name in STORED)
    kinetic = max(state.kinetic_energy - _drift(state), 0.0)
    return math.sqrt(min(kinetic / stored, 1.0)) if stored > 0 else float(kinetic > 0)


def _drift(state: State) -> float:
    """J, kinetic energy of the mean velocity along axes in which no freedom is driven."""
    mass, velocity = state.freedoms.arrays.mass, state.freedoms.arrays.velocity
    free = [axis for axis in (0, 1) if not np.any(state.drives.arrays.row == axis)]
    return sum(0.5 * float(mass[axis] @ velocity[axis]) ** 2 / float(mass[axis].sum()) for axis in free)
