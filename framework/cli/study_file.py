"""The study of a TOML file: the file of ``grainlaw test`` with a table [vary]."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs

from grainlaw.cli.components import evolved
from grainlaw.cli.configuration import Numerics, configured
from grainlaw.cli.law_file import find_law, find_material
from grainlaw.cli.sections import Sections, assign, checked_sections, put, read_tables
from grainlaw.cli.setups import SETUPS
from grainlaw.cli.vary import ALONE, Factor, Place, factors
from grainlaw.compiler.cache import is_portable
from grainlaw.parameter import ParameterError
from grainlaw.runs.parallel import Run
from grainlaw.studies.case import Recipe
from grainlaw.studies.study import Study

SEED = "seed"  #: the key over which means are taken


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
        chosen = configured(str(sections["test"]["type"]), sections, self.quick)
        numerics = chosen.numerics
        return Run(
            chosen.specimen, chosen.law, chosen.protocol,
            time_step_factor=numerics.time_step_factor, mass_scaling=numerics.mass_scaling,
        )  # fmt: skip


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

    def try_first(self) -> None:
        """Build the first case, so that what is wrong with all of them is known at once. Raises ParameterError."""
        first = next(iter(self.study.design))
        try:
            Recipe(self.study.case, (), self.study.design.named).run(first)
        except ParameterError as error:
            levels = ", ".join(f"{name} = {level}" for name, level in first.items())
            raise ParameterError(f"{self.file}: the case {levels} is refused: {error}") from None

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

    Raises :class:`ParameterError`, :class:`~grainlaw.cli.law_file.LawReferenceError`.
    """
    tables = read_tables(file)
    chosen = factors(tables.pop("vary", None), file)
    sections = checked_sections(tables, file)
    for assignment in assignments:
        assign(sections, assignment)
    places = {factor.name: factor.place for factor in chosen}
    evolved(Numerics, sections.get("numerics", {}), "numerics")
    for section, key in ALONE:
        sections.get(section, {}).pop(key, None)
    _check_test(sections, places, file)
    law = sections.get("law", {}).get("type")
    if isinstance(law, str) and ".py" in law and ("law", "type") not in places.values():
        sections["law"]["type"] = find_law(os.fspath(law))
    rock = sections.get("rock", {}).get("type")
    if isinstance(rock, str) and ".py" in rock and ("rock", "type") not in places.values():
        sections["rock"]["type"] = find_material(os.fspath(rock))
    levels: dict[str, Any] = {factor.name: factor.levels for factor in chosen}
    study = Study(FileCase(sections, places, quick), **levels)
    options = [word for assignment in assignments for word in ("--set", assignment)] + ["--quick"] * quick
    options += ["--portable"] * is_portable()
    return StudyFile(file, study, chosen, options)


def _check_test(sections: Sections, places: Mapping[str, Place], file: Path) -> None:
    if ("test", "type") not in places.values() and not sections.setdefault("test", {}).get("type"):
        raise ParameterError(f'{file}: the test is missing: [test] type = "...", one of {", ".join(SETUPS)}')
    sections.setdefault("test", {})
