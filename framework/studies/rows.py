"""Rows of a table from those of a store."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable, Mapping, Sequence
from numbers import Real
from typing import Any

from grainlaw.arguments import Checked
from grainlaw.quantity import Quantity
from grainlaw.studies.case import FINISHED
from grainlaw.studies.design import RESERVED
from grainlaw.studies.statistics import level


def several(names: str | Sequence[str]) -> tuple[str, ...]:
    """One name or several, as several."""
    return (names,) if isinstance(names, str) else tuple(names)


def flat(row: Mapping[str, Any]) -> dict[str, Any]:
    """Factors, status and properties by name; a factor hides a property of its name."""
    found = {**row["factors"], "status": row["status"], "reason": row.get("reason", "")}
    for part in ("summary", "measures"):
        for name, value in (row.get(part) or {}).items():
            found.setdefault(name, value)
    return found


def is_number(value: Any) -> bool:
    return value is None or (isinstance(value, Real) and not isinstance(value, bool))


def number(value: Any) -> float:
    return math.nan if value is None else float(value)


def label(factors: Sequence[str], row: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {level(name, row[name])}" for name in factors)


class Rows(metaclass=Checked):
    """Rows that are read when the first of them is asked for: of a million, not before they are needed."""

    def __init__(self, rows: Iterable[Mapping[str, Any]], factors: Sequence[str]) -> None:
        self.factors, self._given = tuple(factors), rows

    @functools.cached_property
    def _stored(self) -> list[Mapping[str, Any]]:
        return list(self._given)

    @functools.cached_property
    def cases(self) -> list[str]:
        """Keys of the cases."""
        return [str(row["case"]) for row in self._stored]

    @functools.cached_property
    def stored(self) -> list[str]:
        """Keys of the runs, empty where there is none."""
        return [str(row.get("run") or "") for row in self._stored]

    @functools.cached_property
    def costs(self) -> list[dict[str, float]]:
        """CPU time and seconds (s) and bytes of each case, as measured."""
        return [dict(row.get("cost") or {}) for row in self._stored]

    @functools.cached_property
    def rows(self) -> list[dict[str, Any]]:
        """Factors, status, reason and properties of each case, by name; of one that failed, those until then."""
        return [flat(row) for row in self._stored]

    @functools.cached_property
    def declared(self) -> dict[str, Quantity]:
        """What the tests of the rows have declared of their columns and properties, by name."""
        found = [entry for row in self._stored for entry in row.get("quantities") or ()]
        return {entry["name"]: Quantity(**entry) for entry in found}

    @functools.cached_property
    def doubts(self) -> dict[str, list[int]]:
        """Numbers of finished rows that fail the certificate, or whose specimen had not failed, by what is doubted."""
        found: dict[str, list[int]] = {}
        for number, row in enumerate(self._stored):
            for words in row.get("doubts") or () if row["status"] == FINISHED else ():
                found.setdefault(words, []).append(number)
        return found

    @functools.cached_property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns."""
        found = dict.fromkeys(name for row in self.rows for name in row)
        return (*self.factors, *RESERVED, *(n for n in found if n not in (*self.factors, *RESERVED)))

    def value(self, row: Mapping[str, Any], name: str) -> Any:
        """What counts of a row; None for what a test that failed had measured by then, which is no end."""
        return row.get(name) if row["status"] == FINISHED or name in (*self.factors, *RESERVED) else None

    def __len__(self) -> int:
        return len(self.rows)
