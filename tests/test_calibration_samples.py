"""What seeds have in common and what each specimen has for itself, on rocks whose answers are formulas."""

import numpy as np
import pytest
from formula_rocks import FOUR, HIDDEN, FormulaRock, exact, space

from grainlaw.calibration.emulator import _drawn, anchored, samples_of


def test_a_weak_seed_is_scatter_of_all_points_and_noise_of_none():
    seeds = np.exp(0.1 * np.random.default_rng(1).standard_normal(3))
    values = {"ucs": np.linspace(50, 150, 30)[:, None] * 1e6 * seeds}
    samples = samples_of(values)
    assert samples.scatter[0, 0] == pytest.approx((2 * np.var(np.log(seeds), ddof=1) + 3 * 0.05**2) / 5 / 3)
    assert samples.noise.max() < 1e-20
    noisy = {"ucs": values["ucs"] * np.exp(0.03 * np.random.default_rng(2).standard_normal((30, 3)))}
    assert samples_of(noisy).noise.mean() == pytest.approx(0.03**2 / 3, rel=0.35)


def test_a_few_seeds_are_drawn_towards_a_usual_scatter_and_no_likeness():
    """By hand, three seeds: two degrees of freedom beside three of 5 %, of the middle unless a logarithm."""
    given = np.array([[0.01, 0.06], [0.06, 4.0]])  # a correlation of 0.3
    found = _drawn(("ucs", "friction_angle"), given, 3, np.array([[18.0, 30.0], [18.2, 40.0], [18.4, 60.0]]))
    ucs, angle = (2 * 0.01 + 3 * 0.05**2) / 5 / 3, (2 * 4.0 + 3 * (0.05 * 40) ** 2) / 5 / 3
    both = 2 / 5 * 0.3 * np.sqrt(ucs * angle)
    assert found == pytest.approx(np.array([[ucs, both], [both, angle]]))


def test_a_point_whose_tests_failed_is_left_out_and_one_with_a_seed_less_is_noisier():
    values = FormulaRock(0, 0.02).values([HIDDEN] * 20, ["ucs"], (1, 2, 3), np.ones(20))
    values["ucs"][3] = np.nan
    values["ucs"][5, 1:] = np.nan
    values["ucs"][7, 0] = np.nan
    samples = samples_of(values)
    assert np.isnan(samples.means[:, 0]).nonzero()[0].tolist() == [3, 5]  # fewer than half of the seeds
    assert samples.noise[7, 0] > 1.3 * np.median(samples.noise[:, 0])


def test_one_point_on_more_seeds_tells_how_strong_the_common_ones_are():
    rock = FormulaRock(0.1, 0.01)
    points = space().at_reference(space().prior(30, 1))
    given = [space().mapping(point) for point in points]
    seeds, every = (1, 2, 3), range(1, 41)
    before = samples_of(rock.values(given, FOUR, seeds, np.ones(30)))
    after = anchored(before, {0: rock.values(given[:1], FOUR, every, np.ones(1))})
    truth = np.log([exact(point)["ucs"] for point in given])
    assert np.mean(before.means[:, 0] - truth) > 0.05  # the first three seeds are strong
    assert np.mean(before.means[:, 0] + after.shift[0] - truth) == pytest.approx(0, abs=2 * 0.1 / np.sqrt(40))
    expected = (39 * 0.1**2 + 3 * 0.05**2) / 42 / 40 + 0.01**2 / 3  # of forty seeds, and the three's own
    assert after.scatter[0, 0] == pytest.approx(expected, rel=0.4)


def test_points_on_more_seeds_are_known_better_themselves():
    rock = FormulaRock(0.02, 0.2)  # each specimen has most of its scatter for itself
    points = space().at_reference(space().prior(30, 1))
    given = [space().mapping(point) for point in points]
    before = samples_of(rock.values(given, FOUR, (1, 2, 3), np.ones(30)))
    anchors = {k: rock.values(given[k : k + 1], FOUR, range(1, 41), np.ones(1)) for k in (4, 9)}
    after = anchored(before, anchors)
    truth = np.log([exact(given[k])["ucs"] for k in anchors])
    assert after.means[[4, 9], 0] + after.shift[0] == pytest.approx(truth, abs=2.5 * 0.2 / np.sqrt(40))
    assert after.noise[[4, 9], 0] == pytest.approx(before.noise[[4, 9], 0] * 3 / 40)
    others = np.delete(np.arange(30), [4, 9])
    assert np.array_equal(after.means[others], before.means[others])


@pytest.mark.parametrize("known", [4, 7])
def test_a_quantity_that_fails_on_more_seeds_stays_as_it_was(known):
    """On half of the nine others at least."""
    values = FormulaRock().values([HIDDEN] * 10, ("ucs", "tensile_strength"), (1, 2, 3), np.ones(10))
    more = FormulaRock().values([HIDDEN], ("ucs", "tensile_strength"), range(1, 13), np.ones(1))
    more["ucs"][0, known:] = np.nan
    before = samples_of(values)
    after = anchored(before, {0: more})
    assert after.shift[0] == 0 != after.shift[1]
    assert after.scatter[0, 0] == before.scatter[0, 0]


def test_a_quantity_that_most_of_more_seeds_have_is_told_by_those():
    """Eight of twelve: the shift is their mean less that of the first three, of logarithms."""
    common = np.exp([0.1, 0.2, 0.3])
    more = np.exp([0.1, 0.2, 0.3, -0.4, -0.2, -0.4, -0.2, -0.2, np.nan, np.nan, np.nan, np.nan])
    after = anchored(samples_of({"ucs": 1e8 * np.tile(common, (10, 1))}), {0: {"ucs": 1e8 * more[None]}})
    assert after.shift[0] == pytest.approx(-0.8 / 8 - 0.2)
    assert after.seeds.tolist() == [12]


def test_a_point_without_values_on_more_seeds_takes_nothing_from_another():
    rock = FormulaRock(0.1, 0.05)
    points = space().at_reference(space().prior(30, 1))
    given = [space().mapping(point) for point in points]
    before = samples_of(rock.values(given, FOUR, (1, 2, 3), np.ones(30)))
    first, second = (rock.values(given[k : k + 1], FOUR, range(1, 13), np.ones(1)) for k in (4, 9))
    second["ucs"][0, 1] = np.nan
    both, alone = anchored(before, {4: first, 9: second}), anchored(before, {4: first})
    assert both.shift[0] == pytest.approx(alone.shift[0])
    assert both.scatter[0, 0] == pytest.approx(alone.scatter[0, 0])
    assert both.means[9, 0] == before.means[9, 0]
    assert both.shift[1] != alone.shift[1]


def test_the_error_of_the_shift_is_told_apart():
    """That of the common seeds for themselves: with it alone, fresh seeds scatter no more for it."""
    rock = FormulaRock(0.0, 0.1)
    points = space().at_reference(space().prior(60, 1))
    given = [space().mapping(point) for point in points]
    before = samples_of(rock.values(given, FOUR, (1, 2, 3), np.ones(60)))
    after = anchored(before, {4: rock.values(given[4:5], FOUR, range(1, 31), np.ones(1))})
    assert after.of_shift[0] == pytest.approx(0.1**2 / 3, rel=0.35)
    assert after.scatter[0, 0] - after.of_shift[0] == pytest.approx(0.1**2 / 30, rel=0.5)


def test_the_mean_of_a_laboratory_is_above_that_of_logarithms():
    """By half of the variance of one specimen, of a lognormal distribution exp(s^2 / 2); of an angle by nothing."""
    draws = np.random.default_rng(2).standard_normal((1, 4000))
    samples = samples_of({"brazilian_strength": 9e6 * np.exp(0.3 * draws), "friction_angle": 40 + 3 * draws})
    assert samples.of_mean == pytest.approx([0.3**2 / 2, 0.0], rel=0.05)
    mean = np.exp(samples.means[0, 0] + samples.of_mean[0])
    assert mean == pytest.approx(np.mean(9e6 * np.exp(0.3 * draws)), rel=0.005)
    few = samples_of({"ucs": 1e8 * np.exp(0.05 * draws.reshape(1000, 4))})
    more = anchored(few, {0: {"ucs": 1e8 * np.exp(0.05 * draws[:, :40])}})
    assert [few.of_mean[0], more.of_mean[0]] == pytest.approx([0.05**2 / 2] * 2, rel=0.4)
