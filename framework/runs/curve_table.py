"""The table in which a run collects its curves."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np


class CurveTable:
    """Rows of named numbers, kept as arrays that grow."""

    def __init__(self) -> None:
        self.count = 0
        self._table: dict[str, np.ndarray] = {}

    def append(self, row: Mapping[str, float]) -> None:
        """Add a row. A name that is new makes a new column, with nan in the earlier rows."""
        for name, value in row.items():
            column = self._table.get(name)
            if column is None or self.count == len(column):
                longer = np.full(max(1024, 2 * self.count), np.nan)
                longer[: self.count] = np.nan if column is None else column
                column = self._table[name] = longer
            column[self.count] = value
        self.count += 1

    def since(self, first: int) -> dict[str, np.ndarray]:
        """The rows from number ``first`` on."""
        return {name: column[first : self.count] for name, column in self._table.items()}

    def fill(self, curves: Mapping[str, np.ndarray]) -> None:
        """Take whole columns of equal length in place of all rows."""
        self._table = {name: np.array(values) for name, values in curves.items()}
        self.count = len(next(iter(curves.values()), ()))
