"""What cannot be compiled is refused in a few lines that name the law, the place and the reason."""

import math
from types import SimpleNamespace

import attrs
import pytest
from support import small_sample

import grainlaw as gl
from grainlaw.compiler.batch import compile_integrator, compile_law
from grainlaw.compiler.compilation import Compilation
from grainlaw.protocols import UniaxialTension

TABLE = {"a": 1.0}


def factorial(x):
    return 1.0 if x < 1 else x * factorial(x - 1)


def raises(self, opening, slip):
    if opening > 1:
        raise ValueError("too far")
    return opening, slip


def too_few(self, opening, slip, damage):
    if opening > 0:
        return opening, slip
    return opening, slip, damage


def wrong_number(self, opening, slip, damage):
    return opening, slip


def not_numbers(self, opening, slip):
    return opening, "a lot"


def unknown_attribute(self, opening, slip):
    return self.kn * opening, self.stifness * slip


def typo(self, opening, slip):
    return self.kn * math.expp(opening), slip


def recursion(self, opening, slip):
    return factorial(opening), slip


def uses_dictionary(self, opening, slip):
    return TABLE["a"] * opening, slip


def uses_string(self, opening, slip):
    return (opening if self.kind == "hard" else 0.0), slip


def uses_static(self, opening, slip):
    return self.half(opening), slip


def unknown_name(self, opening, slip):
    return stifness * opening, slip  # noqa: F821


def in_a_method(self, opening, slip):
    return self.lost(opening), slip


def adds_text(self, opening, slip):
    return opening + "text", slip


REFUSALS = {
    raises: "raises raises: .* return nan instead",
    too_few: "must return 3 numbers on every path",
    wrong_number: "must return 3 numbers on every path",
    not_numbers: "must return 2 numbers on every path",
    unknown_attribute: r"'stifness' of type Mine(.|\n)*: return self.kn \* opening, self.stifness \* slip",
    typo: "expp",
    recursion: "factorial calls itself: recursion is not supported",
    uses_dictionary: "uses_dictionary.TABLE.*not dict",
    uses_string: "self.kind is a str",
    uses_static: "self.half is a function",
    unknown_name: "name 'stifness' is not defined",
    in_a_method: r"'stifness'(.|\n)*: return self.stifness \* x",
    adds_text: r"(?s)add.float64, Literal.*: return opening \+ .text., slip",
}


@pytest.mark.thorough
@pytest.mark.parametrize("traction", REFUSALS, ids=lambda f: f.__name__)
def test_refusals_name_the_law_the_place_and_the_reason(traction):
    @attrs.frozen(kw_only=True)
    class Mine(gl.ContactLaw):
        kn: float = gl.parameter("Pa/m")
        kind: str = "hard"
        stiffness = property(lambda self: (self.kn, self.kn))

        @staticmethod
        def half(x):
            return x / 2

        def lost(self, x):
            return self.stifness * x

        def traction(self, opening, slip):
            return opening, slip

    Mine.traction = traction
    with pytest.raises(gl.CompilationError, match=REFUSALS[traction]) as caught:
        compile_law(Mine(kn=1.0))
    message = str(caught.value)
    line = traction.__code__.co_firstlineno
    assert message.startswith(f"Mine.traction ({__file__}:{line}) cannot be compiled:\n")
    assert len(message.splitlines()) <= 9
    assert "numba" not in message.lower()
    assert "__method" not in message
    assert caught.value.__suppress_context__ or caught.value.__context__ is None  # no second traceback above it
    with pytest.raises(gl.CompilationError, match=r"Mine.traction"):
        gl.simulate(small_sample(5), Mine(kn=1.0), UniaxialTension())


@attrs.frozen(kw_only=True)
class Coulomb:
    coefficient: float = gl.parameter("1", default=0.5)

    def friction(self, opening):
        return self.coefficient * opening


@attrs.frozen(kw_only=True)
class Mixed(gl.ContactLaw):
    """A field with the name of a part's method."""

    kn: float = gl.parameter("Pa/m", default=1.0)
    friction: float = gl.parameter("1", default=3.0)
    part: Coulomb = gl.part(Coulomb, Coulomb())
    stiffness = property(lambda self: (self.kn, self.kn))

    def traction(self, opening, slip):
        return self.part.friction(opening), self.friction * slip


def test_one_name_for_a_field_and_a_method_of_a_law_is_refused():
    with pytest.raises(gl.CompilationError, match="friction is a field of Mixed and the name of a method"):
        compile_law(Mixed())


@attrs.frozen(kw_only=True)
class Named(gl.ContactLaw):
    """A field with the name of another law's method."""

    kn: float = gl.parameter("Pa/m", default=1.0)
    friction: float = gl.parameter("1", default=3.0)
    stiffness = property(lambda self: (self.kn, self.kn))

    def traction(self, opening, slip):
        return opening, self.friction * slip


@attrs.frozen(kw_only=True)
class Parted(Mixed):
    """The method, without the field."""

    def traction(self, opening, slip):
        return self.part.friction(opening), slip


def test_a_field_may_have_the_name_of_another_laws_method(monkeypatch, tmp_path):
    monkeypatch.setenv("GRAINLAW_CACHE", str(tmp_path))  # what is loaded is not compiled
    assert gl.trace(Parted(), 4.0, 2.0, compiled=True).normal[0] == 2.0
    assert gl.trace(Named(), 4.0, 2.0, compiled=True).shear[0] == 6.0


def test_a_class_that_declares_nothing_is_refused():
    class Bare(gl.ContactLaw):
        stiffness = (1.0, 1.0)

        def traction(self, opening, slip):
            return opening, slip

    with pytest.raises(gl.CompilationError, match=r"Bare must be an attrs class: @attrs.frozen\(kw_only=True\)"):
        compile_law(Bare())


def test_a_traction_without_slip_is_refused():
    @attrs.frozen
    class Short(gl.ContactLaw):
        stiffness = (1.0, 1.0)

        def traction(self, opening):
            return opening

    with pytest.raises(gl.ParameterError, match=r"Short\.traction must take opening and slip"):
        compile_law(Short())


def test_an_integrator_that_returns_one_number_is_refused():
    @attrs.frozen
    class Short(gl.integration.Integrator):
        def step(self, force, change, velocity, mass, time_step):
            return velocity

        def stable_step(self, highest_frequency):
            return 1e-9

    with pytest.raises(gl.CompilationError, match=r"(?s)Short.step.*must return 2 numbers"):
        compile_integrator(Short())


def test_an_integrator_that_moves_to_two_places_is_refused():
    @attrs.frozen
    class Two(gl.integration.Integrator):
        def step(self, force, change, velocity, mass, time_step):
            return velocity, 0.0

        def move(self, displacement, velocity, time_step):
            return displacement, velocity

        def stable_step(self, highest_frequency):
            return 1e-9

    with pytest.raises(gl.CompilationError, match=r"(?s)Two.move.*must return a number"):
        compile_integrator(Two())


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", ""),
        ("Failed in nopython mode pipeline (step: a)\nNo way\n\nThere are 22 of them:\n - one", "No way"),
        ("During: typing\none\ntwo\nthree\nfour\nfive", "one\ntwo\nthree\nfour"),
        ("outer raised a specific error:\n  inner\nFile lost", "inner"),
        (
            "Can't unify return type from the following types: a, b",
            "it must return 2 numbers on every path; types: a, b",
        ),
        ("at BoundFunction(Mine 'lost')", "at BoundFunction(Mine 'lost')"),
        ("at BoundFunction(Mine 'stiff')", "at BoundFunction(Mine 'stiff')"),
        (
            "at BoundFunction(Mine 'both')",
            "both is a field of str and the name of a method: give one of them another name",
        ),
        (
            "Unknown attribute 'title' of Mine",
            "Unknown attribute 'title' of Mine\nself.title is a builtin_function_or_method",
        ),
        ("Unknown attribute 'kn' of Mine", "Unknown attribute 'kn' of Mine"),
    ],
)
def test_what_is_told_of_an_error_by_hand(text, told):
    """Of a component that is a text, with the fields "stiff" and "both" and the methods "lost" and "both"."""
    made = object.__new__(Compilation)
    made.key, methods = 16 * "0", {"lost": None, "both": None}
    made.structure = [SimpleNamespace(component="text", fields=("stiff", "both"), methods=methods)]
    assert made._reason(Exception(text), 2) == told
