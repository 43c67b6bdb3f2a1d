"""A law named on the command line: FILE.py:LAW."""

from __future__ import annotations

import difflib
import importlib.util
import sys
import traceback
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType
from typing import Any

import attrs

from grainlaw.contact import ContactLaw
from grainlaw.parameter import ParameterError


class LawReferenceError(ValueError):
    """A reference that leads to no law; the message says what to write instead."""


def find_law(reference: str) -> ContactLaw:
    """The law of ``FILE.py:LAW``, an instance in the file or a class that needs no parameters.

    The file is run, as a module with its folder in the search path. Raises :class:`LawReferenceError`.
    """
    file, _, name = reference.rpartition(":") if ".py:" in reference else (reference, "", "")
    module = _run(Path(file))
    laws = {key: value for key, value in vars(module).items() if not key.startswith("_") and _is_law(value)}
    known = f"laws in {file}: {', '.join(laws) or 'none'}"
    if not name:
        raise LawReferenceError(f"name the law, as in {file}:{next(iter(laws), 'MyLaw')} ({known})")
    if not hasattr(module, name):
        raise LawReferenceError(f"there is no '{name}' in {file}{nearest(name, laws, 0.3)} ({known})")
    found = getattr(module, name)
    if not _is_law(found):
        raise LawReferenceError(f"'{name}' in {file} is no contact law but {_described(found)} ({known})")
    return _made(found, file) if isinstance(found, type) else found


def nearest(name: str, known: Iterable[str], likeness: float = 0.5) -> str:
    """A question that suggests the nearest known name, or nothing where none is as like (0 to 1)."""
    near = difflib.get_close_matches(name, list(known), n=1, cutoff=likeness)
    return f"; did you mean '{near[0]}'?" if near else ""


def _is_law(value: Any) -> bool:
    return value is not ContactLaw and (
        issubclass(value, ContactLaw) if isinstance(value, type) else isinstance(value, ContactLaw)
    )


def _described(value: Any) -> str:
    return f"the class {value.__name__}" if isinstance(value, type) else f"a value of type {type(value).__name__}"


def _made(kind: type[Any], file: str) -> ContactLaw:
    """An instance by defaults."""
    if not attrs.has(kind):
        raise LawReferenceError(f"{kind.__name__} must be an attrs class: @attrs.frozen(kw_only=True)")
    needed = [field.name for field in attrs.fields(kind) if field.init and field.default is attrs.NOTHING]
    if needed:
        given = ", ".join(f"{name}=..." for name in needed)
        raise LawReferenceError(
            f"{kind.__name__} needs {', '.join(needed)}: put an instance in the file, "
            f"law = {kind.__name__}({given}), and check {file}:law"
        )
    try:
        made: Any = kind()
    except (TypeError, ParameterError) as error:
        raise LawReferenceError(f"{kind.__name__}() cannot be made: {error}") from None
    return made


def _run(file: Path) -> ModuleType:
    """The module of a file. Raises :class:`LawReferenceError`, with the line where the file goes wrong."""
    if not file.is_file():
        raise LawReferenceError(f"there is no file {file}")
    spec = importlib.util.spec_from_file_location(file.stem, file)
    if spec is None or spec.loader is None:
        raise LawReferenceError(f"{file} is no Python file")
    module = importlib.util.module_from_spec(spec)
    path, folder = list(sys.path), str(file.resolve().parent)
    sys.path.insert(0, folder)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
        where = f"{file}:{lines[-1]}" if lines else str(file)
        raise LawReferenceError(f"{where} does not run: {type(error).__name__}: {error}") from None
    finally:
        sys.path[:] = path
    return module
