"""Who answers what a rock with some parameters would do in the laboratory: a study of simulated tests, or a formula."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.calibration.space import Tie, law_with, rounded
from grainlaw.calibration.stiffness_search import with_grains
from grainlaw.calibration.targets import AIMS, BENDING, BRAZILIAN, COMPRESSION, CONFINED, TENSION, TESTS, needed_tests
from grainlaw.fields import ParameterError
from grainlaw.messages import nearest, refusal, short, spelled
from grainlaw.protocol import LoadingProtocol
from grainlaw.protocols import BiaxialCompression, Brazilian, SemiCircularBend, UniaxialCompression, UniaxialTension
from grainlaw.results.standard_measures import MEASURES
from grainlaw.runs.parallel import Run
from grainlaw.runs.progress import Progress
from grainlaw.runs.progress_file import of_process
from grainlaw.runs.record import program
from grainlaw.runs.stopping import Stopped
from grainlaw.specimen import Specimen
from grainlaw.strength import Until
from grainlaw.studies.envelope import fit_mohr_coulomb
from grainlaw.studies.study import Study
from grainlaw.studies.table import Table
from grainlaw.studies.workers import Whole

Values = dict[str, np.ndarray]  #: of each quantity (n, seeds), nan where a test failed


@attrs.frozen
class Failure:
    """A test that gave no value."""

    point: int
    seed: int
    test: str
    reason: str


class Simulator(metaclass=Checked):
    """Answers points of parameters.

    A whole one, a rock whose strengths are those of its contacts::

        class Formula(Simulator):
            def values(self, points, quantities, seeds, scales):
                strength = np.array([point["tensile_strength"] for point in points])
                scatter = np.random.default_rng(seeds).normal(1, 0.05, (len(points), len(seeds)))
                return {name: strength[:, None] * scatter for name in quantities}
    """

    failures: Sequence[Failure] = ()  #: of all that was asked so far
    cpu: float = 0.0  #: s, of all that was asked so far

    @abstractmethod
    def values(
        self, points: Sequence[Mapping[str, float]], quantities: Sequence[str], seeds: Sequence[int],
        scales: np.ndarray,
    ) -> Values:  # fmt: skip
        """Quantities (SI) of points on specimens of these seeds.

        ``scales`` tells of each point how many times stronger the rock is for which it stands: that rock is tested
        under confinement, and values with the dimension of a stress are those of the rock over the scale.
        """


#: Strength is all that a calibration asks of a test: it ends there.
USUAL: dict[str, LoadingProtocol] = {
    COMPRESSION: UniaxialCompression(until=Until.FAILURE),
    CONFINED: BiaxialCompression(confinement=0, until=Until.FAILURE),
    TENSION: UniaxialTension(until=Until.FAILURE),
    BRAZILIAN: Brazilian(until=Until.FAILURE),
    BENDING: SemiCircularBend(until=Until.FAILURE),
}
PRISM, DISC, HALF_DISC = "prism", "disc", "half_disc"
SHAPES = {COMPRESSION: PRISM, CONFINED: PRISM, TENSION: PRISM, BRAZILIAN: DISC, BENDING: HALF_DISC}
MEASURED = ("crack_initiation_lateral", "crack_damage")
LONGEST = 0.45  #: strain, of courses that similarity makes longer
COURSES = {"failure_strain": "maximum_strain", "failure_deflection": "maximum_deflection"}

Specimens = Callable[[int], Specimen]


def checked_tests(given: Mapping[str, Any]) -> dict[str, LoadingProtocol]:
    """The usual tests with others in their place. Raises :class:`ParameterError`."""
    for name, test in given.items():
        if name not in TESTS:
            raise ParameterError(f"calibrate: tests: there is no test {short(name)}{nearest(str(name), TESTS)}")
        if not isinstance(test, type(USUAL[name])):
            raise refusal(f"calibrate: tests: {name}", test, f"a {type(USUAL[name]).__name__}")
    return {**USUAL, **given}


def checked_specimens(given: Any, tests: Sequence[str]) -> dict[str, Specimens]:
    """Functions of the seed by the shapes that tests need. Raises :class:`ParameterError`."""
    known = dict(given) if isinstance(given, Mapping) else {PRISM: given}
    for shape, make in known.items():
        if shape not in SHAPES.values():
            near = nearest(str(shape), (PRISM, DISC, HALF_DISC))
            raise ParameterError(f"calibrate: specimens: there is no shape {short(shape)}{near}")
        if not callable(make):
            raise refusal(f"calibrate: specimens: {shape}", make, "a function of the seed that returns a Specimen")
    for test in tests:
        if SHAPES[test] not in known:
            raise ParameterError(
                f"calibrate: the {test} test needs specimens of the shape '{SHAPES[test]}': give "
                f"specimens={{'{PRISM}': ..., '{SHAPES[test]}': lambda seed: ...}}"
            )
    return known


@attrs.frozen(eq=False)
class TrialCase(metaclass=Checked):
    """One test of a rock; the factors are the parameters by name, the test, its confinement, a scale and the seed.

    The course is long enough for a rock ``scale`` times as strong, which breaks at so many times the strain.
    """

    law: Any  #: or its class
    base: Mapping[str, Any]
    ties: tuple[Tie, ...]
    specimens: Mapping[str, Specimens]
    tests: Mapping[str, LoadingProtocol]
    grains: float  #: times the modulus of the grains

    def __call__(self, test: str, confinement: float, scale: float, seed: int, **parameters: float) -> Run:
        protocol: Any = at_scale(self.tests[test], scale)
        if test == CONFINED:
            protocol = attrs.evolve(protocol, confinement=confinement)
        specimen = with_grains(self.specimens[SHAPES[test]](seed), self.grains)
        return Run(specimen, law_with(self.law, self.base, self.ties, parameters), protocol)


class StudySimulator(Simulator):
    """Runs tests as cases of a study; what its store has is not run again.

    Confined tests have the parameters of the rock itself: split specimens buckle by their strain, so that under
    confinement similar rocks differ. ``powers`` are those of a strength which the parameters follow by similarity.
    """

    def __init__(
        self, case: TrialCase, powers: Mapping[str, int], pressures: Sequence[float], store: Any, *,
        bars: Progress | None = None, **options: Any,
    ) -> None:  # fmt: skip
        self.case, self.powers, self.pressures = case, powers, tuple(pressures)
        self.whole = Whole("calibration", 0, of_process(Path(store), {"program": program()}), bars)
        self.store, self.options = store, {"progress": bars or False, "whole": self.whole, **options}
        self.weakest = 1.0  #: scale for which courses of tests without confinement are long enough
        self.failures: list[Failure] = []
        self.cpu = 0.0
        self.points: dict[tuple[float, ...], int] = {}  #: those that were asked for, numbered
        self.names: tuple[str, ...] = ()  #: of the parameters
        self.cases: set[str] = set()  #: keys of those that were counted

    def stiffen(self, parameters: Mapping[str, float], grains: float) -> None:
        """Test from now on with these stiffnesses of the law, and grains so many times stiffer than given."""
        self.case = attrs.evolve(self.case, base={**self.case.base, **parameters}, grains=grains)

    def plan(self, *parts: tuple[Sequence[str], Sequence[int]]) -> None:
        """Say that from now on quantities are measured on these seeds at most."""
        tests = sum(len(seeds) * tests_of(quantities, self.pressures) for quantities, seeds in parts)
        self.whole.planned = len(self.whole.done) + tests

    def values(
        self, points: Sequence[Mapping[str, float]], quantities: Sequence[str], seeds: Sequence[int],
        scales: np.ndarray,
    ) -> Values:  # fmt: skip
        tests, cases = needed_tests(quantities), list[dict[str, Any]]()
        confined = _confinements(quantities, self.pressures)
        self.names = tuple(points[0]) if points else ()
        trials = [
            {test: self._tested(test, point, float(scale)) for test in tests}
            for point, scale in zip(points, scales, strict=True)
        ]
        for of_point in trials:
            for test, tested in of_point.items():
                levels = confined if test == CONFINED else (0.0,)
                cases += [{**tested, "confinement": level} for level in levels]
        cases = list({tuple(case.items()): case for case in cases}.values())
        found = {name: np.full((len(points), len(seeds)), np.nan) for name in quantities}
        if not cases:
            return found
        measures = [MEASURES[name] for name in MEASURED]
        study = Study(self.case, cases=cases, seed=list(seeds), measures=measures)
        try:
            table = study.run(self.store, **self.options)
        except Stopped as stopped:
            stopped.result = None  # a table of some points is no answer of a calibration
            raise
        rows = self._rows(table)
        for i, (point, scale) in enumerate(zip(points, scales, strict=True)):
            number = self.points.setdefault(tuple(point.values()), len(self.points))
            for j, seed in enumerate(seeds):
                for name in quantities:
                    found[name][i, j] = self._value(name, rows, trials[i], number, seed, float(scale))
        return found

    def _tested(self, test: str, point: Mapping[str, float], scale: float) -> dict[str, Any]:
        """What is tested for a point: under confinement the rock itself, else a similar one."""
        if test != CONFINED:
            return {**point, "test": test, "scale": self.weakest}
        if scale != 1:
            point = {name: rounded(value * scale ** self.powers[name]) for name, value in point.items()}
        return {**point, "test": test, "scale": 1.0}

    def _rows(self, table: Table) -> dict[tuple, dict[str, Any]]:
        for key, cost in zip(table.cases, table.costs, strict=True):
            if key not in self.cases:
                self.cases.add(key)
                self.whole.done.add(key)  # also of those that the store had
                self.cpu += float(cost.get("cpu") or 0.0)
        keys = (*self.names, "test", "scale", "confinement", "seed")
        return {tuple(row[key] for key in keys): row for row in table.rows}

    def _value(
        self, name: str, rows: Mapping[tuple, Mapping[str, Any]], trials: Mapping[str, Mapping[str, Any]], number: int,
        seed: int, scale: float,
    ) -> float:  # fmt: skip
        """A quantity of the point of this number, from what is tested for it."""
        aim = AIMS[name]

        def column(test: str, confinement: float, which: str) -> float:
            tested = trials[test]
            row = rows[(*tested.values(), confinement, seed)]
            reason = _why_none(row, at_scale(self.case.tests[test], tested["scale"]))
            if reason:
                failure = Failure(number, seed, test, reason)
                if failure not in self.failures:
                    self.failures.append(failure)
            value = row.get(which)
            return math.nan if reason or value is None else float(value)

        if CONFINED not in aim.tests:
            return column(aim.tests[0], 0.0, aim.column)
        if aim.confinement:
            return column(CONFINED, aim.confinement, "strength") / scale
        peaks = [scale * column(COMPRESSION, 0.0, "strength")]
        peaks += [column(CONFINED, level, "strength") for level in self.pressures]
        if not np.isfinite(peaks).all():
            return math.nan
        line = fit_mohr_coulomb([0.0, *self.pressures], peaks)
        return line.friction_angle if name == "friction_angle" else line.cohesion / scale


def shape_of(quantity: str) -> str:
    """Of the specimens that measure a quantity."""
    return SHAPES[AIMS[quantity].tests[-1]]


def by_shape(
    quantities: Sequence[str], seeds: Mapping[str, Sequence[int]]
) -> Iterator[tuple[list[str], Sequence[int]]]:
    """Quantities that are measured on specimens of one shape, and the seeds of these."""
    for shape, own in seeds.items():
        if names := [name for name in quantities if shape_of(name) == shape]:
            yield names, own


def tests_of(quantities: Sequence[str], pressures: Sequence[float]) -> int:
    """How many tests of one specimen measure quantities."""
    levels = len(_confinements(quantities, pressures))
    return sum(levels if test == CONFINED else 1 for test in needed_tests(quantities))


def _confinements(quantities: Sequence[str], pressures: Sequence[float]) -> list[float]:
    """Pa, under which quantities are measured."""
    aims = [AIMS[name] for name in quantities if CONFINED in AIMS[name].tests]
    return [*dict.fromkeys(p for aim in aims for p in ((aim.confinement,) if aim.confinement else pressures))]


def at_scale(test: Any, scale: float) -> Any:
    """The test with its course divided by the scale, and as many more samples."""
    courses = {name: getattr(test, name) / scale for name in COURSES.values() if hasattr(test, name)}
    if not courses or scale == 1:
        return test
    if "maximum_strain" in courses:
        courses["maximum_strain"] = min(courses["maximum_strain"], LONGEST)
    return attrs.evolve(test, **courses, samples=math.ceil(test.samples / scale))


def _why_none(row: Mapping[str, Any], test: Any) -> str:
    """Why a test gave no strength; empty if it did."""
    if row["status"] != "finished":
        return f"{row['status']}: {row['reason']}"
    for column, limit in COURSES.items():
        if column in row and (row[column] is None or math.isnan(row[column])):
            return f"no failure up to the {spelled(limit)} of {getattr(test, limit):.4g}"
    return ""
