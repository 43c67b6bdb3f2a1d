"""Rows of a table from those of a store."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

from grainlaw.studies.case import FINISHED
from grainlaw.studies.statistics import level


def several(names: str | Sequence[str]) -> tuple[str, ...]:
    """One name or several, as several."""
    return (names,) if isinstance(names, str) else tuple(names)


def flat(row: Mapping[str, Any]) -> dict[str, Any]:
    """Without what a test that failed had measured by then: it is not what the others measured at their end."""
    found = {**row["factors"], "status": row["status"], "reason": row.get("reason", "")}
    for part in ("summary", "measures") if row["status"] == FINISHED else ():
        for name, value in (row.get(part) or {}).items():
            found.setdefault(name, value)
    return found


def is_number(value: Any) -> bool:
    return value is None or (isinstance(value, Real) and not isinstance(value, bool))


def number(value: Any) -> float:
    return math.nan if value is None else float(value)


def label(factors: Sequence[str], row: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {level(name, row[name])}" for name in factors)
