"""The table of a study: one row for each case, and what follows from all of them."""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from numbers import Real
from typing import TYPE_CHECKING, Any

import numpy as np

from grainlaw.arguments import checked, nearest, short
from grainlaw.naming import aligned, shown
from grainlaw.parameter import ParameterError
from grainlaw.results.archive import from_bytes
from grainlaw.results.result import Result
from grainlaw.studies import groups
from grainlaw.studies.case import FINISHED
from grainlaw.studies.design import RESERVED
from grainlaw.studies.export import to_pandas, to_xarray, write_csv, write_parquet
from grainlaw.studies.statistics import Listing, level
from grainlaw.studies.store import Store

if TYPE_CHECKING:
    import pandas
    import xarray

#: columns that the table prints if it has them
PRINTED = ("peak_stress", "peak_strain", "apparent_modulus", "crack_damage", "tensile_cracks", "shear_cracks")
LINES = 40  #: rows that it prints


class By(Mapping[str, Listing]):
    """What is known of each quantity, by its name; found when it is asked for."""

    def __init__(self, names: Sequence[str], find: Callable[[str], Listing]) -> None:
        self._names, self._find = list(names), find

    def __getitem__(self, name: str) -> Listing:
        if name not in self._names:
            raise ParameterError(f"there is no column '{name}'{nearest(name, self._names)}")
        return self._find(name)

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


class Table:
    """Rows of a study in the order of its cases: factors, status, and the properties of each test (SI).

    Prints as a table. ``table["peak_stress"]`` is a column, nan for cases that failed. It holds nothing of the clock or
    of the machine: the same cases give the same table wherever and in whatever order they ran.
    """

    def __init__(self, rows: Sequence[Mapping[str, Any]], factors: Sequence[str], store: Store) -> None:
        self.factors, self.store = tuple(factors), store
        self.cases = [str(row["case"]) for row in rows]
        self.rows: list[dict[str, Any]] = [_flat(row) for row in rows]
        columns = dict.fromkeys(name for row in self.rows for name in row)
        self.columns = (*self.factors, *RESERVED, *(n for n in columns if n not in (*self.factors, *RESERVED)))
        self._found: dict[str, np.ndarray] = {}
        self.costs: list[dict[str, float]] = [dict(row.get("cost") or {}) for row in rows]

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, name: str) -> np.ndarray:
        """A column (k,): numbers, or texts. Raises ParameterError for a name that is not there."""
        self._check(name)
        if name not in self._found:
            self._found[name] = self._column(name)
        return self._found[name]

    def _column(self, name: str) -> np.ndarray:
        values = [row.get(name) for row in self.rows]
        if name in self.quantities:
            column = np.array([_number(value) for value in values], dtype=float)
        elif values and all(map(_is_number, values)) and None not in values:
            column = np.array(values)  # the levels of a factor
        else:
            column = np.array(values, dtype=object)
        column.flags.writeable = False  # the same one is given again
        return column

    @functools.cached_property
    def quantities(self) -> list[str]:
        """Columns of numbers that are not factors."""
        names = (name for name in self.columns if name not in (*self.factors, *RESERVED))
        return [name for name in names if all(_is_number(row.get(name)) for row in self.rows)]

    def levels(self, factor: str) -> list[Any]:
        """The levels of a factor in the order of the cases. Raises ParameterError for a name that is no factor."""
        self._check_factors("levels", factor)
        return list(dict.fromkeys(row[factor] for row in self.rows))

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Factors, status and reason of the cases that did not come to their end."""
        return [
            {name: row[name] for name in (*self.factors, *RESERVED)} for row in self.rows if row["status"] != FINISHED
        ]

    def result(self, **factors: Any) -> Result:
        """The test of the one case with these levels, without frames. Raises ParameterError if there is not one."""
        self._check(*factors)
        found = [k for k, row in enumerate(self.rows) if all(row[name] == level for name, level in factors.items())]
        if len(found) != 1:
            given = ", ".join(f"{name} = {short(level)}" for name, level in factors.items())
            raise ParameterError(f"Table.result: {len(found)} cases have {given or 'any levels'}, there must be one")
        try:
            return from_bytes(self.store.run_of(self.cases[found[0]]), f"{self.store.path}: the run")
        except KeyError:
            row = self.rows[found[0]]
            raise ParameterError(
                f"Table.result: there is no run of this case: {row['status']}, {row['reason']}"
            ) from None

    # --- what follows ------------------------------------------------------------------------------------------------

    @checked
    def means(self, *by: str) -> By:
        """Mean, deviation and 95 % interval of each quantity, of the cases with equal levels of the factors ``by``.

        ``table.means("law")["peak_stress"]``. Raises ParameterError for a name that is no factor.
        """
        self._check_factors("means", *by)
        return By(self.quantities, lambda name: Listing(name, groups.means(self, name, by)))

    @checked
    def paired(self, factor: str, over: str | Sequence[str] = "seed") -> By:
        """Mean difference of each quantity between the levels of a factor, of pairs that are equal in all else.

        The pairs differ in the factors ``over``, such as the seed of the grains; for each combination of the remaining
        factors there is one mean, with its 95 % interval and a sign test. Cases without a partner do not count. Raises
        ParameterError for a name that is no factor.
        """
        names = several(over)
        self._check_factors("paired", factor, *names)
        return By(self.quantities, lambda name: Listing(name, groups.differences(self, name, factor, names)))

    @checked
    def interaction(self, first: str, second: str, over: str | Sequence[str] = "seed") -> By:
        """How the difference between levels of the factor ``first`` differs between levels of the factor ``second``.

        Of sets of four cases that are equal in all else. Raises ParameterError for a name that is no factor.
        """
        names = several(over)
        self._check_factors("interaction", first, second, *names)
        return By(self.quantities, lambda name: Listing(name, groups.interactions(self, name, first, second, names)))

    def _check(self, *names: str) -> None:
        for name in names:
            if name not in self.columns:
                raise ParameterError(f"Table: there is no column '{name}'{nearest(name, self.columns)}")

    def _check_factors(self, where: str, *names: str) -> None:
        for name in names:
            if name not in self.factors:
                known = f"factors: {', '.join(self.factors) or 'none'}"
                raise ParameterError(
                    f"Table.{where}: there is no factor '{name}'{nearest(name, self.factors)} ({known})"
                )
        if len(set(names)) < len(names):
            raise ParameterError(f"Table.{where}: {', '.join(names)} are not allowed, each factor only once")

    # --- other forms -------------------------------------------------------------------------------------------------

    def to_pandas(self) -> pandas.DataFrame:
        """The rows as a DataFrame. Raises ParameterError without pandas."""
        return to_pandas(self)

    def to_xarray(self) -> xarray.Dataset:
        """The quantities, with the factors as axes. Raises ParameterError without xarray, and for equal cases."""
        return to_xarray(self)

    def write_csv(self, file: str | os.PathLike[str]) -> None:
        """Write the rows, numbers with all their digits. Raises OSError."""
        write_csv(self, file)

    def write_parquet(self, file: str | os.PathLike[str]) -> None:
        """Write the rows for other programs. Raises ParameterError without pandas and pyarrow, OSError."""
        write_parquet(self, file)

    def __str__(self) -> str:
        names = [*self.factors, "status", *(name for name in PRINTED if name in self.columns)]
        rows = [[shown(name).heading for name in names]]
        rows += [[self._text(name, row.get(name)) for name in names] for row in self.rows[:LINES]]
        more = f"\n... and {len(self) - LINES} more" if len(self) > LINES else ""
        reasons = "".join(
            f"\n{_label(self.factors, row)}: {row['status']}, {row['reason']}" for row in self.failed[:LINES]
        )
        return aligned(rows, rule=True) + more + reasons

    __repr__ = __str__

    def _text(self, name: str, value: Any) -> str:
        return level(name, value) if name in self.factors else shown(name).text(value)


def several(names: str | Sequence[str]) -> tuple[str, ...]:
    """One name or several, as several."""
    return (names,) if isinstance(names, str) else tuple(names)


def _flat(row: Mapping[str, Any]) -> dict[str, Any]:
    """Without what a test that failed had measured by then: it is not what the others measured at their end."""
    flat = {**row["factors"], "status": row["status"], "reason": row.get("reason", "")}
    for part in ("summary", "measures") if row["status"] == FINISHED else ():
        for name, value in (row.get(part) or {}).items():
            flat.setdefault(name, value)
    return flat


def _is_number(value: Any) -> bool:
    return value is None or (isinstance(value, Real) and not isinstance(value, bool))


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


def _label(factors: Sequence[str], row: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {level(name, row[name])}" for name in factors)
