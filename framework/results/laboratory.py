"""What a laboratory reports of a test, from its finished result."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import attrs
import numpy as np

from grainlaw.arguments import Checked, checked, fits
from grainlaw.columns import TIME, missing, work_done
from grainlaw.fields import ParameterError
from grainlaw.messages import refusal
from grainlaw.quantity import digits_that_count
from grainlaw.results.acoustic import AcousticEvents, acoustic_events
from grainlaw.results.crack_pattern import FailurePlane, Rose, crack_lengths, crack_rose, failure_plane
from grainlaw.results.fragments import Fragments, fragments
from grainlaw.results.measure import Measure, check_measures, found, lacks_frames
from grainlaw.results.measured import MeasuredCurve
from grainlaw.results.result import Named, Result
from grainlaw.results.standard_measures import MEASURES
from grainlaw.results.tables import data_frame, latex, latex_table, latex_unit
from grainlaw.results.thresholds import Path, path_to_peak
from grainlaw.short_form import html_table
from grainlaw.window import Window, window_mean

if TYPE_CHECKING:
    import pandas

    from grainlaw.drawing.figure import Figure

ROUNDING = 1e-9  #: share of the work done below which an energy is 0
OF_ROCK = ("modulus", "poisson")  #: properties of a test that a laboratory reports, beside its main ones


class _Number(NamedTuple):
    """A row of a table."""

    name: str
    meaning: str
    value: float  #: in the unit, nan where there is none
    unit: str
    resolution: float = 0.0  #: in the unit, 0 where it is not known
    source: str = ""

    @property
    def text(self) -> str:
        return digits_that_count(self.value, self.resolution) if np.isfinite(self.value) else "-"


def _by_name(measured: MeasuredCurve) -> dict[str, _Number]:
    if not isinstance(measured, MeasuredCurve):
        raise refusal("Laboratory: measured", measured, "what gl.read_curve returns")
    return {each.name: each for each in measured.laboratory._numbers}


@checked
def mean_stress(result: Result, window: Window, frame: int = -1) -> np.ndarray:
    """(3,) Pa, xx, yy, xy: area mean over the grains whose centroid lies in a window, at one of the frames."""
    return window_mean(result.specimen.grains, result.frame("mean_stress", frame).stress, window)


def _listed(measures: Sequence[Measure]) -> tuple[Measure, ...]:
    if not fits(measures, Sequence):
        raise refusal("Laboratory: measures", measures, "a list of Measures")
    check_measures("Laboratory", measures)
    return tuple(measures)


def _is_result(_: Any, __: Any, value: Any) -> None:
    if not isinstance(value, (Result, MeasuredCurve)):
        raise refusal("Laboratory: result", value, "a Result or a MeasuredCurve")


@attrs.frozen(eq=False)
class Laboratory(metaclass=Checked):
    """The measures of one test, the standard ones if none are given; prints as a table.

    nan where a measure does not exist (``docs/measures.md``). Raises ParameterError for two measures of one name.
    """

    result: Result = attrs.field(validator=_is_result)  #: of the test; or a curve that was measured
    measures: Sequence[Measure] = attrs.field(converter=_listed)  #: what is found
    _values: dict[str, float] = attrs.field(factory=dict, init=False, repr=False)

    @measures.default
    def _standard(self) -> tuple[Measure, ...]:
        if not self.is_measured:
            return tuple(MEASURES.values())
        return tuple(each for name, each in MEASURES.items() if each.of_curves and not name.startswith("apparent_"))

    @property
    def is_measured(self) -> bool:
        """Whether it is of a :class:`MeasuredCurve`, which has no cracks and no frames."""
        return isinstance(self.result, MeasuredCurve)

    @cached_property
    def path(self) -> Path:
        """The path to the peak."""
        if isinstance(self.result, MeasuredCurve):
            return self.result.path
        return path_to_peak(self.result.of_test().curves)

    @cached_property
    def half_lengths(self) -> np.ndarray:
        """(p,) m, half the length of the interface of each contact point."""
        ends = self.result.mesh.nodes[self.result.interfaces]
        return np.tile(np.hypot(*(ends[:, 1] - ends[:, 0]).T) / 2, 2)

    @cached_property
    def growth(self) -> dict[str, np.ndarray]:
        """``tensile_length`` and ``shear_length`` (t,) m at each sample of the curves."""
        lengths = crack_lengths(self.result.cracks, self.result.curves.get(TIME, np.array([])))
        return dict(zip(("tensile_length", "shear_length"), lengths, strict=True))

    @cached_property
    def rose(self) -> Rose:
        """Length of cracks by orientation."""
        return crack_rose(self.result.cracks)

    @cached_property
    def plane(self) -> FailurePlane:
        """Mean direction of the shear cracks in compression, of the tensile cracks otherwise."""
        cracks = self.result.cracks
        return failure_plane(cracks[~cracks.tensile if self.path.is_compression else cracks.tensile])

    @cached_property
    def fragments(self) -> Fragments:
        """Fragments at the end."""
        return fragments(self.result)

    @cached_property
    def events(self) -> AcousticEvents:
        """Acoustic events of a specimen 1 m thick."""
        return acoustic_events(self.result)

    @cached_property
    def energy_lost(self) -> np.ndarray:
        """(2, p) J/m that each contact point has lost in opening and in slip, at the last frame."""
        bonds = self.result.frame("Laboratory.energy_lost", -1).bonds
        return np.array([self.half_lengths * bonds[name] for name in ("lost_opening", "lost_slip")])

    def beyond_rounding(self, energy: float) -> float:
        """An energy (J/m), or 0 where it is but rounding beside the work done on the specimen."""
        return energy if abs(energy) > ROUNDING * work_done(self.result.curves) else 0.0

    @cached_property
    def broken(self) -> np.ndarray:
        """(p,) whether each contact point has broken, at the last frame."""
        return ~np.isnan(self.result.frame("Laboratory.broken", -1).bonds["broken_time"])

    @cached_property
    def tensile(self) -> np.ndarray:
        """(p,) whether the mode of each contact point is tension, at the last frame."""
        return self.result.frame("Laboratory.tensile", -1).bonds["mode"] < 0.5

    def value(self, name: str) -> float:
        """One measure in SI, by its name: one of this laboratory or a standard one. Raises ParameterError."""
        if name not in self._values:
            known = MEASURES | {measure.name: measure for measure in self.measures}
            if name not in known:
                raise ParameterError(f"Laboratory: there is no measure {name!r}, only {', '.join(known)}")
            self._values[name] = found(known[name], self)
        return self._values[name]

    @cached_property
    def properties(self) -> dict[str, float]:
        """All measures in SI, by name."""
        return Named((measure.name, self.value(measure.name)) for measure in self.measures)

    def to_pandas(self, *, measured: MeasuredCurve | None = None) -> pandas.DataFrame:
        """A row for each number, by name: what it is, its value in its unit with all digits, resolution, source.

        The ``resolution`` is by how much the value may be wrong as it is found, 0 where that is not known. With a
        ``measured`` curve a column has its numbers. Raises ParameterError without pandas.
        """
        numbers = self._numbers
        columns: dict[str, list[Any]] = {name: [getattr(each, name) for each in numbers] for name in _Number._fields}
        columns["measure"] = columns.pop("name")
        if measured is not None:
            others = _by_name(measured)
            columns["measured"] = [others[each.name].value if each.name in others else np.nan for each in numbers]
        return data_frame("Laboratory.to_pandas", columns).set_index("measure")

    def to_latex(self, *, measured: MeasuredCurve | None = None) -> str:
        """A table for a paper (LaTeX, package booktabs): at most three digits, and none finer than a measure is known.

        A stress that is read from the samples is known to the distance of two of them, a b-value to its standard error.
        With a ``measured`` curve a column has its numbers, and only what a curve can have is in the table.
        """
        if measured is None:
            rows = [(latex(each.meaning), latex(each.text), latex_unit(each.unit)) for each in self._numbers]
            return latex_table(("measure", "value", "unit"), rows, "lrl")
        others = _by_name(measured)
        both = [(each, others[each.name]) for each in self._numbers if each.name in others]
        beside = [(latex(one.meaning), latex(one.text), latex(two.text), latex_unit(one.unit)) for one, two in both]
        return latex_table(("measure", "model", "measured", "unit"), beside, "lrrl")

    @cached_property
    def _numbers(self) -> list[_Number]:
        """The properties of the test, which stand before the standard measures, and its measures."""
        own = {each.name for each in self.measures}
        is_whole = own >= {each.name for each in self._standard()}
        looks = [self.result.quantity(name) for name in self.result.summary if is_whole and name not in own]
        found = [
            _Number(
                look.name, ", ".join(filter(None, (look.words, look.meaning))), value * look.factor, look.unit_shown
            )
            for look in looks
            if look.is_main or look.name in OF_ROCK
            if fits(value := self.result.summary[look.name], float) and np.isfinite(value)
        ]
        return found + [
            _Number(
                each.name, each.meaning, self.properties[each.name] * each.factor, each.quantity.unit_shown,
                each.resolution(self) * each.factor, each.source,
            )
            for each in self.measures
        ]  # fmt: skip

    @property
    def note(self) -> str:
        """Which measures do not exist, and why, where that is known; empty if there is nothing to say.

        Nothing is said of a standard measure whose columns the test does not record: it cannot exist in it.
        """
        return "; ".join(f"{why}: no {', '.join(names)}" for why, names in self._reasons().items())

    def _reasons(self) -> dict[str, list[str]]:
        """Measures that do not exist, by the reason."""
        curves, reasons = self.result.curves, dict[str, list[str]]()
        measures = [each for each in self.measures if each.name not in MEASURES or not missing(curves, each.needs)]
        absent = [measure for measure in measures if missing(curves, measure.needs)]
        columns = dict.fromkeys(name for measure in absent for name in missing(curves, measure.needs))
        if absent:
            reasons[f"the test does not record {', '.join(columns)}"] = [measure.quantity.words for measure in absent]
        alone = [each for each in measures if self.is_measured and not each.of_curves]
        if alone:
            reasons["a measured curve has no cracks and no frames"] = [each.quantity.words for each in alone]
        for measure in measures:
            if measure in absent or measure in alone or not np.isnan(self.properties[measure.name]):
                continue
            lacks = "the result was saved without frames, as by a study" if lacks_frames(measure, self) else ""
            if why := lacks or measure.why(self):
                reasons.setdefault(why, []).append(measure.quantity.words)
        return reasons

    @property
    def _facts(self) -> dict[str, str]:
        return {"measures": str(len(self.measures)), "of": repr(self.result)}

    def _html(self) -> str:
        note = [(self.note, "", "", "")] if self.note else []
        return html_table([*self._rows(), *note], ("", "", "unit", "source"), "Laboratory")

    def __str__(self) -> str:
        rows = self._rows()
        widths = [max((len(row[k]) for row in rows), default=0) for k in range(3)]
        lines = [
            f"{a.ljust(widths[0])}  {b.rjust(widths[1])}  {c.ljust(widths[2])}  {d}".rstrip() for a, b, c, d in rows
        ]
        doubted = () if self.is_measured else (f"doubt: {words}" for words in self.result.doubts)
        return "\n".join([*lines, *([self.note] if self.note else []), *doubted])

    def _rows(self) -> list[tuple[str, str, str, str]]:
        """Without what does not exist in this test, but for measures of a user."""
        return [
            (each.meaning, f"{each.value:.4g}" if np.isfinite(each.value) else "-", each.unit, each.source)
            for each in self._numbers
            if np.isfinite(each.value) or each.name not in MEASURES
        ]

    def plot(self, panel: str | None = None, *, ax: Any = None) -> Figure:
        """Draw all panels, or one of them.

        They are "thresholds", "growth", "rose", "fragments", "events", "mechanisms", "moments" and "lost" (energy). Of
        a measured curve there are the thresholds alone. One panel is drawn into the axes ``ax`` of matplotlib, if they
        are given; the rose needs polar ones. Returns the figure. Raises ParameterError.
        """
        from grainlaw.results.figures.laboratory import plot_laboratory, plot_panel

        if self.is_measured:
            if panel not in (None, "thresholds"):
                raise refusal("Laboratory.plot: panel", panel, "'thresholds', for a measured curve has no other")
            panel = "thresholds"
        return plot_laboratory(self) if panel is None and ax is None else plot_panel(self, panel, ax)
