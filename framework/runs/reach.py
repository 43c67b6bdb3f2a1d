"""A hash of all that a function's answer depends on, where that can be known without calling it."""

from __future__ import annotations

import datetime
import decimal
import dis
import enum
import functools
import hashlib
import importlib
import importlib.metadata
import os
import sys
import types
from abc import ABC
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import attr
import attrs
import numpy as np

from grainlaw.compiler.fingerprint import NotCompilable, code_names, references, signature
from grainlaw.compiler.origin import VERSIONS, home, is_standard
from grainlaw.runs.sources import is_grainlaw, sources_hash

#: names by which code reaches files, the clock, the environment or the user: its answer may change without it
OUTSIDE = frozenset((
    "open", "input", "exists", "listdir", "scandir", "glob", "stat",
    "exec", "eval", "__import__", "environ", "getenv", "argv", "stdin", "now", "today", "time_ns",
    "perf_counter", "monotonic", "load", "loadtxt", "genfromtxt", "fromfile", "memmap", "imread", "read", "read_text",
    "read_bytes", "read_csv", "read_excel", "read_parquet", "import_module", "urandom", "uuid4", "token_bytes",
))  # fmt: skip
_NUMBERS = (bool, int, float, complex, str, bytes, decimal.Decimal, datetime.date)


class Unknown(Exception):
    """What a function's answer depends on cannot be told; the words say what."""


def fingerprint_of(function: Any) -> str:
    """Hex digest of a function's code, of all that it reaches, and of grainlaw; comments count for nothing.

    Raises :class:`Unknown` where the function reads files, the clock or the like, or holds what cannot be hashed.
    """
    return digest(function, VERSIONS, sources_hash())


def own_modules(*things: Any) -> set[str]:
    """Names of the modules of the user's own whose functions and classes things reach. Raises :class:`Unknown`."""
    hasher = _Hasher()
    for thing in things:
        hasher.feed(thing, "")
    loaded = hasher.own & set(sys.modules) - {"__main__"}  # others are code that was executed under an invented name
    return {name for name in loaded if not hasher.is_installed(name)}


def digest(*things: Any) -> str:
    """Hex digest of values, functions, classes and components. Raises :class:`Unknown`."""
    hasher = _Hasher()
    for thing in things:
        hasher.feed(thing, "")
    return hasher.hash.hexdigest()


@functools.cache
def _packages() -> Mapping[str, list[str]]:
    return importlib.metadata.packages_distributions()


def release(module: str) -> str | None:
    """Name and version of the installed package that a module belongs to; None for a file of the user's."""
    top = module.split(".")[0]
    found = sys.modules.get(top)
    file = str(getattr(found, "__file__", None) or "")
    if not {"site-packages", "dist-packages"} & set(Path(file).parts) or top not in _packages():
        return None
    return " ".join(f"{name} {importlib.metadata.version(name)}" for name in sorted(set(_packages()[top])))


def imported_within(code: types.CodeType) -> set[str]:
    """Modules that a code object, and the code nested in it, imports when it runs."""
    found = {each.argval for each in dis.get_instructions(code) if each.opname == "IMPORT_NAME"}
    return found.union(*(imported_within(c) for c in code.co_consts if isinstance(c, types.CodeType)))


class _Hasher:
    def __init__(self) -> None:
        self.hash = hashlib.sha256()
        self.own: set[str] = set()  #: modules of functions and classes that were fed by their code
        self.seen: dict[int, tuple[int, Any]] = {}  #: number by id, and the thing, which keeps the id its own

    def word(self, *words: Any) -> None:
        self.hash.update(repr(words).encode())

    def feed(self, thing: Any, where: str) -> None:
        if thing is None or thing is Ellipsis or thing is NotImplemented or type(thing) in _NUMBERS:
            self.word(type(thing).__name__, repr(thing))
        elif isinstance(thing, np.generic) or type(thing) is np.ndarray:
            self.array(np.asarray(thing), where)
        elif id(thing) in self.seen:
            self.word("again", self.seen[id(thing)][0])
        else:
            self.seen[id(thing)] = len(self.seen), thing
            self.other(thing, where)

    def array(self, array: np.ndarray, where: str) -> None:
        if array.dtype.hasobject:
            raise Unknown(f"{where} is an array of objects")
        self.word("array", array.dtype.str, array.shape)
        self.hash.update(np.ascontiguousarray(array).tobytes())

    def other(self, thing: Any, where: str) -> None:
        if isinstance(thing, enum.Enum):
            self.word("member", thing._name_)
            self.feed(type(thing), where)
        elif isinstance(thing, types.ModuleType):
            self.is_installed(thing.__name__, thing)  # of a user's module, what is used is fed by itself
        elif self.is_known(thing):
            pass
        elif isinstance(thing, types.FunctionType):
            self.function(thing, where)
        elif isinstance(thing, (types.MethodType, functools.partial, property, staticmethod, classmethod)):
            self.wrapper(thing, where)
        elif isinstance(thing, functools.cached_property):
            self.feed(thing.func, where)
        elif isinstance(thing, type):
            self.kind(thing, where)
        elif isinstance(thing, (tuple, list)):
            self.word(type(thing).__name__, len(thing))
            for k, entry in enumerate(thing):
                self.feed(entry, f"{where}[{k}]")
        elif isinstance(thing, (Mapping, set, frozenset)):
            self.collection(thing, where)
        elif isinstance(thing, range):
            self.word(repr(thing))
        elif attrs.has(type(thing)):
            self.feed(type(thing), where)
            for field in attrs.fields(type(thing)):
                self.word(field.name)
                self.feed(getattr(thing, field.name), f"{where}.{field.name}")
        elif _is_plain(type(thing)):
            self.feed(type(thing), where)
            for name, value in sorted(vars(thing).items()):
                self.word(name)
                self.feed(value, f"{where}.{name}")
        elif wrapped := getattr(thing, "__wrapped__", None) or getattr(thing, "py_func", None):
            self.feed(wrapped, where)
        else:
            raise Unknown(f"{where or 'it'} is a {type(thing).__name__}, whose content is not known")

    def is_known(self, thing: Any) -> bool:
        """Whether the versions of libraries, or the sources of grainlaw, say all about a function or a class."""
        if not isinstance(thing, type) and not callable(thing):
            return False
        module, name = home(thing)
        if isinstance(thing, types.FunctionType) and thing.__closure__:
            return False  # what it encloses is the user's
        if is_standard(thing):
            self.word("standard", module, name)
            return True
        code = getattr(thing, "__code__", None)
        file = code.co_filename if code else getattr(sys.modules.get(module), "__file__", None)
        if isinstance(thing, (type, types.FunctionType, types.BuiltinFunctionType)):
            if is_grainlaw(file):
                self.word("grainlaw", module, name)
                return True
            if (version := release(module)) is not None:
                self.word("library", module, name, version)
                return True
        return False

    def is_installed(self, name: str, module: types.ModuleType | None = None) -> bool:
        """Whether a module is Python's, grainlaw's or an installed package's, so that its version says all."""
        module = module or sys.modules.get(name) or importlib.import_module(name)
        version = release(name)
        self.word("module", name, version)
        return version is not None or is_standard(module) or is_grainlaw(getattr(module, "__file__", None))

    def function(self, function: types.FunctionType, where: str) -> None:
        inside = is_grainlaw(function.__code__.co_filename)
        name = function.__qualname__
        self.own.add(function.__module__)
        if not inside:
            loaded, attributes = code_names(function.__code__)
            if outside := sorted((loaded | attributes) & OUTSIDE):
                raise Unknown(f"{name} calls {outside[0]}")
            for module in imported_within(function.__code__):
                if not self.is_installed(module):
                    raise Unknown(f"{name} imports {module} when it is called")
        self.word("function", name if inside else signature(function.__code__))
        for value in (*(function.__defaults__ or ()), *(function.__kwdefaults__ or {}).values()):
            self.feed(value, f"{name}: default")
        try:
            for known, value in _closure(function) if inside else references(function):
                self.word(known)
                self.feed(value, f"{name}.{known}")
        except NotCompilable as error:
            raise Unknown(str(error)) from None

    def wrapper(self, thing: Any, where: str) -> None:
        self.word(type(thing).__name__)
        names = ("func", "args", "keywords", "__func__", "__self__", "fget", "fset")
        for name in names:
            if (held := getattr(thing, name, None)) is not None:
                self.feed(held, where)

    def kind(self, kind: type, where: str) -> None:
        """A class of the user's: its bases, its functions, its values, its fields."""
        self.word("class", kind.__qualname__)
        self.own.add(kind.__module__)
        for base in kind.__bases__:
            self.feed(base, where)
        for name, value in sorted(vars(kind).items()):
            inner = f"{kind.__qualname__}.{name}"
            if isinstance(value, types.FunctionType) and _made_by_attrs(value.__code__.co_filename):
                continue  # from the fields
            if name.startswith("__") and not isinstance(value, (types.FunctionType, classmethod, staticmethod)):
                continue
            if name.startswith("_abc_") or isinstance(value, (types.MemberDescriptorType, types.GetSetDescriptorType)):
                continue
            self.word(name)
            self.feed(value, inner)
        for field in attrs.fields(kind) if attrs.has(kind) else ():
            self.word("field", field.name, field.init)
            factory = isinstance(field.default, attrs.Factory)  # type: ignore[arg-type]
            default = field.default.factory if factory else field.default
            for value in (default, field.converter, field.validator):
                if value is not attrs.NOTHING:
                    self.feed(getattr(value, "converter", value), f"{kind.__qualname__}.{field.name}")

    def collection(self, thing: Any, where: str) -> None:
        """In an order of its own, for the order of a set differs from process to process."""
        named = thing.items() if isinstance(thing, Mapping) else ((entry, None) for entry in thing)
        parts = [(digest(key), key, value) for key, value in named]
        self.word(type(thing).__name__, len(parts))
        for part, key, value in sorted(parts, key=lambda each: each[0]):
            self.word(part)
            self.feed(value, f"{where}[{key!r}]")


def _is_plain(kind: type) -> bool:
    """Whether its objects hold nothing but their attributes: no base of it is a library's, and it has no slots."""
    bases = [base for base in kind.__mro__ if base not in (object, ABC)]
    return not any(is_standard(base) or _is_library(base) or vars(base).get("__slots__") for base in bases)


def _is_library(kind: type) -> bool:
    """Whether a class is of an installed package other than grainlaw."""
    file = getattr(sys.modules.get(kind.__module__), "__file__", None)
    return not is_grainlaw(file) and release(kind.__module__) is not None


def _made_by_attrs(file: str) -> bool:
    return file.startswith("<attrs") or os.path.dirname(file) == os.path.dirname(str(attr.__file__))


def _closure(function: types.FunctionType) -> Iterator[tuple[str, Any]]:
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        yield name, cell.cell_contents
