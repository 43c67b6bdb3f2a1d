"""``gl.rocks``: the rocks of papers by name, each with texture, materials, contact laws, and what to cite."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import attrs

from grainlaw.cli.configuration import Composition, composed
from grainlaw.cli.rock_file import NAMES, SECTIONS_OF_ROCK, RockFile, is_rock, over_rock, rock_file
from grainlaw.cli.setups import PRISM
from grainlaw.contact import Laws
from grainlaw.fields import ParameterError
from grainlaw.material import Material, Rigid
from grainlaw.messages import nearest, short
from grainlaw.region import Region
from grainlaw.short_form import html_table, rounded
from grainlaw.specimen import Specimen
from grainlaw.tessellation import Tessellator
from grainlaw.unit_text import quantity


@attrs.frozen(eq=False, repr=False)
class Rock:
    """A rock as a paper has it, or a calibration found it.

    Its file is a configuration without a test: sections [sample], [rock], [rocks], [law] and [laws], a sentence
    ``about`` it, and a list of works to ``cite``, which a specimen of it takes along to the files of its runs.
    """

    file: RockFile  #: what the file says

    @property
    def about(self) -> str:
        """Which rock it is, and by what its parameters were found."""
        return self.file.about

    @property
    def cite(self) -> tuple[str, ...]:
        """Works to cite."""
        return self.file.cite

    @property
    def material(self) -> Material | Rigid | Mapping[Any, Material]:
        """Of the grains, or by mineral."""
        return self._composed().material

    @property
    def law(self) -> Laws:
        """Of the contacts, or by what they are between."""
        return self._composed().law

    def tessellator(self, seed: int = 1, **sample: Any) -> Tessellator:
        """The grains with their minerals; ``sample`` is what a configuration has in this section.

        Raises :class:`~grainlaw.fields.ParameterError`.
        """
        return self._filling(self._composed(seed=seed, **sample))

    def specimen(self, region: Region | None = None, *, seed: int = 1, refinement: int = 0, **sample: Any) -> Specimen:
        """A specimen of it, of the paper's size where no region is given, and with the grain size of the paper.

        ``sample`` is what a configuration has in its section [sample]: ``grains=300``, ``grain_size="2 mm"``. Raises
        :class:`~grainlaw.fields.ParameterError`.
        """
        found = self._composed(seed=seed, **sample)
        return found.specimen(refinement, None if region is None else self._filling(found).tessellate(region))

    def _filling(self, found: Composition) -> Tessellator:
        if found.grains.tessellator is None:
            raise ParameterError(f"the grains of {short(self.file.name)} are those of a file: take its specimen()")
        return found.grains.tessellator

    def _composed(self, **sample: Any) -> Composition:
        empty: dict[str, Any] = {name: {} for name in SECTIONS_OF_ROCK}
        usual = PRISM | {"region": self.file.sections.get("sample", {}).get("region", PRISM["region"])}
        return composed(over_rock(self.file, {**empty, "sample": sample}, usual, False), usual)

    def __repr__(self) -> str:
        return f"{self.file.name}: {self.about or self._in_words}"

    @property
    def _in_words(self) -> str:
        """What the file says of contacts and grains, where it has no sentence about them."""
        sections = self.file.sections
        law, rock = (sections.get(name, {}).get("type", "") for name in ("law", "rock"))
        size = sections.get("sample", {}).get("grain_size")
        grains = f"{rock} grains" if rock else "grains"
        if isinstance(size, str):
            grains += f" of {rounded(quantity(size, 'm', 'sample.grain_size'), 'm')}"
        return f"{law} contacts, {grains}" if law else grains


class Rocks(Mapping[str, Rock]):
    """The rocks that come with grainlaw, by name; and by its path one of a TOML file."""

    def __getitem__(self, name: str) -> Rock:
        if not is_rock(name):
            known = f"rocks: {', '.join(NAMES)}, or a file FILE.toml"
            raise ParameterError(f"there is no rock {short(str(name))}{nearest(str(name), NAMES)} ({known})")
        return Rock(rock_file(name))

    def __iter__(self) -> Iterator[str]:
        return iter(NAMES)

    def __len__(self) -> int:
        return len(NAMES)

    def __contains__(self, name: object) -> bool:
        return name in NAMES

    def __repr__(self) -> str:
        return "\n".join(map(repr, self.values()))

    def _repr_html_(self) -> str:
        return html_table([(name, rock.about) for name, rock in self.items()], caption="Rocks")


rocks = Rocks()
