"""Kernels that are called from Python, compiled once and kept on disk."""

from __future__ import annotations

import functools
from typing import Any

from grainlaw.compiler.cache import OPTIONS, keyed_njit
from grainlaw.compiler.fingerprint import fingerprint


@functools.cache
def compiled(function: Any, what: str = "") -> Any:
    """The compiled form of a plain function, keyed by all that goes into it; see :func:`keyed_njit`."""
    return keyed_njit(function, fingerprint(function, extra=("entry", 1, repr(OPTIONS))), what)
