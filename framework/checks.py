"""Checks of what a component is given beyond the bounds of single numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from grainlaw.fields import ParameterError


def first_of(wrong: Any, *values: Any) -> list[float]:
    """The values at the first place where something is wrong."""
    return [float(np.broadcast_to(value, np.shape(wrong)).flat[int(np.argmax(wrong))]) for value in values]


def _of_several(message: str, wrong: Any) -> ParameterError:
    error = ParameterError(message)
    error.wrong = np.asarray(wrong)
    return error


def not_above(component: Any, name: str, limit: str, reason: str) -> None:
    """Refuse a component whose parameter ``name`` exceeds its parameter ``limit``."""
    value, bound = getattr(component, name), getattr(component, limit)
    wrong = np.greater(value, bound)
    if np.any(wrong):
        first, first_bound = first_of(wrong, value, bound)
        raise _of_several(
            f"{type(component).__name__}: {name} = {first:g} is above {limit} = {first_bound:g}: {reason}", wrong
        )


def not_beyond_apex(component: Any, tension: str, cohesion: str, angle: str) -> None:
    """Refuse a tensile strength that the shear strength c + sigma_n tan(phi) does not let the contact reach."""
    strength, c = getattr(component, tension), getattr(component, cohesion)
    used = strength * np.tan(np.radians(getattr(component, angle)))
    wrong = np.greater(used, c * (1 + 1e-12))
    if np.any(wrong):
        first, first_used, first_c = first_of(wrong, strength, used, c)
        raise _of_several(
            f"{type(component).__name__}: {tension} = {first:g} Pa lies beyond the apex of the shear strength, "
            f"{cohesion} / tan({angle}) = {first * first_c / first_used:g} Pa; no stress can reach it",
            wrong,
        )
