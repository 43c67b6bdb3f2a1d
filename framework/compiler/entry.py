"""Kernels that are called from Python, compiled once and kept on disk."""

from __future__ import annotations

import ctypes
import functools
import threading
from collections.abc import Callable
from typing import Any

from numba import types as nb

from grainlaw.compiler.cache import OPTIONS, keyed_njit, stored
from grainlaw.compiler.fingerprint import fingerprint
from grainlaw.compiler.numba_private import Table, address_of, compile_for


@functools.cache
def compiled(function: Any) -> Any:
    """The compiled form of a plain function, keyed by all that goes into it; see :func:`keyed_njit`."""
    return keyed_njit(function, _key(function))


class Kernel:
    """A plain function of tables and integers that makes no arrays, compiled when it is first needed.

    It is given tables by their addresses (:class:`~grainlaw.compiler.numba_private.Table`), which takes less time to
    compile and to call. Other threads run meanwhile. ``what`` it is in words, if it shall be said that it is compiled.
    Raises TypeError for tables of another form than those it was compiled for.
    """

    def __init__(self, function: Any, what: str = "") -> None:
        self._function, self._what = function, what
        self._lock = threading.Lock()
        self._code: Any = None  # which owns what is called
        self._address: int
        self._call: Callable[..., Any]

    def __call__(self, *arguments: Any) -> Any:
        """What the function returns, where that is an integer."""
        self.address(*arguments)
        return self._call(*(each.address if isinstance(each, Table) else each for each in arguments))

    def address(self, *arguments: Any) -> int:
        """Where it is, for arguments of these kinds; compiled code calls it by that."""
        form = [each.form if isinstance(each, Table) else int for each in arguments]
        with self._lock:
            if self._code is None:
                self._form = form
                key = _key(self._function, *map(named_form, form))
                kinds = tuple(each.kind if isinstance(each, Table) else nb.int64 for each in arguments)
                self._code = stored(key, kinds, self._what) or compile_for(
                    keyed_njit(self._function, key, by_address=True, counted=False), kinds
                )
                self._address = address_of(self._code)
                self._call = ctypes.CFUNCTYPE(*(ctypes.c_int64,) * (1 + len(arguments)))(self._address)
        if form != self._form:
            raise TypeError(f"{self._function.__name__} was compiled for tables of another form")
        self._form = form  # of the same objects the next time: far sooner compared
        return self._address


def _key(function: Any, *forms: Any) -> str:
    return fingerprint(function, extra=("entry", 4, repr(OPTIONS), forms))


def named_form(form: Any) -> Any:
    """The form of a table with the names of what it holds: code finds it by its place, of which types say nothing."""
    kind, *inner = form if isinstance(form, tuple) else (form,)
    return getattr(kind, "__name__", str(kind)), *getattr(kind, "_fields", ()), *map(named_form, inner)
