"""The record of a run: what it was made of, with what, and the key of all that decides its results."""

from __future__ import annotations

import functools
import hashlib
import inspect
import json
import linecache
import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from importlib.metadata import version
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import attrs
import numpy as np

import grainlaw
from grainlaw.arguments import floats
from grainlaw.compiler.cache import is_portable
from grainlaw.compiler.numba_private import processor
from grainlaw.conditions import StageError
from grainlaw.declared import file_of_function, written
from grainlaw.engine.model import Model
from grainlaw.engine.stepping import InstabilityError
from grainlaw.fields import ParameterError, parameters
from grainlaw.protocol import LoadingProtocol
from grainlaw.results.archive import GRAINS
from grainlaw.results.files import warn, without_nan
from grainlaw.results.tables import write_json
from grainlaw.runs.claim import RUN
from grainlaw.runs.identity import digest, sources_hash
from grainlaw.runs.progress_file import read, this_process
from grainlaw.runs.stopping import Stopped
from grainlaw.specimen import Specimen
from grainlaw.tessellation import Tessellation

FORMAT = 1  #: raise when the same run would get another key
LONGEST = 100  #: entries of an array that a record lists; of a longer one it has size, range and hash
PACKAGES = ("grainlaw", "numpy", "scipy", "numba", "llvmlite", "meshio", "attrs")


@functools.cache  # a checkpoint asks each time, and version() searches the disk
def versions() -> Mapping[str, str]:
    """Of Python and of the packages that results depend on."""
    return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}


def made_with() -> dict[str, Any]:
    """Versions, system and processor: what decides the last digits of a result."""
    name, features = processor()
    return {
        "versions": versions(),
        "platform": platform.platform(),
        "processor": name,
        "processor_features": features,
        "environment": {key: os.environ[key] for key in sorted(os.environ) if key.startswith(("NUMBA_", "GRAINLAW_"))},
    }


@functools.cache
def revision() -> str:
    """The commit of the checkout that grainlaw runs from, with "+" if files were changed since; empty for a package."""
    folder = Path(str(grainlaw.__file__)).resolve().parent.parent
    if not (folder / ".git").exists():
        return ""
    try:
        run = functools.partial(subprocess.run, cwd=folder, capture_output=True, text=True, timeout=10, check=True)
        commit = run(["git", "rev-parse", "--short=12", "HEAD"]).stdout.strip()
        changed = run(["git", "status", "--porcelain", "--untracked-files=no"]).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return ""
    return commit + ("+" if changed else "")


def described(component: Any) -> dict[str, Any]:
    """A component's type and parameters; laws or materials by phase as a mapping of them."""
    if isinstance(component, Mapping):
        return {str(key): described(entry) for key, entry in component.items()}
    return {"type": type(component).__name__, **_short(parameters(component))}


def _short(value: Any) -> Any:
    """The same, with long arrays as their size, range and hash."""
    if isinstance(value, Mapping):
        return {key: _short(entry) for key, entry in value.items()}
    if not isinstance(value, list):
        return value
    if len(value) <= LONGEST:
        return [_short(entry) for entry in value]
    try:
        array = floats(value)
    except (TypeError, ValueError):  # texts, or rows of unequal lengths
        text = json.dumps(value, default=str)
        return {"count": len(value), "sha256": hashlib.sha256(text.encode()).hexdigest()}
    least, most = float(array.min()), float(array.max())
    return {"count": len(array), "least": least, "most": most, "sha256": hashlib.sha256(array.tobytes()).hexdigest()}


def grains_hash(grains: Tessellation) -> str:
    """Hash of the polygons, their phases and bodies."""
    hasher = hashlib.sha256()
    for name in GRAINS:
        array = np.ascontiguousarray(getattr(grains, name))
        hasher.update(f"{name} {array.dtype.str} {array.shape}".encode())
        hasher.update(array.tobytes())
    hasher.update(repr((grains.phase_names, list(grains.joints))).encode())
    for edges in grains.joints.values():
        hasher.update(edges.tobytes())
    return hasher.hexdigest()


def _specimen(specimen: Specimen) -> dict[str, Any]:
    grains, boundaries = specimen.grains, sorted(specimen.mesh.boundaries)
    return {
        "grains": {"count": grains.count, "sha256": grains_hash(grains), "boundaries": boundaries},
        "material": described(specimen.material),
        "contact_points": described(specimen.contact_points),
        "refinement": specimen.refinement,
        "slits": specimen.slits,
        "tied": [str(key) for key in specimen.tied],
    }


def described_run(model: Model, protocol: LoadingProtocol, options: Mapping[str, Any]) -> dict[str, Any]:
    """What decides the results of a run, and their ``key``: its SHA-256.

    The law counts with its fingerprint, that of its compiled code, and other components of the user's own with the code
    that they reach: where only comments are edited, the run is the same.
    """
    specimen, law = model.specimen, model.laws
    judged = (protocol, specimen.material, specimen.contact_points, *options.values())  # a law is, by its fingerprint
    content = {
        "format": FORMAT,
        "engine": {"version": versions()["grainlaw"], "sources": sources_hash("cli/"), "portable": is_portable()},
        "specimen": _specimen(specimen),
        "law": described(law) | {"fingerprint": model.fingerprints},
        "protocol": described(protocol),
        "options": {name: described(value) if attrs.has(type(value)) else value for name, value in options.items()},
        "sources": {kind.__qualname__: digest(kind) for kind in _own(*judged) if isinstance(kind, type)},
        "functions": [digest(kind) for each in judged for kind in _kinds(each) if isinstance(kind, FunctionType)],
    }
    text = json.dumps(without_nan(content), sort_keys=True, default=_exact)
    key = hashlib.sha256(text.encode()).hexdigest()
    return {"key": key, **content, "sources": own_sources(law, *judged)}


def _exact(value: Any) -> Any:
    """What JSON has no word for, with all that it holds: what a component or an array prints leaves some of it away."""
    if attrs.has(type(value)):
        return described(value)
    if isinstance(value, np.ndarray):
        return _short(value.tolist())
    if isinstance(value, (set, frozenset)):
        return sorted(json.dumps(without_nan(entry), sort_keys=True, default=_exact) for entry in value)
    return repr(value)


def own_sources(*components: Any) -> dict[str, dict[str, str]]:
    """File, text and hash of the classes of the user's own among components and their parts, by class."""
    found: dict[str, dict[str, str]] = {}
    for kind in _own(*components):
        file, text = _source(kind)
        name, number = kind.__qualname__, 1
        while name in found:  # functions without a name
            name, number = f"{kind.__qualname__} {number + 1}", number + 1
        found[name] = {"file": file, "sha256": hashlib.sha256(text.encode()).hexdigest(), "source": text}
    return found


def _own(*components: Any) -> list[type | FunctionType]:
    """The classes and functions of the user's own among components and their parts."""
    every = dict.fromkeys(kind for component in components for kind in _kinds(component))
    return [kind for kind in every if kind.__module__.split(".")[0] != "grainlaw"]


def _source(kind: type | FunctionType) -> tuple[str, str]:
    """File and text of a class or function. Empty where there is none that can be read."""
    if isinstance(kind, FunctionType):
        file = file_of_function(kind)
        rows = linecache.getlines(file)[kind.__code__.co_firstlineno - 1 :]
        return file, "".join(inspect.getblock(rows)) if rows else ""
    file, lines, node = written(kind)
    if node is None:
        return "", ""
    first = min((decorator.lineno for decorator in node.decorator_list), default=node.lineno)
    return file, "".join(lines[first - 1 : node.end_lineno])


def _kinds(component: Any) -> Iterator[type | FunctionType]:
    if isinstance(component, Mapping):
        for entry in component.values():
            yield from _kinds(entry)
    elif attrs.has(type(component)):
        yield type(component)
        for field in attrs.fields(type(component)):
            yield from _kinds(getattr(component, field.name))
    elif isinstance(component, (list, tuple)):
        for entry in component:
            yield from _kinds(entry)
    elif isinstance(component, FunctionType):
        yield component


def program() -> list[str]:
    """The program that runs, and its arguments."""
    main: ModuleType | None = sys.modules.get("__main__")
    return [str(getattr(main, "__file__", None) or "interactive"), *sys.argv[1:]]


def origin() -> dict[str, Any]:
    """When, by which program and with what something is made."""
    return {
        "started": datetime.now().isoformat(timespec="seconds"),
        "program": program(),
        "grainlaw": {"version": versions()["grainlaw"], "revision": revision()},
        "made_with": made_with(),
    }


def key_of(folder: Path) -> str | None:
    """The key of the run whose record lies in a folder; None where there is none that can be read."""
    found = (read(folder / RUN) or {}).get("key")
    return found if isinstance(found, str) else None


@contextmanager
def recorded(folder: Path, content: Mapping[str, Any]) -> Iterator[None]:
    """Keep ``run.json`` in a folder: at first as running, in the end with how the run ended and what it took.

    Where the file cannot be written at the end it warns (:class:`~grainlaw.results.files.OutputWarning`).
    """
    record = {"status": "running", "process": this_process(), **origin(), **content}
    write_json(folder / RUN, record)
    began = time.monotonic()
    try:
        yield
        record["status"] = "finished"
    except BaseException as error:
        known = isinstance(error, (StageError, InstabilityError, Stopped, ParameterError, OSError))
        record["status"] = str(error) if known else f"{type(error).__name__}: {error}"
        record["stopped"] = isinstance(error, KeyboardInterrupt)
        raise
    finally:
        record["duration"] = time.monotonic() - began
        try:
            write_json(folder / RUN, record)
        except OSError as error:
            warn(f"{folder / RUN} cannot be written: {error}")
