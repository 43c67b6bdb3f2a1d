"""The command that finds the contact parameters of a rock."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import click

from grainlaw.arguments import Checked
from grainlaw.calibration.calibrate import FRESH, first_look
from grainlaw.calibration.calibrate import calibrate as run
from grainlaw.calibration.result import NUMBERS, PICTURES, REPORT, TABLES, Calibration
from grainlaw.calibration.stiffness_search import CONTACTS
from grainlaw.calibration.targets import AIMS, Targets, needed_tests
from grainlaw.calibration.trials import DISC, HALF_DISC, PRISM, SHAPES, USUAL
from grainlaw.cli.answers import answer, json_option
from grainlaw.cli.components import evolved, refuse_unknown, settings
from grainlaw.cli.configuration import Configuration, configured, write_config
from grainlaw.cli.law_copy import copied_files
from grainlaw.cli.minerals import section_of, table_of
from grainlaw.cli.running import contents, end_stopped, refusing
from grainlaw.cli.sections import Sections, assign, checked_sections, read_tables
from grainlaw.contact import ContactLaw
from grainlaw.declared import units_of
from grainlaw.edge_keys import words_of
from grainlaw.fields import ParameterError, whole_number
from grainlaw.messages import refusal, short
from grainlaw.results.files import warn, writable_folder
from grainlaw.runs.progress_file import read
from grainlaw.runs.stopping import Stopped
from grainlaw.specimen import Specimen
from grainlaw.studies.watched import RUNNING, watched
from grainlaw.studies.workers import ExecutorError
from grainlaw.unit_text import quantity

# --- the file ---------------------------------------------------------------------------------------------------------
# That of ``grainlaw test`` with the tables [targets] and [free].

OWN = ("targets", "free", "tied", "calibration", "tests", DISC, HALF_DISC)  #: tables that other files do not have
OTHERS = ("sample", "rock", "rocks", "law", "numerics")
TEST_OF = {PRISM: "uniaxial-compression", DISC: "brazilian", HALF_DISC: "semi-circular-bend"}
TOUGHNESS = re.compile(r"(.*?)[\s*·]*(?:m\^?0\.5|m\^?\(?1/2\)?|sqrt\(m\)|√m)\s*")


@attrs.frozen(kw_only=True)
class Settings(metaclass=Checked):
    """The table [calibration]."""

    elastic: str = CONTACTS
    seeds: int = whole_number(default=3, at_least=2)
    budget: int = whole_number(default=100, at_least=1)
    more: int = whole_number(default=9, at_least=0)
    fresh: Any = FRESH  # a number, or one by shape
    seed: int = whole_number(default=0, at_least=0)
    also: Sequence[str] = ()


@attrs.frozen(eq=False)
class FileSpecimens:
    """Specimens of one shape by their seed, from the sections of a file."""

    shape: str
    sections: Sections
    quick: bool

    def configuration(self, seed: int) -> Configuration:
        sample = {**self.sections["sample"], "seed": seed}
        return configured(TEST_OF[self.shape], {**self.sections, "sample": sample}, self.quick)

    def __call__(self, seed: int) -> Specimen:
        return self.configuration(seed).specimen


@attrs.frozen(eq=False)
class CalibrationFile:
    """What a file asks for."""

    specimens: dict[str, FileSpecimens]
    given: dict[str, Any]  #: the other arguments of :func:`grainlaw.calibrate`


def calibration_of(
    file: Path, assignments: Sequence[str] = (), quick: bool = False, options: Mapping[str, Any] | None = None
) -> CalibrationFile:
    """Read the calibration of a file; ``options`` that are not None take the place of those in [calibration].

    Raises :class:`ParameterError`.
    """
    sections = checked_sections(read_tables(file), file, (*OWN, *OTHERS), " in a calibration")
    for assignment in assignments:
        assign(sections, assignment, (*OWN, *OTHERS))
    beside = {name: sections.pop(name, {}) for name in OWN}
    refuse_unknown("numerics", sections.get("numerics", {}), ["refinement"])
    for name, of in (("sample", sections.get("sample", {})), *((shape, beside[shape]) for shape in (DISC, HALF_DISC))):
        if "file" in of:
            raise ParameterError(f"{file}: {name}.file is not allowed: seeds must make other grains")
    over = {name: value for name, value in (options or {}).items() if value is not None}
    how = evolved(Settings, {**beside["calibration"], **over}, "calibration")
    for name, example in (("targets", 'ucs = "126 MPa"'), ("free", 'cohesion = ["20 MPa", "60 MPa"]')):
        if not beside[name]:
            raise ParameterError(f"{file}: a calibration needs a table [{name}], such as {example}")
    targets = targets_of(beside["targets"])
    needed = {SHAPES[test] for test in needed_tests([*targets.given, *(n for n in how.also if n in AIMS)])}
    shapes = {PRISM: sections.get("sample", {})}
    shapes |= {shape: beside[shape] for shape in (DISC, HALF_DISC) if beside[shape] or shape in needed}
    specimens = {
        shape: FileSpecimens(shape, {**sections, "sample": dict(sample)}, quick) for shape, sample in shapes.items()
    }
    chosen = specimens[PRISM].configuration(1)
    if not isinstance(chosen.law, ContactLaw):
        name, keys = short(sections.get("rock", {}).get("type")), ", ".join(map(words_of, chosen.law))
        raise ParameterError(
            f"{file}: rock.type = {name} is not allowed in a calibration, which finds one law of all contacts: it has "
            f"others ({keys})"
        )
    units = units_of(type(chosen.law))
    refuse_unknown("free", beside["free"], units)
    refuse_unknown("tied", beside["tied"], units)
    refuse_unknown("tests", beside["tests"], USUAL)
    given = {
        "targets": targets,
        "law": chosen.law,
        "free": {name: _pair(f"free.{name}", ends, units[name]) for name, ends in beside["free"].items()},
        "tied": {name: _tie(f"tied.{name}", tie) for name, tie in beside["tied"].items()},
        "tests": {
            name: evolved(USUAL[name], table_of(entry, f"tests.{name}"), f"tests.{name}")
            for name, entry in beside["tests"].items()
        },
        **attrs.asdict(how, recurse=False),
    }
    return CalibrationFile(specimens, given)


def targets_of(table: Mapping[str, Any]) -> Targets:
    """The table [targets]: quantities, or lists of a value and its uncertainty. Raises :class:`ParameterError`."""
    refuse_unknown("targets", table, [*AIMS, "confinements", "triaxial"])
    values: dict[str, Any] = {}
    for name, given in table.items():
        if name == "confinements":
            listed = given if isinstance(given, list) else [given]
            values[name] = [quantity(each, "Pa", f"targets.{name}") for each in listed]
        elif name == "triaxial":
            values[name] = _triaxial(given)
        elif isinstance(given, list):
            values[name] = tuple(_value(name, each) for each in given)
        else:
            values[name] = _value(name, given)
    return Targets(**values)


def _triaxial(given: Any) -> dict[float, Any]:
    if not isinstance(given, list) or not all(isinstance(row, list) and len(row) in (2, 3) for row in given):
        wanted = "a list of [confinement, strength] or [confinement, strength, uncertainty]"
        raise refusal("targets.triaxial", given, wanted)
    rows = [[quantity(each, "Pa", "targets.triaxial") for each in row] for row in given]
    return {pressure: strength[0] if len(strength) == 1 else tuple(strength) for pressure, *strength in rows}


def _value(name: str, given: Any) -> float:
    unit = AIMS[name].unit
    if name == "fracture_toughness":
        unit = "Pa"
        if isinstance(given, str):
            if not (found := TOUGHNESS.fullmatch(given)):
                raise refusal(f"targets.{name}", given, "a number in Pa sqrt(m) or a string such as '1.2 MPa sqrt(m)'")
            given = found[1]
    return quantity(given, unit, f"targets.{name}")


def _pair(where: str, given: Any, unit: str) -> tuple[float, ...]:
    if not isinstance(given, list) or len(given) != 2:
        raise refusal(where, given, "a list: lowest and highest")
    low, high = (quantity(each, unit, where) for each in given)
    if low >= high:
        raise refusal(where, given, "a list: lowest first, then highest")
    return low, high


def _tie(where: str, given: Any) -> tuple[str, float]:
    if not isinstance(given, Mapping) or set(given) != {"of", "times"}:
        raise refusal(where, given, 'like {of = "mode_i_energy", times = 2}')
    return str(given["of"]), quantity(given["times"], "1", f"{where}.times")


FIRST = ("targets", "law", "free", "tied", "elastic", "seeds", "seed")  #: arguments of a first look
STORE = "tests"
CALIBRATED = {PRISM: "calibrated.toml", DISC: "calibrated-disc.toml", HALF_DISC: "calibrated-half-disc.toml"}


@click.command()
@click.argument("file", metavar="FILE.toml", type=click.Path(path_type=Path))
@click.option(
    "--set", "assignments", metavar="KEY=VALUE", multiple=True,
    help="One value of the file, such as calibration.fresh=20; can be repeated.",
)  # fmt: skip
@click.option("--quick", is_flag=True, help="Small specimens.")
@click.option(
    "--out", type=click.Path(path_type=Path), help="Folder to write to.  [default: the file's name without its ending]"
)
@click.option("--budget", type=int, help="Points that are tested at most.  [default: 100]")
@click.option("--seeds", type=int, help="Specimens of each point.  [default: 3]")
@click.option("--first", is_flag=True, help="Only what is expected by no test, in seconds.")
@click.option("--workers", type=int, help="Tests at a time on this machine.  [default: one for each core]")
@click.option("--on", metavar="ADDRESS", help="Scheduler of a Dask cluster, such as tcp://host:8786.")
@json_option
def calibrate(
    *, file: Path, assignments: tuple[str, ...], quick: bool, out: Path | None, budget: int | None, seeds: int | None,
    first: bool, workers: int | None, on: str | None,
) -> None:  # fmt: skip
    """Find the contact parameters of a rock from its laboratory tests, and which of them the tests determine.

    FILE.toml is the file of "grainlaw test" (docs/configuration.md) with the tables [targets], such as
    ucs = "126 MPa", and [free], such as tensile_strength = ["5 MPa", "30 MPa"] (docs/calibration.md).

    Writes report.html, its pictures, calibration.json with all numbers, and calibrated.toml, the rock for "grainlaw
    test NAME --config" (calibrated-disc.toml with the discs of a Brazilian test). All tests are kept in the folder: a
    calibration that is stopped goes on with the same call. The exit code is 1 where targets are in conflict. With
    --first nothing is run or written: an emulator that comes with grainlaw tells what it expects of Mohr-Coulomb
    contacts or cohesive cracks between even grains.
    """
    with refusing():
        asked = calibration_of(file, assignments, quick, {"budget": budget, "seeds": seeds})
        if first:
            known = {name: asked.given[name] for name in FIRST}
            look = first_look(**known, specimens=asked.specimens)
            answer(look, **look.summary)
            if look.posterior is None:
                raise click.ClickException("no parameters in the ranges meet the targets")
            return
        folder = writable_folder(file.with_suffix("") if out is None else out)
        before = _answer_before(folder, asked)
    try:
        with refusing():
            found = run(**asked.given, specimens=asked.specimens, store=folder / STORE, workers=workers, on=on)
            _write(found, asked, folder)
    except Stopped as stopped:
        if (so_far := getattr(stopped, "result", None)) is not None:
            if _is_tried(folder, asked):
                click.echo(f"\n{folder} keeps the answer that it has, which was tried on fresh specimens")
            else:
                _write(so_far, asked, folder)
                click.echo(f"\n{so_far}")
                before = []
        end_stopped(stopped, contents(folder, of_before=before), "go on with the same command")
    except ExecutorError as error:
        raise click.ClickException(f"{error}; go on with the same command") from None
    answer(f"{found}\n\n{contents(folder)}", folder=str(folder), **found.summary)
    if not found.is_plausible:
        raise click.ClickException("the targets are in conflict: no parameters in the ranges meet them together")


def _answer_before(folder: Path, asked: CalibrationFile) -> list[str]:
    """The files of an answer that is there; warns where it is that of other targets or ranges, or one is looked for."""
    with contextlib.suppress(ParameterError):
        if watched(folder).state == RUNNING:
            warn(f"another process calibrates in {folder}: the answer of the one that ends last will stay there")
    written = (REPORT, NUMBERS, TABLES, *CALIBRATED.values(), *(f"{name}.png" for name in PICTURES))
    there = [name for name in written if (folder / name).exists()]
    old = read(folder / NUMBERS)
    if old is not None and not _answers(old, asked):
        warn(f"{folder} has the answer to other targets or ranges: {', '.join(there)} are replaced in the end, and "
             f"tests that are the same are not made again")  # fmt: skip
    return there


def _answers(old: Mapping[str, Any], asked: CalibrationFile) -> bool:
    """Whether the numbers of an answer are to the same targets and ranges."""
    targets = {name: attrs.asdict(target) for name, target in asked.given["targets"].given.items()}
    ranges = {name: list(ends) for name, ends in asked.given["free"].items()}
    return bool(old.get("targets") == targets and old.get("ranges") == ranges)


def _is_tried(folder: Path, asked: CalibrationFile) -> bool:
    """Whether the folder has an answer that was tried on fresh specimens: it is better than one that was not."""
    old = read(folder / NUMBERS)
    return old is not None and bool(old.get("checks")) and _answers(old, asked)


def _write(found: Calibration, asked: CalibrationFile, folder: Path) -> None:
    found.write(folder)
    for shape, name in CALIBRATED.items():
        if found.is_plausible and shape in asked.specimens:
            seed, about = found.typical(shape)
            _write_rock(found, asked.specimens[shape].configuration(seed), folder / name, about=about)
        else:
            (folder / name).unlink(missing_ok=True)  # of another answer


def _write_rock(found: Calibration, chosen: Configuration, file: Path, about: str) -> None:
    sections = {name: section for name, section in chosen.sections.items() if name != "test"}
    material = found.rock(chosen.specimen).material
    minerals: dict[Any, Any] = dict(material) if isinstance(material, Mapping) else {...: material}
    rock = minerals.pop(...)
    sections, _ = copied_files(chosen, sections, file.parent)
    sections["law"] = settings(found.law, ContactLaw) | {"type": sections["law"]["type"]}
    sections["rock"] = sections["rock"] | settings(rock) | {"type": sections["rock"]["type"]}  # it may cite
    if minerals:
        sections["rocks"] = section_of(minerals, rock)
    if not chosen.numerics.refinement:
        del sections["numerics"]  # which a rock by file has not
    write_config(file, "NAME", sections, about)
