"""The table of a study: one row for each case, and what follows from all of them."""

from __future__ import annotations

import functools
import math
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from grainlaw.arguments import Checked, checked, is_number
from grainlaw.columns import STRAIN, STRESS, quantity_of
from grainlaw.fields import ParameterError, checked_whole_number
from grainlaw.messages import nearest, refusal, short
from grainlaw.quantity import Quantity
from grainlaw.results.certificate import COST, LIMITS
from grainlaw.results.measure import Measure
from grainlaw.results.result import Result
from grainlaw.results.standard_measures import MEASURES
from grainlaw.studies import groups
from grainlaw.studies.case import FINISHED, OWN
from grainlaw.studies.design import RESERVED, check_results
from grainlaw.studies.export import as_html, as_text, to_latex, to_pandas, to_xarray, write_csv, write_parquet
from grainlaw.studies.statistics import By, Listing, label
from grainlaw.studies.store import Kept

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from grainlaw.drawing.figure import Figure


SHOWN = 12  #: levels that a refusal names
NO_PROPERTIES = (*LIMITS, *COST)  #: of the rock


def several(names: str | Sequence[str]) -> tuple[str, ...]:
    """One name or several, as several."""
    return (names,) if isinstance(names, str) else tuple(names)


def flat(row: Mapping[str, Any]) -> dict[str, Any]:
    """Factors, status and properties by name. Raises ParameterError where a property has the name of a factor."""
    check_results(row)
    found = {**row["factors"], "status": row["status"], "reason": row.get("reason", "")}
    for part in ("summary", "measures"):
        for name, value in (row.get(part) or {}).items():
            found.setdefault(name, value)
    return found


class Table(metaclass=Checked):
    """Rows of a study in the order of its cases: factors, status, and the properties of each test (SI).

    Prints as a table. ``table["strength"]`` is a column, nan for cases that failed. It holds nothing of the clock or
    of the machine: the same cases give the same table wherever and in whatever order they ran. Rows are read when the
    first of them is asked for: of a million, not before they are needed.
    """

    def __init__(
        self, rows: Iterable[Mapping[str, Any]], factors: Sequence[str], store: Kept,
        measures: Sequence[Measure] | None = None,
    ) -> None:  # fmt: skip
        self.factors, self._given, self.store = tuple(factors), rows, store
        known = MEASURES.values() if measures is None else measures
        self._measures = {measure.name: measure for measure in known}
        self._found: dict[str, np.ndarray] = {}

    @functools.cached_property
    def _stored(self) -> list[Mapping[str, Any]]:
        return list(self._given)

    @functools.cached_property
    def cases(self) -> list[str]:
        """Keys of the cases."""
        return [str(row["case"]) for row in self._stored]

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
        """What tests and measures of the rows have declared of their columns and properties, by name."""
        found = [entry for row in self._stored for kind in ("quantities", OWN) for entry in row.get(kind) or ()]
        return {entry["name"]: Quantity(**entry) for entry in found}

    @functools.cached_property
    def own(self) -> list[str]:
        """Quantities by measures of the user's own that any case has."""
        names = dict.fromkeys(entry["name"] for row in self._stored for entry in row.get(OWN) or ())
        return [name for name in names if name in self._had]

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

    def __getitem__(self, name: str) -> np.ndarray:
        """A column (k,): numbers, or texts. Raises ParameterError for a name that is not there."""
        self._check(name)
        if name not in self._found:
            values = [self.value(row, name) for row in self.rows]
            if name in self.quantities:
                column = np.array([math.nan if value is None else float(value) for value in values], dtype=float)
            elif values and all(map(is_number, values)):
                column = np.array(values)  # the levels of a factor
            else:
                column = np.empty(len(values), dtype=object)  # one entry a row, also of lists
                for k, value in enumerate(values):
                    column[k] = value
            column.flags.writeable = False  # the same one is given again
            self._found[name] = column
        return self._found[name]

    @functools.cached_property
    def quantities(self) -> list[str]:
        """Columns of numbers that are not factors."""
        names = [name for name in self.columns if name not in (*self.factors, *RESERVED)]
        return [n for n in names if all(row.get(n) is None or is_number(row[n]) for row in self.rows)]

    @functools.cached_property
    def _had(self) -> list[str]:
        """Quantities that any case has."""
        return [name for name in self.quantities if not np.isnan(self[name]).all()]

    @property
    def main(self) -> list[str]:
        """Quantities that are shown unasked; the first three properties where a test has none of them."""
        properties = [name for name in self._had if name not in NO_PROPERTIES]
        return [name for name in self._had if self.quantity(name).is_main] or properties[:3]

    @property
    def others(self) -> list[str]:
        """The other properties of the rock that any case has."""
        told = {*self.main, *NO_PROPERTIES}
        return [name for name in self._had if name not in told]

    def quantity(self, name: str) -> Quantity:
        """How a column, or one of the curves, is shown: as its measure or its test declares it."""
        measure = self._measures.get(name)
        return quantity_of(name, self.declared) if measure is None else measure.quantity

    def _listing(self, name: str, entries: Sequence[Any]) -> Listing:
        return Listing(name, entries, self.quantity(name))

    def levels(self, factor: str) -> list[Any]:
        """The levels of a factor in the order of the cases. Raises ParameterError for a name that is no factor."""
        self._check_factors("levels", factor)
        return list(dict.fromkeys(row[factor] for row in self.rows))

    def where(self, **levels: Any) -> Table:
        """The table of the cases with these levels. Raises ParameterError for a name that is no factor, or no level."""
        self._check_factors("where", *levels)
        for name, given in levels.items():
            if given not in (known := self.levels(name)):
                raise refusal(f"Table.where: {name}", given, f"a level: {', '.join(map(short, known[:SHOWN]))}")
        kept = [
            stored for stored, row in zip(self._stored, self.rows, strict=True)
            if all(row[name] == level for name, level in levels.items())
        ]  # fmt: skip
        return Table(kept, self.factors, self.store, tuple(self._measures.values()))

    @property
    def failed(self) -> list[dict[str, Any]]:
        """Factors, status and reason of the cases that did not come to their end."""
        return [
            {name: row[name] for name in (*self.factors, *RESERVED)} for row in self.rows if row["status"] != FINISHED
        ]

    def result(self, **factors: Any) -> Result:
        """The test of the one case with these levels, from a folder without frames.

        Raises ParameterError if there is not one.
        """
        self._check(*factors)
        found = [k for k, row in enumerate(self.rows) if all(row[name] == level for name, level in factors.items())]
        if len(found) != 1:
            given = ", ".join(f"{name} = {short(level)}" for name, level in factors.items())
            raise ParameterError(f"Table.result: {len(found)} cases have {given or 'any levels'}, there must be one")
        return self.run(found[0])

    def run(self, number: int) -> Result:
        """The test of one row, from a folder without frames.

        Raises ParameterError where there is none, as for many that failed.
        """
        try:
            return self.store.result(self.cases[number])
        except KeyError:
            row = self.rows[number]
            which, why = label(self.factors, row), f"{row['status']}, {row['reason']}"
            raise ParameterError(f"Table: the case {which} has no run: {why}") from None

    def has_run(self, number: int) -> bool:
        """Whether the test of a row is stored."""
        return bool(self._stored[number].get("run"))

    def is_finished(self, number: int) -> bool:
        """Whether the test of a row came to its end."""
        return bool(self.rows[number]["status"] == FINISHED)

    # --- what follows ------------------------------------------------------------------------------------------------

    @checked
    def means(self, *by: str) -> By:
        """Mean, deviation and 95 % interval of each quantity, of the cases with equal levels of the factors ``by``.

        ``table.means("law")["strength"]``. Raises ParameterError for a name that is no factor.
        """
        self._check_factors("means", *by)
        return By(self.quantities, lambda name: self._listing(name, groups.means(self, name, by)))

    @checked
    def paired(self, factor: str, over: str | Sequence[str] = "seed") -> By:
        """Mean difference of each quantity between the levels of a factor, of pairs that are equal in all else.

        The pairs differ in the factors ``over``, such as the seed of the grains; for each combination of the remaining
        factors there is one mean, with its 95 % interval and a sign test. Cases without a partner do not count. Raises
        ParameterError for a name that is no factor.
        """
        names = several(over)
        self._check_factors("paired", factor, *names)
        return By(self.quantities, lambda name: self._listing(name, groups.differences(self, name, factor, names)))

    @checked
    def interaction(self, first: str, second: str, over: str | Sequence[str] = "seed") -> By:
        """How the difference between levels of the factor ``first`` differs between levels of the factor ``second``.

        Of sets of four cases that are equal in all else. Raises ParameterError for a name that is no factor.
        """
        names = several(over)
        self._check_factors("interaction", first, second, *names)
        return By(
            self.quantities, lambda name: self._listing(name, groups.interactions(self, name, first, second, names))
        )

    def _check(self, *names: str) -> None:
        for name in names:
            if name not in self.columns:
                if failed := [words for words in self.doubts if name in self.declared and repr(name) in words]:
                    raise ParameterError(f"Table: no case has the measure '{name}': {failed[0]}")
                known = f"there are: {', '.join(self.columns)}"
                raise ParameterError(f"Table: there is no column '{name}'{nearest(name, self.columns)} ({known})")

    def _check_factors(self, where: str, *names: str) -> None:
        for name in names:
            if name not in self.factors:
                known = f"factors: {', '.join(self.factors) or 'none'}"
                raise ParameterError(
                    f"Table.{where}: there is no factor '{name}'{nearest(name, self.factors)} ({known})"
                )
        if len(set(names)) < len(names):
            raise ParameterError(f"Table.{where}: {', '.join(names)} are not allowed, each factor only once")

    # --- pictures ----------------------------------------------------------------------------------------------------

    @checked
    def plot(
        self, column: str, by: str | Sequence[str] = (), over: str | Sequence[str] = "seed", ax: Axes | None = None
    ) -> Figure:
        """A strip of points for each group of cases with equal levels of ``by``, with mean and 95 % interval.

        Groups are by all factors but those ``over``, unless ``by`` names others. Raises ParameterError.
        """
        from grainlaw.studies.figures import plot_strip

        over = several(over)
        self._check_factors("plot", *over)
        by = several(by) or tuple(groups.rest(self, *over))
        self._check_factors("plot", *by)
        return plot_strip(self, self._quantity("plot", column), by, over, ax)

    @checked
    def plot_paired(
        self, column: str, factor: str, over: str | Sequence[str] = "seed", ax: Axes | None = None
    ) -> Figure:
        """Lines that join the pairs of :meth:`paired`, with mean differences and intervals. Raises ParameterError."""
        from grainlaw.studies.figures import plot_paired

        over = several(over)
        self._check_factors("plot_paired", factor, *over)
        return plot_paired(self, self._quantity("plot_paired", column), factor, over, ax)

    @checked
    def plot_curves(
        self, by: str | Sequence[str] = (), y: str = STRESS, x: str = STRAIN, ax: Axes | None = None
    ) -> Figure:
        """Curves of the stored runs of each group, their median and the band of 10 to 90 %.

        They end where half of the runs have; one that has ended counts with its last value. Raises ParameterError.
        """
        from grainlaw.studies.figures import plot_curves

        by = several(by)
        self._check_factors("plot_curves", *by)
        return plot_curves(self, by, y, x, ax)

    @checked
    def plot_cracks(
        self, cases: Sequence[Mapping[str, Any]] | None = None, columns: int | None = None,
        over: str | Sequence[str] = "seed", ax: Sequence[Axes] | None = None,
    ) -> Figure:  # fmt: skip
        """Crack patterns side by side at one scale: of ``cases``, by their levels, or of the first of those ``over``.

        Cracks lie on the deformed specimen, its outline is that before the test. Raises ParameterError.
        """
        from grainlaw.studies.figures import plot_cracks

        if columns is not None:
            checked_whole_number("Table.plot_cracks: columns", columns, at_least=1)
        if cases is None:
            over = several(over)
            self._check_factors("plot_cracks", *over)
            cases = groups.first_of_each(self, over)
        return plot_cracks(self, cases, columns, ax)

    def _quantity(self, where: str, name: str) -> str:
        if name in self.columns and name not in (*self.factors, *RESERVED, *self.quantities):
            raise ParameterError(
                f"Table.{where}: '{name}' is no single number of each case, as a list of one per cycle"
            )
        if name not in self.quantities:
            raise ParameterError(f"Table.{where}: there is no quantity '{name}'{nearest(name, self.quantities)}")
        return name

    # --- other forms -------------------------------------------------------------------------------------------------

    to_pandas, to_latex, to_xarray = to_pandas, to_latex, to_xarray
    write_csv, write_parquet = write_csv, write_parquet
    __str__, _html = as_text, as_html

    @checked
    def write_report(
        self, file: str | os.PathLike[str], title: str = "", over: str | Sequence[str] | None = None
    ) -> None:
        """Write a page of HTML: factors, means, pairs, pictures, failures, cost and versions.

        Cases are samples of their groups ``over`` these factors; "seed", if there is one. Raises OSError.
        """
        from grainlaw.studies.report import write_report

        over = several(over if over is not None else "seed" if "seed" in self.factors else ())
        self._check_factors("write_report", *over)
        write_report(self, file, title, over)

    @property
    def _facts(self) -> dict[str, str]:
        return {"cases": str(len(self)), "factors": ", ".join(self.factors), "failed": str(len(self.failed))}
