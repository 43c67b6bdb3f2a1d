"""What a case or a run is known by: versions, the code of the user's own that it reaches, and values.

The code is walked as for compiled laws, so that comments and what is not used do not count. Grainlaw and installed
packages count by their versions, and a module from which code takes something by a text (``getattr``) by all that its
file says. Files, the clock and chance that code reads are not seen, nor modules that it imports when it is called: give
as levels what files say.
"""

from __future__ import annotations

import datetime
import decimal
import functools
import hashlib
import importlib.metadata
import importlib.util
import os
import sys
import types
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import attrs

import grainlaw
from grainlaw.compiler.fingerprint import Hasher, NotCompilable, global_names, references
from grainlaw.compiler.origin import VERSIONS, in_library
from grainlaw.declared import file_of, file_of_function
from grainlaw.fields import ParameterError

COMPONENTS = ("laws", "geometry", "protocols")
SHOWN_ONLY = ("workbench/", "results/figures/", "studies/")  #: rooms of the package that decide no result

_VALUES = (decimal.Decimal, datetime.date, range, type(...), type(NotImplemented))
_WRAPPERS = (types.MethodType, functools.partial, property, staticmethod, classmethod, functools.cached_property)
_HELD = ("func", "args", "keywords", "__func__", "__self__", "fget", "fset", "__wrapped__", "py_func")


#: methods of an attrs class that follow from its fields
MADE_BY_ATTRS = frozenset((
    "__init__", "__attrs_init__", "__repr__", "_repr_html_", "__eq__", "__ne__", "__lt__", "__le__", "__gt__", "__ge__",
    "__hash__", "__getstate__", "__setstate__", "__setattr__", "__delattr__", "__replace__", "__reduce__",
))  # fmt: skip


@functools.cache
def sources_hash(*without: str) -> str:
    """Hash of the sources that decide results; ``without`` names further rooms that do not.

    Files count by their place in the package, which is the same wherever it is installed.
    """
    hasher, folders = hashlib.sha256(), _folders().items()
    found = {place + file.relative_to(top).as_posix(): file for place, top in folders for file in top.rglob("*.py")}
    for name, file in sorted(found.items()):
        if not name.startswith((*SHOWN_ONLY, *without)):
            hasher.update(f"{name} ".encode())
            hasher.update(_content(file))
    return hasher.hexdigest()


def _content(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except FileNotFoundError:  # an editable installation has links to the checkout
        raise ParameterError(f"grainlaw is installed from files of which {file} is gone: install it again") from None


@functools.cache
def _folders() -> dict[str, Path]:
    """Of each part of the package, whether it is loaded or not: the hash is the same in every process."""
    found = {"": Path(str(grainlaw.__file__)).parent}
    for name in COMPONENTS:
        spec = importlib.util.find_spec(f"grainlaw.{name}")
        if spec and spec.origin:
            found[f"{name}/"] = Path(spec.origin).parent
    return found


@functools.cache
def _below() -> tuple[str, ...]:
    folders = {str(folder.absolute()) for folder in _folders().values()}
    return tuple(folder + os.sep for folder in sorted(folders | {os.path.realpath(folder) for folder in folders}))


class Unknown(Exception):
    """A value whose content cannot be told; the words say which."""


def digest(*things: Any) -> str:
    """Hex digest of values, components, functions and classes. Raises :class:`Unknown`."""
    return _walked(things).hash.hexdigest()


def fingerprint_of(function: Any) -> str:
    """Hex digest of a function, of versions and of grainlaw's sources. Raises :class:`Unknown`."""
    return digest(function, VERSIONS, sources_hash())


def own_modules(*things: Any) -> set[str]:
    """Names of the loaded modules of the user's own whose functions and classes things reach. Raises Unknown."""
    return _walked(things).own & set(sys.modules) - {"__main__"}  # others are code executed under an invented name


def is_own(file: str) -> bool:
    """Whether code of a file is the user's: not Python's, not grainlaw's, and of no installed package."""
    if not file or file.startswith(("<frozen", "<attrs", *_below())) or in_library(file):
        return False
    if os.path.realpath(file).startswith(_below()):
        return False
    return {"site-packages", "dist-packages"}.isdisjoint(Path(file).parts)


def _home(kind: type) -> tuple[str, str]:
    """Where a class is from: one of the user's own is the same in a script, imported from it, and in a renamed file."""
    return "" if is_own(file_of(kind)) else kind.__module__, kind.__qualname__


@functools.cache
def _packages() -> Mapping[str, list[str]]:
    return importlib.metadata.packages_distributions()


@functools.cache
def _release(module: str) -> str:
    """Names and versions of the installed packages that a module belongs to."""
    found = sorted(set(_packages().get(module.split(".")[0], ())))
    return " ".join(f"{name} {importlib.metadata.version(name)}" for name in found)


def _walked(things: tuple[Any, ...]) -> _Walk:
    walk = _Walk()
    try:
        for thing in things:
            walk.feed(thing, "")
    except NotCompilable as error:  # a variable of an enclosing function that has no value yet, or globals()
        raise Unknown(str(error)) from None
    return walk


class _Walk(Hasher):
    """Feeds what compiled code may not hold, too: classes, components, mappings, what wraps a function."""

    holds_functions = True

    def __init__(self) -> None:
        super().__init__()
        self.own: set[str] = set()  #: names of modules of the user's own
        self.known: dict[int, tuple[int, Any]] = {}  #: number by id, and the thing, which keeps the id its own

    def other(self, thing: Any, where: str) -> None:
        if isinstance(thing, _VALUES):
            self.word(type(thing).__name__, repr(thing))
            return
        if id(thing) in self.known:
            self.word("again", self.known[id(thing)][0])
            return
        self.known[id(thing)] = len(self.known), thing
        self.word(*_home(type(thing)))
        names = list(self.parts(thing, where))
        self.word(len(names))
        for name, value in names:
            self.word(name)
            self.feed(value, f"{where}{name}")

    def parts(self, thing: Any, where: str) -> Iterator[tuple[str, Any]]:
        """What a thing holds, by name, in an order of its own: that of a set differs from process to process."""
        if isinstance(thing, Mapping):
            keyed = {f"[{digest(key)}]": value for key, value in thing.items()}
            yield from ((key, keyed[key]) for key in sorted(keyed))
        elif isinstance(thing, (set, frozenset)):
            yield from ((entry, None) for entry in sorted(map(digest, thing)))
        elif isinstance(thing, _WRAPPERS) or hasattr(thing, "__wrapped__") or hasattr(thing, "py_func"):
            yield from ((f".{name}", getattr(thing, name)) for name in _HELD if hasattr(thing, name))
        elif attrs.has(type(thing)) or is_own(file_of(type(thing))):
            yield "", type(thing)
            fields = attrs.fields(type(thing)) if attrs.has(type(thing)) else ()
            names = [field.name for field in fields] or sorted(getattr(thing, "__dict__", {}))
            yield from ((f".{name}", getattr(thing, name)) for name in names)
        else:
            raise Unknown(f"{where or 'it'} is a {type(thing).__name__}, whose content is not known")

    def named(self, value: Any, where: str) -> None:
        """What code names counts by its content, and by its class where that cannot be told."""
        try:
            self.feed(value, where)
        except Unknown:
            self.word("an object", type(value).__qualname__)

    def function(self, function: types.FunctionType, where: str) -> None:
        if is_own(file_of_function(function)):
            self.own.add(function.__module__)
            super().function(function, where)
            self._found_by_text(function)
            return
        self.word("of a library", function.__module__, function.__qualname__, _release(function.__module__))
        for cell in function.__closure__ or ():  # what it encloses may be the user's
            self.named(cell.cell_contents, where)

    def _found_by_text(self, function: types.FunctionType) -> None:
        """All that modules of the user's own hold, by their files, where code may take from them by a text."""
        called = global_names(function)
        if called.get("globals") is globals:
            raise NotCompilable(f"{function.__qualname__} calls globals(): keep in a dict what it shall find by a text")
        if called.get("getattr") is getattr or called.get("vars") is vars:
            for name, module in references(function):
                file = getattr(module, "__file__", None) if isinstance(module, types.ModuleType) else None
                if file and is_own(file):
                    self.own.add(module.__name__)
                    self.word(name, _content(Path(file)))

    def kind(self, kind: type, where: str) -> None:
        """A class; one of the user's with its bases and all that it defines."""
        self.word("class", *_home(kind))
        if not is_own(file_of(kind)):
            self.word(_release(kind.__module__))
            return
        if id(kind) in self.known:
            return
        self.known[id(kind)] = len(self.known), kind
        self.own.add(kind.__module__)
        for base in kind.__bases__:
            self.feed(base, where)
        for name, value in sorted(vars(kind).items()):
            # Known by their names: a class that comes from another process has no slots, and no file says that attrs
            # made its methods.
            made = (attrs.has(kind) and name in MADE_BY_ATTRS) or isinstance(value, types.MemberDescriptorType)
            if not made and (isinstance(value, types.FunctionType) or not name.startswith(("__", "_abc_"))):
                self.word(name)
                self.named(value, f"{kind.__qualname__}.{name}")
        for field in attrs.fields(kind) if attrs.has(kind) else ():
            for value in (field.default, field.converter, field.validator):
                self.named(value, f"{kind.__qualname__}.{field.name}")
