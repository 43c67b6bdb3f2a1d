"""A part of a running specimen: the arrays that the compiled step sees, and what of them steps change."""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np

from grainlaw.engine.parts.imposed import Imposed
from grainlaw.stage import Load

Constant = Annotated[np.ndarray, "constant"]  #: built when the model or a stage begins
Changing = Annotated[np.ndarray, "changing"]  #: steps change it: saved and restored
Scratch = Annotated[np.ndarray, "scratch"]  #: passes write and read it within a step; not kept after it
Told = Annotated[np.ndarray, "told"]  #: passes write it for Python, which reads it after the steps; not kept
Address = Annotated[np.ndarray, "address"]  #: constant: addresses of machine code, or of arrays in memory


class Split(NamedTuple):
    """How the threads share a model: (threads + 1,) bounds of the grains of each, and of their nodes."""

    threads: int
    grain: np.ndarray
    node: np.ndarray
    alone: bool = False  #: whether a thread has points by themselves, as on a device, and not whole vectors of them


class Moment(NamedTuple):
    """When a stage begins."""

    time_step: float  #: s
    at_forces: np.ndarray  #: (2, i) m, displacement at the last forces; the present one where nothing moves


START = Moment(0.0, np.zeros((2, 0)))  #: of a part that no stage has begun


class NoRows(NamedTuple):
    """For a part that the step does not see, or that needs nothing beside the arrays of the step."""


@functools.cache
def declared(kind: Any) -> dict[str, Any]:
    """What the fields of a named tuple are declared as, by name: ``Constant``, ``Changing`` ..."""
    return get_type_hints(kind, include_extras=True)


@functools.cache
def changing(kind: Any) -> tuple[str, ...]:
    """Names of the fields of a named tuple that are declared ``Changing``."""
    return tuple(name for name, hint in declared(kind).items() if hint == Changing)


def check_names(own: Iterable[str], saved: Iterable[str]) -> None:
    """Raise ValueError unless the names are the same."""
    if differ := sorted(set(own) ^ set(saved)):
        raise ValueError(f"{', '.join(differ)} is missing, or does not belong there")


def check_row(name: str, row: np.ndarray, kind: Any, shape: tuple[int, ...]) -> None:
    """Raise ValueError for an array of another kind or shape."""
    if row.dtype != kind or row.shape != shape:
        raise ValueError(f"{name} is an array of {row.shape} {row.dtype}, it must be one of {shape} {kind}")


def check_places(name: str, row: np.ndarray, count: int) -> None:
    """Raise ValueError for a number that is no place in a list of ``count``."""
    if row.size and not 0 <= int(row.min()) <= int(row.max()) < count:
        raise ValueError(f"{name} has a number outside of 0 to {count - 1}")


class Part:
    """One part of the model: zones, bonds, a load.

    A part is a file: a named tuple of arrays whose fields are declared ``Constant``, ``Changing``, ``Scratch`` ..., the
    passes over them that the step calls, and a class that builds them from a specimen. What only Python needs is in a
    second named tuple, ``books``. The last field of ``arrays`` is ``share``, (threads + 1,) bounds of what each thread
    works on.

    A part that ``takes`` loads of some classes begins anew with each stage: ``State.begin`` asks it to ``end`` and then
    to ``begin``. What ``energy`` says less afterwards has been supplied, or lost, in stages before, and is kept.
    """

    any_length: tuple[str, ...] = ()  #: of what is saved: rows of numbers that the step does not see
    takes: tuple[type[Load], ...] = ()  #: classes of loads that it brings on the specimen
    arrays: Any = NoRows()
    books: Any = NoRows()

    def share(self, split: Split) -> np.ndarray:
        """(threads + 1,) bounds of what each thread works on; no thread has a share unless a part says otherwise."""
        return np.zeros(split.threads + 1, dtype=np.int64)

    def begin(self, imposed: Imposed, at: Moment) -> None:
        """Take up what a stage imposes from now on."""

    def energy(self, time_step: float) -> dict[str, float]:
        """J per metre of thickness by kind, at the moment of the last forces."""
        return {}

    def end(self, displacement: np.ndarray) -> dict[str, float]:
        """J by kind that ``energy`` will not count: of the last forces, which end here, on the motion since.

        Nodes are displaced by (2, i) m. See :func:`half_step_work`.
        """
        return {}

    def shared(self, split: Split) -> Any:
        """The arrays for the step."""
        return self.arrays._replace(share=self.share(split))

    def save(self) -> dict[str, np.ndarray]:
        """Copies of all that steps change, by name."""
        return {
            name: getattr(rows, name).copy() for rows in (self.arrays, self.books) for name in changing(rows.__class__)
        }

    def check_saved(self, saved: Mapping[str, np.ndarray]) -> None:
        """Raise ValueError for what ``save`` cannot have returned, as from a file that somebody has changed."""
        own = self.save()
        check_names(own, saved)
        for name, row in own.items():
            shape = saved[name].shape[:1] if name in self.any_length else row.shape
            check_row(name, saved[name], row.dtype, shape)

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Go back to what ``save`` returned. Arrays keep their place in memory unless their shape has changed."""
        for where in ("arrays", "books"):
            rows = getattr(self, where)
            other: dict[str, np.ndarray] = {}
            for name in changing(rows.__class__):
                mine, copy = getattr(rows, name), saved[name]
                if mine.shape == copy.shape:
                    mine[...] = copy
                else:
                    other[name] = copy.copy()
            if other:
                setattr(self, where, rows._replace(**other))


class PointForces(Part, ABC):
    """Forces on points: ``arrays`` have ``force_x`` and ``force_y``, ``moved_x`` and ``moved_y``, and ``work``."""

    kind, sign = "external", 1.0  #: of the energy that their work is

    @abstractmethod
    def points(self, displacement: np.ndarray) -> np.ndarray:
        """(2, n) m, how far the points have moved where nodes are displaced by (2, i) m."""

    def energy(self, time_step: float) -> dict[str, float]:
        return {self.kind: self.sign * float(self.arrays.work.sum())}

    def end(self, displacement: np.ndarray) -> dict[str, float]:
        return {self.kind: self.sign * half_step_work(self.arrays, self.points(displacement))}


def half_step_work(arrays: Any, moved: np.ndarray) -> float:
    """J, of forces that end: that of the last ones on half of the motion since, to ``moved`` (2, n) m, Eq. (11).

    Those that follow work on the other half. ``arrays`` have ``force_x`` and ``force_y``, ``moved_x`` and ``moved_y``.
    """
    way_x, way_y = moved[0] - arrays.moved_x, moved[1] - arrays.moved_y
    return 0.5 * float(np.sum(arrays.force_x * way_x + arrays.force_y * way_y))
