"""Functions of the engine for another machine: copies in which some names mean something else.

The step reaches its passes through globals. A copy of each function that it reaches has globals of its own, in which a
few names are replaced: a law that is called by its address, the place where threads meet. So no pass is written twice,
and none knows of it. ``compiler/compilation.py`` does the same for the methods of a law.
"""

from __future__ import annotations

import types
from collections.abc import Callable, Mapping
from typing import Any

from grainlaw.compiler.fingerprint import code_names
from grainlaw.compiler.numba_private import python_function

PACKAGE = "grainlaw."


class Retarget:
    """Makes copies of functions with ``replaced`` names; ``made`` turns each into what is called.

    What is replaced is found by module and name, or by module and "function.name" for one function alone. The copies
    call each other. What is not of this package stays as it is.
    """

    def __init__(self, made: Callable[[Any], Any], replaced: Mapping[tuple[str, str], Any]) -> None:
        self._made, self.replaced = made, dict(replaced)
        self.copies: dict[types.FunctionType, Any] = {}  #: by the function

    def copy(self, function: Any) -> Any:
        """The copy of a function, which is ``made`` once."""
        function = python_function(function)
        if function not in self.copies:
            self.copies[function] = self._made(self.plain(function))
        return self.copies[function]

    def plain(self, function: Any) -> types.FunctionType:
        """The copy of a function as a plain one; those that it reaches are ``made``."""
        function = python_function(function)
        names = set().union(*code_names(function.__code__))
        scope = dict(function.__globals__)
        for name in names & set(scope):
            scope[name] = self._other(function.__module__, name, scope[name], names, function.__name__)
        copy = types.FunctionType(
            function.__code__, scope, function.__name__, function.__defaults__, function.__closure__
        )
        copy.__qualname__ = function.__qualname__
        return copy

    def _other(self, module: str, name: str, value: Any, names: set[str], function: str = "") -> Any:
        for key in ((module, f"{function}.{name}"), (module, name)):
            if key in self.replaced:
                return self.replaced[key]
        value = python_function(value)
        if isinstance(value, types.FunctionType) and value.__module__.startswith(PACKAGE):
            return self.copy(value)
        if isinstance(value, types.ModuleType) and value.__name__.startswith(PACKAGE):
            room = types.ModuleType(value.__name__)  # `barrier.wait(...)`: a module of copies
            for inner in names & set(vars(value)):
                setattr(room, inner, self._other(value.__name__, inner, getattr(value, inner), names))
            return room
        return value
