"""A curve that a laboratory has measured, read from its file and judged as those of our tests are."""

from __future__ import annotations

import math
import os
import re
import warnings
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, cast

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked, is_number
from grainlaw.columns import (
    DEVIATOR,
    LATERAL_STRAIN,
    NOISE,
    STAGE,
    STRAIN,
    STRESS,
    TIME,
    VOLUMETRIC_STRAIN,
    quantity_of,
)
from grainlaw.fields import (
    STRENGTHS,
    ParameterError,
    UnitWarning,
    checked_number,
    checked_whole_number,
    unusual,
)
from grainlaw.messages import nearest, refusal
from grainlaw.moduli import elastic_moduli
from grainlaw.quantity import Quantity
from grainlaw.results.result import Curves, Named
from grainlaw.results.text_table import TextColumn, in_si, read_table, unit_of
from grainlaw.results.thresholds import Path, path_to_peak
from grainlaw.strength import borne_in, measured_noise, strength_of
from grainlaw.unit_text import dimension

if TYPE_CHECKING:
    from grainlaw.results.laboratory import Laboratory
    from grainlaw.results.result import Result

FORCE, DISPLACEMENT = "force", "displacement"
FEWEST = 10  #: rows of a curve
BACKWARDS = 0.9  #: of the rows: so many whose strain is smaller than before are written from the end
#: what a column may be: words of its name, and its unit in SI; the first that fits, so that the special come first
KINDS: dict[str, tuple[str, str]] = {
    TIME: (r"\btime\b|\bzeit\b|^t$", "s"),
    "other": (r"confin|cell press|pore|temperature|sigma ?3$|^sigma ?(r|rad|radial|c|conf)$", ""),
    VOLUMETRIC_STRAIN: (r"\bvol|^(eps|epsilon) ?v", "1"),
    LATERAL_STRAIN: (
        r"lateral|radial|circumf|transvers|diametr|hoop|querdehnung|^(eps|epsilon) ?(3|l|lat|r|rad|t|h|x|xx)$", "1"
    ),
    STRAIN: (r"strain|dehnung|stauchung|^(eps|epsilon) ?(1|a|ax|axial|z|y|yy)?$", "1"),
    DEVIATOR: (r"deviator|differential|^q$|sigma ?1 ?- ?sigma ?3", "Pa"),
    STRESS: (r"stress|spannung|^sigma ?(1|a|ax|axial|z|y|yy)?$", "Pa"),
    FORCE: (r"force|\bload\b|kraft", "N"),
    DISPLACEMENT: (r"displac|deformation|lvdt|stroke|\bweg\b", "m"),
}  # fmt: skip
GREEK = {"ε": "epsilon", "ϵ": "epsilon", "σ": "sigma", "₁": "1", "₃": "3"}
#: Pa: moduli of rocks, by which a strain without a unit is told from one in % and in millionths, and a slip
SOFTEST, STIFFEST = 1e9, 2e11
STRONGEST = 1e9  #: Pa: no rock bears more


@attrs.frozen(eq=False)
class MeasuredCurve(metaclass=Checked):
    """A curve of a laboratory, made by :func:`read_curve`; ``print`` says what was read, and what was guessed.

    It has ``curves``, ``summary`` and ``laboratory`` as a :class:`Result` has. Stress and strain are positive in the
    direction of loading, lateral and volumetric strain in extension. E and nu are those of the rock: a cylinder has no
    plane problem.
    """

    specimen: ClassVar[None] = None  #: none of ours

    name: str  #: of the file
    curves: Curves = attrs.field(converter=Curves)  #: by column name, one entry per row, SI
    tension: bool  #: whether the specimen was pulled
    laterals: int  #: lateral strains in the volume: 2 of a cylinder, 1 of a plate in plane strain
    notes: tuple[str, ...]  #: what was read, in words
    ends_at_failure: bool = False  #: whether the largest stress of a record without a failure is the strength

    @cached_property
    def path(self) -> Path:
        """The path to the peak."""
        return path_to_peak(self.curves, laterals=self.laterals, tension=self.tension)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Strength, strain at failure, largest stress, and E and nu between 20 and 50 % of the strength, SI."""
        found = borne_in(self.curves)
        if found is not None and not found.failed and self.ends_at_failure:
            found = attrs.evolve(found, at=found.largest, failed=True)
        strength, largest = strength_of(found, self.curves[STRESS])
        load = DEVIATOR if DEVIATOR in self.curves else STRESS
        moduli = elastic_moduli(self.curves, None, 1.0 if self.tension else -1.0, load)
        at_failure = strength_of(found, self.curves[STRAIN])[0]
        return Named(
            strength=strength, failure_strain=at_failure, largest_stress=largest,
            modulus=moduli["modulus"], poisson=moduli["poisson"],
        )  # fmt: skip

    @cached_property
    def laboratory(self) -> Laboratory:
        """E, nu, CC, CI and CD, by the code that judges our curves; cracks, fragments and events it has none."""
        from grainlaw.results.laboratory import Laboratory

        return Laboratory(cast("Result", self))

    def quantity(self, name: str) -> Quantity:
        """How a column or a property is shown."""
        return quantity_of(name)

    def shown(self, name: str) -> np.ndarray:
        """A column of the curves in the unit in which it is shown."""
        return self.curves[name] * self.quantity(name).factor

    @property
    def _facts(self) -> dict[str, str]:
        main = {self.quantity(name).words: self.quantity(name).with_unit(value) for name, value in self.summary.items()}
        return {"file": self.name, "rows": str(len(self.curves[STRESS])), **main}

    def __str__(self) -> str:
        return "\n".join(self.notes)


@checked
def read_curve(
    file: str | os.PathLike[str], *, strain: str | None = None, lateral_strain: str | None = None,
    volumetric_strain: str | None = None, stress: str | None = None, force: str | None = None,
    displacement: str | None = None, time: str | None = None, columns: Mapping[str, Any] | None = None,
    height: float | None = None, diameter: float | None = None, area: float | None = None, confinement: float = 0.0,
    tension: bool = False, laterals: int = 2, ends_at_failure: bool = False,
) -> MeasuredCurve:  # fmt: skip
    """Read a curve of compression or ``tension`` that a laboratory has measured from a text file of columns.

    What separates the columns, the decimal sign, which column is what, and its unit are found in the file; ``print``
    says all of it. A unit is given where the file has none, or a wrong one: ``strain="%"``, ``stress="MPa"``.
    ``columns`` says which column is what, by its name or its number from 1: ``{"strain": "Ext. 2", "stress": 4}``.
    A strain without a unit is taken in that one of 1, % and um/m which gives a modulus of 1 to 200 GPa.

    A force becomes a stress by ``area`` (m2), or the ``diameter`` (m) of a cylinder, a displacement a strain by the
    ``height`` (m). Of a confined test the curve begins where the axial stress exceeds the ``confinement`` (Pa). The
    signs of a file do not matter. A plate in plane strain has one lateral strain, ``laterals=1``. A record that stops
    where the specimen failed, before its load fell, has its strength there with ``ends_at_failure``.

    Raises :class:`~grainlaw.fields.ParameterError`, with the column, for what cannot be told.
    """
    where = "read_curve"
    sizes = {"height": height, "diameter": diameter, "area": area}
    for name, value in sizes.items():
        if value is not None:
            checked_number(f"{where}: {name}", value, "m2" if name == "area" else "m", above=0)
    confinement = checked_number(f"{where}: confinement", confinement, "Pa", at_least=0)
    laterals = checked_whole_number(f"{where}: laterals", laterals, at_least=1, at_most=2)
    units = {
        TIME: time, STRAIN: strain, LATERAL_STRAIN: lateral_strain, VOLUMETRIC_STRAIN: volumetric_strain,
        STRESS: stress, DEVIATOR: stress, FORCE: force, DISPLACEMENT: displacement,
    }  # fmt: skip
    for kind, unit in units.items():
        if unit is not None and (not unit_of(unit) or dimension(unit_of(unit)) != dimension(KINDS[kind][1])):
            raise refusal(f"{where}: {kind}", unit, f"a unit of {_kind(kind)}")
    table = read_table(where, file)
    chosen = _chosen(where, table.columns, columns or {})
    read = _Reading(where, chosen, {k: unit_of(u) if u else "" for k, u in units.items()}, sizes)
    curves = read.curves(confinement, tension, laterals)
    notes = (f"{os.fspath(file)}: {table.form}", *read.notes, *_unused(table.columns, read.used))
    found = MeasuredCurve(
        name=os.path.basename(os.fspath(file)), curves=curves, tension=bool(tension), laterals=laterals, notes=notes,
        ends_at_failure=ends_at_failure,
    )  # fmt: skip
    if math.isnan(found.summary["strength"]):
        no_failure = "strength: the record ends before a failure; ends_at_failure=True takes the largest stress"
        found = attrs.evolve(found, notes=(*notes, no_failure))
    for words in filter(None, _doubts(f"{where}: {found.name}", found, confinement)):
        warnings.warn(UnitWarning(words), stacklevel=3)
    return found


def _doubts(where: str, found: MeasuredCurve, confinement: float) -> Iterator[str]:
    """What is unusual of a rock, as after a slip of the unit of a column or of a size."""
    largest, modulus = found.summary["largest_stress"], found.summary["modulus"]
    yield unusual(f"{where}: confinement", confinement, "Pa", STRENGTHS)
    yield unusual(f"{where}: the largest stress", largest, "Pa", (STRENGTHS[0], 2 * STRONGEST))
    yield "" if math.isnan(modulus) else unusual(f"{where}: the modulus", modulus, "Pa", (SOFTEST, STIFFEST))


def _kind(kind: str) -> str:
    return {"1": "a strain, such as '%'", "Pa": "a stress, such as 'MPa'", "N": "a force, such as 'kN'"}.get(
        KINDS[kind][1], f"a {'length' if KINDS[kind][1] == 'm' else 'time'}, such as 'm{KINDS[kind][1]}'"
    )


def _chosen(where: str, table: Any, given: Mapping[str, Any]) -> dict[str, TextColumn]:
    """Columns by what they are: as given, else by their names."""
    allowed = [kind for kind in KINDS if kind != "other"]
    found = {}
    for kind, column in given.items():
        if kind not in allowed:
            raise ParameterError(
                f"{where}: columns: there is no {kind!r}{nearest(str(kind), allowed)} (there are: {', '.join(allowed)})"
            )
        found[kind] = _named(f"{where}: columns: {kind}", table, column)
    rest = [column for column in table if column not in found.values()]
    guessed: dict[str, list[TextColumn]] = {}
    for column in rest:
        guess = _guess(column)
        if guess in allowed and guess not in found:
            guessed.setdefault(str(guess), []).append(column)
    for kind, several in guessed.items():
        first = kind not in (LATERAL_STRAIN, VOLUMETRIC_STRAIN)  # of sigma_1 and sigma_3, and of gauges along the axis
        axial = [column for column in several if first and re.search(r"axial|[_ ]?1$", column.name, re.I)] or several
        if len(axial) > 1 and kind != TIME:
            titles = ", ".join(column.title for column in axial)
            raise ParameterError(
                f"{where}: the columns {titles} may each be the {kind}, say which: columns={{'{kind}': '...'}}"
            )
        found[kind] = axial[0]
    return found


def _named(where: str, table: Any, column: Any) -> TextColumn:
    if is_number(column, int) and 1 <= column <= len(table):
        return cast(TextColumn, table[int(column) - 1])
    for each in table:
        if str(column).strip() in (each.name, f"{each.name} ({each.unit})", f"{each.name} [{each.unit}]"):
            return cast(TextColumn, each)
    titles = ", ".join(each.title for each in table)
    raise refusal(where, column, f"the name of a column with numbers, or its number from 1 (there are: {titles})")


def _guess(column: TextColumn) -> str | None:
    """What a column is by its name and the dimension of its unit."""
    words = column.name
    for letter, name in GREEK.items():
        words = words.replace(letter, name)
    words = re.sub(r"[\s_.]+", " ", words).strip().lower()
    for kind, (pattern, unit) in KINDS.items():
        if re.search(pattern, words):
            fits = not column.unit or not unit or dimension(column.unit) == dimension(unit)
            if fits:
                return kind
    return None


def _unused(table: Any, used: list[TextColumn]) -> list[str]:
    rest = [column.title for column in table if column not in used]
    return [f"not used: {', '.join(rest)}"] if rest else []


def _from_confinement(curves: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """From the last sample at which there is no more than the confinement; strains count from there."""
    deviator = curves[DEVIATOR]
    before = np.flatnonzero(deviator[: int(np.argmax(deviator)) + 1] <= 0)
    made = {name: values[before[-1] if len(before) else 0 :] for name, values in curves.items()}
    strains = (STRAIN, LATERAL_STRAIN, VOLUMETRIC_STRAIN) if len(before) else ()
    return made | {name: made[name] - made[name][0] for name in strains if name in made}


@attrs.define(eq=False)
class _Reading:
    """From columns as they are written to the curves of a test, and what was done in words."""

    where: str
    chosen: Mapping[str, TextColumn]
    units: Mapping[str, str]  #: as given, by kind
    sizes: Mapping[str, float | None]
    notes: list[str] = attrs.field(factory=list)
    used: list[TextColumn] = attrs.field(factory=list)

    def curves(self, confinement: float, tension: bool, laterals: int) -> dict[str, np.ndarray]:
        load, is_deviator = self._load()
        axial = self._axial(load)
        both = np.isfinite(load) & np.isfinite(axial)
        others = {kind: self._strain(kind) for kind in (LATERAL_STRAIN, VOLUMETRIC_STRAIN) if kind in self.chosen}
        if LATERAL_STRAIN in others:
            both &= np.isfinite(others[LATERAL_STRAIN])
        if not both.all():
            self.notes.append(f"{np.count_nonzero(~both)} rows without all numbers left out")
        if np.count_nonzero(both) < FEWEST:
            raise ParameterError(
                f"{self.where}: {np.count_nonzero(both)} rows have a stress and a strain, it must be at least {FEWEST}"
            )
        rows = np.flatnonzero(both)
        if self._is_backwards(load[rows], axial[rows], rows):
            rows = rows[::-1]
            self.notes.append("rows turned: the newest is written first")
        load, axial, others = load[rows], axial[rows], {kind: values[rows] for kind, values in others.items()}
        load = self._turned(load, int(np.argmax(np.abs(load))), 1.0, "stress")
        peak = int(np.argmax(load))
        written = 1.0 if axial[peak] >= 0 else -1.0
        axial = self._turned(axial, peak, 1.0, "strain")
        lateral = self._lateral(axial, others, peak, written, -1.0 if tension else 1.0, laterals)
        curves = {STAGE: np.zeros(len(load)), STRAIN: axial, STRESS: load, LATERAL_STRAIN: lateral}
        if np.isfinite(lateral).any():
            curves[VOLUMETRIC_STRAIN] = (1.0 if tension else -1.0) * axial + laterals * lateral
            twice = "axial and lateral strain" if laterals == 1 else "axial and twice the lateral strain"
            self.notes.append(f"volumetric_strain: sum of {twice}")
        if confinement or is_deviator:
            curves[STRESS], curves[DEVIATOR] = (load + confinement, load) if is_deviator else (load, load - confinement)
            if not curves[DEVIATOR].max() > 0:
                raise refusal(f"{self.where}: confinement", confinement, "below the largest axial stress (Pa)")
        curves[NOISE] = np.full(len(load), measured_noise(load[: peak + 1]))
        if TIME in self.chosen:
            column = self.chosen[TIME]
            unit = self.units[TIME] or column.unit or "s"
            curves[TIME] = in_si(column.values[rows], unit)
            self._say(TIME, column, unit, guessed=not (self.units[TIME] or column.unit))
        return _from_confinement(curves) if DEVIATOR in curves else curves

    def _is_backwards(self, load: np.ndarray, axial: np.ndarray, rows: np.ndarray) -> bool:
        """Whether time runs backwards or, where there is none, nearly all strains come nearer to zero."""
        if TIME in self.chosen:
            time = self.chosen[TIME].values[rows]
            return bool(time[-1] < time[0])
        size = np.abs(axial)
        shrinks = np.count_nonzero(np.diff(size) < 0) > BACKWARDS * np.count_nonzero(np.diff(size))
        return bool(shrinks and abs(load[-1]) < abs(load[0]))

    def _say(self, kind: str, column: TextColumn, unit: str, *, guessed: bool, more: str = "") -> None:
        self.used.append(column)
        given = " (given)" if self.units.get(kind) else " (guessed)" if guessed else ""
        words = "a ratio" if unit == "1" else unit
        self.notes.append(f"{kind}: {column.title} in {words}{given}{more}")

    def _unit(self, kind: str) -> str:
        """The unit that is given, or written."""
        column = self.chosen[kind]
        unit = self.units[kind] or column.unit
        if unit and dimension(unit) != dimension(KINDS[kind][1]):
            raise ParameterError(f"{self.where}: the column {column.title} has the unit {unit}, which is no {kind}")
        return unit

    def _load(self) -> tuple[np.ndarray, bool]:
        """Pa, and whether it is a deviator."""
        for kind in (STRESS, DEVIATOR):
            if kind in self.chosen:
                column, unit = self.chosen[kind], self._unit(kind)
                guessed = unit or self._guessed_stress(column)
                self._say(kind, column, guessed, guessed=not unit)
                return in_si(column.values, guessed), kind == DEVIATOR
        if FORCE not in self.chosen:
            raise self._lacks("a stress, a deviator or a force", STRESS)
        column, unit = self.chosen[FORCE], self._unit(FORCE)
        if not unit:
            raise ParameterError(f"{self.where}: the column {column.title} has no unit, give it: force='kN'")
        area, diameter = self.sizes["area"], self.sizes["diameter"]
        if area is None and diameter is None:
            raise ParameterError(
                f"{self.where}: the column {column.title} is a force: give the diameter (m) of the cylinder, or the "
                "area (m2)"
            )
        over = area if area is not None else math.pi * cast(float, diameter) ** 2 / 4
        self._say(FORCE, column, unit, guessed=False, more=f", over {over * 1e6:.6g} mm2")
        return in_si(column.values, unit) / over, False

    def _lacks(self, wanted: str, kind: str) -> ParameterError:
        return ParameterError(
            f"{self.where}: no column is {wanted} by its name, say which is: columns={{'{kind}': '...'}}"
        )

    def _guessed_stress(self, column: TextColumn) -> str:
        """MPa up to the strength of rocks, then kPa, then Pa."""
        largest = float(np.nanmax(np.abs(column.values), initial=0))
        return next((u for u in ("MPa", "kPa") if largest <= STRONGEST * (1e-6 if u == "MPa" else 1e-3)), "Pa")

    def _axial(self, load: np.ndarray) -> np.ndarray:
        if STRAIN in self.chosen:
            return self._strain(STRAIN, load)
        if DISPLACEMENT not in self.chosen:
            raise self._lacks("a strain or a displacement", STRAIN)
        column, unit = self.chosen[DISPLACEMENT], self._unit(DISPLACEMENT)
        if not unit:
            raise ParameterError(f"{self.where}: the column {column.title} has no unit, give it: displacement='mm'")
        height = self.sizes["height"]
        if height is None:
            raise ParameterError(f"{self.where}: the column {column.title} is a displacement: give the height (m)")
        self._say(DISPLACEMENT, column, unit, guessed=False, more=f", over a height of {height * 1e3:g} mm")
        return in_si(column.values, unit) / height

    def _strain(self, kind: str, load: np.ndarray | None = None) -> np.ndarray:
        column, unit = self.chosen[kind], self._unit(kind)
        same = self.units[STRAIN] or (self.chosen[STRAIN].unit if STRAIN in self.chosen else "")
        guessed = unit or (self._guessed_strain(column, load) if load is not None else same)
        if not guessed and STRAIN in self.chosen:
            guessed = self._guessed_strain(self.chosen[STRAIN], self._silent_load())
        if not guessed:
            raise ParameterError(f"{self.where}: the column {column.title} has no unit, give it: {kind}='%'")
        self._say(kind, column, guessed, guessed=not unit)
        return in_si(column.values, guessed)

    def _silent_load(self) -> np.ndarray:
        return attrs.evolve(self, notes=[], used=[])._load()[0]

    def _guessed_strain(self, column: TextColumn, load: np.ndarray) -> str:
        """The one of 1, % and um/m with which the rock is as stiff as rocks are."""
        rows = np.flatnonzero(np.isfinite(load) & np.isfinite(column.values))
        most = rows[np.argmax(np.abs(load[rows]))] if len(rows) else 0
        strain = np.abs(column.values[[most]] - column.values[rows[:1]]) if len(rows) else np.zeros(1)
        stiff = [(unit, abs(load[most]) / max(in_si(strain, unit)[0], 1e-30)) for unit in ("1", "%", "um/m")]
        fits = [unit for unit, modulus in stiff if SOFTEST < modulus < STIFFEST]
        if len(fits) != 1:
            raise ParameterError(
                f"{self.where}: the column {column.title} has no unit, and its size does not tell it: strain='%'"
            )
        return fits[0]

    def _turned(self, values: np.ndarray, at: int, wanted: float, kind: str) -> np.ndarray:
        if values[at] * wanted >= 0:
            return values
        self.notes.append(f"{kind}: sign turned")
        return -values

    def _lateral(
        self, axial: np.ndarray, others: Mapping[str, np.ndarray], peak: int, written: float, way: float, laterals: int
    ) -> np.ndarray:
        """Extension positive: a specimen that is pressed widens, one that is pulled narrows."""
        if LATERAL_STRAIN in others:
            return self._turned(others[LATERAL_STRAIN], peak, way, LATERAL_STRAIN)
        if VOLUMETRIC_STRAIN not in others:
            return np.full(len(axial), np.nan)
        # Both strains of a file have one sign: where the axial one is positive, so is what goes with the loading.
        volume = others[VOLUMETRIC_STRAIN] * (-way * written)
        self.notes.append("lateral_strain: from the volumetric and the axial strain")
        return (volume + way * axial) / laterals
