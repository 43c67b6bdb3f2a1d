"""Compiled functions kept on disk under a fingerprint of all that went into them."""

from __future__ import annotations

import os
import sys
import warnings
from pathlib import Path
from typing import Any

import numba
from numba.core import caching

OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}  #: how every kernel is compiled


def cache_folder() -> Path:
    """Where compiled code is kept: ``GRAINLAW_CACHE``, or the user's cache folder."""
    if "GRAINLAW_CACHE" in os.environ:
        return Path(os.environ["GRAINLAW_CACHE"])
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "grainlaw"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "grainlaw"


def keyed_njit(function: Any, key: str) -> Any:
    """njit whose disk cache is keyed by ``key``; a damaged or unwritable cache compiles again, with one warning."""
    folder = cache_folder() / key[:2]

    class Locator(caching._CacheLocator):
        def get_cache_path(self) -> str:
            return str(folder)

        def get_source_stamp(self) -> str:
            return key

        def get_disambiguator(self) -> str:
            return key[:24]

        @classmethod
        def from_function(cls, *_: Any) -> Any:
            return cls()

    class Implementation(caching.CompileResultCacheImpl):
        def __init__(self, function: Any) -> None:
            self._lineno = 0
            self._locator = Locator()
            self._filename_base = f"{function.__name__}-{key[:24]}"

    class KeyedCache(caching.FunctionCache):
        _impl_class = Implementation

        def _index_key(self, signature: Any, codegen: Any) -> tuple:
            return signature, codegen.magic_tuple(), key

        def load_overload(self, signature: Any, context: Any) -> Any:
            try:
                return super().load_overload(signature, context)
            except Exception:  # unreadable: compile again, the save below replaces it
                return None

        def save_overload(self, signature: Any, data: Any) -> None:
            try:
                super().save_overload(signature, data)
            except Exception:
                try:
                    self.flush()  # an unreadable index
                    super().save_overload(signature, data)
                except Exception as error:
                    warnings.warn(
                        f"compiled code is not kept ({error}): set GRAINLAW_CACHE to a writable folder", stacklevel=2
                    )

    dispatcher = numba.njit(**OPTIONS)(function)
    dispatcher._cache = KeyedCache(function)
    return dispatcher
