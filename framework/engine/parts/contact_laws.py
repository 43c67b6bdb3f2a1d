"""The laws of contacts: for each pair of phases that can meet, by default the law of their bonds after breaking."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from grainlaw.compiler.batch import Compiled, compile_law
from grainlaw.contact import Laws, check_names, law_between, names_of
from grainlaw.detection import Detection
from grainlaw.engine.parts.laws import LawGroup, memory_of
from grainlaw.parameter import ParameterError
from grainlaw.specimen import Specimen


def uniform(component: Any) -> Any:
    """The component with the mean of each parameter that differs between contacts."""
    changes = {}
    for field in attrs.fields(type(component)):
        value = getattr(component, field.name)
        if isinstance(value, np.ndarray):
            changes[field.name] = float(value.mean())
        elif attrs.has(type(value)) and uniform(value) is not value:
            changes[field.name] = uniform(value)
    return attrs.evolve(component, **changes) if changes else component


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


def contact_groups(specimen: Specimen, laws: Laws, detection: Detection) -> dict[tuple[int, int], LawGroup]:
    """The laws of all pairs of phases that can meet. Raises :class:`ParameterError` for a pair without one."""
    if detection.law is not None:
        check_names(specimen, detection.law)
    phases, counts = np.unique(specimen.grains.phase, return_counts=True)
    groups = {}
    for k, one in enumerate(phases.tolist()):
        for other in phases[k + (counts[k] < 2) :].tolist():
            names = names_of(specimen, one), names_of(specimen, other)
            own = None if detection.law is None else law_between(detection.law, *names)
            law = own or law_between(laws, *names)
            if law is None:
                pair = f"{specimen.grains.phase_name(one)} and {specimen.grains.phase_name(other)}"
                raise ParameterError(
                    f"law: no law is given for contacts between the phases {pair}, which may meet; "
                    f"give one in law or in Detection(law=...)"
                )
            compiled = compile_law(uniform(law))
            groups[one, other] = LawGroup(law, compiled, broken_memory(compiled))
    return groups
