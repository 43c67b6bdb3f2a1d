"""Compiled functions kept on disk under a fingerprint of all that went into them.

numba's own cache knows a function by its file and line. It refuses a law from standard input ("no locator available for
file '<stdin>'"), and does not see that a helper in another file was edited.
"""

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

from grainlaw.compiler.numba_private import DiskCache, serialized, use_cache

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
        content = serialized(data)
        beside = path.with_suffix(f".{uuid.uuid4().hex}")  # several processes may write the same
        try:
            beside.write_bytes(hashlib.sha256(content).digest() + content)
            os.replace(beside, path)
        finally:
            beside.unlink(missing_ok=True)


def _cache(key: str) -> DiskCache:
    return DiskCache(key, _Files(), str(cache_folder()), _unsaved)


def _unsaved(error: Exception) -> None:
    reason = getattr(error, "strerror", None) or error
    _warn(f"compiled code is not kept in {cache_folder()} ({reason}): set GRAINLAW_CACHE to a writable folder")


@functools.cache
def _warn(message: str) -> None:
    warnings.warn(message, stacklevel=2)


def stored(key: str, signature: tuple[Any, ...]) -> Any:
    """What was compiled before for a key and a signature, or None."""
    return _cache(key).load(signature)


def keyed_njit(function: Any, key: str) -> Any:
    """njit whose disk cache is keyed by ``key``."""
    return use_cache(numba.njit(**OPTIONS)(function), _cache(key))
