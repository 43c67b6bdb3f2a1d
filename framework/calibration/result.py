"""What a calibration has found: prints as tables, writes a report and its numbers."""

from __future__ import annotations

import functools
import itertools
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.calibration.check import MET, NOT_MET, UNCHECKED, UNDECIDED, WITHIN, Compared
from grainlaw.calibration.emulator import quality
from grainlaw.calibration.first_look import FirstLook
from grainlaw.calibration.identifiability import WEAKLY, Identifiability, width_of
from grainlaw.calibration.matching import LIMIT, Known
from grainlaw.calibration.space import Space
from grainlaw.calibration.stiffness_search import Stiffness, with_grains
from grainlaw.calibration.targets import AIMS, Targets, in_words
from grainlaw.calibration.trials import Failure, shape_of, tests_of
from grainlaw.calibration.waves import SearchResult
from grainlaw.contact import ContactLaw
from grainlaw.declared import units_of
from grainlaw.fields import ParameterError
from grainlaw.messages import enumeration, refusal, spelled
from grainlaw.quantity import aligned
from grainlaw.results.files import writable_folder, write_atomically, write_text
from grainlaw.results.tables import latex_lines, write_json
from grainlaw.runs.record import versions
from grainlaw.short_form import rounded
from grainlaw.specimen import Specimen

if TYPE_CHECKING:
    from grainlaw.drawing.figure import Figure

HARDLY = 0.9  #: of the width that the first look leaves
LIMITS = {  # of what is known of a target: the largest part, in words, and what would make it smaller
    "laboratory": ("The uncertainty of the target", "further tests of the rock would tell more"),
    "specimens": ("The scatter of the simulated specimens", "more seeds or larger specimens would tell more"),
    "emulator": ("The error of the emulator", "a larger budget or narrower ranges would tell more"),
}
ONSETS = ("crack_initiation", "crack_damage")  #: which some specimens do not have
VERDICTS = {
    "determined": "These tests determine", "weakly determined": "They determine weakly",
    "not determined": "They do not determine",
}  # fmt: skip
DPI = 200  #: of a picture
WEAK = 0.5  #: Q2 of an emulator of a target: worse is told
REPORT, NUMBERS, TABLES = "report.html", "calibration.json", "tables.tex"
WITHOUT_ANSWER = ("bands", "left_out")  #: pictures that there are of a conflict, too
PICTURES = (*WITHOUT_ANSWER, "corner", "envelope", "fit")
NOTHING = (
    f"Nothing in the ranges is plausible: every set of parameters is {LIMIT:g} standard errors or more off a target."
)


@attrs.frozen(kw_only=True, eq=False)
class Calibration(metaclass=Checked):
    """The answer of :func:`calibrate`; SI, angles in degrees."""

    targets: Targets  #: what was wanted
    space: Space  #: parameters and their ranges
    stiffness: Stiffness | None  #: None without elastic targets
    found: SearchResult  #: what the search has found
    first_look: FirstLook | None = None  #: what was expected before any test
    seeds: int  #: samples of each trial
    store: str  #: folder of the trials
    grains: float = 1.0  #: times the modulus of the grains of the specimens
    failures: Sequence[Failure] = ()  #: trials that have failed
    cpu: float = 0.0  #: s, of all tests
    identifiability: Identifiability | None = None  #: which parameters the targets determine
    best: dict[str, float] = attrs.field(factory=dict)  #: the best parameters by name
    checks: Sequence[Compared] = ()  #: targets beside what the best parameters give
    tried: Mapping[str, Sequence[int]] = attrs.field(factory=dict)  #: seeds of the fresh specimens, by shape

    @property
    def is_plausible(self) -> bool:
        """Whether any parameters in the ranges meet all targets."""
        return self.found.posterior is not None

    @property
    def law(self) -> ContactLaw:
        """The calibrated law. Raises :class:`ParameterError` where there is none."""
        if not self.is_plausible:
            raise ParameterError(
                f"Calibration: there is no calibrated law, the targets are in conflict: {self.conflict}"
            )
        return self.space.made(self.best)

    @property
    def parameters(self) -> dict[str, float]:
        """All that was found of the law: free, tied and elastic; empty where the targets are in conflict."""
        elastic = self.stiffness.parameters if self.stiffness else {}
        return {**elastic, **self.space.with_tied(self.best)} if self.best else {}

    def rock(self, specimen: Specimen) -> Specimen:
        """A specimen with the grains that were found: those of ``specimens``, or stiffer ones."""
        return with_grains(specimen, self.grains)

    @property
    def conflict(self) -> str:
        """The smallest sets of targets that exclude each other; only of use where nothing is plausible."""
        sets = "; ".join(str(conflict) for conflict in self.found.conflicts)
        return sets or "all of them together, though no smaller set is"

    # --- words -------------------------------------------------------------------------------------------------------

    def __str__(self) -> str:
        parts = [self.head]
        if self.identifiability is None:
            parts += [f"{NOTHING} In conflict: {self.conflict}."]
        else:
            parts += [aligned(self.parameter_lines, rule=True), *self.verdicts]
            parts += [aligned(self._printed, rule=True), *self.check_words] if self.checks else [UNCHECKED]
        parts.append(aligned(self.quality_lines, rule=True))
        if self.failures:
            parts.append(self.failure_words)
        return "\n\n".join(parts)

    @property
    def _facts(self) -> dict[str, str]:
        """What is printed in one line, and in a notebook."""
        facts = {"law": self.space.kind.__name__, "points": str(len(self.found.design.points))}
        if not self.is_plausible:
            return {**facts, "in conflict": self.conflict}
        said = [each.verdict for each in self.checks if each.target is not None]
        values = {free.name: rounded(self.best[free.name], free.unit) for free in self.space.free}
        met = f"{said.count(MET)} of {len(said)} targets" if said else "not tried"
        if within := said.count(WITHIN):
            met += f", {within} {WITHIN}"
        return {**facts, **values, "met on fresh seeds": met}

    @property
    def head(self) -> str:
        """What was looked for, how, and what statics gave."""
        count = len(self.found.waves)
        waves = "1 wave" if count == 1 else f"{count} waves"
        lines = [f"{self.space.kind.__name__}, {len(self.found.design.points)} points on seeds 1 to {self.seeds} in "
                 f"{waves}, {self.cpu / 3600:.2g} CPU hours"]  # fmt: skip
        if self.stiffness is not None:
            lines.append(self.stiffness.in_words)
            if self.stiffness.tested:
                lines.append(f"with which tests gave {in_words(self.stiffness.tested)} in the pilot")
        scale = self.space.scale
        if self.first_look is not None:
            lines.append(f"first look, by no test: {self.first_look.in_words}")
            lines += self._apart
        if given := self._given:
            lines.append(f"kept as in the law: {given}")
        if scale is not None:
            lines.append(f"searched over {', '.join(self.space.groups)}; {scale.name} follows from similarity")
        return "\n".join(lines)

    @property
    def _given(self) -> str:
        """Numbers of the law that were not looked for, in words; those that are 0 are left out."""
        if not self.best:
            return ""
        law: Any = self.law
        units = units_of(type(law))
        numbers = {name: getattr(law, name) for name in units if name not in self.parameters}
        shown = (f"{name} = {rounded(v, units[name])}" for name, v in numbers.items() if np.ndim(v) == 0 and v)
        return ", ".join(shown)

    @property
    def _apart(self) -> list[str]:
        """Where these specimens lie so far from the first look that it does not count, in words."""
        design, match = self.found.design, self.found.match
        apart = match.apart(self.space.scaled(design.points, design.scales))
        far = np.array(list(apart.values())).max(axis=0, initial=0.0) > LIMIT
        if not far.any():
            return []
        by = enumeration(AIMS[name].shown.words for name, off in apart.items() if off.max() > LIMIT)
        return [
            f"the first look does not count at {far.sum()} of {len(far)} points that it knows, where tests lie more "
            f"than {LIMIT:g} standard errors from it, in {by}"
        ]

    @property
    def parameter_lines(self) -> list[list[str]]:
        """Best values, intervals, and widths of these over those without any test, with a heading."""
        known = self.first_look.posterior if self.first_look else None
        heads = ["parameter", "best", "95 %", "half width", *(["by the first look"] if known else []), "share of range"]
        rows = [[*heads, ""]]
        assert self.identifiability is not None
        for k, (each, free) in enumerate(zip(self.identifiability.parameters, self.space.free, strict=True)):
            intervals = [each.interval, *([known.interval(k)] if known else [])]
            own, *before = map(free.between, intervals)
            best, half = rounded(self.best[each.name], free.unit), self._halves[each.name]
            verdict = each.verdict if each.width >= WEAKLY else ""
            rows.append([each.name, best, own, half, *before, f"{100 * each.width:.0f} %", verdict])
        return rows

    @property
    def _halves(self) -> dict[str, str]:
        """Half of the interval of each parameter, in words."""
        assert self.identifiability is not None
        known = zip(self.identifiability.parameters, self.space.free, strict=True)
        return {each.name: free.half(each.best, each.interval) for each, free in known}

    @property
    def verdicts(self) -> list[str]:
        """Which parameters the tests determine, what they do not see, and what would tell more."""
        found = self.identifiability
        assert found is not None
        lines = []
        halves = self._halves
        for verdict, words in VERDICTS.items():
            if named := [each for each in found.parameters if each.verdict == verdict]:
                shown = enumeration(f"{each.name} ({halves[each.name]})" for each in named)
                lines.append(f"{words} {shown}.")
        for each in found.unseen:
            lines.append(f"They do not see: {each.words} ({100 * each.width:.0f} % of the prior's deviation is left).")
        lines += [
            f"{one} and {other} trade off (correlation {value:+.2f}): together they are known better than each."
            for one, other, value in found.trade_offs
        ]
        lines += self._limits
        if found.further:
            best = found.further[0]
            lines.append(
                f"Of the quantities measured but not used, {AIMS[best.quantity].shown.words} would tell most: "
                f"{best.gain:.2f} bits, and {best.helped} to {100 * best.width:.0f} % of its present width."
            )
        match = self.found.match
        known = dict(zip(match.targets, np.sqrt(match.target_variance), strict=True))
        weak = [
            each for each in quality(match.emulators)
            if each[2] < WEAK and each[0] in known and match.emulators[each[0]].miss > known[each[0]]
        ]  # fmt: skip
        lines += [
            f"{AIMS[name].shown.words} is predicted badly from the others (Q2 {share:.2f}): more seeds, or larger "
            "specimens, would tell more of what rests on it."
            for name, _, share, *_ in weak
        ]
        assert self.found.posterior is not None
        lines += self.space.two_regions(self.found.posterior.points)
        point = np.array([self.best[name] for name in self.space.names])
        if ends := self.space.at_ends(point, self.found.posterior.points):
            lines.append(ends)
        return lines

    @property
    def check_words(self) -> list[str]:
        """What the fresh specimens leave open, and what to do about it."""
        lines = [
            f"{AIMS[each.name].shown.words} has a value in {each.count} of {len(each.values)} fresh specimens"
            + (" before they fail." if each.name in ONSETS else ".")
            for each in self.checks
            if each.target is not None and each.count < len(each.values)
        ]
        if undecided := self.judged(UNDECIDED):
            are = "is" if len(undecided) == 1 else "are"
            lines.append(
                f"These fresh specimens are too few to tell whether {enumeration(undecided)} {are} met: try "
                f"{self._more_fresh}, or specimens of more grains, which scatter less."
            )
        if other := [AIMS[each.name].shown.words for each in self.checks if not each.is_foreseen]:
            lines.append(
                f"Outside of what was predicted of them (95 %): {enumeration(other)}. The seeds of the search were "
                "weaker or stronger than most, or the emulator errs: more seeds would tell, and move the answer."
            )
        if within := self.judged(WITHIN):
            lines.append(
                f"{WITHIN.capitalize()}: {enumeration(within)}. Target and fresh specimens are known no better (95 %): "
                "only a better known target or more fresh specimens could show a difference."
            )
        if missed := self.judged(NOT_MET):
            more = max((len(values) for each in self.found.design.more.values() for values in each.values()), default=0)
            count = max(each.count for each in self.checks)
            lines.append(
                f"{NOT_MET.capitalize()}, by more than target and fresh specimens are known to (95 %): "
                f"{enumeration(missed)}. With more = {more + count} (of [calibration]) the search learns from as many "
                "specimens again, and its answer is tried on others; larger specimens scatter less."
            )
        if far := [each.outliers for each in self.checks if each.target is not None and each.outliers]:
            several = f"Of the fresh specimens {', '.join(far)}, as where grains lock."
            rule = "do so less, but not under confinement with friction angles above 50 degrees."
            lines.append(f"{several} Specimens of nine grains or more across {rule}")
        return lines

    @property
    def _more_fresh(self) -> str:
        """How many fresh specimens of each shape would tell, and what that would cost, in words."""
        enough, tests = dict[str, int](), 0
        for shape, seeds in self.tried.items():
            own = [each for each in self.checks if shape_of(each.name) == shape]
            enough[shape] = max([len(seeds), *(each.enough for each in own)])
            tests += (enough[shape] - len(seeds)) * tests_of([each.name for each in own], self.targets.pressures)
        each = ", ".join(f"{shape} = {count}" for shape, count in enough.items())
        shown = f"{{{each}}}" if len({*enough.values()}) > 1 else next(iter(enough.values()), "more")
        return f"fresh = {shown} (of [calibration]; {tests} tests more, those that were made are kept)"

    def plot(self, name: str = "fit") -> Figure | None:
        """A picture of the report: "fit", "envelope", "corner", "bands" or "left_out"; None where it shows nothing.

        Raises :class:`ParameterError` for another name.
        """
        from grainlaw.calibration import figures

        if name not in PICTURES:
            raise refusal("Calibration.plot: name", name, enumeration(PICTURES))
        shows = self.is_plausible or name in WITHOUT_ANSWER
        return getattr(figures, name)(self) if shows else None

    def typical(self, shape: str) -> tuple[int, str]:
        """Seed of the fresh specimen of a shape whose strengths lie nearest to their means, and these in words.

        Of those that are targets, where any are. That of the search's first without fresh ones with such strengths.
        """
        of = [
            each for each in self.checks
            if each.name not in ONSETS and each.count == len(self.tried.get(shape, ())) > 1
            and (aim := AIMS[each.name]).power == 1 and aim.column and shape_of(each.name) == shape
        ]  # fmt: skip
        if not of:
            return 1, ""
        of = [each for each in of if each.target] or of
        values = np.array([each.values for each in of])  # (q, n)
        off = (values - values.mean(axis=1, keepdims=True)) / np.maximum(values.std(axis=1, keepdims=True), 1e-300)
        nearest = int(np.argmin((off**2).sum(axis=0)))
        shown = ", ".join(
            f"{look.words} {look.with_unit(each.values[nearest])} (mean {look.with_unit(each.measured)})"
            for each in of
            for look in [AIMS[each.name].shown]
        )
        seed = self.tried[shape][nearest]
        return seed, f"seed {seed}, of the fresh specimens {self.tried_in_words} nearest to their means: {shown}"

    def to_latex(self) -> str:
        """The parameters, and their check on fresh specimens, as tables for a paper (LaTeX, package booktabs)."""
        tables = []
        if self.identifiability:
            tables.append([[spelled(name), *rest] for name, *rest in self.parameter_lines])
        if self.checks:
            tables.append(self._printed)
        return "\n\n".join(map(latex_lines, tables))

    @property
    def tried_in_words(self) -> str:
        """The seeds of the fresh specimens, by shape where these differ."""
        ends = {shape: f"{seeds[0]} to {seeds[-1]}" for shape, seeds in self.tried.items()}
        if len({*ends.values()}) == 1:
            return next(iter(ends.values()))
        return ", ".join(f"{words} ({spelled(shape)})" for shape, words in ends.items()) or "of their own"

    @property
    def known_to(self) -> dict[str, Known]:
        """How well each target and what the tests say of it are known, at the best parameters."""
        return self.found.match.known_to(np.array([self.best[name] for name in self.space.names]))

    @property
    def _limits(self) -> list[str]:
        """Which parameters the tests know hardly better than the first look, and what it is that limits all."""
        lines, known = [], self.known_to
        before, after = self.first_look.posterior if self.first_look else None, self.found.posterior
        if before is not None and after is not None:
            narrowed = width_of(self.space.places(after.points)) / width_of(self.space.places(before.points))
            if alike := [name for name, share in zip(self.space.names, narrowed, strict=True) if share > HARDLY]:
                lines.append(f"Of {enumeration(alike)} the first look knew about as much: the tests confirm it.")
        for part, (words, cure) in LIMITS.items():
            if held := [name for name, each in known.items() if each.largest == part]:
                by = enumeration(f"{AIMS[n].shown.words} ({100 * getattr(known[n], part):.2g} %)" for n in held)
                lines.append(f"{words} is the largest part of what is left open of {by}: {cure}.")
        return lines

    @property
    def known_lines(self) -> list[list[str]]:
        """The standard errors behind the intervals, with a heading."""
        both = "of both, with the first look" if self.first_look else "of both"
        rows = [["standard error of", "target", "specimens", "emulator", both]]
        for name, each in self.known_to.items():
            rows.append([AIMS[name].shown.words, *(f"{100 * part:.2g} %" for part in attrs.astuple(each))])
        return rows

    def judged(self, verdict: str) -> list[str]:
        """Which targets the fresh specimens have so, in words."""
        return [AIMS[each.name].shown.words for each in self.checks if each.verdict == verdict]

    @property
    def check_lines(self) -> list[list[str]]:
        """Targets, predictions and what fresh seeds gave, with a heading."""
        where = f"on fresh seeds {self.tried_in_words}" if self.tried else "on fresh seeds"
        heads = [where, "target", "predicted", "95 %", "measured", "95 %", "scatter", "n", "off", ""]
        rows = [heads]
        for each in self.checks:
            text = AIMS[each.name].shown.text
            off = f"{100 * each.off:+.1f} %" if each.off == each.off else ""
            rows.append([
                AIMS[each.name].shown.heading, text(each.target.value) if each.target else "",
                text(each.predicted), _between(text, each.predicted_interval), text(each.measured),
                _between(text, each.interval), each.scatter_in_words, str(each.count), off, each.verdict or "no target",
            ])  # fmt: skip
        return rows

    @property
    def _printed(self) -> list[list[str]]:
        """The same without the predictions, and without the onsets of cracking that every compression tells."""
        heads, *rows = ([*row[:2], *row[4:]] for row in self.check_lines)
        asked = [each.target is not None or each.name not in ONSETS for each in self.checks]
        return [heads, *itertools.compress(rows, asked)]

    @property
    def quality_lines(self) -> list[list[str]]:
        """How well emulators predict points that were left out, with a heading."""
        rows = [["emulator, left out points", "points", "Q2", "rms of errors", "within 2"]]
        for name, points, share, rms, within in quality(self.found.match.emulators):
            words = AIMS[name].shown.words
            rows.append(
                [words, str(points), f"{share:.3f}" if share == share else "-", f"{rms:.2f}", f"{100 * within:.0f} %"]
            )
        return rows

    @property
    def failure_words(self) -> str:
        """How many tests gave no value, and the first reason of each kind."""
        kinds = Counter(each.test for each in self.failures)
        first = {each.test: each.reason for each in reversed(list(self.failures))}
        words = "; ".join(f"{count} of {test} (first: {first[test]})" for test, count in kinds.items())
        return f"Tests without a value: {words}. A point counts with the seeds that have one, if they are half of them."

    # --- files -------------------------------------------------------------------------------------------------------

    @property
    def summary(self) -> dict[str, Any]:
        """All numbers by name (SI)."""
        found = self.identifiability
        content: dict[str, Any] = {
            "targets": {name: attrs.asdict(target) for name, target in self.targets.given.items()},
            "confinements": list(self.targets.pressures), "law": self.space.kind.__name__, "ranges": self.space.ends,
            "plausible": self.is_plausible, "parameters": self.parameters, "grains": self.grains,
            "stiffness": attrs.asdict(self.stiffness) if self.stiffness else None,
            "first_look": self.first_look.summary if self.first_look else None,
            "waves": [attrs.asdict(wave) for wave in self.found.waves],
            "conflicts": [attrs.asdict(conflict) for conflict in self.found.conflicts],
            "emulators": [dict(zip(("name", "points", "q2", "rms", "within_2"), row, strict=True))
                          for row in quality(self.found.match.emulators)],
            "failures": [attrs.asdict(each) for each in self.failures], "cpu": self.cpu, "seeds": self.seeds,
            "points": self.found.design.points.tolist(), "scales": self.found.design.scales.tolist(),
            "values": {name: values.tolist() for name, values in self.found.design.values.items()},
            "more": {number: {name: values.tolist() for name, values in each.items()}
                     for number, each in self.found.design.more.items()},
            "versions": versions(),
        }  # fmt: skip
        if found is not None:
            content["identifiability"] = {
                "parameters": [attrs.asdict(each) | {"verdict": each.verdict} for each in found.parameters],
                "correlation": found.correlation.tolist(),
                "directions": [attrs.asdict(each) | {"words": each.words} for each in found.directions],
                "further": [attrs.asdict(each) for each in found.further],
                "sobol": {"quantities": list(found.quantities), "parameters": list(self.space.names),
                          "first": found.first_order.tolist(), "total": found.total_order.tolist()},
            }  # fmt: skip
            own = ("off", "verdict")
            content["known_to"] = {name: attrs.asdict(each) for name, each in self.known_to.items()}
            content["checks"] = [attrs.asdict(c) | {name: getattr(c, name) for name in own} for c in self.checks]
        return content

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Write ``report.html``, its pictures, ``tables.tex`` and ``calibration.json``. Raises OSError."""
        from grainlaw.calibration.report import write_report

        path = Path(writable_folder(folder))
        write_json(path / NUMBERS, self.summary)
        write_text(path / TABLES, f"{self.to_latex()}\n")
        drawn = {name: self.plot(name) for name in PICTURES}
        write_report(self, path / REPORT, drawn)
        for name, figure in drawn.items():
            file = path / f"{name}.png"
            if figure is None:
                file.unlink(missing_ok=True)  # of another answer
            else:
                write_atomically(file, functools.partial(figure.savefig, dpi=DPI))


def _between(text: Any, ends: tuple[float, float]) -> str:
    low, high = ends
    return f"{text(low)} to {text(high)}" if low == low else ""
