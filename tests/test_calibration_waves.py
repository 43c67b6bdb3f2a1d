"""The plan of a search, what it asks of a laboratory and the check of its answer: of emulators that are given."""

import math
import warnings
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from formula_rocks import FOUR, RANGES, FormulaRock, space, targets_at
from support import ROCK, STIFF, small_sample

import grainlaw as gl
from grainlaw.calibration import calibrate as calibration
from grainlaw.calibration import trials, waves
from grainlaw.calibration.check import Compared, check
from grainlaw.calibration.first_look import FirstLook, FirstMatch, ShippedEmulator
from grainlaw.calibration.matching import Plausible
from grainlaw.calibration.moduli import meet_moduli
from grainlaw.calibration.posterior import Posterior
from grainlaw.calibration.space import Tie
from grainlaw.calibration.stiffness_search import Stiffness
from grainlaw.calibration.targets import Target, Targets
from grainlaw.calibration.trials import Simulator, StudySimulator, TrialCase, at_scale
from grainlaw.calibration.waves import Search
from grainlaw.fields import ParameterError
from grainlaw.geometry import Bricks, Voronoi, rectangle
from grainlaw.laws import MohrCoulomb
from grainlaw.protocols import SemiCircularBend, UniaxialCompression
from grainlaw.runs.stopping import Stopped
from grainlaw.units import MPa, mm

LAW = MohrCoulomb(**STIFF, tensile_strength=10 * MPa, cohesion=40 * MPa, friction_angle=40)
HIDDEN = {"tensile_strength": 11 * MPa, "cohesion": 33 * MPa, "friction_angle": 41.0}
ROCKS = space(LAW, {name: RANGES[name] for name in ("tensile_strength", "cohesion", "friction_angle")}, {})
PRISM = small_sample(12)
GROUPS, TRIED = 2, 512  # beside the scale of the rock


class Given:
    """Emulators, plausible points and a posterior without any computation; what is asked of them is kept."""

    def __init__(self, monkeypatch, least=1.0, variance=2.0):
        self.least, self.variance, self.asked, self.rooms, self.posteriors = least, variance, [], [], []
        monkeypatch.setattr(waves, "TRIED", TRIED)
        monkeypatch.setattr(waves, "emulators", lambda coordinates, samples, seed: dict.fromkeys(samples.names))
        monkeypatch.setattr(waves, "Match", self.match)
        monkeypatch.setattr(waves, "plausible", self.plausible)
        monkeypatch.setattr(waves, "posterior", self.posterior)
        monkeypatch.setattr(waves, "telling", self.telling)
        monkeypatch.setattr(waves, "conflicts", lambda match, tried, seed: ["conflict"])

    def match(self, space, targets, found, samples, before):
        """Two targets whose other variances are 5 of the seeds and 4 of the laboratory."""
        return SimpleNamespace(
            names=("a", "b"), scatter=lambda names: np.eye(2) * 5, target_variance=np.array([4.0, 4.0]),
            predicted=lambda points, names: (None, np.full((len(points), 2), self.variance)), apart=lambda points: {},
        )  # fmt: skip

    def plausible(self, match, points, seed):
        self.asked.append((len(points), seed))
        return Plausible(points[:400], 0.25, self.least, points[7])

    def posterior(self, match, start, seed, blocks=None, folder=None):
        self.posteriors.append((len(start), seed, blocks))
        return SimpleNamespace(points=np.repeat(start, 2, axis=0), best=start[3])

    def telling(self, match, candidates, count, first):
        self.rooms.append((len(candidates), count, len(first)))
        return np.unique(candidates, axis=0)[:count]


class Asked(Simulator):
    """A rock whose laboratory keeps what it was asked for."""

    def __init__(self):
        self.calls, self.rock = [], FormulaRock()

    def values(self, points, quantities, seeds, scales):
        self.calls.append((len(points), tuple(quantities), tuple(seeds), scales))
        return self.rock.values(points, quantities, seeds, scales)


def search(budget=60, seed=5, more=(), targets=None, names=FOUR):
    targets = targets_at(HIDDEN, FOUR).tested if targets is None else targets
    return Search(ROCKS, targets, names, Asked(), (1, 2, 3), budget, seed, more)


@pytest.mark.parametrize(
    ("budget", "more", "points"),
    [
        (60, (), [20, 10, 10]),  # ten for each group, then five
        (30, (), [18, 6, 6]),  # six tenths of the budget, the rest in halves
        (9, (), [6, 1, 2]),  # four more than groups at least
        (36, range(4, 13), [20, 7, 9]),  # one of the first wave and one of the last are on more seeds
        (6, (), [6]),
    ],
)
def test_a_budget_is_divided_among_waves(monkeypatch, budget, more, points):
    given, plan = Given(monkeypatch), search(budget, more=more)
    found = plan.run()
    assert [wave.count for wave in found.waves] == points
    assert [wave.first for wave in found.waves] == [0, *np.cumsum(points)[:-1]]
    assert {(wave.share, wave.least) for wave in found.waves} == {(0.25, 1.0)}
    assert len(found.design.points) == sum(points) <= budget
    assert {count for count, _ in given.asked} == {TRIED}
    assert [seed for _, seed in given.asked][:: 1 if not more else 2][:1] == [5 + 1]
    assert given.posteriors[-1] == (400, 5, None)
    assert found.conflicts == ()
    seeds = [call[2] for call in plan.simulator.calls if call[2] != (1, 2, 3)]
    assert seeds == [tuple(range(1, 13))] * (4 if more else 0)  # two points, without and with confinement
    assert set(found.design.anchors) == ({19, 35} if more else set())
    assert {values["ucs"].shape for values in found.design.anchors.values()} <= {(1, 12)}
    assert found.design.values["ucs"].shape == (sum(points), 3)


def test_where_it_is_told_where_to_begin_a_search_takes_half_of_the_points(monkeypatch):
    """Five for each group and four more: the first of those that it is given, brought to the reference."""
    Given(monkeypatch)
    begin = ROCKS.prior(40, 3)
    plan = attrs.evolve(search(), begin=begin)
    assert [wave.count for wave in plan.run().waves] == [14, 10, 10]
    assert plan.run().design.points[:14] == pytest.approx(ROCKS.at_reference(begin[:14]))
    few = attrs.evolve(search(9), begin=begin)
    assert [wave.count for wave in few.run().waves] == [6, 1, 2]
    asked = len(plan.simulator.calls)
    assert plan.pilot() == pytest.approx(ROCKS.at_reference(begin[:1])[0])  # the likeliest, without a test
    assert len(plan.simulator.calls) == asked


def test_points_of_a_wave_are_those_that_tell_most_among_plausible_ones(monkeypatch):
    """Half of them of the posterior, from its first to its last sample, at the reference."""
    given = Given(monkeypatch)
    found = search().run()
    assert given.rooms == [(600, 10, 1)] * 2
    assert [asked[:2] for asked in given.posteriors] == [(400, 5)] * 3
    assert ROCKS.scales(found.design.points) == pytest.approx(1, rel=1e-4)


@pytest.mark.parametrize(("variance", "count"), [(0.99, 1), (1.01, 3)])
def test_no_wave_is_made_where_emulators_know_better_than_the_laboratory(monkeypatch, variance, count):
    """A tenth of it all: of the emulators themselves, 5 of the seeds and 4 of the laboratory."""
    Given(monkeypatch, variance=variance)
    assert len(search().run().waves) == count
    Given(monkeypatch, variance=np.array([0.5, 1.01]))
    assert len(search().run().waves) == 3


def test_where_nothing_is_plausible_it_looks_around_the_best_and_tells_the_conflict(monkeypatch):
    given = Given(monkeypatch, least=3.1)
    assert search(more=range(4, 13)).run().posterior is None
    found = search().run()
    assert [wave.count for wave in found.waves] == [20, 10, 10]
    assert (found.posterior, found.conflicts, given.posteriors) == (None, ("conflict",), [])


def test_points_around_the_best_come_nearer_from_wave_to_wave():
    place = np.full((1, 3), 0.5)
    best = ROCKS.points(place)[0]
    one, two = (ROCKS.places(search()._around(best, number)) - 0.5 for number in (1, 2))
    assert one.std(axis=0) == pytest.approx(0.15, rel=0.15)
    assert two.std(axis=0) == pytest.approx(0.075, rel=0.15)
    again = [ROCKS.places(search(seed=5 + k)._around(best, 2 - k)) for k in (0, 1)]
    assert (again[1] - 0.5)[:50] == pytest.approx(2 * (again[0] - 0.5)[:50])  # seed and wave together choose them


@pytest.mark.parametrize(("budget", "count"), [(60, 10), (27, 9), (9, 6)])
def test_a_pilot_is_a_third_of_the_budget_at_most(monkeypatch, budget, count):
    Given(monkeypatch)
    plan = search(budget)
    best = plan.pilot()
    assert plan.simulator.calls[0][0] == count
    assert best == pytest.approx(ROCKS.at_reference(ROCKS.prior(TRIED, 6)[7:8])[0])


def test_rocks_are_as_much_stronger_as_the_targets_ask():
    """By the UCS, by that of a line or of triaxial tests, or by all strengths there are; in the range of the scale."""
    low, high = (float(f"{end / ROCKS.reference:.4g}") for end in (5 * MPa, 30 * MPa))

    def scales(targets, **values):
        given = {name: np.array(rows, dtype=float) * MPa for name, rows in values.items()}
        plan = search(targets={name: Target(value, 1.0) for name, value in targets.items()})
        return plan._scales(given, len(next(iter(given.values())))).tolist()

    ucs = [[50, 200], [25, 100], [np.nan, 400], [1, 1], [np.nan, np.nan]]
    wanted = {"ucs": 100 * MPa, "tensile_strength": 10 * MPa}
    assert scales(wanted, ucs=ucs, tensile_strength=np.ones((5, 2))) == [1.0, 2.0, low, high, 1.0]
    line = {"cohesion": 10 * MPa, "friction_angle": 30.0}  # 2 c cos(phi) / (1 - sin(phi)) = 34.64 MPa
    assert scales(line, ucs=[[34.641, 34.641], [17.3205, 17.3205]]) == [1.0, 2.0]
    two = {"tensile_strength": 10 * MPa, "brazilian_strength": 10 * MPa}
    rows = {"tensile_strength": [[10, 10], [5, 5]], "brazilian_strength": [[3.90625] * 2, [np.nan] * 2]}
    assert scales(two, **rows) == [1.6, 2.0]
    assert scales({"tensile_strength": 10 * MPa, "cohesion": 1 * MPa}, tensile_strength=[[5, 5]]) == [2.0]
    assert scales({"friction_angle": 40.0}, ucs=[[34.641, 34.641]]) == [1.0]
    under_one = {"strength at 20 MPa": 150 * MPa}  # 150 - 5 * 20 = 50 MPa, a usual steepness
    assert scales(under_one, ucs=[[50, 50], [25, 25]]) == [1.0, 2.0]
    under_two = {"strength at 20 MPa": 120 * MPa, "strength at 75 MPa": 285 * MPa}  # three times the confinement
    assert scales(under_two, ucs=[[60, 60], [30, 30]]) == [1.0, 2.0]
    assert scales({"strength at 40 MPa": 200 * MPa}, ucs=[[50, 50]]) == [1.0]  # a quarter of it at least


def test_confined_tests_come_last_at_the_strength_of_the_rock():
    plan = search(names=("cohesion", "ucs", "tensile_strength"))
    points = ROCKS.prior(2, 1)
    scales, values = plan._tested(points, (1, 2))
    free, confined = plan.simulator.calls
    assert free[:3] == (2, ("ucs", "tensile_strength"), (1, 2))
    assert confined[:3] == (2, ("cohesion",), (1, 2))
    assert free[3].tolist() == [1, 1]
    assert confined[3].tolist() == scales.tolist() != [1, 1]
    assert list(values) == ["cohesion", "ucs", "tensile_strength"]


def test_a_target_without_values_is_told():
    class Silent(Asked):
        def values(self, points, quantities, seeds, scales):
            found = super().values(points, quantities, seeds, scales)
            return {name: np.where(np.arange(len(points))[:, None] < 2, rows, np.nan) for name, rows in found.items()}

        failures = (SimpleNamespace(test="tension", reason="no peak"),)

    plan = attrs.evolve(search(), simulator=Silent())
    says = r"ucs has a value at 2 of 20 points only \(the first failure: tension, no peak\); narrow the ranges"
    with pytest.raises(ParameterError, match=says):
        plan.run()


# --- the check -------------------------------------------------------------------------------------------------------


def test_a_check_predicts_what_fresh_seeds_may_give():
    """The variance of the emulator, of the seeds of the search, of their shift, and of the five that have a value."""
    match = SimpleNamespace(
        emulators={"ucs": None}, one=lambda best, name: (np.log([100e6]), np.array([0.01**2 + 0.02**2 + 0.03**2])),
        samples=SimpleNamespace(names=("ucs",), of_shift=np.array([0.02**2]), seeds=np.array([3])),
        scatter=lambda names: np.array([[0.02**2 + 0.03**2]]), space=ROCKS,
    )  # fmt: skip

    class Rock(Asked):
        def values(self, points, quantities, seeds, scales):
            self.calls.append((points, seeds, scales))
            return {name: np.array([[98e6, 99e6, 100e6, 101e6, 102e6, np.nan]]) for name in quantities}

    rock, best = Rock(), np.array(list(HIDDEN.values()))
    seeds = {"prism": range(7, 13), "disc": range(7, 9)}
    ucs, *others = check(match, Targets(ucs=(104e6, 1e6)), rock, best, ("compression", "tension"), seeds)
    assert [each.name for each in others] == [
        "youngs_modulus", "poissons_ratio", "tensile_strength", "crack_initiation", "crack_damage",
    ]  # fmt: skip
    assert rock.calls == [([HIDDEN], range(7, 13), np.ones(1))]
    deviation = math.sqrt(0.01**2 + 0.03**2 + 0.02**2 + 0.03**2 * 3 / 5)
    assert ucs.predicted == pytest.approx(100e6)
    assert ucs.predicted_interval == pytest.approx([100e6 * math.exp(k * 1.959964 * deviation) for k in (-1, 1)])
    half = 2.776445 * math.sqrt(2.5e12 / 5)  # Student's t of four degrees of freedom
    assert (ucs.measured, ucs.count, *ucs.interval) == pytest.approx((100e6, 5, 100e6 - half, 100e6 + half))
    assert ucs.off == pytest.approx(-4 / 104)
    assert ucs.values[:5] == (98e6, 99e6, 100e6, 101e6, 102e6)
    assert math.isnan(ucs.values[5])  # which places a value by its seed
    assert ucs.scatter_in_words == "2 %"
    assert ucs.outliers == ""
    locked = attrs.evolve(ucs, values=(100e6, 140e6, math.nan, 149e6, 226e6, 225e6))
    assert locked.outliers == "2 of 5 have more than 1.5 times the median UCS, 149.00 MPa"
    assert others[0].verdict == ""
    assert math.isnan(others[0].off)
    assert math.isnan(others[0].predicted)


@pytest.mark.parametrize(
    ("measured", "interval", "uncertainty", "verdict"),
    [
        (104.9, (104.8, 105.0), 1, "met"), (95.1, (95.0, 95.2), 1, "met"), (104, (74, 201), 1, "undecided"),
        (106, (99, 113), 0.5, "within errors"),  # 7 % and 1 % together
        (106, (101, 111), 1, "not met"),  # 5.4 % together
        (106, (101, 111), 2, "within errors"),  # 6.3 %
        (115, (74, 201), 1, "undecided"), (125, (110, 140), 5, "not met"),
        (94, (math.nan, math.nan), 5, "not met"), (96, (math.nan, math.nan), 1, "met"),
    ],
)  # fmt: skip
def test_a_target_is_met_within_errors_or_not(measured, interval, uncertainty, verdict):
    """Within 5 %; else within 95 % of the interval's half and 1.96 times the target's uncertainty, as they add up."""
    assert Compared("ucs", Target(100.0, uncertainty), 0.0, (0.0, 0.0), measured, interval, 3).verdict == verdict


# --- tests as cases of a study ---------------------------------------------------------------------------------------


class Table:
    """A study whose runs are formulas: a strength of nine times the contacts' and a confinement that counts thrice."""

    made: list = []  # noqa: RUF012

    def __init__(self, case, cases, seed, measures):
        self.made.append((cases, seed, [measure.name for measure in measures]))
        self.rows = [
            {**each, "seed": k, "status": "finished", "reason": "", "failure_strain": 1e-3,
             "strength": 9 * each["tensile_strength"] * (1 + k / 10) + 3 * each["confinement"]}
            for each in cases for k in seed
        ]  # fmt: skip
        self.cases, self.costs = [str(row) for row in self.rows], [{"cpu": 2.0} for _ in self.rows]

    def run(self, store, **options):
        return self


@pytest.fixture
def laboratory(monkeypatch):
    monkeypatch.setattr(trials, "Study", Table)
    monkeypatch.setattr(Table, "made", [])
    case = TrialCase(LAW, {}, (), {}, trials.USUAL, 1.0)
    simulator = StudySimulator(
        case, {"tensile_strength": 1, "cohesion": 1, "friction_angle": 0}, [5 * MPa, 9 * MPa], ""
    )
    assert simulator.weakest == 1.0
    simulator.weakest = 0.5
    return simulator


def test_values_of_a_point_are_those_of_the_rock_over_its_scale(laboratory):
    """The line of one that is twice as strong has its friction angle and half of its cohesion."""
    rocks = [HIDDEN, HIDDEN | {"cohesion": 50 * MPa}, HIDDEN]
    quantities = ["ucs", "cohesion", "friction_angle", "strength at 9 MPa"]
    found = laboratory.values(rocks, quantities, (1, 2), np.array([1.0, 2.0, 1.0]))
    ucs = 9 * 11 * MPa * np.array([[1.1, 1.2]] * 3)
    assert found["ucs"] == pytest.approx(ucs)
    assert found["friction_angle"] == pytest.approx(np.full((3, 2), 30.0))
    assert found["cohesion"] == pytest.approx(ucs / (2 * math.sqrt(3)))
    assert found["strength at 9 MPa"] == pytest.approx(ucs + 27 * MPa / np.array([[1.0], [2.0], [1.0]]))
    [(cases, seeds, measures)] = Table.made
    assert (seeds, measures) == ([1, 2], ["crack_initiation_lateral", "crack_damage"])
    twice = {"tensile_strength": 22 * MPa, "cohesion": 100 * MPa, "friction_angle": 41.0}
    expected = []
    for rock, strong in ((HIDDEN, HIDDEN), (rocks[1], twice)):
        expected.append({**rock, "test": "compression", "scale": 0.5, "confinement": 0.0})
        expected += [{**strong, "test": "confined", "scale": 1.0, "confinement": p * MPa} for p in (5, 9)]
    assert cases == expected
    assert laboratory.cpu == 2.0 * 12
    laboratory.values(rocks[:1], ["ucs"], (1, 2), np.ones(1))
    assert laboratory.cpu == 2.0 * 12  # what was counted is not counted again
    assert list(laboratory.points.values()) == [0, 1]
    assert np.isnan(laboratory.values(rocks, [], (1, 2), np.ones(3)).get("ucs", np.nan)).all()


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"status": "failed", "reason": "it broke"}, "failed: it broke"),
        ({"failure_strain": math.nan}, "no failure up to the maximum strain of 0.02"),
        ({"failure_strain": None}, "no failure up to the maximum strain of 0.02"),
    ],
)
def test_a_test_without_a_failure_has_no_value_and_says_why(laboratory, monkeypatch, change, reason):
    def rows(self, store, **options):
        self.rows = [row | change if row["seed"] == 2 else row for row in self.rows]
        return self

    monkeypatch.setattr(Table, "run", rows)
    found = laboratory.values([HIDDEN], ["ucs", "cohesion"], (1, 2), np.ones(1))
    assert np.isnan(found["ucs"]).tolist() == np.isnan(found["cohesion"]).tolist() == [[False, True]]
    first = laboratory.failures[0]
    assert (first.point, first.seed, first.test, first.reason) == (0, 2, "compression", reason)
    assert len(laboratory.failures) == len(set(laboratory.failures))


def test_a_case_is_a_test_of_a_specimen_with_the_parameters_of_a_point():
    block = gl.Specimen(Bricks(rows=1).tessellate(rectangle(4e-3, 8e-3)), ROCK)
    case = TrialCase(LAW, {"kn": 2e14}, (Tie("residual_cohesion", "cohesion", 0.1),), {"prism": lambda seed: block},
                     trials.USUAL, 2.0)  # fmt: skip
    press, confined = (
        case(test, p, 0.5, 3, cohesion=30 * MPa) for test, p in (("compression", 0.0), ("confined", 5e6))
    )
    assert press.protocol == at_scale(trials.USUAL["compression"], 0.5)
    assert confined.protocol.confinement == 5e6
    assert press.law == attrs.evolve(LAW, kn=2e14, cohesion=30 * MPa, residual_cohesion=3 * MPa)
    assert press.specimen.material.youngs_modulus == 2 * ROCK.youngs_modulus


def test_stiffnesses_that_statics_will_find_begin_with_five_times_that_of_the_grains():
    """Modulus over size, of those that are neither free nor have a default."""
    square = gl.Specimen(Bricks(rows=2).tessellate(rectangle(4e-3, 8e-3)), ROCK)
    free = {name: RANGES[name] for name in HIDDEN}
    targets = Targets(ucs=1e8, youngs_modulus=5e10)
    found = calibration._space(MohrCoulomb, free, {}, {"prism": lambda seed: square}, targets)
    assert found.base == pytest.approx({"kn": 5 * 60e9 / 4e-3, "ks": 5 * 60e9 / 4e-3})
    del free["cohesion"]  # which is no stiffness, and has no default
    with pytest.raises(gl.ParameterError, match="cohesion"):
        calibration._space(MohrCoulomb, free, {}, {"prism": lambda seed: square}, targets)


def test_courses_grow_as_the_rock_is_weaker():
    press, bend = UniaxialCompression(maximum_strain=0.01, samples=1000), SemiCircularBend(maximum_deflection=2e-4)
    weak = at_scale(press, 0.3)
    assert (weak.maximum_strain, weak.samples) == (0.01 / 0.3, 3334)
    assert at_scale(press, 0.01).maximum_strain == 0.45
    assert (at_scale(bend, 0.5).maximum_deflection, at_scale(bend, 0.5).samples) == (4e-4, 2000)
    assert at_scale(press, 1) is press


# --- stiffness, and the numbers of seeds -----------------------------------------------------------------------------


@pytest.mark.parametrize("gives", [60e9, 50e9])
def test_a_pilot_that_is_of_no_use_is_taken_off_the_budget(laboratory, monkeypatch, gives):
    """Its tests serve the search where statics were right at once."""
    monkeypatch.setattr(Search, "pilot", lambda self: laboratory.values([HIDDEN], ["ucs"], (1,), np.ones(1)) and POINT)
    POINT = np.array(list(HIDDEN.values()))

    def statics(aims):
        young = aims["youngs_modulus"]
        return Stiffness(parameters={"kn": young}, grains=2.0, modulus=young, poisson=0.2, solutions=1)

    def values(points, quantities, seeds, scales):
        assert (points, seeds) == ([HIDDEN], (1, 2, 3))
        return {"youngs_modulus": np.array([[gives / 60e9 * laboratory.case.base["kn"]]])}

    plan = search(budget=40)
    monkeypatch.setattr(laboratory, "values", Once(laboratory.values, values))
    first = statics({"youngs_modulus": 60e9})
    found, stiffness = meet_moduli(plan, laboratory, statics, {"youngs_modulus": 60e9}, first)
    assert stiffness.parameters["kn"] == pytest.approx(60e9 * 60e9 / gives)
    assert found.budget == (40 if gives == 60e9 else 39)
    assert found.space.base == laboratory.case.base == stiffness.parameters
    assert laboratory.case.grains == 2.0


class Once:
    """One function the first time, another one then."""

    def __init__(self, first, then):
        self.functions = [first, then]

    def __call__(self, *given):
        return self.functions.pop(0)(*given) if len(self.functions) > 1 else self.functions[0](*given)


def test_seeds_of_the_search_of_the_best_points_and_of_the_check_are_others(monkeypatch):
    asked = {}

    class Found:
        def __init__(self, space, targets, names, simulator, seeds, budget, seed, others, tell, chains):
            asked.update(names=names, seeds=seeds, budget=budget, seed=seed, others=others, weakest=simulator.weakest)
            self.space, self.seed = space, seed

        def run(self):
            best = np.array([11.23456e6, 33e6, 41.0])
            return waves.SearchResult(None, (), None, None, SimpleNamespace(best=best), ())

    def checked(match, targets, simulator, best, tests, seeds):
        asked.update(best=best.tolist(), tests=tests, fresh=seeds, strong=simulator.weakest)
        return []

    monkeypatch.setattr(calibration, "Search", Found)
    monkeypatch.setattr(calibration, "check", checked)
    monkeypatch.setattr(calibration, "looked_at", lambda *given: "it does not know it")
    monkeypatch.setattr(calibration, "identifiability", lambda match, found, seed: None)
    free = {name: RANGES[name] for name in HIDDEN}
    given = {"store": "", "seeds": 3, "more": 5, "fresh": 4, "seed": 8, "progress": False}
    targets = targets_at(HIDDEN, ("ucs", "tensile_strength"))
    calibration.calibrate(targets, LAW, free, lambda seed: PRISM, budget=30, **given)
    assert (asked["seeds"], asked["others"], asked["fresh"]) == (range(1, 4), range(4, 9), {"prism": range(9, 13)})
    assert (asked["budget"], asked["seed"], asked["strong"]) == (30, 8, 1.0)
    assert asked["weakest"] == pytest.approx(5 / 12.247, rel=1e-3)
    assert asked["names"] == ["ucs", "tensile_strength", "crack_initiation", "crack_damage"]
    assert asked["tests"] == ["compression", "confined", "tension"]
    assert asked["best"] == [11.23e6, 33e6, 41.0]
    with pytest.raises(ParameterError, match="budget = 11 is not allowed, it must be at least 12: 2 times 6 points"):
        calibration.calibrate(targets, LAW, free, lambda seed: PRISM, budget=11, **given)
    one = lambda seed: PRISM  # noqa: E731
    calibration.calibrate(targets, LAW, free, one, budget=30, **given | {"fresh": {"prism": 40}})
    assert asked["fresh"] == {"prism": range(9, 49)}
    with pytest.raises(ParameterError, match=r"fresh = \{'disc': 4\} is not allowed.* one for each of prism"):
        calibration.calibrate(targets, LAW, free, one, budget=30, **given | {"fresh": {"disc": 4}})
    with pytest.raises(ParameterError, match=r"fresh = 1 is not allowed"):
        calibration.calibrate(targets, LAW, free, one, budget=30, **given | {"fresh": 1})
    angle = Targets(friction_angle=40.0)
    with pytest.raises(ParameterError, match="cohesion or friction_angle needs confinements"):
        calibration.calibrate(angle, LAW, free, lambda seed: PRISM, budget=30, **given)
    calibration.calibrate(attrs.evolve(angle, confinements=[5e6]), LAW, free, lambda seed: PRISM, budget=30, **given)
    assert (asked["names"][0], asked["tests"]) == ("ucs", ["compression", "confined", "tension"])

    def stop(*given):
        raise Stopped

    monkeypatch.setattr(calibration, "check", stop)
    with pytest.raises(Stopped) as stopped:
        calibration.calibrate(targets, LAW, free, lambda seed: PRISM, budget=30, **given)
    assert stopped.value.result.best == {"tensile_strength": 11.23e6, "cohesion": 33e6, "friction_angle": 41.0}


def test_grains_of_two_sizes_are_told():
    def made(grains):
        return lambda seed: gl.Specimen(Voronoi(grains=grains, seed=seed).tessellate(rectangle(20 * mm, 40 * mm)), ROCK)

    for few, told in ((30, ["grains of the disc are 5.16 mm, those of the prism 4 mm: a rock has one size"]), (40, [])):
        with warnings.catch_warnings(record=True) as seen:
            warnings.simplefilter("always")
            calibration._warn_of_sizes("calibrate", {"prism": made(50)(1), "disc": made(few)(1)})
        assert [words in str(each.message) for words, each in zip(told, seen, strict=True)] == [True] * len(told)


def test_a_search_begins_where_the_first_look_tells(monkeypatch):
    """With the points that it offers, unless it finds nothing plausible; the answer keeps it."""
    begun, known, point = [], [], np.array([11e6, 33e6, 41.0])

    class Look(FirstLook):
        def beginning(self, count, seed):
            return np.array([[count, seed, 0.0]])

        def __str__(self):
            return "a look"

    def run(self):
        begun.append(None if self.begin is None else self.begin.tolist())
        known.append(self.before and (self.before.space.names, [*self.before.targets], self.before.grains))
        return waves.SearchResult(None, (), None, None, None, ())

    monkeypatch.setattr(Search, "run", run)
    match = FirstMatch(ROCKS, {}, (), {}, 1.0, ShippedEmulator({}, {}))
    looks = Look(match, Posterior(point[None], point, 1.0), 1.0), Look(match, None, 9.0)
    for seen in (*looks, "it does not know it"):
        monkeypatch.setattr(calibration, "looked_at", lambda *given, seen=seen: seen)
        found = calibration.calibrate(
            targets_at(HIDDEN, ("ucs", "tensile_strength")), LAW, {name: RANGES[name] for name in HIDDEN},
            lambda seed: PRISM, budget=30, store="", seed=8, progress=False,
        )  # fmt: skip
        assert found.first_look is (seen if isinstance(seen, Look) else None)
    assert begun == [[[120.0, 8.0, 0.0]], None, None]
    before = tuple(HIDDEN), ["ucs", "tensile_strength"], 1.0
    assert known == [before, before, None]
