"""Elastic constants by statics, and simulated tests as cases of a study."""

import re
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from formula_rocks import HIDDEN, FormulaRock, exact, targets_at
from study_cases import refuse_to_run
from support import ROCK, STIFF

import grainlaw as gl
from grainlaw.calibration.stiffness_search import _found, fit_stiffness, stiffness_names, with_grains
from grainlaw.calibration.trials import USUAL, StudySimulator, TrialCase, checked_specimens, checked_tests
from grainlaw.geometry import Voronoi, rectangle
from grainlaw.laws import CohesiveCrack, MohrCoulomb, MunjizaJoint
from grainlaw.protocols import BiaxialCompression, UniaxialCompression, UniaxialTension
from grainlaw.runs.estimate import in_words
from grainlaw.studies.case import Task
from grainlaw.studies.workers import Watcher
from grainlaw.units import GPa, MPa, mm

BRITTLE = MohrCoulomb(
    **STIFF, tensile_strength=6 * MPa, cohesion=15 * MPa, friction_angle=25, residual_friction_angle=5
)
TESTS = {
    "compression": UniaxialCompression(samples=80, maximum_strain=0.004, stop_fraction=0.7),
    "confined": BiaxialCompression(confinement=0, samples=80, maximum_strain=0.004, stop_fraction=0.7),
    "tension": UniaxialTension(samples=60, maximum_strain=6e-4, stop_fraction=0.5),
}
POINT = {"tensile_strength": 5 * MPa, "cohesion": 14 * MPa}


def prism(seed):
    grains = Voronoi(grains=20, seed=seed).tessellate(rectangle(20 * mm, 40 * mm))
    return gl.Specimen(grains, ROCK)


def simulator(folder, pressures=(), law=BRITTLE, tests=TESTS):
    case = TrialCase(law, {}, (), checked_specimens(prism, tests), checked_tests(tests), 1.0)
    powers = {"tensile_strength": 1, "cohesion": 1}
    return StudySimulator(case, powers, pressures, folder, workers=2)


# --- elastic constants -----------------------------------------------------------------------------------------------


def test_stiffnesses_are_told_from_other_parameters():
    assert stiffness_names(BRITTLE) == ("kn", "ks")
    tough = {"mode_i_energy": 50, "mode_ii_energy": 100}
    assert stiffness_names(MunjizaJoint(**{**attrs.asdict(BRITTLE, filter=kept), **tough})) == ("kn", "ks")
    with pytest.raises(gl.ParameterError, match="Rigidly has no parameters in Pa/m"):
        stiffness_names(Rigidly(strength=1e6))


def kept(field, _value):
    return field.name in ("kn", "ks", "tensile_strength", "cohesion", "friction_angle", "residual_friction_angle")


@attrs.frozen(kw_only=True)
class Rigidly(gl.ContactLaw):
    """Its stiffness is its own affair."""

    strength: float = gl.parameter("Pa")

    @property
    def stiffness(self):
        return 1e14, 1e14

    def traction(self, opening, slip):
        return 1e14 * opening, 1e14 * slip


@pytest.mark.parametrize(
    ("modulus", "poisson", "what"),
    [(45 * GPa, 0.24, "contacts"), (48 * GPa, None, "contacts"), (None, 0.25, "contacts"), (60 * GPa, 0.25, "grains"),
     (80 * GPa, None, "grains")],
)  # fmt: skip
def test_modulus_and_poissons_ratio_are_met_by_statics(modulus, poisson, what):
    specimens = [prism(seed) for seed in (1, 2)]
    found = fit_stiffness(specimens, BRITTLE, modulus, poisson, what)
    law = attrs.evolve(BRITTLE, **found.parameters)
    rocks = [gl.elastic_properties(with_grains(specimen, found.grains), law) for specimen in specimens]
    if modulus is not None:
        assert np.mean([rock.modulus for rock in rocks]) == pytest.approx(modulus, rel=0.005)
    if poisson is not None:
        assert np.mean([rock.poisson for rock in rocks]) == pytest.approx(poisson, rel=0.005)
    if what == "contacts":
        assert found.grains == 1
    else:  # the stiffness of contacts stays in proportion to that of the grains
        assert found.parameters["kn"] == pytest.approx(found.grains * STIFF["kn"], rel=1e-3)  # four digits
    if poisson is None:
        assert found.parameters["ks"] / found.parameters["kn"] == pytest.approx(0.9, rel=1e-3)


@pytest.mark.parametrize(
    ("modulus", "poisson", "what", "words"),
    [
        (62 * GPa, 0.25, "contacts", r"youngs_modulus = 62 GPa cannot be had between these grains.*let elastic be"),
        (
            45 * GPa,
            0.45,
            "contacts",
            r"poissons_ratio = 0.45 cannot be had between these grains.* lies between 0\.\d+ and 0\.\d+",
        ),
        (60 * GPa, 0.45, "grains", r"poissons_ratio = 0.45 cannot be had with grains.* give 0\.\d+ to 0\.\d+"),
    ],
)
def test_what_cannot_be_had_is_refused_with_what_can(modulus, poisson, what, words):
    with pytest.raises(gl.ParameterError, match=words) as told:
        fit_stiffness([prism(1)], BRITTLE, modulus, poisson, what)
    if poisson > 0.4:  # what is said to be the nearest can be had, and little more
        low, high = map(float, re.findall(r"0\.\d+", str(told.value).split("cannot be had")[1])[-2:])
        assert told.value.nearest == pytest.approx(high - 0.02 * (high - low), abs=1e-3)
        found = fit_stiffness([prism(1)], BRITTLE, modulus, told.value.nearest, what)
        assert found.poisson == pytest.approx(told.value.nearest, rel=0.006)


def test_poissons_ratio_a_little_beyond_what_can_be_had_is_refused():
    """By two hundredths of it."""
    small = gl.Specimen(Voronoi(grains=6, seed=1).tessellate(rectangle(20 * mm, 40 * mm)), ROCK)
    with pytest.raises(gl.ParameterError, match="lies between") as told:
        fit_stiffness([small], BRITTLE, 45 * GPa, 0.45, "contacts")
    high = float(re.search(r"between 0\.\d+ and (0\.\d+)", str(told.value))[1])
    with pytest.raises(gl.ParameterError, match="lies between"):
        fit_stiffness([small], BRITTLE, 45 * GPa, high + 0.006, "contacts")


# --- tests as cases --------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def tested(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trials") / "s"
    simulated = simulator(folder, [4 * MPa])
    free = simulated.values([POINT], ["ucs", "tensile_strength"], [1, 2], [1.0])
    return folder, free, simulated.values([POINT], ["cohesion", "friction_angle"], [1, 2], [0.5])


@pytest.mark.thorough
def test_values_are_those_of_the_tests(tested):
    _, free, _ = tested
    law = attrs.evolve(BRITTLE, **POINT)
    for name, test in (("ucs", "compression"), ("tensile_strength", "tension")):
        alone = gl.simulate(prism(2), law, TESTS[test], threads=1)
        assert free[name][0, 1] == alone.summary["strength"]


@pytest.mark.thorough
def test_the_rock_itself_is_tested_under_confinement(tested):
    """A point stands for a rock half as strong; its specimen and that rock would buckle at other loads."""
    _, free, confined = tested
    half = attrs.evolve(BRITTLE, **{name: value / 2 for name, value in POINT.items()})
    pressed = attrs.evolve(TESTS["confined"], confinement=4 * MPa)
    peak = gl.simulate(prism(1), half, pressed, threads=1).summary["strength"]
    ucs = free["ucs"][0, 0] / 2
    slope = (peak - ucs) / (4 * MPa)
    angle = np.degrees(np.arcsin((slope - 1) / (slope + 1)))
    assert confined["friction_angle"][0, 0] == pytest.approx(angle)
    assert confined["cohesion"][0, 0] == pytest.approx(ucs / (2 * np.sqrt(slope)) / 0.5)


@pytest.mark.thorough
def test_a_strength_under_confinement_is_that_of_the_rock_over_its_scale(tmp_path, monkeypatch):
    simulated = simulator(tmp_path / "s", [])
    found = simulated.values([POINT], ["strength at 4 MPa"], [1], [0.5])
    half = attrs.evolve(BRITTLE, **{name: value / 2 for name, value in POINT.items()})
    pressed = attrs.evolve(TESTS["confined"], confinement=4 * MPa)
    peak = gl.simulate(prism(1), half, pressed, threads=1).summary["strength"]
    assert found["strength at 4 MPa"][0, 0] == peak / 0.5


@pytest.mark.thorough
def test_what_is_in_the_store_is_not_run_again(tested, monkeypatch):
    folder, free, _ = tested
    refuse_to_run(monkeypatch)
    again = simulator(folder, [4 * MPa])
    values = again.values([POINT], ["ucs", "tensile_strength"], [1, 2], [1.0])
    assert np.array_equal(values["ucs"], free["ucs"])
    assert again.cpu > 0  # what it took then


@pytest.mark.thorough
def test_a_test_without_a_peak_has_no_strength(tmp_path):
    tests = {**TESTS, "tension": attrs.evolve(TESTS["tension"], maximum_strain=5e-5)}
    simulated = simulator(tmp_path / "s", tests=tests)
    assert np.isnan(simulated.values([POINT], ["tensile_strength"], [1], [1.0])["tensile_strength"]).all()
    [failure] = simulated.failures
    assert (failure.test, failure.seed) == ("tension", 1)
    assert "no failure up to the maximum strain of 5e-05" in failure.reason


@pytest.mark.thorough
def test_courses_are_long_enough_for_the_weakest_rock_a_point_stands_for(tested, tmp_path):
    """A rock a fifth as strong breaks at a fifth of the strain."""
    _, free, _ = tested
    tests = {**TESTS, "tension": attrs.evolve(TESTS["tension"], maximum_strain=1.2e-4, samples=12)}
    simulated = simulator(tmp_path / "s", tests=tests)
    simulated.weakest = 0.2
    found = simulated.values([POINT], ["tensile_strength"], [1, 2], [1.0])
    assert not simulated.failures
    assert found["tensile_strength"] == pytest.approx(free["tensile_strength"])


@pytest.mark.thorough
def test_a_rock_that_is_too_strong_for_its_test_has_no_strength(tmp_path):
    """A stronger rock has its peak at a larger strain, perhaps beyond the end of its test."""
    simulated = simulator(tmp_path / "s", [4 * MPa])
    for scale, ends in ((1.0, False), (20.0, True)):
        found = simulated.values([POINT], ["cohesion"], [1], [scale])["cohesion"]
        assert np.isnan(found).all() == ends
    assert "no failure up to the maximum strain of 0.004" in simulated.failures[0].reason


@pytest.mark.thorough
def test_a_search_asks_for_long_courses_and_the_check_for_those_of_the_rock(tmp_path, monkeypatch):
    asked, rock = [], FormulaRock()

    def values(self, points, quantities, seeds, scales):
        asked.append(self.weakest)
        known = [name for name in quantities if name in exact(HIDDEN)]  # it has no moduli
        unknown = {name: np.full((len(points), len(seeds)), np.nan) for name in quantities}
        return unknown | rock.values(points, known, seeds, scales)

    monkeypatch.setattr(StudySimulator, "values", values)
    free = {"tensile_strength": (5 * MPa, 20 * MPa), "cohesion": (20 * MPa, 60 * MPa)}
    targets = targets_at(HIDDEN, ("ucs", "tensile_strength"))
    found = gl.calibrate(targets, BRITTLE, free, prism, store=tmp_path / "s", budget=20, progress=False)
    assert found.checks
    assert asked == [pytest.approx(0.5)] * (len(asked) - 1) + [1.0]  # 5 over 10, the middle of the range


def test_similar_rocks_have_similar_strengths(tmp_path):
    """Strengths times s, energies times s squared, strains and the speed times s: stresses times s."""
    times, law = 1.5, CohesiveCrack(
        **STIFF, tensile_strength=9 * MPa, cohesion=30 * MPa, friction_angle=25, residual_friction_angle=5,
        mode_i_energy=8, mode_ii_energy=16,
    )  # fmt: skip
    peaks = []
    for s in (1.0, times):
        similar = attrs.evolve(
            law, tensile_strength=s * 9 * MPa, cohesion=s * 20 * MPa, mode_i_energy=s * s * 8, mode_ii_energy=s * s * 16
        )
        test = UniaxialCompression(samples=200, maximum_strain=0.003 * s, stop_fraction=0.7)
        peaks.append(gl.simulate(prism(1), similar, test, threads=1).summary["strength"])
    assert peaks[1] / peaks[0] == pytest.approx(times, rel=0.002)


@pytest.mark.parametrize(
    ("specimens", "tests", "words"),
    [
        (prism, ["brazilian"], "the brazilian test needs specimens of the shape 'disc'"),
        ({"prisma": prism}, ["tension"], "there is no shape 'prisma'; did you mean 'prism'"),
        ({"prism": 3}, ["tension"], "specimens: prism = 3 is not allowed, it must be a function of the seed"),
    ],
)
def test_specimens_that_tests_need_are_asked_for(specimens, tests, words):
    with pytest.raises(gl.ParameterError, match=words):
        checked_specimens(specimens, tests)


def test_a_test_takes_the_place_of_the_usual_one_of_its_kind():
    assert checked_tests({"tension": TESTS["tension"]})["tension"] is TESTS["tension"]
    assert checked_tests({})["brazilian"] is USUAL["brazilian"]
    with pytest.raises(gl.ParameterError, match=r"tests: tension = .* must be a UniaxialTension"):
        checked_tests({"tension": TESTS["compression"]})
    with pytest.raises(gl.ParameterError, match="there is no test 'tensile'; did you mean 'tension'"):
        checked_tests({"tensile": TESTS["tension"]})


def test_stiffnesses_that_were_found_say_how_many_solutions_they_took():
    """Those of this search, and of one before it."""
    search = SimpleNamespace(names=("kn", "ks"), count=4, constants=lambda normal, ratio: (normal / 2, ratio / 3))
    found = _found(search, 8.0, 0.75, 2.0, 10)
    assert (found.parameters, found.grains, found.solutions) == ({"kn": 8.0, "ks": 6.0}, 2.0, 14)
    assert (found.modulus, found.poisson) == (4.0, 0.25)


def test_a_calibration_is_told_as_a_whole(tmp_path, monkeypatch):
    """Tests that are done of all that can be, and the time that the rest takes if it goes on so, from the first minute.

    Of 50 tests two are in the store. One of the first ten is half through after 4 s, another has not told of itself:
    ten tests of 8 s, less 4 s, and 38 others two at a time. When one has taken 6 s in 12 s, 9 and 38 others take 12 s.
    """
    said, now = [], 100.0
    monkeypatch.setattr("grainlaw.studies.workers.time", SimpleNamespace(monotonic=lambda: now))
    made = simulator(tmp_path / "s", pressures=(2e6, 4e6))
    made.whole.tell(3.0)  # where nothing is planned
    made.whole.bar = SimpleNamespace(tell=lambda share, words: said.append((share, words)))
    made.plan((["ucs", "tensile_strength", "cohesion", "strength at 9 MPa"], range(10)))
    assert made.whole.planned == 10 * (1 + 1 + 3)  # pressed, pulled, and under 2, 4 and 9 MPa
    made.whole.done = {"kept", "too"}
    made.plan((["ucs"], range(4)), (["brazilian_strength"], range(6)))
    assert made.whole.planned == 12  # what was done, and what is still to come
    made.whole.planned = 50
    tasks = [Task(f"{k}", {"test": "tension", "seed": k}) for k in range(10)]
    by = SimpleNamespace(doing=lambda: {"0": {"share": 0.5, "where": "", "seconds": 4.0, "left": 4.0}, "1": {}})
    watcher = Watcher(tasks, by, None, made.whole.file, made.whole)
    now += 4.0
    watcher.look()
    now += 8.0
    watcher.done(tasks[0], {"status": "finished", "cost": {"seconds": 6.0}})
    early, late = (10 * 8 - 4 + 38 * 8) / 2, (9 + 38) * 12
    assert said == [
        (0.04, f"2 of at most 50 tests, at most about {in_words(early)} left"),
        (0.06, f"3 of at most 50 tests, at most about {in_words(late)} left"),
    ]
    made.whole.planned = 2
    made.whole.tell(0.0)
    assert said[2:] == [(1.0, "3 of at most 3 tests")]
