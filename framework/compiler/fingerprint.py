"""A hash of everything that is compiled into a function, so that a cached binary is never stale."""

from __future__ import annotations

import dis
import enum
import functools
import hashlib
import types
from collections.abc import Iterator
from typing import Any

import numpy as np
from numba import types as nb

from grainlaw.compiler.numba_private import definition, python_function
from grainlaw.compiler.origin import VERSIONS, home, is_standard

_NUMBERS = (bool, int, float, complex, str, bytes)
_COMPILED_APART = "no code of it is seen here: write it as a plain function"


class NotCompilable(TypeError):
    """A function refers to something that cannot be compiled into a kernel."""


@functools.cache
def code_names(code: types.CodeType) -> tuple[set[str], set[str]]:
    """Names that a code object, and the code nested in it, loads as globals and as attributes."""
    loaded, attributes = set(), set()
    for instruction in dis.get_instructions(code):
        if instruction.opname in ("LOAD_GLOBAL", "LOAD_NAME"):
            loaded.add(instruction.argval)
        elif instruction.opname in ("LOAD_ATTR", "LOAD_METHOD"):
            attributes.add(instruction.argval)
    for constant in code.co_consts:
        if isinstance(constant, types.CodeType):
            more, more_attributes = code_names(constant)
            loaded |= more
            attributes |= more_attributes
    return loaded, attributes


def global_names(function: Any) -> dict[str, Any]:
    """The globals, and the builtins that take their place, which a function's code loads."""
    known = {**function.__builtins__, **function.__globals__}
    return {name: known[name] for name in sorted(code_names(function.__code__)[0]) if name in known}


def references(function: types.FunctionType) -> Iterator[tuple[str, Any]]:
    """What a function's code can reach by name: globals, closure cells, attributes of its helper modules.

    Raises :class:`NotCompilable` for a variable of an enclosing function that has no value yet.
    """
    attributes = code_names(function.__code__)[1]
    for name, value in global_names(function).items():
        yield from _reach(name, value, attributes, ())
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            value = cell.cell_contents
        except ValueError:
            raise NotCompilable(
                f"{function.__name__}.{name}: a variable of the enclosing function that has no value yet"
            ) from None
        yield from _reach(name, value, attributes, ())


def _reach(name: str, value: Any, attributes: set[str], above: tuple) -> Iterator[tuple[str, Any]]:
    yield name, value
    if isinstance(value, types.ModuleType) and value not in above:
        standard = is_standard(value)
        for attribute in sorted(attributes):  # any attribute named anywhere in the function: a safe superset
            held = vars(value).get(attribute, _NOTHING) if standard else getattr(value, attribute, _NOTHING)
            if held is not _NOTHING and not (standard and _belongs(held)):
                yield from _reach(f"{name}.{attribute}", held, attributes, (*above, value))


_NOTHING = object()


def _belongs(held: Any) -> bool:
    """Whether something in a module of Python's is not what a user has put there, as far as compiled code can tell."""
    constant = isinstance(held, (*_NUMBERS, np.ndarray, np.generic, enum.Enum))
    return not constant and (is_standard(held) or not isinstance(python_function(held), types.FunctionType))


def reached(*functions: Any) -> Iterator[types.FunctionType]:
    """Functions and all helpers that they reach, each once; none of Python's, numpy's or numba's own."""
    waiting, seen = list(functions), set[types.FunctionType]()
    while waiting:
        function = python_function(waiting.pop())
        if isinstance(function, types.FunctionType) and function not in seen and not is_standard(function):
            seen.add(function)
            yield function
            waiting.extend(value for _, value in references(function))


def signature(code: types.CodeType) -> tuple:
    # With the types of constants, for 1 == 1.0, and `x * 1` of an integer is no float. Without file and line, so that a
    # law that has moved is found again.
    constants = tuple(
        signature(c) if isinstance(c, types.CodeType) else (type(c).__name__, repr(c)) for c in code.co_consts
    )
    return (
        code.co_code, code.co_exceptiontable, constants, code.co_names, code.co_varnames, code.co_freevars,
        code.co_cellvars, code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags,
    )  # fmt: skip


#: modules whose answers differ from call to call
_CHANCE = ("random", "numpy.random", "numpy.random.mtrand", "secrets", "time", "datetime", "uuid")


def _refuse_chance(value: Any, where: str) -> None:
    """Refuse what makes numbers by chance or by the clock, as a module and as one of its functions."""
    owner = value if isinstance(value, types.ModuleType) else getattr(value, "__self__", None)
    source = owner.__name__ if isinstance(owner, types.ModuleType) else type(owner).__module__
    if source in _CHANCE and is_standard(owner if isinstance(owner, types.ModuleType) else value):
        raise NotCompilable(
            f"{where}: the same opening, slip and memory must give the same traction, without chance or the clock; "
            "strength that differs between contacts is an array, such as laws.WeibullField makes"
        )


class Hasher:
    """Feeds a hash with code and values; what compiled code may hold, and nothing else."""

    holds_functions = False  #: whether a tuple or list may hold them

    def __init__(self) -> None:
        self.hash = hashlib.sha256()
        self.seen: dict[int, tuple[int, Any]] = {}  #: number by id, and the function, which keeps the id its own

    def word(self, *words: Any) -> None:
        self.hash.update(repr(words).encode())

    def feed(self, thing: Any, where: str) -> None:
        thing = python_function(thing)
        if isinstance(thing, enum.Enum):
            self.word(type(thing).__qualname__, thing._name_)
            self.feed(thing._value_, where)
        elif thing is None or isinstance(thing, _NUMBERS):
            self.word(*_number(thing))
        elif isinstance(thing, np.generic) or type(thing) in (np.ndarray, np.memmap):
            array = np.ascontiguousarray(thing)
            if array.dtype.hasobject:
                raise NotCompilable(f"{where} is an array of objects")
            self.word(type(thing).__name__, array.dtype.descr, np.shape(thing))
            self.hash.update(array.tobytes())
        elif isinstance(thing, (tuple, list)):
            self.word(type(thing).__name__, getattr(thing, "_fields", ""), len(thing))
            for entry in map(python_function, thing):
                if isinstance(entry, types.FunctionType) and not self.holds_functions:
                    raise NotCompilable(f"{where}: give functions names of their own, not a {type(thing).__name__}")
                self.feed(entry, where)
        elif isinstance(thing, types.ModuleType):
            self.word("module", is_standard(thing), thing.__name__)
        elif isinstance(thing, nb.Type) and is_standard(type(thing)):
            self.word("type", type(thing).__name__, thing.name)
        elif definition(thing):
            self.function(definition(thing), where)
        elif callable(thing) and is_standard(thing):
            self.word("standard", *home(thing))
        elif isinstance(thing, types.FunctionType):
            self.function(thing, where)
        elif isinstance(thing, type):
            self.kind(thing, where)
        else:
            self.other(thing, where)

    def other(self, thing: Any, where: str) -> None:
        """What is neither code nor a constant."""
        reason = f": {_COMPILED_APART}" if callable(thing) else ""
        raise NotCompilable(
            f"{where}: compiled code may use functions, modules and constants as globals, "
            f"not {type(thing).__name__}{reason}"
        )

    def named(self, value: Any, where: str) -> None:
        """What code names."""
        _refuse_chance(value, where)
        self.feed(value, where)

    def kind(self, kind: Any, where: str) -> None:
        """A user's class: an enumeration or a named tuple."""
        if issubclass(kind, enum.Enum):
            self.word("enumeration", kind.__qualname__, len(kind.__members__))
            for name, member in kind.__members__.items():  # a second name of a member is no member
                self.word(name)
                self.feed(member, where)
        elif issubclass(kind, tuple) and hasattr(kind, "_fields"):
            self.word("named tuple", kind.__qualname__, kind._fields)
            for name, value in sorted(getattr(kind, "_field_defaults", {}).items()):
                self.word(name)
                self.feed(value, f"{where}.{name}")
        else:
            raise NotCompilable(
                f"{where}: compiled code may use enumerations and named tuples, not the class {kind.__name__}: "
                "what a class and those derived from it share is a plain function, or a method of another name"
            )

    def function(self, function: types.FunctionType, where: str) -> None:
        if id(function) in self.seen:  # functions that call each other would be fed for ever; they are refused later
            self.word("again", self.seen[id(function)][0])
            return
        self.seen[id(function)] = len(self.seen), function
        defaults, named = function.__defaults__ or (), function.__kwdefaults__ or {}
        self.word("function", signature(function.__code__), len(defaults), tuple(named))
        for value in (*defaults, *named.values()):
            self.feed(value, f"{where}: default")
        for name, value in references(function):
            self.word(name)
            self.named(value, f"{where}.{name}")


def _number(thing: Any) -> tuple[str, str]:
    """Type and value of a number or text, whatever a class derived from it prints."""
    kind: Any = next((kind for kind in _NUMBERS if isinstance(thing, kind)), type(None))
    return type(thing).__qualname__, kind.__repr__(thing)


def fingerprint(*functions: Any, extra: Any = ()) -> str:
    """Hex digest over byte code, constants, globals, helpers in any module, closures, and the compiler's versions.

    ``extra`` holds constants. Raises :class:`NotCompilable` for a global that is neither function, module nor
    constant.
    """
    hasher = Hasher()
    hasher.word(VERSIONS)
    hasher.feed(extra, "extra")
    for function in functions:
        hasher.feed(function, getattr(python_function(function), "__name__", "?"))
    return hasher.hash.hexdigest()
