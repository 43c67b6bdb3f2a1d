"""The stable time step of a running specimen: its highest frequency, scaled masses, and closures that stiffen."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import scipy

from grainlaw.engine.parts.laws import LawGroup, by_interface
from grainlaw.engine.stability import highest_frequency, scale_masses, stiffness_matrix, touching_stiffness
from grainlaw.engine.state import State
from grainlaw.integration import Integrator
from grainlaw.messages import refusal
from grainlaw.polygon import linked

AHEAD = 1.2  #: reserve of stiffness when the step is shortened, so that this is rare
LOOKS = 20, 500  #: steps between checks of the stiffness, with and without a closure that stiffens
SOFTER = 1.5  #: the step grows again once the stiffness is so many times below what it allows for
LITTLE = 1e-3  #: of a closure: increment with which its tangent is found
LEAST = 1e-9  #: of a grain's size: smaller closures count as none
SAVED = ("allowed", "touching", "frequency", "fluid")  #: what the step goes by


def in_one_piece(state: State) -> bool:
    """Whether bonds and ties connect all grains, so that no contact can form at the rim soon."""
    pairs = state.mesh.held_together
    return len(pairs) > 0 and not linked(state.specimen.grains.count, *pairs.T).any()


def _stiffens(law: LawGroup, memory: np.ndarray, size: float) -> bool:
    """Whether a law stiffens in closure anywhere up to a hundredth of a grain's ``size`` (m)."""
    none = np.zeros(memory.shape[1])
    tangents = [
        law.tangent(none - closure, none, memory, LITTLE * closure) for closure in size * np.geomspace(1e-8, 1e-2, 13)
    ]
    return bool(np.any(np.max(tangents, axis=0) > 1.05 * tangents[0]))


class StableStep:
    """Highest frequency of a state, at first with the laws' declared stiffness; scales masses first if asked to."""

    def __init__(self, state: State, mass_scaling: float = 1.0) -> None:
        self.state = state
        self._size = state.specimen.grains.grain_size
        laws = [(group, state.bonds.memory_of(group)) for group in state.bonds.groups]
        laws += [(group, group.virgin[:, None]) for group in state.contacts.groups]
        #: whether a law stiffens in closure
        self.stiffening = any(_stiffens(law, memory, self._size) for law, memory in laws if memory.shape[1])
        self.look = LOOKS[0] if self.stiffening else LOOKS[1]  #: steps after which to ask ``has_changed``
        self.fluid = (
            0.0  #: 1/s2 that the present step allows for: what a compressed fluid adds to the squared frequency
        )
        self.allowed = 1.0  #: highest closure stiffness, over kn, for which the present step is stable
        self.touching = self._touching or not in_one_piece(state)  #: whether the step allows for contacts at the rim
        matrix, mass = self._matrix(self.state.stiffness[0], self._rim()), self._masses()
        self.frequency = highest_frequency(matrix, mass)  #: 1/s
        if mass_scaling > 1 and self.frequency > 0:
            alike = state.grains.alike(state.freedoms.arrays.mass.shape[1])
            scaled = scale_masses(matrix, mass, mass_scaling, alike)
            state.mass_added, self.frequency = scaled.added, scaled.frequency
            state.freedoms.arrays.mass[:] = state.grains.unflat(scaled.mass)

    def step(self, integrator: Integrator) -> float:
        """Stable time step (s) of an integrator: infinite for a free grain that cannot meet another.

        A dashpot of a contact or a law shortens it by sqrt(1 + b^2) - b, where b is its share of the critical damping:
        its force is taken from the velocity half a step before.
        """
        if self.frequency == 0:
            return math.inf
        frequency = math.sqrt(self.frequency**2 + self.fluid)
        detection, groups = self.state.contacts.detection, (*self.state.bonds.groups, *self.state.contacts.groups)
        damping = 0.0 if detection is None else detection.damping
        damping += max((group.law.retardation_time for group in groups), default=0.0) * frequency / 2
        if not (step := integrator.stable_step(frequency)) > 0:
            raise refusal(f"{type(integrator).__name__}.stable_step", step, "a time above 0 (s)")
        return step * (math.sqrt(1 + damping**2) - damping)

    def save(self) -> dict[str, Any]:
        """What the step goes by."""
        return {name: getattr(self, name) for name in SAVED}

    def restore(self, saved: Mapping[str, Any]) -> None:
        """Go on from what :meth:`save` returned."""
        for name in SAVED:
            setattr(self, name, saved[name])

    @property
    def _touching(self) -> bool:
        """Whether contacts may form at the rim soon: this depends on where grains are, not on the last search."""
        return self.state.contacts.are_near(self.state.nodes.arrays.displacement)

    def has_changed(self) -> bool:
        """Find the frequency again if contacts at the rim have formed or a closure is stiffer or softer; whether so.

        A contact that replaces a bond is taken to be as stiff as the stiffest contact.
        """
        formed = not self.touching and self._touching
        if not (self.stiffening or formed):
            return False
        touching, replaced = self._touch_ratio(), np.tile(self.state.replaced, 2)
        tangents = np.where(replaced, touching * self.state.stiffness[0], self._closure_tangents())
        ratio = float(np.max(tangents / self.state.stiffness[0], initial=touching))
        if not np.isfinite(ratio):  # the check of the energies reports where the run became unstable
            return False
        stiffer, softer = ratio > 1.05 * self.allowed, max(AHEAD * ratio, 1.0) * SOFTER < self.allowed
        if not (stiffer or softer or formed):
            return False
        self.touching = self.touching or formed
        self.allowed = max(AHEAD * ratio, 1.0) if stiffer or softer else self.allowed
        kn = self.state.stiffness[0]
        if self.allowed > 1:
            kn = np.maximum(kn, AHEAD * tangents)
        self.frequency = highest_frequency(self._matrix(kn, self._rim()), self._masses())
        return True

    def fluid_has_changed(self) -> bool:
        """Ask the fluid of an injection how stiff it is; whether the step no longer fits it."""
        now = self.state.fluids.stiffness(self.state.freedoms.arrays.mass)
        fits = now <= self.fluid <= AHEAD * SOFTER * now
        self.fluid = self.fluid if fits else AHEAD * now
        return not fits

    def _touch_ratio(self) -> float:
        """Highest tangent stiffness of closed contacts, over that declared by their law; at least 1."""
        contacts, ratio = self.state.contacts, 1.0
        arrays, closed, groups = contacts.arrays, contacts.arrays.overlap > 0, contacts.groups_of(contacts.books.keys)
        for g in np.unique(groups[closed]).tolist():
            places, group = np.flatnonzero(closed & (groups == g)), contacts.groups[g]
            memory, little = arrays.memory[: group.depth, places], LITTLE * arrays.overlap[places]
            tangent = group.tangent(arrays.opening[places], arrays.slip[places], memory, little)
            ratio = max(ratio, float(np.max(tangent)) / float(np.mean(group.law.stiffness[0])))
        return ratio

    def _closure_tangents(self) -> np.ndarray:
        """(p,) Pa/m: tangent stiffness in closure of bonds; for open ones that at first contact."""
        bonds = self.state.bonds
        tangents = np.empty(2 * len(bonds))
        for group in bonds.groups:
            places, memory, lift = group.points(len(bonds)), bonds.memory_of(group), group.row("dilation")
            rest = 0.0 if lift < 0 else memory[lift]  # opening at which its faces begin to press
            closed = np.minimum(self.state.opening[places], rest)
            little = LITTLE * max(float(np.max(rest - closed, initial=0.0)), LEAST * self._size)
            tangents[places] = group.tangent(closed, self.state.slip[places], memory, little)
        return tangents

    def stiffness(self) -> scipy.sparse.csr_matrix:
        """N/m over the freedoms, in the order of :meth:`Grains.flat`, of zones, bonds and edges that touch.

        As the laws declare it; what touches is taken to stick.
        """
        return self.sound()(self.state.mesh.nodes)

    def sound(self) -> Callable[[np.ndarray], scipy.sparse.csr_matrix]:
        """The same as a function of the nodes (i, 2) m, for grains that turn later; edges that touch now go on to."""
        state, touching = self.state, self._touching_stiffness()

        def with_nodes(nodes: np.ndarray) -> scipy.sparse.csr_matrix:
            matrix = self._nodal(state.stiffness[0], None, nodes)
            return state.grains.over_freedoms(matrix if touching is None else matrix + touching, nodes)

        return with_nodes

    def _touching_stiffness(self) -> scipy.sparse.csr_matrix | None:
        """N/m over node components (2 i); None where there are no contacts."""
        contacts = self.state.contacts
        if not len(contacts):
            return None
        arrays, groups = contacts.arrays, contacts.groups_of(contacts.books.keys)
        stiffness = np.array([[float(np.mean(k)) for k in group.law.stiffness] for group in contacts.groups])[groups]
        nodes = arrays.used[arrays.node]
        places = self.state.positions[nodes]
        return touching_stiffness(places, nodes, stiffness[:, 0], stiffness[:, 1], len(self.state.mesh.nodes))

    def _matrix(self, kn: np.ndarray, rim: tuple[np.ndarray, float, float] | None) -> scipy.sparse.csr_matrix:
        """Stiffness over the freedoms, in the order of :meth:`Grains.flat`, with contacts at the rim."""
        return self.state.grains.over_freedoms(self._nodal(kn, rim, None))

    def _nodal(
        self, kn: np.ndarray, rim: tuple[np.ndarray, float, float] | None, nodes: np.ndarray | None
    ) -> scipy.sparse.csr_matrix:
        bonds = self.state.bonds
        rows = by_interface(bonds.order, np.stack([kn, bonds.stiffness[1]]))
        return stiffness_matrix(self.state.specimen, rows[0], rows[1], rim, nodes)

    def _rim(self) -> tuple[np.ndarray, float, float] | None:
        """Edges that were never bonded, and the highest stiffness of the laws of their contacts."""
        contacts = self.state.contacts
        if not self.touching or not contacts.groups:
            return None
        kn, ks = (max(float(np.max(group.law.stiffness[k])) for group in contacts.groups) for k in (0, 1))
        return contacts.rim, self.allowed * kn, ks

    def _masses(self) -> np.ndarray:
        """Mass of each freedom, in the order of the matrix."""
        return self.state.grains.flat(self.state.freedoms.arrays.mass)
