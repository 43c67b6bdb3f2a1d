"""Bringing a specimen under the loads of a stage by static solutions: Newton's method on the forces of the step."""

from __future__ import annotations

import numpy as np

from grainlaw.compiler.batch import Compiled, compile_integrator
from grainlaw.engine.coasting import Coasting
from grainlaw.engine.factors import Factors
from grainlaw.engine.stable_step import StableStep, in_one_piece
from grainlaw.engine.stage_statics import unknowns
from grainlaw.engine.state import State
from grainlaw.engine.stepping import OverlapError, advance
from grainlaw.loads import Drive
from grainlaw.stage import Stage

INCREMENTS, ITERATIONS = 10, 10  #: of the loads; at most in each of them
BALANCED = 1e-6  #: largest unbalanced force over largest contact force
UNHELD = 1e-4  #: the same of what moves the specimen as a whole where nothing holds it: loads follow what deforms
FAR = 0.01  #: of the size of the specimen: no correction of a static solution is larger


def bring_under_load(state: State, stage: Stage, stability: StableStep) -> bool:
    """Bring a specimen at rest under the loads of a stage that has begun; whether it could be done.

    The loads rise in ten increments, as in the course of their ramps, weights evenly. Each is one step of the engine
    from equilibrium to equilibrium, so that laws follow the path and all works are recorded. The state is as before
    where a static solution does not exist or is not unique: bonds that break, points that may slide as they have no
    cohesion, contacts without a bond.
    """
    moving = bool(state.freedoms.arrays.velocity.any())
    bonded = in_one_piece(state) and all(group.cohesive.all() for group in state.bonds.groups)
    if moving or not bonded or _rubs(state) or stability.stiffening:
        return False
    start, time_step, broken, weight = state.save(), state.time_step, _broken(state), state.gravity.arrays
    try:
        with np.errstate(all="ignore"):
            done = _load(state, stage, stability) and _broken(state) == broken and not _rubs(state, _largest(state))
    except OverlapError:
        done = False
    if not done:
        state.gravity.arrays = weight
        state.restore(start)
        state.time_step = time_step
        return False
    state.change_velocity(-state.freedoms.arrays.velocity)
    state.change_time_step(time_step)
    state.gravity.new[:] = 0.0  # it is balanced: at rest half a step ago, too
    state.new_sample()
    return True


def _rubs(state: State, largest: float = 0.0) -> bool:
    """Whether faces without a bond are pressed together; to be near is none.

    What is nothing beside the ``largest`` force (N), as at the corners of an opening, does not count.
    """
    arrays = state.contacts.arrays
    pressed = arrays.length > 0
    force = np.hypot(arrays.normal, arrays.shear) * arrays.length if largest and pressed.any() else pressed
    return bool((force > BALANCED * largest).any())


def _largest(state: State) -> float:
    """N, the largest force on a bond, or on a node where there is none."""
    if not len(state.bonds):
        return float(np.hypot(*state.nodes.arrays.force).max())
    return float((np.hypot(state.normal, state.shear) * state.contact_lengths).max())


def _broken(state: State) -> int:
    return int(np.count_nonzero(state.memory("damage") >= 1)) + int(state.replaced.sum())


def _load(state: State, stage: Stage, stability: StableStep) -> bool:
    """Go through the increments; whether all of them have a static solution."""
    ramps = [one.lasts for one in stage.loads if not isinstance(one, Drive)]
    state.change_time_step((max(ramps, default=0.0) or stage.interval) / INCREMENTS)
    carry, matrix, places = unknowns(state, stability.stiffness(), stability.frequency)
    factors, coasting = Factors(matrix, places), compile_integrator(Coasting())
    f = state.freedoms.arrays
    drifts, size = _drifts(state), float(np.ptp(state.mesh.nodes, axis=0).max())
    velocity, before = np.zeros_like(f.velocity), state.gravity.arrays.weight - state.gravity.new
    weights = [before + share * state.gravity.new for share in np.arange(INCREMENTS + 1) / INCREMENTS]
    state.gravity.raise_to(weights[0], state.time_step)
    for weight in weights[1:]:
        start, carried = state.save(), state.gravity.arrays
        for _ in range(ITERATIONS):
            _step(state, coasting, velocity)
            state.gravity.raise_to(weight, state.time_step)
            there = state.save()
            _step(state, coasting, np.zeros_like(velocity))  # finds the forces where the first has moved it
            whole = _on_the_whole(state, drifts)
            force = carry.T @ state.grains.flat(f.force - whole)
            force[: len(state.platens)] = state.platens.arrays.force[0]
            largest = _largest(state)
            if np.abs(force).max() <= BALANCED * largest and np.abs(whole[:2]).max() <= UNHELD * largest:
                state.restore(there)
                break
            state.gravity.arrays = carried
            state.restore(start)
            change = state.grains.unflat(carry @ factors.solve(force))
            for drift in drifts:
                change -= drift * (np.sum(f.mass * drift * change) / np.sum(f.mass * drift**2))
            if not np.abs(change[:2]).max() <= FAR * size:
                return False
            velocity = velocity + change / state.time_step
        else:
            return False
    return True


def _drifts(state: State) -> list[np.ndarray]:
    """Motions (r, n) of the specimen as a whole that nothing holds: along an axis, and, if along both, its rotation."""
    driven, count = state.drives.arrays, len(state.mesh.nodes)
    free = [axis for axis in (0, 1) if not (driven.row == axis).any()]
    fields = [np.eye(2)[:, axis, None] * np.ones(count) for axis in free]
    if len(free) == 2:
        x, y = (state.mesh.nodes - np.average(state.mesh.nodes, axis=0, weights=state.specimen.node_masses)).T
        fields.append(np.stack([-y, x]))
    return [state.grains.field(field, state.freedoms, state.mesh.nodes) for field in fields]


def _on_the_whole(state: State, drifts: list[np.ndarray]) -> np.ndarray:
    """(r, n) N, of the forces on the freedoms those that move the specimen as a whole, by its ``drifts``."""
    f = state.freedoms.arrays
    whole = np.zeros_like(f.force)
    for drift in drifts:
        whole += f.mass * drift * (np.sum(drift * f.force) / np.sum(f.mass * drift**2))
    return whole


def _step(state: State, coasting: Compiled, velocity: np.ndarray) -> None:
    """One step of the engine at velocities (r, n) m/s."""
    state.change_velocity(velocity - state.freedoms.arrays.velocity)
    advance(state, coasting, 1)
    state.freedoms.catch_up(held=True)
