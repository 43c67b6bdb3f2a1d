"""Whether something is Python's, numpy's or numba's own, so that their versions say all about it."""

from __future__ import annotations

import functools
import importlib.machinery
import os
import sys
import sysconfig
import types
from typing import Any

import numpy as np

from grainlaw.compiler import numba_private

VERSIONS = (sys.version_info[:3], np.__version__, *numba_private.VERSIONS)
_PACKAGES = [os.path.dirname(os.path.realpath(str(np.__file__))), *numba_private.FOLDERS]
_PYTHON = {
    os.path.realpath(folder)
    for folder in (
        os.path.dirname(os.__file__), sysconfig.get_path("stdlib"), sysconfig.get_path("platstdlib"),
        os.path.join(sys.base_exec_prefix, "DLLs"),
    )
}  # fmt: skip
_INSTALLED = {"site-packages", "dist-packages"}  #: inside Python's own folder, and not Python's own


@functools.cache
def in_library(file: str) -> bool:
    """Whether a file is one of Python's, numpy's, numba's or llvmlite's."""
    if not os.path.isabs(file):
        return False
    path = os.path.realpath(file)
    if any(path.startswith(folder + os.sep) for folder in _PACKAGES):
        return True
    inside = [path[len(folder) :] for folder in _PYTHON if path.startswith(folder + os.sep)]
    return any(_INSTALLED.isdisjoint(rest.split(os.sep)) for rest in inside)


def is_standard(thing: Any) -> bool:
    """Whether a module, function or class is Python's, numpy's or numba's own.

    Judged by where it lives: a module by its file, all else by being what such a module holds under its name, and a
    function by the file of its code too. Names prove nothing: a user's file may be called ``random.py``.
    """
    if isinstance(thing, types.ModuleType):
        return _is_standard_module(thing)
    module, name = home(thing)
    holder = sys.modules.get(module)
    if holder is None or not name or not _is_standard_module(holder):
        return False
    found: Any = holder
    for part in name.split("."):
        found = getattr(found, part, None)
    return found is thing and (not isinstance(thing, types.FunctionType) or _is_standard_code(thing.__code__))


def home(thing: Any) -> tuple[str, str]:
    """Module and qualified name that a function or class says it has."""
    module = getattr(thing, "__module__", None)
    name = getattr(thing, "__qualname__", None) or getattr(thing, "__name__", None)
    return (
        module if isinstance(module, str) else "numpy",  # its universal functions did not say before version 2
        name if isinstance(name, str) else "",
    )


def _is_standard_module(module: types.ModuleType) -> bool:
    spec = getattr(module, "__spec__", None)
    if spec is None or sys.modules.get(spec.name) is not module:
        return False
    if spec.loader is importlib.machinery.BuiltinImporter:
        return spec.name in sys.builtin_module_names
    if spec.loader is importlib.machinery.FrozenImporter:
        return spec.name.split(".")[0] in sys.stdlib_module_names
    return in_library(spec.origin or "")


def _is_standard_code(code: types.CodeType) -> bool:
    return code.co_filename.startswith("<frozen ") or in_library(code.co_filename)
