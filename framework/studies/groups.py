"""Rows of a table that belong together: equal in some factors, and different in others."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from grainlaw.results.means import spread
from grainlaw.studies.statistics import Difference, Interaction, Mean, difference

if TYPE_CHECKING:
    from grainlaw.studies.table import Table

Group = dict[str, Any]  #: levels by factor
Rows = list[int]  #: numbers of rows


def groups(table: Table, by: Sequence[str], rows: Rows | None = None) -> Iterator[tuple[Group, Rows]]:
    """Levels of factors, and the rows that have them, in the order in which they first occur."""
    found: dict[tuple, Rows] = {}
    for k in range(len(table)) if rows is None else rows:
        found.setdefault(tuple(table.rows[k][name] for name in by), []).append(k)
    for key, members in found.items():
        yield dict(zip(by, key, strict=True)), members


def rest(table: Table, *factors: str) -> list[str]:
    """The other factors."""
    return [name for name in table.factors if name not in factors]


def first_of_each(table: Table, over: Sequence[str]) -> list[Group]:
    """Levels of the finished cases that have the first levels of the factors over that occur."""
    finished = [k for k in range(len(table)) if table.is_finished(k)]
    rows = next(groups(table, over, finished), ({}, []))[1]
    return [{name: table.rows[k][name] for name in table.factors} for k in rows]


def values_by_level(
    table: Table, name: str, factor: str, over: Sequence[str], rows: Rows
) -> dict[Any, dict[tuple, float]]:
    """A quantity of rows, where it is known, by the level of a factor and those of the factors over.

    Levels in the order of the whole table: which one is taken from which does not depend on what is missing.
    """
    column = table[name]
    found: dict[Any, dict[tuple, float]] = {level: {} for level in table.levels(factor)}
    for k in rows:
        if not np.isnan(column[k]):
            found[table.rows[k][factor]][tuple(table.rows[k][n] for n in over)] = float(column[k])
    present = {table.rows[k][factor] for k in rows}
    return {level: values for level, values in found.items() if level in present}


def means(table: Table, name: str, by: Sequence[str]) -> list[Mean]:
    """Of each group of rows with equal levels."""
    column = table[name]
    return [Mean(**spread(column[rows]), group=group) for group, rows in groups(table, by)]


def differences(table: Table, name: str, factor: str, over: Sequence[str]) -> list[Difference]:
    """Of each two levels of a factor, of pairs of rows that are equal in all else."""
    found = []
    for group, rows in groups(table, rest(table, factor, *over)):
        values = values_by_level(table, name, factor, over, rows)
        for first, second in itertools.combinations(values, 2):
            both = [k for k in values[first] if k in values[second]]
            alone = len(set(values[first]) ^ set(values[second]))
            pairs = np.array([(values[first][k], values[second][k]) for k in both]).reshape(-1, 2)
            found.append(difference(group, factor, (first, second), pairs, alone))
    return found


def interactions(table: Table, name: str, first: str, second: str, over: Sequence[str]) -> list[Interaction]:
    """Of each two levels of two factors, of sets of four rows that are equal in all else."""
    found = []
    for group, rows in groups(table, rest(table, first, second, *over)):
        members = {chosen[second]: k for chosen, k in groups(table, [second], rows)}
        parts = {
            level: values_by_level(table, name, first, over, members[level])
            for level in table.levels(second)
            if level in members
        }
        for (c, at_c), (d, at_d) in itertools.combinations(parts.items(), 2):
            for a, b in itertools.combinations([level for level in at_c if level in at_d], 2):
                four = (at_c[a], at_c[b], at_d[a], at_d[b])
                whole = [k for k in four[0] if all(k in values for values in four)]
                change = np.array([four[3][k] - four[2][k] - four[1][k] + four[0][k] for k in whole])
                found.append(
                    Interaction(**spread(change), group=group, factors=(first, second), first=(a, b), second=(c, d))
                )
    return found
