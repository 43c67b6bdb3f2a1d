"""A law compiled for many contacts: each answers as it would alone, also where parameters differ between them."""

import attrs
import numpy as np
import pytest
from everything import EVERYTHING, Curve, Pair
from support import HILLERBORG, STIFF, STRONG

import grainlaw as gl
from grainlaw.compiler.batch import compile_law
from grainlaw.engine.parts.laws import LANES
from grainlaw.laws import CohesiveCrack, Linear, MohrCoulomb

COHESIVE = CohesiveCrack(**STRONG, mode_i_energy=150, mode_ii_energy=300)


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


@pytest.mark.thorough
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
