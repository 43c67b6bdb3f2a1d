"""Names and kinds of arguments, for our classes and functions and for a user's."""

import inspect
from collections.abc import Callable, Mapping, Sequence

import attrs
import numpy as np
import pytest
from support import BRITTLE, PULL, STIFF, Hillerborg, small_sample

import grainlaw as gl
from grainlaw.arguments import fits, wanted
from grainlaw.geometry import from_polygons, moved, together
from grainlaw.laws import CohesiveCrack, Linear
from grainlaw.messages import nearest
from grainlaw.protocols import UniaxialTension
from grainlaw.workbench.conformance import Entry, Report

WRONG = {
    "misspelt field": (
        lambda: CohesiveCrack(tensile_strenght=1),
        "CohesiveCrack: there is no 'tensile_strenght'",
    ),
    "nearest": (lambda: CohesiveCrack(tensile_strenght=1), r"did you mean 'tensile_strength'\? .*has: kn, ks"),
    "misspelt option": (
        lambda: gl.simulate(1, 2, 3, thread=2),
        "simulate: there is no 'thread'; .* 'threads'",
    ),
    "a user's law": (lambda: Hillerborg(**STIFF, strenth=1), "Hillerborg: there is no 'strenth'; .* 'strength'"),
    "evolved": (lambda: attrs.evolve(BRITTLE, cohesian=1), "MohrCoulomb: there is no 'cohesian'; .* 'cohesion'"),
    "missing": (lambda: Linear(kn=1), r"Linear: missing a required.* 'ks' \(Linear\(\*, kn, ks\)\)"),
    "twice": (lambda: moved(1, grains=2), "moved: multiple values for argument 'grains'"),
    "kind": (lambda: moved(5), "moved: grains = 5 is not allowed, it must be a Tessellation"),
    "one of several": (lambda: together(5), "together: bodies = 5 is not allowed, it must be a Tessellation"),
    "in a list": (lambda: Report("x", [5]), r"Report: entries = \[5\] is not allowed, it must be a list of Entries"),
    "interface": (lambda: gl.ContactLaw(), "ContactLaw cannot be made: it must define stiffness, traction"),
    "array": (lambda: UniaxialTension(loading=gl.Constant(speed=[1, 2])), r"Constant: speed = \[1, 2\] is not allowed"),
    "empty array": (lambda: Linear(kn=[], ks=1), r"Linear: kn = \[\] is not allowed"),
}


@pytest.mark.parametrize(("call", "words"), WRONG.values(), ids=WRONG)
def test_what_does_not_fit_a_signature_is_refused(call, words):
    with pytest.raises(gl.ParameterError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value)


HINTS = [
    (int, 2, True, "whole number"), (bool, np.bool_(True), 1, "True or False"), (float, np.float32(1), "1", "number"),
    (str | None, None, 1, "a text or None"), (Sequence[str], ["a"], "a", "list of texts"),
    (tuple[int, int], (1, 2), (1, 2, 3), "pair of whole numbers"), (Callable[[int], int], len, 1, "function"),
    (Mapping[int, str], {1: "a"}, {"a": "a"}, "mapping from whole numbers to texts"),
    (tuple[Entry, ...], [], [1], "list of Entries"), (np.ndarray, np.zeros(2), [0.0], "array"),
]  # fmt: skip


@pytest.mark.parametrize(("hint", "right", "other", "words"), HINTS, ids=[str(hint) for hint, *_ in HINTS])
def test_annotations_say_what_fits(hint, right, other, words):
    assert fits(right, hint)
    assert not fits(other, hint)
    assert words in wanted(hint)


def test_signatures_stay_readable():
    assert list(inspect.signature(Linear).parameters) == ["kn", "ks"]
    assert inspect.signature(gl.trace).parameters["compiled"].default is False


def test_a_name_that_a_result_does_not_have_is_answered_with_those_it_has():
    result = gl.simulate(small_sample(4), BRITTLE, attrs.evolve(PULL, maximum_strain=1e-5, samples=10))
    with pytest.raises(KeyError, match=r"no 'strenght'; did you mean 'strength'\? .*are: strength"):
        result.summary["strenght"]
    with pytest.raises(KeyError, match=r"there is no 'ucs' .*strength, failure_strain"):
        result.summary["ucs"]
    with pytest.raises(KeyError, match="did you mean 'stress'"):
        result.curves["stres"]


NO_NUMBERS = {
    "array of texts": np.array(["1"]), "texts": ["1"], "array of flags": np.array([True]), "a flag": [True, 1.0],
    "array of complex numbers": np.array([1 + 2j]), "a complex number": [1 + 0j], "too large": [10**400],
    "nothing": np.array([None]),
}  # fmt: skip


@pytest.mark.parametrize("value", NO_NUMBERS.values(), ids=NO_NUMBERS)
def test_arrays_of_what_is_no_number_are_refused(value):
    """Texts, flags and complex numbers were cast in silence."""
    with pytest.raises(gl.ParameterError, match=r"kn = .* is not allowed"):
        Linear(kn=value, ks=1e14)
    with pytest.raises(gl.ParameterError, match=r"opening = .* is not allowed"):
        gl.trace(Linear(kn=1e14, ks=1e14), opening=value, slip=0.0)


def test_numbers_of_any_kind_are_numbers():
    for value in ([1, 2.0], np.array([1, 2], dtype=np.uint8), np.array([1, 2], dtype=np.float32), (np.int64(1), 2)):
        assert Linear(kn=value, ks=1e14).kn.tolist() == [1.0, 2.0]


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e200, -1e13])
def test_places_are_finite_and_near(wrong):
    ring = [(0.0, 0.0), (1.0, 0.0), (1.0, wrong), (0.0, 1.0)]
    with pytest.raises(gl.ParameterError, match=r"polygon 0 = .* is not allowed, it must be a list of points"):
        from_polygons([ring])


@pytest.mark.parametrize(
    ("given", "known", "meant"),
    [
        ("uniaxial_strength", ["tensile_strength", "ucs"], "ucs"),
        ("tension", ["cohesion", "tensile_strength"], "tensile_strength"),
        ("normal_stiffness", ["kn", "ks", "cohesion"], "kn"),
    ],
)
def test_what_a_short_name_stands_for_suggests_it(given, known, meant):
    """The words of who does not know it are like another name, or like none."""
    assert nearest(given, known) == f"; did you mean '{meant}'?"
    assert meant not in nearest(given, [name for name in known if name != meant])
