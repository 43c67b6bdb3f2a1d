"""Emulators, plausible parameters, conflicts and what is determined, on rocks whose answers are formulas."""

from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from formula_rocks import FOUR, HIDDEN, RANGES, FormulaRock, exact, searched, space, targets_at
from scipy.stats import norm
from sklearn.gaussian_process.kernels import RBF, WhiteKernel
from support import STIFF

from grainlaw.calibration import emulator as emulating
from grainlaw.calibration import posterior as posteriors
from grainlaw.calibration.emulator import Emulator, emulators, fit, samples_of
from grainlaw.calibration.identifiability import Direction, further, identifiability, sobol, width_of
from grainlaw.calibration.matching import Match, conflicts, plausible, telling
from grainlaw.calibration.posterior import Posterior, posterior
from grainlaw.calibration.targets import Target
from grainlaw.laws import MohrCoulomb
from grainlaw.units import MPa

TRIED = space().prior(2048, 2)
STRENGTHS = {name: RANGES[name] for name in ("tensile_strength", "cohesion", "friction_angle")}
BRITTLE = MohrCoulomb(**STIFF, tensile_strength=10 * MPa, cohesion=40 * MPa, friction_angle=40)
HIDDEN_BRITTLE = {"tensile_strength": 11 * MPa, "cohesion": 33 * MPa, "friction_angle": 41.0}


def matched(rocks, targets, names=None, count=40, rock=None):
    """Emulators of one wave beside targets."""
    points = rocks.at_reference(rocks.prior(count, 1))
    names = tuple(targets) if names is None else names
    given = [rocks.mapping(point) for point in points]
    values = (rock or FormulaRock(0, 0)).values(given, names, (1, 2, 3), np.ones(count))
    samples = samples_of(values)
    return Match(rocks, targets, emulators(rocks.coordinates(points), samples, 0), samples)


# --- emulators -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def wavy():
    points = np.random.default_rng(3).uniform(-1, 1, (40, 2))
    value = lambda at: np.sin(2 * at[:, 0]) + 0.5 * at[:, 1] ** 2  # noqa: E731
    noise = 0.05 * np.random.default_rng(4).standard_normal(40)
    return value, fit("friction_angle", points, value(points) + noise, np.full(40, 0.05**2), 0)


def test_an_emulator_knows_how_well_it_knows(wavy):
    value, emulator = wavy
    at = np.random.default_rng(5).uniform(-1, 1, (400, 2))
    mean, variance = emulator.predict(at)
    errors = (mean - value(at)) / np.sqrt(variance)
    assert np.sqrt(np.mean((mean - value(at)) ** 2)) < 0.1 * value(at).std()
    assert 0.5 < np.sqrt(np.mean(errors**2)) < 1.6
    assert 0.7 < np.sqrt(np.mean(emulator.errors**2)) < 1.4  # of points that were left out
    assert 0.97 < emulator.q_squared < 1
    assert emulator.predict(np.array([[6.0, -6.0]]))[1][0] > 10 * variance.mean()  # far away it does not know


def test_left_out_points_are_predicted_as_if_they_were_left_out(wavy):
    _, emulator = wavy
    values = emulator.left_out[:, 0]
    rest = np.arange(40) != 7
    covariance = emulator.factor @ emulator.factor.T
    y = (values - emulator.middle) / emulator.size
    solved = np.linalg.solve(covariance[np.ix_(rest, rest)], np.column_stack([y[rest], covariance[rest, 7]]))
    mean = emulator.middle + emulator.size * covariance[7, rest] @ solved[:, 0]
    deviation = emulator.size * np.sqrt(covariance[7, 7] - covariance[7, rest] @ solved[:, 1])
    assert emulator.left_out[7, 1:] == pytest.approx([mean, deviation], rel=1e-6)
    assert 0.97 < emulator.q_squared < 1


def test_an_emulator_is_the_same_in_any_unit(monkeypatch):
    """Of values in another unit, and from another zero: all that it says is in that unit."""
    monkeypatch.setattr(emulating, "RESTARTS", 0)
    points = np.random.default_rng(3).uniform(-1, 1, (12, 1))
    values, noise = np.sin(2 * points[:, 0]), np.linspace(0.01, 0.04, 12)
    plain, other = (fit("ucs", points, a * values + b, a**2 * noise, 0) for a, b in ((1, 0), (1000, 70)))
    means, variances = plain.predict(points)
    assert other.predict(points) == (
        pytest.approx(1000 * means + 70, rel=1e-3),
        pytest.approx(1e6 * variances, rel=1e-2),
    )
    assert other.errors == pytest.approx(plain.errors, rel=1e-2)
    assert other.left_out[:, 2] == pytest.approx(1000 * plain.left_out[:, 2], rel=1e-3)


@pytest.mark.parametrize(("groups", "fewest"), [(1, 5), (3, 5), (5, 7)])
def test_an_emulator_takes_two_points_more_than_groups_and_five_at_least(groups, fewest, monkeypatch):
    monkeypatch.setattr(emulating, "fit", lambda name, coordinates, *others: coordinates.tolist())
    coordinates = np.arange(10.0 * groups).reshape(10, groups)
    values = np.ones((10, 3))
    values[fewest:] = np.nan
    less = np.where(np.arange(10)[:, None] == fewest - 1, np.nan, values)
    found = emulators(coordinates, samples_of({"ucs": values, "tensile_strength": less}), 0)
    assert found == {"ucs": coordinates[:fewest].tolist()}


# --- matching --------------------------------------------------------------------------------------------------------


def test_implausibility_is_the_distance_over_all_that_is_not_known():
    match = matched(space(), {"ucs": Target(100 * MPa, 3 * MPa)}, rock=FormulaRock(0.05, 0.01))
    point = np.array([list(HIDDEN.values())])
    (mean,), (variance,) = (found[:, 0] for found in match.predicted(point, ["ucs"]))
    seeds = match.samples.scatter[0, 0]
    expected = abs(mean - np.log(100e6)) / np.sqrt(variance + seeds + 0.03**2)
    assert match.implausibility(point)[0, 0] == pytest.approx(expected)
    assert match.log_likelihood(point)[0] - norm.logpdf(mean, np.log(100e6), np.sqrt(variance + seeds + 0.03**2)) == (
        pytest.approx(0.5 * np.log(2 * np.pi))
    )


class Formulas:
    """Knowledge of two targets, off by a factor each, of the weaker half of the rocks."""

    targets = dict.fromkeys(("tensile_strength", "ucs"))
    errors = np.array([[0.03**2, 0.5 * 0.03 * 0.06], [0.5 * 0.03 * 0.06, 0.06**2]])

    def __init__(self, off):
        self.off = off

    def known(self, points):
        return points[:, 0] < np.median(points[:, 0])

    def predicted(self, points):
        exactly = [exact(space().mapping(point)) for point in points]
        means = np.log([[each[name] for name in self.targets] for each in exactly]) + self.off
        return means, np.repeat(self.errors[None], len(points), axis=0)


@pytest.mark.thorough
def test_what_is_known_before_counts_by_its_covariance_as_another_set_of_tests():
    """By precisions, which add up, times 1 - (d / 3)^2; the search gains it from covariances."""
    match = matched(space(), targets_at(HIDDEN, FOUR).tested)
    points, before = space().prior(64, 5), Formulas(np.array([0.05, -0.1]))
    means, covariances = match.by_tests(points)
    found, left = attrs.evolve(match, before=before).expected(points)
    rows = [match.names.index(name) for name in before.targets]
    for k, is_known in enumerate(before.known(points)):
        precision, weighted = np.linalg.inv(covariances[k]), np.linalg.solve(covariances[k], means[k])
        if is_known:
            at, between = before.predicted(points[k : k + 1])[0][0] + match.samples.of_mean[rows], np.ix_(rows, rows)
            deviations = np.abs(means[k][rows] - at) / np.sqrt(np.diag(covariances[k][between] + before.errors))
            weight = 1 - (deviations.max() / 3) ** 2
            assert 0.5 < weight < 0.9
            precision[between] += weight * np.linalg.inv(before.errors)
            weighted[rows] += weight * np.linalg.solve(before.errors, at)
        assert left[k] == pytest.approx(np.linalg.inv(precision), rel=1e-6, abs=1e-9)
        assert found[k] == pytest.approx(np.linalg.solve(precision, weighted), rel=1e-6)
    one, variance = attrs.evolve(match, before=before).one(points, "ucs")
    at = match.names.index("ucs")
    assert one.tolist() == found[:, at].tolist()
    assert variance.tolist() == left[:, at, at].tolist()


@pytest.mark.thorough
@pytest.mark.parametrize("limit", [2.995, 3.005])
def test_what_was_known_ceases_to_count_without_a_jump(limit):
    """Just within three standard errors it moves the mean by next to nothing, and beyond by nothing."""
    match, before = matched(space(), targets_at(HIDDEN, FOUR).tested), Formulas(np.zeros(2))
    before.known = lambda points: np.ones(len(points), dtype=bool)
    point = space().prior(64, 5)[:1]
    means, covariances = match.by_tests(point)
    rows = [match.names.index(name) for name in before.targets]
    deviation = np.sqrt(covariances[0, rows[1], rows[1]] + before.errors[1, 1])
    at = before.predicted(point)[0][0] + match.samples.of_mean[rows]
    before.off = means[0, rows] - at - [0.0, limit * deviation]
    moved = attrs.evolve(match, before=before).expected(point)[0] - means
    assert np.abs(moved).max() < 0.01 * deviation
    assert moved.any() == (limit < 3)


def test_what_was_known_does_not_count_where_tests_lie_far_from_it():
    match, off = matched(space(), targets_at(HIDDEN, FOUR).tested), np.array([0.3, -0.5])
    points = space().prior(64, 5)
    assert match.apart(points) == {}
    scatter = np.diag(match.scatter(("tensile_strength", "ucs")))
    expected = np.abs(off) / np.sqrt(scatter + np.diag(Formulas.errors))  # the emulators are nearly exact here
    apart = attrs.evolve(match, before=Formulas(off)).apart(points)
    assert [each.mean() for each in apart.values()] == pytest.approx(expected, rel=0.05)
    assert len(apart["ucs"]) == Formulas(off).known(points).sum() == 32
    nothing = Formulas(off)
    nothing.known = lambda points: np.zeros(len(points), dtype=bool)
    assert [each.tolist() for each in attrs.evolve(match, before=nothing).apart(points).values()] == [[], []]
    for far in (Formulas(off), nothing):
        for with_it, without in zip(
            attrs.evolve(match, before=far).expected(points), match.by_tests(points), strict=True
        ):
            assert (with_it == without).all()


@pytest.mark.thorough
def test_what_is_plausible_meets_the_targets():
    targets = targets_at(HIDDEN, FOUR).tested
    left = plausible(matched(space(), targets), TRIED, 0)
    assert 0 < left.share < 0.05
    assert left.least < 1
    for point in left.points[::50]:
        found = exact(space().mapping(point))
        assert all(abs(found[name] / target.value - 1) < 0.1 for name, target in targets.items())


def test_the_most_telling_points_lie_where_the_emulators_know_least():
    rocks = space(free={"tensile_strength": (5 * MPa, 20 * MPa), "mode_i_energy": (1, 100)}, tied={})
    assert rocks.scale is None
    known = rocks.points(np.random.default_rng(0).uniform(0, 0.5, (20, 2)))  # the upper half was never tested
    values = {"ucs": 1e8 * (known[:, :1] / 1e7) * np.ones(3)}
    samples = samples_of(values)
    match = Match(rocks, {"ucs": Target(1e8, 1e6)}, emulators(rocks.coordinates(known), samples, 0), samples)
    candidates = rocks.points(np.random.default_rng(1).uniform(0, 1, (200, 2)))
    chosen = rocks.places(telling(match, candidates, 4, known[:1]))
    assert chosen[0] == pytest.approx(rocks.places(known[:1])[0])
    assert chosen[1:].max(axis=1).min() > 0.7
    apart = np.linalg.norm(chosen[1:, None] - chosen[None, 1:], axis=2)[np.triu_indices(3, 1)]
    assert apart.min() > 0.1  # not the same corner again and again


@pytest.mark.parametrize("seed", range(4))
def test_points_are_chosen_one_after_the_other_by_what_is_left_unknown(seed):
    """By hand: variances of the smooth quantities given all points so far, solved anew after each, over what seeds and
    targets leave open. One quantity is rough, so that tests tell little of it.
    """
    random = np.random.default_rng(seed)
    tested, candidates, first = (random.uniform(-1, 1, (count, 2)) for count in (8, 30, 1))
    names, length, size, rough = ("ucs", "cohesion"), (0.4, 0.9), (0.3, 2.0), (0.3, 0.01)
    noise, scatter, of_targets = np.array([[0.01, 0.4]] * 7 + [[np.nan, 0.4]]), (0.02, 0.3), (0.01, 0.5)

    def smooth(k, one, other):
        return np.exp(-((one[:, None] - other[None]) ** 2).sum(axis=2) / (2 * length[k] ** 2))

    def covariance(k, points):
        return smooth(k, points, points) + (rough[k] + (0.01, 0.4)[k] / size[k] ** 2) * np.eye(len(points))

    match = SimpleNamespace(
        names=names, space=SimpleNamespace(coordinates=lambda points: points), scatter=lambda names: np.diag(scatter),
        target_variance=np.array(of_targets), samples=SimpleNamespace(names=names, noise=noise),
        emulators={
            name: Emulator(
                name, RBF(length[k]) + WhiteKernel(rough[k]), tested, np.linalg.cholesky(covariance(k, tested)),
                np.zeros(8), rough[k], 0.0, size[k], None,
            )
            for k, name in enumerate(names)
        },
    )  # fmt: skip
    every, picked = np.concatenate([first, candidates]), [0]
    while len(picked) < 6:
        gain, known = np.zeros(31), np.concatenate([tested, every[picked]])
        for k in (0, 1):
            across = smooth(k, known, every)
            left = 1 - np.sum(across * np.linalg.solve(covariance(k, known), across), axis=0)
            gain += np.log(1 + size[k] ** 2 * left / (scatter[k] + of_targets[k]))
        gain[picked] = 0
        picked.append(int(np.argmax(gain)))
    assert telling(match, candidates, 6, first) == pytest.approx(every[picked])


def test_what_a_further_test_would_tell_is_the_information_of_a_channel():
    """Gaussian: half log2 of one and signal over noise, in bits; what is left of a width, by the linear regression."""
    points = np.random.default_rng(0).normal(size=(4000, 2))
    means = (1 + 0.06 * points[:, :1]) * 1e8  # of the first parameter alone
    match = SimpleNamespace(
        space=SimpleNamespace(names=("kn", "cohesion"), places=lambda given: given),
        predicted=lambda given, names: (np.log(means), np.full((len(given), 1), 0.01**2)),
        scatter=lambda names: np.array([[0.02**2]]),
    )
    [told] = further(match, SimpleNamespace(points=points), ["ucs"])
    signal, noise = np.log(means).var(), 0.01**2 + 0.02**2 + 0.02**2
    assert told.gain == pytest.approx(0.5 * np.log2(1 + signal / noise))
    assert 1 < told.gain < 1.3
    assert told.helped == "kn"
    assert told.width == pytest.approx(np.sqrt(noise / (signal + noise)), rel=0.01)
    match.predicted = lambda given, names: (40 + 3 * points[:, 1:], np.full((len(given), 1), 0.5**2))
    match.scatter = lambda names: np.array([[0.3**2]])
    [told] = further(match, SimpleNamespace(points=points), ["friction_angle"])  # no logarithm: 2 % of 40 degrees
    signal = (3 * points[:, 1]).var()
    noise = 0.5**2 + 0.3**2 + (0.02 * (40 + 3 * points[:, 1].mean())) ** 2
    assert told.gain == pytest.approx(0.5 * np.log2(1 + signal / noise))
    assert told.helped == "cohesion"
    assert further(match, SimpleNamespace(points=points), []) == ()
    of_two = SimpleNamespace(space=SimpleNamespace(free=("cohesion", "angle")))
    assert [each.shape for each in sobol(of_two, [], 0)] == [(0, 2)] * 2  # nothing is predicted


def test_what_would_tell_most_is_named_first_and_what_tells_nothing_is_left_out():
    points = np.random.default_rng(0).normal(size=(100, 1))
    sizes = {"ucs": 0.1, "tensile_strength": 0.0, "brazilian_strength": 0.3, "crack_initiation": 0.2}
    match = SimpleNamespace(
        space=SimpleNamespace(names=("kn",), places=lambda given: given),
        predicted=lambda given, names: (18 + points * [sizes[each] for each in names], np.zeros((100, len(names)))),
        scatter=lambda names: np.array([[0.01**2]]),
    )
    told = further(match, SimpleNamespace(points=points), list(sizes))
    assert [each.quantity for each in told] == ["brazilian_strength", "crack_initiation", "ucs"]


class Lines:
    """Targets over two places: how far each is off there is given, in deviations."""

    def __init__(self, *offs, names=("ucs", "cohesion", "friction_angle")):
        self.offs, self.names, self.space = offs, names[: len(offs)], self

    def implausibility(self, points):
        return np.column_stack([np.abs(off(*points.T)) for off in self.offs])

    def expected(self, points):
        return np.column_stack([np.log(1e8 + 0 * points[:, 0]), points]), None

    def places(self, points):
        return points

    points = places

    def allowed(self, points):
        return points[:, 0] <= 0.9


EVEN = np.random.default_rng(0).uniform(0, 1, (4000, 2)) * [0.9, 1]


def test_what_is_plausible_is_searched_for_where_it_is_little():
    """Within three deviations of x = 0.5; the best point lies on it, and none where the law refuses."""
    wide = plausible(Lines(lambda x, y: 10 * (x - 0.5)), EVEN, 0)
    assert wide.share == pytest.approx(0.6 / 0.9, abs=0.02)
    assert len(wide.points) == 1000
    narrow = plausible(Lines(lambda x, y: 500 * (x - 0.5), lambda x, y: 500 * (y - 0.4)), EVEN, 0)
    assert narrow.share < 2e-3
    assert 100 < len(narrow.points) <= 1000
    assert np.abs(narrow.points - [0.5, 0.4]).max() <= 6e-3
    assert narrow.best == pytest.approx([0.5, 0.4], abs=1e-3)
    assert narrow.least < 0.5
    refused = plausible(Lines(lambda x, y: 100 * (x - 1)), EVEN, 0)
    assert (refused.share, len(refused.points)) == (0, 0)
    assert refused.best[0] == pytest.approx(0.9, abs=2e-3)
    assert refused.least == pytest.approx(10, rel=0.02)


def test_the_smallest_sets_of_targets_that_exclude_each_other():
    """Each two of three lines meet, all are 5 off at best; of two parallel ones each is off by half the distance."""
    three = Lines(lambda x, y: 25 * (x - 0.2), lambda x, y: 25 * (y - 0.2), lambda x, y: 25 * (x + y - 1))
    [found] = conflicts(three, EVEN, 0)
    assert found.targets == ("ucs", "cohesion", "friction_angle")
    assert found.implausibility == pytest.approx(5, rel=0.02)
    assert found.values == pytest.approx({"ucs": 1e8, "cohesion": np.exp(0.4), "friction_angle": 0.4}, rel=0.03)
    two = Lines(lambda x, y: 40 * (x - 0.2), lambda x, y: 10 * (y - 0.5), lambda x, y: 40 * (x - 0.6))
    [found] = conflicts(two, EVEN, 0)
    assert found.targets == ("ucs", "friction_angle")
    assert found.implausibility == pytest.approx(8, rel=0.02)
    assert conflicts(Lines(lambda x, y: x, lambda x, y: 3 + 0 * x), EVEN, 0) == []


@pytest.mark.thorough
def test_targets_that_exclude_each_other_are_named():
    # Each two of these can be had; but a line with this cohesion and angle has a UCS of 2 c tan(45 + phi/2) = 69 MPa.
    targets = targets_at(HIDDEN, FOUR, ucs=90 * MPa, cohesion=20 * MPa, friction_angle=30.0).tested
    match = matched(space(), targets)
    assert plausible(match, TRIED, 0).least > 3
    [found] = conflicts(match, TRIED, 0)
    assert found.targets == ("ucs", "cohesion", "friction_angle")
    assert found.implausibility > 3


@pytest.mark.thorough
def test_a_target_that_is_out_of_reach_alone_is_named_alone():
    match = matched(space(), targets_at(HIDDEN, FOUR, friction_angle=20.0).tested)  # 27 to 45 degrees can be had
    assert [each.targets for each in conflicts(match, TRIED, 0)] == [("friction_angle",)]


# --- the posterior ---------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def one_strength():
    """Of two parameters the tests see one: the strength, known to 4 %; three seeds that seem not to scatter."""
    rocks = space(free={"tensile_strength": (2 * MPa, 50 * MPa), "friction_angle": (20, 40)}, tied={})
    points = rocks.prior(24, 1)
    values = {"ucs": 9 * points[:, :1] * np.ones(3), "brazilian_strength": 1e7 + 1e5 * points[:, 1:] * np.ones(3)}
    samples = samples_of(values)
    target = {"ucs": Target(90 * MPa, 3.6 * MPa)}
    match = Match(rocks, target, emulators(rocks.coordinates(points), samples, 0), samples)
    return match, posterior(match, plausible(match, rocks.prior(2048, 1), 0).points, seed=0)


def test_the_posterior_is_that_of_theory(one_strength):
    _, found = one_strength
    logs = np.log(found.points[:, 0])
    assert logs.mean() == pytest.approx(np.log(10 * MPa), abs=0.004)
    assert logs.std() == pytest.approx(np.sqrt(0.04**2 + 3 / 5 * 0.05**2 / 3), rel=0.06)
    assert np.log(found.best[0]) == pytest.approx(np.log(10 * MPa), abs=0.004)
    assert found.points[:, 1].mean() == pytest.approx(30, abs=0.6)  # as wide as the prior
    assert found.points[:, 1].std() == pytest.approx(20 / np.sqrt(12), rel=0.06)
    assert 300 < found.effective < 48 * 500  # walkers, and steps between two looks
    assert len(found.points) == 4000
    places = one_strength[0].space.places(found.points)
    assert 0 <= places.min() < places.max() <= 1


def test_walkers_may_begin_at_fewer_points_than_they_are(one_strength, monkeypatch):
    match, found = one_strength
    monkeypatch.setattr(posteriors, "BLOCK", 40)
    few = posterior(match, found.points[:3], seed=1, blocks=1)
    assert len(few.points) == 48 * 40  # of each walker and step
    assert np.log(few.best[0]) == pytest.approx(np.log(10 * MPa), abs=0.01)


@pytest.mark.thorough
def test_samples_are_made_once_for_the_same_likelihood(one_strength, tmp_path, monkeypatch):
    """Again where the target, the seed or the ranges differ, or where the file is damaged."""
    match, found = one_strength
    monkeypatch.setattr(posteriors, "BLOCK", 20)
    start, sampled, asked = found.points[:60], posteriors._sampled, []
    monkeypatch.setattr(posteriors, "_sampled", lambda *given: asked.append(given) or sampled(*given))

    def again(match=match, seed=1):
        return posterior(match, start, seed, 1, tmp_path / "chains")

    first, second = again(), again()
    assert len(asked) == 1
    assert second.points.tolist() == first.points.tolist()
    assert second.best.tolist() == first.best.tolist()
    assert second.effective == pytest.approx(first.effective, nan_ok=True)
    again(seed=2)
    again(attrs.evolve(match, targets={"ucs": Target(91 * MPa, 3.6 * MPa)}))
    wider = attrs.evolve(match.space.free[1], high=50)
    again(attrs.evolve(match, space=attrs.evolve(match.space, free=(match.space.free[0], wider))))
    assert len(asked) == 4
    for file in (tmp_path / "chains").iterdir():
        file.write_bytes(file.read_bytes()[:100])
    assert again().points.tolist() == first.points.tolist()
    assert len(asked) == 5
    again()
    assert len(asked) == 5


@pytest.mark.parametrize(("time", "blocks"), [(0.7, 1), (1.4, 2), (2.1, 3), (np.nan, 4)])
def test_a_chain_goes_on_until_it_has_thirty_steps_for_each_correlation_time(one_strength, time, blocks, monkeypatch):
    """In blocks of 30: 21, 42 and 63 steps are asked for; where no time can be told, as many blocks as there may be."""
    match, found = one_strength
    monkeypatch.setattr(posteriors, "BLOCK", 30)
    monkeypatch.setattr("emcee.EnsembleSampler.get_autocorr_time", lambda *_, **__: np.array([0.1, time]))
    few = posterior(match, found.points[:60], seed=1, blocks=4)
    assert len(few.points) == min(48 * 30 * blocks, 4000)
    if not np.isnan(time):
        assert few.effective == pytest.approx(48 * 30 * blocks / max(time, 1))


def test_what_the_tests_do_not_see_is_named_and_what_would_see_it(one_strength):
    match, found = one_strength
    seen = identifiability(match, found, 0)
    assert seen.not_determined == ("friction_angle",)
    strength, angle = seen.parameters
    assert strength.verdict == "determined"
    assert angle.width == pytest.approx(1, abs=0.03)
    normal = 2 * 1.96 * np.sqrt(0.04**2 + 3 / 5 * 0.05**2 / 3)  # 95 % of it, over those of the logarithm of the range
    assert strength.width == pytest.approx(normal / (0.95 * np.log(25)), rel=0.07)
    logs = np.log(strength.interval)
    assert logs[1] - logs[0] == pytest.approx(normal, rel=0.07)
    assert [each.width for each in seen.directions] == pytest.approx(
        [1, normal / 3.92 / (np.log(25) / 12**0.5)], rel=0.07
    )
    assert np.abs(seen.correlation - np.eye(2)).max() < 0.1
    assert [each.words for each in seen.unseen] == ["friction_angle"]
    assert (seen.further[0].quantity, seen.further[0].helped) == ("brazilian_strength", "friction_angle")
    assert seen.further[0].width < 0.7
    assert seen.total_order == pytest.approx(np.eye(2), abs=0.05)  # each quantity follows one parameter
    poor = attrs.evolve(match.emulators["brazilian_strength"], left_out=np.array([[1.0, 2.0, 0.1], [2.0, 1.0, 0.1]]))
    blind = identifiability(attrs.evolve(match, emulators={**match.emulators, "brazilian_strength": poor}), found, 0)
    assert (poor.q_squared, blind.quantities, blind.further) == (-3, ("ucs",), ())
    good = match.emulators["brazilian_strength"]
    few = attrs.evolve(good, points=good.points[: len(good.points) // 2 - 1])  # of less than half of the points
    rare = identifiability(attrs.evolve(match, emulators={**match.emulators, "brazilian_strength": few}), found, 0)
    assert (rare.quantities, rare.further) == (("ucs",), ())


def test_intervals_hold_as_much_below_as_above():
    places = np.linspace(0, 1, 1001)[:, None] * [1.0, 2.0]
    assert width_of(places) == pytest.approx([0.95, 1.9])
    found = Posterior(points=places, best=places[0], effective=1.0)
    assert found.interval(1) == pytest.approx((0.05, 1.95))
    assert found.interval(0, 0.5) == pytest.approx((0.25, 0.75))


def test_a_direction_is_told_in_words():
    assert Direction({"a": 0.7, "b": -0.7, "c": 0.1}, 0.9).words == "a up with b down"
    assert Direction({"a": -0.7, "b": -0.7, "c": 0.1}, 0.9).words == "a and b up together"
    assert Direction({"a": -0.99, "b": 0.1}, 0.9).words == "a"


# --- the whole -------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def whole():
    rock = FormulaRock()
    return rock, searched(
        targets_at(HIDDEN_BRITTLE, FOUR),
        ["crack_damage"],
        rock,
        more=range(4, 13),
        law=BRITTLE,
        free=STRENGTHS,
        tied={},
    )


@pytest.mark.thorough
def test_a_hidden_rock_is_found(whole):
    _, found = whole
    for k, value in enumerate(HIDDEN_BRITTLE.values()):
        low, high = found.posterior.interval(k, 0.99)
        assert low <= value <= high
        assert high / low < 1.5


@pytest.mark.thorough
def test_waves_stay_in_the_budget_and_tests_are_made_at_one_scale(whole):
    rock, found = whole
    assert sum(rock.asked) == 2 * len(found.design.points) <= 2 * 60  # without confinement, then with it
    assert found.waves[0].count == 20  # ten for each group, one of them on more seeds
    assert found.match.space.scales(found.design.points) == pytest.approx(1, rel=1e-4)
    assert len(np.unique(found.design.scales)) > 10  # for rocks of many


@pytest.mark.thorough
def test_a_rock_is_found_by_triaxial_strengths_without_its_ucs():
    """How strong the rock is, for confined tests, is told by the line through them."""
    targets = targets_at(HIDDEN_BRITTLE, ("tensile_strength", "strength at 20 MPa", "strength at 75 MPa"))
    found = searched(targets, ["ucs"], more=range(4, 13), law=BRITTLE, free=STRENGTHS, tied={})
    for k, value in enumerate(HIDDEN_BRITTLE.values()):
        low, high = found.posterior.interval(k, 0.99)
        assert low <= value <= high
        assert high / low < 1.6
    ucs = exact(HIDDEN_BRITTLE)["ucs"]
    near = found.design.scales * found.design.values["ucs"].mean(axis=1) / ucs
    assert np.median(near) == pytest.approx(1, abs=0.1)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_answer():
    two = {name: RANGES[name] for name in ("tensile_strength", "cohesion")}
    asked = targets_at(HIDDEN_BRITTLE, ("ucs", "tensile_strength"))
    one, again = (searched(asked, more=range(4, 13), law=BRITTLE, free=two, tied={}, budget=30) for _ in range(2))
    assert np.array_equal(again.design.points, one.design.points)
    assert np.array_equal(again.posterior.points, one.posterior.points)
    assert np.array_equal(again.posterior.best, one.posterior.best)
    other = searched(asked, more=range(4, 13), law=BRITTLE, free=two, tied={}, budget=30, seed=1)
    assert not np.array_equal(other.design.points, one.design.points)


@pytest.mark.slow
def test_an_impossible_ratio_of_strengths_ends_in_a_conflict():
    found = searched(targets_at(HIDDEN, FOUR, tensile_strength=exact(HIDDEN)["ucs"] / 60))
    assert found.posterior is None
    assert [each.targets for each in found.conflicts] == [("tensile_strength",)]  # below the range of the contacts
    assert found.waves[-1].least > 3


@pytest.mark.slow
def test_intervals_hold_the_truth():
    """Hidden rocks of four parameters, of which the tests see three, each on seeds of its own: 95 % intervals.

    At least nine in ten of all; of one parameter 16 of 20 at least, fewer happen in 0.3 % of all such tests.
    """
    rocks = space()
    hidden = rocks.prior(20, seed=77)
    held = np.zeros((20, 4), dtype=bool)
    for k, point in enumerate(hidden):
        seeds = range(100 * k, 100 * k + 3)
        targets = targets_at(rocks.mapping(point), FOUR)
        found = searched(targets, seed=k, seeds=seeds, more=range(100 * k + 3, 100 * k + 12))
        ends = [found.posterior.interval(j) for j in range(4)]
        held[k] = [low <= value <= high for (low, high), value in zip(ends, point, strict=True)]
    assert held.mean() >= 0.9, held.sum(axis=0)
    assert held.sum(axis=0).min() >= 16, held.sum(axis=0)


@pytest.mark.slow
def test_later_waves_go_where_it_is_plausible():
    found = searched(targets_at(HIDDEN, FOUR), rock=FormulaRock(0.05, 0.1))
    assert len(found.waves) > 1
    near = (
        found.match.implausibility(found.design.points * found.design.scales[:, None] ** [1, 1, 0, 2]).max(axis=1) < 3
    )
    first = found.waves[0].count
    assert near[first:].mean() > 3 * near[:first].mean()
    assert near[first:].mean() > 0.3  # where the emulators learn most, what looked plausible may turn out not to be
