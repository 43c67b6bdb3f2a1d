"""Checkpoints: a run between two samples as one file, from which it goes on with the same bits."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from grainlaw.engine.state import Saved
from grainlaw.fields import ParameterError, parameters
from grainlaw.integration import Integrator, Motion
from grainlaw.observation import Observer
from grainlaw.results.files import Arrays, below, grouped, write_atomically

FORMAT = 5  #: raise when a checkpoint of before could not be read any more


@attrs.define(kw_only=True)
class Counters:
    """Where a run stands."""

    stage: int = 0  #: its number
    first_sample: int = 0  #: of the stage
    pieces: int = 1  #: into which the next sample is divided, as contacts are being damaged
    without_static: int = 0  #: static stages whose loads had no static solution
    supplied: float = 1e-300  #: J, largest external work so far, or that of giving all grains the platens' speed
    seconds: float = 0.0  #: in the time loop
    finished: bool = False


@attrs.frozen(eq=False)
class SavedMoment:
    """A run between two samples: what it needs, beside its specimen, law and protocol, to go on from there."""

    state: Saved
    integrator: Integrator
    before: Motion | None  #: the motion that the integrator has seen last
    numbers: dict[str, Any]  #: counters of the run and what governs the time step, by name


@attrs.frozen(eq=False)
class Checkpoint:
    """What is in a file; the integrator as its numbers."""

    key: str  #: of all that decides the results of the run
    made_with: dict[str, Any]  #: versions and processor
    state: Saved
    integrator: dict[str, Any]
    before: Motion | None
    numbers: dict[str, Any]
    curves: Arrays
    observers: list[tuple[str, Arrays]]  #: class and record of each

    def moment(self, integrator: Integrator) -> SavedMoment:
        """The moment, with the integrator of its stage."""
        return SavedMoment(self.state, with_numbers(integrator, self.integrator), self.before, self.numbers)


def save(
    file: Path, key: str, made_with: Mapping[str, Any], moment: SavedMoment, curves: Mapping[str, np.ndarray],
    observers: Sequence[Observer],
) -> None:  # fmt: skip
    """Write a checkpoint, an uncompressed .npz without pickled objects. Raises OSError."""
    arrays: Arrays = {f"curves/{name}": values for name, values in curves.items()}
    for part, rows in moment.state.items():
        arrays |= {f"state/{part}/{name}": row for name, row in rows.items()}
    if moment.before is not None:
        arrays |= {f"before/{name}": row for name, row in attrs.asdict(moment.before, recurse=False).items()}
    for k, observer in enumerate(observers):
        arrays |= {f"observers/{k}/{name}": row for name, row in observer.save().items()}
    about = {
        "format": FORMAT, "key": key, "made_with": made_with, "numbers": moment.numbers,
        "integrator": {"type": type(moment.integrator).__name__, **parameters(moment.integrator)},
        "observers": [type(each).__name__ for each in observers],
    }  # fmt: skip
    text = json.dumps(about, default=float)
    arrays |= {"about": np.array(text), "checksum": np.array(_checksum(text, arrays))}
    write_atomically(file, lambda path: np.savez(path, allow_pickle=False, **arrays), forced=True)


def _checksum(about: str, arrays: Mapping[str, np.ndarray]) -> str:
    """Of all that is written. It tells damage, not intent: who can change the file can change it, too."""
    found = hashlib.sha256(about.encode())
    for name, row in sorted(arrays.items()):
        found.update(f"{name} {row.dtype.str} {row.shape}".encode())
        found.update(np.ascontiguousarray(row).tobytes())
    return found.hexdigest()


def load(file: Path) -> Checkpoint:
    """Read a checkpoint. Raises :class:`ParameterError` for a file that is none, OSError."""
    try:
        with np.load(file, allow_pickle=False) as stored:
            arrays = {name: stored[name] for name in stored.files}
        text, checksum = (str(arrays.pop(name, "")) for name in ("about", "checksum"))
        about = json.loads(text)
        written = about["format"]
    except OSError:
        raise
    except Exception as error:
        raise ParameterError(f"{file} is no checkpoint that can be read: {error}") from None
    if written != FORMAT:
        raise ParameterError(f"{file} has the format {written}; this version of grainlaw reads {FORMAT}")
    if checksum != _checksum(text, arrays):
        changed = "was changed after it was written (its checksum is another)"
        raise ParameterError(f"{file} {changed}: begin anew (overwrite)")
    before = below("before", arrays)
    return Checkpoint(
        key=about["key"], made_with=about["made_with"], state=grouped(below("state", arrays)),
        integrator=about["integrator"], before=Motion(**before) if before else None, numbers=about["numbers"],
        curves=below("curves", arrays),
        observers=[(name, below(f"observers/{k}", arrays)) for k, name in enumerate(about["observers"])],
    )  # fmt: skip


def with_numbers(component: Any, numbers: Mapping[str, Any]) -> Any:
    """The same component with the numbers of another, as :func:`parameters` gives them.

    Raises :class:`ParameterError` for one of another class.
    """
    kind = type(component).__name__
    if numbers["type"] != kind:
        raise ParameterError(f"the checkpoint has a {numbers['type']} where the run has a {kind}")
    values = {}
    for field in attrs.fields(type(component)):
        own = getattr(component, field.name)
        if field.init and attrs.has(type(own)):
            values[field.alias] = with_numbers(own, numbers[field.name])
        elif field.init and isinstance(own, (int, float)):
            values[field.alias] = numbers[field.name]
    return attrs.evolve(component, **values)
