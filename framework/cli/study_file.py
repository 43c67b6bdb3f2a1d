"""The study of a TOML file: the file of ``grainlaw test`` with a table [vary]."""

from __future__ import annotations

import itertools
import os
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from grainlaw.cli.components import evolved
from grainlaw.cli.configuration import Numerics, configured
from grainlaw.cli.law_file import find_with_files
from grainlaw.cli.sections import Sections, assign, check_section, checked_sections, put, read_tables, value_toml
from grainlaw.cli.setups import SETUPS
from grainlaw.compiler.cache import is_portable
from grainlaw.contact import ContactLaw
from grainlaw.fields import ParameterError
from grainlaw.material import Material
from grainlaw.messages import refusal, short
from grainlaw.protocol import LoadingProtocol
from grainlaw.runs.parallel import Run
from grainlaw.studies.case import Recipe
from grainlaw.studies.study import Study
from grainlaw.unit_text import in_si

SEED = "seed"  #: the key over which means are taken
Place = tuple[str, ...]  #: section and keys
TYPES = ("law", "test", "rock")  #: sections that stand for their key ``type``
#: what a level FILE.py:NAME is
FILES: dict[Place, Any] = {("law", "type"): ContactLaw, ("rock", "type"): Material, ("test", "type"): LoadingProtocol}
ALONE = (("numerics", "threads"), ("numerics", "frames"))  #: what does not decide a result
MOST = 1_000_000  #: levels of a range
RANGE = re.compile(r"\s*([+-]?\d+)\s*\.\.\s*([+-]?\d+)\s*")
LIKE = 'a list such as ["10 MPa", "13 MPa"], or a range of whole numbers such as "1..20"'


@attrs.frozen
class Factor:
    """A key that is varied: its name in the table, its place, and its levels by what the table records of them."""

    name: str
    place: Place
    levels: dict[Any, Any]


def factors(vary: Any, file: Path) -> list[Factor]:
    """The factors of a table, in its order. Raises :class:`ParameterError`."""
    if not isinstance(vary, Mapping) or not vary:
        raise ParameterError(f'{file}: a study needs a table [vary], such as "sample.seed" = "1..20"')
    found: dict[Place, Any] = {}
    for key, given in _flat(vary):
        place = _place(key, file)
        if place in found:
            raise ParameterError(f"{file}: vary: '{key}' is given twice")
        found[place] = given
    names = _names(found)
    return [Factor(names[place], place, _levels(place, given, file)) for place, given in found.items()]


def _flat(table: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Keys with dots, also where a file has them without quotes, and TOML thus makes tables of them."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{key}.")
        else:
            yield before + key, value


def _place(key: str, file: Path) -> Place:
    section, *keys = (part.strip() for part in key.split("."))
    check_section(section, f"{file}: vary")
    place = (section, *(keys or ["type"] * (section in TYPES)))
    if len(place) == 1 or not all(place):
        raise ParameterError(f"{file}: vary: '{key}' is not allowed, it must be a key such as 'sample.seed'")
    if place in ALONE:
        raise ParameterError(f"{file}: vary: '{key}' is not allowed, it does not decide a result")
    return place


def _names(places: Mapping[Place, Any]) -> dict[Place, str]:
    """A key without its section where no other ends in it, else the whole key; ``law`` for its type."""
    short_names = {place: place[0] if place[1:] == ("type",) else ".".join(place[1:]) for place in places}
    times = Counter(short_names.values())
    return {place: name if times[name] == 1 else ".".join(place) for place, name in short_names.items()}


def _levels(place: Place, given: Any, file: Path) -> dict[Any, Any]:
    """What the table records of each level, and what stands in the section."""
    where = f"{file}: vary: {'.'.join(place)}"
    listed = _range(where, given) if isinstance(given, str) else given
    if not isinstance(listed, list):
        raise refusal(where, given, LIKE)
    if not listed:
        raise ParameterError(f"{where} has no levels, it must be {LIKE}")
    levels: dict[Any, Any] = {}
    for level in listed:
        if (recorded := _recorded(level)) in levels:
            raise ParameterError(f"{where} = {short(given)} is not allowed, it has the same level twice")
        kind = FILES.get(place) if isinstance(level, str) and ".py" in level else None
        try:
            levels[recorded] = find_with_files(os.fspath(file.parent / str(level)), kind)[0] if kind else level
        except ParameterError as error:
            raise ParameterError(f"{where} = {short(level)} is refused: {error}") from None
    return levels


def _range(where: str, text: str) -> list[int]:
    found = RANGE.fullmatch(text)
    if not found:
        raise refusal(where, text, LIKE)
    first, last = int(found[1]), int(found[2])
    if last < first:
        raise ParameterError(f"{where} = {short(text)} is not allowed: the range is empty, {last} is below {first}")
    if last - first >= MOST:
        raise ParameterError(f"{where} = {short(text)} is not allowed, it may have {MOST:,} levels at most")
    return list(range(first, last + 1))


def _recorded(level: Any) -> Any:
    """A quantity as a number in SI units, a table as its text."""
    if isinstance(level, str):
        number = in_si(level)
        if number is not None and re.fullmatch(r"\s*[+-]?\d+\s*", level):
            return int(level)
        return level if number is None else number
    return level if isinstance(level, (bool, int, float)) else value_toml(level)


@attrs.frozen(eq=False)
class FileCase:
    """A case from the sections of a file, in which the levels of factors take their places."""

    sections: Sections
    places: Mapping[str, Place]  #: of each factor, by its name
    quick: bool

    def __call__(self, **levels: Any) -> Run:
        sections = {name: dict(section) for name, section in self.sections.items()}
        for name, level in levels.items():
            put(sections, self.places[name], level)
        chosen = configured(sections["test"]["type"], sections, self.quick)
        return Run(chosen.specimen, chosen.law, chosen.protocol, **chosen.numerics.step_options)


def case_of(sections: Sections, places: Mapping[str, Place], quick: bool = False) -> FileCase:
    """The case of sections: without what is varied or decides no result, with the components of a user's files.

    Raises :class:`ParameterError`.
    """
    left_out = {*ALONE, *places.values()}
    made = {name: {k: v for k, v in section.items() if (name, k) not in left_out} for name, section in sections.items()}
    for (section, key), kind in FILES.items():
        given = made.get(section, {}).get(key)
        if isinstance(given, str) and ".py" in given:
            made[section][key] = find_with_files(given, kind)[0]
    return FileCase(made, places, quick)


@attrs.frozen(eq=False)
class StudyFile:
    """A study, and how its file calls it."""

    file: Path
    study: Study
    factors: list[Factor]
    options: list[str]  #: of the command, beside the file

    @property
    def folder(self) -> Path:
        """Where its store is if nothing else is said: beside the file, under its name."""
        return self.file.with_suffix("")

    def try_first(self) -> list[str]:
        """Build the first case of each rock, so that what is wrong with all of them is known at once; what to cite.

        Raises ParameterError.
        """
        rock = next((factor.name for factor in self.factors if factor.place == ("rock", "type")), None)
        firsts: dict[Any, Mapping[str, Any]] = {}
        for levels in self.study.design if rock else itertools.islice(self.study.design, 1):
            firsts.setdefault(levels[rock] if rock else None, levels)
        works: list[str] = []
        for first in firsts.values():
            try:
                works += Recipe(self.study.case, (), self.study.design.named).run(first).specimen.cite
            except ParameterError as error:
                words = ", ".join(f"{name} = {level}" for name, level in first.items())
                raise ParameterError(f"{self.file}: the case {words} is refused: {error}") from None
        return works

    @property
    def over(self) -> list[str]:
        """The factors that are seeds: means are taken over them."""
        return [factor.name for factor in self.factors if factor.place[-1] == SEED]

    @property
    def by(self) -> list[str]:
        """The factors that are no seeds."""
        return [factor.name for factor in self.factors if factor.place[-1] != SEED]


def study_of(file: Path, assignments: Sequence[str] = (), quick: bool = False) -> StudyFile:
    """Read the study of a file, with single values ``section.key=value`` in place of those of the file.

    Raises :class:`ParameterError`.
    """
    tables = read_tables(file)
    chosen = factors(tables.pop("vary", None), file)
    sections = checked_sections(tables, file)
    for assignment in assignments:
        assign(sections, assignment)
    places = {factor.name: factor.place for factor in chosen}
    evolved(Numerics, sections.get("numerics", {}), "numerics")
    if ("test", "type") not in places.values() and not sections.get("test", {}).get("type"):
        raise ParameterError(
            f'{file}: the test is missing: [test] type = "...", one of {", ".join(SETUPS)}, or FILE.py:TEST'
        )
    sections.setdefault("test", {})
    levels: dict[str, Any] = {factor.name: factor.levels for factor in chosen}
    study = Study(case_of(sections, places, quick), **levels)
    options = [word for assignment in assignments for word in ("--set", assignment)] + ["--quick"] * quick
    options += ["--portable"] * is_portable()
    return StudyFile(file, study, chosen, options)
