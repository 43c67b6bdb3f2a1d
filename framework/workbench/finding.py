"""What breaks a property of a law, in words and numbers."""

from __future__ import annotations

from typing import Any

import attrs


@attrs.frozen
class Finding:
    """A broken property: where, and by how much."""

    text: str
    size: float = 0.0


def place(point: Any) -> str:
    """A point of a path in words."""
    return f"opening {words(point[0], 'm')}, slip {words(point[1], 'm')}"


def words(value: Any, unit: str) -> str:
    """A number for a report: lengths in um, tractions in MPa."""
    factor, shown = {"m": (1e6, "um"), "Pa": (1e-6, "MPa"), "J/m2": (1.0, "J/m2")}[unit]
    return f"{float(value) * factor:.4g} {shown}"
