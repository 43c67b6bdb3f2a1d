"""The stability margin of a loaded specimen: how far it is from motions that cost nothing.

It is the lowest eigenvalue of K(u) v = lambda K0 v, Eq. (23): K0 is the stiffness of the sound specimen, K(u) the
present one. 1: as stiff as sound; 0: a peak, or a buckling load; below 0: unstable. No tangent is assembled: K(u) v is
a difference of forces of the step itself, so that geometry, contacts, damage and materials are all in it.
Index letters: ``r, n`` rows and places of the freedoms, ``q`` unknowns: platens under a force and free freedoms.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
import scipy

from grainlaw.compiler.batch import compile_integrator
from grainlaw.engine import step
from grainlaw.engine.coasting import Coasting
from grainlaw.engine.factors import Factors
from grainlaw.engine.parts.part import changing
from grainlaw.engine.stage_statics import LOOSE, unknowns
from grainlaw.engine.state import State
from grainlaw.engine.stepping import advance, schedule_of

TRIAL = 2e-10  #: of the specimen's size: largest displacement of a trial motion
AHEAD = 300  #: times that: how far ahead on its way the specimen is when trial motions begin
FREE = 1e-3  #: of the frequency of the steady motion: below, a motion that nothing resists counts as sound
EXACT = 0.01  #: residual of the eigenvalue, in the norm of K0, and
SETTLED, SINCE = 0.01, 3  #: by how much it may have changed over so many spaces: what has softened may be small
IN_SPACE = 1e-10  #: share of a motion, in the norm of K0, that is left by rounding once the space is taken from it
MOST = 16  #: trial motions; a margin that is not found with them is not known
FARTHEST = 0.05  #: of the grain size: largest displacement by which a soft motion is brought to its place at once
INCREMENTS = 10  #: steps in which it is moved: the work of contacts that open or close on the way is that of steps
TURNED = 2e-3  #: rad, to which angles of grains are rounded: the sound stiffness turns with them, and
ROUGHLY = 0.05  #: rad, for its factors, which only have to guide the search
KNEE = 0.4  #: of the mean velocity where a motion has just begun: sqrt(2) - 1
LITTLE = 1e-3  #: least margin by which the first trial of that is found
BALANCED, TRIALS = 0.01, 16  #: of the force on the motion: what may be left of it; in so many trials
LARGEST = 1_500_000  #: freedoms: of larger specimens the margin is not asked, for the room that K0's factors take


@attrs.frozen(kw_only=True)
class LowestMode:
    """A margin, and the motion that it belongs to."""

    margin: float  #: lowest eigenvalue
    frequency: float  #: 1/s that its motion would have in the sound specimen; times sqrt(margin): that it has now
    motion: np.ndarray  #: (q,) displacement, of unit energy in the sound specimen


class Margin:
    """Finds the margin of a state in one of its stages.

    ``sound`` gives the stiffness (N/m) of the sound specimen over its freedoms, in the order of :meth:`Grains.flat`,
    with its nodes (i, 2) where they are when grains have turned. ``highest_frequency`` (1/s) is its highest one, and
    ``steady_frequency`` that of the steady motion of the stage.
    """

    def __init__(
        self,
        state: State,
        sound: Callable[[np.ndarray], scipy.sparse.csr_matrix],
        highest_frequency: float,
        steady_frequency: float,
    ) -> None:
        self._state, self._sound_with = state, sound
        self._highest_frequency, self._steady_frequency = highest_frequency, steady_frequency
        self._angles = self._rough_angles = np.full(len(state.specimen.grains.centroids), np.nan)
        self._coasting = compile_integrator(Coasting())
        low, high = state.specimen.grains.region.bounds
        self._trial = TRIAL * float(np.max(high - low))
        self._turn()

    def _turn(self) -> None:
        """Take the stiffness of the sound specimen with grains that have turned as they have now.

        Otherwise a motion that turns a turned grain would seem to strain it. Angles are rounded, so that this is rare,
        and depends on nothing but the present state.
        """
        angles = self._state.grains.rotations(self._state.freedoms, self._state.positions)
        finely, roughly = (np.round(angles / unit) * unit for unit in (TURNED, ROUGHLY))
        if not np.array_equal(finely, self._angles):
            self._angles, self._sound = finely, self._turned(finely)
        if not np.array_equal(roughly, self._rough_angles):
            matrix = self._turned(roughly)
            self._rough_angles, self._factors = roughly, Factors(matrix, self._places)

    def _turned(self, angles: np.ndarray) -> scipy.sparse.csc_matrix:
        """Stiffness of the sound specimen over the unknowns, with grains turned by angles (g,) rad."""
        state, mesh = self._state, self._state.mesh
        cosine, sine = np.cos(angles)[mesh.node_grain], np.sin(angles)[mesh.node_grain]
        centre = state.specimen.grains.centroids[mesh.node_grain]
        x, y = (mesh.nodes - centre).T
        turned = centre + np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=1)
        stiffness = self._sound_with(turned if angles.any() else mesh.nodes)
        carry, matrix, self._places = unknowns(state, stiffness, self._highest_frequency)
        self._carry, self._gather = carry, carry.T.tocsr()
        self._mass = self._gather @ state.grains.flat(state.freedoms.arrays.mass)
        # Motions that nothing resists, as a slide along smooth platens, get the same little stiffness in both matrices.
        little = (FREE * self._steady_frequency) ** 2 * self._mass
        self._free = little + LOOSE * self._highest_frequency**2 * self._mass
        return scipy.sparse.csc_matrix(matrix + scipy.sparse.diags(little))

    def first_guess(self) -> np.ndarray:
        """(q,) a smooth motion in which all parts of the specimen take part."""
        return self._factors.solve(self._mass * np.random.default_rng(0).normal(size=len(self._mass)))

    def find(self, guess: np.ndarray) -> LowestMode | None:
        """The margin of the present state, sought from a motion (q,) like that of the last; None if it is not found.

        Where a contact answers a trial by another branch than that it is on, as by unloading, differences of forces are
        not linear. So they are taken some way ahead along the steady motion: each contact stays on the branch on which
        the loading drives it, and the margin is that of the specimen as it is being loaded.
        """
        self._turn()
        state = self._state
        steady, platens = state.steady.books.field, state.platens.arrays
        scale = self._trial * AHEAD / max(self._size_of(steady), 1e-300)
        ahead, springs = steady * scale, np.append(platens.stiffness, np.zeros(len(self._mass) - len(platens.column)))
        with _Trials(state, self._coasting) as trials:

            def force(moved: np.ndarray) -> np.ndarray:
                return self._gather @ state.grains.flat(trials.forces(moved, scale))

            before = force(ahead)

            def tangent(motion: np.ndarray) -> np.ndarray:
                size = self._trial / self._size(motion)
                trial = motion * size
                now = force(ahead + state.grains.unflat(self._carry @ trial)) - springs * trial
                return (before - now) / size + self._free * motion

            return self._lowest(tangent, [guess, self._gather @ state.grains.flat(steady)])

    def settle(self, found: LowestMode, way: float) -> float:
        """Bring the specimen along its softest motion to where that has no force; (m) by how much it has moved.

        A soft motion, as the bending of a column that is about to buckle, is slower than the loading by the root of its
        margin. It is not waited for: some steps move it there, from equilibrium to equilibrium, and it goes on with the
        mean velocity since it was settled last, a ``way`` (m) of the drives ago; slower where it has just begun, as it
        grows with the root of the way there. It is not moved farther than ``FARTHEST``, nor where a contact would be
        damaged by it, or slide.
        """
        state, motion = self._state, found.motion
        rows = state.grains.unflat(self._carry @ motion)
        farthest = FARTHEST * state.specimen.grains.grain_size / self._size(motion)
        with _Trials(state, self._coasting) as trials:

            def force(size: float) -> float:
                found = self._gather @ state.grains.flat(trials.forces(rows * size, 0.0))
                return math.nan if trials.remembered else float(motion @ found)

            size = _zero(force, found.margin, farthest)
        if not size:
            return 0.0
        f, steady = state.freedoms.arrays, state.steady
        weight = rows * f.mass / np.sum(rows * f.mass * rows)
        velocity = f.velocity.copy()
        before = float(np.sum(weight * velocity)) / steady.pace
        state.change_velocity(rows * (size / (INCREMENTS * state.time_step)))
        advance(state, self._coasting, 1)
        state.freedoms.catch_up(held=True)
        advance(state, self._coasting, INCREMENTS - 1)
        mean = float(np.sum(weight * (f.displacement - steady.books.settled))) / way
        mean *= KNEE if abs(mean) > 2 * abs(before) else 1.0
        steady.books.field[:] += rows * (mean - float(np.sum(weight * steady.books.field)))
        steady.books.settled[:] = f.displacement
        velocity += rows * (mean * steady.pace - float(np.sum(weight * velocity)))
        state.change_velocity((velocity - f.velocity) * f.free)
        return size * self._size(motion)

    def _lowest(self, tangent: Any, starts: list[np.ndarray]) -> LowestMode | None:
        """Davidson's method: the space grows by the residual, on which the inverse of K0 has acted.

        Friction makes the tangent unsymmetric: of a pair of complex eigenvalues the real part counts.
        """
        basis = np.zeros((len(self._mass), MOST), order="F")
        sound, now, count, asked = np.zeros_like(basis), np.zeros_like(basis), 0, 0  # K0 and K(u) times the basis
        projected, found = np.zeros((MOST, MOST)), [math.inf] * SINCE
        while count < MOST:
            new = starts.pop(0)
            before = float(new @ (self._sound @ new))
            for _ in range(2):
                new = new - basis[:, :count] @ (sound[:, :count].T @ new)
            resisted = self._sound @ new
            energy = float(new @ resisted)
            if energy > IN_SPACE**2 * before:  # less is rounding of what the space has already
                basis[:, count], sound[:, count] = new / np.sqrt(energy), resisted / np.sqrt(energy)
                now[:, count] = tangent(basis[:, count])
                count += 1
                projected[:count, count - 1] = basis[:, :count].T @ now[:, count - 1]
                projected[count - 1, :count] = basis[:, count - 1] @ now[:, :count]
            if starts:
                continue
            if not count or not np.isfinite(projected).all():
                return None
            is_whole, asked = count == asked, count
            values, vectors = np.linalg.eig(projected[:count, :count])
            lowest = int(np.argmin(values.real))
            value, shares = values[lowest], vectors[:, lowest]
            residual = (now[:, :count] @ shares - value * (sound[:, :count] @ shares)).real
            following = self._factors.solve(residual)
            found = [*found[1:], float(value.real)]
            if is_whole or (residual @ following <= EXACT**2 and max(found) - min(found) <= SETTLED):
                motion = basis[:, :count] @ (shares.real / np.linalg.norm(shares.real))
                frequency = float(1 / np.sqrt(motion @ (self._mass * motion)))
                return LowestMode(margin=float(value.real), frequency=frequency, motion=motion)
            starts.append(following)
        return None

    def _size(self, motion: np.ndarray) -> float:
        return self._size_of(self._state.grains.unflat(self._carry @ motion))

    def _size_of(self, rows: np.ndarray) -> float:
        """Largest displacement (m) of a motion (r, n), that of a rotating grain at its rim."""
        turned = np.abs(rows[2:]).max(initial=0.0) * self._state.specimen.grains.grain_size
        return max(float(np.abs(rows[:2]).max()), float(turned))


def _zero(force: Callable[[float], float], margin: float, farthest: float) -> float:
    """Where a force (N), which falls by ``margin`` along the motion at first, is zero; at most ``farthest``.

    Less where it becomes nan on the way.
    """
    first = force(0.0)
    sign = math.copysign(1.0, first)
    low, at_low = 0.0, abs(first)
    high, at_high = min(at_low / max(margin, LITTLE), farthest), math.nan
    for _ in range(TRIALS):
        value = sign * force(sign * high)
        if abs(value) <= BALANCED * abs(first) or (value > 0 and high >= farthest):
            return sign * high
        if value > 0 and math.isnan(at_high):  # it still pulls: go on
            low, at_low, high = high, value, min(2 * high, farthest)
            continue
        if value > 0:
            low, at_low = high, value
        else:  # too far, or damaged
            top, at_high = high, value
        share = at_low / (at_low - at_high)
        high = low + (top - low) * (0.5 if math.isnan(share) else min(max(share, 0.1), 0.9))
    return sign * low


class _Trials:
    """Forces of the step at displacements near the present ones; the state is as before when they are done."""

    def __init__(self, state: State, coasting: Any) -> None:
        self._state = state
        self._shared = state.shared(1)
        self._parts = self._shared.parts
        rows = [*self._parts, *(part.books for part in state.parts.values())]
        kept = [getattr(row, name) for row in rows for name in changing(row.__class__)]
        self._kept = [(array, array.copy()) for array in kept]
        self._numbers = np.append(coasting.numbers, state.time_step)
        end = np.array([state.time - state.began])
        begin = end - state.time_step
        temperatures = np.full((1, 2), state.heat.temperature)
        self._rest, self._moving = (schedule_of(state, begin, end, pace, temperatures) for pace in (0.0, 1.0))
        memories = {id(rows.memory) for rows in (self._parts.bonds, self._parts.contacts)}
        self._memories = [(array, copy) for array, copy in self._kept if id(array) in memories]
        self._address, self.remembered = coasting.address, False  #: whether a law has changed its memory in the last
        detection = state.contacts.detection
        # A dashpot acts on the way of the last step: only one that goes nowhere is without it.
        self._rests = 2 if detection is not None and detection.damping and len(state.contacts) else 1

    def __enter__(self) -> _Trials:
        return self

    def __exit__(self, *error: object) -> None:
        self._back()
        self._parts.contacts.tally[:] = 0

    def _back(self) -> None:
        for array, copy in self._kept:
            array[...] = copy

    def forces(self, moved: np.ndarray, scale: float) -> np.ndarray:
        """(r, n) N at a displacement ``moved`` (r, n) m from here, for which the drives move ``scale`` times theirs."""
        state = self._state
        once = self._rest + (self._moving - self._rest) * (scale / state.time_step)
        velocity = state.freedoms.arrays.velocity
        velocity[:] = moved / state.time_step
        self._give_platens(velocity)
        self._step(once)
        velocity[:] = 0.0
        self._give_platens(velocity)
        for _ in range(self._rests):
            self._step(self._rest)
        found = state.freedoms.arrays.force.copy()
        self.remembered = any(not np.array_equal(array, copy) for array, copy in self._memories)
        self._back()
        return found

    def _give_platens(self, velocity: np.ndarray) -> None:
        at, platens = self._state.drives.arrays, self._parts.platens
        for k, column in enumerate(platens.column.tolist()):
            first = int(np.flatnonzero(at.column == column)[0])
            platens.velocity[:, k] = velocity[at.row[first], at.place[first]]

    def _step(self, schedule: np.ndarray) -> None:
        state = self._state
        own, numbers = np.empty((1, schedule.shape[1])), self._numbers.ctypes.data
        chunk = step.Chunk(1, state.steps, state.time_step, schedule, own, self._address, numbers)
        step.run(1, self._shared, chunk)
