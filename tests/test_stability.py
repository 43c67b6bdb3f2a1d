"""The stability margin: its value by theory, what it leaves alone, and columns that buckle at their load."""

import itertools
import sys
from pathlib import Path
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
import scipy
from support import BRITTLE, ROCK, STIFF, small_sample, state_of

import grainlaw as gl
from grainlaw.engine import margin as margins
from grainlaw.engine.margin import LowestMode, Margin, _Trials, _zero
from grainlaw.engine.stability import touching_stiffness
from grainlaw.engine.stable_step import StableStep
from grainlaw.geometry import Bricks, rectangle
from grainlaw.laws import Linear
from grainlaw.protocols import BiaxialCompression, Platens, UniaxialCompression, UniaxialTension
from grainlaw.results.certificate import doubts, fails

sys.path.insert(0, str(Path(__file__).parent / "validation"))
from first_failure_study import KN, KS, buckling_stress, column

sys.path.pop(0)


@attrs.frozen(kw_only=True)
class Softening(gl.ContactLaw):
    """Straight softening from the start of its damage on, elastic in shear."""

    kn: float = gl.parameter("Pa/m")
    ks: float = gl.parameter("Pa/m")
    strength: float = gl.parameter("Pa")
    fall: float = gl.parameter("Pa/m")
    stiffness = property(lambda self: (self.kn, self.ks))

    def traction(self, opening, slip, damage, widest):
        peak = self.strength / self.kn
        widest = max(widest, opening, peak)
        damage = min((widest - peak) * self.fall / self.strength, 1.0)
        secant = self.strength * (1 - damage) / widest
        return (secant if opening > 0 else self.kn) * opening, self.ks * slip, damage, widest


def pressed(bend, loading, samples=200):
    test = UniaxialCompression(
        platens=Platens.ROUGH, maximum_strain=0.008, stop_fraction=0, samples=samples, loading=loading
    )
    return gl.simulate(column(bend), Linear(kn=KN, ks=KS), test, detection=None)


@pytest.mark.thorough
@pytest.mark.parametrize("bend", [0.001, 0.005])
def test_a_bent_column_bears_its_buckling_load(bend):
    """The eigenvalue of a chain of hinges, at the default pace; an elastic column bears it while it bends on."""
    result = pressed(bend, gl.Adaptive())
    assert result.curves["stress"].max() == pytest.approx(buckling_stress(), rel=0.02)
    assert not any(fails(name, value) for name, value in result.summary.items())
    assert result.summary["energy_error"] < 1e-3


@pytest.mark.thorough
def test_the_margin_of_a_run_that_is_much_too_fast_points_to_the_buckling_load():
    """It falls in a straight line with the load, from 1 to 0; the certificate fails when the load goes on to rise."""
    result = pressed(0.001, gl.Constant(speed=0.6))
    stress, margin = result.curves["stress"], result.curves["stability"]
    assert stress.max() > 1.2 * buckling_stress()
    early = (margin > 0.2) & (margin < 0.9)
    slope, start = np.polyfit(stress[early], margin[early], 1)
    assert start == pytest.approx(1.0, abs=0.01)
    assert -start / slope == pytest.approx(buckling_stress(), rel=0.02)
    assert margin[-1] < 0
    assert fails("unstable_rise", result.summary["unstable_rise"])
    assert any("the load rose above what the specimen can bear" in words for words in doubts(result))


@pytest.mark.thorough
def test_a_softening_joint_between_two_blocks_has_the_margin_of_springs_in_series():
    """Of the joint: (k - h)/(k + kn) with k = E/L of both blocks in series, and -h the slope of its softening."""
    width, height, modulus, kn, fall = 4e-3, 40e-3, 50e9, 5e12, 0.6e12
    rock = gl.Specimen(
        Bricks(rows=2, columns=1).tessellate(rectangle(width, height)),
        gl.Elastic(youngs_modulus=modulus, poissons_ratio=0.0, density=3000),
    )
    law = Softening(kn=kn, ks=kn, strength=10e6, fall=fall)
    test = UniaxialTension(maximum_strain=4e-4, stop_fraction=0.6, samples=200)
    curves = gl.simulate(rock, law, test).curves
    blocks = modulus / height  # plane strain without a Poisson effect
    softens = curves["damaged"] > 0
    assert curves["stability"][~softens][1:-1] == pytest.approx(1.0, abs=0.01)
    assert curves["stability"][softens][5:] == pytest.approx((blocks - fall) / (blocks + kn), abs=0.005)


@pytest.mark.parametrize("material", [ROCK, gl.Rigid(density=3100)], ids=["elastic", "rigid"])
def test_a_sound_specimen_has_the_margin_1(material):
    test = UniaxialCompression(maximum_strain=1e-4, samples=20)
    margin = gl.simulate(small_sample(material=material), Linear(**STIFF), test).curves["stability"]
    assert margin[1:] == pytest.approx(1.0, abs=0.01)


@pytest.mark.thorough
def test_asking_for_the_margin_leaves_the_state_as_it_was():
    """To the last bit, under pressure and a platen, with contacts that have replaced bonds."""

    @attrs.define
    class Asks(gl.Observer):
        asked: int = 0

        def observe(self, state, curves, stage, progress):
            if stage.loading is None or len(curves["time"]) % 20 or len(curves["time"]) < 100:
                return
            step = StableStep(state)
            margin = Margin(state, step.sound(), step.frequency, step.frequency / 30)
            before = state.save()
            margin.find(margin.first_guess())
            after = state.save()
            for part, rows in before.items():
                for name, row in rows.items():
                    assert np.array_equal(after[part][name], row, equal_nan=True), (part, name)
            self.asked += 1

    asks = Asks()
    test = BiaxialCompression(confinement=5e6, stop_fraction=0.7)
    gl.simulate(small_sample(), BRITTLE, test, observers=[asks])
    assert asks.asked > 3


def asked(grains, ask):
    """What ``ask`` answers, given the margin and the state of a sound specimen that begins to be loaded."""

    @attrs.define
    class Asks(gl.Observer):
        answers: list = attrs.field(factory=list)

        def observe(self, state, curves, stage, progress):
            if not self.answers and stage.loading is not None:
                step = StableStep(state)
                self.answers.append(ask(Margin(state, step.sound(), step.frequency, step.frequency / 30), state))

    asks = Asks()
    test = UniaxialCompression(maximum_strain=1e-5, samples=10)
    gl.simulate(small_sample(grains), Linear(**STIFF), test, observers=[asks])
    return asks.answers[0]


def test_the_margin_is_the_lowest_eigenvalue_of_an_unsymmetric_stiffness():
    """As LAPACK finds it, where that of the symmetric part is far below: a sound stiffness with freedoms that slide."""

    def ask(margin, state):
        sound, random = margin._sound.toarray(), np.random.default_rng(3)
        now = sound.copy()
        for k, lost in zip(random.choice(len(now), 12, replace=False), np.linspace(0.1, 0.3, 12), strict=True):
            now[k, k] -= lost * sound[k, k]
            now[k, (k + 2) % len(now)] += 0.5 * sound[k, k]  # as a shear force that follows the normal force
        found = margin._lowest(lambda motion: now @ motion, [margin.first_guess()])
        values = scipy.linalg.eig(now, sound, right=False)
        symmetric = scipy.linalg.eigh((now + now.T) / 2, sound, eigvals_only=True)
        return found and found.margin, values.real.min(), symmetric[0]

    found, lowest, of_symmetric = asked(12, ask)
    assert found == pytest.approx(lowest, abs=0.01)
    assert of_symmetric < lowest - 0.2


@pytest.mark.thorough
def test_one_softened_spring_is_found_from_a_smooth_motion():
    """Of rank one, in closed form: a motion of the whole specimen has hardly any of it, and so a small residual."""

    def ask(margin, state):
        sound = margin._sound.toarray()
        k = len(sound) // 2
        spring = np.zeros(len(sound))
        spring[[k, k + 2]] = 1, -1  # the same component of two nodes of a grain
        spring /= np.sqrt(spring @ np.linalg.solve(sound, spring))
        now = sound - 0.5 * np.outer(spring, spring)
        steady = margin._gather @ state.grains.flat(state.steady.books.field)
        return margin._lowest(lambda motion: now @ motion, [margin.first_guess(), steady]).margin

    assert asked(100, ask) == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_rounding_is_no_motion_of_its_own(count):
    """As many freedoms as the first trials span: what is left of a residual is rounding, and was taken for a motion
    that nothing resists.
    """
    sound = scipy.sparse.csc_matrix(np.diag(1e9 * np.arange(1.0, count + 1)))
    margin, calls = Margin.__new__(Margin), itertools.count(1)
    margin._sound, margin._mass, margin._factors = sound, np.full(count, 30.0), scipy.sparse.linalg.splu(sound)
    shares = np.linspace(0.7, 0.9, count)

    def tangent(motion):
        return shares * (sound @ motion) * (1 + 1e-14 * next(calls))

    found = margin._lowest(tangent, [np.ones(count), np.zeros(count)])
    assert found.margin == pytest.approx(0.7)
    assert found.frequency == pytest.approx(np.sqrt(1e9 / 30))
    assert margin._lowest(tangent, [np.zeros(count), np.zeros(count)]) is None


def diagonal_margin(softened, start):
    """The lowest mode of a diagonal stiffness of which shares are left, from one start, and the trials it took."""
    sound, trials = scipy.sparse.diags(1e9 * np.linspace(1, 2, len(softened)), format="csc"), []
    margin = Margin.__new__(Margin)
    margin._sound, margin._mass, margin._factors = sound, np.full(len(start), 30.0), scipy.sparse.linalg.splu(sound)

    def tangent(motion):
        trials.append(motion)
        return softened * (sound @ motion)

    found = margin._lowest(tangent, [start, np.zeros(len(start))])
    assert found.motion @ sound @ found.motion == pytest.approx(1)
    return found, len(trials)


def test_one_soft_freedom_of_many_is_found_beside_others_that_differ():
    """The first trial has so little of it that its residual is small."""
    softened = np.ones(10_000)
    softened[0] = 0.5
    found, trials = diagonal_margin(softened, np.ones(len(softened)))
    assert found.margin == pytest.approx(0.5)
    assert trials < 6
    assert found.frequency == pytest.approx(np.sqrt(1e9 / 30))
    found, trials = diagonal_margin(np.append(0.3, np.linspace(0.8, 1, 99)), np.ones(100))
    assert found.margin == pytest.approx(0.3, abs=1e-4)
    assert trials < 10


def test_of_a_pair_of_complex_eigenvalues_the_real_part_counts():
    margin, sound = Margin.__new__(Margin), scipy.sparse.csc_matrix(1e9 * np.eye(2))
    margin._sound, margin._mass, margin._factors = sound, np.full(2, 30.0), scipy.sparse.linalg.splu(sound)
    turning = 1e9 * np.array([[0.5, 0.3], [-0.3, 0.5]])
    found = margin._lowest(lambda motion: turning @ motion, [np.array([1.0, 0.0]), np.array([1.0, 1.0])])
    assert found.margin == pytest.approx(0.5)
    assert found.motion @ sound @ found.motion == pytest.approx(1)
    assert found.frequency == pytest.approx(np.sqrt(1e9 / 30))


@pytest.mark.parametrize(
    ("force", "margin", "farthest", "trials"),
    [
        (lambda u: 6 - 3 * u, 3, 10, [0, 2]),
        (lambda u: -6 - 3 * u, 3, 10, [0, -2]),
        (lambda u: 6 - 3 * u, 3, 0.5, [0, 0.5]),
        (lambda u: -6 - 3 * u, 3, 0.5, [0, -0.5]),
        (lambda u: 6 - 3 * u, 12, 10, [0, 0.5, 1, 2]),
        (lambda u: 6 - 3 * u, 12, 1.5, [0, 0.5, 1, 1.5]),
        (lambda u: 6 - 3 * u, 1, 10, [0, 6, 2]),
        (lambda u: 100 - 99.1 * u, 100, 10, [0, 1]),
        (lambda u: 3e-3 - 1e-3 * u, -5, 10, [0, 3]),
        (lambda u: 4 - u**2, 1, 10, [0, 4, 1, 1.6, 1.857143, 2.071429, 1.997403]),
        (lambda u: 1 - 10 * u if u < 0.2 else -99, 1, 10, [0, 1, 0.1]),
        (lambda u: 9 - 10 * u if u < 0.95 else -0.2, 9, 10, [0, 1, 0.9]),
    ],
    ids=[
        "straight", "to the other side", "far", "far on the other side", "softer", "softer and far", "stiffer",
        "one percent is left", "a margin below 0", "curved", "steep at the end", "flat at the end",
    ],
)  # fmt: skip
def test_where_a_force_is_zero_is_found_by_secants(force, margin, farthest, trials):
    asked = []
    found = _zero(lambda u: asked.append(u) or force(u), margin, farthest)
    assert asked == pytest.approx(trials)
    assert found == asked[-1]


def test_a_force_that_ends_before_its_zero_is_followed_to_where_it_ends():
    for sign in (1, -1):
        asked = []
        found = _zero(lambda u: asked.append(u) or (2 - u * sign if u * sign < 0.3 else np.nan) * sign, 2, 10)  # noqa: B023
        assert asked[:4] == [0, sign, 0.5 * sign, 0.25 * sign]
        assert 0.29 < found * sign < 0.3


@pytest.mark.parametrize(
    ("gaps", "points"),
    [((-0.1, -0.1), (1, 1)), ((-0.05, 0.15), (1, 0)), ((0.05, -0.15), (0, 1)), ((0.15, 0.05), (0, 0))],
    ids=["pressed", "open at its end", "open at its start", "apart"],
)
def test_edges_touch_by_springs_on_their_common_part(gaps, points):
    """Edge a goes from 0 to 2, b back from 3 to 1: each point has half of the springs from 1 to 2."""
    kn, ks, size, turn = np.array([7e9, 5e9]), np.array([3e9, 2e9]), 1e-4, np.exp(0.4j)
    b = 3 - 1j * gaps[1], 1 - 1j * gaps[0]  # the outward normal of a points down
    ends = size * (np.array([[0, 0], [2, 2], [b[0]] * 2, [b[1]] * 2]) * turn + [0.3 + 0.7j, 5 - 2j])  # of two contacts
    places = np.stack([ends.real, ends.imag], axis=2)
    motion = np.random.default_rng(1).normal(size=(4, 2))
    along, normal = (np.array([each.real, each.imag]) for each in (turn, -1j * turn))
    squares = np.zeros(2)  # of the jump along the normal, and along the edges
    for x, touches in zip((1.5 - 0.5 / np.sqrt(3), 1.5 + 0.5 / np.sqrt(3)), points, strict=True):
        jump = [np.interp(x, [1, 3], motion[[3, 2], k]) - np.interp(x, [0, 2], motion[:2, k]) for k in (0, 1)]
        squares += touches * np.array([jump @ normal, jump @ along]) ** 2
    nodes, moved = np.array([[4, 7], [1, 6], [0, 8], [2, 5]]), np.zeros((9, 2))
    for contact in (0, 1):
        moved[nodes[:, contact]] = (contact + 1) * motion
    expected = size / 2 * (np.array([kn, ks]).T @ squares) @ [1, 4]
    assert moved.ravel() @ touching_stiffness(places, nodes, kn, ks, 9) @ moved.ravel() == pytest.approx(expected)
    places[2:] += 2.5 * size * along
    assert abs(touching_stiffness(places, nodes, kn, ks, 9)).max() == 0


ROWS = np.array([[1.0, 0.0], [0.0, -2.0]])  #: a soft motion of two nodes of 2 and 4 kg: 18 kg m2 in all
PULL = 3.0  #: N on it, which falls by 1.5 N/m


class TwoNodes:
    """What a margin needs of a state to settle a motion; it moves without force."""

    def __init__(self, field, settled, velocity, pace):
        self.arrays = SimpleNamespace(
            mass=np.array([[2.0, 4.0], [2.0, 4.0]]), velocity=velocity.copy(), displacement=np.ones((2, 2)),
            free=np.array([[1.0, 0.0], [1.0, 1.0]]),
        )  # fmt: skip
        self.freedoms = SimpleNamespace(arrays=self.arrays, catch_up=lambda held: self.done.append(("caught", held)))
        books = SimpleNamespace(field=field.copy(), settled=settled.copy())
        self.steady, self.time_step = SimpleNamespace(pace=pace, books=books), 1e-9
        self.grains = SimpleNamespace(flat=np.ravel, unflat=lambda flat: flat.reshape(2, 2))
        self.specimen = SimpleNamespace(grains=SimpleNamespace(grain_size=1e3))
        self.done = []

    def change_velocity(self, rows):
        self.arrays.velocity += rows

    def advance(self, state, coasting, steps):
        self.arrays.displacement += steps * self.time_step * self.arrays.velocity
        self.done.append(steps)


class Pulls:
    """Trials of such a state."""

    def __init__(self, state, coasting):
        self.remembered = False

    def __enter__(self):
        return self

    def __exit__(self, *error):
        pass

    def forces(self, moved, scale):
        return (PULL - 1.5 * moved[1, 1] / ROWS[1, 1]) * ROWS / np.sum(ROWS**2)


@pytest.mark.parametrize(("way", "slower"), [(0.25, 1.0), (0.2, 0.4)])
def test_a_settled_motion_goes_on_with_its_mean_velocity(way, slower, monkeypatch):
    """By 2 along itself to where it has no force, and by 0.5 before: 2.5 on a way of 0.25 m, a rate of 10 per m.

    It had (2 + 24) / 18 per s, at a pace of 0.25 m/s 5.8 per m: of more than twice as much it has just begun.
    """
    field, velocity = np.array([[0.3, 0.0], [0.1, 0.2]]), np.array([[1.0, 0.0], [0.7, -3.0]])
    state = TwoNodes(field, 1 - 0.5 * ROWS, velocity, 0.25)
    made = object.__new__(Margin)
    made._state, made._coasting, made._carry, made._gather = state, None, np.eye(4), np.eye(4)
    monkeypatch.setattr(margins, "_Trials", Pulls)
    monkeypatch.setattr(margins, "advance", state.advance)
    assert made.settle(LowestMode(margin=1.5, frequency=1.0, motion=ROWS.ravel()), way) == pytest.approx(2 * 2.0)
    assert state.done == [1, ("caught", True), margins.INCREMENTS - 1]
    assert state.arrays.displacement == pytest.approx(1 + 2 * ROWS)
    mean = 2.5 / way * slower
    weight = ROWS * state.arrays.mass / 18
    assert state.steady.books.field == pytest.approx(field + ROWS * (mean - np.sum(weight * field)), rel=1e-6)
    assert np.sum(weight * state.steady.books.field) == pytest.approx(mean, rel=1e-6)
    assert np.array_equal(state.steady.books.settled, state.arrays.displacement)
    assert state.arrays.velocity == pytest.approx(velocity + ROWS * (0.25 * mean - 26 / 18), rel=1e-6)


def test_a_motion_without_force_is_not_settled(monkeypatch):
    state = TwoNodes(np.zeros((2, 2)), np.zeros((2, 2)), np.ones((2, 2)), 0.5)
    made = object.__new__(Margin)
    made._state, made._coasting, made._carry, made._gather = state, None, np.eye(4), np.eye(4)
    monkeypatch.setattr(margins, "_Trials", Pulls)
    monkeypatch.setattr(Pulls, "forces", lambda self, moved, scale: 0 * moved)
    assert made.settle(LowestMode(margin=1.5, frequency=1.0, motion=ROWS.ravel()), 1.0) == 0
    assert state.done == []
    assert (state.arrays.velocity == 1).all()


def test_a_settled_motion_goes_no_farther_than_five_percent_of_a_grain(monkeypatch):
    """Its own size is 2 m: half of it where grains are as large as 20 m."""
    state = TwoNodes(np.zeros((2, 2)), np.ones((2, 2)), np.zeros((2, 2)), 1.0)
    state.specimen.grains.grain_size = 20.0
    made = object.__new__(Margin)
    made._state, made._coasting, made._carry, made._gather = state, None, np.eye(4), np.eye(4)
    monkeypatch.setattr(margins, "_Trials", Pulls)
    monkeypatch.setattr(margins, "advance", state.advance)
    assert made.settle(LowestMode(margin=1.5, frequency=1.0, motion=ROWS.ravel()), 1.0) == pytest.approx(1.0)
    assert state.arrays.displacement == pytest.approx(1 + 0.5 * ROWS)


def test_platens_move_with_what_they_drive():
    """Each with the first freedom of its column."""
    driven = SimpleNamespace(column=np.array([0, 7, 3, 7]), row=np.array([0, 1, 1, 0]), place=np.array([0, 2, 1, 0]))
    platens = SimpleNamespace(column=np.array([3, 7]), velocity=np.zeros((1, 2)))
    made = object.__new__(_Trials)
    made._state = SimpleNamespace(drives=SimpleNamespace(arrays=driven))
    made._parts = SimpleNamespace(platens=platens)
    made._give_platens(np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]))
    assert platens.velocity.tolist() == [[5.0, 6.0]]


def test_trials_start_ahead_on_the_way_of_the_steady_motion(monkeypatch):
    """By hand: of 4 freedoms with springs of 1, 2, 3 and 4 N/m, and a platen of 10 N/m on the first; forces at 5 N."""
    springs, asked = np.diag([1.0, 2.0, 3.0, 4.0]), []

    class Springs(Pulls):
        def forces(self, moved, scale):
            asked.append((moved, scale))
            return 5 - (springs @ moved.ravel()).reshape(2, 2)

    field = np.array([[0.5, 0.0], [-4.0, 1.0]])
    state = TwoNodes(field, field, field, 1.0)
    state.platens = SimpleNamespace(arrays=SimpleNamespace(stiffness=np.array([10.0]), column=np.array([0])))
    made = object.__new__(Margin)
    made._state, made._coasting, made._carry, made._gather = state, None, np.eye(4), np.eye(4)
    made._trial, made._free, made._mass, turned = 1e-3, np.full(4, 0.25), np.ones(4), []
    made._turn = lambda: turned.append(True)
    made._lowest = lambda tangent, starts: (tangent(np.array([1.0, 0.0, 0.0, 2.0])), starts)
    monkeypatch.setattr(margins, "_Trials", Springs)
    answer, starts = made.find(np.array([9.0, 8.0, 7.0, 6.0]))
    assert turned == [True]
    assert answer == pytest.approx([1 + 10 + 0.25, 0, 0, 2 * (4 + 0.25)])
    assert [start.tolist() for start in starts] == [[9, 8, 7, 6], field.ravel().tolist()]
    ahead = 1e-3 * 300 / 4  # the largest of the steady motion is 4
    assert [scale for _, scale in asked] == pytest.approx([ahead, ahead])
    assert asked[0][0] == pytest.approx(ahead * field)
    assert asked[1][0] - asked[0][0] == pytest.approx(1e-3 / 2 * np.array([[1.0, 0.0], [0.0, 2.0]]))


def test_the_sound_stiffness_turns_with_grains_by_rounded_angles(monkeypatch):
    """To 0.002 rad, and its factors to 0.05 rad; they are found again only where the rounded angles differ."""
    angles, turned, factored = [np.zeros(2)], [], []
    made = object.__new__(Margin)
    made._state = SimpleNamespace(
        grains=SimpleNamespace(rotations=lambda freedoms, positions: angles[-1]), freedoms=None, positions=None
    )
    made._angles = made._rough_angles = np.full(2, np.nan)
    made._places = "places"
    made._turned = lambda given: turned.append(given.tolist()) or "sound"
    monkeypatch.setattr(margins, "Factors", lambda matrix, places: factored.append((matrix, places)) or "factors")
    made._turn()
    made._turn()
    assert (turned, factored, made._sound, made._factors) == ([[0, 0]] * 2, [("sound", "places")], "sound", "factors")
    for more, finely, count in (([9e-4, -9e-4], None, 1), ([0.0031, 0.0], [0.004, 0], 1), ([0.06, 0], [0.06, 0], 2)):
        turned.clear()
        angles.append(np.array(more))
        made._turn()
        assert len(factored) == count
        assert turned[:1] == ([] if finely is None else [pytest.approx(finely, abs=1e-12)])
        assert turned[1:] == ([] if count == 1 else [pytest.approx([0.05, 0], abs=1e-12)])


def test_trials_act_under_the_loads_of_the_last_step(monkeypatch):
    asked = []
    monkeypatch.setattr(margins, "schedule_of", lambda state, *given: asked.append(given) or np.zeros((1, 1)))
    state = state_of(small_sample(4), Linear(**STIFF))
    state.clock.count(3, 7e-6)
    state.began, state.time_step = 4e-6, 1e-6
    _Trials(state, SimpleNamespace(numbers=np.zeros(1), address=0))
    begins, ends, paces, temperatures = zip(*asked, strict=True)
    assert np.ravel(begins) == pytest.approx([2e-6, 2e-6])
    assert np.ravel(ends) == pytest.approx([3e-6, 3e-6])
    assert paces == (0.0, 1.0)
    assert np.ravel(temperatures) == pytest.approx([20.0] * 4)
