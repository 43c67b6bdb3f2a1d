"""A test that is ready to run, from sections of names and quantities."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import attrs

from grainlaw.cli.components import (
    begin_with,
    choices,
    drafted,
    evolved,
    explained,
    name_of,
    own,
    refuse_unknown,
    settings,
)
from grainlaw.cli.default_rock import LAWS, NAMES, ROCK
from grainlaw.cli.law_file import find_with_files
from grainlaw.cli.minerals import check_cracks, laws_by_key, materials, table_of
from grainlaw.cli.rock_file import checked_cite, is_rock, over_rock, rock_file
from grainlaw.cli.sample import Sample, sample, with_notes
from grainlaw.cli.sections import SECTIONS, Sections, toml
from grainlaw.cli.setups import PRISM, SETUPS, SMALL_PRISM, Setup
from grainlaw.contact import ContactLaw, Laws, check_names
from grainlaw.declared import parameters_of
from grainlaw.engine.thread_count import AUTO, MOST_THREADS, Threads, checked_threads
from grainlaw.fields import ParameterError, parameter, whole_number
from grainlaw.material import Material, Rigid
from grainlaw.messages import nearest, refusal, short
from grainlaw.protocol import LoadingProtocol, stages_of
from grainlaw.results.files import write_text
from grainlaw.runs.parallel import Run
from grainlaw.runs.record import versions
from grainlaw.runs.simulation import LEAST_FACTOR, begun
from grainlaw.specimen import Specimen
from grainlaw.tessellation import Tessellation

CONFIG = "config.toml"  #: in the folder of a run


def _yes_or_no(_: object, attribute: attrs.Attribute, value: object) -> None:
    if not isinstance(value, bool):
        raise refusal(f"numerics.{attribute.name}", value, "true or false")


@attrs.frozen(kw_only=True)
class Numerics:
    """How a test is computed, and how much of it is kept."""

    takes_arrays: ClassVar[bool] = False

    time_step_factor: float = parameter("1", default=1.0, at_least=LEAST_FACTOR, at_most=1)  #: shortens the stable step
    mass_scaling: float = parameter("1", default=1.0, at_least=1, at_most=100)  #: lengthens it, with heavier grains
    refinement: int = whole_number(default=0, at_least=0)  #: times that each zone is cut into four
    frames: int = whole_number(default=30, at_least=1)  #: pictures of the specimen that are kept
    #: whether the files for ParaView have the stress and strain of each zone
    zones: bool = attrs.field(default=False, validator=_yes_or_no)
    #: that share the model
    threads: Threads = attrs.field(
        default=AUTO, converter=lambda value: checked_threads("threads", value),
        metadata={"at_least": 1, "at_most": MOST_THREADS},
    )  # fmt: skip

    @property
    def step_options(self) -> dict[str, Any]:
        """What decides the time step, as options of :func:`grainlaw.simulate`."""
        return {"time_step_factor": self.time_step_factor, "mass_scaling": self.mass_scaling}


@attrs.frozen(kw_only=True)
class Configuration:
    """A test that is ready to run, and the sections that make the same one again."""

    specimen: Specimen
    law: Laws
    protocol: LoadingProtocol
    numerics: Numerics
    sections: Sections
    law_files: Sequence[Path] = ()  #: the user's file with the law, and those of its folder that it imports
    material_files: Sequence[Path] = ()  #: the same of the rock
    test_files: Sequence[Path] = ()  #: and of the test

    def check(self) -> None:
        """Raise what :func:`grainlaw.simulate` would raise before its first step."""
        begun(self._run.model, self.protocol, frames=self.numerics.frames, **self.numerics.step_options)

    @property
    def key(self) -> str:
        """Hex SHA-256 of all that decides the result."""
        return self._run.key(self.numerics.frames)

    @property
    def _run(self) -> Run:
        return Run(self.specimen, self.law, self.protocol, **self.numerics.step_options)


def write_config(file: Path, name: str, sections: Sections, about: str = "") -> None:
    """Write sections as the configuration of the test of a name, with the versions they are of. Raises OSError."""
    heading = f"# {about}\n" if about else ""
    heading += "".join(f"# {package} {number}\n" for package, number in versions().items())
    write_text(file, f"# grainlaw test {name} --config {file.name}\n{heading}\n{toml(sections)}")


def configured(name: Any, sections: Sections, quick: bool = False) -> Configuration:
    """The test of a name, of FILE.py:TEST or as it is, with what the sections give in place of the defaults.

    Raises :class:`~grainlaw.fields.ParameterError` for what is unknown, missing, of another unit or out of bounds.
    """
    setup, given, test_files = _of_setup(name, sections, quick)
    test = evolved(setup.protocol, given["test"], "test")
    parts = composed(given, setup.quick if quick else setup.sample)
    numerics = evolved(Numerics, given["numerics"], "numerics")
    specimen = parts.specimen(numerics.refinement)
    check_names(specimen, parts.law)
    stages_of(test, specimen)  # refuses a specimen that it cannot hold
    made = {**parts.sections, "test": settings(test) | {"type": name}, "numerics": own(settings(numerics))}
    made = {name: section for name, section in made.items() if section}
    return Configuration(
        specimen=specimen, law=parts.law, protocol=test, numerics=numerics, sections=made, law_files=parts.law_files,
        material_files=parts.material_files, test_files=test_files,
    )  # fmt: skip


@attrs.frozen(kw_only=True)
class Composition:
    """Grains that are not made yet, rock and law, and the sections that make them again."""

    grains: Sample
    material: Material | Rigid | Mapping[Any, Material]
    law: Laws
    cite: tuple[str, ...]
    sections: Sections
    law_files: Sequence[Path]
    material_files: Sequence[Path]

    def specimen(self, refinement: int, grains: Tessellation | None = None) -> Specimen:
        """A specimen of the grains of the sections, or of others."""
        made = self.grains.grains() if grains is None else grains
        points, edges = self.grains.contact_points, self.grains.edges
        return Specimen(
            made, self.material, contact_points=points, refinement=refinement, cite=self.cite, **edges
        )  # fmt: skip


def composed(given: Sections, usual: Mapping[str, Any]) -> Composition:
    """What sections say of grains, rock and law; ``usual`` is the section [sample] beneath them."""
    rock_given, cite = _without_cite(given["rock"])
    reference, law, law_files = _law(given["law"])
    laws, law_section = laws_by_key(law, given["laws"], _law)
    rock_type, base, material_files = _begin_rock(rock_given)
    rock: Material | Rigid = evolved(base, own(rock_given), "rock")
    minerals, rock_section = materials(rock, given["rocks"])
    grains = sample(usual, given["sample"])
    check_cracks(grains.section, laws)
    sections = {
        "sample": grains.section,
        "rock": settings(rock) | rock_type | ({"cite": list(cite)} if cite else {}),
        "rocks": rock_section,
        "law": settings(law, ContactLaw) | {"type": reference},
        "laws": law_section,
    }
    return Composition(
        grains=grains, material=minerals, law=laws, cite=cite, sections=sections, law_files=law_files,
        material_files=material_files,
    )  # fmt: skip


def template(name: str, sections: Sections, quick: bool = False) -> str:
    """A configuration as TOML with every parameter, each with its unit, what is allowed, and its meaning.

    What has no value is a comment, and what a test cannot do without is to be filled in. Raises ParameterError.
    """
    setup, given, _ = _of_setup(name, sections, quick)
    given["rock"], cite = _without_cite(given["rock"])
    reference, law, _ = _begin_law(given["law"])
    rock_type, rock, _ = _begin_rock(given["rock"])
    bases = {"rock": rock, "law": law, "test": setup.protocol, "numerics": Numerics}
    made = {section: drafted(base, own(given[section]), section) for section, base in bases.items()}
    made["rock"] |= rock_type | ({"cite": list(cite)} if cite else {})
    made["law"]["type"], made["test"]["type"] = reference, name
    del made["numerics"]["type"]
    notes = {section: explained(base if isinstance(base, type) else type(base)) for section, base in bases.items()}
    grains = sample(setup.quick if quick else setup.sample, given["sample"])
    made["sample"], notes["sample"] = with_notes(grains.section)
    for key, entry in given["laws"].items():
        if "type" not in (table := table_of(entry, f"laws.{key}")):
            refuse_unknown(
                f"laws.{key}", table, [row[0] for row in parameters_of(law if isinstance(law, type) else type(law))]
            )
    whole = given | made
    return f"# grainlaw test {name} --config FILE\n\n{toml({key: whole[key] for key in SECTIONS if whole[key]}, notes)}"


def _setup(name: Any) -> tuple[Setup, list[Path]]:
    """The test of a name, or of FILE.py:TEST on a prism, and its files.

    A test that a file has been asked for already stands in the place of its name.
    """
    if isinstance(name, LoadingProtocol) or (isinstance(name, type) and issubclass(name, LoadingProtocol)):
        return Setup(name, PRISM, SMALL_PRISM), []
    name = str(name)
    if ".py" in name:
        found, files = _of_file("test", name, LoadingProtocol)
        return Setup(found, PRISM, SMALL_PRISM), files
    if name not in SETUPS:
        known = f"tests: {', '.join(SETUPS)}; one of your own: FILE.py:TEST"
        raise ParameterError(f"there is no test {short(name)}{nearest(name, SETUPS)} ({known})")
    return SETUPS[name], []


def _of_setup(name: Any, sections: Sections, quick: bool) -> tuple[Setup, Sections, list[Path]]:
    """The test of a name, what is given of each section, and the files of the test.

    With the rock and the law of the test, if it has such.
    """
    setup, files = _setup(name)
    given = {section: dict(sections.get(section, {})) for section in SECTIONS}
    other = given["test"].pop("type", name)
    if other != name and not (files and os.path.abspath(str(other)) == os.path.abspath(name)):
        raise ParameterError(f"test.type = {other!r} is not allowed, the test is {name}")
    if is_rock(given["rock"].get("type")):
        given = over_rock(rock_file(given["rock"]["type"]), given, setup.quick if quick else setup.sample, quick)
    if not given["rock"]:
        given["rock"] = _of_whole_minerals(given)
    for section, usual in (("rock", setup.rock), ("law", setup.law)):
        if "type" not in given[section]:
            given[section] = {**usual, **given[section]}
    return setup, given, files


def _of_whole_minerals(given: Sections) -> dict[str, Any]:
    """The rock of the first mineral where [rocks] has the type of each: nothing is missing then. Else an empty one."""
    minerals, rocks = given["sample"].get("minerals"), given["rocks"]
    if not isinstance(minerals, Mapping) or not minerals:
        return {}
    whole = [rocks[name] for name in minerals if isinstance(rocks.get(name), Mapping) and "type" in rocks[name]]
    return dict(whole[0]) if len(whole) == len(minerals) else {}


def _without_cite(rock: dict[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """A section [rock] without the works to cite, and these."""
    rest = {name: value for name, value in rock.items() if name != "cite"}
    return rest, checked_cite(rock.get("cite", []), "rock.cite")


def _begin_rock(given: dict[str, Any]) -> tuple[dict[str, Any], Any, list[Path]]:
    """What a section says of the type of the rock if that is FILE.py:MATERIAL; what ``evolved`` makes it of; its files.

    A material that a file has been asked for already stands in the place of its name.
    """
    kind = given.get("type")
    if isinstance(kind, Material):
        return {"type": type(kind).__name__}, kind, []
    if ".py" not in str(kind):
        try:
            return {}, begin_with((Material, Rigid), given, "rock", ROCK), []
        except ParameterError:
            materials = choices((Material, Rigid))
            raise ParameterError(
                f"rock: there is no {short(str(kind))}{nearest(str(kind), [*NAMES, *materials])} (rocks: "
                f"{', '.join(NAMES)}, or FILE.toml; materials: {', '.join(materials)})"
            ) from None
    material, files = _of_file("rock", str(kind), Material)
    return {"type": kind}, material, files


def _of_file(section: str, reference: str, kind: type) -> tuple[Any, list[Path]]:
    """What FILE.py:NAME of a section is, and its files. Raises :class:`ParameterError`."""
    try:
        return find_with_files(reference, kind)
    except ParameterError as error:
        raise ParameterError(f"{section}.type: {error}") from None


def _law(given: dict[str, Any]) -> tuple[str, ContactLaw, list[Path]]:
    """What a law is called (a name in Table 1's laws, of another class, or FILE.py:LAW), the law, and its files."""
    name, base, files = _begin_law(given)
    return name, evolved(base, own(given), "law"), files


def _begin_law(given: dict[str, Any]) -> tuple[str, Any, list[Path]]:
    """The same with what the law is made of by ``evolved``.

    A law that a file has been asked for already stands in the place of its name.
    """
    kind = given.get("type", "cohesive-crack")
    if isinstance(kind, ContactLaw):
        return type(kind).__name__, kind, []
    if isinstance(kind, type):  # that of a rock of a paper
        return next((name for name, law in LAWS.items() if type(law) is kind), name_of(kind, ContactLaw)), kind, []
    name = str(kind)
    if ".py" in name:
        return name, *_of_file("law", name, ContactLaw)
    others = {short: cls for short, cls in choices(ContactLaw).items() if cls not in map(type, LAWS.values())}
    known: dict[str, Any] = LAWS | others
    if name not in known:
        raise ParameterError(f"there is no law {short(name)}{nearest(name, known)} (laws: {', '.join(known)})")
    return name, known[name], []
