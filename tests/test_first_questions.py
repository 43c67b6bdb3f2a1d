"""What a law is asked before its first run, and what of it is refused."""

import math
import time
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import STIFF, STRONG, Hillerborg, small_sample
from test_laws_properties import LAWS

import grainlaw as gl
from grainlaw.compiler.batch import compile_law
from grainlaw.engine.model import Model
from grainlaw.laws import Linear, MohrCoulomb, WeibullField
from grainlaw.protocols import UniaxialTension
from grainlaw.runs import first_questions
from grainlaw.runs.first_questions import ask_first_questions


@pytest.fixture(autouse=True)
def unseen(monkeypatch):
    monkeypatch.setattr(first_questions, "_answered", set())


@pytest.mark.thorough
@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_every_law_answers_in_milliseconds(law):
    compile_law(law)
    times = []
    for _ in range(3):
        first_questions._answered.clear()
        start = time.perf_counter()
        ask_first_questions(Model(None, law))
        times.append(time.perf_counter() - start)
    assert min(times) < 0.1  # some ms on an idle machine


def law_of(respond, stiffness=(1e14, 1e14), memory=""):
    """A law of a traction written as an expression."""
    arguments = f"self, opening, slip{', ' + memory if memory else ''}"
    scope = {"math": math}
    exec(f"def traction({arguments}):\n    return {respond}", scope)

    @attrs.frozen(kw_only=True)
    class Own(gl.ContactLaw):
        k: float = gl.parameter("Pa/m", default=1e14)
        stiffness = property(lambda self: stiffness)
        traction = scope["traction"]

    return Own()


K, S = "self.k * opening", "self.k * slip"
REFUSED = {
    "stiffer in opening": (f"3 * {K}, {S}", r"normal traction grows by 3e\+14 Pa/m, more than 1\.05 times the 1e\+14"),
    "stiffer in slip": (f"{K}, 1.1 * {S}", r"opening 0 m, slip 9\.27e-13 m the shear traction grows by 1\.1e\+14"),
    "stiffer later": (f"{K} if opening < 1e-5 else 2 * {K}, {S}", r"opening 1\.\d+e-05 m.* normal traction grows"),
    "stiffer under pressure": (f"{K}, (1 - 1e6 * min(opening, 0.0)) * {S}", "opening -1e-07 m.* shear traction grows"),
    "a jump": (f"{K} + (0.0 if opening < 1e-5 else 1e12), {S}", "normal traction grows"),
    "not a number": (f"{K} if opening > -1e-7 else math.nan, {S}", "normal traction is nan interpreted, it must be"),
    "an error": (
        f"{K}, {S} / slip * slip",
        r"normal traction is nan interpreted \(ZeroDivisionError: .*must be finite",
    ),
    "memory that overflows": (f"{K}, {S}, 1e200 + wide * wide", "wide is .* must be finite"),
    "whole numbers": (
        f"{K}, {S} * (1.0 if int(3 + 0 * opening) ** 41 > 0 else 0.5)",  # beyond 64 bits
        "shear traction is .* compiled, .* interpreted, they must be equal",
    ),
}


@pytest.mark.thorough
@pytest.mark.parametrize(("respond", "words"), REFUSED.values(), ids=REFUSED)
def test_a_law_that_no_run_can_trust_is_refused(respond, words):
    law = law_of(respond, memory="wide" if "wide" in respond else "")
    with pytest.raises(gl.ParameterError, match=r"^Own: at .*" + words) as caught:
        gl.simulate(small_sample(5), law, UniaxialTension())
    assert "gl.check_law(law) tells more" in str(caught.value)
    assert len(str(caught.value)) < 300


def test_answers_that_differ_are_shown_both():
    """A function that says something else to the interpreter: there is no honest law that does."""
    law = law_of(f"{K}, {S}")
    ask_first_questions(Model(None, law))
    first_questions._answered.clear()
    compiled = compile_law(law)
    type(law).traction = law_of(f"{K}, {S} * (1 + 1e-11)").traction.__func__
    with pytest.raises(gl.ParameterError, match=r"shear traction is .* compiled, .* interpreted, they must be equal"):
        first_questions._Questions(law, compiled).ask()


def test_a_law_is_refused_where_it_has_become_stiffer():
    """Of five points the third is the first beyond a stiffness of 10, and it is met by hand: 6 more on a way of 0.5."""
    made = object.__new__(first_questions._Questions)
    made.law = law_of(f"{K}, {S}", (10.0, 2.0))
    made.points = np.array([[[0, 0], [1, 0], [1.5, 0], [2, 0], [3, 0]], [[0, 0], [0, 1], [0, 2], [0, 3], [0, 4]]])
    made.interpreted = np.array([[[t, 0] for t in (0, 10, 16, 18, 40)], [[9, t] for t in (0, 2.09, 4.1, 2, 4.11)]])
    with pytest.raises(gl.ParameterError, match=r"at opening 1\.5 m, slip 0 m the normal traction grows by 12 Pa/m"):
        made._not_stiffer(0, 0)
    with pytest.raises(gl.ParameterError, match=r"at opening 0 m, slip 4 m the shear traction grows by 2\.11 Pa/m"):
        made._not_stiffer(1, 1)
    made._not_stiffer(0, 1)
    made._not_stiffer(1, 0)


@pytest.mark.parametrize(
    "stiffness", [(1e14,), (1e14, 0.0), (-1.0, 1.0), (math.nan, 1.0), (1.0, math.inf), None, ("a", "b")], ids=repr
)
def test_a_stiffness_that_is_not_two_positive_numbers_is_refused(stiffness):
    with pytest.raises(gl.ParameterError, match=r"Own\.stiffness = .* is not allowed, it must be two positive finite"):
        ask_first_questions(Model(None, law_of(f"{K}, {S}", stiffness)))


SOUND = {
    "brittle": MohrCoulomb(**STRONG),
    "softening": Hillerborg(**STIFF, strength=13e6, energy=50),
    "closing stiffens": law_of(f"{K} * (1 + 1e6 * abs(min(opening, 0.0))), {S}"),
    "just as stiff as steps allow": law_of(f"1.04 * {K}, 1.04 * {S}"),
    "soft": law_of("opening, slip", (1.0, 1.0)),
    "very stiff": law_of("1e20 * opening, 1e20 * slip", (1e20, 1e20)),
    "far from unity": Hillerborg(kn=1e9, ks=1e9, strength=1e3, energy=1e-2),
}


@pytest.mark.parametrize("law", SOUND.values(), ids=SOUND)
def test_a_sound_law_is_not_refused(law):
    ask_first_questions(Model(None, law))


def test_memory_may_be_what_is_left_of_larger_numbers():
    """Its last digits differ between the interpreter and code in which products are added without rounding."""
    ask_first_questions(Model(None, law_of(f"{K}, {S}, {S} + 1e7 - self.k * (slip + opening)", memory="left")))


def test_a_traction_may_be_what_is_left_of_larger_ones():
    """Where opening and slip are equal there is none, but for their last digits."""
    ask_first_questions(Model(None, law_of(f"{K} - {S}, {S}")))


def test_all_laws_of_a_run_are_asked():
    """Those of pairs of phases, and the one of contacts that are no bonds."""
    sound, wrong = Linear(**STIFF), law_of(f"2 * {K}, {S}")
    with pytest.raises(gl.ParameterError, match=r"^Own: at"):
        ask_first_questions(Model(None, {(0, 0): sound, (0, 1): wrong}))
    for law in (wrong, {(0, 0): wrong}):
        with pytest.raises(gl.ParameterError, match=r"^Own: at"):
            gl.simulate(small_sample(5), sound, UniaxialTension(), detection=gl.Detection(law=law))


def test_a_law_of_different_contacts_is_asked_as_one():
    specimen = small_sample(5)
    law = WeibullField(modulus=5.0).scatter(MohrCoulomb(**STRONG), specimen)
    ask_first_questions(Model(None, law))
    assert len(first_questions._answered) == 1
    with pytest.raises(gl.ParameterError, match=r"stiffness = .* two positive"):
        ask_first_questions(Model(None, law_of(f"{K}, {S}", (np.array([1e14, -1.0]), 1e14))))


def test_a_law_is_asked_once_for_its_numbers(monkeypatch):
    asked = []
    monkeypatch.setattr(first_questions._Questions, "ask", lambda self: asked.append(self.law))
    one, other = MohrCoulomb(**STRONG), MohrCoulomb(**STRONG | {"cohesion": 28e6})
    for law in (one, one, other, one, MohrCoulomb(**STRONG)):
        ask_first_questions(Model(None, law))
    assert asked == [one, other]


def test_an_answer_that_is_no_number_is_shown_without_an_error_that_there_was_not():
    with pytest.raises(gl.ParameterError, match="the normal traction is nan interpreted, it must be finite"):
        ask_first_questions(Model(None, law_of(f"{K} if opening > -1e-7 else math.nan, {S}")))


@pytest.mark.parametrize(
    ("how", "said"),
    [("interpreted", r"is nan interpreted \(ValueError: too far\), it must"), ("compiled", "is nan compiled, it must")],
)
def test_the_error_behind_an_answer_that_is_no_number_is_that_of_the_interpreter(how, said):
    asked = first_questions._Questions.__new__(first_questions._Questions)
    asked.law, asked.contact = None, SimpleNamespace(error="ValueError: too far", names=())
    asked.points, answers = np.zeros((1, 2, 2)), np.full((1, 2, 2), np.nan)
    with pytest.raises(gl.ParameterError, match=f"at opening 0 m, slip 0 m the normal traction {said} be finite"):
        asked._finite(answers, how)


class AsksAnArray(Hillerborg):
    """What numba compiles, and what fails at every point."""

    def traction(self, opening, slip, damage, widest):
        moved = np.array([opening, slip])
        return self.kn * opening if moved > 0 else 0.0, self.ks * slip, damage, widest


ASKS = AsksAnArray(kn=1e14, ks=5e13, strength=13e6, energy=50)


def test_a_law_that_fails_everywhere_is_told_once_and_not_asked_compiled(capfd):
    """Compiled code has nobody to raise to: each point would print a traceback."""
    with pytest.raises(gl.ParameterError, match=r"nan interpreted \(ValueError: The truth value of an array"):
        ask_first_questions(Model(None, ASKS))
    said = str(gl.check_law(ASKS)["compiled"])
    assert "FAILS      it fails wherever it is asked: ValueError: The truth value of an array" in said
    assert "Exception ignored" not in "".join(capfd.readouterr())


def test_a_contact_is_driven_to_and_fro_and_sheared_when_broken():
    """In turn pulled, pulled less and sheared back, closed as far as the highest pressure, and half opened."""
    paths = first_questions._paths(1e13)
    u = [0.0, *first_questions.DISPLACEMENTS]
    shares = [(1, 0.5), (0.3, -1), (0, 0.8), (0.6, 0.1)]
    expected = [(shares[i % 4][0] * x, shares[i % 4][1] * x) for i, x in enumerate(u)]
    for i in range(2, len(u), 4):
        expected[i] = (-min(u[i], first_questions.HIGHEST / 1e13), expected[i][1])
    assert paths["to and fro"] == pytest.approx(np.array(expected), rel=1e-12)
    closed = min(first_questions.PRESSURES[1] / 1e13, u[-1])
    broken = [(0, 0), (u[-1], u[1]), *((-closed, x) for x in u[2:])]
    assert paths["slip when broken"] == pytest.approx(np.array(broken), rel=1e-12)
    for pressure in first_questions.PRESSURES:
        under = paths[f"slip under {pressure:g} Pa"]
        assert under[:, 0] == pytest.approx(-min(pressure / 1e13, u[-1]))


def test_laws_are_asked_in_all_directions():
    paths = first_questions._paths(1e13)
    opening, slip = (np.concatenate([path[:, k] for path in paths.values()]) for k in (0, 1))
    for each in (opening, slip):
        assert each.min() < 0 < each.max()
    assert np.array_equal(paths["slip back"], -paths["slip"])
    assert paths["slip"][1:, 1].min() > 0
    assert paths["closing"].min() < 0 == paths["closing"].max()
