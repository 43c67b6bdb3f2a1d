"""A hash of everything that is compiled into a function, so that a cached binary is never stale."""

from __future__ import annotations

import dis
import enum
import functools
import hashlib
import os
import sys
import types
from collections.abc import Iterator
from typing import Any

import numpy as np

_LIBRARY = os.path.dirname(os.__file__)


class NotCompilable(TypeError):
    """A function refers to something that cannot be compiled into a kernel."""


def plain(function: Any) -> Any:
    """The Python function behind a numba dispatcher, or the object itself."""
    return getattr(function, "py_func", function)


def is_standard(thing: Any) -> bool:
    """Whether a module or function belongs to Python, numpy or numba: what the versions in the key cover."""
    name = thing.__name__ if isinstance(thing, types.ModuleType) else getattr(thing, "__module__", None) or "math"
    top = name.split(".")[0]
    if top in ("numpy", "numba", "llvmlite"):
        return True
    file = getattr(sys.modules.get(top), "__file__", None) or _LIBRARY
    return top in sys.stdlib_module_names and file.startswith(_LIBRARY)  # not a user's file of that name


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


def references(function: types.FunctionType) -> Iterator[tuple[str, Any]]:
    """What a function's code can reach by name: globals, attributes of its helper modules, closure cells."""
    loaded, attributes = code_names(function.__code__)
    for name in sorted(loaded & set(function.__globals__)):
        yield from _reach(name, function.__globals__[name], attributes, ())
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        yield name, cell.cell_contents


def _reach(name: str, value: Any, attributes: set[str], above: tuple) -> Iterator[tuple[str, Any]]:
    yield name, value
    if isinstance(value, types.ModuleType) and not is_standard(value) and value not in above:
        for attribute in sorted(attributes):  # any attribute named anywhere in the function: a safe superset
            if hasattr(value, attribute):
                yield from _reach(f"{name}.{attribute}", getattr(value, attribute), attributes, (*above, value))


def _signature(code: types.CodeType) -> tuple:
    constants = tuple(
        _signature(c) if isinstance(c, types.CodeType) else (type(c).__name__, repr(c)) for c in code.co_consts
    )
    return (
        code.co_code, code.co_exceptiontable, constants, code.co_names, code.co_varnames, code.co_freevars,
        code.co_cellvars, code.co_argcount, code.co_kwonlyargcount, code.co_flags,
    )  # fmt: skip


class _Hasher:
    def __init__(self) -> None:
        self.hash = hashlib.sha256()
        self.seen: dict[int, int] = {}

    def word(self, *words: Any) -> None:
        self.hash.update(repr(words).encode())

    def feed(self, thing: Any, where: str) -> None:
        thing = plain(thing)
        if isinstance(thing, types.FunctionType) and not is_standard(thing):
            self.function(thing, where)
        elif isinstance(thing, types.ModuleType):
            self.word("module", thing.__name__)
        elif isinstance(thing, np.ndarray):
            self.word(thing.dtype.descr, thing.shape)
            self.hash.update(np.ascontiguousarray(thing).tobytes())
        elif isinstance(thing, (bool, int, float, complex, str, bytes, type(None), np.generic, enum.Enum)):
            self.word(type(thing).__name__, thing)
        elif isinstance(thing, (tuple, list)):
            self.word(type(thing).__name__, getattr(thing, "_fields", ""), len(thing))
            for entry in thing:
                self.feed(entry, where)
        elif isinstance(thing, type) and issubclass(thing, enum.Enum):
            self.word([(member.name, member.value) for member in thing])
        elif isinstance(thing, type) and (hasattr(thing, "_fields") or thing.__module__ == "builtins"):
            self.word(thing.__qualname__, getattr(thing, "_fields", ""))
        elif isinstance(getattr(thing, "_defn", None), types.FunctionType):  # what a numba intrinsic holds
            self.function(thing._defn, where)
        elif callable(thing) and is_standard(thing):
            self.word("builtin", getattr(thing, "__name__", repr(type(thing))))
        else:
            raise NotCompilable(
                f"{where}: compiled code may use functions, modules and constants as globals, "
                f"not {type(thing).__name__}"
            )

    def function(self, function: types.FunctionType, where: str) -> None:
        if id(function) in self.seen:
            self.word("again", self.seen[id(function)])
            return
        self.seen[id(function)] = len(self.seen)
        self.word(_signature(function.__code__), tuple(function.__kwdefaults__ or ()))
        for value in (*(function.__defaults__ or ()), *(function.__kwdefaults__ or {}).values()):
            self.feed(value, f"{where}: default")
        for name, value in references(function):
            self.word(name)
            self.feed(value, f"{where}.{name}")


def fingerprint(*functions: Any, extra: tuple = ()) -> str:
    """Hex digest over byte code, constants, globals, helpers in any module, closures, and the compiler's versions.

    ``extra`` must have a stable ``repr``. Raises :class:`NotCompilable` for a global that is neither function,
    module nor constant.
    """
    import llvmlite
    import numba

    hasher = _Hasher()
    hasher.word(sys.version_info[:3], numba.__version__, llvmlite.__version__, extra)
    for function in functions:
        hasher.feed(function, getattr(plain(function), "__name__", "?"))
    return hasher.hash.hexdigest()
