"""Plain functions to compiled ones: the scalar methods of a component and all they reach, jitted as copies.

Inside compiled code a component is a named tuple; its methods are overloads chosen by the tuple's class.

Copies, because numba calls no plain Python function: ``traction`` that uses a helper of its module fails with "Cannot
determine Numba type of <class 'function'>", and ``helpers.chi(x)`` with "Unknown attribute 'chi' of type Module". The
user's own functions stay as they are, so that a debugger can stop in them.

Names are changed in the byte code and not in the source, because a law from standard input has no source: there
``inspect.getsource`` fails with "could not get source code".
"""

from __future__ import annotations

import collections
import dis
import itertools
import linecache
import os
import re
import textwrap
import types
from typing import Any

import attrs
from numba import njit, typeof

from grainlaw.compiler.cache import OPTIONS
from grainlaw.compiler.fingerprint import NotCompilable, code_names, global_names
from grainlaw.compiler.numba_private import (
    NumbaError,
    compile_for,
    is_number,
    is_tuple_of_numbers,
    named_tuple_method,
    python_function,
    return_type,
)
from grainlaw.compiler.origin import is_standard
from grainlaw.compiler.structure import Structure
from grainlaw.declared import file_of_function

#: Ending of method names in compiled code. An overload of ``friction`` is one for all named tuples: without the mark,
#: after a law with a method ``friction`` no law with a number ``friction`` could be compiled in the same process.
MARK = "__method"


class CompilationError(TypeError):
    """A component cannot be compiled; the message names it, the place and the reason."""


def refusal(component: Any, method: str, problem: str) -> CompilationError:
    """The error that says why ``component.method`` cannot be compiled."""
    kind = type(component)
    function = python_function(getattr(kind, method))
    written = isinstance(function, types.FunctionType)
    place = f" ({file_of_function(function)}:{function.__code__.co_firstlineno})" if written else ""
    return CompilationError(
        f"{kind.__name__}.{method}{place} cannot be compiled:\n"
        + textwrap.indent(problem, "    ")
        + "\nIt may use its arguments, the numbers, flags and parts of self, math.*, and other plain functions."
    )


@attrs.define(eq=False)
class Compilation:
    """The compiled methods of one structure. Names end in the start of its ``key``, so that no two share a symbol."""

    structure: Structure
    key: str
    copies: dict[int, Any] = attrs.field(factory=dict)  #: by the id of the plain function; None while in the making
    classes: dict[int, Any] = attrs.field(factory=dict)  #: named tuples, by the id of the part

    def __attrs_post_init__(self) -> None:
        for number, part in enumerate(self.structure):
            name = f"{type(part.component).__name__}_{number}_{self.key[:16]}"
            kind = self.classes[id(part)] = collections.namedtuple(name, part.fields)
            _methods[kind] = {method: self.copy(function) for method, function in part.methods.items()}
            for method in part.methods:
                _make_overload(method)

    @property
    def names(self) -> set[str]:
        """Of all methods."""
        return {name for part in self.structure for name in part.methods}

    def _mark(self, name: str) -> str:
        return name + MARK if name in self.names else name

    def copy(self, function: Any) -> Any:
        """A jitted copy of a function in which every plain function it reaches is jitted, and methods are marked."""
        function = python_function(function)
        if id(function) not in self.copies:
            self.copies[id(function)] = None
            self.copies[id(function)] = njit(forceinline=True, **OPTIONS)(self._marked(function))
        elif self.copies[id(function)] is None:
            raise NotCompilable(f"{function.__name__} calls itself: recursion is not supported")
        return self.copies[id(function)]

    def _marked(self, function: types.FunctionType) -> types.FunctionType:
        scope = dict(function.__globals__, __name__=__name__)  # numba imports this module when it loads from disk
        attributes = code_names(function.__code__)[1]
        for name, value in global_names(function).items():
            scope[self._mark(name)] = self._convert(value, attributes)
        cells = [types.CellType(self._convert(c.cell_contents, attributes)) for c in function.__closure__ or ()]
        code = function.__code__.replace(
            co_names=tuple(self._mark(name) for name in function.__code__.co_names),
            co_name=f"{function.__name__}_{self.key[:16]}",
        )
        defaults = tuple(self._convert(value, attributes) for value in function.__defaults__ or ())
        copy = types.FunctionType(code, scope, code.co_name, defaults, tuple(cells) or None)
        copy.__kwdefaults__ = {k: self._convert(v, attributes) for k, v in (function.__kwdefaults__ or {}).items()}
        copy.__qualname__, copy.__module__ = code.co_name, __name__
        return copy

    def _convert(self, value: Any, attributes: set[str]) -> Any:
        value = python_function(value)
        if isinstance(value, types.FunctionType) and not is_standard(value):
            return self.copy(value)
        if isinstance(value, types.ModuleType) and (not is_standard(value) or attributes & self.names):
            module = types.ModuleType(value.__name__)  # `helpers.chi(...)`: a module of jitted functions
            for attribute in attributes:
                if hasattr(value, attribute) and getattr(value, attribute) is not value:
                    setattr(module, self._mark(attribute), self._convert(getattr(value, attribute), attributes))
            return module
        return value

    def tuple_of(self, part: Structure) -> Any:
        """An example of the tuple that represents a part, for the types of its entries."""
        values = (*(0.0,) * len((*part.numbers, *part.rows)), *part.constants.values())
        return self.classes[id(part)](*(*values, *map(self.tuple_of, part.parts.values())) or (0.0,))

    def problem(self, method: str, inputs: tuple[Any, ...], results: int) -> str | None:
        """Why a method cannot be compiled, in a few lines; by itself, so that they are about it and not its loop."""
        for copy in self.copies.values():
            function = python_function(copy)
            name = function.__name__.removesuffix(f"_{self.key[:16]}")
            if any(instruction.opname == "RAISE_VARARGS" for instruction in dis.get_instructions(function)):
                return (
                    f"{name} raises: compiled code cannot stop in the middle of a batch, "
                    "the other contacts would silently keep their old forces; return nan instead"
                )
        respond = self.copy(self.structure.methods[method])
        try:
            code = compile_for(respond, (typeof(self.tuple_of(self.structure)), *inputs))
        except NumbaError as error:
            return self._reason(error, results)
        except Exception as error:
            return f"{type(error).__name__}: {error}"
        given = return_type(code)
        if not (is_number(given) if results == 1 else is_tuple_of_numbers(given, results)):
            numbers = "a number" if results == 1 else f"{results} numbers"
            return f"it must return {numbers} on every path; the compiler sees {given}"
        return None

    def _reason(self, error: Exception, results: int) -> str:
        """What of a numba error speaks of the user's code: the reason, and the line where it is."""
        text = re.sub(rf"\x1b\[[0-9;]*m|{MARK}|(_\d+)?_{self.key[:16]}", "", str(error))
        text = text.split("raised a specific error:")[-1]  # inside a method that is called: the innermost
        noise = ("TypingError", "Failed in nopython", "During:", "- Resolution failure")
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        told = itertools.dropwhile(lambda line: line.startswith(noise), lines)
        ends = ("File ", "There are ", "During:")
        reason = list(itertools.takewhile(lambda line: not line.startswith(ends), told))[:4]
        if reason and reason[0].startswith("Can't unify return type"):
            reason = [f"it must return {results} numbers on every path; {reason[0].split('following ')[-1]}"]
        if found := re.search(r"BoundFunction.*'(\w+)'", text):
            # The name occurs once in the byte code, for the number and for the method, and is marked as the method's.
            owners = [part.component for part in self.structure if found[1] in part.fields]
            if owners and found[1] in self.names:
                kind = type(owners[0]).__name__
                reason = [f"{found[1]} is a field of {kind} and the name of a method: give one of them another name"]
        if found := re.search(r"Unknown attribute '(\w+)'", text):
            owners = [part.component for part in self.structure if hasattr(part.component, found[1])]
            reason += [f"self.{found[1]} is a {type(getattr(owner, found[1])).__name__}" for owner in owners]
        if place := re.search(r'File "([^"]+)", line (\d+)', text):
            file, line = place[1], int(place[2])
            reason.append(f"{file}:{line}: {linecache.getline(os.path.abspath(file), line).strip()}")
        return "\n".join(reason)


_methods: dict[Any, dict[str, Any]] = {}  #: of each tuple class, its compiled methods
_overloaded: set[str] = set()


def methods_of(kind: Any) -> dict[str, Any]:
    """The compiled methods of a tuple class, by name; none of a class that is no component's."""
    return _methods.get(kind, {})


def overloaded() -> set[str]:
    """Names of the methods that compiled code may call on tuples."""
    return set(_overloaded)


def _make_overload(name: str) -> None:
    """Let compiled code call method ``name`` on the tuple of any component that has it."""
    if name not in _overloaded:
        _overloaded.add(name)
        named_tuple_method(name + MARK, lambda kind: methods_of(kind).get(name))
