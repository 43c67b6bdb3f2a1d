"""What the key of compiled code holds: all that an answer depends on, judged by where it lives and not by its name."""

import builtins
import contextlib
import ctypes
import enum
import functools
import math
import operator
import os
import random
import sys
import types
from collections import namedtuple
from pathlib import Path

import attrs
import numba
import numpy as np
import pytest

import grainlaw as gl
from grainlaw.compiler.batch import compile_law
from grainlaw.compiler.fingerprint import NotCompilable, fingerprint
from grainlaw.compiler.origin import is_standard


def made(source, **scope):
    """The function f of a source that was run without a module."""
    exec(source, scope)
    return scope["f"]


def key(value):
    return fingerprint(made("def f(x):\n    return value", value=value))


STANDARD = {
    "module": math, "package": np.linalg, "built in": builtins, "frozen": os, "C function": math.sin, "builtin": abs,
    "ufunc": np.sin, "dispatcher": np.clip, "class": np.float64, "type": float, "Python": functools.wraps,
    "numba": numba.prange, "another module's": operator.add, "method": Path.exists,
}  # fmt: skip


@pytest.mark.parametrize("thing", STANDARD.values(), ids=STANDARD)
def test_what_is_pythons_or_numpys_own_is_standard(thing):
    assert is_standard(thing)


def imposter(**names):
    def sin(x):
        return x

    for name, value in names.items():
        setattr(sin, name, value)
    return sin


MINE = {
    "module by name": types.ModuleType("math"),
    "function by name": imposter(__module__="math", __qualname__="sin"),
    "function without a module": made("def f(x):\n    return x"),
    "class without a module": made("class f(float):\n    pass"),
    "file that says it is Python's": made("def f(x): return x", __name__="math"),
    "decorated by Python": contextlib.contextmanager(imposter()),
    "cached": functools.lru_cache(imposter()),
    "wrapped": functools.wraps(math.sin)(imposter()),
    "generic": functools.singledispatch(imposter()),
    "partial": functools.partial(math.pow, 2.0),
    "main": sys.modules[__name__],
    "pytest": pytest,
}


@pytest.mark.parametrize("thing", MINE.values(), ids=MINE)
def test_what_only_has_a_name_of_pythons_is_not(thing):
    assert not is_standard(thing)


def test_what_a_user_puts_in_a_module_of_pythons_is_not_pythons(monkeypatch):
    mine = imposter(__module__="math", __qualname__="sin")
    monkeypatch.setattr(math, "sin", mine)
    assert not is_standard(mine)
    fake = types.ModuleType("math")
    monkeypatch.setitem(sys.modules, "math", fake)
    assert not is_standard(fake)


class Quiet(float):
    __repr__ = __str__ = lambda self: "a number"


def member(**values):
    kind = enum.Enum("Kind", values, module=__name__)
    kind.__repr__ = lambda self: "a member"
    return kind


def point(**defaults):
    return namedtuple("Point", defaults, defaults=defaults.values())


class Reversed(np.ndarray):
    pass


DIFFERENT = {
    "a name in two libraries": (math.floor, np.floor),
    "zeros": (0.0, -0.0),
    "whole numbers and fractions": (1, 1.0),
    "flags": (1, True),
    "numbers that print alike": (Quiet(1.0), Quiet(2.0)),
    "members of another value": (member(A=1.0).A, member(A=2.0).A),
    "members of another name": (member(A=1.0).A, member(B=1.0).B),
    "a second name of another member": (member(A=1.0, B=2.0, C=1.0), member(A=1.0, B=2.0, C=2.0)),
    "defaults of named tuples": (point(a=1.0), point(a=2.0)),
    "named tuples": (point(a=1.0)(3.0), point(b=1.0)(3.0)),
    "precision": (np.float32(0.5), np.float64(0.5)),
    "arrays": (np.array([1.0, 2.0]), np.array([2.0, 1.0])),
    "shapes": (np.zeros((2, 3)), np.zeros((3, 2))),
    "defaults": (made("def f(x, a=1.0): return a"), made("def f(x, a=2.0): return a")),
    "defaults by keyword": (made("def f(x, *, a=1.0): return a"), made("def f(x, *, a=2.0): return a")),
    "functions as defaults": (
        made("def f(x, g=g): return g(x)", g=made("def f(x): return x")),
        made("def f(x, g=g): return g(x)", g=made("def f(x): return 2 * x")),
    ),
    "types of numba": (numba.float32, numba.float64),
}  # fmt: skip


@pytest.mark.parametrize(("one", "other"), DIFFERENT.values(), ids=DIFFERENT)
def test_different_things_have_different_keys(one, other):
    assert key(one) == key(one)
    assert key(one) != key(other)


class Small(ctypes.Structure):
    pass


REFUSED = {
    "partial": functools.partial(math.pow, 2.0),
    "cached function": functools.lru_cache(imposter()),
    "C function of a library": ctypes.CDLL(None).labs if sys.platform != "win32" else ctypes.cdll.msvcrt.labs,
    "callback": ctypes.CFUNCTYPE(ctypes.c_double, ctypes.c_double)(lambda x: x),
    "compiled callback": numba.cfunc("float64(float64)")(lambda x: 2 * x),
    "universal function": numba.vectorize(lambda x: 2 * x),
    "bound method": random.Random(1).random,
    "object": object(),
    "class": Small,
    "tuple of one's own": type("Pair", (tuple,), {}),
    "class with fields": type("Fields", (), {"_fields": ("a",)}),
    "dictionary": {"a": 1.0},
    "functions in a tuple": (imposter(), imposter()),
    "array of another kind": np.zeros(3).view(Reversed),
}


@pytest.mark.parametrize("thing", REFUSED.values(), ids=REFUSED)
def test_what_cannot_be_seen_through_is_refused(thing):
    with pytest.raises(NotCompilable, match=r"^f\.value: "):
        key(thing)


@pytest.mark.parametrize("module", [math, np, np.linalg, builtins], ids=lambda m: m.__name__)
def test_what_is_put_into_a_module_of_pythons_is_seen(monkeypatch, module):
    """A constant, and a function that numba would compile."""
    use = "gain * g(x)" if module is builtins else "module.gain * module.g(x)"
    f = made(f"def f(x):\n    return {use}", module=module)
    keys = []
    for gain, g in [(1.0, imposter()), (2.0, imposter()), (2.0, numba.njit(lambda x: 2 * x))]:
        monkeypatch.setattr(module, "gain", gain, raising=False)
        monkeypatch.setattr(module, "g", g, raising=False)
        keys.append(fingerprint(f))
    assert len(set(keys)) == 3


# --- changed between two compilations ---------------------------------------------------------------------------------


@attrs.frozen(kw_only=True)
class Mine(gl.ContactLaw):
    """Its traction is asked of another function."""

    k: float = gl.parameter("Pa/m", default=1.0)
    stiffness = (1.0, 1.0)

    def traction(self, opening, slip):
        return TABLE[1] * opening, slip


TABLE = np.array([1.0, 2.0])


def test_an_array_changed_in_place_is_used():
    assert compile_law(Mine()).respond(1.0, 0.0)[0] == 2.0
    TABLE[1] = 5.0
    try:
        assert compile_law(Mine()).respond(1.0, 0.0)[0] == 5.0
    finally:
        TABLE[1] = 2.0
    assert compile_law(Mine()).respond(1.0, 0.0)[0] == 2.0


def test_a_variable_of_the_enclosing_function_that_is_bound_again_is_used():
    gain = 2.0

    def bind(value):
        nonlocal gain
        gain = value

    def unbind():
        nonlocal gain
        del gain

    @attrs.frozen(kw_only=True)
    class Own(gl.ContactLaw):
        k: float = gl.parameter("Pa/m", default=1.0)
        stiffness = (1.0, 1.0)

        def traction(self, opening, slip):
            return gain * opening, slip

    assert compile_law(Own()).respond(1.0, 0.0)[0] == 2.0
    bind(3.0)
    assert compile_law(Own()).respond(1.0, 0.0)[0] == 3.0
    unbind()
    with pytest.raises(gl.CompilationError, match=r"traction\.gain: a variable .* that has no value yet"):
        compile_law(Own())


def test_a_number_of_a_part_without_methods_is_reached():
    @attrs.frozen
    class Numbers:
        gain: float = 3.0

    @attrs.frozen(kw_only=True)
    class Own(gl.ContactLaw):
        numbers: Numbers = Numbers()
        stiffness = (1.0, 1.0)

        def traction(self, opening, slip):
            return self.numbers.gain * opening, slip

    assert compile_law(Own()).respond(1.0, 0.0)[0] == 3.0
    assert compile_law(Own(numbers=Numbers(gain=4.0))).respond(1.0, 0.0)[0] == 4.0
