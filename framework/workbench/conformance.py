"""The conformance kit: whether a contact law has the properties every law must have, on paths scaled to it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked
from grainlaw.contact import ContactLaw
from grainlaw.short_form import html_table
from grainlaw.workbench.bench import Bench, Finding
from grainlaw.workbench.properties import PROPERTIES, unread

EXCUSABLE = ("stiffness", "energy", "fracture energies", "continuity")  #: properties a law may declare that it breaks


@attrs.frozen(eq=False)
class Entry(metaclass=Checked):
    """One property of a law: whether it holds, and the worst that was found."""

    name: str  #: of the property
    passed: bool  #: whether it holds
    found: str = ""  #: the offending path in words and numbers; empty if there is none
    size: float = 0.0  #: of what was found, in the unit that ``found`` names
    exception: str = ""  #: why the law declares that it breaks the property

    def __str__(self) -> str:
        verdict = "FAILS" if not self.passed else "exception" if self.exception else "holds"
        text = "; ".join(part for part in (self.exception and f"declared: {self.exception}", self.found) if part)
        return f"{self.name:<18} {verdict:<9}  {text}".rstrip()


@attrs.frozen(eq=False)
class Report(metaclass=Checked):
    """What :func:`check_law` found: iterable over its entries, printed with one line for each."""

    law: str  #: name of the law
    entries: tuple[Entry, ...]  #: one for each property

    @property
    def passed(self) -> bool:
        """Whether every property holds or is a declared exception."""
        return all(entry.passed for entry in self.entries)

    def __iter__(self) -> Iterator[Entry]:
        return iter(self.entries)

    def __getitem__(self, name: str) -> Entry:
        """The entry of a property by name."""
        for entry in self.entries:
            if entry.name == name:
                return entry
        raise KeyError(f"no property {name!r}, only {', '.join(entry.name for entry in self.entries)}")

    @property
    def _facts(self) -> dict[str, str]:
        failed = [entry.name for entry in self.entries if not entry.passed]
        verdict = f"fails {', '.join(failed)}" if failed else "conforms"
        return {"law": self.law, "verdict": verdict, "properties": str(len(self.entries))}

    def _html(self) -> str:
        rows = [(e.name, "holds" if e.passed else "fails", e.exception or e.found) for e in self.entries]
        return html_table(rows, caption=f"{self.law} {self._facts['verdict']}")

    def __str__(self) -> str:
        failed = sum(not entry.passed for entry in self.entries)
        verdict = "conforms" if self.passed else f"fails {failed} of {len(self.entries)} properties"
        return "\n".join([f"{self.law} {verdict}", *(f"  {entry}" for entry in self.entries)])


@checked
def check_law(law: ContactLaw, *, compiled: bool = True) -> Report:
    """Ask a law for every property that makes laws comparable and safe to run.

    The paths are scaled from the law's own stiffness and peaks: pull, shear and reverse, both under pressure, open and
    slide and close, mixed ratios. ``compiled=False`` leaves out the comparison with machine code. Raises
    ParameterError for what is no law, whose numbers differ from contact to contact, or whose stiffness is no number.
    """
    bench = Bench(law)
    chosen = (name for name in PROPERTIES if compiled or name != "compiled")
    with np.errstate(all="ignore"):
        return Report(type(law).__name__, tuple(_entry(name, bench) for name in chosen))


def _entry(name: str, bench: Bench) -> Entry:
    excused = {name: text for name, text in bench.law.exceptions.items() if name in EXCUSABLE}
    note = ""
    if name == "fracture energies" and not bench.law.fracture_energies:
        note = "none declared"
    elif name == "units" and (never := unread(type(bench.law))):
        note = f"no code of the law reads {', '.join(never)}"
    return entry(name, PROPERTIES[name](bench), excused, note)


def entry(name: str, finding: Finding | None, excused: Mapping[str, str], note: str = "") -> Entry:
    """The entry of a property, with what was found; ``excused`` says why properties may be broken."""
    exception = excused.get(name, "")
    if finding is None:
        return Entry(name, True, "not met on these paths" if exception else note, 0.0, exception)
    return Entry(name, bool(exception), finding.text, finding.size, exception)
