"""Laws and integrators compiled: the same numbers as interpreted, from wherever they come, and readable refusals."""

import enum
import math
import types

import attrs
import numpy as np
import pytest
from support import STIFF, STRONG, Hillerborg, small_sample

import grainlaw as gl
from grainlaw.compiler.batch import compile_integrator, compile_law
from grainlaw.compiler.fingerprint import fingerprint
from grainlaw.engine import step as loop
from grainlaw.engine.parts import bond_passes as passes
from grainlaw.engine.parts.laws import LANES
from grainlaw.laws import CohesiveCrack, Linear, MohrCoulomb
from grainlaw.protocols import UniaxialTension

COHESIVE = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300)


HILLERBORG = Hillerborg(**STIFF, strength=13e6, energy=50)


def path(points=300, seed=0):
    """Openings and slips (m) of a walk into both signs and past failure."""
    return np.cumsum(np.random.default_rng(seed).normal(size=(2, points)) * 3e-7, axis=1)


def assert_compiled_is_interpreted(law):
    opening, slip = path()
    plain, compiled = gl.trace(law, opening, slip), gl.trace(law, opening, slip, compiled=True)
    for name in ("normal", "shear", *plain.memory):
        a, b = getattr(plain, name), getattr(compiled, name)
        assert np.abs(a).max() > 0, f"{name} is not exercised"
        np.testing.assert_allclose(b, a, rtol=1e-12, atol=1e-12 * np.abs(a).max(), err_msg=name)


# --- the same numbers ------------------------------------------------------------------------------------------------


def test_a_law_of_ones_own_traces_its_energy_and_runs():
    opening = np.linspace(0, 1.01 * 2 * 50 / 13e6, 4001)
    for compiled in (False, True):
        t = gl.trace(HILLERBORG, opening, 0, compiled=compiled)
        assert t.work[-1] == pytest.approx(50.0, rel=1e-4)
        assert t.damage[-1] == 1
    assert_compiled_is_interpreted(HILLERBORG)
    result = gl.simulate(
        small_sample(12),
        attrs.evolve(HILLERBORG, energy=1.0),
        UniaxialTension(speed=0.2, maximum_strain=6e-4, samples=60),
    )
    assert 5e6 < result.summary["peak_stress"] < 14e6
    assert result.summary["tensile_cracks"] > 0


class Branch(enum.Enum):
    TWICE = 1
    ONCE = 2


FACTOR = 3.0


def doubled(x):
    return 2 * x


def scaled(x, by=FACTOR):
    return doubled(x) * by


helpers = types.ModuleType("helpers")
helpers.inner = types.ModuleType("helpers.inner")
helpers.inner.GAIN = 0.5
exec("import math\ndef bend(x):\n    return math.tanh(x * 1e6)", helpers.inner.__dict__)


def _closed(amount):
    return lambda x: x + amount


shifted = _closed(1e-7)


@attrs.frozen(kw_only=True)
class Curve:
    """A part that has a part."""

    height: float = gl.parameter("Pa")
    branch: Branch = Branch.TWICE

    def at(self, x):
        return self.height * (2 * x if self.branch == Branch.TWICE else x)


@attrs.frozen(kw_only=True)
class Pair:
    first: Curve
    second: Curve

    def at(self, x):
        return self.first.at(x) - self.second.at(-x * self.slope)

    @property
    def slope(self):
        return math.tan(math.radians(self.first.height))


@attrs.frozen(kw_only=True)
class Everything(gl.ContactLaw):
    """Parts, methods, flags, options, properties, helpers of modules, closures, a method named like math's."""

    kn: float = gl.parameter("Pa/m")
    pair: Pair
    branch: Branch = Branch.ONCE
    soft: bool = True
    power: int = 3
    stiffness = property(lambda self: (self.kn, self.kn))

    @property
    def half(self):
        return self.kn / 2

    def exp(self, x):
        return math.exp(-abs(x) * 1e6) * self.half

    def both(self, x):
        return self.exp(x) + (self.kn if self.branch == Branch.ONCE else 0.0)

    def traction(self, opening, slip, count, largest):
        largest = max(largest, abs(shifted(slip)))
        count = count + (1 if self.soft and opening > 0 else 2)
        normal = self.both(opening) * opening + self.pair.at(opening) * (opening * 1e6) ** self.power
        return normal + scaled(slip), helpers.inner.bend(slip) * helpers.inner.GAIN, count, largest


EVERYTHING = Everything(kn=1e6, pair=Pair(first=Curve(height=30), second=Curve(height=20, branch=Branch.ONCE)))


def test_everything_a_law_may_be_made_of():
    assert_compiled_is_interpreted(EVERYTHING)


@pytest.mark.parametrize(
    "change",
    [
        {"branch": Branch.TWICE},
        {"soft": False},
        {"power": 2},
        {"pair": Pair(first=Curve(height=3), second=Curve(height=2))},
    ],
    ids=lambda change: next(iter(change)),
)
def test_other_options_are_other_code(change):
    law = attrs.evolve(EVERYTHING, **change)
    assert_compiled_is_interpreted(law)
    at = np.array([2e-7]), np.array([1e-7])
    assert not np.array_equal(gl.trace(law, *at).normal, gl.trace(EVERYTHING, *at).normal) or change == {"soft": False}


@attrs.frozen(kw_only=True)
class Guarded(gl.ContactLaw):
    """Both sides of a choice are computed: one of them is nan or infinite."""

    kn: float = gl.parameter("Pa/m")
    stiffness = property(lambda self: (self.kn, self.kn))

    def traction(self, opening, slip):
        root = self.kn * opening if opening <= 0 else self.kn * math.sqrt(opening) * math.sqrt(opening)
        return root, self.kn * slip if slip == 0 else self.kn / (1 / slip)


def test_a_branch_that_is_not_chosen_may_be_nan():
    opening, slip = np.array([[-1e-6, -2e-6, 0.0, 1e-6], [0.0, 1e-6, 0.0, 0.0]])
    found = gl.trace(Guarded(kn=2.0), opening, slip, compiled=True)
    assert np.allclose(found.normal, 2 * opening, rtol=1e-15)
    assert np.allclose(found.shear, 2 * slip, rtol=1e-15)


# --- many contacts ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "law",
    [Linear(**STIFF), MohrCoulomb(**STRONG), COHESIVE, HILLERBORG, EVERYTHING],
    ids=lambda law: type(law).__name__,
)
def test_a_split_at_whole_lanes_gives_the_same_bits(law):
    """Threads cut the contacts there: the compiler may round those that do not fill a vector in another way."""
    compiled = compile_law(law)
    count, size = len(compiled.memory), 5 * LANES + 37
    opening, slip = np.random.default_rng(1).normal(size=(2, size)) * 1e-6
    answers = []
    for cuts in [[], *([n * LANES] for n in range(1, 6)), [LANES, 2 * LANES, 5 * LANES]]:
        memory = np.zeros((count, size))
        pieces = []
        for step in (1.0, 1.7):  # the second with a memory that is not zero
            pieces = []
            for part in np.split(np.arange(size), cuts):
                rows = np.ascontiguousarray(memory[:, part]) if count else np.zeros((1, len(part)))
                pieces.append(compiled.batch(step * opening[part], step * slip[part], rows))
                memory[:, part] = rows[:count]
        answers.append(np.vstack([np.hstack(pieces), memory]))
    for answer in answers[1:]:
        assert np.array_equal(answer, answers[0])


@pytest.mark.parametrize(
    "law",
    [Linear(**STIFF), MohrCoulomb(**STRONG), COHESIVE, HILLERBORG, EVERYTHING],
    ids=lambda law: type(law).__name__,
)
def test_one_contact_alone_answers_as_among_others(law):
    """To rounding: one by one contacts do not fill a vector."""
    compiled = compile_law(law)
    opening, slip = np.random.default_rng(1).normal(size=(2, 40)) * 1e-6
    memory = np.zeros((len(compiled.memory), 40))
    one = np.array([compiled.respond(o, s, *m) for o, s, *m in zip(opening, slip, *memory, strict=True)]).T
    together = np.vstack([compiled.batch(opening, slip, memory), memory])
    assert together == pytest.approx(one, rel=1e-12, abs=1e-12 * np.abs(one).max())


def varied(law, count, **names):
    rng = np.random.default_rng(4)
    return attrs.evolve(law, **{name: value * rng.uniform(0.8, 1.0, count) for name, value in names.items()})


@pytest.mark.parametrize(
    "law",
    [
        varied(MohrCoulomb(**STRONG), 30, friction_angle=50, ks=9e13),  # a property uses math.tan
        varied(COHESIVE, 30, cohesion=29e6, mode_i_energy=150),
        attrs.evolve(EVERYTHING, pair=Pair(first=varied(Curve(height=3), 30, height=30), second=Curve(height=2))),
        varied(Linear(**STIFF), 30, kn=1e14, ks=1e13),
    ],
    ids=lambda law: type(law).__name__,
)
def test_parameters_that_differ_between_contacts(law):
    """Entry c of every array at contact c, the same as a law of those numbers alone."""
    compiled = compile_law(law, 30)
    opening, slip = np.random.default_rng(1).normal(size=(2, 30)) * 1e-6
    memory = np.zeros((len(compiled.memory) or 1, 30))
    answer = np.vstack([compiled.batch(opening, slip, memory), memory[: len(compiled.memory)]])

    def at(component, c):
        fields = {f.name: getattr(component, f.name) for f in attrs.fields(type(component))}
        changes = {n: v[c] for n, v in fields.items() if isinstance(v, np.ndarray)}
        changes |= {n: at(v, c) for n, v in fields.items() if attrs.has(type(v))}
        return attrs.evolve(component, **changes)

    zero = (0.0,) * len(compiled.memory)
    each = np.array([at(law, c).traction(opening[c], slip[c], *zero) for c in range(30)]).T
    np.testing.assert_allclose(answer, each, rtol=1e-12)
    alike = compiled.batch(np.full(30, -2e-8), np.full(30, 1e-7), memory * 0)
    assert len(np.unique(alike, axis=1).T) == 30


def test_few_different_contacts_are_evaluated_once_each(monkeypatch):
    calls = []
    monkeypatch.setattr(MohrCoulomb, "friction", property(lambda self: calls.append(1) or self.friction_angle / 50))
    angles = np.where(np.arange(50_000) % 3, 50.0, 40.0)
    compiled = compile_law(attrs.evolve(MohrCoulomb(**STRONG), friction_angle=angles), len(angles))
    assert compiled.rows.shape == (1, 50_000)
    assert np.array_equal(compiled.rows[0], angles / 50)
    assert len(calls) < 20


def test_an_array_of_the_wrong_length_is_refused():
    with pytest.raises(gl.ParameterError, match=r"cohesion has 30 entries.* 31 contact points"):
        compile_law(varied(COHESIVE, 30, cohesion=29e6), 31)


def test_an_option_cannot_differ_between_contacts():
    @attrs.frozen(kw_only=True)
    class Split(gl.ContactLaw):
        kn: float = gl.parameter("Pa/m")
        stiffness = property(lambda self: (self.kn, self.kn))
        brittle = property(lambda self: self.kn > 1.5)

        def traction(self, opening, slip):
            return (0.0 if self.brittle else self.kn) * opening, slip

    with pytest.raises(gl.CompilationError, match=r"differs between contacts.*: it is one of brittle"):
        compile_law(Split(kn=np.array([1.0, 2.0])), 2)


# --- integrators -----------------------------------------------------------------------------------------------------


@attrs.frozen(kw_only=True)
class Free(gl.Integrator):
    """The example of the interface's docstring."""

    def step(self, force, velocity, mass, time_step):
        return velocity + force / mass * time_step, 0.0

    def stable_step(self, highest_frequency):
        return 0.9 * 2 / highest_frequency


@attrs.frozen(kw_only=True)
class Drifting(Free):
    """One that moves by a rule of its own, with a number of its own."""

    drift: float = gl.parameter("m/s", default=0.5)

    def move(self, displacement, velocity, time_step):
        return displacement + (velocity + self.drift) * time_step


def advance(integrator, cuts=(), count=40):
    """One step of ``count`` freedoms, driven and free, in the pieces between ``cuts``."""
    import ctypes

    compiled = compile_integrator(integrator)
    rng = np.random.default_rng(2)
    arrays = [rng.normal(size=count) for _ in range(7)]
    arrays[3] = np.abs(arrays[3]) + 1
    arrays[4] = (arrays[4] > 0).astype(float)
    arrays[5] *= 1 - arrays[4]
    parameters = np.append(compiled.numbers, 0.25)
    call = ctypes.CFUNCTYPE(None, *(ctypes.c_int64,) * 9)(compiled.address)
    before = [a.copy() for a in arrays]
    for part in np.split(np.arange(count), list(cuts)):
        call(parameters.ctypes.data, *(a.ctypes.data + 8 * int(part[0]) for a in arrays), len(part))
    return before, arrays


INTEGRATORS = [
    Free(), Drifting(), gl.CentralDifference(), gl.CentralDifference(damping=gl.Undamped()),
    gl.CentralDifference(damping=gl.MassDamping(coefficient=0.3)), gl.DynamicRelaxation(),
]  # fmt: skip


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=lambda i: f"{type(i).__name__}")
def test_integrators_compiled_are_interpreted(integrator):
    before, after = advance(integrator)
    for force, v, u, mass, free, imposed, loss, new_v, new_u, new_loss in zip(
        *before, after[1], after[2], after[6], strict=True
    ):
        expected, damping = integrator.step(force, v, mass, 0.25)
        expected = expected if free else imposed
        assert new_v == pytest.approx(expected, rel=1e-12)
        drift = 0.5 if isinstance(integrator, Drifting) else 0.0
        assert new_u == pytest.approx(u + 0.25 * (expected + drift), rel=1e-12, abs=1e-14)
        assert new_loss == pytest.approx(loss - free * damping * 0.125 * (v + expected), rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("integrator", INTEGRATORS, ids=lambda i: f"{type(i).__name__}")
def test_integrators_split_unevenly_give_the_same_bits(integrator):
    whole = np.array(advance(integrator)[1])
    for n in range(1, 40):
        assert np.array_equal(np.array(advance(integrator, [n])[1]), whole)


def test_an_integrator_of_ones_own_runs():
    test = UniaxialTension(maximum_strain=2e-5, samples=20, integrator=Free())
    own = gl.simulate(small_sample(12), Linear(**STIFF), test)
    undamped = attrs.evolve(test, integrator=gl.CentralDifference(damping=gl.Undamped()))
    theirs = gl.simulate(small_sample(12), Linear(**STIFF), undamped)
    assert own.summary["steps"] == theirs.summary["steps"]
    assert np.allclose(own.curves["stress"], theirs.curves["stress"], rtol=1e-6)


# --- the key of the cache --------------------------------------------------------------------------------------------


def test_the_key_of_the_loop_knows_its_passes(monkeypatch):
    key = fingerprint(loop._steps)
    assert key == fingerprint(loop._steps)
    monkeypatch.setattr(passes, "gather_forces", lambda first, second, cx, cy, fx, fy: None)
    assert fingerprint(loop._steps) != key


def test_the_key_follows_constants_defaults_closures_and_helpers(monkeypatch):
    def keys():
        return [fingerprint(f) for f in (scaled, Everything.traction, doubled)]

    first = keys()
    monkeypatch.setattr(helpers.inner, "GAIN", 0.25)
    assert [a == b for a, b in zip(first, keys(), strict=True)] == [True, False, True]
    monkeypatch.undo()
    monkeypatch.setattr(scaled, "__defaults__", (2.0,))
    assert [a == b for a, b in zip(first, keys(), strict=True)] == [False, False, True]
    monkeypatch.undo()
    monkeypatch.setitem(globals(), "shifted", _closed(2e-7))
    assert [a == b for a, b in zip(first, keys(), strict=True)] == [True, False, True]
    monkeypatch.undo()
    assert keys() == first


def test_an_edit_in_a_running_session_is_used(monkeypatch):
    """As after an automatic reload in a notebook: the class stays, its method is another."""

    @attrs.frozen(kw_only=True)
    class Edited(gl.ContactLaw):
        kn: float = gl.parameter("Pa/m")
        stiffness = property(lambda self: (self.kn, self.kn))

        def factor(self):
            return 2.0

        def traction(self, opening, slip):
            return self.factor() * self.kn * opening, slip

    assert compile_law(Edited(kn=1)).respond(1.0, 0.0) == (2.0, 0.0)
    Edited.factor = lambda self: 3.0
    assert compile_law(Edited(kn=1)).respond(1.0, 0.0) == (3.0, 0.0)
