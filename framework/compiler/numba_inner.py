"""Functions that other compiled code alone calls: without machine code of their own.

It looks inside numba, as :mod:`~grainlaw.compiler.numba_private` does, and is tested in the same place.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numba
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler

__all__ = ["inner_options", "uncounted"]


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


class _InnerCompiler(Compiler):
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
