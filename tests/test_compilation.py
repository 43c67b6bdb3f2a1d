"""Laws compiled: the same numbers as interpreted, from wherever they come, and a key that follows every edit."""

import math
import textwrap
import types

import attrs
import everything
import numpy as np
import pytest
from everything import EVERYTHING, Branch, Curve, Everything, Pair, doubled, helpers, scaled
from support import HILLERBORG, small_sample

import grainlaw as gl
from grainlaw.compiler.batch import compile_law
from grainlaw.compiler.compilation import Compilation
from grainlaw.compiler.fingerprint import fingerprint
from grainlaw.compiler.loops import has_loop
from grainlaw.engine import step as loop
from grainlaw.engine.parts import bonds as passes
from grainlaw.protocols import UniaxialTension


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
        UniaxialTension(loading=gl.Constant(speed=0.2), maximum_strain=6e-4, samples=60),
    )
    assert 5e6 < result.summary["strength"] < 14e6
    assert result.summary["tensile_cracks"] > 0


def test_everything_a_law_may_be_made_of():
    assert_compiled_is_interpreted(EVERYTHING)


@pytest.mark.thorough
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
    monkeypatch.setattr(everything, "shifted", everything.adding(2e-7))
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


def halved(x):
    while x > 1:
        x = x / 2
    return x


def once(x):
    return 2 * x if x > 0 else -x


def twice(x):
    return once(once(x))


def far_away(x):
    return twice(halved(x))


def within(x):
    return sum(x for _ in range(3))


@pytest.mark.parametrize(
    ("function", "jumps"), [(halved, True), (once, False), (twice, False), (far_away, True), (within, True)]
)
def test_what_may_never_end_is_known_by_its_jumps_back(function, jumps):
    """Its own, and those of what it calls: only such code runs in a thread of its own, to be left by Ctrl-C."""
    assert has_loop([once, function]) is jumps


def sin(x):
    """No method of the law, though one of Python's has its name."""
    return x


def test_only_a_users_functions_and_modules_are_copied():
    """Of a law with a method "exp": in math, where one function bears its name, that one is marked."""

    class Copied(Compilation):
        copy = lambda self, function: ("copy", function)  # noqa: E731

    made = object.__new__(Copied)
    made.key, made.structure = 20 * "0", [types.SimpleNamespace(methods={"exp": None})]
    mine = types.ModuleType("helpers")
    mine.chi, mine.itself, mine.number = sin, mine, 2.0
    assert made._convert(sin, set()) == ("copy", sin)
    assert made._convert(textwrap.dedent, set()) is textwrap.dedent
    assert made._convert(math.sin, set()) is math.sin
    assert made._convert(3.5, set()) == 3.5
    assert made._convert(math, {"sin"}) is math
    marked = made._convert(math, {"sin", "exp"})
    assert {name for name in vars(marked) if name[0] != "_"} == {"sin", "exp__method"}
    copied = made._convert(mine, {"chi", "itself", "number", "absent"})
    assert {name: found for name, found in vars(copied).items() if name[0] != "_"} == {
        "chi": ("copy", sin),
        "number": 2.0,
    }
    shift = 2.0
    assert made._marked(lambda x: x + shift)(1.0) == 3.0
    assert made._marked(lambda x, by=4.0: x + by)(1.0) == 5.0
