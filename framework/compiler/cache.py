"""Compiled functions kept on disk under a fingerprint of all that went into them.

numba's own cache knows a function by its file and line. It refuses a law from standard input ("no locator available for
file '<stdin>'"), and does not see that a helper in another file was edited. And it holds pickles, which can be made to
call anything when they are read.
"""

from __future__ import annotations

import functools
import hashlib
import logging
import os
import warnings
from typing import Any

import numba

from grainlaw.compiler.cache_folder import Folder, NotPrivateError, cache_folder, limit
from grainlaw.compiler.numba_inner import inner_options, sooner, uncounted
from grainlaw.compiler.numba_private import DiskCache, NotKeptError, use_cache
from grainlaw.fields import ParameterError

PORTABLE = os.environ.get("GRAINLAW_PORTABLE", "0") not in ("", "0")
#: Multiplication and addition in one rounding, where the processor can: others round twice, and curves part.
FUSED = set() if PORTABLE else {"contract"}
_begun: list[str] = []  #: keys of what was compiled, or found on disk
_ENTRY: dict[str, Any] = {"nogil": True, "error_model": "numpy", "fastmath": FUSED}
OPTIONS = inner_options(_ENTRY)  #: how every kernel is compiled; those that Python calls go through :func:`keyed_njit`
_BY_PYTHON = sooner({**_ENTRY, "no_cfunc_wrapper": True})
_BY_ADDRESS = sooner({**_ENTRY, "no_cpython_wrapper": True})
PASS = uncounted(OPTIONS)  #: the same for passes over tables of many arrays; they make no arrays


def compile_portably() -> None:
    """Compile so that every processor gives the same bits. Raises ParameterError if something else was compiled."""
    if FUSED and _begun:
        raise ParameterError("something was compiled that is not portable: set GRAINLAW_PORTABLE=1 before the start")
    FUSED.clear()  # numba reads it when it compiles


def is_portable() -> bool:
    """Whether code is compiled so that every processor gives the same bits."""
    return not FUSED


@functools.cache
def tell_compiling(what: str) -> None:
    """Say once that something is compiled, as a message of the logger "grainlaw": on the error stream if not told."""
    logging.getLogger("grainlaw").warning("compiling %s", what)


class _Files:
    """The files of the cache, which say what is wrong with them once, as a warning."""

    def __init__(self, what: str = "") -> None:
        self.what = what  #: in words, to say that it is compiled

    def load(self, key: tuple[Any, ...]) -> tuple[dict[str, Any], bytes] | None:
        found = None
        try:
            found = Folder(cache_folder()).read(_name(key))
        except NotPrivateError as error:
            _warn_not_private(error)
        if found is None and self.what:
            tell_compiling(self.what)
        return found

    def save(self, key: tuple[Any, ...], header: dict[str, Any], code: bytes) -> None:
        try:
            Folder(cache_folder()).write(_name(key), header, code)
        except NotPrivateError as error:
            _warn_not_private(error)
        except OSError as error:
            reason = error.strerror or error
            _warn(f"compiled code is not kept in {cache_folder()} ({reason}): set GRAINLAW_CACHE to a writable folder")


def _name(key: tuple[Any, ...]) -> str:
    return hashlib.sha256(repr(key).encode()).hexdigest()[:40]


def _cache(key: str, what: str = "") -> DiskCache:
    limit()  # a wrong one is refused before anything is compiled
    _begun.append(key)
    return DiskCache(key, _Files(what), _unkept)


def _unkept(name: str, error: NotKeptError) -> None:
    _warn(f"the compiled code of {name} is not kept, and will be compiled again: {error}")


def _warn_not_private(error: NotPrivateError) -> None:
    _warn(f"compiled code is neither read nor kept, for it would be executed: {error}; or set GRAINLAW_CACHE")


@functools.cache
def _warn(message: str) -> None:
    warnings.warn(message, stacklevel=2)


def stored(key: str, signature: tuple[Any, ...], what: str = "") -> Any:
    """What was compiled before for a key and a signature, or None; ``what`` it is, if that shall be said then."""
    return _cache(key, what).load(signature)


def code_kept(key: tuple[str, ...], what: str = "") -> tuple[dict[str, Any], bytes] | None:
    """Machine code that :func:`keep_code` has kept under a key, with its header, or None; ``what`` it is, if told."""
    return _Files(what).load(key)


def keep_code(key: tuple[str, ...], header: dict[str, Any], code: bytes) -> None:
    """Keep machine code of another machine on disk, and a header that fits JSON."""
    _Files().save(key, header, code)


def keyed_njit(function: Any, key: str, *, by_address: bool = False, counted: bool = True) -> Any:
    """njit whose disk cache is keyed by ``key``; what is called ``by_address`` cannot be called from Python.

    One that makes no arrays need not count them; see :func:`~grainlaw.compiler.numba_inner.uncounted`. Raises
    ParameterError where numba is told not to compile.
    """
    if numba.config.DISABLE_JIT:
        raise ParameterError(
            "NUMBA_DISABLE_JIT = 1 is not allowed, a run is compiled: to look into a law while it answers, call "
            "gl.trace or its traction, which are interpreted"
        )
    options = _BY_ADDRESS if by_address else _BY_PYTHON
    return use_cache(numba.njit(**(options if counted else uncounted(options)))(function), _cache(key))
