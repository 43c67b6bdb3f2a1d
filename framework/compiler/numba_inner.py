"""Compiled in half the time: functions that compiled code alone calls have no machine code, and types are asked once.

It looks inside numba, as :mod:`~grainlaw.compiler.numba_private` does, and is tested in the same place.
"""

from __future__ import annotations

import contextlib
import ctypes
import gc
from collections.abc import Iterator
from typing import Any

import numba
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_lock import global_compiler_lock
from numba.core.targetconfig import ConfigStack
from numba.core.types.functions import BaseFunction

__all__ = ["inner_options", "sooner", "uncounted"]


def sooner(options: dict[str, Any]) -> dict[str, Any]:
    """Options like ``options``, by which the same code is compiled in three quarters of the time.

    At each addition numba asks some ten kinds of addition which of them two such numbers have; here it asks once for a
    function and all that it calls. Python's garbage collector, which would look again and again through what the
    compiler needs to the end, waits meanwhile.
    """
    return {**options, "pipeline_class": _Compiler}


_FUNCTIONS: Any = BaseFunction  #: whose method is another one while we compile


class _Compiler(Compiler):
    @global_compiler_lock  # of no other thread is what follows seen
    def compile_extra(self, function: Any) -> Any:
        with _types_kept():
            return super().compile_extra(function)


@contextlib.contextmanager
def _types_kept() -> Iterator[None]:
    """Keep which kind of a function answers arguments of some types, until the outermost compilation ends."""
    asked = _FUNCTIONS.get_call_type
    if hasattr(asked, "kept"):  # by the compilation of what calls this
        yield
        return

    def of_call(self: Any, context: Any, arguments: Any, named: Any) -> Any:
        how = ConfigStack.top_or_none()  # it is compiled, which a kind may look at; slow to compare
        if id(how) not in ways:
            ways[id(how)] = how, how and repr(sorted(how._values.items()))
        key = self, context, arguments, *named.items(), ways[id(how)][1]
        if key not in kept:
            signature = asked(self, context, arguments, named)
            kept[key] = signature, self._impl_keys[signature.args]
        signature, self._impl_keys[signature.args] = kept[key]
        return signature

    ways: dict[int, Any] = {}
    kept = of_call.kept = {}  # type: ignore[attr-defined]
    collecting = gc.isenabled()
    gc.disable()
    _FUNCTIONS.get_call_type = of_call
    try:
        yield
    finally:
        _FUNCTIONS.get_call_type = asked
        if collecting:
            gc.enable()


def inner_options(options: dict[str, Any]) -> dict[str, Any]:
    """Options like ``options`` for functions that other compiled code calls: they take half as long to compile.

    numba gives every function machine code and two wrappers of its own, by which Python and C call it, though code
    that calls it takes it in before. One of these that is called from Python all the same is compiled with ``options``.
    It also improves a function with all that it calls, again at each level; here that is done once, in the outermost.
    """

    class Inner(_InnerCompiler):
        plain = options

    return {**options, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": Inner}


def uncounted(options: dict[str, Any]) -> dict[str, Any]:
    """Options like ``options`` for functions that make no arrays: they do not count who refers to theirs.

    A function that is given a table of fifty arrays otherwise counts each of them up and down, one after the other so
    that no other thread interferes, which takes a microsecond for a call. One that makes an array does not compile.
    """
    return {**options, "_nrt": False}


_CALL = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.py_object, ctypes.c_void_p)  # as Python calls C


class _InnerCompiler(_Compiler):
    plain: dict[str, Any]

    def compile_extra(self, function: Any) -> Any:
        if self.state.library is None:
            self.state.library = _InnerLibrary(self.state.targetctx.codegen(), function.__qualname__)
            self.state.library.use(function, self.plain)
        return super().compile_extra(function)


class _InnerLibrary(JITCodeLibrary):
    """Code that is linked into that of its callers and optimized there, and for which no machine code is made."""

    def use(self, function: Any, options: dict[str, Any]) -> None:
        """What Python shall call in place of the code."""
        made: list[Any] = []

        def from_python(_self: Any, arguments: Any, _named: Any) -> Any:
            if not made:
                made.append(numba.njit(**options)(function))
            return made[0](*arguments)

        self._from_python = _CALL(from_python)  # which ctypes keeps only as long as we do

    def _optimize_final_module(self) -> None:
        """Nothing: in a time loop of nested passes this would be done five times for the innermost."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        self._ensure_finalized()
        return ctypes.cast(self._from_python, ctypes.c_void_p).value or 0

    @property
    def codegen(self) -> Any:
        """Where environments are set: by the cache, in the code of the caller."""
        return _NoEnvironments(self._codegen)


class _NoEnvironments:
    def __init__(self, codegen: Any) -> None:
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, name: str, environment: Any) -> None:
        """There is no machine code in which it could be set."""
