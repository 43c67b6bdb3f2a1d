"""A model: a specimen with its laws and the detection of contacts, checked, compiled and in groups."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any

import attrs
import numpy as np

from grainlaw.compiler.batch import Compiled, compile_law
from grainlaw.contact import (
    ContactLaw,
    Laws,
    check_laws,
    check_names,
    declared_stiffness,
    each_law,
    keys_of_bonds,
    law_between,
)
from grainlaw.detection import Detection
from grainlaw.edge_keys import CRACKS, names_of
from grainlaw.engine.parts.laws import LawGroup, memory_of
from grainlaw.fields import ParameterError
from grainlaw.specimen import Specimen


@attrs.frozen(eq=False)
class PreparedLaw:
    """A law as one contact follows it: with the mean of each parameter that differs between contacts."""

    law: ContactLaw
    compiled: Compiled


def prepared(law: ContactLaw) -> PreparedLaw:
    """A law that was checked, made uniform and compiled. Raises :class:`ParameterError` and CompilationError."""
    declared_stiffness(law)
    one: ContactLaw = uniform(law) if attrs.has(type(law)) else law
    return PreparedLaw(one, compile_law(one))


def uniform(component: Any, number: Callable[[np.ndarray], Any] = np.mean) -> Any:
    """The component with one number of each parameter that differs between contacts: their mean, or as told."""
    changes = {}
    for field in attrs.fields(type(component)):
        value = getattr(component, field.name)
        if isinstance(value, np.ndarray):
            changes[field.alias] = float(number(value))
        elif attrs.has(type(value)) and (one := uniform(value, number)) is not value:
            changes[field.alias] = one
    return attrs.evolve(component, **changes) if changes else component


class Model:
    """What runs: a specimen, the laws of its bonds and contacts, and how contacts are found. Made once for each run.

    ``laws`` is one law or laws by phases; ``detection`` None leaves the bonds alone. Raises :class:`ParameterError` for
    an object that is not a law; what is asked of it raises for a law that does not compile, and for a pair of phases
    without a law.
    """

    def __init__(self, specimen: Specimen, laws: Laws, detection: Detection | None = None) -> None:
        check_laws("law", laws)
        self.specimen, self.laws, self.detection = specimen, laws, detection

    @property
    def of_bonds(self) -> list[ContactLaw]:
        """The laws of bonds, as they were given. Raises :class:`ParameterError` where there is none."""
        return each_law(self.laws)

    @cached_property
    def _prepared(self) -> dict[int, PreparedLaw]:
        """By the identity of the law that was given."""
        every = [*self.of_bonds, *(each_law(self.detection.law) if self.detection and self.detection.law else ())]
        return {id(law): prepared(law) for law in every}

    @property
    def each(self) -> list[PreparedLaw]:
        """All laws of bonds and contacts."""
        return list(self._prepared.values())

    @property
    def fingerprints(self) -> Any:
        """Of the code of the law of bonds, or of the laws by their phases."""
        if isinstance(self.laws, Mapping):
            return {str(phases): self._prepared[id(law)].compiled.key for phases, law in self.laws.items()}
        return self._prepared[id(self.laws)].compiled.key

    @cached_property
    def bonds(self) -> tuple[np.ndarray, list[LawGroup]]:
        """Order of the bonds in which those of each law are consecutive, and the groups of the laws."""
        order, sizes = laws_of_bonds(self.specimen, self.laws)
        groups, first = [], 0
        for law, size in sizes:
            compiled = compile_law(law, 2 * size)
            groups.append(LawGroup(law, compiled, np.zeros(memory_of(compiled)), first, first + size))
            first += size
        return order, groups

    @cached_property
    def contacts(self) -> dict[tuple[int, int], LawGroup]:
        """The laws of all pairs of phases that can meet, by default those of their bonds after breaking."""
        if self.detection is None:
            return {}
        if self.detection.law is not None:
            check_names(self.specimen, self.detection.law)
        grains = self.specimen.grains
        phases, counts = np.unique(grains.phase, return_counts=True)
        groups = {}
        for k, one in enumerate(phases.tolist()):
            for other in phases[k + (counts[k] < 2) :].tolist():
                law = self._law_between(one, other)
                compiled = self._prepared[id(law)].compiled
                groups[one, other] = LawGroup(law, compiled, broken_memory(compiled))
        return groups

    def _law_between(self, one: int, other: int) -> ContactLaw:
        names = names_of(self.specimen.grains, one), names_of(self.specimen.grains, other)
        for laws in (None if self.detection is None else self.detection.law, self.laws):
            law = None if laws is None else law_between(laws, *names)
            if law is not None:
                return law
        pair = " and ".join(map(self.specimen.grains.phase_name, (one, other)))
        raise ParameterError(
            f"law: no law is given for contacts between the phases {pair}, which may meet; "
            f"give one in law or in Detection(law=...)"
        )


def broken_memory(law: Compiled) -> np.ndarray:
    """(m,) memory of a contact that was pulled apart until it broke and then closed."""
    memory = np.zeros((memory_of(law), 1))
    for opening in (0.0, *2.0 ** np.arange(-60, 41), 0.0):  # m, from so small to so large that any law breaks
        before = memory.copy()
        law.batch(np.array([opening]), np.zeros(1), memory)
        if not np.isfinite(memory).all():
            memory = before
        if "damage" in law.memory and memory[law.memory.index("damage"), 0] >= 1:
            break
    law.batch(np.zeros(1), np.zeros(1), memory)
    return memory[:, 0]


def laws_of_bonds(specimen: Specimen, laws: Laws) -> tuple[np.ndarray, list[tuple[ContactLaw, int]]]:
    """Order of the bonds in which those of each law are consecutive, and the laws with their numbers of bonds.

    Raises :class:`ParameterError` for an object that is not a law, and for a pair of phases without one.
    """
    check_laws("law", laws)
    if CRACKS in specimen.grains.kinds and not (isinstance(laws, Mapping) and CRACKS in laws):
        raise ParameterError(
            f"law: the {CRACKS} have no law of their own, and would be bonded as all else; give law={{'{CRACKS}': "
            "Friction(kn=..., ks=..., friction_angle=30), ...: law}, or another one"
        )
    count = len(specimen.mesh.interfaces)
    if isinstance(laws, ContactLaw):
        return np.arange(count), [(laws, count)]
    each = keys_of_bonds(specimen, laws)
    sizes = np.bincount(each, minlength=len(laws))
    return np.argsort(each, kind="stable"), list(zip(laws.values(), sizes.tolist(), strict=True))
