"""Compiled functions kept on disk under a fingerprint of all that went into them."""

from __future__ import annotations

import functools
import hashlib
import os
import pickle
import sys
import uuid
import warnings
from pathlib import Path
from typing import Any

import numba
from numba.core import caching
from numba.core.registry import cpu_target

OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": {"contract"}}  #: how every kernel is compiled


def cache_folder() -> Path:
    """Where compiled code is kept: ``GRAINLAW_CACHE``, or the user's cache folder."""
    if "GRAINLAW_CACHE" in os.environ:
        return Path(os.environ["GRAINLAW_CACHE"])
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "grainlaw"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "grainlaw"


class _Files:
    """One file per compiled function, its name the hash of the key and its content led by its own hash."""

    def _path(self, key: Any) -> Path:
        name = hashlib.sha256(repr(key).encode()).hexdigest()
        return cache_folder() / name[:2] / f"{name[2:40]}.bin"

    def load(self, key: Any) -> Any:
        content = self._path(key).read_bytes()
        if hashlib.sha256(content[32:]).digest() != content[:32]:
            raise OSError("damaged")
        return pickle.loads(content[32:])

    def save(self, key: Any, data: Any) -> None:
        path = self._path(key)
        path.parent.mkdir(parents=True, exist_ok=True)
        content = caching.dumps(data)
        beside = path.with_suffix(f".{uuid.uuid4().hex}")  # several processes may write the same
        try:
            beside.write_bytes(hashlib.sha256(content).digest() + content)
            os.replace(beside, path)
        finally:
            beside.unlink(missing_ok=True)


class _Locator(caching._CacheLocator):
    def get_cache_path(self) -> str:
        return str(cache_folder())

    def ensure_cache_path(self) -> None:
        pass

    def get_source_stamp(self) -> str:
        return ""

    def get_disambiguator(self) -> str:
        return ""

    @classmethod
    def from_function(cls, *_: Any) -> Any:
        return cls()


class _Implementation(caching.CompileResultCacheImpl):
    def __init__(self, key: str) -> None:
        self._lineno, self._locator, self._filename_base = 0, _Locator(), key


class KeyedCache(caching.FunctionCache):
    """numba's cache with a key of our own; a damaged or unwritable one compiles again, with one warning."""

    _impl_class = _Implementation

    def __init__(self, key: str) -> None:
        super().__init__(key)
        self._key, self._cache_file = key, _Files()

    def _index_key(self, signature: Any, codegen: Any) -> tuple:
        return str(signature), codegen.magic_tuple(), self._key

    def load_overload(self, signature: Any, context: Any) -> Any:
        try:
            return super().load_overload(signature, context)
        except Exception:  # missing or unreadable: compile again, the save below replaces it
            return None

    def save_overload(self, signature: Any, data: Any) -> None:
        try:
            super().save_overload(signature, data)
        except Exception as error:
            reason = getattr(error, "strerror", None) or error
            _warn(f"compiled code is not kept in {cache_folder()} ({reason}): set GRAINLAW_CACHE to a writable folder")


@functools.cache
def _warn(message: str) -> None:
    warnings.warn(message, stacklevel=2)


def stored(key: str, signature: tuple[Any, ...]) -> Any:
    """What was compiled before for a key and a signature, or None."""
    return KeyedCache(key).load_overload(signature, cpu_target.target_context)


def keyed_njit(function: Any, key: str) -> Any:
    """njit whose disk cache is keyed by ``key``."""
    dispatcher = numba.njit(**OPTIONS)(function)
    dispatcher._cache = KeyedCache(key)
    return dispatcher
