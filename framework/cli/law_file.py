"""A law, a material or a test of the user's own, named on the command line: FILE.py:LAW."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import os
import sys
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import attrs

from grainlaw.contact import ContactLaw
from grainlaw.fields import ParameterError
from grainlaw.material import Material
from grainlaw.messages import nearest
from grainlaw.protocol import LoadingProtocol

WORDS: dict[Any, str] = {ContactLaw: "law", Material: "material", LoadingProtocol: "test"}  #: what a file is asked for


def find_with_files(reference: str, kind: type) -> tuple[Any, list[Path]]:
    """The law, material or test of ``FILE.py:NAME``; its file, and those of its folder that it imports.

    An instance in the file, or a class that needs no parameters; a class of tests stays one, for what it needs may be
    given beside it. The file is run, as a module with its folder in the search path. Raises :class:`ParameterError`.
    """
    word = WORDS[kind]
    file, _, name = reference.rpartition(":") if ".py:" in reference else (reference, "", "")
    module, files = _run(Path(file))
    found = {key: value for key, value in vars(module).items() if not key.startswith("_") and _is(value, kind)}
    known = f"{word}s in {file}: {', '.join(found) or 'none'}"
    if not name:
        example = next(iter(found), f"My{word.capitalize()}")
        raise ParameterError(f"name the {word}, as in {file}:{example} ({known})")
    if not hasattr(module, name):
        raise ParameterError(f"there is no '{name}' in {file}{nearest(name, found, 0.3)} ({known})")
    chosen = getattr(module, name)
    if not _is(chosen, kind):
        whole = "contact law" if kind is ContactLaw else word
        raise ParameterError(f"'{name}' in {file} is no {whole} but {_described(chosen)} ({known})")
    if isinstance(chosen, type) and not attrs.has(chosen):
        raise ParameterError(f"the {word} {chosen.__name__} must be an attrs class: @attrs.frozen(kw_only=True)")
    needs_instance = isinstance(chosen, type) and kind is not LoadingProtocol
    return _made(chosen, file, word) if needs_instance else chosen, files


def _is(value: Any, kind: type) -> bool:
    return value is not kind and (issubclass(value, kind) if isinstance(value, type) else isinstance(value, kind))


def _described(value: Any) -> str:
    return f"the class {value.__name__}" if isinstance(value, type) else f"a value of type {type(value).__name__}"


def _made(kind: type[Any], file: str, word: str) -> Any:
    """An instance by defaults."""
    needed = [field.name for field in attrs.fields(kind) if field.init and field.default is attrs.NOTHING]
    if needed:
        given = ", ".join(f"{name}=..." for name in needed)
        raise ParameterError(
            f"the {word} {kind.__name__} needs {', '.join(needed)}: put an instance in the file, "
            f"{word} = {kind.__name__}({given}), and name it, {file}:{word}"
        )
    try:
        made: Any = kind()
    except (TypeError, ParameterError) as error:
        raise ParameterError(f"the {word} {kind.__name__}() cannot be made: {error}") from None
    return made


def _run(file: Path) -> tuple[ModuleType, list[Path]]:
    """The module of a file, and the files it consists of.

    Raises :class:`ParameterError`, with the line where the file goes wrong.
    """
    if not file.is_file():
        raise ParameterError(f"there is no file {file}")
    spec = importlib.util.spec_from_file_location(file.stem, file)
    if spec is None:
        raise ParameterError(f"{file} is no Python file")
    module, files = importlib.util.module_from_spec(spec), [file]
    try:
        with _helpers_of_its_own(file.resolve().parent, files):
            exec(compile(file.read_bytes(), file, "exec"), vars(module))  # never the byte code of an older file
    except (Exception, SystemExit) as error:
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(file)]
        where = f"{file}:{lines[-1]}" if lines else str(file)
        raise ParameterError(f"{where} does not run: {_said(error)}") from None
    return module, files


def _said(error: BaseException) -> str:
    if isinstance(error, SystemExit):
        return "it ends Python (sys.exit); the file is imported, what it should do when run goes below __main__"
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


@contextlib.contextmanager
def _helpers_of_its_own(folder: Path, files: list[Path]) -> Iterator[None]:
    """Import what lies in a folder as it is on disk now, and forget it afterwards; what that was is added to ``files``.

    Another file's helpers may have the same names; those of an earlier run may have been edited since.
    """
    path, writes_none = list(sys.path), sys.dont_write_bytecode
    aside = _take_out(lambda top: _hides(top, folder))
    sys.path.insert(0, str(folder))
    sys.dont_write_bytecode = True  # an edit within the second of the first import would be missed
    importlib.invalidate_caches()
    try:
        yield
    finally:
        sys.path[:], sys.dont_write_bytecode = path, writes_none
        if not _holds_installed(folder):
            helpers = _take_out(lambda top: _found_in(top) == folder)
            files += [Path(str(helper.__file__)) for helper in helpers.values() if getattr(helper, "__file__", None)]
        sys.modules.update(aside)


def _take_out(chosen: Callable[[str], bool]) -> dict[str, ModuleType]:
    """Take modules, and what lies in them, out of those that are loaded."""
    tops = {top for top in {name.partition(".")[0] for name in sys.modules} if chosen(top)}
    return {name: sys.modules.pop(name) for name in list(sys.modules) if name.partition(".")[0] in tops}


def _hides(top: str, folder: Path) -> bool:
    """Whether a loaded module would be taken for one of the folder; Python's own and installed ones may be."""
    found = _found_in(top)
    if found is None or _holds_installed(found):
        return False
    return (folder / f"{top}.py").exists() or (folder / top).is_dir()


def _holds_installed(folder: Path) -> bool:
    """Whether a folder holds Python's own modules (those in C lie in one below the others), or installed ones."""
    return _STANDARD in (folder, folder.parent) or folder.name in ("site-packages", "dist-packages")


def _found_in(top: str) -> Path | None:
    """The folder of the search path in which a loaded module or package was found, if any."""
    module = sys.modules.get(top)
    if module is None or top in ("__main__", "grainlaw"):
        return None
    places = list(getattr(module, "__path__", ()))
    file = places[0] if places else getattr(module, "__file__", None)
    return Path(file).resolve().parent if file else None


_STANDARD = Path(os.__file__).resolve().parent
