"""The cases of a study: all combinations of the levels of factors, a list, or points that fill ranges evenly."""

from __future__ import annotations

import inspect
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import attrs
import numpy as np
import scipy

from grainlaw.arguments import checked
from grainlaw.fields import ParameterError, checked_number, checked_whole_number
from grainlaw.messages import nearest, refusal, short

Factors = dict[str, Any]  #: name and level, as it is recorded
RESERVED = ("status", "reason")  #: columns of every table
PLAIN = (bool, int, float, str, type(None))


@attrs.frozen(eq=False)
class Design:
    """Cases in their order: levels by the names of the factors."""

    names: tuple[str, ...]
    levels: dict[str, dict[Any, Any]]  #: of each factor: what is recorded, and what the case is given
    listed: tuple[Factors, ...] | None = None  #: the cases, if they are not all combinations

    def __len__(self) -> int:
        return math.prod(map(len, self.levels.values())) if self.listed is None else len(self.listed)

    def __iter__(self) -> Iterator[Factors]:
        if self.listed is not None:
            yield from self.listed
            return
        for chosen in itertools.product(*self.levels.values()):
            yield dict(zip(self.names, chosen, strict=True))

    @property
    def named(self) -> dict[str, dict[Any, Any]]:
        """Levels of which something else is recorded: what a case is given for that, by the names of the factors."""
        found = {n: {label: level for label, level in e.items() if level is not label} for n, e in self.levels.items()}
        return {name: levels for name, levels in found.items() if levels}


def factorial(factors: Mapping[str, Any]) -> Design:
    """All combinations; the last factor changes fastest."""
    levels = {name: _levels(name, given) for name, given in factors.items()}
    return Design(tuple(levels), levels)


def listed(cases: Any, factors: Mapping[str, Any]) -> Design:
    """The cases of a list of mappings or of a DataFrame, each with all combinations of further factors."""
    rows = cases.to_dict("records") if hasattr(cases, "to_dict") else cases
    if isinstance(rows, (str, Mapping)) or not isinstance(rows, Iterable):
        raise refusal("Study: cases", cases, "a list of mappings or a DataFrame")
    found: list[Factors] = []
    for number, row in enumerate(rows):
        if not isinstance(row, Mapping) or not all(isinstance(name, str) for name in row):
            raise refusal(f"Study: cases[{number}]", row, "a mapping of names to levels")
        found.append({name: _plain(f"cases[{number}]", name, level) for name, level in row.items()})
    if not found:
        raise ParameterError("Study: cases is empty, it must have at least one")
    names = tuple(found[0])
    for number, row in enumerate(found):
        if set(row) != set(names):
            raise ParameterError(
                f"Study: cases[{number}] has the factors {', '.join(row)}, but cases[0] has {', '.join(names)}"
            )
    further = factorial(factors)
    if both := set(names) & set(further.names):
        raise ParameterError(f"Study: the factor '{min(both)}' is given twice, in cases and by itself")
    every = tuple({**row, **more} for row in found for more in further)
    if len({frozenset(row.items()) for row in every}) < len(every):
        raise ParameterError("Study: cases has the same case twice")
    return Design((*names, *further.names), dict(further.levels), every)


def _levels(name: str, given: Any) -> dict[Any, Any]:
    """What is recorded of each level, and the level."""
    if isinstance(given, Mapping):
        levels = {_label(name, label): level for label, level in given.items()}
        if len(levels) < len(given):
            raise ParameterError(f"Study: {name} = {short(list(given))} is not allowed, two levels have the same name")
    elif isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        raise refusal(f"Study: {name}", given, "a list of levels")
    else:
        plain = [_plain("", name, level) for level in given]
        levels = {level: level for level in plain}
        if len(levels) < len(plain):
            raise ParameterError(f"Study: {name} = {short(plain)} is not allowed, it has the same level twice")
    if not levels:
        raise ParameterError(f"Study: {name} has no levels, it must have at least one")
    return levels


def _label(name: str, label: Any) -> Any:
    """What is recorded of a level that has a name, or a number, of its own."""
    return _plain("", name, label) if isinstance(label, (int, float, np.number)) else str(label)


def _plain(where: str, name: str, level: Any) -> Any:
    """A level as a number or a text of Python's own."""
    plain = level.item() if isinstance(level, np.generic) else level
    if type(plain) not in PLAIN or (isinstance(plain, float) and not math.isfinite(plain)):
        place = f"{where}: {name}" if where else name
        raise ParameterError(
            f"Study: {place} = {short(level)} is not allowed as a level, it must be a finite number or a text; give "
            f"others by names, {name}={{'name': ...}}"
        )
    return plain


def check_signature(case: Callable[..., Any], names: Sequence[str]) -> None:
    """Refuse factors that a function does not take, and one without those it needs."""
    if not callable(case):
        raise refusal("Study: case", case, "a function of the factors")
    if taken := [name for name in names if name in RESERVED]:
        raise ParameterError(f"Study: a factor may not be called '{taken[0]}', a column of the table has this name")
    try:
        known = inspect.signature(case).parameters.values()
    except (TypeError, ValueError):  # of a function of another language
        return
    takes = [p.name for p in known if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    words = f"{getattr(case, '__name__', 'case')}({', '.join(takes)})"
    if not any(p.kind is p.VAR_KEYWORD for p in known):
        for name in names:
            if name not in takes:
                raise ParameterError(f"Study: there is no factor '{name}' in {words}{nearest(name, takes)}")
    needed = [p.name for p in known if p.default is p.empty and p.name in takes]
    if absent := [name for name in needed if name not in names]:
        raise ParameterError(f"Study: {words} needs the factor '{absent[0]}'")
    if any(p.kind is p.POSITIONAL_ONLY and p.default is p.empty for p in known):
        raise ParameterError(f"Study: {words} has a parameter without a name; factors are given by their names")


def check_results(row: Mapping[str, Any]) -> None:
    """Refuse a factor that a test has measured under the same name, as something else."""
    found = {**(row.get("measures") or {}), **(row.get("summary") or {})}
    for name, level in row["factors"].items():
        if name in found and found[name] != level:
            raise ParameterError(
                f"Study: the factor '{name}' = {short(level)} has the name of a result of the tests, here "
                f"{short(found[name])}, which could not be asked for; give the factor another name (tests that have "
                "run are not run again)"
            )


@checked
def latin_hypercube(count: int, *, seed: int = 0, **ranges: Any) -> list[dict[str, float]]:
    """Points that fill ranges evenly, one in each of ``count`` slices of every range; ``cases`` of a study.

    ``latin_hypercube(50, strength=(5 * MPa, 20 * MPa), energy=(50, 300))``; the same seed gives the same points.
    (McKay, Beckman and Conover 1979, doi:10.1080/00401706.1979.10489755.) Raises ParameterError.
    """

    drawn = scipy.stats.qmc.LatinHypercube
    return _points("latin_hypercube", count, seed, ranges, lambda d: drawn(d, rng=seed).random(count))


@checked
def sobol(count: int, *, seed: int = 0, **ranges: Any) -> list[dict[str, float]]:
    """Points of a scrambled Sobol sequence in ranges; even where ``count`` is a power of two; ``cases`` of a study.

    (Sobol 1967; scrambled as Owen 1998, doi:10.1006/jcom.1998.0487.) Raises ParameterError.
    """

    def points(dimension: int) -> np.ndarray:
        return scipy.stats.qmc.Sobol(dimension, rng=seed).random_base2(math.ceil(math.log2(count)))[:count]

    return _points("sobol", count, seed, ranges, points)


def _points(
    name: str, count: int, seed: int, ranges: Mapping[str, Any], points: Callable[[int], np.ndarray]
) -> list[dict[str, float]]:
    checked_whole_number(f"{name}: count", count, at_least=1)
    checked_whole_number(f"{name}: seed", seed, at_least=0)
    if not ranges:
        raise ParameterError(f"{name}: there is no range; give at least one, as {name}(50, strength=(5, 20))")
    ends = []
    for factor, given in ranges.items():
        try:
            low, high = given
        except (TypeError, ValueError):
            raise refusal(f"{name}: {factor}", given, "(low, high)") from None
        low = checked_number(f"{name}: {factor}", low)
        ends.append((low, checked_number(f"{name}: {factor}", high, above=low)))
    low, high = np.array(ends).T
    inside = np.clip(low + points(len(ends)) * (high - low), low, high)  # rounding may lead out
    return [dict(zip(ranges, row, strict=True)) for row in inside.tolist()]
