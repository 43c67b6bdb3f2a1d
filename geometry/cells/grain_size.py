"""How many grains a tessellator makes: fields checked on construction, the number checked against the region."""

from __future__ import annotations

import math
import os
from typing import Any

import numpy as np

from grainlaw.arguments import is_number
from grainlaw.fields import ParameterError, checked_field, checked_points
from grainlaw.messages import refusal, short
from grainlaw.region import Region

BYTES_PER_GRAIN = 10_000  #: of a specimen with all that a simulation keeps of it


def length() -> Any:
    """Declare a length of a component (m) that may be left out."""

    def check(where: str, value: Any) -> float | None:
        if value is None:
            return None
        if not is_number(value) or not 0 < value < math.inf:
            raise ParameterError(f"{where} = {short(value)} m is not allowed, it must be a finite number above 0")
        return float(value)

    return checked_field(check, default=None, metadata={"unit": "m"})


def some_points(where: str, value: Any) -> tuple[tuple[float, float], ...]:
    """At least one point (x, y) m. Raises :class:`ParameterError`, which begins with ``where``."""
    points = checked_points(where, value)
    if not len(points):
        raise refusal(where, value, "a list of at least one point (x, y) in m")
    return tuple((x, y) for x, y in points.tolist())


def require_one(component: Any, *others: str) -> None:
    """Raise :class:`ParameterError` unless exactly one of ``grains``, ``grain_size`` and ``others`` is given."""
    given = [name for name in ("grains", "grain_size", *others) if getattr(component, name) is not None]
    if len(given) != 1:
        which = "neither" if not given else "both" if given[-1] == "grain_size" else " and ".join(given)
        further = "".join(f", or {name}" for name in others)
        raise ParameterError(f"{type(component).__name__}: give either grains or grain_size, not {which}{further}")


def grain_count(component: Any, region: Region) -> int:
    """Number of grains of ``component`` in ``region``; refuses what fits neither the region nor the memory."""
    name = type(component).__name__
    if component.grains is not None:
        count, given = component.grains, f"grains = {component.grains}"
    else:
        extent = np.ptp(region.bounds, axis=0).min()
        if component.grain_size > extent:
            raise ParameterError(
                f"{name}: grain_size = {component.grain_size:g} m is not allowed, it must be at most {extent:g} m, "
                "the shorter extent of the region"
            )
        area = max(component.grain_size**2, np.finfo(float).tiny)  # of a size that has no square
        count = max(1, round(min(region.area / area, float(np.finfo(float).max))))
        given = f"grain_size = {component.grain_size:g} m, which makes {count} grains,"
    check_memory(name, given, count)
    return count


def check_memory(name: str, given: str, count: int) -> None:
    """Raise :class:`ParameterError` if this computer cannot hold so many grains."""
    check_room(f"{name}: {given} is not allowed", count)


def check_room(fault: str, count: float) -> None:
    """Raise :class:`ParameterError`, which begins with ``fault``, for more grains than the memory holds."""
    room = _memory() // BYTES_PER_GRAIN
    if count > room:
        raise ParameterError(f"{fault}, the memory of this computer holds about {room} grains")


def _memory() -> int:
    """Physical memory in bytes; where the system does not tell, more than anybody has."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):
        return 1 << 60
